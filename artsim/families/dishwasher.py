"""Dishwashers: a tub with a door that drops down about a hinge at its bottom, or one or two that slide out as drawers.

What varies: built-in, free-standing (with a worktop) or for the countertop; a door over the whole front, below a fixed
strip of controls, or only over the upper half; between side panels or over them; where the hinge lies; handle, strips,
relief and inner liner of the door; racks inside, fixed or on slides; spray arm; buttons and dials.
"""

from dataclasses import dataclass

import numpy as np

from artsim.common.elementary import hypot
from artsim.families.details import dial, flat_handle, front_handle, push_button, wire_shelf
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute
from artsim.making.solids import Solid, box, frame, posts, rod, tray, union

GAP = 0.002


@dataclass(frozen=True)
class Shape:
    """Measures of one dishwasher, in metres; the back of its closed door is the plane x = 0."""

    half: float  # half the width of the body
    depth: float
    height: float  # of the body, without a worktop
    wall: float
    thick: float  # of the door
    half_door: float
    bottom: float  # height of the door's lower edge
    top: float  # height of the door's upper edge
    hinge_x: float
    hinge_z: float
    liner: float  # how far the inside of the door reaches into the tub; 0 for none

    @property
    def front(self) -> float:
        """x of the tub's front: the lower back edge of the door swings clear of it."""
        return float(hypot(self.hinge_x, self.hinge_z - self.bottom)) + self.hinge_x + GAP

    @property
    def floor(self) -> float:
        """Height of the tub's floor."""
        return self.bottom + 0.6 * self.wall


def build(rng: Rng) -> Assembly:
    """A dishwasher, closed at rest."""
    if rng.random() < 0.12:
        return _drawers(rng)
    compact, half_door = rng.random(2) < (0.08, 0.12)
    half_door = half_door and not compact  # there is no room for it
    width = rng.uniform(0.42, 0.48) if rng.random() < 0.2 and not compact else rng.uniform(0.54, 0.64)
    height = width * rng.uniform(0.75, 0.95) if compact else rng.uniform(0.70, 0.9)
    wall, thick = rng.uniform(0.012, 0.04), rng.uniform(0.03, 0.075)
    plinth = rng.uniform(0.02, 0.05) if compact or rng.random() < 0.4 else rng.uniform(0.06, 0.15)
    strip = rng.uniform(0.07, 0.14) if rng.random() < 0.4 else 0.0
    flush = bool(rng.random() < 0.3)  # what lies below the door is as far in front as the door
    flanked = bool(rng.random() < 0.35)  # the door lies between the side panels
    if half_door:
        plinth, flush, strip = rng.uniform(0.35, 0.5) * height, True, max(strip, 0.09)
    elif flanked:
        strip = max(strip, wall)
    hinge_x = -thick if flush else -thick * rng.choice([0.0, rng.uniform(0.0, 0.6)])
    swing = float(hypot(hinge_x, height - plinth)) - (height - plinth)  # the upper back edge rises while it opens
    shape = Shape(
        half=0.5 * width,
        depth=rng.uniform(0.42, 0.64),
        height=height,
        wall=wall,
        thick=thick,
        half_door=0.5 * width - (wall + GAP if flanked else rng.uniform(0.0, 0.004)),
        bottom=plinth,
        top=height - strip - 1.3 * swing - 2 * GAP,
        hinge_x=hinge_x,
        hinge_z=plinth + (0.0 if flush else rng.uniform(0.0, 0.012)),
        liner=rng.uniform(0.005, 0.025) if rng.random() < 0.75 else 0.0,
    )
    racks = pick(rng, {"none": 0.4, "fixed": 0.4, "sliding": 0.2})
    machine = Assembly()
    body = _body(rng, shape, strip, flush, flanked, compact)
    if racks == "fixed":
        for low in _rack_heights(shape):
            half = shape.half - shape.wall + 0.002
            body += _rack(rng, shape.liner + shape.front + 0.01, shape.depth - shape.wall + 0.002, half, low)
    machine.add("body", body, density=300.0)
    opening = 0.5 * np.pi if rng.random() < 0.7 else np.deg2rad(rng.uniform(75.0, 90.0))
    hinge = (shape.hinge_x, 0.0, shape.hinge_z)
    machine.add("door", _door(rng, shape, strip > 0.05, machine), revolute("body", (0, -1, 0), hinge, 0.0, opening))
    if strip > 0.05 and rng.random() < 0.6:
        _controls(rng, machine, shape)
    if racks == "sliding":
        _sliding_racks(rng, machine, shape)
    return machine


def _drawers(rng: Rng) -> Assembly:
    """Tubs that slide out behind a full front, one above the other."""
    count = pick(rng, {1: 0.65, 2: 0.35})
    half, depth, wall = 0.5 * rng.uniform(0.5, 0.64), rng.uniform(0.42, 0.62), rng.uniform(0.012, 0.03)
    plinth = rng.uniform(0.015, 0.1)
    tall = rng.uniform(0.4, 0.75) if count == 1 else rng.uniform(0.34, 0.42)
    shape = Shape(
        half=half,
        depth=depth,
        height=plinth + count * tall,
        wall=wall,
        thick=rng.uniform(0.02, 0.05),
        half_door=half + rng.uniform(-0.002, 0.025),
        bottom=plinth - (rng.uniform(0.0, 0.012) if count == 1 else 0.0),
        top=plinth + tall + (rng.uniform(-0.003, 0.012) if count == 1 else -0.004),
        hinge_x=0.0,
        hinge_z=plinth,
        liner=0.0,
    )
    body = tray((shape.front, -half, plinth), (depth, half, shape.height), wall, axis=0, side=-1)
    body += box((shape.front + rng.uniform(0.0, 0.06), depth), half - 0.005, (0.0, plinth + 0.003))
    if count == 2:
        z = plinth + tall
        body += box((shape.front, depth), half - 0.002, (z - 0.5 * wall, z + 0.5 * wall))
    low, inside, back = plinth + wall + 0.004, half - wall - 0.005, depth - wall - rng.uniform(0.01, 0.08)
    machine = Assembly()
    drawer = _door(rng, shape, True, machine)
    drawer += tray((-0.004, -inside, low), (back, inside, low + rng.uniform(0.6, 0.85) * (tall - 2 * wall)), 0.008)
    if rng.random() < 0.6:
        drawer += _rack(rng, 0.02, back - 0.03, inside - 0.02, low + 0.006)
    machine.add("body", body, density=300.0)
    travel = rng.uniform(0.6, 0.9) * back
    for number in range(count):
        name = "drawer" if count == 1 else f"drawer_{number + 1}"
        machine.add(name, drawer.moved((0, 0, number * tall)), prismatic("body", (-1, 0, 0), 0.0, travel))
    return machine


def _body(rng: Rng, s: Shape, strip: float, flush: bool, flanked: bool, compact: bool) -> Solid:
    front, back, half, base = s.front, s.depth, s.half, s.floor - s.wall
    solid = tray((front, -half, base), (back, half, s.height), s.wall, axis=0, side=-1)
    face = -s.thick * (1.0 if rng.random() < 0.6 else rng.uniform(0.3, 0.95))  # front of the fixed panels
    if flanked:
        for y in (-half, half - s.wall):
            solid += box((face, front + 0.01), (y, y + s.wall), (s.bottom - 0.01, s.height))
    if strip > 0:
        y = half - (0.001 if flanked else 0.0)
        solid += box((-s.thick, front + s.wall), y, (s.height - strip, s.height), fillet=0.004)
    if flush:
        foot = min(rng.uniform(0.0, 0.09), 0.5 * s.bottom, base - 0.002)
        solid += box((face, front + 0.02), half, (foot, s.bottom - GAP), fillet=0.003)
        solid += box((front + 0.01, back), half, (foot, base + 0.002))
        solid += box((face + rng.uniform(0.02, 0.06), back - 0.02), half - 0.01, (0.0, foot + 0.01))
    elif compact or rng.random() < 0.25:
        solid += posts((front + 0.05, back - 0.05), half - 0.05, (0, base + 0.003), 0.018)
    else:
        recess = front + rng.uniform(0.0, 0.08)
        solid += box((recess, back), half - 0.002, (0, base + 0.003))
    if not compact and rng.random() < 0.4:  # a worktop
        lip = rng.uniform(0.0, 0.02)
        solid += box((-s.thick * rng.uniform(0.0, 1.4), -half - lip, s.height - 0.001),
                             (back + lip, half + lip, s.height + rng.uniform(0.012, 0.04)), fillet=0.004)  # fmt: skip
    return solid


def _rack_heights(s: Shape) -> list[float]:
    """Height of the lower rack, and of the upper one where there is room."""
    lower = s.floor + 0.07
    return [lower] if s.top - s.floor < 0.5 else [lower, s.floor + 0.55 * (s.top - s.floor)]


def _rack(rng: Rng, front: float, back: float, half: float, low: float) -> Solid:
    """Basket of wire, open at the top."""
    wire, height = 0.005, rng.uniform(0.06, 0.11)
    solid = wire_shelf((front, -half, low), (back, half, low + wire), 6, wire)
    solid += frame((front, -half, low + height - wire), (back, half, low + height), [wire] * 4, 0, 1)
    posts = [(x, y) for x in (front, back - wire) for y in np.linspace(-half, half - wire, 6)]
    posts += [(0.5 * (front + back), y) for y in (-half, half - wire)]
    return solid + union(box((x, x + wire), (y, y + wire), (low, low + height)) for x, y in posts)


def _sliding_racks(rng: Rng, machine: Assembly, s: Shape) -> None:
    """Racks that stay behind the door in every state, and perhaps a spray arm below them."""
    front, back = s.front + s.liner + 0.01, s.depth - s.wall - 0.005
    half = s.half - s.wall - 0.006
    travel = rng.uniform(0.25, 0.4) * (back - front)
    for number, low in enumerate(_rack_heights(s), 1):
        rack = _rack(rng, front + travel, back, half, low)
        machine.add(f"rack_{number}", rack, prismatic("body", (-1, 0, 0), 0.0, travel, (back, 0, low)), density=900.0)
    center = 0.5 * (front + back)
    reach = min(0.5 * (back - front), half) - 0.02
    low = s.floor + 0.02
    arm = box((center - reach, center + reach), 0.025, (low, low + 0.015), fillet=0.02, axis=2)
    arm += rod(center, 0, (s.floor + GAP, low + 0.02), 0.03)
    machine.add("spray_arm", arm, continuous("body", (0, 0, 1), (center, 0, low)))


def _controls(rng: Rng, machine: Assembly, s: Shape) -> None:
    """Buttons and perhaps a dial on the fixed strip."""
    z = 0.5 * (s.top + 0.008 + s.height)
    size = min(0.012, 0.22 * (s.height - s.top))
    ys = np.linspace(-0.8, 0.8, 9) * s.half
    first, count = int(rng.integers(0, 5)), int(rng.integers(1, 5))
    for number, y in enumerate(ys[first : first + count], 1):
        face = (-s.thick, y, z)
        button = push_button(face, (2 * size, 2 * size), rng.choice([0.002, size]))
        machine.add(f"button_{number}", button, prismatic("body", (1, 0, 0), 0.0, 0.0015, face))
    if rng.random() < 0.5:
        y, radius = ys[(first + count + 1) % 9], min(0.022, 0.4 * (s.height - s.top))
        foot = (-s.thick, y, z)
        machine.add("dial", dial(foot, (-1, 0, 0), 0.02, radius), continuous("body", (-1, 0, 0), foot))


def _door(rng: Rng, s: Shape, controls_above: bool, machine: Assembly) -> Solid:
    half, tall, x = s.half_door, s.top - s.bottom, -s.thick
    kind = pick(rng, {"bar": 0.24, "bow": 0.24, "flat": 0.16, "pocket": 0.18, "edge": 0.1, "none": 0.08})
    machine.record(handles=kind in ("bar", "bow", "flat", "edge"))
    band = rng.uniform(0.08, 0.14) if not controls_above and rng.random() < 0.5 else 0.0
    z = s.top - band - rng.uniform(0.03, 0.1)  # height of the handle
    if kind == "pocket":
        deep, side, slot = rng.uniform(0.012, 0.02), rng.uniform(0.2, 0.75) * half, rng.uniform(0.02, 0.05)
        solid = box((x + deep - 0.001, 0), half, (s.bottom, s.top))
        widths = [half - side, half - side, z - slot - s.bottom, s.top - z]
        solid += frame((x, -half, s.bottom), (x + deep, half, s.top), widths)
    else:
        solid = box((x, 0), half, (s.bottom, s.top), fillet=rng.uniform(0.002, 0.012))
    if band > 0:  # a strip of controls, in front of the door or within an outline
        lead = rng.uniform(0.003, 0.02)
        solid += box((x - lead, x + 0.02), half, (s.top - band, s.top), fillet=0.003)
        solid += _marks(rng, x - lead, half, s.top - 0.5 * band)
    elif rng.random() < 0.3:
        solid += box((x - 0.0015, x + 0.002), 0.12 * half, (s.bottom + 0.12 * tall, s.bottom + 0.15 * tall))
    if kind != "pocket" and rng.random() < 0.25:  # a raised board
        edge = rng.uniform(0.02, 0.07)
        solid += box((x - 0.004, x + 0.003), half - edge, (s.bottom + edge, z - 0.03), fillet=0.003)
    span = half * rng.uniform(0.45, 0.93)
    reach, radius = rng.uniform(0.03, 0.06), rng.uniform(0.006, 0.013)
    left, right = (x, -span, z), (x, span, z)
    if kind in ("bar", "bow"):
        solid += front_handle(kind, left, right, reach, radius)
    elif kind == "flat":
        solid += flat_handle(left, right, reach, rng.uniform(0.015, 0.04), rng.uniform(0.006, 0.014))
    elif kind == "edge":  # a lip along the upper edge
        solid += box((x - reach, x + 0.01), half, (s.top - 0.02, s.top), fillet=0.006)
    return solid + _inside(rng, s)


def _marks(rng: Rng, x: float, half: float, z: float) -> Solid:
    """A display and keys that do not move."""
    solid = box((x - 0.0015, x + 0.002), 0.2 * half, (z - 0.015, z + 0.015)) if rng.random() < 0.6 else Solid()
    for y in np.linspace(0.4, 0.8, int(rng.integers(2, 6))) * half * rng.choice([-1, 1]):
        solid += box((x - 0.002, x + 0.002), (y - 0.01, y + 0.01), (z - 0.007, z + 0.007), fillet=0.004, axis=0)
    return solid


def _inside(rng: Rng, s: Shape) -> Solid:
    """The shallow tray on the inside of the door, with the box for the detergent."""
    if s.liner == 0.0:
        return Solid()
    half = min(s.half_door, s.half - s.wall) - 0.012
    low, high = s.floor + s.liner + 0.02, s.top - max(0.03, s.wall)
    solid = tray((-0.002, -half, low), (s.liner, half, high), 0.03, 0.0035, axis=0, side=1)
    if s.liner > 0.01:
        y, z = rng.uniform(-0.2, 0.5) * half, low + rng.uniform(0.4, 0.7) * (high - low)
        solid += box((0, 0.8 * s.liner), (y - 0.06, y + 0.09), (z - 0.05, z + 0.05), fillet=0.006)
        solid += rod((0, 0.7 * s.liner), y - 0.12, z, 0.03)
    return solid
