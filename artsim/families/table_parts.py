"""Pieces of tables: tops, legs, cases with drawers and doors, leaves, trays, wheels."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from artsim.families import fronts
from artsim.families.fronts import Cell, Moving, Style
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import Array, Vector, about
from artsim.making.solids import Solid, box, cylinder, hull_of, rod, tube, union

GAP = 0.003
LEGS = {"square": 0.3, "tapered": 0.22, "round": 0.22, "turned": 0.13, "loops": 0.13}
PEDESTALS = {"right": (-1,), "left": (1,), "both": (-1, 1)}
"""Sides of a desk, along Y, that have a pedestal."""


def add_case(
    draws: Draws, table: Assembly, low: Vector, high: Vector, style: Style, grid: tuple[int, int], doors: float,
    back: bool = False, free: tuple[bool, bool] = (False, False),
) -> None:  # fmt: skip
    """A case between two corners, open towards -X, with a grid of cells, so many columns and rows.

    ``doors`` is how likely a cell that is high enough has doors. Where ``back``, it opens towards +X, reflected in the
    plane x = 0. Where nothing stands beside it at -Y or +Y, it is ``free`` there: doors open beyond a right angle.
    """
    board = style.board
    style = replace(style, face=float(low[0]), back=float(high[0]) - 0.008)
    solid = box((style.back, low[1], low[2]), high)
    solid += union(box((style.face, high[0]), (low[1], high[1]), (z, z + board)) for z in (low[2], high[2] - board))
    solid += union(box((style.face, high[0]), (y, y + board), (low[2], high[2])) for y in (low[1], high[1] - board))
    whole = Cell((low[1] + board, low[2] + board), (high[1] - board, high[2] - board), (free[0], True), (free[1], True))
    columns, boards = _divided(draws, whole, 0, grid[0], style)
    solid += boards
    recipe, alike = draws.seed("pattern"), draws.chance("columns_alike", 0.6)
    parts: list[Moving] = []
    for column in columns:
        draw = draws.fork("", recipe) if alike else draws
        cells, boards = _divided(draw, column, 1, grid[1] if alike else draws.integer("rows", 1, grid[1]), style)
        solid += boards
        for cell in cells:
            inside, more = _fill(draw, cell, style, doors, must_move=not parts)
            solid += inside
            parts += more
    table.body += solid.mirrored(0) if back else solid
    for part in parts:
        table.add_numbered(*(_mirrored(part) if back else part))


def _divided(draws: Draws, cell: Cell, axis: int, count: int, style: Style) -> tuple[list[Cell], Solid]:
    """Cells side by side (axis 0) or one above the other (axis 1), and the boards between them."""
    count = max(1, min(count, int(cell.sides[axis] / (0.16 if axis == 0 else 0.085))))
    shares = np.ones(count) if draws.chance("equal_cells", 0.5) else draws.numbers("cell_share", 0.7, 1.5, count)
    edges = levels(cell.low[axis], cell.high[axis], shares, 0.75)  # the least still holds a drawer
    half = style.board / 2
    cells = []
    for k in range(count):
        first = edges[k] + (half if k else 0.0)
        last = edges[k + 1] - (half if k < count - 1 else 0.0)
        cells.append(cell.between(axis, float(first), float(last)))
    return cells, fronts.boards_across(cell, style, axis, edges[1:-1])


def levels(low: float, high: float, shares: Array, least: float) -> Array:
    """(N + 1,) levels that divide a range in N proportions, each at least so much of an equal share."""
    shares = np.maximum(shares / shares.sum(), least / len(shares))
    edges: Array = low + np.concatenate([[0.0], np.cumsum(shares) / shares.sum()]) * (high - low)
    return edges


def _fill(draws: Draws, cell: Cell, style: Style, doors: float, must_move: bool) -> tuple[Solid, list[Moving]]:
    """What a cell holds."""
    width, height = cell.sides
    if not must_move and draws.chance("still", 0.12):
        still = draws.one_of("still_front", {"open": fronts.shelves, "fixed": fronts.fixed}, (0.7, 0.3))
        return still(draws, cell, style)
    if height > 0.2 and width > 0.05 and draws.chance("has_door", doors * (1.0 if height > 0.3 else 0.6)):
        if width > 0.42 and draws.chance("door_pair", 0.75):
            pairs = {"hinged": fronts.double_door, "sliding": fronts.sliding_doors}
            return draws.one_of("pair", pairs, (0.85, 0.15))(draws, cell, style)
        hinges = ["left", "right"] if width < 1.3 * height else ["bottom", "top"]
        return fronts.door(draws, cell, style, draws.pick("hinge", hinges))
    if height > 0.65:
        return fronts.door(draws, cell, style, draws.pick("hinge", ["left", "right"]))
    return fronts.drawer(draws, cell, style)


def _mirrored(part: Moving) -> Moving:
    """Reflected in the plane x = 0: a slide turns about, a hinge turns the other way round."""
    label, solid, joint = part
    x, y, z = (float(v) for v in joint.axis)
    axis = (-x, y, z) if joint.type == "prismatic" else (x, -y, -z)
    origin = np.asarray(joint.origin, dtype=np.float64) * (-1.0, 1.0, 1.0)
    return label, solid.mirrored(0), replace(joint, axis=axis, origin=tuple(origin.tolist()))


def table_top(draws: Draws, depth: float, width: float, low: float, high: float) -> Solid:
    """A board with round corners or round edges, from height ``low`` to ``high``."""
    corners = (-depth / 2, -width / 2, low), (depth / 2, width / 2, high)
    if draws.chance("round_corners", 0.25):
        return box(*corners, fillet=draws.length("corner_radius", (0.02, 0.12)), axis=2)
    return box(*corners, fillet=draws.pick("edge_rounding", [0.1, 0.3, 0.49]) * (high - low))


def four_legs(
    draws: Draws, x: float, y: float, low: float, high: float, size: float, shapes: Mapping[str, float] = LEGS,
    thinnest: float = 0.4, splay: bool = False,
) -> Solid:  # fmt: skip
    """Four legs with their outer edges on a rectangle, of one of several shapes, or a loop at either end."""
    kind = draws.pick("leg_shape", shapes)
    half, taper, tall = size / 2, draws.number("leg_taper", (thinnest, 0.9)), high - low
    out = min(0.12 * tall, 0.2 * min(x, y)) if splay and kind in ("tapered", "round") else 0.0
    solid = Solid()
    for sx in (-1, 1):
        if kind == "loops":
            beside = sx * y, sx * (y - size)
            solid += union(box((u, u + size), beside, (low, high)) for u in (-x, x - size))
            solid += box(x, beside, (low, low + 0.7 * size))
            continue
        for sy in (-1, 1):
            head = np.array([sx * (x - half), sy * (y - half), high])
            foot = head + (sx * out, sy * out, -tall)
            if kind == "square":
                solid += box(foot - (half, half, 0), head + (half, half, 0))
            elif kind == "round":
                solid += cylinder(foot, head, taper * half, half, 16)
            elif kind == "tapered" and out:
                solid += cylinder(foot, head, taper * half, 1.2 * half, 4)
            elif kind == "blocked":  # tapered below a straight block, its outer faces upright
                block, thin = box(head - (half, half, 0.25 * tall), head + (half, half, 0)), taper * half
                corner = foot + (sx * (half - thin), sy * (half - thin), 0)
                solid += block + hull_of(block, box(thin, thin, (0, 0.01)).moved(corner))
            elif kind == "baluster":  # turned below a straight block
                path = [(*head[:2], share * high) for share in (0.0, 0.03, 0.1, 0.45, 0.5, 0.53, 0.56, 0.7)]
                radii = half * np.array([0.5, 0.8, 0.5, 0.95, 0.6, 0.9, 0.6, 1.0])
                solid += tube(path, radii.tolist(), 12)
                solid += box(about(head[0], half), about(head[1], half), (0.69 * high, high))
            elif kind == "tapered":
                below = box(foot - (taper * half, taper * half, 0), foot + (taper * half, taper * half, 0.01))
                solid += hull_of(below, box(head - (half, half, 0.25 * tall), head + (half, half, 0)))
            else:
                path = [(*head[:2], low + share * tall) for share in (0.0, 0.05, 0.12, 0.5, 0.56, 0.62, 0.75, 1.0)]
                radii = half * np.array([0.55, 0.85, 0.5, 0.95, 0.6, 0.95, 1.0, 1.0])
                solid += tube(path, radii.tolist(), 10)
    return solid


def drop_leaves(draws: Draws, table: Assembly, depth: float, width: float, top: float, height: float) -> None:
    """Leaves at one or both ends that hang down when they turn."""
    long = min(draws.number("leaf_length", (0.15, 0.4)) * width, top - 0.05)
    for side in (-1, 1)[: draws.integer("leaves", 1, 2)]:
        near, far = side * (width / 2 + GAP), side * (width / 2 + GAP + long)
        leaf = box(depth / 2, (near, far), (top, height), fillet=0.2 * (height - top))
        limit = np.pi / 2 * draws.number("leaf_angle", (0.9, 1.0))
        table.add_numbered("leaf", leaf, revolute("body", (-side, 0, 0), (0.0, near, top), 0.0, limit))


def keyboard_tray(draws: Draws, desk: Assembly, front: float, near: float, far: float, top: float, deep: float) -> None:
    """A board that slides out below the top between two rails."""
    half, middle = 0.5 * (far - near) * draws.number("tray_width", (0.6, 0.96)), 0.5 * (near + far)
    y0, y1 = middle - half, middle + half
    z = top - draws.length("tray_drop", (0.07, 0.12))
    for y in (y0 - 0.012, y1):
        desk.body += box((front + 0.01, front + deep), (y, y + 0.012), (z - 0.005, top + 0.001))
    board = box((front + 0.005, front + deep), (y0 + GAP, y1 - GAP), (z, z + 0.018), fillet=0.004)
    joint = prismatic("body", (-1, 0, 0), 0.0, deep * draws.number("travel", (0.5, 0.85)), (front, middle, z))
    desk.add_numbered("drawer", board, joint)


def wheels(table: Assembly, spots: list[tuple[float, float]], height: float, size: float) -> None:
    """A wheel between two cheeks under each spot, which is ``height`` above the floor."""
    radius = 0.42 * height
    half, thick = 0.3 * radius, 0.004
    for x, y in spots:
        across = (y - half - thick - 0.002, y + half + thick + 0.002)
        body = box(about(x, 0.5 * radius), across, (height - 0.1 * radius, height + 0.012))
        for s in (-1, 1):
            beside = y + s * (half + 0.002), y + s * (half + 0.002 + thick)
            body += box((x - 0.35 * radius, x + 0.35 * radius), beside, (0.7 * radius, height))
        body += rod(x, y, (height - 0.001, height + 0.01), 0.4 * size, sections=12)
        table.body += body
        wheel = rod(x, (y - half, y + half), radius, radius, sections=18)
        table.add_numbered("wheel", wheel, continuous("body", (0, 1, 0), (x, y, radius)))
