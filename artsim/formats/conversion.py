"""dataset -> workers -> files: convert a finished dataset on local processes, resumably.

A folder under construction holds ``progress.jsonl``: a line that says what is converted, then one for each finished
piece. ``conversion.json`` is written last, with the checksum of every file: its presence means that all is there.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args

import orjson

from artsim.common.files import file_sha256, read_bounded, read_json, write_atomic, write_error
from artsim.common.progress import track
from artsim.datasets.dataset import Dataset
from artsim.datasets.description import DESCRIPTION
from artsim.datasets.splits import SPLITS
from artsim.datasets.worker import StoppedError, report, stop_if_asked
from artsim.datasets.worker_pool import WorkerLost, WorkerPool, folder_lock
from artsim.errors import ConfigError, DatasetError
from artsim.formats.base import Format, FormatName, Output, Piece
from artsim.formats.bop import BopFormat
from artsim.formats.coco import CocoFormat
from artsim.formats.hdf5 import Hdf5Format
from artsim.formats.ply import PlyFormat
from artsim.formats.webdataset import WebDatasetFormat
from artsim.observing.sample import Sample

FORMATS: dict[FormatName, Format] = {
    "webdataset": WebDatasetFormat(),
    "bop": BopFormat(),
    "coco": CocoFormat(),
    "hdf5": Hdf5Format(),
    "ply": PlyFormat(),
}

JOURNAL, DONE = "progress.jsonl", "conversion.json"
_VERSION = 1
"""Of what is written: another one is another conversion."""

_OBJECTS_AT_ONCE = 16
_MAX_JOURNAL = 4_000_000_000


@dataclass(frozen=True)
class ConvertResult:
    """What a call of :func:`convert` did.

    Attributes
    ----------
    folder : Path
    num_samples : int
        Of the whole conversion.
    made : int
        Samples converted by this call.
    files : int
        Of the whole conversion, without ``conversion.json``.
    seconds : float
    """

    folder: Path
    num_samples: int
    made: int
    files: int
    seconds: float


def convert(
    dataset: str | Path | Dataset,
    to: FormatName,
    out: str | Path,
    split: str | None = None,
    samples: Sequence[int] = (),
    group: int = 256,
    workers: int = 2,
    progress: bool = True,
) -> ConvertResult:
    """Convert a finished dataset, or go on with a conversion that was stopped.

    The same bytes come out whatever the number of workers and however often the run was stopped. A complete conversion
    is checked and left alone; one with damaged or missing files is made again.

    Parameters
    ----------
    dataset : path or Dataset
    to : str
        One of :data:`FORMATS`.
    out : path
        Folder to write to; made if missing.
    split : str, optional
        Convert this split only.
    samples : sequence of int
        Convert samples with these indices only; by default all.
    group : int
        Samples of a tar file (webdataset) or images of a scene (bop); with other formats, of a step of work.
    workers : int
        Processes.
    progress : bool
        Show progress bars.

    Returns
    -------
    ConvertResult

    Raises
    ------
    ConfigError
        When the dataset lacks what the format needs, an option makes no sense, or a library is missing.
    DatasetError
        When the dataset is damaged, or the folder holds something else or is in use.
    """
    start = time.perf_counter()
    source = Dataset(dataset.folder if isinstance(dataset, Dataset) else dataset)
    if to not in get_args(FormatName):
        raise ConfigError(f"there is no format {to!r:.40}", "to", f"use one of {', '.join(FORMATS)}")
    if split not in (None, *SPLITS):
        raise ConfigError(f"there is no split {split!r:.40}", "split", f"use one of {', '.join(SPLITS)}")
    for name, value in (("group", group), ("workers", workers)):
        if value < 1:
            raise ConfigError(f"{value} is not a count", name, "use 1 or more")
    folder = Path(out)
    if folder.resolve().is_relative_to(source.folder.resolve()):
        raise ConfigError("lies within the dataset", folder, "choose a folder outside of it")
    FORMATS[to].check(source.plan.sample, source.folder)
    pieces = _pieces(source, to, split, samples, group)
    recipe = {
        "format": to,
        "version": _VERSION,
        "dataset": file_sha256(source.folder / DESCRIPTION),
        "split": split,
        "samples": sorted(set(samples)),
        "group": group,
    }
    total = sum(len(piece.members) for piece in pieces if piece.split)
    with folder_lock(folder):
        _remove_parts(folder)
        files = _complete(folder, recipe, progress)
        made = 0
        if files is None:
            try:
                with WorkerPool(source.folder, workers) as team:
                    answers, made = _run(source, folder, recipe, pieces, team, total, progress)
            finally:
                _remove_parts(folder)
            files = _finish(source, folder, recipe, pieces, answers)
    return ConvertResult(folder, total, made, len(files), time.perf_counter() - start)


def _pieces(source: Dataset, to: FormatName, split: str | None, samples: Sequence[int], group: int) -> list[Piece]:
    """All pieces: objects first, then each split in order."""
    chosen, plan, start = set(samples), source.plan, 0
    members: dict[str, list[int]] = {name: [] for name in SPLITS}
    shown, seen = set(), set()
    for shard in source.shards:
        for position, index in enumerate(plan.indices(shard), start):
            if split in (None, shard.split) and (not chosen or index in chosen):
                members[shard.split].append(position)
                shown.add(plan.object_of(index).key)
                seen.add(index)
        start += len(shard)
    if chosen - seen:
        raise ConfigError(
            f"there is no sample {min(chosen - seen)}" + (f" in split {split}" if split else ""),
            "samples",
            f"name some of 0 to {plan.num_samples - 1}" + (", or no split" if split else ""),
        )
    pieces = []
    if FORMATS[to].converts_objects:
        pieces += _cut("", [i for i, planned in enumerate(plan.objects) if planned.key in shown], _OBJECTS_AT_ONCE)
    for name, positions in members.items():
        pieces += _cut(name, positions, group)
    return pieces


def _cut(split: str, members: Sequence[int], size: int) -> list[Piece]:
    starts = range(0, len(members), size)
    return [Piece(split, i, tuple(members[start : start + size])) for i, start in enumerate(starts)]


@dataclass(frozen=True)
class _Answer:
    """What a worker did: the files that it wrote, and what the format wants to know at the end."""

    files: dict[str, tuple[int, str]]
    value: Any


@lru_cache(maxsize=1)
def _opened(folder: Path) -> Dataset:
    """The dataset that a worker reads, once."""
    return Dataset(folder)


def convert_piece(source: Path, out: Path, to: FormatName, piece: Piece) -> _Answer | None:
    """Write the files of a piece, in a worker; None when asked to stop before all are written."""
    dataset, output = _opened(source), Output(out)
    try:
        if piece.split:
            value = FORMATS[to].write_samples(dataset, piece, _read(dataset, piece), output)
        else:
            value = FORMATS[to].write_objects(dataset, piece, output)
    except StoppedError:
        return None
    return _Answer(output.files, value)


def _read(dataset: Dataset, piece: Piece) -> Iterator[Sample]:
    for position in piece.members:
        stop_if_asked()
        yield dataset[position]
        report(1)


def _run(
    source: Dataset,
    folder: Path,
    recipe: Mapping[str, Any],
    pieces: Sequence[Piece],
    team: WorkerPool,
    total: int,
    progress: bool,
) -> tuple[dict[str, _Answer], int]:
    """Convert what is not converted yet; answers of all pieces by name, and how many samples were done now."""
    answers = _journal(folder, recipe, pieces, progress)
    write_atomic(folder / JOURNAL, b"".join([_line(recipe), *(_entry(name, a) for name, a in answers.items())]))
    (folder / DONE).unlink(missing_ok=True)
    missing = [piece for piece in pieces if piece.name not in answers]
    left = sum(len(piece.members) for piece in missing if piece.split)
    tasks = ((piece, (source.folder, folder.absolute(), recipe["format"], piece)) for piece in missing)
    with track("samples", total=total, initial=total - left, unit="sample", shown=progress) as bar:
        for piece, answer in team.run(convert_piece, tasks, progress=bar.update):
            if isinstance(answer, WorkerLost):
                raise DatasetError(
                    f"{answer.why} while {piece.name} was converted",
                    folder,
                    "use fewer --workers; the same command resumes",
                )
            if answer is not None:
                answers[piece.name] = answer
                try:
                    with (folder / JOURNAL).open("ab") as file:
                        file.write(_entry(piece.name, answer))
                except OSError as error:
                    raise write_error(error, folder / JOURNAL) from error
    return answers, left


def _finish(
    source: Dataset, folder: Path, recipe: Mapping[str, Any], pieces: Sequence[Piece], answers: Mapping[str, _Answer]
) -> dict[str, tuple[int, str]]:
    """Write what needs all pieces, then the list of files."""
    last = Output(folder)
    FORMATS[recipe["format"]].finish(source, [(piece, answers[piece.name].value) for piece in pieces], last)
    files = {name: entry for piece in pieces for name, entry in answers[piece.name].files.items()} | last.files
    write_atomic(folder / DONE, orjson.dumps({**recipe, "files": files}, option=orjson.OPT_INDENT_2))
    (folder / JOURNAL).unlink(missing_ok=True)
    return files


def _complete(folder: Path, recipe: Mapping[str, Any], progress: bool) -> dict[str, tuple[int, str]] | None:
    """The files of a conversion that is complete and whole; None when there is something to do.

    Raises
    ------
    DatasetError
        When the folder holds something else.
    """
    if (folder / DONE).exists():
        document = read_json(folder / DONE, DONE, DatasetError)
        files = document.pop("files", None) if isinstance(document, dict) else None
        _refuse_other(folder, recipe, document)
        return files if _are_whole(folder, files, progress) else None
    if not (folder / JOURNAL).exists():
        found = sorted(path.name for path in folder.iterdir() if path.name != ".lock")
        if found:
            raise DatasetError(f"the folder already holds {found[0]!r}", folder, "choose an empty or new folder")
    return None


def _refuse_other(folder: Path, recipe: Mapping[str, Any], found: object) -> None:
    """Refuse to go on with another conversion."""
    if not isinstance(found, dict):
        raise DatasetError("the folder holds no conversion of this dataset", folder, "choose another --out folder")
    differing = [name for name, value in recipe.items() if found.get(name) != value]
    if differing:
        raise DatasetError(
            f"the folder holds another conversion (different: {', '.join(differing)})",
            folder,
            "choose another --out folder, or the same options",
        )


def _are_whole(folder: Path, files: object, progress: bool) -> bool:
    """Whether all files that are listed have the content that they had."""
    if not isinstance(files, dict):
        return False
    for name, entry in track("check", list(files.items()), unit="file", shown=progress, leave=False):
        if not isinstance(entry, list | tuple) or len(entry) != 2 or not _is_whole(folder / name, *entry):
            return False
    return True


def _is_whole(path: Path, size: object, sha256: object) -> bool:
    try:
        return path.is_file() and path.stat().st_size == size and file_sha256(path) == sha256
    except OSError:
        return False


def _journal(folder: Path, recipe: Mapping[str, Any], pieces: Iterable[Piece], progress: bool) -> dict[str, _Answer]:
    """What a run that was stopped has finished.

    Raises
    ------
    DatasetError
        When it was another conversion.
    """
    path = folder / JOURNAL
    if not path.exists():
        return {}
    lines = read_bounded(path, _MAX_JOURNAL, JOURNAL, DatasetError, fix="remove it").splitlines()
    try:
        _refuse_other(folder, recipe, json.loads(lines[0]) if lines else {})
    except ValueError as error:
        raise DatasetError(f"{JOURNAL} is damaged", folder, "choose another --out folder") from error
    names, answers = {piece.name for piece in pieces}, {}
    for line in track("check", lines[1:], unit="piece", shown=progress, leave=False):
        try:
            name, files, value = json.loads(line)
            answer = _Answer({file: (size, sha256) for file, (size, sha256) in files.items()}, value)
        except (ValueError, TypeError, AttributeError):
            continue  # the last line of a killed run may be cut short: its piece is converted again
        if name in names and all(_is_whole(folder / file, *entry) for file, entry in answer.files.items()):
            answers[name] = answer
    return answers


def _entry(name: str, answer: _Answer) -> bytes:
    return _line([name, answer.files, answer.value])


def _line(content: Any) -> bytes:
    return orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY) + b"\n"


def _remove_parts(folder: Path) -> None:
    """Remove files that killed runs did not finish."""
    for part in folder.rglob(".*.part"):
        part.unlink(missing_ok=True)
