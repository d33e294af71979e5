"""Endless sources in training loops: each process takes its own share, so that nothing comes twice.

Nothing here imports torch. A process that has not imported it is no worker of a loader and has no process group.
"""

import sys
from typing import Any

from typing_extensions import Self

NO_LENGTH = (
    "an endless stream has no length. Fix: import torch before you make the stream, so that a DataLoader takes it for "
    "an IterableDataset; then leave out sampler and shuffle"
)


class Shared:
    """A stream that loaders of torch take for an ``IterableDataset``: processes and workers share it out."""

    _rank: tuple[int, int] | None = None
    """Of the process that hands it to workers, which have no group."""

    def __new__(cls, *arguments: object, **more: object) -> Self:
        """Also of what is unpickled: torch may be there since."""
        data = sys.modules.get("torch.utils.data")
        if data is not None and not issubclass(cls, data.IterableDataset):
            data.IterableDataset.register(cls)
        return super().__new__(cls)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_rank": self._rank or process_rank(), "_renderer": None}

    def __len__(self) -> int:
        raise TypeError(NO_LENGTH)

    def _share(self) -> tuple[int, int]:
        """The share of this process, or of this worker of a loader: its number, and the number of all shares."""
        data: Any = sys.modules.get("torch.utils.data")
        info = None if data is None else data.get_worker_info()
        worker, workers = (0, 1) if info is None else (info.id, info.num_workers)
        rank, ranks = self._rank or process_rank()
        return rank * workers + worker, ranks * workers


def process_rank() -> tuple[int, int]:
    """Rank of this process in torch's process group, and how many there are; (0, 1) without one."""
    distributed: Any = sys.modules.get("torch.distributed")
    if distributed is None or not distributed.is_available() or not distributed.is_initialized():
        return 0, 1
    return int(distributed.get_rank()), int(distributed.get_world_size())
