"""Washing machines: front loaders with a porthole, top loaders with a lid.

What varies: round or square door with a glass bowl or closed, its hinge; drawer for the detergent, knob, buttons;
console and lid of a top loader; a drum or agitator that turns; feet, plinth, worktop.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import add_push_button, dial, front_handle, holed_plate, side_hinge
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, UP, Array, about
from artsim.making.solids import Solid, box, frame, hull, posts, ring, rod, tray, vessel

GAP = 0.002


class Shape:
    """Measures of the cabinet in metres; its front is the plane x = 0."""

    def __init__(self, draws: Draws) -> None:
        self.low = draws.length("foot_height", (0.012, 0.03))
        self.front_loader = draws.pick("loads", {"front": 0.7, "top": 0.3}) == "front"
        self.half = 0.5 * draws.length("width", (0.56, 0.7))
        self.depth = draws.length("depth", (0.45, 0.66) if self.front_loader else (0.55, 0.7))
        self.high = self.low + draws.length("height", (0.8, 0.95) if self.front_loader else (0.85, 0.98))
        if not self.front_loader and draws.chance("narrow", 0.35):  # narrow and tall ones, for small rooms
            narrow = draws.within("narrow")
            self.half, self.depth = 0.5 * narrow.length("width", (0.4, 0.56)), narrow.length("depth", (0.42, 0.6))
            self.high = self.low + narrow.length("height", (0.85, 1.15))


def build(draws: Draws) -> Assembly:
    """A washing machine, closed at rest."""
    shape = Shape(draws)
    return _front_loader(draws, shape) if shape.front_loader else _top_loader(draws, shape)


def _feet(s: Shape) -> Solid:
    return posts((0.06, s.depth - 0.06), s.half - 0.06, (0, s.low + 0.01), 0.025)


def _front_loader(draws: Draws, s: Shape) -> Assembly:
    left = draws.chance("hinge_left", 0.75)
    sign = 1.0 if left else -1.0
    strip = s.high - draws.length("strip_height", (0.1, 0.15))  # lower edge of the strip of controls
    hole = draws.length("hole_radius", (0.13, 0.175))
    z = s.low + (strip - s.low) * draws.number("hole_height", (0.5, 0.56))
    drum = min(s.half - 0.03, strip - z - 0.015, hole + 0.09)
    plate = 0.02
    box_half, box_side = 0.5 * draws.length("drawer_width", (0.14, 0.24)), draws.side("drawer_side")
    drawer = draws.chance("detergent_drawer", 0.75)

    body = tray((0.5 * plate, -s.half, s.low), (s.depth, s.half, s.high), 0.012, axis=0, side=-1) + _feet(s)
    body += holed_plate((0, -s.half, s.low), (plate, s.half, strip + 0.001), (0.0, z), hole, 0, 20)
    slot = np.array([box_side * (s.half - box_half - 0.03), 0.5 * (strip + s.high)])
    room = 0.5 * (s.high - strip) - 0.016
    proud = draws.one_of("strip", {"flush": 0.0, "proud": draws.length("strip_reach", (0.005, 0.02))})
    if drawer:
        widths = [slot[0] - box_half + s.half, s.half - slot[0] - box_half, 0.016, 0.016]
        panel = frame((-proud, -s.half, strip), (plate, s.half, s.high), widths)
    else:
        panel = box((-proud, plate), s.half, (strip, s.high), fillet=0.003)
    body += panel.called("panel", FRONT)
    if draws.chance("worktop", 0.6):
        lead, top = -draws.length("worktop_overhang", (0.0, 0.02)), draws.length("worktop_thickness", (0.01, 0.035))
        body += box((lead, s.depth), s.half + 0.002, (s.high - 0.001, s.high + top), fillet=0.005)
    if draws.chance("plinth", 0.5):  # and the flap of the filter
        body += box((0.012, s.depth - 0.01), s.half - 0.005, (0.0, s.low + 0.002))
        body += box((-0.0025, 0.01), (s.half - 0.2, s.half - 0.05), (s.low + 0.03, s.low + 0.12), fillet=0.004, axis=0)
    turning, bowl = draws.chance("drum", 0.6), draws.length("bowl_depth", (0.03, 0.06))
    tub = _drum(s, z, drum, hole, plate, bowl if turning else -plate / 2)
    machine = Assembly()
    machine.record(handles=True)
    machine.add("body", body if turning else body + tub, density=350.0)

    outer, thick = hole + draws.length("door_rim", (0.03, 0.055)), draws.length("door_thickness", (0.025, 0.05))
    door = _porthole(draws, z, hole, outer, thick, bowl)
    hinge = side_hinge(-GAP - thick, sign * (outer + 0.012), draws.turn("door_angle", (95.0, 160.0)), left)
    machine.add("door", door if left else door.mirrored(1), hinge)
    if turning:
        machine.add("drum", tub, continuous("body", FRONT, (0, 0, z)), density=900.0)
    free = (-s.half, s.half)
    if drawer:
        across = (slot[0] - box_half, slot[0] + box_half)
        face = (across[0] + GAP, across[1] - GAP)
        solid = box((-proud - 0.016, -proud - GAP), face, (strip + 0.012, s.high - 0.012), fillet=0.004)
        inner = np.array([box_half - 0.004, room - 0.003])
        solid += tray((-proud - 0.006, *(slot - inner)), (0.55 * s.depth, *(slot + inner)), 0.003)
        grip = box((-proud - 0.024, -proud - 0.012), about(slot[0], 0.4 * box_half), (strip + 0.022, strip + 0.032))
        slide = prismatic("body", FRONT, 0.0, draws.number("drawer_travel", (0.3, 0.45)) * s.depth, (0, *slot))
        machine.add("detergent_drawer", solid + grip.called("handle", FRONT), slide)
        free = (across[1], s.half) if box_side < 0 else (-s.half, across[0])
    _controls(draws, machine, free, -proud, strip, s.high)
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


def _porthole(draws: Draws, z: float, hole: float, outer: float, thick: float, bowl: float) -> Solid:
    """Door with its hinge at +Y; the glass reaches into the hole."""
    x0, x1 = -GAP - thick, -GAP
    glass, blind = hole * draws.number("glass_radius", (0.72, 0.9)), draws.chance("door_blind", 0.15)
    if draws.pick("door_shape", {"round": 0.75, "square": 0.25}) == "round":
        solid = ring((0.5 * (x0 + x1), 0, z), (1, 0, 0), 0.97 * glass, outer, thick, 22)
        if draws.chance("door_bead", 0.5):
            solid += ring((x0, 0, z), (1, 0, 0), glass + 0.012, outer - 0.012, 0.012, 16)
    else:
        solid = holed_plate((x0, -outer, z - outer), (x1, outer, z + outer), (0.0, z), 0.97 * glass, 0, 20)
    # The bowl is narrow enough to swing past the rim of the hole.
    pane = rod((x1 - 0.002, x1 + bowl), 0, z, hole - 0.008, 0.78 * hole, 28)
    if blind:
        solid += rod((x0 - 0.004, x1), 0, z, glass, sections=28) + pane
    else:
        solid += (rod((x0 + 0.3 * thick, x1 + 0.002), 0, z, glass * 1.02, sections=28) + pane).called("glass", FRONT)
    for side in (-0.35, 0.35):  # hinges
        solid += box((x1 - 0.014, x1), (0.6 * outer, outer + 0.01), about(z + side * outer, 0.02))
    reach = draws.length("handle_reach", (0.03, 0.05))
    if draws.chance("handle_block", 0.5):
        y = 0.018 - outer
        grip = box((x0 - 0.012, x0 + 0.01), (y - 0.004, y + 0.014), about(z, 0.25 * outer))
        return solid + grip.called("handle", FRONT)
    start, end = (x0, 0.02 - 0.97 * outer, z - 0.1 * outer), (x0, 0.02 - 0.97 * outer, z + 0.1 * outer)
    return solid + front_handle(draws.pick("handle", ["bow", "flat"]), start, end, reach, 0.006)


def _top_loader(draws: Draws, s: Shape) -> Assembly:
    console = draws.length("console_depth", (0.09, 0.16))  # at the back
    rise = draws.length("console_height", (0.08, 0.18))
    back = s.depth - console
    deck, thick = 0.03, draws.length("lid_thickness", (0.02, 0.04))
    radius = min(0.5 * back - 0.05, s.half - 0.05)
    center = np.array([0.5 * back, 0.0])
    body = tray((0, -s.half, s.low), (s.depth, s.half, s.high - 0.5 * deck), 0.012) + _feet(s)
    body += holed_plate((0, -s.half, s.high - deck), (s.depth, s.half, s.high), center, radius, 2, 20)
    slope = draws.number("console_slope", (0.0, 0.5)) * console
    foot, crest = s.high - 0.002, s.high + rise
    face = [(back + 0.004, foot), (back + 0.004 + slope, crest), (s.depth, crest), (s.depth, foot)]
    body += hull([(x, y, z) for x, z in face for y in (-s.half, s.half)]).called("panel", FRONT)
    upright = slope < 0.2 * console
    if upright:  # dials stand on its face
        body += box((back + 0.003, back + 0.02 + slope), 0.95 * s.half, (s.high + 0.02, s.high + rise - 0.01))
    if draws.chance("front_board", 0.5):
        body += box((-0.003, 0.01), s.half - 0.06, (s.low + 0.08, s.high - 0.1), fillet=0.002)
    machine = Assembly()
    machine.add("body", body, density=350.0)

    # The open lid stays clear of the dials.
    front, hinge = -draws.length("lid_overhang", (0.0, 0.015)), back - (0.04 if upright else 0.0)
    low, high = np.array([front, 0.004 - s.half, s.high + GAP]), np.array([hinge, s.half - 0.004, s.high + GAP + thick])
    if draws.chance("lid_narrow", 0.4):  # narrower than the deck
        low[:2] += (0.03, 0.06)
        high[1] -= 0.06
    edge = draws.length("lid_margin", (0.04, 0.09))
    if draws.chance("window", 0.5):
        lid = frame(low, high, [edge] * 4, 0, 1)
        inside = np.array([edge - 0.002, edge - 0.002, 0.3 * thick])
        lid += box(low + inside, high - inside).called("glass", UP)
    else:
        lid = box(low, high, fillet=0.008)
    grip = (low[2] + 0.004, high[2] - 0.003)
    if draws.pick("lid_hinge", {"back": 0.65, "side": 0.35}) == "back":
        upper = draws.turn("lid_angle", (75.0, 89.0))
        lid += box((low[0] - 0.012, low[0] + 0.01), 0.07, grip, fillet=0.004).called("handle", FRONT)
        machine.add("lid", lid, revolute("body", (0, 1, 0), (high[0], 0, high[2]), 0.0, upper))
    else:
        upper = draws.turn("lid_angle", (85.0, 120.0), (40.0, 120.0), tails=0.3)
        side = draws.side("lid_hinge_side")
        x, free = 0.5 * (low[0] + high[0]), -side * high[1]
        lid += box(about(x, 0.06), about(free, 0.01), grip, fillet=0.004).called("handle", (0, -side, 0))
        machine.add("lid", lid, revolute("body", (-side, 0, 0), (x, side * high[1], high[2]), 0.0, upper))
    machine.add("drum", _agitator(draws, center, radius, s), continuous("body", UP, (*center, s.low)), density=900.0)
    if upright:
        _controls(draws, machine, (-s.half, s.half), back + 0.003, s.high + thick + 0.01, s.high + rise)
    return machine


def _agitator(draws: Draws, center: Array, radius: float, s: Shape) -> Solid:
    """Drum with a column and its vanes, or with a low impeller."""
    low, high, r = s.low + 0.05, s.high - 0.08, radius - 0.01
    solid = vessel([(r, low), (r, high)], 0.006, (*center, 0.0), 16)
    x, y = center
    column = draws.chance("agitator", 0.5)
    top = low + (draws.number("agitator_height", (0.6, 0.85)) * (high - low) if column else 0.05)
    solid += rod(x, y, (low + 0.001, top), 0.3 * r, 0.15 * r, 16)
    for k in range(4):
        vane = box((x, x + 0.6 * r), (y - 0.01, y + 0.01), (low + 0.001, low + 0.06))
        solid += vane.turned((0, 0, 1), 0.5 * np.pi * k, (x, y, 0))
    return solid


def _controls(draws: Draws, machine: Assembly, free: tuple[float, float], x: float, low: float, high: float) -> None:
    """A dial and a row of buttons on a strip that faces -X."""
    z, room = 0.5 * (low + high), high - low
    places = np.linspace(free[0], free[1], 9)[1:-1].tolist()
    reverse = -1 if draws.chance("buttons_from_left", 0.5) else 1
    radius = min(draws.length("knob_radius", (0.022, 0.035)), 0.4 * room)
    spot = (x, places[draws.one_of("knob_place", {"middle": 3, "right": 1, "left": 5})], z)
    reach = draws.length("knob_reach", (0.018, 0.03))
    machine.add("knob", dial(spot, FRONT, reach, radius), continuous("body", FRONT, spot))
    number = 0
    for y in places[::reverse]:
        if abs(y - spot[1]) < radius + 0.02 or number >= 4 or draws.chance("button_left_out", 0.4):
            continue
        number += 1
        corner = draws.one_of("button_shape", {"square": 0.002, "round": 0.006})
        add_push_button(machine, number, (x, y, z), (0.016, 0.012), corner)
