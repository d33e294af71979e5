"""Tasks that write files, resumably: file name -> function -> digest. Each is finished, or done again.

A folder under construction holds ``progress.jsonl``: a line that says what is made, then one for each finished task.
A last file, written at the end, holds the checksum of every file: its presence means that all is there.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import orjson

from artsim.common.files import read_json, write_atomic
from artsim.common.progress import track
from artsim.errors import DatasetError
from artsim.runs.checksums import check_files
from artsim.runs.journal import JOURNAL, Journal
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerPool, results
from artsim.runs.recipe import differences
from artsim.runs.worker import StoppedError

Files = dict[str, tuple[int, str]]
"""Size and SHA-256 of files, by their paths within a folder."""


@dataclass
class Output:
    """The folder that a task writes to, and which files it has written.

    Attributes
    ----------
    folder : Path
    files : dict
        Size and SHA-256 of each file that was written, by its path within the folder.
    """

    folder: Path
    files: Files = field(default_factory=dict)

    def write(self, name: str, data: bytes) -> None:
        """Write a whole file and note it."""
        write_atomic(self.folder / name, data)
        self.files[name] = len(data), hashlib.sha256(data).hexdigest()


@dataclass(frozen=True)
class Task:
    """A piece of work.

    Attributes
    ----------
    work : callable
        A function of a module. It gets an :class:`Output` and the arguments, and returns, in JSON's terms, what the end
        of the run wants to know. It may call :func:`artsim.runs.worker.stop_if_asked`.
    arguments : tuple
    size : int
        What it counts for on the progress bar: as much as ``work`` reports.
    """

    work: Callable[..., Any]
    arguments: tuple[Any, ...]
    size: int = 1


@dataclass(frozen=True)
class Run:
    """What is made, and where.

    Attributes
    ----------
    folder : Path
    recipe : mapping
        All that the files follow from, in JSON's terms.
    done : str
        Name of the last file.
    what : str
        What the folder holds, for messages.
    unit : str
        What is counted.
    grows : str
        Name of a number of the recipe that may become larger later: finished tasks are kept. Empty for none.
    progress : bool
        Show progress bars.
    """

    folder: Path
    recipe: Mapping[str, Any]
    done: str
    what: str
    unit: str
    grows: str = ""
    progress: bool = True


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
    checked and left alone; one with damaged or missing files is made again.

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
        files = _complete_files(run)
        if files is not None:
            return files, 0
        try:
            records, made = _work(run, tasks, workers)
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
        Journal(run.folder / JOURNAL).remove()
        return files, made


def _work(run: Run, tasks: Mapping[str, Task], workers: int) -> tuple[dict[str, _Record], int]:
    """Do what is not done yet; records of all tasks by name, and how much was done now."""
    records, journal = _finished(run, tasks), Journal(run.folder / JOURNAL)
    journal.start([run.recipe, *([name, own.files, own.value] for name, own in records.items())])
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
                journal.add([name, record.files, record.value])
    return records, left


def _do(folder: Path, task: Task) -> _Record | None:
    """Do a task, in a worker; None when asked to stop before all is written."""
    output = Output(folder)
    try:
        return _Record(output.files, task.work(output, *task.arguments))
    except StoppedError:
        return None


def _complete_files(run: Run) -> Files | None:
    """Files of a run that is complete and whole; None when there is something to do.

    Raises
    ------
    DatasetError
        When the folder holds something else.
    """
    folder = run.folder
    if (folder / run.done).exists():
        document = read_json(folder / run.done, run.done, DatasetError)
        if _is_smaller(run, document):
            _take_up(run, document)
            return None
        _refuse_other(run, document)
        try:
            files = {name: (size, sha256) for name, (size, sha256) in document["files"].items()}
        except (KeyError, TypeError, ValueError, AttributeError):
            return None
        return files if all(_whole(run, files).values()) else None
    if not (folder / JOURNAL).exists():
        found = sorted(path.name for path in folder.iterdir() if path.name != ".lock")
        if found:
            raise DatasetError(f"the folder already holds {found[0]!r}", folder, "choose an empty or new folder")
    return None


def _is_smaller(run: Run, found: object) -> bool:
    """Whether what was made is less of the same."""
    if not run.grows or not isinstance(found, dict) or not isinstance(found.get(run.grows), int):
        return False
    return bool(found[run.grows] < run.recipe[run.grows]) and _differing(run, found) == [run.grows]


def _take_up(run: Run, document: Mapping[str, Any]) -> None:
    """Note the finished tasks of a smaller run, before nothing else says so."""
    try:
        files = document["files"]
        lines = [[name, {file: files[file] for file in own}, value] for name, own, value in document["pieces"]]
    except (KeyError, TypeError, ValueError) as error:
        raise DatasetError(f"{run.done} is damaged", run.folder, "choose another --out folder") from error
    Journal(run.folder / JOURNAL).start([run.recipe, *lines])
    (run.folder / run.done).unlink()


def _differing(run: Run, found: Mapping[str, Any]) -> list[str]:
    """Names of what differs, such as 'scene.count'."""
    return [name for name, _, _ in differences(found, json.loads(orjson.dumps(run.recipe)))]


def _refuse_other(run: Run, found: object) -> None:
    """Refuse to resume another run."""
    if not isinstance(found, dict):
        raise DatasetError(f"the folder holds no {run.what} of this kind", run.folder, "choose another --out folder")
    differing = _differing(run, found)
    if differing:
        raise DatasetError(
            f"the folder holds another {run.what} (different: {', '.join(differing)})",
            run.folder,
            "choose another --out folder, or the same options",
        )


def _finished(run: Run, tasks: Mapping[str, Task]) -> dict[str, _Record]:
    """What a run that was stopped has finished.

    Raises
    ------
    DatasetError
        When it was another run.
    """
    lines = Journal(run.folder / JOURNAL).lines()
    if not lines:
        return {}
    begun = lines[0]
    if not _is_smaller(run, begun):
        _refuse_other(run, begun)
    records: dict[str, _Record] = {}
    for line in lines[1:]:
        try:
            name, files, value = line
            records[name] = _Record({file: (size, sha256) for file, (size, sha256) in files.items()}, value)
        except (ValueError, TypeError, AttributeError):
            continue
    records = {name: record for name, record in records.items() if name in tasks}
    whole = _whole(run, {file: entry for record in records.values() for file, entry in record.files.items()})
    return {name: record for name, record in records.items() if all(whole[file] for file in record.files)}


def _whole(run: Run, files: Mapping[str, tuple[int, str]]) -> dict[str, bool]:
    """Whether each file has the content that it had."""
    found = check_files(run.folder, {name: [sha256] for name, (_, sha256) in files.items()}, progress=run.progress)
    return {name: problem is None for name, (problem, _) in found.items()}


def _remove_unfinished(folder: Path) -> None:
    """Remove files that killed runs did not finish."""
    for part in folder.rglob(".*.part"):
        part.unlink(missing_ok=True)
