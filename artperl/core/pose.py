"""Joint-centric pose: the state Theta of a reference object <-> the 9D pose of every part (ArtPERL, section 4.1).

A batch holds B objects with trees of any shape, padded to P rows for parts. The root's free joint carries a rotation,
a translation and a scale; every other joint one state. The reference's shape may be adapted: as a whole along the axes
of its rest frame, and part by part (size about the part's own box centre, position of its joint's anchor). In the
rest frame a point ``x`` of part k, whose box centre is ``c`` and whose joint's anchor is ``o``, goes to

    x' = c' + exp(log_scale + stretch_k) * (x - c),  c' = exp(log_scale) * c + shifts,  o' = exp(log_scale) * o + shifts

where ``shifts`` is the sum of the anchors' shifts from the root down to part k. Directions of axes are what objects of
a category share (equation 7), so that no scale turns them. Lengths along a prismatic joint, and its limits, are in
the reference's own units and grow with ``exp(log_scale)`` along the axis: see :func:`reach`.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.rotations import nearest_angle, rotate, rotation_about
from artperl.core.trees import Trees


@dataclass(frozen=True, eq=False)
class Theta(Batch):
    """Joint-centric state of B objects."""

    rotation: Tensor
    """(B, 3, 3) float. Of the root: rest frame -> camera."""
    translation: Tensor
    """(B, 3) float. Of the root, metres."""
    log_scale: Tensor
    """(B, 3) float. Logarithm of the scale of the whole reference along the axes of its rest frame."""
    state: Tensor
    """(B, P) float. Radians, or lengths in the reference's units. Entries of the root, of followers and of padding are
    ignored."""
    shift: Tensor
    """(B, P, 3) float. Of each joint's anchor, in the rest frame; what hangs from it moves along. The root's entry is
    ignored."""
    stretch: Tensor
    """(B, P, 3) float. Logarithm of each part's own scale, besides that of the whole."""

    @staticmethod
    def at_rest(trees: Trees) -> Theta:
        """Rest state on the camera frame, the reference's shape unchanged."""
        B, P = trees.valid.shape
        zeros = trees.rest.new_zeros
        rotation = torch.eye(3, dtype=trees.rest.dtype, device=trees.rest.device).expand(B, 3, 3)
        return Theta(rotation, zeros(B, 3), zeros(B, 3), trees.rest, zeros(B, P, 3), zeros(B, P, 3))


@dataclass(frozen=True, eq=False)
class Posed(Batch):
    """Where Theta puts the parts. ``p_camera = rotation @ (center_rest + scale * (x - c)) + translation``."""

    rotation: Tensor
    """(B, P, 3, 3) float."""
    translation: Tensor
    """(B, P, 3) float. ``T_camera_part``: the adapted rest frame, as carried by each part -> camera."""
    center_rest: Tensor
    """(B, P, 3) float. Box centres in the adapted rest frame."""
    origin_rest: Tensor
    """(B, P, 3) float. Anchors of the joints in the adapted rest frame, at rest."""
    scale: Tensor
    """(B, P, 3) float. Of each part, about its box centre."""
    reach: Tensor
    """(B, P) float. See :func:`reach`."""

    @property
    def center(self) -> Tensor:
        """(B, P, 3) box centres in the camera frame: the translation of the 9D pose."""
        return rotate(self.rotation, self.center_rest) + self.translation

    def points(self, points: Tensor, box_center: Tensor) -> Tensor:
        """Reference points of each part in the camera frame.

        Parameters
        ----------
        points : (B, P, M, 3) float
            In the reference's rest frame.
        box_center : (B, P, 3) float
            Of the reference.
        """
        adapted = self.center_rest[:, :, None] + self.scale[:, :, None] * (points - box_center[:, :, None])
        return adapted @ self.rotation.transpose(-1, -2) + self.translation[:, :, None]

    def normals(self, normals: Tensor) -> Tensor:
        """(B, P, M, 3) unit normals of the reference's surface in the camera frame."""
        adapted = torch.nn.functional.normalize(normals / self.scale[:, :, None], dim=-1)
        return adapted @ self.rotation.transpose(-1, -2)


def complete_state(trees: Trees, state: Tensor) -> Tensor:
    """(B, P) states with followers set from their sources, and the root and padding at rest."""
    followed = trees.multiplier * state.gather(1, trees.source) + trees.offset
    return torch.where(trees.multiplier != 0, followed, trees.rest + trees.offset)


def reach(trees: Trees, log_scale: Tensor) -> Tensor:
    """(B, P) camera units per reference unit along each joint's axis: 1 for joints that only turn.

    A drawer's state and limits are lengths of the reference; ``state * reach`` is the drawer's state in metres.
    """
    along = torch.linalg.vector_norm(log_scale.exp()[:, None] * trees.axis, dim=-1)
    return torch.where(trees.slide != 0, along, torch.ones_like(along))


def joint_states(trees: Trees, theta: Theta) -> Tensor:
    """(B, P) states in radians and camera units (metres); see :func:`reach`. Screws count radians."""
    state = complete_state(trees, theta.state)
    return torch.where(trees.turn == 0, state * reach(trees, theta.log_scale), state)


def pose_parts(trees: Trees, theta: Theta, box_center: Tensor) -> Posed:
    """Pose every part: forward kinematics of the adapted reference.

    Motions of joints are composed along the tree by doubling: after n rounds each part knows its motion against its
    2^n-th ancestor, so that a batch of trees of depth d takes log2(d) rounds, whatever their shapes.

    Parameters
    ----------
    trees : Trees
    theta : Theta
    box_center : (B, P, 3) float
        Of the reference's parts, in its rest frame.
    """
    whole = theta.log_scale.exp()[:, None]
    shifts = torch.einsum("bjk,bji->bki", trees.carries.to(theta.shift.dtype), theta.shift)
    origin, center = whole * trees.origin + shifts, whole * box_center + shifts
    along = reach(trees, theta.log_scale)
    step = complete_state(trees, theta.state) - trees.rest
    rotation = rotation_about(trees.axis, step * trees.turn)
    translation = origin - rotate(rotation, origin) + (step * trees.slide * along)[..., None] * trees.axis
    ancestor, known = trees.parent, 1
    deepest = int(trees.depth.max())
    while known < deepest:
        rows = ancestor[..., None]
        above = rotation.gather(1, rows[..., None].expand(-1, -1, 3, 3))
        translation = rotate(above, translation) + translation.gather(1, rows.expand(-1, -1, 3))
        rotation = above @ rotation
        ancestor, known = ancestor.gather(1, ancestor), 2 * known
    return Posed(
        theta.rotation[:, None] @ rotation,
        rotate(theta.rotation[:, None], translation) + theta.translation[:, None],
        center,
        origin,
        (theta.log_scale[:, None] + theta.stretch).exp(),
        along,
    )


def joint_axes(trees: Trees, posed: Posed) -> tuple[Tensor, Tensor]:
    """(B, P, 3) unit axes and anchors of the joints in the camera frame, carried by their parents."""
    rotation, translation = parent_pose(trees, posed)
    return rotate(rotation, trees.axis), rotate(rotation, posed.origin_rest) + translation


def parent_pose(trees: Trees, posed: Posed) -> tuple[Tensor, Tensor]:
    """(B, P, 3, 3) rotation and (B, P, 3) translation of each part's parent; of the root, its own."""
    rows = trees.parent[..., None]
    rotation = posed.rotation.gather(1, rows[..., None].expand(-1, -1, 3, 3))
    return rotation, posed.translation.gather(1, rows.expand(-1, -1, 3))


def theta_from_parts(
    trees: Trees, box_center: Tensor, box_size: Tensor, rotation: Tensor, center: Tensor, size: Tensor
) -> Theta:
    """State of a reference that takes its parts to given 9D poses: the inverse of :func:`pose_parts`.

    The root's pose and every size are met exactly. A joint's state is the one whose rotation (or, for prismatic
    joints, whose displacement of the box centre along the axis) is nearest; its anchor is shifted so that the part's
    box centre is met, up to what a prismatic joint's own state does. So the result is exact for poses that the tree
    allows, and the nearest state for others: the target that an expert steers a reference to.

    Parameters
    ----------
    trees : Trees
    box_center, box_size : (B, P, 3) float
        Of the reference, in its rest frame.
    rotation : (B, P, 3, 3) float
    center, size : (B, P, 3) float
        9D poses: rotation of ``T_camera_part``, box centre in the camera frame, box size.

    Returns
    -------
    Theta
        States may lie outside the reference's limits; see :func:`clamp_state`.
    """
    valid = trees.valid[..., None]
    log_size = torch.where(valid, (size / box_size.clamp(min=1e-12)).clamp(min=1e-12).log(), 0.0)
    log_scale = log_size.sum(1) / valid.sum(1)
    stretch = torch.where(valid, log_size - log_scale[:, None], 0.0)
    whole = log_scale.exp()[:, None]
    along = reach(trees, log_scale)
    root = rotation[:, 0]
    translation = center[:, 0] - rotate(root, (whole * box_center)[:, 0])
    slides_only = (trees.slide != 0) & (trees.turn == 0)
    state, shift = trees.rest.clone(), torch.zeros_like(box_center)
    theta = Theta(root, translation, log_scale, state, shift, stretch)
    for depth in range(1, int(trees.depth.max()) + 1):
        posed = pose_parts(trees, theta, box_center)  # right for all parts above this depth
        above, moved = parent_pose(trees, posed)
        here = (trees.depth == depth) & trees.valid
        turned = nearest_angle(above.transpose(-1, -2) @ rotation, trees.axis)
        goal = rotate(above.transpose(-1, -2), center - moved)  # box centre in the parent's rest frame
        slid = ((goal - posed.center_rest) * trees.axis).sum(-1) / (along * _nonzero(trees.slide))
        # A screw's angle is known up to whole turns: its displacement says how many.
        turns = torch.where(trees.turn * trees.slide != 0, ((slid - turned) / (2 * torch.pi)).round(), 0.0)
        step = torch.where(trees.turn != 0, turned + 2 * torch.pi * turns, torch.where(trees.slide != 0, slid, 0.0))
        state = torch.where(here, _into_limits(trees, trees.rest + step), theta.state)
        theta = Theta(root, translation, log_scale, state, theta.shift, stretch)
        missing = goal - rotate(above.transpose(-1, -2), pose_parts(trees, theta, box_center).center - moved)
        missing = torch.where(slides_only[..., None], _across(missing, trees.axis), missing)
        theta = Theta(root, translation, log_scale, state, torch.where(here[..., None], missing, theta.shift), stretch)
    return theta


def clamp_state(trees: Trees, state: Tensor) -> Tensor:
    """(B, P) states moved into the limits."""
    return torch.maximum(torch.minimum(state, trees.upper), trees.lower)


def _across(vectors: Tensor, axis: Tensor) -> Tensor:
    """The components perpendicular to unit axes."""
    return vectors - (vectors * axis).sum(-1, keepdim=True) * axis


def _nonzero(values: Tensor) -> Tensor:
    return torch.where(values == 0, torch.ones_like(values), values)


def _into_limits(trees: Trees, state: Tensor) -> Tensor:
    """States of hinges that lie outside their limits, moved by a whole turn where that brings them inside."""
    turn = 2 * torch.pi
    hinge = (trees.turn != 0) & (trees.slide == 0)
    for other in (state + turn, state - turn):
        inside = (other >= trees.lower) & (other <= trees.upper)
        outside = (state < trees.lower) | (state > trees.upper)
        state = torch.where(hinge & inside & outside, other, state)
    return state


@dataclass(frozen=True, eq=False)
class AxisPrior(Batch):
    """How the axes of an object's hinges may lean away from its reference's, of B objects."""

    covariance: Tensor
    """(B, 3 P, 3 P) float. Of the rotation vectors that take the reference's axes to the object's: axes may well lean
    together."""
    leans: Tensor
    """(B, P) bool. Joints whose axes lean at all."""
