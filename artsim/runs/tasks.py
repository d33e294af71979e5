"""Tasks that write files, resumably: file name -> function -> digest. Each is finished, or done again.

A folder under construction holds ``progress.jsonl``: a line that says what is made, then one for each finished task.
A last file, written at the end, holds the checksum of every file: its presence means that all is there.
"""

import contextlib
import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import orjson

from artsim.common.files import append, read_bounded, read_json, write_atomic
from artsim.common.progress import track
from artsim.errors import DatasetError
from artsim.runs.checksums import check_files
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerPool, results
from artsim.runs.recipe import differences
from artsim.runs.worker import StoppedError

JOURNAL = "progress.jsonl"
_MAX_JOURNAL = 4_000_000_000
_DAMAGED = (ValueError, KeyError, TypeError, AttributeError)
"""What reading values of a damaged file ends in."""

Files = dict[str, tuple[int, str]]
"""Size and SHA-256 of files, by their paths within a folder."""


@dataclass
class Output:
    """The folder that a task writes to, and which files it has written."""

    folder: Path
    files: Files = field(default_factory=dict)
    """Size and SHA-256 of each file that was written, by its path within the folder."""

    def write(self, name: str, data: bytes) -> None:
        """Write a whole file and note it."""
        write_atomic(self.folder / name, data)
        self.files[name] = len(data), hashlib.sha256(data).hexdigest()


@dataclass(frozen=True)
class Task:
    """A piece of work."""

    work: Callable[..., Any]
    """A function of a module. It gets an :class:`Output` and the arguments, and returns, in JSON's terms, what the end
    of the run wants to know. It may call :func:`artsim.runs.worker.stop_if_asked`."""
    arguments: tuple[Any, ...]
    size: int = 1
    """What it counts for on the progress bar: as much as ``work`` reports."""


@dataclass(frozen=True)
class Run:
    """What is made, and where."""

    folder: Path
    recipe: Mapping[str, Any]
    """All that the files follow from, in JSON's terms."""
    done: str
    """Name of the last file."""
    what: str
    """What the folder holds, for messages."""
    unit: str
    """What is counted."""
    grows: str = ""
    """Name of a number of the recipe that may become larger later: finished tasks are kept. Empty for none."""
    progress: bool = True
    """Show progress bars."""


@dataclass(frozen=True)
class RunResult:
    """What a call has come to: where it is, how much that is, and how much of it was made now."""

    folder: Path
    total: int
    made: int
    seconds: float


@dataclass(frozen=True)
class _Record:
    """What a task has written and returned."""

    files: Files
    value: Any


def run_tasks(
    run: Run, tasks: Mapping[str, Task], workers: int, finish: Callable[[dict[str, Any], Output], None] | None = None
) -> tuple[Files, int]:
    """Do the tasks that are not done yet, then write what needs all of them, and the last file.

    The same bytes come out whatever the number of workers and however often the run was stopped. A complete run is
    checked and left alone; damaged or missing files are made again, or all of them where nothing says whose they are.

    Parameters
    ----------
    run : Run
    tasks : mapping
        By name, in order.
    workers : int
        Processes.
    finish : callable, optional
        Gets the value of every task by name, and may write more files.

    Returns
    -------
    files : dict
    made : int
        Size of the tasks that were done now.

    Raises
    ------
    DatasetError
        When the folder holds something else or is in use, or a process was lost.
    """
    with folder_lock(run.folder):
        _remove_unfinished(run.folder)
        found, records, files = _found(run)
        is_smaller = found is not None and _is_smaller(run, found)
        whole = _whole(run, files or {file: entry for own in records.values() for file, entry in own.files.items()})
        if files is not None and not is_smaller and all(whole.values()):
            return files, 0
        records = {
            name: own for name, own in records.items() if name in tasks and all(whole.get(file) for file in own.files)
        }
        try:
            made = _work(run, tasks, records, workers)
        finally:
            _remove_unfinished(run.folder)
        last = Output(run.folder)
        values = {name: records[name].value for name in tasks}
        if finish is not None:
            finish(values, last)
        files = {name: entry for task in tasks for name, entry in records[task].files.items()} | last.files
        pieces = {"pieces": [[name, list(records[name].files), values[name]] for name in tasks]} if run.grows else {}
        document = {**run.recipe, **pieces, "files": files}
        data = orjson.dumps(document, option=orjson.OPT_INDENT_2 | orjson.OPT_SERIALIZE_NUMPY)
        write_atomic(run.folder / run.done, data)
        (run.folder / JOURNAL).unlink(missing_ok=True)
        return files, made


def _work(run: Run, tasks: Mapping[str, Task], records: dict[str, _Record], workers: int) -> int:
    """Do what is not done yet, and add its records; how much was done now."""
    journal = run.folder / JOURNAL
    write_atomic(journal, _lines(run.recipe, *([name, own.files, own.value] for name, own in records.items())))
    (run.folder / run.done).unlink(missing_ok=True)
    missing = {name: task for name, task in tasks.items() if name not in records}
    total, left = (sum(task.size for task in some.values()) for some in (tasks, missing))
    jobs = ((name, (run.folder.absolute(), task)) for name, task in missing.items())
    with (
        WorkerPool(workers) as team,
        track(f"{run.unit}s", total=total, initial=total - left, unit=run.unit, shown=run.progress) as bar,
    ):
        for name, record in results(team.run(_do, jobs, progress=bar.update), run.folder):
            if record is not None:
                records[name] = record
                append(journal, _lines([name, record.files, record.value]))
    return left


def _do(folder: Path, task: Task) -> _Record | None:
    """Do a task, in a worker; None when asked to stop before all is written."""
    output = Output(folder)
    try:
        return _Record(output.files, task.work(output, *task.arguments))
    except StoppedError:
        return None


def _found(run: Run) -> tuple[Any, dict[str, _Record], Files | None]:
    """What the folder says of its run: its recipe, finished tasks and, if it is complete, all files.

    Raises
    ------
    DatasetError
        When the folder holds something else.
    """
    files: Files | None = None
    lines: list[Any] = []
    if (run.folder / run.done).exists():
        found = read_json(run.folder / run.done, run.done, DatasetError)
        with contextlib.suppress(*_DAMAGED):
            files = {name: (size, sha256) for name, (size, sha256) in found["files"].items()}
            lines = [[name, {file: files[file] for file in own}, value] for name, own, value in found.get("pieces", ())]
    else:
        found, *lines = read_journal(run.folder) or [None]
        strange = sorted(path.name for path in run.folder.iterdir() if path.name not in (".lock", JOURNAL))
        if strange and not (run.folder / JOURNAL).exists():
            raise DatasetError(f"the folder already holds {strange[0]!r}", run.folder, "choose an empty or new folder")
    records: dict[str, _Record] = {}
    for line in lines:
        with contextlib.suppress(*_DAMAGED):
            name, own, value = line
            records[name] = _Record({file: (size, sha256) for file, (size, sha256) in own.items()}, value)
    return found, records, files


def read_journal(folder: Path) -> list[Any]:
    """Lines of a journal. The last line of a killed run may be cut short: it is left out, as other damaged ones."""
    values, path = [], folder / JOURNAL
    data = read_bounded(path, _MAX_JOURNAL, JOURNAL, DatasetError, fix="remove it") if path.exists() else b""
    for line in data.splitlines():
        with contextlib.suppress(ValueError):
            values.append(orjson.loads(line))
    return values


def _lines(*values: Any) -> bytes:
    try:
        return b"".join(orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY) + b"\n" for value in values)
    except TypeError:  # a file's name that is no text
        return b"".join(json.dumps(value).encode() + b"\n" for value in values)


def _is_smaller(run: Run, found: object) -> bool:
    """Whether what was made is less of the same.

    Raises
    ------
    DatasetError
        When it was another run.
    """
    if not isinstance(found, dict):
        raise DatasetError(f"the folder holds no {run.what} of this kind", run.folder, "choose another --out folder")
    differing = [name for name, _, _ in differences(found, json.loads(orjson.dumps(run.recipe)))]
    before = found.get(run.grows)
    if differing == [run.grows] and isinstance(before, int) and before < run.recipe[run.grows]:
        return True
    if differing:
        raise DatasetError(
            f"the folder holds another {run.what} (different: {', '.join(differing)})",
            run.folder,
            "choose another --out folder, or the same options",
        )
    return False


def _whole(run: Run, files: Mapping[str, tuple[int, str]]) -> dict[str, bool]:
    """Whether each file has the content that it had."""
    found = check_files(run.folder, {name: [sha256] for name, (_, sha256) in files.items()}, progress=run.progress)
    return {name: problem is None for name, (problem, _) in found.items()}


def _remove_unfinished(folder: Path) -> None:
    """Remove files that killed runs did not finish."""
    for part in folder.rglob(".*.part"):
        part.unlink(missing_ok=True)
