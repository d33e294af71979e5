"""What clocks have in common: faces with marks, rims, hands, pendulums, glass doors."""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.details import side_hinge
from artsim.making.assembly import Assembly, JointSpec, continuous, revolute
from artsim.making.draws import Draws, Interval
from artsim.making.outlines import FRONT, Array, about, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, frame, hull, hull_of, prism, revolved, rod, union

CLOCKWISE = np.array([1.0, 0.0, 0.0])
"""Axis of the hands: a turn about it takes the top to someone's right who looks at the face."""
GAP = 0.001
DENSITY = 500.0
HANDS = {
    "bar": [[(-0.5, 0.0), (0.5, 0.0), (0.4, 1.0), (-0.4, 1.0)]],
    "lance": [[(-0.35, 0.0), (0.35, 0.0), (0.8, 0.65), (0.0, 1.0), (-0.8, 0.65)]],
    "spade": [
        [(-0.35, 0.0), (0.35, 0.0), (0.35, 0.8), (-0.35, 0.8)],
        [(0.0, 0.55), (1.5, 0.68), (0.9, 0.8), (0.0, 1.0), (-0.9, 0.8), (-1.5, 0.68)],
    ],
    "dart": [[(-1.0, 0.0), (1.0, 0.0), (0.0, 1.0)]],
}
"""Outlines of hands that point up: shares of their width and length."""


def outline(kind: str, half: float, tall: float = 1.0) -> Array:
    """Points (N, 2) along Y and Z of a case's front, about the middle of the face; ``tall`` stretches it upright."""
    if kind == "square":
        return half * np.array([(-1.0, -tall), (1.0, -tall), (1.0, tall), (-1.0, tall)])
    sides = {"round": 32, "octagon": 8, "hexagon": 6, "dodecagon": 12}[kind]
    angles = (np.arange(sides) + 0.5) * (2.0 * np.pi / sides)
    points: Array = half * np.stack([cos(angles), tall * sin(angles)], axis=1)
    return points


def dial_plate(draws: Draws, radius: float) -> Solid:
    """A round plate whose front is the plane x = 0, with the marks of the hours: bars, dots, or four large ones."""
    kind = draws.pick("marks", ["bars", "dots", "four", "mixed"])
    size, long = draws.lengths(mark_width=(0.02, 0.04), mark_length=(0.05, 0.11), of=radius)
    solid = rod((0, 0.004), 0, 0, radius, sections=32)
    for hour, a in enumerate(turns(12)):
        main = hour % 3 == 0
        out, across = np.array([0.0, -sin(a), cos(a)]), np.array([0.0, cos(a), sin(a)])
        at = 0.86 * radius * out
        if kind == "dots":
            solid += cylinder(at + (0.001, 0, 0), at - (0.0015, 0, 0), size * (1.5 if main else 1.0), sections=8)
        elif main or kind != "four":
            wide = size * (1.4 if main and kind == "mixed" else 1.0)
            reach = long * (1.6 if main else 1.0)
            solid += hull([at + u * wide * across + v * reach * out + (w, 0, 0) for u in (-0.5, 0.5)
                           for v in (-1.0, 0.25) for w in (-0.0012, 0.001)])  # fmt: skip
    return solid


def add_hands(draws: Draws, clock: Assembly, radius: float, parent: str = "body") -> float:
    """Add hour, minute and by chance a second hand before a face at x = 0; returns where they end in front."""
    kind = draws.pick("hand_shape", list(HANDS))
    thick = max(0.012 * radius, 0.0008)
    gap = max(0.006 * radius, 0.0005)
    wide, hub = draws.lengths(hand_width=(0.035, 0.1), hand_hub=(0.05, 0.09), of=radius)
    names = ["hour_hand", "minute_hand"] + (["second_hand"] if draws.chance("second_hand", 0.5) else [])
    lengths = {"hour_hand": (0.45, 0.6), "minute_hand": (0.7, 0.9), "second_hand": (0.72, 0.92)}
    drawn = [draws.length(f"{name}_length", usual, of=radius) for name, usual in lengths.items()]
    x = 0.0
    for number, name in enumerate(names):
        thin = number == 2
        long = drawn[number]
        w = wide * (0.3 if thin else 1.0 - 0.2 * number)
        tail = draws.length(f"{name}_tail", (0.1, 0.3), of=long)
        tail *= draws.pick(f"{name}_has_tail", [False, True])
        low, high = x - gap - thick, x - gap
        outlines = [np.array(points) * (w, long) for points in HANDS["bar" if thin else kind]]
        if tail:
            outlines.insert(0, np.array([(-0.5 * w, -tail), (0.5 * w, -tail), (0.6 * w, 0.0), (-0.6 * w, 0.0)]))
        solid = rod((low, high), 0, 0, hub * (1.0 - 0.2 * number), sections=14)
        solid += union(prism(points, low, high, 0) for points in outlines)
        turned = solid.turned(CLOCKWISE, draws.angle(f"{name}_angle", (0.0, 2.0 * np.pi)))
        clock.add(name, turned, continuous(parent, CLOCKWISE, (low, 0, 0)), label="hand", density=2000.0)
        x = low
    return x


def rim(draws: Draws, radius: float, wide: float, rise: float) -> Solid:
    """A ring around a face at x = 0, which stands out by ``rise``: bevelled or flat."""
    inner = draws.length("rim_edge", (0.3, 1.0), of=rise)
    section = [(radius, -0.003), (radius + wide, -0.003), (radius + wide, inner), (radius, rise)]
    if draws.chance("rim_falls_inward", 0.5):
        section[2], section[3] = (radius + wide, rise), (radius, inner)
    return revolved(section, (0.003, 0, 0), FRONT, 28)


def pendulum(draws: Draws, x: float, top: float, length: float, room: float) -> tuple[Solid, JointSpec]:
    """A rod with a bob that hangs from height ``top``; its joint swings within a case of half width ``room``."""
    bob = min(draws.length("bob_radius", (0.1, 0.22), of=length), 0.55 * room)
    z = top - length + bob
    thin = max(0.008 * length, 0.0012)
    solid = rod(x - 0.5 * thin, 0, (top, z), thin, sections=8)
    kind = draws.pick("bob", ["disc", "lens", "bar", "drop"])
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
    swing = max(min(0.7 * (room - bob) / length, 0.45), 0.03)
    return solid, revolute("body", FRONT, (x, 0, top), -swing, swing)


def glass_door(draws: Draws, clock: Assembly, x: float, across: Interval, upright: Interval) -> None:
    """A frame before an opening at ``x``, hinged at its left or right."""
    draws = draws.within("door")
    thick = draws.length("thickness", (0.006, 0.012))
    low, high = (x - GAP - thick, across[0], upright[0]), (x - GAP, across[1], upright[1])
    bar = draws.length("frame", (0.1, 0.2), of=across[1] - across[0])
    door = frame(low, high, [bar] * 4)
    middle = 0.5 * (upright[0] + upright[1])
    if draws.chance("crossbar", 0.3):
        deep = (low[0] + 0.002, high[0] - 0.002)
        door += box(deep, (across[0] + 0.5 * bar, across[1] - 0.5 * bar), about(middle, 0.3 * bar))
    left = draws.chance("hinged_left", 0.5)
    edge, y = (across[1], across[0] + 0.5 * bar) if left else (across[0], across[1] - 0.5 * bar)
    door += rod((low[0] + 0.001, low[0] - 0.01), y, middle, 0.3 * bar, sections=12).called("knob", FRONT)
    clock.add("door", door, side_hinge(low[0], edge, draws.angle("angle", (1.0, 2.0)), left), density=DENSITY)
