"""Suitcases: trolleys, briefcases and bags; upright, closed at rest.

Trolleys have a shell that opens at one side, a telescopic handle of one or two stages (the second follows the first),
and two wheels or four casters that also swivel. Briefcases open downward to the front and have a handle that folds.
Bags have one or two bails, on the crown or on the sides. Sizes, corners, ribs, where the shells meet and how far they
open vary.
"""

import numpy as np

from artsim.common.elementary import arctan2, cos, power, sin
from artsim.families.details import bow_handle, rounded_tray
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute
from artsim.making.outlines import Vector, about, lifted, rounded_rectangle
from artsim.making.solids import Solid, box, cylinder, frame, hull, loft, rod, tube, union
from artsim.model.kinematics import Array

GAP = 0.001


def build(rng: Rng) -> Assembly:
    """A trolley, a briefcase or a bag."""
    return pick(rng, {_trolley: 0.5, _briefcase: 0.3, _bag: 0.2})(rng)


def _shells(rng: Rng, x: float, y: float, low: float, high: float, seam: float) -> tuple[Solid, Solid]:
    """Front and back half with round corners, open towards one another at X = ``seam``; ribs stand out of both."""
    radius = rng.uniform(0.05, 0.5) * min(y, 0.15)
    front, back = seam - GAP / 2 + x, x - seam - GAP / 2
    bevel = min(rng.uniform(0.3, 0.9) * radius, 0.6 * front, 0.6 * back)
    halves = []
    for depth, side in ((front, 1), (back, -1)):
        edge = [(0.0, bevel), (0.3 * bevel / depth, 0.3 * bevel), (bevel / depth, 0.0), (1.0, 0.0)]
        low_x, high_x = (-x, seam - GAP / 2) if side > 0 else (seam + GAP / 2, x)
        shell = rounded_tray((low_x, -y, low), (high_x, y, high), 0.003, radius, edge, axis=0, side=side)
        halves.append(shell)
    count = int(rng.choice([0, 0, 3, 5, 7]))
    upright = rng.random() < 0.6
    room = bevel + 0.02
    for k in range(count):
        share = (k + 0.5) / count
        if upright:
            middle, half = (2 * share - 1) * (y - room), 0.25 * (y - room) / count
            rib_low, rib_high = (middle - half, low + room), (middle + half, high - room)
        else:
            middle, half = low + room + share * (high - low - 2 * room), 0.12 * (high - low) / count
            rib_low, rib_high = (-y + room, middle - half), (y - room, middle + half)
        halves[0] += box((-x - 0.004, *rib_low), (-x + 0.002, *rib_high), fillet=0.003, steps=2)
    return halves[0], halves[1]


def _trolley(rng: Rng) -> Assembly:
    y, x = rng.uniform(0.16, 0.26), rng.uniform(0.1, 0.16)
    lift = rng.uniform(0.045, 0.06)
    high = lift + 2 * y * rng.uniform(1.35, 1.65)
    seam = float(rng.choice([0.0, -0.45 * x]))
    front, back = _shells(rng, x, y, lift, high, seam)
    side = float(rng.choice([-1.0, 1.0]))  # of the hinge
    hinge_y = side * (y + 0.004)
    for share in (0.2, 0.5, 0.8):
        z = lift + share * (high - lift)
        front += rod(seam, hinge_y, (z - 0.025, z + 0.025), 0.0022, sections=12)
        front += box((seam - 0.012, min(hinge_y, side * (y - 0.002)), z - 0.025),
                     (seam - GAP / 2, max(hinge_y, side * (y - 0.002)), z + 0.025))  # fmt: skip
    middle = 0.5 * (x + seam)
    back += bow_handle((middle, -0.07, high), (middle, 0.07, high), (0, 0, 1), 0.03, 0.007)
    if rng.random() < 0.6:
        center = 0.5 * (lift + high)
        back += bow_handle(
            (middle, -side * y, center - 0.07), (middle, -side * y, center + 0.07), (0, -side, 0), 0.03, 0.007
        )
    half = rng.uniform(0.35, 0.6) * y
    back += _housing(x, half, lift, high)

    wheel_x = x - 0.05
    front_x = -wheel_x if seam == 0.0 else seam + 0.04
    spinner = rng.random() < 0.7 and wheel_x - front_x > 0.09  # four casters that clear one another
    if spinner:
        places = [(wheel_x, s * (y - 0.05), "body") for s in (-1, 1)]
        places += [(front_x, s * (y - 0.05), "lid" if front_x < seam else "body") for s in (-1, 1)]
        for px, py, parent in places:
            mount = rod(px, py, (lift - 0.003, lift + 0.02), 0.022, 0.026, 16)
            front, back = (front + mount, back) if parent == "lid" else (front, back + mount)
    else:
        places = []
        for s in (-1.0, 1.0):  # feet in front, wheel arches behind
            back += box((seam + 0.004, seam + 0.017), about(s * (y - 0.05), 0.012), (0.0, lift + 0.01), fillet=0.003)
            for cheek in (-0.022, 0.022):
                across = about(s * (y - 0.04) + cheek, 0.004)
                back += box((wheel_x - 0.02, wheel_x + 0.022), across, (0.022, lift + 0.01))
    case = Assembly("body", back, 300.0)
    limit = np.deg2rad(rng.uniform(60.0, 175.0))
    case.add("lid", front, revolute("body", (0, 0, -side), (seam, hinge_y, high / 2), 0.0, limit))
    _telescope(rng, case, x, half, lift, high)
    for number, (px, py, parent) in enumerate(places):
        _caster(case, number, px, py, lift - 0.003, parent)
    if not spinner:
        for number, s in enumerate((-1.0, 1.0)):
            radius = 0.5 * (lift - 0.004)
            axle = np.array([wheel_x, s * (y - 0.04), radius])
            roll = cylinder(axle - (0, 0.0165, 0), axle + (0, 0.0165, 0), radius, sections=24)
            case.add(f"wheel_{number}", roll, continuous("body", (0, 1, 0), tuple(axle)), density=900.0)
    return case


def _housing(x: float, half: float, low: float, high: float) -> Solid:
    """Cover behind the back, open at the top, in which the telescopic handle slides."""
    y, z0, z1 = half + 0.016, low + 0.02, high - 0.01
    solid = box((x + 0.019, x + 0.023), y, (z0, z1)) + box((x - 0.002, x + 0.02), y, (z0, z0 + 0.012))
    return solid + union(box((x - 0.002, x + 0.0225), (s * y - 0.002, s * y + 0.002), (z0, z1)) for s in (-1, 1))


def _telescope(rng: Rng, case: Assembly, x: float, half: float, low: float, high: float) -> None:
    """Two rods with a grip, pulled out upward; with two stages, the inner rods follow the outer tubes."""
    z0, z1 = low + 0.035, high - 0.012
    travel = rng.uniform(0.6, 0.8) * (z1 - z0)
    middle = x + 0.0095
    grip_low, grip_high = (middle - 0.008, -half - 0.011, high + 0.004), (middle + 0.008, half + 0.011, high + 0.024)
    grip = box(grip_low, grip_high, fillet=0.006)
    if rng.random() < 0.6:
        rods = union(box(about(middle, 0.006), about(s * half, 0.008), (z0, high + 0.01)) for s in (-1, 1))
        case.add("handle", grip + rods, prismatic("body", (0, 0, 1), 0.0, travel, (middle, 0, high)), density=800.0)
        return
    tubes = box((middle - 0.0075, middle + 0.0075), half, (z0, z0 + 0.012))
    for s in (-1, 1):
        near, far = (middle - 0.0075, s * half - 0.009, z0), (middle + 0.0075, s * half + 0.009, z1 - 0.001)
        tubes += frame(near, far, [0.002] * 4, 0, 1)
    rods = union(box(about(middle, 0.0045), about(s * half, 0.006), (z0 + 0.014, high + 0.01)) for s in (-1, 1))
    travel *= 0.9
    case.add("handle_stage", tubes, prismatic("body", (0, 0, 1), 0.0, travel, (middle, 0, high)), density=800.0)
    follows = prismatic("handle_stage", (0, 0, 1), 0.0, travel, (middle, 0, high), mimic=("handle_stage", 1.0))
    case.add("handle", grip + rods, follows, density=800.0)


def _caster(case: Assembly, number: int, x: float, y: float, top: float, parent: str) -> None:
    """A fork that swivels below its mount, and a wheel in it."""
    radius, offset = 0.5 * (top - 0.009), 0.012
    fork = rod(x, y, (top - 0.007, top - GAP), 0.02, sections=16)
    center = np.array([x + offset, y, radius])
    for s in (-1.0, 1.0):
        side = y + s * 0.0125
        fork += hull(np.concatenate([
            [(x + a, side + b, top - 0.006) for a in (-0.01, 0.014) for b in (-0.002, 0.002)],
            [(center[0] + a, side + b, radius - 0.005) for a in (-0.006, 0.006) for b in (-0.002, 0.002)],
        ]))  # fmt: skip
    case.add(f"caster_{number}", fork, continuous(parent, (0, 0, 1), (x, y, top)), density=900.0)
    wheel = cylinder(center - (0, 0.0095, 0), center + (0, 0.0095, 0), radius, sections=20)
    case.add(f"wheel_{number}", wheel, continuous(f"caster_{number}", (0, 1, 0), tuple(center)), density=900.0)


def _briefcase(rng: Rng) -> Assembly:
    y, z = rng.uniform(0.16, 0.34), rng.uniform(0.24, 0.6)
    x = rng.uniform(0.035, 0.14)
    seam = float(rng.uniform(-0.55, 0.35)) * x
    front, back = _shells(rng, x, y, 0.0, z, seam)
    barrel = 0.003
    for share in (-0.6, 0.6):
        ends = (share * y - 0.03, share * y + 0.03)
        front += rod(seam, (ends[0], ends[1]), -barrel - 0.001, barrel, sections=12)
        front += box((seam - 0.012, seam - GAP / 2), (ends[0], ends[1]), (-barrel - 0.001, 0.002))
    middle = 0.5 * (x + seam)
    half = rng.uniform(0.05, 0.08)
    handle, lugs = _bail((middle, 0.0, z + 0.0085), half, rng.uniform(0.035, 0.06), 0.0055, (0, 0, -1), 0.0095)
    for s in (-1.0, 1.0):  # locks beside the handle
        front += box((seam - 0.02, seam - GAP / 2), (s * 0.6 * y - 0.02, s * 0.6 * y + 0.02), (z - 0.002, z + 0.004))
    if rng.random() < 0.6:
        back += union(rod(0.6 * x, s * 0.8 * y, (-0.008, 0.003), 0.008, 0.01, 12) for s in (-1, 1))
    fixed = rng.random() < 0.35  # the handle
    case = Assembly("body", back + lugs + handle if fixed else back + lugs, 300.0)
    limit = np.deg2rad(rng.uniform(45.0, 175.0))
    case.add("lid", front, revolute("body", (0, -1, 0), (seam, 0, -barrel - 0.001), 0.0, limit))
    if not fixed:
        most = rng.uniform(0.9, 1.35)
        case.add("handle", handle, revolute("body", (0, 1, 0), (middle, 0, z + 0.0085), -most, most), density=900.0)
    return case


def _bail(center: Vector, half: float, height: float, wire: float, toward: Vector, drop: float) -> tuple[Solid, Solid]:
    """Handle that turns about the Y axis through ``center`` between two pairs of lugs; the lugs end ``drop`` away."""
    x, _, z = center
    angles = np.linspace(0.0, np.pi, 15)
    cosine = cos(angles)
    path: Array = np.column_stack(
        [np.full(15, x), half * np.sign(cosine) * power(np.abs(cosine), 0.6), z + height * power(sin(angles), 0.7)]
    )
    handle, lugs = tube(path, wire, 10), Solid()
    barrel = wire + 0.001
    for s in (-1.0, 1.0):
        handle += rod(x, (s * half - 0.006, s * half + 0.006), z, barrel, sections=12)
        for side in (-0.009, 0.009):
            y = s * half + side
            low, high = np.array([x - 0.005, y - 0.002, z - 0.005]), np.array([x + 0.005, y + 0.002, z + 0.005])
            shift = np.asarray(toward) * drop
            lugs += box(np.minimum(low, low + shift), np.maximum(high, high + shift))
    return handle, lugs


def _bag(rng: Rng) -> Assembly:
    """Bag with a closed body and one or two bails."""
    y = rng.uniform(0.13, 0.26)
    z, x = y * rng.uniform(0.8, 1.8), y * rng.uniform(0.22, 0.7)
    kind = int(rng.integers(3))
    top = rng.uniform(0.25, 0.7) if kind == 0 else 1.0
    flare = rng.uniform(0.75, 1.0)
    if kind == 2:  # duffel: round across Y
        z = 2 * x * rng.uniform(0.9, 1.15)
        angles = np.linspace(0.0, 2 * np.pi, 25)[:-1]
        rings = [
            np.column_stack([k * x * cos(angles), np.full(24, w), z / 2 + k * z / 2 * sin(angles)])
            for k, w in ((0.86, -y), (1.0, -0.92 * y), (1.0, 0.92 * y), (0.86, y))
        ]
        body = loft(rings)
    else:
        shares = np.array([0.0, 0.12, 1.0])
        sizes = [(0.9, 0.95), (1.0, 1.0), (top, flare)]
        rings = [_outline(a * x, b * y, s * z) for s, (a, b) in zip(shares, sizes, strict=True)]
        if kind == 1:  # rounded top
            rings += [_outline(0.75 * x, 0.85 * flare * y, 1.1 * z), _outline(0.3 * x, 0.6 * flare * y, 1.16 * z)]
        body = loft(rings)
    bag = Assembly("body", body, 150.0)
    upright = kind == 2 or rng.random() < 0.45  # one bail on the crown, instead of bails on the sides
    wire = rng.uniform(0.004, 0.007)
    half = rng.uniform(0.35, 0.92 if kind == 0 else 0.6) * (flare if kind == 0 else 1.0) * y
    height = rng.uniform(0.5, 1.9) * half
    if upright:
        crown, most = body.bounds()[1, 2], rng.uniform(1.0, 1.57)
        handle, lugs = _bail((0.0, 0.0, crown + wire + 0.004), half, height, wire, (0, 0, -1), wire + 0.02)
        bag.body += lugs
        bag.add("handle", handle, revolute("body", (0, 1, 0), (0, 0, crown + wire + 0.004), -most, most), density=500.0)
        return bag
    pivot = rng.uniform(0.62, 0.8) * z
    face = x * (1.0 + (top - 1.0) * (pivot / z - 0.12) / 0.88)
    slope = float(arctan2((1.0 - top) * x, 0.88 * z))  # of the sides, which the bails hang down to
    limit = rng.uniform(0.55, 1.0) * (np.pi - 0.15 - slope)
    for s in pick(rng, {(-1.0, 1.0): 0.55, (-1.0,): 0.3, (1.0,): 0.15}):
        place = (s * (face + wire + 0.004), 0.0, pivot)
        handle, lugs = _bail(place, half, height, wire, (-s, 0, 0), wire + 0.02)
        bag.body += lugs
        bag.add_numbered("handle", handle, revolute("body", (0, s, 0), place, 0.0, limit), density=500.0)
    return bag


def _outline(x: float, y: float, z: float) -> Array:
    """(N, 3) rounded rectangle at a height."""
    return lifted(rounded_rectangle((-x, -y), (x, y), 0.5 * min(x, y), 3), z)
