"""Clocks: on a wall, on a mantel, longcase clocks, alarm clocks, cuckoo clocks, pocket watches.

What varies: the kind, the outline of the case (round, square, polygon, arch, house, tambour), the rim, the marks of the
hours, two or three hands of several forms and where they point, a pendulum and its bob, weights on chains, a door
before the pendulum, doors of a cuckoo, a lid, bells with a hammer, knobs, a fork in which the case tilts. Two to eight
parts move. Hands turn freely about the middle of the face, clockwise as seen from the front.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.clock_faces import CLOCKWISE, add_hands, dial_plate, glass_door, outline, pendulum, rim
from artsim.families.details import side_hinge
from artsim.families.hanging_clocks import cuckoo_clock, pendulum_clock, wall_clock
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute
from artsim.making.outlines import FRONT, about, arch
from artsim.making.solids import Solid, box, cylinder, ellipsoid, frame, hull_of, prism, ring, rod, tube, union

GAP = 0.001
DENSITY = 500.0


def build(rng: Rng) -> Assembly:
    """A clock; its face looks towards -X and the pendulum hangs straight at rest."""
    kinds = {wall_clock: 0.24, pendulum_clock: 0.16, _mantel_clock: 0.16, _longcase_clock: 0.13, _alarm_clock: 0.15,
             cuckoo_clock: 0.08, _watch: 0.08}  # fmt: skip
    return pick(rng, kinds)(rng)


def _mantel_clock(rng: Rng) -> Assembly:
    """A case that stands: a block, an arch, a tambour, a house, or a drum on feet."""
    radius = rng.uniform(0.04, 0.1)
    deep = radius * rng.uniform(0.7, 1.5)
    kind = pick(rng, ["block", "arch", "tambour", "house", "drum", "lancet"])
    half = radius * rng.uniform(1.12, 1.5)
    low = -radius * rng.uniform(1.12, 1.8)
    body = dial_plate(rng, radius)
    body += rim(rng, 1.005 * radius, 0.08 * radius, 0.003 + 0.1 * radius)
    around = outline("round", half)
    corners = np.array([(-half, low), (half, low)])
    if kind == "drum":
        low = -half * rng.uniform(1.05, 1.4)
        body += rod((0.002, deep), 0, 0, half, sections=32)
        for y in (-0.6 * half, 0.6 * half):
            body += box((0.1 * deep, 0.9 * deep), (y - 0.1 * half, y + 0.1 * half), (low, -0.6 * half))
    elif kind == "tambour":
        body += prism(np.concatenate([around, corners]), 0.002, deep, 0)
        wide = half * rng.uniform(1.5, 2.6)
        shoulder = low + 0.3 * (0.0 - low)
        body += prism([(-wide, low), (wide, low), (0.95 * wide, shoulder), (half, 0.3 * half), (-half, 0.3 * half),
                       (-0.95 * wide, shoulder)], 0.004, deep - 0.002, 0)  # fmt: skip
    elif kind == "arch":
        body += prism(np.concatenate([around, corners]), 0.002, deep, 0)
    elif kind == "lancet":
        body += prism(np.concatenate([around, corners, [(0.0, 1.6 * half)]]), 0.002, deep, 0)
    else:
        body += box((0.002, deep), half, (low, half))
        if kind == "house":
            body += prism([(-1.1 * half, half), (1.1 * half, half), (0.0, half * rng.uniform(1.3, 1.8))], -0.008,
                          deep + 0.008, 0)  # fmt: skip
        elif rng.random() < 0.6:
            body += box((-0.012, deep + 0.008), 1.12 * half, (half - 0.001, half + 0.1 * half), fillet=0.004)
        if rng.random() < 0.4:  # a handle on top
            top = half * (1.1 if kind == "block" else 1.0)
            bow = [(0.5 * deep, y, top - 0.004 + z) for y, z in arch(0.4 * half, 0.35 * half, 8)]
            body += tube(bow, 0.04 * half, 8) if kind == "block" else Solid()
    base = half * (rng.uniform(1.05, 1.4) if kind != "tambour" else 2.65)
    if kind != "drum" and rng.random() < 0.75:
        body += box((-0.014, deep + 0.008), base, (low - 0.15 * half, low + 0.002), fillet=0.004)
    tilting = kind == "drum" and rng.random() < 0.4
    if tilting:  # the drum hangs in a fork
        drum = dial_plate(rng, radius) + rod((0.002, deep), 0, 0, half, sections=32)
        drum += rim(rng, 1.005 * radius, 0.08 * radius, 0.003 + 0.1 * radius)
        x, r = 0.5 * deep, 0.08 * half
        arm = half + 0.004 + 2 * r
        clear = half + deep + 0.01
        fork = tube([(x, -arm, 0), (x, -arm, -0.6 * clear), (x, -0.4 * half, -clear), (x, 0.4 * half, -clear),
                     (x, arm, -0.6 * clear), (x, arm, 0)], r, 10)  # fmt: skip
        fork += box((x - 0.8 * half, x + 0.8 * half), 0.9 * half, (-clear - 0.012, -clear + 0.002), fillet=0.005)
        clock = Assembly("body", fork, 1500.0)
        limit = rng.uniform(0.2, 0.6)
        clock.add("case", drum, revolute("body", (0, 1, 0), (x, 0, 0), -limit, limit), density=DENSITY)
        add_hands(rng, clock, 0.95 * radius, "case")
        return clock
    clock = Assembly("body", body, DENSITY)
    add_hands(rng, clock, 0.95 * radius, "body")
    if rng.random() < 0.45:
        _knobs(rng, clock, deep, 0.35 * radius)
    return clock


def _knobs(rng: Rng, clock: Assembly, x: float, spread: float) -> None:
    """One to three knobs at the back."""
    count = int(rng.integers(1, 4))
    for k in range(count):
        y, z = (k - 0.5 * (count - 1)) * spread, rng.uniform(-0.6, 0.3) * spread
        r = 0.35 * spread * rng.uniform(0.6, 1.0)
        knob = rod((x + GAP, x + GAP + 0.5 * r), y, z, 0.5 * r, sections=10)
        knob += box((x + GAP + 0.4 * r, x + GAP + 1.4 * r), about(y, r), about(z, 0.25 * r), fillet=0.2 * r)
        name = f"knob_{k}" if count > 1 else "knob"
        clock.add(name, knob, continuous("body", CLOCKWISE, (x, y, z)), density=DENSITY)


def _longcase_clock(rng: Rng) -> Assembly:
    """A tall case on the floor: a hood with the face, a trunk with pendulum and weights, a plinth."""
    radius = rng.uniform(0.11, 0.17)
    deep = rng.uniform(0.18, 0.28)
    hood = radius * rng.uniform(1.15, 1.45)
    trunk = hood * rng.uniform(0.65, 0.95)
    foot = trunk * rng.uniform(1.05, 1.4)
    length = rng.uniform(0.7, 1.1)
    plinth = rng.uniform(0.25, 0.45)
    low = -hood - rng.uniform(0.0, 0.05)
    bottom = low - length
    body = dial_plate(rng, radius) + box((0.002, deep), hood, (low, hood))
    body += rim(rng, 1.005 * radius, 0.08 * radius, 0.01 + 0.05 * radius)
    crest = pick(rng, ["flat", "gable", "arch", "swan"])
    if crest == "gable":
        body += prism([(-1.1 * hood, hood), (1.1 * hood, hood), (0, hood * rng.uniform(1.3, 1.7))], -0.02, deep, 0)
    elif crest == "arch":
        body += prism(outline("round", hood).clip((-hood, 0), (hood, hood)) + (0, hood - 0.01), -0.01, deep, 0)
    elif crest == "swan":
        for s in (-1.0, 1.0):
            horn = ((1.08 * hood, hood - 0.001), (0.2 * hood, hood - 0.001), (0.2 * hood, 1.45 * hood))
            body += prism([(s * y, z) for y, z in (*horn, (0.4 * hood, 1.5 * hood))], 0.0, 0.3 * deep, 0)
    body += box((-0.02, deep), 1.1 * hood, (hood - 0.02, hood + 0.02), fillet=0.01)
    if rng.random() < 0.5:
        body += union(rod(-0.02, s * hood, (low, hood - 0.02), 0.012, sections=12) for s in (-1.0, 1.0))
    body += box((-0.02, deep), 1.05 * hood, (low - 0.03, low + 0.002))
    body += frame((0.01, -trunk, bottom), (deep, trunk, low - 0.028), [0.02] * 4)
    body += box((deep - 0.012, deep), trunk - 0.01, (bottom + 0.01, low - 0.03))
    body += box((-0.02, deep), foot, (bottom - plinth, bottom + 0.005), fillet=0.006)
    if rng.random() < 0.6:
        body += box((-0.035, deep), 1.1 * foot, (bottom - plinth, bottom - 0.75 * plinth), fillet=0.006)
    top = low - 0.05
    body += box((0.5 * deep, deep - 0.005), 0.006, (top + 0.002, top + 0.004))
    clock = Assembly("body", body, DENSITY)
    add_hands(rng, clock, 0.95 * radius, "body")
    room = trunk - 0.025
    solid, swing = pendulum(rng, 0.6 * deep, top, (top - bottom) * rng.uniform(0.65, 0.9) - 0.02, room)
    clock.add("pendulum", solid, revolute("body", FRONT, (0.6 * deep, 0, top), -swing, swing), density=2000.0)
    if rng.random() < 0.75:
        glass_door(rng, clock, 0.01, (-trunk + 0.004, trunk - 0.004), (bottom + 0.008, low - 0.034))
    return clock


def _alarm_clock(rng: Rng) -> Assembly:
    """A drum on feet with two bells, or a small case with a button."""
    radius = rng.uniform(0.025, 0.06)
    deep = radius * rng.uniform(0.6, 1.3)
    half = radius * rng.uniform(1.08, 1.25)
    body = dial_plate(rng, radius)
    body += rim(rng, 1.005 * radius, 0.06 * radius, 0.003 + 0.12 * radius)
    bells = rng.random() < 0.65
    middle = 0.5 * deep
    if not bells:
        tall = rng.uniform(0.9, 1.3)
        kind = pick(rng, ["square", "wedge", "drum"])
        if kind == "drum":
            body += rod((0.002, deep), 0, 0, half, sections=32)
            body += box((0.1 * deep, 0.9 * deep), 0.7 * half, (-1.08 * half, -0.5 * half))
            top = half * cos(np.pi / 32)
        else:
            edge = half * tall
            body += box((0.002, deep), half, edge, fillet=rng.uniform(0.05, 0.4) * half, axis=0)
            if kind == "wedge":
                body += prism([(deep - 0.004, -edge), (deep * 1.9, -edge), (deep - 0.004, 0.6 * edge)], -0.8 * half,
                              0.8 * half, 1)  # fmt: skip
            top = edge
        wide = half * rng.uniform(0.2, 0.55)
        body += box((0.3 * deep, 0.7 * deep), 0.7 * wide, (0.9 * top, top + 0.0005))
        clock = Assembly("body", body, DENSITY)
        add_hands(rng, clock, 0.95 * radius, "body")
        button = box((0.2 * deep, 0.8 * deep), wide, (top + 0.004, top + 0.01), fillet=0.003)
        clock.add("button", button, prismatic("body", (0, 0, -1), 0.0, 0.003, (middle, 0, top)), density=DENSITY)
        if kind != "wedge":
            _knobs(rng, clock, deep, 0.3 * radius)
        return clock
    body += rod((0.002, deep), 0, 0, half, sections=32)
    spread = rng.uniform(0.5, 0.75)
    r = 0.07 * radius
    size = radius * rng.uniform(0.38, 0.55)
    for s in (-1.0, 1.0):
        out = np.array([0.0, s * sin(spread), -cos(spread)])
        foot = np.array([middle, 0, 0]) + 0.9 * half * out
        body += tube([foot, foot + 0.5 * half * out], [1.6 * r, r], 10) + ellipsoid(foot + 0.5 * half * out, 1.3 * r, 8)
        up = np.array([0.0, s * sin(spread), cos(spread)])
        seat = np.array([middle, 0, 0]) + half * up
        body += cylinder(seat - 0.1 * half * up, seat + 0.25 * size * up, 0.8 * r, sections=10)
        bell = seat + 0.2 * size * up
        levels = ((0.0, 1.0), (0.35, 0.92), (0.65, 0.66), (0.8, 0.2))
        body += hull_of(*(cylinder(bell + h * size * up, bell + (h * size + 1e-4) * up, w * size, sections=18)
                          for h, w in levels))  # fmt: skip
    lean = half * cos(spread) + size
    if rng.random() < 0.6:
        span = half * sin(spread) + 0.5 * size
        body += tube([(middle, y, lean + 0.2 * size + z) for y, z in arch(span, 0.9 * size, 8)], r, 8)
    clock = Assembly("body", body, 1500.0)
    add_hands(rng, clock, 0.95 * radius, "body")
    room = half * sin(spread) - size * cos(spread)
    if room > 0.12 * radius:
        z = half + 0.006
        high = half * cos(spread) + 0.35 * size
        tip = max(high, z + 0.25 * size)
        head = min(0.35 * room, 0.1 * radius)
        hammer = rod(middle, 0, (z, tip), 0.5 * head, sections=8)
        hammer += rod(middle, (-0.8 * head, 0.8 * head), tip, head, sections=10)
        limit = max(0.3 * (room - head) / (tip - z), 0.02)
        clock.add("hammer", hammer, revolute("body", FRONT, (middle, 0, z), -limit, limit), density=3000.0)
    _knobs(rng, clock, deep, 0.5 * radius)
    return clock


def _watch(rng: Rng) -> Assembly:
    """A pocket watch that stands upright: a flat drum with a crown, a bow, and by chance a lid."""
    radius = rng.uniform(0.016, 0.028)
    deep = radius * rng.uniform(0.25, 0.55)
    half = radius * rng.uniform(1.06, 1.18)
    rise = 0.16 * radius
    body = dial_plate(rng, radius)
    body += rod((0.0015, 0.5 * deep), 0, 0, half, sections=30)
    body += rod((0.5 * deep - 1e-4, deep), 0, 0, half, 0.8 * half, 30)
    body += ring((0.0015 - 0.5 * rise, 0, 0), FRONT, 1.005 * radius, half, rise, 28)
    neck = half + 0.12 * radius
    body += rod(0.3 * deep, 0, (0.95 * half, neck), 0.1 * radius, sections=12)
    x = 0.3 * deep
    crown = rod(x, 0, (neck + 0.0004, neck + 0.22 * radius), 0.14 * radius, sections=14)
    loop = arch(0.34 * radius, 0.42 * radius, 11, -0.6, np.pi + 0.6)
    bow = tube([(x, y, neck + 0.05 * radius + z) for y, z in loop], 0.04 * radius, 8)
    fixed = rng.random() < 0.5
    ears = union(cylinder((x, s * 0.08 * radius, neck - 0.08 * radius), (x, s * 0.3 * radius, neck - 0.18 * radius),
                          0.05 * radius, sections=8) for s in (-1.0, 1.0))  # fmt: skip
    clock = Assembly("body", body + bow + ears if fixed else body, 3000.0)
    clock.add("crown", crown, continuous("body", (0, 0, 1), (x, 0, neck)), label="knob")
    front = add_hands(rng, clock, 0.9 * radius, "body")
    if rng.random() < 0.55:
        edge = min(front, 0.0015 - rise) - 0.0004
        lid = rod((edge, edge - 0.12 * radius), 0, 0, half, 0.85 * half, 30)
        left = rng.random() < 0.5
        y = half * (1.0 if left else -1.0)
        clock.add("lid", lid, side_hinge(edge - 0.06 * radius, 1.02 * y, rng.uniform(1.2, 2.2), left))
    return clock
