"""The discrete action space, what an action does, and the expert that knows the way (ArtPERL, section 4.3).

Each step chooses, for every part, one of 11 bins on each of 9 axes: nothing, or one of five magnitudes in either
direction. The root's free joint turns about the axes of its rest frame through its box centre, moves along them, and
scales along them: seen from the reference, the same error needs the same action wherever the camera is. A hinge turns
about its axis and moves its anchor; a slide moves along its axis. The axes that a joint does not have are masked.
"""

from dataclasses import replace

import torch
from torch import Tensor

from artperl.core.pose import Theta, clamp_state, reach
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Shapes
from artperl.core.trees import Trees

MAGNITUDES = (0.0033, 0.01, 0.03, 0.09, 0.27)
"""Radians, and units of an observed cloud of unit radius (as ReAgent, Bauer et al. 2021)."""
NUM_BINS = 2 * len(MAGNITUDES) + 1
NOTHING = len(MAGNITUDES)
"""The bin that changes nothing."""
TURN, MOVE, SCALE = slice(0, 3), slice(3, 6), slice(6, 9)
"""Axes of the root. Of other parts, axis 0 is the joint's state, and ``MOVE`` shifts its anchor in the rest frame."""
STATE = 0
NUM_AXES = 9

STEPS = torch.tensor([*(-m for m in reversed(MAGNITUDES)), 0.0, *MAGNITUDES])
"""(11,) signed step of each bin."""
_FINE = 0.03
"""Radians, or radii: 512 points of a cloud tell steps of this size apart, and hardly smaller ones."""


def action_mask(trees: Trees) -> Tensor:
    """(B, P, 9) bool: the axes that each part has."""
    B, P = trees.valid.shape
    mask = torch.zeros(B, P, NUM_AXES, dtype=torch.bool, device=trees.valid.device)
    mask[:, 0] = True
    mask[..., STATE] |= trees.free
    hinge = trees.free & (trees.turn != 0)
    mask[..., MOVE] |= hinge[..., None]
    return mask & trees.valid[..., None]


def apply(shapes: Shapes, theta: Theta, action: Tensor, radius: Tensor) -> Theta:
    """Theta after an action.

    Parameters
    ----------
    shapes : Shapes
    theta : Theta
    action : (B, P, 9) int64
        Bins; those of masked axes are ignored.
    radius : (B,) float
        Of the observed cloud, metres.
    """
    return move(shapes, theta, STEPS.to(radius)[action] * action_mask(shapes.trees), radius)


def move(shapes: Shapes, theta: Theta, step: Tensor, radius: Tensor) -> Theta:
    """Theta after steps of any size (B, P, 9), in radians and radii."""
    root, metres = step[:, 0], radius[:, None]
    trees = shapes.trees
    center = rotate(theta.rotation, _root_center(shapes, theta)) + theta.translation
    rotation = theta.rotation @ rotation_from_vector(root[:, TURN])
    log_scale = theta.log_scale + root[:, SCALE]
    slides = (trees.slide != 0) & (trees.turn == 0)
    along = reach(trees, log_scale)
    state_step = torch.where(slides, step[..., STATE] * metres / along, step[..., STATE])
    state = torch.where(trees.free, clamp_state(trees, theta.state + state_step), theta.state)
    shift = theta.shift + step[..., MOVE] * metres[..., None]
    shift = torch.cat([theta.shift[:, :1], shift[:, 1:]], dim=1)
    moved = replace(theta, rotation=rotation, log_scale=log_scale, state=state, shift=shift)
    shifted = center + rotate(theta.rotation, root[:, MOVE] * metres)
    translation = shifted - rotate(rotation, _root_center(shapes, moved))
    return replace(moved, translation=translation)


def residual(shapes: Shapes, theta: Theta, goal: Theta, radius: Tensor) -> Tensor:
    """(B, P, 9) steps that would lead from ``theta`` to ``goal`` at once: the inverse of :func:`move`."""
    trees, metres = shapes.trees, radius[:, None]
    steps = torch.zeros(*trees.valid.shape, NUM_AXES, dtype=radius.dtype, device=radius.device)
    steps[:, 0, TURN] = rotation_vector(theta.rotation.transpose(-1, -2) @ goal.rotation)
    here = rotate(theta.rotation, _root_center(shapes, theta)) + theta.translation
    there = rotate(goal.rotation, _root_center(shapes, goal)) + goal.translation
    steps[:, 0, MOVE] = rotate(theta.rotation.transpose(-1, -2), there - here) / metres
    steps[:, 0, SCALE] = goal.log_scale - theta.log_scale
    slides = (trees.slide != 0) & (trees.turn == 0)
    missing = goal.state - theta.state
    missing = torch.where(slides, missing * reach(trees, goal.log_scale) / metres, missing)
    steps[:, 1:, STATE] = missing[:, 1:]
    steps[:, 1:, MOVE] = ((goal.shift - theta.shift) / metres[..., None])[:, 1:]
    return steps * action_mask(trees)


def compressed(step: Tensor) -> Tensor:
    """Steps of any size on the scale that errors are counted on: as they are up to :data:`_FINE`, then by logarithm.

    Points cannot tell smaller steps apart. If these counted like large ones, an agent would mostly learn their noise.
    """
    return (step / _FINE).asinh()


BINS = compressed(STEPS)
"""(11,) where the bins stand on that scale."""


def nearest_bin(step: Tensor) -> Tensor:
    """(...) int64 bins nearest to steps of any size, on the scale of :func:`compressed`."""
    middles = 0.5 * (BINS[1:] + BINS[:-1])
    return torch.bucketize(compressed(step), middles.to(step))


def expert(shapes: Shapes, theta: Theta, goal: Theta, radius: Tensor) -> Tensor:
    """(B, P, 9) int64: the action of an expert that knows the goal: on each axis the bin nearest to what is missing."""
    return nearest_bin(residual(shapes, theta, goal, radius))


def rotation_vector(rotation: Tensor) -> Tensor:
    """(B, 3) axis times angle of rotations (B, 3, 3)."""
    twist = torch.stack(
        [
            rotation[..., 2, 1] - rotation[..., 1, 2],
            rotation[..., 0, 2] - rotation[..., 2, 0],
            rotation[..., 1, 0] - rotation[..., 0, 1],
        ],
        dim=-1,
    )
    sine2 = torch.linalg.vector_norm(twist, dim=-1)
    trace = rotation.diagonal(dim1=-2, dim2=-1).sum(-1)
    angle = torch.atan2(sine2, trace - 1.0)
    # Near half a turn the twist vanishes; there the symmetric part shows the axis: (1 - cos) a a^T.
    eye = torch.eye(3, dtype=rotation.dtype, device=rotation.device)
    symmetric = 0.5 * (rotation + rotation.transpose(-1, -2)) - 0.5 * (trace - 1.0)[..., None, None] * eye
    column = torch.linalg.vector_norm(symmetric, dim=-2).argmax(-1)
    half = torch.nn.functional.normalize(
        symmetric.gather(-1, column[..., None, None].expand(*column.shape, 3, 1))[..., 0], dim=-1
    )
    half = torch.where((half * twist).sum(-1, keepdim=True) < 0, -half, half)
    axis = torch.where((trace < -0.9)[..., None], half, twist / sine2.clamp(min=1e-12)[..., None])
    return torch.where((sine2 < 1e-7)[..., None] & (trace > 0)[..., None], 0.5 * twist, axis * angle[..., None])


def _root_center(shapes: Shapes, theta: Theta) -> Tensor:
    """(B, 3) box centre of the root in the adapted rest frame."""
    return theta.log_scale.exp() * shapes.box_center[:, 0]
