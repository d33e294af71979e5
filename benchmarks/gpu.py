"""All that a GPU changes, in one command: ``make gpu``, or ``python -m benchmarks.gpu``.

Slices of less than ten minutes run one after the other, each in a process of its own: the tests marked gpu, parity of
the processor and the GPU among them; renderers, one view at a time and many at once, with ManiSkill's camera beside
them; training and estimation. Each leaves its output and, where its last line is JSON, that line, in a file of OUT. A
slice that has its file is not run again. The last line is one JSON object.
"""

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from artsim.common.extras import require_extra
from artsim.common.files import write_atomic
from artsim.errors import ConfigError

_TRAIN = (
    "import json, time, torch\n"
    "from pathlib import Path\n"
    "from tempfile import TemporaryDirectory\n"
    "from artperl.training.options import PRESETS, changed\n"
    "from artperl.training.run import Training\n"
    "start, seen = time.perf_counter(), []\n"
    "def report(group, figures, step):\n"
    "    if group == 'perception': seen.append(time.perf_counter())\n"
    "options = changed(PRESETS['long'], {'perception_steps': 300, 'dense_steps': 0, 'box_views': 0,\n"
    "                                    'validate_every': 300, 'test_objects': 4, 'foreign_categories': 1})\n"
    "with TemporaryDirectory() as out:\n"
    "    figures = Training(options, Path(out), WORKERS, progress=False, report=report, device='DEVICE').run()\n"
    "print(json.dumps({'steps_per_s': 200 / (seen[299] - seen[99]), 'device': 'DEVICE', 'workers': WORKERS}))\n"
)

_WORKERS = str(max(1, (os.cpu_count() or 1) - 1))
_ESTIMATE = (
    "import json, time\n"
    "import artperl, artsim\n"
    "from artsim.datasets.sample_options import SampleOptions, draw_sample\n"
    "from artsim.renderers import make_renderer\n"
    "laptop, renderer = artsim.make('laptop', 2_000_001), make_renderer('raycast')\n"
    "clouds = [draw_sample(laptop, SampleOptions(), 0, i, renderer).points for i in range(24)]\n"
    "def seconds(device):\n"
    "    estimate = artperl.load_estimator('laptop', device=device)\n"
    "    for cloud in clouds[:4]: estimate(cloud)\n"
    "    start = time.perf_counter()\n"
    "    for cloud in clouds[4:]: estimate(cloud)\n"
    "    return (time.perf_counter() - start) / 20\n"
    "print(json.dumps({'s_per_estimate': {device: seconds(device) for device in ('cpu', 'cuda')}}))\n"
)

SLICES: dict[str, list[str]] = {
    "tests": ["-m", "pytest", "-q", "-m", "gpu"],
    "doctor": ["-c", "import sys; sys.argv[1:] = ['doctor']; from artsim.commands.verbs import main; main()"],
    "renderers": ["-m", "benchmarks.renderers"],
    "estimation": ["-c", _ESTIMATE],
    "training_gpu": ["-c", _TRAIN.replace("DEVICE", "cuda").replace("WORKERS", _WORKERS)],
    "training_cpu": ["-c", _TRAIN.replace("DEVICE", "cpu").replace("WORKERS", _WORKERS)],
}
"""What is run, by name."""


@dataclass(frozen=True)
class Options:
    """Run the slices."""

    out: Path = Path("out/gpu")
    """Folder of the results."""
    slices: tuple[str, ...] = tuple(SLICES)
    limit: float = 600.0
    """Seconds that a slice may take."""
    without: bool = False
    """Run them on a machine without a GPU, too, to try the slices themselves."""


def main(options: Options) -> None:
    """Run every slice that has no result yet."""
    unknown = sorted(set(options.slices) - SLICES.keys())
    if unknown:
        raise ConfigError(f"there is no slice {unknown[0]!r}", "slices", f"use {', '.join(SLICES)}")
    device = _device()
    if device is None and not options.without:
        raise ConfigError("torch finds no GPU here", fix="run make gpu on a machine with one; --without tries it here")
    results: dict[str, Any] = {"device": device}
    for name in options.slices:
        file = options.out / f"{name}.json"
        if not file.exists():
            write_atomic(file, (json.dumps(run(name, options.limit), indent=1) + "\n").encode())
        results[name] = json.loads(file.read_text())
        print(f"{name}: {results[name]['ended']} after {results[name]['seconds']} s", flush=True)
    print(json.dumps({name: result.get("figures") if isinstance(result, dict) else result
                      for name, result in results.items()}))  # fmt: skip


def run(name: str, limit: float) -> dict[str, Any]:
    """One slice: how it ended, its last lines, and its figures."""
    start = time.perf_counter()
    try:
        done = subprocess.run([sys.executable, *SLICES[name]], capture_output=True, text=True, timeout=limit)
        ended, output = ("well" if done.returncode == 0 else f"with exit code {done.returncode}"), done.stdout
        errors = done.stderr
    except subprocess.TimeoutExpired as late:
        ended, output, errors = "at its limit of time", _text(late.stdout), _text(late.stderr)
    lines = output.strip().splitlines()
    try:
        figures = json.loads(lines[-1])
    except (IndexError, ValueError):
        figures = None
    return {
        "ended": ended, "seconds": round(time.perf_counter() - start), "figures": figures, "output": lines[-60:],
        "errors": [] if ended == "well" else errors.strip().splitlines()[-20:],
    }  # fmt: skip


def _text(data: bytes | str | None) -> str:
    return data.decode(errors="replace") if isinstance(data, bytes) else data or ""


def _device() -> str | None:
    """What torch calls the GPU."""
    with require_extra("speed on a GPU"):
        import torch
    return str(torch.cuda.get_device_name()) if torch.cuda.is_available() else None


if __name__ == "__main__":
    try:
        main(tyro.cli(Options, description=__doc__))
    except ConfigError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
