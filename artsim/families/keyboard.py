"""Keyboards and keypads that lie flat, the space bar towards -X: every key or every row of keys travels down.

What varies: the kind (full, compact, number pad, macro pad, split halves on a pivot, halves that fold together, angled
halves); pitch, rows, columns, wide keys, height and shape of the caps, stepped rows; thickness and slope of the body,
its outline, rims, strips of media keys; feet that fold out, knobs, rollers, faders, wrist rests, cables.
"""

from collections.abc import Sequence

import numpy as np

from artsim.common.elementary import cos, exp, sin
from artsim.common.products import dot, unit
from artsim.families.details import dial
from artsim.families.key_layouts import (
    Cell,
    compact_layout,
    extent,
    full_layout,
    half_layout,
    macro_layout,
    number_layout,
)
from artsim.families.keys import CLEAR, Face, key, key_outline, press, top_face
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute
from artsim.making.outlines import rounded_rectangle
from artsim.making.solids import Solid, box, hull, rod, tube, union
from artsim.model.kinematics import Array

GAP = 0.0005


class _Caps:
    """Look of the keys."""

    def __init__(self, rng: Rng) -> None:
        self.pitch = rng.triangular(0.011, 0.018, 0.026)  # distance of two keys
        tall = rng.random() < 0.5
        self.height = self.pitch * (rng.uniform(0.35, 0.65) if tall else rng.uniform(0.1, 0.25))
        self.travel = self.height * rng.uniform(0.2, 0.45)
        self.shrink = rng.uniform(0.15, 0.4) if tall else rng.uniform(0.0, 0.15)  # of a cap's top against its foot
        self.kind = pick(rng, {"square": 0.66, "pill": 0.24, "round": 0.1})  # :func:`artsim.families.keys.key_outline`
        self.step = self.height * rng.uniform(0.0, 0.18) if tall else 0.0  # each row is higher than the one before it
        self.fill = rng.uniform(0.76, 0.95)  # share of a cell that the cap takes up


def build(rng: Rng) -> Assembly:
    """A keyboard; no key is pressed and the feet are folded in at rest."""
    kinds = {"full": 0.2, "compact": 0.2, "numbers": 0.16, "macro": 0.16, "pivot": 0.1, "folding": 0.08, "angled": 0.1}
    kind = pick(rng, kinds)
    caps = _Caps(rng)
    keyboard = Assembly(density=900.0)
    if kind in ("pivot", "folding", "angled"):
        {"pivot": _pivot, "folding": _folding, "angled": _angled}[kind](rng, keyboard, caps)
        return keyboard
    layouts = {"full": full_layout, "compact": compact_layout, "numbers": number_layout, "macro": macro_layout}
    groups = layouts[kind](rng)
    if sum(len(group) for group in groups) > 45:
        caps.kind = "square"  # so many round keys would be most of the triangles of a scene
    size = extent(groups) * caps.pitch
    margin = caps.pitch * rng.uniform(0.15, 1.2, 4)  # right, left, front, back
    if rng.random() < 0.4:
        margin[3] += caps.pitch * rng.uniform(0.5, 2.5)
    low = np.array([-0.5 * size[0] - margin[1], -0.5 * size[1] - margin[2]])
    high = np.array([0.5 * size[0] + margin[0], 0.5 * size[1] + margin[3]])
    feet = kind != "macro" and rng.random() < 0.5
    pads = rng.uniform(0.0032, 0.005) if feet else rng.choice([0.0, 0.0015])
    thick = min(exp(rng.uniform(-5.3, -3.6)), 0.3 * float((high - low).min()))  # 5 to 27 mm
    slope = rng.triangular(0.0, 0.03, 0.22)
    face = Face(np.array([0.0, 0.0, pads + thick + sin(slope) * -low[1]]), np.array([0.0, -1.0, 0.0]),
                np.array([cos(slope), 0.0, sin(slope)]))  # fmt: skip
    body = _plate(rng, face, low, high, pads)
    rest = float(body.bounds()[0, 0]) - 0.001
    body += _pads(low, high, pads, feet)
    if rng.random() < 0.3:
        body += _rim(face, low, high, min(0.6 * float(margin.min()), 0.003), 0.6 * caps.height)
    body += _trimmings(rng, face, low, high, pads + 0.5 * thick)
    keyboard.add("body", body)
    _add_keys(keyboard, "body", face, groups, caps)
    _controls(rng, keyboard, face, low, high, margin[3], 0.5 * size[1])
    if feet:
        _feet(rng, keyboard, low, high, pads)
    if kind in ("full", "compact") and rng.random() < 0.2:
        _wrist_rest(rng, keyboard, low, high, rest, pads + thick)
    return keyboard


# --- parts -----------------------------------------------------------------------------------------------------------


def _add_keys(
    keyboard: Assembly, parent: str, face: Face, groups: Sequence[Sequence[Cell]], caps: _Caps, first: int = 0
) -> None:
    """A part for each group of cells, the whole centred on the face's origin."""
    cells = np.array([cell for group in groups for cell in group])
    low = (cells[:, :2] - 0.5 * cells[:, 2:]).min(axis=0)
    middle = low + 0.5 * extent(groups)
    shapes: dict[tuple[float, float, float], Solid] = {}
    for number, group in enumerate(groups, first):
        solid = Solid()
        for u, v, wide, deep in group:
            row = float(np.floor(v - low[1]))
            shape = (wide, deep, row)
            if shape not in shapes:
                size = caps.pitch * (np.array([wide, deep]) - (1.0 - caps.fill))
                outline = key_outline(
                    caps.kind if wide == deep else "pill" if caps.kind == "round" else caps.kind, size, 10
                )
                high = caps.height + row * caps.step
                shapes[shape] = key(face, 0.0, 0.0, outline, caps.travel + CLEAR, high + CLEAR, caps.shrink)
            offset = caps.pitch * (u - middle[0]) * face.right + caps.pitch * (v - middle[1]) * face.up
            solid += shapes[shape].moved(offset)
        at = caps.pitch * (np.array(group[0][:2]) - middle)
        label = "key" if len(group) == 1 else "keys"
        keyboard.add(f"{label}_{number}", solid, press(face, parent, at[0], at[1], caps.travel))


def _plate(rng: Rng, face: Face, low: Array, high: Array, bottom: float) -> Solid:
    """The body under a deck: from its outline down to a flat bottom."""
    size = high - low
    radius = float(size.min()) * rng.choice([rng.uniform(0.005, 0.05), rng.uniform(0.05, 0.3)])
    outline = rounded_rectangle(low, high, radius, 3)
    kind = rng.random()
    if kind < 0.3:  # bowed front or back edges
        bow = rng.uniform(0.03, 0.3, 2) * size[1] * rng.choice([0.0, 1.0], 2)
        u = np.linspace(-0.9, 0.9, 9)
        across, bulge = 0.5 * size[0] * u + 0.5 * (low[0] + high[0]), 1 - np.square(u)
        arcs = [np.column_stack([across, np.full(9, edge) + s * b * bulge])
                for edge, s, b in ((low[1], -1, bow[0]), (high[1], 1, bow[1]))]  # fmt: skip
        outline = np.concatenate([outline, *arcs])
    elif kind < 0.45:  # wider at the front
        spread = rng.uniform(0.03, 0.15) * size[0]
        outline = np.concatenate([outline, [(low[0] - spread, low[1] + radius), (high[0] + spread, low[1] + radius)]])
    top = face.raised(outline, 0.0)
    inset = rng.uniform(0.9, 1.0)
    foot = top * (inset, inset, 0.0) + (0.0, 0.0, bottom)
    return hull(np.concatenate([top, foot]))


def _pads(low: Array, high: Array, height: float, feet: bool) -> Solid:
    """Rubber pads below, at the back only one where there are feet."""
    if height <= 0:
        return Solid()
    size = min(0.06 * float((high - low).max()), 0.008)
    spots = [(0.7 * low[1], 0.7 * low[0]), (0.7 * low[1], 0.7 * high[0]), (0.5 * high[1], 0.0)]
    if not feet:
        spots += [(0.6 * high[1], 0.7 * low[0]), (0.6 * high[1], 0.7 * high[0])]
    return union(box((x - size, x + size), (-u - size, -u + size), (0.0, height + 0.001)) for x, u in spots)


def _slab(face: Face, low: Sequence[float], high: Sequence[float], heights: tuple[float, float]) -> Solid:
    """A block on a face between two corners (u, v) and two heights."""
    return hull([face.at(u, v, h) for u in (low[0], high[0]) for v in (low[1], high[1]) for h in heights])


def _rim(face: Face, low: Array, high: Array, wide: float, height: float) -> Solid:
    """A raised border around the deck."""
    spans = [((low[0], low[1]), (high[0], low[1] + wide)), ((low[0], high[1] - wide), (high[0], high[1])),
             ((low[0], low[1]), (low[0] + wide, high[1])), ((high[0] - wide, low[1]), (high[0], high[1]))]  # fmt: skip
    return union(_slab(face, a, b, (-0.0005, height)) for a, b in spans)


def _trimmings(rng: Rng, face: Face, low: Array, high: Array, level: float) -> Solid:
    """A cable, a bar behind the keys."""
    solid = Solid()
    back = face.at(0.0, high[1])
    if rng.random() < 0.35:
        y = rng.uniform(-0.4, 0.4) * (high[0] - low[0])
        z = min(level, float(back[2]))
        solid += tube([(back[0] - 0.004, y, z), (back[0] + rng.uniform(0.015, 0.06), y, z)], min(0.0025, 0.4 * z), 8)
    if rng.random() < 0.2:  # a thick tube for batteries along the back edge
        radius = rng.uniform(0.006, 0.012)
        half = 0.5 * (high[0] - low[0]) * rng.uniform(0.7, 1.0)
        at = (back[0] + 0.6 * radius, max(float(back[2]) - radius, radius))
        solid += rod(at[0], (-half, half), at[1], radius, sections=18)
    return solid


def _controls(
    rng: Rng, keyboard: Assembly, face: Face, low: Array, high: Array, margin: float, keys_end: float
) -> None:
    """Knobs, a roller or a fader on a wide strip behind the keys."""
    room = margin - 0.006
    if room < 0.008:
        return
    v = keys_end + 0.002 + 0.5 * room
    span = high[0] - low[0] - room
    count = min(int(rng.integers(1, 4)), int(span / (1.4 * room)))
    for k in range(count):
        u = 0.5 * (low[0] + high[0]) + span * (0.5 - (k + 0.5) / max(count, 3))
        center = face.at(u, v)
        if rng.random() < 0.6:
            solid = dial(center, face.outward, min(rng.uniform(0.4, 1.0) * room, 0.014), min(0.42 * room, 0.014), 18)
            keyboard.add(f"knob_{k}", solid, continuous("body", face.outward, tuple(center)), density=1200.0)
        else:
            outline = key_outline("pill", (0.35 * room, 0.3 * room), 8)
            start = v - 0.3 * room
            solid = key(face, u, start, outline, 0.0006, min(rng.uniform(0.3, 0.5) * room, 0.007), 0.2)
            slide = prismatic("body", face.up, 0.0, 0.6 * room, tuple(face.at(u, start)))
            keyboard.add(f"slider_{k}", solid, slide, density=1200.0)


def _feet(rng: Rng, keyboard: Assembly, low: Array, high: Array, room: float) -> None:
    """Two feet below the back edge that fold down."""
    thick = room - 2.0 * GAP
    length, wide = rng.uniform(0.014, 0.03), rng.uniform(0.01, 0.03)
    wide = min(wide, 0.2 * float(high[0] - low[0]))
    x, z = high[1] * 0.88, GAP + 0.5 * thick
    limit = rng.uniform(1.1, 1.7)
    for k, share in enumerate((-0.33, 0.33)):
        y = -0.5 * (low[0] + high[0]) + share * (high[0] - low[0])
        solid = box((x - length, x), (y - 0.5 * wide, y + 0.5 * wide), (GAP, GAP + thick))
        solid += rod(x, (y - 0.5 * wide, y + 0.5 * wide), z, 0.5 * thick, sections=10)
        keyboard.add(f"foot_{k}", solid, revolute("body", (0, -1, 0), (x, y, z), 0.0, limit), density=1000.0)


def _wrist_rest(rng: Rng, keyboard: Assembly, low: Array, high: Array, end: float, height: float) -> None:
    """A cushion that ends at x = ``end`` before the keyboard and pulls off to -X."""
    deep, rise = rng.uniform(0.04, 0.09), height * rng.uniform(0.6, 1.1)
    half = 0.5 * float(high[0] - low[0]) * rng.uniform(0.85, 1.0)
    middle = -0.5 * float(low[0] + high[0])
    solid = box((end - deep, end), (middle - half, middle + half), (0.0, rise), fillet=0.6 * rise, axis=1)
    slide = prismatic("body", (-1, 0, 0), 0.0, rng.uniform(0.02, 0.08), (end, 0, 0))
    keyboard.add("wrist_rest", solid, slide, density=400.0)


# --- keyboards of two halves -----------------------------------------------------------------------------------------


def _half(rng: Rng, caps: _Caps, most: float) -> tuple[list[list[Cell]], Array, float]:
    """Keys of one half, half of its size along u and v, and the margin around the keys, at most in pitches."""
    margin = caps.pitch * rng.uniform(0.2, most)
    groups = half_layout(rng)
    return groups, 0.5 * extent(groups) * caps.pitch + margin, margin


def _pivot(rng: Rng, keyboard: Assembly, caps: _Caps) -> None:
    """Two halves that a pivot at the back lets splay."""
    groups, half, _ = _half(rng, caps, 0.8)
    thick = rng.uniform(0.008, 0.028)
    radius = rng.uniform(0.012, 0.02)
    pivot = np.array([half[1] + radius + 0.001, 0.0])
    gap = 0.0015
    bodies = []
    for side in (1.0, -1.0):
        face = top_face(thick, 0.0, side * (half[0] + gap))
        body = box(
            (-half[1], side * (half[0] + gap) - half[0], 0.0), (half[1], side * (half[0] + gap) + half[0], thick),
            fillet=rng.uniform(0.003, 0.02), axis=2)  # fmt: skip
        # One half's disc lies on the other's, each joined to its own half by an arm.
        low, high = (0.0, 0.45 * thick) if side > 0 else (0.45 * thick + GAP, thick)
        body += rod(pivot[0], 0, (low, high), radius, sections=20)
        arm = side * (gap + 0.2 * radius), side * (gap + 1.6 * radius)
        body += box((half[1] - 0.003, pivot[0] + 0.3 * radius), arm, (low, high))
        bodies.append((body, face))
    keyboard.add("left", bodies[0][0])
    keyboard.add("right", bodies[1][0], revolute("left", (0, 0, 1), (*pivot, thick), 0.0, rng.uniform(0.3, 0.9)))
    _add_keys(keyboard, "left", bodies[0][1], groups, caps)
    _add_keys(keyboard, "right", bodies[1][1], groups, caps, len(groups))


def _folding(rng: Rng, keyboard: Assembly, caps: _Caps) -> None:
    """Two flat halves; the right one folds over the left one."""
    caps.height, caps.travel, caps.step = min(caps.height, 0.003), min(caps.travel, 0.0012), 0.0
    groups, half, margin = _half(rng, caps, 0.6)
    thick = rng.uniform(0.004, 0.012)
    axis = thick + caps.height + 2.0 * CLEAR
    radius = rng.uniform(0.003, 0.005)
    faces = [top_face(thick, 0.0, side * (half[0] + radius + GAP)) for side in (1.0, -1.0)]
    rounding = rng.uniform(0.003, 0.015)
    for side, face, name in zip((1.0, -1.0), faces, ("left", "right"), strict=True):
        y = float(face.origin[1])
        body = box(half[1], (y - half[0], y + half[0]), (0.0, thick), fillet=rounding, axis=2)
        shares = (-0.9, -0.5, 0.5, 0.9) if side > 0 else (-0.49, -0.2, 0.2, 0.49)
        for first, last in ((shares[0], shares[1]), (shares[2], shares[3])):
            x0, x1 = first * half[1], last * half[1]
            body += rod((x0, x1), 0, axis, radius, sections=12)
            near, far = side * 0.2 * radius, side * (radius + 0.3 * margin)
            body += hull([(x, y, z) for x in (x0, x1) for y, z in ((near, axis - 0.9 * radius), (near, axis),
                          (far, 0.5 * thick), (far, thick), (near + side * 0.5 * radius, 0.3 * thick))])  # fmt: skip
        fold = None if side > 0 else revolute("left", (-1, 0, 0), (0, 0, axis), 0.0, rng.uniform(2.4, 3.1))
        keyboard.add(name, body, fold, density=1100.0)
    _add_keys(keyboard, "left", faces[0], groups, caps)
    _add_keys(keyboard, "right", faces[1], groups, caps, len(groups))


def _angled(rng: Rng, keyboard: Assembly, caps: _Caps) -> None:
    """One body with a deck for each hand, turned inwards and lower at its outer side."""
    groups, half, _ = _half(rng, caps, 0.8)
    yaw, tent, slope = rng.uniform(0.05, 0.4), rng.uniform(0.0, 0.35), rng.uniform(0.0, 0.12)
    low = rng.uniform(0.006, 0.02)
    body, faces, edges = Solid(), [], []
    for side in (1.0, -1.0):
        up = np.array([cos(yaw) * cos(slope), -side * sin(yaw), sin(slope)])
        right = np.array([-side * sin(yaw), -cos(yaw) * cos(tent), side * sin(tent)])
        up = unit(up)
        right = unit(right - dot(right, up) * up)
        face = Face(np.zeros(3), right, up)
        corners = face.raised(np.array([(u, v) for u in (-half[0], half[0]) for v in (-half[1], half[1])]), 0.0)
        inner = float((side * corners[:, 1]).min())
        y = side * (0.001 + rng.uniform(0.0, 0.01)) - side * inner
        face = Face(np.array([0.0, y, low - corners[:, 2].min()]), right, up)
        corners = corners + face.origin
        body += hull(np.concatenate([corners, corners * (1, 1, 0)]))
        faces.append(face)
        inside = face.raised(np.array([(-side * half[0], v) for v in (-half[1], half[1])]), 0.0)
        edges += [inside * (1, 1, 0), inside * (1, 1, 0.95)]
    body += hull(np.concatenate(edges))  # the bridge
    keyboard.add("body", body)
    for number, face in enumerate(faces):
        _add_keys(keyboard, "body", face, groups, caps, number * len(groups))
