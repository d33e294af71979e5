"""Telephones: mobile ones that stand upright with their face towards -X, and desk sets.

What varies: the kind (bar, flip, slider, swivel, folding screen, smartphone, cordless in its dock, desk set with a
handset); proportions, round edges, bent backs; keypads and their keys, function and side keys; antennas, kickstands,
battery covers, cameras; on desk sets the slope, a dial in place of keys, a display that tilts, the handset's shape.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from artsim.common.elementary import cos, exp, sin
from artsim.families.keys import (
    Face,
    add_key,
    cross_sections,
    front_face,
    key_cells,
    key_outline,
)
from artsim.making.assembly import Assembly, JointSpec, prismatic, revolute
from artsim.making.solids import Solid, box, cylinder, hull, loft, ring, rounded_box, tube, union
from artsim.model.kinematics import Array

GAP = 0.0005
KINDS = ("bar", "flip", "slider", "swivel", "fold", "smartphone", "cordless", "desk")


def build(rng: np.random.Generator) -> Assembly:
    """A telephone; closed, its handset in place and no key pressed at rest."""
    kind = str(rng.choice(KINDS, p=[0.15, 0.17, 0.12, 0.07, 0.08, 0.1, 0.11, 0.2]))
    phone = Assembly()
    if kind == "desk":
        _desk(rng, phone)
    elif kind == "cordless":
        _cordless(rng, phone)
    else:
        {"bar": _bar, "flip": _flip, "slider": _slider, "swivel": _swivel, "fold": _fold, "smartphone": _smartphone}[
            kind
        ](rng, phone)
    return phone


def _slab(
    rng: np.random.Generator, half: float, x: tuple[float, float], z: tuple[float, float], curve: int = 0
) -> Solid:
    """Upright plate with round edges; where ``curve`` is 1 its back (+X) bulges, where it is -1 its front does."""
    levels = np.array([0.0, 0.03, 0.2, 0.5, 0.8, 0.97, 1.0])
    corner = rng.uniform(0.0, 0.35) * np.array([1.0, 0.3, 0.0, 0.0, 0.0, 0.3, 1.0])
    waist = rng.uniform(-0.12, 0.12) * rng.choice([0.0, 1.0]) * np.array([0.0, 0.05, 0.6, 1.0, 0.6, 0.05, 0.0])
    thick = x[1] - x[0]
    bow = (
        rng.uniform(0.1, 0.7)
        * thick
        * rng.choice([0.0, 1.0])
        * np.array([1.0, 0.9, 0.4, rng.uniform(0.0, 0.3), 0.4, 0.9, 1.0])
    )
    fronts, backs = np.full(7, x[0]), np.full(7, x[1])
    if curve > 0:
        backs = backs - bow
    elif curve < 0:
        fronts = fronts + bow
    halves = half * (1.0 - corner - np.abs(waist))
    return loft(cross_sections(z[0] + levels * (z[1] - z[0]), fronts, backs, halves, rng.uniform(0.1, 0.8)))


def _keypad(
    rng: np.random.Generator, phone: Assembly, parent: str, face: Face, half: float, v: tuple[float, float],
    height: float, first: int = 0,
) -> int:  # fmt: skip
    """Keys in three or four columns over a part of a face, function keys above them; returns the next free number."""
    kind = str(rng.choice(["square", "pill", "round"]))
    columns, rows = (3, 4) if rng.random() < 0.7 else (int(rng.integers(3, 6)), int(rng.integers(2, 5)))
    fill = rng.uniform(0.6, 0.9, 2)
    travel = min(rng.uniform(0.0003, 0.0006), height - 0.0008)
    number, low, high = first, v[0], v[1]
    if rng.random() < 0.7:
        split = high - (high - low) * rng.uniform(0.15, 0.3)
        number = _functions(rng, phone, parent, face, half, (split, high), height, number)
        high = split
    pitch = np.array([2.0 * half / columns, (high - low) / rows])
    outline = key_outline(kind, np.minimum(fill * pitch, 2.2 * pitch.min()), 10)
    for _, _, a, b in key_cells((-half, half), (low, high), columns, rows):
        add_key(phone, parent, f"button_{number}", face, (a, b), outline, height, travel, 0.2)
        number += 1
    return number


def _functions(
    rng: np.random.Generator, phone: Assembly, parent: str, face: Face, half: float, v: tuple[float, float],
    height: float, number: int,
) -> int:  # fmt: skip
    """Two keys with a larger one between them; returns the next free number."""
    travel, deep, middle = 0.0003, v[1] - v[0], 0.5 * (v[0] + v[1])
    wide = 0.5 * half
    big = key_outline(str(rng.choice(["round", "pill", "square"])), (min(0.8 * half, 1.4 * deep), 0.85 * deep), 14)
    small = key_outline(str(rng.choice(["round", "pill", "square"])), (0.8 * wide, 0.5 * deep), 10)
    for u, outline in ((-0.75 * half, small), (0.0, big), (0.75 * half, small)):
        add_key(phone, parent, f"button_{number}", face, (u, middle), outline, height, travel, 0.15)
        number += 1
    return number


def _side_keys(rng: np.random.Generator, phone: Assembly, parent: str, half: float, x: float, z: tuple[float, float],
               thick: float, sides: Sequence[float] = (-1.0, 1.0)) -> None:  # fmt: skip
    """Keys on the right (-1) and left (1) edges of an upright body."""
    for side in sides:
        face = Face(np.array([x, side * half, 0.0]), np.array([-side, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        for k in range(int(rng.integers(0, 3))):
            v = z[0] + (0.62 + 0.14 * k) * (z[1] - z[0])
            outline = key_outline("pill", (0.3 * thick, rng.uniform(0.05, 0.11) * (z[1] - z[0])), 8)
            name = f"{'left' if side > 0 else 'right'}_key_{k}"
            add_key(phone, parent, name, face, (0.0, v), outline, 0.0014, 0.0004)


def _size(rng: np.random.Generator) -> tuple[float, float, float]:
    """Length, half of the width and thickness of a mobile phone."""
    length = 0.12 * exp(rng.uniform(-0.45, 0.7))
    half = 0.5 * length * rng.triangular(0.28, 0.45, 0.72)
    return length, half, length * rng.triangular(0.06, 0.13, 0.36)


def _aerial(rng: np.random.Generator, phone: Assembly, half: float, x: float, length: float, thick: float) -> None:
    """A rod along one side that swings up about its upper end, on some."""
    if rng.random() < 0.7:
        return
    radius = min(rng.uniform(0.0015, 0.004), 0.4 * thick)
    side = float(rng.choice([-1.0, 1.0]))
    y, z = side * (half + radius + 0.002), 0.93 * length  # clear of keys on the edge
    rod = cylinder((x, y, z), (x, y, z - length * rng.uniform(0.4, 0.85)), radius, sections=12)
    rod += cylinder((x, y - side * radius, z), (x, y + 0.5 * side * radius, z), 1.4 * radius, sections=14)
    turn = revolute("body", (0, float(rng.choice([-1.0, 1.0])), 0), (x, y, z), 0.0, rng.uniform(1.6, 3.14))
    phone.add("antenna", rod, turn, density=2000.0)


def _stand(rng: np.random.Generator, phone: Assembly, half: float, x: float, length: float) -> None:
    """A leaf on the back that folds out, on some."""
    if rng.random() < 0.75:
        return
    thick, z = 0.0015, length * rng.uniform(0.4, 0.65)
    wide, low = half * rng.uniform(0.3, 0.8), length * rng.uniform(0.03, 0.2)
    leaf = rounded_box((x + GAP, -wide, low), (x + GAP + thick, wide, z), 0.004, axis=0, steps=2)
    hinge = revolute("body", (0, -1, 0), (x + GAP, 0, z), 0.0, rng.uniform(0.5, 1.5))
    phone.add("stand", leaf, hinge, density=1500.0)


def _bar(rng: np.random.Generator, phone: Assembly) -> None:
    """One piece with keys below a display."""
    length, half, thick = _size(rng)
    body = _slab(rng, half, (0.0, thick), (0.0, length), 1)
    split = length * rng.uniform(0.42, 0.68)
    inner = 0.72 * half
    body += box((-0.0006, -inner, split + 0.04 * length), (0.001, inner, 0.9 * length))
    if rng.random() < 0.35:  # a stub of an antenna
        y, top = rng.choice([-0.6, 0.6]) * half, length * rng.uniform(1.08, 1.35)
        body += cylinder((0.5 * thick, y, 0.9 * length), (0.5 * thick, y, top), 0.3 * thick, 0.22 * thick, 12)
    phone.add("body", body, density=1300.0)
    height = rng.uniform(0.0011, 0.0026)
    _keypad(rng, phone, "body", front_face(0.0), inner, (0.1 * length, split), height)
    _side_keys(rng, phone, "body", half, 0.5 * thick, (0.0, length), thick)
    _aerial(rng, phone, half, 0.5 * thick, length, thick)
    _stand(rng, phone, half, thick, length)


def _lid_height(rng: np.random.Generator) -> float:
    """How far the keys under a lid stand out."""
    return rng.uniform(0.001, 0.0016)


def _flip(rng: np.random.Generator, phone: Assembly) -> None:
    """A lid with the display before the keys, hinged at the top (or, at times, half-way up)."""
    length, half, thick = _size(rng)
    length *= 0.8
    lower = thick * rng.uniform(0.45, 0.65)
    upper = thick - lower
    height = _lid_height(rng)
    plane = -height - GAP  # the hinge's axis lies in the back of the lid
    radius = 0.45 * min(upper, lower) + 0.001
    top = length * rng.uniform(0.72, 1.0)
    pivot = top - radius - GAP
    span = half * rng.uniform(0.35, 0.7)
    body = _slab(rng, half, (0.0, lower), (0.0, top - 2.0 * radius - 2.0 * GAP), 1)
    knuckle = plane + radius
    for s in (-1.0, 1.0):
        first, last = sorted((s * (span + GAP), s * half * 0.98))
        body += cylinder((plane, first, pivot), (plane, last, pivot), radius, sections=16)
        body += box((plane + 0.0003, first, top - 4.0 * radius), (max(lower * 0.5, knuckle), last, pivot))
    phone.add("body", body, density=1300.0)
    bottom = rng.uniform(0.0, 0.45) * top if rng.random() < 0.3 else 0.0
    lid = _slab(rng, half, (plane - upper, plane), (bottom, pivot - radius - GAP), -1)
    lid += cylinder((plane, GAP - span, pivot), (plane, span - GAP, pivot), radius * 0.9, sections=16)
    lid += box((plane - min(upper, radius), GAP - span, pivot - 4.0 * radius), (plane, span - GAP, pivot))
    if rng.random() < 0.6:  # a small display on the outside
        z = bottom + rng.uniform(0.45, 0.7) * (pivot - bottom)
        size = 0.45 * half
        lid += rounded_box(
            (plane - upper - 0.0008, -size, z - size), (plane - 0.5 * upper, size, z + size), 0.3 * size, 0, 2
        )
    phone.add("lid", lid, revolute("body", (0, 1, 0), (plane, 0, pivot), 0.0, rng.uniform(1.6, 2.9)), density=1300.0)
    _keypad(rng, phone, "body", front_face(0.0), 0.8 * half, (0.08 * top, 0.78 * (top - 4.0 * radius)), height)
    _side_keys(rng, phone, "body", half, 0.5 * lower, (0.0, top - 4.0 * radius), lower)


def _slider(rng: np.random.Generator, phone: Assembly) -> None:
    """The half with the display slides off the keys, up or to the side."""
    length, half, thick = _size(rng)
    lower = thick * rng.uniform(0.4, 0.65)
    height = _lid_height(rng)
    plane = -height - GAP
    body = _slab(rng, half, (0.0, lower), (0.0, length), 1)
    sideways = rng.random() < 0.3
    travel = (half if sideways else 0.5 * length) * rng.uniform(0.7, 0.95)
    if sideways:
        body += union(
            box((plane + GAP, -0.5 * half, z), (0.001, 0.5 * half, z + 0.03 * length))
            for z in (0.02 * length, 0.95 * length)
        )
        keys = (0.12 * length, 0.88 * length)
    else:
        body += union(box((plane + GAP, y - 0.05 * half, 0.55 * length), (0.001, y + 0.05 * half, 0.95 * length))
                      for y in (-0.7 * half, 0.7 * half))  # fmt: skip
        keys = (0.06 * length, 0.47 * length)
    phone.add("body", body, density=1300.0)
    upper = thick - lower
    lid = _slab(rng, half, (plane - upper, plane), (0.0, length), -1)
    lid += box((plane - upper - 0.0005, -0.75 * half, 0.35 * length), (plane - 0.5 * upper, 0.75 * half, 0.88 * length))
    axis = (0, float(rng.choice([-1.0, 1.0])), 0) if sideways else (0, 0, 1)
    phone.add("lid", lid, prismatic("body", axis, 0.0, travel, (plane, 0, 0)), density=1300.0)
    number = _keypad(rng, phone, "body", front_face(0.0), 0.78 * half, keys, height)
    front = front_face(plane - upper)
    _functions(rng, phone, "lid", front, 0.7 * half, (0.08 * length, 0.24 * length), 0.0014, number)
    _side_keys(rng, phone, "body", half, 0.5 * lower, (0.0, length), lower)


def _swivel(rng: np.random.Generator, phone: Assembly) -> None:
    """The half with the display turns off the keys in its own plane."""
    length, half, thick = _size(rng)
    lower = thick * rng.uniform(0.4, 0.6)
    height = _lid_height(rng)
    plane = -height - GAP
    pivot = length - half * rng.uniform(0.8, 1.0)
    body = _slab(rng, half, (0.0, lower), (0.0, length), 1)
    body += cylinder((plane + GAP, 0, pivot), (0.001, 0, pivot), 0.7 * half, sections=20)
    phone.add("body", body, density=1300.0)
    upper = thick - lower
    lid = _slab(rng, half, (plane - upper, plane), (0.0, length), -1)
    lid += cylinder((plane - upper - 0.0006, 0, pivot), (plane, 0, pivot), 0.5 * half, sections=20)
    side = float(rng.choice([-1.0, 1.0]))
    turn = revolute("body", (side, 0, 0), (plane, 0, pivot), 0.0, rng.uniform(1.57, 3.2))
    phone.add("lid", lid, turn, density=1300.0)
    _keypad(rng, phone, "body", front_face(0.0), 0.78 * half, (0.06 * length, pivot - 0.75 * half), height)
    _side_keys(rng, phone, "body", half, 0.5 * lower, (0.0, length), lower)


def _fold(rng: np.random.Generator, phone: Assembly) -> None:
    """Two halves like a book's covers, hinged at one side."""
    length, half, thick = _size(rng)
    side = float(rng.choice([-1.0, 1.0]))
    leaf, gap = 0.5 * thick, rng.uniform(0.0008, 0.003)
    radius = 0.6 * leaf
    body = _slab(rng, half, (0.5 * gap, leaf), (0.0, length), 1)
    y = side * (half + radius + GAP)
    first = np.linspace(0.03, 0.97, 6) * length
    reach = sorted((side * 0.5 * half, y))
    for low, high in ((first[0], first[1]), (first[4], first[5])):
        body += cylinder((0, y, low), (0, y, high), radius, sections=16)
        body += box((0.5 * gap, reach[0], low), (0.5 * gap + 0.5 * (leaf - 0.5 * gap), reach[1], high))
    body += rounded_box(
        (leaf - 0.0005, -0.6 * half, 0.7 * length), (leaf + 0.0016, 0.1 * half, 0.95 * length), 0.3 * half, 0, 2
    )
    phone.add("body", body, density=1500.0)
    lid = _slab(rng, half, (-leaf, -0.5 * gap), (0.0, length), -1)
    lid += cylinder((0, y, first[1] + GAP), (0, y, first[4] - GAP), radius, sections=16)
    lid += box((-0.5 * leaf - 0.25 * gap, reach[0], first[1] + GAP), (-0.5 * gap, reach[1], first[4] - GAP))
    turn = revolute("body", (0, 0, -side), (0, y, 0), 0.0, rng.uniform(1.6, 3.1))
    phone.add("lid", lid, turn, density=1500.0)
    _side_keys(rng, phone, "body", half, 0.5 * leaf + 0.25 * gap, (0.0, length), leaf, (-side,))


def _smartphone(rng: np.random.Generator, phone: Assembly) -> None:
    """A display with keys on the edges, at times below it, and a camera on the back."""
    length, half, thick = _size(rng)
    length, thick = 1.25 * length, max(0.7 * thick, 0.006)
    body = _slab(rng, half, (0.0, thick), (0.0, length), 1)
    chin, brow = rng.uniform(0.02, 0.2), rng.uniform(0.02, 0.14)
    body += box((-0.0005, -0.92 * half, chin * length), (0.001, 0.92 * half, (1.0 - brow) * length))
    if rng.random() < 0.7:  # the camera's bump
        bump, size = rng.uniform(0.0008, 0.004), rng.uniform(0.15, 0.45) * half
        y, z = rng.choice([0.0, 0.45]) * half, 0.88 * length - size
        body += rounded_box((0.5 * thick, y - size, z - size), (thick + bump, y + size, z + size), 0.5 * size, 0, 2)
    phone.add("body", body, density=1800.0)
    if chin > 0.1:
        _functions(rng, phone, "body", front_face(0.0), 0.8 * half, (0.02 * length, (chin - 0.02) * length), 0.0013, 0)
    else:
        face = Face(np.array([0.5 * thick, 0.0, length]), np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0]))
        outline = key_outline("pill", (0.25 * half, 0.3 * thick), 8)
        add_key(phone, "body", "button_0", face, (0.6 * half, 0.0), outline, 0.0013, 0.0004)
    _side_keys(rng, phone, "body", half, 0.5 * thick, (0.0, length), thick)
    _stand(rng, phone, half, thick + 0.0045, length)


def _cordless(rng: np.random.Generator, phone: Assembly) -> None:
    """A handset that stands in a dock, and is drawn out upwards."""
    length, half, thick = _size(rng)
    length = 1.1 * length
    thick = max(thick, 0.016)
    floor, rise = 0.004 + 0.2 * thick, length * rng.uniform(0.12, 0.3)
    room = 0.0015
    size = np.array([2.0 * half * rng.uniform(1.3, 2.6), thick * rng.uniform(2.2, 5.0)])
    low, high = (-0.5 * size[1], -0.5 * size[0]), (0.5 * size[1], 0.5 * size[0])
    taper = rng.uniform(0.6, 0.95)
    dock = box((*low, 0.0), (*high, floor))
    opening = np.array([0.5 * thick + room, half + room])
    for s in (-1.0, 1.0):  # walls about the handset's foot
        for axis in (0, 1):
            near, far = s * opening[axis], s * (0.5 * size[1 - axis])
            across = opening[1] if axis == 0 else 0.5 * size[1]
            foot = np.array([(a, b) for a in (near, far) for b in (-across, across)])
            crown = np.array([(a, b) for a in (near, near + taper * 0.5 * (far - near)) for b in (-across, across)])
            points = [
                np.column_stack([ring_, np.full(4, z)]) for ring_, z in ((foot, floor - 1e-4), (crown, floor + rise))
            ]
            flat = np.concatenate(points)
            dock += hull(flat if axis == 0 else flat[:, [1, 0, 2]])
    phone.add("dock", dock, density=900.0)
    start = floor + GAP
    face = front_face(-0.5 * thick, 0.0, start)
    body = _slab(rng, half, (-0.5 * thick, 0.5 * thick), (start, start + length), 1)
    inner = 0.74 * half
    body += box((-0.5 * thick - 0.0005, -inner, start + 0.68 * length), (0.0, inner, start + 0.9 * length))
    if rng.random() < 0.4:
        y = rng.choice([-0.6, 0.6]) * half
        body += cylinder(
            (0, y, start + 0.9 * length),
            (0, y, start + length * rng.uniform(1.08, 1.4)),
            0.25 * thick,
            0.18 * thick,
            12,
        )
    lift = prismatic("dock", (0, 0, 1), 0.0, length * rng.uniform(0.4, 1.2), (0, 0, start))
    phone.add("handset", body, lift, density=900.0)
    _keypad(rng, phone, "handset", face, inner, (rise + 0.05 * length, 0.66 * length), rng.uniform(0.0011, 0.002))


# --- desk sets -------------------------------------------------------------------------------------------------------


def _desk(rng: np.random.Generator, phone: Assembly) -> None:
    """A sloping base with keys or a dial, and a handset across its left side or along its back."""
    depth, width = rng.uniform(0.14, 0.26), rng.uniform(0.13, 0.3)
    front, back = rng.uniform(0.012, 0.04), rng.uniform(0.03, 0.13)
    back = max(back, front)
    inset = rng.uniform(0.0, 0.18) * min(width, depth)
    reach = depth - inset  # of the deck
    slope = np.array([reach, 0.0, back - front]) / np.sqrt(reach**2 + (back - front) ** 2)
    corners = [(x, y) for x in (-0.5 * depth, 0.5 * depth) for y in (-0.5 * width, 0.5 * width)]
    upper = [
        (x * (1 - inset / depth), y * (1 - inset / width), front + (x / depth + 0.5) * (back - front))
        for x, y in corners
    ]
    base = hull([(x, y, z) for x, y in corners for z in (0.0, 0.3 * front)] + upper)
    across = rng.random() < 0.4  # the handset lies along the back
    grip = rng.uniform(0.018, 0.03)
    deck = Face(np.array([-0.5 * reach, 0.0, front]), np.array([0.0, -1.0, 0.0]), slope)
    run = reach / slope[0]
    if across:
        length = max(width * rng.uniform(0.8, 1.15), 0.15)
        middle = deck.at(0.0, run - 1.4 * grip)
        along = np.array([0.0, 1.0, 0.0])
        keys_u, keys_v = (-0.42, 0.42), (0.1, 1.0 - 3.2 * grip / run)
    else:
        length = max(run * rng.uniform(0.85, 1.15), 0.15)
        middle = deck.at(-0.5 * width + 1.3 * grip + 0.5 * inset, 0.5 * run)
        along = slope
        keys_u, keys_v = (-0.5 + (3.0 * grip + 0.5 * inset) / width, 0.42), (0.1, 0.9)
    out = deck.outward
    side = np.cross(out, along)
    lift = rng.uniform(0.006, 0.022)
    for s in (-1.0, 1.0):  # the cradle
        spot = middle + s * 0.33 * length * along
        base += hull([spot + a * 0.4 * grip * along + b * grip * w * side + z * out for a in (-1, 1) for b in (-1, 1)
                      for z, w in ((-0.004, 0.9), (lift, 0.7))])  # fmt: skip
    phone.add("base", base, density=700.0)
    _handset(rng, phone, middle + (lift + GAP) * out, along, side, out, length, grip)
    u0, u1 = keys_u[0] * width, (keys_u[1] * width - 0.5 * inset)
    v0, v1 = keys_v[0] * run, keys_v[1] * run
    middle_u, half = 0.5 * (u0 + u1), 0.5 * (u1 - u0)
    shifted = Face(deck.at(middle_u, 0.0), deck.right, deck.up)
    if rng.random() < 0.25:
        _dial(rng, phone, shifted, 0.5 * (v0 + v1), min(half, 0.5 * (v1 - v0), 0.045))
        return
    split = v0 + (v1 - v0) * rng.uniform(0.55, 0.95)
    deep = min(split - v0, rng.uniform(1.2, 2.4) * half * 2)
    _keypad(
        rng, phone, "base", shifted, half * rng.uniform(0.7, 0.95), (split - deep, split), rng.uniform(0.0015, 0.005)
    )
    room = v1 - split
    if room > 0.02:
        _display(rng, phone, shifted, split + 0.12 * room, 0.8 * room, 0.9 * half)


def _handset(
    rng: np.random.Generator, phone: Assembly, foot: Array, along: Array, side: Array, out: Array, length: float,
    grip: float,
) -> None:  # fmt: skip
    """A bar between two round or square ends that lie on the cradle; it is lifted off."""
    thick = grip * rng.uniform(0.7, 1.2)
    bow = rng.uniform(0.1, 0.9) * thick
    square = rng.random() < 0.5
    shares = np.linspace(-1.0, 1.0, 7)
    rings = []
    for s in shares:
        rise = thick + bow * (1.0 - s * s)
        center = foot + 0.5 * s * length * along + rise * out
        wide = grip * (0.75 + 0.25 * s * s)
        rings.append(
            np.array(
                [center + a * wide * side + b * 0.5 * thick * out for a, b in ((-1, -1), (1, -1), (0.7, 1), (-0.7, 1))]
            )
        )
    solid = loft(rings)
    for s in (-1.0, 1.0):
        center = foot + s * 0.5 * (length - 1.9 * grip) * along
        if square:
            solid += hull(
                [
                    center + a * 0.95 * grip * along + b * grip * w * side + z * out
                    for a in (-1, 1)
                    for b in (-1, 1)
                    for z, w in ((0.0, 0.9), (0.9 * thick, 1.0))
                ]
            )
        else:
            solid += cylinder(center, center + 0.9 * thick * out, 0.95 * grip, 0.8 * grip, 20)
    phone.add("handset", solid, prismatic("base", out, 0.0, rng.uniform(0.06, 0.2), tuple(foot)), density=500.0)


def _dial(rng: np.random.Generator, phone: Assembly, face: Face, v: float, radius: float) -> None:
    """A dial with ten holes that turns."""
    center, out = face.at(0.0, v, 0.001), face.outward
    thick = rng.uniform(0.0025, 0.006)
    solid = cylinder(center, center + 0.4 * thick * out, radius, sections=30)
    rim = [(0.86, 1.0), (0.3, 0.5)]
    for inner, outer in rim:
        solid += ring(center + 0.5 * thick * out, out, inner * radius, outer * radius, thick, 24)
    for k in range(11):
        angle = 0.5 * k
        spoke = cos(angle) * face.right + sin(angle) * face.up
        solid += tube(
            [center + 0.6 * thick * out + 0.45 * radius * spoke, center + 0.6 * thick * out + 0.9 * radius * spoke],
            0.35 * thick,
            6,
        )
    phone.add("dial", solid, revolute("base", -out, tuple(center), 0.0, rng.uniform(4.2, 5.4)), density=1200.0)


def _display(rng: np.random.Generator, phone: Assembly, face: Face, v: float, deep: float, half: float) -> None:
    """A display above the keys, hinged at its lower edge."""
    thick = rng.uniform(0.006, 0.012)
    corners = [face.at(u, w, h) for u in (-half, half) for w in (v, v + deep) for h in (0.001, thick)]
    solid = hull(corners)
    inner = [face.at(u, w, h) for u in (-0.85 * half, 0.85 * half) for w in (v + 0.15 * deep, v + 0.85 * deep)
             for h in (0.5 * thick, thick + 0.0006)]  # fmt: skip
    hinge: JointSpec = revolute("base", face.right, tuple(face.at(0.0, v, 0.001)), 0.0, rng.uniform(0.4, 1.2))
    phone.add("display", solid + hull(inner), hinge, density=900.0)
