"""The shape base: objects in canonical space that serve as references, and the nearest of them by an embedding."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from torch import Tensor

from artperl.core.clouds import joint_rows
from artperl.core.pose import AxisPrior
from artperl.core.shapes import Shapes
from artperl.core.trees import KINDS
from artsim.errors import ConfigError
from artsim.model.kinematics import KinematicTree
from artsim.model.objects import ArticulatedObject

_ALIKE = 0.02
"""Radians: axes that differ by less are alike."""
_OTHER_SORT = 0.35
"""Radians: axes that differ by more are no two versions of one another, as those of doors and flaps."""


@dataclass(frozen=True, eq=False)
class ShapeBase:
    """Reference objects at diagonal 1 in their rest frames, with what is needed to find and to fit them."""

    object_ids: tuple[str, ...]
    categories: tuple[str, ...]
    trees: tuple[KinematicTree, ...]
    shapes: Shapes
    """B rows, padded to the most parts of any object."""
    embeddings: Tensor | None = None
    """(B, E) float or None. One for each object, of whatever network searches the base."""

    def __len__(self) -> int:
        return len(self.object_ids)

    @cached_property
    def mean_axis(self) -> Tensor:
        """(B, P, 3) mean axis of each joint among all objects of the same kind."""
        axis = self.shapes.trees.axis
        means = [axis[self.kind == kind].mean(0) for kind in range(int(self.kind.max()) + 1)]
        return torch.nn.functional.normalize(torch.stack(means), dim=-1)[self.kind]

    def axis_prior(self, row: int) -> AxisPrior | None:
        """How far the axes of an observed object may lean from those of a reference; None where they hardly lean."""
        return self._axis_priors[int(self.kind[row])]

    @cached_property
    def _axis_priors(self) -> list[AxisPrior | None]:
        """One for each kind.

        As those of all objects of the reference's kind do about their mean, and twice as far: retrieved axes are right
        more often than not, and otherwise they may be those of the other extreme. Axes that differ by so much that
        they are of another sort, as those of doors and flaps, stay.
        """
        every = torch.linalg.cross(self.mean_axis, self.shapes.trees.axis)
        priors: list[AxisPrior | None] = []
        for kind in range(int(self.kind.max()) + 1):
            lean = every[self.kind == kind]
            spread = lean.square().sum(-1).mean(0).sqrt()
            leans = (spread > _ALIKE) & (spread < _OTHER_SORT)
            twice = 2.0 * (lean * leans[:, None]).flatten(1)
            priors.append(AxisPrior((twice.T @ twice / len(twice))[None], leans[None]) if bool(leans.any()) else None)
        return priors

    @cached_property
    def kind(self) -> Tensor:
        """(B,) int64 number that objects of one category with the same kinematic tree share."""
        kinds = [(c, t.types, tuple(t.parents)) for c, t in zip(self.categories, self.trees, strict=True)]
        numbers = {kind: number for number, kind in enumerate(dict.fromkeys(kinds))}
        return torch.tensor([numbers[kind] for kind in kinds], device=self.shapes.diagonal.device)

    def has_other_axes(self, row: int) -> Tensor:
        """(B,) bool: objects of an object's kind of which some axis leans away from it beyond the mean."""
        axis, mean = self.shapes.trees.axis, self.mean_axis[row]
        apart, usual = _angle(axis, axis[row]), _angle(axis[row], mean)
        return (self.kind == self.kind[row]) & (apart > usual.clamp(min=_ALIKE)).any(1)

    @staticmethod
    def of(objects: Sequence[ArticulatedObject], points_per_part: int = 512, num_rows: int | None = None) -> ShapeBase:
        """A base of any set of objects, each brought to diagonal 1, with limits as wide as any object's of its kind.

        There are ``num_rows`` rows for parts, by default as many as any object has.
        """
        if not objects:
            raise ConfigError("a shape base needs objects", fix="pass at least one")
        units = widen_limits([obj.with_diagonal(1.0) for obj in objects])
        return ShapeBase(
            tuple(obj.object_id for obj in units),
            tuple(obj.category for obj in units),
            tuple(obj.tree for obj in units),
            Shapes.from_objects(units, points_per_part, num_rows),
        )

    def with_embeddings(self, embeddings: Tensor) -> ShapeBase:
        """The same objects, found by other embeddings (B, E)."""
        if len(embeddings) != len(self):
            raise ConfigError(f"{len(embeddings)} embeddings do not fit {len(self)} objects", "embeddings")
        return replace(self, embeddings=embeddings.detach())

    def to(self, device: torch.device | str) -> ShapeBase:
        """The base on another device."""
        embeddings = None if self.embeddings is None else self.embeddings.to(device)
        return replace(self, shapes=self.shapes.to(device), embeddings=embeddings)

    def name(self, row: int) -> str:
        """Category and name of an object."""
        return f"{self.categories[row]}:{self.object_ids[row]}"

    def of_category(self, category: str) -> Tensor:
        """(B,) bool: objects of a category."""
        return torch.tensor([name == category for name in self.categories], device=self.shapes.diagonal.device)

    @cached_property
    def joints(self) -> Tensor:
        """(B, P, 9) joints as :func:`artperl.core.clouds.joint_rows` has them."""
        trees, shapes = self.shapes.trees, self.shapes
        parts = zip(trees.axis, trees.origin, shapes.box_center, shapes.diagonal, strict=True)
        rows = [
            joint_rows([KINDS[k] for k in kinds], *(values.cpu().double().numpy() for values in own))
            for kinds, own in zip(trees.kind.tolist(), parts, strict=True)
        ]
        return torch.from_numpy(np.stack(rows)).to(shapes.box_center)

    def nearest_objects(
        self, queries: Tensor, count: int = 1, allowed: Tensor | None = None, further: Tensor | None = None
    ) -> tuple[Tensor, Tensor]:
        """The objects whose embeddings are nearest (section 4.2: Euclidean distance), nearest first.

        Parameters
        ----------
        queries : (Q, E) float
        count : int
            Objects for each query.
        allowed : (B,) or (Q, B) bool, optional
            Objects to choose among, for example those of a category; at least ``count`` for each query.
        further : (Q, B) float, optional
            Distances in other regards.

        Returns
        -------
        rows : (Q, count) int64
        distance : (Q, count) float

        Raises
        ------
        ConfigError
            When the base has no embeddings, or too few objects.
        """
        if self.embeddings is None:
            raise ConfigError("the shape base has no embeddings", fix="give it some: with_embeddings")
        apart = torch.cdist(queries, self.embeddings.to(queries))
        if further is not None:
            apart = torch.hypot(apart, further)
        if allowed is not None:
            apart = apart.masked_fill(~allowed.to(apart.device), torch.inf)
        if count > len(self) or not bool(torch.isfinite(apart).sum(1).ge(count).all()):
            raise ConfigError(f"fewer than {count} objects to choose among", "count", "ask for fewer, or allow more")
        distance, rows = apart.topk(count, largest=False)
        return rows, distance


def _angle(axis: Tensor, other: Tensor) -> Tensor:
    """Radians between unit vectors."""
    return torch.linalg.vector_norm(torch.linalg.cross(axis, other.expand_as(axis)), dim=-1).clamp(max=1.0).asin()


def widen_limits(objects: Sequence[ArticulatedObject]) -> list[ArticulatedObject]:
    """Objects whose joints go as far as those of any other one of the same category and kinematic tree.

    How far the joints of an observed object go is not known, and a reference that stops earlier could not follow it.
    """
    kinds = [(obj.category, obj.tree.types, tuple(obj.tree.parents)) for obj in objects]
    limits = {
        kind: np.stack([obj.tree.limits for obj, own in zip(objects, kinds, strict=True) if own == kind])
        for kind in dict.fromkeys(kinds)
    }
    result = []
    for obj, kind in zip(objects, kinds, strict=True):
        low, high = limits[kind][..., 0].min(axis=0), limits[kind][..., 1].max(axis=0)
        joints = [
            replace(joint, lower=float(low[k]), upper=float(high[k])) if k else joint
            for k, joint in enumerate(obj.tree.joints)
        ]
        result.append(replace(obj, native_tree=KinematicTree(joints).scaled(1.0 / obj.scale)))
    return result
