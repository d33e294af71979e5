"""Kettles and teapots: for a stove, electric, for tea.

What varies: the outline from the side (cone, drum, belly, ball, squat) and from above, the spout (beak, straight,
gooseneck), the lid, which lifts off, turns, screws or swings about a hinge, its knob, the handle (a bow over the lid
that swings down or that stands fast, or a grip at the back), a cover of the spout, a switch or a button, and the stand
below, on which electric kettles turn or from which they lift. One to three parts move.
"""

import numpy as np

from artsim.common.elementary import cos
from artsim.common.products import unit
from artsim.families.details import cheeks
from artsim.families.vessels import Level, cross_section, dome, grip_loop, moulded
from artsim.making.assembly import Assembly, JointSpec, Rng, continuous, pick, prismatic, revolute, screw
from artsim.making.outlines import UP, arch
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull, hull_of, ring, rod, tube
from artsim.model.kinematics import Array

GAP = 0.0015
DENSITY = 500.0  # kg/m^3, as the pieces are solid and real ones are hollow


class Pot:
    """Levels of the body, radius of the opening, heights of foot and top; metres."""

    def __init__(self, rng: Rng, kind: str, foot: float) -> None:
        wide = rng.uniform(0.065, 0.12) if kind == "stove" else rng.uniform(0.055, 0.095)
        share = {"stove": (0.8, 1.7), "electric": (1.7, 3.2), "teapot": (0.9, 1.9)}[kind]
        height = wide * rng.uniform(*share)
        shapes = {"stove": ["cone", "drum", "belly", "squat"], "electric": ["cone", "drum", "hourglass", "belly"],
                  "teapot": ["belly", "ball", "squat", "drum", "pear"]}  # fmt: skip
        shape = pick(rng, shapes[kind])
        mouth = rng.uniform(0.45, 0.75)
        if kind == "electric":
            mouth = rng.uniform(0.65, 0.9)
        low = rng.uniform(0.8, 0.97)
        # Height over the whole, and radius over the widest; the last is the mouth.
        profile = {
            "cone": [(0.0, 0.97), (0.05, 1.0), (0.75, 0.5 + 0.5 * mouth), (1.0, mouth)],
            "drum": [(0.0, low), (0.06, 1.0), (0.8, 1.0), (0.93, 0.5 + 0.5 * mouth), (1.0, mouth)],
            "belly": [(0.0, 0.75 * low), (0.15, 0.93), (0.4, 1.0), (0.65, 0.95), (0.85, 0.5 + 0.45 * mouth),
                      (1.0, mouth)],
            "ball": [(0.0, 0.5), (0.12, 0.76), (0.3, 0.94), (0.5, 1.0), (0.7, 0.94), (0.88, max(0.74, mouth)),
                     (1.0, min(mouth, 0.6))],
            "squat": [(0.0, low), (0.1, 0.97), (0.3, 1.0), (0.55, 0.94), (0.8, 0.5 + 0.4 * mouth), (1.0, mouth)],
            "hourglass": [(0.0, 1.0), (0.3, 0.86), (0.6, 0.82), (1.0, min(0.9, mouth + 0.05))],
            "pear": [(0.0, 0.8), (0.2, 1.0), (0.4, 0.98), (0.7, 0.72), (0.9, 0.6), (1.0, 0.62)],
        }[shape]  # fmt: skip
        self.levels: list[Level] = [
            (foot + z * height, r * wide, r * wide, 1.0 if z == 1.0 else 0.0) for z, r in profile
        ]
        self.mouth, self.foot, self.top = profile[-1][1] * wide, foot, foot + height

    def radius(self, z: float) -> float:
        """Half depth at a height."""
        return float(np.interp(z, [level[0] for level in self.levels], [level[1] for level in self.levels]))


def build(rng: Rng) -> Assembly:
    """A kettle with its lid on at rest; it pours towards -X."""
    kind = pick(rng, {"stove": 0.38, "electric": 0.37, "teapot": 0.25})
    standing = kind == "electric" and rng.random() < 0.6  # on a base of its own
    pot = Pot(rng, kind, 0.022 if standing else 0.0)
    outline = cross_section(pick(rng, ["round", "round", "round", "octagon", "square"]), rng.uniform(0.0, 0.4))
    body = moulded(pot.levels, outline)
    spout, mouth = _spout(rng, kind, pot)
    body += spout
    bow = kind != "electric" and rng.random() < (0.75 if kind == "stove" else 0.25)
    swinging = bow and rng.random() < 0.6
    over = np.inf
    room = pot.top + pot.mouth * rng.uniform(1.1, 1.6)  # below the bow
    lid_joint = pick(rng, {"lift": 0.45, "hinge": 0.3, "turn": 0.1, "screw": 0.15})
    if kind == "electric" and rng.random() < 0.6:
        lid_joint = "hinge"
    if bow and lid_joint == "hinge":
        lid_joint = "lift"
    if bow and not swinging:
        arch, over = _bow(rng, pot, room)
        body += arch
    if not bow:
        body += _back_grip(rng, pot, lid_joint == "hinge", kind)
    lid, knob_top = _lid(rng, pot, lid_joint, bow)
    if lid_joint == "hinge":
        body += _lugs(pot)
    pins = Pins(rng, pot, max(room, knob_top + 0.012))
    if swinging:
        for s in (-1.0, 1.0):
            root, tip = (0, s * 0.6 * pins.reach, pins.z), (0, s * (pins.reach - pins.rod - GAP), pins.z)
            body += hull_of(cylinder(root, tip, 1.6 * pins.rod))
    switch = _switch(rng, pot) if kind == "electric" else None
    if switch is not None:
        body += switch[0]
    kettle = Assembly("body", body, DENSITY)
    free = min(room - knob_top, over - pot.top - 0.02) if bow else np.inf
    kettle.add("lid", lid, _lid_joint(rng, lid_joint, pot, free))
    if swinging:
        _swinging_bow(rng, kettle, pins, pot)
    if mouth is not None and kind == "stove" and rng.random() < 0.6:
        _whistle(rng, kettle, mouth)
    if standing:
        _base(rng, kettle, pot)
    if switch is not None:
        kettle.add(switch[1], switch[2], switch[3], density=900.0)
    return kettle


def _spout(rng: Rng, kind: str, pot: Pot) -> tuple[Solid, tuple[Array, Array, float] | None]:
    """Beak at the rim, or a tube from the belly; the mouth of a straight one: its middle, direction and radius."""
    height = pot.top - pot.foot
    choice = pick(rng, {"tube": 0.55, "goose": 0.3, "beak": 0.15})
    if kind == "electric":
        choice = pick(rng, {"beak": 0.75, "goose": 0.15, "tube": 0.1})
    shoulder = pot.radius(pot.top - 0.1 * height) < 0.75 * max(level[1] for level in pot.levels)
    if choice == "beak" and shoulder:  # a beak at a narrow rim would pour onto the body
        choice = "tube"
    if choice == "beak":
        z0, z1 = pot.top - height * rng.uniform(0.2, 0.6), pot.top - rng.uniform(0.001, 0.03) * height
        reach = pot.radius(z1) + pot.mouth * rng.uniform(0.2, 0.55)
        half = pot.mouth * rng.uniform(0.35, 0.75)
        foot = [(-0.6 * pot.radius(z0), y, z0) for y in (-0.25 * half, 0.25 * half)]
        rim = [(-0.6 * pot.radius(z1), y, z1) for y in (-half, half)] + [(-0.3 * pot.radius(z1), 0.0, z1 - 0.002)]
        edge = [(-reach, y, z) for y in (-0.12 * half, 0.12 * half) for z in (z1 - 0.06 * height, z1 + 0.02 * height)]
        return hull([*foot, *rim, *edge]), None
    start = pot.foot + height * rng.uniform(0.2, 0.5)
    wide = pot.mouth * (rng.uniform(0.2, 0.36) if choice == "tube" else rng.uniform(0.12, 0.2))
    root = pot.radius(start)
    end = pot.foot + height * rng.uniform(0.85, 1.1)
    reach = max(root, pot.radius(end - 0.15 * height)) + height * rng.uniform(0.25, 0.6)
    if choice == "tube":
        tip = np.array([-reach, 0.0, end])
        bend = np.array([-root - 0.3 * (reach - root), 0.0, start + 0.3 * (end - start)])
        solid = tube(
            np.array([(-0.6 * root, 0.0, start - 0.05 * height), bend, tip]), [1.5 * wide, wide, 0.6 * wide], 14
        )
        return solid, (tip, unit(tip - bend), 0.6 * wide)
    # An S: out of the belly, up, and over to the front.
    s = np.linspace(0.0, 1.0, 10)
    swing = 0.5 - 0.5 * cos(np.pi * s)
    x = -0.6 * root - (reach - 0.6 * root) * (0.35 * s + 0.65 * s * s * s)
    path = np.stack([x, 0.0 * s, start + (end - start) * (1.25 * swing - 0.25 * s * s * s)], axis=1)
    return tube(path, (np.linspace(1.5, 0.65, 10) * wide).tolist(), 12), None


def _whistle(rng: Rng, kettle: Assembly, mouth: tuple[Array, Array, float]) -> None:
    """A cover of the spout that turns up."""
    tip, ahead, radius = mouth
    up = np.array([ahead[2], 0.0, -ahead[0]])  # across the spout, away from the pot's foot
    near = tip + GAP * ahead
    cover = cylinder(near, near + 0.35 * radius * ahead, 1.15 * radius, radius, 14)
    if rng.random() < 0.5:
        cover += cylinder(near, near + 0.9 * radius * ahead, 0.5 * radius, 0.3 * radius, 10)
    pivot = near + 1.15 * radius * up
    lift = tube([near + 0.9 * radius * up + 0.15 * radius * ahead, pivot + radius * (0.8 * up + 0.3 * ahead)],
                0.18 * radius, 8)  # fmt: skip
    kettle.add("whistle", cover + lift, revolute("body", (0, 1, 0), pivot, 0.0, rng.uniform(0.6, 1.5)), density=1500.0)


def _lid(rng: Rng, pot: Pot, joint: str, low: bool) -> tuple[Solid, float]:
    """The lid and the height of its top; ``low`` keeps the knob short."""
    z = pot.top + GAP
    radius = pot.mouth * rng.uniform(0.9, 1.04)
    rim = rng.uniform(0.003, 0.01)
    lid = rod(0, 0, (z, z + rim), radius, rng.uniform(0.92, 1.0) * radius)
    rise = radius * rng.choice([0.06, rng.uniform(0.1, 0.5)])
    share = rng.uniform(0.8, 0.92)
    lid += dome(share * radius, z + rim - 0.0005, rise)
    top = z + rim + rise
    size = pot.mouth * rng.uniform(0.16, 0.28)
    kind = pick(rng, ["ball", "mushroom", "ring", "bar", "cone"])
    foot = top - 0.15 * rise - 0.001
    if kind == "ball":
        lid += rod(0, 0, (foot, top + 0.5 * size), 0.4 * size) + ellipsoid((0, 0, top + size), size, 14)
        top += 2.0 * size
    elif kind == "mushroom":
        lid += rod(0, 0, (foot, top + 0.7 * size), 0.45 * size, 0.6 * size)
        lid += rod(0, 0, (top + 0.6 * size, top + size), 1.2 * size, size)
        top += size
    elif kind == "ring":
        path = [(x, 0.0, top + 0.4 * size + h) for x, h in arch(size, size, 9, -0.3, np.pi + 0.3)]
        lid += tube([(size * cos(0.3), 0, foot - 0.1 * rise), *path, (-size * cos(0.3), 0, foot - 0.1 * rise)],
                    0.2 * size, 8)  # fmt: skip
        top += 1.6 * size
    elif kind == "bar":
        half = 1.3 * size
        lid += box(0.35 * size, half, (foot - 0.3 * rise, top + 0.7 * size), fillet=0.2 * size)
        top += 0.7 * size
    else:
        lid += rod(0, 0, (foot, top + 1.2 * size), 0.5 * size, size, 16)
        top += 1.2 * size
    if joint == "hinge":
        x, half, r = _hinge(pot)
        lid += rod(x, (-half, half), z + r, r, sections=14)
        lid += box((0.8 * radius, x), half, (z, z + r))
    elif rng.random() < 0.5:  # a rim that reaches into the pot is hidden while the lid lies: only a plate shows
        lid += ring((0, 0, z + 0.5 * rim), UP, 0.9 * radius, 1.03 * radius, 0.6 * rim, 24)
    return lid, top


def _hinge(pot: Pot) -> tuple[float, float, float]:
    """Distance of the hinge behind the axis, half length and radius of its barrel."""
    r = 0.0045
    return 1.04 * pot.mouth + 1.3 * r, 0.22 * pot.mouth, r


def _lugs(pot: Pot) -> Solid:
    """What carries the barrel of the lid's hinge, at both its ends."""
    x, half, r = _hinge(pot)
    roots = (0.85 * pot.mouth, x + 0.5 * r), (pot.top - 0.02, pot.top - 0.012)
    return cheeks((x, pot.top + GAP + r), r, half + 0.001, half + 0.007, *roots)


def _lid_joint(rng: Rng, kind: str, pot: Pot, room: float) -> JointSpec:
    at = np.array([0.0, 0.0, pot.top])
    travel = min(pot.mouth * rng.uniform(0.3, 1.5), 0.8 * room)
    if travel < 0.004:  # the bow holds it down
        kind = "turn"
    if kind == "hinge":
        x, _, r = _hinge(pot)
        return revolute("body", (0, 1, 0), (x, 0, pot.top + GAP + r), 0.0, np.deg2rad(rng.uniform(60, 88)))
    if kind == "turn":
        return continuous("body", UP, at)
    if kind == "screw":
        turns = 2.0 * np.pi * rng.uniform(0.25, 1.5)
        return screw("body", UP, at, 0.0, turns, min(travel, 0.02) / turns)
    return prismatic("body", UP, 0.0, travel, at)


def _bow_path(room: float, reach: float, lift: float, square: bool) -> list[tuple[float, float]]:
    """X and Z of a bow between two feet at ``reach``, as high as ``room``."""
    if square:
        edge = 0.75 * reach
        return [(-reach, lift), (-edge, room), (edge, room), (reach, lift)]
    return [(x, lift + z) for x, z in arch(reach, room - lift, 11, np.pi, 0.0)]


def _bow(rng: Rng, pot: Pot, room: float) -> tuple[Solid, float]:
    """A fixed bow from front to back over the lid, and how high it is above the lid's edge."""
    z = pot.foot + 0.8 * (pot.top - pot.foot)
    reach = pot.radius(z)
    room += 0.02
    path = [(x, 0.0, h) for x, h in _bow_path(room, reach, z - 0.004, rng.random() < 0.4)]
    r = rng.uniform(0.004, 0.007)
    solid = tube(path, r, 10)
    if rng.random() < 0.7:
        solid += tube([(-0.45 * reach, 0, room), (0.45 * reach, 0, room)], 2.0 * r, 14)
    x, _, z = np.array(path).T
    return solid, float(np.interp(-1.05 * pot.mouth, x, z)) - 2.0 * r


class Pins:
    """Where a swinging bow hangs: half distance and height of the pins, height of the bow, radius of its rod."""

    def __init__(self, rng: Rng, pot: Pot, room: float) -> None:
        self.z = pot.foot + rng.uniform(0.6, 0.9) * (pot.top - pot.foot)
        widest = max(level[2] for level in pot.levels)
        self.rod = rng.uniform(0.003, 0.006)
        # So wide and so high that it passes around the body wherever it stands.
        self.reach = widest + self.rod + 0.004
        self.top = max(room + 2.4 * self.rod, self.z + 1.2 * widest + 2.4 * self.rod) + 0.01


def _swinging_bow(rng: Rng, kettle: Assembly, pins: Pins, pot: Pot) -> None:
    """A bow that hangs on two pins at the sides, upright at rest, and swings down to the back."""
    rise, r = pins.top - pins.z, pins.rod
    if rng.random() < 0.4:
        path = [(0.0, s * y * pins.reach, pins.z + h * rise) for s, y, h in
                ((-1, 1, 0), (-1, 1, 0.65), (-1, 0.75, 1), (1, 0.75, 1), (1, 1, 0.65), (1, 1, 0))]  # fmt: skip
    else:
        path = [(0.0, y, pins.z + z) for y, z in arch(pins.reach, rise, 13, np.pi, 0.0)]
    bow = tube(path, r, 10)
    if rng.random() < 0.75:
        bow += tube([(0, -0.4 * pins.reach, pins.top), (0, 0.4 * pins.reach, pins.top)], r * rng.uniform(1.5, 2.4), 14)
    limit = np.deg2rad(rng.uniform(20, 85))
    low = -np.deg2rad(rng.uniform(5, 20)) if rng.random() < 0.4 else 0.0
    kettle.add("handle", bow, revolute("body", (0, 1, 0), (0, 0, pins.z), low, limit), density=1500.0)


def _back_grip(rng: Rng, pot: Pot, hinged: bool, kind: str) -> Solid:
    """A handle at the back, below the hinge of the lid."""
    height = pot.top - pot.foot
    high = pot.foot + height * rng.uniform(0.78, 0.92)
    low = pot.foot + height * rng.uniform(0.12, 0.4)
    reach = max(pot.radius(z) for z in (low, high)) + rng.uniform(0.03, 0.05)
    thick, wide = rng.uniform(0.004, 0.007), rng.uniform(0.006, 0.012)
    style = pick(rng, ["loop", "open", "round"])
    start, end = (0.8 * pot.radius(high), high), (0.8 * pot.radius(low), low)
    if style == "loop":
        points = [start, (0.92 * reach, high + 0.05 * height), (reach, high - 0.15 * height),
                  (0.96 * reach, low + 0.2 * height), end]  # fmt: skip
    elif style == "open":
        points = [start, (0.9 * reach, high + 0.06 * height), (reach, high - 0.1 * height), (reach, low)]
    else:
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        base = pot.radius(middle)
        round_it = arch(reach - base, half, 6, 0.4 * np.pi, -0.4 * np.pi)
        points = [start, *((base + x, middle + z) for x, z in round_it), end]
    return grip_loop(points, wide, thick)


def _base(rng: Rng, kettle: Assembly, pot: Pot) -> None:
    """The stand below an electric kettle: it turns, or the kettle lifts off it."""
    radius = pot.levels[0][1] * rng.uniform(0.98, 1.25)
    tall = pot.foot - GAP
    base = rod(0, 0, (0, 0.55 * tall), radius) + rod(0, 0, (0.5 * tall, tall), radius, 0.85 * radius)
    if rng.random() < 0.5:
        base += box((radius * 0.5, 1.35 * radius), 0.3 * radius, (0.0, 0.6 * tall), fillet=0.004)
    at = np.array([0.0, 0.0, tall])
    joint = continuous("body", UP, at) if rng.random() < 0.5 else prismatic("body", -UP, 0.0, rng.uniform(0.03, 0.15))
    kettle.add("base", base, joint)


def _switch(rng: Rng, pot: Pot) -> tuple[Solid, str, Solid, JointSpec]:
    """A rocker or a button at the side of the foot: its mount on the body, its name, solid and joint."""
    z = pot.foot + rng.uniform(0.1, 0.25) * (pot.top - pot.foot)
    side = float(rng.choice([-1.0, 1.0]))
    y = pot.radius(z) + 0.003
    half = rng.uniform(0.006, 0.012)

    def between(near: float, far: float, x: float, high: float, low: float) -> Solid:
        return box(x, (side * near, side * far), (z - low, z + high), fillet=0.002)

    mount = between(0.6 * y, y, 1.5 * half, half + 0.004, half + 0.004)
    if rng.random() < 0.5:
        button = between(y + 0.0025, y + 0.008, half, 0.7 * half, 0.7 * half)
        return mount, "button", button, prismatic("body", (0, -side, 0), 0.0, 0.0018, (0, side * y, z))
    lever = between(y + GAP, y + 0.016, 0.4 * half, 0.004, 0.004)
    limit = rng.uniform(0.2, 0.5)
    return mount, "switch", lever, revolute("body", (0, side, 0), (0, side * y, z), -limit, limit)
