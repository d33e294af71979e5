"""Ways in which a part may open, and how likely each is: what a front that is shut does not tell for sure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WAYS = ("slides", *(f"hinged at {end}" for end in ("-X", "-Y", "-Z", "+X", "+Y", "+Z")), "turns about its middle")
"""A part slides, is hinged at an end of its box, or turns about its middle, as a knob does. Ends are named in the rest
frame: of furniture, seen from its front, +Y is on the left."""
_AT_MIDDLE = 0.02
"""Diagonals: an axis nearer to the middle of a part's box is at no end of it."""
_SMALL = 0.05
"""Diagonals that are added to half of a box's longest side before a distance is taken over it: votes for small parts
differ by as much."""
_SHARPNESS = np.array([1.4, 1.5])
"""Of distances of votes on a cloud, and on its mirror image. As :data:`_USUAL`, ``python -m benchmarks.ways --fit 60``
has them from procedural furniture that nothing is learnt from."""
_USUAL = np.array([1.6, -3.1, 1.3, 2.4, -3.1, 1.2, 1.3, -1.5])
"""Log-odds of each way of a front before anything is seen, but for a constant."""
_LIKELY, _WORTH_SAYING = 0.05, 0.2
"""Probabilities from which a way is told, and another one is said to people."""


def ways_of(joint: Array) -> NDArray[np.int64]:
    """(K,) numbers in :data:`WAYS` of joints (K, 9) as :func:`artperl.core.clouds.joint_rows` has them; -1 of what is
    fixed.
    """
    slide, turn, pivot = np.split(np.asarray(joint), 3, axis=-1)
    away, axis = np.abs(pivot).max(-1), np.abs(pivot).argmax(-1)
    ahead = np.take_along_axis(pivot, axis[..., None], -1)[..., 0] > 0
    hinged = np.where(away < _AT_MIDDLE, len(WAYS) - 1, 1 + axis + 3 * ahead)
    way = np.where(slide.any(-1), 0, hinged)
    return np.where(slide.any(-1) | turn.any(-1), way, -1)


def _ideal_joints(size: Array) -> tuple[Array, NDArray[np.int64]]:
    """Joints (n, 9), but for the sense of their axes, of a box with such sides (3,), and their ways."""
    rows, ways = [], []
    for axis in np.eye(3):
        rows.append(np.concatenate([axis, np.zeros(6)]))
        ways.append(0)
        rows.append(np.concatenate([np.zeros(3), axis, np.zeros(3)]))
        ways.append(len(WAYS) - 1)
        for end, side in enumerate(np.concatenate([-np.eye(3), np.eye(3)])):
            if not side @ axis:
                rows.append(np.concatenate([np.zeros(3), axis, 0.5 * size * side]))
                ways.append(1 + end)
    return np.array(rows), np.array(ways)


def way_distances(votes: Array, size: Array) -> Array:
    """How far votes for a part's joint are, in the mean, from the nearest joint of each way: the difference of axes of
    length 1, and how far the one is from the other in halves of the box.

    Parameters
    ----------
    votes : (n, 9) float
    size : (3,) float
        Of the part's box, in diagonals.

    Returns
    -------
    (W,) float
    """
    rows, ways = _ideal_joints(size)
    told = np.concatenate([np.abs(votes[:, :6]), votes[:, 6:]], axis=1)
    off = np.abs(told[:, None] - rows).mean(axis=0)
    apart = off[:, :6].sum(axis=1) + off[:, 6:].sum(axis=1) / (0.5 * size.max() + _SMALL)
    return np.array([apart[ways == way].min() for way in range(len(WAYS))])


def way_chances(distances: Array) -> Array:
    """(..., W) probabilities of ways, by distances (..., W, 2) of votes on a cloud and on its mirror image."""
    score = _USUAL - distances @ _SHARPNESS
    chance = np.exp(score - score.max(axis=-1, keepdims=True))
    shares: Array = chance / chance.sum(axis=-1, keepdims=True)
    return shares


def likely_ways(chances: Array, joint_type: Sequence[str]) -> tuple[dict[str, float], ...]:
    """Ways of each part and their probabilities, the likeliest first; none of what does not move, or is not told.

    Parameters
    ----------
    chances : (K, W) float
        Or (0, 0).
    joint_type : sequence of str, length K
    """
    told = []
    for k, kind in enumerate(joint_type):
        own = chances[k] if len(chances) and kind not in ("free", "fixed") else np.zeros(0)
        told.append({WAYS[w]: float(own[w]) for w in np.argsort(-own) if own[w] >= _LIKELY})
    return tuple(told)


def unsure(ways: Sequence[Mapping[str, float]], names: Sequence[str]) -> list[str]:
    """A line for each part that may well open in more than one way."""
    lines = []
    for k, own in enumerate(ways):
        told = [f"{way} ({100 * chance:.0f} %)" for way, chance in own.items() if chance >= _WORTH_SAYING]
        if len(told) > 1:
            lines.append(f"{names[k] if k < len(names) else k}: {' or '.join(told)}")
    return lines
