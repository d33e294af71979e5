"""Clouds of simulated objects, true states of references, and states that are off by a known amount."""

from __future__ import annotations

import numpy as np
import torch

import artsim
from artperl.core.pose import Theta, clamp_state, pose_parts, theta_from_parts
from artperl.core.rotations import rotation_from_vector
from artperl.core.shapes import Observed, Shapes
from artperl.evaluation import metrics
from artsim.model.draws import StateOptions, ViewOptions, sample_state, sample_view
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample


def views(category: str, count: int, first_seed: int = 0) -> tuple[list[ArticulatedObject], list[Sample]]:
    """Objects of diagonal 1, and a partial cloud of each in a random state."""
    rng = np.random.default_rng([first_seed, count])
    objects = [artsim.make(category, first_seed + i).with_diagonal(1.0) for i in range(count)]
    samples = []
    for obj in objects:
        q = sample_state(obj, StateOptions(), rng)
        samples.append(artsim.observe(obj, q, sample_view(obj, q, ViewOptions(), rng), num_points=512, rng=rng))
    return objects, samples


def observe(samples: list[Sample]) -> Observed:
    part = torch.from_numpy(np.stack([s.part for s in samples]).astype(np.int64))
    return Observed.of(torch.from_numpy(np.stack([s.points for s in samples])), part)


def true_theta(shapes: Shapes, samples: list[Sample]) -> Theta:
    """The state in which a reference meets each sample's true part poses and boxes."""
    B, P = shapes.trees.valid.shape
    rotation = np.tile(np.eye(3), (B, P, 1, 1))
    center, size = np.zeros((B, P, 3)), np.ones((B, P, 3))
    for b, s in enumerate(samples):
        K = len(s.joint_type)
        rotation[b, :K], size[b, :K] = s.T_camera_part[:, :3, :3], s.box_size
        center[b, :K] = (rotation[b, :K] @ s.box_center[..., None])[..., 0] + s.T_camera_part[:, :3, 3]
    poses = (torch.from_numpy(x).to(shapes.points.dtype) for x in (rotation, center, size))
    return theta_from_parts(shapes.trees, shapes.box_center, shapes.box_size, *poses)


def perturbed(shapes: Shapes, theta: Theta, degrees: float, length: float, seed: int = 0) -> Theta:
    """Turned about the root's centre, moved, and with every joint off, by as much as said; the shape unchanged."""
    rng = torch.Generator().manual_seed(seed)
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    axis, way = (torch.nn.functional.normalize(torch.randn(len(theta), 3, generator=rng), dim=-1) for _ in range(2))
    turn = rotation_from_vector((np.deg2rad(degrees) * axis).to(theta.state.dtype))
    pivot = posed.center[:, 0]
    sign = torch.rand(theta.state.shape, generator=rng).sub(0.5).sign()
    amount = torch.where(shapes.trees.turn != 0, float(np.deg2rad(degrees)), length)
    return Theta(
        turn @ theta.rotation,
        (turn @ (theta.translation - pivot)[..., None])[..., 0] + pivot + length * way.to(theta.state.dtype),
        torch.zeros_like(theta.log_scale),
        clamp_state(shapes.trees, theta.state + (sign * amount).to(theta.state.dtype)),
        torch.zeros_like(theta.shift),
        torch.zeros_like(theta.stretch),
    )


def errors(shapes: Shapes, theta: Theta, truth: Theta) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (deg) and translation (diagonals) of every part that exists."""
    found, true = (pose_parts(shapes.trees, t, shapes.box_center) for t in (theta, truth))
    valid = shapes.trees.valid
    rotation = metrics.rotation_error(found.rotation[valid].numpy(), true.rotation[valid].numpy())
    return rotation, metrics.translation_error(found.center[valid].numpy(), true.center[valid].numpy(), 1.0)
