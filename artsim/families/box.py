"""Boxes: cartons with one, two or four flaps (see ``carton``), and rigid boxes, chests and cases with one lid or two.

Sizes and proportions, the shape of lids (flat, hollow, domed, with a skirt), corners, a board at the back, bands, feet,
dividers, handles and latches of rigid boxes vary.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import bow_handle, knob, rounded_tray, unusual_sides
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import UP, Array, about, ends
from artsim.making.solids import Solid, box, deferred, frame, hull, posts, rod, tray, union

GAP = 0.0015
LEAST_SHARES, MOST_SHARES = (0.29, 0.43, 0.075), (0.765, 0.95, 0.79)
"""Depth, width and height of unusual boxes over their diagonal."""


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

    body = _rigid_body(draws, x, y, height, wall, radius) + _bands(draws, x, y, 0.0, height, band, wall, radius)
    body += _interior(draws, x, y, height, wall) + _feet(draws, x, y, wall)
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


def carton(draws: Draws) -> Assembly:
    """Cardboard box; the longer flaps hang on the front and the back.

    Flaps share the opening without overlapping one another, so each of them moves freely: mitred, one pair between the
    other, around a hole, or with the inner pair folding down into the carton.
    """
    width = draws.length("width", (0.18, 0.6))
    depth, height = width * draws.number("depth", (0.5, 1.0)), width * draws.number("height", (0.3, 1.3))
    if draws.chance("unusual", 0.3):
        depth, width, height = unusual_sides(draws, LEAST_SHARES, MOST_SHARES, (0.14, 0.18, 0.06))
    wall = draws.length("wall", (0.003, 0.005))
    x, y = depth / 2, width / 2
    result = Assembly("body", _carton_body(draws, x, y, height, wall), 150.0)
    kinds = {"one": 0.12, "two": 0.25, "mitred": 0.14, "long": 0.16, "short": 0.11, "wheel": 0.1, "inner": 0.12}
    kind = draws.pick("flap_pattern", kinds)
    flaps = _flaps(draws, kind, x, y, wall, height)
    limit = np.deg2rad(_limit(draws, 100.0))
    for number, (side, inward, outline) in enumerate(flaps):
        across, sign, axis = _SIDES[side]
        edge = (x, y)[across]
        origin = np.zeros(3)
        if inward:  # below the others, within the walls: it folds down into the carton
            edge = edge - wall - GAP
            solid = _flap(side, outline, edge, height - wall, height)
            origin[across], origin[2] = sign * edge, height - wall
            joint = revolute("body", -np.asarray(axis), origin, 0.0, np.deg2rad(86.0))
        else:  # it lies on the walls, and turns about its upper edge, so that it may hang down outside
            own_limit = limit if draws.chance("flaps_alike", 0.7) else np.deg2rad(_limit(draws, 95.0))
            z = height + GAP + (0.0007 if side in ("left", "right") else 0.0)
            solid = _flap(side, outline, edge, z, z + wall)
            if kind == "one" and draws.chance("lipped", 0.5):  # over the front
                lip = min(draws.length("lip", (0.03, 0.08)), 0.6 * height)
                solid += box((-x - GAP - wall, -x - GAP), y, (z - lip, z + wall))
                solid += box((-x - GAP - wall, 0), y, (z, z + wall))
            # The axis lies beyond the wall, which a flap turned by 270 degrees hangs beside.
            origin[across], origin[2] = sign * (edge + GAP), z + wall
            joint = revolute("body", axis, origin, 0.0, own_limit)
        result.add(f"flap_{number}", solid, joint)
    return result


def _limit(draws: Draws, least: float) -> float:
    """Degrees that a flap turns by; some hang down flat against the outside."""
    return 270.0 if draws.chance("hangs_down", 0.2) else draws.degrees("flap_angle", (least, 250.0))


def _carton_body(draws: Draws, x: float, y: float, height: float, wall: float) -> Solid:
    if not (draws.chance("hand_holes", 0.35) and min(x, y) > 0.1 and height > 0.15):
        return tray((-x, -y, 0), (x, y, height), wall)
    solid = box(x, y, (0, wall)) + box((-x, -x + wall), y, (0, height)) + box((x - wall, x), y, (0, height))
    low, high = height * draws.number("hole_bottom", (0.6, 0.68)), height * draws.number("hole_top", (0.75, 0.82))
    half = min(draws.length("hole_width", (0.035, 0.05)), 0.6 * x)
    for end in (-y, y - wall):
        solid += frame((-x, end, 0), (x, end + wall, height), [x - half, x - half, low, height - high], 0, 2)
    return solid


Flap = tuple[str, bool, Array]
"""Where it hangs, whether it folds inward, and its outline (N, 2): distance from the hinge, and position along it."""


def _flaps(draws: Draws, kind: str, x: float, y: float, wall: float, height: float) -> list[Flap]:
    c = 0.002  # between flaps

    def bar(reach: float, low: float, high: float, tip: float = 0.0) -> Array:
        return np.array([(0.0, low), (0.0, high), (reach, high - tip), (reach, low + tip)])

    tip = draws.one_of("flap_ends", {"square": 0.0, "tapered": draws.length("flap_taper", (0.0, 0.03))})
    if kind == "one":
        return [("back", False, bar(2 * x, -y, y, 0.0))]
    if kind == "two":
        uneven, short = draws.number("first_reach", (0.5, 1.5)), draws.number("short_reach", (0.4, 0.9))
        first = {"even": 1.0, "uneven": uneven, "short": short}
        share = first[draws.pick("flaps_reach", ["even", "even", "uneven", "short"])]
        second = 2.0 - share if share > 1.0 or draws.chance("flaps_meet", 0.5) else share
        if draws.chance("wide_flaps", 0.7):
            return [("front", False, bar(share * x - c, -y, y, tip)), ("back", False, bar(second * x - c, -y, y, tip))]
        return [("left", False, bar(share * y - c, -x, x, tip)), ("right", False, bar(second * y - c, -x, x, tip))]
    if kind == "wheel":  # each flap ends at the next one's side
        p = y * draws.number("flap_width", (0.4, 0.9))
        return [
            ("front", False, bar(x - c, -y, y - p - c)),
            ("left", False, bar(p - c, -x, -c)),
            ("back", False, bar(x - c, -y + p + c, y)),
            ("right", False, bar(p - c, c, x)),
        ]
    if kind == "mitred":  # at 45 degrees, whatever their reach; a raised flap's inner edge clears the next one's corner
        corner, least = wall + c, min(x, y)
        long, short = least * draws.number("long_reach", (0.6, 1.0)), least * draws.number("short_reach", (0.6, 0.95))
        longs = bar(long - c, -y + corner, y - corner, long - c)
        ends = bar(short - c, -x + corner, x - corner, short - 2 * c - wall)
    elif kind == "long":  # short flaps reach a little way, long ones lie between them
        short = y * draws.number("short_reach", (0.15, 0.6))
        longs = bar(x * draws.pick("long_reach", [1.0, 0.8]) - c, -y + short + 2 * c, y - short - 2 * c, tip)
        ends = bar(short, -x, x, min(tip, 0.2 * x))
    elif kind == "short":
        reach = x * draws.number("long_reach", (0.25, 0.6))
        longs = bar(reach, -y, y, min(tip, 0.2 * y))
        ends = bar(y * draws.pick("short_reach", [1.0, 0.7]) - c, -x + reach + 2 * c, x - reach - 2 * c, tip)
    else:
        longs = bar(x - c, -y, y, tip)
        short = min(y * draws.number("short_reach", (0.5, 0.95)), height - 0.02)
        ends = bar(short, -x + wall + c, x - wall - c, 0.01)
    inward = kind == "inner"
    return [(side, False, longs) for side in ("front", "back")] + [(side, inward, ends) for side in ("left", "right")]


# Of each side: the axis across the hinge (0: X, 1: Y), its sign at that side, and the direction of the hinge.
_SIDES = {"front": (0, -1.0, (0.0, -1.0, 0.0)), "back": (0, 1.0, (0.0, 1.0, 0.0)),
          "left": (1, 1.0, (-1.0, 0.0, 0.0)), "right": (1, -1.0, (1.0, 0.0, 0.0))}  # fmt: skip


@deferred
def _flap(side: str, outline: Array, edge: float, low: float, high: float) -> Solid:
    """Flat piece between two heights from an outline along a hinge at distance ``edge`` from the middle."""
    across, sign, _ = _SIDES[side]
    points = np.empty((2, len(outline), 3))
    points[:, :, across] = sign * (edge - outline[:, 0])
    points[:, :, 1 - across] = outline[:, 1]
    points[0, :, 2], points[1, :, 2] = low, high
    return hull(points.reshape(-1, 3))
