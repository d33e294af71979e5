"""Keys and buttons on flat faces, and bodies of varying cross-section, as handheld and desktop devices have them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, JointSpec, Rng, pick, prismatic
from artsim.making.outlines import Vector, lifted, rounded_rectangle
from artsim.making.solids import Solid, hull, prism, union
from artsim.model.kinematics import Array

CLEAR = 0.0003
"""Metres that a key at the end of its travel keeps from the face under it."""


@dataclass(frozen=True, eq=False)
class Face:
    """A flat face with coordinates u (to the right of who looks at it) and v (up).

    Its directions are unit vectors; their cross product points out of the face.
    """

    origin: Array
    right: Array
    up: Array

    @property
    def outward(self) -> Array:
        """(3,) unit normal."""
        return np.cross(self.right, self.up)

    def at(self, u: float, v: float, height: float = 0.0) -> Array:
        """(3,) point at ``height`` above the face."""
        return self.origin + u * self.right + v * self.up + height * self.outward

    def raised(self, outline: Array, height: float) -> Array:
        """(N, 3) points of an (N, 2) outline at ``height`` above the face."""
        points: Array = self.at(0.0, 0.0, height) + outline[:, :1] * self.right + outline[:, 1:] * self.up
        return points


def front_face(x: float, y: float = 0.0, z: float = 0.0) -> Face:
    """A face that looks towards -X, with its origin at (x, y, z): v is along Z."""
    return Face(np.array([x, y, z]), np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0]))


def top_face(z: float, x: float = 0.0, y: float = 0.0) -> Face:
    """A face that looks up, read by who sits at -X: v is along X."""
    return Face(np.array([x, y, z]), np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0]))


def key_outline(kind: str, size: Vector, sections: int = 12) -> Array:
    """(N, 2) outline about 0 of a key of a size along u and v: "square", "pill" (round corners), "round", "diamond"."""
    half = 0.5 * np.asarray(size, dtype=np.float64)
    if kind == "round":
        angles = (np.arange(sections) + 0.5) * (2.0 * np.pi / sections)
        return np.stack([cos(angles), sin(angles)], axis=1) * half
    if kind == "diamond":
        return np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]) * half
    if kind == "pill":
        return rounded_rectangle(-half, half, 0.45 * float(half.min()), 2)
    return np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]) * half


def key(face: Face, u: float, v: float, outline: Array, low: float, high: float, shrink: float = 0.1) -> Solid:
    """A key between two heights above a face; its top is smaller than its foot by the share ``shrink``."""
    foot = outline + (u, v)
    top = (1.0 - shrink) * outline + (u, v)
    return hull(np.concatenate([face.raised(foot, low), face.raised(top, high)]))


def press(face: Face, parent: str, u: float, v: float, travel: float) -> JointSpec:
    """The slide of a key into its face, from 0 to ``travel`` metres."""
    return prismatic(parent, -face.outward, 0.0, travel, face.at(u, v))


def add_key(
    assembly: Assembly, parent: str, name: str, face: Face, uv: Sequence[float], outline: Array,
    height: float, travel: float, shrink: float = 0.1,
) -> None:  # fmt: skip
    """Add a key that stands ``height`` metres above a face of the parent when it is up."""
    solid = key(face, uv[0], uv[1], outline, travel + CLEAR, max(height, travel + CLEAR + 0.0004), shrink)
    assembly.add(name, solid, press(face, parent, uv[0], uv[1], travel), density=1100.0)


def key_cells(
    u: Sequence[float], v: Sequence[float], columns: int, rows: int
) -> Iterator[tuple[int, int, float, float]]:
    """Row, column and centre of each cell of a grid over a rectangle of limits u and v, from its upper left on."""
    wide, high = (u[1] - u[0]) / columns, (v[1] - v[0]) / rows
    for row in range(rows):
        for column in range(columns):
            yield row, column, u[0] + (column + 0.5) * wide, v[1] - (row + 0.5) * high


def add_keypad(
    rng: Rng, phone: Assembly, parent: str, face: Face, half: float, v: tuple[float, float],
    height: float,
) -> int:  # fmt: skip
    """Keys in three or four columns over a part of a face, function keys above them; returns the next free number."""
    kind = pick(rng, ["square", "pill", "round"])
    columns, rows = (3, 4) if rng.random() < 0.7 else (int(rng.integers(3, 6)), int(rng.integers(2, 5)))
    fill = rng.uniform(0.6, 0.9, 2)
    travel = min(rng.uniform(0.0003, 0.0006), height - 0.0008)
    number, low, high = 0, v[0], v[1]
    if rng.random() < 0.7:
        split = high - (high - low) * rng.uniform(0.15, 0.3)
        number = add_function_keys(rng, phone, parent, face, half, (split, high), height, number)
        high = split
    pitch = np.array([2.0 * half / columns, (high - low) / rows])
    outline = key_outline(kind, np.minimum(fill * pitch, 2.2 * pitch.min()), 10)
    for _, _, a, b in key_cells((-half, half), (low, high), columns, rows):
        add_key(phone, parent, f"button_{number}", face, (a, b), outline, height, travel, 0.2)
        number += 1
    return number


def add_function_keys(
    rng: Rng, phone: Assembly, parent: str, face: Face, half: float, v: tuple[float, float], height: float, number: int
) -> int:
    """Two keys with a larger one between them; returns the next free number."""
    travel, deep, middle = 0.0003, v[1] - v[0], 0.5 * (v[0] + v[1])
    wide = 0.5 * half
    big = key_outline(pick(rng, ["round", "pill", "square"]), (min(0.8 * half, 1.4 * deep), 0.85 * deep), 14)
    small = key_outline(pick(rng, ["round", "pill", "square"]), (0.8 * wide, 0.5 * deep), 10)
    for u, outline in ((-0.75 * half, small), (0.0, big), (0.75 * half, small)):
        add_key(phone, parent, f"button_{number}", face, (u, middle), outline, height, travel, 0.15)
        number += 1
    return number


def sleeve(low: Vector, high: Vector, hole_low: Vector, hole_high: Vector, radius: float, steps: int = 2) -> Solid:
    """Tunnel along X between two corners with round outer edges and a rectangular hole, whose corners are in y and z.

    The edges are at most three times as round as the thinnest wall is thick, so that they keep clear of the hole's.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    walls = np.minimum(np.asarray(hole_low) - low[1:], high[1:] - np.asarray(hole_high))
    outer = rounded_rectangle(low[1:], high[1:], min(radius, 3.0 * float(walls.min())), steps)
    inner = np.repeat(_corners(hole_low, hole_high), steps + 1, axis=0)
    pieces = []
    for k in range(len(outer)):
        outline = np.concatenate([outer[[k - 1, k]], inner[[k - 1, k]]])
        pieces.append(prism(outline, low[0], high[0], 0))
    return union(pieces)


def _corners(low: Vector, high: Vector) -> Array:
    """(4, 2) corners of a rectangle, in the order of :func:`artsim.making.solids.rounded_rectangle`."""
    return np.array([(high[0], high[1]), (low[0], high[1]), (low[0], low[1]), (high[0], low[1])])


def cross_sections(levels: ArrayLike, fronts: ArrayLike, backs: ArrayLike, halves: ArrayLike, roundness: float,
                   steps: int = 2) -> list[Array]:  # fmt: skip
    """Rounded rectangles across the Z axis at heights ``levels``, to loft an upright body from.

    Each reaches from x = front to back and to y = half at either side; ``roundness`` is the radius of its edges over
    half of its thickness, at most 1.
    """
    rings = []
    rows = np.stack(np.broadcast_arrays(levels, fronts, backs, halves), axis=1)
    for z, front, back, half in rows:
        radius = roundness * 0.5 * min(back - front, 2.0 * half)
        plane = rounded_rectangle((front, -half), (back, half), radius, steps)
        rings.append(lifted(plane, z))
    return rings
