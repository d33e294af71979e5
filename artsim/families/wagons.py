"""Carts to pull: wagons whose front axle steers, and hand carts on two large wheels."""

import numpy as np

from artsim.common.elementary import arctan2, cos, sin
from artsim.families.details import rounded_tray
from artsim.families.wheels import GAP, STEEL, Wheels, bar
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, UP, about, ends
from artsim.making.solids import box, cylinder, hull_of, rod, tube


def wagon(draws: Draws) -> Assembly:
    """A tray on four wheels; the front axle steers with the drawbar."""
    wheels = Wheels(draws, (0.07, 0.15), (0.03, 0.06))
    length, half = draws.length("depth", (0.7, 1.1)), 0.5 * draws.length("width", (0.4, 0.64))
    floor = 2.0 * wheels.radius + 0.03 + 3.0 * GAP
    tall, radius = draws.lengths(tray_height=(0.08, 0.3), tray_corner=(0.01, 0.08))
    if draws.chance("moulded", 0.5):
        profile = ((0.0, draws.length("tray_taper", (0.0, 0.04))), (1.0, 0.0))
        low, high = (-0.5 * length, -half, floor), (0.5 * length, half, floor + tall)
        body = rounded_tray(low, high, 0.006, radius, profile)
    else:  # stakes and boards
        body = box(0.5 * length, half, (floor, floor + 0.02))
        boards = draws.integer("boards", 1, 3)
        for k in range(boards):
            z0 = floor + 0.02 + (k + 0.3) * tall / boards
            z1 = z0 + 0.6 * tall / boards
            for s in (-1.0, 1.0):
                body += box(0.5 * length, (s * half, s * (half - 0.015)), (z0, z1))
                body += box((s * 0.5 * length, s * (0.5 * length - 0.015)), half, (z0, z1))
        for sx in (-1.0, 1.0):
            for sy in (-1.0, 1.0):
                x, y = sx * (0.5 * length - 0.025), sy * (half - 0.025)
                body += box(about(x, 0.012), about(y, 0.012), (floor, floor + 0.02 + tall))
    x_front, x_back = -0.5 * length + 1.3 * wheels.radius, 0.5 * length - 1.2 * wheels.radius
    track = half - 0.5 * wheels.wide
    inner = track - 0.5 * wheels.wide - GAP
    z = wheels.radius
    body += box(about(x_back, 0.02), inner - 0.03, (z - 0.015, floor + 0.002))
    body += rod(x_back, (-inner, inner), z, 0.012, sections=12)
    cart = Assembly("body", body, 500.0)
    top = floor - GAP
    axle = rod(x_front, 0, (top, top - 0.015), 0.4 * half, sections=20)
    axle += box(about(x_front, 0.02), 0.35 * half, (z - 0.015, top - 0.005))
    axle += rod(x_front, (-inner, inner), z, 0.012, sections=12)
    limit = draws.angle("axle_angle", (0.3, 0.6))
    # Steered all the way and turned up, the drawbar stays in front of the tray's lower edge.
    rise, ahead = floor - z, (x_front + 0.5 * length + 0.04) / cos(limit)
    nose = x_front - max(0.5 * wheels.radius, 0.06, ahead - rise * draws.number("nose", (0.2, 1.2)))
    steepest = float(arctan2(rise, max(ahead - (x_front - nose), 0.15 * rise)))
    axle += box((nose, x_front), 0.025, (z - 0.012, z + 0.012))
    cart.add("axle", axle, revolute("body", UP, (x_front, 0, top), -limit, limit), density=STEEL)
    long = draws.length("handle_length", (0.5, 0.85))
    start = draws.number("handle_slope", (0.35, 0.95)) * steepest
    pivot = np.array([nose - 0.014, 0.0, z])
    out = np.array([-cos(start), 0.0, sin(start)])
    tip = pivot + long * out
    drawbar = cylinder(pivot - (0, 0.022, 0), pivot + (0, 0.022, 0), 0.011, sections=12) + tube([pivot, tip], 0.009, 8)
    if draws.chance("bar_grip", 0.6):
        drawbar += cylinder(tip - (0, 0.07, 0), tip + (0, 0.07, 0), 0.013, sections=12)
    else:
        loop = [tip, tip + 0.06 * SIDE + 0.06 * out, tip + 0.13 * out, tip - 0.06 * SIDE + 0.06 * out]
        drawbar += tube(np.array(loop), 0.008, 6, closed=True)
    cart.add("handle", drawbar, revolute("axle", SIDE, pivot, -0.8 * start, steepest - start), density=STEEL)
    for x, parent in ((x_front, "axle"), (x_back, "body")):
        for s in (-1.0, 1.0):
            wheels.add(cart, (x, s * track, z), parent)
    return cart


def hand_cart(draws: Draws) -> Assembly:
    """A box or a bed between two large wheels, with shafts to the front, and by chance a tailgate that folds down."""
    wheels = Wheels(draws, (0.2, 0.45), (0.03, 0.07), large=True)
    length, half = draws.length("depth", (0.8, 1.5)), 0.5 * draws.length("width", (0.56, 1.0))
    low = wheels.radius + draws.length("floor_lift", (-0.02, 0.12))
    tall = draws.length("side_height", (0.12, 0.45)) if draws.chance("side", 0.7) else 0.0
    wall = draws.length("wall", (0.012, 0.025))
    front, back = -0.5 * length, 0.5 * length
    body = box((front, back), half, (low, low + wall))
    gate = tall > 0 and draws.chance("tailgate", 0.55)
    flare = draws.length("flare", (0.0, 0.12))
    if tall > 0:
        top = low + tall
        for s in (-1.0, 1.0):
            near, far = ends((s * half, s * (half - wall))), ends((s * (half + flare), s * (half + flare - wall)))
            if draws.chance("boarded", 0.5) or flare > 0.04:
                body += hull_of(box((front, back), near, (low, low + wall)), box((front, back), far, (top - wall, top)))
                continue
            y = s * (half - 0.5 * wall)
            for share in np.linspace(0.02, 0.98, draws.integer("stakes", 4, 8)).tolist():  # stakes and a rail
                x = front + share * length
                body += bar((x, y, low), (x, y + s * flare, top), 0.4 * wall, 6)
            y = s * (half - 0.5 * wall + flare)
            body += tube([(front, y, top), (back, y, top)], 0.5 * wall, 8)
        for x in [front] if gate else [front, back - wall]:
            body += box((x, x + wall), half, (low, top - (0.0 if draws.chance("full_end", 0.5) else 0.3 * tall)))
    x_axle = draws.number("axle_shift", (-0.1, 0.15)) * length
    y_wheel = half + flare + 0.5 * wheels.wide + 0.012
    z = wheels.radius
    reach = y_wheel - 0.5 * wheels.wide - GAP
    body += rod(x_axle, (-reach, reach), z, 0.015, sections=12)
    for s in (-1.0, 1.0):
        body += box(about(x_axle, 0.04), about(s * 0.7 * half, 0.02), (min(z, low) - 0.02, low + 0.002))
    r, reach = draws.lengths(shaft_radius=(0.012, 0.02), shaft_length=(0.5, 1.1))
    under = low - r
    tip = (front - reach, half * 0.75, under + draws.length("shaft_rise", (-0.1, 0.25)))
    for s in (-1.0, 1.0):
        y = s * half * draws.number("shaft_spread", (0.7, 0.72))
        body += tube([(back - 0.02, y, under), (front, y, under), (tip[0], s * tip[1], tip[2])], r, 8)
    if draws.chance("crossbar", 0.6):
        body += bar((tip[0], -tip[1], tip[2]), tip, 1.1 * r).called("handle", FRONT)
    if draws.chance("prop", 0.5):  # a prop on which it stands level
        for s in (-1.0, 1.0):
            body += tube([(front + 0.1, s * 0.6 * half, under), (front + 0.08, s * 0.6 * half, 0.8 * r)], 0.8 * r, 8)
    cart = Assembly("body", body, 500.0)
    if gate:
        x = back + GAP
        leaf = box((x, x + wall), half - 0.004, (low + 0.004, low + tall))
        hinge = revolute("body", SIDE, (x + wall, 0, low + 0.004), 0.0, draws.angle("tailgate_angle", (1.0, 2.4)))
        cart.add("tailgate", leaf, hinge, label="door")
    for s in (-1.0, 1.0):
        wheels.add(cart, (x_axle, s * y_wheel, z))
    return cart
