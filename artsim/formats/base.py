"""What a format is: which samples go into which file, and what is written for them."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import orjson

from artsim.datasets.dataset import Dataset
from artsim.datasets.sample_options import SampleOptions
from artsim.errors import ConfigError
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.runs.tasks import Output
from artsim.runs.worker import report, stop_if_asked

FormatName = Literal[
    "webdataset", "bop", "coco", "hdf5", "ply", "huggingface", "op-align", "particulate", "singapo", "gapartnet",
    "two-state",
]  # fmt: skip


@dataclass(frozen=True)
class Piece:
    """What is converted at once, and is either finished or done again."""

    split: str
    """Of its samples; empty for objects."""
    number: int
    """Within its split, from 0."""
    members: tuple[int, ...]
    """Positions of its samples in the whole dataset, or of its objects in the plan."""

    @property
    def name(self) -> str:
        """Unique within a conversion."""
        return f"{self.split or 'objects'}-{self.number:06d}"


class Format:
    """A format that a dataset can be converted to. All methods but ``check`` run after it."""

    converts_objects = False
    """Whether the objects become files of their own."""
    converts_samples = True

    def check(self, options: SampleOptions, folder: Path) -> None:
        """Refuse a dataset, made or yet to be made, whose samples lack what the format needs.

        Raises
        ------
        ConfigError
        """

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write the files of a piece. What it returns is JSON, and goes to :meth:`finish`."""
        raise NotImplementedError

    def write_objects(self, dataset: Dataset, piece: Piece, output: Output) -> Any:
        """Write the files of some objects of the plan; as :meth:`write_samples`."""
        raise NotImplementedError

    def finish(self, dataset: Dataset, answers: Sequence[tuple[Piece, Any]], output: Output) -> None:
        """Write the files that need to know of all pieces, given in order with what was returned for each."""


class ObjectFormat(Format):
    """A format of objects alone, at native size: a folder for each, by its key, and the splits."""

    converts_objects, converts_samples = True, False

    def write_objects(self, dataset: Dataset, piece: Piece, output: Output) -> Any:
        """Write the files of each object; the answer has their keys by split."""
        written: dict[str, list[str]] = {}
        for number in piece.members:
            stop_if_asked()
            planned = dataset.plan.objects[number]
            for name, data in self.object_files(dataset.objects[planned.file]):
                output.write(f"{planned.key}/{name}", data)
            written.setdefault(planned.split, []).append(planned.key)
            report(1)
        return written

    def object_files(self, obj: ArticulatedObject) -> Iterator[tuple[str, bytes]]:
        """Name and content of each file of an object."""
        raise NotImplementedError

    def finish(self, dataset: Dataset, answers: Sequence[tuple[Piece, Any]], output: Output) -> None:
        """Write ``data_split.json``: the folders of each split."""
        splits: dict[str, list[str]] = {}
        for _, written in answers:
            for split, keys in written.items():
                splits.setdefault(split, []).extend(keys)
        output.write("data_split.json", orjson.dumps(splits, option=orjson.OPT_INDENT_2 | orjson.OPT_SORT_KEYS))


def require_images(options: SampleOptions, folder: Path, name: str, images: Sequence[str]) -> None:
    """Refuse a dataset, by its options and folder, without some images.

    Raises
    ------
    ConfigError
        Which says how to generate it with them.
    """
    have = options.images
    missing = [image for image in images if image not in have]
    if missing:
        wanted = " ".join(image for image in ("depth", "part_mask", "rgb") if image in {*images, *have})
        raise ConfigError(
            f"{name} needs images, and the dataset has no {' and no '.join(missing)}",
            folder,
            f"generate it into another folder with --images {wanted} (rgb also wants --renderer sapien or pybullet)",
        )
