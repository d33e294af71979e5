"""Tables and desks: drawers and doors under the top, and what else of a table moves.

What varies: the kind (apron between legs, pedestals, a case on a stand, a column), size, tops (square, round, oval),
legs, the grid of cells under the top and what they hold, cells at the back, leaves that drop, tops that turn, tip or
rise, a tray for a keyboard, wheels.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families import fronts
from artsim.families.fronts import Cell, Moving, Style
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.solids import Solid, box, cylinder, hull_of, loft, ring, rounded_box, tube, union
from artsim.model.kinematics import Array

GAP = 0.003
UP = (0.0, 0.0, 1.0)


@dataclass
class _Table:
    """A body under construction, and what moves on it."""

    body: Solid = field(default_factory=Solid)
    moving: list[Moving] = field(default_factory=list)

    def add_case(
        self,
        rng: np.random.Generator,
        low: Array,
        high: Array,
        style: Style,
        grid: tuple[int, int],
        doors: float,
        back: bool = False,
    ) -> None:
        """A case, open towards -X, with a grid of cells.

        Parameters
        ----------
        low, high : (3,) float
            Outer corners.
        grid : 2 int
            Columns and rows.
        doors : float
            How likely a cell that is high enough has doors.
        back : bool
            Turns it to open towards +X, reflected in the plane x = 0.
        """
        board = style.board
        style = replace(style, face=float(low[0]), back=float(high[0]) - 0.008)
        solid = box((style.back, low[1], low[2]), high)
        for z in (low[2], high[2] - board):
            solid += box((style.face, low[1], z), (high[0], high[1], z + board))
        for y in (low[1], high[1] - board):
            solid += box((style.face, y, low[2]), (high[0], y + board, high[2]))
        whole = Cell((low[1] + board, low[2] + board), (high[1] - board, high[2] - board))
        columns, boards = _divided(rng, whole, 0, grid[0], style)
        solid += boards
        recipe, alike = int(rng.integers(2**31)), rng.random() < 0.6
        parts: list[Moving] = []
        for column in columns:
            draw = np.random.default_rng(recipe) if alike else rng
            rows = grid[1] if alike else int(rng.integers(1, grid[1] + 1))
            cells, boards = _divided(draw, column, 1, rows, style)
            solid += boards
            for cell in cells:
                inside, more = _fill(draw, cell, style, doors, must_move=not parts)
                solid += inside
                parts += more
        self.body += solid.mirrored(0) if back else solid
        self.moving += [_mirrored(part) for part in parts] if back else parts


def _divided(rng: np.random.Generator, cell: Cell, axis: int, count: int, style: Style) -> tuple[list[Cell], Solid]:
    """Cells side by side (axis 0) or one above the other (axis 1), and the boards between them."""
    room = cell.sides[axis]
    count = max(1, min(count, int(room / (0.16 if axis == 0 else 0.085))))
    shares = np.ones(count) if rng.random() < 0.5 else rng.uniform(0.7, 1.5, count)
    edges = cell.low[axis] + np.concatenate([[0.0], np.cumsum(shares) / shares.sum()]) * room
    half = style.board / 2
    cells, boards = [], Solid()
    for k in range(count):
        first = edges[k] + (half if k else 0.0)
        last = edges[k + 1] - (half if k < count - 1 else 0.0)
        cells.append(cell.between(axis, float(first), float(last)))
    for edge in edges[1:-1]:
        low, high = np.array([style.face, *cell.low]) - 0.001, np.array([style.back, *cell.high]) + 0.001
        low[0] = style.face
        low[1 + axis], high[1 + axis] = edge - half, edge + half
        boards += box(low, high)
    return cells, boards


def _fill(
    rng: np.random.Generator, cell: Cell, style: Style, doors: float, must_move: bool
) -> tuple[Solid, list[Moving]]:
    """What a cell holds."""
    width, height = cell.sides
    if not must_move and rng.random() < 0.12:
        return fronts.shelves(rng, cell, style) if rng.random() < 0.7 else fronts.fixed(cell, style)
    if height > 0.2 and width > 0.16 and rng.random() < doors * (1.0 if height > 0.3 else 0.6):
        if width > 0.42 and rng.random() < 0.75:
            return (
                fronts.double_door(rng, cell, style) if rng.random() < 0.85 else fronts.sliding_doors(rng, cell, style)
            )
        if width < 1.3 * height:
            return fronts.door(rng, cell, style, str(rng.choice(["left", "right"])))
        return fronts.door(rng, cell, style, str(rng.choice(["bottom", "top"])))
    if height > 0.5:
        return fronts.door(rng, cell, style, str(rng.choice(["left", "right"])))
    return fronts.drawer(rng, cell, style)


def _mirrored(part: Moving) -> Moving:
    """Reflected in the plane x = 0: a slide turns about, a hinge turns the other way round."""
    label, solid, joint = part
    x, y, z = (float(v) for v in joint.axis)
    axis = (-x, y, z) if joint.type == "prismatic" else (x, -y, -z)
    origin = np.asarray(joint.origin, dtype=np.float64) * (-1.0, 1.0, 1.0)
    return label, solid.mirrored(0), replace(joint, axis=axis, origin=tuple(origin.tolist()))


def build(rng: np.random.Generator) -> Assembly:
    """A table, all drawers and doors closed at rest."""
    table = _Table()
    kinds = (_apron, _pedestals, _case, _column)
    kinds[rng.choice(4, p=[0.36, 0.27, 0.25, 0.12])](rng, table)
    assembly = Assembly()
    assembly.add("body", table.body, density=650.0)
    count: dict[str, int] = {}
    for label, solid, joint in table.moving:
        number = count[label] = count.get(label, -1) + 1
        assembly.add(f"{label}_{number}", solid, joint, density=650.0)
    return assembly


def _style(rng: np.random.Generator) -> Style:
    return Style(
        face=0.0,
        back=0.0,
        board=rng.uniform(0.012, 0.024),
        lap=1.0,
        place=float(rng.choice([0.5, 0.7, 0.85])),
        level=rng.random() < 0.2,
        thickness=rng.uniform(0.014, 0.022),
        overlay=rng.random() < 0.5,
        panel=str(rng.choice(["slab", "shaker", "raised", "planks", "glass"], p=[0.62, 0.15, 0.15, 0.04, 0.04])),
        rail=rng.uniform(0.025, 0.06),
        recess=rng.uniform(0.004, 0.008),
        handle=str(rng.choice(["bar", "bow", "knob", "block", "cup", "none"], p=[0.24, 0.15, 0.25, 0.05, 0.05, 0.26])),
        handle_length=rng.uniform(0.06, 0.4),
        reach=rng.uniform(0.014, 0.04),
        grip=rng.uniform(0.004, 0.008),
        travel=rng.triangular(0.45, 0.8, 0.92),
    )


def _apron(rng: np.random.Generator, table: _Table) -> None:
    """Legs with a low case between them under the top; leaves at the ends, a shelf below, wheels."""
    height = rng.uniform(0.32, 0.95)
    width, depth = height * rng.uniform(0.65, 3.4), height * rng.uniform(0.4, 1.7)
    depth = float(np.clip(depth, 0.3, 1.1))
    width = float(np.clip(width, 0.34, 2.4))
    thick, over = rng.uniform(0.014, 0.06), rng.uniform(0.0, 0.06)
    size = height * rng.uniform(0.04, 0.12)
    size = min(size, 0.2 * depth, 0.15 * width)
    over = min(over, 0.12 * depth)
    top = height - thick
    x, y = depth / 2 - over, width / 2 - over
    apron = min(max(height * rng.uniform(0.12, 0.32), 0.09), 0.5 * height)
    rolling = rng.random() < 0.12
    foot = 0.07 if rolling else 0.0
    table.body += _top(rng, depth, width, top, height)
    table.body += _legs(rng, x, y, foot, top + 0.001, size, splay=rng.random() < 0.2)
    style = _style(rng)
    inset = 0.25 * size
    both = rng.random() < 0.12 and 2 * x > 0.5
    rear = not both and rng.random() < 0.1
    deep = (0.47 if both else rng.uniform(0.6, 1.0)) * (2 * x - 2 * inset)
    half = y - 0.5 * size
    low = np.array([-x + inset, -half, top - apron])
    high = np.array([-x + inset + deep, half, top + 0.001])
    grid = int(rng.choice([1, 2, 3, 4], p=[0.45, 0.25, 0.2, 0.1])), 1 if apron < 0.22 else int(rng.integers(1, 3))
    # The fronts lie between the legs.
    style = replace(style, overlay=style.overlay and inset > 0.02)
    low[1], high[1] = -(y - size) + 0.001, y - size - 0.001
    if high[1] - low[1] < 0.2:
        low[1], high[1] = -0.1, 0.1
    for back in (False, True):
        if both or back == rear:
            table.add_case(rng, low, high, style, grid, 0.25, back)
    rail = min(0.008, 0.4 * size)
    for s in (-1, 1):  # rails into the legs, beside and behind the case
        table.body += (
            box((s * (x - inset) - 0.008, -half, top - apron), (s * (x - inset) + 0.008, half, top + 0.001))
            if (s > 0 and not both and not rear) or (s < 0 and rear)
            else Solid()
        )
        table.body += box(
            (-x + 0.5 * size, s * half - rail, top - apron), (x - 0.5 * size, s * half + rail, top + 0.001)
        )
        for near in (-x + inset, x - inset - 0.012):
            a, b = sorted((s * (high[1] - 0.002), s * half))
            table.body += box((near, a, top - apron), (near + 0.012, b, top + 0.001))
    if rng.random() < 0.25:
        z = foot + rng.uniform(0.1, 0.4) * (top - apron - foot)
        table.body += box((-x + 0.3 * size, -y + 0.3 * size, z), (x - 0.3 * size, y - 0.3 * size, z + 0.018))
    if rng.random() < 0.1:
        _leaves(rng, table, depth, width, top, height)
    if rolling:
        _wheels(
            rng, table, [(sx * (x - 0.5 * size), sy * (y - 0.5 * size)) for sx in (-1, 1) for sy in (-1, 1)], foot, size
        )


def _pedestals(rng: np.random.Generator, table: _Table) -> None:
    """A desk: cases with drawers and doors at one or both ends, legs or a panel elsewhere, a flat case or a tray between."""
    height = rng.uniform(0.62, 0.85)
    width, depth = height * rng.uniform(1.3, 3.4), height * rng.uniform(0.5, 1.4)
    thick, over = rng.uniform(0.016, 0.05), rng.uniform(0.0, 0.05)
    top, x, y = height - thick, depth / 2 - over, width / 2 - over
    table.body += _top(rng, depth, width, top, height)
    style = _style(rng)
    broad = min(rng.uniform(0.26, 0.5), 0.38 * width)
    sides = [(-1,), (1,), (-1, 1)][rng.choice(3, p=[0.3, 0.3, 0.4])]
    rolling = rng.random() < 0.1
    on_legs = not rolling and rng.random() < 0.35
    size = rng.uniform(0.03, 0.06)
    outer = y - (size if on_legs else 0.0)
    panel = 0.001
    low_z = (
        rng.uniform(0.1, 0.5) * height if on_legs else 0.07 if rolling else rng.choice([0.0, rng.uniform(0.03, 0.12)])
    )
    deep = rng.uniform(0.75, 1.0) * 2 * x
    recipe, alike = int(rng.integers(2**31)), rng.random() < 0.6
    doors = float(rng.choice([0.0, 0.4, 1.0], p=[0.45, 0.3, 0.25]))
    overhang = style.thickness + 0.004 if style.overlay else 0.0
    front = -x + overhang
    for side in sides:
        a, b = sorted((side * outer, side * (outer - broad)))
        draw = np.random.default_rng(recipe) if alike else rng
        table.add_case(
            draw,
            np.array([front, a, low_z]),
            np.array([front + deep - overhang, b, top + 0.001]),
            style,
            (1, int(draw.integers(1, 5))),
            doors,
        )
        if not on_legs and not rolling and low_z > 0:
            table.body += box((front + 0.03, a + 0.01, 0.0), (front + deep - overhang - 0.02, b - 0.01, low_z + 0.001))
        if rolling:
            spots = [(u, v) for u in (front + 0.05, front + deep - overhang - 0.05) for v in (a + 0.05, b - 0.05)]
            _wheels(rng, table, spots, low_z, 0.05)
    if on_legs:
        table.body += _legs(rng, x, y, 0.0, top + 0.001, size, splay=False)
    elif len(sides) == 1:
        panel = rng.uniform(0.02, 0.05)
        a, b = sorted((-sides[0] * y, -sides[0] * (y - panel)))
        table.body += box((-x + overhang, a, 0.0), (x, b, top + 0.001))
    near = -outer + (broad if -1 in sides else panel) - 0.001
    far = outer - (broad if 1 in sides else panel) + 0.001
    table.body += box(
        (front + deep - overhang - 0.03, near, top - rng.uniform(0.2, 0.8) * (top - low_z)),
        (front + deep - overhang - 0.012, far, top + 0.001),
    )
    between = str(rng.choice(["case", "tray", "nothing"], p=[0.45, 0.2, 0.35]))
    if between == "case":
        flat = rng.uniform(0.085, 0.14)
        table.add_case(
            rng,
            np.array([front, near, top - flat]),
            np.array([front + 0.8 * deep - 0.04, far, top + 0.001]),
            style,
            (int(rng.integers(1, 4)), 1),
            0.0,
        )
    elif between == "tray":
        _keyboard_tray(rng, table, front, near, far, top, 0.6 * deep)
    if rng.random() < 0.15:  # shelves on the top
        rise, back = rng.uniform(0.2, 0.5), x - rng.uniform(0.18, 0.3)
        for yy in (-y, y - 0.02):
            table.body += box((back, yy, height - 0.001), (x, yy + 0.02, height + rise))
        table.body += box((back, -y, height + rise - 0.02), (x, y, height + rise))


def _case(rng: np.random.Generator, table: _Table) -> None:
    """A low table or a console: one case from side to side on legs, a plinth or wheels."""
    height = rng.uniform(0.3, 0.95)
    width, depth = height * rng.uniform(0.6, 3.2), height * rng.uniform(0.4, 1.6)
    depth = float(np.clip(depth, 0.28, 0.9))
    width = max(width, 0.34)
    thick, over = rng.uniform(0.012, 0.05), rng.uniform(0.0, 0.05)
    top, x, y = height - thick, depth / 2 - min(over, 0.1 * depth), width / 2 - over
    style = _style(rng)
    stand = str(rng.choice(["legs", "plinth", "wheels"], p=[0.55, 0.3, 0.15]))
    low = {"legs": rng.uniform(0.12, 0.65), "plinth": rng.uniform(0.03, 0.2)}.get(stand, 0.0) * height
    low = 0.07 if stand == "wheels" else min(low, top - 0.12)
    ahead = style.thickness + 0.004 if style.overlay else 0.0
    table.body += _top(rng, depth, width, top, height)
    rows = int(rng.integers(1, 4))
    columns = max(1, min(4, int(width / rng.uniform(0.3, 0.7))))
    both = rng.random() < 0.1 and depth > 0.5
    end = -0.002 if both else x
    for back in (False, True):
        if both or not back:
            table.add_case(
                rng,
                np.array([-x + ahead, -y, low]),
                np.array([end, y, top + 0.001]),
                style,
                (columns, rows),
                float(rng.choice([0.0, 0.5, 1.0])),
                back,
            )
    size = rng.uniform(0.02, 0.05)
    if stand == "legs":
        table.body += _legs(rng, x - ahead, y, 0.0, low + 0.002, size, splay=rng.random() < 0.3)
    elif stand == "plinth":
        inset = rng.uniform(0.01, 0.06)
        table.body += box((-x + ahead + inset, -y + inset, 0.0), (x - inset, y - inset, low + 0.001))
    else:
        _wheels(rng, table, [(sx * (x - 0.06), sy * (y - 0.06)) for sx in (-1, 1) for sy in (-1, 1)], low, 0.05)


def _column(rng: np.random.Generator, table: _Table) -> None:
    """A top on a column that turns, tips or rises, on feet, a disc or wheels."""
    height, wide = rng.uniform(0.45, 1.1), rng.uniform(0.22, 0.6)
    thick = rng.uniform(0.015, 0.05)
    power = float(rng.choice([2.0, 4.0, 12.0]))
    count = 32
    angles = np.arange(count) * 2.0 * np.pi / count
    c, s = cos(angles), sin(angles)
    long = wide * rng.choice([1.0, rng.uniform(1.0, 2.2)])
    outline = np.column_stack(
        [np.sign(c) * np.abs(c) ** (2.0 / power) * wide, np.sign(s) * np.abs(s) ** (2.0 / power) * long]
    )

    def slab(z: float) -> Solid:
        rings = [
            np.column_stack([k * outline, np.full(count, h)])
            for k, h in ((0.96, z), (1.0, z + 0.3 * thick), (1.0, z + 0.8 * thick), (0.98, z + thick))
        ]
        return loft(rings)

    radius = rng.uniform(0.022, 0.06)
    feet = int(rng.choice([0, 3, 4, 5]))
    rolling = feet > 2 and rng.random() < 0.4
    foot = 0.06 if rolling else 0.0
    span = wide * rng.uniform(0.55, 0.9)
    base = Solid()
    low = foot + 0.05
    spots = []
    for k in range(feet):
        angle = 2.0 * np.pi * (k + 0.5) / feet
        leg = hull_of(
            box((0, -0.6 * radius, low), (0.01, 0.6 * radius, low + rng.uniform(0.05, 0.15))),
            box((span - 0.02, -0.02, foot), (span + 0.015, 0.02, foot + 0.03)),
        )
        base += leg.turned(UP, angle)
        spots.append((span * cos(angle), span * sin(angle)))
    if not feet:
        base += cylinder((0, 0, 0), (0, 0, 0.02), span, 0.9 * span, 32) + cylinder(
            (0, 0, 0.02), (0, 0, 0.06), 2 * radius, radius, 24
        )
    kind = str(rng.choice(["turning", "tipping", "rising"]))
    top = height - thick
    if kind == "rising":
        sleeve = 0.62 * top
        inner = 0.7 * radius
        base += ring((0, 0, 0.5 * (low + sleeve)), UP, inner + GAP, radius + GAP, sleeve - low, 16)
        base += cylinder((0, 0, foot + 0.01), (0, 0, low + 0.01), radius + GAP)
        travel = rng.uniform(0.3, 0.6) * (sleeve - low)
        rod = cylinder((0, 0, sleeve - travel - 0.05), (0, 0, top + 0.002), inner, sections=16)
        table.moving.append(("top", rod + slab(top), prismatic("body", UP, 0.0, travel, (0, 0, top))))
    elif kind == "turning":
        base += cylinder((0, 0, foot + 0.01), (0, 0, top - GAP), radius)
        base += cylinder((0, 0, top - 0.02 - GAP), (0, 0, top - GAP), min(3 * radius, 0.5 * wide))
        joint = (
            continuous("body", UP, (0, 0, top))
            if rng.random() < 0.6
            else revolute("body", UP, (0, 0, top), -1.57, 1.57)
        )
        table.moving.append(("top", slab(top), joint))
    else:
        base += cylinder((0, 0, foot + 0.01), (0, 0, top - 0.05), radius)
        base += box((-radius, -radius, top - 0.06), (0.5 * radius, radius, top - 0.02))
        hinge = (radius + 0.01, 0.0, top - 0.03)
        lugs = union(
            box(
                (hinge[0] - 0.01, t * 1.3 * radius - 0.008, top - 0.04),
                (hinge[0] + 0.01, t * 1.3 * radius + 0.008, top + 0.002),
            )
            for t in (-1, 1)
        )
        base += box((0.0, -1.1 * radius, top - 0.04), (hinge[0] + 0.005, 1.1 * radius, top - 0.025))
        # Beyond the hinge's axis the top comes down before the column.
        table.moving.append(("top", slab(top) + lugs, revolute("body", (0, 1, 0), hinge, 0.0, rng.uniform(0.5, 0.9))))
    table.body += base
    if rolling:
        _wheels(rng, table, spots, foot, 0.03)


def _top(rng: np.random.Generator, depth: float, width: float, low: float, high: float) -> Solid:
    corners = (-depth / 2, -width / 2, low), (depth / 2, width / 2, high)
    if rng.random() < 0.25:
        return rounded_box(*corners, rng.uniform(0.02, 0.12), axis=2)
    return rounded_box(*corners, rng.choice([0.1, 0.3, 0.49]) * (high - low))


def _legs(rng: np.random.Generator, x: float, y: float, low: float, high: float, size: float, splay: bool) -> Solid:
    """Four legs within a rectangle: square, tapered, round, turned or a loop at either end."""
    kind = str(rng.choice(["square", "tapered", "round", "turned", "loops"], p=[0.3, 0.22, 0.22, 0.13, 0.13]))
    half, taper = size / 2, rng.uniform(0.4, 0.9)
    tall = high - low
    out = min(0.12 * tall, 0.2 * min(x, y)) if splay and kind in ("tapered", "round") else 0.0
    solid = Solid()
    if kind == "loops":
        for s in (-1, 1):
            a, b = sorted((s * y, s * (y - size)))
            for u in (-x, x - size):
                solid += box((u, a, low), (u + size, b, high))
            solid += box((-x, a, low), (x, b, low + 0.7 * size))
        return solid
    for sx in (-1, 1):
        for sy in (-1, 1):
            head = np.array([sx * (x - half), sy * (y - half), high])
            foot = head + (sx * out, sy * out, -tall)
            if kind == "square":
                solid += box(foot - (half, half, 0), head + (half, half, 0))
            elif kind == "round":
                solid += cylinder(foot, head, taper * half, half, 16)
            elif kind == "tapered":
                solid += (
                    cylinder(foot, head, taper * half, 1.2 * half, 4)
                    if out
                    else hull_of(
                        box(foot - (taper * half, taper * half, 0), foot + (taper * half, taper * half, 0.01)),
                        box(head - (half, half, 0.25 * tall), head + (half, half, 0)),
                    )
                )
            else:
                levels = low + np.array([0.0, 0.05, 0.12, 0.5, 0.56, 0.62, 0.75, 1.0]) * tall
                radii = half * np.array([0.55, 0.85, 0.5, 0.95, 0.6, 0.95, 1.0, 1.0])
                path = np.column_stack([np.full(8, head[0]), np.full(8, head[1]), levels])
                solid += tube(path, radii.tolist(), 10)
    return solid


def _leaves(rng: np.random.Generator, table: _Table, depth: float, width: float, top: float, height: float) -> None:
    """Leaves at one or both ends that hang down when they turn."""
    long = rng.uniform(0.15, 0.4) * width
    long = min(long, top - 0.05)
    for side in (-1, 1)[: int(rng.integers(1, 3))]:
        near, far = side * (width / 2 + GAP), side * (width / 2 + GAP + long)
        leaf = rounded_box((-depth / 2, min(near, far), top), (depth / 2, max(near, far), height), 0.2 * (height - top))
        joint = revolute("body", (-side, 0, 0), (0.0, near, top), 0.0, np.pi / 2 * rng.uniform(0.9, 1.0))
        table.moving.append(("leaf", leaf, joint))


def _keyboard_tray(
    rng: np.random.Generator, table: _Table, front: float, near: float, far: float, top: float, deep: float
) -> None:
    """A board that slides out below the top between two rails."""
    room = far - near
    wide = room * rng.uniform(0.6, 0.96)
    middle = 0.5 * (near + far)
    y0, y1 = middle - 0.5 * wide, middle + 0.5 * wide
    z = top - rng.uniform(0.07, 0.12)
    for y in (y0 - 0.012, y1):
        table.body += box((front + 0.01, y, z - 0.005), (front + deep, y + 0.012, top + 0.001))
    board = rounded_box((front + 0.005, y0 + GAP, z), (front + deep, y1 - GAP, z + 0.018), 0.004)
    table.moving.append(
        ("drawer", board, prismatic("body", (-1, 0, 0), 0.0, deep * rng.uniform(0.5, 0.85), (front, middle, z)))
    )


def _wheels(
    rng: np.random.Generator, table: _Table, spots: list[tuple[float, float]], height: float, size: float
) -> None:
    """A wheel between two cheeks under each spot, which is ``height`` above the floor."""
    radius = 0.42 * height
    half, thick = 0.3 * radius, 0.004
    for x, y in spots:
        body = box(
            (x - 0.5 * radius, y - half - thick - 0.002, height - 0.1 * radius),
            (x + 0.5 * radius, y + half + thick + 0.002, height + 0.012),
        )
        for s in (-1, 1):
            a, b = sorted((y + s * (half + 0.002), y + s * (half + 0.002 + thick)))
            body += box((x - 0.35 * radius, a, 0.7 * radius), (x + 0.35 * radius, b, height))
        body += cylinder((x, y, height - 0.001), (x, y, height + 0.01), 0.4 * size, sections=12)
        table.body += body
        wheel = cylinder((x, y - half, radius), (x, y + half, radius), radius, sections=18)
        table.moving.append(("wheel", wheel, continuous("body", (0, 1, 0), (x, y, radius))))
