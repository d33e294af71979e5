"""Details that several families share: handles and hinged panels."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from artsim.kinematics import Array
from artsim.solids import Solid, Vector, box, cylinder, frame, hull, rounded_box, tube, union


def bar_handle(start: Vector, end: Vector, outward: Vector, reach: float, radius: float) -> Solid:
    """Straight bar between two points, held by two posts that stand on the surface.

    Parameters
    ----------
    start, end : (3,) float
        On the surface.
    outward : (3,) float
        Unit normal of the surface.
    reach : float
        Distance of the bar from the surface.
    """
    start, end, outward = (np.asarray(v, dtype=np.float64) for v in (start, end, outward))
    lifted = outward * reach
    posts = (start + share * (end - start) for share in (0.1, 0.9))
    bar = tube([start + lifted, end + lifted], radius)
    return bar + union(tube([foot - 0.002 * outward, foot + lifted], 0.8 * radius, 10) for foot in posts)


def bow_handle(start: Vector, end: Vector, outward: Vector, reach: float, radius: float) -> Solid:
    """Round bow from one point of the surface to another."""
    start, end, outward = (np.asarray(v, dtype=np.float64) for v in (start, end, outward))
    angles = np.linspace(0.0, np.pi, 9)
    shares = 0.5 - 0.5 * np.cos(angles)
    path: Array = start + shares[:, None] * (end - start) + (reach * np.sin(angles) - 0.002)[:, None] * outward
    return tube(path, radius, 10)


def knob(foot: Vector, outward: Vector, reach: float, radius: float) -> Solid:
    """Round knob on a thinner stem."""
    foot, outward = np.asarray(foot, dtype=np.float64), np.asarray(outward, dtype=np.float64)
    neck = foot + reach * outward
    stem = cylinder(foot - 0.002 * outward, neck, 0.4 * radius, sections=12)
    return stem + cylinder(neck, neck + 0.5 * radius * outward, radius, 0.8 * radius, 20)


def panel(kind: str, low: Vector, high: Vector, rail: float, recess: float) -> Solid:
    """Upright panel whose front faces -X: the face of a door or of a drawer.

    Parameters
    ----------
    kind : str
        "slab"; "shaker" (frame around a sunken board); "raised" (the board rises again in its middle); "planks";
        "glass" (frame around a thin pane with glazing bars). A panel too small for its frame becomes a slab.
    low, high : (3,) float
        Corners of the whole panel.
    rail : float
        Width of the frame.
    recess : float
        Depth of the sunken board behind the frame.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    sides = high - low
    if kind == "slab" or min(sides[1:]) < 3.2 * rail:
        return rounded_box(low, high, 0.15 * sides[0], steps=2)
    bars = frame(low, high, [rail] * 4)
    inside = np.array([0.0, rail - 0.002, rail - 0.002])
    inner_low, inner_high = low + inside, high - inside
    if kind == "glass":
        middle = 0.5 * (low[0] + high[0])
        for axis in (1, 2):
            for edge in np.linspace(inner_low[axis], inner_high[axis], int(2 + sides[axis] // 0.35))[1:-1]:
                bar_low, bar_high = inner_low + (0.003, 0, 0), inner_high - (0.003, 0, 0)
                bar_low[axis], bar_high[axis] = edge - 0.2 * rail, edge + 0.2 * rail
                bars += box(bar_low, bar_high)
        inner_low[0], inner_high[0] = middle - 0.002, middle + 0.002
        return bars + box(inner_low, inner_high)
    board = box(inner_low + (recess, 0, 0), inner_high - (0.001, 0, 0))
    if kind == "raised":
        ledge = 0.25 * rail
        rise = [_rectangle(low[0] + x, inner_low[1:] + s, inner_high[1:] - s)
                for x, s in ((recess + 0.001, ledge), (0.2 * recess, 2.0 * ledge))]  # fmt: skip
        return bars + board + hull(np.concatenate(rise))
    if kind == "planks":
        edges = np.linspace(inner_low[1], inner_high[1], int(2 + sides[1] // 0.09))
        for left, right in pairwise(edges):
            board += box((low[0] + 0.4 * recess, left + 0.002, inner_low[2]),
                         (high[0] - 0.002, right - 0.002, inner_high[2]))  # fmt: skip
    return bars + board


def _rectangle(x: float, low: Array, high: Array) -> Array:
    """(4, 3) corners of a rectangle across the X axis."""
    return np.array([(x, y, z) for y in (low[0], high[0]) for z in (low[1], high[1])])
