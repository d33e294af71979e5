"""Coffee machines: espresso machines with a portafilter, drip machines with a carafe, pod machines with a lever,
percolators whose lid lifts off, and urns.

What varies: sizes, round or square bodies; which of drip tray, steam wand, lid, knobs, buttons, carafe, tank move.
"""

import numpy as np

from artsim.common.elementary import power
from artsim.families.details import dial
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws, Interval
from artsim.making.outlines import FRONT, UP, about, lifted, rounded_rectangle
from artsim.making.solids import Solid, box, cylinder, deferred, hull, hull_of, ring, rod, tray, tube, union, vessel

GAP = 0.0015


def build(draws: Draws) -> Assembly:
    """An espresso, a drip or a pod machine, a percolator or an urn."""
    kinds = {"espresso": _espresso, "drip": _drip, "pod": _pod, "percolator": _percolator, "urn": _urn}
    return draws.one_of("kind", kinds, (0.29, 0.29, 0.14, 0.14, 0.14))(draws)


def _drip_tray(draws: Draws, machine: Assembly, x: float, front: float, y: float, high: float) -> None:
    """A tray with a slotted cover, in the niche of the base."""
    x0, depth, low = -x - 0.001, front - 0.003, 0.01
    solid = tray((x0, -y, low), (x0 + depth, y, high), 0.003)
    count = draws.integer("tray_bars", 2, 5) + 1
    for edge in np.linspace(-y, y, count + 1)[1:-1]:
        solid += box((x0 + 0.001, x0 + depth - 0.001), about(edge, 0.25 * y / count * 2), (high - 0.004, high - 0.0005))
    solid += box((x0 - 0.006, x0 + 0.002), y, (low, high), fillet=0.003)
    machine.add("drip_tray", solid, prismatic("body", FRONT, 0.0, 0.8 * depth, (x0, 0, low)), density=900.0)


def _base(x: float, y: float, height: float, radius: float, tray_y: float, front: float) -> Solid:
    """Base plate with a niche for the drip tray in front, ``front`` deep."""
    solid = box((-x + front, x), y, (0, height), fillet=radius, axis=2) + box((-x, -x + front + radius), y, (0, 0.008))
    return solid + union(box((-x, -x + front + radius), (s * y, s * (tray_y + GAP)), (0.001, height)) for s in (-1, 1))


def _espresso(draws: Draws) -> Assembly:
    x, y = 0.5 * draws.length("depth", (0.24, 0.36)), 0.5 * draws.length("width", (0.18, 0.38))
    height, base, head = draws.lengths(height=(0.28, 0.4), base_height=(0.045, 0.075), head_height=(0.1, 0.15))
    front = draws.length("head_reach", (0.12, 0.15))  # how far head and base stand out before the column
    radius = draws.length("edge_radius", (0.005, 0.03))
    tray_y = y - 0.012
    body = _base(x, y, base, radius, tray_y, front)
    body += box((-x + front, x), y, (base - 0.002, height - 0.002), fillet=radius, axis=2)
    head_low = height - head
    round_edges = draws.pick("head_edges", {"level": 0.4, "upright": 0.6})
    body += box(x, y, (head_low, height), fillet=radius, axis=1 if round_edges == "level" else 2)
    with_lid = draws.chance("lid", 0.5)
    if draws.chance("cup_rail", 0.6):  # before the lid
        post, behind = 0.02, 0.1 * x if with_lid else x - 0.03
        corners = [(a, b * (y - 0.02)) for a, b in ((0.03 - x, -1), (0.03 - x, 1), (behind, 1), (behind, -1))]
        body += tube([(a, b, height + post) for a, b in corners], 0.0035, 8, closed=True)
        body += union(rod(a, b, (height - 0.003, height + post), 0.003, sections=8) for a, b in corners)

    wand_side = draws.side("wand_side") if draws.chance("steam_wand", 0.7) and y > 0.11 else 0.0
    group = np.array([-x + 0.5 * front, -0.25 * wand_side * y, head_low])
    body += cylinder(group + (0, 0, 0.002), group - (0, 0, 0.014), 0.036, sections=24)
    machine = Assembly("body", body, 900.0)
    _drip_tray(draws, machine, x, front, tray_y, base)

    # The portafilter turns away from the wand.
    group_x, group_y, top = group[0], group[1], group[2] - 0.014 - GAP
    basket = rod(group_x, group_y, (top - 0.03, top), 0.029, 0.034)
    neck, end = group_x - 0.03, group_x - 0.035 - draws.length("portafilter_length", (0.09, 0.13))
    path = [(group_x, top - 0.012), (neck, top - 0.014), (neck - 0.03, top - 0.016), (end, top - 0.022)]
    basket += tube([(a, group_y, b) for a, b in path], [0.007, 0.007, 0.011, 0.013]).called("handle", FRONT)
    if top - 0.03 - base > 0.05:
        basket += union(
            cylinder((group_x, group_y + s * 0.012, top - 0.045), (group_x, group_y, top - 0.028), 0.005, 0.007, 10)
            for s in (-1, 1)
        )
    away = -wand_side if wand_side else draws.side("portafilter_side")
    limit = draws.turn("portafilter_angle", (35.0, 55.0))
    machine.add("portafilter", basket, revolute("body", (0, 0, -away), group, 0.0, limit), density=3000.0)

    if wand_side:
        foot = np.array([-x + 0.03, wand_side * (y - 0.022), head_low - GAP])
        drop = min(0.13, head_low - base - 0.04)
        bends = (-0.025, 0.01 * wand_side, -0.6 * drop), (-0.03, 0.014 * wand_side, -drop)
        wand = tube(foot + np.array([(0, 0, 0), (0, 0, -0.02), *bends]), 0.0045, 10)
        wand += cylinder(foot, foot - (0, 0, 0.014), 0.009, sections=14)
        limit = draws.turn("wand_angle", (60.0, 120.0))
        machine.add("steam_wand", wand, revolute("body", (0, 0, -wand_side), foot, 0.0, limit), density=3000.0)
    _controls(draws, machine, -x, y, head_low, height)
    if with_lid:  # of the water tank
        seam, thick = height + GAP, 0.008
        lid = box((0.25 * x, 0.97 * x), 0.7 * y, (seam, seam + thick), fillet=0.01, axis=2)
        tab = box((0.27 * x, 0.27 * x + 0.012), 0.012, (seam + 0.5 * thick, seam + thick + 0.004), fillet=0.002)
        limit = draws.turn("lid_angle", (70.0, 100.0))
        hinge = revolute("body", (0, 1, 0), (0.97 * x, 0, seam), 0.0, limit)
        machine.add("lid", lid + tab.called("handle", UP), hinge, density=900.0)
    return machine


def _controls(draws: Draws, machine: Assembly, face: float, y: float, low: float, high: float) -> None:
    """Knobs and buttons in a row on the front of the head."""
    z = 0.5 * (low + high)
    room = 0.36 * (high - low)
    count = draws.integer("control_count", 1, 3)
    if y < 0.03:  # a narrow or round front has room for one
        count, y = 1, 0.06
    for number, share in enumerate(np.linspace(-1.0, 1.0, count + 2)[1:-1]):
        center = (face, share * 0.9 * y, z)
        if draws.pick("control", {"knob": 0.5, "button": 0.5}) == "knob":
            size = min(draws.length("knob_radius", (0.012, 0.024)), room, 0.2 * y)
            turn = continuous("body", FRONT, center)
            machine.add(f"knob_{number}", dial(center, FRONT, 0.018, size), turn, density=900.0)
        else:
            size = min(draws.length("button_radius", (0.008, 0.012)), room, 0.22 * y)
            key = rod((face - 0.0032, face - 0.011), center[1], z, size, 0.92 * size, 16)
            machine.add(f"button_{number}", key, prismatic("body", (1, 0, 0), 0.0, 0.0025, center), density=900.0)


def _drip(draws: Draws) -> Assembly:
    y = 0.5 * draws.length("width", (0.15, 0.25))
    pot = y - draws.length("carafe_clearance", (0.01, 0.02))  # radius of the carafe
    x = pot + draws.length("tank_depth", (0.05, 0.07))
    height, base, head = draws.lengths(height=(0.27, 0.42), base_height=(0.025, 0.04), head_height=(0.07, 0.1))
    radius = draws.length("edge_radius", (0.01, 0.5 * y))
    center = -x + pot + 0.012
    back = center + pot + 0.006
    head_low = height - head
    body = box(x, y, (0, base), fillet=radius, axis=2)
    body += box((back, x + 0.02), y, (0, height), fillet=min(radius, 0.02), axis=2)
    shrink = y * draws.one_of("head_shape", {"straight": 0.0, "tapered": draws.number("head_taper", (0.0, 0.15))})
    reach = center - 0.5 * pot if draws.chance("head_short", 0.3) else -x  # it ends above the middle of the carafe
    body += _tapered((reach, -y), (x + 0.018, y), (head_low, height), radius, shrink)
    body += rod(center, 0, (base - 0.002, base + 0.003), 0.8 * pot)
    if draws.chance("gauge", 0.5):  # of the water tank
        gauge = box((x - 0.01, x + 0.004), (-y - 0.002, -y + 0.002), (base + 0.03, head_low - 0.02))
        body += gauge.called("glass", (0, -1, 0))
    plain = draws.chance("lid_alone", 0.35)  # nothing else moves
    carafe = _carafe(draws, center, pot, base + 0.003 + GAP, head_low - GAP)
    machine = Assembly("body", body + carafe.moved((0, 0, -GAP - 0.0005)) if plain else body, 700.0)
    if not plain:
        draw = prismatic("body", FRONT, 0.0, draws.number("carafe_travel", (1.0, 2.4)) * pot, (center, 0, base))
        machine.add("carafe", carafe, draw, density=1500.0)

    seam, thick = height + GAP, draws.length("lid_height", (0.012, 0.06))
    hinge = x + 0.018
    bevel = draws.pick("lid_bevel", [0.0, 0.5, 1.0]) * thick
    lid = _tapered((reach, shrink - y), (hinge, y - shrink), (seam, seam + thick), radius, bevel)
    lifts = 0.6 if plain else 0.15
    if draws.pick("lid_joint", {"lift": lifts, "hinge": 1.0 - lifts}) == "lift":
        travel = draws.length("lid_travel", (0.02, 0.2))
        machine.add("lid", lid, prismatic("body", UP, 0.0, travel, (0.5 * (reach + hinge), 0, seam)))
    else:
        limit = draws.turn("lid_angle", (50.0, 115.0))
        machine.add("lid", lid, revolute("body", (0, 1, 0), (hinge, 0, seam), 0.0, limit))
    if plain:
        return machine
    if draws.chance("control_row", 0.5):
        _controls(draws, machine, reach, 0.7 * (y - shrink), head_low, height)
    else:
        z = 0.5 * (height + head_low)
        key = box((reach - 0.010, reach - 0.0032), 0.012, (z - 0.008, z + 0.008), fillet=0.002)
        machine.add("button", key, prismatic("body", (1, 0, 0), 0.0, 0.0025, (reach, 0, z)), density=900.0)
    return machine


def _percolator(draws: Draws) -> Assembly:
    """A tall jug with a handle, on a heated foot; its lid lifts off or swings up."""
    foot, tall, radius = draws.lengths(foot_height=(0.03, 0.11), jug_height=(0.14, 0.3), jug_radius=(0.045, 0.085))
    narrow, half = draws.number("jug_bottom", (0.6, 1.05)) * radius, draws.number("foot_width", (0.95, 1.35)) * radius
    waist = draws.number("collar_height", (0.0, 0.25)) * tall  # between the foot and the jug
    upper = draws.number("foot_taper", (0.75, 1.0)) * half
    if draws.pick("foot_shape", {"square": 0.6, "round": 0.4}) == "square":
        corner = draws.length("foot_corner", (0.005, 0.03))
        rings = [lifted(rounded_rectangle((-w, -w), (w, w), corner, 3), z) for w, z in ((half, 0.0), (upper, foot))]
        body = hull(np.concatenate(rings))
    else:
        body = rod(0, 0, (0, foot), half, upper)
    body += rod(0, 0, (foot - 0.002, foot + waist + 0.002), 0.95 * narrow, 0.85 * narrow)
    low, top = foot + waist, foot + waist + tall
    body += vessel([(narrow, low), (radius, top)], 0.004, sections=20)
    side = draws.one_of("handle_side", {"left": 0.5, "right": -0.5, "back": 0.0, "front": 1.0}) * np.pi
    out = radius + draws.length("handle_reach", (0.03, 0.06))
    grip = [(narrow, 0, low + 0.2 * tall), (out, 0, low + 0.3 * tall), (out, 0, top - 0.03),
            (radius - 0.002, 0, top - 0.02)]  # fmt: skip
    handle = tube(grip, draws.length("handle_radius", (0.005, 0.009)), 10).called("handle", -FRONT)
    machine = Assembly("body", body + handle.turned((0, 0, 1), side), 900.0)
    seam = top + GAP
    crown = seam + draws.length("lid_height", (0.006, 0.03))
    lid = rod(0, 0, (seam, crown), radius + 0.003, draws.number("lid_taper", (0.5, 1.0)) * radius)
    knob_top = crown + draws.length("knob_height", (0.008, 0.03))
    knob = rod(0, 0, (seam, knob_top), draws.number("knob_radius", (0.15, 0.45)) * radius, sections=16)
    lid += knob.called("knob", UP)
    if draws.pick("lid_joint", {"lift": 0.75, "hinge": 0.25}) == "lift":
        lid += rod(0, 0, (seam - draws.length("lid_plug", (0.004, 0.02)), seam + 0.001), 0.45 * radius, 0.75 * radius)
        joint = prismatic("body", UP, 0.0, draws.number("lid_travel", (0.02, 0.8)) * tall, (0, 0, seam))
    else:
        joint = revolute("body", (0, 1, 0), (radius + 0.004, 0.0, seam), 0.0, draws.turn("lid_angle", (60.0, 110.0)))
    machine.add("lid", lid, joint)
    return machine


@deferred
def _tapered(low: Interval, high: Interval, heights: Interval, radius: float, shrink: float) -> Solid:
    """Block with round upright edges whose two sides lean inward."""
    outlines = [
        lifted(rounded_rectangle((low[0], low[1] + s), (high[0], high[1] - s), radius, 4), z)
        for s, z in zip((0.0, shrink), heights, strict=True)
    ]
    return hull(np.concatenate(outlines))


def _carafe(draws: Draws, center: float, pot: float, low: float, high: float) -> Solid:
    """Glass jug with a handle in front, between the base and the head."""
    rise = (high - low) * draws.number("carafe_height", (0.8, 0.97))
    lid = 0.014
    neck = draws.number("carafe_neck", (0.55, 0.8))
    radii = pot * np.array([0.85, 0.97, 1.0, neck, neck + 0.03])
    profile = np.column_stack([radii, np.array([0.0, 0.12, 0.45, 0.85, 1.0]) * (rise - lid)])
    solid = vessel(profile, 0.003, (center, 0, low), sections=24)
    top = low + rise - lid
    solid += rod(center, 0, (top - 0.002, top + lid - 0.001), radii[-1] - 0.001, 0.8 * radii[-1])
    solid += ring((center, 0, top - 0.02), UP, 0.95 * radii[3] - 0.004, radii[3] + 0.004, 0.014)
    grip = [(center - radii[3] + 0.002, 0, top - 0.016), (center - radii[3] - 0.04, 0, top - 0.012),
            (center - radii[3] - 0.055, 0, top - 0.03), (center - pot - 0.02, 0, low + 0.35 * rise),
            (center - 0.97 * pot, 0, low + 0.3 * rise)]  # fmt: skip
    return solid + tube(np.array(grip), 0.007, 10).called("handle", FRONT)


def _pod(draws: Draws) -> Assembly:
    y, x = 0.5 * draws.length("width", (0.11, 0.17)), 0.5 * draws.length("depth", (0.26, 0.36))
    height, base, head = draws.lengths(height=(0.22, 0.3), base_height=(0.03, 0.045), head_height=(0.08, 0.11))
    front, radius = draws.lengths(head_reach=(0.1, 0.13), edge_radius=(0.01, 0.03))
    tank_x = x - draws.length("tank_depth", (0.05, 0.07))
    body = _base(x, y, base, radius, y - 0.01, front)
    body += box((-x + front, tank_x), y, (base - 0.002, height - 0.002), fillet=radius, axis=2)
    body += box((-x + 0.01, tank_x - 0.001), y, (height - head, height), fillet=1.5 * radius, axis=1)
    body += rod(-x + 0.5 * front, 0, (height - head - 0.018, height - head + 0.002), 0.012, 0.02, 16)
    machine = Assembly("body", body, 700.0)
    _drip_tray(draws, machine, x, front, y - 0.01, base)
    # The lever lies on the head and turns up about an axis above its back.
    pivot, axle, wide = tank_x - 0.04, height + 0.0075, 0.7 * y
    tip = pivot - draws.number("lever_length", (0.6, 0.95)) * (pivot + x - 0.01)
    upright = (height + GAP, height + GAP + 0.010)
    lever = box((tip, tip + 0.03), wide, upright, fillet=0.004).called("handle", FRONT)
    lever += union(box((tip, pivot + 0.006), (s * wide, s * (wide - 0.01)), upright, fillet=0.004) for s in (-1.0, 1.0))
    lever += rod(pivot, (-wide, wide), axle, 0.005, sections=12)
    limit = draws.turn("lever_angle", (60.0, 105.0))
    machine.add("lever", lever, revolute("body", (0, 1, 0), (pivot, 0, axle), 0.0, limit), density=900.0)
    top = height * draws.number("tank_height", (0.8, 0.98))
    tank = box((tank_x + GAP, x), 0.9 * y, (base + GAP, top), fillet=0.015, axis=2)
    tank += box((tank_x + GAP + 0.001, x - 0.001), 0.85 * y, (top - 0.001, top + 0.006), fillet=0.012, axis=2)
    machine.add("water_tank", tank, prismatic("body", UP, 0.0, 0.8 * (top - base), (x, 0, base)), density=900.0)
    return machine


def _urn(draws: Draws) -> Assembly:
    """A tall body, round or square, with a lid on top that lifts off or swings up; a niche for a cup, or a tap."""
    x = 0.5 * draws.length("depth", (0.14, 0.3))
    y = x * (1.0 if draws.chance("width_as_depth", 0.5) else draws.number("width_share", (0.7, 1.35)))
    height = draws.length("height", (1.1, 2.9), of=2 * x)
    radius = min(x, y) * draws.one_of("outline", {"round": 0.999, "square": draws.number("corner_radius", (0.1, 0.6))})
    niche = draws.pick("front", {"niche": 0.5, "tap": 0.5}) == "niche"
    if niche:  # a foot, a column at the back, and a head
        foot, head = 0.09 * height, draws.number("head_height", (0.35, 0.6)) * height
        back = x * draws.number("niche_depth", (-0.2, 0.4))
        body = box(x, y, (0, foot), fillet=radius, axis=2, steps=5)
        body += box((back, 0.95 * x), 0.85 * y, (0.5 * foot, height - 0.5 * head), fillet=0.02, axis=2)
        body += box(x, y, (height - head, height), fillet=radius, axis=2, steps=5)
        roof = height - head
        body += rod(0.5 * (back - x), 0, (roof - 0.02, roof + 0.002), 0.01, 0.015, 14)
    else:
        waist = draws.number("waist", (0.75, 1.0))
        body = box(x, y, (0, 0.12 * height), fillet=radius, axis=2, steps=5) + hull_of(
            box(x * waist, y * waist, (0.11 * height, 0.13 * height), fillet=waist * radius, axis=2, steps=5),
            box(x, y, (height - 0.02, height), fillet=radius, axis=2, steps=5),
        )
        tap = (-0.9 * waist * x, 0.0, 0.22 * height)
        body += tube([tap, (tap[0] - 0.3 * x, 0, tap[2]), (tap[0] - 0.34 * x, 0, tap[2] - 0.12 * x)], 0.09 * x, 10)
    if draws.chance("back_handle", 0.6):
        grip = [(0.9 * x, 0.8), (x + 0.35 * x, 0.75), (x + 0.35 * x, 0.4), (0.7 * x, 0.35)]
        body += tube([(a, 0, b * height) for a, b in grip], 0.007, 10).called("handle", -FRONT)
    machine = Assembly("body", body, 700.0)

    share, seam = draws.number("lid_width", (0.6, 1.0)), height + GAP
    rise = x * draws.number("lid_height", (0.08, 0.45))
    crown = seam + rise
    side_x, side_y = share * x, share * y
    lid = hull_of(
        box(side_x, side_y, (seam, seam + 0.3 * rise), fillet=share * radius, axis=2, steps=5),
        box(0.7 * side_x, 0.7 * side_y, (seam, crown), fillet=0.7 * share * radius, axis=2, steps=5),
    )
    if draws.chance("lid_knob", 0.75):
        size = x * draws.number("knob_size", (0.08, 0.16))
        knob = rod(0, 0, (crown - 0.002, crown + size), 0.6 * size, sections=14)
        knob += rod(0, 0, (crown + 0.9 * size, crown + 1.8 * size), 1.3 * size, size, 18)
        lid += knob.called("knob", UP)
    if draws.pick("lid_joint", {"lift": 0.65, "hinge": 0.35}) == "lift":
        # Short ways are drawn as often as long ones.
        travel = height * power(12.0, draws.number("lid_travel_exponent", (-1.0, -0.1)))
        joint = prismatic("body", UP, 0.0, travel, (0, 0, seam))
    else:
        hinge, half = (side_x + 0.006, 0.0, seam + 0.002), 0.3 * side_y
        lid += box((side_x - 0.3 * x, hinge[0]), half, (seam, seam + 0.004))
        lid += rod(hinge[0], (-half, half), hinge[2], 0.002, sections=10)
        joint = revolute("body", (0, 1, 0), hinge, 0.0, draws.turn("lid_angle", (60.0, 110.0)))
    machine.add("lid", lid, joint)
    if niche and draws.chance("controls", 0.6):
        _controls(draws, machine, -x, y - radius, height - head, height)
    return machine
