"""Carts to pull: wagons whose front axle steers, and hand carts on two large wheels."""

import numpy as np

from artsim.common.elementary import arctan2, cos, sin
from artsim.families.details import rounded_tray
from artsim.families.wheels import GAP, STEEL, Wheels, bar
from artsim.making.assembly import Assembly, Rng, pick, revolute
from artsim.making.outlines import UP, about
from artsim.making.solids import box, cylinder, hull_of, rod, tube, union


def wagon(rng: Rng) -> Assembly:
    """A tray on four wheels; the front axle steers with the drawbar."""
    wheels = Wheels(rng, rng.uniform(0.07, 0.15), rng.uniform(0.03, 0.06))
    length, half = rng.uniform(0.7, 1.1), rng.uniform(0.2, 0.32)
    floor = 2.0 * wheels.radius + 0.03 + 3.0 * GAP
    tall = rng.uniform(0.08, 0.3)
    radius = rng.uniform(0.01, 0.08)
    if rng.random() < 0.5:
        body = rounded_tray((-0.5 * length, -half, floor), (0.5 * length, half, floor + tall), 0.006, radius,
                            ((0.0, rng.uniform(0.0, 0.04)), (1.0, 0.0)))  # fmt: skip
    else:  # stakes and boards
        body = box(0.5 * length, half, (floor, floor + 0.02))
        boards = int(rng.integers(1, 4))
        for k in range(boards):
            z0 = floor + 0.02 + (k + 0.3) * tall / boards
            z1 = z0 + 0.6 * tall / boards
            for s in (-1.0, 1.0):
                body += box(0.5 * length, (s * half, s * (half - 0.015)), (z0, z1))
                body += box((s * 0.5 * length, s * (0.5 * length - 0.015)), half, (z0, z1))
        for sx in (-1.0, 1.0):
            for sy in (-1.0, 1.0):
                x, y = sx * (0.5 * length - 0.025), sy * (half - 0.025)
                body += box((x - 0.012, x + 0.012), (y - 0.012, y + 0.012), (floor, floor + 0.02 + tall))
    x_front, x_back = -0.5 * length + 1.3 * wheels.radius, 0.5 * length - 1.2 * wheels.radius
    track = half - 0.5 * wheels.wide
    inner = track - 0.5 * wheels.wide - GAP
    z = wheels.radius
    body += box((x_back - 0.02, x_back + 0.02), inner - 0.03, (z - 0.015, floor + 0.002))
    body += rod(x_back, (-inner, inner), z, 0.012, sections=12)
    cart = Assembly("body", body, 500.0)
    top = floor - GAP
    axle = rod(x_front, 0, (top, top - 0.015), 0.4 * half, sections=20)
    axle += box((x_front - 0.02, x_front + 0.02), 0.35 * half, (z - 0.015, top - 0.005))
    axle += rod(x_front, (-inner, inner), z, 0.012, sections=12)
    limit = rng.uniform(0.3, 0.6)
    # Steered all the way and turned up, the drawbar stays in front of the tray's lower edge.
    rise, ahead = floor - z, (x_front + 0.5 * length + 0.04) / cos(limit)
    nose = x_front - max(0.5 * wheels.radius, 0.06, ahead - rise * rng.uniform(0.2, 1.2))
    steepest = float(arctan2(rise, max(ahead - (x_front - nose), 0.15 * rise)))
    axle += box((nose, x_front), 0.025, (z - 0.012, z + 0.012))
    cart.add("axle", axle, revolute("body", UP, (x_front, 0, top), -limit, limit), density=STEEL)
    long = rng.uniform(0.5, 0.85)
    start = rng.uniform(0.35, 0.95) * steepest
    pivot = np.array([nose - 0.014, 0.0, z])
    out = np.array([-cos(start), 0.0, sin(start)])
    drawbar = cylinder(pivot - (0, 0.022, 0), pivot + (0, 0.022, 0), 0.011, sections=12)
    drawbar += tube([pivot, pivot + long * out], 0.009, 8)
    if rng.random() < 0.6:
        grip = pivot + long * out
        drawbar += cylinder(grip - (0, 0.07, 0), grip + (0, 0.07, 0), 0.013, sections=12)
    else:
        across = np.array([0.0, 0.06, 0.0])
        tip = pivot + long * out
        loop = [tip, tip + across + 0.06 * out, tip + 0.13 * out, tip - across + 0.06 * out]
        drawbar += tube(np.array(loop), 0.008, 6, closed=True)
    cart.add("handle", drawbar, revolute("axle", (0, 1, 0), pivot, -0.8 * start, steepest - start), density=STEEL)
    for x, parent in ((x_front, "axle"), (x_back, "body")):
        for s in (-1.0, 1.0):
            wheels.add(cart, (x, s * track, z), parent)
    return cart


def hand_cart(rng: Rng) -> Assembly:
    """A box or a bed between two large wheels, with shafts to the front, and by chance a tailgate that folds down."""
    wheels = Wheels(rng, rng.uniform(0.2, 0.45), rng.uniform(0.03, 0.07))
    wheels.style = pick(rng, ["spokes", "spokes", "rim"])
    wheels.spokes, wheels.hub = int(rng.integers(6, 11)), wheels.radius * rng.uniform(0.12, 0.25)
    length, half = rng.uniform(0.8, 1.5), rng.uniform(0.28, 0.5)
    low = wheels.radius + rng.uniform(-0.02, 0.12)
    tall, wall = rng.uniform(0.12, 0.45) if rng.random() < 0.7 else 0.0, rng.uniform(0.012, 0.025)
    front, back = -0.5 * length, 0.5 * length
    body = box((front, back), half, (low, low + wall))
    gate = tall > 0 and rng.random() < 0.55
    flare = rng.uniform(0.0, 0.12)
    if tall > 0:
        top = low + tall
        for s in (-1.0, 1.0):
            foot = sorted((s * half, s * (half - wall)))
            rim = sorted((s * (half + flare), s * (half + flare - wall)))
            if rng.random() < 0.5 or flare > 0.04:  # a board
                body += hull_of(box((front, foot[0], low), (back, foot[1], low + wall)),
                                box((front, rim[0], top - wall), (back, rim[1], top)))  # fmt: skip
                continue
            for share in np.linspace(0.02, 0.98, int(rng.integers(4, 9))).tolist():  # stakes and a rail
                x = front + share * length
                y = s * (half - 0.5 * wall)
                body += bar((x, y, low), (x, y + s * flare, top), 0.4 * wall, 6)
            body += tube([(front, s * (half - 0.5 * wall + flare), top), (back, s * (half - 0.5 * wall + flare), top)],
                         0.5 * wall, 8)  # fmt: skip
        ends = [front] if gate else [front, back - wall]
        body += union(box((x, x + wall), half, (low, top - (0.0 if rng.random() < 0.5 else 0.3 * tall))) for x in ends)
    x_axle = rng.uniform(-0.1, 0.15) * length
    y_wheel = half + flare + 0.5 * wheels.wide + 0.012
    z = wheels.radius
    reach = y_wheel - 0.5 * wheels.wide - GAP
    body += rod(x_axle, (-reach, reach), z, 0.015, sections=12)
    for s in (-1.0, 1.0):
        body += box(about(x_axle, 0.04), about(s * 0.7 * half, 0.02), (min(z, low) - 0.02, low + 0.002))
    r, reach = rng.uniform(0.012, 0.02), rng.uniform(0.5, 1.1)
    rise = rng.uniform(-0.1, 0.25)
    under = low - r
    tips = []
    for s in (-1.0, 1.0):
        y = s * half * rng.uniform(0.7, 0.72)
        tip = np.array([front - reach, s * half * 0.75, under + rise])
        body += tube(np.array([(back - 0.02, y, under), (front, y, under), tip]), r, 8)
        tips.append(tip)
    if rng.random() < 0.6:
        body += bar(tips[0], tips[1], 1.1 * r)
    if rng.random() < 0.5:  # a prop on which it stands level
        for s in (-1.0, 1.0):
            body += tube([(front + 0.1, s * 0.6 * half, under), (front + 0.08, s * 0.6 * half, 0.8 * r)], 0.8 * r, 8)
    cart = Assembly("body", body, 500.0)
    if gate:
        x = back + GAP
        leaf = box((x, x + wall), half - 0.004, (low + 0.004, low + tall))
        hinge = revolute("body", (0, 1, 0), (x + wall, 0, low + 0.004), 0.0, rng.uniform(1.0, 2.4))
        cart.add("tailgate", leaf, hinge, label="door")
    for s in (-1.0, 1.0):
        wheels.add(cart, (x_axle, s * y_wheel, z))
    return cart
