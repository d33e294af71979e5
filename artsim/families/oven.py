"""Ovens: cookers with a hob, ovens to build in, and cooktops whose knobs alone turn.

What varies: one door or two that drop down, or one that opens sideways; a drawer below; a hob with gas grates, coils or
a glass top; a guard at the back; dials in front or on the guard, with or without stops; window, handle, racks, feet.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import arctan2
from artsim.families.details import dial, front_handle, push_button, side_hinge, windowed_panel, wire_shelf
from artsim.families.proportions import with_tails
from artsim.making.assembly import Assembly, JointSpec, Rng, continuous, pick, prismatic, revolute
from artsim.making.solids import Solid, box, frame, posts, rod, tray, union
from artsim.model.kinematics import Array

GAP = 0.002


def build(rng: Rng) -> Assembly:
    """An oven, closed at rest. The back of its doors is the plane x = 0."""
    if rng.random() < 0.12:
        return _cooktop(rng)
    built_in = rng.random() < 0.25
    half = 0.5 * (rng.uniform(0.54, 0.62) if built_in else with_tails(rng, (0.48, 0.78), (0.44, 1.0)))
    depth = with_tails(rng, (0.5, 0.66), (0.42, 0.72))
    height = rng.uniform(0.44, 0.62) if built_in else rng.uniform(0.82, 0.95)
    two = not built_in and rng.random() < 0.2
    wall, thick = rng.uniform(0.03, 0.05), with_tails(rng, (0.03, 0.06), (0.022, 0.1))
    guard = 0.0 if built_in or rng.random() < 0.55 else rng.uniform(0.06, 0.2)
    on_guard = guard > 0.11 and rng.random() < 0.6  # the dials
    strip = rng.uniform(0.02, 0.05) if on_guard else with_tails(rng, (0.08, 0.13), (0.07, 0.2))
    plinth = 0.01 if built_in else rng.uniform(0.03, 0.11)
    drawer = rng.uniform(0.13, 0.2) if not built_in and not two and rng.random() < 0.55 else 0.0
    ceiling = height - strip

    oven = Assembly()
    oven.record(handles=True)
    body = tray((GAP, -half, plinth), (depth, half, height), wall, 0.02, axis=0, side=-1)
    body += box((-thick, 0.02), half, (ceiling, height), fillet=0.004, axis=1)
    body += posts((0.05, depth - 0.05), half - 0.05, (0, plinth + 0.01), 0.02)
    if not built_in:
        body += _hob(rng, half, depth, height, thick)
        if rng.random() < 0.6:  # a plinth set back
            body += box((0.03, depth - 0.01), half - 0.004, (0.0, plinth + 0.002))
    if guard > 0:
        body += box((depth - 0.05, depth), half, (height - 0.01, height + guard), fillet=0.006, axis=1)
    floor = plinth + drawer
    if drawer > 0:
        body += box((GAP, depth - 0.01), half - 0.01, (floor - 0.012, floor + 0.01))
    edges = [floor, ceiling] if not two else [floor, floor + rng.uniform(0.5, 0.62) * (ceiling - floor), ceiling]
    for low, high in pairwise(edges):
        body += box((GAP, depth - 0.01), half - 0.01, (high - wall, high + 0.01))
        body += box((GAP, depth - 0.01), half - 0.01, (low, low + wall))
        for z in np.linspace(low + wall, high - wall, int(rng.integers(2, 4)))[1:-1]:
            body += wire_shelf(
                (0.05, wall - half - 0.002, z), (depth - wall + 0.002, half - wall + 0.002, z + 0.006), 7, 0.006
            )
    oven.add("body", body, density=350.0)

    sideways = bool(not two and rng.random() < 0.1)
    kind, reach = pick(rng, ["bar", "bow", "flat"]), rng.uniform(0.035, 0.055)
    for number, (low, high) in enumerate(pairwise(edges), 1):
        corner_low = np.array([-thick, 0.001 - half, low + GAP])
        # The upper back edge of a door that drops rises before it falls.
        rise = thick * thick / (2.0 * (high - low))
        corner_high = np.array([0.0, half - 0.001, high - max(3 * GAP, rise + GAP)])
        name = f"door_{number}" if two else "door"
        door, grip = _door(rng, corner_low, corner_high, kind, reach)
        oven.add(name, door, _hinge(rng, corner_low, corner_high, sideways, grip, reach if number == 2 else 0.0))
    if drawer > 0:
        # The handle of the open door hangs down: the drawer stops before it.
        travel = min(0.65 * depth, grip - floor - 0.09)
        oven.add("drawer", _drawer(rng, half, depth, thick, wall, plinth, floor, kind),
                 prismatic("body", (-1, 0, 0), 0.0, travel, (0, 0, 0.5 * (plinth + floor))))  # fmt: skip
    face, middle = (depth - 0.05, height + 0.66 * guard) if on_guard else (-thick, height - 0.5 * strip)
    _dials(rng, oven, half, face, middle, min(0.3 * guard, 0.035) if on_guard else 0.5 * strip)
    return oven


def _cooktop(rng: Rng) -> Assembly:
    """A hob to stand on a worktop or to sink into it: a slab with a row of dials, at one side or in front."""
    half, depth, height = rng.uniform(0.14, 0.46), rng.uniform(0.28, 0.56), rng.uniform(0.02, 0.12)
    strip = rng.uniform(0.06, 0.1)  # for the dials
    beside = rng.random() < 0.6
    front = 0.004
    side = float(rng.choice([-1.0, 1.0]))
    body = _hob(rng, half, depth, height, front, 0.008) + box((-front, depth), half, (0, height), fillet=0.008)
    level = height + 0.008
    if beside:
        body += box((-front, depth), (side * (half - 0.01), side * (half + strip)), (0.0, level), fillet=0.006)
    cooktop = Assembly()
    count, room = int(rng.integers(1, 7)), (depth if beside else 1.8 * half)
    gap = min(room / (count + 1), rng.uniform(0.05, 0.12))
    radius = min(rng.uniform(0.014, 0.028), 0.42 * gap, 0.26 * strip)
    start = rng.uniform(0.5 * gap, room - (count - 0.5) * gap)
    feet = []
    for share in start + gap * np.arange(count):
        middle = side * (half + 0.02 + 0.5 * (strip - 0.02))
        feet.append((float(share), middle, level) if beside else (-0.5 * strip, float(share) - 0.5 * room, level))
    if not beside:
        body += box((-strip, 0.01), half, (0, level), fillet=0.006)
    cooktop.add("body", body, density=350.0)
    reach, axis = rng.uniform(0.015, 0.035), (0, 0, float(rng.choice([-1.0, 1.0])))
    stops = rng.random() < 0.25
    for number, foot in enumerate(feet, 1):
        turn = revolute("body", axis, foot, 0.0, 5.0) if stops else continuous("body", axis, foot)
        cooktop.add(f"knob_{number}", dial(foot, (0, 0, 1), reach, radius), turn)
    return cooktop


def _hob(rng: Rng, half: float, depth: float, z: float, thick: float, rise: float | None = None) -> Solid:
    """Worktop with two to six burners, ``rise`` above the height ``z``."""
    top = z + (rng.uniform(0.008, 0.03) if rise is None else rise)
    over = rng.uniform(0.0, 0.012)
    solid = box((-thick - over, depth), half + over, (z - 0.001, top), fillet=0.004)
    columns = 3 if half > 0.34 else 2 if half > 0.22 else 1
    ys = (np.arange(columns) - 0.5 * (columns - 1)) * (1.9 * half / columns)
    kind = pick(rng, {"gas": 0.5, "coil": 0.25, "glass": 0.25})
    if kind == "glass":
        solid += box((-thick + 0.02, depth - 0.07), half - 0.02, (top - 0.001, top + 0.003), fillet=0.01, axis=2)
    for x in np.array([0.24, 0.68]) * depth:
        for y in ys:
            radius = min(rng.uniform(0.06, 0.1), 0.2 * depth) if kind != "gas" else rng.uniform(0.025, 0.045)
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
    solid = frame((x - long, y - wide, lift), (x + long, y + wide, lift + bar), [bar] * 4, 0, 1)
    solid += box((x - long, x + long), (y - 0.5 * bar, y + 0.5 * bar), (lift, lift + 1.5 * bar))
    for u in (x - 0.55 * long, x, x + 0.55 * long):
        solid += box((u - 0.5 * bar, u + 0.5 * bar), (y - wide, y + wide), (lift, lift + 1.5 * bar))
    feet = [(u, v) for u in (x - long, x + long - bar) for v in (y - wide, y + wide - bar)]
    return solid + union(box((u, u + bar), (v, v + bar), (low - 0.001, lift + 0.001)) for u, v in feet)


def _door(rng: Rng, low: Array, high: Array, kind: str, reach: float) -> tuple[Solid, float]:
    """Door with a window or a board, and the height of its handle."""
    tall, half = high[2] - low[2], high[1]
    grip = high[2] - rng.uniform(0.03, 0.05)
    side = rng.uniform(0.05, 0.12)
    margins = [side, side, rng.uniform(0.05, 0.1) if tall > 0.3 else 0.05, high[2] - grip + 0.03]
    if rng.random() < 0.75:
        solid = windowed_panel(low, high, margins, rng.uniform(0.006, 0.02), rng.uniform(0.001, 0.006))
    else:
        solid = box(low, high, fillet=0.005)
        if rng.random() < 0.6:
            solid += box(low + (-0.003, side, margins[2]), high - (0.01, side, margins[3]), fillet=0.002)
    span = half * rng.uniform(0.6, 0.93)
    radius = rng.uniform(0.007, 0.012)
    return solid + front_handle(kind, (low[0], -span, grip), (low[0], span, grip), reach, radius), float(grip)


def _hinge(rng: Rng, low: Array, high: Array, sideways: bool, grip: float, reach: float) -> JointSpec:
    """Hinge at the side, or along the lower front edge; its handle must not sink by ``reach`` onto a door below."""
    if sideways:
        left = bool(rng.random() < 0.5)
        return side_hinge(0.0, high[1] if left else low[1], np.deg2rad(rng.uniform(85.0, 130.0)), left)
    upper = np.deg2rad(90.0 if rng.random() < 0.7 else rng.uniform(75.0, 90.0))
    if reach > 0:
        upper = min(upper, float(arctan2(grip - low[2] - 0.03, reach + 0.015)))
    return revolute("body", (0, -1, 0), (low[0], 0.0, low[2]), 0.0, upper)


def _drawer(
    rng: Rng, half: float, depth: float, thick: float, wall: float, low: float, high: float, kind: str
) -> Solid:
    """Drawer below the oven, for trays."""
    solid = box((-thick, 0.0), half - 0.001, (low + GAP, high - GAP), fillet=0.005)
    side = half - wall - 0.004
    inner = max(low + 0.023, low + wall + 0.003) if wall > 0.02 else low + 0.023
    solid += tray((-0.003, -side, inner), (depth - 0.05, side, high - 0.03), 0.006)
    if rng.random() < 0.6:
        z, span = 0.5 * (low + high) + 0.02, half * rng.uniform(0.3, 0.8)
        solid += front_handle(kind, (-thick, -span, z), (-thick, span, z), 0.03, 0.007)
    return solid


def _dials(rng: Rng, oven: Assembly, half: float, face: float, z: float, room: float) -> None:
    """A row of dials, perhaps around a display, and perhaps buttons."""
    count = int(rng.integers(2, 8))
    reach = with_tails(rng, (0.018, 0.035), (0.01, 0.055))
    stops = rng.random() < 0.35
    end = with_tails(rng, (0.85, 0.85), (0.85, 1.1), 0.3)  # of the row of dials, with a gap before it
    ys = np.linspace(-end, end, count + 2)[1:-1] * half
    if rng.random() < 0.4:  # in two groups
        ys = np.sign(ys + 1e-6) * (0.25 + 0.65 * np.abs(ys) / half) * half
    room = min(0.75 * room, 0.42 * float(np.diff(ys).min()), half - float(np.abs(ys).max()) - 0.002)
    radius = min(with_tails(rng, (0.016, 0.026), (0.01, 0.045)), room)
    for number, y in enumerate(ys, 1):
        foot = (face, float(y), z)
        turn = revolute("body", (-1, 0, 0), foot, 0.0, 5.0) if stops else continuous("body", (-1, 0, 0), foot)
        oven.add(f"knob_{number}", dial(foot, (-1, 0, 0), reach, radius), turn)
    if count < 4 and rng.random() < 0.5:
        for number, y in enumerate(0.5 * (ys[:-1] + ys[1:]), 1):
            point = (face, float(y), z)
            button = push_button(point, (0.018, 0.012), 0.003)
            oven.add(f"button_{number}", button, prismatic("body", (1, 0, 0), 0.0, 0.0015, point))
