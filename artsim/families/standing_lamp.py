"""Lamps on a pole or a body, from table lamps to floor lamps, with what switches them; spotlights in a yoke.

What varies: height, foot (disc, square, three legs, vase), pole, shade (cone, drum, square, ball), whether the shade
turns or the pole slides, switches (pull chain, button, dial); of spotlights the mount, the yoke, the head, its flaps.
"""

import numpy as np

from artsim.common.elementary import cos, hypot, power, sin
from artsim.making.assembly import Assembly, continuous, prismatic, revolute, swivel
from artsim.making.draws import Draws
from artsim.making.outlines import SIDE, UP, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull_of, ring, rod, tube, union, vessel

GAP = 0.002


def standing(draws: Draws) -> Assembly:
    """A shade on top of a pole or a body."""
    on_table = draws.chance("on_table", 0.55)
    height = draws.length("height", (0.22, 0.6) if on_table else (0.9, 1.7))
    small = height < 0.7
    radius = draws.length("pole_radius", (0.006, 0.014)) * (1.0 if small else 1.4)
    wide = draws.length("foot_radius", (0.06, 0.12)) * (1.0 if small else 1.5)
    foot = draws.pick("foot", {"disc": 0.35, "square": 0.2, "legs": 0.25, "vase": 0.2})
    thick = draws.length("foot_thickness", (0.012, 0.03))
    base, floor = _foot(draws, foot, wide, thick, height, radius)
    flat = foot in ("disc", "square")
    slides = flat and draws.chance("pole", 0.35)
    if slides:
        sleeve, bore = draws.length("sleeve_height", (0.4, 0.6), of=height), 0.6 * radius
        base += ring((0, 0, 0.5 * (floor + sleeve)), UP, bore + 0.001, radius + 0.002, sleeve - floor + 0.01, 12)
        travel = draws.length("pole_travel", (0.4, 0.8), of=sleeve - floor)
        pole = rod(0, 0, (sleeve - travel - 0.02, height), bore, sections=12)
    else:
        base += rod(0, 0, (floor - 0.004, height), radius, sections=14)
    button = draws.chance("button", 0.35) and flat
    lamp = Assembly("base", base, 2500.0)
    parent = lamp.add("pole", pole, prismatic("base", UP, 0.0, travel, (0, 0, sleeve))) if slides else "base"
    rim = draws.length("shade_radius", (0.08, 0.19)) * (1.0 if small else 1.4)
    tall = draws.length("shade_height", (0.8, 1.9), of=rim)
    kind = draws.pick("shade", {"cone": 0.4, "drum": 0.25, "square": 0.15, "ball": 0.2})
    tilts = draws.chance("shade_tilts", 0.3)
    low = height + (0.035 if tilts else GAP)
    shade = _shade(draws, kind, rim, tall, low)
    if tilts:  # a knuckle at the head of the pole carries it
        at = (0.0, 0.0, height + 0.015)
        shade += rod(0, (-0.006, 0.006), at[2], 0.01, sections=14) + box(0.004, 0.004, (at[2], low + 0.004))
        reach = draws.angle("shade_tilt", (0.4, 1.0))
        joint = revolute(parent, SIDE, at, -reach, reach)
    else:
        joint = swivel(parent, UP, (0, 0, height), None if draws.chance("shade_turns_freely", 0.7) else 1.57)
    lamp.add("shade", shade, joint, density=500.0)
    if button:
        size = draws.length("button_radius", (0.008, 0.014))
        x, top = -0.62 * wide, thick + GAP
        key = rod(x, 0, (top + 0.003, top + 0.008), size, sections=16)
        lamp.add("button", key, prismatic("base", (0, 0, -1), 0.0, 0.003, (x, 0, top)), density=900.0)
    if draws.chance("switch", 0.5) and not tilts and not slides:
        _switch(draws, lamp, radius, height)
    return lamp


def _foot(draws: Draws, kind: str, wide: float, thick: float, height: float, radius: float) -> tuple[Solid, float]:
    """Solid, and the height at which the pole begins."""
    if kind == "disc":
        return rod(0, 0, (0, thick), wide, draws.length("foot_top_radius", (0.8, 1.0), of=wide), 36), thick
    if kind == "square":
        return box(wide, wide, (0, thick), fillet=draws.length("foot_corner", (0.05, 0.5), of=wide), axis=2), thick
    if kind == "legs":
        head = draws.length("leg_height", (0.25, 0.75), of=height)
        span = min(draws.length("leg_spread", (0.25, 0.5), of=height) + 0.06, 0.4)
        size = draws.length("leg_radius", (0.006, 0.014))
        legs = union(
            tube([(span * cos(a), span * sin(a), size), (0.5 * radius * cos(a), 0.5 * radius * sin(a), head)], size, 10)
            for a in turns(3, 0.5)
        )
        return legs + rod(0, 0, (head - 0.02, head + 0.02), 1.8 * radius + size, sections=16), head
    top = draws.length("vase_height", (0.6, 0.85), of=height)
    shares = np.linspace(0.0, 1.0, 8)
    belly, waist = draws.lengths(vase_radius=(0.5, 1.0), vase_waist=(0.2, 0.5), of=wide)
    bulge = power(sin(np.pi * (0.15 + 0.85 * shares)), draws.number("vase_bulge", (0.7, 2.5)))
    radii = waist + (belly - waist) * bulge
    radii[-1] = max(1.3 * radius, 0.3 * waist)
    return tube(np.column_stack([np.zeros(8), np.zeros(8), shares * top]), radii.tolist(), 20), top


def _shade(draws: Draws, kind: str, rim: float, tall: float, low: float) -> Solid:
    """Open below, with a holder across its inside; it begins at ``low``."""
    if kind == "ball":
        return ellipsoid((0, 0, low + 0.8 * rim), (rim, rim, 0.8 * rim), 24)
    sections = 4 if kind == "square" else 24
    neck = draws.length("neck_radius", (0.3, 0.75) if kind == "cone" else (0.85, 1.0), of=rim)
    wall = 0.0025
    holder = low + draws.length("holder_height", (0.02, 0.25), of=tall)
    shell = vessel([(rim, low), (neck, low + tall)], wall, (0.0, 0.0, 0.0), sections, floor=False)
    width = (rim + (neck - rim) * (holder - low) / tall) * cos(np.pi / sections)
    spokes = box(width - 0.002, 0.003, (holder, holder + 0.004))
    spokes += spokes.turned(UP, np.pi / 2)
    if sections == 4:
        spokes = spokes.turned(UP, np.pi / 4)
    bulb = ellipsoid((0, 0, holder + 0.3 * tall), (0.2 * neck, 0.2 * neck, 0.22 * tall), 12)
    return shell + spokes + bulb + rod(0, 0, (low, holder + 0.25 * tall), 0.012, sections=14)


def _switch(draws: Draws, lamp: Assembly, radius: float, height: float) -> None:
    """A dial at the pole, or a chain below the shade."""
    z = height - draws.length("switch_below", (0.03, 0.06))
    if draws.chance("dial", 0.5):
        out = radius + GAP
        dial = rod((-out, -out - 0.02), 0, z, 0.004, sections=10)
        dial += rod((-out - 0.01, -out - 0.026), 0, z, 0.008, sections=8)
        lamp.add("dial", dial, continuous("base", (-1, 0, 0), (-out, 0, z)), density=900.0)
        return
    x = -radius - 0.004
    long = min(draws.length("chain_length", (0.04, 0.15)), 0.3 * height)
    chain = rod(x, 0, (z, z - long), 0.0016, sections=8) + ellipsoid((x, 0, z - long), 0.0035, 10)
    joint = prismatic("base", (0, 0, -1), 0.0, draws.length("chain_travel", (0.01, 0.03)), (x, 0, z))
    lamp.add("chain", chain.moved((-0.004, 0, 0)), joint, density=900.0)


def spotlight(draws: Draws) -> Assembly:
    """A head that tips in a yoke, which turns on a mount."""
    radius, long = draws.lengths(head_radius=(0.03, 0.09), head_length=(0.06, 0.2))
    thick = 0.08 * radius + 0.002
    reach = float(hypot(radius, 0.6 * long)) + 0.012
    mount = draws.pick("mount", ["disc", "pole", "legs"])
    high = draws.length("height", (0.01, 0.04) if mount == "disc" else (0.1, 1.1))
    wide = draws.length("foot_radius", (1.0, 1.8), of=radius)
    base = rod(0, 0, (0, min(high, 0.02)), wide, 0.9 * wide, 32)
    if mount == "legs":
        base, _ = _foot(draws, "legs", wide, 0.02, high, 0.012)
    if mount != "disc":
        base += rod(0, 0, (0.01 if mount == "pole" else 0.2 * high, high), 0.011, sections=14)
    lamp = Assembly("base", base, 2500.0)
    low = high + GAP
    center = np.array([0.0, 0.0, low + thick + reach])
    half = radius + 0.006
    yoke = box(0.012, half + thick, (low, low + thick))
    for s in (-1, 1):
        a, b = sorted((s * half, s * (half + thick)))
        yoke += hull_of(box(0.012, (a, b), (low, low + thick)), rod(0, (a, b), center[2], 0.012, sections=14))
    lamp.add("yoke", yoke, continuous("base", UP, (0, 0, high)))
    # The front of the head looks to -X.
    rim, back = draws.lengths(front_radius=(0.75, 1.0), back_radius=(0.3, 0.95), of=radius)
    start, end = np.array([-0.55 * long, 0, center[2]]), np.array([0.45 * long, 0, center[2]])
    head = cylinder(start, center, 0.97 * rim, 0.97 * radius, 24) + cylinder(center, end, 0.97 * radius, back, 24)
    head += ring(start, (1, 0, 0), 0.8 * rim, rim, 0.012, 24)
    for s in (-1, 1):
        a, b = sorted((s * 0.6 * radius, s * (half - 0.0015)))
        head += rod(0, (a, b), center[2], 0.008, sections=12)
    lower, upper = -draws.angle("tilt_down", (0.3, 1.3)), draws.angle("tilt_up", (0.3, 1.5))
    lamp.add("head", head, revolute("yoke", SIDE, center, lower, upper), density=1200.0)
    if draws.chance("knob", 0.4):
        foot = np.array([0.0, half + thick + GAP, center[2]])
        knob = cylinder(foot, foot + (0, 0.015, 0), 0.013, 0.011, 8)
        lamp.add("knob", knob, continuous("yoke", SIDE, foot), density=1200.0)
    return lamp
