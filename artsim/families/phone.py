"""Telephones: mobile ones that stand upright with their face towards -X, and desk sets.

What varies: the kind (bar, flip, slider, swivel, folding screen, smartphone, cordless in its dock, desk set with a
handset); proportions, round edges, bent backs; keypads and their keys, function and side keys; antennas, kickstands,
cameras; on desk sets the slope, a dial in place of keys, a display that tilts, the handset's shape.
"""

from collections.abc import Sequence

import numpy as np

from artsim.common.elementary import exp
from artsim.families.desk_phone import desk_set
from artsim.families.keys import Face, add_function_keys, add_key, add_keypad, cross_sections, front_face, key_outline
from artsim.making.assembly import Assembly, Rng, pick, prismatic, revolute
from artsim.making.outlines import about, lifted
from artsim.making.solids import Solid, box, hull, loft, rod, union

GAP = 0.0005
UNDER_LID = (0.001, 0.0016)
"""How far keys under a lid stand out, metres."""


def build(rng: Rng) -> Assembly:
    """A telephone; closed, its handset in place and no key pressed at rest."""
    kinds = {_bar: 0.15, _flip: 0.17, _slider: 0.12, _swivel: 0.07, _fold: 0.08, _smartphone: 0.1, _cordless: 0.11,
             desk_set: 0.2}  # fmt: skip
    phone = Assembly(density=1300.0)
    pick(rng, kinds)(rng, phone)
    return phone


def _slab(rng: Rng, half: float, x: tuple[float, float], z: tuple[float, float], curve: int = 0) -> Solid:
    """Upright plate with round edges; where ``curve`` is 1 its back (+X) bulges, where it is -1 its front does."""
    levels = np.array([0.0, 0.03, 0.2, 0.5, 0.8, 0.97, 1.0])
    corner = rng.uniform(0.0, 0.35) * np.array([1.0, 0.3, 0.0, 0.0, 0.0, 0.3, 1.0])
    waist = rng.uniform(-0.12, 0.12) * rng.choice([0.0, 1.0]) * np.array([0.0, 0.05, 0.6, 1.0, 0.6, 0.05, 0.0])
    thick = x[1] - x[0]
    bow = rng.uniform(0.1, 0.7) * thick * rng.choice([0.0, 1.0])
    bow = bow * np.array([1.0, 0.9, 0.4, rng.uniform(0.0, 0.3), 0.4, 0.9, 1.0])
    fronts, backs = np.full(7, x[0]), np.full(7, x[1])
    if curve > 0:
        backs = backs - bow
    elif curve < 0:
        fronts = fronts + bow
    halves = half * (1.0 - corner - np.abs(waist))
    return loft(cross_sections(z[0] + levels * (z[1] - z[0]), fronts, backs, halves, rng.uniform(0.1, 0.8)))


def _side_keys(rng: Rng, phone: Assembly, half: float, x: float, z: tuple[float, float],
               thick: float, sides: Sequence[float] = (-1.0, 1.0)) -> None:  # fmt: skip
    """Keys on the right (-1) and left (1) edges of an upright body."""
    for side in sides:
        face = Face(np.array([x, side * half, 0.0]), np.array([-side, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        for k in range(int(rng.integers(0, 3))):
            v = z[0] + (0.62 + 0.14 * k) * (z[1] - z[0])
            outline = key_outline("pill", (0.3 * thick, rng.uniform(0.05, 0.11) * (z[1] - z[0])), 8)
            name = f"{'left' if side > 0 else 'right'}_key_{k}"
            add_key(phone, "body", name, face, (0.0, v), outline, 0.0014, 0.0004)


def _size(rng: Rng) -> tuple[float, float, float]:
    """Length, half of the width and thickness of a mobile phone."""
    length = 0.12 * exp(rng.uniform(-0.45, 0.7))
    half = 0.5 * length * rng.triangular(0.28, 0.45, 0.72)
    return length, half, length * rng.triangular(0.06, 0.13, 0.36)


def _aerial(rng: Rng, phone: Assembly, half: float, x: float, length: float, thick: float) -> None:
    """A rod along one side that swings up about its upper end, on some."""
    if rng.random() < 0.55:
        return
    radius = min(rng.uniform(0.0015, 0.004), 0.4 * thick)
    side = float(rng.choice([-1.0, 1.0]))
    y, z = side * (half + radius + 0.002), 0.93 * length  # clear of keys on the edge
    stalk = rod(x, y, (z, z - length * rng.uniform(0.4, 0.85)), radius, sections=12)
    stalk += rod(x, (y - side * radius, y + 0.5 * side * radius), z, 1.4 * radius, sections=14)
    turn = revolute("body", (0, float(rng.choice([-1.0, 1.0])), 0), (x, y, z), 0.0, rng.uniform(1.6, 3.14))
    phone.add("antenna", stalk, turn, density=2000.0)


def _stand(rng: Rng, phone: Assembly, half: float, x: float, length: float) -> None:
    """A leaf on the back that folds out, on some."""
    if rng.random() < 0.55:
        return
    thick, z = 0.0015, length * rng.uniform(0.4, 0.65)
    wide, low = half * rng.uniform(0.3, 0.8), length * rng.uniform(0.03, 0.2)
    leaf = box((x + GAP, x + GAP + thick), wide, (low, z), fillet=0.004, axis=0, steps=2)
    phone.add("stand", leaf, revolute("body", (0, -1, 0), (x + GAP, 0, z), 0.0, rng.uniform(0.5, 1.5)), density=1500.0)


def _bar(rng: Rng, phone: Assembly) -> None:
    """One piece with keys below a display."""
    length, half, thick = _size(rng)
    body = _slab(rng, half, (0.0, thick), (0.0, length), 1)
    split = length * rng.uniform(0.42, 0.68)
    inner = 0.72 * half
    body += box((-0.0006, 0.001), inner, (split + 0.04 * length, 0.9 * length))
    if rng.random() < 0.35:  # a stub of an antenna
        y, top = rng.choice([-0.6, 0.6]) * half, length * rng.uniform(1.08, 1.35)
        body += rod(0.5 * thick, y, (0.9 * length, top), 0.3 * thick, 0.22 * thick, 12)
    phone.add("body", body)
    height = rng.uniform(0.0011, 0.0026)
    add_keypad(rng, phone, "body", front_face(0.0), inner, (0.1 * length, split), height)
    _side_keys(rng, phone, half, 0.5 * thick, (0.0, length), thick)
    _aerial(rng, phone, half, 0.5 * thick, length, thick)
    _stand(rng, phone, half, thick, length)


def _flip(rng: Rng, phone: Assembly) -> None:
    """A lid with the display before the keys, hinged at the top (or, at times, half-way up)."""
    length, half, thick = _size(rng)
    length *= 0.8
    lower = thick * rng.uniform(0.45, 0.65)
    upper = thick - lower
    height = rng.uniform(*UNDER_LID)
    plane = -height - GAP  # the hinge's axis lies in the back of the lid
    radius = 0.45 * min(upper, lower) + 0.001
    top = length * rng.uniform(0.72, 1.0)
    pivot = top - radius - GAP
    span = half * rng.uniform(0.35, 0.7)
    body = _slab(rng, half, (0.0, lower), (0.0, top - 2.0 * radius - 2.0 * GAP), 1)
    knuckle = plane + radius
    for s in (-1.0, 1.0):
        first, last = sorted((s * (span + GAP), s * half * 0.98))
        body += rod(plane, (first, last), pivot, radius, sections=16)
        body += box((plane + 0.0003, max(lower * 0.5, knuckle)), (first, last), (top - 4.0 * radius, pivot))
    phone.add("body", body)
    bottom = rng.uniform(0.0, 0.45) * top if rng.random() < 0.3 else 0.0
    lid = _slab(rng, half, (plane - upper, plane), (bottom, pivot - radius - GAP), -1)
    lid += rod(plane, (GAP - span, span - GAP), pivot, radius * 0.9, sections=16)
    lid += box((plane - min(upper, radius), plane), span - GAP, (pivot - 4.0 * radius, pivot))
    if rng.random() < 0.6:  # a small display on the outside
        z = bottom + rng.uniform(0.45, 0.7) * (pivot - bottom)
        size = 0.45 * half
        deep = (plane - upper - 0.0008, plane - 0.5 * upper)
        lid += box(deep, size, about(z, size), fillet=0.3 * size, axis=0, steps=2)
    phone.add("lid", lid, revolute("body", (0, 1, 0), (plane, 0, pivot), 0.0, rng.uniform(1.6, 2.9)))
    add_keypad(rng, phone, "body", front_face(0.0), 0.8 * half, (0.08 * top, 0.78 * (top - 4.0 * radius)), height)
    _side_keys(rng, phone, half, 0.5 * lower, (0.0, top - 4.0 * radius), lower)


def _slider(rng: Rng, phone: Assembly) -> None:
    """The half with the display slides off the keys, up or to the side."""
    length, half, thick = _size(rng)
    lower = thick * rng.uniform(0.4, 0.65)
    height = rng.uniform(*UNDER_LID)
    plane = -height - GAP
    body = _slab(rng, half, (0.0, lower), (0.0, length), 1)
    sideways = rng.random() < 0.3
    travel = (half if sideways else 0.5 * length) * rng.uniform(0.7, 0.95)
    runner = plane + GAP, 0.001
    if sideways:
        body += union(box(runner, 0.5 * half, (z, z + 0.03 * length)) for z in (0.02 * length, 0.95 * length))
        keys = (0.12 * length, 0.88 * length)
    else:
        upright = 0.55 * length, 0.95 * length
        body += union(box(runner, about(s * 0.7 * half, 0.05 * half), upright) for s in (-1, 1))
        keys = (0.06 * length, 0.47 * length)
    phone.add("body", body)
    upper = thick - lower
    lid = _slab(rng, half, (plane - upper, plane), (0.0, length), -1)
    lid += box((plane - upper - 0.0005, plane - 0.5 * upper), 0.75 * half, (0.35 * length, 0.88 * length))
    axis = (0, float(rng.choice([-1.0, 1.0])), 0) if sideways else (0, 0, 1)
    phone.add("lid", lid, prismatic("body", axis, 0.0, travel, (plane, 0, 0)))
    number = add_keypad(rng, phone, "body", front_face(0.0), 0.78 * half, keys, height)
    front = front_face(plane - upper)
    add_function_keys(rng, phone, "lid", front, 0.7 * half, (0.08 * length, 0.24 * length), 0.0014, number)
    _side_keys(rng, phone, half, 0.5 * lower, (0.0, length), lower)


def _swivel(rng: Rng, phone: Assembly) -> None:
    """The half with the display turns off the keys in its own plane."""
    length, half, thick = _size(rng)
    lower = thick * rng.uniform(0.4, 0.6)
    height = rng.uniform(*UNDER_LID)
    plane = -height - GAP
    pivot = length - half * rng.uniform(0.8, 1.0)
    body = _slab(rng, half, (0.0, lower), (0.0, length), 1)
    body += rod((plane + GAP, 0.001), 0, pivot, 0.7 * half, sections=20)
    phone.add("body", body)
    upper = thick - lower
    lid = _slab(rng, half, (plane - upper, plane), (0.0, length), -1)
    lid += rod((plane - upper - 0.0006, plane), 0, pivot, 0.5 * half, sections=20)
    side = float(rng.choice([-1.0, 1.0]))
    phone.add("lid", lid, revolute("body", (side, 0, 0), (plane, 0, pivot), 0.0, rng.uniform(1.57, 3.2)))
    add_keypad(rng, phone, "body", front_face(0.0), 0.78 * half, (0.06 * length, pivot - 0.75 * half), height)
    _side_keys(rng, phone, half, 0.5 * lower, (0.0, length), lower)


def _fold(rng: Rng, phone: Assembly) -> None:
    """Two halves like a book's covers, hinged at one side."""
    length, half, thick = _size(rng)
    side = float(rng.choice([-1.0, 1.0]))
    leaf, gap = 0.5 * thick, rng.uniform(0.0008, 0.003)
    radius = 0.6 * leaf
    body = _slab(rng, half, (0.5 * gap, leaf), (0.0, length), 1)
    y = side * (half + radius + GAP)
    first = np.linspace(0.03, 0.97, 6) * length
    reach = side * 0.5 * half, y
    for low, high in ((first[0], first[1]), (first[4], first[5])):
        body += rod(0, y, (low, high), radius, sections=16)
        body += box((0.5 * gap, 0.5 * gap + 0.5 * (leaf - 0.5 * gap)), reach, (low, high))
    bump = (leaf - 0.0005, leaf + 0.0016), (-0.6 * half, 0.1 * half), (0.7 * length, 0.95 * length)
    body += box(*bump, fillet=0.3 * half, axis=0, steps=2)
    phone.add("body", body, density=1500.0)
    lid = _slab(rng, half, (-leaf, -0.5 * gap), (0.0, length), -1)
    lid += rod(0, y, (first[1] + GAP, first[4] - GAP), radius, sections=16)
    lid += box((-0.5 * leaf - 0.25 * gap, -0.5 * gap), reach, (first[1] + GAP, first[4] - GAP))
    phone.add("lid", lid, revolute("body", (0, 0, -side), (0, y, 0), 0.0, rng.uniform(1.6, 3.1)), density=1500.0)
    _side_keys(rng, phone, half, 0.5 * leaf + 0.25 * gap, (0.0, length), leaf, (-side,))


def _smartphone(rng: Rng, phone: Assembly) -> None:
    """A display with keys on the edges, at times below it, and a camera on the back."""
    length, half, thick = _size(rng)
    length, thick = 1.25 * length, max(0.7 * thick, 0.006)
    body = _slab(rng, half, (0.0, thick), (0.0, length), 1)
    chin, brow = rng.uniform(0.02, 0.2), rng.uniform(0.02, 0.14)
    body += box((-0.0005, 0.001), 0.92 * half, (chin * length, (1.0 - brow) * length))
    if rng.random() < 0.7:  # the camera's bump
        bump, size = rng.uniform(0.0008, 0.004), rng.uniform(0.15, 0.45) * half
        y, z = rng.choice([0.0, 0.45]) * half, 0.88 * length - size
        body += box((0.5 * thick, thick + bump), about(y, size), about(z, size), fillet=0.5 * size, axis=0, steps=2)
    phone.add("body", body, density=1800.0)
    if chin > 0.1:
        upright = 0.02 * length, (chin - 0.02) * length
        add_function_keys(rng, phone, "body", front_face(0.0), 0.8 * half, upright, 0.0013, 0)
    else:
        face = Face(np.array([0.5 * thick, 0.0, length]), np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0]))
        outline = key_outline("pill", (0.25 * half, 0.3 * thick), 8)
        add_key(phone, "body", "button_0", face, (0.6 * half, 0.0), outline, 0.0013, 0.0004)
    _side_keys(rng, phone, half, 0.5 * thick, (0.0, length), thick)
    _stand(rng, phone, half, thick + 0.0045, length)


def _cordless(rng: Rng, phone: Assembly) -> None:
    """A handset that stands in a dock, and is drawn out upwards."""
    length, half, thick = _size(rng)
    length, thick = 1.1 * length, max(thick, 0.016)
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
            flat = np.concatenate([lifted(foot, floor - 1e-4), lifted(crown, floor + rise)])
            dock += hull(flat if axis == 0 else flat[:, [1, 0, 2]])
    phone.add("dock", dock, density=900.0)
    start = floor + GAP
    face = front_face(-0.5 * thick, 0.0, start)
    body = _slab(rng, half, (-0.5 * thick, 0.5 * thick), (start, start + length), 1)
    inner = 0.74 * half
    body += box((-0.5 * thick - 0.0005, 0.0), inner, (start + 0.68 * length, start + 0.9 * length))
    if rng.random() < 0.4:
        y = rng.choice([-0.6, 0.6]) * half
        top = start + length * rng.uniform(1.08, 1.4)
        body += rod(0, y, (start + 0.9 * length, top), 0.25 * thick, 0.18 * thick, 12)
    lift = prismatic("dock", (0, 0, 1), 0.0, length * rng.uniform(0.4, 1.2), (0, 0, start))
    phone.add("handset", body, lift, density=900.0)
    add_keypad(rng, phone, "handset", face, inner, (rise + 0.05 * length, 0.66 * length), rng.uniform(0.0011, 0.002))
