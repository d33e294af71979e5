"""How a reference's points move with its parameters: the Jacobian of the residuals, and the step back onto Theta.

A part moves rigidly and grows about its box centre, whatever the tree. So the Jacobian is a product of two factors: how
a residual changes with six or nine numbers of its part (:func:`residual_rates`), one row for each residual; and how
these numbers change with all parameters (:func:`part_rates`), one small matrix for each part.
"""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor
from torch.nn import functional

from artperl.core.pose import Posed, Theta, clamp_state, complete_state, joint_axes, parent_pose
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Shapes
from artperl.core.trees import Trees
from artperl.fitting.columns import Columns
from tests.artperl.fitting.torch_matches import Matches


def residual_rates(shapes: Shapes, middle: Tensor, matches: Matches, directions: Tensor, rigid: bool) -> Tensor:
    """Derivatives of residuals by the motion and growth of their part.

    Parameters
    ----------
    shapes : Shapes
    middle : (B, 1, 3) float
        What the object turns about.
    matches : Matches
    directions : (B, R, 2, 3) float
        In which each residual is measured, camera frame; they turn with the part.
    rigid : bool
        Parts do not grow.

    Returns
    -------
    (B, R, 2, 6) float
        By a turn about the middle (3) and by motion (3); unless ``rigid``, (B, R, 2, 9): by growth about the box centre
        (3), too.
    """
    point, posed = (matches.point - middle)[:, :, None].expand_as(directions), matches.posed
    rates = [torch.linalg.cross(point, directions), directions]
    if not rigid:
        rotation = _of_part(posed.rotation.flatten(2), matches.part).unflatten(2, (3, 3))
        growth = _of_part(posed.scale, matches.part) * (matches.local - _of_part(shapes.box_center, matches.part))
        rates.append((directions @ rotation) * growth[:, :, None])
    return -torch.cat(rates, dim=-1)


def part_rates(shapes: Shapes, middle: Tensor, theta: Theta, posed: Posed, rigid: bool, leans: bool) -> Tensor:
    """Derivatives of each part's motion and growth by the parameters.

    Returns
    -------
    (B, P, 6, D) float, unless ``rigid`` (B, P, 9, D)
        Rows as :func:`residual_rates` has them, columns as :class:`Columns`: ``residual_rates @ part_rates`` are the
        derivatives of the residuals of a part's points.
    """
    trees = shapes.trees
    B, P = trees.valid.shape
    columns = Columns(P)
    axis, origin = joint_axes(trees, posed)
    turn, arm = trees.turn[..., None], origin - middle
    carried = trees.carries.transpose(1, 2).to(axis.dtype)[:, :, None]  # (B, P, 1, joints)
    # The moment about a joint's axis is that about the middle less the direction's own about the axis (Pluecker).
    slide = (trees.slide * posed.reach)[..., None] * axis - turn * torch.linalg.cross(axis, arm)
    lines = torch.cat([turn * axis, slide], dim=-1).transpose(1, 2)
    follow = trees.multiplier[..., None] * functional.one_hot(trees.source, P)
    last = columns.state if rigid else columns.lean if leans else columns.shift
    rates = axis.new_zeros(B, P, 6 if rigid else 9, last.stop)
    rates[:, :, :6, slice(6)] = torch.eye(6, device=axis.device)
    rates[:, :, :6, columns.state] = (carried * lines[:, None]) @ follow[:, None]
    if rigid:
        return rates
    above, _ = parent_pose(trees, posed)
    rates[:, :, 3:6, columns.log_scale] = _scale_lever(shapes, theta, posed, above)
    rates[:, :, 6:, columns.log_scale] = torch.eye(3, device=axis.device)
    rates[:, :, 6:, columns.stretch] = torch.eye(3 * P, device=axis.device).reshape(P, 3, 3 * P)
    rates[:, :, 3:6, columns.shift] = torch.einsum("bpj,bjri->bprji", carried[:, :, 0], above).flatten(3)
    if leans:
        # An axis that leans by d takes the turn R about the anchor to exp(d) R exp(-d).
        own = above.transpose(-1, -2) @ posed.rotation
        swing = (turn[..., None] * (above - above @ own)).transpose(-1, -2)
        lines = torch.cat([swing, -torch.linalg.cross(swing, arm[:, :, None].expand_as(swing))], dim=-1)
        rates[:, :, :6, columns.lean] = (
            carried.repeat_interleave(3, dim=-1) * lines.flatten(1, 2).transpose(1, 2)[:, None]
        )
    return rates


def _scale_lever(shapes: Shapes, theta: Theta, posed: Posed, above: Tensor) -> Tensor:
    """(B, P, 3, 3) how each part's box centre moves in the camera frame when log_scale grows along each axis."""
    trees = shapes.trees
    whole = theta.log_scale.exp()[:, None]
    center = posed.rotation * (whole * shapes.box_center)[:, :, None]
    # Anchors move too, with all that they carry; a joint's own turn takes back its parent's part of that.
    anchor = (above - posed.rotation) * (whole * trees.origin)[:, :, None]
    # Prismatic joints reach farther: d reach / d log_scale_i = (scale_i axis_i)^2 / reach.
    step = (complete_state(trees, theta.state) - trees.rest) * trees.slide
    longer = step[..., None] * (whole * trees.axis) ** 2 / posed.reach[..., None]
    along = rotate(above, trees.axis)[..., None] * longer[:, :, None]
    return center + torch.einsum("bjk,bjxi->bkxi", trees.carries.to(center.dtype), anchor + along)


def retract(trees: Trees, theta: Theta, lean: Tensor, step: Tensor, middle: Tensor) -> tuple[Theta, Tensor]:
    """Theta and lean (B, P, 3) after a step (B, D), columns as :class:`Columns`; states stay within their limits."""
    columns = Columns(trees.num_rows)
    turn, pivot = rotation_from_vector(step[:, :3]), middle[:, 0]
    after = Theta(
        turn @ theta.rotation,
        rotate(turn, theta.translation - pivot) + pivot + step[:, 3:6],
        theta.log_scale + step[:, columns.log_scale],
        clamp_state(trees, theta.state + step[:, columns.state]),
        theta.shift + step[:, columns.shift].reshape(theta.shift.shape),
        theta.stretch + step[:, columns.stretch].reshape(theta.stretch.shape),
    )
    leant = step[:, columns.lean]
    return after, lean + leant.reshape(lean.shape) if leant.shape[1] else lean


def lean_axes(shapes: Shapes, lean: Tensor) -> Shapes:
    """References whose axes are turned by rotation vectors (B, P, 3)."""
    if not bool(lean.any()):
        return shapes
    return replace(shapes, trees=replace(shapes.trees, axis=rotate(rotation_from_vector(lean), shapes.trees.axis)))


def _of_part(values: Tensor, part: Tensor) -> Tensor:
    """(B, R, C) the row of (B, P, C) that each part index (B, R) names."""
    return values.gather(1, part[..., None].expand(-1, -1, values.shape[-1]))
