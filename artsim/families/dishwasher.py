"""Dishwashers: a tub with a door that drops down about a hinge at its bottom, or one or two that slide out as drawers.

What varies: built-in, free-standing or for the countertop; a door over the whole front, below a fixed strip, or over
the upper half; where the hinge lies; handle, strips, relief and liner of the door; racks, spray arm, buttons, dials.
"""

from dataclasses import dataclass

import numpy as np

from artsim.common.elementary import hypot
from artsim.families.details import add_push_button, dial, flat_handle, front_handle, wire_shelf
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, UP, about
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


def build(draws: Draws) -> Assembly:
    """A dishwasher, closed at rest."""
    if draws.pick("front", {"drawers": 0.12, "door": 0.88}) == "drawers":
        return _drawers(draws)
    compact = draws.chance("compact", 0.08)
    upper_half = draws.chance("half_door", 0.12) and not compact  # there is no room for it
    narrow = draws.chance("narrow", 0.2) and not compact
    width = draws.length("width", (0.42, 0.48) if narrow else (0.54, 0.64))
    height = draws.length("height", (0.75, 0.95), of=width) if compact else draws.length("height", (0.70, 0.9))
    wall, thick = draws.lengths(wall=(0.012, 0.04), door_thickness=(0.03, 0.075))
    low = compact or draws.chance("plinth_low", 0.4)
    plinth = draws.length("plinth_height", (0.02, 0.05) if low else (0.06, 0.15))
    strip = draws.length("strip_height", (0.07, 0.14)) if draws.chance("fixed_strip", 0.4) else 0.0
    flush = draws.chance("flush", 0.3)  # what lies below the door is as far in front as the door
    flanked = draws.chance("door_between_sides", 0.35)
    if upper_half:
        plinth, flush, strip = draws.number("half_door_place", (0.35, 0.5)) * height, True, max(strip, 0.09)
    elif flanked:
        strip = max(strip, wall)
    hinge_x = -thick
    if not flush:
        hinge_x *= draws.one_of("hinge", {"back": 0.0, "inside": draws.number("hinge_depth", (0.0, 0.6))})
    swing = float(hypot(hinge_x, height - plinth)) - (height - plinth)  # the upper back edge rises while it opens
    half, depth, top = 0.5 * width, draws.length("depth", (0.42, 0.64)), height - strip - 1.3 * swing - 2 * GAP
    half_door = half - (wall + GAP if flanked else draws.length("door_gap", (0.0, 0.004)))
    hinge_z = plinth + (0.0 if flush else draws.length("hinge_height", (0.0, 0.012)))
    liner = draws.length("liner_depth", (0.005, 0.025)) if draws.chance("liner", 0.75) else 0.0
    shape = Shape(half, depth, height, wall, thick, half_door, plinth, top, hinge_x, hinge_z, liner)
    racks = draws.pick("rack_mount", {"none": 0.4, "fixed": 0.4, "sliding": 0.2})
    machine = Assembly()
    body = _body(draws, shape, strip, flush, flanked, compact)
    if racks == "fixed":
        front, back, side = liner + shape.front + 0.01, depth - wall + 0.002, half - wall + 0.002
        body += union(_rack(draws, front, back, side, low) for low in _rack_heights(shape))
    machine.add("body", body, density=300.0)
    level = draws.chance("door_opens_level", 0.7)
    opening = 0.5 * np.pi if level else draws.turn("door_angle", (75.0, 90.0))
    hinge = revolute("body", (0, -1, 0), (hinge_x, 0.0, hinge_z), 0.0, opening)
    machine.add("door", _door(draws, shape, strip > 0.05, machine), hinge)
    if strip > 0.05 and draws.chance("controls", 0.6):
        _controls(draws, machine, shape)
    if racks == "sliding":
        _sliding_racks(draws, machine, shape)
    return machine


def _drawers(draws: Draws) -> Assembly:
    """Tubs that slide out behind a full front, one above the other."""
    count = draws.pick("drawers", {1: 0.65, 2: 0.35})
    half, depth = 0.5 * draws.length("width", (0.5, 0.64)), draws.length("depth", (0.42, 0.62))
    wall, plinth = draws.lengths(wall=(0.012, 0.03), plinth_height=(0.015, 0.1))
    tall = draws.length("drawer_height", (0.4, 0.75) if count == 1 else (0.34, 0.42))
    height, thick = plinth + count * tall, draws.length("door_thickness", (0.02, 0.05))
    half_door = half + draws.length("front_overlap", (-0.002, 0.025))
    bottom, top = plinth, plinth + tall - 0.004
    if count == 1:
        bottom = plinth - draws.length("front_overlap_below", (0.0, 0.012))
        top = plinth + tall + draws.length("front_overlap_above", (-0.003, 0.012))
    shape = Shape(half, depth, height, wall, thick, half_door, bottom, top, hinge_x=0.0, hinge_z=plinth, liner=0.0)
    body = tray((shape.front, -half, plinth), (depth, half, shape.height), wall, axis=0, side=-1)
    recess = shape.front + draws.length("plinth_setback", (0.0, 0.06))
    body += box((recess, depth), half - 0.005, (0.0, plinth + 0.003))
    if count == 2:
        body += box((shape.front, depth), half - 0.002, about(plinth + tall, 0.5 * wall))
    low, inside = plinth + wall + 0.004, half - wall - 0.005
    back = depth - wall - draws.length("space_behind", (0.01, 0.08))
    machine = Assembly()
    drawer = _door(draws, shape, True, machine)
    rim = low + draws.number("tub_height", (0.6, 0.85)) * (tall - 2 * wall)
    drawer += tray((-0.004, -inside, low), (back, inside, rim), 0.008)
    if draws.chance("drawer_rack", 0.6):
        drawer += _rack(draws, 0.02, back - 0.03, inside - 0.02, low + 0.006)
    machine.add("body", body, density=300.0)
    travel = draws.number("drawer_travel", (0.6, 0.9)) * back
    for number in range(count):
        name = "drawer" if count == 1 else f"drawer_{number + 1}"
        machine.add(name, drawer.moved((0, 0, number * tall)), prismatic("body", FRONT, 0.0, travel))
    return machine


def _body(draws: Draws, s: Shape, strip: float, flush: bool, flanked: bool, compact: bool) -> Solid:
    front, back, half, base = s.front, s.depth, s.half, s.floor - s.wall
    solid = tray((front, -half, base), (back, half, s.height), s.wall, axis=0, side=-1)
    # Front of the fixed panels.
    face = -s.thick * (1.0 if draws.chance("sides_flush", 0.6) else draws.number("sides_forward", (0.3, 0.95)))
    if flanked:
        for y in (-half, half - s.wall):
            solid += box((face, front + 0.01), (y, y + s.wall), (s.bottom - 0.01, s.height))
    if strip > 0:
        y = half - (0.001 if flanked else 0.0)
        above = box((-s.thick, front + s.wall), y, (s.height - strip, s.height), fillet=0.004)
        solid += above.called("panel", FRONT) if strip > 0.05 else above
    if flush:
        foot = min(draws.length("foot_height", (0.0, 0.09)), 0.5 * s.bottom, base - 0.002)
        solid += box((face, front + 0.02), half, (foot, s.bottom - GAP), fillet=0.003)
        solid += box((front + 0.01, back), half, (foot, base + 0.002))
        recess = face + draws.length("foot_setback", (0.02, 0.06))
        solid += box((recess, back - 0.02), half - 0.01, (0.0, foot + 0.01))
    elif compact or draws.chance("feet", 0.25):
        solid += posts((front + 0.05, back - 0.05), half - 0.05, (0, base + 0.003), 0.018)
    else:
        recess = front + draws.length("plinth_setback", (0.0, 0.08))
        solid += box((recess, back), half - 0.002, (0, base + 0.003))
    if not compact and draws.chance("worktop", 0.4):
        lip = draws.length("worktop_lip", (0.0, 0.02))
        lead = -s.thick * draws.number("worktop_overhang", (0.0, 1.4))
        top = s.height + draws.length("worktop_thickness", (0.012, 0.04))
        solid += box((lead, back + lip), half + lip, (s.height - 0.001, top), fillet=0.004)
    return solid


def _rack_heights(s: Shape) -> list[float]:
    """Height of the lower rack, and of the upper one where there is room."""
    lower = s.floor + 0.07
    return [lower] if s.top - s.floor < 0.5 else [lower, s.floor + 0.55 * (s.top - s.floor)]


def _rack(draws: Draws, front: float, back: float, half: float, low: float) -> Solid:
    """Basket of wire, open at the top."""
    wire, height = 0.005, draws.length("rack_height", (0.06, 0.11))
    solid = wire_shelf((front, -half, low), (back, half, low + wire), 6, wire)
    solid += frame((front, -half, low + height - wire), (back, half, low + height), [wire] * 4, 0, 1)
    posts = [(x, y) for x in (front, back - wire) for y in np.linspace(-half, half - wire, 6)]
    posts += [(0.5 * (front + back), y) for y in (-half, half - wire)]
    return solid + union(box((x, x + wire), (y, y + wire), (low, low + height)) for x, y in posts)


def _sliding_racks(draws: Draws, machine: Assembly, s: Shape) -> None:
    """Racks that stay behind the door in every state, and a spray arm below them."""
    front, back = s.front + s.liner + 0.01, s.depth - s.wall - 0.005
    half = s.half - s.wall - 0.006
    travel = draws.number("rack_travel", (0.25, 0.4)) * (back - front)
    for number, low in enumerate(_rack_heights(s), 1):
        rack = _rack(draws, front + travel, back, half, low)
        machine.add(f"rack_{number}", rack, prismatic("body", FRONT, 0.0, travel, (back, 0, low)), density=900.0)
    center = 0.5 * (front + back)
    reach = min(0.5 * (back - front), half) - 0.02
    low = s.floor + 0.02
    arm = box((center - reach, center + reach), 0.025, (low, low + 0.015), fillet=0.02, axis=2)
    arm += rod(center, 0, (s.floor + GAP, low + 0.02), 0.03)
    machine.add("spray_arm", arm, continuous("body", UP, (center, 0, low)))


def _controls(draws: Draws, machine: Assembly, s: Shape) -> None:
    """Buttons and perhaps a dial on the fixed strip."""
    z, room = 0.5 * (s.top + 0.008 + s.height), s.height - s.top
    size = min(0.012, 0.22 * room)
    ys = np.linspace(-0.8, 0.8, 9) * s.half
    first, count = draws.integer("first_button", 0, 4), draws.integer("buttons", 1, 4)
    for number, y in enumerate(ys[first : first + count], 1):
        corner = draws.one_of("button_shape", {"square": 0.002, "round": size})
        add_push_button(machine, number, (-s.thick, y, z), (2 * size, 2 * size), corner)
    if draws.chance("dial", 0.5):
        foot = (-s.thick, ys[(first + count + 1) % 9], z)
        machine.add("dial", dial(foot, FRONT, 0.02, min(0.022, 0.4 * room)), continuous("body", FRONT, foot))


def _door(draws: Draws, s: Shape, controls_above: bool, machine: Assembly) -> Solid:
    half, tall, x = s.half_door, s.top - s.bottom, -s.thick
    kind = draws.pick("handle", {"bar": 0.24, "bow": 0.24, "flat": 0.16, "pocket": 0.18, "edge": 0.1, "none": 0.08})
    machine.record(handles=kind not in ("pocket", "none"))
    banded = not controls_above and draws.chance("door_strip", 0.5)
    band = draws.length("door_strip_height", (0.08, 0.14)) if banded else 0.0
    z = s.top - band - draws.length("handle_below_top", (0.03, 0.1))
    if kind == "pocket":
        deep, side = draws.length("pocket_depth", (0.012, 0.02)), draws.number("pocket_width", (0.2, 0.75)) * half
        slot = draws.length("pocket_height", (0.02, 0.05))
        solid = box((x + deep - 0.001, 0), half, (s.bottom, s.top))
        widths = [half - side, half - side, z - slot - s.bottom, s.top - z]
        solid += frame((x, -half, s.bottom), (x + deep, half, s.top), widths)
    else:
        solid = box((x, 0), half, (s.bottom, s.top), fillet=draws.length("door_edge_radius", (0.002, 0.012)))
    if banded:  # a strip of controls, in front of the door or within an outline
        front = x - draws.length("door_strip_reach", (0.003, 0.02))
        solid += box((front, x + 0.02), half, (s.top - band, s.top), fillet=0.003).called("panel", FRONT)
        solid += _marks(draws, front, half, s.top - 0.5 * band)
    elif draws.chance("sign", 0.3):
        solid += box((x - 0.0015, x + 0.002), 0.12 * half, (s.bottom + 0.12 * tall, s.bottom + 0.15 * tall))
    if kind != "pocket" and draws.chance("door_board", 0.25):
        edge = draws.length("door_board_margin", (0.02, 0.07))
        solid += box((x - 0.004, x + 0.003), half - edge, (s.bottom + edge, z - 0.03), fillet=0.003)
    span = half * draws.number("handle_length", (0.45, 0.93))
    reach, radius = draws.lengths(handle_reach=(0.03, 0.06), handle_radius=(0.006, 0.013))
    left, right = (x, -span, z), (x, span, z)
    if kind == "flat":
        width, depth = draws.lengths(handle_width=(0.015, 0.04), handle_depth=(0.006, 0.014))
        solid += flat_handle(left, right, reach, width, depth)
    elif kind == "edge":  # a lip along the upper edge
        solid += box((x - reach, x + 0.01), half, (s.top - 0.02, s.top), fillet=0.006).called("handle", FRONT)
    else:
        solid += front_handle(kind, left, right, reach, radius)
    return solid + _inside(draws, s) if s.liner > 0.0 else solid


def _marks(draws: Draws, x: float, half: float, z: float) -> Solid:
    """A display and keys that do not move."""
    solid = Solid()
    if draws.chance("display", 0.6):
        solid += box((x - 0.0015, x + 0.002), 0.2 * half, (z - 0.015, z + 0.015)).called("display", FRONT)
    for y in np.linspace(0.4, 0.8, draws.integer("key_count", 2, 5)) * half * draws.side("key_side"):
        key = box((x - 0.002, x + 0.002), (y - 0.01, y + 0.01), (z - 0.007, z + 0.007), fillet=0.004, axis=0)
        solid += key.called("button", FRONT)
    return solid


def _inside(draws: Draws, s: Shape) -> Solid:
    """The shallow tray on the inside of the door, with the box for the detergent."""
    half = min(s.half_door, s.half - s.wall) - 0.012
    low, high = s.floor + s.liner + 0.02, s.top - max(0.03, s.wall)
    solid = tray((-0.002, -half, low), (s.liner, half, high), 0.03, 0.0035, axis=0, side=1)
    if s.liner > 0.01:
        y = draws.number("soap_box_aside", (-0.2, 0.5)) * half
        z = low + draws.number("soap_box_place", (0.4, 0.7)) * (high - low)
        solid += box((0, 0.8 * s.liner), (y - 0.06, y + 0.09), (z - 0.05, z + 0.05), fillet=0.006)
        solid += rod((0, 0.7 * s.liner), y - 0.12, z, 0.03)
    return solid
