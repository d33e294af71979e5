"""Reading mutated files by the million: ``python -m benchmarks.fuzz --runs 1000000``.

Input i depends on (seed, i) and the kinds alone. Whatever ends in anything but success or an ``ArtsimError`` is a
finding: its file lies in ``found`` under the output folder, and ``--replay FILE`` reads it again. Stop it at any
moment: the same command goes on. The last line is one JSON object; the program ends with 1 when there is any finding.
"""

from __future__ import annotations

import faulthandler
import gc
import json
import os
import resource
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np
import tyro

from artsim.common.files import read_json, write_atomic
from artsim.common.names import safe_name
from artsim.common.progress import track
from artsim.errors import ConfigError
from tests.fuzz.seeds import Input, input_at, input_of, seeds_of
from tests.fuzz.targets import TARGETS, Finding, examine

_CHUNK = 10_000
"""Inputs of a process."""
_NOTE = 500
"""Inputs after which a process writes down how far it is."""
_STILL_S = 60.0
"""Seconds after which an input hangs, and its process ends."""
_HEADROOM = 2 << 30
"""Bytes of address space that a process may take beyond what its libraries take."""
_KEPT = 5
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
    part: tuple[int, int] | None = None
    """Read these inputs in this process: what the run itself calls."""

    def __post_init__(self) -> None:
        unknown = sorted(set(self.kinds) - TARGETS.keys())
        if unknown or not self.kinds:
            raise ConfigError(f"there is no kind {', '.join(unknown)}", "kinds", f"use some of {', '.join(TARGETS)}")
        if self.runs < 1 or self.workers < 1:
            raise ConfigError("a run has inputs and workers", "runs, workers", "use 1 or more")


@dataclass
class Report:
    """What came of the inputs of a chunk: ``end`` is the first that is not read yet."""

    end: int
    slowest_s: float = 0.0
    peak_mb: float = 0.0
    causes: dict[str, int] = field(default_factory=dict)
    """Findings by sort and cause."""

    @classmethod
    def of(cls, file: Path, first: int) -> Report:
        """As stored; of nothing where nothing is."""
        return cls(**read_json(file, "report")) if file.is_file() else cls(first)

    def add(self, options: Options, index: int, finding: Finding) -> None:
        """Count a finding, and store its input and what came of it, unless there are enough of its cause."""
        cause = f"{finding.sort} {finding.cause}"
        self.causes[cause] = self.causes.get(cause, 0) + 1
        folder = options.out / "found" / safe_name(cause)
        if folder.is_dir() and len(list(folder.glob("*.txt"))) >= _KEPT:
            return
        given = input_at(options.seed, index, options.kinds)
        write_atomic(folder / given.file_name(index), given.data)
        write_atomic(folder / f"{index}.txt", finding.text.encode("utf-8", "backslashreplace"))


def work(options: Options, first: int, end: int) -> None:
    """Read a range of inputs; a crash or a hang ends the process, and ``current`` says at which input."""
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    file = _report_file(options, first)
    report = Report.of(file, first)
    with tempfile.TemporaryDirectory(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None) as name:
        for seed in (seed for kind in options.kinds for seed in seeds_of(kind)):  # once, so that imports count for none
            member = next(iter(seed.files))
            examine(Input(seed, member, seed.files[member]), Path(name))
        gc.freeze()
        held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (held + _HEADROOM, held + _HEADROOM))
        current = os.open(file.with_suffix(".at"), os.O_CREAT | os.O_WRONLY)
        for index in range(report.end, end):
            os.pwrite(current, b"%20d" % index, 0)
            faulthandler.dump_traceback_later(_STILL_S, exit=True)
            spent, taken, finding = examine(input_at(options.seed, index, options.kinds), Path(name))
            faulthandler.cancel_dump_traceback_later()
            report.slowest_s, report.peak_mb = max(report.slowest_s, spent), max(report.peak_mb, taken)
            report.end = index + 1
            if finding is not None:
                report.add(options, index, finding)
            if finding is not None or report.end % _NOTE == 0 or report.end == end:
                write_atomic(file, json.dumps(asdict(report)).encode())


def read(options: Options, first: int, end: int) -> Report:
    """Let processes read a range of inputs; one that crashes is followed by one that begins behind the input."""
    file = _report_file(options, first)
    words = [
        sys.executable, "-m", "benchmarks.fuzz", "--kinds", *options.kinds, "--seed", str(options.seed),
        "--out", str(options.out), "--part", str(first), str(end),
    ]  # fmt: skip
    while (report := Report.of(file, first)).end < end:
        file.with_suffix(".at").unlink(missing_ok=True)
        done = subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        if done.returncode == 0:
            continue
        said = done.stderr.decode("utf-8", "replace")[-5000:]
        if not file.with_suffix(".at").exists():
            raise ConfigError(f"a process fails before its first input: {said}", options.out)
        at = int(file.with_suffix(".at").read_text())
        report = Report.of(file, first)
        report.add(options, at, Finding("crash", f"exit code {done.returncode}", said))
        report.end = at + 1
        write_atomic(file, json.dumps(asdict(report)).encode())
    return report


def _report_file(options: Options, first: int) -> Path:
    return options.out / "parts" / f"{first}.json"


def run(options: Options) -> list[Report]:
    """Read all inputs that are still to be read.

    Raises
    ------
    ConfigError
        When another run is in the folder.
    """
    asked, file = {"seed": options.seed, "kinds": list(options.kinds)}, options.out / "run.json"
    if file.exists() and read_json(file, "run") != asked:
        raise ConfigError("another run is in this folder", options.out, "give its seed and kinds, or another folder")
    write_atomic(file, json.dumps(asked).encode())
    (options.out / "parts").mkdir(exist_ok=True)
    ranges = [(first, min(first + _CHUNK, options.runs)) for first in range(0, options.runs, _CHUNK)]
    with ThreadPoolExecutor(options.workers) as team:
        parts = [team.submit(read, options, *one) for one in ranges]
        return [part.result() for part in track("inputs", as_completed(parts), total=len(parts), unit="chunk")]


def replay(file: Path) -> bool:
    """Read a stored input again, in this process; whether it is a finding."""
    with tempfile.TemporaryDirectory() as name:
        spent, _, finding = examine(input_of(file), Path(name))
    print("nothing to complain of" if finding is None else f"{finding.sort}: {finding.text}")
    print(json.dumps({"seconds": round(spent, 3), "finding": None if finding is None else finding.cause}))
    return finding is not None


def main(options: Options) -> None:
    """Run, and print findings by cause."""
    options = replace(options, out=options.out.absolute())
    if options.part is not None:
        work(options, *options.part)
        return
    if options.replay is not None:
        sys.exit(int(replay(options.replay)))
    reports = run(options)
    causes = Counter[str]()
    for report in reports:
        causes.update(report.causes)
    for cause, count in causes.most_common():
        print(f"{count:8d}  {cause}")
    sorts = {sort: sum(n for cause, n in causes.items() if cause.startswith(sort)) for sort in ("raw", "crash")}
    slowest, peak = max(report.slowest_s for report in reports), max(report.peak_mb for report in reports)
    found = {"runs": options.runs, "raw_exceptions": sorts["raw"], "crashes": sorts["crash"]}
    print(json.dumps(found | {"slowest_s": round(slowest, 3), "peak_mb": round(peak, 1)}))
    sys.exit(int(bool(causes)))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
