"""Work in pieces, on local processes, resumably: each piece writes files of its own, and is finished or done again.

A folder under construction holds ``progress.jsonl``: a line that says what is made, then one for each finished piece.
A last file, written at the end, holds the checksum of every file: its presence means that all is there.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import orjson

from artsim.common.files import file_sha256, read_bounded, read_json, write_atomic, write_error
from artsim.common.progress import track
from artsim.errors import DatasetError
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerLost, WorkerPool

JOURNAL = "progress.jsonl"
_MAX_JOURNAL = 4_000_000_000

Files = dict[str, tuple[int, str]]
"""Size and SHA-256 of files, by their paths within a folder."""


@dataclass
class Output:
    """The folder that work is written to, and which files were written to it.

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
class Answer:
    """What a worker did: the files that it wrote, and, in JSON's terms, what the end of the run wants to know."""

    files: Files
    value: Any


@dataclass(frozen=True)
class Task:
    """A piece of work.

    Attributes
    ----------
    work : callable
        A function of a module that gives an :class:`Answer`, or None when it was asked to stop before all was written.
    arguments : tuple
    size : int
        What it counts for on the progress bar: as much as ``work`` reports.
    """

    work: Callable[..., Answer | None]
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
        Name of a number of the recipe that may become larger later: finished pieces are kept. Empty for none.
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
class Result:
    """What a call of :func:`run_pieces` did: all files, how much was made by it, and each piece's value."""

    files: Files
    made: int
    values: dict[str, Any]


def run_pieces(
    run: Run,
    tasks: Mapping[str, Task],
    finish: Callable[[dict[str, Any], Output], Mapping[str, Any]],
    workers: int,
) -> Result:
    """Do the pieces that are not done yet, then write what needs all of them, and the last file.

    The same bytes come out whatever the number of workers and however often the run was stopped. A complete run is
    checked and left alone; one with damaged or missing files is made again.

    Parameters
    ----------
    run : Run
    tasks : mapping
        Pieces by name, in order.
    finish : callable
        Gets the value of every piece by name, and may write more files; what it returns goes into the last file.
    workers : int
        Processes.

    Raises
    ------
    DatasetError
        When the folder holds something else or is in use, or a process was lost.
    """
    folder, total = run.folder, sum(task.size for task in tasks.values())
    with folder_lock(folder):
        _remove_parts(folder)
        document = _complete(run)
        if document is not None:
            files = {name: (size, digest) for name, (size, digest) in document["files"].items()}
            return Result(files, 0, {})
        try:
            with WorkerPool(workers) as team:
                answers, made = _work(run, tasks, team, total)
        finally:
            _remove_parts(folder)
        return Result(*_finish(run, tasks, answers, finish, made))


def _work(run: Run, tasks: Mapping[str, Task], team: WorkerPool, total: int) -> tuple[dict[str, Answer], int]:
    """Do what is not done yet; answers of all pieces by name, and how much was done now."""
    folder = run.folder
    answers = _journal(run, tasks)
    write_atomic(folder / JOURNAL, b"".join([_line(run.recipe), *(_entry(name, a) for name, a in answers.items())]))
    (folder / run.done).unlink(missing_ok=True)
    missing = {name: task for name, task in tasks.items() if name not in answers}
    left = sum(task.size for task in missing.values())
    jobs = ((name, (task.work, task.arguments)) for name, task in missing.items())
    with track(f"{run.unit}s", total=total, initial=total - left, unit=run.unit, shown=run.progress) as bar:
        for name, answer in team.run(_do, jobs, progress=bar.update):
            if isinstance(answer, WorkerLost):
                raise DatasetError(
                    f"{answer.why} while {name} was made", folder, "use fewer --workers; the same command resumes"
                )
            if answer is not None:
                answers[name] = answer
                try:
                    with (folder / JOURNAL).open("ab") as file:
                        file.write(_entry(name, answer))
                except OSError as error:
                    raise write_error(error, folder / JOURNAL) from error
    return answers, left


def _do(work: Callable[..., Answer | None], arguments: tuple[Any, ...]) -> Answer | None:
    return work(*arguments)


def _finish(
    run: Run,
    tasks: Mapping[str, Task],
    answers: Mapping[str, Answer],
    finish: Callable[[dict[str, Any], Output], Mapping[str, Any]],
    made: int,
) -> tuple[Files, int, dict[str, Any]]:
    """Write what needs all pieces, then the list of files."""
    last, values = Output(run.folder), {name: answers[name].value for name in tasks}
    told = finish(values, last)
    files = {name: entry for piece in tasks for name, entry in answers[piece].files.items()} | last.files
    pieces = {"pieces": [[name, list(answers[name].files), values[name]] for name in tasks]} if run.grows else {}
    document = {**run.recipe, **told, **pieces, "files": files}
    write_atomic(run.folder / run.done, orjson.dumps(document, option=orjson.OPT_INDENT_2 | orjson.OPT_SERIALIZE_NUMPY))
    (run.folder / JOURNAL).unlink(missing_ok=True)
    return files, made, values


def _complete(run: Run) -> dict[str, Any] | None:
    """The last file of a run that is complete and whole; None when there is something to do.

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
        return document if _are_whole(run, document.get("files")) else None
    if not (folder / JOURNAL).exists():
        found = sorted(path.name for path in folder.iterdir() if path.name != ".lock")
        if found:
            raise DatasetError(f"the folder already holds {found[0]!r}", folder, "choose an empty or new folder")
    return None


def _is_smaller(run: Run, found: object) -> bool:
    """Whether what was made is less of the same."""
    if not run.grows or not isinstance(found, dict) or not isinstance(found.get(run.grows), int):
        return False
    return (
        bool(found[run.grows] < run.recipe[run.grows])
        and _differing({**found, run.grows: run.recipe[run.grows]}, run) == []
    )


def _take_up(run: Run, document: Mapping[str, Any]) -> None:
    """Note the finished pieces of a smaller run, before nothing else says so."""
    try:
        files = document["files"]
        lines = [_line([name, {file: files[file] for file in own}, value]) for name, own, value in document["pieces"]]
    except (KeyError, TypeError, ValueError) as error:
        raise DatasetError(f"{run.done} is damaged", run.folder, "choose another --out folder") from error
    write_atomic(run.folder / JOURNAL, b"".join([_line(run.recipe), *lines]))
    (run.folder / run.done).unlink()


def _differing(found: Mapping[str, Any], run: Run) -> list[str]:
    """Names of what differs, such as 'scene.count'."""
    return _differences(json.loads(orjson.dumps(run.recipe)), found, "")


def _differences(wanted: Mapping[str, Any], found: Mapping[str, Any], prefix: str) -> list[str]:
    names: list[str] = []
    for name, value in wanted.items():
        there = found.get(name)
        if isinstance(value, dict) and isinstance(there, dict) and value.keys() == there.keys():
            names += _differences(value, there, f"{prefix}{name}.")
        elif there != value:
            names.append(prefix + name)
    return names


def _refuse_other(run: Run, found: object) -> None:
    """Refuse to go on with another run."""
    if not isinstance(found, dict):
        raise DatasetError(f"the folder holds no {run.what} of this kind", run.folder, "choose another --out folder")
    differing = _differing(found, run)
    if differing:
        raise DatasetError(
            f"the folder holds another {run.what} (different: {', '.join(differing)})",
            run.folder,
            "choose another --out folder, or the same options",
        )


def _are_whole(run: Run, files: object) -> bool:
    """Whether all files that are listed have the content that they had."""
    if not isinstance(files, dict):
        return False
    for name, entry in track("check", list(files.items()), unit="file", shown=run.progress, leave=False):
        if not isinstance(entry, list | tuple) or len(entry) != 2 or not _is_whole(run.folder / name, *entry):
            return False
    return True


def _is_whole(path: Path, size: object, sha256: object) -> bool:
    try:
        return path.is_file() and path.stat().st_size == size and file_sha256(path) == sha256
    except OSError:
        return False


def _journal(run: Run, names: Iterable[str]) -> dict[str, Answer]:
    """What a run that was stopped has finished.

    Raises
    ------
    DatasetError
        When it was another run.
    """
    path = run.folder / JOURNAL
    if not path.exists():
        return {}
    lines = read_bounded(path, _MAX_JOURNAL, JOURNAL, DatasetError, fix="remove it").splitlines()
    try:
        begun = json.loads(lines[0]) if lines else {}
        if not _is_smaller(run, begun):
            _refuse_other(run, begun)
    except ValueError as error:
        raise DatasetError(f"{JOURNAL} is damaged", run.folder, "choose another --out folder") from error
    known, answers = set(names), {}
    for line in track("check", lines[1:], unit="piece", shown=run.progress, leave=False):
        try:
            name, files, value = json.loads(line)
            answer = Answer({file: (size, sha256) for file, (size, sha256) in files.items()}, value)
        except (ValueError, TypeError, AttributeError):
            continue  # the last line of a killed run may be cut short: its piece is done again
        if name in known and all(_is_whole(run.folder / file, *entry) for file, entry in answer.files.items()):
            answers[name] = answer
    return answers


def _entry(name: str, answer: Answer) -> bytes:
    return _line([name, answer.files, answer.value])


def _line(content: Any) -> bytes:
    return orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY) + b"\n"


def _remove_parts(folder: Path) -> None:
    """Remove files that killed runs did not finish."""
    for part in folder.rglob(".*.part"):
        part.unlink(missing_ok=True)
