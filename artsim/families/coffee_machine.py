"""Coffee machines: espresso machines with a portafilter, drip machines with a carafe, pod machines with a lever,
percolators whose lid lifts off, and urns.

Drip trays slide out; portafilters, levers, lids and steam wands turn; lids of drip machines lift off, too; knobs turn
freely; buttons travel; carafes and water tanks come out. Sizes, round or square bodies, and which of these there are
vary.
"""

import numpy as np

from artsim.common.elementary import power
from artsim.families.details import dial
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute
from artsim.making.outlines import FRONT, about, lifted, rounded_rectangle
from artsim.making.solids import Solid, box, cylinder, hull, hull_of, ring, rod, tray, tube, union, vessel

GAP = 0.0015


def build(rng: Rng) -> Assembly:
    """An espresso, a drip or a pod machine, a percolator or an urn."""
    return pick(rng, {_espresso: 0.29, _drip: 0.29, _pod: 0.14, _percolator: 0.14, _urn: 0.14})(rng)


def _drip_tray(rng: Rng, machine: Assembly, x0: float, depth: float, y: float, low: float, high: float) -> None:
    """A tray with a slotted cover, in an opening of the base between two heights."""
    solid = tray((x0, -y, low), (x0 + depth, y, high), 0.003)
    count = int(rng.integers(3, 7))
    for edge in np.linspace(-y, y, count + 1)[1:-1]:
        solid += box((x0 + 0.001, x0 + depth - 0.001), about(edge, 0.25 * y / count * 2), (high - 0.004, high - 0.0005))
    solid += box((x0 - 0.006, x0 + 0.002), y, (low, high), fillet=0.003)
    machine.add("drip_tray", solid, prismatic("body", FRONT, 0.0, 0.8 * depth, (x0, 0, low)), density=900.0)


def _base(x: float, y: float, height: float, radius: float, tray_y: float, front: float) -> Solid:
    """Base plate with a niche for the drip tray in front, ``front`` deep."""
    solid = box((-x + front, x), y, (0, height), fillet=radius, axis=2)
    solid += box((-x, -x + front + radius), y, (0, 0.008))
    return solid + union(box((-x, -x + front + radius), (s * y, s * (tray_y + GAP)), (0.001, height)) for s in (-1, 1))


def _espresso(rng: Rng) -> Assembly:
    x, y = rng.uniform(0.12, 0.18), rng.uniform(0.09, 0.19)
    height = rng.uniform(0.28, 0.4)
    base, head = rng.uniform(0.045, 0.075), rng.uniform(0.1, 0.15)
    front = rng.uniform(0.12, 0.15)  # how far head and base stand out before the column
    radius = rng.uniform(0.005, 0.03)
    tray_y = y - 0.012
    body = _base(x, y, base, radius, tray_y, front)
    body += box((-x + front, x), y, (base - 0.002, height - 0.002), fillet=radius, axis=2)
    head_low = height - head
    body += box(x, y, (head_low, height), fillet=radius, axis=1 if rng.random() < 0.4 else 2)
    with_lid = rng.random() < 0.5
    if rng.random() < 0.6:  # rail for cups, before the lid
        post, behind = 0.02, 0.1 * x if with_lid else x - 0.03
        corners = [(a, b * (y - 0.02)) for a, b in ((0.03 - x, -1), (0.03 - x, 1), (behind, 1), (behind, -1))]
        body += tube([(a, b, height + post) for a, b in corners], 0.0035, 8, closed=True)
        body += union(rod(a, b, (height - 0.003, height + post), 0.003, sections=8) for a, b in corners)

    wand_side = float(rng.choice([-1.0, 1.0])) if rng.random() < 0.7 and y > 0.11 else 0.0
    group = np.array([-x + 0.5 * front, -0.25 * wand_side * y, head_low])
    body += cylinder(group + (0, 0, 0.002), group - (0, 0, 0.014), 0.036, sections=24)
    machine = Assembly("body", body, 900.0)
    _drip_tray(rng, machine, -x - 0.001, front - 0.003, tray_y, 0.01, base)

    # The portafilter turns away from the wand.
    top = group[2] - 0.014 - GAP
    basket = rod(group[0], group[1], (top - 0.03, top), 0.029, 0.034)
    reach = rng.uniform(0.09, 0.13)
    neck = (group[0] - 0.03, group[1], top - 0.014)
    grip = (group[0] - 0.035 - reach, group[1], top - 0.022)
    basket += tube(
        [(group[0], group[1], top - 0.012), neck, (neck[0] - 0.03, group[1], top - 0.016), grip],
        [0.007, 0.007, 0.011, 0.013],
    )
    if top - 0.03 - base > 0.05:
        basket += union(
            cylinder((group[0], group[1] + s * 0.012, top - 0.045), (group[0], group[1], top - 0.028), 0.005, 0.007, 10)
            for s in (-1, 1)
        )
    away = -wand_side if wand_side else float(rng.choice([-1.0, 1.0]))
    limit = np.deg2rad(rng.uniform(35.0, 55.0))
    machine.add("portafilter", basket, revolute("body", (0, 0, -away), tuple(group), 0.0, limit), density=3000.0)

    if wand_side:
        foot = np.array([-x + 0.03, wand_side * (y - 0.022), head_low - GAP])
        drop = min(0.13, head_low - base - 0.04)
        bends = (-0.025, 0.01 * wand_side, -0.6 * drop), (-0.03, 0.014 * wand_side, -drop)
        wand = tube(foot + np.array([(0, 0, 0), (0, 0, -0.02), *bends]), 0.0045, 10)
        wand += cylinder(foot, foot - (0, 0, 0.014), 0.009, sections=14)
        turn = revolute("body", (0, 0, -wand_side), tuple(foot), 0.0, np.deg2rad(rng.uniform(60.0, 120.0)))
        machine.add("steam_wand", wand, turn, density=3000.0)
    _controls(rng, machine, -x, y, head_low, height)
    if with_lid:
        _back_lid(rng, machine, x, y, height)
    return machine


def _controls(rng: Rng, machine: Assembly, face: float, y: float, low: float, high: float) -> None:
    """Knobs and buttons in a row on the front of the head."""
    z = 0.5 * (low + high)
    room = 0.36 * (high - low)
    for number, share in enumerate(np.linspace(-1.0, 1.0, int(rng.integers(1, 4)) + 2)[1:-1]):
        center = (face, share * 0.9 * y, z)
        if rng.random() < 0.5:
            size = min(rng.uniform(0.012, 0.024), room, 0.2 * y)
            machine.add(
                f"knob_{number}", dial(center, FRONT, 0.018, size), continuous("body", FRONT, center), density=900.0
            )
        else:
            size = min(rng.uniform(0.008, 0.012), room)
            key = rod((face - 0.0032, face - 0.011), center[1], z, size, 0.92 * size, 16)
            machine.add(f"button_{number}", key, prismatic("body", (1, 0, 0), 0.0, 0.0025, center), density=900.0)


def _back_lid(rng: Rng, machine: Assembly, x: float, y: float, height: float) -> None:
    """Lid of the water tank on top."""
    seam, thick = height + GAP, 0.008
    low, high = (0.25 * x, -0.7 * y, seam), (0.97 * x, 0.7 * y, seam + thick)
    lid = box(low, high, fillet=0.01, axis=2)
    lid += box((0.27 * x, 0.27 * x + 0.012), 0.012, (seam + 0.5 * thick, seam + thick + 0.004), fillet=0.002)
    limit = np.deg2rad(rng.uniform(70.0, 100.0))
    machine.add("lid", lid, revolute("body", (0, 1, 0), (0.97 * x, 0, seam), 0.0, limit), density=900.0)


def _drip(rng: Rng) -> Assembly:
    y = rng.uniform(0.075, 0.125)
    pot = y - rng.uniform(0.01, 0.02)  # radius of the carafe
    x = pot + rng.uniform(0.05, 0.07)
    height = rng.uniform(0.27, 0.42)
    base, head = rng.uniform(0.025, 0.04), rng.uniform(0.07, 0.1)
    radius = rng.uniform(0.01, 0.5 * y)
    center = -x + pot + 0.012
    back = center + pot + 0.006
    head_low = height - head
    body = box(x, y, (0, base), fillet=radius, axis=2)
    body += box((back, x + 0.02), y, (0, height), fillet=min(radius, 0.02), axis=2)
    shrink = rng.choice([0.0, rng.uniform(0.0, 0.15)]) * y  # the head may narrow upward
    reach = center - 0.5 * pot if rng.random() < 0.3 else -x  # or end above the middle of the carafe
    body += _tapered((reach, -y), (x + 0.018, y), (head_low, height), radius, shrink)
    body += rod(center, 0, (base - 0.002, base + 0.003), 0.8 * pot)
    if rng.random() < 0.5:  # gauge of the water tank
        body += box((x - 0.01, x + 0.004), (-y - 0.002, -y + 0.002), (base + 0.03, head_low - 0.02))
    plain = rng.random() < 0.35  # nothing but the lid moves
    carafe = _carafe(rng, center, pot, base + 0.003 + GAP, head_low - GAP)
    machine = Assembly("body", body + carafe.moved((0, 0, -GAP - 0.0005)) if plain else body, 700.0)
    if not plain:
        draw = prismatic("body", FRONT, 0.0, rng.uniform(1.0, 2.4) * pot, (center, 0, base))
        machine.add("carafe", carafe, draw, density=1500.0)

    seam, thick = height + GAP, rng.uniform(0.012, 0.06)
    hinge = x + 0.018
    low, high = (reach, shrink - y), (hinge, y - shrink)
    lid = _tapered(low, high, (seam, seam + thick), radius, rng.choice([0.0, 0.5, 1.0]) * thick)
    if rng.random() < (0.6 if plain else 0.15):
        joint = prismatic("body", (0, 0, 1), 0.0, rng.uniform(0.02, 0.2), (0.5 * (reach + hinge), 0, seam))
    else:
        joint = revolute("body", (0, 1, 0), (hinge, 0, seam), 0.0, np.deg2rad(rng.uniform(50.0, 115.0)))
    machine.add("lid", lid, joint)
    if plain:
        return machine
    z = 0.5 * (height + head_low)
    if rng.random() < 0.5:
        _controls(rng, machine, reach, 0.7 * (y - shrink), head_low, height)
    else:
        key = box((reach - 0.010, reach - 0.0032), 0.012, (z - 0.008, z + 0.008), fillet=0.002)
        machine.add("button", key, prismatic("body", (1, 0, 0), 0.0, 0.0025, (reach, 0, z)), density=900.0)
    return machine


def _percolator(rng: Rng) -> Assembly:
    """A tall jug with a handle, on a heated foot; its lid lifts off or swings up."""
    foot, tall, radius = rng.uniform(0.03, 0.11), rng.uniform(0.14, 0.3), rng.uniform(0.045, 0.085)
    narrow, half = rng.uniform(0.6, 1.05) * radius, rng.uniform(0.95, 1.35) * radius
    waist = rng.uniform(0.0, 0.25) * tall  # a collar between the foot and the jug
    levels = [(half, 0.0), (rng.uniform(0.75, 1.0) * half, foot)]
    if rng.random() < 0.6:
        corner = rng.uniform(0.005, 0.03)
        rings = [lifted(rounded_rectangle((-w, -w), (w, w), corner, 3), z) for w, z in levels]
        body = hull(np.concatenate(rings))
    else:
        body = rod(0, 0, (0, foot), levels[0][0], levels[1][0])
    body += rod(0, 0, (foot - 0.002, foot + waist + 0.002), 0.95 * narrow, 0.85 * narrow)
    low, top = foot + waist, foot + waist + tall
    body += vessel([(narrow, low), (radius, top)], 0.004, sections=20)
    turn = float(rng.choice([0.5, -0.5, 0.0, 1.0])) * np.pi  # where the handle points
    reach, r = rng.uniform(0.03, 0.06), rng.uniform(0.005, 0.009)
    out = radius + reach
    grip = [(narrow, 0, low + 0.2 * tall), (out, 0, low + 0.3 * tall), (out, 0, top - 0.03)]
    body += tube([*grip, (radius - 0.002, 0, top - 0.02)], r, 10).turned((0, 0, 1), turn)
    machine = Assembly("body", body, 900.0)
    seam, rise = top + GAP, rng.uniform(0.006, 0.03)
    lid = rod(0, 0, (seam, seam + rise), radius + 0.003, rng.uniform(0.5, 1.0) * radius)
    knob_top = seam + rise + rng.uniform(0.008, 0.03)
    lid += rod(0, 0, (seam, knob_top), rng.uniform(0.15, 0.45) * radius, sections=16)
    if rng.random() < 0.75:
        lid += rod(0, 0, (seam - rng.uniform(0.004, 0.02), seam + 0.001), 0.45 * radius, 0.75 * radius)
        joint = prismatic("body", (0, 0, 1), 0.0, rng.uniform(0.02, 0.8) * tall, (0, 0, seam))
    else:
        hinge = (radius + 0.004, 0.0, seam)
        joint = revolute("body", (0, 1, 0), hinge, 0.0, np.deg2rad(rng.uniform(60.0, 110.0)))
    machine.add("lid", lid, joint)
    return machine


def _tapered(
    low: tuple[float, float], high: tuple[float, float], heights: tuple[float, float], radius: float, shrink: float
) -> Solid:
    """Block with round upright edges whose two sides lean inward."""
    outlines = [
        lifted(rounded_rectangle((low[0], low[1] + s), (high[0], high[1] - s), radius, 4), z)
        for s, z in zip((0.0, shrink), heights, strict=True)
    ]
    return hull(np.concatenate(outlines))


def _carafe(rng: Rng, center: float, pot: float, low: float, high: float) -> Solid:
    """Glass jug with a handle in front, between the base and the head."""
    rise = (high - low) * rng.uniform(0.8, 0.97)
    lid = 0.014
    shares = np.array([0.0, 0.12, 0.45, 0.85, 1.0])
    neck = rng.uniform(0.55, 0.8)
    radii = pot * np.array([0.85, 0.97, 1.0, neck, neck + 0.03])
    profile = np.column_stack([radii, shares * (rise - lid)])
    solid = vessel(profile, 0.003, (center, 0, low), sections=24)
    top = low + rise - lid
    solid += rod(center, 0, (top - 0.002, top + lid - 0.001), radii[-1] - 0.001, 0.8 * radii[-1])
    solid += ring((center, 0, top - 0.02), (0, 0, 1), 0.95 * radii[3] - 0.004, radii[3] + 0.004, 0.014)
    grip = [(center - radii[3] + 0.002, 0, top - 0.016), (center - radii[3] - 0.04, 0, top - 0.012),
            (center - radii[3] - 0.055, 0, top - 0.03), (center - pot - 0.02, 0, low + 0.35 * rise),
            (center - 0.97 * pot, 0, low + 0.3 * rise)]  # fmt: skip
    return solid + tube(np.array(grip), 0.007, 10)


def _pod(rng: Rng) -> Assembly:
    y, x = rng.uniform(0.055, 0.085), rng.uniform(0.13, 0.18)
    height = rng.uniform(0.22, 0.3)
    base, head = rng.uniform(0.03, 0.045), rng.uniform(0.08, 0.11)
    front = rng.uniform(0.1, 0.13)
    radius = rng.uniform(0.01, 0.03)
    tank_x = x - rng.uniform(0.05, 0.07)
    body = _base(x, y, base, radius, y - 0.01, front)
    body += box((-x + front, tank_x), y, (base - 0.002, height - 0.002), fillet=radius, axis=2)
    body += box((-x + 0.01, tank_x - 0.001), y, (height - head, height), fillet=1.5 * radius, axis=1)
    body += rod(-x + 0.5 * front, 0, (height - head - 0.018, height - head + 0.002), 0.012, 0.02, 16)
    machine = Assembly("body", body, 700.0)
    _drip_tray(rng, machine, -x - 0.001, front - 0.003, y - 0.01, 0.01, base)
    # The lever lies on the head and turns up about an axis above its back.
    pivot = (tank_x - 0.04, 0.0, height + 0.012)
    wide, thick = 0.7 * y, 0.010
    length = rng.uniform(0.6, 0.95) * (pivot[0] + x - 0.01)
    lever = box((pivot[0] - length, pivot[0] - length + 0.03), wide, (height + GAP, height + GAP + thick), fillet=0.004)
    for s in (-1.0, 1.0):
        deep, arm = (pivot[0] - length, pivot[0] + 0.006), (s * wide, s * (wide - 0.01))
        lever += box(deep, arm, (height + GAP, height + GAP + thick), fillet=0.004)
    lever += rod(pivot[0], (-wide, wide), height + 0.0075, 0.005, sections=12)
    limit = np.deg2rad(rng.uniform(60.0, 105.0))
    turn = revolute("body", (0, 1, 0), (pivot[0], 0, height + 0.0075), 0.0, limit)
    machine.add("lever", lever, turn, density=900.0)
    top = height * rng.uniform(0.8, 0.98)
    tank = box((tank_x + GAP, x), 0.9 * y, (base + GAP, top), fillet=0.015, axis=2)
    tank += box((tank_x + GAP + 0.001, x - 0.001), 0.85 * y, (top - 0.001, top + 0.006), fillet=0.012, axis=2)
    machine.add("water_tank", tank, prismatic("body", (0, 0, 1), 0.0, 0.8 * (top - base), (x, 0, base)), density=900.0)
    return machine


def _urn(rng: Rng) -> Assembly:
    """A tall body, round or square, with a lid on top that lifts off or swings up; a niche for a cup, or a tap."""
    x = rng.uniform(0.07, 0.15)
    y = x * (1.0 if rng.random() < 0.5 else rng.uniform(0.7, 1.35))
    height = 2 * x * rng.uniform(1.1, 2.9)
    radius = min(x, y) * rng.choice([0.999, rng.uniform(0.1, 0.6)])
    niche = rng.random() < 0.5
    if niche:  # a foot, a column at the back, and a head
        foot, head = 0.09 * height, rng.uniform(0.35, 0.6) * height
        back = x * rng.uniform(-0.2, 0.4)
        body = box(x, y, (0, foot), fillet=radius, axis=2, steps=5)
        body += box((back, 0.95 * x), 0.85 * y, (0.5 * foot, height - 0.5 * head), fillet=0.02, axis=2)
        body += box(x, y, (height - head, height), fillet=radius, axis=2, steps=5)
        spout = (0.5 * (back - x), 0.0, height - head)
        body += rod(spout[0], 0, (spout[2] - 0.02, spout[2] + 0.002), 0.01, 0.015, 14)
    else:
        waist = rng.uniform(0.75, 1.0)
        low = box(x, y, (0, 0.12 * height), fillet=radius, axis=2, steps=5)
        body = low + hull_of(
            box(x * waist, y * waist, (0.11 * height, 0.13 * height), fillet=waist * radius, axis=2, steps=5),
            box((-x, -y, height - 0.02), (x, y, height), fillet=radius, axis=2, steps=5),
        )
        tap = (-0.9 * waist * x, 0.0, 0.22 * height)
        body += tube([tap, (tap[0] - 0.3 * x, 0, tap[2]), (tap[0] - 0.34 * x, 0, tap[2] - 0.12 * x)], 0.09 * x, 10)
    if rng.random() < 0.6:  # a handle at the back
        body += tube([(0.9 * x, 0, 0.8 * height), (x + 0.35 * x, 0, 0.75 * height), (x + 0.35 * x, 0, 0.4 * height),
                      (0.7 * x, 0, 0.35 * height)], 0.007, 10)  # fmt: skip
    machine = Assembly("body", body, 700.0)

    share, seam = rng.uniform(0.6, 1.0), height + GAP
    rise = x * rng.uniform(0.08, 0.45)
    side_x, side_y = share * x, share * y
    lid = hull_of(
        box((-side_x, -side_y, seam), (side_x, side_y, seam + 0.3 * rise), fillet=share * radius, axis=2, steps=5),
        box(0.7 * side_x, 0.7 * side_y, (seam, seam + rise), fillet=0.7 * share * radius, axis=2, steps=5),
    )
    if rng.random() < 0.75:
        grip = x * rng.uniform(0.08, 0.16)
        top = seam + rise
        lid += rod(0, 0, (top - 0.002, top + grip), 0.6 * grip, sections=14)
        lid += rod(0, 0, (top + 0.9 * grip, top + 1.8 * grip), 1.3 * grip, grip, 18)
    if rng.random() < 0.65:
        joint = prismatic("body", (0, 0, 1), 0.0, height * power(12.0, rng.uniform(-1.0, -0.1)), (0, 0, seam))
    else:
        hinge, half = (side_x + 0.006, 0.0, seam + 0.002), 0.3 * side_y
        lid += box((side_x - 0.3 * x, hinge[0]), half, (seam, seam + 0.004))
        lid += rod(hinge[0], (-half, half), hinge[2], 0.002, sections=10)
        joint = revolute("body", (0, 1, 0), hinge, 0.0, np.deg2rad(rng.uniform(60.0, 110.0)))
    machine.add("lid", lid, joint)
    if niche and rng.random() < 0.6:
        _controls(rng, machine, -x, 0.5 * (y - radius) if radius < 0.7 * y else 0.001, height - head, height)
    return machine
