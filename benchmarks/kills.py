"""Killing programs and starting them again: ``python -m benchmarks.kills``.

Each program runs once undisturbed. Then it is begun in another folder, killed with SIGKILL again and again at random
moments, its orphans still busy as it begins again, and may finish. What it leaves must be the same, byte for byte: no
file less, none more. One line for each program; the last line is one JSON object.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from artsim.common.files import file_sha256, write_atomic

ROOT = Path(__file__).resolve().parents[1]
_DEMO = [str(ROOT / "urdf_assets" / name) for name in ("laptop", "cabinet", "eyeglasses", "dishwasher", "scissors")]
_TINY: dict[str, Any] = {
    "categories": ["laptop"],
    "base_objects": 4,
    "test_objects": 2,
    "validation_views": 1,
    "foreign_categories": 1,
    "box_views": 0,
}
_RECIPES = {
    "full": {"perception_steps": 100, "dense_steps": 50, "validate_every": 50},
    "artperl": {"perception_steps": 40, "retrieval_steps": 40, "agent_rollouts": 10, "validate_every": 10},
    "ancsh": {"perception_steps": 100, "validate_every": 50},
    "omad": {"prior_steps": 50, "perception_steps": 80, "validate_every": 50},
}  # fmt: skip
"""Trainings of some seconds, by method."""
PROGRAMS = {
    "generate": ["generate.py", "--objects", *_DEMO, "--num-samples", "40000", "--shard-size", "64",
                 "--num-points", "512"],
    "generate, PartNet-Mobility": ["generate.py", "--objects", os.environ.get("ARTSIM_PARTNET_DIR", ""),
                                   "--skip-broken", "--num-samples", "2000"],
    **{f"train {method}": ["train.py", "--recipe", f"{method}.json"] for method in _RECIPES},
}  # fmt: skip
_TIMES = {"seconds.json", "table.txt"}
"""Files that tell how long a run took."""


@dataclass(frozen=True)
class Options:
    """Kill, go on, and compare."""

    programs: tuple[str, ...] = tuple(PROGRAMS)
    """Which of them."""
    kills: int = 10
    workers: int = 2
    seed: int = 0


def started(program: str, out: Path, workers: int) -> subprocess.Popen[bytes]:
    """The process of a program that writes a folder."""
    script, *options = PROGRAMS[program]
    for method, own in _RECIPES.items():
        recipe = {"preset": "quick", "options": {"method": method, **_TINY}, "lengths": own}
        write_atomic(out.parent / f"{method}.json", json.dumps(recipe).encode())
    command = [sys.executable, str(ROOT / script), *options, "--workers", str(workers), "--out", str(out)]
    return subprocess.Popen(command, cwd=out.parent, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def finish(program: str, out: Path, workers: int) -> float:
    """Seconds until a program has come to its end."""
    start = time.perf_counter()
    process = started(program, out, workers)
    _, errors = process.communicate()
    if process.returncode:
        raise RuntimeError(f"{program} ended with exit code {process.returncode}: {errors.decode()[-2000:]}")
    return time.perf_counter() - start


def digests(folder: Path) -> dict[str, str]:
    """Checksum of every file but curves, pictures and locks, and those that tell times."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name not in _TIMES)
    kept = {
        path.relative_to(folder).as_posix(): path for path in files if path.suffix not in {".png", ".html", ".lock"}
    }
    return {
        name: _timeless(path) if path.suffix == ".json" else file_sha256(path)
        for name, path in sorted(kept.items())
        if not name.startswith("events/") and path.name != ".lock"
    }


def _timeless(path: Path) -> str:
    """A document without the times of estimates."""
    return "".join(part for part in path.read_text().split(",") if "ms_per_instance" not in part)


def main(options: Options) -> None:
    """Run, kill, go on, compare."""
    rng, rows = np.random.default_rng(options.seed), []
    for program in options.programs:
        with tempfile.TemporaryDirectory() as folder:
            straight, out = Path(folder) / "straight", Path(folder) / "killed"
            longest = finish(program, straight, options.workers)
            kills = 0
            for _ in range(options.kills):
                process = started(program, out, options.workers)
                try:
                    process.wait(rng.uniform(0.0, 2.0 * longest / options.kills))
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
                    kills += 1
            finish(program, out, options.workers)
            one, other = digests(straight), digests(out)
            differ = sorted(name for name in one.keys() | other.keys() if one.get(name) != other.get(name))
        rows.append({"program": program, "seconds": round(longest, 1), "kills": kills, "differ": differ})
        print(f"{program}: {kills} kills, {'the same bytes' if not differ else ', '.join(differ)}", flush=True)
    print(json.dumps(rows))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
