"""Batches of reference shapes (trees, part boxes, part clouds) and of observed clouds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.trees import Trees
from artsim.errors import ConfigError
from artsim.model.joints import Joint
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject


@dataclass(frozen=True, eq=False)
class Shapes(Batch):
    """B reference objects in their rest frames, in metres or any other unit of their own."""

    trees: Trees
    box_center: Tensor
    box_size: Tensor
    """(B, P, 3) float. Of each part; padding has no size."""
    points: Tensor
    normals: Tensor
    """(B, P, M, 3) float. Points spread evenly over each part's surface, and its outward unit normals there."""
    spacing: Tensor
    """(B, P) float. Typical distance between neighbouring points of a part; infinite for parts without a surface."""
    diagonal: Tensor
    """(B,) float. Of the box of the whole object at rest."""

    @property
    def has_surface(self) -> Tensor:
        """(B, P) bool: parts that can be seen."""
        return torch.isfinite(self.spacing)

    @staticmethod
    def from_objects(
        objects: Sequence[ArticulatedObject],
        points_per_part: int = 512,
        num_rows: int | None = None,
        dtype: torch.dtype = torch.float32,
        seed: int = 0,
    ) -> Shapes:
        """Shapes of simulated objects at their scale.

        Parameters
        ----------
        objects : sequence of ArticulatedObject
        points_per_part : int
        num_rows : int, optional
            Rows for parts; by default as many as the largest object has.
        dtype : torch.dtype
        seed : int
            Of the points, which depend on nothing else.
        """
        trees = Trees.stack([obj.tree for obj in objects], num_rows, dtype)
        B, P = trees.valid.shape
        arrays = {name: np.zeros((B, P, points_per_part, 3)) for name in ("points", "normals")}
        boxes = {name: np.zeros((B, P, 3)) for name in ("box_center", "box_size")}
        spacing = np.full((B, P), np.inf)
        for b, obj in enumerate(objects):
            boxes["box_center"][b, : len(obj)], boxes["box_size"][b, : len(obj)] = obj.box_center, obj.box_size
            for k, part in enumerate(obj.parts):
                if len(part.faces):
                    rng = np.random.default_rng([seed, k])
                    surface = spread_points(part.vertices * obj.scale, part.faces, points_per_part, rng)
                    arrays["points"][b, k], arrays["normals"][b, k], spacing[b, k] = surface
        tensors = {name: torch.from_numpy(array).to(dtype) for name, array in {**boxes, **arrays}.items()}
        diagonal = torch.tensor([obj.diagonal for obj in objects], dtype=dtype)
        return Shapes(trees=trees, **tensors, spacing=torch.from_numpy(spacing).to(dtype), diagonal=diagonal)

    def part(self, row: int) -> Shapes:
        """One part of every object as an object of its own, in the same rest frame."""
        alone = Trees.stack([KinematicTree([Joint("root", "free", -1)])] * len(self), dtype=self.points.dtype)
        fields = ("box_center", "box_size", "points", "normals", "spacing")
        own = {name: getattr(self, name)[:, row : row + 1] for name in fields}
        return Shapes(trees=alone.to(self.points.device), diagonal=self.diagonal, **own)


@dataclass(frozen=True, eq=False)
class Observed(Batch):
    """B observed clouds of N points in the camera frame (the camera at the origin), segmented into parts."""

    points: Tensor
    """(B, N, 3) float. Metres."""
    part: Tensor
    """(B, N) int64. Part of each point."""
    weight: Tensor
    """(B, N) float. How much each point counts; 0 for padding and outliers."""

    @staticmethod
    def of(points: Tensor, part: Tensor, weight: Tensor | None = None) -> Observed:
        """Clouds whose points all count alike, unless ``weight`` says otherwise."""
        return Observed(points, part.long(), torch.ones_like(points[..., 0]) if weight is None else weight)


def faces_camera(points: Tensor, normals: Tensor) -> Tensor:
    """(...) bool: surface points (..., 3), camera frame, whose normals (..., 3) lean towards the camera."""
    return (points * normals).sum(-1) < 0.0


def spread_points(
    vertices: Array, faces: NDArray[np.int32], count: int, rng: np.random.Generator
) -> tuple[Array, Array, float]:
    """Points spread evenly over a surface: the farthest of eight times as many random ones, one after the other.

    Parameters
    ----------
    vertices : (V, 3) float
    faces : (F, 3) int
    count : int
    rng : numpy Generator

    Returns
    -------
    points, normals : (count, 3) float
    spacing : float
        Square root of the area for each point.

    Raises
    ------
    ConfigError
        When no point is asked for.
    """
    if count < 1:
        raise ConfigError("a shape needs points", "points_per_part", "use at least 1")
    triangles = vertices[faces]
    edges = triangles[:, 1:] - triangles[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    area = 0.5 * np.linalg.norm(normal, axis=1)
    total = float(area.sum())
    if total <= 0.0:
        triangles, normal, area = triangles[:1], np.array([[0.0, 0.0, 1.0]]), np.ones(1)
    chosen = rng.choice(len(area), size=8 * count, p=area / area.sum())
    share = rng.random((8 * count, 2))
    share = np.where(share.sum(axis=1, keepdims=True) > 1.0, 1.0 - share, share)
    candidates = triangles[chosen, 0] + (share[..., None] * (triangles[:, 1:] - triangles[:, :1])[chosen]).sum(axis=1)
    picked = np.zeros(count, dtype=np.int64)
    distance = np.full(len(candidates), np.inf)
    for i in range(1, count):
        offset = candidates - candidates[picked[i - 1]]
        np.minimum(distance, np.einsum("ij,ij->i", offset, offset), out=distance)
        picked[i] = distance.argmax()
    normals = normal[chosen[picked]]
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return candidates[picked], normals / np.where(length > 0, length, 1.0), float(np.sqrt(total / count))
