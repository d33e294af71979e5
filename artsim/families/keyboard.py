"""Keyboards and keypads that lie flat, the space bar towards -X: every key or every row of keys travels down.

What varies: the kind, of one body or of two halves; layout and caps of the keys; outline, thickness and slope of the
body; feet that fold out, knobs, faders, wrist rests, cables.
"""

from itertools import product

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.common.products import dot, unit
from artsim.families import key_layouts
from artsim.families.details import dial, drawn_from
from artsim.families.key_layouts import Cell, extent
from artsim.families.keys import CLEAR, Face, key, key_outline, pill, press, top_face
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import Array, about, rounded_rectangle
from artsim.making.solids import Solid, box, hull, rod, tube, union

GAP = 0.0005
_HANDS = (("left", 1.0), ("right", -1.0))
"""The two halves, and on which side of the middle they are."""


class _Caps:
    """Look of the keys."""

    def __init__(self, draws: Draws) -> None:
        draws = draws.within("key")
        self.pitch = draws.triangular("pitch", 0.011, 0.018, 0.026, unit="m")  # distance of two keys
        tall = draws.chance("tall", 0.5)
        self.height = self.pitch * draws.number("height", (0.35, 0.65) if tall else (0.1, 0.25))
        self.travel = self.height * draws.number("travel", (0.2, 0.45))
        self.shrink = draws.number("taper", (0.15, 0.4) if tall else (0.0, 0.15))  # of a cap's top against its foot
        self.kind = draws.pick("shape", {"square": 0.66, "pill": 0.24, "round": 0.1})
        self.step = self.height * draws.number("step", (0.0, 0.18)) if tall else 0.0  # from each row to the next
        self.fill = draws.number("fill", (0.76, 0.95))  # share of a cell that the cap takes up


def build(draws: Draws) -> Assembly:
    """A keyboard; no key is pressed and the feet are folded in at rest."""
    kinds = {"full": 0.2, "compact": 0.2, "numbers": 0.16, "macro": 0.16, "pivot": 0.1, "folding": 0.08, "angled": 0.1}
    kind = draws.pick("kind", kinds)
    caps = _Caps(draws)
    keyboard = Assembly(density=900.0)
    if kind in ("pivot", "folding", "angled"):
        {"pivot": _pivot, "folding": _folding, "angled": _angled}[kind](draws, keyboard, caps)
        return keyboard
    groups = {"full": key_layouts.full_layout, "compact": key_layouts.compact_layout,
              "numbers": key_layouts.number_layout, "macro": key_layouts.macro_layout}[kind](draws)  # fmt: skip
    if sum(len(group) for group in groups) > 45:
        caps.kind = "square"  # so many round keys would be most of the triangles of a scene
    size = extent(groups) * caps.pitch
    sides = ("right", "left", "front", "back")
    margin = caps.pitch * np.array([draws.number(f"{side}_margin", (0.15, 1.2)) for side in sides])
    if draws.chance("strip", 0.4):  # behind the keys, for controls
        margin[3] += caps.pitch * draws.number("strip_depth", (0.5, 2.5))
    low = np.array([-0.5 * size[0] - margin[1], -0.5 * size[1] - margin[2]])
    high = np.array([0.5 * size[0] + margin[0], 0.5 * size[1] + margin[3]])
    feet = kind != "macro" and draws.chance("foot", 0.5)
    pads = draws.length("pad_height", (0.0032, 0.005)) if feet else 0.0015 * draws.pick("pads", [False, True])
    thick = min(draws.log_length("height", 1.0, -5.3, -3.6), 0.3 * float((high - low).min()))  # 5 to 27 mm
    slope = draws.triangular("slope", 0.0, 0.03, 0.22, unit="rad")
    face = Face(np.array([0.0, 0.0, pads + thick + sin(slope) * -low[1]]), np.array([0.0, -1.0, 0.0]),
                np.array([cos(slope), 0.0, sin(slope)]))  # fmt: skip
    plate = _plate(draws, face, low, high, pads)
    body = plate + _pads(low, high, pads, feet)
    if draws.chance("rim", 0.3):
        body += _rim(face, low, high, min(0.6 * float(margin.min()), 0.003), 0.6 * caps.height)
    body += _trimmings(draws, face, low, high, pads + 0.5 * thick)
    keyboard.add("body", body)
    _add_keys(keyboard, [("body", face)], groups, caps)
    _controls(draws, keyboard, face, low, high, margin[3], 0.5 * size[1])
    if feet:
        _feet(draws.within("foot"), keyboard, low, high, pads)
    if kind in ("full", "compact") and draws.chance("wrist_rest", 0.2):
        end = float(plate.bounds()[0, 0]) - 0.001
        _wrist_rest(draws.within("wrist_rest"), keyboard, low, high, end, pads + thick)
    return keyboard


# --- parts -----------------------------------------------------------------------------------------------------------


def _add_keys(keyboard: Assembly, decks: list[tuple[str, Face]], groups: list[list[Cell]], caps: _Caps) -> None:
    """A part for each group of cells on each deck, a face of a part; the whole is centred on the face's origin."""
    cells = np.array([cell for group in groups for cell in group])
    low = (cells[:, :2] - 0.5 * cells[:, 2:]).min(axis=0)
    middle = low + 0.5 * extent(groups)
    shapes: dict[tuple[Face, float, float, float], Solid] = {}
    for number, ((parent, face), group) in enumerate(product(decks, groups)):
        solid = Solid()
        for u, v, wide, deep in group:
            row = float(np.floor(v - low[1]))
            shape = (face, wide, deep, row)
            if shape not in shapes:
                size = caps.pitch * (np.array([wide, deep]) - (1.0 - caps.fill))
                outline = key_outline("pill" if caps.kind == "round" and wide != deep else caps.kind, size, 10)
                high = caps.height + row * caps.step
                shapes[shape] = key(face, 0.0, 0.0, outline, caps.travel + CLEAR, high + CLEAR, caps.shrink)
            offset = caps.pitch * (u - middle[0]) * face.right + caps.pitch * (v - middle[1]) * face.up
            solid += shapes[shape].moved(offset)
        at = caps.pitch * (np.array(group[0][:2]) - middle)
        label = "key" if len(group) == 1 else "keys"
        keyboard.add(f"{label}_{number}", solid, press(face, parent, at[0], at[1], caps.travel))


def _plate(draws: Draws, face: Face, low: Array, high: Array, bottom: float) -> Solid:
    """The body under a deck: from its outline down to a flat bottom."""
    size = high - low
    radius = float(size.min()) * drawn_from(draws, "corner", {"sharp": (0.005, 0.05), "round": (0.05, 0.3)})
    outline = rounded_rectangle(low, high, radius, 3)
    kind = draws.pick("outline", {"bowed": 0.3, "tapered": 0.15, "straight": 0.55})
    if kind == "bowed":  # at the front, the back, or both
        bow = draws.numbers("bow", 0.03, 0.3, 2) * size[1]
        bow *= [draws.pick(f"{edge}_bowed", [False, True]) for edge in ("front", "back")]
        u = np.linspace(-0.9, 0.9, 9)
        across, bulge = 0.5 * size[0] * u + 0.5 * (low[0] + high[0]), 1 - np.square(u)
        arcs = [np.column_stack([across, np.full(9, edge) + s * b * bulge])
                for edge, s, b in ((low[1], -1, bow[0]), (high[1], 1, bow[1]))]  # fmt: skip
        outline = np.concatenate([outline, *arcs])
    elif kind == "tapered":  # wider at the front
        spread = draws.number("front_spread", (0.03, 0.15)) * size[0]
        outline = np.concatenate([outline, [(low[0] - spread, low[1] + radius), (high[0] + spread, low[1] + radius)]])
    top = face.raised(outline, 0.0)
    inset = draws.number("foot_inset", (0.9, 1.0))
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


def _rim(face: Face, low: Array, high: Array, wide: float, height: float) -> Solid:
    """A raised border around the deck."""
    (u0, v0), (u1, v1) = low, high
    sides = [((u0, u1), (v0, v0 + wide)), ((u0, u1), (v1 - wide, v1)),
             ((u0, u0 + wide), (v0, v1)), ((u1 - wide, u1), (v0, v1))]  # fmt: skip
    return union(hull([face.at(u, v, h) for u in us for v in vs for h in (-0.0005, height)]) for us, vs in sides)


def _trimmings(draws: Draws, face: Face, low: Array, high: Array, level: float) -> Solid:
    """A cable, a bar behind the keys."""
    solid = Solid()
    back = face.at(0.0, high[1])
    if draws.chance("cable", 0.35):
        y = draws.number("cable_place", (-0.4, 0.4)) * (high[0] - low[0])
        z, end = min(level, float(back[2])), back[0] + draws.length("cable_length", (0.015, 0.06))
        solid += tube([(back[0] - 0.004, y, z), (end, y, z)], min(0.0025, 0.4 * z), 8)
    if draws.chance("battery_tube", 0.2):  # along the back edge
        radius = draws.length("battery_tube_radius", (0.006, 0.012))
        half = 0.5 * (high[0] - low[0]) * draws.number("battery_tube_length", (0.7, 1.0))
        at = (back[0] + 0.6 * radius, max(float(back[2]) - radius, radius))
        solid += rod(at[0], (-half, half), at[1], radius, sections=18)
    return solid


def _controls(draws: Draws, keyboard: Assembly, face: Face, low: Array, high: Array, margin: float, end: float) -> None:
    """Knobs, a roller or a fader on a wide strip behind the keys."""
    room = margin - 0.006
    if room < 0.008:
        return
    v = end + 0.002 + 0.5 * room
    span = high[0] - low[0] - room
    count = min(draws.integer("controls", 1, 3), int(span / (1.4 * room)))
    for k in range(count):
        u = 0.5 * (low[0] + high[0]) + span * (0.5 - (k + 0.5) / max(count, 3))
        center = face.at(u, v)
        if draws.chance("knob", 0.6):
            reach = min(draws.number("knob_reach", (0.4, 1.0)) * room, 0.014)
            solid = dial(center, face.outward, reach, min(0.42 * room, 0.014), 18)
            keyboard.add(f"knob_{k}", solid, continuous("body", face.outward, tuple(center)), density=1200.0)
        else:
            start, reach = v - 0.3 * room, min(draws.number("slider_reach", (0.3, 0.5)) * room, 0.007)
            solid = key(face, u, start, pill(0.35 * room, 0.3 * room), 0.0006, reach, 0.2)
            slide = prismatic("body", face.up, 0.0, 0.6 * room, tuple(face.at(u, start)))
            keyboard.add(f"slider_{k}", solid, slide, density=1200.0)


def _feet(draws: Draws, keyboard: Assembly, low: Array, high: Array, room: float) -> None:
    """Two feet below the back edge that fold down."""
    thick = room - 2.0 * GAP
    length = draws.length("length", (0.014, 0.03))
    wide = min(draws.length("width", (0.01, 0.03)), 0.2 * float(high[0] - low[0]))
    x, z = high[1] * 0.88, GAP + 0.5 * thick
    limit = draws.angle("angle", (1.1, 1.7))
    for k, share in enumerate((-0.33, 0.33)):
        y = share * (high[0] - low[0]) - 0.5 * (low[0] + high[0])
        across = about(y, 0.5 * wide)
        solid = box((x - length, x), across, (GAP, GAP + thick)) + rod(x, across, z, 0.5 * thick, sections=10)
        keyboard.add(f"foot_{k}", solid, revolute("body", (0, -1, 0), (x, y, z), 0.0, limit), density=1000.0)


def _wrist_rest(draws: Draws, keyboard: Assembly, low: Array, high: Array, end: float, height: float) -> None:
    """A cushion that ends at x = ``end`` before the keyboard and pulls off to -X."""
    deep, rise = draws.length("depth", (0.04, 0.09)), height * draws.number("height", (0.6, 1.1))
    half = 0.5 * float(high[0] - low[0]) * draws.number("width", (0.85, 1.0))
    solid = box((end - deep, end), about(-0.5 * float(low[0] + high[0]), half), (0.0, rise), fillet=0.6 * rise, axis=1)
    slide = prismatic("body", (-1, 0, 0), 0.0, draws.length("travel", (0.02, 0.08)), (end, 0, 0))
    keyboard.add("wrist_rest", solid, slide, density=400.0)


# --- keyboards of two halves -----------------------------------------------------------------------------------------


def _half(draws: Draws, caps: _Caps, most: float) -> tuple[list[list[Cell]], Array, float]:
    """Keys of one half, half of its size along u and v, and the margin around the keys, at most in pitches."""
    margin = caps.pitch * draws.number("margin", (0.2, most))
    groups = key_layouts.half_layout(draws)
    return groups, 0.5 * extent(groups) * caps.pitch + margin, margin


def _pivot(draws: Draws, keyboard: Assembly, caps: _Caps) -> None:
    """Two halves that a pivot at the back lets splay."""
    groups, half, _ = _half(draws, caps, 0.8)
    thick, radius = draws.lengths(height=(0.008, 0.028), pivot_radius=(0.012, 0.02))
    pivot = np.array([half[1] + radius + 0.001, 0.0])
    gap = 0.0015
    joint, decks = None, []
    for name, side in _HANDS:
        y, corner = side * (half[0] + gap), draws.length(f"{name}_corner", (0.003, 0.02))
        decks.append((name, top_face(thick, 0.0, y)))
        body = box(half[1], about(y, half[0]), (0.0, thick), fillet=corner, axis=2)
        # One half's disc lies on the other's, each joined to its own half by an arm.
        low, high = (0.0, 0.45 * thick) if side > 0 else (0.45 * thick + GAP, thick)
        body += rod(pivot[0], 0, (low, high), radius, sections=20)
        arm = side * (gap + 0.2 * radius), side * (gap + 1.6 * radius)
        body += box((half[1] - 0.003, pivot[0] + 0.3 * radius), arm, (low, high))
        if side < 0:
            joint = revolute("left", (0, 0, 1), (*pivot, thick), 0.0, draws.angle("splay_angle", (0.3, 0.9)))
        keyboard.add(name, body, joint)
    _add_keys(keyboard, decks, groups, caps)


def _folding(draws: Draws, keyboard: Assembly, caps: _Caps) -> None:
    """Two flat halves; the right one folds over the left one."""
    caps.height, caps.travel, caps.step = min(caps.height, 0.003), min(caps.travel, 0.0012), 0.0
    groups, half, margin = _half(draws, caps, 0.6)
    thick = draws.length("height", (0.004, 0.012))
    axis = thick + caps.height + 2.0 * CLEAR
    radius, corner = draws.lengths(hinge_radius=(0.003, 0.005), corner_radius=(0.003, 0.015))
    joint, decks = None, []
    for name, side in _HANDS:
        y = side * (half[0] + radius + GAP)
        decks.append((name, top_face(thick, 0.0, y)))
        body = box(half[1], about(y, half[0]), (0.0, thick), fillet=corner, axis=2)
        shares = (-0.9, -0.5, 0.5, 0.9) if side > 0 else (-0.49, -0.2, 0.2, 0.49)
        for first, last in ((shares[0], shares[1]), (shares[2], shares[3])):
            x0, x1 = first * half[1], last * half[1]
            body += rod((x0, x1), 0, axis, radius, sections=12)
            near, far = side * 0.2 * radius, side * (radius + 0.3 * margin)
            body += hull([(x, y, z) for x in (x0, x1) for y, z in ((near, axis - 0.9 * radius), (near, axis),
                          (far, 0.5 * thick), (far, thick), (near + side * 0.5 * radius, 0.3 * thick))])  # fmt: skip
        if side < 0:
            joint = revolute("left", (-1, 0, 0), (0, 0, axis), 0.0, draws.angle("fold_angle", (2.4, 3.1)))
        keyboard.add(name, body, joint, density=1100.0)
    _add_keys(keyboard, decks, groups, caps)


def _angled(draws: Draws, keyboard: Assembly, caps: _Caps) -> None:
    """One body with a deck for each hand, turned inwards and lower at its outer side."""
    groups, half, _ = _half(draws, caps, 0.8)
    yaw, tent = draws.angle("yaw", (0.05, 0.4)), draws.angle("tent", (0.0, 0.35))
    slope, low = draws.angle("slope", (0.0, 0.12)), draws.length("height", (0.006, 0.02))
    body, decks, edges = Solid(), [], []
    for _, side in _HANDS:
        up = np.array([cos(yaw) * cos(slope), -side * sin(yaw), sin(slope)])
        right = np.array([-side * sin(yaw), -cos(yaw) * cos(tent), side * sin(tent)])
        up = unit(up)
        right = unit(right - dot(right, up) * up)
        face = Face(np.zeros(3), right, up)
        corners = face.raised(np.array([(u, v) for u in (-half[0], half[0]) for v in (-half[1], half[1])]), 0.0)
        inner = float((side * corners[:, 1]).min())
        y = side * (0.001 + draws.length("deck_gap", (0.0, 0.01))) - side * inner
        face = Face(np.array([0.0, y, low - corners[:, 2].min()]), right, up)
        corners = corners + face.origin
        body += hull(np.concatenate([corners, corners * (1, 1, 0)]))
        decks.append(("body", face))
        inside = face.raised(np.array([(-side * half[0], v) for v in (-half[1], half[1])]), 0.0)
        edges += [inside * (1, 1, 0), inside * (1, 1, 0.95)]
    body += hull(np.concatenate(edges))  # the bridge
    keyboard.add("body", body)
    _add_keys(keyboard, decks, groups, caps)
