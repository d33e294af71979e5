"""Kettles and teapots: for a stove, electric, for tea.

What varies: outline, spout, knob; how the lid lifts off, turns, screws or swings; a bow over the lid that swings or
stands fast, or a grip at the back; whistle, switch or button; a base on which it turns or from which it lifts.
"""

import numpy as np

from artsim.common.elementary import cos
from artsim.common.products import unit
from artsim.families.details import cheeks
from artsim.families.vessels import Level, cross_section, dome, grip_loop, moulded
from artsim.making.assembly import Assembly, JointSpec, continuous, prismatic, revolute, screw
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, UP, Array, arch
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull, hull_of, ring, rod, tube

GAP = 0.0015
DENSITY = 500.0  # kg/m^3, as the pieces are solid and real ones are hollow


class Pot:
    """Levels of the body, its radius and that of the opening, heights of foot and top, hinge of the lid; metres."""

    def __init__(self, draws: Draws, kind: str, foot: float) -> None:
        wide = 0.5 * draws.length("width", (0.13, 0.24) if kind == "stove" else (0.11, 0.19))
        shares = {"stove": (0.8, 1.7), "electric": (1.7, 3.2), "teapot": (0.9, 1.9)}
        height = draws.length("height", shares[kind], of=wide)
        shapes = {"stove": ["cone", "drum", "belly", "squat"], "electric": ["cone", "drum", "hourglass", "belly"],
                  "teapot": ["belly", "ball", "squat", "drum", "pear"]}  # fmt: skip
        shape, mouth = draws.pick("shape", shapes[kind]), draws.number("mouth", (0.45, 0.75))
        if kind == "electric":
            mouth = draws.number("electric_mouth", (0.65, 0.9))
        low = draws.number("bottom_width", (0.8, 0.97))
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
        self.wide, self.mouth, self.foot, self.top = wide, profile[-1][1] * wide, foot, foot + height
        # Distance of the hinge behind the axis, half length and radius of its barrel.
        self.hinge = 1.04 * self.mouth + 1.3 * 0.0045, 0.22 * self.mouth, 0.0045

    def radius(self, z: float) -> float:
        """Half depth at a height."""
        return float(np.interp(z, [level[0] for level in self.levels], [level[1] for level in self.levels]))


def build(draws: Draws) -> Assembly:
    """A kettle with its lid on at rest; it pours towards -X."""
    kind = draws.pick("kind", {"stove": 0.38, "electric": 0.37, "teapot": 0.25})
    standing = kind == "electric" and draws.chance("base", 0.6)  # of its own
    pot = Pot(draws, kind, 0.022 if standing else 0.0)
    outline = draws.pick("outline", ["round", "round", "round", "octagon", "square"])
    body = moulded(pot.levels, cross_section(outline, draws.number("sharpness", (0.0, 0.4))))
    spout, mouth = _spout(draws, kind, pot)
    body += spout
    bow = kind != "electric" and draws.chance("bow", 0.75 if kind == "stove" else 0.25)
    swinging = bow and draws.chance("bow_swings", 0.6)
    over = np.inf
    room = pot.top + pot.mouth * draws.number("bow_height", (1.1, 1.6))  # below the bow
    lid_joint = draws.pick("lid_joint", {"lift": 0.45, "hinge": 0.3, "turn": 0.1, "screw": 0.15})
    if kind == "electric" and draws.chance("lid_hinged", 0.6):
        lid_joint = "hinge"
    if bow and lid_joint == "hinge":
        lid_joint = "lift"
    if not bow:
        body += _back_grip(draws, pot)
    elif not swinging:
        handle, over = _bow(draws, pot, room)
        body += handle
    lid, knob_top = _lid(draws, pot, lid_joint == "hinge")
    if lid_joint == "hinge":  # what carries its barrel, at both ends
        x, half, r = pot.hinge
        roots = (0.85 * pot.mouth, x + 0.5 * r), (pot.top - 0.02, pot.top - 0.012)
        body += cheeks((x, pot.top + GAP + r), r, half + 0.001, half + 0.007, *roots)
    pin = pot.foot + draws.number("pin_height", (0.6, 0.9)) * (pot.top - pot.foot)
    r = draws.length("bow_radius", (0.003, 0.006))
    # So wide and so high that the bow passes around the body wherever it stands.
    reach, crest = pot.wide + r + 0.004, max(room, knob_top + 0.012) + 2.4 * r
    crest = max(crest, pin + 1.2 * pot.wide + 2.4 * r) + 0.01
    if swinging:
        for s in (-1.0, 1.0):
            body += hull_of(cylinder((0, s * 0.6 * reach, pin), (0, s * (reach - r - GAP), pin), 1.6 * r))
    switch = _switch(draws, pot) if kind == "electric" else None
    if switch is not None:
        body += switch[0]
    kettle = Assembly("body", body, DENSITY)
    free = min(room - knob_top, over - pot.top - 0.02) if bow else np.inf
    kettle.add("lid", lid, _lid_joint(draws, lid_joint, pot, free))
    if swinging:
        _swinging_bow(draws, kettle, reach, pin, crest, r)
    if mouth is not None and kind == "stove" and draws.chance("whistle", 0.6):
        _whistle(draws, kettle, mouth)
    if standing:
        _base(draws, kettle, pot)
    if switch is not None:
        kettle.add(switch[1], switch[2], switch[3], density=900.0)
    return kettle


def _spout(draws: Draws, kind: str, pot: Pot) -> tuple[Solid, tuple[Array, Array, float] | None]:
    """Beak at the rim, or a tube from the belly; the mouth of a straight one: its middle, direction and radius."""
    height = pot.top - pot.foot
    choice = draws.pick("spout", {"tube": 0.55, "goose": 0.3, "beak": 0.15})
    if kind == "electric":
        choice = draws.pick("electric_spout", {"beak": 0.75, "goose": 0.15, "tube": 0.1})
    shoulder = pot.radius(pot.top - 0.1 * height) < 0.75 * pot.wide
    if choice == "beak" and shoulder:  # a beak at a narrow rim would pour onto the body
        choice = "tube"
    if choice == "beak":
        z0 = pot.top - height * draws.number("beak_height", (0.2, 0.6))
        z1 = pot.top - height * draws.number("beak_below_rim", (0.001, 0.03))
        reach = pot.radius(z1) + pot.mouth * draws.number("beak_reach", (0.2, 0.55))
        half = pot.mouth * draws.number("beak_width", (0.35, 0.75))
        foot = [(-0.6 * pot.radius(z0), y, z0) for y in (-0.25 * half, 0.25 * half)]
        rim = [(-0.6 * pot.radius(z1), y, z1) for y in (-half, half)] + [(-0.3 * pot.radius(z1), 0.0, z1 - 0.002)]
        edge = [(-reach, y, z) for y in (-0.12 * half, 0.12 * half) for z in (z1 - 0.06 * height, z1 + 0.02 * height)]
        return hull([*foot, *rim, *edge]), None
    start = pot.foot + height * draws.number("spout_start", (0.2, 0.5))
    wide = pot.mouth * draws.number("spout_radius", (0.2, 0.36) if choice == "tube" else (0.12, 0.2))
    root = pot.radius(start)
    end = pot.foot + height * draws.number("spout_end", (0.85, 1.1))
    reach = max(root, pot.radius(end - 0.15 * height)) + height * draws.number("spout_reach", (0.25, 0.6))
    if choice == "tube":
        tip = np.array([-reach, 0.0, end])
        bend = np.array([-root - 0.3 * (reach - root), 0.0, start + 0.3 * (end - start)])
        path = np.array([(-0.6 * root, 0.0, start - 0.05 * height), bend, tip])
        return tube(path, [1.5 * wide, wide, 0.6 * wide], 14), (tip, unit(tip - bend), 0.6 * wide)
    # An S: out of the belly, up, and over to the front.
    s = np.linspace(0.0, 1.0, 10)
    swing = 0.5 - 0.5 * cos(np.pi * s)
    x = -0.6 * root - (reach - 0.6 * root) * (0.35 * s + 0.65 * s * s * s)
    path = np.stack([x, 0.0 * s, start + (end - start) * (1.25 * swing - 0.25 * s * s * s)], axis=1)
    return tube(path, (np.linspace(1.5, 0.65, 10) * wide).tolist(), 12), None


def _whistle(draws: Draws, kettle: Assembly, mouth: tuple[Array, Array, float]) -> None:
    """A cover of the spout that turns up."""
    tip, ahead, radius = mouth
    up = np.array([ahead[2], 0.0, -ahead[0]])  # across the spout, away from the pot's foot
    near = tip + GAP * ahead
    cover = cylinder(near, near + 0.35 * radius * ahead, 1.15 * radius, radius, 14)
    if draws.chance("whistle_nose", 0.5):
        cover += cylinder(near, near + 0.9 * radius * ahead, 0.5 * radius, 0.3 * radius, 10)
    pivot = near + 1.15 * radius * up
    lift = tube([near + 0.9 * radius * up + 0.15 * radius * ahead, pivot + radius * (0.8 * up + 0.3 * ahead)],
                0.18 * radius, 8)  # fmt: skip
    hinge = revolute("body", (0, 1, 0), pivot, 0.0, draws.angle("whistle_angle", (0.6, 1.5)))
    kettle.add("whistle", cover + lift, hinge, density=1500.0)


def _lid(draws: Draws, pot: Pot, hinged: bool) -> tuple[Solid, float]:
    """The lid and the height of its top."""
    z = pot.top + GAP
    radius, rim = pot.mouth * draws.number("lid_radius", (0.9, 1.04)), draws.length("lid_rim", (0.003, 0.01))
    lid = rod(0, 0, (z, z + rim), radius, draws.number("lid_taper", (0.92, 1.0)) * radius)
    rise = radius * draws.one_of("lid_shape", {"flat": 0.06, "arched": draws.number("lid_rise", (0.1, 0.5))})
    lid += dome(draws.number("dome_width", (0.8, 0.92)) * radius, z + rim - 0.0005, rise)
    top = z + rim + rise
    size = pot.mouth * draws.number("knob_size", (0.16, 0.28))
    kind = draws.pick("knob", ["ball", "mushroom", "ring", "bar", "cone"])
    foot = top - 0.15 * rise - 0.001
    if kind == "ball":
        knob = rod(0, 0, (foot, top + 0.5 * size), 0.4 * size) + ellipsoid((0, 0, top + size), size, 14)
        top += 2.0 * size
    elif kind == "mushroom":
        knob = rod(0, 0, (foot, top + 0.7 * size), 0.45 * size, 0.6 * size)
        knob += rod(0, 0, (top + 0.6 * size, top + size), 1.2 * size, size)
        top += size
    elif kind == "ring":
        path = [(x, 0.0, top + 0.4 * size + h) for x, h in arch(size, size, 9, -0.3, np.pi + 0.3)]
        ends = [(s * size * cos(0.3), 0, foot - 0.1 * rise) for s in (1, -1)]
        knob = tube([ends[0], *path, ends[1]], 0.2 * size, 8)
        top += 1.6 * size
    elif kind == "bar":
        knob = box(0.35 * size, 1.3 * size, (foot - 0.3 * rise, top + 0.7 * size), fillet=0.2 * size)
        top += 0.7 * size
    else:
        knob = rod(0, 0, (foot, top + 1.2 * size), 0.5 * size, size, 16)
        top += 1.2 * size
    lid += knob.called("knob", UP)
    if hinged:
        x, half, r = pot.hinge
        lid += rod(x, (-half, half), z + r, r, sections=14) + box((0.8 * radius, x), half, (z, z + r))
    elif draws.chance("lid_bead", 0.5):  # a rim that reaches into the pot is hidden: only a plate shows
        lid += ring((0, 0, z + 0.5 * rim), UP, 0.9 * radius, 1.03 * radius, 0.6 * rim, 24)
    return lid, top


def _lid_joint(draws: Draws, kind: str, pot: Pot, room: float) -> JointSpec:
    at = np.array([0.0, 0.0, pot.top])
    travel = min(pot.mouth * draws.number("lid_travel", (0.3, 1.5)), 0.8 * room)
    if travel < 0.004:  # the bow holds it down
        kind = "turn"
    if kind == "hinge":
        x, _, r = pot.hinge
        return revolute("body", (0, 1, 0), (x, 0, pot.top + GAP + r), 0.0, draws.turn("lid_angle", (60.0, 88.0)))
    if kind == "turn":
        return continuous("body", UP, at)
    if kind == "screw":
        turns = 2.0 * np.pi * draws.number("lid_turns", (0.25, 1.5))
        return screw("body", UP, at, 0.0, turns, min(travel, 0.02) / turns)
    return prismatic("body", UP, 0.0, travel, at)


def _bow(draws: Draws, pot: Pot, room: float) -> tuple[Solid, float]:
    """A fixed bow from front to back over the lid, and how high it is above the lid's edge."""
    z = pot.foot + 0.8 * (pot.top - pot.foot)
    reach, low = pot.radius(z), z - 0.004
    room += 0.02
    if draws.chance("bow_square", 0.4):
        edge = 0.75 * reach
        path = [(-reach, low), (-edge, room), (edge, room), (reach, low)]
    else:
        path = [(x, low + h) for x, h in arch(reach, room - low, 11, np.pi, 0.0)]
    r = draws.length("bow_thickness", (0.004, 0.007))
    solid = tube([(x, 0.0, h) for x, h in path], r, 10)
    if draws.chance("bow_grip", 0.7):
        solid += tube([(-0.45 * reach, 0, room), (0.45 * reach, 0, room)], 2.0 * r, 14)
    xs, zs = np.array(path).T
    return solid.called("handle", UP), float(np.interp(-1.05 * pot.mouth, xs, zs)) - 2.0 * r


def _swinging_bow(draws: Draws, kettle: Assembly, reach: float, low: float, high: float, r: float) -> None:
    """A bow that hangs on two pins at the sides, upright at rest, and swings down to the back."""
    if draws.chance("bow_square", 0.4):
        corners = ((-1, 0), (-1, 0.65), (-0.75, 1), (0.75, 1), (1, 0.65), (1, 0))
        path = [(0.0, y * reach, low + h * (high - low)) for y, h in corners]
    else:
        path = [(0.0, y, low + z) for y, z in arch(reach, high - low, 13, np.pi, 0.0)]
    bow = tube(path, r, 10)
    if draws.chance("bow_grip", 0.75):
        thick = r * draws.number("bow_grip_thickness", (1.5, 2.4))
        bow += tube([(0, -0.4 * reach, high), (0, 0.4 * reach, high)], thick, 14)
    limit = draws.turn("bow_angle", (20.0, 85.0))
    lower = -draws.turn("bow_angle_forward", (5.0, 20.0)) if draws.chance("bow_both_ways", 0.4) else 0.0
    kettle.add("handle", bow, revolute("body", (0, 1, 0), (0, 0, low), lower, limit), density=1500.0)


def _back_grip(draws: Draws, pot: Pot) -> Solid:
    """A handle at the back, below the hinge of the lid."""
    height = pot.top - pot.foot
    high = pot.foot + height * draws.number("handle_top", (0.78, 0.92))
    low = pot.foot + height * draws.number("handle_bottom", (0.12, 0.4))
    reach = max(pot.radius(z) for z in (low, high)) + draws.length("handle_reach", (0.03, 0.05))
    thick, wide = draws.lengths(handle_thickness=(0.004, 0.007), handle_width=(0.006, 0.012))
    style = draws.pick("handle", ["loop", "open", "round"])
    start, end = (0.8 * pot.radius(high), high), (0.8 * pot.radius(low), low)
    if style == "loop":
        points = [start, (0.92 * reach, high + 0.05 * height), (reach, high - 0.15 * height),
                  (0.96 * reach, low + 0.2 * height), end]  # fmt: skip
    elif style == "open":
        points = [start, (0.9 * reach, high + 0.06 * height), (reach, high - 0.1 * height), (reach, low)]
    else:
        middle = 0.5 * (low + high)
        base = pot.radius(middle)
        round_it = arch(reach - base, 0.5 * (high - low), 6, 0.4 * np.pi, -0.4 * np.pi)
        points = [start, *((base + x, middle + z) for x, z in round_it), end]
    return grip_loop(points, wide, thick).called("handle", -FRONT)


def _base(draws: Draws, kettle: Assembly, pot: Pot) -> None:
    """The stand below an electric kettle: it turns, or the kettle lifts off it."""
    radius = pot.levels[0][1] * draws.number("base_radius", (0.98, 1.25))
    tall = pot.foot - GAP
    base = rod(0, 0, (0, 0.55 * tall), radius) + rod(0, 0, (0.5 * tall, tall), radius, 0.85 * radius)
    if draws.chance("base_tail", 0.5):
        base += box((radius * 0.5, 1.35 * radius), 0.3 * radius, (0.0, 0.6 * tall), fillet=0.004)
    if draws.pick("base_joint", {"turn": 0.5, "lift": 0.5}) == "turn":
        kettle.add("base", base, continuous("body", UP, (0.0, 0.0, tall)))
    else:
        kettle.add("base", base, prismatic("body", -UP, 0.0, draws.length("base_travel", (0.03, 0.15))))


def _switch(draws: Draws, pot: Pot) -> tuple[Solid, str, Solid, JointSpec]:
    """A rocker or a button at the side of the foot: its mount on the body, its name, solid and joint."""
    z = pot.foot + draws.number("switch_height", (0.1, 0.25)) * (pot.top - pot.foot)
    side = draws.side("switch_side")
    y = pot.radius(z) + 0.003
    half = 0.5 * draws.length("switch_width", (0.012, 0.024))

    def between(near: float, far: float, x: float, high: float) -> Solid:
        return box(x, (side * near, side * far), (z - high, z + high), fillet=0.002)

    mount = between(0.6 * y, y, 1.5 * half, half + 0.004)
    if draws.pick("switch", {"button": 0.5, "rocker": 0.5}) == "button":
        button = between(y + 0.0025, y + 0.008, half, 0.7 * half)
        return mount, "button", button, prismatic("body", (0, -side, 0), 0.0, 0.0018, (0, side * y, z))
    lever = between(y + GAP, y + 0.016, 0.4 * half, 0.004)
    limit = draws.angle("switch_angle", (0.2, 0.5))
    return mount, "switch", lever, revolute("body", (0, side, 0), (0, side * y, z), -limit, limit)
