"""Clocks that hang on a wall: plain ones, those with a pendulum, cuckoo clocks."""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.clock_faces import add_hands, dial_plate, glass_door, outline, pendulum, rim
from artsim.families.details import side_hinge
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute
from artsim.making.outlines import FRONT
from artsim.making.solids import box, ellipsoid, frame, hull_of, prism, rod, tube

GAP = 0.001
DENSITY = 500.0


def wall_clock(rng: Rng) -> Assembly:
    """A plain case, or a face with rays."""
    radius = rng.uniform(0.07, 0.25)
    deep = radius * rng.uniform(0.1, 0.5)
    kind = pick(rng, ["round", "round", "square", "octagon", "dodecagon", "hexagon", "rays"])
    tall = 1.0 if kind != "square" or rng.random() < 0.5 else rng.uniform(1.05, 1.5)
    edge = rng.uniform(1.04, 1.35)
    body = dial_plate(rng, radius)
    if kind == "rays":
        body += rod((0.002, deep), 0, 0, 1.02 * radius, sections=32)
        count, reach = int(rng.integers(6, 17)), rng.uniform(1.35, 2.0)
        r = radius * rng.uniform(0.02, 0.05)
        for k in range(count):
            a = 2.0 * np.pi * k / count
            out = np.array([0.0, cos(a), sin(a)])
            far = reach * (1.0 if k % 2 else rng.uniform(0.75, 1.0)) * radius
            body += tube([0.95 * radius * out + (0.5 * deep, 0, 0), far * out + (0.5 * deep, 0, 0)], [r, 0.6 * r], 6)
            if count < 13 and reach > 1.5:
                body += ellipsoid(far * out + (0.5 * deep, 0, 0), 1.8 * r, 8)
    else:
        around = edge if kind in ("round", "square") else edge / cos(np.pi / 6)
        body += prism(outline(kind, around * radius, tall), 0.002, deep, 0)
        if rng.random() < 0.4:
            body += prism(outline(kind, 1.06 * around * radius, tall), 0.4 * deep, 0.9 * deep, 0)
    body += rim(rng, 1.005 * radius, radius * rng.uniform(0.03, min(0.3, edge - 0.99)),
                0.003 + radius * rng.uniform(0.05, 0.2))  # fmt: skip
    clock = Assembly("body", body, DENSITY)
    add_hands(rng, clock, 0.95 * radius, "body")
    if rng.random() < 0.15 and deep > 0.02:
        knob = rod(0.5 * deep, 0, (0, 0.012), 0.3 * deep, sections=14)
        lift = max(outline(kind if kind != "rays" else "round", 1.2 * edge * radius, tall)[:, 1]) + GAP
        if kind != "rays":
            clock.add("knob", knob.moved((0, 0, lift)), continuous("body", (0, 0, 1), (0.5 * deep, 0, lift)))
    return clock


def pendulum_clock(rng: Rng) -> Assembly:
    """A case on the wall with a box below, in which a pendulum hangs; or the pendulum hangs free."""
    radius = rng.uniform(0.06, 0.14)
    deep = rng.uniform(0.05, 0.11)
    kind = pick(rng, ["round", "octagon", "square", "house", "arch"])
    half = radius * rng.uniform(1.1, 1.35)
    body = dial_plate(rng, radius)
    body += rim(rng, 1.005 * radius, 0.06 * radius, 0.003 + 0.1 * radius)
    low = -half
    if kind in ("house", "arch"):
        body += box((0.002, deep), half, half)
        if kind == "house":
            body += prism(
                [(-1.15 * half, half), (1.15 * half, half), (0.0, half * rng.uniform(1.4, 1.9))], -0.01, deep, 0
            )
        else:
            body += prism(outline("round", half).clip((-half, 0), (half, half)) + (0, 0.9 * half), 0.002, deep, 0)
    else:
        name = "square" if kind == "square" else kind
        around = half if kind != "octagon" else half / cos(np.pi / 8)
        body += prism(outline(name, around), 0.002, deep, 0)
    clock = Assembly("body", body, DENSITY)
    length = radius * rng.uniform(1.4, 3.6)
    free = rng.random() < 0.35
    if free:  # in the open below the case
        solid, swing = pendulum(rng, 0.4 * deep, low - 0.004, length, half)
        clock.body += box((0.35 * deep, 0.45 * deep), 0.004, (low - 0.0025, low + 0.01))
    else:
        room = half * rng.uniform(0.5, 0.85)
        bottom = low - length - 0.02
        clock.body += frame((0.006, -room - 0.01, bottom - 0.012), (deep, room + 0.01, low + 0.01), [0.01] * 4)
        clock.body += box((deep - 0.008, deep), room + 0.005, (bottom - 0.008, low + 0.005))
        if rng.random() < 0.6:
            edges = ((-room - 0.01, 0.01), (room + 0.01, 0.01), (0.5 * room, 0.5 * room), (-0.5 * room, 0.5 * room))
            clock.body += prism([(y, bottom - drop) for y, drop in edges], 0.006, deep, 0)
        clock.body += box((deep - 0.03, deep), 0.003, (low - 0.003, low + 0.01))
        solid, swing = pendulum(rng, 0.5 * deep, low - 0.004, length - 0.006, room)
        if rng.random() < 0.6:
            glass_door(rng, clock, 0.006, (-room - 0.008, room + 0.008), (bottom - 0.008, low - 0.002))
    x = 0.4 * deep if free else 0.5 * deep
    add_hands(rng, clock, 0.95 * radius, "body")
    clock.add("pendulum", solid, revolute("body", FRONT, (x, 0, low - 0.004), -swing, swing), density=2000.0)
    return clock


def cuckoo_clock(rng: Rng) -> Assembly:
    """A house with a steep roof, a small door for the bird, a leaf as a pendulum, and cones on chains."""
    radius = rng.uniform(0.035, 0.06)
    deep, half = rng.uniform(0.06, 0.1), radius * rng.uniform(1.4, 2.0)
    low, eaves = -radius * rng.uniform(1.25, 1.6), radius * rng.uniform(1.6, 2.2)
    ridge = eaves + half * rng.uniform(0.7, 1.2)
    body = dial_plate(rng, radius) + box((0.002, deep), half, (low, eaves))
    body += prism([(-half, eaves - 0.001), (half, eaves - 0.001), (0, ridge)], 0.002, deep, 0)
    thick, over = 0.08 * half, 1.25
    slope = (ridge - eaves) / half
    for s in (-1.0, 1.0):
        edge = eaves - (over - 1.0) * half * slope
        slab = [(y, z + t) for y, z in ((0, ridge), (s * over * half, edge)) for t in (0.0, 1.5 * thick)]
        body += prism(slab, -0.35 * deep, deep, 0)
    body += rim(rng, 1.005 * radius, 0.1 * radius, 0.006)
    top, wide = eaves + 0.25 * (ridge - eaves), 0.22 * half
    base = radius * 1.15
    length = radius * rng.uniform(1.5, 3.0)
    body += box((0.35 * deep, 0.45 * deep), 0.004, (low - 0.0025, low + 0.01))
    clock = Assembly("body", body, DENSITY)
    add_hands(rng, clock, 0.95 * radius, "body")
    two = rng.random() < 0.5
    thin = 0.003
    for number in range(1 + two):
        left = number == 0
        seam = 0.0006
        across = (seam if two else -wide, wide) if left else (-wide, -seam)
        leaf = box((0.002 - GAP - thin, 0.002 - GAP), (across[0], across[1]), (base, max(top, base + 1.5 * wide)))
        edge = across[1] if left else across[0]
        joint = side_hinge(0.002 - GAP - thin, edge, rng.uniform(1.2, 2.0), left)
        clock.add(f"door_{number}" if two else "door", leaf, joint)
    solid, swing = pendulum(rng, 0.4 * deep, low - 0.004, length, 0.9 * half)
    clock.add("pendulum", solid, revolute("body", FRONT, (0.4 * deep, 0, low - 0.004), -swing, swing), density=1500.0)
    if rng.random() < 0.7:
        x = 0.8 * deep
        for number, y in enumerate((-0.35 * half, 0.35 * half)):
            drop = length * rng.uniform(0.6, 1.6)
            r = 0.14 * radius
            weight = rod(x, y, (low - GAP, low - drop), 0.001, sections=6)
            weight += hull_of(rod(x, y, (low - drop, low - drop - 3 * r), r, 0.5 * r, 10),
                              ellipsoid((x, y, low - drop - 0.5 * r), r, 10))  # fmt: skip
            fall = prismatic("body", (0, 0, -1), 0.0, rng.uniform(0.05, 0.2), (x, y, low))
            clock.add(f"weight_{number}", weight, fall, density=4000.0)
    return clock
