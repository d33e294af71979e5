"""Safes: a box with thick walls, a heavy door, and a lock on the door.

What varies: proportions from a hotel's safe to a gun cabinet; door within the walls or over them, hinge on the left or
right, inside or on barrels outside; dial, keypad or keyhole; lever, wheel with spokes or pull handle; bolts, shelves,
feet, round edges.
"""

import numpy as np

from artsim.common.elementary import cos, hypot, sin
from artsim.families.details import front_handle, rounded_shell, side_hinge
from artsim.making.assembly import Assembly, continuous, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, Array, about, turns
from artsim.making.solids import Solid, box, ellipsoid, posts, ring, rod, tube, union

GAP = 0.0015


class Shape:
    """Measures of one safe in metres. The front of its walls is the plane x = 0; the hinge is at +Y."""

    def __init__(self, draws: Draws, kind: str) -> None:
        widths = {"small": (0.3, 0.45), "cube": (0.35, 0.6), "tall": (0.45, 0.75)}
        heights = {"small": (0.55, 0.85), "cube": (0.9, 1.35), "tall": (1.5, 2.2)}  # over the width
        self.half = 0.5 * draws.length("width", widths[kind])
        height = 2 * self.half * draws.number("height", heights[kind])
        self.inset = draws.chance("door_inset", 0.65)  # whether the door lies within the walls
        self.wall = self.half * draws.number("wall", (0.08, 0.26))
        self.low = draws.length("foot_height", (0.008, 0.06)) if draws.chance("feet", 0.65) else 0.0
        self.high = self.low + height
        self.depth = self.half * draws.number("depth", (1.4, 2.3), (1.4, 3.0), tails=0.15)
        widest = None if self.inset else (0.06, 1.2)  # a few doors before the walls hold the lock's works, or a chest
        self.thick = self.half * draws.number("door_thickness", (0.06, 0.3), widest, tails=0.3)
        self.barrel = 0.0  # radius of the barrels on the hinge axis; 0 for a hidden hinge
        if self.inset and draws.chance("barrels", 0.6):
            self.barrel = float(np.clip(0.3 * self.wall, 0.006, 0.014))

    @property
    def door(self) -> tuple[Array, Array]:
        """Low and high corner of the door."""
        if not self.inset:
            return np.array([-GAP - self.thick, -self.half, self.low]), np.array([-GAP, self.half, self.high])
        reach = 2.0 * (self.half - self.wall)
        swing = self.thick * self.thick / (2.0 * reach) + 2 * GAP  # the inner edge swings past the wall
        y, z = self.half - self.wall, self.wall + GAP
        return np.array([0.0, swing - y, self.low + z]), np.array([self.thick, y - GAP, self.high - z])

    @property
    def hinge(self) -> tuple[float, float]:
        """x and y of the axis."""
        return (-self.barrel, self.half - self.wall) if self.inset else (-GAP, self.half)


def build(draws: Draws) -> Assembly:
    """A safe, closed at rest."""
    kind = draws.pick("kind", {"small": 0.35, "cube": 0.35, "tall": 0.3})
    shape = Shape(draws, kind)
    left = draws.chance("hinge_left", 0.35)
    sign = 1.0 if left else -1.0

    def placed(solid: Solid) -> Solid:
        return solid if left else solid.mirrored(1)

    safe = Assembly("body", placed(_body(draws, shape)), 2500.0)
    safe.record(handles=True)
    x, y = shape.hinge
    # Right back, a door within the walls on a hidden hinge would press its raised board on them.
    free = not shape.inset or shape.barrel > 0
    right_back = free and draws.chance("opens_right_back", 0.15)
    upper = np.pi if right_back else draws.turn("door_angle", (100.0, 176.0))
    face = shape.door[0][0]
    front = face - 0.0045  # clear of a raised board
    opener = draws.pick("opener", {"lever": 0.45, "wheel": 0.3, "pull": 0.25})
    combination = draws.chance("combination", 0.6)
    safe.add("door", placed(_door(draws, shape, combination, opener)), side_hinge(x, sign * y, upper, left))

    low, high = shape.door
    size = min(high[1] - low[1], high[2] - low[2])
    along = low[1] + (0.5 if kind == "tall" or draws.chance("lock_centred", 0.4) else 0.35) * (high[1] - low[1])
    upright = high[2] - low[2] > 0.85 * (high[1] - low[1])
    # The lock above the handle, or beside it on a low door.
    if upright:
        (lock_y, lock_z), (grip_y, grip_z) = ((along, low[2] + s * (high[2] - low[2])) for s in (0.66, 0.4))
    else:
        level = 0.5 * (low[2] + high[2])
        (lock_y, lock_z), (grip_y, grip_z) = ((low[1] + s * (high[1] - low[1]), level) for s in (0.66, 0.33))
    apart = float(hypot(lock_y - grip_y, lock_z - grip_z))
    if combination:
        radius = min(0.13 * size, 0.055, 0.3 * apart)
        foot_at = (face, sign * lock_y, lock_z)
        solid = _combination(draws, front, lock_y, lock_z, radius)
        safe.add("dial", placed(solid), continuous("door", (-1, 0, 0), foot_at), density=3000.0)
    if opener != "pull":
        foot_at = (face, sign * grip_y, grip_z)
        radius = min(draws.number("opener_radius", (0.13, 0.22)) * size, 0.11, 0.5 * apart)
        if opener == "wheel":
            solid = _wheel(draws, front, grip_y, grip_z, radius)
            joint = continuous("door", (-1, 0, 0), foot_at)
        else:
            solid = _lever(draws, front, grip_y, grip_z, radius)
            joint = revolute("door", (sign, 0, 0), foot_at, 0.0, draws.turn("handle_angle", (45.0, 95.0)))
        safe.add("wheel" if opener == "wheel" else "handle", placed(solid), joint, density=3000.0)
    return safe


def _body(draws: Draws, s: Shape) -> Solid:
    corner = draws.one_of("corners", {"sharp": 0.004, "round": draws.length("corner_radius", (0.01, 0.05))})
    corner = min(corner, 0.9 * s.wall)
    solid = rounded_shell((0.0, -s.half, s.low), (s.depth, s.half, s.high), s.wall, corner, 3)
    solid += box((s.depth - s.wall, s.depth), s.half - 0.002, (s.low + 0.002, s.high - 0.002), fillet=corner, axis=0)
    inside = s.half - s.wall + 0.002
    if draws.chance("shelf", 0.6):
        front = (s.thick if s.inset else 0.0) + 0.06
        tall = s.high - s.low
        for z in np.linspace(s.low + s.wall, s.high - s.wall, int(2 + tall // 0.35 + (tall > 0.3)))[1:-1]:
            solid += box((front, s.depth - s.wall + 0.002), inside, (z, z + 0.005))
    if s.low > 0:
        along, across, upright = (0.16 * s.half, s.depth - 0.16 * s.half), 0.82 * s.half, (0, s.low + 0.004)
        radius = 0.1 * s.half
        if draws.chance("round_feet", 0.5):
            solid += posts(along, across, upright, radius, sections=16)
        else:
            solid += union(box(about(x, radius), about(y, radius), upright) for x in along for y in (-across, across))
    if s.barrel > 0:
        x, y = s.hinge
        for low, high in _knuckles(s, of_door=False):
            solid += rod(x, y, (low, high), s.barrel - 0.0005, sections=16)
            solid += box((x, 0.002), (y, y + 0.6 * s.wall), (low, high))
    return solid


def _knuckles(s: Shape, of_door: bool) -> list[tuple[float, float]]:
    """Lowest and highest point of the barrels: two pairs, the door's standing on the body's."""
    low, high = s.door[0][2], s.door[1][2]
    length = 0.05 * (high - low) + 0.01
    levels = (low + share * (high - low) for share in (0.15, 0.75))
    return [(z + GAP, z + length) if of_door else (z - length, z) for z in levels]


def _door(draws: Draws, s: Shape, combination: bool, opener: str) -> Solid:
    low, high = s.door
    wide, tall = high[1] - low[1], high[2] - low[2]
    if s.inset:
        solid = box(low, high, fillet=0.003, axis=0)
    else:
        solid = box(low, high, fillet=min(0.4 * s.thick, 0.012))
        # The plug that fills the opening; its inner edge swings past the wall.
        plug, inner = draws.length("plug", (0.01, 0.03)), s.half - s.wall
        swing = plug * plug / (4.0 * inner) + 0.004
        upright = (low[2] + s.wall + 0.004, high[2] - s.wall - 0.004)
        solid += box((high[0] - 0.002, plug), (swing - inner, inner - 0.004), upright)
    if draws.chance("raised_board", 0.5):  # the hinge side stays free for the barrels
        edge = 0.1 * min(wide, tall)
        solid += box(low + (-0.003, edge, edge), (low[0] + 0.004, *(high[1:] - edge)), fillet=0.0015)
    if s.barrel > 0:
        x, y = s.hinge
        for bottom, top in _knuckles(s, of_door=True):
            solid += rod(x, y, (bottom, top), s.barrel - 0.0005, sections=16)
            solid += box((x, 0.003), (y - 0.14 * wide, y), (bottom, top))
    if not combination:  # a keypad with its keys
        y, z, unit = low[1] + 0.66 * wide, low[2] + 0.66 * tall if tall > 0.85 * wide else low[2] + 0.5 * tall, 0.014
        keypad = box((low[0] - 0.008, low[0] + 0.003), about(y, 2.3 * unit), about(z, 3 * unit), fillet=0.004)
        solid += keypad.called("panel", FRONT)
        for row in range(4):
            for column in (-1, 0, 1):
                center = np.array([low[0] - 0.008, y + column * 1.4 * unit, z + (row - 1.9) * 1.3 * unit])
                key = box(center - (0.002, 0.5 * unit, 0.45 * unit), center + (0.002, 0.5 * unit, 0.45 * unit))
                solid += key.called("button", FRONT)
    if opener == "pull":
        y, z = low[1] + 0.16 * wide, 0.5 * (low[2] + high[2])
        start, end = (low[0], y, z - 0.18 * tall), (low[0], y, z + 0.18 * tall)
        solid += front_handle(draws.pick("handle", ["bar", "bow", "flat"]), start, end, 0.035, 0.007)
    return solid


def _combination(draws: Draws, x: float, y: float, z: float, radius: float) -> Solid:
    """Combination dial: a skirt, a grip and the mark it is read at."""
    skirt, reach = draws.lengths(dial_skirt=(0.006, 0.012), dial_reach=(0.02, 0.03))
    solid = rod((x, x - skirt), y, z, radius, 0.85 * radius, 28)
    solid += rod((x - 0.5 * skirt, x - skirt - reach), y, z, 0.55 * radius, 0.45 * radius, 16)
    mark = (y - 0.03 * radius - 0.001, y + 0.03 * radius + 0.001)
    return solid + box((x - skirt - 0.002, x - 0.001), mark, (z + 0.5 * radius, z + 0.9 * radius))


def _wheel(draws: Draws, x: float, y: float, z: float, radius: float) -> Solid:
    """Hub with three to five spokes that end in balls or in a rim."""
    reach, spokes = draws.length("wheel_reach", (0.03, 0.05)), draws.integer("spokes", 3, 5)
    solid = rod((x, x - reach), y, z, 0.3 * radius, 0.22 * radius, 18)
    rim = draws.chance("rim", 0.4)
    hub = np.array([x - 0.8 * reach, y, z])
    for a in turns(spokes, 0.25):
        end = hub + radius * np.array([0.0, cos(a), sin(a)])
        solid += tube(np.stack([hub, end]), 0.006, 10)
        solid += Solid() if rim else ellipsoid(end, 0.011, 12)
    if rim:
        solid += ring((x - 0.8 * reach, y, z), (1, 0, 0), 0.9 * radius, 1.05 * radius, 0.012, 24)
    return solid


def _lever(draws: Draws, x: float, y: float, z: float, radius: float) -> Solid:
    """Lever on a round boss, level at rest."""
    reach = draws.length("handle_reach", (0.025, 0.04))
    solid = rod((x, x - 0.008), y, z, 0.35 * radius, 0.3 * radius, 18)
    solid += rod((x - 0.004, x - reach), y, z, 0.16 * radius + 0.003, sections=14)
    tip = np.array([x - reach, y - 1.1 * radius, z])
    if draws.chance("round_handle", 0.5):
        return solid + tube(np.stack([tip + (0.004, 1.1 * radius, 0.0), tip]), [0.010, 0.007], 12)
    return solid + box(tip - (0.0, 0.0, 0.011), (x - reach + 0.012, y + 0.012, z + 0.011), fillet=0.005)
