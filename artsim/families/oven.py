"""Ovens: cookers with a hob, ovens to build in, and cooktops whose knobs alone turn.

What varies: one or two doors that drop down, or one that opens sideways; a drawer; gas, coil or glass burners; a guard
at the back; knobs in front or on the guard, with or without stops; window, handle, racks, feet.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from artsim.common.elementary import arctan2
from artsim.families.details import add_push_button, dial, front_handle, side_hinge, windowed_panel, wire_shelf
from artsim.making.assembly import Assembly, JointSpec, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, UP, Array, Vector, about
from artsim.making.solids import Solid, box, frame, posts, rod, tray, union

GAP = 0.002


def build(draws: Draws) -> Assembly:
    """An oven, closed at rest. The back of its doors is the plane x = 0."""
    if draws.chance("cooktop", 0.12):
        return _cooktop(draws)
    built_in = draws.chance("built_in", 0.25)
    usual, widest = ((0.54, 0.62), (0.54, 0.76)) if built_in else ((0.48, 0.78), (0.44, 1.0))
    half, depth = 0.5 * draws.length("width", usual, widest), draws.length("depth", (0.5, 0.66), (0.42, 0.72))
    height = draws.length("height", (0.44, 0.62) if built_in else (0.82, 0.95))
    two = not built_in and draws.pick("doors", {2: 0.2, 1: 0.8}) == 2
    wall, thick = draws.length("wall", (0.03, 0.05)), draws.length("door_thickness", (0.03, 0.06), (0.022, 0.1))
    plain = built_in or draws.pick("back", {"plain": 0.55, "guard": 0.45}) == "plain"
    guard = 0.0 if plain else draws.length("guard_height", (0.06, 0.2))
    on_guard = guard > 0.11 and draws.chance("knobs_on_guard", 0.6)
    usual, widest = ((0.02, 0.05), (0.02, 0.05)) if on_guard else ((0.08, 0.13), (0.07, 0.2))
    strip = draws.length("strip_height", usual, widest)
    plinth = draws.length("plinth_height", (0.003, 0.01) if built_in else (0.03, 0.11))
    has_drawer = not built_in and not two and draws.pick("drawers", {1: 0.55, 0: 0.45}) == 1
    drawer = draws.length("drawer_height", (0.13, 0.2)) if has_drawer else 0.0
    ceiling = height - strip

    oven = Assembly()
    oven.record(handles=True)
    body = tray((GAP, -half, plinth), (depth, half, height), wall, 0.02, axis=0, side=-1)
    front = box((-thick, 0.02), half, (ceiling, height), fillet=0.004, axis=1)
    body += front if on_guard else front.called("panel", FRONT)
    body += posts((0.05, depth - 0.05), half - 0.05, (0, plinth + 0.01), 0.02)
    if not built_in:
        body += _hob(draws, half, depth, height, thick)
        if draws.chance("plinth_set_back", 0.6):
            body += box((0.03, depth - 0.01), half - 0.004, (0.0, plinth + 0.002))
    if guard > 0:
        back = box((depth - 0.05, depth), half, (height - 0.01, height + guard), fillet=0.006, axis=1)
        body += back.called("panel", FRONT) if on_guard else back
    floor = plinth + drawer
    if drawer > 0:
        body += box((GAP, depth - 0.01), half - 0.01, (floor - 0.012, floor + 0.01))
    edges = [floor, ceiling]
    if two:
        edges.insert(1, floor + draws.number("lower_door_share", (0.5, 0.62)) * (ceiling - floor))
    for low, high in pairwise(edges):
        body += box((GAP, depth - 0.01), half - 0.01, (high - wall, high + 0.01))
        body += box((GAP, depth - 0.01), half - 0.01, (low, low + wall))
        for z in np.linspace(low + wall, high - wall, 2 + draws.integer("wire_shelf_count", 0, 1))[1:-1]:
            corner = (depth - wall + 0.002, half - wall + 0.002, z + 0.006)
            body += wire_shelf((0.05, wall - half - 0.002, z), corner, 7, 0.006)
    oven.add("body", body, density=350.0)

    sideways = not two and draws.chance("door_sideways", 0.1)
    kind = draws.pick("handle", ["bar", "bow", "flat"])
    reach = draws.length("handle_reach", (0.035, 0.055), (0.035, 0.085))
    for number, (low, high) in enumerate(pairwise(edges), 1):
        corner_low = np.array([-thick, 0.001 - half, low + GAP])
        # The upper back edge of a door that drops rises before it falls.
        rise = thick * thick / (2.0 * (high - low))
        corner_high = np.array([0.0, half - 0.001, high - max(3 * GAP, rise + GAP)])
        name = f"door_{number}" if two else "door"
        door, grip = _door(draws, corner_low, corner_high, kind, reach)
        oven.add(name, door, _hinge(draws, corner_low, corner_high, sideways, grip, reach if number == 2 else 0.0))
    if drawer > 0:
        # The handle of the open door hangs down: the drawer stops before it.
        travel = min(0.65 * depth, grip - floor - 0.09)
        oven.add("drawer", _drawer(draws, half, depth, thick, wall, plinth, floor, kind),
                 prismatic("body", FRONT, 0.0, travel, (0, 0, 0.5 * (plinth + floor))))  # fmt: skip
    face, middle = (depth - 0.05, height + 0.66 * guard) if on_guard else (-thick, height - 0.5 * strip)
    _controls(draws, oven, half, face, middle, min(0.3 * guard, 0.035) if on_guard else 0.5 * strip)
    return oven


def _cooktop(draws: Draws) -> Assembly:
    """A hob to stand on a worktop or to sink into it: a slab with a row of dials, at one side or in front."""
    half = 0.5 * draws.length("width", (0.28, 0.92))
    depth, height = draws.lengths(depth=(0.28, 0.56), height=(0.02, 0.12))
    strip = draws.length("strip_width", (0.06, 0.1))  # for the dials
    beside, side = draws.chance("knobs_beside", 0.6), draws.side("knob_side")
    front = 0.004
    body = _hob(draws, half, depth, height, front, 0.008) + box((-front, depth), half, (0, height), fillet=0.008)
    level = height + 0.008
    if beside:
        strip_y = (side * (half - 0.01), side * (half + strip))
        body += box((-front, depth), strip_y, (0.0, level), fillet=0.006).called("panel", UP)
    count, room = draws.integer("knobs", 1, 6), (depth if beside else 1.8 * half)
    gap = min(room / (count + 1), draws.length("knob_spacing", (0.05, 0.12)))
    radius = min(draws.length("knob_radius", (0.014, 0.028)), 0.42 * gap, 0.26 * strip)
    along = draws.length("knobs_start", (0.5 * gap, room - (count - 0.5) * gap)) + gap * np.arange(count)
    middle = side * (half + 0.02 + 0.5 * (strip - 0.02))
    feet = [(v, middle, level) if beside else (-0.5 * strip, v - 0.5 * room, level) for v in along.tolist()]
    if not beside:
        body += box((-strip, 0.01), half, (0, level), fillet=0.006).called("panel", UP)
    cooktop = Assembly()
    cooktop.add("body", body, density=350.0)
    reach = draws.length("knob_reach", (0.015, 0.035))
    axis = draws.one_of("knob_turns", {"clockwise": (0, 0, -1), "counterclockwise": (0, 0, 1)})
    _add_knobs(cooktop, feet, UP, axis, reach, radius, draws.chance("knob_stops", 0.25))
    return cooktop


def _add_knobs(
    oven: Assembly, feet: Sequence[Vector], outward: Vector, axis: Vector, reach: float, radius: float, stops: bool
) -> None:
    for number, foot in enumerate(feet, 1):
        turn = revolute("body", axis, foot, 0.0, 5.0) if stops else continuous("body", axis, foot)
        oven.add(f"knob_{number}", dial(foot, outward, reach, radius), turn)


def _hob(draws: Draws, half: float, depth: float, z: float, thick: float, rise: float | None = None) -> Solid:
    """Worktop with two to six burners, ``rise`` above the height ``z``."""
    top = z + (draws.length("hob_thickness", (0.008, 0.03)) if rise is None else rise)
    over = draws.length("hob_overhang", (0.0, 0.012))
    solid = box((-thick - over, depth), half + over, (z - 0.001, top), fillet=0.004)
    columns = 3 if half > 0.34 else 2 if half > 0.22 else 1
    ys = (np.arange(columns) - 0.5 * (columns - 1)) * (1.9 * half / columns)
    kind = draws.pick("burner", {"gas": 0.5, "coil": 0.25, "glass": 0.25})
    if kind == "glass":
        pane = box((-thick + 0.02, depth - 0.07), half - 0.02, (top - 0.001, top + 0.003), fillet=0.01, axis=2)
        solid += pane.called("glass", UP)
    for x in np.array([0.24, 0.68]) * depth:
        for y in ys:
            radius = draws.length("burner_radius", (0.025, 0.045) if kind == "gas" else (0.06, 0.1))
            radius = min(radius, 0.2 * depth)
            if kind == "glass":
                solid += rod(x, y, (top, top + 0.0045), radius, sections=28)
            elif kind == "coil":
                solid += rod(x, y, (top - 0.001, top + 0.006), radius, sections=28)
                solid += rod(x, y, (top, top + 0.014), 0.75 * radius, sections=24)
            else:
                solid += rod(x, y, (top - 0.001, top + 0.012), radius, 0.8 * radius, 20)
    if kind == "gas":
        solid += union(_grate(0.46 * depth, y, 0.4 * depth, 0.92 * half / columns, top) for y in ys)
    return solid


def _grate(x: float, y: float, long: float, wide: float, low: float) -> Solid:
    """Iron grate over the burners of one column."""
    bar, lift = 0.009, low + 0.02
    across, upright = about(y, wide), (lift, lift + 1.5 * bar)
    solid = frame((x - long, y - wide, lift), (x + long, y + wide, lift + bar), [bar] * 4, 0, 1)
    solid += box(about(x, long), about(y, 0.5 * bar), upright)
    solid += union(box(about(u, 0.5 * bar), across, upright) for u in (x - 0.55 * long, x, x + 0.55 * long))
    feet = [(u, v) for u in (x - long, x + long - bar) for v in (y - wide, y + wide - bar)]
    return solid + union(box((u, u + bar), (v, v + bar), (low - 0.001, lift + 0.001)) for u, v in feet)


def _door(draws: Draws, low: Array, high: Array, kind: str, reach: float) -> tuple[Solid, float]:
    """Door with a window or a board, and the height of its handle."""
    tall, half = high[2] - low[2], high[1]
    grip = high[2] - draws.length("handle_below_top", (0.03, 0.05))
    side = draws.length("door_margin", (0.05, 0.12))
    bottom = draws.length("door_margin_below", (0.05, 0.1)) if tall > 0.3 else 0.05
    margins = [side, side, bottom, high[2] - grip + 0.03]
    if draws.chance("window", 0.75):
        pane, inset = draws.lengths(window_thickness=(0.006, 0.02), window_inset=(0.001, 0.006))
        solid = windowed_panel(low, high, margins, pane, inset)
    else:
        solid = box(low, high, fillet=0.005)
        if draws.chance("door_board", 0.6):
            solid += box(low + (-0.003, side, margins[2]), high - (0.01, side, margins[3]), fillet=0.002)
    span = half * draws.number("handle_length", (0.6, 0.93))
    radius = draws.length("handle_radius", (0.007, 0.012))
    return solid + front_handle(kind, (low[0], -span, grip), (low[0], span, grip), reach, radius), float(grip)


def _hinge(draws: Draws, low: Array, high: Array, sideways: bool, grip: float, reach: float) -> JointSpec:
    """Hinge at the side, or along the lower front edge; its handle must not sink by ``reach`` onto a door below."""
    if sideways:
        left, upper = draws.chance("hinge_left", 0.5), draws.turn("door_angle", (85.0, 130.0))
        return side_hinge(0.0, high[1] if left else low[1], upper, left)
    level = draws.chance("door_opens_level", 0.7)
    upper = np.deg2rad(90.0 if level else draws.degrees("door_angle", (75.0, 90.0)))
    if reach > 0:
        upper = min(upper, float(arctan2(grip - low[2] - 0.03, reach + 0.015)))
    return revolute("body", (0, -1, 0), (low[0], 0.0, low[2]), 0.0, upper)


def _drawer(
    draws: Draws, half: float, depth: float, thick: float, wall: float, low: float, high: float, kind: str
) -> Solid:
    """Drawer below the oven, for trays."""
    solid = box((-thick, 0.0), half - 0.001, (low + GAP, high - GAP), fillet=0.005)
    side = half - wall - 0.004
    inner = max(low + 0.023, low + wall + 0.003)
    solid += tray((-0.003, -side, inner), (depth - 0.05, side, high - 0.03), 0.006)
    if draws.chance("drawer_handle", 0.6):
        z, span = 0.5 * (low + high) + 0.02, half * draws.number("drawer_handle_length", (0.3, 0.8))
        solid += front_handle(kind, (-thick, -span, z), (-thick, span, z), 0.03, 0.007)
    return solid


def _controls(draws: Draws, oven: Assembly, half: float, face: float, z: float, room: float) -> None:
    """A row of dials, perhaps in two groups, and perhaps buttons between them."""
    count, reach = draws.integer("knobs", 2, 7), draws.length("knob_reach", (0.018, 0.035), (0.01, 0.055))
    stops = draws.chance("knob_stops", 0.35)
    end = draws.number("knob_row", (0.85, 0.85), (0.85, 1.2), tails=0.3)  # its length, with a gap before it
    ys = np.linspace(-end, end, count + 2)[1:-1] * half
    if draws.chance("knobs_in_two_groups", 0.4):
        ys = np.sign(ys + 1e-6) * (0.25 + 0.65 * np.abs(ys) / half) * half
    gap = float(np.diff(ys).min())
    room = min(0.75 * room, 0.42 * gap, half - float(np.abs(ys).max()) - 0.002)
    radius = min(draws.length("knob_radius", (0.016, 0.026), (0.01, 0.045)), room)
    _add_knobs(oven, [(face, y, z) for y in ys.tolist()], FRONT, FRONT, reach, radius, stops)
    if count < 4 and draws.chance("buttons_between", 0.5) and 0.5 * gap - radius > 0.011:
        for number, y in enumerate((0.5 * (ys[:-1] + ys[1:])).tolist(), 1):
            add_push_button(oven, number, (face, y, z), (0.018, 0.012), 0.003)
