"""Long runs of ``generate.py``, watched: ``python -m benchmarks.runs``.

The same dataset is made by one process, by two, and on Ray. Several times a second, the processor time, memory and open
files of all processes of a run are read, and how many shards there are. Printed are the processor time and the time of
1,000 samples from the first shard on, memory and files in the second and in the last fifth of the run, and what is left
that should not be. All ways must make the same bytes. The last line is one JSON object.
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
import tyro

from artsim.common.files import file_sha256

ROOT = Path(__file__).resolve().parents[1]
_EVERY = 0.5
"""Seconds between two looks: each takes some milliseconds of a core that the run wants."""


@dataclass(frozen=True)
class Options:
    """Watch runs."""

    samples: int = 40_000
    """200,000 for a long one."""
    num_points: int = 2048
    shard_size: int = 256
    categories: tuple[str, ...] = ("laptop", "drawer", "dishwasher")
    objects_per_category: int = 16
    ways: tuple[str, ...] = ("workers 1", "workers 2", "ray local")
    """An option of `generate.py` and its value."""
    rounds: int = 1
    """Turns that each way has; of figures the median counts."""


@dataclass(frozen=True)
class Look:
    """What was seen at a moment, of all processes together: seconds, bytes in memory, open files."""

    seconds: float
    shards: int
    processor: float
    memory: int
    files: int


def main(options: Options) -> None:
    """Run every way, and compare the bytes."""
    rows: dict[str, list[dict[str, Any]]] = {way: [] for way in options.ways}
    digests = set()
    for way in options.ways * options.rounds:
        with tempfile.TemporaryDirectory() as name:
            out = Path(name) / "made"
            looks = watch(command(out, options, way), out)
            digests.add(tuple(file_sha256(path) for path in sorted(out.glob("*.tar"))))
            left = sorted(path.name for pattern in (".*.part", "objects/.*.part", ".parts/*")
                          for path in out.glob(pattern))  # fmt: skip
        rows[way].append(figures(looks, options.shard_size) | {"left_over": len(left)})
        print(f"{way:<12} {rows[way][-1]} {' '.join(left)}", flush=True)
    result = {way: {name: statistics.median(row[name] for row in own) for name in own[0]} for way, own in rows.items()}
    print(json.dumps({"samples": options.samples, "same_bytes": len(digests) == 1, **result}))


def command(out: Path, options: Options, way: str) -> list[str]:
    """What makes the dataset in one way."""
    return [
        sys.executable, str(ROOT / "generate.py"), "--categories", *options.categories, "--objects-per-category",
        str(options.objects_per_category), "--num-samples", str(options.samples), "--num-points",
        str(options.num_points), "--shard-size", str(options.shard_size), "--out", str(out), *f"--{way}".split(),
    ]  # fmt: skip


def watch(words: Sequence[str], out: Path) -> list[Look]:
    """Looks at a run from its first shard until it ends, which must be a success."""
    process = psutil.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    start, looks = time.perf_counter(), []
    used: dict[int, float] = {}
    while process.poll() is None:
        memory = files = 0
        with suppress(psutil.Error):
            for own in [process, *process.children(recursive=True)]:
                with suppress(psutil.Error), own.oneshot():
                    times = own.cpu_times()
                    used[own.pid] = times.user + times.system
                    memory, files = memory + own.memory_info().rss, files + own.num_fds()
        shards = len(list(out.glob("*.tar")))
        looks.append(Look(time.perf_counter() - start, shards, sum(used.values()), memory, files))
        time.sleep(_EVERY)
    looks = [look for look in looks if look.shards]
    if process.returncode != 0 or len(looks) < 2:
        raise RuntimeError(f"{' '.join(words)} ended with exit code {process.returncode} after {len(looks)} looks")
    return looks


def figures(looks: Sequence[Look], shard_size: int) -> dict[str, float]:
    """Seconds for 1,000 samples, MB and files."""
    first, last = looks[0], looks[-1]
    thousands = shard_size * max(1, last.shards - first.shards) / 1000
    found = {
        "processor_s": (last.processor - first.processor) / thousands,
        "seconds": (last.seconds - first.seconds) / thousands,
        "start_processor_s": first.processor,
        "start_seconds": first.seconds,
    }
    for name, number in (("early", 1), ("late", 4)):
        own = [look for look in looks if number <= 5 * look.shards // last.shards <= number + number // 4] or [last]
        found |= {f"{name}_mb": statistics.mean(look.memory for look in own) / 1e6}
        found |= {f"{name}_files": max(look.files for look in own)}
    return {name: round(value, 3) for name, value in found.items()}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
