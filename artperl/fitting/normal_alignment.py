"""Turning a fit until flat surfaces face along the axes of their part: beyond the paper.

Most of what articulated objects show is flat, and parallel to the sides of its part's box. A fit turns by half a degree
to make up for a reference whose top lies a little too high, or whose front a little too far out; which way surfaces
face does not depend on where they lie, and tells the rotation to a few hundredths of a degree.
"""

from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

from artperl.core.neighbours import planes, tree_of
from artperl.core.pose import Theta, clamp_state, pose_parts
from artperl.core.rotations import rotation_from_vector
from artperl.core.shapes import Shapes

Array = NDArray[np.float64]

_LOOKED_AT, _NEIGHBOURS = 1024, 12
"""Points whose normals are looked at, and by how many points around them, with their own."""
_FLAT = 0.3
"""Thickness of such a neighbourhood over its width, both root mean squares, up to which it is flat."""
_WINDOWS = (5.0, 2.5, 2.5, 2.5)
"""Degrees from an axis within which normals count, round by round."""
_NEAR = 1.0
"""Degrees from an axis at which a normal counts half."""
_TRUST = 0.005
"""Share of the points that weighs as much as the fit does."""
_SQUARE, _SHARP = 0.2, 0.7
"""Shares of the part's points, and of those that count, that must be that near an axis in the end: flat, not round."""
_LEAN, _MOST = 0.5, 3.0
"""Degrees that a hinge may lean from the axes for its part to be square, and that a part is turned by at most."""


def normals_of(points: Array) -> tuple[NDArray[np.int64], Array]:
    """Some points of a cloud in random order (N, 3) that lie in flat surroundings, (M,), and their normals, (M, 3).

    Normals have either sign.
    """
    count = min(_NEIGHBOURS, len(points))
    spread, normal = planes(points, tree_of(points).query(points[:_LOOKED_AT], range(1, count + 1))[1])
    flat = np.flatnonzero((spread[:, 0] < _FLAT**2 * spread[:, 1]) & (spread[:, 1] > 0.0))
    return flat, normal[flat]


def align_normals(shapes: Shapes, theta: Theta, points: Array, part: NDArray[np.int64]) -> Theta:
    """Theta of one object whose root is turned, and whose hinges are, until surfaces face along axes.

    The root, and what slides along it, turns about the middle of its points; then each hinge down the tree turns by
    what its part's surfaces say. What has few flat surfaces that nearly face along an axis stays as it is, and so does
    what hangs from a hinge that leans.

    Parameters
    ----------
    shapes : Shapes
    theta : Theta
    points : (N, 3) float
        Camera frame, metres, in random order.
    part : (N,) int64
        -1 for points of no part.
    """
    trees, known = shapes.trees, part >= 0
    points, part = points[known], part[known]
    if len(points) < _NEIGHBOURS:
        return theta
    flat, normal = normals_of(points)
    looked_at = part[:_LOOKED_AT]
    own = looked_at[flat]
    turning = (trees.turn[0] != 0).numpy()
    still = ~trees.carries[0].numpy()[turning].any(axis=0)
    R = theta.rotation[0].double().numpy()
    turn = _alignment(normal[still[own]] @ R, np.eye(3), int(still[looked_at].sum()))
    if turn is not None:
        middle = points[still[part]].mean(axis=0)
        turned = R @ rotation_from_vector(torch.from_numpy(turn)).numpy()
        moved = middle + turned @ R.T @ (theta.translation[0].double().numpy() - middle)
        theta = replace(
            theta, rotation=torch.from_numpy(turned)[None].to(theta.rotation),
            translation=torch.from_numpy(moved)[None].to(theta.translation),
        )  # fmt: skip
    for k in np.flatnonzero(turning & trees.free[0].numpy()):  # parents come before their children
        axis = trees.axis[0, k].double().numpy()
        if np.abs(axis).max() > np.cos(np.radians(_LEAN)):
            R = pose_parts(trees, theta, shapes.box_center).rotation[0, k].double().numpy()
            turn = _alignment(normal[own == k] @ R, axis[None], int((looked_at == k).sum()))
            if turn is not None:
                state = theta.state.clone()
                state[0, k] += float(turn @ axis) / float(trees.turn[0, k])
                theta = replace(theta, state=clamp_state(trees, state))
    return theta


def _alignment(normal: Array, about: Array, points: int) -> Array | None:
    """(3,) rotation vector, a mix of directions (D, 3), by which a part is to turn in its own frame; None if unclear.

    Parameters
    ----------
    normal : (M, 3) float
        In the part's frame.
    about : (D, 3) float
    points : int
        Of the part that were looked at, flat or not.
    """
    if len(normal) == 0:
        return None
    turn, rows = np.zeros(3), np.arange(len(normal))
    for window in _WINDOWS:
        seen = normal @ rotation_from_vector(torch.from_numpy(turn)).numpy()
        axis = np.abs(seen).argmax(axis=1)
        target = np.zeros_like(seen)
        target[rows, axis] = np.sign(seen[rows, axis])
        off = np.degrees(np.arccos(np.clip(np.abs(seen[rows, axis]), 0.0, 1.0)))
        weight = (off < window) / (1.0 + (off / _NEAR) ** 2)
        arm = np.cross(seen[:, None], about)  # how normals turn with the part
        push = np.einsum("n,ndi,nei->de", weight, arm, arm) + _TRUST * points * np.eye(len(about))
        pull = np.einsum("n,ndi,ni->d", weight, arm, target - seen) - _TRUST * points * (about @ turn)
        turn = turn + np.linalg.solve(push, pull) @ about
    sharp = np.sum(off < _NEAR) >= max(_SQUARE * points, _SHARP * np.sum(off < window))
    return turn if sharp and np.degrees(np.linalg.norm(turn)) <= _MOST else None
