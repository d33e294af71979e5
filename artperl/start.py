"""A first guess at every part's pose, from where the perception network says that points lie in the rest frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from artperl.data import Clouds
from artperl.networks.perception import Perceived
from artperl.pose import Theta, clamp_state, pose_parts, reach, theta_from_parts
from artperl.rotations import rotate
from artperl.shapes import Shapes
from artsim.camera import look_at_transform

_ROUNDS = 4
_LEAST = 8.0
"""Points from which a part's own pose is trusted; with fewer it stands as at rest against the root."""


def part_poses(clouds: Clouds, perceived: Perceived) -> tuple[Tensor, Tensor, Tensor]:
    """Pose of each part by robust weighted Procrustes alignment of its points (Umeyama 1991, without scale).

    The size of the object is the network's: a part seen from one side does not tell it.

    Returns
    -------
    rotation : (B, P, 3, 3) float
        Of ``T_camera_part``.
    center : (B, P, 3) float
        Box centres in the camera frame, metres.
    size : (B, P, 3) float
        Box sizes, metres.
    """
    unit = perceived.log_diagonal.exp()[:, None, None]
    goal = perceived.canonical * unit
    member = torch.nn.functional.one_hot(perceived.part, perceived.part_logits.shape[2]).to(goal.dtype)
    trust = member.transpose(1, 2) * (-perceived.spread.clamp(-4.0, 2.0)).exp()[:, None]
    weight = trust
    for _ in range(_ROUNDS):
        rotation, translation = procrustes(goal, clouds.points, weight)
        off = rotate(rotation[:, :, None], goal[:, None]) + translation[:, :, None] - clouds.points[:, None]
        distance = off.square().sum(-1)
        typical = (distance * weight).sum(2, keepdim=True) / weight.sum(2, keepdim=True).clamp(min=1e-9)
        weight = trust / (1.0 + distance / typical.clamp(min=1e-6)) ** 2
    unseen = member.sum(1) < _LEAST
    rotation = torch.where(unseen[..., None, None], rotation[:, :1], rotation)
    translation = torch.where(unseen[..., None], translation[:, :1], translation)
    center = rotate(rotation, perceived.box_center * unit) + translation
    metres = clouds.radius[:, None, None]
    return rotation, center * metres + clouds.center[:, None], perceived.box_size * unit * metres


def start(clouds: Clouds, perceived: Perceived, references: Shapes, count: int) -> tuple[Shapes, Theta]:
    """References adapted to what is perceived, and the states that bring them nearest to :func:`part_poses`.

    Parameters
    ----------
    clouds : Clouds
    perceived : Perceived
        Both of B objects.
    references : Shapes
        ``count`` for each object, neighbours together.
    count : int

    Returns
    -------
    Shapes, Theta
        B * count rows. The shapes have the perceived size, so that the states carry no scale.
    """
    rows = references.trees.num_rows
    rotation, center, size = (pose[:, :rows].repeat_interleave(count, dim=0) for pose in part_poses(clouds, perceived))
    fitted = theta_from_parts(references.trees, references.box_center, references.box_size, rotation, center, size)
    plain = torch.zeros_like(fitted.stretch)
    shapes = adapted(references, replace(fitted, shift=plain))
    theta = replace(fitted, log_scale=plain[:, 0], stretch=plain, shift=plain)
    return shapes, replace(theta, state=clamp_state(shapes.trees, _rescaled(references, fitted)))


def facing(shapes: Shapes, center: Tensor, azimuths: Sequence[float], elevation: float) -> Theta:
    """References that stand where a cloud is and are seen from one side each, their joints half-way.

    Parameters
    ----------
    shapes : Shapes
        One for each azimuth.
    center : (1, 3) float
        Mean of the cloud.
    azimuths : sequence of float
        Degrees about the vertical of the rest frame, 0 for a view of its front.
    elevation : float
        Degrees above the horizon.
    """
    side, up = np.deg2rad(np.asarray(azimuths)), np.deg2rad(elevation)
    away = np.stack([-np.cos(side) * np.cos(up), -np.sin(side) * np.cos(up), np.full(len(side), np.sin(up))], axis=1)
    turned = np.stack([look_at_transform(eye, np.zeros(3))[:3, :3].T for eye in away])
    trees, plain = shapes.trees, Theta.at_rest(shapes.trees)
    middle = torch.where(torch.isfinite(trees.upper - trees.lower), 0.5 * (trees.lower + trees.upper), trees.rest)
    theta = replace(
        plain, rotation=torch.from_numpy(turned).to(center), translation=center.expand(len(shapes), -1),
        state=torch.where(trees.free, middle, plain.state),
    )  # fmt: skip
    posed = pose_parts(trees, theta, shapes.box_center)
    points, normals = posed.points(shapes.points, shapes.box_center), posed.normals(shapes.normals)
    seen = ((points * normals).sum(-1) < 0.0) & shapes.has_surface[..., None]
    share = seen.to(points.dtype)[..., None] / seen.sum((1, 2)).clamp(min=1)[:, None, None, None]
    return replace(theta, translation=2.0 * center - (points * share).sum((1, 2)))


def adapted(shapes: Shapes, theta: Theta) -> Shapes:
    """References that have the shape which ``theta`` gives them, so that a state without scale poses them alike."""
    trees = shapes.trees
    posed = pose_parts(trees, theta, shapes.box_center)
    unit = torch.where((trees.slide != 0) & (trees.turn == 0), posed.reach, 1.0)
    mean_scale = posed.scale.mean(-1)
    return Shapes(
        trees=replace(
            trees, origin=posed.origin_rest, lower=trees.lower * unit, upper=trees.upper * unit,
            rest=trees.rest * unit, slide=torch.where(trees.turn == 0, trees.slide, trees.slide * posed.reach),
            offset=trees.offset * unit,
        ),
        box_center=posed.center_rest,
        box_size=shapes.box_size * posed.scale,
        points=posed.center_rest[:, :, None]
        + posed.scale[:, :, None] * (shapes.points - shapes.box_center[:, :, None]),
        normals=torch.nn.functional.normalize(shapes.normals / posed.scale[:, :, None], dim=-1),
        spacing=shapes.spacing * mean_scale,
        diagonal=shapes.diagonal * theta.log_scale.mean(-1).exp(),
    )  # fmt: skip


def sized(shapes: Shapes, diagonal: Tensor) -> Shapes:
    """References with the diagonals (B,) asked for."""
    plain = Theta.at_rest(shapes.trees)
    log_scale = (diagonal.to(plain.state.dtype) / shapes.diagonal).log()[:, None].expand(-1, 3)
    return adapted(shapes, replace(plain, log_scale=log_scale))


def _rescaled(shapes: Shapes, theta: Theta) -> Tensor:
    """States in the units of the adapted references."""
    slides = (shapes.trees.slide != 0) & (shapes.trees.turn == 0)
    return torch.where(slides, theta.state * reach(shapes.trees, theta.log_scale), theta.state)


def procrustes(source: Tensor, target: Tensor, weight: Tensor) -> tuple[Tensor, Tensor]:
    """Rigid motions that bring weighted points nearest to their partners.

    Parameters
    ----------
    source, target : (B, N, 3) float
    weight : (B, P, N) float

    Returns
    -------
    rotation : (B, P, 3, 3) float
    translation : (B, P, 3) float
        ``target = rotation @ source + translation``.
    """
    share = weight / weight.sum(2, keepdim=True).clamp(min=1e-9)
    source_mean, target_mean = share @ source, share @ target
    covariance = torch.einsum("bpn,bni,bnj->bpij", share, target, source)
    covariance = covariance - target_mean[..., :, None] * source_mean[..., None, :]
    u, _, vt = torch.linalg.svd(covariance.double())
    turn = torch.eye(3, dtype=u.dtype).expand(u.shape).clone()
    turn[..., 2, 2] = torch.linalg.det(u @ vt).sign()
    rotation = (u @ turn @ vt).to(source.dtype)
    return rotation, target_mean - rotate(rotation, source_mean)
