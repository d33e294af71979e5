"""Doors in a frame: one leaf or two, hinged at the left or the right, or sliding on two tracks.

Leaves are plain, panelled or glazed; levers or knobs turn on the leaf and pass through it, others have fixed pulls.
Sizes, panels, the frame's shape (with fanlight, side light, round arch or a wall up to a long partition, in which the
door stands), the thickness of the wall, handles and how far the leaf opens vary.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import bar_handle, grid_panel, swing_limits
from artsim.families.proportions import with_tails
from artsim.making.assembly import Assembly, Rng, pick, prismatic, revolute
from artsim.making.solids import Solid, box, ellipsoid, frame, hull, ring, rod, tube, union
from artsim.model.kinematics import Array

GAP = 0.004
PROUD = 0.014
"""Metres by which the hinges' axis stands before the leaf, so that the leaf clears the frame."""


class Style:
    """What the leaves of a door share; metres, positions in Y as shares of a leaf's width."""

    def __init__(self, rng: Rng, kind: str) -> None:
        look = pick(rng, {"flush": 0.3, "panels": 0.4, "glass": 0.2, "half": 0.1})
        self.thickness = rng.uniform(0.035, 0.05)
        self.rows: tuple[float, ...] = ()  # heights of the crossbars, as shares of a leaf's height
        if look != "flush":
            self.rows = pick(rng, ((), (0.45,), (0.42, 0.5), (0.3, 0.62), (0.4, 0.75), (0.2, 0.4, 0.6, 0.8)))
        self.stile = rng.uniform(0.085, 0.14)
        self.columns = int(rng.choice([1, 2, 3] if look == "glass" else [1, 2])) if look != "flush" else 1
        # Thickness of the boards or panes.
        self.board = {"flush": self.thickness, "panels": 0.012, "glass": 0.006, "half": 0.012}[look]
        self.raised = look == "panels" and rng.random() < 0.6
        handles = {"lever": 0.42, "knob": 0.3, "pull": 0.13, "none": 0.15}
        self.handle = "pull" if kind == "sliding" else pick(rng, handles)
        self.handle_z = rng.uniform(0.95, 1.1)


def build(rng: Rng) -> Assembly:
    """A door, mostly closed at rest."""
    kind = pick(rng, {"single": 0.62, "double": 0.23, "sliding": 0.15})
    width = rng.uniform(0.5, 1.4) * (1.0 if kind == "single" else rng.uniform(1.5, 1.9))
    height = rng.uniform(1.6, 3.0)
    depth, jamb = with_tails(rng, (0.07, 0.42), (0.07, 0.75), 0.15), rng.uniform(0.03, 0.25)
    style = Style(rng, kind)
    if kind == "sliding":
        depth = max(depth, 2 * style.thickness + 0.025)
    door = Assembly("frame", _frame(rng, width, height, depth, jamb, style, kind), 700.0)
    door.record(handles=True)
    if kind == "sliding":
        _sliding(rng, door, width, height, depth, style)
        return door
    limit = float(np.deg2rad(rng.uniform(60.0, 175.0)))
    ajar = rng.uniform(0.1, 0.75) * limit if rng.random() < 0.25 else 0.0
    both = rng.random() < 0.5
    sides = [float(rng.choice([-1.0, 1.0]))] if kind == "single" else [1.0, -1.0]
    for number, side in enumerate(sides):
        edge = side * (width / 2 - GAP)
        inner = -edge if kind == "single" else side * 0.0035
        low = np.array([-depth / 2, min(edge, inner), 0.008])
        high = np.array([-depth / 2 + style.thickness, max(edge, inner), height - 0.005])
        name = "door" if kind == "single" else f"door_{number}"
        turning = style.handle in ("lever", "knob") and (number == 0 or both)
        _leaf(rng, door, name, side, low, high, style, limit, turning)
        if ajar > 0 and number == 0:
            door.open_at_rest(name, ajar)
    return door


def _sliding(rng: Rng, door: Assembly, width: float, height: float, depth: float, style: Style) -> None:
    """Two leaves, one behind the other; the one behind may be fixed, as a part of the frame."""
    fixed = rng.random() < 0.4
    first = float(rng.choice([-1.0, 1.0]))  # where the leaf in front stands
    overlap, half = rng.uniform(0.02, 0.06), rng.uniform(0.1, 0.3)
    leaves = []
    for track, side in enumerate((first, -first)):
        x = -depth / 2 + 0.006 + track * (style.thickness + 0.006)
        outer, inner = side * (width / 2 - 0.003), -side * overlap
        low = np.array([x, min(outer, inner), 0.004])
        high = np.array([x + style.thickness, max(outer, inner), height - 0.004])
        leaf = _face(low, high, style, None)
        y = outer - side * min(0.5 * style.stile, 0.06)
        face, outward = (low[0], -1.0) if track == 0 else (high[0], 1.0)
        leaf += bar_handle(
            (face, y, style.handle_z - half), (face, y, style.handle_z + half), (outward, 0, 0), 0.04, 0.009
        )
        leaves.append((leaf, side, 0.5 * (low + high)))
    travel = width / 2 - overlap - 0.006
    if fixed:
        door.body += leaves.pop()[0] + box(depth / 2 - 0.02, (-width / 2 - 0.002, 0), 0.001)
    for number, (leaf, side, center) in enumerate(leaves):
        name = "door" if fixed else f"door_{number}"
        door.add(name, leaf, prismatic("frame", (0, -side, 0), 0.0, travel, tuple(center)), label="door", density=500.0)


def _frame(rng: Rng, width: float, height: float, depth: float, jamb: float, style: Style, kind: str) -> Solid:
    """Jambs and lintel with a stop behind the leaves; above or beside them perhaps a fixed light or an arch."""
    x0, x1, y = -depth / 2, depth / 2, width / 2
    threshold = float(rng.choice([0.0, 0.015]))
    solid = frame((x0, -y - jamb, -threshold), (x1, y + jamb, height + jamb), [jamb, jamb, threshold, jamb], 1, 2)
    if kind != "sliding":
        stop = x0 + style.thickness + 0.003
        if stop + 0.012 < x1:
            bars = [0.014, 0.014, 0.0, 0.014]
            solid += frame((stop, -y - 0.002, 0), (stop + 0.011, y + 0.002, height + 0.002), bars, 1, 2)
    extra = pick(rng, {"none": 0.27, "casing": 0.2, "fanlight": 0.12, "side light": 0.11, "arch": 0.1, "wall": 0.2})
    if extra == "casing":
        wide = rng.uniform(0.05, 0.1)
        for face in (x0 - 0.009, x1 - 0.002):
            solid += frame((face, -y - jamb - wide, 0), (face + 0.011, y + jamb + wide, height + jamb + wide),
                           [wide + 0.002, wide + 0.002, 0, wide + 0.002], 1, 2)  # fmt: skip
    elif extra == "fanlight":
        rise = rng.uniform(0.25, 0.5)
        low, high = (x0, -y - jamb, height + jamb - 0.002), (x1, y + jamb, height + jamb + rise)
        lights = list(np.linspace(-y, y, int(rng.integers(1, 4)) + 1)[1:-1])
        solid += grid_panel(low, high, [jamb, jamb, 0.02, 0.6 * jamb], lights, [], 0.03, 0.006)
    elif extra == "side light":
        side, wide = rng.choice([-1.0, 1.0]), rng.uniform(0.25, 0.45)
        ends = sorted((side * (y + jamb - 0.002), side * (y + jamb + wide)))
        lights = list(np.linspace(0, height, int(rng.integers(1, 5)) + 1)[1:-1])
        solid += grid_panel(
            (x0, ends[0], 0), (x1, ends[1], height + jamb), [0.05, 0.05, 0.1, jamb], [], lights, 0.03, 0.006
        )
    elif extra == "wall":  # or fixed panels, beside and above
        beside = with_tails(rng, (0.2, 2.0), (0.2, 12.0), 0.3)  # up to a shop front or a long partition
        shares = rng.uniform(0.0 if beside < 4.0 else 0.7, 1.0, 2)
        left, right = shares * min(beside * width, 3.7) + 0.02
        above = rng.uniform(0.02, 0.6 if beside < 4.0 else 0.2)
        solid += frame((x0 + 0.004, -y - jamb - left, 0.0), (x1 - 0.003, y + jamb + right, height + jamb + above),
                       [left + 0.002, right + 0.002, 0.0, above + 0.002], 1, 2)  # fmt: skip
    elif extra == "arch":
        angles = np.linspace(0.0, np.pi, 17)
        radius, base = y + jamb, height + jamb - 0.002
        rise = rng.uniform(0.3, 1.0)
        rim = np.stack([np.zeros(17), radius * cos(angles), base + rise * radius * sin(angles)], axis=1)
        solid += hull(np.concatenate([rim + (x0, 0, 0), rim + (x1, 0, 0)]))
    return solid


def _face(low: Array, high: Array, style: Style, bore: tuple[float, float, float] | None) -> Solid:
    width, height = high[1] - low[1], high[2] - low[2]
    stile = min(style.stile, 0.22 * width)
    columns = list(np.linspace(low[1] + stile / 2, high[1] - stile / 2, style.columns + 1)[1:-1])
    rows = [low[2] + share * height for share in style.rows]
    bar = 0.8 * stile if style.board > 0.008 else 0.35 * stile
    solid = grid_panel(low, high, [stile, stile, 1.6 * stile, stile], columns, rows, bar, style.board, bore)
    if style.raised:
        solid += union(_raised(low, high, cell, style) for cell in _cells(low, high, columns, rows, stile, bar))
    return solid


def _cells(low: Array, high: Array, columns: list[float], rows: list[float], stile: float, bar: float) -> list[Array]:
    """(2, 2) corners in Y and Z of the boards between the bars."""
    edges_y = [low[1] + stile - bar / 2, *columns, high[1] - stile + bar / 2]
    edges_z = [low[2] + 1.6 * stile - bar / 2, *rows, high[2] - stile + bar / 2]
    cells = []
    for y0, y1 in pairwise(edges_y):
        for z0, z1 in pairwise(edges_z):
            cells.append(np.array([(y0 + bar / 2, z0 + bar / 2), (y1 - bar / 2, z1 - bar / 2)]))
    return cells


def _raised(low: Array, high: Array, cell: Array, style: Style) -> Solid:
    """A field that rises from its board on both sides."""
    middle = 0.5 * (low[0] + high[0])
    margin = 0.03
    if (cell[1] - cell[0]).min() < 3.5 * margin:
        return Solid()
    points = [
        (middle + s * out, y, z)
        for s in (-1, 1)
        for out, inset in ((style.board / 2 - 0.001, margin), (0.42 * style.thickness, 1.7 * margin))
        for y in (cell[0, 0] + inset, cell[1, 0] - inset)
        for z in (cell[0, 1] + inset, cell[1, 1] - inset)
    ]
    return hull(points)


def _leaf(
    rng: Rng, door: Assembly, name: str, side: float, low: Array, high: Array, style: Style, limit: float, turning: bool
) -> None:
    """A leaf hinged at ``side`` (1: left, as one stands before it), with its handle at the other edge."""
    edge = high[1] if side > 0 else low[1]
    width = high[1] - low[1]
    stile = min(style.stile, 0.22 * width)
    # A knob nearer to the edge would strike the jamb as it swings out.
    y, z = edge - side * (width - max(stile / 2, 0.055)), style.handle_z
    leaf = _face(low, high, style, (y, z, 0.0105) if turning else None) + _knuckles(low, high, edge, side)
    reach = 0.0
    if turning:
        leaf += _escutcheon(rng, low, high, y, z, stile)
        reach = 0.08
    elif style.handle == "pull":
        half, reach = rng.uniform(0.1, 0.4), 0.07
        for x, outward in ((low[0], -1.0), (high[0], 1.0)):
            leaf += bar_handle((x, y, z - half), (x, y, z + half), (outward, 0, 0), 0.055, 0.011)
    _, most = swing_limits(width - stile, reach - PROUD)
    hinge = (low[0] - PROUD, edge, 0.5 * (low[2] + high[2]))
    door.add(name, leaf, revolute("frame", (0, 0, -side), hinge, 0.0, min(limit, most)), label="door", density=500.0)
    if turning:
        _turning_handle(rng, door, name, style.handle, low[0], high[0], (y, z), side)


def _knuckles(low: Array, high: Array, edge: float, side: float) -> Solid:
    """Hinges beside the axis."""
    x, y = low[0] - PROUD + 0.006, edge - side * 0.007
    solid = Solid()
    for share in (0.12, 0.5, 0.88):
        z = low[2] + share * (high[2] - low[2])
        solid += rod(x, y, (z - 0.045, z + 0.045), 0.0055, sections=12)
        solid += box((x, low[0] + 0.001), (y - 0.003, y + 0.003), (z - 0.045, z + 0.045))
    return solid


def _escutcheon(rng: Rng, low: Array, high: Array, y: float, z: float, stile: float) -> Solid:
    """Roses or long plates around the hole for the handle, on both sides."""
    if rng.random() < 0.5:
        return union(ring((x, y, z), (1, 0, 0), 0.0115, 0.026, 0.012, 20) for x in (low[0], high[0]))
    half = min(0.021, 0.4 * stile)
    below, above = rng.uniform(0.1, 0.17), 0.06
    widths = [half - 0.0115, half - 0.0115, below - 0.0115, above - 0.0115]
    return union(
        frame((x - 0.006, y - half, z - below), (x + 0.006, y + half, z + above), widths, 1, 2)
        for x in (low[0], high[0])
    )


def _turning_handle(
    rng: Rng, door: Assembly, leaf: str, kind: str, front: float, back: float, center: tuple[float, float], side: float
) -> None:
    """Lever or knob on both sides of a leaf, on one spindle through it."""
    y, z = center
    out = 0.045
    handle = rod((front - out, back + out), y, z, 0.0085, sections=12)
    if kind == "knob":
        width, tall = rng.uniform(0.024, 0.032), rng.uniform(0.02, 0.032)
        handle += union(ellipsoid((x, y, z), (0.02, width, tall)) for x in (front - out - 0.01, back + out + 0.01))
        lower, upper = -1.3, 1.3
    else:
        length, droop, radius = rng.uniform(0.09, 0.13), rng.uniform(-0.012, 0.012), rng.uniform(0.007, 0.01)
        for x, turn in ((front - out, 1.0), (back + out, -1.0)):
            path = [(x, y - 0.4 * side * radius, z), (x, y + 0.6 * side * length, z + droop),
                    (x + turn * 0.01, y + side * length, z + droop)]  # fmt: skip
            handle += tube(path, radius, 10)
        lower, upper = 0.0, float(np.deg2rad(rng.uniform(30.0, 50.0)))
    name = "handle" if leaf == "door" else leaf.replace("door", "handle")
    door.add(name, handle, revolute(leaf, (-side, 0, 0), (front, y, z), lower, upper), label="handle", density=2500.0)
