"""Distances of clouds from posed references, in torch: the reference of the compiled loops, by automatic means."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.pose import Posed, Theta, pose_parts
from artperl.core.shapes import Shapes
from artperl.fitting.correspondence import BACK_FACE, DISC_RADIUS, OUTLINE_POINTS, TANGENT_WEIGHT, Target


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
    ray = target.rays.gather(1, cost.argmin(-1)[..., None].expand(-1, -1, 2))
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
    """(B, N) index of the disc of its own part that each point is nearest to, over all pairs."""
    observed = target.observed
    facing = (points * normals).sum(-1) < 0.0  # the camera is at the origin
    index = torch.zeros_like(observed.part)
    for b in range(len(index)):
        for k in range(points.shape[1]):
            own = observed.part[b] == k
            apart = (observed.points[b, own][:, None] - points[b, k]) / target.unit[b]
            square = (apart * normals[b, k]).sum(-1) ** 2 + TANGENT_WEIGHT**2 * apart.square().sum(-1)
            index[b, own] = (square + BACK_FACE * ~facing[b, k]).argmin(1)
    return index
