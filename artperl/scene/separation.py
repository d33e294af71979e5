"""Estimates of one scene that stand in each other are moved apart: two things are not in one place.

Boxes of parts stand for the parts. Of two objects the one that is less sure moves more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from artperl.core.estimate import Estimate

Array = NDArray[np.float64]

_ROUNDS = 20
"""Passes over all pairs: what moves out of one neighbour may move into another."""
_TOUCHING = 1e-4
"""Metres that boxes may still be in each other."""
_PARALLEL = 1e-9
"""Squared length of a cross product below which two edges are parallel, and give no direction of their own."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes of K parts, camera frame, metres.

    Attributes
    ----------
    rotation, center, half : (K, 3, 3), (K, 3), (K, 3) float
        ``half``: half of their sizes.
    """

    rotation: Array
    center: Array
    half: Array

    @staticmethod
    def of(estimate: Estimate) -> Boxes:
        """Those of an estimate."""
        return Boxes(estimate.rotation, estimate.translation, 0.5 * estimate.size)


def overlap(one: Boxes, other: Boxes) -> tuple[float, Array]:
    """How deep the boxes of two objects are in each other at most.

    By the separating axis theorem: two boxes are as deep in each other as they are along that one of 15 directions in
    which they are least so (Gottschalk et al. 1996).

    Returns
    -------
    float, (3,) float
        Metres, 0 if they are apart; and the direction in which ``other`` leaves ``one``.
    """
    deepest, direction = 0.0, np.zeros(3)
    for R, center, half in zip(one.rotation, one.center, one.half, strict=True):
        for S, away, side in zip(other.rotation, other.center - center, other.half, strict=True):
            crossed = np.cross(R.T[:, None], S.T[None]).reshape(9, 3)
            axes = np.concatenate([R.T, S.T, crossed[(crossed**2).sum(1) > _PARALLEL]])
            axes /= np.linalg.norm(axes, axis=1, keepdims=True)
            apart = axes @ away
            depth = np.abs(axes @ R) @ half + np.abs(axes @ S) @ side - np.abs(apart)
            least = int(depth.argmin())
            if depth[least] > deepest:
                deepest, direction = float(depth[least]), axes[least] * (1.0 if apart[least] >= 0 else -1.0)
    return deepest, direction


def moved_apart(estimates: Sequence[Estimate | None], most: float) -> list[Array]:
    """How far each estimate has to move so that none stands in another.

    Parameters
    ----------
    estimates : sequence of Estimate or None
    most : float
        Metres that one is moved at most: what is deeper in another is wrong in another way.

    Returns
    -------
    list of (3,) float
        Metres, camera frame; zeros for None.
    """
    moves = [np.zeros(3) for _ in estimates]
    boxes = {i: Boxes.of(estimate) for i, estimate in enumerate(estimates) if estimate is not None}
    doubts = {i: 1.0 - estimate.confidence + 1e-3 for i, estimate in enumerate(estimates) if estimate is not None}
    reach = {i: _reach(own) for i, own in boxes.items()}
    for _ in range(_ROUNDS):
        clear = True
        for i, j in combinations(boxes, 2):
            one, other = _shifted(boxes[i], moves[i]), _shifted(boxes[j], moves[j])
            if np.linalg.norm(reach[i][0] + moves[i] - reach[j][0] - moves[j]) > reach[i][1] + reach[j][1]:
                continue
            depth, direction = overlap(one, other)
            if depth <= _TOUCHING:
                continue
            clear = False
            share = doubts[i] / (doubts[i] + doubts[j])
            moves[i] = _bounded(moves[i] - share * depth * direction, most)
            moves[j] = _bounded(moves[j] + (1.0 - share) * depth * direction, most)
        if clear:
            break
    return moves


def moved(estimate: Estimate, move: Array) -> Estimate:
    """The estimate somewhere else, by (3,) metres in the camera frame."""
    T = estimate.T_camera_part.copy()
    T[:, :3, 3] += move
    return replace(
        estimate, T_camera_part=T, translation=estimate.translation + move, joint_origin=estimate.joint_origin + move
    )


def _shifted(boxes: Boxes, move: Array) -> Boxes:
    return replace(boxes, center=boxes.center + move)


def _reach(boxes: Boxes) -> tuple[Array, float]:
    """Centre and radius of a ball around all boxes."""
    middle = boxes.center.mean(0)
    return middle, float((np.linalg.norm(boxes.center - middle, axis=1) + np.linalg.norm(boxes.half, axis=1)).max())


def _bounded(move: Array, most: float) -> Array:
    length = float(np.linalg.norm(move))
    return move if length <= most else move * (most / length)
