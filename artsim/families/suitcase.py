"""Suitcases: trolleys, briefcases and bags; upright, closed at rest.

Trolleys have a shell that opens at one side, a telescopic handle of one or two stages (the second follows the first),
and two wheels or four casters that also swivel. Briefcases open downward to the front and have a handle that folds.
Bags have one or two bails, on the crown or on the sides. Sizes, corners, ribs, where the shells meet and how far they
open vary.
"""

import numpy as np

from artsim.common.elementary import arctan2, cos, power, sin
from artsim.families.details import bow_handle, rounded_tray
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import SIDE, UP, Array, Vector, about, ends, lifted, rounded_rectangle
from artsim.making.solids import Solid, box, cylinder, frame, hull, loft, rod, tube, union

GAP = 0.001


def build(draws: Draws) -> Assembly:
    """A trolley, a briefcase or a bag."""
    return draws.one_of("kind", {"trolley": _trolley, "briefcase": _briefcase, "bag": _bag}, (0.5, 0.3, 0.2))(draws)


def _shells(draws: Draws, x: float, y: float, low: float, high: float, seam: float) -> tuple[Solid, Solid]:
    """Front and back half with round corners, open towards one another at X = ``seam``; ribs stand out of both."""
    radius = draws.number("corner", (0.05, 0.5)) * min(y, 0.15)
    front, back = seam - GAP / 2 + x, x - seam - GAP / 2
    bevel = min(draws.number("bevel", (0.3, 0.9)) * radius, 0.6 * front, 0.6 * back)
    halves = []
    for depth, side in ((front, 1), (back, -1)):
        edge = [(0.0, bevel), (0.3 * bevel / depth, 0.3 * bevel), (bevel / depth, 0.0), (1.0, 0.0)]
        low_x, high_x = (-x, seam - GAP / 2) if side > 0 else (seam + GAP / 2, x)
        halves.append(rounded_tray((low_x, -y, low), (high_x, y, high), 0.003, radius, edge, axis=0, side=side))
    count, upright = draws.pick("ribs", [0, 0, 3, 5, 7]), draws.chance("upright_ribs", 0.6)
    room = bevel + 0.02
    for k in range(count):
        share = (k + 0.5) / count
        if upright:
            across, tall = about((2 * share - 1) * (y - room), 0.25 * (y - room) / count), (low + room, high - room)
        else:
            middle = low + room + share * (high - low - 2 * room)
            across, tall = (-y + room, y - room), about(middle, 0.12 * (high - low) / count)
        halves[0] += box((-x - 0.004, -x + 0.002), across, tall, fillet=0.003, steps=2)
    return halves[0], halves[1]


def _trolley(draws: Draws) -> Assembly:
    """A case on wheels that stands on its narrow side."""
    y, x = 0.5 * draws.length("width", (0.32, 0.52)), 0.5 * draws.length("depth", (0.2, 0.32))
    lift = draws.length("clearance", (0.045, 0.06))
    high = lift + 2 * y * draws.number("height", (1.35, 1.65))
    seam = draws.one_of("shells", {"equal": 0.0, "shallow_lid": -0.45 * x})
    front, back = _shells(draws, x, y, lift, high, seam)
    side = draws.side("hinge_side")
    hinge_y = side * (y + 0.004)
    for share in (0.2, 0.5, 0.8):
        z = lift + share * (high - lift)
        front += rod(seam, hinge_y, (z - 0.025, z + 0.025), 0.0022, sections=12)
        front += box((seam - 0.012, seam - GAP / 2), ends((hinge_y, side * (y - 0.002))), about(z, 0.025))
    middle = 0.5 * (x + seam)
    back += bow_handle((middle, -0.07, high), (middle, 0.07, high), UP, 0.03, 0.007)
    if draws.chance("side_handle", 0.6):
        center = 0.5 * (lift + high)
        start, end = ((middle, -side * y, center + t * 0.07) for t in (-1, 1))
        back += bow_handle(start, end, (0, -side, 0), 0.03, 0.007)
    half = draws.number("handle_width", (0.35, 0.6)) * y
    # Cover behind the back, open at the top, in which the telescopic handle slides.
    y_side, z0, z1 = half + 0.016, lift + 0.02, high - 0.01
    back += box((x + 0.019, x + 0.023), y_side, (z0, z1)) + box((x - 0.002, x + 0.02), y_side, (z0, z0 + 0.012))
    back += union(box((x - 0.002, x + 0.0225), about(s * y_side, 0.002), (z0, z1)) for s in (-1, 1))

    wheel_x = x - 0.05
    front_x = -wheel_x if seam == 0.0 else seam + 0.04
    spinner = draws.chance("caster", 0.7) and wheel_x - front_x > 0.09  # four casters that clear one another
    places: list[tuple[float, float, str]] = []
    if spinner:
        for px, parent in ((wheel_x, "body"), (front_x, "lid" if front_x < seam else "body")):
            for py in (0.05 - y, y - 0.05):
                places.append((px, py, parent))
                mount = rod(px, py, (lift - 0.003, lift + 0.02), 0.022, 0.026, 16)
                front, back = (front + mount, back) if parent == "lid" else (front, back + mount)
    else:
        for s in (-1.0, 1.0):  # feet in front, wheel arches behind
            back += box((seam + 0.004, seam + 0.017), about(s * (y - 0.05), 0.012), (0.0, lift + 0.01), fillet=0.003)
            for cheek in (-0.022, 0.022):
                across = about(s * (y - 0.04) + cheek, 0.004)
                back += box((wheel_x - 0.02, wheel_x + 0.022), across, (0.022, lift + 0.01))
    case = Assembly("body", back, 300.0)
    limit = draws.turn("lid_angle", (60.0, 175.0))
    case.add("lid", front, revolute("body", (0, 0, -side), (seam, hinge_y, high / 2), 0.0, limit))
    _telescope(draws, case, x, half, lift, high)
    for number, (px, py, parent) in enumerate(places):
        _caster(case, number, px, py, lift - 0.003, parent)
    if not spinner:
        for s in (-1.0, 1.0):
            radius = 0.5 * (lift - 0.004)
            axle = np.array([wheel_x, s * (y - 0.04), radius])
            roll = cylinder(axle - (0, 0.0165, 0), axle + (0, 0.0165, 0), radius, sections=24)
            case.add_numbered("wheel", roll, continuous("body", SIDE, axle), density=900.0)
    return case


def _telescope(draws: Draws, case: Assembly, x: float, half: float, low: float, high: float) -> None:
    """Two rods with a grip, pulled out upward; with two stages, the inner rods follow the outer tubes."""
    z0, z1 = low + 0.035, high - 0.012
    travel = draws.number("handle_travel", (0.6, 0.8)) * (z1 - z0)
    middle = x + 0.0095
    grip = box(about(middle, 0.008), half + 0.011, (high + 0.004, high + 0.024), fillet=0.006)
    if draws.chance("single_stage", 0.6):
        rods = union(box(about(middle, 0.006), about(s * half, 0.008), (z0, high + 0.01)) for s in (-1, 1))
        case.add("handle", grip + rods, prismatic("body", UP, 0.0, travel, (middle, 0, high)), density=800.0)
        return
    tubes = box(about(middle, 0.0075), half, (z0, z0 + 0.012))
    for s in (-1, 1):
        near, far = (middle - 0.0075, s * half - 0.009, z0), (middle + 0.0075, s * half + 0.009, z1 - 0.001)
        tubes += frame(near, far, [0.002] * 4, 0, 1)
    rods = union(box(about(middle, 0.0045), about(s * half, 0.006), (z0 + 0.014, high + 0.01)) for s in (-1, 1))
    travel *= 0.9
    case.add("handle_stage", tubes, prismatic("body", UP, 0.0, travel, (middle, 0, high)), density=800.0)
    follows = prismatic("handle_stage", UP, 0.0, travel, (middle, 0, high), mimic=("handle_stage", 1.0))
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
    case.add(f"caster_{number}", fork, continuous(parent, UP, (x, y, top)), density=900.0)
    wheel = cylinder(center - (0, 0.0095, 0), center + (0, 0.0095, 0), radius, sections=20)
    case.add(f"wheel_{number}", wheel, continuous(f"caster_{number}", SIDE, center), density=900.0)


def _briefcase(draws: Draws) -> Assembly:
    """A flat case that lies open on its back half."""
    y, z = 0.5 * draws.length("width", (0.32, 0.68)), draws.length("height", (0.24, 0.6))
    x = 0.5 * draws.length("depth", (0.07, 0.28))
    seam = draws.number("seam", (-0.55, 0.35)) * x
    front, back = _shells(draws, x, y, 0.0, z, seam)
    barrel = -0.004
    for share in (-0.6, 0.6):
        across = about(share * y, 0.03)
        front += rod(seam, across, barrel, 0.003, sections=12)
        front += box((seam - 0.012, seam - GAP / 2), across, (barrel, 0.002))
    pivot = (0.5 * (x + seam), 0.0, z + 0.0085)
    half = 0.5 * draws.length("handle_length", (0.1, 0.16))
    handle, lugs = _bail(pivot, half, draws.length("handle_height", (0.035, 0.06)), 0.0055, (0, 0, -1), 0.0095)
    for s in (-1.0, 1.0):  # locks beside the handle
        lock = box((seam - 0.02, seam - GAP / 2), about(s * 0.6 * y, 0.02), (z - 0.002, z + 0.004))
        front += lock.called("latch", UP)
    if draws.chance("feet", 0.6):
        back += union(rod(0.6 * x, s * 0.8 * y, (-0.008, 0.003), 0.008, 0.01, 12) for s in (-1, 1))
    case = Assembly("body", back + lugs, 300.0)
    fixed = draws.chance("handle_fixed", 0.35)
    case.add("lid", front, revolute("body", (0, -1, 0), (seam, 0, barrel), 0.0, draws.turn("lid_angle", (45.0, 175.0))))
    if fixed:
        case.body += handle.called("handle", UP)
    else:
        most = draws.angle("handle_angle", (0.9, 1.35))
        case.add("handle", handle, revolute("body", SIDE, pivot, -most, most), density=900.0)
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
    for s in (-1.0, 1.0):
        handle += rod(x, about(s * half, 0.006), z, wire + 0.001, sections=12)
        for side in (-0.009, 0.009):
            middle = np.array([x, s * half + side, z])
            low, high = middle - (0.005, 0.002, 0.005), middle + (0.005, 0.002, 0.005)
            shift = np.asarray(toward) * drop
            lugs += box(np.minimum(low, low + shift), np.maximum(high, high + shift))
    return handle, lugs


def _bag(draws: Draws) -> Assembly:
    """Bag with a closed body and one or two bails."""
    y = 0.5 * draws.length("width", (0.26, 0.52))
    z, x = y * draws.number("height", (0.8, 1.8)), y * draws.number("depth", (0.22, 0.7))
    kind = draws.pick("bag", ["tapered", "rounded", "duffel"])
    top = draws.number("top", (0.25, 0.7)) if kind == "tapered" else 1.0
    flare = draws.number("flare", (0.75, 1.0))
    if kind == "duffel":  # round across Y
        crown = z = 2 * x * draws.number("duffel_height", (0.9, 1.15))
        angles = np.linspace(0.0, 2 * np.pi, 25)[:-1]
        rings = [
            np.column_stack([k * x * cos(angles), np.full(24, w), z / 2 + k * z / 2 * sin(angles)])
            for k, w in ((0.86, -y), (1.0, -0.92 * y), (1.0, 0.92 * y), (0.86, y))
        ]
    else:
        levels = [(0.9, 0.95, 0.0), (1.0, 1.0, 0.12), (top, flare, 1.0)]
        if kind == "rounded":
            levels += [(0.75, 0.85 * flare, 1.1), (0.3, 0.6 * flare, 1.16)]
        sizes = np.array(levels) * (x, y, z)
        rings = [lifted(rounded_rectangle((-a, -b), (a, b), 0.5 * min(a, b), 3), c) for a, b, c in sizes.tolist()]
        crown = sizes[-1, 2]
    bag = Assembly("body", loft(rings), 150.0)
    # One bail on the crown, instead of bails on the sides.
    upright = kind == "duffel" or draws.chance("crown_handle", 0.45)
    wire = draws.length("handle_wire", (0.004, 0.007))
    half = draws.number("handle_spread", (0.35, 0.92 if kind == "tapered" else 0.6))
    half = half * (flare if kind == "tapered" else 1.0) * y
    height = draws.number("handle_rise", (0.5, 1.9)) * half
    if upright:
        most = draws.angle("handle_angle", (1.0, 1.57))
        place = (0.0, 0.0, crown + wire + 0.004)
        handle, lugs = _bail(place, half, height, wire, (0, 0, -1), wire + 0.02)
        bag.body += lugs
        bag.add("handle", handle, revolute("body", SIDE, place, -most, most), density=500.0)
        return bag
    pivot = draws.number("handle_pivot", (0.62, 0.8)) * z
    face = x * (1.0 + (top - 1.0) * (pivot / z - 0.12) / 0.88)
    slope = float(arctan2((1.0 - top) * x, 0.88 * z))  # of the sides, which the bails hang down to
    limit = draws.number("handle_swing", (0.55, 1.0)) * (np.pi - 0.15 - slope)
    sides = {"both": (-1.0, 1.0), "front": (-1.0,), "back": (1.0,)}
    for s in draws.one_of("handle_sides", sides, (0.55, 0.3, 0.15)):
        place = (s * (face + wire + 0.004), 0.0, pivot)
        handle, lugs = _bail(place, half, height, wire, (-s, 0, 0), wire + 0.02)
        bag.body += lugs
        bag.add_numbered("handle", handle, revolute("body", (0, s, 0), place, 0.0, limit), density=500.0)
    return bag
