"""Which part a point is of, given what is known of it before and how far each part is from it."""

from typing import Any, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.pose import Theta, pose_parts
from artperl.core.shapes import Observed, Shapes
from artsim.common.compiled import compiled

Array = NDArray[np.float64]
Single = NDArray[np.float32]
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
    distance = nearest_distance(observed.points, points)
    sigma = shapes.diagonal[:, None, None] * _SURFACE_SIGMA
    score = label_log_odds(logits[:, :N, :P].log_softmax(-1), distance, sigma)
    return score.masked_fill(~shapes.has_surface[:, None], -torch.inf).argmax(-1)


def nearest_distance(points: Tensor, surface: Tensor) -> Tensor:
    """(B, N, P) distance of points (B, N, 3) from the nearest point of each part (B, P, M, 3)."""
    if points.device.type != "cpu":
        every: Tensor = torch.cdist(points[:, None].expand(-1, surface.shape[1], -1, -1), surface).amin(-1)
        return every.transpose(1, 2)
    pairs = zip(points.float().numpy(), surface.float().transpose(2, 3).contiguous().numpy(), strict=True)
    squared = np.stack([_nearest_squared(own, parts) for own, parts in pairs])
    return torch.from_numpy(np.sqrt(squared)).to(points.dtype)


@compiled
def _nearest_squared(points: Single, surface: Single) -> Single:
    """(N, P) squared distance of points (N, 3) from the nearest point of each part (P, 3, M).

    Bits of numbers that are not negative, taken for whole numbers, are in their order. Least whole numbers are found in
    wide registers.
    """
    found, apart = np.empty((len(points), len(surface)), dtype=np.float32), np.empty(surface.shape[2], dtype=np.float32)
    nearest, bits = found.view(np.int32), apart.view(np.int32)
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        for k in range(len(surface)):
            for m in range(surface.shape[2]):
                dx, dy, dz = surface[k, 0, m] - x, surface[k, 1, m] - y, surface[k, 2, m] - z
                apart[m] = dx * dx + dy * dy + dz * dz
            least = np.int32(2**31 - 1)
            for m in range(surface.shape[2]):
                least = min(least, bits[m])
            nearest[n, k] = least
    return found


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
    places = (points - T_camera_part[:, None, :3, 3]) @ T_camera_part[:, :3, :3]
    beyond = np.maximum(np.abs(places - center[:, None]) - 0.5 * size[:, None], 0.0)
    score = label_log_odds(log_odds[:, : len(center)], np.sqrt((beyond**2).sum(axis=-1)).T, sigma)
    return np.where(np.isnan(score).any(axis=1), -1, score.argmax(axis=1))
