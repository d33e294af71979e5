"""What clocks have in common: faces with marks, rims, hands, pendulums, glass doors."""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import side_hinge
from artsim.making.assembly import Assembly, Rng, continuous, pick
from artsim.making.outlines import FRONT, about
from artsim.making.solids import Solid, box, cylinder, ellipsoid, frame, hull, hull_of, prism, revolved, rod
from artsim.model.kinematics import Array

CLOCKWISE = np.array([1.0, 0.0, 0.0])
"""Axis of the hands: a turn about it takes the top to someone's right who looks at the face."""
GAP = 0.001
DENSITY = 500.0


def outline(kind: str, half: float, tall: float = 1.0) -> Array:
    """Points (N, 2) along Y and Z of a case's front, about the middle of the face; ``tall`` stretches it upright."""
    if kind == "square":
        return half * np.array([(-1.0, -tall), (1.0, -tall), (1.0, tall), (-1.0, tall)])
    sides = {"round": 32, "octagon": 8, "hexagon": 6, "dodecagon": 12}[kind]
    angles = (np.arange(sides) + 0.5) * (2.0 * np.pi / sides)
    points: Array = half * np.stack([cos(angles), tall * sin(angles)], axis=1)
    return points


def marks(rng: Rng, radius: float) -> Solid:
    """Marks of the hours on a face at x = 0: bars, dots, or four large ones."""
    kind = pick(rng, ["bars", "dots", "four", "mixed"])
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
        at = 0.86 * radius * out
        if kind == "dots":
            solid += cylinder(at + (0.001, 0, 0), at - (0.0015, 0, 0), size * (1.5 if main else 1.0), sections=8)
            continue
        wide = size * (1.4 if main and kind == "mixed" else 1.0)
        reach = long * (1.6 if main else 1.0)
        ends = [at + u * wide * across + v * reach * out + (w, 0, 0) for u in (-0.5, 0.5) for v in (-1.0, 0.25)
                for w in (-0.0012, 0.001)]  # fmt: skip
        solid += hull(np.array(ends))
    return solid


def add_hands(rng: Rng, clock: Assembly, radius: float, parent: str) -> float:
    """Add hour, minute and by chance a second hand before a face at x = 0; returns where they end in front."""
    kind = pick(rng, ["bar", "lance", "spade", "dart"])
    thick = max(0.012 * radius, 0.0008)
    gap = max(0.006 * radius, 0.0005)
    wide = radius * rng.uniform(0.035, 0.1)
    hub = radius * rng.uniform(0.05, 0.09)
    names = ["hour_hand", "minute_hand"] + (["second_hand"] if rng.random() < 0.5 else [])
    lengths = [rng.uniform(0.45, 0.6), rng.uniform(0.7, 0.9), rng.uniform(0.72, 0.92)]
    x = 0.0
    for number, name in enumerate(names):
        thin = number == 2
        long = lengths[number] * radius
        w = wide * (0.3 if thin else 1.0 - 0.2 * number)
        tail = long * rng.choice([0.0, rng.uniform(0.1, 0.3)])
        low, high = x - gap - thick, x - gap
        solid = rod((low, high), 0, 0, hub * (1.0 - 0.2 * number), sections=14)
        solid += _hand("bar" if thin else kind, low, high, w, long, tail)
        turned = solid.turned(CLOCKWISE, rng.uniform(0.0, 2.0 * np.pi))
        clock.add(name, turned, continuous(parent, CLOCKWISE, (low, 0, 0)), label="hand", density=2000.0)
        x = low
    return x


def _hand(kind: str, low: float, high: float, wide: float, long: float, tail: float) -> Solid:
    """A hand that points up from the origin."""

    def plate(points: list[tuple[float, float]]) -> Solid:
        return prism(np.array(points), low, high, 0)

    back = (
        plate([(-0.5 * wide, -tail), (0.5 * wide, -tail), (0.6 * wide, 0.0), (-0.6 * wide, 0.0)]) if tail else Solid()
    )
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


def dial_plate(rng: Rng, radius: float) -> Solid:
    """A round plate whose front is the plane x = 0, with the marks of the hours."""
    return rod((0, 0.004), 0, 0, radius, sections=32) + marks(rng, radius)


def rim(rng: Rng, radius: float, wide: float, rise: float) -> Solid:
    """A ring around a face at x = 0, which stands out by ``rise``: bevelled or flat."""
    inner = rng.uniform(0.3, 1.0) * rise
    section = [(radius, -0.003), (radius + wide, -0.003), (radius + wide, inner), (radius, rise)]
    if rng.random() < 0.5:
        section[2], section[3] = (radius + wide, rise), (radius, inner)
    return revolved(section, (0.003, 0, 0), FRONT, 28)


def pendulum(rng: Rng, x: float, top: float, length: float, room: float) -> tuple[Solid, float]:
    """A rod with a bob that hangs from height ``top``; and how far it may swing in a case of half width ``room``."""
    bob = min(length * rng.uniform(0.1, 0.22), 0.55 * room)
    z = top - length + bob
    thin = max(0.008 * length, 0.0012)
    solid = rod(x - 0.5 * thin, 0, (top, z), thin, sections=8)
    kind = pick(rng, ["disc", "lens", "bar", "drop"])
    thick = max(0.12 * bob, 0.002)
    if kind == "disc":
        solid += rod((x - thick, x + thick), 0, z, bob, sections=24)
    elif kind == "lens":
        solid += ellipsoid((x, 0, z), (1.5 * thick, bob, bob), 18)
    elif kind == "bar":
        solid += rod(x, 0, (z + bob, z - bob), max(0.35 * bob, thin), sections=14)
    else:
        solid += hull_of(ellipsoid((x, 0, z - 0.3 * bob), (1.5 * thick, 0.7 * bob, 0.7 * bob), 14),
                         box((x - thin, -thin, z), (x + thin, thin, z + bob)))  # fmt: skip
    swing = min(0.7 * (room - bob) / length, 0.45)
    return solid, max(swing, 0.03)


def glass_door(rng: Rng, clock: Assembly, x: float, across: tuple[float, float], upright: tuple[float, float]) -> None:
    """A frame before an opening at ``x``, hinged at its left or right."""
    thick = rng.uniform(0.006, 0.012)
    low, high = (x - GAP - thick, across[0], upright[0]), (x - GAP, across[1], upright[1])
    bar = rng.uniform(0.1, 0.2) * (across[1] - across[0])
    door = frame(low, high, [bar] * 4)
    if rng.random() < 0.3:
        middle = 0.5 * (upright[0] + upright[1])
        deep = (low[0] + 0.002, high[0] - 0.002)
        door += box(deep, (across[0] + 0.5 * bar, across[1] - 0.5 * bar), about(middle, 0.3 * bar))
    left = rng.random() < 0.5
    y = across[0] + 0.5 * bar if left else across[1] - 0.5 * bar
    spot = np.array([low[0], y, 0.5 * (upright[0] + upright[1])])
    door += cylinder(spot + (0.001, 0, 0), spot - (0.01, 0, 0), 0.3 * bar, sections=12)
    edge = across[1] if left else across[0]
    clock.add("door", door, side_hinge(low[0], edge, rng.uniform(1.0, 2.0), left), density=DENSITY)
