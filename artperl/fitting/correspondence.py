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
from functools import cached_property

import torch
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.neighbours import nearest_points
from artperl.core.pose import Posed, Theta, pose_parts
from artperl.core.shapes import Observed, Shapes

TANGENT_WEIGHT = 0.4
"""Of offsets along a surface against those from it: with none, flat parts would slide along themselves."""
DISC_RADIUS = 0.7
"""Of the disc that a point stands for, over the spacing of points."""
_OUTLINE_GAP = 2.0
"""Gap within an outline over the mean distance of neighbouring rays: for random rays, few points have a wider one."""
OUTLINE_POINTS = 32
"""Points of each part that must lie within the outline; the first ones are spread as evenly as all."""
_BLOCK = 64
"""Points that are matched together."""
BACK_FACE = 10.0
"""Squared distance, in diagonals, added for a disc that faces away from the camera: it cannot be seen."""


@dataclass(frozen=True, eq=False)
class Target(Batch):
    """An observed cloud, prepared for matching.

    Attributes
    ----------
    observed : Observed
    share : (B, N) float
        Weights of the points; they add up to 1.
    middle : (B, 1, 3) float
        Mean of the points.
    unit : (B,) float
        Diagonal of the object, metres, in which distances are counted.
    rays : (B, N, 2) float
        Points on the image plane at depth 1; those without weight are far off.
    slot : (B, N) int64
        Where each point stands once points are sorted by part, in blocks of one part.
    block_part : (B, G) int64
        Part of each block.
    monomials : (B, G, 64, 10) float32
        Products of the sorted points' coordinates, in diagonals about the middle, of degree 2, 1 and 0.
    gap : (B,) float
        Distance on that plane that may lie between a point within the outline and the nearest ray.
    """

    observed: Observed
    share: Tensor
    middle: Tensor
    unit: Tensor
    rays: Tensor
    slot: Tensor
    block_part: Tensor
    monomials: Tensor
    gap: Tensor

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
        x = ((observed.points - middle) / unit[:, None, None]).float()  # small numbers, for single precision
        monomials = torch.cat([x * x, x * x.roll(1, -1), x, torch.ones_like(x[..., :1])], dim=-1)
        slot, source, block_part = _blocks(observed.part)
        sorted_rows = monomials.gather(1, source[..., None].expand(-1, -1, 10)).reshape(len(x), -1, _BLOCK, 10)
        return Target(observed, share, middle, unit, rays, slot, block_part, sorted_rows, gap)


def _blocks(part: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Sort points by part into blocks, so that each is compared with its own part's discs alone.

    Returns
    -------
    slot : (B, N) int64
        Place of each point.
    source : (B, G * 64) int64
        Point in each place; 0 in places that stay empty.
    block_part : (B, G) int64
    """
    B, N = part.shape
    members = torch.nn.functional.one_hot(part)
    count = members.sum(1)
    rank = (members.cumsum(1) - 1).gather(2, part[..., None])[..., 0]
    blocks = (count + _BLOCK - 1) // _BLOCK
    end = blocks.cumsum(1)
    slot = _BLOCK * (end - blocks).gather(1, part) + rank
    numbers = torch.arange(int(end.max()), device=part.device)
    block_part = (end[:, None] <= numbers[:, None]).sum(-1).clamp(max=members.shape[2] - 1)
    source = torch.zeros(B, _BLOCK * len(numbers), dtype=torch.int64, device=part.device)
    return slot, source.scatter(1, slot, torch.arange(N, device=part.device).expand(B, -1)), block_part


@dataclass(frozen=True, eq=False)
class Matches(Batch):
    """Distances between a cloud and a posed reference. Camera frame; R rows: observed points, then outline points.

    Attributes
    ----------
    theta : Theta
        State in which the reference was posed.
    posed : Posed
    point : (B, R, 3) float
        Where a distance is measured.
    part : (B, R) int64
        Part of the reference that it depends on.
    local : (B, R, 3) float
        The reference's own point, in its rest frame.
    normal, tangent : (B, R, 3) float
        Unit directions in which the point is off.
    normal_residual, tangent_residual : (B, R) float
        By how much, in diagonals; the second counts :data:`TANGENT_WEIGHT` times.
    weight : (B, R) float
    """

    theta: Theta
    posed: Posed
    point: Tensor
    part: Tensor
    local: Tensor
    normal: Tensor
    tangent: Tensor
    normal_residual: Tensor
    tangent_residual: Tensor
    weight: Tensor

    @cached_property
    def square(self) -> Tensor:
        """(B, R) squared distances e^2, in diagonals."""
        return self.normal_residual**2 + (TANGENT_WEIGHT * self.tangent_residual) ** 2


def match(shapes: Shapes, target: Target, theta: Theta, outline_weight: float) -> Matches:
    """Distances of a cloud from the reference in state ``theta``, and of the reference from the cloud's outline.

    Every observed point goes with the nearest disc of its own part that faces the camera.
    """
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    points = posed.points(shapes.points, shapes.box_center)
    rows = [_surface_residuals(shapes, target, posed, points)]
    if outline_weight > 0:
        rows.append(_outline_residuals(shapes, target, points[:, :, :OUTLINE_POINTS], outline_weight))
    return Matches(theta, posed, *(torch.cat(column, dim=1) for column in zip(*rows, strict=True)))


def _surface_residuals(shapes: Shapes, target: Target, posed: Posed, points: Tensor) -> tuple[Tensor, ...]:
    """Rows of :class:`Matches` for the observed points."""
    observed = target.observed
    normals = posed.normals(shapes.normals)
    disc = _nearest_disc(target, points, normals)
    B, P, M, _ = points.shape
    flat = observed.part * M + disc

    def at(values: Tensor) -> Tensor:
        return values.reshape(B, P * M, 3).gather(1, flat[..., None].expand(-1, -1, 3))

    normal, unit = at(normals), target.unit[:, None]
    apart = observed.points - at(points)
    offset = (apart * normal).sum(-1)
    tangent = apart - offset[..., None] * normal
    length = torch.linalg.vector_norm(tangent, dim=-1)
    radius = (DISC_RADIUS * posed.scale.mean(-1) * shapes.spacing).gather(1, observed.part)
    excess = (length - radius).clamp(min=0.0) / unit
    tangent = tangent / length.clamp(min=1e-12)[..., None]
    # A part without a surface is at no distance from the points that are labelled as it.
    weight = target.share * torch.isfinite(radius)
    return observed.points, observed.part, at(shapes.points), normal, tangent, offset / unit, excess, weight


def _outline_residuals(shapes: Shapes, target: Target, points: Tensor, outline_weight: float) -> tuple[Tensor, ...]:
    """Rows of :class:`Matches` for points of the reference (B, P, M, 3), which must appear within the outline."""
    B, P, M, _ = points.shape
    point = points.flatten(1, 2)
    depth = point[..., 2:].clamp(min=1e-6)
    rays = point[..., :2] / depth
    cost = (target.rays**2).sum(-1)[:, None] - 2.0 * rays @ target.rays.transpose(1, 2)
    ray = target.rays.gather(1, _argmin(cost)[..., None].expand(-1, -1, 2))
    outwards = rays - ray
    length = torch.linalg.vector_norm(outwards, dim=-1)
    outwards = outwards / length.clamp(min=1e-12)[..., None]
    # depth * length grows by outwards . (dx - rays * dz) when the point moves; residuals fall along their normal.
    normal = -torch.cat([outwards, -(outwards * rays).sum(-1, keepdim=True)], dim=-1)
    offset = depth[..., 0] * (length - target.gap[:, None]).clamp(min=0.0) / target.unit[:, None]
    solid = shapes.has_surface.to(point.dtype)
    weight = outline_weight * solid / (M * solid.sum(1, keepdim=True).clamp(min=1.0))
    part = torch.arange(P, device=point.device).repeat_interleave(M).expand(B, -1)
    own = shapes.points[:, :, :M].flatten(1, 2)
    zero = torch.zeros_like(point)
    normal = normal * (offset > 0)[..., None]
    return point, part, own, normal, zero, offset, zero[..., 0], weight.repeat_interleave(M, 1)


def _nearest_disc(target: Target, points: Tensor, normals: Tensor) -> Tensor:
    """(B, N) index of the disc of its own part that each point is nearest to.

    ``(n . (x - y))^2 + w |x - y|^2`` is linear in ten products of the point's coordinates, so that all pairs take one
    matrix product.
    """
    y = ((points - target.middle[:, None]) / target.unit[:, None, None, None]).float()
    n = normals.float()
    facing = (points * normals).sum(-1) < 0.0  # the camera is at the origin
    weight = TANGENT_WEIGHT**2
    height = (n * y).sum(-1, keepdim=True)
    constant = height**2 + weight * (y * y).sum(-1, keepdim=True) + BACK_FACE * (~facing)[..., None]
    linear = -2.0 * (height * n + weight * y)
    # Products of different coordinates (zx, xy, yz) count twice.
    discs = torch.cat([n * n, 2.0 * n * n.roll(1, -1), linear, constant], dim=-1)
    # weight |x|^2 is the same for all discs of a point and is left out.
    own = discs.flatten(2).gather(1, target.block_part[..., None].expand(-1, -1, discs[0, 0].numel()))
    own = own.reshape(*target.block_part.shape, -1, 10)
    # Few objects at a time on a CPU, so that their distances stay in its cache.
    rows = len(y) if y.is_cuda else max(1, 1_000_000 // (own.shape[1] * own.shape[2] * _BLOCK))
    pairs = zip(target.monomials.split(rows), own.split(rows), strict=True)
    index = torch.cat([_argmin(a @ b.transpose(-1, -2)) for a, b in pairs])
    return index.flatten(1).gather(1, target.slot)


def _argmin(cost: Tensor) -> Tensor:
    """Index of the least entry along the last dimension. On a CPU NumPy finds it eight times as fast as torch."""
    return torch.from_numpy(cost.detach().numpy().argmin(-1)) if cost.device.type == "cpu" else cost.argmin(-1)
