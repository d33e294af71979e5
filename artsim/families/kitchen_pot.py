"""Kitchen pots: casseroles, stockpots, saucepans, bellied pots and pans with a lid.

What varies: the size and the shape, one long or two short handles of several kinds, the lid (flat, domed, with a rim),
its knob or bow, whether the lid lifts off or swings up about a hinge at the back.
"""

from collections.abc import Sequence

import numpy as np

from artsim.common.elementary import cos, hypot, sin
from artsim.families.details import bow_handle, knob
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, UP, Array, Vector, about, ends
from artsim.making.solids import Solid, box, cylinder, hull_of, ring, rod, tube, union, vessel

GAP = 0.0012
STEEL = 2500.0  # kg/m^3, as walls are thicker than real ones


def build(draws: Draws) -> Assembly:
    """A pot with its lid on at rest; it faces -X."""
    radius = 0.5 * draws.length("width", (0.16, 0.32), (0.12, 0.48), tails=0.2)
    shape = draws.pick("shape", {"straight": 0.4, "flared": 0.2, "bellied": 0.2, "round": 0.2})
    low = draws.chance("low_pot", 0.4)
    height = draws.number("height", (0.3, 0.9)) if low else draws.number("height", (0.9, 2.1), (0.9, 3.0), tails=0.15)
    height *= radius
    wall = draws.length("wall", (0.003, 0.006))
    profile = _profile(draws, shape, radius, height)
    pot = vessel(profile, wall, sections=24)
    if draws.chance("rolled_rim", 0.6):
        width = draws.length("rim_width", (0.0015, 0.004))
        pot += ring((0, 0, height - 0.0015), UP, radius - wall, radius + width, 0.003, 24)
    if draws.chance("thick_base", 0.3):
        pot += rod(0, 0, (-0.005, 0.003), profile[0, 0] + 0.001, sections=24)
    hinged = draws.chance("hinge", 0.2)
    pot += _handles(draws, radius, height, hinged)
    mouth = float(np.interp(height - 0.009, profile[:, 1], profile[:, 0])) - wall  # clear radius where a lid dips in
    lid, lid_radius, top = _lid(draws, radius, height, wall, mouth, hinged)

    assembly = Assembly("pot", pot, STEEL)
    assembly.record(handles=True)
    if hinged:
        r = 0.005
        x, z = lid_radius + 1.6 * r, height + GAP + r
        half = 0.5 * draws.length("hinge_width", (0.024, 0.05))
        arm = box((lid_radius - 0.012, x), half, (height + GAP, height + GAP + 0.9 * r))
        lid += arm + rod(x, (-half, half), z, r, sections=16)
        for side in (-1, 1):  # lugs on the pot, either side of the barrel
            across = ends((side * (half + GAP), side * (half + GAP + 0.006)))
            lug = hull_of(rod(x, across, z, r, sections=16), box(about(x, r), across, (height - 0.02, height)))
            assembly.body += lug + box((radius - wall, x), across, (height - 0.02, height - 0.008))
        joint = revolute("pot", SIDE, (x, 0, z), 0.0, draws.turn("lid_angle", (80, 105)))
    else:
        # Cubed, as lids of real files rise by 1 % of the diagonal, those in use by half.
        share = draws.number("lid_travel", (0.15, 1.0))
        joint = prismatic("pot", UP, 0.0, 1.3 * share * share * share * radius, (0, 0, top))
    assembly.add("lid", lid, joint)
    return assembly


def _profile(draws: Draws, shape: str, radius: float, height: float) -> Array:
    """(N, 2) outer radius and height, from the bottom up."""
    foot = draws.number("foot", (0.75, 0.9))
    if shape == "flared":
        points = [(foot * radius, 0.0), (radius, height)]
    elif shape == "bellied":
        belly = draws.number("belly", (1.06, 1.16))
        points = [(foot * radius, 0.0), (belly * radius, 0.3 * height), (belly * radius, 0.6 * height)]
        points += [(1.02 * radius, 0.92 * height), (radius, height)]
    elif shape == "round":
        points = [(0.6 * radius, 0.0), (0.83 * radius, 0.12 * height), (0.95 * radius, 0.35 * height), (radius, height)]
    else:
        chamfer = draws.number("chamfer", (0.03, 0.1))
        points = [((1 - chamfer) * radius, 0.0), (radius, chamfer * radius), (radius, height)]
    return np.array(points)


def _handles(draws: Draws, radius: float, height: float, hinged: bool) -> Solid:
    """One long handle, with a short one opposite by chance, or two short ones at the sides."""
    z = height - draws.length("handle_drop", (0.014, 0.025))
    if not hinged and draws.chance("long_handle", 0.3):
        solid = _stick(draws, radius, z)
        if draws.chance("second_handle", 0.3):
            solid += _short(draws.within("second"), "bow", radius, z).turned(UP, np.pi)
        return solid.turned(UP, draws.one_of("handle_at", {"front": 0.0, "left": -0.5 * np.pi}))
    one = _short(draws, draws.pick("handle", {"bow": 0.45, "ear": 0.25, "bar": 0.3}), radius, z).turned(UP, 0.5 * np.pi)
    return one + one.mirrored(1)


def _stick(draws: Draws, radius: float, z: float) -> Solid:
    """Long handle along -X, a little upward."""
    length, rise = radius * draws.number("handle_length", (1.1, 1.7)), draws.number("handle_rise", (-0.05, 0.2))
    half = 0.5 * draws.length("handle_width", (0.018, 0.026))
    thick = 0.5 * draws.length("handle_thickness", (0.01, 0.016))
    root, tip = np.array([-radius, 0.0, z]), np.array([-radius - length, 0.0, z + rise * length])
    waist = root + 0.3 * (tip - root)
    spots = ((root + (0.006, 0, 0), 1.3), (waist, 0.75), (tip, 1.0))
    slabs = [box(p - (0.003, w * half, thick), p + (0.003, w * half, thick), fillet=0.6 * thick) for p, w in spots]
    return (hull_of(slabs[0], slabs[1]) + hull_of(slabs[1], slabs[2])).called("handle", FRONT)


def _short(draws: Draws, kind: str, radius: float, z: float) -> Solid:
    """Short handle at -X."""
    spread = draws.angle("handle_spread", (0.25, 0.45))
    reach = draws.length("handle_reach", (0.022, 0.045), (0.012, 0.06), tails=0.3)
    inside = radius - 0.003
    start, end = (np.array([-inside * cos(spread), s * inside * sin(spread), z]) for s in (-1, 1))
    if kind == "bow":
        sag = draws.number("handle_sag", (-0.5, 0.0))
        outward = np.array([-1.0, 0.0, sag]) / hypot(1.0, sag)
        return bow_handle(start, end, outward, reach, draws.length("handle_radius", (0.004, 0.007)))
    if kind == "bar":
        r = draws.length("handle_radius", (0.0035, 0.006))
        over = np.array([0.0, draws.length("handle_overhang", (0.0, 0.02)), 0.0])
        tips = [np.array([-radius - reach, foot[1], z]) for foot in (start, end)]
        return _bridge((start, end), tips, over, 1.2 * r, 0.8 * r, FRONT)
    half, thick = radius * sin(spread), draws.length("handle_thickness", (0.004, 0.007))
    far_x = -radius - reach
    far = box((far_x, far_x + 0.012), 0.6 * half, (z - thick, z + 0.8 * thick), fillet=0.004)
    root = box((-radius - 0.004, -inside * cos(spread)), half, about(z, thick), fillet=0.003)
    return hull_of(root, far).called("handle", FRONT)


def _bridge(feet: Sequence[Array], tips: Sequence[Array], over: Array, bar: float, post: float, out: Vector) -> Solid:
    """A round bar on two posts, which it overhangs, with the radii of both."""
    solid = tube([tips[0] - over, tips[1] + over], bar)
    solid += union(tube([foot, tip], post, 10) for foot, tip in zip(feet, tips, strict=True))
    return solid.called("handle", out)


def _lid(
    draws: Draws, radius: float, height: float, wall: float, mouth: float, hinged: bool
) -> tuple[Solid, float, float]:
    """The lid, its radius, and the height of its top."""
    lid_radius = radius + draws.length("lid_overhang", (-0.5 * wall, 0.004), (-0.5 * wall, 0.01), tails=0.2)
    z = height + GAP
    rim = draws.length("lid_rim", (0.003, 0.008))
    solid = rod(0, 0, (z, z + rim), lid_radius, sections=24)
    dome = lid_radius * draws.one_of("lid", {"flat": 0.03, "domed": draws.number("lid_dome", (0.08, 0.5))})
    spread = draws.number("dome_width", (0.86, 0.99))
    heights, shares = np.array([0.0, 0.45, 0.75, 0.93, 1.0]), np.array([1.0, 0.86, 0.66, 0.42, 0.15])
    low = z + rim - 0.0005
    discs = [rod(0, 0, (low, low + dome * h + 1e-4), spread * lid_radius * s, sections=24)
             for h, s in zip(heights, shares, strict=True)]  # fmt: skip
    solid += hull_of(*discs)
    if not hinged and draws.chance("inner_rim", 0.6):  # a rim that dips into the pot
        inner = min(radius - wall, mouth) - 0.002
        solid += ring((0, 0, z - 0.003), UP, inner - 0.004, inner, 0.008, 24)
    top = low + dome
    foot = np.array([0.0, 0.0, top])
    kind = draws.pick("lid_handle", {"knob": 0.4, "bow": 0.25, "disc": 0.2, "bridge": 0.15})
    size = radius * draws.number("lid_handle_size", (0.1, 0.25))
    if kind == "knob":
        solid += knob(foot, UP, 0.9 * size, size)
    elif kind == "disc":
        disc = cylinder(foot - (0, 0, 0.003), foot + (0, 0, 0.8 * size), 0.45 * size, 0.6 * size)
        disc += cylinder(foot + (0, 0, 0.75 * size), foot + (0, 0, 1.1 * size), 1.4 * size, 1.3 * size)
        solid += disc.called("knob", UP)
    else:
        sunk = top - 0.5 * dome - 0.002
        start, end = (np.array([0.0, s * 1.8 * size, sunk]) for s in (-1, 1))
        reach = top - sunk + draws.length("lid_handle_height", (0.02, 0.035))
        r = draws.length("lid_handle_radius", (0.004, 0.006))
        if kind == "bow":
            solid += bow_handle(start, end, UP, reach, r)
        else:
            tips = start + reach * UP, end + reach * UP
            solid += _bridge((start, end), tips, r * SIDE, 1.2 * r, r, UP)
    return solid, lid_radius, top
