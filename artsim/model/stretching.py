"""Stretching: what lies between the edges of parts becomes wider or narrower along an axis of the rest frame.

A map of one coordinate commutes with every joint that leaves this coordinate alone: hinges along the axis, and slides
across it. Then each pose of the stretched object is the stretched pose of the object, and what did not collide does
not collide.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from artsim.model.kinematics import Array

SPREAD = 0.35
"""Standard deviation of the logarithm of a factor: of two drawers one is, commonly, half as wide again."""
APART = 0.01
"""Edges that are nearer than that, in diagonals, are stretched together."""
SIDEWAYS = 1
"""Axis of the rest frame along which furniture is, commonly, the same from either end."""
PARALLEL = 1e-3
"""Sine of the angle within which directions are the same."""


@dataclass(frozen=True, eq=False)
class AxisMap:
    """A map of one coordinate: linear between knots, and a shift beyond the outermost."""

    knots: Array
    goals: Array
    """(N,) float. Ascending. Without any, nothing moves."""

    def __call__(self, values: Array) -> Array:
        """Where coordinates go."""
        if len(self.knots) == 0:
            return values
        inside: Array = np.interp(values, self.knots, self.goals) + values - np.clip(
            values, self.knots[0], self.knots[-1]
        )  # fmt: skip
        return inside


def draw_axis_map(edges: Array, apart: float, mirrored: bool, rng: np.random.Generator) -> AxisMap:
    """A map that keeps the outermost edges, and gives each range between two edges a factor of its own.

    Parameters
    ----------
    edges : (E,) float
        Of parts' boxes along the axis.
    apart : float
        Edges nearer than that are one.
    mirrored : bool
        Edges that are the same from either end stay so.
    rng : numpy.random.Generator
    """
    edges = np.sort(edges)
    knots = edges[np.concatenate([[True], np.diff(edges) > apart])]
    if len(knots) < 2:
        return AxisMap(np.zeros(0), np.zeros(0))
    logarithms = SPREAD * rng.standard_normal(len(knots) - 1)
    if mirrored and np.ptp(knots + knots[::-1]) < 2 * apart:
        half = len(logarithms) // 2
        logarithms[len(logarithms) - half :] = logarithms[:half][::-1]
    lengths = np.diff(knots) * np.exp(logarithms)
    lengths *= (knots[-1] - knots[0]) / lengths.sum()
    return AxisMap(knots, knots[0] + np.concatenate([[0.0], np.cumsum(lengths)]))


def stretchable_axes(joint_axis: Array, joint_type: Sequence[str]) -> list[int]:
    """Axes of the rest frame along which stretching commutes with every joint.

    Parameters
    ----------
    joint_axis : (K, 3) float
        Unit.
    joint_type : sequence of str
        K types; the root's is "free".
    """
    along = np.abs(joint_axis)
    slides, turns = along > PARALLEL, np.sqrt(np.clip(1.0 - along**2, 0.0, 1.0)) > PARALLEL
    minds = np.zeros_like(slides)
    for k, kind in enumerate(joint_type):
        minds[k] = {"free": False, "prismatic": slides[k], "screw": True}.get(kind, turns[k])
    return np.flatnonzero(~minds.any(axis=0)).tolist()


def coupled_axes(joint_axis: Array, joint_type: Sequence[str]) -> list[list[int]]:
    """Groups of axes of the rest frame: scaling each group by a factor of its own commutes with every joint.

    A turning joint couples the axes that it turns into one another. A slide couples none: it goes as much farther as
    the object gets longer along it. Parameters as for :func:`stretchable_axes`.
    """
    group = [0, 1, 2]
    for axis, kind in zip(joint_axis, joint_type, strict=True):
        if kind in ("free", "prismatic"):
            continue
        turned = np.flatnonzero(np.sqrt(np.clip(1.0 - axis**2, 0.0, 1.0)) > PARALLEL)
        together = {group[i] for i in turned}
        group = [min(together) if g in together else g for g in group]
    return [[i for i in range(3) if group[i] == g] for g in sorted(set(group))]
