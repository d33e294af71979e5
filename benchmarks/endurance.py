"""A long generation run, watched: ``python -m benchmarks.endurance``.

``generate.py`` runs as a process of its own. Every second, the memory and the open files of it and of its workers are
read, and how many shards there are. Memory, files and rate of the last fifth of the run are compared with those of the
second one. No temporary file may be left. The last line is one JSON object.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from benchmarks.demo_objects import ASSETS

_EVERY = 1.0
"""Seconds between two looks."""


@dataclass(frozen=True)
class Options:
    """Watch a long run."""

    samples: int = 200_000
    num_points: int = 512
    shard_size: int = 256
    workers: int = 2
    objects_per_category: int = 40
    categories: tuple[str, ...] = ("laptop", "drawer", "eyeglasses", "dishwasher", "scissors")


@dataclass(frozen=True)
class Look:
    """What was seen at a moment: bytes in memory and open files of all processes together."""

    seconds: float
    shards: int
    memory: int
    files: int


def main(options: Options) -> None:
    """Run and watch."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "long"
        command = [
            sys.executable, str(ASSETS.parent / "generate.py"), "--categories", *options.categories,
            "--objects-per-category", str(options.objects_per_category), "--num-samples", str(options.samples),
            "--num-points", str(options.num_points), "--shard-size", str(options.shard_size),
            "--workers", str(options.workers), "--out", str(out),
        ]  # fmt: skip
        looks = watch(command, out)
        left = [path.name for pattern in (".*.part", "objects/.*.part", "objects/_*") for path in out.glob(pattern)]
        left += ["progress.jsonl"] if (out / "progress.jsonl").exists() else []
        size = sum(path.stat().st_size for path in out.glob("*.tar"))
    early, late = fifth(looks, 1), fifth(looks, 4)
    result = {
        "samples": options.samples,
        "seconds": round(looks[-1].seconds),
        "gigabytes": round(size / 1e9, 2),
        **{f"{name}_{what}": value for name, looked in (("early", early), ("late", late))
           for what, value in figures(looked, options.shard_size).items()},
        "left_over": left,
    }  # fmt: skip
    print(json.dumps(result))


def watch(command: Sequence[str], out: Path) -> list[Look]:
    """Looks at a run until it ends, which must be a success."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    start, looks = time.perf_counter(), []
    while process.poll() is None:
        family = [process.pid, *children(process.pid)]
        shards = len(list(out.glob("*.tar")))
        looks.append(Look(time.perf_counter() - start, shards, sum(map(memory, family)), sum(map(files, family))))
        time.sleep(_EVERY)
    if process.returncode != 0:
        raise RuntimeError(f"generate.py ended with exit code {process.returncode}")
    return [look for look in looks if look.shards]


def fifth(looks: Sequence[Look], number: int) -> Sequence[Look]:
    """The looks of a fifth of the run, by its shards."""
    most = looks[-1].shards
    return [look for look in looks if number * most <= 5 * look.shards < (number + 1) * most] or looks[-2:]


def figures(looks: Sequence[Look], shard_size: int) -> dict[str, float]:
    """Mean memory in MB, most open files, samples a second."""
    shards, seconds = looks[-1].shards - looks[0].shards, looks[-1].seconds - looks[0].seconds
    return {
        "mb": round(float(np.mean([look.memory for look in looks])) / 1e6, 1),
        "files": max(look.files for look in looks),
        "samples_per_s": round(shard_size * shards / max(seconds, 1e-9), 1),
    }


def children(parent: int) -> list[int]:
    """Processes that a process has started."""
    try:
        return [int(pid) for pid in Path(f"/proc/{parent}/task/{parent}/children").read_text().split()]
    except OSError:
        return []


def memory(pid: int) -> int:
    """Resident bytes of a process; 0 once it is gone."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):
        return 0


def files(pid: int) -> int:
    """Open files of a process; 0 once it is gone."""
    try:
        return len(list(Path(f"/proc/{pid}/fd").iterdir()))
    except OSError:
        return 0


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
