"""Which part a point is of, given what is known of it before and how far each part is from it."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.pose import Theta, pose_parts
from artperl.core.shapes import Observed, Shapes

Array = NDArray[np.float64]
Values = TypeVar("Values", Array, Tensor)

_SURFACE_SIGMA = 0.03
"""Distance from a fitted part, in diagonals, that weighs as much against a label as odds of 1 to e."""


def label_log_odds(prior: Values, distance: Any, sigma: Any = 1.0) -> Values:
    """Log-odds of labels: those known before, less the squared distance over sigma squared (a Gaussian likelihood).

    Parameters
    ----------
    prior : (..., P) float
        Log-odds of each part.
    distance, sigma : broadcastable to (..., P)
        In the same unit.
    """
    return prior - (distance / sigma) ** 2


def labels_by_surface(shapes: Shapes, observed: Observed, theta: Theta, logits: Tensor) -> Tensor:
    """(B, N) parts of observed points by perception and by the distance from the fitted surface of each part.

    Parameters
    ----------
    shapes : Shapes
    observed : Observed
    theta : Theta
    logits : (B, >= N, >= P) float
        Perception's.
    """
    N, P = observed.part.shape[1], shapes.trees.num_rows
    points = pose_parts(shapes.trees, theta, shapes.box_center).points(shapes.points, shapes.box_center)
    distance = torch.cdist(observed.points[:, None].expand(-1, P, -1, -1), points).amin(-1).transpose(1, 2)
    sigma = shapes.diagonal[:, None, None] * _SURFACE_SIGMA
    score = label_log_odds(logits[:, :N, :P].log_softmax(-1), distance, sigma)
    return score.masked_fill(~shapes.has_surface[:, None], -torch.inf).argmax(-1)


def labels_by_boxes(
    points: Array, T_camera_part: Array, center: Array, size: Array, log_odds: Array, sigma: float
) -> NDArray[np.int64]:
    """(N,) parts of points by perception and by the distance out of the box of each part; -1 without log-odds.

    Parameters
    ----------
    points : (N, 3) float
    T_camera_part : (K, 4, 4) float
    center, size : (K, 3) float
        Boxes in the rest frame, metres.
    log_odds : (N, >= K) float
        NaN for outliers.
    sigma : float
        Metres that weigh as much as odds of 1 to e.
    """
    distance = np.stack([
        np.linalg.norm(np.maximum(np.abs((points - T[:3, 3]) @ T[:3, :3] - middle) - 0.5 * whole, 0.0), axis=1)
        for T, middle, whole in zip(T_camera_part, center, size, strict=True)
    ], axis=1)  # fmt: skip
    score = label_log_odds(log_odds[:, : len(size)], distance, sigma)
    return np.where(np.isnan(score).any(axis=1), -1, score.argmax(axis=1))
