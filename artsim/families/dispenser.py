"""Dispensers: pumps for soap and lotion, soap boxes on a wall, drink dispensers with a tap, water coolers.

What varies: bottle, pump head and collar, one to three pumps on a tray; lever, bar or buttons of a soap box and its
cover; lid, taps and stand of a jar; bottle, taps and door of a cooler. One to six parts move.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import front_handle, rounded_tray, side_hinge
from artsim.families.vessels import GAP, Level, cap, cross_section, dome, moulded, neck, pump_head, ribs
from artsim.making.assembly import Assembly, JointSpec, continuous, prismatic, revolute, screw, swivel
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, UP, Array, about, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull_of, ring, rod, tube, union

DENSITY = 400.0  # kg/m^3, as the pieces are solid and real ones are hollow
CLEAR = 0.0015


def build(draws: Draws) -> Assembly:
    """A dispenser, shut at rest; it gives towards -X."""
    kinds = {"pump": _pump_bottle, "soap_box": _soap_box, "drink_jar": _drink_jar, "water_cooler": _water_cooler}
    return draws.one_of("kind", kinds, (0.5, 0.18, 0.2, 0.12))(draws)


def _pump_bottle(draws: Draws) -> Assembly:
    """One bottle with a pump, or two or three alike side by side."""
    count = draws.pick("pumps", {1: 0.78, 2: 0.15, 3: 0.07})
    half, depth = 0.5 * draws.length("width", (0.05, 0.12)), 0.5 * draws.length("depth", (0.05, 0.12))
    height = draws.length("height", (0.06, 0.24))
    shape = draws.pick("outline", ["round", "round", "square", "square", "octagon", "hexagon", "flask"])
    depth = half if shape != "flask" and draws.chance("depth_as_width", 0.6) else depth
    outline = cross_section(shape, draws.number("sharpness", (0.0, 1.0)))
    radius = min(half, depth) * draws.number("neck_radius", (0.25, 0.5))
    rim = height + draws.length("neck_height", (0.016, 0.03))
    one = moulded(_bottle_levels(draws, depth, half, height, radius), outline)
    one += neck(radius, 0.75 * radius, height - 0.0005, rim)
    spacing = 2.0 * half * draws.number("spacing", (1.04, 1.2)) + 0.002
    places = [(k - 0.5 * (count - 1)) * spacing for k in range(count)]
    body = union(one.moved((0, y, 0)) for y in places)
    if count > 1 or draws.chance("tray", 0.12):
        wide = half + places[-1] + 0.006
        body += box(depth + 0.006, wide, (-0.006, 0.004), fillet=0.006, axis=2)
        rise = height * draws.number("tray_back", (0.3, 0.8))
        body += box((0.55 * depth, depth + 0.006), wide, (0, rise), fillet=0.004)
    wall = max(0.14 * radius, 0.0016)
    outer = 1.02 * radius + GAP + wall
    low, high = height + GAP, rim + GAP + wall
    stem = min(radius * draws.number("stem_radius", (0.25, 0.4)), 0.006)
    stroke = (rim - height) * draws.number("stroke", (0.4, 0.75))
    turret = outer * draws.one_of("collar_shape", {"plain": 0.0, "turret": draws.number("turret_height", (0.3, 1.2))})
    size = outer * draws.number("head_radius", (0.6, 1.25))
    reach = max(draws.number("nozzle_reach", (0.9, 2.2)) * max(depth, outer), 1.3 * size)
    head = high + turret + stroke + 0.0015 + (0.25 * reach if turret < 0.5 * reach else 0.0)
    collar = cap(outer * draws.number("collar_flare", (1.0, 1.15)), wall, low, high, stem + GAP, outer)
    if turret > 0:
        wide = outer * draws.number("turret_radius", (0.4, 0.75))
        collar += ring((0, 0, high + 0.5 * turret - 0.0005), UP, stem + GAP, wide, turret, 16)
    if count == 1 and draws.chance("ribs", 0.5):
        collar += ribs(outer, low + 0.002, high - 0.002, draws.integer("rib_count", 10, 19), 0.07 * outer)
    pump = pump_head(draws.within("pump"), head, stem, size, reach, head - high + 0.004)
    turning = draws.pick("collar_joint", {"screw": 0.3, "turn": 0.4, "fixed": 0.3})
    if turning == "fixed":
        body += union(collar.moved((0, y, 0)) + rod(0, y, (low - GAP, low + wall), 0.99 * outer) for y in places)
    dispenser = Assembly("body", body, DENSITY)
    for number, y in enumerate(places):
        parent, tail = "body", f"_{number}" if count > 1 else ""
        at = np.array([0.0, y, rim])
        if turning != "fixed":
            parent = f"collar{tail}"
            angle = 2.0 * np.pi * draws.number("collar_turns", (0.5, 2.5))
            # Neighbours' nozzles may not meet: they turn a little only.
            turn = swivel("body", UP, at, min(0.8, 0.3 * spacing / reach) if count > 1 else None)
            if count == 1 and turning == "screw":
                turn = screw("body", UP, at, 0.0, angle, (rim - height) / angle)
            dispenser.add(parent, collar.moved((0, y, 0)), turn)
        dispenser.add(f"pump{tail}", pump.moved((0, y, 0)), prismatic(parent, -UP, 0.0, stroke, (0, y, head)))
    return dispenser


def _bottle_levels(draws: Draws, depth: float, half: float, height: float, radius: float) -> list[Level]:
    """From the foot to the shoulder, where a round neck follows."""
    kind = draws.pick("bottle_shape", ["straight", "cone", "belly", "waist", "foam", "step"])
    edge = draws.number("shoulder_width", (0.6, 0.95))
    cone, waist = draws.number("cone_top", (0.5, 0.9)), draws.number("waist", (0.6, 0.85))
    shares = {
        "straight": [(0.0, 0.96), (0.03, 1.0), (0.9, 1.0), (0.97, edge)],
        "cone": [(0.0, 1.0), (0.03, 1.0), (0.93, cone), (0.97, 0.5)],
        "belly": [(0.0, 0.7), (0.2, 0.93), (0.45, 1.0), (0.7, 0.9), (0.88, 0.66), (0.96, 0.5)],
        "waist": [(0.0, 1.0), (0.05, 1.0), (0.45, waist), (0.85, 0.95), (0.96, 0.6)],
        "foam": [(0.0, 0.85), (0.04, 0.9), (0.6, 0.95), (0.85, 1.0), (0.95, 0.95)],
        "step": [(0.0, 1.0), (0.4, 1.0), (0.44, 0.8), (0.9, 0.78), (0.97, 0.6)],
    }[kind]
    levels = [(z * height, s * depth, s * half, 0.0) for z, s in shares]
    return [*levels, (height, 1.1 * radius, 1.1 * radius, 1.0)]


def _soap_box(draws: Draws) -> Assembly:
    """A box with a cover in front, and a lever, a push bar or buttons below it."""
    depth, half = draws.length("depth", (0.07, 0.13)), 0.5 * draws.length("width", (0.1, 0.22))
    height, radius = draws.lengths(height=(0.14, 0.32), edge_radius=(0.005, 0.03))
    low = height * draws.number("cover_bottom", (0.22, 0.35))
    thick = depth * draws.number("cover_depth", (0.2, 0.7))
    front = -thick - CLEAR  # of the body behind the cover
    body = box((front, depth - thick), half, (low, height), fillet=radius, axis=0)
    body += box((front - 0.004, depth - thick), 0.8 * half, (0.3 * low, low), fillet=0.006)
    body += box((front * 0.5, depth - thick - 0.01), 0.6 * half, (low - 0.006, low + 0.03))
    body += rod(front * 0.4, 0, (0.3 * low, 0.12 * low), 0.008, 0.006, 14)  # the nozzle
    face = front - CLEAR
    taper = draws.number("cover_taper", (0.0, 0.25)) * half
    cover = rounded_tray((face - thick, -half, low + 0.002 + CLEAR), (face, half, height), 0.003, radius,
                         ((0.0, taper), (0.35, 0.0), (1.0, 0.0)), axis=0, side=1)  # fmt: skip
    if draws.chance("window", 0.5):  # it shows how much is left
        upright = (low + 0.3 * (height - low), low + 0.8 * (height - low))
        pane = box((face - thick - 0.0015, face - thick + 0.002), 0.2 * half, upright, fillet=0.003, axis=0)
        cover += pane.called("glass", FRONT)
    dispenser = Assembly("body", body, DENSITY)
    style = draws.pick("control", ["bar", "lever", "button", "twin", "sensor"])
    if style == "sensor":  # nothing to press, and the cover swings down
        down_at = (face - 0.005, 0.0, low + 0.001)  # before the foot of the box
        dispenser.add("lid", cover, revolute("body", (0, -1, 0), down_at, 0.0, draws.angle("lid_angle", (0.6, 1.5))))
        return dispenser
    limit = draws.angle("lid_angle", (0.6, 1.6))
    dispenser.add("lid", cover, revolute("body", (0, 1, 0), (face, 0, height), 0.0, limit))
    if style == "lever":  # an elbow lever below, to press back
        x, z, r = front - 0.004 - CLEAR - 0.004, 0.65 * low, 0.004
        reach = draws.length("lever_length", (0.04, 0.16))
        wide = 0.5 * half
        bend, pad = (x - 0.3 * reach, 0, z - 0.02), (x - reach, 0, z - 0.03 - 0.3 * reach)
        solid = tube([(x, 0, z), bend], r, 10) + hull_of(
            *(box(about(u, 0.003), w, about(v, 0.003), fillet=0.002) for (u, _, v), w in ((bend, 0.006), (pad, wide)))
        )
        solid += rod(x, (-0.4 * wide, 0.4 * wide), z, r, sections=12)
        turn = revolute("body", (0, -1, 0), (x, 0.0, z), 0.0, draws.angle("lever_angle", (0.1, 0.3)))
        dispenser.add("lever", solid, turn)
        return dispenser
    wide = half * draws.number("bar_width", (0.5, 0.78))
    back = front - 0.004 - 0.012
    tip = min(min(face - thick, back - 0.01) * draws.number("bar_reach", (0.8, 1.05)), back - 0.008)
    top, bottom = low - 0.001, 0.35 * low
    if style == "bar":
        solid = box((tip, back), wide, (bottom, top), fillet=0.005)
        dispenser.add("bar", solid, prismatic("body", (1, 0, 0), 0.0, 0.01, (back, 0, bottom)))
        return dispenser
    spots = [0.0] if style == "button" else [-0.4 * half, 0.4 * half]
    z, r = 0.5 * (top + bottom), min(0.45 * (top - bottom), 0.3 * half)
    for number, y in enumerate(spots):
        solid = rod((back, back - 0.012), y, z, r) + rod((back - 0.011, back - 0.016), y, z, 0.95 * r, 0.6 * r)
        name = f"button_{number}" if len(spots) > 1 else "button"
        dispenser.add(name, solid, prismatic("body", (1, 0, 0), 0.0, 0.01, (back, y, z)))
    return dispenser


def _drink_jar(draws: Draws) -> Assembly:
    """A jar or an urn with taps near its foot, on a stand or on feet."""
    half, height = 0.5 * draws.length("width", (0.16, 0.3)), draws.length("height", (0.18, 0.42))
    foot = draws.length("stand_height", (0.06, 0.2))
    shape = draws.pick("outline", ["round", "round", "round", "square", "octagon", "hexagon"])
    outline = cross_section(shape, draws.number("sharpness", (0.0, 1.0)))
    mouth = draws.number("mouth", (0.55, 0.95))
    shares = {
        "drum": [(0.0, 0.95), (0.03, 1.0), (0.9, 1.0), (1.0, mouth)],
        "urn": [(0.0, 0.6), (0.15, 0.8), (0.5, 1.0), (0.8, 0.97), (1.0, mouth)],
        "keg": [(0.0, 0.8), (0.2, 0.94), (0.5, 1.0), (0.8, 0.94), (1.0, 0.78)],
    }[draws.pick("jar_shape", ["drum", "urn", "keg"])]
    levels: list[Level] = [(foot + z * height, s * half, s * half, 1.0 if z == 1.0 else 0.0) for z, s in shares]
    body = moulded(levels, outline) + _stand(draws, shares[0][1] * half, foot)
    top = foot + height
    z = foot + height * draws.number("tap_height", (0.08, 0.16))
    wide = float(np.interp(z, [v[0] for v in levels], [v[1] for v in levels]))
    count = draws.pick("levers", {1: 0.8, 2: 0.2})
    spots = [0.0] if count == 1 else [-0.33 * wide, 0.33 * wide]
    r = draws.length("tap_radius", (0.008, 0.012))
    out, rise = -wide - (draws.length("tap_reach", (0.03, 0.06)) + r), r * draws.number("tap_rise", (1.3, 2.0))
    for y in spots:
        body += rod((-0.4 * wide, out), y, z, r, sections=16)
        body += rod(out, y, (z - 0.035, z + rise), 1.15 * r, sections=16)
        body += ring((-0.985 * wide, y, z), (1, 0, 0), 0.5 * r, 1.9 * r, 0.01, 16)
    dispenser = Assembly("body", body, DENSITY)
    dispenser.add("lid", *_jar_lid(draws, shares[-1][1] * half, top))
    style, long = draws.pick("tap", ["lever", "wing", "flip"]), draws.length("lever_length", (0.03, 0.06))
    for number, y in enumerate(spots):
        at = np.array([out, y, z + rise + 0.001])
        solid, joint = _tap_handle(draws, style, at, r, min(long, 0.28 * wide if count > 1 else long))
        dispenser.add(f"tap_{number}" if count > 1 else "tap", solid, joint, label="lever")
    return dispenser


def _jar_lid(draws: Draws, radius: float, top: float) -> tuple[Solid, JointSpec]:
    """A lid with a knob, which swings up, screws, or lifts off."""
    low = top + CLEAR
    lid = rod(0, 0, (low, low + 0.012), radius * draws.number("lid_radius", (0.95, 1.05)), 0.93 * radius)
    lid += dome(0.9 * radius, low + 0.0115, radius * draws.number("lid_rise", (0.05, 0.45)))
    crown = float(lid.bounds()[1, 2])
    size = radius * draws.number("knob_size", (0.12, 0.2))
    knob = rod(0, 0, (crown - 0.004, crown + 0.6 * size), 0.5 * size) + ellipsoid((0, 0, crown + size), size, 12)
    lid += knob.called("knob", UP)
    if draws.chance("lid_hinged", 0.3):
        x, w = 1.05 * radius + 0.006, 0.3 * radius
        lid += rod(x, (-w, w), low + 0.004, 0.004, sections=12) + box((0.8 * radius, x), w, (low, low + 0.004))
        return lid, revolute("body", (0, 1, 0), (x, 0, low + 0.004), 0.0, draws.angle("lid_angle", (0.8, 1.55)))
    if draws.chance("lid_screws", 0.3):
        angle = 2.0 * np.pi * draws.number("lid_turns", (0.3, 2.0))
        return lid, screw("body", UP, (0, 0, top), 0.0, angle, draws.length("thread_height", (0.008, 0.03)) / angle)
    return lid, prismatic("body", UP, 0.0, radius * draws.number("lid_travel", (0.3, 1.2)), (0, 0, top))


def _tap_handle(draws: Draws, style: str, at: Array, r: float, long: float) -> tuple[Solid, JointSpec]:
    """What opens a tap: a lever that turns about the upright, a wing, or a lever that is pulled towards the front."""
    if style == "flip":
        pivot = at + (0, 0, 1.1 * r)
        solid = cylinder(pivot - (0, 1.1 * r, 0), pivot + (0, 1.1 * r, 0), r, sections=14)
        solid += tube([pivot, pivot + (-0.15 * long, 0, long)], [0.5 * r, 0.75 * r], 10)
        return solid, revolute("body", (0, -1, 0), pivot, 0.0, draws.angle("tap_angle", (0.5, 1.3)))
    solid = cylinder(at, at + (0, 0, 1.2 * r), 1.1 * r, r, 14)
    level = at + (0, 0, 0.8 * r)
    if style == "wing":
        span = min(long, 2.0 * r)
        solid += hull_of(*(ellipsoid(level + (0, s * span, 0.4 * r), (0.4 * r, 0.3 * r, 0.7 * r), 8) for s in (-1, 1)))
        return solid, revolute("body", UP, at, 0.0, 0.5 * np.pi)
    solid += tube([level, level + (-long, 0, 0.3 * long)], [0.5 * r, 0.7 * r], 10)
    limit = draws.angle("tap_angle", (0.8, 1.57))
    return solid, revolute("body", UP, at, -limit if draws.chance("tap_both_ways", 0.4) else 0.0, limit)


def _stand(draws: Draws, wide: float, foot: float) -> Solid:
    """Legs with a ring, a pedestal, or a plinth."""
    kind = draws.pick("stand", ["legs", "pedestal", "plinth"])
    if kind == "plinth":
        return rod(0, 0, (0, foot + 0.002), wide * draws.number("plinth_width", (0.9, 1.05)), 0.9 * wide)
    if kind == "pedestal":
        stem = rod(0, 0, (0.01, foot + 0.002), 0.3 * wide, 0.6 * wide)
        return stem + rod(0, 0, (0, 0.015), wide, 0.85 * wide)
    solid = ring((0, 0, foot - 0.006), UP, 0.75 * wide, 1.0 * wide, 0.016, 20)
    count, spread = draws.integer("leg_count", 3, 4), draws.number("leg_spread", (0.9, 1.25))
    for a in turns(count, 0.5):
        x, y = cos(a) * wide, sin(a) * wide
        solid += tube([(0.88 * x, 0.88 * y, foot - 0.004), (spread * x, spread * y, 0.004)], 0.006, 8)
    return solid


def _water_cooler(draws: Draws) -> Assembly:
    """A cabinet with a bottle on top, levers or buttons over a drip tray, and sometimes a door below."""
    depth, half = 0.5 * draws.length("depth", (0.28, 0.4)), 0.5 * draws.length("width", (0.26, 0.4))
    tall = draws.pick("stands", {"floor": 0.7, "table": 0.3}) == "floor"
    height = draws.length("height", (0.75, 1.05) if tall else (0.32, 0.48))
    shelf = draws.length("niche_height" if tall else "foot_height", (0.28, 0.34) if tall else (0.03, 0.06))
    shelf = height - shelf if tall else shelf
    roof = height - draws.length("roof_height", (0.05, 0.09))
    niche = -depth + draws.length("niche_depth", (0.08, 0.13))
    body = box((niche, depth), half, (shelf - 0.01, roof + 0.01))
    body += box(depth, half, (roof, height), fillet=draws.length("edge_radius", (0.01, 0.05)), axis=2)
    for s in (-1.0, 1.0):
        body += box((-depth + 0.01, depth), (s * half, s * (half - 0.012)), (shelf - 0.01, roof + 0.01))
    door = tall and draws.chance("door", 0.7)
    inset = 0.03 if door else 0.0
    if tall:
        body += box((-depth + inset, depth), half, (0.0, shelf)) + box(depth, half, (shelf - 0.03, shelf))
    else:
        body += box(depth, half, (0.0, shelf), fillet=0.02, axis=2)
    body += box((-depth - 0.02, niche + 0.01), 0.6 * half, (shelf - 0.015, shelf + 0.008), fillet=0.006)
    spots = (np.linspace(-1.0, 1.0, draws.pick("taps", {2: 0.75, 3: 0.25})) * 0.4 * half).tolist()
    style = draws.pick("tap", ["lever", "button", "tap"])
    z, nose = roof - (0.075 if style == "tap" else 0.02), niche - 0.045
    for y in spots:
        body += rod((niche + 0.005, nose), y, z, 0.01, sections=14)
        body += rod(nose, y, (z + 0.01, z - 0.03), 0.009, sections=14)
    cooler = Assembly("body", body, density=250.0)
    for number, y in enumerate(spots):
        if style == "lever":  # a paddle below the tap, which the cup pushes back
            pivot = (niche - 0.012, y, z - 0.04)
            tap = box(about(pivot[0], 0.003), about(y, 0.02), (z - 0.11, z - 0.045))
            tap += rod(pivot[0], (y - 0.012, y + 0.012), pivot[2], 0.006, sections=12)
            joint = revolute("body", (0, -1, 0), pivot, 0.0, 0.09)
        elif style == "tap":
            tap, joint = _tap_handle(draws, "flip", np.array([nose, y, z + 0.011]), 0.009, 0.03)
        else:
            face = -depth - 0.001
            middle = 0.5 * (roof + height)
            size = min(0.3 * (height - roof), 0.02)
            tap = box((face - 0.008, face - 0.003), about(y, 1.3 * size), about(middle, size), fillet=0.003, axis=0)
            joint = prismatic("body", (1, 0, 0), 0.0, 0.002, (face, y, middle))
        cooler.add(f"{style}_{number}", tap, joint, label="button" if style == "button" else "lever", density=900.0)
    if draws.chance("bottle", 0.75):
        _big_bottle(draws, cooler, height, min(depth, half))
    if door:
        face, thick = -depth + inset - 0.002, inset - 0.002
        left = draws.chance("hinge_left", 0.5)
        sign = 1.0 if left else -1.0
        panel = box((face - thick, face), half - 0.004, (0.03, shelf - 0.033), fillet=0.004)
        start, end = ((face - thick, -0.6 * sign * half, v * shelf) for v in (0.5, 0.8))
        panel += front_handle(draws.pick("handle", ["bar", "bow", "flat"]), start, end, 0.025, 0.005)
        limit = draws.angle("door_angle", (1.2, 1.9))
        cooler.add("door", panel, side_hinge(face - thick, (half - 0.004) * sign, limit, left), density=300.0)
    return cooler


def _big_bottle(draws: Draws, cooler: Assembly, z: float, room: float) -> None:
    """A bottle upside down, which lifts out."""
    radius, height = room * draws.number("bottle_radius", (0.72, 0.95)), draws.length("bottle_height", (0.28, 0.42))
    z += CLEAR
    levels = [(0.0, 0.35), (0.05, 0.4), (0.18, 1.0), (0.4, 1.0), (0.44, 0.95), (0.48, 1.0), (0.7, 1.0), (0.74, 0.95),
              (0.78, 1.0), (0.96, 1.0), (1.0, 0.9)]  # fmt: skip
    solid = moulded([(z + h * height, s * radius, s * radius, 0.0) for h, s in levels], cross_section("round"))
    lift = prismatic("body", UP, 0.0, draws.length("bottle_travel", (0.1, 0.4)), (0, 0, z))
    turn = continuous("body", UP, (0, 0, z))
    cooler.add("bottle", solid, lift if draws.chance("bottle_lifts", 0.7) else turn, density=DENSITY)
