"""Computer mice that lie on a table, their buttons towards -X.

What varies: the dome's outline and sides; buttons, a wheel, keys on the side and on top, a ball; the roll; a cable.
"""

from dataclasses import replace

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.common.products import apply
from artsim.families.details import holed_plate
from artsim.families.keys import add_key, pill, side_face, top_face
from artsim.making.assembly import Assembly, JointSpec, continuous, revolute
from artsim.making.draws import Draws, Interval
from artsim.making.solids import Solid, cylinder, deferred, ellipsoid, hull, loft, rod, tube, union
from artsim.model.kinematics import Array
from artsim.model.transforms import rotation_about

GAP = 0.0007
TRAVEL = 0.0007
"""Of keys, metres."""


class _Dome:
    """The outer shape: height, half width and lateral shift at stations along X, front first."""

    def __init__(self, draws: Draws) -> None:
        length = draws.length("depth", (0.07, 0.14))
        half = 0.5 * draws.triangular("width", 0.4, 0.58, 0.85, of=length, unit="m")
        height = draws.triangular("height", 0.13, 0.32, 0.5, of=length, unit="m")
        share = np.array([0.0, 0.03, 0.1, 0.22, 0.38, 0.55, 0.72, 0.86, 0.95, 1.0])
        top = draws.number("hump_place", (0.35, 0.8))
        front, back = draws.number("front_height", (0.3, 0.85)), draws.number("back_height", (0.15, 0.8))
        before, behind = np.maximum(top - share, 0.0) / top, np.maximum(share - top, 0.0) / (1.0 - top)
        profile = 1.0 - (1.0 - front) * np.square(before) - (1.0 - back) * np.square(behind) * np.sqrt(behind)
        ends = draws.number("front_taper", (0.1, 0.75)), draws.number("back_taper", (0.1, 0.75))
        near, far = np.maximum(1.0 - share / 0.35, 0.0), np.maximum((share - 0.6) / 0.4, 0.0)
        widths = 1.0 - ends[0] * np.square(near) - ends[1] * np.square(far)
        narrow = draws.number("waist", (0.0, 0.2)) * draws.pick("waisted", [False, True])
        waist = narrow * np.maximum(1.0 - np.square((share - 0.42) / 0.3), 0.0)
        slant = draws.number("slant", (-0.25, 0.25)) * draws.pick("slanted", [False, True]) * half
        self.stations = length * (share - 0.5)
        self.front, self.back = float(self.stations[0]), float(self.stations[-1])
        self.heights, self.halves = height * profile, half * (widths - waist)
        self.shifts = slant * np.maximum(1.0 - np.square((share - 0.5) / 0.5), 0.0)
        self.steep = draws.number("steepness", (0.0, 1.0))  # 0 for a round cross-section, 1 for one with upright sides
        self.shoulder = draws.number("shoulder", (0.15, 0.55))  # share of the height up to which sides are upright

    def at(self, x: float) -> tuple[float, float, float]:
        """Height, half width and shift at x."""
        rows = (self.heights, self.halves, self.shifts)
        return tuple(float(np.interp(x, self.stations, row)) for row in rows)  # type: ignore[return-value]

    def cut(self, x: float, y: Interval = (-1, 1), low: float = 0.0, share: float = 1.0, drop: float = 0.0) -> Array:
        """(N, 3) cross-section at x, clamped to a range of y and, in shares of the height there, of z.

        Its upper end is ``drop`` metres lower than that.
        """
        height, half, shift = self.at(x)
        angles = np.linspace(0.0, np.pi, 9)
        c, s = cos(angles), sin(angles)
        across = (1.0 - self.steep) * c + self.steep * np.sign(c) * np.sqrt(np.abs(c))
        rise = (1.0 - self.steep) * s + self.steep * np.sqrt(np.maximum(s, 0.0))
        rise = self.shoulder + (1.0 - self.shoulder) * rise
        plane = np.column_stack([shift + half * across, height * rise])
        foot = 0.94 * half
        plane = np.concatenate([plane, [(shift - half, 0.12 * height), (shift - foot, 0.0), (shift + foot, 0.0),
                                        (shift + half, 0.12 * height)]])  # fmt: skip
        plane[:, 0] = np.clip(plane[:, 0], *y)
        plane[:, 1] = np.clip(plane[:, 1], low * height, share * height - drop)
        return np.column_stack([np.full(len(plane), x), plane])

    @deferred
    def between(self, first: float, last: float, *clamp: object, **more: object) -> Solid:
        """The part of the dome between two x; see :meth:`cut` for the rest."""
        inside = self.stations[(self.stations > first + 1e-5) & (self.stations < last - 1e-5)]
        return loft([self.cut(x, *clamp, **more) for x in (first, *inside, last)])  # type: ignore[arg-type]


def build(draws: Draws) -> Assembly:
    """A mouse; no button is pressed at rest."""
    dome = _Dome(draws)
    turn = None
    if draws.chance("upright", 0.14, upper=True):  # rolled onto its side
        way = draws.pick("upright_hand", {"right": 0.85, "left": 0.15})
        turn = rotation_about((1.0, 0.0, 0.0), {"right": -1.0, "left": 1.0}[way] * draws.angle("roll", (0.25, 0.85)))
    mouse = _Mouse(turn)
    _shell(draws, mouse, dome)
    if turn is not None:
        # An upright mouse stands on what is between its own bottom and the table.
        bottom = np.concatenate([ring[ring[:, 2] <= 0.0] for ring in map(dome.cut, dome.stations)])
        edge = np.stack([apply(turn, point) for point in bottom])
        floor = float(edge[:, 2].min()) - draws.length("foot_height", (0.001, 0.006))
        middle = edge.mean(axis=0)
        shadow = middle + (edge - middle) * (1.0, draws.number("foot_width", (1.0, 1.4)), 0.0)
        shadow[:, 2] = floor
        mouse.body += hull(np.concatenate([edge, shadow]))
    return mouse


class _Mouse(Assembly):
    """An assembly whose parts are rolled about X as they are added; all are of one plastic."""

    def __init__(self, turn: Array | None) -> None:
        super().__init__(density=900.0)
        self.turn = turn

    def add(
        self, name: str, solid: Solid, joint: JointSpec | None = None, label: str | None = None,
        density: float | None = None,
    ) -> str:  # fmt: skip
        """Add a part as it stands before the roll."""
        if self.turn is not None:
            solid = solid.rotated(self.turn)
            if joint is not None:
                axis, origin = (apply(self.turn, np.asarray(v, dtype=np.float64)) for v in (joint.axis, joint.origin))
                joint = replace(joint, axis=axis, origin=origin)
        return super().add(name, solid, joint, label)


def _shell(draws: Draws, mouse: _Mouse, dome: _Dome) -> None:
    """Body, buttons and what sits between them."""
    front, length = dome.front, dome.back - dome.front
    split = front + draws.number("button_length", (0.33, 0.62)) * length
    floor, count = draws.number("button_bottom", (0.3, 0.55)), draws.pick("buttons", {1: 0.15, 2: 0.65, 3: 0.2})
    height = dome.at(split)[0]
    # The gap below the buttons, in shares of the height, leaves room for their travel.
    room = (0.0022 + GAP) / float(dome.heights[dome.stations <= split].min())
    floor = min(floor, 0.8 - room)
    half = float(dome.halves[3])
    slot = draws.length("slot_width", (0.003, 0.007))
    slot = {1: 0.0, 2: min(slot, 0.3 * half), 3: 0.33 * half}[count]
    drift = float(np.interp(0.5 * (front + split), dome.stations, dome.shifts))
    ball = _well(draws, dome, split) if draws.chance("ball", 0.16) else None
    body = _rear(dome, split, ball) + dome.between(front, split + 0.0002, (-1.0, 1.0), 0.0, floor)
    turns = count == 2 and draws.chance("wheel", 0.9)
    angle = 0.002 / (split - front)
    hinge_z = (floor + room) * height
    edge = split - GAP
    between = (drift - slot + GAP, drift + slot - GAP)
    spans = {"button_left": (drift + slot, 1.0), "button_right": (-1.0, drift - slot), "button_middle": between}
    if count == 1:
        spans = {"button": (-1.0, 1.0)}
    wheel = _wheel(draws, dome, drift, slot, split, floor) if turns else None
    if count == 2:
        gaps = [(front + 0.06 * length, split + 0.0002)]
        if wheel is not None:
            x, _, radius, _ = wheel
            gaps = [(gaps[0][0], x - radius - 0.001), (x + radius + 0.001, gaps[0][1])]
        body += union(dome.between(a, b, between, 0.0, 0.98, 0.0004) for a, b in gaps if b > a + 0.002)
    body += _underside(draws, dome)
    mouse.add("body", body)
    for name, span in list(spans.items())[:count]:
        solid = dome.between(front, edge, span, floor + room)
        mouse.add(name, solid, revolute("body", (0, -1, 0), (edge, 0, hinge_z), 0.0, angle))
    if wheel is not None:
        x, z, radius, wide = wheel
        solid = rod(x, (drift - wide, drift + wide), z, radius, sections=20)
        if draws.chance("wheel_ribs", 0.6):
            for a in np.arange(10) * 0.2 * np.pi:
                at, side = np.array([x + 0.97 * radius * cos(a), drift, z + 0.97 * radius * sin(a)]), (0, 0.9 * wide, 0)
                solid += cylinder(at - side, at + side, 0.09 * radius, sections=5)
        mouse.add("wheel", solid, continuous("body", (0, 1, 0), (x, drift, z)))
    if ball is not None:
        mouse.add("ball", ellipsoid(*ball, 20), continuous("body", (0, 1, 0), tuple(ball[0])))
    if draws.chance("side_key", 0.4):
        _side_keys(draws, mouse, dome, split)
    start = split + 0.04 * length  # of keys on top, where that is free
    if ball is None and start + 0.25 * length <= dome.back and draws.chance("key", 0.35, upper=True):
        wide = min(draws.length("key_width", (0.004, 0.009)), 0.4 * float(dome.halves.max()))
        top = float(max(dome.at(x)[0] for x in np.linspace(start, start + 0.16 * length, 7)))
        for k in range(draws.integer("keys", 1, 2)):
            face = top_face(top, start + (0.04 + 0.075 * k) * length, dome.at(start)[2])
            add_key(mouse, "body", f"key_{k}", face, (0.0, 0.0), pill(wide, 0.055 * length), TRAVEL + 0.0016, TRAVEL)


def _wheel(
    draws: Draws, dome: _Dome, y: float, slot: float, split: float, floor: float
) -> tuple[float, float, float, float] | None:
    """X and Z of the axle, radius and half of the width of a wheel between the buttons."""
    front = dome.front
    x = front + draws.number("wheel_place", (0.35, 0.7)) * (split - front)
    height = dome.at(x)[0]
    proud = draws.length("wheel_height", (0.0015, 0.005))
    # It must keep clear of the floor under it, which rises to the back.
    radius = 0.5 * (height + proud - floor * dome.at(min(x + 0.012, split))[0] - 0.0016)
    radius = min(radius, draws.length("wheel_radius", (0.007, 0.014)), 0.42 * (split - front))
    wide = slot - GAP
    if radius < 0.003 or wide < 0.001:
        return None
    return x, height + proud - radius, radius, wide


def _underside(draws: Draws, dome: _Dome) -> Solid:
    """Glides below and a cable in front, on some."""
    front = dome.front
    solid = Solid()
    if draws.chance("glides", 0.5):
        for x in (0.7 * front, 0.7 * dome.back):
            _, half, shift = dome.at(x)
            spots = [(x + a * 0.006, shift + b * (0.6 * half)) for a in (-1, 1) for b in (-1, 1)]
            solid += hull([(*spot, z) for spot in spots for z in (-0.0008, 0.001)])
    if draws.chance("cable", 0.45):
        height, _, shift = dome.at(front)
        z, radius = 0.14 * height + 0.001, min(draws.length("cable_radius", (0.0012, 0.0025)), 0.12 * height)
        reach = draws.length("cable_length", (0.008, 0.05))
        end = (front - reach, shift + draws.number("cable_bend", (-0.3, 0.3)) * reach, z)
        path = [(front + 0.004, shift, z), (front - 0.4 * reach, shift, z), end]
        solid += tube(np.array(path), [1.6 * radius, radius, radius], 8)
    return solid


def _side_keys(draws: Draws, mouse: _Mouse, dome: _Dome, split: float) -> None:
    """Keys for the thumb, on the left (+Y)."""
    count = draws.integer("side_keys", 1, 3)
    span = (split + 0.002, split + 0.55 * (dome.back - split))
    pitch = (span[1] - span[0]) / count
    rows = np.array([dome.at(x) for x in np.linspace(*span, 9)])
    side = float((rows[:, 1] + rows[:, 2]).max())
    low, high = 0.16 * float(rows[:, 0].min()), dome.shoulder * float(rows[:, 0].min())
    if high - low < 0.003:
        return
    for k in range(count):
        face = side_face(1.0, span[0] + (k + 0.5) * pitch, side, 0.5 * (low + high))
        outline = pill(0.85 * pitch, 0.9 * (high - low))
        add_key(mouse, "body", f"side_key_{k}", face, (0.0, 0.0), outline, TRAVEL + 0.0018, TRAVEL, 0.15)


def _well(draws: Draws, dome: _Dome, split: float) -> tuple[Array, float] | None:
    """Centre (3,) and radius of a ball that is sunk into the back, where there is room for one."""
    back = dome.back
    x = split + draws.number("ball_place", (0.4, 0.6)) * (back - split)
    height, _, shift = dome.at(x)
    near = np.array([dome.at(x + d) for d in np.linspace(-0.012, 0.012, 5)])
    # The ball stands out by 0.6 radii, and its lower end keeps clear of a floor at 0.2 of the height.
    radius = min((height - 0.2 * float(near[:, 0].max()) - GAP) / 1.4, 0.75 * float(near[:, 1].min()) - 0.003,
                 0.4 * (back - split), draws.length("ball_radius", (0.008, 0.02)))  # fmt: skip
    if radius < 0.006:
        return None
    return np.array([x, shift, height - 0.4 * radius]), radius


def _rear(dome: _Dome, split: float, ball: tuple[Array, float] | None) -> Solid:
    """The body behind the buttons, with a well for a ball."""
    if ball is None:
        return dome.between(split, dome.back)
    (x, y, _), radius = ball
    room = radius + GAP
    solid = dome.between(split, x - room) + dome.between(x + room, dome.back)
    first, last = x - room - 1e-4, x + room + 1e-4
    solid += dome.between(first, last, (-1.0, 1.0), 0.0, 0.2)
    solid += dome.between(first, last, (y + room, 1.0)) + dome.between(first, last, (-1.0, y - room))
    rim = (room + 0.0005, room + 0.0005, 0.0008)
    return solid + holed_plate(ball[0] - rim, ball[0] + rim, (x, y), room, axis=2, sections=16)
