"""What is true of clouds, as tensors: what networks learn to say."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.clouds import Clouds, joint_rows
from artsim.model.kinematics import Array
from artsim.observing.interference import FOREIGN
from artsim.observing.sample import Sample


@dataclass(frozen=True, eq=False)
class Truth(Batch):
    """What is true of B clouds. Lengths of the rest frame are in diagonals of the object."""

    part: Tensor
    """(B, N) int64. 0 for points that are not of the object."""
    own: Tensor
    """(B, N) bool. Whether a point is of the object."""
    canonical: Tensor
    """(B, N, 3) float. Where each point lies in the rest frame, at rest; 0 for points that are not of the object."""
    part_valid: Tensor
    """(B, P) bool."""
    box_center: Tensor
    box_size: Tensor
    """(B, P, 3) float."""
    joint: Tensor
    """(B, P, 9) float. See :func:`joint_rows`."""
    level: Tensor
    """(B, P) int64. How many joints are between the root and the part."""
    parent: Tensor
    """(B, P) int64. The root, and rows that pad, name the root."""
    diagonal: Tensor
    """(B,) float. Over the cloud's scale."""

    def of_points(self, rows: Tensor) -> Tensor:
        """(B, N, ...) of each point's part, from (B, P, ...) of each part."""
        return torch.stack([own[part] for own, part in zip(rows, self.part, strict=True)])


def training_rows(sample: Sample, num_points: int, num_rows: int) -> dict[str, Array]:
    """One sample as arrays for :class:`Clouds` and :class:`Truth`, with ``num_rows`` rows for parts."""
    K = len(sample.joint_type)
    points, part = sample.points[:num_points], sample.part[:num_points].astype(np.int64)
    own = part != FOREIGN
    joint = joint_rows(
        sample.joint_type, sample.joint_axis, sample.joint_origin, sample.box_center, sample.diagonal
    )  # fmt: skip
    level, parent = np.zeros(num_rows, dtype=np.int64), np.zeros(num_rows, dtype=np.int64)
    for k in range(1, K):
        parent[k] = sample.joint_parent[k]
        level[k] = level[sample.joint_parent[k]] + 1

    def pad(rows: Array) -> Array:
        padded = np.zeros((num_rows, *rows.shape[1:]), dtype=np.float32)
        padded[:K] = rows
        return padded

    return {
        "points": points.astype(np.float32),
        "part": np.where(own, part, 0),
        "own": own,
        "canonical": np.where(own[:, None], sample.rest_points[:num_points] / sample.diagonal, 0.0).astype(np.float32),
        "part_valid": np.arange(num_rows) < K,
        "box_center": pad(sample.box_center / sample.diagonal),
        "box_size": pad(sample.box_size / sample.diagonal),
        "joint": pad(joint),
        "level": level,
        "parent": parent,
        "diagonal": np.float32(sample.diagonal),
    }


def to_batch(rows: dict[str, Tensor]) -> tuple[Clouds, Truth]:
    """Collated rows of :func:`training_rows` as records."""
    clouds = Clouds.of(rows["points"])
    names = ("part", "own", "canonical", "part_valid", "box_center", "box_size", "joint", "level", "parent")
    return clouds, Truth(**{name: rows[name] for name in names}, diagonal=rows["diagonal"] / clouds.scale)
