"""Tables and desks: drawers and doors under the top, and what else of a table moves.

What varies: the kind (apron between legs, pedestals, a case on a stand, a column), size and proportions (a few are long
consoles, low slabs, deep or tall stands), tops (square, round, oval), legs, the grid of cells under the top and what
they hold, cells at the back, leaves that drop, tops that turn, tip or rise, a tray for a keyboard, wheels.
"""

from dataclasses import replace

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import unusual_sides
from artsim.families.fronts import Style
from artsim.families.table_parts import (
    GAP,
    PEDESTALS,
    add_case,
    drop_leaves,
    four_legs,
    keyboard_tray,
    table_top,
    wheels,
)
from artsim.making.assembly import Assembly, prismatic, revolute, swivel
from artsim.making.draws import Draws
from artsim.making.outlines import UP, about, ends, lifted, superellipse, turns
from artsim.making.solids import Solid, box, hull_of, loft, ring, rod, union

LEAST_SHARES, MOST_SHARES = (0.105, 0.27, 0.12), (0.79, 0.985, 0.94)
"""Depth, width and height of unusual tables over their diagonal."""


def build(draws: Draws) -> Assembly:
    """A table, all drawers and doors closed at rest."""
    table = Assembly("body", density=650.0)
    makers = {"apron": _apron, "pedestals": _pedestals, "case": _case, "column": _column}
    draws.one_of("kind", makers, (0.36, 0.27, 0.25, 0.12))(draws, table)
    return table


def _style(draws: Draws, deep: bool = False) -> Style:
    """Of all fronts; the drawers of a deep table come out nearly wholly."""
    return Style(
        face=0.0,
        back=0.0,
        board=draws.length("board", (0.012, 0.024)),
        lap=1.0,
        place=draws.pick("handle_place", [0.5, 0.7, 0.85]),
        level=draws.chance("handles_level", 0.2),
        thickness=draws.length("front_thickness", (0.014, 0.022)),
        overlay=draws.chance("overlay", 0.5),
        panel=draws.pick("panel", {"slab": 0.62, "shaker": 0.15, "raised": 0.15, "planks": 0.04, "glass": 0.04}),
        rail=draws.length("rail", (0.025, 0.06)),
        recess=draws.length("recess", (0.004, 0.008)),
        handle=draws.pick("handle", {"bar": 0.24, "bow": 0.15, "knob": 0.25, "block": 0.05, "cup": 0.05, "none": 0.26}),
        handle_length=draws.length("handle_length", (0.06, 0.4)),
        reach=draws.length("handle_reach", (0.014, 0.04)),
        grip=draws.length("handle_radius", (0.004, 0.008)),
        travel=draws.number("travel", (0.92, 1.0) if deep else (0.5, 0.9), None if deep else (0.35, 1.0), tails=0.4),
    )


def _apron(draws: Draws, table: Assembly) -> None:
    """Legs with a low case between them under the top; leaves at the ends, a shelf below, wheels."""
    height = draws.length("height", (0.32, 0.95))
    width, depth = height * draws.number("width", (0.65, 3.4)), height * draws.number("depth", (0.4, 1.7))
    width, depth = float(np.clip(width, 0.34, 2.4)), float(np.clip(depth, 0.3, 1.1))
    if draws.chance("unusual", 0.3):
        depth, width, height = unusual_sides(draws, LEAST_SHARES, MOST_SHARES, (0.28, 0.34, 0.3))
    thick, over = draws.lengths(top_thickness=(0.014, 0.06), top_overhang=(0.0, 0.06))
    size = min(height * draws.number("leg_width", (0.04, 0.12)), 0.2 * depth, 0.15 * width)
    over = min(over, 0.12 * depth)
    top, x, y = height - thick, depth / 2 - over, width / 2 - over
    apron = min(max(height * draws.number("apron_height", (0.12, 0.32)), 0.09), 0.5 * height)
    rolling = draws.chance("rolling", 0.12)
    foot = 0.07 if rolling else 0.0
    table.body += table_top(draws, depth, width, top, height)
    table.body += four_legs(draws, x, y, foot, top + 0.001, size, splay=draws.chance("legs_splayed", 0.2))
    style = _style(draws, depth > width)
    inset = 0.25 * size
    both = draws.chance("both_sides", 0.12) and 2 * x > 0.5
    rear = not both and draws.chance("at_back", 0.1)
    deep = (0.47 if both else draws.number("case_depth", (0.6, 1.0))) * (2 * x - 2 * inset)
    half = y - 0.5 * size
    grid = draws.pick("columns", {1: 0.45, 2: 0.25, 3: 0.2, 4: 0.1}), 1 if apron < 0.22 else draws.integer("rows", 1, 2)
    # The fronts lie between the legs.
    style = replace(style, overlay=style.overlay and inset > 0.02)
    room = y - size - 0.001 if 2.0 * (y - size - 0.001) >= 0.2 else 0.1
    low, high = (-x + inset, -room, top - apron), (-x + inset + deep, room, top + 0.001)
    for back in (False, True):
        if both or back == rear:
            add_case(draws, table, low, high, style, grid, 0.25, back)
    rail = min(0.008, 0.4 * size)
    for s in (-1, 1):  # rails into the legs, beside and behind the case
        if (s > 0 and not both and not rear) or (s < 0 and rear):
            table.body += box(about(s * (x - inset), 0.008), half, (top - apron, top + 0.001))
        table.body += box(x - 0.5 * size, (s * half - rail, s * half + rail), (top - apron, top + 0.001))
        for near in (-x + inset, x - inset - 0.012):
            table.body += box((near, near + 0.012), (s * (room - 0.002), s * half), (top - apron, top + 0.001))
    if draws.chance("shelf", 0.25):
        z = foot + draws.number("shelf_height", (0.1, 0.4)) * (top - apron - foot)
        table.body += box(x - 0.3 * size, y - 0.3 * size, (z, z + 0.018))
    if draws.chance("drop_leaves", 0.1):
        drop_leaves(draws, table, depth, width, top, height)
    if rolling:
        wheels(table, [(u, v) for u in ends(x - 0.5 * size) for v in ends(y - 0.5 * size)], foot, size)


def _pedestals(draws: Draws, table: Assembly) -> None:
    """A desk: cases at one or both ends, legs or a panel elsewhere, a flat case or a tray between."""
    height = draws.length("height", (0.62, 0.85))
    width, depth = height * draws.number("width", (1.3, 3.4)), height * draws.number("depth", (0.5, 1.4))
    thick, over = draws.lengths(top_thickness=(0.016, 0.05), top_overhang=(0.0, 0.05))
    top, x, y = height - thick, depth / 2 - over, width / 2 - over
    table.body += table_top(draws, depth, width, top, height)
    style = _style(draws)
    broad = min(draws.length("pedestal_width", (0.26, 0.5), (0.1, 0.6), tails=0.4), 0.38 * width)
    sides, rolling = draws.one_of("pedestals", PEDESTALS, (0.3, 0.3, 0.4)), draws.chance("rolling", 0.1)
    on_legs = not rolling and draws.chance("on_legs", 0.35)
    size = draws.length("leg_width", (0.03, 0.06))
    outer = y - (size if on_legs else 0.0)
    panel = 0.001
    low_z = 0.07
    if on_legs:
        low_z = draws.number("pedestal_bottom", (0.1, 0.5)) * height
    elif not rolling:
        low_z = draws.one_of("stands_on", {"floor": 0.0, "plinth": draws.length("plinth_height", (0.03, 0.12))})
    broad = min(broad, outer - 0.1) if len(sides) == 2 else broad  # room for knees
    deep = draws.number("pedestal_depth", (0.75, 1.0)) * 2 * x
    recipe, alike = draws.seed("pedestal_pattern"), draws.chance("pedestals_alike", 0.6)
    doors = draws.pick("door_share", {0.0: 0.45, 0.4: 0.3, 1.0: 0.25})
    overhang = style.thickness + 0.004 if style.overlay else 0.0
    front = -x + overhang
    for side in sides:
        a, b = sorted((side * outer, side * (outer - broad)))
        draw = draws.fork("", recipe) if alike else draws
        low, high = (front, a, low_z), (front + deep - overhang, b, top + 0.001)
        free = (side < 0 and not on_legs, side > 0 and not on_legs)
        add_case(draw, table, low, high, style, (1, draw.integer("rows", 1, 4)), doors, free=free)
        if not on_legs and not rolling and low_z > 0:
            upright = (0.0, low_z + 0.001)
            table.body += box((front + 0.03, front + deep - overhang - 0.02), (a + 0.01, b - 0.01), upright)
        if rolling:
            spots = [(u, v) for u in (front + 0.05, front + deep - overhang - 0.05) for v in (a + 0.05, b - 0.05)]
            wheels(table, spots, low_z, 0.05)
    if on_legs:
        table.body += four_legs(draws, x, y, 0.0, top + 0.001, size)
    elif len(sides) == 1:
        panel = draws.length("end_panel", (0.02, 0.05))
        table.body += box((-x + overhang, x), (-sides[0] * y, -sides[0] * (y - panel)), (0.0, top + 0.001))
    near = -outer + (broad if -1 in sides else panel) - 0.001
    far = outer - (broad if 1 in sides else panel) + 0.001
    deepest, drop = front + deep - overhang, draws.number("back_panel", (0.2, 0.8)) * (top - low_z)
    table.body += box((deepest - 0.03, deepest - 0.012), (near, far), (top - drop, top + 0.001))
    between = draws.pick("between", {"case": 0.45, "tray": 0.2, "nothing": 0.35})
    if far - near < 0.2:
        between = "nothing"
    if between == "case":
        flat = draws.length("case_height", (0.085, 0.14))
        low, high = (front, near, top - flat), (front + 0.8 * deep - 0.04, far, top + 0.001)
        add_case(draws, table, low, high, style, (draws.integer("columns", 1, 3), 1), 0.0)
    elif between == "tray":
        keyboard_tray(draws, table, front, near, far, top, 0.6 * deep)
    if draws.chance("top_shelves", 0.15):
        rise, back = draws.length("top_shelf_height", (0.2, 0.5)), x - draws.length("top_shelf_depth", (0.18, 0.3))
        table.body += union(box((back, x), (yy, yy + 0.02), (height - 0.001, height + rise)) for yy in (-y, y - 0.02))
        table.body += box((back, x), y, (height + rise - 0.02, height + rise))


def _case(draws: Draws, table: Assembly) -> None:
    """A low table or a console: one case from side to side on legs, a plinth or wheels."""
    height = draws.length("height", (0.3, 0.95))
    width, depth = height * draws.number("width", (0.6, 3.2)), height * draws.number("depth", (0.4, 1.6))
    width, depth = max(width, 0.34), float(np.clip(depth, 0.28, 0.9))
    if draws.chance("unusual", 0.45):
        depth, width, height = unusual_sides(draws, LEAST_SHARES, MOST_SHARES, (0.28, 0.34, 0.28))
    thick, over = draws.lengths(top_thickness=(0.012, 0.05), top_overhang=(0.0, 0.05))
    top, x, y = height - thick, depth / 2 - min(over, 0.1 * depth), width / 2 - over
    style = _style(draws, depth > width)
    stand = draws.pick("stand", {"legs": 0.55, "plinth": 0.3, "wheels": 0.15})
    legs, plinth = draws.number("leg_height", (0.12, 0.65)), draws.number("plinth_height", (0.03, 0.2))
    low = {"legs": legs, "plinth": plinth, "wheels": 0.0}[stand] * height
    low = 0.07 if stand == "wheels" else min(low, top - 0.12)
    ahead = style.thickness + 0.004 if style.overlay else 0.0
    table.body += table_top(draws, depth, width, top, height)
    rows = draws.integer("rows", 1, 3)
    columns = max(1, min(4, int(width / draws.length("column_width", (0.3, 0.7)))))
    both = draws.chance("both_sides", 0.1) and depth > 0.5
    corners = (-x + ahead, -y, low), (-0.002 if both else x, y, top + 0.001)
    for back in (False, True)[: 1 + both]:
        doors = draws.pick("door_share", [0.0, 0.5, 1.0])
        add_case(draws, table, *corners, style, (columns, rows), doors, back, free=(True, True))
    size = draws.length("leg_width", (0.02, 0.05))
    if stand == "legs":
        table.body += four_legs(draws, x - ahead, y, 0.0, low + 0.002, size, splay=draws.chance("legs_splayed", 0.3))
    elif stand == "plinth":
        inset = draws.length("plinth_setback", (0.01, 0.06))
        table.body += box((-x + ahead + inset, x - inset), y - inset, (0.0, low + 0.001))
    else:
        wheels(table, [(u, v) for u in ends(x - 0.06) for v in ends(y - 0.06)], low, 0.05)


def _column(draws: Draws, table: Assembly) -> None:
    """A top on a column that turns, tips or rises, on feet, a disc or wheels."""
    height, wide = draws.length("height", (0.45, 1.1)), 0.5 * draws.length("depth", (0.44, 1.2))
    thick = draws.length("top_thickness", (0.015, 0.05))
    power = draws.one_of("top_corners", {"round": 2.0, "rounded": 4.0, "square": 12.0})
    long = wide * draws.one_of("top_shape", {"even": 1.0, "long": draws.number("width", (1.0, 2.2))})
    outline = superellipse(power, wide, long, 32)

    def slab(z: float) -> Solid:
        sections = ((0.96, z), (1.0, z + 0.3 * thick), (1.0, z + 0.8 * thick), (0.98, z + thick))
        return loft([lifted(share * outline, level) for share, level in sections])

    radius, feet = draws.length("column_radius", (0.022, 0.06)), draws.pick("feet", [0, 3, 4, 5])
    rolling = feet > 2 and draws.chance("rolling", 0.4)
    foot = 0.06 if rolling else 0.0
    span = wide * draws.number("foot_reach", (0.55, 0.9))
    base, low, spots = Solid(), foot + 0.05, []
    for angle in turns(feet, 0.5):
        leg = hull_of(
            box((0, 0.01), 0.6 * radius, (low, low + draws.length("foot_height", (0.05, 0.15)))),
            box((span - 0.02, span + 0.015), 0.02, (foot, foot + 0.03)),
        )
        base += leg.turned(UP, angle)
        spots.append((span * cos(angle), span * sin(angle)))
    if not feet:
        base += rod(0, 0, (0, 0.02), span, 0.9 * span, 32) + rod(0, 0, (0.02, 0.06), 2 * radius, radius, 24)
    kind = draws.pick("top_moves", ["turning", "tipping", "rising"])
    top = height - thick
    if kind == "rising":
        sleeve, inner = 0.62 * top, 0.7 * radius
        base += ring((0, 0, 0.5 * (low + sleeve)), UP, inner + GAP, radius + GAP, sleeve - low, 16)
        base += rod(0, 0, (foot + 0.01, low + 0.01), radius + GAP)
        travel = draws.number("rise", (0.3, 0.6)) * (sleeve - low)
        pole = rod(0, 0, (sleeve - travel - 0.05, top + 0.002), inner, sections=16)
        table.add_numbered("top", pole + slab(top), prismatic("body", UP, 0.0, travel, (0, 0, top)))
    elif kind == "turning":
        base += rod(0, 0, (foot + 0.01, top - GAP), radius)
        base += rod(0, 0, (top - 0.02 - GAP, top - GAP), min(3 * radius, 0.5 * wide))
        limit = None if draws.chance("turns_freely", 0.6) else 1.57
        table.add_numbered("top", slab(top), swivel("body", UP, (0, 0, top), limit))
    else:
        base += rod(0, 0, (foot + 0.01, top - 0.05), radius)
        base += box((-radius, 0.5 * radius), radius, (top - 0.06, top - 0.02))
        hinge = (radius + 0.01, 0.0, top - 0.03)
        deep, upright = about(hinge[0], 0.01), (top - 0.04, top + 0.002)
        lugs = union(box(deep, about(y, 0.008), upright) for y in (-1.3 * radius, 1.3 * radius))
        base += box((0.0, hinge[0] + 0.005), 1.1 * radius, (top - 0.04, top - 0.025))
        # Beyond the hinge's axis the top comes down before the column.
        tip = revolute("body", (0, 1, 0), hinge, 0.0, draws.angle("top_angle", (0.5, 0.9)))
        table.add_numbered("top", slab(top) + lugs, tip)
    table.body += base
    if rolling:
        wheels(table, spots, foot, 0.03)
