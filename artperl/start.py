"""A first guess at every part's pose, from where the perception network says that points lie in the rest frame."""

from __future__ import annotations

import torch
from torch import Tensor

from artperl.data import Clouds
from artperl.networks.perception import Perceived
from artperl.pose import Theta, theta_from_parts
from artperl.rotations import rotate
from artperl.shapes import Shapes

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


def start(clouds: Clouds, perceived: Perceived, shapes: Shapes) -> Theta:
    """The state that brings each reference nearest to :func:`part_poses`."""
    rotation, center, size = part_poses(clouds, perceived)
    rows = shapes.trees.num_rows
    return theta_from_parts(
        shapes.trees, shapes.box_center, shapes.box_size, rotation[:, :rows], center[:, :rows], size[:, :rows]
    )


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
