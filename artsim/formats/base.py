"""What a format is: which samples go into which file, and what is written for them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from artsim.datasets.dataset import Dataset
from artsim.datasets.sample_options import SampleOptions
from artsim.errors import ConfigError
from artsim.observing.sample import Sample
from artsim.runs.tasks import Output

FormatName = Literal["webdataset", "bop", "coco", "hdf5", "ply"]


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
