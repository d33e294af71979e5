"""Closed vessels that several families share: moulded bodies of any outline, necks, caps that cover them, pumps."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from artsim.common.elementary import cos, power, sin
from artsim.making.draws import Draws
from artsim.making.outlines import UP, Array, about, lifted, turns
from artsim.making.solids import Solid, box, deferred, ellipsoid, hull_of, loft, ring, rod, tube, union

GAP = 0.0008
"""Metres between a neck and its cap, and between a stem and its bore: bottles are small."""
SECTIONS = 24

Level = tuple[float, float, float, float]
"""Height, half depth (X), half width (Y), and how round the outline is there: 0 as drawn, 1 an ellipse."""


def cross_section(kind: str, sharpness: float = 0.5) -> Array:
    """Outline (24, 2) of a moulded body seen from above, from -1 to 1 along X and Y.

    It is "round", "square" (a superellipse, its corners sharper from 0, nearly round, to 1), "hexagon", "octagon", or
    "flask" (round in front, flat behind).
    """
    angles = (np.arange(SECTIONS) + 0.5) * (2.0 * np.pi / SECTIONS)
    circle = np.stack([cos(angles), sin(angles)], axis=1)
    if kind == "square":
        # |x|^n + |y|^n = 1, along rays: n = 2 is a circle, n = 10 nearly a square.
        n = 2.5 + 7.5 * sharpness
        return circle / power(power(np.abs(circle), n).sum(axis=1), 1.0 / n)[:, None]
    if kind in ("hexagon", "octagon"):
        sides = 6 if kind == "hexagon" else 8
        corner = 2.0 * np.pi / sides
        offset = np.mod(angles, corner) - 0.5 * corner
        outline = circle * (cos(0.5 * corner) / cos(offset))[:, None]
        return outline / np.abs(outline).max(axis=0)
    return np.column_stack([np.minimum(circle[:, 0], 0.35), circle[:, 1]]) if kind == "flask" else circle


@deferred
def moulded(levels: Sequence[Level], outline: Array, shift: float = 0.0) -> Solid:
    """Body of an outline that :func:`cross_section` makes, its size changing from level to level, from the bottom up.

    ``shift`` moves the levels towards +X, those that are round less: the round neck of a can stays at x = 0.
    """
    angles = (np.arange(len(outline)) + 0.5) * (2.0 * np.pi / len(outline))
    circle = np.stack([cos(angles), sin(angles)], axis=1)
    # Points between the corners of a flat side may cost a hull one of its corners.
    before, after = outline - np.roll(outline, 1, axis=0), np.roll(outline, -1, axis=0) - outline
    corners = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) > 1e-9
    rings = []
    for z, x, y, roundness in levels:
        plane = ((1.0 - roundness) * outline + roundness * circle) * (x, y) + ((1.0 - roundness) * shift, 0.0)
        rings.append(lifted(plane[corners] if roundness == 0 else plane, z))
    return loft(rings)


def neck(radius: float, bore: float, low: float, high: float) -> Solid:
    """Open round neck."""
    return ring((0, 0, 0.5 * (low + high)), UP, bore, radius, high - low, 18)


@deferred
def cap(
    radius: float, wall: float, low: float, high: float, bore: float = 0.0, top: float | None = None, sections: int = 24
) -> Solid:
    """Cup upside down that covers a neck, between two heights; ``bore`` is the radius of a hole in its top.

    ``radius`` and ``top`` are those outside at its edge and at its top, the same by default.
    """
    upper = radius if top is None else top
    shoulder = upper + (radius - upper) * wall / (high - low)  # outside, where the top begins
    inner, under = min(radius, upper) - wall, high - wall
    corners = np.array([(inner, low), (radius, low), (shoulder, under), (inner, under)])
    slices = [
        np.column_stack([corners[:, 0] * cos(a), corners[:, 0] * sin(a), corners[:, 1]])
        for a in np.linspace(0.0, 2.0 * np.pi, sections + 1).tolist()
    ]
    if bore > 0:
        return loft(slices) + ring((0, 0, high - 0.5 * wall), UP, bore, min(upper, shoulder), wall, sections)
    return loft(slices) + rod(0, 0, (under, high), shoulder, upper, sections)


@deferred
def ribs(radius: float, low: float, high: float, count: int, size: float) -> Solid:
    """Upright ribs around a cap."""
    return union(rod(radius * cos(a), radius * sin(a), (low, high), size, sections=6) for a in turns(count))


@deferred
def dome(radius: float, low: float, rise: float) -> Solid:
    """Round cap of a sphere or flatter, on a level circle."""
    levels = ((0.0, 1.0), (0.4, 0.9), (0.75, 0.64), (0.95, 0.3), (1.0, 0.08))
    heights = ((low + h * rise, s * radius) for h, s in levels)
    return hull_of(*(rod(0, 0, (z, z + 1e-5), max(r, 1e-4), sections=20) for z, r in heights))


def pump_head(draws: Draws, low: float, stem: float, size: float, reach: float, down: float) -> Solid:
    """Head of a pump with a nozzle towards -X, ``low`` above the ground, on a stem that goes ``down`` below it.

    ``stem`` and ``size`` are the radii of stem and head; the nozzle reaches ``reach`` from the axis.
    """
    draws = draws.within("head")
    tall = size * draws.number("height", (0.45, 1.3))
    solid = rod(0, 0, (low - down, low + 0.5 * tall), stem, sections=14)
    kind = draws.pick("style", ["saddle", "disc", "hook", "block", "drop"])
    droop = draws.number("droop", (0.0, 0.25))
    r = min(size * draws.number("nozzle_radius", (0.3, 0.48)), 0.48 * tall)
    middle = low + 0.5 * tall
    if kind == "saddle":  # a wide thumb rest that narrows to the nozzle
        back = box((-0.6 * size, size), size, (low, low + tall), fillet=0.35 * tall)
        tip = ellipsoid((-reach, 0, middle - droop * reach), r, 10)
        return solid + back + hull_of(ellipsoid((-0.3 * size, 0, middle), 1.3 * r, 10), tip)
    if kind == "block":
        wide = max(1.2 * r, 0.55 * size)
        return solid + box((-reach, 0.9 * size), wide, (low, low + tall), fillet=0.4 * min(tall, wide))
    if kind == "hook":
        bend = -reach * draws.number("bend", (0.75, 0.9))
        path = [(0, 0, middle), (bend, 0, middle + 0.1 * reach), (-reach, 0, middle - max(droop, 0.1) * reach)]
        return solid + tube(path, [1.2 * r, r, 0.8 * r], 10) + rod(0, 0, (low, low + tall), size)
    if kind == "drop":
        back = ellipsoid((0, 0, middle), (size, size, 0.5 * tall), 14)
        return solid + hull_of(back, ellipsoid((-reach, 0, middle - 0.5 * droop * reach), 0.7 * r, 10))
    top = low + tall
    solid += rod(0, 0, (low, top), size * draws.number("crown", (0.5, 0.9)), size) + dome(size, top - 1e-4, 0.25 * tall)
    return solid + tube([(0, 0, middle), (-reach, 0, middle - droop * reach)], [r, 0.8 * r], 10)


@deferred
def grip_loop(points: ArrayLike, wide: float, thick: float) -> Solid:
    """Flat strap along points (N, 2) in X and Z, as a jug's handle; half extents along Y and across."""
    path = np.asarray(points, dtype=np.float64)
    knots = [box(about(x, thick), wide, about(z, thick), fillet=0.8 * thick, axis=1) for x, z in path.tolist()]
    return union(hull_of(a, b) for a, b in pairwise(knots))
