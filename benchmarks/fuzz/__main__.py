"""Reading mutated files by the million: ``python -m benchmarks.fuzz --runs 1000000``.

Input i depends on (seed, i) and the kinds alone. Whatever ends in anything but success or an ``ArtsimError`` is a
finding: its file lies in ``found`` under the output folder, and ``--replay FILE`` reads it again. Stop it at any
moment: the same command goes on. The last line is one JSON object; the program ends with 1 when there is any finding.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

import tyro

from artsim.common.files import read_json, write_atomic
from artsim.common.names import safe_name
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError
from benchmarks.fuzz.corpus import corpus
from benchmarks.fuzz.inputs import Desk, input_at, input_of
from benchmarks.fuzz.targets import TARGETS
from benchmarks.fuzz.worker import Finding, Report, examine, scratch, work

CHUNK = 1000
"""Inputs between two notes of how far a run is."""

HANG_S = 10.0
"""Seconds of processor time after which an input hangs."""

STILL_S = 120.0
"""Seconds after which one hangs that takes no processor time: a busy machine may hold a worker up for some."""

START_S = 180.0
"""Seconds in which a worker must have read its first input: it makes the seeds, and imports what reads them."""

KEPT = 5
"""Findings of one cause whose files are kept."""


@dataclass(frozen=True)
class Options:
    """Feed mutated files of every kind to what reads them."""

    runs: int = 100_000
    """Inputs in all, those of an earlier call with the same folder included."""
    workers: int = 2
    """Processes."""
    kinds: tuple[str, ...] = tuple(TARGETS)
    """Kinds of files."""
    seed: int = 0
    out: Path = Path("out/fuzz")
    """Folder of findings and of how far the run is."""
    replay: Path | None = None
    """Read one stored input again, and print what comes of it."""

    def __post_init__(self) -> None:
        unknown = sorted(set(self.kinds) - TARGETS.keys())
        if unknown or not self.kinds:
            raise ConfigError(f"there is no kind {', '.join(unknown)}", "kinds", f"use some of {', '.join(TARGETS)}")
        if self.runs < 1 or self.workers < 1:
            raise ConfigError("a run has inputs and workers", "runs, workers", "use 1 or more")


@dataclass
class State:
    """How far a run is, as ``state.json`` has it."""

    seed: int
    kinds: list[str]
    done: dict[str, int] = field(default_factory=dict)
    """End of each finished chunk, by its first input."""
    raw_exceptions: int = 0
    crashes: int = 0
    slowest_s: float = 0.0
    peak_mb: float = 0.0
    causes: dict[str, int] = field(default_factory=dict)

    def add(self, report: Report) -> None:
        """Count what a worker found."""
        self.done[str(report.first // CHUNK * CHUNK)] = report.end
        self.slowest_s = max(self.slowest_s, report.slowest_s)
        self.peak_mb = max(self.peak_mb, report.peak_mb)
        for finding in report.findings:
            self.raw_exceptions += finding.sort == "raw"
            self.crashes += finding.sort in ("crash", "hang")
            self.causes[finding.cause] = self.causes.get(finding.cause, 0) + 1

    @property
    def runs(self) -> int:
        """Inputs that were read."""
        return sum(end - int(first) for first, end in self.done.items())

    def missing(self, runs: int) -> list[tuple[int, int]]:
        """Ranges of inputs that are still to be read."""
        starts = range(0, runs, CHUNK)
        ranges = [(max(first, self.done.get(str(first), 0)), min(first + CHUNK, runs)) for first in starts]
        return [(first, end) for first, end in ranges if first < end]


class Crew:
    """Worker processes; one that crashes or hangs is replaced, and goes on behind the input that it was at."""

    def __init__(self, options: Options):
        self.options = options
        self.root = scratch()
        # A forked worker has its parent's threads' locks, but not its threads.
        self._context = multiprocessing.get_context("spawn")
        self._hands = [_Hand(self._context, options, self.root / f"{n}") for n in range(options.workers)]

    def reports(self, ranges: list[tuple[int, int]]) -> Any:
        """The report of each range, as they come."""
        waiting = list(reversed(ranges))
        busy: list[_Hand] = []
        for hand in self._hands:
            if waiting:
                hand.begin(*waiting.pop())
                busy.append(hand)
        while busy:
            ready = wait([hand.pipe for hand in busy], timeout=0.5)
            for hand in list(busy):
                report = hand.answer() if hand.pipe in ready else hand.watch()
                if report is None:
                    continue
                yield report
                if waiting:
                    hand.begin(*waiting.pop())
                else:
                    busy.remove(hand)

    def close(self) -> None:
        """Stop all workers."""
        for hand in self._hands:
            hand.stop()
        shutil.rmtree(self.root, ignore_errors=True)


class _Hand:
    """One worker process at a time, and the range that it is at."""

    def __init__(self, context: multiprocessing.context.SpawnContext, options: Options, root: Path):
        self._context, self._options, self._root = context, options, root
        self._range = (0, 0)
        self._found: list[Finding] = []
        self._start()

    def _start(self) -> None:
        options = self._options
        shutil.rmtree(self._root, ignore_errors=True)
        self._root.mkdir(parents=True)
        self.pipe, theirs = self._context.Pipe()
        self._current = self._context.Value("q", -1, lock=False)
        log = options.out / "workers.log"
        self._process = self._context.Process(
            target=work,
            args=(options.seed, options.kinds, corpus(), theirs, self._current, log, self._root),
            daemon=True,
        )
        self._process.start()
        theirs.close()
        self._seen, self._since, self._spent, self._started = -1, time.monotonic(), 0.0, False

    def begin(self, first: int, end: int) -> None:
        """Give it a range."""
        self._range, self._found = (first, end), []
        self.pipe.send((first, end))
        self._since = time.monotonic()

    def answer(self) -> Report | None:
        """Its report; None when it has crashed, and begins again behind the input that it crashed at."""
        try:
            report: Report = self.pipe.recv()
        except (EOFError, OSError):
            self._process.join(5)
            return self._replaced("crash", f"ended with {self._process.exitcode}")
        report.first = self._range[0]
        report.findings = self._found + report.findings
        self._started = True
        return report

    def watch(self) -> Report | None:
        """Look after a worker that says nothing; as :meth:`answer`."""
        now, spent, current = time.monotonic(), _processor_time(self._process.pid), self._current.value
        if current != self._seen:
            self._seen, self._since, self._spent = current, now, spent
            self._started = self._started or current >= 0
        hangs = self._started and spent - self._spent > HANG_S
        if hangs or now - self._since > (STILL_S if self._started else START_S):
            os.kill(self._process.pid or 0, signal.SIGUSR1)  # it writes into its log where it is
            time.sleep(0.5)
            return self._replaced("hang", f"no answer in {now - self._since:.0f} s")
        return None

    def _replaced(self, sort: str, text: str) -> Report | None:
        current, end = self._current.value, self._range[1]
        self.stop()
        if current < 0:
            raise ConfigError(f"a worker fails before its first input: {text}", self._options.out / "workers.log")
        self._found.append(Finding(current, sort, f"{sort} {text}", text))
        self._start()
        if current + 1 < end:
            self.pipe.send((current + 1, end))
            return None
        return Report(self._range[0], end, findings=self._found)

    def stop(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


def _processor_time(pid: int | None) -> float:
    """Seconds of processor time that a process has taken; of the clock where the system does not say."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return time.monotonic()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run(options: Options) -> State:
    """Read all inputs that are still to be read.

    Raises
    ------
    ConfigError
        When another run is in the folder.
    """
    state = _state(options)
    options.out.mkdir(parents=True, exist_ok=True)
    ranges = state.missing(options.runs)
    if not ranges:
        return state
    crew = Crew(options)
    try:
        with track("inputs", total=options.runs, initial=state.runs, unit="input") as bar:
            for report in crew.reports(ranges):
                state.add(report)
                for finding in report.findings:
                    _keep(options, state, finding)
                write_atomic(options.out / "state.json", json.dumps(asdict(state), indent=1).encode())
                bar.update(report.end - report.first)
    finally:
        crew.close()
    return state


def _state(options: Options) -> State:
    path = options.out / "state.json"
    if not path.exists():
        return State(options.seed, list(options.kinds))
    state = State(**read_json(path, "state"))
    if (state.seed, state.kinds) != (options.seed, list(options.kinds)):
        raise ConfigError("another run is in this folder", options.out, "give its seed and kinds, or another folder")
    return state


def _keep(options: Options, state: State, finding: Finding) -> None:
    """Store a finding's input and what came of it, unless there are enough of its cause."""
    folder = options.out / "found" / safe_name(finding.cause)
    if folder.is_dir() and len(list(folder.glob("*.txt"))) >= KEPT:
        return
    given = input_at(options.seed, finding.index, options.kinds, corpus())
    stem, _, ending = given.file_name.partition(".")
    name = f"{stem}-{finding.index}"
    write_atomic(folder / f"{name}.{ending}", given.data)
    write_atomic(folder / f"{name}.txt", f"{finding.sort}: {finding.text}\n".encode("utf-8", "backslashreplace"))


def replay(file: Path) -> bool:
    """Read a stored input again, in this process; whether it is a finding."""
    desk = Desk(Path(tempfile.mkdtemp(prefix="fuzz-")))
    try:
        spent, _, finding = examine(0, input_of(file, corpus()), desk)
    finally:
        desk.clear()
    print("nothing to complain of" if finding is None else f"{finding.sort}: {finding.text}")
    print(json.dumps({"seconds": round(spent, 3), "finding": None if finding is None else finding.cause}))
    return finding is not None


def main() -> None:
    """Entry point."""
    options = tyro.cli(Options, description=__doc__)
    if options.replay is not None:
        sys.exit(int(replay(options.replay)))
    try:
        state = run(options)
    except KeyboardInterrupt:
        print(f"\nstopped; the same command goes on from {options.out}", file=sys.stderr)
        sys.exit(130)
    for cause, count in sorted(state.causes.items(), key=lambda item: -item[1]):
        print(f"{count:8d}  {cause}")
    found = {name: getattr(state, name) for name in ("runs", "raw_exceptions", "crashes")}
    print(json.dumps(found | {"slowest_s": round(state.slowest_s, 3), "peak_mb": round(state.peak_mb, 1)}))
    sys.exit(int(bool(state.causes)))


if __name__ == "__main__":
    try:
        main()
    except ArtsimError as problem:
        print(f"error: {problem}", file=sys.stderr)
        sys.exit(2)
