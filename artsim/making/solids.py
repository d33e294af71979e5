"""Solids to build objects from: every solid is a union of convex pieces.

The pieces serve as exact collision geometry; their boolean union is the watertight visual mesh. Shapes that are not
convex (trays, rings, tubes, bowls) are made of convex pieces from the start, so nothing has to be decomposed later.
Metres, radians; Z is up.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, overload

import numpy as np
from manifold3d import Manifold
from numpy.typing import ArrayLike

from artsim.common.elementary import cos, sin
from artsim.common.products import cross, dot, unit
from artsim.making.outlines import Span, Vector, around, circle, ends, frame_about, rounded_rectangle
from artsim.making.solid import Solid, deferred, mesh_of, union
from artsim.model.kinematics import Array

__all__ = [
    "Solid", "box", "cylinder", "deferred", "ellipsoid", "frame", "hull", "hull_of", "loft", "mesh_of", "posts",
    "prism", "revolved", "ring", "rod", "tray", "tube", "union", "vessel",
]  # fmt: skip

Along = float | tuple[float, float]
"""Where something is along an axis, or its two ends."""


# --- convex shapes ---------------------------------------------------------------------------------------------------


@deferred
def hull(points: ArrayLike) -> Solid:
    """Convex hull of (N, 3) points."""
    return Solid((Manifold.hull_points(np.asarray(points, dtype=np.float64)),))


@deferred
def hull_of(*solids: Solid) -> Solid:
    """Convex hull of whole solids."""
    return Solid((Manifold.batch_hull([p for s in solids for p in s.pieces]),))


@overload
def box(
    low: Vector, high: Vector, /, *, fillet: float | None = None, axis: int | None = None, steps: int = 3
) -> Solid: ...
@overload
def box(
    x: Span, y: Span, z: Span, /, *, fillet: float | None = None, axis: int | None = None, steps: int = 3
) -> Solid: ...
@deferred
def box(*extent: Any, fillet: float | None = None, axis: int | None = None, steps: int = 3) -> Solid:
    """Axis-aligned box between two corners, or by its span along each axis; its edges may be round.

    Parameters
    ----------
    fillet : float, optional
        Radius of the edges. Cut to just under half of the smallest side concerned.
    axis : int, optional
        Round only the four edges along this coordinate axis; all twelve by default.
    steps : int
        Segments of a quarter circle.
    """
    if len(extent) == 3:
        extent = tuple(zip(*map(ends, extent), strict=True))
    low, high = (np.asarray(corner, dtype=np.float64) for corner in extent)
    sides = high - low
    if fillet is None:
        return Solid((Manifold.cube(sides).translate(low),))
    across = [i for i in range(3) if i != axis]
    radius = float(min(fillet, 0.499 * sides[across].min()))
    if axis is not None:
        return prism(rounded_rectangle(low[across], high[across], radius, steps), low[axis], high[axis], axis)
    angles = np.linspace(0.0, 0.5 * np.pi, steps + 1)
    corner = np.array(
        [(cos(a) * cos(b), sin(a) * cos(b), sin(b)) for b in angles[:-1] for a in angles] + [(0.0, 0.0, 1.0)]
    )
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    half = 0.5 * sides - radius
    return hull((signs[:, None] * (half + radius * corner)).reshape(-1, 3) + 0.5 * (low + high))


@deferred
def prism(outline: ArrayLike, low: float, high: float, axis: int = 2) -> Solid:
    """Convex polygon, extruded along a coordinate axis from ``low`` to ``high``.

    Parameters
    ----------
    outline : (N, 2) float
        In the two other coordinates, in the order x, y, z. Its convex hull is taken.
    """
    outline = np.asarray(outline, dtype=np.float64)
    points = np.empty((2, len(outline), 3))
    across = [i for i in range(3) if i != axis]
    points[:, :, across] = outline
    points[0, :, axis], points[1, :, axis] = low, high
    return hull(points.reshape(-1, 3))


@deferred
def cylinder(start: Vector, end: Vector, radius: float, end_radius: float | None = None, sections: int = 24) -> Solid:
    """Cylinder, cone or frustum between two points."""
    far = radius if end_radius is None else end_radius
    direction = np.asarray(end, dtype=np.float64) - start
    rings = [circle(start, direction, radius, sections), circle(end, direction, far, sections)]
    return hull(np.concatenate(rings))


def rod(x: Along, y: Along, z: Along, radius: float, end_radius: float | None = None, sections: int = 24) -> Solid:
    """Cylinder, cone or frustum along a coordinate axis: the one whose two ends are given, from the first to the other.

    Examples
    --------
    >>> rod(0.1, (-0.2, 0.2), 0.3, 0.01)  # an axle along Y
    """
    start, end = zip(*(v if isinstance(v, tuple) else (v, v) for v in (x, y, z)), strict=True)
    return cylinder(start, end, radius, end_radius, sections)


@deferred
def ellipsoid(center: Vector, radii: Vector | float, sections: int = 16) -> Solid:
    """Ellipsoid with its axes along x, y and z; a sphere when ``radii`` is one number."""
    factors = np.broadcast_to(np.asarray(radii, dtype=np.float64), (3,))
    return Solid((Manifold.sphere(1.0, sections).scale(factors).translate(np.asarray(center, dtype=np.float64)),))


# --- shapes of several pieces ----------------------------------------------------------------------------------------


@deferred
def posts(x: Span, y: Span, z: Span, radius: float, end_radius: float | None = None, sections: int = 14) -> Solid:
    """Four upright cylinders, or cones, on the corners of a rectangle: feet, legs."""
    low, high = ends(z)
    spots = ((px, py) for px in ends(x) for py in ends(y))
    return union(cylinder((*spot, low), (*spot, high), radius, end_radius, sections) for spot in spots)


@deferred
def tube(path: ArrayLike, radius: float | Sequence[float], sections: int = 12, closed: bool = False) -> Solid:
    """Round rod along a polyline.

    Parameters
    ----------
    path : (N, 3) float
    radius : float or (N,) float
    closed : bool
        Joins the last point to the first.
    """
    return loft(_rings(np.asarray(path, dtype=np.float64), radius, sections, closed), closed)


def _rings(path: Array, radius: float | Sequence[float], sections: int, closed: bool) -> list[Array]:
    """A circle across the path at each of its points, turned as little as possible from one to the next."""
    radii = np.broadcast_to(np.asarray(radius, dtype=np.float64), (len(path),))
    steps = np.roll(path, -1, axis=0) - path if closed else np.diff(path, axis=0)
    steps = unit(steps)
    before = np.roll(steps, 1, axis=0) if closed else np.concatenate([steps[:1], steps])
    after = steps if closed else np.concatenate([steps, steps[-1:]])
    u, _ = frame_about(after[0])
    c, s = around(sections)
    rings = []
    for point, r, a, b in zip(path, radii, before, after, strict=True):
        tangent = unit(a + b)
        u = unit(u - dot(u, tangent) * tangent)
        v = cross(tangent, u)
        rings.append(point + r * (c * u + s * v))
    return rings


@deferred
def loft(rings: Sequence[ArrayLike], closed: bool = False) -> Solid:
    """Hull of each two neighbours in a row of (M, 3) cross-sections."""
    pairs = pairwise([*rings, rings[0]] if closed else rings)
    return union(hull(np.concatenate([np.asarray(a), np.asarray(b)])) for a, b in pairs)


def ring(
    center: Vector,
    normal: Vector,
    inner: float,
    outer: float,
    height: float,
    sections: int = 24,
    arc: tuple[float, float] = (0.0, 2.0 * np.pi),
) -> Solid:
    """Flat ring (annulus) or a sector of one, ``height`` thick along its normal, centred on ``center``."""
    return revolved([(inner, -0.5 * height), (outer, -0.5 * height), (outer, 0.5 * height), (inner, 0.5 * height)],
                    center, normal, sections, arc)  # fmt: skip


@deferred
def revolved(
    outline: ArrayLike,
    center: Vector = (0.0, 0.0, 0.0),
    axis: Vector = (0.0, 0.0, 1.0),
    sections: int = 24,
    arc: tuple[float, float] = (0.0, 2.0 * np.pi),
) -> Solid:
    """Convex outline turned about an axis, in as many wedges as there are sections.

    Parameters
    ----------
    outline : (N, 2) float
        Distance from the axis and position along it.
    arc : 2 float
        First and last angle, radians.
    """
    u, v = frame_about(axis)
    w = unit(axis)
    outline = np.asarray(outline, dtype=np.float64)
    angles = np.linspace(*arc, sections + 1)
    slices = [np.asarray(center) + outline[:, :1] * (cos(a) * u + sin(a) * v) + outline[:, 1:] * w for a in angles]
    return loft(slices)


@deferred
def vessel(
    profile: ArrayLike, wall: float, center: Vector = (0.0, 0.0, 0.0), sections: int = 24, floor: bool = True
) -> Solid:
    """Round open vessel about the vertical: bucket, pot, bowl.

    Parameters
    ----------
    profile : (N, 2) float
        Outer radius and height, from the bottom up.
    wall : float
        Thickness, horizontally, and of the floor.
    """
    profile = np.asarray(profile, dtype=np.float64)
    x, y, z = center
    sides = union(
        revolved([(r0 - wall, z0), (r0, z0), (r1, z1), (r1 - wall, z1)], center, (0, 0, 1), sections)
        for (r0, z0), (r1, z1) in pairwise(profile)
    )
    if not floor:
        return sides
    (r0, z0), (r1, z1) = profile[:2]
    top = r0 + (r1 - r0) * wall / (z1 - z0)
    return sides + cylinder((x, y, z + z0), (x, y, z + z0 + wall), r0, top, sections)


@deferred
def tray(low: Vector, high: Vector, wall: float, floor: float | None = None, axis: int = 2, side: int = 1) -> Solid:
    """Open box: a floor and four walls.

    Parameters
    ----------
    low, high : (3,) float
        Outer corners.
    wall, floor : float
        Thickness; the floor is as thick as the walls by default.
    axis, side : int
        It is open towards ``side`` (1 or -1) of coordinate ``axis``: upward by default.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    depth = wall if floor is None else floor
    bottom_low, bottom_high, wall_low, wall_high = low.copy(), high.copy(), low.copy(), high.copy()
    if side > 0:
        bottom_high[axis] = wall_low[axis] = low[axis] + depth
    else:
        bottom_low[axis] = wall_high[axis] = high[axis] - depth
    opening = [i for i in range(3) if i != axis]
    return box(bottom_low, bottom_high) + frame(wall_low, wall_high, [wall] * 4, opening[0], opening[1])


@deferred
def frame(low: Vector, high: Vector, widths: Sequence[float], first: int = 1, second: int = 2) -> Solid:
    """Box with a rectangular hole through it.

    Parameters
    ----------
    low, high : (3,) float
        Outer corners.
    widths : 4 float
        Of the bars at the low and high end of coordinate ``first``, then of coordinate ``second``.
    first, second : int
        The two coordinates of the plane of the frame.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    solids = []
    inner_low, inner_high = low.copy(), high.copy()
    for axis, near, far in ((first, widths[0], widths[1]), (second, widths[2], widths[3])):
        for size, at_low in ((near, True), (far, False)):
            if size <= 0:
                continue
            bar_low, bar_high = inner_low.copy(), inner_high.copy()
            if at_low:
                bar_high[axis] = low[axis] + size
            else:
                bar_low[axis] = high[axis] - size
            solids.append(box(bar_low, bar_high))
        inner_low[axis], inner_high[axis] = low[axis] + near, high[axis] - far
    return union(solids)
