"""Clocks that hang on a wall: plain ones, those with a pendulum, cuckoo clocks."""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.clock_faces import DENSITY, GAP, add_hands, dial_plate, glass_door, outline, pendulum, rim
from artsim.families.details import side_hinge
from artsim.making.assembly import Assembly, continuous, prismatic
from artsim.making.draws import Draws
from artsim.making.outlines import UP, turns
from artsim.making.solids import box, ellipsoid, frame, hull_of, prism, rod, tube


def wall_clock(draws: Draws) -> Assembly:
    """A plain case, or a face with rays."""
    radius = 0.5 * draws.length("diameter", (0.14, 0.5))
    deep = draws.length("depth", (0.1, 0.5), of=radius)
    kind = draws.pick("case", ["round", "round", "square", "octagon", "dodecagon", "hexagon", "rays"])
    oblong = kind == "square" and not draws.chance("square", 0.5)
    tall = draws.number("case_stretch", (1.05, 1.5)) if oblong else 1.0
    edge = draws.number("case_edge", (1.04, 1.35))
    body = dial_plate(draws, radius)
    if kind == "rays":
        body += rod((0.002, deep), 0, 0, 1.02 * radius, sections=32)
        count, reach = draws.integer("rays", 6, 16), draws.number("ray_reach", (1.35, 2.0))
        r = draws.length("ray_radius", (0.02, 0.05), of=radius)
        for k, a in enumerate(turns(count)):
            out = np.array([0.0, cos(a), sin(a)])
            far = reach * (1.0 if k % 2 else draws.number("short_ray", (0.75, 1.0))) * radius
            body += tube([0.95 * radius * out + (0.5 * deep, 0, 0), far * out + (0.5 * deep, 0, 0)], [r, 0.6 * r], 6)
            if count < 13 and reach > 1.5:
                body += ellipsoid(far * out + (0.5 * deep, 0, 0), 1.8 * r, 8)
    else:
        around = edge if kind in ("round", "square") else edge / cos(np.pi / 6)
        body += prism(outline(kind, around * radius, tall), 0.002, deep, 0)
        if draws.chance("case_step", 0.4):
            body += prism(outline(kind, 1.06 * around * radius, tall), 0.4 * deep, 0.9 * deep, 0)
    wide = draws.length("rim_width", (0.03, min(0.3, edge - 0.99)), of=radius)
    body += rim(draws, 1.005 * radius, wide, 0.003 + draws.length("rim_rise", (0.05, 0.2), of=radius))
    clock = Assembly("body", body, DENSITY)
    add_hands(draws, clock, 0.95 * radius)
    if draws.chance("knob", 0.15) and deep > 0.02 and kind != "rays":
        lift = outline(kind, 1.2 * edge * radius, tall)[:, 1].max() + GAP
        knob = rod(0.5 * deep, 0, (0, 0.012), 0.3 * deep, sections=14).moved((0, 0, lift))
        clock.add("knob", knob, continuous("body", UP, (0.5 * deep, 0, lift)))
    return clock


def pendulum_clock(draws: Draws) -> Assembly:
    """A case on the wall with a box below, in which a pendulum hangs; or the pendulum hangs free."""
    radius, deep = 0.5 * draws.length("diameter", (0.12, 0.28)), draws.length("depth", (0.05, 0.11))
    kind = draws.pick("case", ["round", "octagon", "square", "house", "arch"])
    half = 0.5 * draws.length("case_width", (1.1, 1.35), of=2 * radius)
    body = dial_plate(draws, radius)
    body += rim(draws, 1.005 * radius, 0.06 * radius, 0.003 + 0.1 * radius)
    low = -half
    if kind in ("house", "arch"):
        body += box((0.002, deep), half, half)
        if kind == "house":
            ridge = draws.length("ridge_height", (1.4, 1.9), of=half)
            body += prism([(-1.15 * half, half), (1.15 * half, half), (0.0, ridge)], -0.01, deep, 0)
        else:
            body += prism(outline("round", half).clip((-half, 0), (half, half)) + (0, 0.9 * half), 0.002, deep, 0)
    else:
        body += prism(outline(kind, half if kind != "octagon" else half / cos(np.pi / 8)), 0.002, deep, 0)
    clock = Assembly("body", body, DENSITY)
    length = draws.length("pendulum_length", (1.4, 3.6), of=radius)
    if draws.chance("pendulum_free", 0.35):  # in the open below the case
        swinging = pendulum(draws, 0.4 * deep, low - 0.004, length, half)
        clock.body += box((0.35 * deep, 0.45 * deep), 0.004, (low - 0.0025, low + 0.01))
    else:
        room = 0.5 * draws.length("box_width", (0.5, 0.85), of=2 * half)
        bottom = low - length - 0.02
        clock.body += frame((0.006, -room - 0.01, bottom - 0.012), (deep, room + 0.01, low + 0.01), [0.01] * 4)
        clock.body += box((deep - 0.008, deep), room + 0.005, (bottom - 0.008, low + 0.005))
        if draws.chance("box_tapers", 0.6):
            edges = ((-room - 0.01, 0.01), (room + 0.01, 0.01), (0.5 * room, 0.5 * room), (-0.5 * room, 0.5 * room))
            clock.body += prism([(y, bottom - drop) for y, drop in edges], 0.006, deep, 0)
        clock.body += box((deep - 0.03, deep), 0.003, (low - 0.003, low + 0.01))
        swinging = pendulum(draws, 0.5 * deep, low - 0.004, length - 0.006, room)
        if draws.chance("door", 0.6):
            glass_door(draws, clock, 0.006, (-room - 0.008, room + 0.008), (bottom - 0.008, low - 0.002))
    add_hands(draws, clock, 0.95 * radius)
    clock.add("pendulum", *swinging, density=2000.0)
    return clock


def cuckoo_clock(draws: Draws) -> Assembly:
    """A house with a steep roof, a small door for the bird, a leaf as a pendulum, and cones on chains."""
    radius = 0.5 * draws.length("diameter", (0.07, 0.12))
    deep, half = draws.length("depth", (0.06, 0.1)), 0.5 * draws.length("case_width", (1.4, 2.0), of=2 * radius)
    low = -draws.length("case_bottom", (1.25, 1.6), of=radius)
    eaves = draws.length("eaves_height", (1.6, 2.2), of=radius)
    ridge = eaves + draws.length("roof_height", (0.7, 1.2), of=half)
    body = dial_plate(draws, radius) + box((0.002, deep), half, (low, eaves))
    body += prism([(-half, eaves - 0.001), (half, eaves - 0.001), (0, ridge)], 0.002, deep, 0)
    thick, over = 0.08 * half, 1.25
    slope = (ridge - eaves) / half
    for s in (-1.0, 1.0):
        edge = eaves - (over - 1.0) * half * slope
        slab = [(y, z + t) for y, z in ((0, ridge), (s * over * half, edge)) for t in (0.0, 1.5 * thick)]
        body += prism(slab, -0.35 * deep, deep, 0)
    body += rim(draws, 1.005 * radius, 0.1 * radius, 0.006)
    top, wide = eaves + 0.25 * (ridge - eaves), 0.22 * half
    base = radius * 1.15
    length = draws.length("pendulum_length", (1.5, 3.0), of=radius)
    body += box((0.35 * deep, 0.45 * deep), 0.004, (low - 0.0025, low + 0.01))
    clock = Assembly("body", body, DENSITY)
    add_hands(draws, clock, 0.95 * radius)
    front, seam = 0.001, 0.0006
    spans = [(seam, wide), (-wide, -seam)] if draws.chance("double_door", 0.5) else [(-wide, wide)]
    for number, across in enumerate(spans):
        leaf = box((front - 0.003, front), across, (base, max(top, base + 1.5 * wide)))
        joint = side_hinge(front - 0.003, across[1 - number], draws.angle("door_angle", (1.2, 2.0)), number == 0)
        clock.add(f"door_{number}" if len(spans) > 1 else "door", leaf, joint)
    clock.add("pendulum", *pendulum(draws, 0.4 * deep, low - 0.004, length, 0.9 * half), density=1500.0)
    if draws.chance("weight", 0.7):
        x, r = 0.8 * deep, 0.14 * radius
        for number, y in enumerate((-0.35 * half, 0.35 * half)):
            drop = draws.length("chain_length", (0.6, 1.6), of=length)
            weight = rod(x, y, (low - GAP, low - drop), 0.001, sections=6)
            weight += hull_of(rod(x, y, (low - drop, low - drop - 3 * r), r, 0.5 * r, 10),
                              ellipsoid((x, y, low - drop - 0.5 * r), r, 10))  # fmt: skip
            fall = prismatic("body", (0, 0, -1), 0.0, draws.length("weight_travel", (0.05, 0.2)), (x, y, low))
            clock.add(f"weight_{number}", weight, fall, density=4000.0)
    return clock
