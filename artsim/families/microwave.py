"""Microwave ovens: a door with a window beside a panel of controls, and a turntable.

What varies: hinge on the left, on the right or at the bottom; controls beside, below or none at all; window, handle or
a key that opens the door; dials, keys that move or stay; turntable or a flat floor; feet, vents.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import dial, front_handle, push_button, side_hinge, windowed_panel
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import Array, turns
from artsim.making.solids import Solid, box, posts, rod, tray, union

GAP = 0.0015


def build(draws: Draws) -> Assembly:
    """A microwave oven, closed at rest. The back of its door is the plane x = 0."""
    width, depth = draws.length("width", (0.42, 0.62)), draws.length("depth", (0.30, 0.48), (0.16, 0.62))
    height, wall = draws.length("height", (0.23, 0.37), (0.2, 0.46)), draws.length("wall", (0.012, 0.03))
    thick = draws.length("door_thickness", (0.018, 0.045), (0.008, 0.045))
    foot = draws.length("foot_height", (0.006, 0.018))
    drops = draws.chance("door_drops", 0.15)  # the door falls open, its controls below or above it
    mirrored = draws.chance("mirrored", 0.15)
    half = 0.5 * width
    # Controls take the strip of the front that the door leaves: at -Y (before mirroring), or below it.
    has_panel = draws.chance("controls", 0.88)
    strip = draws.number("controls_width", (0.17, 0.33), (0.17, 0.5)) * width if has_panel else 0.0
    low, high = np.array([-thick, strip - half, foot]), np.array([0.0, half, foot + height])
    panel_low, panel_high = np.array([-thick, -half, foot]), np.array([0.0, strip - half - GAP, foot + height])
    if drops:
        has_panel, strip = True, draws.number("controls_height", (0.16, 0.26)) * height
        low[1:], high[1:] = (-half, foot + strip), (half, foot + height)
        panel_high[1:] = half, foot + strip - GAP
    elif draws.chance("rim", 0.25):  # door and panel within a rim
        low[2] += wall
        high[2] -= wall

    hollow_low = np.array([GAP, low[1] + wall, (low[2] if drops else foot) + wall])
    hollow_high = np.array([depth - wall, half - wall, foot + height - wall])
    body = _body(draws, panel_low[1], half, foot, foot + height, depth, hollow_low, hollow_high)
    if low[2] > foot and not drops:
        body += union(box((-thick, 0.01), half, (z, z + wall - GAP)) for z in (foot, high[2] + GAP))
    oven = Assembly()
    if has_panel:
        body += box(panel_low, panel_high + (0.01, 0, 0), fillet=0.004, axis=1)
    opener = has_panel and not drops and draws.chance("opening_button", 0.35)
    controls, movers = _controls(draws, panel_low, panel_high, opener) if has_panel else (Solid(), [])
    handle = "none" if opener else draws.pick("handle", ["bar", "bow", "flat", "none"])
    oven.record(handles=handle != "none")
    door = _door(draws, low, high, drops, handle)

    def placed(solid: Solid) -> Solid:
        return solid.mirrored(1) if mirrored else solid

    sign = -1.0 if mirrored else 1.0
    oven.add("body", placed(body + controls), density=350.0)
    angle = np.deg2rad(90.0 if drops else draws.degrees("door_angle", (90.0, 150.0), (45.0, 170.0)))
    # The axis of a thin door may stand at the front face: the free edge of a thick one would run into the panel.
    outer = thick if thick * thick < GAP * (high[1] - low[1]) and draws.chance("hinge_at_face", 0.5) else 0.0
    drop = revolute("body", (0, -1, 0), (-thick, 0, low[2]), 0.0, angle)
    oven.add("door", placed(door), drop if drops else side_hinge(-outer, sign * half, angle, not mirrored))
    for name, solid, point in movers:
        point = point * (1.0, sign, 1.0)
        turns = continuous("body", (-1, 0, 0), point)
        oven.add(name, placed(solid), turns if "dial" in name else prismatic("body", (1, 0, 0), 0.0, 0.0015, point))
    if draws.chance("turntable", 0.75):
        center = 0.5 * (hollow_low + hollow_high)
        plate = _turntable(draws, hollow_low, hollow_high, center)
        oven.add("turntable", placed(plate), continuous("body", (0, 0, 1), center * (1, sign, 1)), density=2000.0)
    return oven


def _body(
    draws: Draws, right: float, left: float, low: float, high: float, depth: float, inner: Array, outer: Array
) -> Solid:
    """Case around the hollow from ``inner`` to ``outer``, which is open to the front."""
    shell = 0.012
    solid = tray((GAP, right, low), (depth, left, high), shell, axis=0, side=-1)
    solid += box((GAP, depth - 0.002), (right + 0.002, inner[1]), (low + 0.002, high - 0.002))  # the electronics
    solid += box((GAP, outer[0] + 0.01), (inner[1] - 0.01, left - 0.002), (low + 0.002, inner[2]))
    solid += box((GAP, outer[0] + 0.01), (inner[1] - 0.01, left - 0.002), (outer[2], high - 0.002))
    solid += box((GAP, outer[0] + 0.01), (outer[1], left - 0.002), (low + 0.002, high - 0.002))
    solid += box((outer[0], depth - 0.002), (inner[1] - 0.01, left - 0.002), (low + 0.002, high - 0.002))
    solid += posts((0.05, depth - 0.05), (right + 0.05, left - 0.05), (0, low + 0.004), 0.015)
    if draws.chance("ribs", 0.4):  # ribs over the vents
        for x in np.linspace(0.4, 0.8, 7) * depth:
            upright = (low + 0.55 * (high - low), low + 0.85 * (high - low))
            solid += box((x, x + 0.006), (left - 0.005, left + 0.0025), upright)
    return solid


def _door(draws: Draws, low: Array, high: Array, drops: bool, handle: str) -> Solid:
    """Door with a window, handle at the side away from its hinge."""
    tall, wide = high[2] - low[2], high[1] - low[1]
    edge = draws.length("door_edge", (0.02, 0.06))
    margins = np.array([edge + (0.0 if drops or handle == "none" else 0.035), edge, edge, edge])
    margins[3] += 0.045 if drops and handle != "none" else 0.0
    if draws.chance("window", 0.75):
        solid = windowed_panel(low, high, list(margins), 0.004, draws.length("window_inset", (0.0015, 0.008)))
    else:
        solid = box(low, high, fillet=0.004)
        solid += box(low + (-0.0015, margins[0], margins[2]), high - (0.004, margins[1], margins[3]))
    radius, reach = draws.lengths(handle_radius=(0.005, 0.009), handle_reach=(0.025, 0.042))
    inside = draws.number("handle_inset", (0.08, 0.25))
    start = low + (0, 0.024, inside * tall)
    end = np.array([low[0], start[1], high[2] - inside * tall])
    if drops:
        start = np.array([low[0], low[1] + inside * wide, high[2] - 0.03])
        end = start + (0, (1 - 2 * inside) * wide, 0)
    return solid + front_handle(handle, start, end, reach, radius)


def _controls(draws: Draws, low: Array, high: Array, opener: bool) -> tuple[Solid, list[tuple[str, Solid, Array]]]:
    """What stays on the panel, and what moves: names, solids and places."""
    upright = high[2] - low[2] > high[1] - low[1]
    long, short = (2, 1) if upright else (1, 2)
    center, size = 0.5 * (low + high), high - low
    center[0] = low[0]

    def at(along: float, across: float = 0.0) -> Array:
        point = center.copy()
        point[long] += along * size[long]
        point[short] += across * size[short]
        return point

    fixed, movers = Solid(), []
    span = np.zeros(3)
    span[long], span[short] = 0.06 * size[long], 0.36 * size[short]
    middle = at(0.37)
    fixed += box(middle - span - (0.0015, 0, 0), middle + span + (0.003, 0, 0))  # the display
    if opener:
        keys = [0.12 * size[long], 0.75 * size[short]]
        movers.append(("button_1", push_button(at(-0.39), keys if short == 2 else keys[::-1], 0.003), at(-0.39)))
    if draws.chance("dial_controls", 0.5):
        radius = min(0.36 * size[short], 0.1 * size[long], 0.03)
        radius *= draws.number("dial_radius", (0.9, 1.0), (0.55, 1.0))
        reach = draws.length("dial_reach", (0.012, 0.022), (0.004, 0.022))
        lower = 0.0 if opener else draws.number("dials_lower", (0.0, 0.12))
        for number, along in enumerate((0.15 - lower, -0.15 - lower)[: draws.integer("dials", 1, 2)], 1):
            movers.append((f"dial_{number}", dial(at(along), (-1, 0, 0), reach, radius), at(along)))
        return fixed, movers
    rows, columns = draws.integer("key_rows", 3, 5), draws.integer("key_columns", 2, 3)
    moving = draws.chance("keys_move", 0.35)
    key = (0.7 * 0.72 / columns * size[short], 0.45 / rows * 0.6 * size[long])
    count = 2 if opener else 1
    for along in np.linspace(0.2, -0.22, rows):
        for across in np.linspace(-0.27, 0.27, columns):
            point = at(along, across)
            wide, tall = key if upright else key[::-1]
            if moving and count < 6:
                movers.append((f"button_{count}", push_button(point, (wide, tall), 0.002), point))
                count += 1
            else:
                half = np.array([0.002, 0.5 * wide, 0.5 * tall])
                fixed += box(point - half, point + half)
    return fixed, movers


def _turntable(draws: Draws, low: Array, high: Array, center: Array) -> Solid:
    """Glass plate with a raised rim of beads, 3 mm above the floor."""
    x, y, z = center[0], center[1], low[2] + 0.002
    radius = 0.5 * min(high[0] - low[0], high[1] - low[1]) - draws.length("turntable_clearance", (0.006, 0.02))
    solid = rod(x, y, (z + 0.006, z + 0.012), 0.93 * radius, radius, 32)
    solid += rod(x, y, (z, z + 0.008), draws.length("turntable_hub", (0.03, 0.05)), sections=12)
    for a in turns(3):
        point = np.array([x + 0.8 * radius * cos(a), y + 0.8 * radius * sin(a), z + 0.012])
        solid += box(point - (0.012, 0.006, 0.003), point + (0.012, 0.006, 0.0015))
    return solid
