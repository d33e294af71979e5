"""Details that several families share: handles and hinged panels."""

from __future__ import annotations

import numpy as np

from artsim.kinematics import Array
from artsim.solids import Solid, Vector, cylinder, tube, union


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
