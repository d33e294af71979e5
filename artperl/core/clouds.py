"""Clouds at a common place and size, and what tells the joints of parts apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.batch import Batch
from artsim.model.joints import ROTATING
from artsim.model.kinematics import Array

_FARTHEST = 1e9
"""Coordinates beyond stand for no measurement, as the largest float does for some sensors; squares of them overflow."""


@dataclass(frozen=True, eq=False)
class Clouds(Batch):
    """B partial clouds of N points, brought to a common place and size."""

    points: Tensor
    """(B, N, 3) float. ``(camera-frame points - center) / scale``, in random order."""
    center: Tensor
    """(B, 3) float. Mean of the points, metres, camera frame."""
    scale: Tensor
    """(B,) float. Root of the mean squared distance from it, times two, metres."""

    @staticmethod
    def of(points: Tensor) -> Clouds:
        """Clouds of (B, N, 3) camera-frame points."""
        center = points.mean(1)
        local = points - center[:, None]
        scale = 2.0 * local.square().sum(-1).mean(1).sqrt().clamp(min=1e-9)
        return Clouds(local / scale[:, None, None], center, scale)


def joint_rows(kinds: Sequence[str], axis: Array, origin: Array, center: Array, diagonal: float) -> Array:
    """(K, 9) what tells the joints of K parts apart: zeros for the root and where a part is fixed.

    The direction of a slide (3), that of a turning axis (3), and where the nearest point of this axis is from the
    centre of the part's box, in diagonals (3).

    Parameters
    ----------
    kinds : sequence of str, length K
        Types of joints.
    axis, origin, center : (K, 3) float
        In the rest frame; axes of length 1.
    diagonal : float
        Of the object.
    """
    sliding, turning = (np.isin(kinds, types)[:, None] for types in ("prismatic", list(ROTATING)))
    away = origin - center
    pivot = (away - (away * axis).sum(-1, keepdims=True) * axis) / diagonal
    rows: Array = np.concatenate([axis * sliding, axis * turning, pivot * turning], axis=1)
    return rows


def is_measured(points: Array) -> NDArray[np.bool_]:
    """(N,) which points a sensor can have measured: finite, not beyond all reach, and not at exactly 0 0 0.

    The origin is the camera itself; sensors and exporters write it where nothing came back.
    """
    return np.logical_and((np.abs(points) < _FARTHEST).all(axis=1), points.any(axis=1))


def draw(available: int, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """``count`` of ``available`` indices in random order, every one before any comes twice."""
    rounds = [rng.permutation(available) for _ in range(-(-count // available))]
    return np.concatenate(rounds)[:count]
