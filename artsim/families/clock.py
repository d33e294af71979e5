"""Clocks: on a wall, on a mantel, longcase clocks, alarm clocks, cuckoo clocks, pocket watches.

What varies: the kind, the outline of the case (round, square, polygon, arch, house, tambour), the rim, the marks of the
hours, two or three hands of several forms and where they point, a pendulum and its bob, weights on chains, a door
before the pendulum, doors of a cuckoo, a lid, bells with a hammer, knobs, a fork in which the case tilts. Two to eight
parts move. Hands turn freely about the middle of the face, clockwise as seen from the front. The diameter is that of
the face; most other lengths are drawn as shares of it.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.clock_faces import DENSITY, GAP, add_hands, dial_plate, glass_door, outline, pendulum, rim
from artsim.families.details import side_hinge
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, UP, about, arch, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, frame, hull_of, prism, ring, rod, tube, union


def build(draws: Draws) -> Assembly:
    """A clock; its face looks towards -X and the pendulum hangs straight at rest."""
    makers = {"wall": _wall_clock, "pendulum": _pendulum_clock, "mantel": _mantel_clock, "longcase": _longcase_clock,
              "alarm": _alarm_clock, "cuckoo": _cuckoo_clock, "watch": _watch}  # fmt: skip
    return draws.one_of("kind", makers, (0.24, 0.16, 0.16, 0.13, 0.15, 0.08, 0.08))(draws)


def _mantel_clock(draws: Draws) -> Assembly:
    """A case that stands: a block, an arch, a tambour, a house, or a drum on feet."""
    radius = 0.5 * draws.length("diameter", (0.08, 0.2))
    deep = draws.length("depth", (0.7, 1.5), of=radius)
    kind = draws.pick("case", ["block", "arch", "tambour", "house", "drum", "lancet"])
    half = 0.5 * draws.length("case_width", (1.12, 1.5), of=2 * radius)
    low = -draws.length("case_bottom", (1.12, 1.8), of=radius)
    body = dial_plate(draws, radius) + rim(draws, 1.005 * radius, 0.08 * radius, 0.003 + 0.1 * radius)
    around = [*outline("round", half), (-half, low), (half, low)]
    if kind == "drum":
        low = -draws.length("feet_bottom", (1.05, 1.4), of=half)
        body += rod((0.002, deep), 0, 0, half, sections=32)
        for y in (-0.6 * half, 0.6 * half):
            body += box((0.1 * deep, 0.9 * deep), (y - 0.1 * half, y + 0.1 * half), (low, -0.6 * half))
    elif kind in ("tambour", "arch", "lancet"):
        body += prism([*around, (0.0, 1.6 * half)] if kind == "lancet" else around, 0.002, deep, 0)
        if kind == "tambour":
            wide = 0.5 * draws.length("shoulder_width", (1.5, 2.6), of=2 * half)
            shoulder = low + 0.3 * (0.0 - low)
            body += prism([(-wide, low), (wide, low), (0.95 * wide, shoulder), (half, 0.3 * half), (-half, 0.3 * half),
                           (-0.95 * wide, shoulder)], 0.004, deep - 0.002, 0)  # fmt: skip
    else:
        body += box((0.002, deep), half, (low, half))
        if kind == "house":
            ridge = draws.length("ridge_height", (1.3, 1.8), of=half)
            body += prism([(-1.1 * half, half), (1.1 * half, half), (0.0, ridge)], -0.008, deep + 0.008, 0)
        elif draws.chance("cornice", 0.6):
            body += box((-0.012, deep + 0.008), 1.12 * half, (half - 0.001, half + 0.1 * half), fillet=0.004)
        if draws.chance("handle", 0.4) and kind == "block":  # on top
            bow = [(0.5 * deep, y, half * 1.1 - 0.004 + z) for y, z in arch(0.4 * half, 0.35 * half, 8)]
            body += tube(bow, 0.04 * half, 8).called("handle", UP)
    base = 0.5 * draws.length("plinth_width", (1.05, 1.4), of=2 * half) if kind != "tambour" else 2.65 * half
    if kind != "drum" and draws.chance("plinth", 0.75):
        body += box((-0.014, deep + 0.008), base, (low - 0.15 * half, low + 0.002), fillet=0.004)
    clock = Assembly("body", body, DENSITY)
    if kind == "drum" and draws.chance("tilts", 0.4):  # the drum hangs in a fork
        drum = dial_plate(draws, radius) + rod((0.002, deep), 0, 0, half, sections=32)
        drum += rim(draws, 1.005 * radius, 0.08 * radius, 0.003 + 0.1 * radius)
        x, r = 0.5 * deep, 0.08 * half
        arm = half + 0.004 + 2 * r
        clear = half + deep + 0.01
        fork = tube([(x, -arm, 0), (x, -arm, -0.6 * clear), (x, -0.4 * half, -clear), (x, 0.4 * half, -clear),
                     (x, arm, -0.6 * clear), (x, arm, 0)], r, 10)  # fmt: skip
        fork += box((x - 0.8 * half, x + 0.8 * half), 0.9 * half, (-clear - 0.012, -clear + 0.002), fillet=0.005)
        clock = Assembly("body", fork, 1500.0)
        limit = draws.angle("tilt", (0.2, 0.6))
        clock.add("case", drum, revolute("body", SIDE, (x, 0, 0), -limit, limit), density=DENSITY)
        add_hands(draws, clock, 0.95 * radius, "case")
        return clock
    add_hands(draws, clock, 0.95 * radius)
    if draws.chance("knob", 0.45):
        _knobs(draws, clock, deep, 0.35 * radius)
    return clock


def _knobs(draws: Draws, clock: Assembly, x: float, spread: float) -> None:
    """One to three knobs at the back."""
    count = draws.integer("knobs", 1, 3)
    for k in range(count):
        y, z = (k - 0.5 * (count - 1)) * spread, draws.length("knob_height", (-0.6, 0.3), of=spread)
        r = draws.length("knob_radius", (0.6, 1.0), of=0.35 * spread)
        knob = rod((x + GAP, x + GAP + 0.5 * r), y, z, 0.5 * r, sections=10)
        knob += box((x + GAP + 0.4 * r, x + GAP + 1.4 * r), about(y, r), about(z, 0.25 * r), fillet=0.2 * r)
        clock.add(f"knob_{k}" if count > 1 else "knob", knob, continuous("body", (1, 0, 0), (x, y, z)), density=DENSITY)


def _longcase_clock(draws: Draws) -> Assembly:
    """A tall case on the floor: a hood with the face, a trunk with pendulum and weights, a plinth."""
    radius, deep = 0.5 * draws.length("diameter", (0.22, 0.34)), draws.length("depth", (0.18, 0.28))
    hood = 0.5 * draws.length("hood_width", (1.15, 1.45), of=2 * radius)
    trunk = 0.5 * draws.length("trunk_width", (0.65, 0.95), of=2 * hood)
    foot = 0.5 * draws.length("plinth_width", (1.05, 1.4), of=2 * trunk)
    length, plinth = draws.lengths(trunk_height=(0.7, 1.1), plinth_height=(0.25, 0.45))
    low = -hood - draws.length("below_face", (0.0, 0.05))
    bottom = low - length
    body = dial_plate(draws, radius) + box((0.002, deep), hood, (low, hood))
    body += rim(draws, 1.005 * radius, 0.08 * radius, 0.01 + 0.05 * radius)
    crest = draws.pick("crest", ["flat", "gable", "arch", "swan"])
    if crest == "gable":
        ridge = draws.length("ridge_height", (1.3, 1.7), of=hood)
        body += prism([(-1.1 * hood, hood), (1.1 * hood, hood), (0, ridge)], -0.02, deep, 0)
    elif crest == "arch":
        body += prism(outline("round", hood).clip((-hood, 0), (hood, hood)) + (0, hood - 0.01), -0.01, deep, 0)
    elif crest == "swan":
        for s in (-1.0, 1.0):
            horn = ((1.08 * hood, hood - 0.001), (0.2 * hood, hood - 0.001), (0.2 * hood, 1.45 * hood))
            body += prism([(s * y, z) for y, z in (*horn, (0.4 * hood, 1.5 * hood))], 0.0, 0.3 * deep, 0)
    body += box((-0.02, deep), 1.1 * hood, (hood - 0.02, hood + 0.02), fillet=0.01)
    if draws.chance("columns", 0.5):
        body += union(rod(-0.02, s * hood, (low, hood - 0.02), 0.012, sections=12) for s in (-1.0, 1.0))
    body += box((-0.02, deep), 1.05 * hood, (low - 0.03, low + 0.002))
    body += frame((0.01, -trunk, bottom), (deep, trunk, low - 0.028), [0.02] * 4)
    body += box((deep - 0.012, deep), trunk - 0.01, (bottom + 0.01, low - 0.03))
    body += box((-0.02, deep), foot, (bottom - plinth, bottom + 0.005), fillet=0.006)
    if draws.chance("plinth_step", 0.6):
        body += box((-0.035, deep), 1.1 * foot, (bottom - plinth, bottom - 0.75 * plinth), fillet=0.006)
    top = low - 0.05
    body += box((0.5 * deep, deep - 0.005), 0.006, (top + 0.002, top + 0.004))
    clock = Assembly("body", body, DENSITY)
    add_hands(draws, clock, 0.95 * radius)
    long = draws.length("pendulum_length", (0.65, 0.9), of=top - bottom) - 0.02
    clock.add("pendulum", *pendulum(draws, 0.6 * deep, top, long, trunk - 0.025), density=2000.0)
    if draws.chance("door", 0.75):
        glass_door(draws, clock, 0.01, (-trunk + 0.004, trunk - 0.004), (bottom + 0.008, low - 0.034))
    return clock


def _alarm_clock(draws: Draws) -> Assembly:
    """A drum on feet with two bells, or a small case with a button."""
    radius = 0.5 * draws.length("diameter", (0.05, 0.12))
    deep = draws.length("depth", (0.6, 1.3), of=radius)
    half = 0.5 * draws.length("case_width", (1.08, 1.25), of=2 * radius)
    body = dial_plate(draws, radius) + rim(draws, 1.005 * radius, 0.06 * radius, 0.003 + 0.12 * radius)
    if draws.chance("bells", 0.65):
        return _twin_bell_clock(draws, body, radius, deep, half)
    edge = 0.5 * draws.length("case_height", (0.9, 1.3), of=2 * half)
    kind = draws.pick("case", ["square", "wedge", "drum"])
    if kind == "drum":
        body += rod((0.002, deep), 0, 0, half, sections=32)
        body += box((0.1 * deep, 0.9 * deep), 0.7 * half, (-1.08 * half, -0.5 * half))
        top = half * cos(np.pi / 32)
    else:
        body += box((0.002, deep), half, edge, fillet=draws.length("case_corner", (0.05, 0.4), of=half), axis=0)
        if kind == "wedge":
            slope = [(deep - 0.004, -edge), (deep * 1.9, -edge), (deep - 0.004, 0.6 * edge)]
            body += prism(slope, -0.8 * half, 0.8 * half, 1)
        top = edge
    wide = 0.5 * draws.length("button_width", (0.2, 0.55), of=2 * half)
    body += box((0.3 * deep, 0.7 * deep), 0.7 * wide, (0.9 * top, top + 0.0005))
    clock = Assembly("body", body, DENSITY)
    add_hands(draws, clock, 0.95 * radius)
    button = box((0.2 * deep, 0.8 * deep), wide, (top + 0.004, top + 0.01), fillet=0.003)
    clock.add("button", button, prismatic("body", (0, 0, -1), 0.0, 0.003, (0.5 * deep, 0, top)), density=DENSITY)
    if kind != "wedge":
        _knobs(draws, clock, deep, 0.3 * radius)
    return clock


def _twin_bell_clock(draws: Draws, body: Solid, radius: float, deep: float, half: float) -> Assembly:
    """A drum on two feet, two bells on its top and a hammer between them; ``body`` is its face."""
    middle = np.array([0.5 * deep, 0.0, 0.0])
    body += rod((0.002, deep), 0, 0, half, sections=32)
    spread = draws.angle("bell_angle", (0.5, 0.75))
    r = 0.07 * radius
    size = draws.length("bell_radius", (0.38, 0.55), of=radius)
    for s in (-1.0, 1.0):
        out = np.array([0.0, s * sin(spread), -cos(spread)])
        foot = middle + 0.9 * half * out
        body += tube([foot, foot + 0.5 * half * out], [1.6 * r, r], 10) + ellipsoid(foot + 0.5 * half * out, 1.3 * r, 8)
        up = np.array([0.0, s * sin(spread), cos(spread)])
        seat = middle + half * up
        body += cylinder(seat - 0.1 * half * up, seat + 0.25 * size * up, 0.8 * r, sections=10)
        bell = seat + 0.2 * size * up
        levels = ((0.0, 1.0), (0.35, 0.92), (0.65, 0.66), (0.8, 0.2))
        body += hull_of(*(cylinder(bell + h * size * up, bell + (h * size + 1e-4) * up, w * size, sections=18)
                          for h, w in levels))  # fmt: skip
    if draws.chance("handle", 0.6):
        span, lean = half * sin(spread) + 0.5 * size, half * cos(spread) + size
        bow = [(0.5 * deep, y, lean + 0.2 * size + z) for y, z in arch(span, 0.9 * size, 8)]
        body += tube(bow, r, 8).called("handle", UP)
    clock = Assembly("body", body, 1500.0)
    add_hands(draws, clock, 0.95 * radius)
    room = half * sin(spread) - size * cos(spread)
    if room > 0.12 * radius:
        x, z = 0.5 * deep, half + 0.006
        tip = max(half * cos(spread) + 0.35 * size, z + 0.25 * size)
        head = min(0.35 * room, 0.1 * radius)
        hammer = rod(x, 0, (z, tip), 0.5 * head, sections=8) + rod(x, (-0.8 * head, 0.8 * head), tip, head, sections=10)
        limit = max(0.3 * (room - head) / (tip - z), 0.02)
        clock.add("hammer", hammer, revolute("body", FRONT, (x, 0, z), -limit, limit), density=3000.0)
    _knobs(draws, clock, deep, 0.5 * radius)
    return clock


def _watch(draws: Draws) -> Assembly:
    """A pocket watch that stands upright: a flat drum with a crown, a bow, and by chance a lid."""
    radius = 0.5 * draws.length("diameter", (0.032, 0.056))
    deep = draws.length("depth", (0.25, 0.55), of=radius)
    half = 0.5 * draws.length("case_width", (1.06, 1.18), of=2 * radius)
    rise = 0.16 * radius
    body = dial_plate(draws, radius) + rod((0.0015, 0.5 * deep), 0, 0, half, sections=30)
    body += rod((0.5 * deep - 1e-4, deep), 0, 0, half, 0.8 * half, 30)
    body += ring((0.0015 - 0.5 * rise, 0, 0), FRONT, 1.005 * radius, half, rise, 28)
    x, neck = 0.3 * deep, half + 0.12 * radius
    body += rod(x, 0, (0.95 * half, neck), 0.1 * radius, sections=12)
    crown = rod(x, 0, (neck + 0.0004, neck + 0.22 * radius), 0.14 * radius, sections=14)
    if draws.chance("bow", 0.5):  # to hang it by
        loop = arch(0.34 * radius, 0.42 * radius, 11, -0.6, np.pi + 0.6)
        body += tube([(x, y, neck + 0.05 * radius + z) for y, z in loop], 0.04 * radius, 8)
        for s in (-1.0, 1.0):
            ear = (x, s * 0.3 * radius, neck - 0.18 * radius)
            body += cylinder((x, s * 0.08 * radius, neck - 0.08 * radius), ear, 0.05 * radius, sections=8)
    clock = Assembly("body", body, 3000.0)
    clock.add("crown", crown, continuous("body", UP, (x, 0, neck)), label="knob")
    front = add_hands(draws, clock, 0.9 * radius)
    if draws.chance("lid", 0.55):
        edge = min(front, 0.0015 - rise) - 0.0004
        lid = rod((edge, edge - 0.12 * radius), 0, 0, half, 0.85 * half, 30)
        left = draws.chance("lid_hinged_left", 0.5)
        y = half * (1.0 if left else -1.0)
        clock.add("lid", lid, side_hinge(edge - 0.06 * radius, 1.02 * y, draws.angle("lid_angle", (1.2, 2.2)), left))
    return clock


def _wall_clock(draws: Draws) -> Assembly:
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


def _pendulum_clock(draws: Draws) -> Assembly:
    """A case on the wall with a box below, in which a pendulum hangs; or the pendulum hangs free."""
    radius, deep = 0.5 * draws.length("diameter", (0.12, 0.28)), draws.length("depth", (0.05, 0.11))
    kind = draws.pick("case", ["round", "octagon", "square", "house", "arch"])
    half = 0.5 * draws.length("case_width", (1.1, 1.35), of=2 * radius)
    body = dial_plate(draws, radius) + rim(draws, 1.005 * radius, 0.06 * radius, 0.003 + 0.1 * radius)
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


def _cuckoo_clock(draws: Draws) -> Assembly:
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
