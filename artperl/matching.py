"""Which point of a posed reference an observed point belongs to, and how far it is away.

The reference's points stand for small discs of its surface. An observed point is at distance

    e^2 = n^2 + (glide * max(t - zone, 0))^2

from a disc with offset ``n`` along the disc's normal and ``t`` across it, where ``zone`` is the spacing of the
reference's points: the distance from the surface that the discs sample, rather than from the samples themselves.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from artperl.batch import Batch
from artperl.pose import Posed, Theta, pose_parts
from artperl.shapes import Observed, Shapes

GLIDE = 0.4
"""Weight of offsets across a surface against those from it: with none, flat parts would slide along themselves."""
_ZONE = 0.7
"""Radius of the disc that a point stands for, over the spacing of points."""
_HIDDEN = 10.0
"""Squared distance, in diagonals, added for a disc that faces away from the camera: it could not be seen."""


@dataclass(frozen=True, eq=False)
class Matches(Batch):
    """Discs that belong to observed points, and the offsets of the points from them. Camera frame.

    Attributes
    ----------
    theta : Theta
        State in which the reference was posed.
    local : (B, N, 3) float
        Centres of the discs, in the reference's rest frame.
    normal, across : (B, N, 3) float
        Unit directions: the disc's normal, and from its centre towards the point along the disc.
    offset : (B, N) float
        Along the normal, in diagonals.
    excess : (B, N) float
        Along the disc beyond its radius, in diagonals; 0 for points above it.
    """

    theta: Theta
    local: Tensor
    normal: Tensor
    across: Tensor
    offset: Tensor
    excess: Tensor

    @property
    def square(self) -> Tensor:
        """(B, N) squared distances e^2, in diagonals."""
        return self.offset**2 + (GLIDE * self.excess) ** 2


def match(shapes: Shapes, observed: Observed, theta: Theta, unit: Tensor) -> tuple[Matches, Posed]:
    """The nearest visible disc of its own part, for every observed point.

    Parameters
    ----------
    shapes : Shapes
    observed : Observed
    theta : Theta
    unit : (B,) float
        Diagonal of the observed object, metres, in which distances are counted.

    Returns
    -------
    Matches
    Posed
        Where ``theta`` puts the reference's parts.
    """
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    points = posed.points(shapes.points, shapes.box_center)
    normals = posed.normals(shapes.normals)
    nearest = _nearest_disc(shapes, observed, points, normals, unit)
    B, P, M, _ = points.shape
    flat = observed.part * M + nearest.gather(1, observed.part[:, None])[:, 0]

    def at(values: Tensor) -> Tensor:
        return values.reshape(B, P * M, 3).gather(1, flat[..., None].expand(-1, -1, 3))

    normal, scale = at(normals), unit[:, None]
    apart = observed.points - at(points)
    offset = (apart * normal).sum(-1)
    sideways = apart - offset[..., None] * normal
    length = torch.linalg.vector_norm(sideways, dim=-1)
    growth = posed.scale.mean(-1)
    radius = (_ZONE * growth * shapes.spacing).gather(1, observed.part)
    excess = torch.where(torch.isfinite(radius), (length - radius).clamp(min=0.0), 0.0)
    across = sideways / length.clamp(min=1e-12)[..., None]
    return Matches(theta, at(shapes.points), normal, across, offset / scale, excess / scale), posed


def _nearest_disc(shapes: Shapes, observed: Observed, points: Tensor, normals: Tensor, unit: Tensor) -> Tensor:
    """(B, P, N) index of the disc of each part that each point is nearest to.

    ``(n . (x - y))^2 + w |x - y|^2`` is linear in ten products of the point's coordinates, so that all pairs take one
    matrix product.
    """
    middle = observed.points.mean(dim=1, keepdim=True)  # small numbers, for single precision
    scale = unit[:, None, None]
    x = ((observed.points - middle) / scale).float()
    y = ((points - middle[:, None]) / scale[..., None]).float()
    n = normals.float()
    facing = (points * normals).sum(-1) < 0.0  # the camera is at the origin
    weight = GLIDE**2
    height = (n * y).sum(-1)
    constant = height**2 + weight * (y * y).sum(-1) + _HIDDEN * (~facing)
    linear = -2.0 * (height[..., None] * n + weight * y)
    first, second = torch.tensor([[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], device=x.device)
    twice = torch.tensor([1.0, 1.0, 1.0, 2.0, 2.0, 2.0], device=x.device)
    quadratic = twice * n[..., first] * n[..., second]
    discs = torch.cat([quadratic, linear, constant[..., None]], dim=-1)
    # weight |x|^2 is the same for all discs of a point and is left out.
    monomials = torch.cat([x[..., first] * x[..., second], x, torch.ones_like(x[..., :1])], dim=-1)
    return (monomials[:, None] @ discs.transpose(-1, -2)).argmin(dim=-1)
