"""Boxes: cartons with one, two or four flaps (see ``carton``), and rigid boxes, chests and cases with one lid or two.

Sizes and proportions, the shape of lids (flat, hollow, domed, with a skirt), corners, a board at the back, bands, feet,
dividers, handles and latches of rigid boxes vary.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.carton import LEAST_SHARES, MOST_SHARES, carton
from artsim.families.details import bow_handle, knob, rounded_tray
from artsim.families.proportions import unusual_sides
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import UP, about, ends
from artsim.making.solids import Solid, box, frame, hull, posts, rod, tray, union

GAP = 0.0015


def build(draws: Draws) -> Assembly:
    """A box, closed at rest."""
    return carton(draws) if draws.chance("carton", 0.45) else _rigid(draws)


def _rigid(draws: Draws) -> Assembly:
    """Chest, case or jewellery box; its hinge lies behind the back, so that the lid clears it in every state."""
    widths = {"small": draws.length("width", (0.12, 0.35)), "large": draws.length("large_width", (0.4, 1.3))}
    width = draws.one_of("scale", widths)
    depth, height = width * draws.number("depth", (0.42, 0.8)), width * draws.number("height", (0.18, 0.6))
    if draws.chance("unusual", 0.35):
        depth, width, height = unusual_sides(draws, LEAST_SHARES, MOST_SHARES, (0.07, 0.1, 0.05))
    wall = max(0.003, width * draws.number("wall", (0.012, 0.035)))
    x, y = depth / 2, width / 2
    radius = draws.one_of("corners", {"square": 0.0, "round": draws.number("corner_radius", (0.02, 0.1)) * depth})
    band = draws.one_of("edges", {"plain": 0.0, "banded": wall * draws.number("band_thickness", (0.3, 0.6))})
    seam = height + GAP

    body = _rigid_body(draws, x, y, height, wall, radius)
    body += _bands(draws, x, y, 0.0, height, band, wall, radius)
    body += _interior(draws, x, y, height, wall)
    body += _feet(draws, x, y, wall)
    side_handles = height > 0.12 and draws.chance("side_handles", 0.25)
    if side_handles:
        half, z = min(0.4 * x, 0.06), draws.number("side_handle_height", (0.55, 0.75)) * height
        for s in (-1.0, 1.0):
            body += bow_handle((-half, s * y, z), (half, s * y, z), (0, s, 0), 0.5 * half, 0.09 * half)

    chest = Assembly("body", body, 700.0)
    if draws.chance("two_lids", 0.12) and radius == 0.0:  # hinged at the left and the right
        chest.record(handles=True)
        limit, thick = draws.turn("lid_angle", (80.0, 175.0)), wall * draws.number("lid_thickness", (0.6, 1.2))
        for number, (sign, axis) in enumerate(((1, (-1, 0, 0)), (-1, (1, 0, 0)))):
            lid = box(x, (sign * y, sign * GAP), (seam, seam + thick))
            lid += knob((0, sign * 0.12 * y, seam + thick), (0, 0, 1), 0.05 * y, 0.04 * y)
            chest.add(f"lid_{number}", lid, revolute("body", axis, (0, sign * (y + band + 0.001), seam), 0.0, limit))
        return chest
    lid, top, domed = _lid(draws, x, y, seam, height, wall, radius, band == 0.0)
    lid += _bands(draws, x, y, seam, top, band, wall, radius) if top - seam > 3 * wall else Solid()
    handle = "none" if domed else draws.pick("handle", {"knob": 0.1, "bow": 0.15, "none": 0.75})
    size = min(x, 0.5 * y, 0.12)
    if handle == "knob":
        lid += knob((0, 0, top), UP, 0.1 * size, 0.13 * size)
    elif handle == "bow":
        lid += bow_handle((0, -0.6 * size, top), (0, 0.6 * size, top), UP, 0.3 * size, 0.05 * size)
    chest.record(handles=side_handles or handle != "none")
    barrel = max(0.002, 0.25 * wall)
    axis_x = x + band + 0.001 + barrel
    if not domed and top - seam + 0.2 * min(x, y) < 0.7 * height and draws.chance("rear_board", 0.25):
        # A board below that stands out at the back, under the open lid, so that the box does not tip.
        behind = depth * draws.number("rear_board_reach", (0.015, 0.065))
        chest.body += box((x - wall, axis_x + behind), 0.95 * (y - radius), (0.0, 0.6 * wall))
    spans = [(-0.8, -0.6), (0.6, 0.8)] if draws.chance("two_hinges", 0.7) else [(-0.85, 0.85)]
    for first, last in spans:
        lid += rod(axis_x, (first * y, last * y), seam, barrel, sections=12)
        lid += box((x - wall, axis_x), (first * y, last * y), (seam + 0.0003, seam + 0.9 * barrel))
    angles = {"usually": draws.turn("lid_angle", (75.0, 115.0)), "wide": draws.turn("wide_lid_angle", (115.0, 170.0))}
    limit = draws.one_of("lid_opens", angles)
    chest.add("lid", lid, revolute("body", (0, 1, 0), (axis_x, 0, seam), 0.0, limit))
    if top - seam > 0.02 and draws.chance("latch", 0.2):
        _latches(draws, chest, max(x + band, -float(lid.bounds()[0, 0])), y, seam, top)
    return chest


def _rigid_body(draws: Draws, x: float, y: float, height: float, wall: float, radius: float) -> Solid:
    if radius == 0.0:
        return tray((-x, -y, 0), (x, y, height), wall)
    bevel = draws.one_of("bottom_edge", {"sharp": 0.0, "bevelled": 0.4 * radius})
    profile = [(0.0, bevel), (bevel / height, 0.0), (1.0, 0.0)] if bevel > 0 else [(0.0, 0.0), (1.0, 0.0)]
    return rounded_tray((-x, -y, 0), (x, y, height), wall, radius, profile, floor=wall + bevel)


def _bands(draws: Draws, x: float, y: float, low: float, high: float, band: float, wall: float, radius: float) -> Solid:
    """Boards and straps that stand out all around: at the edges, or across the front."""
    if band <= 0:
        return Solid()
    solid = Solid()
    for z0, z1 in ((low, low + 1.5 * wall), (high - 1.5 * wall, high))[: draws.integer("bands", 1, 2)]:
        solid += frame((-x - band, -y - band, z0), (x + band, y + band, z1), [0.8 * wall + band] * 4, 0, 1)
    if draws.chance("strap", 0.6):
        for share in draws.one_of("straps", {2: (-0.6, 0.6), 3: (-0.7, 0.0, 0.7)}):
            for side in (-x - band, x - 0.8 * wall):
                across = about(share * (y - (wall + radius)), 0.7 * wall)
                solid += box((side, side + band + 0.8 * wall), across, (low, high))
    return solid


def _interior(draws: Draws, x: float, y: float, height: float, wall: float) -> Solid:
    """Dividers below the rim."""
    if draws.chance("empty", 0.5):
        return Solid()
    thin = max(0.0015, 0.3 * wall)
    top = height * draws.number("divider_height", (0.4, 0.9))
    solid = Solid()
    for edge in np.linspace(-y, y, draws.integer("columns", 2, 4) + 1)[1:-1]:
        solid += box(x - wall / 2, (edge - thin, edge + thin), (wall / 2, top))
    for edge in np.linspace(-x, x, draws.integer("rows", 1, 3) + 1)[1:-1]:
        solid += box((edge - thin, edge + thin), y - wall / 2, (wall / 2, top))
    return solid


def _feet(draws: Draws, x: float, y: float, wall: float) -> Solid:
    """Plinth, blocks or balls below the corners, or nothing."""
    kind = draws.pick("feet", {"none": 0.5, "plinth": 0.2, "blocks": 0.2, "balls": 0.1})
    drop = wall * draws.number("foot_height", (1.0, 3.0))
    if kind == "plinth":
        out = 0.0 if draws.chance("flush_plinth", 0.3) else 0.8 * wall
        return frame((-x - out, -y - out, -drop), (x, y + out, wall), [2 * wall + out] * 4, 0, 1)
    if kind == "blocks":
        corners = [(u, v) for u in ends(x - 2 * wall) for v in ends(y - 2 * wall)]
        return union(box(about(u, 1.9 * wall), about(v, 1.9 * wall), (-drop, 0.5 * wall)) for u, v in corners)
    if kind == "balls":
        return posts(x - 2 * wall, y - 2 * wall, (-drop, 0.5 * wall), 1.2 * wall, 1.8 * wall, 16)
    return Solid()


def _lid(
    draws: Draws, x: float, y: float, seam: float, height: float, wall: float, radius: float, plain: bool
) -> tuple[Solid, float, bool]:
    """Lid above the seam, the top of its upright part, and whether a dome rises above that."""
    kind = draws.pick("lid", {"flat": 0.35, "hollow": 0.45, "dome": 0.2})
    if kind == "flat":
        thick = wall * draws.number("lid_thickness", (0.7, 1.5))
        overhang = draws.number("lid_overhang", (0.5, 1.2)) * wall
        over = draws.one_of("lid_edge", {"flush": 0.0, "overhanging": overhang})
        low, high = (-x - over, -y - over, seam), (x, y + over, seam + thick)
        solid = box(low, high, fillet=radius, axis=2) if radius > 0 else box(low, high, fillet=0.2 * thick, steps=2)
        inner = 0.6 * over
        if plain and radius == 0.0 and inner > GAP and over - inner > 0.0015 and draws.chance("skirt", 0.6):
            skirt = min(draws.number("skirt_height", (0.5, 3.0)) * wall, 0.18 * height)
            widths = [over - inner, 0.0, over - inner, over - inner]  # on three sides, outside the body
            solid += frame((-x - over, -y - over, seam - skirt), (x, y + over, seam + 0.6 * thick), widths, 0, 1)
        elif draws.chance("raised_board", 0.4):
            solid += box(0.75 * x, 0.85 * y, (seam + 0.5 * thick, seam + 1.4 * thick), fillet=0.3 * thick)
        return solid, seam + thick, False
    if kind == "hollow":
        rise = height * draws.number("lid_height", (0.15, 0.9), (0.08, 1.6), tails=0.2)
        if radius == 0.0:
            return tray((-x, -y, seam), (x, y, seam + rise), wall, min(wall, 0.7 * rise), side=-1), seam + rise, False
        bevel = draws.one_of("top_edge", {"sharp": 0.0, "bevelled": min(0.6 * radius, 0.5 * rise)})
        profile = [(0.0, bevel), (0.3 * bevel / rise, 0.3 * bevel), (bevel / rise, 0.0), (1.0, 0.0)]
        shape = profile if bevel > 0 else [(0.0, 0.0), (1.0, 0.0)]
        floor = min(wall + bevel, 0.7 * rise)
        solid = rounded_tray((-x, -y, seam), (x, y, seam + rise), wall, radius, shape, side=-1, floor=floor)
        return solid, seam + rise, False
    straight = height * draws.number("lid_edge_height", (0.0, 0.25)) + 2 * wall
    rise = x * draws.number("dome_height", (0.35, 0.95))
    angles = np.linspace(0.0, np.pi, 11)
    arc = [(cos(angles) * (x - w), seam + straight + sin(angles) * (rise - w)) for w in (0.0, wall)]
    rows = [np.stack([a, np.zeros(11), b], axis=1) for a, b in arc]
    solid = frame((-x, -y, seam), (x, y, seam + straight + 0.001), [wall] * 4, 0, 1)
    for k in range(10):
        strip = np.concatenate([row[[k, k + 1]] for row in rows])
        solid += hull(np.concatenate([strip - (0, y, 0), strip + (0, y, 0)]))
    for end in (-y, y - wall):
        solid += hull(np.concatenate([rows[0] + (0, end, 0), rows[0] + (0, end + wall, 0)]))
    return solid, seam + straight, True


def _latches(draws: Draws, chest: Assembly, front: float, y: float, seam: float, top: float) -> None:
    """Hasps on the lid's front that hang down over the body and flip up."""
    width, upper, pin = min(0.08 * y, 0.02), min(0.4 * (top - seam), 0.1 * y, 0.025), 0.0025
    axis_x, z = -front - 2.2 * pin, seam + upper
    for number, share in enumerate(draws.one_of("latches", {1: (0.0,), 2: (-0.6, 0.6)}, (0.5, 0.5))):
        middle = share * y
        solid = rod(axis_x, (middle - width, middle + width), z, pin, sections=12)
        solid += box((axis_x - 0.002, axis_x + 0.001), about(middle, width), (seam - 1.4 * upper, z), fillet=0.001)
        turn = revolute("lid", (0, 1, 0), (axis_x, middle, z), 0.0, np.deg2rad(85.0))
        chest.add(f"latch_{number}", solid, turn, density=2000.0)
