"""A dataset as a shuffled stream: whole shards are read, as object storage wants it.

The shards of a split are put into a new order for each epoch. Nodes and workers take equal stretches of that order: at
their ends two of them share a shard. Within its stretch, each holds a few shards at once and mixes their samples.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from artsim.common.sharding import process_rank, register_with_torch, share_of
from artsim.common.storage import FolderStorage
from artsim.datasets.padding import PaddedStream
from artsim.datasets.plan import ShardRecord
from artsim.datasets.shards import ShardReader, sample_key
from artsim.errors import ConfigError
from artsim.observing.sample import Sample

if TYPE_CHECKING:
    from artsim.datasets.dataset import Dataset

_SHARDS_AT_ONCE = 8
"""By default 2,048 samples of 128 objects, 120 MB, are mixed."""


class EpochStream:
    """Every sample of a dataset once in each epoch, in a random order that depends on (seed, epoch) and on the shares.

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
        self._rank: tuple[int, int] | None = None
        register_with_torch(EpochStream)

    def set_epoch(self, epoch: int) -> None:
        """Which epoch the next iteration goes through: another one has another order."""
        self.epoch = epoch

    def padded(self, max_parts: int | None = None, float32: bool = False) -> PaddedStream:
        """The stream as dictionaries of arrays of one shape; see :meth:`artsim.datasets.dataset.Dataset.padded`."""
        return PaddedStream(self, max_parts or max(o.num_parts for o in self.dataset.plan.objects), float32)

    def __len__(self) -> int:
        """Samples of this process in an epoch, those of all its workers together."""
        rank, ranks = self._rank or process_rank()
        return _bound(len(self.dataset), rank + 1, ranks) - _bound(len(self.dataset), rank, ranks)

    def __getitem__(self, i: int) -> Sample:
        return self.dataset[i]

    def __iter__(self) -> Iterator[Sample]:
        share, shares = share_of(self._rank or process_rank())
        rng = np.random.default_rng([self.seed, self.epoch, share, shares])
        pieces = list(self._pieces(share, shares))
        for first in range(0, len(pieces), self.shards_at_once):
            mixed = pieces[first : first + self.shards_at_once]
            readers = [(self._reader(shard), shard, places) for shard, places in mixed]
            samples = [(reader, shard, place) for reader, shard, places in readers for place in places]
            for number in rng.permutation(len(samples)):
                reader, shard, place = samples[number]
                yield reader.read(sample_key(self.dataset.plan.index_at(shard.split, place)))
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

    def _reader(self, shard: ShardRecord) -> ShardReader:
        """A shard: of a folder as a file, of a URL as a whole, whose checksum is compared."""
        storage, fix = self.dataset.storage, self.dataset.fix
        if isinstance(storage, FolderStorage):
            return ShardReader(storage.folder / shard.name, fix)
        return ShardReader.of_bytes(storage, shard.name, shard.bytes, shard.sha256, fix)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_rank": self._rank or process_rank()}  # workers have no group

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        register_with_torch(EpochStream)


def _bound(total: int, share: int, shares: int) -> int:
    """Where a share begins: the shares of a process's workers make up that of the process."""
    return total * share // shares
