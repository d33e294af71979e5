"""What solids are drawn from: directions, spans, angles, and outlines, which are arrays of points."""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from artsim.common.elementary import cos, sin
from artsim.common.elementary import power as raised
from artsim.common.products import cross, unit
from artsim.model.kinematics import Array as Array

Vector = Sequence[float] | Array
FRONT = np.array([-1.0, 0.0, 0.0])
SIDE = np.array([0.0, 1.0, 0.0])
UP = np.array([0.0, 0.0, 1.0])
"""Directions of an object in its rest frame: its front, the left of who looks at it, and up."""
Span = float | tuple[float, float]
"""Two ends along an axis, in either order, or half of a width about 0."""


def ends(span: Span) -> tuple[float, float]:
    """Low and high end of a span."""
    return (min(span), max(span)) if isinstance(span, tuple) else (-span, span)


def about(middle: float, half: float) -> tuple[float, float]:
    """Span of twice a half width about its middle."""
    return middle - half, middle + half


def turns(count: int, start: float = 0.0) -> list[float]:
    """Angles of equal steps of a full turn; the first is the share ``start`` of a step."""
    return [2.0 * np.pi * (k + start) / count for k in range(count)]


def arch(half: float, rise: float, count: int, first: float = 0.0, last: float = np.pi) -> list[tuple[float, float]]:
    """Points of an ellipse about 0 between two angles: by default over the top, from one side to the other."""
    return [(half * cos(a), rise * sin(a)) for a in np.linspace(first, last, count).tolist()]


def frame_about(normal: Vector) -> tuple[Array, Array]:
    """Two unit vectors that complete a normal to a right-handed frame."""
    w = unit(normal)
    u = unit(cross(np.eye(3)[np.argmin(np.abs(w))], w))
    return u, cross(w, u)


def circle(center: Vector, normal: Vector, radius: float, sections: int = 24) -> Array:
    """(sections, 3) points of a circle."""
    u, v = frame_about(normal)
    c, s = around(sections)
    return np.asarray(center) + radius * (c * u + s * v)


@cache
def around(sections: int) -> tuple[Array, Array]:
    """(sections, 1) cosines and (sections, 1) sines of equal steps of a full turn, from 0."""
    angles = np.arange(sections) * (2.0 * np.pi / sections)
    return cos(angles)[:, None], sin(angles)[:, None]


def rounded_rectangle(low: Vector, high: Vector, radius: float, steps: int = 4) -> Array:
    """(N, 2) outline of a rectangle with round corners."""
    center = 0.5 * (np.asarray(low, dtype=np.float64) + np.asarray(high))
    half = 0.5 * (np.asarray(high, dtype=np.float64) - low)
    radius = min(radius, float(half.min()))
    angles = np.linspace(0.0, 0.5 * np.pi, steps + 1)
    quarter = np.stack([cos(angles), sin(angles)], axis=1) * radius + (half - radius)
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return np.concatenate([quarter[:: x * y] * (x, y) for x, y in signs]) + center


def strips(first: Array, second: Array) -> list[Array]:
    """Convex outlines that fill what lies between two edges, (N, 2) points each."""
    return [np.concatenate([first[k : k + 2], second[k : k + 2]]) for k in range(len(first) - 1)]


def normals(path: Array, closed: bool = False) -> Array:
    """(N, 2) unit vectors to the right of a path of (N, 2) points, at each of them."""
    steps = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0) if closed else np.gradient(path, axis=0)
    return unit(np.stack([steps[:, 1], -steps[:, 0]], axis=1))


def superellipse(power: float, x: float, y: float, count: int) -> Array:
    """(count, 2) outline of half widths x and y: an ellipse for a power of 2, nearly a rectangle for 10."""
    angles = np.arange(count) * 2.0 * np.pi / count
    c, s = cos(angles), sin(angles)
    return np.column_stack(
        [np.sign(c) * raised(np.abs(c), 2.0 / power) * x, np.sign(s) * raised(np.abs(s), 2.0 / power) * y]
    )


def lifted(outline: Array, z: float) -> Array:
    """(N, 3) points of an (N, 2) outline at a height."""
    return np.column_stack([outline, np.full(len(outline), z)])


def cross_sections(levels: ArrayLike, fronts: ArrayLike, backs: ArrayLike, halves: ArrayLike, roundness: float,
                   steps: int = 2) -> list[Array]:  # fmt: skip
    """Rounded rectangles across the Z axis at heights ``levels``, to loft an upright body from.

    Each reaches from x = front to back and to y = half at either side; ``roundness`` is the radius of its edges over
    half of its thickness, at most 1.
    """

    def ring(z: float, front: float, back: float, half: float) -> Array:
        radius = roundness * 0.5 * min(back - front, 2.0 * half)
        return lifted(rounded_rectangle((front, -half), (back, half), radius, steps), z)

    return [ring(*row) for row in np.stack(np.broadcast_arrays(levels, fronts, backs, halves), axis=1)]
