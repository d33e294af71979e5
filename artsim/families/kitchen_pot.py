"""Kitchen pots: casseroles, stockpots, saucepans, bellied pots and pans with a lid.

What varies: the size and the shape, one long or two short handles of several kinds, the lid (flat, domed, with a rim),
its knob or bow, whether the lid lifts off or swings up about a hinge at the back.
"""

import numpy as np

from artsim.common.elementary import cos, hypot, sin
from artsim.families.details import bow_handle, knob
from artsim.families.proportions import with_tails
from artsim.making.assembly import Assembly, Rng, pick, prismatic, revolute
from artsim.making.solids import Solid, box, cylinder, hull_of, ring, rod, tube, union, vessel
from artsim.model.kinematics import Array

GAP = 0.0012
STEEL = 2500.0  # kg/m^3, as walls are thicker than real ones


def build(rng: Rng) -> Assembly:
    """A pot with its lid on at rest; it faces -X."""
    radius = with_tails(rng, (0.08, 0.16), (0.06, 0.24), 0.2)
    shape = pick(rng, {"straight": 0.4, "flared": 0.2, "bellied": 0.2, "round": 0.2})
    height = radius * (rng.uniform(0.3, 0.9) if rng.random() < 0.4 else with_tails(rng, (0.9, 2.1), (0.9, 3.0), 0.15))
    wall = rng.uniform(0.003, 0.006)
    profile = _profile(rng, shape, radius, height)
    pot = vessel(profile, wall, sections=24)
    if rng.random() < 0.6:  # rolled rim
        pot += ring((0, 0, height - 0.0015), (0, 0, 1), radius - wall, radius + rng.uniform(0.0015, 0.004), 0.003, 24)
    if rng.random() < 0.3:  # thick base
        foot = profile[0, 0] + 0.001
        pot += rod(0, 0, (-0.005, 0.003), foot, sections=24)
    hinged = rng.random() < 0.2
    pot += _handles(rng, radius, height, hinged)
    mouth = float(np.interp(height - 0.009, profile[:, 1], profile[:, 0])) - wall  # clear radius where a lid dips in
    lid, lid_radius, top = _lid(rng, radius, height, wall, mouth, hinged)

    assembly = Assembly("pot", pot, STEEL)
    assembly.record(handles=True)
    if hinged:
        r = 0.005
        x, z = lid_radius + 1.6 * r, height + GAP + r
        half = rng.uniform(0.012, 0.025)
        arm = box((lid_radius - 0.012, x), half, (height + GAP, height + GAP + 0.9 * r))
        lid += arm + rod(x, (-half, half), z, r, sections=16)
        for side in (-1, 1):  # lugs on the pot, either side of the barrel
            y0, y1 = sorted((side * (half + GAP), side * (half + GAP + 0.006)))
            lug = hull_of(rod(x, (y0, y1), z, r, sections=16), box((x - r, x + r), (y0, y1), (height - 0.02, height)))
            assembly.body += lug + box((radius - wall, x), (y0, y1), (height - 0.02, height - 0.008))
        joint = revolute("pot", (0, 1, 0), (x, 0, z), 0.0, np.deg2rad(rng.uniform(80, 105)))
    else:
        share = rng.uniform(0.15, 1.0)  # cubed, as lids of real files rise by 1 % of the diagonal, those in use by half
        joint = prismatic("pot", (0, 0, 1), 0.0, 1.3 * share * share * share * radius, (0, 0, top))
    assembly.add("lid", lid, joint)
    return assembly


def _profile(rng: Rng, shape: str, radius: float, height: float) -> Array:
    """(N, 2) outer radius and height, from the bottom up."""
    foot = rng.uniform(0.75, 0.9)
    if shape == "flared":
        points = [(foot * radius, 0.0), (radius, height)]
    elif shape == "bellied":
        belly = rng.uniform(1.06, 1.16)
        points = [(foot * radius, 0.0), (belly * radius, 0.3 * height), (belly * radius, 0.6 * height)]
        points += [(1.02 * radius, 0.92 * height), (radius, height)]
    elif shape == "round":
        points = [(0.6 * radius, 0.0), (0.83 * radius, 0.12 * height), (0.95 * radius, 0.35 * height), (radius, height)]
    else:
        chamfer = rng.uniform(0.03, 0.1)
        points = [((1 - chamfer) * radius, 0.0), (radius, chamfer * radius), (radius, height)]
    return np.array(points)


def _handles(rng: Rng, radius: float, height: float, hinged: bool) -> Solid:
    """One long handle, with a short one opposite by chance, or two short ones at the sides."""
    z = height - rng.uniform(0.014, 0.025)
    if not hinged and rng.random() < 0.3:
        solid = _stick(rng, radius, z)
        if rng.random() < 0.3:
            solid += _short(rng, "bow", radius, z).turned((0, 0, 1), np.pi)
        return solid.turned((0, 0, 1), rng.choice([0.0, -0.5 * np.pi]))
    kind = pick(rng, {"bow": 0.45, "ear": 0.25, "bar": 0.3})
    one = _short(rng, kind, radius, z).turned((0, 0, 1), 0.5 * np.pi)
    return one + one.mirrored(1)


def _stick(rng: Rng, radius: float, z: float) -> Solid:
    """Long handle along -X, a little upward."""
    length, rise = radius * rng.uniform(1.1, 1.7), rng.uniform(-0.05, 0.2)
    half, thick = rng.uniform(0.009, 0.013), rng.uniform(0.005, 0.008)
    root, tip = np.array([-radius, 0.0, z]), np.array([-radius - length, 0.0, z + rise * length])
    waist = root + 0.3 * (tip - root)
    spots = ((root + (0.006, 0, 0), 1.3), (waist, 0.75), (tip, 1.0))
    slabs = [box(p - (0.003, w * half, thick), p + (0.003, w * half, thick), fillet=0.6 * thick) for p, w in spots]
    return hull_of(slabs[0], slabs[1]) + hull_of(slabs[1], slabs[2])


def _short(rng: Rng, kind: str, radius: float, z: float) -> Solid:
    """Short handle at -X."""
    spread, reach = rng.uniform(0.25, 0.45), with_tails(rng, (0.022, 0.045), (0.012, 0.06), 0.3)
    inside = radius - 0.003
    start, end = (np.array([-inside * cos(spread), s * inside * sin(spread), z]) for s in (-1, 1))
    if kind == "bow":
        sag = rng.uniform(-0.5, 0.0)
        outward = np.array([-1.0, 0.0, sag]) / hypot(1.0, sag)
        return bow_handle(start, end, outward, reach, rng.uniform(0.004, 0.007))
    if kind == "bar":
        r = rng.uniform(0.0035, 0.006)
        posts = [(p, np.array([-radius - reach, p[1], z])) for p in (start, end)]
        over = np.array([0.0, rng.uniform(0.0, 0.02), 0.0])
        bar = tube([posts[0][1] - over, posts[1][1] + over], 1.2 * r)
        return bar + union(tube([foot, tip], 0.8 * r, 10) for foot, tip in posts)
    half, thick = radius * sin(spread), rng.uniform(0.004, 0.007)
    far_x = -radius - reach
    far = box((far_x, far_x + 0.012), 0.6 * half, (z - thick, z + 0.8 * thick), fillet=0.004)
    start_box = box((-radius - 0.004, -inside * cos(spread)), half, (z - thick, z + thick), fillet=0.003)
    return hull_of(start_box, far)


def _lid(rng: Rng, radius: float, height: float, wall: float, mouth: float, hinged: bool) -> tuple[Solid, float, float]:
    """The lid, its radius, and the height of its top."""
    lid_radius = radius + with_tails(rng, (-0.5 * wall, 0.004), (-0.5 * wall, 0.01), 0.2)
    z = height + GAP
    rim = rng.uniform(0.003, 0.008)
    solid = rod(0, 0, (z, z + rim), lid_radius, sections=24)
    dome = lid_radius * rng.choice([0.03, rng.uniform(0.08, 0.5)])
    spread = rng.uniform(0.86, 0.99)
    heights, shares = np.array([0.0, 0.45, 0.75, 0.93, 1.0]), np.array([1.0, 0.86, 0.66, 0.42, 0.15])
    low = z + rim - 0.0005
    discs = [rod(0, 0, (low, low + dome * h + 1e-4), spread * lid_radius * s, sections=24)
             for h, s in zip(heights, shares, strict=True)]  # fmt: skip
    solid += hull_of(*discs)
    if not hinged and rng.random() < 0.6:  # a rim that dips into the pot
        inner = min(radius - wall, mouth) - 0.002
        solid += ring((0, 0, z - 0.003), (0, 0, 1), inner - 0.004, inner, 0.008, 24)
    top = low + dome
    foot = np.array([0.0, 0.0, top])
    kind = pick(rng, {"knob": 0.4, "bow": 0.25, "disc": 0.2, "bridge": 0.15})
    size = radius * rng.uniform(0.1, 0.25)
    if kind == "knob":
        solid += knob(foot, np.array([0.0, 0.0, 1.0]), 0.9 * size, size)
    elif kind == "disc":
        solid += cylinder(foot - (0, 0, 0.003), foot + (0, 0, 0.8 * size), 0.45 * size, 0.6 * size)
        solid += cylinder(foot + (0, 0, 0.75 * size), foot + (0, 0, 1.1 * size), 1.4 * size, 1.3 * size)
    else:
        half = 1.8 * size
        sunk = top - 0.5 * dome - 0.002
        start, end = np.array([0.0, -half, sunk]), np.array([0.0, half, sunk])
        reach = top - sunk + rng.uniform(0.02, 0.035)
        if kind == "bow":
            solid += bow_handle(start, end, np.array([0.0, 0.0, 1.0]), reach, rng.uniform(0.004, 0.006))
        else:
            r = rng.uniform(0.004, 0.006)
            up = np.array([0.0, 0.0, reach])
            solid += tube([start - (0, r, 0) + up, end + (0, r, 0) + up], 1.2 * r)
            solid += tube([start, start + up], r, 10) + tube([end, end + up], r, 10)
    return solid, lid_radius, top
