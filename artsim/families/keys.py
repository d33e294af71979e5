"""Keys and buttons on flat faces, of handheld and desktop devices."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, JointSpec, prismatic
from artsim.making.draws import Draws, Interval
from artsim.making.outlines import Array, Vector, rounded_rectangle
from artsim.making.solids import Solid, deferred, hull, prism, union

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


def side_face(side: float, x: float, y: float, z: float) -> Face:
    """A face that looks to the left (1) or to the right (-1) of who stands before the front: v is along Z."""
    return Face(np.array([x, y, z]), np.array([-side, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))


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


def pill(u: float, v: float) -> Array:
    """Outline of a small key with round corners, so long along u and v."""
    return key_outline("pill", (u, v), 8)


@deferred
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


def add_buttons(
    assembly: Assembly, parent: str, face: Face, spots: Iterable[Sequence[float]], outline: Array,
    height: float, travel: float, shrink: float = 0.1, first: int = 0, label: str = "button",
) -> int:  # fmt: skip
    """Add equal keys at places (u, v), numbered on from ``first``; returns the next free number."""
    number = first
    for number, spot in enumerate(spots, first + 1):
        add_key(assembly, parent, f"{label}_{number - 1}", face, spot, outline, height, travel, shrink)
    return number


def key_cells(u: Sequence[float], v: Sequence[float], columns: int, rows: int) -> Iterator[tuple[float, float]]:
    """Centre of each cell of a grid over a rectangle of limits u and v, from its upper left on, row by row."""
    wide, high = (u[1] - u[0]) / columns, (v[1] - v[0]) / rows
    return ((u[0] + (c + 0.5) * wide, v[1] - (r + 0.5) * high) for r in range(rows) for c in range(columns))


def add_keypad(draws: Draws, phone: Assembly, parent: str, face: Face, half: float, v: Interval, height: float) -> int:
    """Keys in three or four columns over a part of a face, function keys above them; returns the next free number."""
    kind = draws.pick("key_shape", ["square", "pill", "round"])
    columns, rows = 3, 4
    if not draws.chance("twelve_keys", 0.7):
        columns, rows = draws.integer("key_columns", 3, 5), draws.integer("key_rows", 2, 4)
    fill = draws.numbers("key_fill", 0.6, 0.9, 2)  # share of a cell that a key takes up, along u and v
    travel = min(draws.length("key_travel", (0.0003, 0.0006)), height - 0.0008)
    number, low, high = 0, v[0], v[1]
    if draws.chance("function_keys", 0.7):
        split = high - (high - low) * draws.number("function_keys_height", (0.15, 0.3))
        number = add_function_keys(draws, phone, parent, face, half, (split, high), height, number)
        high = split
    pitch = np.array([2.0 * half / columns, (high - low) / rows])
    outline = key_outline(kind, np.minimum(fill * pitch, 2.2 * pitch.min()), 10)
    spots = key_cells((-half, half), (low, high), columns, rows)
    return add_buttons(phone, parent, face, spots, outline, height, travel, 0.2, number)


def add_function_keys(
    draws: Draws, phone: Assembly, parent: str, face: Face, half: float, v: Interval, height: float, number: int
) -> int:
    """Two keys with a larger one between them; returns the next free number."""
    deep, middle = v[1] - v[0], 0.5 * (v[0] + v[1])
    sizes = {"select_key": (min(0.8 * half, 1.4 * deep), 0.85 * deep), "function_key": (0.4 * half, 0.5 * deep)}
    big, small = (
        key_outline(draws.pick(f"{name}_shape", ["round", "pill", "square"]), size, 14 if name == "select_key" else 10)
        for name, size in sizes.items()
    )
    for u, outline in ((-0.75, small), (0.0, big), (0.75, small)):
        number = add_buttons(phone, parent, face, [(u * half, middle)], outline, height, 0.0003, 0.15, number)
    return number


def sleeve(low: Vector, high: Vector, hole_low: Vector, hole_high: Vector, radius: float, steps: int = 2) -> Solid:
    """Tunnel along X between two corners with round outer edges and a rectangular hole, whose corners are in y and z.

    The edges are at most three times as round as the thinnest wall is thick, so that they keep clear of the hole's.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    walls = np.minimum(np.asarray(hole_low) - low[1:], high[1:] - np.asarray(hole_high))
    outer = rounded_rectangle(low[1:], high[1:], min(radius, 3.0 * float(walls.min())), steps)
    (y0, z0), (y1, z1) = hole_low, hole_high
    inner = np.repeat([(y1, z1), (y0, z1), (y0, z0), (y1, z0)], steps + 1, axis=0)
    pairs = zip(np.roll(outer, 1, axis=0), outer, np.roll(inner, 1, axis=0), inner, strict=True)
    return union(prism(np.array(pair), low[0], high[0], 0) for pair in pairs)
