"""The processes that learn one run together: those that torchrun started, or this one alone.

All hold the same networks, and see the same batches: each makes its share of the clouds for all, and learns from its
share of the rows. Gradients are added up, so that a step is that of one process but for the order of sums.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, TypeVar

import torch
from torch import distributed, nn

from artperl.core.device import find_device

T = TypeVar("T")

_PATIENCE = timedelta(hours=6)
"""The others wait for as long while the first process validates, or learns boxes."""


@dataclass(frozen=True)
class Ranks:
    """This process among those of a run."""

    rank: int = 0
    count: int = 1
    """Its number, and how many there are. The first alone writes."""
    control: Any = None
    """For what is not gradients: records, clouds."""

    @staticmethod
    def started(device: str) -> tuple[Ranks, torch.device]:
        """The processes that torchrun started, and the device of this one; alone without torchrun.

        Raises
        ------
        ConfigError
            When the device is not there.
        """
        own = find_device(device)
        if not several_started():
            return Ranks(), own
        if own.type == "cuda":
            own = torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
            torch.cuda.set_device(own)
        if not distributed.is_initialized():
            _join("nccl" if own.type == "cuda" else "gloo")
        control = distributed.new_group(backend="gloo", timeout=_PATIENCE)
        return Ranks(distributed.get_rank(), distributed.get_world_size(), control), own

    @property
    def first(self) -> bool:
        """Whether this process writes."""
        return self.rank == 0

    def close(self) -> None:
        """Leave the others, at the end."""
        if self.count > 1 and distributed.is_initialized():
            distributed.destroy_process_group()

    def same(self, value: T, owner: int = 0) -> T:
        """The value that one of the processes has."""
        if self.count == 1:
            return value
        holder = [value]
        distributed.broadcast_object_list(holder, src=owner, group=self.control)
        return holder[0]

    def every(self, value: T) -> list[T]:
        """The values that the processes have, by their number."""
        if self.count == 1:
            return [value]
        values: list[Any] = [None] * self.count
        distributed.all_gather_object(values, value, group=self.control)
        return values

    def rows(self, total: int) -> slice:
        """The rows of a batch that this process learns from."""
        return slice(self.rank * total // self.count, (self.rank + 1) * total // self.count)

    def in_turn(self, own: Iterator[T]) -> Iterator[T]:
        """Items that the processes make in turn, each every ``count``-th, as all of them see them."""
        if self.count == 1:
            yield from own
        else:
            owner = 0
            while True:
                yield self.same(next(own) if owner == self.rank else None, owner)  # type: ignore[misc]
                owner = (owner + 1) % self.count

    def add_gradients(self, network: nn.Module) -> None:
        """Let every process have the sum of all gradients; what no process has a gradient of keeps none."""
        if self.count == 1:
            return
        parameters = [parameter for parameter in network.parameters() if parameter.requires_grad]
        there = parameters[0].new_tensor([p.grad is not None for p in parameters], dtype=torch.float32)
        flat = torch.cat([
            there, *((torch.zeros_like(p) if p.grad is None else p.grad).flatten().float() for p in parameters)
        ])  # fmt: skip
        distributed.all_reduce(flat)
        there, *gradients = flat.split([len(parameters), *(p.numel() for p in parameters)])
        for parameter, has, gradient in zip(parameters, there.tolist(), gradients, strict=True):
            parameter.grad = gradient.view_as(parameter).to(parameter.dtype) if has else None

    def add(self, values: Sequence[float]) -> list[float]:
        """Sums over all processes."""
        if self.count == 1:
            return list(values)
        total = torch.tensor(values, dtype=torch.float64)
        distributed.all_reduce(total, group=self.control)
        return total.tolist()


def _join(backend: str) -> None:
    """Meet the other processes.

    torchrun may keep its store when it starts processes again. The addresses of those that died are still in it, so
    that each start has keys of its own.
    """
    store, rank, count = next(distributed.rendezvous("env://", timeout=_PATIENCE))  # type: ignore[attr-defined]
    start = os.environ.get("TORCHELASTIC_RESTART_COUNT", "0")
    own = distributed.PrefixStore(f"start {start}", store)  # type: ignore[attr-defined]
    distributed.init_process_group(backend, store=own, rank=rank, world_size=count, timeout=_PATIENCE)


def several_started() -> bool:
    """Whether torchrun has started this process beside others."""
    return os.environ.get("WORLD_SIZE", "1") != "1" and "RANK" in os.environ


ALONE = Ranks()
"""One process that learns by itself."""
