"""Datasets on disk: length, random access, verification, and an endless on-line stream of the same distribution."""

from __future__ import annotations

import bisect
import os
from collections import OrderedDict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.datasets.description import read_description
from artsim.datasets.plan import Plan, PlannedObject, ShardRecord
from artsim.datasets.problems import repair_command
from artsim.datasets.sample_options import draw_sample
from artsim.datasets.shards import ShardReader, sample_key
from artsim.datasets.splits import SPLITS
from artsim.datasets.summary import summary
from artsim.errors import ConfigError, DatasetError
from artsim.model.kinematics import JOINT_TYPES
from artsim.model.object_file import ObjectCache
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.renderers import Renderer, make_renderer

_OPEN_SHARDS = 64
_FAR = 1_000_000_007


class Dataset:
    """Random access to the samples of one split, or of all: ``len(ds)``, ``ds[i]``, iteration.

    It can be given to a torch ``DataLoader`` (which wants :meth:`padded`, so that samples of objects with different
    numbers of parts stack) and pickled to its workers; torch itself is not imported. Samples come in the order of the
    shards, in which several views of few objects lie together: shuffle for training.

    Parameters
    ----------
    folder : path
        Folder that ``generate.py`` wrote.
    split : str, optional
        "train", "val" or "test"; all samples by default.

    Raises
    ------
    DatasetError
        When the folder holds no complete dataset.
    """

    def __init__(self, folder: str | Path, split: str | None = None):
        self.folder = Path(folder)
        self.plan, shards, self.description = read_description(self.folder)
        if split is not None and split not in SPLITS:
            raise ConfigError(f"there is no split {split!r}", fix=f"use one of {', '.join(SPLITS)}")
        self.split = split
        self.shards = [s for s in shards if split in (None, s.split)]
        self._ends = np.cumsum([s.end - s.first for s in self.shards]).tolist()
        self._readers: OrderedDict[str, ShardReader] = OrderedDict()
        self._owner = os.getpid()
        self.objects = ObjectCache(self.folder / "objects")

    def __len__(self) -> int:
        return self._ends[-1] if self._ends else 0

    def __getitem__(self, i: int) -> Sample:
        if not -len(self) <= i < len(self):
            raise IndexError(f"sample {i} of {len(self)}")
        shard, index = self._place(int(i) % len(self))
        return self._reader(shard.name).read(sample_key(index))

    def _place(self, i: int) -> tuple[ShardRecord, int]:
        """Shard and number in the whole dataset of sample ``i``."""
        s = bisect.bisect_right(self._ends, i)
        shard = self.shards[s]
        return shard, self.plan.index_at(shard.split, shard.end - (self._ends[s] - i))

    def __str__(self) -> str:
        """What it holds, on one screen."""
        return summary(self.folder, self.plan, self.shards, self.description, self.split)

    def __repr__(self) -> str:
        split = "" if self.split is None else f", split={self.split!r}"
        return f"<Dataset {str(self.folder)!r}{split}: {len(self)} samples of {len(self.plan.objects)} objects>"

    def __iter__(self) -> Iterator[Sample]:
        return (self[i] for i in range(len(self)))

    def _reader(self, name: str) -> ShardReader:
        if self._owner != os.getpid():  # forked: a shared file position would mix up reads
            self._readers, self._owner = OrderedDict(), os.getpid()
        if name not in self._readers:
            self._readers[name] = ShardReader(self.folder / name, repair_command(self.folder))
            if len(self._readers) > _OPEN_SHARDS:
                self._readers.popitem(last=False)[1].close()
        self._readers.move_to_end(name)
        return self._readers[name]

    def __getstate__(self) -> dict[str, Any]:
        return {"folder": self.folder, "split": self.split}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["folder"], state["split"])  # type: ignore[misc]

    def object_key(self, i: int) -> str:
        """Name, unique in the dataset, of the object that sample ``i`` shows, without reading it."""
        return self.planned(self._place(i)[1]).key

    def planned(self, index: int) -> PlannedObject:
        """What the plan says of the object that the sample of an index shows.

        Raises
        ------
        DatasetError
            When the dataset has no such sample.
        """
        try:
            return self.plan.object_of(index)
        except IndexError as error:
            raise DatasetError(f"it has no sample {index}", self.folder, repair_command(self.folder)) from error

    def object_of(self, sample: Sample) -> ArticulatedObject:
        """The object that a sample shows, at the sample's scale."""
        return self.objects[self.planned(sample.index).key].scaled(sample.scale)

    def padded(self, max_parts: int | None = None) -> PaddedDataset:
        """View as dictionaries of arrays of one shape, which default collation stacks.

        Parameters
        ----------
        max_parts : int, optional
            Rows of per-part arrays; by default the most parts of any object of the dataset.
        """
        return PaddedDataset(self, max_parts or max(o.num_parts for o in self.plan.objects))

    def stream(self, split: str = "train", seed: int | None = None, start: int = 0, step: int = 1) -> SampleStream:
        """Fresh samples of a split's objects for ever, drawn like this dataset's but with another seed.

        Parameters
        ----------
        split : str
        seed : int, optional
            By default far from the dataset's, so that no sample of it, or of one with a neighbouring seed, comes back.
        start, step : int
            See :class:`SampleStream`.
        """
        return SampleStream(self.plan, self.folder, split, self.plan.seed + _FAR if seed is None else seed, start, step)


class PaddedDataset:
    """Samples as dictionaries of equally shaped arrays; rows beyond a sample's parts are zero.

    ``part_valid (P,) bool`` marks the rows that are parts; ``joint_type (P,) int64`` indexes
    ``artsim.model.kinematics.JOINT_TYPES``; infinite limits stay infinite.
    """

    def __init__(self, dataset: Dataset, max_parts: int):
        self.dataset = dataset
        self.max_parts = max_parts

    def __len__(self) -> int:
        return len(self.dataset)

    def __getitem__(self, i: int) -> dict[str, NDArray[Any]]:
        return pad_sample(self.dataset[i], self.max_parts)


_PER_PART = (
    "T_camera_part", "box_center", "box_size", "visible_fraction", "joint_parent", "joint_axis", "joint_origin",
    "joint_axis_camera", "joint_origin_camera", "joint_state", "joint_rest", "joint_limits",
)  # fmt: skip


def pad_sample(sample: Sample, max_parts: int) -> dict[str, NDArray[Any]]:
    """A sample as arrays whose shapes do not depend on its number of parts.

    Raises
    ------
    ConfigError
        When the sample has more parts than rows.
    """
    num_parts = len(sample.joint_type)
    if num_parts > max_parts:
        raise ConfigError(f"{num_parts} parts do not fit {max_parts} rows", "max_parts", f"use at least {num_parts}")

    def pad(array: NDArray[Any]) -> NDArray[Any]:
        rows: NDArray[Any] = np.zeros((max_parts, *array.shape[1:]), dtype=array.dtype)
        rows[:num_parts] = array
        return rows

    arrays = {name: pad(getattr(sample, name)) for name in _PER_PART}
    arrays["joint_type"] = pad(np.array([JOINT_TYPES.index(t) for t in sample.joint_type], dtype=np.int64))
    arrays["part_valid"] = np.arange(max_parts) < num_parts
    arrays |= {name: getattr(sample, name) for name in ("points", "part", "npcs", "K", "T_world_camera")}
    arrays |= {name: np.asarray(getattr(sample, name)) for name in ("scale", "diagonal", "index", "width", "height")}
    arrays |= {name: image for name in ("depth", "part_mask", "rgb") if (image := getattr(sample, name)) is not None}
    return arrays


class SampleStream:
    """Endless on-line source: sample ``i`` is made when asked for, and is always the same.

    Iterating yields samples ``start``, ``start + step``, ...; give each training process its own ``start`` and a common
    ``step``. Indexing makes any one.

    Parameters
    ----------
    plan : Plan
    folder : Path
        Dataset folder that holds the objects.
    split : str
    seed : int
    start, step : int
    """

    def __init__(self, plan: Plan, folder: Path, split: str = "train", seed: int = 1, start: int = 0, step: int = 1):
        if split not in SPLITS or not plan.objects_of[split]:
            raise ConfigError(f"split {split!r} has no objects", fix="choose one that has, or other shares")
        if seed < 0 or start < 0 or step < 1:
            raise ConfigError(f"a stream has no seed {seed}, start {start}, step {step}", fix="count from 0 upwards")
        self.plan, self.split, self.seed, self.start, self.step = plan, split, seed, start, step
        self.objects = ObjectCache(Path(folder) / "objects")
        self._renderer: Renderer | None = None

    def __getitem__(self, i: int) -> Sample:
        if i < 0:
            raise IndexError(f"sample {i} of an endless stream")
        if self._renderer is None:
            self._renderer = make_renderer(self.plan.sample.renderer)
        planned = self.plan.object_in_split(self.split, i)
        return draw_sample(self.objects[planned.key], self.plan.sample, self.seed, i, self._renderer)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "objects": ObjectCache(self.objects.folder), "_renderer": None}

    def __iter__(self) -> Iterator[Sample]:
        i = self.start
        while True:
            yield self[i]
            i += self.step


def open_dataset(folder: str | Path, split: str | None = None) -> Dataset:
    """Open a dataset that ``generate.py`` wrote; see :class:`Dataset`."""
    return Dataset(folder, split)
