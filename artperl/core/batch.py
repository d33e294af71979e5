"""Records of tensors that share their first dimension: one row per object, hypothesis or environment."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import torch
from torch import Tensor
from typing_extensions import Self


@dataclass(frozen=True, eq=False)
class Batch:
    """Base of records whose fields are tensors (or records of tensors) with the same number of rows.

    Every operation returns a new record and acts on all fields alike, so that objects, their poses and their
    observations can be selected, repeated for several starts, stacked and moved to a device together.
    """

    def __len__(self) -> int:
        return len(getattr(self, fields(self)[0].name))

    def map(self, change: Callable[[Tensor], Tensor]) -> Self:
        """The record with ``change`` applied to every tensor."""
        return replace(self, **{f.name: _apply(getattr(self, f.name), change) for f in fields(self)})

    def __getitem__(self, rows: Tensor | slice | list[int]) -> Self:
        """The chosen rows: a slice, indices or a mask."""
        return self.map(lambda tensor: tensor[rows])

    def repeat(self, times: int) -> Self:
        """Each row ``times`` times, neighbours together: several starts for every object."""
        return self.map(lambda tensor: tensor.repeat_interleave(times, dim=0))

    def where(self, mask: Tensor, other: Self) -> Self:
        """Rows of this record where ``mask (B,) bool`` holds, rows of ``other`` elsewhere."""

        def choose(mine: Any, others: Any) -> Any:
            if isinstance(mine, Batch):
                return mine.where(mask, others)
            return torch.where(mask.view(-1, *(1,) * (mine.ndim - 1)), mine, others)

        return replace(self, **{f.name: choose(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)})

    def to(self, target: torch.device | torch.dtype | str) -> Self:
        """On another device, or with another floating-point type (integers and masks keep theirs)."""
        if isinstance(target, torch.dtype):
            return self.map(lambda tensor: tensor.to(target) if tensor.is_floating_point() else tensor)
        return self.map(lambda tensor: tensor.to(target))

    def detach(self) -> Self:
        """Without the history of gradients."""
        return self.map(torch.Tensor.detach)


def _apply(value: Any, change: Callable[[Tensor], Tensor]) -> Any:
    return value.map(change) if isinstance(value, Batch) else change(value)


def concatenate(records: Sequence[Batch]) -> Any:
    """Rows of several records of one kind, one after the other."""
    first = records[0]
    columns = {f.name: [getattr(record, f.name) for record in records] for f in fields(first)}
    return replace(
        first,
        **{
            name: concatenate(column) if isinstance(column[0], Batch) else torch.cat(column)
            for name, column in columns.items()
        },
    )
