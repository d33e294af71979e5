"""Lamps: desk lamps with arms in a row of joints, standing lamps and spotlights.

What varies: the kind. Of desk lamps the base (disc, square, clamp), whether it swivels, arms of one or two rods,
springs, a parallel rod that follows the lower arm, a third arm, and the shade (cone, bell, flat panel). The others are
in :mod:`artsim.families.standing_lamp`.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import arcsin, arctan2, cos, sin
from artsim.common.products import apply
from artsim.families.clearance import Link, narrow_limits
from artsim.families.standing_lamp import spotlight, standing
from artsim.making.assembly import Assembly, continuous, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import SIDE, UP, Array
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull_of, revolved, rod, tube, union
from artsim.model.transforms import rotation_about

GAP = 0.001


def build(draws: Draws) -> Assembly:
    """A lamp; what leans, leans forward to -X at rest."""
    return draws.one_of("kind", {"desk": _desk, "standing": standing, "spotlight": spotlight}, (0.5, 0.32, 0.18))(draws)


def _desk(draws: Draws) -> Assembly:
    """Base, arms and shade."""
    for _ in draws.tries():
        links, beside, foot = _links(draws)
        if narrow_limits(links, 0.02):
            break
    lamp = Assembly(density=1200.0)
    for link in links:
        lamp.add(link.name, link.solid, link.joint)
    if foot is not None:  # the rod follows the lower arm
        k = [link.name for link in links].index("lower_arm")
        arm = links[k].joint
        assert arm is not None
        lamp.add("rod", beside, revolute(links[k - 1].name, SIDE, foot, arm.lower, arm.upper, mimic=("lower_arm", 1.0)))
    return lamp


def _links(draws: Draws) -> tuple[list[Link], Solid, Array | None]:
    """All links; and the rod that runs beside the lower arm, and its foot, if there is one."""
    half, r = draws.lengths(arm_radius=(0.006, 0.009), knuckle_radius=(0.010, 0.015))
    links = [Link("base")]
    top = _base(draws, links[0], r)
    if draws.chance("turret", 0.6):
        links.append(Link("turret", continuous("base", UP, (0, 0, top))))
        top += GAP
        links[-1].rod((0, 0, top), (0, 0, top + 0.012), 1.3 * r)
    at = np.array([0.0, 0.0, top + 3.0 * r])
    links[-1].rod((0, 0, top + (0.003 if len(links) > 1 else -0.003)), at, 0.8 * half)
    links[-1].rod(at - half * SIDE, at + half * SIDE, r)

    double, sprung = draws.chance("arms_doubled", 0.45), draws.chance("springs", 0.4)
    names = ["lower_arm", *(["middle_arm"] if draws.chance("middle_arm", 0.2) else []), "upper_arm"]
    leans = {"lower_arm": (5.0, 40.0), "second_arm": (-100.0, -55.0), "third_arm": (-30.0, 40.0)}
    angles = np.deg2rad([draws.degrees(f"{arm}_angle", usual) for arm, usual in leans.items()])  # from the link before
    angle, side = 0.0, draws.side("arms_side")
    beside, foot = Solid(), None
    if draws.chance("rod", 0.35):  # a lug behind the knuckle carries the parallel rod
        foot = at + (2.4 * r, 0, 0)
        ends = [cylinder(p - half * SIDE, p + half * SIDE, q, sections=16) for p, q in ((at, r), (foot, 0.7 * r))]
        links[-1].solid += hull_of(*ends)
        links[-1].guard(at, foot, r)
        foot = foot - side * (2.0 * half + GAP) * SIDE
    for k, name in enumerate(names):
        angle += angles[k]
        at = at + side * (2.0 * half + GAP) * SIDE
        hinge = at - side * (half + 0.5 * GAP) * SIDE
        if k == 0:  # stay clear of the base's disc
            lower, upper = np.deg2rad(-62) - angle, np.deg2rad(62) - angle
        else:
            lower = -draws.turn(f"{name}_forward", (50.0, 85.0))
            upper = draws.turn(f"{name}_backward", (50.0, 85.0))
        links.append(Link(name, revolute(links[-1].name, SIDE, hinge, lower, upper)))
        length = draws.length(f"{name}_length", (0.2, 0.36)) * (0.75 if len(names) == 3 else 1.0)
        if k == 0 and foot is not None:  # the rod stays within this distance
            links[-1].guard(at + 0.09 * _lean(angle), at + 0.9 * length * _lean(angle), 3.4 * r + 2.0 * half)
        at = _arm(links[-1], at, _lean(angle), length, half, r, double, sprung and k < 2)
        if k == 0 and foot is not None:
            start, end = links[-1].capsules[-1][:3], links[-1].capsules[-1][3:6]
            path = [foot, foot + 0.93 * (end - start)]
            beside += tube(path, 0.55 * half, 10)
            beside += union(cylinder(p - half * SIDE, p + half * SIDE, 0.7 * r, sections=16) for p in path)
        if draws.chance(f"{name}_sides_change", 0.7):
            side = -side
    at = at + side * (2.0 * half + GAP) * SIDE
    _shade(draws, links, at, side, angle, half, r)
    return links, beside, foot


def _lean(angle: float) -> Array:
    """Direction that leans from the vertical to +X by an angle."""
    return apply(rotation_about(SIDE, angle), UP)


def _base(draws: Draws, link: Link, r: float) -> float:
    """The foot; returns the height of its top."""
    wide, thick = draws.lengths(foot_radius=(0.06, 0.1), foot_thickness=(0.012, 0.03))
    kind = draws.pick("foot", {"disc": 0.4, "dome": 0.2, "square": 0.25, "clamp": 0.15})
    if kind == "clamp":
        link.solid += box((-0.06, 0.035), 0.025, 0.012, fillet=0.004)
        link.solid += box((0.02, 0.035), 0.025, (-0.09, 0.0)) + box((-0.04, 0.03), 0.02, (-0.09, -0.078))
        link.solid += tube([(-0.02, 0, -0.11), (-0.02, 0, -0.045)], 0.006, 12)
        link.solid += rod(-0.02, 0, (-0.05, -0.042), 0.014, sections=16) + box((-0.04, 0.0), 0.004, (-0.114, -0.106))
        link.guard((-0.02, 0, -0.12), (-0.02, 0, 0.03), 0.05)
        link.guard((-0.08, 0, 0), (0.05, 0, 0), 0.03)
        thick = 0.012
    else:
        square = box(wide, 0.8 * wide, (0, thick), fillet=0.25 * wide, axis=2)
        link.solid += square if kind == "square" else rod(0, 0, (0, thick), wide, 0.95 * wide, 36)
        if kind == "dome":
            link.solid += rod(0, 0, (thick - 0.001, thick + 0.015), 0.9 * wide, 0.3 * wide, 32)
        for angle in np.arange(8) * np.pi / 4.0:  # a rim of rods guards the disc
            out = np.array([cos(angle), sin(angle), 0.0])
            link.guard((0, 0, 0.5 * thick), wide * 1.1 * out + (0, 0, 0.5 * thick), 0.5 * thick)
    post = draws.length("post_height", (0.02, 0.045))
    link.solid += rod(0, 0, (0.002, thick + post), 1.25 * r)
    link.guard((0, 0, 0.002), (0, 0, thick + post - 0.7 * r), 1.25 * r)
    return thick + post


def _arm(link: Link, at: Array, along: Array, length: float, half: float, r: float, twin: bool, sprung: bool) -> Array:
    """An arm from one knuckle on; returns where the next one is."""
    end = at + length * along
    link.solid += cylinder(at - half * SIDE, at + half * SIDE, r, sections=18)
    across = np.cross(SIDE, along)
    thin = 0.8 * half
    if twin:
        link.solid += union(tube([at + s * r * across, end + s * r * across], 0.75 * thin, 10) for s in (-0.6, 0.6))
    else:
        link.solid += tube([at, end], thin, 12)
    if sprung:
        low, high = at + 0.15 * length * along, at + 0.4 * length * along
        coils = (low + share * (high - low) for share in np.linspace(0.0, 1.0, 11))
        link.solid += union(cylinder(p, p + 0.05 * (high - low), 0.97 * half, sections=12) for p in coils)
    link.solid += cylinder(end - half * SIDE, end + half * SIDE, r, sections=18)
    link.guard(at, end, r)
    return end


def _shade(draws: Draws, links: list[Link], at: Array, side: float, arm_angle: float, half: float, r: float) -> None:
    """The last link: knuckle, stem and shade. It turns as far as its rim keeps clear of the arm."""
    stem = draws.length("shade_stem", (0.04, 0.06))
    kind = draws.pick("shade", {"cone": 0.45, "bell": 0.3, "panel": 0.25})
    if kind == "panel":
        length, wide = draws.length("shade_length", (0.16, 0.3)), 0.5 * draws.length("shade_width", (0.032, 0.07))
        deep = 0.012
        outline = np.array([(0.6 * length, -0.003)])
    else:
        rim, neck = draws.lengths(shade_radius=(0.05, 0.085), neck_radius=(0.018, 0.026))
        deep = draws.length("shade_depth", (0.09, 0.15))
        share, level = (0.55, 0.7) if kind == "cone" else (0.9, 0.6)
        outline = np.array([(neck, 0), (neck, 0.25 * deep), (neck + share * (rim - neck), level * deep), (rim, deep)])
    # Seen from its knuckle the shade takes up this angle to either side; the arm takes some as well.
    keep = float(arctan2(outline[:, 0], stem + outline[:, 1]).max()) + arcsin(min((r + 0.003) / stem, 1.0)) + 0.05
    # Down and forward, measured from the arm.
    room = draws.turn("shade_angle", (-180.0, -140.0)) - arm_angle - np.pi
    room = max(room % (2.0 * np.pi), keep + 0.1)
    along = _lean(arm_angle + np.pi + room)

    solid = cylinder(at - half * SIDE, at + half * SIDE, r, sections=18)
    solid += tube([at, at + (stem + 0.01) * along], 0.6 * half, 12)
    start = at + stem * along
    if kind == "panel":
        forward = np.cross(SIDE, along)
        forward = -forward if forward[0] > 0 else forward
        spots = [start + a * forward + b * SIDE + c * along for a in (-0.4 * length, 0.597 * length)
                 for b in (-wide, wide) for c in (0.0, deep)]  # fmt: skip
        solid += hull_of(*(ellipsoid(p, 0.003, 8) for p in spots))
        guard = (start - 0.4 * length * forward, start + 0.6 * length * forward, wide + 0.004)
    else:
        solid += cylinder(start, start + 0.06 * deep * along, neck, sections=20)
        for (r0, z0), (r1, z1) in pairwise(outline):
            solid += revolved([(r0 - 0.0025, z0), (r0, z0), (r1, z1), (r1 - 0.0025, z1)], start, along, 18)
        bulb = start + 0.6 * deep * along
        solid += ellipsoid(bulb, 0.4 * rim, 14) + tube([start, bulb], 0.4 * neck, 10)
        guard = (start, start + deep * along, rim)
    lower, upper = -min(room - keep, 1.2), min(2.0 * np.pi - room - keep, 1.2)
    hinge = at - side * (half + 0.5 * GAP) * SIDE
    links.append(Link("shade", revolute(links[-1].name, SIDE, hinge, lower, max(upper, 0.05)), solid=solid))
    links[-1].guard(*guard)
