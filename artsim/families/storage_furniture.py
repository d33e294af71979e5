"""Storage furniture: kitchen units, wall cupboards, wardrobes, dressers, sideboards, nightstands.

The front is divided again and again into cells; a cell holds a drawer, a door (hinged at the left, right, top or
bottom), double doors, sliding doors or open shelves, and a door may hide trays that slide. Sizes, divisions, fronts
before or between the boards, kinds of panels and handles, tops, plinths, legs and shelves vary.
"""

from itertools import pairwise

import numpy as np

from artsim.families import fronts
from artsim.families.fronts import Cell, Moving, Style
from artsim.making.assembly import Assembly
from artsim.making.draws import Draws
from artsim.making.outlines import about
from artsim.making.solids import Solid, box, cylinder, frame, hull, union

# Of each kind: the ranges of width, depth and height of the body and of the height of what it stands on, in metres;
# how likely a low cell is a drawer; how common the kind is.
KINDS: dict[str, tuple[tuple[tuple[float, float], ...], float, float]] = {
    "base": (((0.3, 1.1), (0.5, 0.65), (0.6, 0.8), (0.08, 0.15)), 0.45, 0.25),
    "wall": (((0.3, 1.2), (0.28, 0.42), (0.3, 1.0), (0.0, 0.0)), 0.05, 0.2),
    "tall": (((0.35, 1.4), (0.35, 0.62), (1.2, 2.1), (0.0, 0.15)), 0.3, 0.15),
    "dresser": (((0.6, 1.6), (0.38, 0.55), (0.5, 1.1), (0.0, 0.2)), 0.8, 0.15),
    "nightstand": (((0.35, 0.6), (0.32, 0.5), (0.3, 0.6), (0.0, 0.35)), 0.7, 0.1),
    "sideboard": (((1.0, 2.0), (0.35, 0.5), (0.4, 0.75), (0.0, 0.3)), 0.4, 0.15),
}
MOST_MOVING = 9


def build(draws: Draws) -> Assembly:
    """A body with one to nine drawers, doors and trays, all closed at rest."""
    kind = draws.pick("kind", {kind: common for kind, (_, _, common) in KINDS.items()})
    ranges, drawers, _ = KINDS[kind]
    names = ("width", "depth", "height", "stand_height")
    width, depth, height, stand = (draws.length(name, span) for name, span in zip(names, ranges, strict=True))
    stand = 0.0 if stand < 0.02 else stand
    style = _style(draws, kind, depth)
    edge = style.board
    whole = Cell((-width / 2 + edge, stand + edge), (width / 2 - edge, stand + height - edge))

    furniture = Assembly("body", density=650.0)
    furniture.record(handles=style.handle != "none")
    cells, furniture.body = _divide(draws, whole, style, 0)
    cells.sort(key=lambda item: -item[0].sides[0] * item[0].sides[1])
    for cell, recipe in cells:  # the largest, and those like it, are not left open
        inside, parts = _fill(draws.fork("", recipe), cell, style, drawers, recipe == cells[0][1])
        if len(furniture) + len(parts) > 1 + MOST_MOVING:
            inside, parts = fronts.shelves(draws, cell, style)
        furniture.body += inside
        for part in parts:
            furniture.add_numbered(*part)
    furniture.body += _carcass(draws, kind, width, depth, height, stand, style, furniture)
    return furniture


def _style(draws: Draws, kind: str, depth: float) -> Style:
    framed = draws.chance("wide_boards", 0.25)  # wide boards around the fronts
    place = {"base": 0.85, "wall": 0.15}.get(kind, 0.5)
    return Style(
        face=-depth / 2,
        back=depth / 2 - draws.length("back_inset", (0.006, 0.015)),
        board=draws.length("board", (0.03, 0.045) if framed else (0.015, 0.026)),
        lap=draws.length("front_lap", (0.006, 0.012)) if framed else 1.0,
        place=place if draws.chance("usual_place", 0.6) else draws.pick("handle_place", [0.15, 0.5, 0.85]),
        level=draws.chance("handles_level", 0.2),
        thickness=draws.length("front_thickness", (0.016, 0.024)),
        overlay=draws.chance("overlay", 0.7),
        panel=draws.pick("panel", {"slab": 0.45, "shaker": 0.2, "raised": 0.22, "planks": 0.05, "glass": 0.08}),
        rail=draws.length("rail", (0.035, 0.075)),
        recess=draws.length("recess", (0.005, 0.009)),
        handle=draws.pick("handle", {"bar": 0.3, "bow": 0.2, "knob": 0.22, "block": 0.08, "cup": 0.08, "none": 0.12}),
        handle_length=draws.length("handle_length", (0.08, 0.35) if draws.chance("short_bars", 0.8) else (0.35, 0.8)),
        reach=draws.length("handle_reach", (0.018, 0.04)),
        grip=draws.length("handle_radius", (0.004, 0.008)),
        free_flaps=kind == "wall",
        travel=draws.number("travel", (0.5, 0.97)),
    )


def _divide(draws: Draws, cell: Cell, style: Style, level: int) -> tuple[list[tuple[Cell, int]], Solid]:
    """Cells, each with the seed of what it holds, and the boards between them. Equal cells often hold the same."""
    width, height = cell.sides
    large = max(width / 0.55, height / 0.75)
    fits = [min(4, int(width / 0.24)), min(5, int(height / 0.13))]
    if max(fits) < 2 or not draws.chance("divided", (0.85, 0.5, 0.2)[level] * min(1.0, 0.35 + 0.5 * large)):
        return [(cell, draws.seed("contents"))], Solid()
    axis = int(np.argmax(fits))
    if min(fits) > 1:
        axis = 0 if draws.chance("side_by_side", width / (width + 0.8 * height)) else 1
    low, high = cell.low[axis], cell.high[axis]
    alike = draws.chance("alike", 0.6)
    if alike:
        edges = np.linspace(low, high, draws.integer(("columns", "rows")[axis], 2, fits[axis]) + 1)
    else:
        edges = np.array([low, low + draws.number("divider", (0.25, 0.75)) * (high - low), high])
    half = style.board / 2
    cells: list[tuple[Cell, int]] = []
    boards = Solid()
    seed = draws.seed("pattern")
    for first, last in pairwise(edges):
        near, far = (first + half if first > low else first), (last - half if last < high else last)
        below = draws.fork("", seed) if alike else draws
        parts, more = _divide(below, cell.between(axis, near, far), style, min(level + 1, 2))
        cells += parts
        boards += more
    return cells, boards + fronts.boards_across(cell, style, axis, edges[1:-1])


def _fill(draws: Draws, cell: Cell, style: Style, drawers: float, must_move: bool) -> tuple[Solid, list[Moving]]:
    """What stands in a cell: chosen by its shape."""
    width, height = cell.sides
    low_and_wide = 0.08 < height < 0.45 and width > 0.18 and height < 1.2 * width
    chances = {
        "drawer": drawers * low_and_wide,
        "door": 0.5 * (0.18 < width < 0.75 and height > 0.2 and width < 1.3 * height),
        "double": (0.5 if width < 0.7 else 1.2) * (width > 0.44 and height > 0.25 and width < 2.2 * height),
        "flap": 0.3 * (width > 1.15 * height and 0.18 < height < 0.6),
        "sliding": 0.2 * (width > 0.7 and height > 0.3),
        "open": 0.0 if must_move else 0.1,
        "fixed": 0.04 * (not must_move and low_and_wide),
    }
    chances["drawer"] += sum(chances.values()) <= 0.0
    total = np.sum(list(chances.values()))
    what = draws.pick("holds", {name: chance / total for name, chance in chances.items()})
    plain = {"drawer": fronts.drawer, "double": fronts.double_door, "sliding": fronts.sliding_doors,
             "open": fronts.shelves, "fixed": fronts.fixed}  # fmt: skip
    if what in plain:
        return plain[what](draws, cell, style)
    if what == "flap":
        return fronts.door(draws, cell, style, draws.pick("hinge", {"top": 0.7, "bottom": 0.3}))
    outside = [name for name, outer in (("left", cell.outer_high[0]), ("right", cell.outer_low[0])) if outer]
    return fronts.door(draws, cell, style, draws.pick("hinge", outside if outside else ["left", "right"]))


def _carcass(
    draws: Draws, kind: str, width: float, depth: float, height: float, stand: float, style: Style, furniture: Assembly
) -> Solid:
    """Outer boards, top and what it stands on."""
    x, y, board, top = depth / 2, width / 2, style.board, stand + height
    to_floor = stand > 0 and draws.chance("sides_to_floor", 0.3)
    upright, across = (0.0 if to_floor else stand, top), y - 0.001
    solid = box((style.back, x), across, (stand + 0.001, top - 0.001))
    solid += union(box(x, about(s, board / 2), upright) for s in (board / 2 - y, y - board / 2))
    solid += box(x, across, (stand, stand + board))
    if kind == "base" and draws.chance("worktop_rails", 0.4):  # open at the top, with rails for a worktop
        rail = draws.length("worktop_rail_depth", (0.06, 0.12))
        for deep in ((-x, -x + rail), (style.back - rail, x - 0.001)):
            solid += box(deep, across, (top - board, top))
    else:
        solid += box(x, across, (top - board, top)) + _top(draws, kind, x, y, top)
    if kind not in ("base", "wall") and draws.chance("corner_posts", 0.15):  # down to the floor
        post = draws.length("post_width", (0.02, 0.045))
        to_floor = False
        for near in (-x - fronts.GAP, x - post):
            solid += union(box((near, near + post), (s * y, s * (y + post)), (0, top)) for s in (-1, 1))
    if to_floor:
        setback = draws.length("plinth_setback", (0.02, 0.07)) - x
        return solid + box((setback, setback + board), across, (0, stand + 0.001))
    return solid + (_stand(draws, kind, x, y, stand, board, furniture) if stand > 0 else Solid())


def _top(draws: Draws, kind: str, x: float, y: float, top: float) -> Solid:
    if kind == "wall" or draws.pick("top", {"none": 0.25, "board": 0.75}) == "none":
        return Solid()
    over, thick = draws.lengths(top_overhang=(0.0, 0.035), top_thickness=(0.012, 0.04))
    front = -x - 0.022
    solid = box((front - over, x), y + over, (top - 0.001, top + thick))
    if kind == "tall" and draws.chance("cornice", 0.4):
        for step in (1, 2):
            more, z = over + 0.012 * step, top + thick * step
            solid += box((front - more, x), y + more, (z - 0.001, z + thick))
    if kind in ("dresser", "sideboard", "nightstand") and draws.chance("backboard", 0.12):
        solid += box((x - 0.02, x), y, (top, top + thick + draws.length("backboard_height", (0.05, 0.2))))
    return solid


def _stand(draws: Draws, kind: str, x: float, y: float, height: float, board: float, furniture: Assembly) -> Solid:
    """Plinth, brackets or legs below the body."""
    if kind == "base" or (height < 0.1 and draws.chance("plinth", 0.6)):
        setback = draws.length("plinth_setback", (0.03, 0.08) if kind == "base" else (-0.015, 0.03))
        wide = y - 0.5 * abs(setback) + 0.01
        return frame((setback - x, -wide, 0), (x, wide, height + 0.001), [board] * 4, 0, 1)
    signs = [(sx, sy) for sx in (-1, 1) for sy in (-1, 1)]
    if height < 0.2 and draws.chance("brackets", 0.25):  # an angle at each corner
        arm, thick = draws.lengths(bracket_length=(0.06, 0.12), bracket_thickness=(0.018, 0.03))
        levels = ((1.0, height + 0.001), (0.6, 0.0))
        return union(
            hull([(sx * (x - u * p), sy * (y - v * p), z) for p, z in levels for u in (0.0, du) for v in (0.0, dv)])
            for sx, sy in signs for du, dv in ((arm, thick), (thick, arm))
        )  # fmt: skip
    furniture.record(legs=True)
    radius, taper = draws.length("leg_radius", (0.012, 0.03)), draws.number("leg_taper", (0.45, 1.0))
    splay = draws.one_of("legs_stand", {"upright": 0.0, "splayed": draws.number("leg_splay", (0.0, 0.25)) * height})
    inset = radius + draws.length("leg_inset", (0.0, 0.06))
    sections, legs = draws.pick("leg_sides", [4, 16]), Solid()
    inner_x, inner_y = x - inset, y - inset
    for sx, sy in signs:
        head = np.array([sx * inner_x, sy * inner_y, height + 0.002])
        foot = head + (0.8 * sx * splay, 0.8 * sy * splay, -height - 0.002)
        legs += cylinder(foot, head, taper * radius, radius, sections)
    if height > 0.12 and draws.chance("apron", 0.5):
        low, high = height - draws.length("apron_height", (0.02, 0.05)), height + 0.001
        inner_x, inner_y = inner_x + 0.008, inner_y + 0.008
        legs += frame((-inner_x, -inner_y, low), (inner_x, inner_y, high), [0.016] * 4, 0, 1)
    return legs
