"""Toilets: a bowl with a seat and a lid, and what flushes it.

What varies: bowl (long, round or square), foot (pedestal, closed to the wall, hung), cistern (low, high on a pipe, in
the wall), its lid (fixed or lifted off), lever or one or two buttons and where they are, seat (closed or open ring),
lid, hinges.
"""

from itertools import pairwise

import numpy as np

from artsim.making.assembly import Assembly, JointSpec, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, UP, Array, Vector, about, lifted, superellipse
from artsim.making.solids import Solid, box, cylinder, frame, hull, hull_of, loft, rod, tray, tube, union

GAP = 0.002
_AROUND = 24  # sides of the bowl
Point = tuple[float, float, float]
Moving = tuple[str, Solid, JointSpec]
BACK = tuple(SIDE)  # a positive turn about this axis lifts the front edge


class _Cover:
    """Seat and lid; metres."""

    def __init__(self, draws: Draws) -> None:
        self.over = draws.length("overhang", (0.0, 0.012))  # how far they reach beyond the bowl
        self.thick = draws.length("seat_thickness", (0.014, 0.028))  # of the seat
        self.lid = draws.length("lid_thickness", (0.012, 0.03))  # thickness of the lid
        self.axis = draws.length("hinge_gap", (0.015, 0.03))  # distance of the hinges' axis from the seat's end
        self.rise = 0.5 * self.thick + GAP + self.lid  # of the lid's top over the axis


def build(draws: Draws) -> Assembly:
    """A toilet; one sits down facing -X. Seat and lid lie on the bowl at rest."""
    length, width, height = draws.lengths(bowl_length=(0.38, 0.56), width=(0.33, 0.42), bowl_height=(0.34, 0.48))
    squareness = {"ellipse": 2.0, "full": draws.number("bowl_fullness", (2.0, 2.6)),
                  "square": draws.number("bowl_squareness", (3.0, 6.0))}  # fmt: skip
    power = draws.one_of("bowl", squareness, (0.4, 0.4, 0.2))
    tank = draws.pick("cistern", {"low": 0.7, "high": 0.1, "wall": 0.2})
    hung = tank == "wall" and draws.chance("hung", 0.7)
    cover = _Cover(draws)
    lean = draws.angle("lid_lean", (0.0, 0.2))  # beyond upright
    # Behind the axis there is room for the lid as it stands up, and for a lever on the cistern.
    back = 0.5 * length + cover.over + cover.axis + cover.rise + 0.045 + lean * (length + 0.05)
    body = _bowl(draws, length, width, height, power, back, hung)
    moving: list[Moving] = []
    if tank == "low":
        body += _low_cistern(draws, moving, back, width, height)
    elif tank == "high":
        body += _high_cistern(draws, moving, back, height)
    else:
        body += _wall(draws, moving, back, width, height, hung)
    fixed, covers = _seat_and_lid(draws, length, width, height, power, cover, np.pi / 2 + lean)
    toilet = Assembly("body", body + fixed, 2300.0)
    for name, solid, joint in covers + moving:
        toilet.add(name, solid, joint, density=1200.0)
    return toilet


def _oval(length: float, width: float, power: float, z: float, shift: float = 0.0) -> Array:
    """(N, 3) outline, a superellipse about x = shift, longer towards the front."""
    return lifted(superellipse(power, 0.5 * length, 0.5 * width, _AROUND) + (shift, 0.0), z)


def _rim(outer: tuple[Array, Array], inner: tuple[Array, Array], first: int = 0, last: int = _AROUND) -> Solid:
    """Wedges between outlines, each (bottom, top); only those from ``first`` to ``last`` where the ring is open."""
    pairs = [np.array([r[k % _AROUND] for r in (*outer, *inner)]) for k in range(first, last + 1)]
    return union(hull(np.concatenate(pair)) for pair in pairwise(pairs))


def _bowl(draws: Draws, length: float, width: float, height: float, power: float, back: float, hung: bool) -> Solid:
    """Hollow bowl on a foot, with a deck behind it that carries the hinges."""
    wall, low = draws.length("bowl_wall", (0.03, 0.05)), height * draws.number("bowl_depth", (0.35, 0.5))
    narrow = draws.number("bowl_taper", (0.5, 0.75))
    levels = [(low, narrow), (0.5 * (low + height), 0.5 * (1.0 + narrow) + 0.06), (height, 1.0)]
    solid = Solid()
    for (z0, s0), (z1, s1) in pairwise(levels):
        outer, inner = (
            (_oval(s0 * length - w, s0 * width - w, power, z0), _oval(s1 * length - w, s1 * width - w, power, z1))
            for w in (0.0, 2 * wall)
        )
        solid += _rim(outer, inner)
    solid += loft([_oval(narrow * length, narrow * width, power, z) for z in (low - 0.02, low + 0.02)])
    deck = draws.length("deck_thickness", (0.04, 0.12))
    half = 0.5 * width * draws.number("deck_width", (0.75, 1.0))
    solid += box((0.5 * length - wall, back), half, (height - deck, height))
    solid += hull_of(
        box((0.3 * length, back), 0.8 * half, (height - deck - 0.03, height - deck + 0.01)),
        box((0.2 * length, back), 0.4 * half, (low - 0.02, low)),
    )
    if hung:
        return solid
    kind, foot = draws.pick("foot", ["pedestal", "skirt", "box"]), draws.number("foot_length", (0.5, 0.85))
    if kind == "pedestal":
        waist = draws.number("waist", (0.35, 0.5))
        rings = [
            _oval(foot * length, 0.7 * foot * width, 3.0, 0.0, 0.12 * length),
            _oval(0.95 * foot * length, 0.66 * foot * width, 3.0, 0.04, 0.12 * length),
            _oval(waist * length, waist * width, 2.2, 0.6 * low, 0.1 * length),
            _oval(narrow * length, narrow * width, power, low),
        ]
        solid += loft(rings)
        if draws.chance("trap", 0.6):
            low_end = box((0.1 * length, back - 0.02), 0.08, (0.01, 0.03))
            solid += hull_of(low_end, box((0.2 * length, back), 0.09, (low, low + 0.02)))
    elif kind == "skirt":
        shift = 0.5 * (back - 0.5 * foot * length) * 0.5
        below = _oval(foot * length + 0.1, foot * width, 4.0, 0.0, shift)
        solid += loft([below, _oval(narrow * length, narrow * width, power, low)])
        solid += box((0.1, back), 0.4 * foot * width, (0, low))
    else:
        solid += box((-0.4 * foot * length, back), 0.42 * foot * width, (0, low), fillet=0.05, axis=2)
    return solid


def _low_cistern(draws: Draws, moving: list[Moving], back: float, width: float, height: float) -> Solid:
    """On the deck, right behind the bowl."""
    deep, tall = draws.lengths(cistern_depth=(0.14, 0.22), cistern_height=(0.28, 0.42))
    half = 0.5 * width * draws.number("cistern_to_bowl", (0.85, 1.35))
    start = back - 0.001
    foot = height - draws.length("cistern_drop", (0.0, 0.04))
    wall = 0.02
    taper = draws.number("cistern_taper", (0.85, 1.0))
    solid = hull_of(
        box((start, start + taper * deep), taper * half, (foot, foot + 0.05)),
        box((start, start + deep), half, (foot + 0.04, foot + 0.1)),
    )
    top = foot + tall
    solid += tray((start, -half, foot + 0.06), (start + deep, half, top), wall)
    # The deck below, down to the floor or a slope.
    solid += hull_of(
        box((start, start + 0.7 * deep), 0.6 * taper * half, (foot - 0.06, foot + 0.01)),
        box((start - 0.05, start + 0.02), 0.3 * half, (0.5 * height, 0.5 * height + 0.03)),
    )
    flush = draws.pick("flush", {"lever": 0.35, "side lever": 0.15, "button": 0.25, "two buttons": 0.25})
    over, thick = draws.lengths(cistern_lid_overhang=(0.004, 0.02), cistern_lid_thickness=(0.02, 0.045))
    low, high = (start - over, -half - over, top + GAP), (start + deep + over, half + over, top + GAP + thick)
    middle = start + 0.5 * deep
    buttons = flush in ("button", "two buttons")
    lifts = draws.chance("cistern_lid", 0.5)
    if buttons:
        lid, parts = _button_lid(draws, low, high, middle, 2 if flush == "two buttons" else 1)
    else:
        lid, parts = box(low, high, fillet=draws.number("cistern_lid_edge", (0.15, 0.45)) * thick), []
    if lifts:
        travel = draws.length("cistern_lid_travel", (0.1, 0.3))
        moving.append(("cistern_lid", lid, prismatic("body", UP, 0.0, travel, (middle, 0.0, low[2]))))
    else:
        solid += lid + frame((start, -half, top - 0.01), (start + deep, half, low[2] + 0.002), [wall] * 4, 0, 1)
    for number, button in enumerate(parts):
        joint = prismatic("cistern_lid" if lifts else "body", (0, 0, -1), 0.0, 0.006, button.bounds().mean(axis=0))
        moving.append((f"button_{number}", button, joint))
    if not buttons:
        hand, level = draws.side("lever_side"), top - draws.length("lever_drop", (0.03, 0.08))
        if flush == "lever":
            inset = draws.length("lever_inset", (0.05, 0.08))
            moving.append(_lever(draws, (start, hand * (half - inset), level), FRONT, (0.0, -hand, 0.0)))
        else:
            moving.append(_lever(draws, (start + 0.04, hand * half, level), (0.0, hand, 0.0), FRONT))
    return solid


def _lever(draws: Draws, foot: Vector, out: Vector, along: Vector) -> Moving:
    """A handle on a pivot in a wall; pressed down it turns."""
    long, thick = draws.lengths(lever_length=(0.05, 0.1), lever_thickness=(0.004, 0.008))
    foot, out, along, reach = np.asarray(foot), np.asarray(out), np.asarray(along), 0.02
    hub = foot + reach * out
    radius = draws.length("lever_pivot", (0.009, 0.014))
    solid = cylinder(foot + GAP * out, foot + (reach + thick) * out, radius, sections=16)
    tip = hub + long * along
    drop = np.array([0.0, 0.0, -draws.length("lever_droop", (0.0, 0.015))])
    solid += tube([hub, tip + drop], [thick, draws.number("lever_taper", (0.8, 1.5)) * thick], 12)
    down = np.cross(along, (0.0, 0.0, -1.0))
    return "lever", solid, revolute("body", down, foot, 0.0, draws.angle("lever_angle", (0.4, 0.8)))


def _button_lid(draws: Draws, low: Point, high: Point, x: float, count: int) -> tuple[Solid, list[Solid]]:
    """Lid with a square well and the buttons in it."""
    half = 0.5 * draws.length("well_width", (0.04, 0.07))
    well = frame(low, high, [x - half - low[0], high[0] - x - half, -half - low[1], high[1] - half], 0, 1)
    floor = low[2] + 0.25 * (high[2] - low[2])
    well += box((x - half - 0.001, x + half + 0.001), half + 0.001, (low[2], floor))
    buttons = []
    split = -half + 2 * half * draws.number("button_split", (0.4, 0.65)) if count == 2 else half
    low_z = max(floor + 0.007, high[2] - 0.01)
    round_off = 0.99 if count == 1 and draws.chance("round_button", 0.5) else 0.2
    for y0, y1 in pairwise([-half, half] if count == 1 else [-half, split, half]):
        corner = round_off * 0.5 * min(y1 - y0, 2 * half)
        deep, across = (x - half + GAP / 2, x + half - GAP / 2), (y0 + GAP / 2, y1 - GAP / 2)
        upright = (low_z, high[2] + draws.length("button_height", (0.0065, 0.01)))
        buttons.append(box(deep, across, upright, fillet=corner, axis=2, steps=5))
    return well, buttons


def _high_cistern(draws: Draws, moving: list[Moving], back: float, height: float) -> Solid:
    """Up on a pipe, with a chain to pull."""
    up, half = draws.length("pipe_length", (0.6, 1.3)), 0.5 * draws.length("cistern_width", (0.34, 0.52))
    deep, tall = draws.lengths(cistern_depth=(0.15, 0.2), cistern_height=(0.2, 0.32))
    x = back + 0.05
    solid = tube([(back - 0.03, 0, height - 0.06), (x, 0, height - 0.04), (x, 0, height + up + 0.01)], 0.02, 14)
    low = height + up
    start = x - 0.5 * deep
    solid += box((start, start + deep), half, (low, low + tall), fillet=0.02)
    upright = (low + tall - 0.01, low + tall + 0.02)
    solid += box((start - 0.012, start + deep + 0.012), half + 0.012, upright, fillet=0.008)
    side = draws.side("chain_side")
    y = side * (half + 0.03)
    upright = (low + 0.6 * tall, low + 0.6 * tall + 0.015)
    solid += box(about(x, 0.012), (side * (half - 0.01), y + side * 0.012), upright)
    long = draws.number("chain_length", (0.3, 0.55)) * up + 0.2
    top = low + 0.6 * tall - GAP
    chain = tube([(x, y, top), (x, y, top - long)], 0.0035, 8)
    chain += rod(x, y, (top - long - 0.06, top - long + 0.005), 0.013, 0.008, 14)
    pull = prismatic("body", (0, 0, -1), 0.0, draws.length("chain_travel", (0.04, 0.1)), (x, y, top))
    moving.append(("chain", chain, pull))
    return solid


def _wall(draws: Draws, moving: list[Moving], back: float, width: float, height: float, hung: bool) -> Solid:
    """A panel behind the bowl with a plate for one or two buttons."""
    half = 0.5 * width + draws.length("panel_margin", (0.03, 0.2))
    top = height + draws.length("panel_height", (0.45, 0.75))
    low = 0.0 if hung or draws.chance("panel_to_floor", 0.7) else 0.1
    solid = box((back - 0.001, back + draws.length("panel_thickness", (0.06, 0.16))), half, (low, top))
    z = top - draws.length("plate_drop", (0.08, 0.14))
    wide, high = 0.5 * draws.length("plate_width", (0.18, 0.26)), 0.5 * draws.length("plate_height", (0.12, 0.18))
    solid += frame((back - 0.012, -wide, z - high), (back, wide, z + high), [0.012] * 4)
    count = draws.integer("buttons", 1, 2)
    inner = wide - 0.012 - GAP
    split = 0.0 if count == 1 else inner * draws.number("button_split", (-0.3, 0.3))
    edges = [(-inner, inner)] if count == 1 else [(-inner, split - GAP / 2), (split + GAP / 2, inner)]
    for number, (y0, y1) in enumerate(edges):
        upright = (z - high + 0.012 + GAP, z + high - 0.012 - GAP)
        button = box((back - 0.016, back - 0.008), (y0, y1), upright, fillet=0.002)
        joint = prismatic("body", (1, 0, 0), 0.0, 0.006, (back - 0.016, 0.5 * (y0 + y1), z))
        moving.append((f"button_{number}", button, joint))
    return solid


def _seat_and_lid(
    draws: Draws, length: float, width: float, height: float, power: float, cover: _Cover, limit: float
) -> tuple[Solid, list[Moving]]:
    """What of seat and lid belongs to the body, and what turns about one axis behind the bowl.

    The lid lies on the seat: it hangs on it, goes ahead of it in step, or only one of the two moves. So neither can go
    through the other.
    """
    low = height + 0.004
    top, at = low + cover.thick, low + 0.5 * cover.thick
    long, wide = length + 2 * cover.over, width + 2 * cover.over
    edge = 0.5 * long
    axis_x = edge + cover.axis
    half = draws.length("hinge_width", (0.02, 0.04))
    apart = 0.5 * width * draws.number("hinge_spread", (0.3, 0.55))
    seat = _ring(draws, long, wide, power, low, top)
    for y in (-apart, apart):
        near, far = y - half / 2 + 0.001, y + half / 2 - 0.001
        seat += box((edge - 0.06, axis_x), (near, far), (low + 0.15 * cover.thick, low + 0.85 * cover.thick))
        seat += rod(axis_x, (near, far), at, 0.45 * cover.thick, sections=14)
    scale, bevel = draws.number("lid_size", (0.96, 1.02)), draws.number("lid_bevel", (0.02, 0.25))
    levels = ((1.0, top + GAP), (1.0, top + GAP + 0.6 * cover.lid), (1.0 - bevel, top + GAP + cover.lid))
    lid = loft([_oval(share * (scale * long), share * (scale * wide), power, z) for share, z in levels])
    upright = (top + GAP, top + GAP + 0.5 * cover.lid)
    for y in (-apart - half, apart + half):  # arms from the plate down to the axis, beside the seat's
        near, far = y - half / 2 + 0.001, y + half / 2 - 0.001
        lid += box((edge - 0.07, axis_x), (near, far), upright)
        barrel = rod(axis_x, (near, far), at, 0.3 * cover.thick, sections=14)
        lid += hull_of(barrel, box((axis_x - 0.01, axis_x), (near, far), upright))
    hinge = (axis_x, 0.0, at)
    kind = draws.pick("covers", {"both": 0.45, "in step": 0.2, "lid": 0.25, "seat": 0.1})
    if kind == "lid":
        upright = (height - 0.002, low + 0.002)
        stops = union(rod(0.3 * length, y, upright, 0.01, sections=10) for y in (-0.36 * width, 0.36 * width))
        return seat + stops, [("lid", lid, revolute("body", BACK, hinge, 0.0, limit))]
    share = draws.number("seat_share", (0.3, 0.7))
    first = share * limit if kind == "both" else limit * draws.number("seat_turn", (0.96, 1.0))
    covers: list[Moving] = [("seat", seat, revolute("body", BACK, hinge, 0.0, first))]
    if kind == "both":
        covers.append(("lid", lid, revolute("seat", BACK, hinge, 0.0, (1.0 - share) * limit)))
    elif kind == "in step":
        covers.append(("lid", lid, revolute("body", BACK, hinge, 0.0, limit, mimic=("seat", limit / first))))
    return Solid(), covers


def _ring(draws: Draws, long: float, wide: float, power: float, low: float, top: float) -> Solid:
    """Seat: a ring, closed or open at the front."""
    broad = draws.length("seat_border", (0.16, 0.24))
    inner_long = long - broad * draws.number("seat_length", (0.8, 1.0))
    inner_wide = wide - broad * draws.number("seat_width", (0.7, 0.95))
    outer = (_oval(long, wide, power, low), _oval(0.985 * long, 0.985 * wide, power, top))
    inner = (_oval(inner_long, inner_wide, 2.0, low, 0.01), _oval(1.03 * inner_long, 1.03 * inner_wide, 2.0, top, 0.01))
    first = _AROUND // 2 + 2
    return _rim(outer, inner, first, first + _AROUND - 4) if draws.chance("open_seat", 0.2) else _rim(outer, inner)
