"""Doors in a frame: one leaf or two, hinged at the left or the right, or sliding on two tracks.

Leaves are plain, panelled or glazed; levers or knobs turn on the leaf and pass through it, others have fixed pulls.
Sizes, panels, the frame's shape (with fanlight, side light, round arch or a wall up to a long partition, in which the
door stands), the thickness of the wall, handles and how far the leaf opens vary.
"""

from itertools import pairwise, product

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import bar_handle, grid_panel, swing_limits
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, Array, about
from artsim.making.solids import Solid, box, deferred, ellipsoid, frame, hull, ring, rod, tube, union

GAP = 0.004
PROUD = 0.014
"""Metres by which the hinges' axis stands before the leaf, so that the leaf clears the frame."""
CROSSBARS = {"none": (), "one": (0.45,), "lock rail": (0.42, 0.5), "thirds": (0.3, 0.62), "low": (0.4, 0.75),
             "four": (0.2, 0.4, 0.6, 0.8)}  # fmt: skip
"""Heights of a leaf's crossbars, as shares of its own."""


class Style:
    """What the leaves of a door share; metres, positions in Y as shares of a leaf's width."""

    def __init__(self, draws: Draws, kind: str) -> None:
        look = draws.pick("leaf", {"flush": 0.3, "panels": 0.4, "glass": 0.2, "half": 0.1})
        flush, self.glass = look == "flush", look == "glass"
        self.thickness = draws.length("leaf_thickness", (0.035, 0.05))
        self.rows = CROSSBARS["none" if flush else draws.pick("crossbars", list(CROSSBARS))]
        self.stile = draws.length("stile_width", (0.085, 0.14))
        self.columns = 1 if flush else draws.pick("panel_columns", [1, 2, 3] if self.glass else [1, 2])
        # Thickness of the boards or panes.
        self.board = {"flush": self.thickness, "panels": 0.012, "glass": 0.006, "half": 0.012}[look]
        self.raised = look == "panels" and draws.chance("panels_raised", 0.6)
        handles = {"lever": 0.42, "knob": 0.3, "pull": 0.13, "none": 0.15}
        self.handle = "pull" if kind == "sliding" else draws.pick("handle", handles)
        self.limit = 0.0  # radians that a hinged leaf opens
        self.handle_z = draws.length("handle_height", (0.95, 1.1))


def build(draws: Draws) -> Assembly:
    """A door, mostly closed at rest."""
    kind = draws.pick("kind", {"single": 0.62, "double": 0.23, "sliding": 0.15})
    width = draws.length("width", (0.5, 1.4)) * (1.0 if kind == "single" else draws.number("two_leaves", (1.5, 1.9)))
    height = draws.length("height", (1.6, 3.0))
    depth = draws.length("depth", (0.07, 0.42), (0.07, 0.75), tails=0.15)
    jamb = draws.length("jamb_width", (0.03, 0.25))
    style = Style(draws, kind)
    if kind == "sliding":
        depth = max(depth, 2 * style.thickness + 0.025)
    door = Assembly("frame", _frame(draws, width, height, depth, jamb, style, kind), 700.0)
    door.record(handles=True)
    if kind == "sliding":
        _sliding(draws, door, width, height, depth, style)
        return door
    style.limit = draws.turn("opening_angle", (60.0, 175.0))
    ajar = draws.number("open_share", (0.1, 0.75)) * style.limit if draws.chance("ajar", 0.25) else 0.0
    both = draws.chance("handles_on_both", 0.5)
    sides = [draws.side("hinge")] if kind == "single" else [1.0, -1.0]
    for number, side in enumerate(sides):
        edge = side * (width / 2 - GAP)
        inner = -edge if kind == "single" else side * 0.0035
        low = np.array([-depth / 2, min(edge, inner), 0.008])
        high = np.array([-depth / 2 + style.thickness, max(edge, inner), height - 0.005])
        name = "door" if kind == "single" else f"door_{number}"
        _leaf(draws, door, name, side, low, high, style, style.handle in ("lever", "knob") and (number == 0 or both))
        if ajar > 0 and number == 0:
            door.open_at_rest(name, ajar)
    return door


def _sliding(draws: Draws, door: Assembly, width: float, height: float, depth: float, style: Style) -> None:
    """Two leaves, one behind the other; the one behind may be fixed, as a part of the frame."""
    fixed = draws.chance("one_fixed", 0.4)
    first = draws.side("front_leaf")  # where the leaf in front stands
    overlap, half = draws.length("overlap", (0.02, 0.06)), 0.5 * draws.length("pull_length", (0.2, 0.6))
    leaves = []
    for track, side in enumerate((first, -first)):
        x = -depth / 2 + 0.006 + track * (style.thickness + 0.006)
        outer, inner = side * (width / 2 - 0.003), -side * overlap
        low = np.array([x, min(outer, inner), 0.004])
        high = np.array([x + style.thickness, max(outer, inner), height - 0.004])
        leaf = _face(low, high, style, None)
        y, z = outer - side * min(0.5 * style.stile, 0.06), style.handle_z
        face, outward = (low[0], FRONT) if track == 0 else (high[0], -FRONT)
        leaf += bar_handle((face, y, z - half), (face, y, z + half), outward, 0.04, 0.009)
        leaves.append((leaf, side, 0.5 * (low + high)))
    travel = width / 2 - overlap - 0.006
    if fixed:
        door.body += leaves.pop()[0] + box(depth / 2 - 0.02, (-width / 2 - 0.002, 0), 0.001)
    for number, (leaf, side, center) in enumerate(leaves):
        name = "door" if fixed else f"door_{number}"
        door.add(name, leaf, prismatic("frame", (0, -side, 0), 0.0, travel, tuple(center)), label="door", density=500.0)


def _frame(draws: Draws, width: float, height: float, depth: float, jamb: float, style: Style, kind: str) -> Solid:
    """Jambs and lintel with a stop behind the leaves; above or beside them perhaps a fixed light or an arch."""
    x0, x1, y = -depth / 2, depth / 2, width / 2
    threshold = 0.015 if draws.pick("threshold", [False, True]) else 0.0
    solid = frame((x0, -y - jamb, -threshold), (x1, y + jamb, height + jamb), [jamb, jamb, threshold, jamb])
    if kind != "sliding":
        stop = x0 + style.thickness + 0.003
        if stop + 0.012 < x1:
            bars = [0.014, 0.014, 0.0, 0.014]
            solid += frame((stop, -y - 0.002, 0), (stop + 0.011, y + 0.002, height + 0.002), bars)
    around = {"none": 0.27, "casing": 0.2, "fanlight": 0.12, "side light": 0.11, "arch": 0.1, "wall": 0.2}
    extra = draws.pick("surround", around)
    if extra == "casing":
        wide = draws.length("casing_width", (0.05, 0.1))
        for face in (x0 - 0.009, x1 - 0.002):
            solid += frame((face, -y - jamb - wide, 0), (face + 0.011, y + jamb + wide, height + jamb + wide),
                           [wide + 0.002, wide + 0.002, 0, wide + 0.002])  # fmt: skip
    elif extra == "fanlight":
        rise = draws.length("fanlight_height", (0.25, 0.5))
        low, high = (x0, -y - jamb, height + jamb - 0.002), (x1, y + jamb, height + jamb + rise)
        lights = np.linspace(-y, y, draws.integer("fanlight_panes", 1, 3) + 1)[1:-1]
        solid += grid_panel(low, high, [jamb, jamb, 0.02, 0.6 * jamb], lights, [], 0.03, 0.006)
    elif extra == "side light":
        side, wide = draws.side("side_light"), draws.length("side_light_width", (0.25, 0.45))
        ends = sorted((side * (y + jamb - 0.002), side * (y + jamb + wide)))
        low, high = (x0, ends[0], 0), (x1, ends[1], height + jamb)
        lights = np.linspace(0, height, draws.integer("side_light_panes", 1, 4) + 1)[1:-1]
        solid += grid_panel(low, high, [0.05, 0.05, 0.1, jamb], [], lights, 0.03, 0.006)
    elif extra == "wall":  # or fixed panels, beside and above
        # Up to a shop front or a long partition.
        beside = draws.number("wall_width", (0.2, 2.0), (0.2, 12.0), tails=0.3)
        left, right = draws.numbers("wall_side", 0.0 if beside < 4.0 else 0.7, 1.0, 2) * min(beside * width, 3.7) + 0.02
        above = draws.length("wall_above", (0.02, 0.6 if beside < 4.0 else 0.2))
        solid += frame((x0 + 0.004, -y - jamb - left, 0.0), (x1 - 0.003, y + jamb + right, height + jamb + above),
                       [left + 0.002, right + 0.002, 0.0, above + 0.002])  # fmt: skip
    elif extra == "arch":
        angles = np.linspace(0.0, np.pi, 17)
        radius, base = y + jamb, height + jamb - 0.002
        rise = draws.length("arch_rise", (0.3, 1.0), of=radius)
        rim = np.stack([np.zeros(17), radius * cos(angles), base + rise * sin(angles)], axis=1)
        solid += hull(np.concatenate([rim + (x0, 0, 0), rim + (x1, 0, 0)]))
    return solid


@deferred
def _face(low: Array, high: Array, style: Style, bore: tuple[float, float, float] | None) -> Solid:
    """A leaf without its handle; boards may rise in their middle, on both sides."""
    width, height = high[1] - low[1], high[2] - low[2]
    stile = min(style.stile, 0.22 * width)
    columns = np.linspace(low[1] + stile / 2, high[1] - stile / 2, style.columns + 1)[1:-1]
    rows = [low[2] + share * height for share in style.rows]
    bar = 0.8 * stile if style.board > 0.008 else 0.35 * stile
    widths = [stile, stile, 1.6 * stile, stile]
    solid = grid_panel(low, high, widths, columns, rows, bar, style.board, bore, style.glass)
    if not style.raised:
        return solid
    middle, margin = 0.5 * (low[0] + high[0]), 0.03
    levels = ((style.board / 2 - 0.001, margin), (0.42 * style.thickness, 1.7 * margin))
    edges_y = [low[1] + stile - bar / 2, *columns, high[1] - stile + bar / 2]
    edges_z = [low[2] + 1.6 * stile - bar / 2, *rows, high[2] - stile + bar / 2]
    for y, z in product(pairwise(edges_y), pairwise(edges_z)):
        cell = np.array([y, z]) + (bar / 2, -bar / 2)
        if (cell[:, 1] - cell[:, 0]).min() >= 3.5 * margin:
            solid += hull([(middle + s * out, *spot) for s in (-1, 1) for out, inset in levels
                           for spot in product(*(cell + (inset, -inset)))])  # fmt: skip
    return solid


def _leaf(
    draws: Draws, door: Assembly, name: str, side: float, low: Array, high: Array, style: Style, turning: bool
) -> None:
    """A leaf hinged at ``side`` (1: left, as one stands before it), with its handle at the other edge."""
    edge = high[1] if side > 0 else low[1]
    width = high[1] - low[1]
    stile = min(style.stile, 0.22 * width)
    # A knob nearer to the edge would strike the jamb as it swings out.
    y, z = edge - side * (width - max(stile / 2, 0.055)), style.handle_z
    leaf = _face(low, high, style, (y, z, 0.0105) if turning else None)
    for share in (0.12, 0.5, 0.88):  # knuckles beside the hinge's axis
        at = (low[0] - PROUD + 0.006, edge - side * 0.007, low[2] + share * (high[2] - low[2]))
        leaf += rod(at[0], at[1], about(at[2], 0.045), 0.0055, sections=12)
        leaf += box((at[0], low[0] + 0.001), about(at[1], 0.003), about(at[2], 0.045))
    reach = 0.0
    if turning:
        leaf += _escutcheon(draws, low, high, y, z, stile)
        reach = 0.08
    elif style.handle == "pull":
        half, reach = 0.5 * draws.length("pull_length", (0.2, 0.8)), 0.07
        for x, outward in ((low[0], FRONT), (high[0], -FRONT)):
            leaf += bar_handle((x, y, z - half), (x, y, z + half), outward, 0.055, 0.011)
    most = min(style.limit, swing_limits(width - stile, reach - PROUD)[1])
    hinge = (low[0] - PROUD, edge, 0.5 * (low[2] + high[2]))
    door.add(name, leaf, revolute("frame", (0, 0, -side), hinge, 0.0, most), label="door", density=500.0)
    if turning:
        handle, lower, upper = _turning_handle(draws, style, low[0], high[0], y, side)
        joint = revolute(name, (-side, 0, 0), (low[0], y, z), lower, upper)
        door.add(name.replace("door", "handle"), handle, joint, label="handle", density=2500.0)


def _escutcheon(draws: Draws, low: Array, high: Array, y: float, z: float, stile: float) -> Solid:
    """Roses or long plates around the hole for the handle, on both sides."""
    faces = low[0], high[0]
    if draws.chance("roses", 0.5):
        return union(ring((x, y, z), (1, 0, 0), 0.0115, 0.026, 0.012, 20) for x in faces)
    half = min(0.021, 0.4 * stile)
    below, above = draws.length("plate_below", (0.1, 0.17)), 0.06
    widths = [half - 0.0115, half - 0.0115, below - 0.0115, above - 0.0115]
    return union(frame((x - 0.006, y - half, z - below), (x + 0.006, y + half, z + above), widths) for x in faces)


def _turning_handle(
    draws: Draws, style: Style, front: float, back: float, y: float, side: float
) -> tuple[Solid, float, float]:
    """Lever or knob on both sides of a leaf, on one spindle through it; and how far it turns."""
    z, out = style.handle_z, 0.045
    handle = rod((front - out, back + out), y, z, 0.0085, sections=12)
    if style.handle == "knob":
        width, tall = draws.lengths(knob_width=(0.024, 0.032), knob_height=(0.02, 0.032))
        handle += union(ellipsoid((x, y, z), (0.02, width, tall)) for x in (front - out - 0.01, back + out + 0.01))
        return handle, -1.3, 1.3
    length, droop = draws.lengths(lever_length=(0.09, 0.13), lever_rise=(-0.012, 0.012))
    radius = draws.length("lever_radius", (0.007, 0.01))
    for x, turn in ((front - out, 1.0), (back + out, -1.0)):
        path = [(x, y - 0.4 * side * radius, z), (x, y + 0.6 * side * length, z + droop),
                (x + turn * 0.01, y + side * length, z + droop)]  # fmt: skip
        handle += tube(path, radius, 10)
    return handle, 0.0, draws.turn("lever_angle", (30.0, 50.0))
