"""Endless sources in training loops: each process takes its own share, so that nothing comes twice.

Nothing here imports torch. A process that has not imported it is no worker of a loader and has no process group.
"""

from __future__ import annotations

import sys
from typing import Any

NO_LENGTH = (
    "an endless stream has no length. Fix: import torch before you make the stream, so that a DataLoader takes it for "
    "an IterableDataset; then leave out sampler and shuffle"
)


def register_with_torch(cls: type) -> None:
    """Let loaders take a class for an ``IterableDataset``, if torch is there."""
    data = sys.modules.get("torch.utils.data")
    if data is not None and not issubclass(cls, data.IterableDataset):
        data.IterableDataset.register(cls)


def process_rank() -> tuple[int, int]:
    """Rank of this process in torch's process group, and how many there are; (0, 1) without one."""
    distributed: Any = sys.modules.get("torch.distributed")
    if distributed is None or not distributed.is_available() or not distributed.is_initialized():
        return 0, 1
    return int(distributed.get_rank()), int(distributed.get_world_size())


def share_of(rank: tuple[int, int]) -> tuple[int, int]:
    """The share of this worker of a loader: its number, and the number of shares over all loaders.

    Parameters
    ----------
    rank : (int, int)
        Of the process that the loader belongs to, see :func:`process_rank`.
    """
    data: Any = sys.modules.get("torch.utils.data")
    info = None if data is None else data.get_worker_info()
    worker, workers = (0, 1) if info is None else (info.id, info.num_workers)
    return rank[0] * workers + worker, rank[1] * workers
