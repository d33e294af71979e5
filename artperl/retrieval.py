"""The base of reference shapes, and finding in it the ones most like an observed object (ArtPERL, section 4.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from artperl.shapes import Shapes
from artsim.errors import ConfigError
from artsim.objects import ArticulatedObject

_MISSING = 4.0
"""Distance, in diagonals per part, between objects whose parts or joints do not correspond."""


@dataclass(frozen=True, eq=False)
class ShapeBase:
    """Reference objects, scaled to a diagonal of 1, found by the boxes of their parts.

    Attributes
    ----------
    shapes : Shapes
        One row for each object.
    names : tuple of str
        Where each came from, such as "laptop:3".
    """

    shapes: Shapes
    names: tuple[str, ...]

    @staticmethod
    def of(objects: Sequence[ArticulatedObject], num_rows: int | None = None, points_per_part: int = 192) -> ShapeBase:
        """A base of some objects.

        Raises
        ------
        ConfigError
            When there is none.
        """
        if not objects:
            raise ConfigError("a base without objects has nothing to retrieve", mend="pass some objects")
        unit = [obj.with_diagonal(1.0) for obj in objects]
        shapes = Shapes.from_objects(unit, points_per_part, num_rows)
        return ShapeBase(shapes, tuple(f"{obj.category}:{obj.object_id}" for obj in objects))

    def __len__(self) -> int:
        return len(self.names)

    def distance(self, valid: Tensor, box_center: Tensor, box_size: Tensor) -> Tensor:
        """(B, len) difference of part boxes, in diagonals, mean over parts.

        Parameters
        ----------
        valid : (B, P) bool
            Parts of the observed objects.
        box_center, box_size : (B, P, 3) float
            In the rest frame, in diagonals of the object, as perceived.
        """
        P = valid.shape[1]
        both = torch.cat([box_center, box_size], dim=-1)
        base = torch.cat([self.shapes.box_center, self.shapes.box_size], dim=-1)[:, :P]
        known = self.shapes.trees.valid[:, :P]
        apart = (both[:, None] - base[None]).abs().sum(-1)
        agree = valid[:, None] & known[None]
        differ = valid[:, None] ^ known[None]
        extra = self.shapes.trees.valid[:, P:].sum(1)
        total = (apart * agree).sum(-1) + _MISSING * (differ.sum(-1) + extra)
        return total / valid.sum(1, keepdim=True).clamp(min=1)

    def nearest(self, valid: Tensor, box_center: Tensor, box_size: Tensor, count: int = 1) -> Tensor:
        """(B, count) rows of the most similar objects, the best first."""
        return self.distance(valid, box_center, box_size).topk(min(count, len(self)), largest=False).indices
