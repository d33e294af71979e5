"""Killing and resuming a generation run: ``python -m benchmarks.resume``.

``generate.py`` runs as a process of its own, is killed with SIGKILL at random moments and started again, until it has
been killed often enough; then it may finish. Its shards must equal those of uninterrupted runs with 1, 2 and 5 workers
byte for byte. The last line is one JSON object.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from artsim.dataset import file_sha256, open_dataset
from benchmarks.demo_objects import ASSETS

ROOT = ASSETS.parent
OBJECTS = [ASSETS / name for name in ("laptop", "cabinet", "eyeglasses", "dishwasher", "scissors")]


@dataclass(frozen=True)
class Options:
    """Kill and resume, and compare with uninterrupted runs."""

    rounds: int = 20
    samples: int = 12_000
    """Samples of the run; more leave more time to be killed in."""
    longest: float = 6.0
    """Longest time in seconds until a kill; the shortest is 0.2."""
    workers: tuple[int, ...] = (1, 2, 5)
    """Worker counts of the uninterrupted runs."""
    seed: int = 0


def command(out: Path, options: Options, workers: int) -> list[str]:
    """The generate command of a run."""
    objects = [str(path) for path in OBJECTS]
    return [
        sys.executable, str(ROOT / "generate.py"), "--objects", *objects, "--out", str(out),
        "--num-samples", str(options.samples), "--shard-size", "64", "--num-points", "512",
        "--workers", str(workers), "--splits", "1", "0", "0",
    ]  # fmt: skip


def digests(folder: Path) -> dict[str, str]:
    """Checksum of each shard."""
    return {path.name: file_sha256(path) for path in sorted(folder.glob("*.tar"))}


def orphans(out: Path) -> int:
    """Living processes that work on a folder."""
    found = 0
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                text = (entry / "cmdline").read_bytes()
                opened = [str(link.readlink()) for link in (entry / "fd").iterdir()]
            except OSError:
                continue  # gone meanwhile, or not ours
            found += str(out).encode() in text or any(name.startswith(str(out)) for name in opened)
    return found


def main(options: Options) -> None:
    """Run, kill, resume, compare."""
    rng = np.random.default_rng(options.seed)
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "killed"
        while_loading = while_sampling = finished_early = 0
        for number in range(options.rounds):
            process = subprocess.Popen(command(out, options, 2), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                process.wait(timeout=rng.uniform(0.2, options.longest) + 1.2)
                finished_early += 1
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
                process.wait()
                if (out / "plan.json").exists():
                    while_sampling += 1
                else:
                    while_loading += 1
            print(f"round {number}: {len(list(out.glob('*.tar')))} whole shards")
        time.sleep(2.0)
        left_running = orphans(out)
        subprocess.run(command(out, options, 2), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        killed, same = digests(out), []
        for workers in options.workers:
            whole = Path(folder) / f"workers_{workers}"
            subprocess.run(
                command(whole, options, workers), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            same.append(
                digests(whole) == killed
                and (whole / "dataset.json").read_bytes() == (out / "dataset.json").read_bytes()
            )
        indices = [sample.index for sample in open_dataset(out)]
        leftovers = [p.name for p in [*out.iterdir(), *(out / "objects").iterdir()] if p.suffix in (".part", ".jsonl")]
    result = {
        "rounds": options.rounds,
        "kills_while_loading": while_loading,
        "kills_while_sampling": while_sampling,
        "finished_early": finished_early,
        "workers_compared": list(options.workers),
        "identical": all(same),
        "lost": options.samples - len(set(indices)),
        "twice": len(indices) - len(set(indices)),
        "leftovers": leftovers,
        "orphans": left_running,
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
