"""Dispensers: pumps for soap and lotion, soap boxes on a wall, drink dispensers with a tap, water coolers.

What varies: the kind; the bottle's outline from above and from the side; a pump's head, its nozzle and stroke, whether
its collar turns; one to three pumps on a tray; a lever, a push bar or a button of a soap box, and its cover, which
swings up or down; a jar with a lid that lifts or swings, one or two taps with levers or wings, a stand; a cooler with
its bottle, levers or buttons, and a door below. One to six parts move.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import front_handle, rounded_tray, side_hinge
from artsim.families.vessels import GAP, Level, cap, cross_section, dome, moulded, neck, pump_head, ribs
from artsim.making.assembly import Assembly, JointSpec, Rng, continuous, pick, prismatic, revolute, screw
from artsim.making.outlines import UP, about, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull_of, ring, rod, tube, union
from artsim.model.kinematics import Array

DENSITY = 400.0  # kg/m^3, as the pieces are solid and real ones are hollow
CLEAR = 0.0015


def build(rng: Rng) -> Assembly:
    """A dispenser, shut at rest; it gives towards -X."""
    return pick(rng, {_pump_bottle: 0.5, _soap_box: 0.18, _drink_jar: 0.2, _water_cooler: 0.12})(rng)


# --- pumps -----------------------------------------------------------------------------------------------------------


def _pump_bottle(rng: Rng) -> Assembly:
    """One bottle with a pump, or two or three alike side by side."""
    count = pick(rng, {1: 0.78, 2: 0.15, 3: 0.07})
    half, depth, height = rng.uniform(0.025, 0.06), rng.uniform(0.025, 0.06), rng.uniform(0.06, 0.24)
    shape = pick(rng, ["round", "round", "square", "square", "octagon", "hexagon", "flask"])
    if shape != "flask" and rng.random() < 0.6:
        depth = half
    outline = cross_section(shape, rng.uniform(0.0, 1.0))
    radius = min(half, depth) * rng.uniform(0.25, 0.5)
    rim = height + rng.uniform(0.016, 0.03)
    one = moulded(_bottle_levels(rng, depth, half, height, radius), outline)
    one += neck(radius, 0.75 * radius, height - 0.0005, rim)
    spacing = 2.0 * half * rng.uniform(1.04, 1.2) + 0.002
    places = [(k - 0.5 * (count - 1)) * spacing for k in range(count)]
    body = union(one.moved((0, y, 0)) for y in places)
    if count > 1 or rng.random() < 0.12:
        wide = half + places[-1] + 0.006
        body += box(depth + 0.006, wide, (-0.006, 0.004), fillet=0.006, axis=2)
        body += box((0.55 * depth, depth + 0.006), wide, (0, height * rng.uniform(0.3, 0.8)), fillet=0.004)
    wall = max(0.14 * radius, 0.0016)
    outer = 1.02 * radius + GAP + wall
    low, high = height + GAP, rim + GAP + wall
    stem = min(radius * rng.uniform(0.25, 0.4), 0.006)
    stroke = (rim - height) * rng.uniform(0.4, 0.75)
    turret = outer * rng.choice([0.0, rng.uniform(0.3, 1.2)])
    size = outer * rng.uniform(0.6, 1.25)
    reach = max(rng.uniform(0.9, 2.2) * max(depth, outer), 1.3 * size)
    head = high + turret + stroke + 0.0015 + (0.25 * reach if turret < 0.5 * reach else 0.0)
    collar = cap(outer * rng.uniform(1.0, 1.15), wall, low, high, stem + GAP, outer)
    if turret > 0:
        collar += ring((0, 0, high + 0.5 * turret - 0.0005), UP, stem + GAP, outer * rng.uniform(0.4, 0.75), turret, 16)
    if count == 1 and rng.random() < 0.5:
        collar += ribs(outer, low + 0.002, high - 0.002, int(rng.integers(10, 20)), 0.07 * outer)
    pump = pump_head(rng, head, stem, size, reach, head - high + 0.004)
    turning = pick(rng, {"screw": 0.3, "turn": 0.4, "fixed": 0.3})
    if turning == "fixed":
        body += union(collar.moved((0, y, 0)) + rod(0, y, (low - GAP, low + wall), 0.99 * outer) for y in places)
    dispenser = Assembly("body", body, DENSITY)
    for number, y in enumerate(places):
        parent, tail = "body", f"_{number}" if count > 1 else ""
        at = np.array([0.0, y, rim])
        if turning != "fixed":
            parent = f"collar{tail}"
            turns = 2.0 * np.pi * rng.uniform(0.5, 2.5)
            free = count == 1 and turning == "screw"
            turn = screw("body", UP, at, 0.0, turns, (rim - height) / turns) if free else continuous("body", UP, at)
            if count > 1:
                # Neighbours' nozzles may not meet: they turn a little only.
                limit = min(0.8, 0.3 * spacing / reach)
                turn = revolute("body", UP, at, -limit, limit)
            dispenser.add(parent, collar.moved((0, y, 0)), turn)
        dispenser.add(f"pump{tail}", pump.moved((0, y, 0)), prismatic(parent, -UP, 0.0, stroke, (0, y, head)))
    return dispenser


def _bottle_levels(rng: Rng, depth: float, half: float, height: float, radius: float) -> list[Level]:
    """From the foot to the shoulder, where a round neck follows."""
    kind = pick(rng, ["straight", "cone", "belly", "waist", "foam", "step"])
    edge = rng.uniform(0.6, 0.95)
    shares = {
        "straight": [(0.0, 0.96), (0.03, 1.0), (0.9, 1.0), (0.97, edge)],
        "cone": [(0.0, 1.0), (0.03, 1.0), (0.93, rng.uniform(0.5, 0.9)), (0.97, 0.5)],
        "belly": [(0.0, 0.7), (0.2, 0.93), (0.45, 1.0), (0.7, 0.9), (0.88, 0.66), (0.96, 0.5)],
        "waist": [(0.0, 1.0), (0.05, 1.0), (0.45, rng.uniform(0.6, 0.85)), (0.85, 0.95), (0.96, 0.6)],
        "foam": [(0.0, 0.85), (0.04, 0.9), (0.6, 0.95), (0.85, 1.0), (0.95, 0.95)],
        "step": [(0.0, 1.0), (0.4, 1.0), (0.44, 0.8), (0.9, 0.78), (0.97, 0.6)],
    }[kind]
    levels = [(z * height, s * depth, s * half, 0.0) for z, s in shares]
    return [*levels, (height, 1.1 * radius, 1.1 * radius, 1.0)]


# --- a soap box on a wall -------------------------------------------------------------------------------------------


def _soap_box(rng: Rng) -> Assembly:
    """A box with a cover in front, and a lever, a push bar or buttons below it."""
    depth, half, height = rng.uniform(0.07, 0.13), rng.uniform(0.05, 0.11), rng.uniform(0.14, 0.32)
    radius = rng.uniform(0.005, 0.03)
    low = height * rng.uniform(0.22, 0.35)  # where the cover begins
    thick = depth * rng.uniform(0.2, 0.7)
    front = -thick - CLEAR  # of the body behind the cover
    body = box((front, depth - thick), half, (low, height), fillet=radius, axis=0)
    body += box((front - 0.004, depth - thick), 0.8 * half, (0.3 * low, low), fillet=0.006)
    body += box((front * 0.5, depth - thick - 0.01), 0.6 * half, (low - 0.006, low + 0.03))
    nozzle = front * 0.4
    body += rod(nozzle, 0, (0.3 * low, 0.12 * low), 0.008, 0.006, 14)
    face = front - CLEAR
    cover = rounded_tray((face - thick, -half, low + 0.002 + CLEAR), (face, half, height), 0.003, radius,
                         ((0.0, rng.uniform(0.0, 0.25) * half), (0.35, 0.0), (1.0, 0.0)), axis=0, side=1)  # fmt: skip
    if rng.random() < 0.5:  # a window that shows how much is left
        upright = (low + 0.3 * (height - low), low + 0.8 * (height - low))
        cover += box((face - thick - 0.0015, face - thick + 0.002), 0.2 * half, upright, fillet=0.003, axis=0)
    dispenser = Assembly("body", body, DENSITY)
    style = pick(rng, ["bar", "lever", "button", "twin", "sensor"])
    if style == "sensor":  # nothing to press, and the cover swings down
        down_at = (face - 0.005, 0.0, low + 0.001)  # before the foot of the box
        dispenser.add("lid", cover, revolute("body", (0, -1, 0), down_at, 0.0, rng.uniform(0.6, 1.5)))
        return dispenser
    dispenser.add("lid", cover, revolute("body", (0, 1, 0), (face, 0, height), 0.0, rng.uniform(0.6, 1.6)))
    room = face - thick
    if style == "lever":  # an elbow lever below, to press back
        pivot = (front - 0.004 - CLEAR - 0.004, 0.0, 0.65 * low)
        reach = rng.uniform(0.04, 0.16)
        r = 0.004
        path = [(pivot[0], 0, pivot[2]), (pivot[0] - 0.3 * reach, 0, pivot[2] - 0.02),
                (pivot[0] - reach, 0, pivot[2] - 0.03 - 0.3 * reach)]  # fmt: skip
        wide = 0.5 * half
        solid = tube([path[0], path[1]], r, 10) + hull_of(
            *(box((x - 0.003, -w, z - 0.003), (x + 0.003, w, z + 0.003), fillet=0.002)
              for (x, _, z), w in ((path[1], 0.006), (path[2], wide)))
        )  # fmt: skip
        solid += rod(pivot[0], (-0.4 * wide, 0.4 * wide), pivot[2], r, sections=12)
        dispenser.add("lever", solid, revolute("body", (0, -1, 0), pivot, 0.0, rng.uniform(0.1, 0.3)))
        return dispenser
    wide = half * rng.uniform(0.5, 0.78)
    back = front - 0.004 - 0.012
    tip = min(room, back - 0.01) * rng.uniform(0.8, 1.05)
    tip = min(tip, back - 0.008)
    top = low - 0.001
    bottom = 0.35 * low
    if style == "bar":
        solid = box((tip, back), wide, (bottom, top), fillet=0.005)
        dispenser.add("bar", solid, prismatic("body", (1, 0, 0), 0.0, 0.01, (back, 0, bottom)))
        return dispenser
    spots = [0.0] if style == "button" else [-0.4 * half, 0.4 * half]
    r = min(0.45 * (top - bottom), 0.3 * half)
    for number, y in enumerate(spots):
        z = 0.5 * (top + bottom)
        solid = rod((back, back - 0.012), y, z, r) + rod((back - 0.011, back - 0.016), y, z, 0.95 * r, 0.6 * r)
        name = f"button_{number}" if len(spots) > 1 else "button"
        dispenser.add(name, solid, prismatic("body", (1, 0, 0), 0.0, 0.01, (back, y, z)))
    return dispenser


# --- a jar with taps -------------------------------------------------------------------------------------------------


def _drink_jar(rng: Rng) -> Assembly:
    """A jar or an urn with taps near its foot, on a stand or on feet."""
    half, height = rng.uniform(0.08, 0.15), rng.uniform(0.18, 0.42)
    foot = rng.uniform(0.06, 0.2)
    shape = pick(rng, ["round", "round", "round", "square", "octagon", "hexagon"])
    outline = cross_section(shape, rng.uniform(0.0, 1.0))
    mouth = rng.uniform(0.55, 0.95)
    kind = pick(rng, ["drum", "urn", "keg"])
    shares = {
        "drum": [(0.0, 0.95), (0.03, 1.0), (0.9, 1.0), (1.0, mouth)],
        "urn": [(0.0, 0.6), (0.15, 0.8), (0.5, 1.0), (0.8, 0.97), (1.0, mouth)],
        "keg": [(0.0, 0.8), (0.2, 0.94), (0.5, 1.0), (0.8, 0.94), (1.0, 0.78)],
    }[kind]
    mouth = shares[-1][1]
    levels: list[Level] = [(foot + z * height, s * half, s * half, 1.0 if z == 1.0 else 0.0) for z, s in shares]
    body = moulded(levels, outline)
    body += _stand(rng, shares[0][1] * half, foot)
    top = foot + height
    z = foot + height * rng.uniform(0.08, 0.16)
    wide = float(np.interp(z, [v[0] for v in levels], [v[1] for v in levels]))
    count = pick(rng, {1: 0.8, 2: 0.2})
    spots = [0.0] if count == 1 else [-0.33 * wide, 0.33 * wide]
    r = rng.uniform(0.008, 0.012)
    reach = rng.uniform(0.03, 0.06) + r
    out = -wide - reach
    rise = r * rng.uniform(1.3, 2.0)
    for y in spots:
        body += rod((-0.4 * wide, out), y, z, r, sections=16)
        body += rod(out, y, (z - 0.035, z + rise), 1.15 * r, sections=16)
        body += ring((-0.985 * wide, y, z), (1, 0, 0), 0.5 * r, 1.9 * r, 0.01, 16)
    radius = mouth * half
    lid = rod(0, 0, (top + CLEAR, top + CLEAR + 0.012), radius * rng.uniform(0.95, 1.05), 0.93 * radius)
    lid += dome(0.9 * radius, top + CLEAR + 0.0115, radius * rng.uniform(0.05, 0.45))
    crown = float(lid.bounds()[1, 2])
    size = radius * rng.uniform(0.12, 0.2)
    lid += rod(0, 0, (crown - 0.004, crown + 0.6 * size), 0.5 * size) + ellipsoid((0, 0, crown + size), size, 12)
    hinged = rng.random() < 0.3
    if hinged:
        x, w = 1.05 * radius + 0.006, 0.3 * radius
        lid += rod(x, (-w, w), top + CLEAR + 0.004, 0.004, sections=12)
        lid += box((0.8 * radius, x), w, (top + CLEAR, top + CLEAR + 0.004))
    dispenser = Assembly("body", body, DENSITY)
    if hinged:
        joint = revolute("body", (0, 1, 0), (x, 0, top + CLEAR + 0.004), 0.0, rng.uniform(0.8, 1.55))
    elif rng.random() < 0.3:
        turns = 2.0 * np.pi * rng.uniform(0.3, 2.0)
        joint = screw("body", UP, (0, 0, top), 0.0, turns, rng.uniform(0.008, 0.03) / turns)
    else:
        joint = prismatic("body", UP, 0.0, radius * rng.uniform(0.3, 1.2), (0, 0, top))
    dispenser.add("lid", lid, joint)
    style = pick(rng, ["lever", "wing", "flip"])
    long = rng.uniform(0.03, 0.06)
    for number, y in enumerate(spots):
        at = np.array([out, y, z + rise + 0.001])
        solid, joint = _tap_handle(style, at, r, min(long, 0.28 * wide if count > 1 else long), rng)
        dispenser.add(f"tap_{number}" if count > 1 else "tap", solid, joint, label="lever")
    return dispenser


def _tap_handle(style: str, at: Array, r: float, long: float, rng: Rng) -> tuple[Solid, JointSpec]:
    """What opens a tap: a lever that turns about the upright, a wing, or a lever that is pulled towards the front."""
    if style == "flip":
        pivot = at + (0, 0, 1.1 * r)
        solid = cylinder(pivot - (0, 1.1 * r, 0), pivot + (0, 1.1 * r, 0), r, sections=14)
        solid += tube([pivot, pivot + (-0.15 * long, 0, long)], [0.5 * r, 0.75 * r], 10)
        return solid, revolute("body", (0, -1, 0), pivot, 0.0, rng.uniform(0.5, 1.3))
    solid = cylinder(at, at + (0, 0, 1.2 * r), 1.1 * r, r, 14)
    level = at + (0, 0, 0.8 * r)
    if style == "wing":
        span = min(long, 2.0 * r)
        solid += hull_of(*(ellipsoid(level + (0, s * span, 0.4 * r), (0.4 * r, 0.3 * r, 0.7 * r), 8) for s in (-1, 1)))
        return solid, revolute("body", UP, at, 0.0, 0.5 * np.pi)
    solid += tube([level, level + (-long, 0, 0.3 * long)], [0.5 * r, 0.7 * r], 10)
    limit = rng.uniform(0.8, 1.57)
    return solid, revolute("body", UP, at, -limit if rng.random() < 0.4 else 0.0, limit)


def _stand(rng: Rng, wide: float, foot: float) -> Solid:
    """Legs with a ring, a pedestal, or a plinth."""
    kind = pick(rng, ["legs", "pedestal", "plinth"])
    if kind == "plinth":
        return rod(0, 0, (0, foot + 0.002), wide * rng.uniform(0.9, 1.05), 0.9 * wide)
    if kind == "pedestal":
        stem = rod(0, 0, (0.01, foot + 0.002), 0.3 * wide, 0.6 * wide)
        return stem + rod(0, 0, (0, 0.015), wide, 0.85 * wide)
    solid = ring((0, 0, foot - 0.006), UP, 0.75 * wide, 1.0 * wide, 0.016, 20)
    count = int(rng.integers(3, 5))
    spread = rng.uniform(0.9, 1.25)
    for a in turns(count, 0.5):
        x, y = cos(a) * wide, sin(a) * wide
        solid += tube([(0.88 * x, 0.88 * y, foot - 0.004), (spread * x, spread * y, 0.004)], 0.006, 8)
    return solid


# --- a water cooler --------------------------------------------------------------------------------------------------


def _water_cooler(rng: Rng) -> Assembly:
    """A cabinet with a bottle on top, levers or buttons over a drip tray, and sometimes a door below."""
    depth, half = rng.uniform(0.14, 0.2), rng.uniform(0.13, 0.2)
    tall = rng.random() < 0.7
    height = rng.uniform(0.75, 1.05) if tall else rng.uniform(0.32, 0.48)
    shelf = height - rng.uniform(0.28, 0.34) if tall else rng.uniform(0.03, 0.06)
    roof = height - rng.uniform(0.05, 0.09)
    niche = -depth + rng.uniform(0.08, 0.13)
    cooler = Assembly("body", density=250.0)
    body = box((niche, depth), half, (shelf - 0.01, roof + 0.01))
    body += box(depth, half, (roof, height), fillet=rng.uniform(0.01, 0.05), axis=2)
    for s in (-1.0, 1.0):
        body += box((-depth + 0.01, depth), (s * half, s * (half - 0.012)), (shelf - 0.01, roof + 0.01))
    door = tall and rng.random() < 0.7
    inset = 0.03 if door else 0.0
    if shelf > 0.1:
        body += box((-depth + inset, depth), half, (0.0, shelf))
        body += box(depth, half, (shelf - 0.03, shelf))
    else:
        body += box(depth, half, (0.0, shelf), fillet=0.02, axis=2)
    body += box((-depth - 0.02, niche + 0.01), 0.6 * half, (shelf - 0.015, shelf + 0.008), fillet=0.006)
    count = pick(rng, {2: 0.75, 3: 0.25})
    spots = (np.linspace(-1.0, 1.0, count) * 0.4 * half).tolist()
    style = pick(rng, ["lever", "button", "tap"])
    z = roof - (0.075 if style == "tap" else 0.02)
    for number, y in enumerate(spots):
        nose = niche - 0.045
        body += rod((niche + 0.005, nose), y, z, 0.01, sections=14)
        body += rod(nose, y, (z + 0.01, z - 0.03), 0.009, sections=14)
        if style == "lever":  # a paddle below the tap, which the cup pushes back
            pivot = (niche - 0.012, y, z - 0.04)
            tap = box((pivot[0] - 0.003, pivot[0] + 0.003), (y - 0.02, y + 0.02), (z - 0.11, z - 0.045))
            tap += rod(pivot[0], (y - 0.012, y + 0.012), pivot[2], 0.006, sections=12)
            joint = revolute("body", (0, -1, 0), pivot, 0.0, 0.09)
        elif style == "tap":
            tap, joint = _tap_handle("flip", np.array([nose, y, z + 0.011]), 0.009, 0.03, rng)
        else:
            face = -depth - 0.001
            middle = 0.5 * (roof + height)
            size = min(0.3 * (height - roof), 0.02)
            tap = box((face - 0.008, face - 0.003), about(y, 1.3 * size), about(middle, size), fillet=0.003, axis=0)
            joint = prismatic("body", (1, 0, 0), 0.0, 0.002, (face, y, middle))
        cooler.add(f"{style}_{number}", tap, joint, label="button" if style == "button" else "lever", density=900.0)
    cooler.body = body
    if rng.random() < 0.75:
        _big_bottle(rng, cooler, height, min(depth, half))
    if door:
        face, thick = -depth + inset - 0.002, inset - 0.002
        left = rng.random() < 0.5
        panel = box((face - thick, face), half - 0.004, (0.03, shelf - 0.033), fillet=0.004)
        y = (half if left else -half) * 0.6 * -1.0
        panel += front_handle(pick(rng, ["bar", "bow", "flat"]), (face - thick, y, 0.5 * shelf),
                              (face - thick, y, 0.8 * shelf), 0.025, 0.005)  # fmt: skip
        edge = (half - 0.004) * (1.0 if left else -1.0)
        cooler.add("door", panel, side_hinge(face - thick, edge, rng.uniform(1.2, 1.9), left), density=300.0)
    return cooler


def _big_bottle(rng: Rng, cooler: Assembly, z: float, room: float) -> None:
    """A bottle upside down, which lifts out."""
    radius, height = room * rng.uniform(0.72, 0.95), rng.uniform(0.28, 0.42)
    z += CLEAR
    levels = [(0.0, 0.35), (0.05, 0.4), (0.18, 1.0), (0.4, 1.0), (0.44, 0.95), (0.48, 1.0), (0.7, 1.0), (0.74, 0.95),
              (0.78, 1.0), (0.96, 1.0), (1.0, 0.9)]  # fmt: skip
    solid = moulded([(z + h * height, s * radius, s * radius, 0.0) for h, s in levels], cross_section("round"))
    lift = prismatic("body", UP, 0.0, rng.uniform(0.1, 0.4), (0, 0, z))
    cooler.add("bottle", solid, lift if rng.random() < 0.7 else continuous("body", UP, (0, 0, z)), density=DENSITY)
