"""A process that reads thousands of inputs, and says what came of them; it may crash, and is watched from outside."""

from __future__ import annotations

import faulthandler
import gc
import os
import resource
import signal
import tempfile
import time
import traceback
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

import numpy as np

from benchmarks.fuzz.corpus import Seed
from benchmarks.fuzz.inputs import Desk, Input, input_at
from benchmarks.fuzz.targets import TARGETS, fails

HEADROOM = 2 << 30
"""Bytes of address space that a worker may take beyond what its libraries take."""

SLOW_S, LARGE_MB = 2.0, 500.0
"""Processor time of one input, and memory of a worker, from which on an input is a finding."""


@dataclass
class Finding:
    """An input that ends in anything but success or an error of our own.

    Attributes
    ----------
    index : int
    sort : str
        ``raw``, ``slow``, ``large``, ``crash`` or ``hang``.
    cause : str
        What findings of one cause share.
    text : str
        Traceback, or figures.
    """

    index: int
    sort: str
    cause: str
    text: str


@dataclass
class Report:
    """What a worker found in inputs ``first`` to ``end`` (exclusive)."""

    first: int
    end: int
    slowest_s: float = 0.0
    peak_mb: float = 0.0
    findings: list[Finding] = field(default_factory=list)


def memory_mb(name: str) -> float:
    """Memory of this process, MB: ``VmRSS`` now, ``VmHWM`` at most since :func:`forget_most`."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return float(next(line.split()[1] for line in lines if line.startswith(name))) / 1024


def forget_most() -> None:
    """Let the most memory of this process be what it has now."""
    Path("/proc/self/clear_refs").write_text("5")


def warm_up(kinds: Sequence[str], corpus: Sequence[Seed], desk: Desk) -> None:
    """Read every seed once, so that imports count for no input."""
    for seed in corpus:
        if seed.kind in kinds:
            TARGETS[seed.kind].read(desk.lay_out(Input(seed, seed.files[seed.member])))


def scratch() -> Path:
    """A new folder in memory, where there is such a place."""
    shared = Path("/dev/shm")
    return Path(tempfile.mkdtemp(prefix="fuzz-", dir=shared if os.access(shared, os.W_OK) else None))


def examine(index: int, given: Input, desk: Desk) -> tuple[float, float, Finding | None]:
    """Processor time and memory of reading an input, seconds and MB; and what is wrong with it."""
    folder = desk.lay_out(given)
    forget_most()
    before, start = memory_mb("VmRSS"), time.process_time()
    error = fails(given.seed.kind, folder)
    spent, taken = time.process_time() - start, memory_mb("VmHWM") - before
    if error is not None:
        return spent, taken, Finding(index, "raw", _cause(error), "".join(traceback.format_exception(error)))
    if spent > SLOW_S:
        return spent, taken, Finding(index, "slow", f"slow {given.file_name}", f"{spent:.1f} s of processor time")
    if taken > LARGE_MB:
        return spent, taken, Finding(index, "large", f"large {given.file_name}", f"{taken:.0f} MB")
    return spent, taken, None


def _cause(error: BaseException) -> str:
    """Type of an error, and the last line of our own that it came through."""
    frames = [f for f in traceback.extract_tb(error.__traceback__) if "/benchmarks/fuzz/" not in f.filename]
    own = [f for f in frames if "/artsim/" in f.filename or "/artperl/" in f.filename]
    where = (own or frames)[-1] if frames else None
    return type(error).__name__ + (f" {Path(where.filename).name}:{where.lineno}" if where else "")


def work(
    seed: int,
    kinds: Sequence[str],
    corpus: Sequence[Seed],
    pipe: Connection,
    current: Synchronized[int],
    log: Path,
    root: Path,
) -> None:
    """Take ranges of inputs from a pipe and answer with reports, until there is None."""
    with log.open("a") as file:
        os.dup2(file.fileno(), 1)  # libraries print what they think of a file
        os.dup2(file.fileno(), 2)
        faulthandler.enable(file)
        faulthandler.register(signal.SIGUSR1, file)
        warnings.simplefilter("ignore")
        np.seterr(all="ignore")
        desk = Desk(root)
        warm_up(kinds, corpus, desk)
        gc.freeze()
        held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (held + HEADROOM, held + HEADROOM))
        while (wanted := pipe.recv()) is not None:
            report = Report(*wanted)
            for index in range(*wanted):
                given = input_at(seed, index, kinds, corpus)
                current.value = index
                spent, taken, finding = examine(index, given, desk)
                report.slowest_s, report.peak_mb = max(report.slowest_s, spent), max(report.peak_mb, taken)
                if finding is not None:
                    report.findings.append(finding)
            current.value = -1
            pipe.send(report)
