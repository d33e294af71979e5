"""Furniture with drawers: chests and nightstands, tables with drawers under the top, desks with pedestals.

What varies: the kind; proportions (a few are long and low, deep or tall); number and grid of the drawers, how wide
those of a row and how high those of a column are, on which side of a desk they are, in one row or at the back of a
table as well; open compartments and fronts that do not move; legs, plinths and shelves; fronts and handles.
"""

from collections.abc import Sequence

import numpy as np

from artsim.families.details import front_handle, knob, panel, unusual_sides
from artsim.families.table_parts import PEDESTALS, four_legs, levels
from artsim.making.assembly import Assembly, prismatic
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, Array, Vector
from artsim.making.solids import Solid, box, frame, tray, union

GAP = 0.002
_FRONT = 0.018  # thickness of a front
_NARROWEST, _SHALLOWEST = 0.12, 0.1  # of what is between a table's legs, and of its drawers with what is around them

_LEAST_SHARES, _MOST_SHARES = (0.148, 0.28, 0.11), (0.84, 0.983, 0.935)
"""Depth, width and height of unusual furniture over its diagonal."""
_LEGS = {"square": 0.35, "blocked": 0.25, "round": 0.25, "baluster": 0.15}, 0.45


class _Furniture(Assembly):
    """Furniture whose drawers are all of one style."""

    def __init__(self, draws: Draws) -> None:
        super().__init__("body", density=650.0)
        self.front = draws.pick("panel", {"slab": 0.7, "shaker": 0.15, "raised": 0.1, "planks": 0.05})
        self.overlay = draws.chance("overlay", 0.5)  # the fronts lie before the case, or within it
        self.handle = draws.pick("handle", {"bar": 0.24, "knob": 0.24, "bow": 0.16, "two knobs": 0.08, "none": 0.28})
        self.size = draws.number("handle_length", (0.15, 0.7))  # of the handle, over the front's width
        self.reach = draws.length("handle_reach", (0.015, 0.04))
        self.rise = draws.number("handle_rise", (-0.2, 0.3))  # of the handle above the front's middle, over its height
        self.side = draws.number("drawer_side", (0.6, 0.95))  # height of the drawer's sides over its front's
        self.length = draws.number("drawer_length", (0.75, 1.0), (0.45, 1.0), tails=0.15)  # over the case's depth
        self.travel = draws.number("travel", (0.65, 0.97), (0.35, 1.0), tails=0.3)  # over the drawer's length
        self.record(handles=self.handle != "none", legs=False)

    def add_case(
        self, low: Vector, high: Vector, wall: float, grid: list[Array], rows: Sequence[str] = (), back: bool = False
    ) -> None:
        """A case that is open towards -X, with a grid of drawers, fixed fronts or open compartments.

        ``grid`` holds, in Y and in Z, the middles of the dividers; the first and last lie on the inner faces of the
        walls. ``rows`` says of each from the bottom up: "drawer", "fixed" or "open". Where ``back``, it opens
        towards +X, reflected in the plane x = 0.
        """
        low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
        thin, (edges_y, edges_z) = wall / 4, grid
        inner_low, inner_high = low + wall / 2, high - wall / 2
        deep = (low[0], high[0] - thin)
        solid = tray(low, high, wall, wall / 2, axis=0, side=-1)
        solid += union(box(deep, (inner_low[1], inner_high[1]), (z - thin, z + thin)) for z in edges_z[1:-1])
        solid += union(box(deep, (y - thin, y + thin), (inner_low[2], inner_high[2])) for y in edges_y[1:-1])
        for row in range(len(edges_z) - 2, -1, -1):
            content = rows[row] if rows else "drawer"
            for column in range(len(edges_y) - 1):
                cell_low = np.array([low[0], edges_y[column] + thin, edges_z[row] + thin])
                cell_high = np.array([inner_high[0], edges_y[column + 1] - thin, edges_z[row + 1] - thin])
                if content == "drawer":
                    self._add_drawer(cell_low + GAP, cell_high - GAP, wall, back)
                elif content == "fixed":
                    face = low[0] - GAP - (_FRONT if self.overlay else 0.0)
                    front_low = np.array([face, *(cell_low[1:] - thin / 2)])
                    front_high = np.array([low[0] + 0.01, *(cell_high[1:] + thin / 2)])
                    solid += self._front(front_low, front_high)
        self.body += solid.mirrored(0) if back else solid

    def _add_drawer(self, low: Array, high: Array, wall: float, back: bool) -> None:
        """Box open at the top behind a front with a handle."""
        face = low[0] - _FRONT - 2 * GAP if self.overlay else low[0]
        spread = wall / 4 if self.overlay else 0.0
        front_low = np.array([face, low[1] - spread, low[2] - spread])
        front_high = np.array([face + _FRONT, high[1] + spread, high[2] + spread])
        length = self.length * (high[0] - low[0])
        top = low[2] + self.side * (high[2] - low[2])
        inner_low, inner_high = (face + _FRONT - 0.005, low[1] + 0.004, low[2]), (low[0] + length, high[1] - 0.004, top)
        drawer = self._front(front_low, front_high, tray(inner_low, inner_high, 0.010))
        ends, way = drawer.bounds(), 1.0 if back else -1.0
        origin = (-way * ends[0, 0], *(0.5 * (ends[0] + ends[1])[1:]))
        slide = prismatic("body", (way, 0, 0), 0.0, self.travel * length, origin)
        self.add_numbered("drawer", drawer.mirrored(0) if back else drawer, slide, density=600.0)

    def _front(self, low: Array, high: Array, behind: Solid | None = None) -> Solid:
        """A front with its handle, and what stands behind it."""
        width, height = high[1] - low[1], high[2] - low[2]
        solid = panel(self.front, low, high, 0.045, 0.006) + (behind or Solid())
        x, y, z = low[0], 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])
        if self.front == "slab":
            z += self.rise * height
        sunken = 0.007 if self.front in ("shaker", "planks") and min(width, height) > 0.144 else 0.0
        half = 0.5 * min(self.size * width, 0.35)
        x, reach = x + sunken, self.reach + sunken
        if "knob" in self.handle:
            two = self.handle == "two knobs" and width >= 0.35
            spots = [y - 0.28 * width, y + 0.28 * width] if two else [y]
            return solid + union(knob((x, spot, z), FRONT, reach, min(0.018, 0.2 * height)) for spot in spots)
        return solid + front_handle(self.handle, (x, y - half, z), (x, y + half, z), reach, min(0.006, 0.08 * height))


def build(draws: Draws) -> Assembly:
    """A body with drawers that slide out towards -X, closed at rest."""
    furniture = _Furniture(draws)
    draws.one_of("kind", {"chest": _chest, "table": _table, "desk": _desk}, (0.45, 0.3, 0.25))(draws, furniture)
    return furniture


def _chest(draws: Draws, furniture: _Furniture) -> None:
    """One case from side to side; some of its rows may be open, or have fronts that do not move."""
    columns = draws.pick("columns", {1: 0.68, 2: 0.23, 3: 0.09})
    rows = draws.integer("rows", 1, max(2, 6 // columns))
    width = columns * draws.length("width", (0.28, 0.6) if columns > 1 else (0.3, 0.9))
    depth, height = draws.length("depth", (0.3, 0.65)), rows * draws.length("height", (0.1, 0.28))
    wall, raised = draws.length("board", (0.012, 0.03)), draws.chance("raised", 0.4)
    legs = draws.length("stand_height", (0.08, 0.45) if raised else (0.0, 0.1))
    if draws.chance("unusual", 0.45):
        depth, width, height = unusual_sides(draws, _LEAST_SHARES, _MOST_SHARES, (0.24, 0.3, 0.2))
        legs = min(legs, 0.5 * height - 0.05)
        height -= legs
        columns, rows = max(1, min(columns, int(width / 0.2))), max(1, min(rows, int(height / 0.11)))
        if width > 6 * height and draws.chance("wide_grid", 0.7):
            columns = draws.integer("columns", 2, 4)
    x, y, top = depth / 2, width / 2, legs + height
    contents = ["drawer"] * rows
    if rows > 1 and draws.chance("mixed_rows", 0.3):  # the lower rows, the commonest first
        others = draws.integer("other_rows", 1, rows - 1)
        contents[:others] = [draws.pick("other_rows_are", {"open": 0.7, "fixed": 0.3})] * others
    grid = [_widths(draws, -y + wall, y - wall, columns), _shares(draws, legs + wall, top - wall, rows)]
    furniture.add_case((-x, -y, legs), (x, y, top), wall, grid, contents)
    if draws.chance("top", 0.55):  # a top that stands over
        over = draws.length("top_overhang", (0.003, 0.04))
        front = over + (_FRONT if furniture.overlay and draws.chance("top_over_fronts", 0.7) else 0.0)
        thick = draws.length("top_thickness", (0.01, 0.035))
        furniture.body += box((-x - front, x), y + over, (top - 0.001, top + thick), fillet=0.3 * thick)
    if raised:
        furniture.body += four_legs(draws, x, y, 0.0, legs + 0.001, draws.length("leg_width", (0.02, 0.06)), *_LEGS)
        furniture.record(legs=True)
    elif legs > 0.005:
        recess = draws.length("plinth_setback", (0.0, 0.05))
        furniture.body += frame((recess - x, -y + 0.01, 0), (x - 0.01, y - 0.01, legs + 0.001), [wall] * 4, 0, 1)


def _table(draws: Draws, furniture: _Furniture) -> None:
    """A top on four legs with a row of drawers in the apron, at the front, the back or both."""
    height = draws.length("height", (0.35, 0.85))
    width = height * draws.number("width", (0.7, 3.2))
    depth = min(max(width * draws.number("depth", (0.35, 1.0)), 0.3), 1.0)
    if draws.chance("unusual", 0.25):
        depth, width, height = unusual_sides(draws, _LEAST_SHARES, _MOST_SHARES, (0.3, 0.34, 0.32))
    thick, over = draws.lengths(top_thickness=(0.015, 0.05), top_overhang=(0.0, 0.07))
    leg = height * draws.number("leg_width", (0.05, 0.13))
    over = min(over, width / 2 - leg - _NARROWEST / 2, depth / 2 - leg - _SHALLOWEST / 2)  # room between the legs
    x, y, top = depth / 2 - over, width / 2 - over, height - thick
    apron = max(height * draws.number("apron_height", (0.11, 0.25)), 0.075)
    wall = draws.length("board", (0.012, 0.02))
    furniture.body += _top(draws, depth, width, top, height) + four_legs(draws, x, y, 0.0, top + 0.001, leg, *_LEGS)
    furniture.record(legs=True)
    between = y - leg + 0.002  # the apron reaches into the legs
    inset = draws.number("apron_inset", (0.0, 0.4)) * leg
    share = 1.0 if draws.chance("whole_apron", 0.6) else draws.number("case_width", (0.4, 0.9))
    span = max(between * share, _NARROWEST / 2)
    middle = 0.0 if draws.chance("centred", 0.8) else draws.side("case_side") * (between - span)
    columns = int(np.clip(round(2 * span / draws.length("column_width", (0.25, 0.7))), 1, 4))
    sides = draws.pick("open_sides", {"front": 0.82, "back": 0.08, "both": 0.1})
    deepest = depth - 2 * over - 2 * inset - wall
    share = draws.number("case_depth", (0.3, 0.47) if sides == "both" else (0.45, 1.0))
    if sides == "both" and deepest < 2.2 * _SHALLOWEST:
        sides = "front"
    reach = max(deepest * share, _SHALLOWEST)
    edges = _widths(draws, middle - span + wall, middle + span - wall, columns)
    for back in (False, True):
        if sides in ("both", ("front", "back")[back]):
            low, high = (inset - x, middle - span, top - apron), (inset - x + reach, middle + span, top + 0.001)
            furniture.add_case(low, high, wall, [edges, np.array([top - apron + wall, top - wall])], back=back)
            for near, far in ((-between, middle - span + 0.002), (middle + span - 0.002, between)):
                if far - near > 0.003:
                    board = box((inset - x, inset - x + wall), (near, far), (top - apron, top + 0.001))
                    furniture.body += board.mirrored(0) if back else board
        else:
            board = box((x - inset - wall, x - inset), between, (top - apron, top + 0.001))
            furniture.body += board if back else board.mirrored(0)
    for side in (-1, 1):
        beside = side * (y - inset), side * (y - inset - wall)
        furniture.body += box(x - leg + 0.002, beside, (top - apron, top + 0.001))
    if draws.chance("shelf", 0.25):
        z = draws.number("shelf_height", (0.12, 0.35)) * height
        furniture.body += box(x - 0.25 * leg, y - 0.25 * leg, (z, z + 0.018))


def _desk(draws: Draws, furniture: _Furniture) -> None:
    """A top over one or two pedestals with drawers; legs or a panel elsewhere, perhaps flat drawers between."""
    height = draws.length("height", (0.62, 0.82))
    width, depth = height * draws.number("width", (1.4, 2.4)), height * draws.number("depth", (0.55, 1.0))
    thick, over, wall = draws.lengths(top_thickness=(0.018, 0.05), top_overhang=(0.0, 0.05), board=(0.014, 0.022))
    x, y, top = depth / 2 - over, width / 2 - over, height - thick
    furniture.body += _top(draws, depth, width, top, height)
    pedestal = min(draws.length("pedestal_width", (0.28, 0.45)), 0.4 * width)
    sides, on_legs = draws.one_of("pedestals", PEDESTALS, (0.35, 0.35, 0.3)), draws.chance("on_legs", 0.4)
    leg = draws.length("leg_width", (0.035, 0.07))
    low = 0.0
    if on_legs:
        low = height * draws.number("pedestal_bottom", (0.1, 0.6))
    elif not draws.chance("on_floor", 0.5):
        low = draws.length("plinth_height", (0.03, 0.1))
    outer = y - leg + 0.002 if on_legs else y
    if len(sides) == 2:
        pedestal = min(pedestal, outer - 0.1)  # room for knees
    rows = draws.integer("rows", 1, 3 if len(sides) == 2 else 4)
    rows = min(rows, max(1, int((top - low) / 0.1)))
    contents = ["drawer"] * rows
    if rows > 1 and draws.chance("open_bottom", 0.3):
        contents[0] = "open"
    elif rows == 1 and top - low > 0.35:  # one drawer above an open compartment
        rows, contents = 2, ["open", "drawer"]
    levels = _shares(draws, low + wall, top - wall, rows)
    if contents[0] == "open" and top - low > 0.3:  # the open compartment is higher than the drawers
        bottom = low + wall + draws.number("open_height", (0.4, 0.7)) * (top - low)
        levels = np.concatenate([levels[:1], np.linspace(bottom, top - wall, rows)])
    for side in sides:
        near, far = sorted((side * outer, side * (outer - pedestal)))
        grid = [np.array([near + wall, far - wall]), levels]
        furniture.add_case((-x, near, low), (x, far, top + 0.001), wall, grid, contents)
        if not on_legs and low > 0:
            furniture.body += frame((0.03 - x, near + 0.01, 0), (x - 0.01, far - 0.01, low + 0.001), [wall] * 4, 0, 1)
    left = -outer + (pedestal if -1 in sides else wall) - 0.002
    right = outer - (pedestal if 1 in sides else wall) + 0.002
    if on_legs:
        furniture.record(legs=True)
        furniture.body += four_legs(draws, x, y, 0.0, top + 0.001, leg, *_LEGS)
    elif len(sides) == 1:  # a panel holds the other end
        edge = -sides[0] * y
        furniture.body += box(x, (edge, edge + sides[0] * wall), (0, top))
    if on_legs or draws.chance("back_panel", 0.7):
        drop = draws.number("back_panel_height", (0.15, 0.9)) * (top - low)
        furniture.body += box((x - 0.06, x - 0.04), (left, right), (top - drop, top + 0.001))
    if draws.chance("flat_case", 0.5):
        flat = draws.length("flat_case_height", (0.08, 0.13))
        edges = np.linspace(left + wall, right - wall, draws.pick("columns", {1: 0.7, 2: 0.3}) + 1)
        far = x - max(0.058, draws.number("flat_case_setback", (0.05, 0.3)) * depth)
        levels = np.array([top - flat + wall, top - wall])
        furniture.add_case((-x, left, top - flat), (far, right, top + 0.001), wall, [edges, levels])


def _shares(draws: Draws, low: float, high: float, rows: int) -> Array:
    """(rows + 1,) levels: equal, at random, or growing downwards."""
    pattern = draws.pick("row_pattern", {"equal": 0.5, "random": 0.3, "growing": 0.2})
    random = draws.rng.dirichlet([12.0] * rows)
    growing = np.linspace(draws.number("row_growth", (1.2, 2.0)), 1.0, rows)
    return levels(low, high, {"equal": np.ones(rows), "random": random, "growing": growing}[pattern], 0.6)


def _widths(draws: Draws, low: float, high: float, columns: int) -> Array:
    """(columns + 1,) edges: of equal columns; the same from either end, as where knees go; or at random."""
    pattern = draws.pick("column_pattern", {"equal": 0.6, "mirrored": 0.25, "random": 0.15})
    half = draws.numbers("column_share", 0.7, 1.5, (columns + 1) // 2)
    mirrored = np.concatenate([half, half[: columns // 2][::-1]])
    random = draws.rng.dirichlet([12.0] * columns)
    return levels(low, high, {"equal": np.ones(columns), "mirrored": mirrored, "random": random}[pattern], 0.6)


def _top(draws: Draws, depth: float, width: float, low: float, high: float) -> Solid:
    radius = draws.pick("edge_rounding", [0.1, 0.45]) * (high - low)
    corners = (-depth / 2, -width / 2, low), (depth / 2, width / 2, high)
    if draws.chance("round_corners", 0.2):
        return box(*corners, fillet=draws.length("corner_radius", (0.02, 0.1)), axis=2)
    return box(*corners, fillet=radius)
