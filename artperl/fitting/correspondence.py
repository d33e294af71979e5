"""Which point of a posed reference an observed point belongs to, and how far it is away.

The reference's points stand for small discs of its surface. An observed point is at distance

    e^2 = n^2 + (w * max(t - r, 0))^2

from a disc of radius ``r`` with offset ``n`` along the disc's normal and ``t`` along its tangent plane: the distance
from the surface that the discs sample, rather than from the samples themselves. ``w`` is :data:`TANGENT_WEIGHT`.

An object that is too large fits what is seen of a surface as well. So the outline of the cloud counts, too: every point
of the reference, hidden or not, is to appear within it, and is at a distance where it appears beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.neighbours import nearest_points
from artperl.core.shapes import Observed

TANGENT_WEIGHT = 0.4
"""Of offsets along a surface against those from it: with none, flat parts would slide along themselves."""
DISC_RADIUS = 0.7
"""Of the disc that a point stands for, over the spacing of points."""
_OUTLINE_GAP = 2.0
"""Gap within an outline over the mean distance of neighbouring rays: for random rays, few points have a wider one."""
OUTLINE_POINTS = 32
"""Points of each part that must lie within the outline; the first ones are spread as evenly as all."""
BACK_FACE = 10.0
"""Squared distance, in diagonals, added for a disc that faces away from the camera: it cannot be seen."""


@dataclass(frozen=True, eq=False)
class Target(Batch):
    """An observed cloud, prepared for matching."""

    observed: Observed
    share: Tensor
    """(B, N) float. Weights of the points; they add up to 1."""
    middle: Tensor
    """(B, 1, 3) float. Mean of the points."""
    unit: Tensor
    """(B,) float. Diagonal of the object, metres, in which distances are counted."""
    rays: Tensor
    """(B, N, 2) float. Points on the image plane at depth 1; those without weight are far off."""
    gap: Tensor
    """(B,) float. Distance on that plane that may lie between a point within the outline and the nearest ray."""

    @staticmethod
    def of(observed: Observed, unit: Tensor) -> Target:
        """Prepare clouds whose objects have diagonals ``unit (B,)``."""
        share = observed.weight / observed.weight.sum(1, keepdim=True).clamp(min=1e-12)
        middle = (share[..., None] * observed.points).sum(1, keepdim=True)
        rays = observed.points[..., :2] / observed.points[..., 2:].clamp(min=1e-6)
        rays = torch.where(observed.weight[..., None] > 0, rays, 1e3)
        gap = _OUTLINE_GAP * (share * nearest_points(rays, rays, 2)[0].amax(-1).sqrt()).sum(
            1
        )  # each ray is the nearest to itself
        return Target(observed, share, middle, unit, rays, gap)
