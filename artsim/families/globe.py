"""Globes: a sphere with raised continents that turns in an arc on a stand.

What varies: size, tilt, the arc (half, whole ring, round or flat), the stand (disc, plinth, legs, a ring around the
horizon), finials, and whether the arc itself turns on the stand.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.common.products import apply, unit
from artsim.making.assembly import Assembly, continuous, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import UP, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull, revolved, ring, rod, tube, union
from artsim.model.transforms import rotation_about

GAP = 0.0015


def build(draws: Draws) -> Assembly:
    """A globe; its axis leans to one side, the front faces -X."""
    radius = 0.5 * draws.length("diameter", (0.12, 0.4))  # of the sphere
    lean = np.deg2rad(draws.one_of("axis", {"earth": 23.4, "other": draws.degrees("tilt", (0.0, 40.0))}))
    lean *= draws.one_of("leans_to", {"left": -1.0, "right": 1.0})
    axis = apply(rotation_about((1, 0, 0), lean), UP)
    thick = draws.length("arc_thickness", (0.04, 0.075), of=radius)
    arc_radius = draws.length("arc_radius", (1.08, 1.16), of=radius) + thick
    sphere = ellipsoid((0, 0, 0), radius, 36) + _continents(draws, radius)
    pin = 0.45 * thick
    for side in (-1.0, 1.0):
        sphere += cylinder(side * 0.95 * radius * axis, side * (arc_radius - thick - GAP) * axis, pin, sections=12)
    if draws.chance("equator", 0.5):
        sphere += ring((0, 0, 0), axis, 0.97 * radius, 1.01 * radius, 0.02 * radius, 28)

    arc = _arc(draws, arc_radius, thick, lean)
    foot = -arc_radius - 2.3 * thick
    turning = draws.chance("arc_turns", 0.3)
    horizon = not turning and draws.chance("horizon", 0.2)
    stand = _stand(draws, radius, foot - (GAP if turning else -1.5 * thick), thick)
    if horizon:
        stand += _horizon(draws, arc_radius + 1.6 * thick, foot, thick, radius)
    globe = Assembly("stand", stand, 900.0)
    if turning:
        stub = rod(0, 0, (foot, foot + 2.3 * thick), 0.9 * thick, sections=16)
        joint = continuous("stand", UP, (0, 0, foot))
        if not draws.chance("arc_turns_freely", 0.5):
            right, left = draws.angle("arc_turn_right", (0.8, 3.0)), draws.angle("arc_turn_left", (0.8, 3.0))
            joint = revolute("stand", UP, (0, 0, foot), -right, left)
        globe.add("arc", arc + stub, joint)
    else:
        globe.body += arc
    globe.add("globe", sphere, continuous("arc" if turning else "stand", axis, (0, 0, 0)), density=200.0)
    return globe


def _continents(draws: Draws, radius: float) -> Solid:
    """Blobs that stand out of the sphere by a hundredth."""
    solid = Solid()
    angles = np.arange(11) * (2.0 * np.pi / 11)
    for _ in range(draws.integer("continents", 5, 8)):
        center = unit(draws.rng.normal(size=3))
        u = unit(np.cross(center, np.eye(3)[np.argmin(np.abs(center))]))
        v = np.cross(center, u)
        sizes = draws.angle("continent_size", (0.18, 0.42)) * draws.rng.uniform(0.6, 1.2, 11)
        points = [center]
        for share in (0.5, 1.0):
            spread = share * sizes[:, None] * (cos(angles)[:, None] * u + sin(angles)[:, None] * v)
            points += list(unit(center + spread))
        shell = 1.025 * radius * np.array(points)
        solid += hull(np.concatenate([shell, 0.93 * shell]))
    return solid


def _arc(draws: Draws, radius: float, thick: float, tilt: float) -> Solid:
    """The meridian from pole to pole, in the plane x = 0; on the side that the axis leans away from, or all round."""
    whole, flat = draws.chance("arc_whole", 0.25), draws.chance("arc_flat", 0.5)
    # Angles in the plane x = 0 from Z towards -Y: the axis stands at `tilt`.
    # With a tilt >= 0 the lower pole is at y > 0: half an arc goes round by way of it.
    angles = np.linspace(0.0, 2.0 * np.pi, 33) if whole else np.linspace(0.0, np.copysign(np.pi, tilt), 21)
    angles = tilt + angles
    along = np.stack([0 * angles, -sin(angles), cos(angles)], axis=1)
    if flat:
        wide, t = 0.5 * draws.length("arc_width", (0.8, 1.6), of=2 * thick), 0.5 * thick
        rings = [[(x, *(p[1:] * r)) for r in (radius - t, radius + t) for x in (-wide, wide)] for p in along]
        solid = union(hull(np.concatenate([a, b])) for a, b in pairwise(rings))
    else:
        solid = tube(radius * along, 0.6 * thick, 10)
    axis = np.array([0.0, -sin(tilt), cos(tilt)])
    solid += union(
        cylinder(side * (radius - 0.8 * thick) * axis, side * (radius + thick) * axis, 0.8 * thick, sections=14)
        for side in (-1.0, 1.0)
    )
    draws.rng.random()  # keeps the objects of seeds as they are
    if draws.chance("finial", 0.5):
        solid += ellipsoid((radius + 1.3 * thick) * axis, 0.9 * thick, 12)
    return solid


def _stand(draws: Draws, radius: float, top: float, thick: float) -> Solid:
    """Column below the arc, on a foot."""
    height = draws.length("stand_height", (0.15, 0.9), of=radius)
    low = top - height
    stem = draws.length("stem_radius", (0.9, 1.3), of=thick)
    solid = rod(0, 0, (low, top), stem, sections=18)
    if draws.chance("knop", 0.5):
        z = low + draws.length("knop_height", (0.3, 0.7), of=height)
        solid += ellipsoid((0, 0, z), (1.8 * stem, 1.8 * stem, 0.14 * height), 16)
    wide = draws.length("foot_radius", (0.55, 0.85), of=radius)
    kind = draws.pick("foot", ["disc", "stepped", "plinth", "legs", "dome"])
    if kind == "legs":
        for a in turns(draws.integer("leg_count", 3, 4)):
            out = np.array([cos(a + 0.3), sin(a + 0.3), 0.0])
            path = np.outer([0.0, 0.5 * wide, wide], out) + np.outer(low + height * np.array([0.5, 0.25, 0.0]), UP)
            solid += tube(path, [stem, 0.8 * stem, 0.7 * stem], 10) + ellipsoid(path[-1], 0.9 * stem, 10)
        return solid
    tall = draws.length("foot_height", (0.06, 0.14), of=radius)
    if kind == "plinth":
        return solid + box(wide, wide, (low - tall, low + 0.002), fillet=0.1 * wide, axis=2)
    solid += rod(0, 0, (low - tall, low + 0.002), wide, 0.9 * wide, 32)
    if kind == "stepped":
        solid += rod(0, 0, (low, low + 0.7 * tall), 0.65 * wide, 0.55 * wide, 28)
    elif kind == "dome":
        solid += rod(0, 0, (low, low + 0.3 * height), 0.88 * wide, 1.2 * stem, 28)
    return solid


def _horizon(draws: Draws, inner: float, foot: float, thick: float, radius: float) -> Solid:
    """A flat ring around the globe, on legs that reach out from the column."""
    solid = revolved([(inner, -0.5 * thick), (inner + 3 * thick, -0.5 * thick), (inner + 3 * thick, 0.5 * thick),
                      (inner, 0.5 * thick)], sections=28)  # fmt: skip
    at = inner + 1.5 * thick
    for a in turns(draws.integer("horizon_legs", 3, 4), 0.5):
        out = np.array([cos(a), sin(a), 0.0])
        path = np.outer([at, at, 0.0], out) + np.outer([0.0, 0.6 * foot, foot - 0.06 * radius], UP)
        solid += tube(path, 0.7 * thick, 10)
    return solid
