"""What stands in an opening of a cabinet: drawers, doors, sliding doors, trays behind doors, shelves.

Everything that belongs to a cell stays within the cell's own range of Y and Z, in whatever state; only doors hinged at
the outer side of a body open beyond a right angle. So cells never collide with one another.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from artsim.families.details import front_handle, knob, panel, swing_limits
from artsim.making.assembly import JointSpec, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, Array, Vector, about
from artsim.making.solids import Solid, box, cylinder, deferred, hull_of, tray, union

GAP = 0.0015
T = TypeVar("T")
Moving = tuple[str, Solid, JointSpec]
"""Label, solid and joint of a moving part; its parent is "body"."""
HINGES = {"left": (1, 1, (0, 0, -1)), "right": (1, -1, (0, 0, 1)), "top": (2, 1, (0, 1, 0)),
          "bottom": (2, -1, (0, -1, 0))}  # fmt: skip
"""Of each hinge: the axis of the front across which it lies, its end there, and its direction."""


@dataclass(frozen=True)
class Cell:
    """Opening between boards: its edges in Y and Z, metres, and which of them are outer edges of the body."""

    low: tuple[float, float]
    high: tuple[float, float]
    outer_low: tuple[bool, bool] = (True, True)
    outer_high: tuple[bool, bool] = (True, True)

    @property
    def sides(self) -> tuple[float, float]:
        """Width and height."""
        return self.high[0] - self.low[0], self.high[1] - self.low[1]

    def between(self, axis: int, first: float, last: float) -> Cell:
        """The part of the opening between two positions along ``axis`` (0: Y, 1: Z)."""

        def changed(pair: tuple[T, T], value: T) -> tuple[T, T]:
            return (value, pair[1]) if axis == 0 else (pair[0], value)

        outer_low = changed(self.outer_low, self.outer_low[axis] and first <= self.low[axis])
        outer_high = changed(self.outer_high, self.outer_high[axis] and last >= self.high[axis])
        return Cell(changed(self.low, first), changed(self.high, last), outer_low, outer_high)


@dataclass(frozen=True)
class Style:
    """What all fronts of one piece of furniture share; metres."""

    face: float  # x of the front edges of the boards
    back: float  # x of the front of the back board
    board: float
    thickness: float  # of doors and drawer fronts
    overlay: bool  # fronts lie before the boards rather than between them
    panel: str
    rail: float
    recess: float
    handle: str
    handle_length: float
    reach: float
    grip: float  # radius of the handles' bars
    travel: float  # of drawers, as a share of their depth
    lap: float  # how far overlaid fronts reach over the boards; they meet over a board that is narrower
    place: float  # where the handles of doors are, as a share of the doors' height
    level: bool  # handles of doors lie level rather than upright
    free_flaps: bool = False  # nothing stands out above or below the body: flaps there open beyond a right angle


def drawer(draws: Draws, cell: Cell, style: Style) -> tuple[Solid, list[Moving]]:
    """A drawer that slides out towards -X."""
    low, high = _front_box(cell, style)
    solid = panel(style.panel, low, high, style.rail, style.recess)
    depth = style.back - high[0] - 0.01
    wall, clear = 0.009, 0.005
    bottom = cell.low[1] + clear
    top = bottom + (cell.sides[1] - 2 * clear) * draws.number("drawer_side", (0.55, 0.9))
    solid += tray((high[0] - 0.001, cell.low[0] + clear, bottom), (high[0] + depth, cell.high[0] - clear, top), wall)
    middle = 0.5 * (low + high)
    rise = (high[2] - low[2]) * draws.pick("handle_rise", [0.0, 0.0, 0.25])
    half = 0.5 * min(style.handle_length, 0.75 * (high[1] - low[1]))
    solid += _handle(style, (low[0], middle[1], middle[2] + rise), 1, half, low, high)
    return Solid(), [("drawer", solid, prismatic("body", FRONT, 0.0, style.travel * depth, tuple(middle)))]


def door(draws: Draws, cell: Cell, style: Style, hinge: str) -> tuple[Solid, list[Moving]]:
    """One door, hinged at its "left", "right" (as one stands before it), "top" or "bottom"."""
    inside, trays = _interior(draws, cell, style)
    return inside, [_leaf(draws, cell, style, hinge, *_front_box(cell, style)), *trays]


def double_door(draws: Draws, cell: Cell, style: Style) -> tuple[Solid, list[Moving]]:
    """Two doors that meet in the middle."""
    inside, trays = _interior(draws, cell, style)
    low, high = _front_box(cell, style)
    middle = 0.5 * (low[1] + high[1])
    seed = draws.seed("leaf")
    leaves = []
    for hinge, first, last in (("left", middle + GAP, high[1]), ("right", low[1], middle - GAP)):
        edges = np.array([low[0], first, low[2]]), np.array([high[0], last, high[2]])
        leaves.append(_leaf(draws.fork("", seed), cell, style, hinge, *edges))
    return inside, [*leaves, *trays]


def sliding_doors(draws: Draws, cell: Cell, style: Style) -> tuple[Solid, list[Moving]]:
    """Two doors on two tracks, one behind the other."""
    thickness, clear = 0.016, 0.003
    width = 0.5 * cell.sides[0] + draws.length("sliding_overlap", (0.01, 0.03))
    travel = cell.sides[0] - 2 * clear - width
    left_first = 1 if draws.chance("left_in_front", 0.5) else -1
    leaves: list[Moving] = []
    for track, side in enumerate((left_first, -left_first)):
        x = style.face + clear + track * (thickness + clear)
        outer = cell.high[0] - clear if side > 0 else cell.low[0] + clear
        inner = outer - side * width
        low = np.array([x, min(outer, inner), cell.low[1] + clear])
        high = np.array([x + thickness, max(outer, inner), cell.high[1] - clear])
        solid = panel(style.panel, low, high, style.rail, min(style.recess, 0.006))
        grip = (x, outer - side * style.rail / 2, 0.5 * (low[2] + high[2]))
        if track == 0 and style.handle != "none":
            solid += _handle(style, grip, 2, min(0.5 * style.handle_length, 0.3 * (high[2] - low[2])), low, high)
        else:
            radius = min(0.4 * style.rail, 0.02)
            solid += union(cylinder(grip, np.add(grip, (depth, 0, 0)), radius) for depth in (-0.001, 0.003))
        leaves.append(("sliding_door", solid, prismatic("body", (0, -side, 0), 0.0, travel, tuple(0.5 * (low + high)))))
    return _shelves(draws, cell, style.face + (2 * (thickness + clear) + clear) + 0.015, style), leaves


def shelves(draws: Draws, cell: Cell, style: Style) -> tuple[Solid, list[Moving]]:
    """An open cell."""
    return _shelves(draws, cell, style.face + draws.length("shelf_setback", (0.0, 0.02)), style), []


def fixed(draws: Draws, cell: Cell, style: Style) -> tuple[Solid, list[Moving]]:
    """A front that does not move, as before a sink."""
    low, high = _front_box(cell, style)
    margin = np.array([0.0, 0.002, 0.002])
    joint = box(low + margin + (0.5 * style.thickness, 0, 0), high - margin + (2 * GAP, 0, 0))
    if not style.overlay:
        joint = box(low - 2 * margin + (0.4 * style.thickness, 0, 0), high + 2 * margin)
    return panel(style.panel, low, high, style.rail, style.recess) + joint, []


@deferred
def boards_across(cell: Cell, style: Style, axis: int, edges: Array) -> Solid:
    """Boards that divide a cell along ``axis`` (0: Y, 1: Z), their middles at ``edges``."""
    solid = Solid()
    for edge in edges:
        low, high = np.array([style.face, *cell.low]) - 0.001, np.array([style.back, *cell.high]) + 0.001
        low[0] = style.face
        low[1 + axis], high[1 + axis] = about(edge, style.board / 2)
        solid += box(low, high)
    return solid


def _interior(draws: Draws, cell: Cell, style: Style) -> tuple[Solid, list[Moving]]:
    """Behind a door: shelves, or trays that stay inside even when they are pulled out behind a closed door."""
    front = style.face + style.thickness + 0.02
    room = style.back - 0.008 - front
    width, height = cell.sides
    if not draws.chance("inner_trays", 0.22) or width < 0.25 or room < 0.25:
        return _shelves(draws, cell, front, style), []
    count = draws.integer("trays", 1, min(3, int(height // 0.16) + 1))
    pitch = height / count
    share, wall = draws.number("tray_depth", (0.5, 0.65)), draws.number("tray_height", (0.25, 0.7)) * pitch
    trays: list[Moving] = []
    for number in range(count):
        z = cell.low[1] + number * pitch + 0.006
        low = (style.back - 0.008 - share * room, cell.low[0] + 0.006, z)
        solid = tray(low, (style.back - 0.008, cell.high[0] - 0.006, z + min(wall, 0.2)), 0.01)
        trays.append(("drawer", solid, prismatic("body", FRONT, 0.0, 0.95 * (1 - share) * room, low)))
    return Solid(), trays


def _shelves(draws: Draws, cell: Cell, front: float, style: Style) -> Solid:
    width, height = cell.sides
    count = draws.integer("shelves", 0, int(height // 0.2)) if height > 0.2 else 0
    solid, half = Solid(), min(style.board, 0.018) / 2
    deep = (front, style.back + 0.001)
    for z in np.linspace(cell.low[1], cell.high[1], count + 2)[1:-1]:
        solid += box(deep, (cell.low[0] - 0.001, cell.high[0] + 0.001), about(z, half))
    if count == 0 and width > 0.8 and draws.chance("partition", 0.5):
        y = 0.5 * (cell.low[0] + cell.high[0])
        solid += box(deep, about(y, half), (cell.low[1] - 0.001, cell.high[1] + 0.001))
    return solid


def _front_box(cell: Cell, style: Style) -> tuple[Array, Array]:
    """Corners of a cell's front: before the boards, up to their middle, or between them."""
    if not style.overlay:
        margin = GAP + 0.001
        low, high = np.array([style.face, *cell.low]), np.array([style.face + style.thickness, *cell.high])
        return low + (0, margin, margin), high - (0, margin, margin)
    grow_low, grow_high = (
        [min(style.lap, style.board - 0.0025 if outer else style.board / 2 - GAP) for outer in edges]
        for edges in (cell.outer_low, cell.outer_high)
    )
    x = style.face - GAP
    return (
        np.array([x - style.thickness, cell.low[0] - grow_low[0], cell.low[1] - grow_low[1]]),
        np.array([x, cell.high[0] + grow_high[0], cell.high[1] + grow_high[1]]),
    )


def _leaf(draws: Draws, cell: Cell, style: Style, hinge: str, low: Array, high: Array) -> Moving:
    """A hinged panel with its handle near the edge that opens."""
    across, end, axis = HINGES[hinge]
    along = 3 - across
    edge = high[across] if end > 0 else low[across]
    width, length = high[across] - low[across], high[along] - low[along]
    solid = panel(style.panel, low, high, style.rail, style.recess)

    run = across if style.level and across == 1 else along  # the axis along which the handle lies
    half = 0.5 * min(style.handle_length, 0.6 * (width if run == across else length))
    grip = np.array([low[0], 0.0, 0.0])
    aside = max(style.rail / 2, 0.02) + (half if run == across else 0.0)
    grip[across] = edge - end * (width - aside)
    margin = 0.03 + (half if run == along else 0.0)
    place = style.place if across == 1 else 0.5
    grip[along] = np.clip(low[along] + place * length, low[along] + margin, high[along] - margin)
    handle = _handle(style, grip, run, half, low, high)
    outer = (cell.outer_high if end > 0 else cell.outer_low)[across - 1] and (across == 1 or style.free_flaps)
    bounds = handle.bounds() if handle.pieces else np.array([grip, grip])
    near = edge - bounds[1, across] if end > 0 else bounds[0, across] - edge
    limit, most = swing_limits(near, low[0] - bounds[0, 0])
    if outer:
        angles = [95.0, 110.0, 135.0, 170.0] if across == 1 else [95.0, 105.0, 115.0]
        limit = min(most, np.deg2rad(draws.pick("door_angle", angles)))
    origin = 0.5 * (low + high)
    origin[across], origin[0] = edge, low[0] - 0.0005
    return "door", solid + handle, revolute("body", axis, tuple(origin), 0.0, float(limit))


@deferred
def _handle(style: Style, foot: Vector, along: int, half: float, low: Array, high: Array) -> Solid:
    """The style's handle on a front, centred on ``foot``, along axis 1 or 2 (Y or Z), ``2 * half`` long."""
    center = np.asarray(foot, dtype=np.float64)
    framed = style.panel in ("shaker", "planks") and (high[1:] - low[1:]).min() >= 3.2 * style.rail
    margin = np.minimum(center - low, high - center)[1:].min()
    if framed and margin > style.rail:  # it stands on the sunken board
        center = center + (style.recess, 0, 0)
    ahead = np.zeros(3)
    ahead[along] = half
    radius = min(style.grip, 0.45 * margin)
    reach = style.reach + (style.recess if framed else 0.0)
    if style.handle in ("bar", "bow"):
        return front_handle(style.handle, center - ahead, center + ahead, reach, radius)
    if style.handle == "knob":
        return knob(center, FRONT, reach, min(2.4 * style.grip, 0.8 * margin))
    if style.handle == "block":
        wide = np.full(3, radius)
        wide[along] = half
        wide[0] = 0.5 * reach
        middle = center - (0.5 * reach - 0.002, 0, 0)
        return box(middle - wide, middle + wide, fillet=0.3 * radius, axis=along).called("handle", FRONT)
    if style.handle == "cup":
        ends = [center + s * 0.8 * ahead for s in (-1, 1)]
        thick = np.array([0.0, 0.0, 0.004]) if along == 1 else np.array([0.0, 0.004, 0.0])
        lip = [box(e - (0.6 * reach, 0, 0) - thick - 0.001, e + (0.002, 0, 0) + thick + 0.001) for e in ends]
        return hull_of(*lip).called("handle", FRONT)
    return Solid()
