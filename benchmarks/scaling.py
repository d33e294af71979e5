"""What a sample costs with one process, with two, and on Ray: ``python -m benchmarks.scaling``.

The same dataset is generated each way, by a process of its own. The processor time of all processes of a run is added
up, so that other work on the machine does not count; that of Ray's own services, which do no task, is told apart, and
so is the time before the first shard, in which processes and Ray start. All ways take turns; the median cost of each
counts. The last line is one JSON object.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import NamedTuple

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
    ways: tuple[str, ...] = ("workers 1", "workers 2", "ray local")
    """An option of `generate.py` and its value."""
    rounds: int = 3
    """Turns that each way has."""


@dataclass(frozen=True)
class Cost:
    """Of the run after its first shard: processor seconds and seconds for each 1,000 samples; and before it."""

    processor: float
    services: float
    """Part of `processor` that Ray's services took."""
    seconds: float
    start_processor: float
    start_seconds: float


def main(options: Options) -> None:
    """Run every way, and compare the bytes."""
    costs: dict[str, list[Cost]] = {way: [] for way in options.ways}
    seen = set()
    for way in options.ways * options.rounds:
        with tempfile.TemporaryDirectory() as name:
            out = Path(name) / "made"
            cost = measure(out, options, way.split())
            seen.add(tuple(file_sha256(path) for path in sorted(out.glob("*.tar"))))
        costs[way].append(cost)
        print(
            f"{way:<14} {cost.processor:.2f} processor s ({cost.services:.2f} of them of services) and "
            f"{cost.seconds:.2f} s for 1,000 samples; before the first shard {cost.start_processor:.1f} and "
            f"{cost.start_seconds:.1f} s",
            flush=True,
        )
    result = {
        way: {
            field.name: round(statistics.median(getattr(cost, field.name) for cost in found), 3)
            for field in fields(Cost)
        }
        for way, found in costs.items()
    }
    print(json.dumps({"same_bytes": len(seen) == 1, **result}))


def measure(out: Path, options: Options, way: Sequence[str]) -> Cost:
    """Generate, and add up what all processes took."""
    command = [
        sys.executable, str(ASSETS.parent / "generate.py"), "--categories", "laptop", "drawer", "dishwasher",
        "--objects-per-category", "16", "--num-samples", str(options.samples), "--num-points", str(options.num_points),
        "--shard-size", str(options.shard_size), "--out", str(out), f"--{way[0]}", *way[1:],
    ]  # fmt: skip
    mark, start, quiet = uuid.uuid4().hex, time.perf_counter(), subprocess.DEVNULL
    process = subprocess.Popen(command, env={**os.environ, "ARTSIM_BENCHMARK_RUN": mark}, stdout=quiet, stderr=quiet)
    used = dict[int, Used]()
    looks: list[tuple[int, float, float, float]] = []
    """Shards, seconds, processor seconds and those of services, whenever there are more shards."""
    while process.poll() is None:
        used |= processor_seconds(mark)
        made = len(list(out.glob("*.tar")))
        if made > (looks[-1][0] if looks else 0):
            services = sum(each.seconds for each in used.values() if each.service)
            looks.append((made, time.perf_counter() - start, sum(each.seconds for each in used.values()), services))
        time.sleep(_EVERY)
    if process.returncode != 0 or len(looks) < 2:
        raise RuntimeError(f"generate.py {' '.join(way)} ended with exit code {process.returncode}")
    first, last = looks[0], looks[-1]
    thousands = options.shard_size * (last[0] - first[0]) / 1000
    seconds, processor, services = ((last[k] - first[k]) / thousands for k in (1, 2, 3))
    return Cost(processor, services, seconds, first[2], first[1])


class Used(NamedTuple):
    """Processor seconds of a process, and whether it is one of Ray's services."""

    seconds: float
    service: bool


def processor_seconds(mark: str) -> dict[int, Used]:
    """What every process of a marked run has used so far."""
    found = {}
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and mark.encode() in (entry / "environ").read_bytes():
                times = (entry / "stat").read_text().rpartition(")")[2].split()
                name = (entry / "cmdline").read_bytes()
                # Its workers call themselves ray::TASK; its services are programs and scripts in its package.
                service = b"/ray/" in name and not name.startswith(b"ray::")
                found[int(entry.name)] = Used((int(times[11]) + int(times[12])) / _TICKS, service)
        except OSError:
            continue  # gone meanwhile
    return found


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
