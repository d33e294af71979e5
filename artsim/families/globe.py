"""Globes: a sphere with raised continents that turns in an arc on a stand.

What varies: size, tilt, the arc (half, whole ring, round or flat), the stand (disc, plinth, legs, a ring around the
horizon), finials, and whether the arc itself turns on the stand.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.common.products import apply, unit
from artsim.making.assembly import Assembly, Rng, continuous, revolute
from artsim.making.outlines import UP, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull, revolved, ring, rod, tube, union
from artsim.model.transforms import rotation_about

GAP = 0.0015


def build(rng: Rng) -> Assembly:
    """A globe; its axis leans to one side, the front faces -X."""
    radius = rng.uniform(0.06, 0.2)
    tilt = np.deg2rad(rng.choice([23.4, rng.uniform(0.0, 40.0)]))
    lean = rng.choice([-1.0, 1.0])
    axis = apply(rotation_about((1, 0, 0), lean * tilt), UP)
    thick = radius * rng.uniform(0.04, 0.075)
    arc_radius = radius * rng.uniform(1.08, 1.16) + thick
    sphere = ellipsoid((0, 0, 0), radius, 36) + _continents(rng, radius)
    pin = 0.45 * thick
    for side in (-1.0, 1.0):
        sphere += cylinder(side * 0.95 * radius * axis, side * (arc_radius - thick - GAP) * axis, pin, sections=12)
    if rng.random() < 0.5:
        sphere += ring((0, 0, 0), axis, 0.97 * radius, 1.01 * radius, 0.02 * radius, 28)

    arc = _arc(rng, arc_radius, thick, lean * tilt)
    foot = -arc_radius - 2.3 * thick
    turning = rng.random() < 0.3
    horizon = not turning and rng.random() < 0.2
    stand = _stand(rng, radius, foot - (GAP if turning else -1.5 * thick), thick)
    if horizon:
        stand += _horizon(rng, arc_radius + 1.6 * thick, foot, thick, radius)
    globe = Assembly("stand", stand, 900.0)
    if turning:
        stub = rod(0, 0, (foot, foot + 2.3 * thick), 0.9 * thick, sections=16)
        if rng.random() < 0.5:
            joint = continuous("stand", UP, (0, 0, foot))
        else:
            joint = revolute("stand", UP, (0, 0, foot), -rng.uniform(0.8, 3.0), rng.uniform(0.8, 3.0))
        globe.add("arc", arc + stub, joint)
    else:
        globe.body += arc
    globe.add("globe", sphere, continuous("arc" if turning else "stand", axis, (0, 0, 0)), density=200.0)
    return globe


def _continents(rng: Rng, radius: float) -> Solid:
    """Blobs that stand out of the sphere by a hundredth."""
    solid = Solid()
    for _ in range(int(rng.integers(5, 9))):
        center = rng.normal(size=3)
        center = unit(center)
        u = np.cross(center, np.eye(3)[np.argmin(np.abs(center))])
        u = unit(u)
        v = np.cross(center, u)
        size = rng.uniform(0.18, 0.42)
        angles = np.arange(11) * (2.0 * np.pi / 11)
        sizes = size * rng.uniform(0.6, 1.2, 11)
        points = [center]
        for share in (0.5, 1.0):
            spread = share * sizes[:, None] * (cos(angles)[:, None] * u + sin(angles)[:, None] * v)
            points += list(unit(center + spread))
        shell = 1.025 * radius * np.array(points)
        solid += hull(np.concatenate([shell, 0.93 * shell]))
    return solid


def _arc(rng: Rng, radius: float, thick: float, tilt: float) -> Solid:
    """The meridian from pole to pole, in the plane x = 0; on the side that the axis leans away from, or all round."""
    whole = rng.random() < 0.25
    flat = rng.random() < 0.5
    # Angles in the plane x = 0 from Z towards -Y: the axis stands at `tilt`.
    if whole:
        angles = tilt + np.linspace(0.0, 2.0 * np.pi, 33)
    elif tilt >= 0:  # the lower pole is at y > 0: round by way of it
        angles = tilt + np.linspace(0.0, np.pi, 21)
    else:
        angles = tilt - np.linspace(0.0, np.pi, 21)
    along = np.stack([0 * angles, -sin(angles), cos(angles)], axis=1)
    if flat:
        wide, t = thick * rng.uniform(0.8, 1.6), 0.5 * thick
        rings = [[(x, *(p[1:] * r)) for r in (radius - t, radius + t) for x in (-wide, wide)] for p in along]
        solid = union(hull(np.concatenate([a, b])) for a, b in pairwise(rings))
    else:
        solid = tube(radius * along, 0.6 * thick, 10)
    axis = along[0] if not whole else np.array([0.0, -sin(tilt), cos(tilt)])
    for side in (-1.0, 1.0):
        root, tip = side * (radius - 0.8 * thick) * axis, side * (radius + thick) * axis
        solid += cylinder(root, tip, 0.8 * thick, sections=14)
        if rng.random() < 0.5 and side * axis[2] > 0:
            solid += ellipsoid(side * (radius + 1.3 * thick) * axis, 0.9 * thick, 12)
    return solid


def _stand(rng: Rng, radius: float, top: float, thick: float) -> Solid:
    """Column below the arc, on a foot."""
    height = radius * rng.uniform(0.15, 0.9)
    low = top - height
    stem = thick * rng.uniform(0.9, 1.3)
    solid = rod(0, 0, (low, top), stem, sections=18)
    if rng.random() < 0.5:
        z = low + rng.uniform(0.3, 0.7) * height
        solid += ellipsoid((0, 0, z), (1.8 * stem, 1.8 * stem, 0.14 * height), 16)
    wide = radius * rng.uniform(0.55, 0.85)
    kind = rng.choice(["disc", "stepped", "plinth", "legs", "dome"])
    if kind == "legs":
        count = int(rng.integers(3, 5))
        for k in range(count):
            a = 2.0 * np.pi * k / count + 0.3
            out = np.array([cos(a), sin(a), 0.0])
            heights = low + height * np.array([0.5, 0.25, 0.0])
            path = np.outer([0.0, 0.5 * wide, wide], out) + np.outer(heights, UP)
            solid += tube(path, [stem, 0.8 * stem, 0.7 * stem], 10) + ellipsoid(path[-1], 0.9 * stem, 10)
        return solid
    tall = radius * rng.uniform(0.06, 0.14)
    if kind == "plinth":
        return solid + box(wide, wide, (low - tall, low + 0.002), fillet=0.1 * wide, axis=2)
    solid += rod(0, 0, (low - tall, low + 0.002), wide, 0.9 * wide, 32)
    if kind == "stepped":
        solid += rod(0, 0, (low, low + 0.7 * tall), 0.65 * wide, 0.55 * wide, 28)
    elif kind == "dome":
        solid += rod(0, 0, (low, low + 0.3 * height), 0.88 * wide, 1.2 * stem, 28)
    return solid


def _horizon(rng: Rng, inner: float, foot: float, thick: float, radius: float) -> Solid:
    """A flat ring around the globe, on legs that reach out from the column."""
    solid = revolved([(inner, -0.5 * thick), (inner + 3 * thick, -0.5 * thick), (inner + 3 * thick, 0.5 * thick),
                      (inner, 0.5 * thick)], sections=28)  # fmt: skip
    count = int(rng.integers(3, 5))
    for a in turns(count, 0.5):
        out = np.array([cos(a), sin(a), 0.0])
        at = inner + 1.5 * thick
        path = np.outer([at, at, 0.0], out) + np.outer([0.0, 0.6 * foot, foot - 0.06 * radius], UP)
        solid += tube(path, 0.7 * thick, 10)
    return solid
