"""dataset -> workers -> files: convert a finished dataset on local processes, resumably.

``conversion.json`` is written last, with the checksum of every file; see :mod:`artsim.runs.tasks`.
"""

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args

from artsim.common.files import file_sha256
from artsim.common.names import name_fix
from artsim.datasets.dataset import Dataset
from artsim.datasets.description import DESCRIPTION
from artsim.datasets.shards import sample_key
from artsim.datasets.splits import SPLITS
from artsim.errors import ConfigError
from artsim.formats.base import Format, FormatName, Piece
from artsim.formats.bop import BopFormat
from artsim.formats.coco import CocoFormat
from artsim.formats.gapartnet import GapartnetFormat
from artsim.formats.hdf5 import Hdf5Format
from artsim.formats.huggingface import HuggingFaceFormat
from artsim.formats.op_align import OpAlignFormat
from artsim.formats.particulate import ParticulateFormat
from artsim.formats.singapo import SingapoFormat
from artsim.formats.two_state import TwoStateFormat
from artsim.formats.webdataset import WebDatasetFormat
from artsim.model.ply import cloud_ply
from artsim.observing.sample import Sample
from artsim.runs.recipe import check_counts
from artsim.runs.tasks import Output, Run, Task, run_tasks
from artsim.runs.worker import report, stop_if_asked


class PlyFormat(Format):
    """``<split>/<index>.ply``: one cloud for each sample, coloured by part, camera frame, metres."""

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write one file for each sample."""
        for sample in samples:
            output.write(f"{piece.split}/{sample_key(sample.index)}.ply", cloud_ply(sample.points, sample.part))


FORMATS: dict[FormatName, Format] = {
    "webdataset": WebDatasetFormat(),
    "bop": BopFormat(),
    "coco": CocoFormat(),
    "hdf5": Hdf5Format(),
    "ply": PlyFormat(),
    "huggingface": HuggingFaceFormat(),
    "op-align": OpAlignFormat(),
    "particulate": ParticulateFormat(),
    "singapo": SingapoFormat(),
    "gapartnet": GapartnetFormat(),
    "two-state": TwoStateFormat(),
}

DONE = "conversion.json"
_VERSION = 1
"""Of what is written: another one is another conversion."""

_OBJECTS_AT_ONCE = 16


@dataclass(frozen=True)
class ConvertResult:
    """What a call of :func:`convert` did.

    Attributes
    ----------
    folder : Path
    num_samples : int
        Of the whole conversion; objects, in a format of objects alone.
    made : int
        Those converted by this call.
    unit : str
        What is counted: "sample" or "object".
    files : int
        Of the whole conversion, without ``conversion.json``.
    seconds : float
    """

    folder: Path
    num_samples: int
    made: int
    files: int
    seconds: float
    unit: str = "sample"


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
    """Convert a finished dataset, or resume a conversion that was stopped.

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
        raise ConfigError(f"there is no format {to!r:.40}", "to", name_fix(to, FORMATS))
    if split not in (None, *SPLITS):
        raise ConfigError(f"there is no split {split!r:.40}", "split", f"use one of {', '.join(SPLITS)}")
    check_counts(group=group, workers=workers)
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
    counted = FORMATS[to].converts_samples
    sizes = {piece.name: len(piece.members) if bool(piece.split) == counted else 0 for piece in pieces}
    tasks = {piece.name: Task(convert_piece, (source.folder, to, piece), sizes[piece.name]) for piece in pieces}

    def finish(values: dict[str, Any], output: Output) -> None:
        FORMATS[to].finish(source, [(piece, values[piece.name]) for piece in pieces], output)

    run = Run(folder, recipe, DONE, "conversion", "sample" if counted else "object", progress=progress)
    files, made = run_tasks(run, tasks, workers, finish)
    return ConvertResult(folder, sum(sizes.values()), made, len(files), time.perf_counter() - start, run.unit)


def _pieces(source: Dataset, to: FormatName, split: str | None, samples: Sequence[int], group: int) -> list[Piece]:
    """All pieces: objects first, then each split in order."""
    chosen, plan = set(samples), source.plan
    members: dict[str, list[int]] = {name: [] for name in SPLITS}
    shown, seen = set(), set()
    for position, (own, index) in enumerate((s.split, index) for s in source.shards for index in plan.indices(s)):
        if split in (None, own) and (not chosen or index in chosen):
            members[own].append(position)
            shown.add(plan.object_of(index).key)
            seen.add(index)
    if chosen - seen:
        raise ConfigError(
            f"there is no sample {min(chosen - seen)}" + (f" in split {split}" if split else ""),
            "samples",
            f"name some of 0 to {plan.num_samples - 1}" + (", or no split" if split else ""),
        )
    pieces = []
    if FORMATS[to].converts_objects:
        pieces += _cut("", [i for i, planned in enumerate(plan.objects) if planned.key in shown], _OBJECTS_AT_ONCE)
    for name, positions in members.items() if FORMATS[to].converts_samples else ():
        pieces += _cut(name, positions, group)
    return pieces


def _cut(split: str, members: Sequence[int], size: int) -> list[Piece]:
    starts = range(0, len(members), size)
    return [Piece(split, i, tuple(members[start : start + size])) for i, start in enumerate(starts)]


_opened = lru_cache(maxsize=1)(Dataset)
"""What a worker reads, opened once."""


def convert_piece(output: Output, source: Path, to: FormatName, piece: Piece) -> Any:
    """The task of a piece: write its files."""
    dataset = _opened(source)
    if piece.split:
        return FORMATS[to].write_samples(dataset, piece, _read(dataset, piece), output)
    return FORMATS[to].write_objects(dataset, piece, output)


def _read(dataset: Dataset, piece: Piece) -> Iterator[Sample]:
    for position in piece.members:
        stop_if_asked()
        yield dataset[position]
        report(1)
