"""Datasets on disk: length, random access, verification, and an endless on-line stream of the same distribution."""

from __future__ import annotations

import bisect
import os
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from artsim.common.sharding import Shared, process_rank
from artsim.datasets.description import read_description
from artsim.datasets.object_cache import ObjectCache
from artsim.datasets.plan import Plan, PlannedObject, ShardRecord
from artsim.datasets.problems import repair_command
from artsim.datasets.sample_options import DrawnStream
from artsim.datasets.shards import ShardReader, sample_key
from artsim.datasets.splits import SPLITS
from artsim.datasets.summary import summary
from artsim.errors import ConfigError, DatasetError
from artsim.model.objects import ArticulatedObject
from artsim.observing.padding import PaddedDataset, PaddedStream, refuse_collation
from artsim.observing.sample import Sample
from artsim.runs.storage import FolderStorage, Place, storage_of

_OPEN_SHARDS = 64
"""Files that are open at most, of the least recently read shards the first to be closed. Their indices are kept."""
_FAR = 1_000_000_007
_SHARDS_AT_ONCE = 8
"""By default 2,048 samples of 128 objects, 120 MB, are mixed."""


class Dataset:
    """Random access to the samples of one split, or of all: ``len(ds)``, ``ds[i]``, iteration.

    It can be given to a torch ``DataLoader`` (which wants :meth:`padded`, so that samples of objects with different
    numbers of parts stack) and pickled to its workers; torch itself is not imported. Samples come in the order of the
    shards, in which several views of few objects lie together: shuffle for training.

    Parameters
    ----------
    folder : path or str
        Folder that ``artsim generate`` wrote, or URL for fsspec, such as ``s3://bucket/first``.
    split : str, optional
        "train", "val" or "test"; all samples by default.

    Raises
    ------
    DatasetError
        When the folder holds no complete dataset.
    """

    def __init__(self, folder: Place, split: str | None = None):
        self.storage = storage_of(folder)
        self.plan, shards, self.description = read_description(self.storage)
        if split is not None and split not in SPLITS:
            raise ConfigError(f"there is no split {split!r}", fix=f"use one of {', '.join(SPLITS)}")
        self.split = split
        self.shards = [s for s in shards if split in (None, s.split)]
        self._ends = np.cumsum([s.end - s.first for s in self.shards]).tolist()
        self._readers: dict[str, ShardReader] = {}
        self._open: OrderedDict[str, ShardReader] = OrderedDict()
        self._owner, self.fix = os.getpid(), repair_command(self.storage.place)
        self.objects = ObjectCache(self.storage)

    @property
    def folder(self) -> Path:
        """Where it lies.

        Raises
        ------
        ConfigError
            When that is a URL.
        """
        if not isinstance(self.storage, FolderStorage):
            raise ConfigError("this needs a dataset in a folder", self.storage.place, "copy it to a disk")
        return self.storage.folder

    def __len__(self) -> int:
        return self._ends[-1] if self._ends else 0

    def __getitem__(self, i: int) -> Sample:
        if not -len(self) <= i < len(self):
            raise IndexError(f"sample {i} of {len(self)}")
        shard, index = self._place(int(i) % len(self))
        return self._reader(shard).read(sample_key(index))

    def __getitems__(self, indices: list[int]) -> list[Sample]:
        """A batch, as a torch ``DataLoader`` asks for it."""
        refuse_collation()
        return [self[i] for i in indices]

    def _place(self, i: int) -> tuple[ShardRecord, int]:
        """Shard and number in the whole dataset of sample ``i``."""
        s = bisect.bisect_right(self._ends, i)
        shard = self.shards[s]
        return shard, self.plan.index_at(shard.split, shard.end - (self._ends[s] - i))

    def __str__(self) -> str:
        """What it holds, on one screen."""
        return summary(self.storage.place, self.plan, self.shards, self.description, self.split)

    def __repr__(self) -> str:
        split = "" if self.split is None else f", split={self.split!r}"
        return f"<Dataset {self.storage.place!r}{split}: {len(self)} samples of {len(self.all_planned)} objects>"

    def __iter__(self) -> Iterator[Sample]:
        return (self[i] for i in range(len(self)))

    def _reader(self, shard: ShardRecord) -> ShardReader:
        name = shard.name
        if self._owner != os.getpid():  # forked: a shared file position would mix up reads
            for opened in self._open.values():
                opened.close()
            self._open, self._owner = OrderedDict(), os.getpid()
        if name not in self._readers:
            self._readers[name] = ShardReader.at(self.storage, name, shard.bytes, shard.sha256, self.fix)
        reader = self._readers[name]
        self._open[name] = reader
        self._open.move_to_end(name)
        if len(self._open) > _OPEN_SHARDS:
            self._open.popitem(last=False)[1].close()
        return reader

    def __reduce__(self) -> tuple[Any, ...]:
        return Dataset, (self.storage, self.split)

    def object_key(self, i: int) -> str:
        """Name, unique in the dataset, of the object that sample ``i`` shows, without reading it."""
        return self.planned(self._place(i)[1]).key

    @property
    def all_planned(self) -> Sequence[PlannedObject]:
        """What the plan says of the objects of this split."""
        return self.plan.objects if self.split is None else self.plan.objects_of[self.split]

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
            raise DatasetError(f"it has no sample {index}", self.storage.place, self.fix) from error

    def object_of(self, sample: Sample) -> ArticulatedObject:
        """The object that a sample shows, at the sample's scale."""
        return self.objects[self.planned(sample.index).file].scaled(sample.scale)

    def padded(self, max_parts: int | None = None, float32: bool = True) -> PaddedDataset:
        """View as dictionaries of arrays of one shape, which default collation stacks.

        Parameters
        ----------
        max_parts : int, optional
            Rows of per-part arrays; by default the most parts of any object of the dataset.
        float32 : bool
            Poses, boxes, joints and cameras in single precision.
        """
        return PaddedDataset(self, max_parts or self.plan.max_parts, float32)

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
        return SampleStream(
            self.plan, self.storage, split, self.plan.seed + _FAR if seed is None else seed, start, step
        )

    def shuffled(self, seed: int = 0) -> EpochStream:
        """Every sample once in each epoch, in a random order; read shard by shard, as object storage wants it."""
        return EpochStream(self, seed)


class SampleStream(DrawnStream):
    """Endless on-line source of samples of a dataset's objects, of one view at a time.

    Parameters
    ----------
    plan : Plan
    place : path, str or Storage
        Of the dataset that holds the objects.
    split : str
    seed, start, step : int
        See :class:`artsim.datasets.sample_options.DrawnStream`.
    """

    def __init__(self, plan: Plan, place: Place, split: str = "train", seed: int = 1, start: int = 0, step: int = 1):
        if split not in SPLITS or not plan.objects_of[split]:
            raise ConfigError(f"split {split!r} has no objects", fix="choose one that has, or other shares")
        super().__init__(plan.sample, seed, 1, start, step)
        self.plan, self.split, self.objects = plan, split, ObjectCache(place)

    def padded(self, max_parts: int | None = None, float32: bool = True) -> PaddedStream:
        """The stream as dictionaries of arrays of one shape; see :meth:`Dataset.padded`."""
        return PaddedStream(self, max_parts or self.plan.max_parts, float32)

    def object(self, n: int) -> ArticulatedObject:
        """The object at a turn of the split's rotation."""
        return self.objects[self.plan.object_in_split(self.split, n).file]


def open_dataset(folder: str | Path, split: str | None = None) -> Dataset:
    """Open a dataset that ``artsim generate`` wrote, in a folder or at a URL; see :class:`Dataset`."""
    return Dataset(folder, split)


class EpochStream(Shared):
    """Every sample of a dataset once in each epoch, in a random order that depends on (seed, epoch) and on the shares.

    The shards of a split are put into a new order for each epoch. Nodes and workers take equal stretches of it: at
    their ends two of them share a shard. Within its stretch, each holds a few shards at once and mixes their samples.

    Iterating goes through one epoch. Workers of a torch ``DataLoader``, and processes of its process group, share it
    out by themselves, each with as many samples as the others, give or take one. Call :meth:`set_epoch` before each
    epoch, and leave ``persistent_workers`` off.

    Parameters
    ----------
    dataset : Dataset
    seed : int
    shards_at_once : int
        Shards whose samples are mixed. Of a dataset at a URL, so many are in memory.
    """

    def __init__(self, dataset: Dataset, seed: int = 0, shards_at_once: int = _SHARDS_AT_ONCE):
        if seed < 0 or shards_at_once < 1:
            raise ConfigError(f"there is no seed {seed}, or {shards_at_once} shards", fix="use 0 or more, 1 or more")
        self.dataset, self.seed, self.shards_at_once, self.epoch = dataset, seed, shards_at_once, 0

    def set_epoch(self, epoch: int) -> None:
        """Which epoch the next iteration goes through: another one has another order."""
        self.epoch = epoch

    def padded(self, max_parts: int | None = None, float32: bool = True) -> PaddedStream:
        """The stream as dictionaries of arrays of one shape; see :meth:`artsim.datasets.dataset.Dataset.padded`."""
        return PaddedStream(self, max_parts or self.dataset.plan.max_parts, float32)

    def __len__(self) -> int:
        """Samples of this process in an epoch, those of all its workers together."""
        rank, ranks = self._rank or process_rank()
        return _bound(len(self.dataset), rank + 1, ranks) - _bound(len(self.dataset), rank, ranks)

    def __getitem__(self, i: int) -> Sample:
        return self.dataset[i]

    def __iter__(self) -> Iterator[Sample]:
        refuse_collation()
        share, shares = self._share()
        rng = np.random.default_rng([self.seed, self.epoch, share, shares])
        pieces = list(self._pieces(share, shares))
        for first in range(0, len(pieces), self.shards_at_once):
            mixed = pieces[first : first + self.shards_at_once]
            dataset = self.dataset
            readers = [
                (ShardReader.at(dataset.storage, s.name, s.bytes, s.sha256, dataset.fix, in_memory=True), s, places)
                for s, places in mixed
            ]
            samples = [(reader, shard, place) for reader, shard, places in readers for place in places]
            for number in rng.permutation(len(samples)):
                reader, shard, place = samples[number]
                yield reader.read(sample_key(dataset.plan.index_at(shard.split, place)))
            for reader, _, _ in readers:
                reader.close()

    def _pieces(self, share: int, shares: int) -> Iterator[tuple[ShardRecord, range]]:
        """Shards of a share in the order of the epoch, and which places of their splits are its own."""
        total = len(self.dataset)
        start, end = _bound(total, share, shares), _bound(total, share + 1, shares)
        at = 0
        for number in np.random.default_rng([self.seed, self.epoch]).permutation(len(self.dataset.shards)):
            shard = self.dataset.shards[number]
            first, last = max(start - at, 0), min(end - at, len(shard))
            if first < last:
                yield shard, range(shard.first + first, shard.first + last)
            at += len(shard)


def _bound(total: int, share: int, shares: int) -> int:
    """Where a share begins: the shares of a process's workers make up that of the process."""
    return total * share // shares
