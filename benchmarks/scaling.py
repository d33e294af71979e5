"""What a sample costs with one process, with two, and on Ray: ``python -m benchmarks.scaling``.

The same dataset is generated each way, by a process of its own. The processor time of all processes of a run is added
up, Ray's own among them, so that other work on the machine does not count. The time before the first shard, in which
processes and Ray start, is told apart. All ways take turns; the least cost of each counts, since a slow minute of the
machine only adds. The last line is one JSON object.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import tyro

from artsim.common.files import file_sha256
from benchmarks.demo_objects import ASSETS

_TICKS = os.sysconf("SC_CLK_TCK")
_EVERY = 0.5
"""Seconds between two looks: each takes some milliseconds of a core that the run wants."""


@dataclass(frozen=True)
class Options:
    """Measure processor time of a sample, each way."""

    samples: int = 40_000
    num_points: int = 2048
    shard_size: int = 256
    ways: tuple[str, ...] = ("--workers 1", "--workers 2", "--ray local")
    rounds: int = 1
    """Turns that each way has."""


@dataclass(frozen=True)
class Cost:
    """Of the run after its first shard: processor seconds and seconds for each 1,000 samples; and before it."""

    processor: float
    seconds: float
    start_processor: float
    start_seconds: float


def main(options: Options) -> None:
    """Run every way, and compare the bytes."""
    result, seen = dict[str, list[float]](), set()
    for way in options.ways * options.rounds:
        with tempfile.TemporaryDirectory() as name:
            out = Path(name) / "made"
            cost = measure(out, options, way.split())
            seen.add(tuple(file_sha256(path) for path in sorted(out.glob("*.tar"))))
        print(
            f"{way:<14} {cost.processor:.2f} processor s and {cost.seconds:.2f} s for 1,000 samples; before the first "
            f"shard {cost.start_processor:.1f} and {cost.start_seconds:.1f} s",
            flush=True,
        )
        figures = [round(cost.processor, 3), round(cost.seconds, 3), round(cost.start_processor, 1)]
        result[way] = [min(pair) for pair in zip(figures, result.get(way, figures), strict=True)]
    print(json.dumps({"same_bytes": len(seen) == 1, **result}))


def measure(out: Path, options: Options, way: Sequence[str]) -> Cost:
    """Generate, and add up what all processes took."""
    command = [
        sys.executable, str(ASSETS.parent / "generate.py"), "--categories", "laptop", "drawer", "dishwasher",
        "--objects-per-category", "16", "--num-samples", str(options.samples), "--num-points", str(options.num_points),
        "--shard-size", str(options.shard_size), "--out", str(out), *way,
    ]  # fmt: skip
    mark, start, used = uuid.uuid4().hex, time.perf_counter(), dict[int, float]()
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(command, env={**os.environ, "ARTSIM_BENCHMARK_RUN": mark}, stdout=quiet, stderr=quiet)
    first: tuple[float, float, int] | None = None
    last = (0.0, 0.0, 0)
    while process.poll() is None:
        used |= processor_seconds(mark)
        made = len(list(out.glob("*.tar")))
        last = (time.perf_counter() - start, sum(used.values()), made) if made > last[2] else last
        if first is None and made:
            first = last
        time.sleep(_EVERY)
    if process.returncode != 0 or first is None:
        raise RuntimeError(f"generate.py {' '.join(way)} ended with exit code {process.returncode}")
    thousands = options.shard_size * (last[2] - first[2]) / 1000
    return Cost((last[1] - first[1]) / thousands, (last[0] - first[0]) / thousands, first[1], first[0])


def processor_seconds(mark: str) -> dict[int, float]:
    """Processor seconds so far of every process of a marked run."""
    found = {}
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and mark.encode() in (entry / "environ").read_bytes():
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
                found[int(entry.name)] = (int(fields[11]) + int(fields[12])) / _TICKS
        except OSError:
            continue  # gone meanwhile
    return found


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
