"""Washing machines: front loaders with a porthole, top loaders with a lid.

What varies: round or square door, hinged left or right, with a glass bowl or closed; drawer for the detergent; dials,
keys and display; console of a top loader, its lid hinged at the back or at a side; a drum or agitator that turns;
feet, plinth, worktop.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import dial, front_handle, holed_plate, push_button, side_hinge
from artsim.families.proportions import with_tails
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute
from artsim.making.outlines import about
from artsim.making.solids import Solid, box, frame, hull, posts, ring, rod, tray, vessel
from artsim.model.kinematics import Array

GAP = 0.002


class Shape:
    """Measures of the cabinet in metres; its front is the plane x = 0."""

    def __init__(self, rng: Rng) -> None:
        self.low = rng.uniform(0.012, 0.03)
        self.front_loader = rng.random() < 0.7
        self.half = 0.5 * rng.uniform(0.56, 0.7)
        self.depth = rng.uniform(0.45, 0.66) if self.front_loader else rng.uniform(0.55, 0.7)
        self.high = self.low + (rng.uniform(0.8, 0.95) if self.front_loader else rng.uniform(0.85, 0.98))
        if not self.front_loader and rng.random() < 0.35:  # narrow and tall ones, for small rooms
            self.half, self.depth = 0.5 * rng.uniform(0.4, 0.56), rng.uniform(0.42, 0.6)
            self.high = self.low + rng.uniform(0.85, 1.15)


def build(rng: Rng) -> Assembly:
    """A washing machine, closed at rest."""
    shape = Shape(rng)
    return _front_loader(rng, shape) if shape.front_loader else _top_loader(rng, shape)


def _feet(s: Shape) -> Solid:
    return posts((0.06, s.depth - 0.06), s.half - 0.06, (0, s.low + 0.01), 0.025)


# --- front loaders ---------------------------------------------------------------------------------------------------


def _front_loader(rng: Rng, s: Shape) -> Assembly:
    left = bool(rng.random() < 0.75)
    sign = 1.0 if left else -1.0
    strip = s.high - rng.uniform(0.1, 0.15)  # lower edge of the strip of controls
    hole = rng.uniform(0.13, 0.175)
    z = s.low + (strip - s.low) * rng.uniform(0.5, 0.56)
    drum = min(s.half - 0.03, strip - z - 0.015, hole + 0.09)
    plate = 0.02
    box_half, box_side = rng.uniform(0.07, 0.12), rng.choice([-1.0, 1.0])
    drawer = bool(rng.random() < 0.75)

    body = tray((0.5 * plate, -s.half, s.low), (s.depth, s.half, s.high), 0.012, axis=0, side=-1) + _feet(s)
    body += holed_plate((0, -s.half, s.low), (plate, s.half, strip + 0.001), (0.0, z), hole, 0, 20)
    slot = np.array([box_side * (s.half - box_half - 0.03), 0.5 * (strip + s.high)])
    room = 0.5 * (s.high - strip) - 0.016
    proud = rng.choice([0.0, rng.uniform(0.005, 0.02)])  # of the strip
    if drawer:
        widths = [slot[0] - box_half + s.half, s.half - slot[0] - box_half, 0.016, 0.016]
        body += frame((-proud, -s.half, strip), (plate, s.half, s.high), widths)
    else:
        body += box((-proud, plate), s.half, (strip, s.high), fillet=0.003)
    if rng.random() < 0.6:
        body += box((-rng.uniform(0.0, 0.02), -s.half - 0.002, s.high - 0.001),
                            (s.depth, s.half + 0.002, s.high + rng.uniform(0.01, 0.035)), fillet=0.005)  # fmt: skip
    if rng.random() < 0.5:  # plinth and the flap of the filter
        body += box((0.012, s.depth - 0.01), s.half - 0.005, (0.0, s.low + 0.002))
        body += box((-0.0025, 0.01), (s.half - 0.2, s.half - 0.05), (s.low + 0.03, s.low + 0.12), fillet=0.004, axis=0)
    turning = bool(rng.random() < 0.6)
    bowl = rng.uniform(0.03, 0.06)
    tub = _drum(s, z, drum, hole, plate, bowl if turning else -plate / 2)
    machine = Assembly()
    machine.record(handles=True)
    machine.add("body", body if turning else body + tub, density=350.0)

    outer = hole + rng.uniform(0.03, 0.055)
    thick = rng.uniform(0.025, 0.05)
    door = _porthole(rng, z, hole, outer, thick, bowl)
    upper = np.deg2rad(rng.uniform(95.0, 160.0))
    hinge = side_hinge(-GAP - thick, sign * (outer + 0.012), upper, left)
    machine.add("door", door if left else door.mirrored(1), hinge)
    if turning:
        machine.add("drum", tub, continuous("body", (-1, 0, 0), (0, 0, z)), density=900.0)
    if drawer:
        solid = box((-proud - 0.016, slot[0] - box_half + GAP, strip + 0.012),
                            (-proud - GAP, slot[0] + box_half - GAP, s.high - 0.012), fillet=0.004)  # fmt: skip
        inner = np.array([box_half - 0.004, room - 0.003])
        solid += tray((-proud - 0.006, *(slot - inner)), (0.55 * s.depth, *(slot + inner)), 0.003)
        solid += box((-proud - 0.024, -proud - 0.012), about(slot[0], 0.4 * box_half), (strip + 0.022, strip + 0.032))
        travel = rng.uniform(0.3, 0.45) * s.depth
        machine.add("detergent_drawer", solid, prismatic("body", (-1, 0, 0), 0.0, travel, (0, *slot)))
        free = (slot[0] + box_half, s.half) if box_side < 0 else (-s.half, slot[0] - box_half)
    else:
        free = (-s.half, s.half)
    _controls(rng, machine, free, -proud, strip, s.high)
    return machine


def _drum(s: Shape, z: float, radius: float, hole: float, plate: float, gap: float) -> Solid:
    """Drum behind the porthole with three paddles; ``gap`` behind the front plate."""
    front, back = plate + gap + 0.008, s.depth - 0.05
    solid = ring((0.5 * (front + back), 0, z), (1, 0, 0), radius - 0.008, radius, back - front, 16)
    solid += rod((back - 0.004, back + 0.01), 0, z, radius, sections=16)
    solid += ring((front + 0.004, 0, z), (1, 0, 0), hole + 0.012, radius - 0.004, 0.008, 16)
    for k in range(3):
        a = 2.0 * np.pi * k / 3 + 0.4
        out, across = np.array([0.0, cos(a), sin(a)]), np.array([0.0, -sin(a), cos(a)])
        feet = [np.array([x, 0, z]) + (radius - 0.005) * out + v * across for x in (front + 0.03, back)
                for v in (-0.03, 0.03)]  # fmt: skip
        tips = [np.array([x, 0, z]) + (radius - 0.05) * out for x in (front + 0.06, back)]
        solid += hull(feet + tips)
    return solid


def _porthole(rng: Rng, z: float, hole: float, outer: float, thick: float, bowl: float) -> Solid:
    """Door with its hinge at +Y; the glass reaches into the hole."""
    x0, x1 = -GAP - thick, -GAP
    glass = hole * rng.uniform(0.72, 0.9)
    closed = rng.random() < 0.15
    if rng.random() < 0.75:
        solid = ring((0.5 * (x0 + x1), 0, z), (1, 0, 0), 0.97 * glass, outer, thick, 22)
        solid += ring((x0, 0, z), (1, 0, 0), glass + 0.012, outer - 0.012, 0.012, 16) if rng.random() < 0.5 else Solid()
    else:
        solid = holed_plate((x0, -outer, z - outer), (x1, outer, z + outer), (0.0, z), 0.97 * glass, 0, 20)
    if closed:
        solid += rod((x0 - 0.004, x1), 0, z, glass, sections=28)
    else:
        solid += rod((x0 + 0.3 * thick, x1 + 0.002), 0, z, glass * 1.02, sections=28)
    # The bowl is narrow enough to swing past the rim of the hole.
    solid += rod((x1 - 0.002, x1 + bowl), 0, z, hole - 0.008, 0.78 * hole, 28)
    for side in (-0.35, 0.35):  # hinges
        solid += box((x1 - 0.014, x1), (0.6 * outer, outer + 0.01), (z + side * outer - 0.02, z + side * outer + 0.02))
    y, reach = 0.018 - outer, rng.uniform(0.03, 0.05)
    if rng.random() < 0.5:
        grip = 0.25 * outer
        return solid + box((x0 - 0.012, x0 + 0.01), (y - 0.004, y + 0.014), (z - grip, z + grip))
    start, end = (x0, 0.02 - 0.97 * outer, z - 0.1 * outer), (x0, 0.02 - 0.97 * outer, z + 0.1 * outer)
    return solid + front_handle(pick(rng, ["bow", "flat"]), start, end, reach, 0.006)


# --- top loaders -----------------------------------------------------------------------------------------------------


def _top_loader(rng: Rng, s: Shape) -> Assembly:
    console = rng.uniform(0.09, 0.16)  # depth of the console at the back
    rise = rng.uniform(0.08, 0.18)
    back = s.depth - console
    deck, thick = 0.03, rng.uniform(0.02, 0.04)
    radius = min(0.5 * back - 0.05, s.half - 0.05)
    center = np.array([0.5 * back, 0.0])
    body = tray((0, -s.half, s.low), (s.depth, s.half, s.high - 0.5 * deck), 0.012) + _feet(s)
    body += holed_plate((0, -s.half, s.high - deck), (s.depth, s.half, s.high), center, radius, 2, 20)
    slope = rng.uniform(0.0, 0.5) * console
    face = [
        (back + 0.004, s.high - 0.002),
        (back + 0.004 + slope, s.high + rise),
        (s.depth, s.high + rise),
        (s.depth, s.high - 0.002),
    ]
    body += hull([(x, y, z) for x, z in face for y in (-s.half, s.half)])
    upright = slope < 0.2 * console
    if upright:  # dials stand on its face
        body += box((back + 0.003, back + 0.02 + slope), 0.95 * s.half, (s.high + 0.02, s.high + rise - 0.01))
    if rng.random() < 0.5:  # a raised board in front
        body += box((-0.003, 0.01), s.half - 0.06, (s.low + 0.08, s.high - 0.1), fillet=0.002)
    machine = Assembly()
    machine.add("body", body, density=350.0)

    # The open lid stays clear of the dials.
    front, hinge = -rng.uniform(0.0, 0.015), back - (0.04 if upright else 0.0)
    low, high = np.array([front, 0.004 - s.half, s.high + GAP]), np.array([hinge, s.half - 0.004, s.high + GAP + thick])
    if rng.random() < 0.4:  # narrower than the deck
        low[:2] += (0.03, 0.06)
        high[1] -= 0.06
    edge = rng.uniform(0.04, 0.09)
    if rng.random() < 0.5:  # a window
        lid = frame(low, high, [edge] * 4, 0, 1)
        lid += box(low + (edge - 0.002, edge - 0.002, 0.3 * thick), high - (edge - 0.002, edge - 0.002, 0.3 * thick))
    else:
        lid = box(low, high, fillet=0.008)
    if rng.random() < 0.65:  # hinged at the back
        upper = np.deg2rad(rng.uniform(75.0, 89.0))
        lid += box((low[0] - 0.012, low[0] + 0.01), 0.07, (low[2] + 0.004, high[2] - 0.003), fillet=0.004)
        machine.add("lid", lid, revolute("body", (0, 1, 0), (high[0], 0, high[2]), 0.0, upper))
    else:
        upper, side = np.deg2rad(with_tails(rng, (85.0, 120.0), (40.0, 120.0), 0.3)), int(rng.choice([-1, 1]))
        x, free = 0.5 * (low[0] + high[0]), -side * high[1]
        lid += box((x - 0.06, x + 0.06), (free - 0.01, free + 0.01), (low[2] + 0.004, high[2] - 0.003), fillet=0.004)
        machine.add("lid", lid, revolute("body", (-side, 0, 0), (x, side * high[1], high[2]), 0.0, upper))
    machine.add(
        "drum", _agitator(rng, center, radius, s), continuous("body", (0, 0, 1), (*center, s.low)), density=900.0
    )
    if upright:
        _controls(rng, machine, (-s.half, s.half), back + 0.003, s.high + thick + 0.01, s.high + rise)
    return machine


def _agitator(rng: Rng, center: Array, radius: float, s: Shape) -> Solid:
    """Drum with a column and its vanes, or with a low impeller."""
    low, high, r = s.low + 0.05, s.high - 0.08, radius - 0.01
    solid = vessel([(r, low), (r, high)], 0.006, (*center, 0.0), 16)
    x, y = center
    top = low + (rng.uniform(0.6, 0.85) * (high - low) if rng.random() < 0.5 else 0.05)
    solid += rod(x, y, (low + 0.001, top), 0.3 * r, 0.15 * r, 16)
    for k in range(4):
        vane = box((x, x + 0.6 * r), (y - 0.01, y + 0.01), (low + 0.001, low + 0.06))
        solid += vane.turned((0, 0, 1), 0.5 * np.pi * k, (x, y, 0))
    return solid


def _controls(rng: Rng, machine: Assembly, free: tuple[float, float], x: float, low: float, high: float) -> None:
    """A dial and a row of buttons on a strip that faces -X."""
    z, room = 0.5 * (low + high), high - low
    places = np.linspace(free[0], free[1], 9)[1:-1]
    middle, reverse = places[3], -1 if rng.random() < 0.5 else 1
    radius = min(rng.uniform(0.022, 0.035), 0.4 * room)
    spot = (x, float(rng.choice([middle, places[1], places[5]])), z)
    machine.add("knob", dial(spot, (-1, 0, 0), rng.uniform(0.018, 0.03), radius), continuous("body", (-1, 0, 0), spot))
    number = 0
    for y in places[::reverse]:
        if abs(y - spot[1]) < radius + 0.02 or number >= 4 or rng.random() < 0.4:
            continue
        number += 1
        face = (x, float(y), z)
        button = push_button(face, (0.016, 0.012), rng.choice([0.002, 0.006]))
        machine.add(f"button_{number}", button, prismatic("body", (1, 0, 0), 0.0, 0.0015, face))
