"""Datasets of format 1, which artsim wrote until November 2026: they open and verify, and are not gone on with.

There, every split had a range of sample indices, and which object a sample shows depended on the number of samples.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from artsim.datasets.plan import Plan, PlannedObject, Shard
from artsim.datasets.splits import SPLITS

_OBJECTS_AT_ONCE = 16
_VIEWS_IN_A_ROW = 16


class PlanFormat1(Plan):
    """A plan of format 1. Places of a split are indices of samples."""

    format = 1

    @cached_property
    def ranges(self) -> dict[str, tuple[int, int]]:
        """First and end index of each split's samples."""
        ends = np.cumsum([len(self.objects_of[split]) for split in SPLITS])
        ends = np.round(self.num_samples * ends / len(self.objects)).astype(int)
        starts = [0, *ends[:-1]]
        return {split: (int(s), int(e)) for split, s, e in zip(SPLITS, starts, ends, strict=True)}

    @cached_property
    def sizes(self) -> dict[str, int]:
        return {split: end - first for split, (first, end) in self.ranges.items()}

    def object_of(self, index: int) -> PlannedObject:
        for split, (first, end) in self.ranges.items():
            if first <= index < end:
                objects = self.objects_of[split]
                return objects[_whose_turn(index - first, len(objects), (end - first) // len(objects))]
        raise IndexError(f"sample {index} of {self.num_samples}")

    def index_at(self, split: str, place: int) -> int:
        return place

    def shards(self) -> list[Shard]:
        return [
            Shard(f"{split}-{number:06d}.tar", split, first, min(first + self.shard_size, end))
            for split, (start, end) in self.ranges.items()
            for number, first in enumerate(range(start, end, self.shard_size))
        ]


def _whose_turn(turn: int, objects: int, rounds: int) -> int:
    lap, left = divmod(turn, objects * _VIEWS_IN_A_ROW)
    in_a_row = min(_VIEWS_IN_A_ROW, rounds - lap * _VIEWS_IN_A_ROW)
    if left >= objects * in_a_row:
        return left - objects * in_a_row
    first = left // (_OBJECTS_AT_ONCE * in_a_row) * _OBJECTS_AT_ONCE
    return first + (left - first * in_a_row) % min(_OBJECTS_AT_ONCE, objects - first)
