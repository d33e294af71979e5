"""Killing and resuming a generation run: ``python -m benchmarks.resume``.

``generate.py`` runs as a process of its own, is killed with SIGKILL at random moments and started again at once, while
its orphaned workers may still be busy. Then it may finish. Its shards must equal those of uninterrupted runs with 1, 2
and 5 workers byte for byte. The last line is one JSON object.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import tempfile
import time
import uuid
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from artsim.common.files import file_sha256
from benchmarks.demo_objects import ASSETS

ROOT = ASSETS.parent
DEMO = tuple(ASSETS / name for name in ("laptop", "cabinet", "eyeglasses", "dishwasher", "scissors"))


@dataclass(frozen=True)
class Options:
    """Kill and resume, and compare with uninterrupted runs."""

    rounds: int = 20
    objects: tuple[Path, ...] = DEMO
    """URDF files, object folders, or folders of them."""
    samples: int = 40_000
    """Samples of the run; more leave more time to be killed in."""
    longest: float = 3.0
    """Longest time in seconds from the start of sampling until the kill."""
    workers: tuple[int, ...] = (1, 2, 5)
    """Worker counts of the uninterrupted runs."""
    seed: int = 0


class Run:
    """One process of ``generate.py``."""

    def __init__(self, out: Path, options: Options, workers: int, mark: str = ""):
        command = [
            sys.executable, str(ROOT / "generate.py"), "--objects", *map(str, options.objects), "--out", str(out),
            "--num-samples", str(options.samples), "--shard-size", "64", "--num-points", "512",
            "--workers", str(workers),
        ]  # fmt: skip
        environment = {**os.environ, "ARTSIM_BENCHMARK_RUN": mark}
        quiet = subprocess.DEVNULL
        self.process = subprocess.Popen(command, env=environment, stdout=quiet, stderr=quiet)

    def wait_for_change(self, path: Path, before: int) -> None:
        """Until a file was written after that moment, or the process has ended."""
        while self.process.poll() is None and written(path) == before:
            time.sleep(0.005)

    def kill(self) -> bool:
        """SIGKILL, to this process alone; whether it was still alive."""
        alive = self.process.poll() is None
        self.process.kill()
        self.process.wait()
        return alive

    def finish(self) -> None:
        """Wait for its end, which must be a success."""
        if self.process.wait() != 0:
            raise RuntimeError(f"generate.py ended with exit code {self.process.returncode}")


def written(path: Path) -> int:
    """When a file was last written, 0 if it is not there."""
    return path.stat().st_mtime_ns if path.exists() else 0


def living(mark: str) -> int:
    """How many processes of a marked run there are, workers included."""
    found = 0
    for entry in Path("/proc").iterdir():
        try:
            found += entry.name.isdigit() and mark.encode() in (entry / "environ").read_bytes()
        except OSError:
            continue  # gone meanwhile
    return found


def digests(folder: Path) -> dict[str, str]:
    """Checksum of everything that belongs to a dataset."""
    files = [*folder.glob("*.tar"), *folder.glob("objects/*"), folder / "dataset.json", folder / "plan.json"]
    return {path.relative_to(folder).as_posix(): file_sha256(path) for path in files}


def sample_counts(folder: Path) -> Counter[str]:
    """How often each sample is there, by the names in the tar files themselves."""
    counts: Counter[str] = Counter()
    for path in folder.glob("*.tar"):
        with tarfile.open(path) as tar:
            counts.update(name[: -len(".json")] for name in tar.getnames() if name.endswith(".json"))
    return counts


def main(options: Options) -> None:
    """Run, kill, resume, compare."""
    rng = np.random.default_rng(options.seed)
    mark = uuid.uuid4().hex
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "killed"
        while_loading = while_sampling = finished_early = 0
        for number in range(options.rounds):
            before = written(out / "progress.jsonl")
            run = Run(out, options, 2, mark)
            # A fifth of the kills while objects are loaded, the others at any time after shards are begun.
            if number < options.rounds // 5:
                run.wait_for_change(out / "objects", 0)
                time.sleep(rng.uniform(0.0, 0.5))
            else:
                run.wait_for_change(out / "progress.jsonl", before)
                time.sleep(rng.uniform(0.0, options.longest))
            if not run.kill():
                finished_early += 1
            elif (out / "plan.json").exists():
                while_sampling += 1
            else:
                while_loading += 1
            print(f"round {number}: {len(list(out.glob('*.tar')))} whole shards", flush=True)
        killed_at = time.perf_counter()
        while living(mark) and time.perf_counter() - killed_at < 60:
            time.sleep(0.05)
        orphans_lived = time.perf_counter() - killed_at
        Run(out, options, 2).finish()
        same = []
        for workers in options.workers:
            whole = Path(folder) / f"workers_{workers}"
            Run(whole, options, workers).finish()
            same.append(digests(whole) == digests(out))
            print(f"{workers} workers: {'the same bytes' if same[-1] else 'DIFFERENT BYTES'}", flush=True)
        counts = sample_counts(out)
        known = {".lock", ".sources.json", "objects", "plan.json", "dataset.json"}
        leftovers = sorted({p.name for p in out.iterdir() if p.suffix != ".tar"} - known)
    result = {
        "rounds": options.rounds,
        "kills_during_objects": while_loading,
        "kills_during_samples": while_sampling,
        "finished_early": finished_early,
        "identical": all(same),
        "lost": sum(f"{index:09d}" not in counts for index in range(options.samples)),
        "twice": sum(count > 1 for count in counts.values()),
        "workers_compared": list(options.workers),
        "leftovers": leftovers,
        "seconds_orphans_lived": round(orphans_lived, 2),
    }
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
