"""Clocks: on a wall, on a mantel, longcase clocks, alarm clocks, cuckoo clocks, pocket watches.

What varies: the kind, the outline of the case (round, square, polygon, arch, house, tambour), the rim, the marks of the
hours, two or three hands of several forms and where they point, a pendulum and its bob, weights on chains, a door before
the pendulum, doors of a cuckoo, a lid, bells with a hammer, knobs, a stand in which the case tilts. Two to seven parts
move. Hands turn freely about the middle of the face, clockwise as seen from the front.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import side_hinge
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.solids import (
    Solid,
    box,
    cylinder,
    ellipsoid,
    frame,
    hull,
    hull_of,
    prism,
    revolved,
    ring,
    rounded_box,
    tube,
    union,
)
from artsim.model.kinematics import Array

GAP = 0.001
FRONT = np.array([-1.0, 0.0, 0.0])
CLOCKWISE = np.array([1.0, 0.0, 0.0])
"""Axis of the hands: a turn about it takes the top to someone's right who looks at the face."""
DENSITY = 500.0


def build(rng: np.random.Generator) -> Assembly:
    """A clock; its face looks towards -X and the pendulum hangs straight at rest."""
    kinds: tuple[Callable[[np.random.Generator], Assembly], ...] = (
        _wall_clock, _pendulum_clock, _mantel_clock, _longcase_clock, _alarm_clock, _cuckoo_clock, _watch
    )  # fmt: skip
    return kinds[int(rng.choice(len(kinds), p=[0.24, 0.16, 0.16, 0.13, 0.15, 0.08, 0.08]))](rng)


# --- the face --------------------------------------------------------------------------------------------------------


def outline(kind: str, half: float, tall: float = 1.0) -> Array:
    """Points (N, 2) along Y and Z of a case's front, about the middle of the face; ``tall`` stretches it upright."""
    if kind == "square":
        return half * np.array([(-1.0, -tall), (1.0, -tall), (1.0, tall), (-1.0, tall)])
    sides = {"round": 32, "octagon": 8, "hexagon": 6, "dodecagon": 12}[kind]
    angles = (np.arange(sides) + 0.5) * (2.0 * np.pi / sides)
    points: Array = half * np.stack([cos(angles), tall * sin(angles)], axis=1)
    return points


def marks(rng: np.random.Generator, x: float, center: Array, radius: float) -> Solid:
    """Marks of the hours on a face at ``x``: bars, dots, or four large ones."""
    kind = str(rng.choice(["bars", "dots", "four", "mixed"]))
    solid = Solid()
    size = radius * rng.uniform(0.02, 0.04)
    long = radius * rng.uniform(0.05, 0.11)
    for hour in range(12):
        a = 2.0 * np.pi * hour / 12
        main = hour % 3 == 0
        if kind == "four" and not main:
            continue
        out = np.array([0.0, -sin(a), cos(a)])
        across = np.array([0.0, cos(a), sin(a)])
        at = center + 0.86 * radius * out + (x, 0, 0)
        if kind == "dots":
            solid += cylinder(at + (0.001, 0, 0), at - (0.0015, 0, 0), size * (1.5 if main else 1.0), sections=8)
            continue
        wide = size * (1.4 if main and kind == "mixed" else 1.0)
        reach = long * (1.6 if main else 1.0)
        ends = [at + u * wide * across + v * reach * out + (w, 0, 0) for u in (-0.5, 0.5) for v in (-1.0, 0.25)
                for w in (-0.0012, 0.001)]  # fmt: skip
        solid += hull(np.array(ends))
    return solid


def add_hands(rng: np.random.Generator, clock: Assembly, x: float, center: Array, radius: float, parent: str) -> float:
    """Add hour, minute and by chance a second hand before a face at ``x``; returns where they end in front."""
    kind = str(rng.choice(["bar", "lance", "spade", "dart"]))
    thick = max(0.012 * radius, 0.0008)
    gap = max(0.006 * radius, 0.0005)
    wide = radius * rng.uniform(0.025, 0.06)
    hub = radius * rng.uniform(0.05, 0.09)
    names = ["hour_hand", "minute_hand"] + (["second_hand"] if rng.random() < 0.5 else [])
    lengths = [rng.uniform(0.45, 0.6), rng.uniform(0.7, 0.9), rng.uniform(0.72, 0.92)]
    for number, name in enumerate(names):
        thin = number == 2
        long = lengths[number] * radius
        w = wide * (0.3 if thin else 1.0 - 0.2 * number)
        tail = long * rng.choice([0.0, rng.uniform(0.1, 0.3)])
        low, high = x - gap - thick, x - gap
        solid = cylinder((low, 0, 0), (high, 0, 0), hub * (1.0 - 0.2 * number), sections=14)
        solid += _hand("bar" if thin else kind, low, high, w, long, tail)
        turned = solid.turned(CLOCKWISE, rng.uniform(0.0, 2.0 * np.pi)).moved(center)
        joint = continuous(parent, CLOCKWISE, center + (low, 0, 0))
        clock.add(name, turned, joint, label="hand", density=2000.0)
        x = low
    return x


def _hand(kind: str, low: float, high: float, wide: float, long: float, tail: float) -> Solid:
    """A hand that points up from the origin."""
    def plate(points: list[tuple[float, float]]) -> Solid:
        return prism(np.array(points), low, high, 0)

    back = plate([(-0.5 * wide, -tail), (0.5 * wide, -tail), (0.6 * wide, 0.0), (-0.6 * wide, 0.0)]) if tail else Solid()
    if kind == "bar":
        return back + plate([(-0.5 * wide, 0.0), (0.5 * wide, 0.0), (0.4 * wide, long), (-0.4 * wide, long)])
    if kind == "lance":
        return back + plate([(-0.35 * wide, 0.0), (0.35 * wide, 0.0), (0.8 * wide, 0.65 * long), (0.0, long),
                             (-0.8 * wide, 0.65 * long)])  # fmt: skip
    if kind == "spade":
        stem = plate([(-0.35 * wide, 0.0), (0.35 * wide, 0.0), (0.35 * wide, 0.8 * long), (-0.35 * wide, 0.8 * long)])
        leaf = [(0.0, 0.55 * long), (1.5 * wide, 0.68 * long), (0.9 * wide, 0.8 * long), (0.0, long),
                (-0.9 * wide, 0.8 * long), (-1.5 * wide, 0.68 * long)]  # fmt: skip
        return back + stem + plate(leaf)
    return back + plate([(-wide, 0.0), (wide, 0.0), (0.0, long)])


def dial_plate(rng: np.random.Generator, x: float, center: Array, radius: float) -> Solid:
    """A round plate whose front is at ``x``, with the marks of the hours."""
    solid = cylinder(center + (x, 0, 0), center + (x + 0.004, 0, 0), radius, sections=32)
    return solid + marks(rng, x, center, radius)


def rim(rng: np.random.Generator, x: float, center: Array, radius: float, wide: float, rise: float) -> Solid:
    """A ring around a face at ``x``, which stands out by ``rise``: bevelled or flat."""
    inner = rng.uniform(0.3, 1.0) * rise
    section = [(radius, -0.003), (radius + wide, -0.003), (radius + wide, inner), (radius, rise)]
    if rng.random() < 0.5:
        section[2], section[3] = (radius + wide, rise), (radius, inner)
    return revolved(section, center + (x, 0, 0), FRONT, 28)


# --- kinds -----------------------------------------------------------------------------------------------------------


def _wall_clock(rng: np.random.Generator) -> Assembly:
    """A plain case, or a face with rays."""
    radius = rng.uniform(0.07, 0.25)
    center = np.zeros(3)
    deep = radius * rng.uniform(0.1, 0.5)
    kind = str(rng.choice(["round", "round", "square", "octagon", "dodecagon", "hexagon", "rays"]))
    tall = 1.0 if kind != "square" or rng.random() < 0.5 else rng.uniform(1.05, 1.5)
    edge = rng.uniform(1.04, 1.35)
    body = dial_plate(rng, 0.0, center, radius)
    if kind == "rays":
        body += cylinder((0.002, 0, 0), (deep, 0, 0), 1.02 * radius, sections=32)
        count, reach = int(rng.integers(6, 17)), rng.uniform(1.35, 2.0)
        r = radius * rng.uniform(0.02, 0.05)
        for k in range(count):
            a = 2.0 * np.pi * k / count
            out = np.array([0.0, cos(a), sin(a)])
            far = reach * (1.0 if k % 2 else rng.uniform(0.75, 1.0)) * radius
            body += tube([0.95 * radius * out + (0.5 * deep, 0, 0), far * out + (0.5 * deep, 0, 0)], [r, 0.6 * r], 6)
            if count < 13 and reach > 1.5:
                body += ellipsoid(far * out + (0.5 * deep, 0, 0), 1.8 * r, 8)
    else:
        around = edge if kind in ("round", "square") else edge / cos(np.pi / 6)
        body += prism(outline(kind, around * radius, tall), 0.002, deep, 0)
        if rng.random() < 0.4:
            body += prism(outline(kind, 1.06 * around * radius, tall), 0.4 * deep, 0.9 * deep, 0)
    body += rim(rng, 0.003, center, 1.005 * radius, radius * rng.uniform(0.03, min(0.3, edge - 0.99)),
                0.003 + radius * rng.uniform(0.05, 0.2))  # fmt: skip
    clock = Assembly()
    clock.add("body", body, density=DENSITY)
    add_hands(rng, clock, 0.0, center, 0.95 * radius, "body")
    if rng.random() < 0.15 and deep > 0.02:
        knob = cylinder((0.5 * deep, 0, 0), (0.5 * deep, 0, 0.012), 0.3 * deep, sections=14)
        lift = max(outline(kind if kind != "rays" else "round", 1.2 * edge * radius, tall)[:, 1]) + GAP
        if kind != "rays":
            joint = continuous("body", (0, 0, 1), (0.5 * deep, 0, lift))
            clock.add("knob", knob.moved((0, 0, lift)), joint, density=DENSITY)
    return clock


def _pendulum(rng: np.random.Generator, x: float, top: float, length: float, room: float) -> tuple[Solid, float]:
    """A rod with a bob that hangs from height ``top``; and how far it may swing in a case of half width ``room``."""
    bob = min(length * rng.uniform(0.1, 0.22), 0.55 * room)
    z = top - length + bob
    rod = max(0.008 * length, 0.0012)
    solid = cylinder((x - 0.5 * rod, 0, top), (x - 0.5 * rod, 0, z), rod, sections=8)
    kind = str(rng.choice(["disc", "lens", "bar", "drop"]))
    thick = max(0.12 * bob, 0.002)
    if kind == "disc":
        solid += cylinder((x - thick, 0, z), (x + thick, 0, z), bob, sections=24)
    elif kind == "lens":
        solid += ellipsoid((x, 0, z), (1.5 * thick, bob, bob), 18)
    elif kind == "bar":
        solid += cylinder((x, 0, z + bob), (x, 0, z - bob), max(0.35 * bob, rod), sections=14)
    else:
        solid += hull_of(ellipsoid((x, 0, z - 0.3 * bob), (1.5 * thick, 0.7 * bob, 0.7 * bob), 14),
                         box((x - rod, -rod, z), (x + rod, rod, z + bob)))  # fmt: skip
    swing = min(0.7 * (room - bob) / length, 0.45)
    return solid, max(swing, 0.03)


def _pendulum_clock(rng: np.random.Generator) -> Assembly:
    """A case on the wall with a box below, in which a pendulum hangs; or the pendulum hangs free."""
    radius = rng.uniform(0.06, 0.14)
    center = np.zeros(3)
    deep = rng.uniform(0.05, 0.11)
    kind = str(rng.choice(["round", "octagon", "square", "house", "arch"]))
    half = radius * rng.uniform(1.1, 1.35)
    body = dial_plate(rng, 0.0, center, radius)
    body += rim(rng, 0.003, center, 1.005 * radius, 0.06 * radius, 0.003 + 0.1 * radius)
    low = -half
    if kind in ("house", "arch"):
        body += box((0.002, -half, -half), (deep, half, half))
        if kind == "house":
            body += prism([(-1.15 * half, half), (1.15 * half, half), (0.0, half * rng.uniform(1.4, 1.9))], -0.01, deep, 0)
        else:
            body += prism(outline("round", half).clip((-half, 0), (half, half)) + (0, 0.9 * half), 0.002, deep, 0)
    else:
        name = "square" if kind == "square" else kind
        around = half if kind != "octagon" else half / cos(np.pi / 8)
        body += prism(outline(name, around), 0.002, deep, 0)
    clock = Assembly()
    length = radius * rng.uniform(1.4, 3.6)
    free = rng.random() < 0.35
    if free:  # in the open below the case
        solid, swing = _pendulum(rng, 0.4 * deep, low - 0.004, length, half)
        body += box((0.35 * deep, -0.004, low - 0.0025), (0.45 * deep, 0.004, low + 0.01))
        clock.add("body", body, density=DENSITY)
    else:
        room = half * rng.uniform(0.5, 0.85)
        bottom = low - length - 0.02
        body += frame((0.006, -room - 0.01, bottom - 0.012), (deep, room + 0.01, low + 0.01), [0.01] * 4)
        body += box((deep - 0.008, -room - 0.005, bottom - 0.008), (deep, room + 0.005, low + 0.005))
        if rng.random() < 0.6:
            body += prism([(-room - 0.01, bottom - 0.01), (room + 0.01, bottom - 0.01), (0.5 * room, bottom - 0.5 * room),
                           (-0.5 * room, bottom - 0.5 * room)], 0.006, deep, 0)  # fmt: skip
        body += box((deep - 0.03, -0.003, low - 0.003), (deep, 0.003, low + 0.01))
        solid, swing = _pendulum(rng, 0.5 * deep, low - 0.004, length - 0.006, room)
        clock.add("body", body, density=DENSITY)
        if rng.random() < 0.6:
            _glass_door(rng, clock, 0.006, (-room - 0.008, room + 0.008), (bottom - 0.008, low - 0.002))
    x = 0.4 * deep if free else 0.5 * deep
    add_hands(rng, clock, 0.0, center, 0.95 * radius, "body")
    clock.add("pendulum", solid, revolute("body", FRONT, (x, 0, low - 0.004), -swing, swing), density=2000.0)
    return clock


def _glass_door(
    rng: np.random.Generator, clock: Assembly, x: float, across: tuple[float, float], upright: tuple[float, float]
) -> None:
    """A frame before an opening at ``x``, hinged at its left or right."""
    thick = rng.uniform(0.006, 0.012)
    low, high = (x - GAP - thick, across[0], upright[0]), (x - GAP, across[1], upright[1])
    bar = rng.uniform(0.1, 0.2) * (across[1] - across[0])
    door = frame(low, high, [bar] * 4)
    if rng.random() < 0.3:
        middle = 0.5 * (upright[0] + upright[1])
        door += box((low[0] + 0.002, across[0] + 0.5 * bar, middle - 0.3 * bar), (high[0] - 0.002, across[1] - 0.5 * bar,
                                                                                 middle + 0.3 * bar))  # fmt: skip
    left = rng.random() < 0.5
    y = across[0] + 0.5 * bar if left else across[1] - 0.5 * bar
    spot = np.array([low[0], y, 0.5 * (upright[0] + upright[1])])
    door += cylinder(spot + (0.001, 0, 0), spot - (0.01, 0, 0), 0.3 * bar, sections=12)
    edge = across[1] if left else across[0]
    clock.add("door", door, side_hinge(low[0], edge, rng.uniform(1.0, 2.0), left), density=DENSITY)


def _mantel_clock(rng: np.random.Generator) -> Assembly:
    """A case that stands: a block, an arch, a tambour, a house, or a drum on feet."""
    radius = rng.uniform(0.04, 0.1)
    deep = radius * rng.uniform(0.7, 1.5)
    kind = str(rng.choice(["block", "arch", "tambour", "house", "drum", "lancet"]))
    half = radius * rng.uniform(1.12, 1.5)
    low = -radius * rng.uniform(1.12, 1.8)
    center = np.zeros(3)
    body = dial_plate(rng, 0.0, center, radius)
    body += rim(rng, 0.003, center, 1.005 * radius, 0.08 * radius, 0.003 + 0.1 * radius)
    around = outline("round", half)
    corners = np.array([(-half, low), (half, low)])
    if kind == "drum":
        low = -half * rng.uniform(1.05, 1.4)
        body += cylinder((0.002, 0, 0), (deep, 0, 0), half, sections=32)
        for y in (-0.6 * half, 0.6 * half):
            body += box((0.1 * deep, y - 0.1 * half, low), (0.9 * deep, y + 0.1 * half, -0.6 * half))
    elif kind == "tambour":
        body += prism(np.concatenate([around, corners]), 0.002, deep, 0)
        wide = half * rng.uniform(1.5, 2.6)
        shoulder = low + 0.3 * (0.0 - low)
        body += prism([(-wide, low), (wide, low), (0.95 * wide, shoulder), (half, 0.3 * half), (-half, 0.3 * half),
                       (-0.95 * wide, shoulder)], 0.004, deep - 0.002, 0)  # fmt: skip
    elif kind == "arch":
        body += prism(np.concatenate([around, corners]), 0.002, deep, 0)
    elif kind == "lancet":
        body += prism(np.concatenate([around, corners, [(0.0, 1.6 * half)]]), 0.002, deep, 0)
    else:
        body += box((0.002, -half, low), (deep, half, half))
        if kind == "house":
            body += prism([(-1.1 * half, half), (1.1 * half, half), (0.0, half * rng.uniform(1.3, 1.8))], -0.008,
                          deep + 0.008, 0)  # fmt: skip
        elif rng.random() < 0.6:
            body += rounded_box((-0.012, -1.12 * half, half - 0.001), (deep + 0.008, 1.12 * half, half + 0.1 * half), 0.004)
        if rng.random() < 0.4:  # a handle on top
            top = half * (1.1 if kind == "block" else 1.0)
            angles = np.linspace(0.0, np.pi, 8)
            arch = [(0.5 * deep, 0.4 * half * cos(a), top - 0.004 + 0.35 * half * sin(a)) for a in angles.tolist()]
            body += tube(arch, 0.04 * half, 8) if kind == "block" else Solid()
    base = half * (rng.uniform(1.05, 1.4) if kind != "tambour" else 2.65)
    if kind != "drum" and rng.random() < 0.75:
        body += rounded_box((-0.014, -base, low - 0.15 * half), (deep + 0.008, base, low + 0.002), 0.004)
    clock = Assembly()
    tilting = kind == "drum" and rng.random() < 0.4
    if tilting:  # the drum hangs in a fork
        drum = dial_plate(rng, 0.0, center, radius) + cylinder((0.002, 0, 0), (deep, 0, 0), half, sections=32)
        drum += rim(rng, 0.003, center, 1.005 * radius, 0.08 * radius, 0.003 + 0.1 * radius)
        x, r = 0.5 * deep, 0.08 * half
        arm = half + 0.004 + 2 * r
        clear = half + deep + 0.01
        fork = tube([(x, -arm, 0), (x, -arm, -0.6 * clear), (x, -0.4 * half, -clear), (x, 0.4 * half, -clear),
                     (x, arm, -0.6 * clear), (x, arm, 0)], r, 10)  # fmt: skip
        fork += rounded_box((x - 0.8 * half, -0.9 * half, -clear - 0.012), (x + 0.8 * half, 0.9 * half, -clear + 0.002),
                            0.005)  # fmt: skip
        clock.add("body", fork, density=1500.0)
        limit = rng.uniform(0.2, 0.6)
        clock.add("case", drum, revolute("body", (0, 1, 0), (x, 0, 0), -limit, limit), density=DENSITY)
        add_hands(rng, clock, 0.0, center, 0.95 * radius, "case")
        return clock
    clock.add("body", body, density=DENSITY)
    add_hands(rng, clock, 0.0, center, 0.95 * radius, "body")
    if rng.random() < 0.45:
        _knobs(rng, clock, deep, 0.35 * radius)
    return clock


def _knobs(rng: np.random.Generator, clock: Assembly, x: float, spread: float) -> None:
    """One to three knobs at the back."""
    count = int(rng.integers(1, 4))
    for k in range(count):
        y, z = (k - 0.5 * (count - 1)) * spread, rng.uniform(-0.6, 0.3) * spread
        r = 0.35 * spread * rng.uniform(0.6, 1.0)
        knob = cylinder((x + GAP, y, z), (x + GAP + 0.5 * r, y, z), 0.5 * r, sections=10)
        knob += rounded_box((x + GAP + 0.4 * r, y - r, z - 0.25 * r), (x + GAP + 1.4 * r, y + r, z + 0.25 * r), 0.2 * r)
        name = f"knob_{k}" if count > 1 else "knob"
        clock.add(name, knob, continuous("body", CLOCKWISE, (x, y, z)), density=DENSITY)


def _longcase_clock(rng: np.random.Generator) -> Assembly:
    """A tall case on the floor: a hood with the face, a trunk with pendulum and weights, a plinth."""
    radius = rng.uniform(0.11, 0.17)
    deep = rng.uniform(0.18, 0.28)
    hood = radius * rng.uniform(1.15, 1.45)
    trunk = hood * rng.uniform(0.65, 0.95)
    foot = trunk * rng.uniform(1.05, 1.4)
    length = rng.uniform(0.7, 1.1)
    plinth = rng.uniform(0.25, 0.45)
    low = -hood - rng.uniform(0.0, 0.05)
    bottom = low - length
    center = np.zeros(3)
    body = dial_plate(rng, 0.0, center, radius) + box((0.002, -hood, low), (deep, hood, hood))
    body += rim(rng, 0.003, center, 1.005 * radius, 0.08 * radius, 0.01 + 0.05 * radius)
    crest = str(rng.choice(["flat", "gable", "arch", "swan"]))
    if crest == "gable":
        body += prism([(-1.1 * hood, hood), (1.1 * hood, hood), (0, hood * rng.uniform(1.3, 1.7))], -0.02, deep, 0)
    elif crest == "arch":
        body += prism(outline("round", hood).clip((-hood, 0), (hood, hood)) + (0, hood - 0.01), -0.01, deep, 0)
    elif crest == "swan":
        for s in (-1.0, 1.0):
            body += prism([(s * 1.08 * hood, hood - 0.001), (s * 0.2 * hood, hood - 0.001), (s * 0.2 * hood, 1.45 * hood),
                           (s * 0.4 * hood, 1.5 * hood)], 0.0, 0.3 * deep, 0)  # fmt: skip
    body += rounded_box((-0.02, -1.1 * hood, hood - 0.02), (deep, 1.1 * hood, hood + 0.02), 0.01)
    if rng.random() < 0.5:
        for s in (-1.0, 1.0):
            body += cylinder((-0.02, s * hood, low), (-0.02, s * hood, hood - 0.02), 0.012, sections=12)
    body += box((-0.02, -1.05 * hood, low - 0.03), (deep, 1.05 * hood, low + 0.002))
    body += frame((0.01, -trunk, bottom), (deep, trunk, low - 0.028), [0.02] * 4)
    body += box((deep - 0.012, -trunk + 0.01, bottom + 0.01), (deep, trunk - 0.01, low - 0.03))
    body += rounded_box((-0.02, -foot, bottom - plinth), (deep, foot, bottom + 0.005), 0.006)
    if rng.random() < 0.6:
        body += rounded_box((-0.035, -1.1 * foot, bottom - plinth), (deep, 1.1 * foot, bottom - 0.75 * plinth), 0.006)
    top = low - 0.05
    body += box((0.5 * deep, -0.006, top + 0.002), (deep - 0.005, 0.006, top + 0.004))
    clock = Assembly()
    clock.add("body", body, density=DENSITY)
    add_hands(rng, clock, 0.0, center, 0.95 * radius, "body")
    room = trunk - 0.025
    solid, swing = _pendulum(rng, 0.6 * deep, top, (top - bottom) * rng.uniform(0.65, 0.9) - 0.02, room)
    clock.add("pendulum", solid, revolute("body", FRONT, (0.6 * deep, 0, top), -swing, swing), density=2000.0)
    if rng.random() < 0.75:
        _glass_door(rng, clock, 0.01, (-trunk + 0.004, trunk - 0.004), (bottom + 0.008, low - 0.034))
    return clock


def _alarm_clock(rng: np.random.Generator) -> Assembly:
    """A drum on feet with two bells, or a small case with a button."""
    radius = rng.uniform(0.025, 0.06)
    deep = radius * rng.uniform(0.6, 1.3)
    half = radius * rng.uniform(1.08, 1.25)
    center = np.zeros(3)
    body = dial_plate(rng, 0.0, center, radius)
    body += rim(rng, 0.003, center, 1.005 * radius, 0.06 * radius, 0.003 + 0.12 * radius)
    clock = Assembly()
    bells = rng.random() < 0.65
    middle = 0.5 * deep
    if not bells:
        tall = rng.uniform(0.9, 1.3)
        kind = str(rng.choice(["square", "wedge", "drum"]))
        if kind == "drum":
            body += cylinder((0.002, 0, 0), (deep, 0, 0), half, sections=32)
            body += box((0.1 * deep, -0.7 * half, -1.08 * half), (0.9 * deep, 0.7 * half, -0.5 * half))
            top = half * cos(np.pi / 32)
        else:
            edge = half * tall
            body += rounded_box((0.002, -half, -edge), (deep, half, edge), rng.uniform(0.05, 0.4) * half, axis=0)
            if kind == "wedge":
                body += prism([(deep - 0.004, -edge), (deep * 1.9, -edge), (deep - 0.004, 0.6 * edge)], -0.8 * half,
                              0.8 * half, 1)  # fmt: skip
            top = edge
        clock.add("body", body, density=DENSITY)
        add_hands(rng, clock, 0.0, center, 0.95 * radius, "body")
        wide = half * rng.uniform(0.2, 0.55)
        button = rounded_box((0.2 * deep, -wide, top + 0.004), (0.8 * deep, wide, top + 0.01), 0.003)
        clock.add("button", button, prismatic("body", (0, 0, -1), 0.0, 0.003, (middle, 0, top)), density=DENSITY)
        if kind != "wedge":
            _knobs(rng, clock, deep, 0.3 * radius)
        return clock
    body += cylinder((0.002, 0, 0), (deep, 0, 0), half, sections=32)
    spread = rng.uniform(0.5, 0.75)
    r = 0.07 * radius
    size = radius * rng.uniform(0.38, 0.55)
    for s in (-1.0, 1.0):
        out = np.array([0.0, s * sin(spread), -cos(spread)])
        foot = np.array([middle, 0, 0]) + 0.9 * half * out
        body += tube([foot, foot + 0.5 * half * out], [1.6 * r, r], 10) + ellipsoid(foot + 0.5 * half * out, 1.3 * r, 8)
        up = np.array([0.0, s * sin(spread), cos(spread)])
        seat = np.array([middle, 0, 0]) + half * up
        body += cylinder(seat - 0.1 * half * up, seat + 0.25 * size * up, 0.8 * r, sections=10)
        bell = seat + 0.2 * size * up
        levels = ((0.0, 1.0), (0.35, 0.92), (0.65, 0.66), (0.8, 0.2))
        body += hull_of(*(cylinder(bell + h * size * up, bell + (h * size + 1e-4) * up, w * size, sections=18)
                          for h, w in levels))  # fmt: skip
    lean = half * cos(spread) + size
    if rng.random() < 0.6:
        angles = np.linspace(0.0, np.pi, 8)
        span = half * sin(spread) + 0.5 * size
        body += tube([(middle, span * cos(a), lean + 0.2 * size + 0.9 * size * sin(a)) for a in angles.tolist()], r, 8)
    clock.add("body", body, density=1500.0)
    add_hands(rng, clock, 0.0, center, 0.95 * radius, "body")
    room = half * sin(spread) - size * cos(spread)
    if room > 0.12 * radius:
        z = half + 0.006
        high = half * cos(spread) + 0.35 * size
        tip = max(high, z + 0.25 * size)
        head = min(0.35 * room, 0.1 * radius)
        hammer = cylinder((middle, 0, z), (middle, 0, tip), 0.5 * head, sections=8)
        hammer += cylinder((middle, -0.8 * head, tip), (middle, 0.8 * head, tip), head, sections=10)
        limit = max(0.3 * (room - head) / (tip - z), 0.02)
        clock.add("hammer", hammer, revolute("body", FRONT, (middle, 0, z), -limit, limit), density=3000.0)
    _knobs(rng, clock, deep, 0.5 * radius)
    return clock


def _cuckoo_clock(rng: np.random.Generator) -> Assembly:
    """A house with a steep roof, a small door for the bird, a leaf as a pendulum, and cones on chains."""
    radius = rng.uniform(0.035, 0.06)
    deep, half = rng.uniform(0.06, 0.1), radius * rng.uniform(1.4, 2.0)
    center = np.zeros(3)
    low, eaves = -radius * rng.uniform(1.25, 1.6), radius * rng.uniform(1.6, 2.2)
    ridge = eaves + half * rng.uniform(0.7, 1.2)
    body = dial_plate(rng, 0.0, center, radius) + box((0.002, -half, low), (deep, half, eaves))
    body += prism([(-half, eaves - 0.001), (half, eaves - 0.001), (0, ridge)], 0.002, deep, 0)
    thick, over = 0.08 * half, 1.25
    slope = (ridge - eaves) / half
    for s in (-1.0, 1.0):
        edge = eaves - (over - 1.0) * half * slope
        body += prism([(0, ridge), (0, ridge + 1.5 * thick), (s * over * half, edge), (s * over * half, edge + 1.5 * thick)],
                      -0.35 * deep, deep, 0)  # fmt: skip
    body += rim(rng, 0.003, center, 1.005 * radius, 0.1 * radius, 0.006)
    top, wide = eaves + 0.25 * (ridge - eaves), 0.22 * half
    base = radius * 1.15
    clock = Assembly()
    length = radius * rng.uniform(1.5, 3.0)
    body += box((0.35 * deep, -0.004, low - 0.0025), (0.45 * deep, 0.004, low + 0.01))
    clock.add("body", body, density=DENSITY)
    add_hands(rng, clock, 0.0, center, 0.95 * radius, "body")
    pieces = [0] if rng.random() < 0.5 else [0, 1]
    thin = 0.003
    for number in pieces:
        left = number == 0
        if len(pieces) == 1:
            across = (-wide, wide)
        else:
            across = (0.0006, wide) if left else (-wide, -0.0006)
        leaf = box((0.002 - GAP - thin, across[0], base), (0.002 - GAP, across[1], max(top, base + 1.5 * wide)))
        edge = across[1] if left else across[0]
        joint = side_hinge(0.002 - GAP - thin, edge, rng.uniform(1.2, 2.0), left)
        clock.add(f"door_{number}" if len(pieces) > 1 else "door", leaf, joint, density=DENSITY)
    solid, swing = _pendulum(rng, 0.4 * deep, low - 0.004, length, 0.9 * half)
    clock.add("pendulum", solid, revolute("body", FRONT, (0.4 * deep, 0, low - 0.004), -swing, swing), density=1500.0)
    if rng.random() < 0.7:
        x = 0.8 * deep
        for number, y in enumerate((-0.35 * half, 0.35 * half)):
            drop = length * rng.uniform(0.6, 1.6)
            r = 0.14 * radius
            weight = cylinder((x, y, low - GAP), (x, y, low - drop), 0.001, sections=6)
            weight += hull_of(cylinder((x, y, low - drop), (x, y, low - drop - 3 * r), r, 0.5 * r, 10),
                              ellipsoid((x, y, low - drop - 0.5 * r), r, 10))  # fmt: skip
            fall = prismatic("body", (0, 0, -1), 0.0, rng.uniform(0.05, 0.2), (x, y, low))
            clock.add(f"weight_{number}", weight, fall, density=4000.0)
    return clock


def _watch(rng: np.random.Generator) -> Assembly:
    """A pocket watch that stands upright: a flat drum with a crown, a bow, and by chance a lid."""
    radius = rng.uniform(0.016, 0.028)
    deep = radius * rng.uniform(0.25, 0.55)
    half = radius * rng.uniform(1.06, 1.18)
    center = np.zeros(3)
    rise = 0.16 * radius
    body = dial_plate(rng, 0.0, center, radius)
    body += cylinder((0.0015, 0, 0), (0.5 * deep, 0, 0), half, sections=30)
    body += cylinder((0.5 * deep - 1e-4, 0, 0), (deep, 0, 0), half, 0.8 * half, 30)
    body += ring((0.0015 - 0.5 * rise, 0, 0), FRONT, 1.005 * radius, half, rise, 28)
    neck = half + 0.12 * radius
    body += cylinder((0.3 * deep, 0, 0.95 * half), (0.3 * deep, 0, neck), 0.1 * radius, sections=12)
    clock = Assembly()
    x = 0.3 * deep
    crown = cylinder((x, 0, neck + 0.0004), (x, 0, neck + 0.22 * radius), 0.14 * radius, sections=14)
    bow = tube([(x, 0.34 * radius * cos(a), neck + 0.05 * radius + 0.42 * radius * sin(a))
                for a in np.linspace(-0.6, np.pi + 0.6, 11).tolist()], 0.04 * radius, 8)  # fmt: skip
    fixed = rng.random() < 0.5
    ears = union(cylinder((x, s * 0.08 * radius, neck - 0.08 * radius), (x, s * 0.3 * radius, neck - 0.18 * radius),
                          0.05 * radius, sections=8) for s in (-1.0, 1.0))  # fmt: skip
    clock.add("body", body + bow + ears if fixed else body, density=3000.0)
    joint = continuous("body", (0, 0, 1), (x, 0, neck))
    clock.add("crown", crown, joint, label="knob", density=3000.0)
    front = add_hands(rng, clock, 0.0, center, 0.9 * radius, "body")
    if rng.random() < 0.55:
        edge = min(front, 0.0015 - rise) - 0.0004
        lid = cylinder((edge, 0, 0), (edge - 0.12 * radius, 0, 0), half, 0.85 * half, 30)
        left = rng.random() < 0.5
        y = half * (1.0 if left else -1.0)
        clock.add("lid", lid, side_hinge(edge - 0.06 * radius, 1.02 * y, rng.uniform(1.2, 2.2), left), density=3000.0)
    return clock
