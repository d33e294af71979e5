"""What all objects of a category share: the kinematic tree, and means of boxes, axes and limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.shapes import Shapes
from artperl.core.trees import KINDS
from artsim.errors import ConfigError

Array = NDArray[np.float64]

_NAMED = {"revolute", "continuous", "prismatic", "free"}
"""Kinds of joints that a method without references can pose."""


@dataclass(frozen=True, eq=False)
class CategoryPrior:
    """Of K parts; lengths in diagonals, rest frame."""

    kinds: tuple[str, ...]
    """Types of the joints, "free" for the root."""
    parents: NDArray[np.int64]
    """(K,) int64. -1 for the root."""
    rest: Array
    """(K,) float."""
    limits: Array
    """(K, 2) float. As wide as those of any object."""
    axis: Array
    origin: Array
    """(K, 3) float. Means."""
    box_center: Array
    box_size: Array
    """(K, 3) float. Means."""

    def __len__(self) -> int:
        return len(self.kinds)

    @property
    def slides(self) -> NDArray[np.bool_]:
        """(K,) whether each part's joint is prismatic."""
        return np.array(self.kinds) == "prismatic"

    @property
    def typical_state(self) -> Array:
        """(K,) half-way between the limits; at rest where there are none."""
        middle = self.limits.mean(axis=1)
        typical: Array = np.where(np.isfinite(middle), middle, self.rest)
        return typical

    @staticmethod
    def of(shapes: Shapes, kind: Tensor) -> CategoryPrior:
        """The prior of objects; ``kind`` (B,) is the same for those with the same kinematic tree.

        Raises
        ------
        ConfigError
            When they have different kinematic trees, or a joint that is neither a hinge nor a slide.
        """
        trees = shapes.trees
        if bool((kind != kind[0]).any()):
            raise ConfigError(
                "its objects have different kinematic trees, and this method learns one", "categories",
                "name one category of ArtImage, with --parts artimage",
            )  # fmt: skip
        K = int(trees.valid[0].sum())
        kinds = tuple(KINDS[kind] for kind in trees.kind[0, :K].tolist())
        if set(kinds) - _NAMED:
            raise ConfigError(
                f"this method has no {', '.join(sorted(set(kinds) - _NAMED))} joints", "categories",
                "use the method full or artperl",
            )  # fmt: skip

        def mean(values: Tensor) -> Array:
            averaged: Array = values[:, :K].double().mean(0).cpu().numpy()
            return averaged

        axis = mean(trees.axis)
        return CategoryPrior(
            kinds=kinds,
            parents=np.where(np.arange(K) == 0, -1, trees.parent[0, :K].cpu().numpy()),
            rest=mean(trees.rest),
            limits=np.stack([mean(trees.lower), mean(trees.upper)], axis=1),
            axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
            origin=mean(trees.origin),
            box_center=mean(shapes.box_center),
            box_size=mean(shapes.box_size),
        )
