"""Telephones: mobile ones that stand upright with their face towards -X, and desk sets.

What varies: the kind; proportions, round edges, bent backs; keypads, function and side keys; antennas, kickstands,
cameras; on desk sets the slope, a dial in place of keys, a display that tilts, the handset.
"""

from collections.abc import Sequence

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.common.products import unit
from artsim.families.keys import Face, add_function_keys, add_key, add_keypad, front_face, pill, side_face, top_face
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, Array, about, cross_sections, lifted
from artsim.making.solids import Solid, box, cylinder, hull, loft, ring, rod, tube, union

GAP = 0.0005


def build(draws: Draws) -> Assembly:
    """A telephone; closed, its handset in place and no key pressed at rest."""
    phone = Assembly(density=1300.0)
    makers = {"bar": _bar, "flip": _flip, "slider": _slider, "swivel": _swivel, "fold": _fold,
              "smartphone": _smartphone, "cordless": _cordless, "desk": _desk_set}  # fmt: skip
    draws.one_of("kind", makers, (0.15, 0.17, 0.12, 0.07, 0.08, 0.1, 0.11, 0.2))(draws, phone)
    return phone


def _slab(draws: Draws, half: float, x: tuple[float, float], z: tuple[float, float], curve: int = 0) -> Solid:
    """Upright plate with round edges; where ``curve`` is 1 its back (+X) bulges, where it is -1 its front does."""
    levels = np.array([0.0, 0.03, 0.2, 0.5, 0.8, 0.97, 1.0])
    corner = draws.number("corner", (0.0, 0.35)) * np.array([1.0, 0.3, 0.0, 0.0, 0.0, 0.3, 1.0])
    narrow = draws.number("waist", (-0.12, 0.12)) * draws.pick("waisted", [False, True])
    waist = narrow * np.array([0.0, 0.05, 0.6, 1.0, 0.6, 0.05, 0.0])
    rise = draws.number("bow", (0.1, 0.7)) * (x[1] - x[0]) * draws.pick("bowed", [False, True])
    bow = rise * np.array([1.0, 0.9, 0.4, draws.number("bow_hollow", (0.0, 0.3)), 0.4, 0.9, 1.0])
    fronts, backs = np.full(7, x[0]), np.full(7, x[1])
    if curve > 0:
        backs = backs - bow
    elif curve < 0:
        fronts = fronts + bow
    halves = half * (1.0 - corner - np.abs(waist))
    roundness = draws.number("roundness", (0.1, 0.8))
    return loft(cross_sections(z[0] + levels * (z[1] - z[0]), fronts, backs, halves, roundness))


def _side_keys(draws: Draws, phone: Assembly, half: float, x: float, z: tuple[float, float],
               thick: float, sides: Sequence[float] = (-1.0, 1.0)) -> None:  # fmt: skip
    """Keys on the right (-1) and left (1) edges of an upright body."""
    for side in sides:
        face = side_face(side, x, side * half, 0.0)
        name = "left_key" if side > 0 else "right_key"
        for k in range(draws.integer(f"{name}s", 0, 2)):
            v = z[0] + (0.62 + 0.14 * k) * (z[1] - z[0])
            long = draws.number(f"{name}_length", (0.05, 0.11)) * (z[1] - z[0])
            add_key(phone, "body", f"{name}_{k}", face, (0.0, v), pill(0.3 * thick, long), 0.0014, 0.0004)


def _size(draws: Draws) -> tuple[float, float, float]:
    """Length, half of the width and thickness of a mobile phone."""
    length = draws.log_length("height", 0.12, -0.45, 0.7)
    half = 0.5 * draws.triangular("width", 0.28, 0.45, 0.72, of=length, unit="m")
    return length, half, draws.triangular("depth", 0.06, 0.13, 0.36, of=length, unit="m")


def _halves(draws: Draws, base: tuple[float, float]) -> tuple[float, float, float, float, float, float]:
    """Measures of a phone of two halves, one on the other; ``base`` is the lower one's share of the thickness.

    Length, half of the width, thickness of the lower and of the upper half, how far keys stand out, and x of the upper
    half's back.
    """
    length, half, thick = _size(draws)
    lower = thick * draws.number("base_thickness", base)
    height = draws.length("key_height", (0.001, 0.0016))  # of keys under a lid
    return length, half, lower, thick - lower, height, -height - GAP


def _aerial(draws: Draws, phone: Assembly, half: float, x: float, length: float, thick: float) -> None:
    """A rod along one side that swings up about its upper end, on some."""
    if not draws.chance("antenna", 0.45, upper=True):
        return
    radius, side = min(draws.length("antenna_radius", (0.0015, 0.004)), 0.4 * thick), draws.side("antenna_side")
    y, z = side * (half + radius + 0.002), 0.93 * length  # clear of keys on the edge
    stalk = rod(x, y, (z, z - length * draws.number("antenna_length", (0.4, 0.85))), radius, sections=12)
    stalk += rod(x, (y - side * radius, y + 0.5 * side * radius), z, 1.4 * radius, sections=14)
    axis = (0, draws.one_of("antenna_way", {"back": -1.0, "front": 1.0}), 0)
    turn = revolute("body", axis, (x, y, z), 0.0, draws.angle("antenna_angle", (1.6, 3.14)))
    phone.add("antenna", stalk, turn, density=2000.0)


def _stand(draws: Draws, phone: Assembly, half: float, x: float, length: float) -> None:
    """A leaf on the back that folds out, on some."""
    if not draws.chance("stand", 0.45, upper=True):
        return
    thick, z = 0.0015, length * draws.number("stand_top", (0.4, 0.65))
    wide, low = half * draws.number("stand_width", (0.3, 0.8)), length * draws.number("stand_bottom", (0.03, 0.2))
    leaf = box((x + GAP, x + GAP + thick), wide, (low, z), fillet=0.004, axis=0, steps=2)
    hinge = revolute("body", (0, -1, 0), (x + GAP, 0, z), 0.0, draws.angle("stand_angle", (0.5, 1.5)))
    phone.add("stand", leaf, hinge, density=1500.0)


def _bar(draws: Draws, phone: Assembly) -> None:
    """One piece with keys below a display."""
    length, half, thick = _size(draws)
    body = _slab(draws.within("base"), half, (0.0, thick), (0.0, length), 1)
    split = length * draws.number("keypad_top", (0.42, 0.68))
    inner = 0.72 * half
    body += box((-0.0006, 0.001), inner, (split + 0.04 * length, 0.9 * length)).called("display", FRONT)
    if draws.chance("stub", 0.35):  # of an antenna
        y, top = 0.6 * draws.side("stub_side") * half, length * draws.number("stub_top", (1.08, 1.35))
        body += rod(0.5 * thick, y, (0.9 * length, top), 0.3 * thick, 0.22 * thick, 12)
    phone.add("body", body)
    height = draws.length("key_height", (0.0011, 0.0026))
    add_keypad(draws, phone, "body", front_face(0.0), inner, (0.1 * length, split), height)
    _side_keys(draws, phone, half, 0.5 * thick, (0.0, length), thick)
    _aerial(draws, phone, half, 0.5 * thick, length, thick)
    _stand(draws, phone, half, thick, length)


def _flip(draws: Draws, phone: Assembly) -> None:
    """A lid with the display before the keys, hinged at the top (or, at times, half-way up)."""
    length, half, lower, upper, height, plane = _halves(draws, (0.45, 0.65))  # the hinge's axis lies in the plane
    length *= 0.8
    radius = 0.45 * min(upper, lower) + 0.001
    top = length * draws.number("hinge_height", (0.72, 1.0))
    pivot = top - radius - GAP
    span = half * draws.number("hinge_width", (0.35, 0.7))
    body = _slab(draws.within("base"), half, (0.0, lower), (0.0, top - 2.0 * radius - 2.0 * GAP), 1)
    knuckle = plane + radius
    for s in (-1.0, 1.0):
        first, last = sorted((s * (span + GAP), s * half * 0.98))
        body += rod(plane, (first, last), pivot, radius, sections=16)
        body += box((plane + 0.0003, max(lower * 0.5, knuckle)), (first, last), (top - 4.0 * radius, pivot))
    phone.add("body", body)
    bottom = draws.number("lid_bottom", (0.0, 0.45)) * top if draws.chance("short_lid", 0.3) else 0.0
    lid = _slab(draws.within("lid"), half, (plane - upper, plane), (bottom, pivot - radius - GAP), -1)
    lid += rod(plane, (GAP - span, span - GAP), pivot, radius * 0.9, sections=16)
    lid += box((plane - min(upper, radius), plane), span - GAP, (pivot - 4.0 * radius, pivot))
    if draws.chance("outer_display", 0.6):
        z = bottom + draws.number("outer_display_height", (0.45, 0.7)) * (pivot - bottom)
        size = 0.45 * half
        deep = (plane - upper - 0.0008, plane - 0.5 * upper)
        lid += box(deep, size, about(z, size), fillet=0.3 * size, axis=0, steps=2).called("display", FRONT)
    phone.add("lid", lid, revolute("body", (0, 1, 0), (plane, 0, pivot), 0.0, draws.angle("lid_angle", (1.6, 2.9))))
    add_keypad(draws, phone, "body", front_face(0.0), 0.8 * half, (0.08 * top, 0.78 * (top - 4.0 * radius)), height)
    _side_keys(draws, phone, half, 0.5 * lower, (0.0, top - 4.0 * radius), lower)


def _slider(draws: Draws, phone: Assembly) -> None:
    """The half with the display slides off the keys, up or to the side."""
    length, half, lower, upper, height, plane = _halves(draws, (0.4, 0.65))
    body = _slab(draws.within("base"), half, (0.0, lower), (0.0, length), 1)
    sideways = draws.chance("slides_sideways", 0.3)
    travel = (half if sideways else 0.5 * length) * draws.number("lid_travel", (0.7, 0.95))
    runner = plane + GAP, 0.001
    if sideways:
        body += union(box(runner, 0.5 * half, (z, z + 0.03 * length)) for z in (0.02 * length, 0.95 * length))
        keys = (0.12 * length, 0.88 * length)
    else:
        upright = 0.55 * length, 0.95 * length
        body += union(box(runner, about(s * 0.7 * half, 0.05 * half), upright) for s in (-1, 1))
        keys = (0.06 * length, 0.47 * length)
    phone.add("body", body)
    lid = _slab(draws.within("lid"), half, (plane - upper, plane), (0.0, length), -1)
    pane = box((plane - upper - 0.0005, plane - 0.5 * upper), 0.75 * half, (0.35 * length, 0.88 * length))
    lid += pane.called("display", FRONT)
    axis = (0, draws.side("slide_side"), 0) if sideways else (0, 0, 1)
    phone.add("lid", lid, prismatic("body", axis, 0.0, travel, (plane, 0, 0)))
    number = add_keypad(draws, phone, "body", front_face(0.0), 0.78 * half, keys, height)
    front, below = front_face(plane - upper), (0.08 * length, 0.24 * length)
    add_function_keys(draws.within("lid"), phone, "lid", front, 0.7 * half, below, 0.0014, number)
    _side_keys(draws, phone, half, 0.5 * lower, (0.0, length), lower)


def _swivel(draws: Draws, phone: Assembly) -> None:
    """The half with the display turns off the keys in its own plane."""
    length, half, lower, upper, height, plane = _halves(draws, (0.4, 0.6))
    pivot = length - half * draws.number("pivot_inset", (0.8, 1.0))
    body = _slab(draws.within("base"), half, (0.0, lower), (0.0, length), 1)
    body += rod((plane + GAP, 0.001), 0, pivot, 0.7 * half, sections=20)
    phone.add("body", body)
    lid = _slab(draws.within("lid"), half, (plane - upper, plane), (0.0, length), -1)
    lid += rod((plane - upper - 0.0006, plane), 0, pivot, 0.5 * half, sections=20)
    hinge = (draws.side("lid_side"), 0, 0), (plane, 0, pivot)
    phone.add("lid", lid, revolute("body", *hinge, 0.0, draws.angle("lid_angle", (1.57, 3.2))))
    add_keypad(draws, phone, "body", front_face(0.0), 0.78 * half, (0.06 * length, pivot - 0.75 * half), height)
    _side_keys(draws, phone, half, 0.5 * lower, (0.0, length), lower)


def _fold(draws: Draws, phone: Assembly) -> None:
    """Two halves like a book's covers, hinged at one side."""
    length, half, thick = _size(draws)
    side = draws.side("hinge_side")
    leaf, gap = 0.5 * thick, draws.length("leaf_gap", (0.0008, 0.003))
    radius = 0.6 * leaf
    body = _slab(draws.within("base"), half, (0.5 * gap, leaf), (0.0, length), 1)
    y = side * (half + radius + GAP)
    first = np.linspace(0.03, 0.97, 6) * length
    reach = side * 0.5 * half, y
    for low, high in ((first[0], first[1]), (first[4], first[5])):
        body += rod(0, y, (low, high), radius, sections=16)
        body += box((0.5 * gap, 0.5 * gap + 0.5 * (leaf - 0.5 * gap)), reach, (low, high))
    bump = (leaf - 0.0005, leaf + 0.0016), (-0.6 * half, 0.1 * half), (0.7 * length, 0.95 * length)
    body += box(*bump, fillet=0.3 * half, axis=0, steps=2).called("glass", -FRONT)  # of the cameras
    phone.add("body", body, density=1500.0)
    lid = _slab(draws.within("lid"), half, (-leaf, -0.5 * gap), (0.0, length), -1)
    lid += rod(0, y, (first[1] + GAP, first[4] - GAP), radius, sections=16)
    lid += box((-0.5 * leaf - 0.25 * gap, -0.5 * gap), reach, (first[1] + GAP, first[4] - GAP))
    hinge = revolute("body", (0, 0, -side), (0, y, 0), 0.0, draws.angle("lid_angle", (1.6, 3.1)))
    phone.add("lid", lid, hinge, density=1500.0)
    _side_keys(draws, phone, half, 0.5 * leaf + 0.25 * gap, (0.0, length), leaf, (-side,))


def _smartphone(draws: Draws, phone: Assembly) -> None:
    """A display with keys on the edges, at times below it, and a camera on the back."""
    length, half, thick = _size(draws)
    length, thick = 1.25 * length, max(0.7 * thick, 0.006)
    body = _slab(draws.within("base"), half, (0.0, thick), (0.0, length), 1)
    chin, brow = draws.number("chin", (0.02, 0.2)), draws.number("brow", (0.02, 0.14))
    body += box((-0.0005, 0.001), 0.92 * half, (chin * length, (1.0 - brow) * length)).called("display", FRONT)
    if draws.chance("camera", 0.7):  # its bump
        deep = (0.5 * thick, thick + draws.length("camera_height", (0.0008, 0.004)))
        size = draws.number("camera_width", (0.15, 0.45)) * half
        y = draws.one_of("camera_place", {"middle": 0.0, "side": 0.45}) * half
        bump = box(deep, about(y, size), about(0.88 * length - size, size), fillet=0.5 * size, axis=0, steps=2)
        body += bump.called("glass", -FRONT)
    phone.add("body", body, density=1800.0)
    if chin > 0.1:
        upright = 0.02 * length, (chin - 0.02) * length
        add_function_keys(draws, phone, "body", front_face(0.0), 0.8 * half, upright, 0.0013, 0)
    else:
        face, outline = top_face(length, 0.5 * thick), pill(0.25 * half, 0.3 * thick)
        add_key(phone, "body", "button_0", face, (0.6 * half, 0.0), outline, 0.0013, 0.0004)
    _side_keys(draws, phone, half, 0.5 * thick, (0.0, length), thick)
    _stand(draws, phone, half, thick + 0.0045, length)


def _cordless(draws: Draws, phone: Assembly) -> None:
    """A handset that stands in a dock, and is drawn out upwards."""
    length, half, thick = _size(draws)
    length, thick = 1.1 * length, max(thick, 0.016)
    floor, rise = 0.004 + 0.2 * thick, length * draws.number("dock_height", (0.12, 0.3))
    room = 0.0015
    size = 2.0 * half * draws.number("dock_width", (1.3, 2.6)), thick * draws.number("dock_depth", (2.2, 5.0))
    taper = draws.number("dock_taper", (0.6, 0.95))
    dock = box(0.5 * size[1], 0.5 * size[0], (0.0, floor))
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
    body = _slab(draws.within("base"), half, (-0.5 * thick, 0.5 * thick), (start, start + length), 1)
    inner = 0.74 * half
    upright = (start + 0.68 * length, start + 0.9 * length)
    body += box((-0.5 * thick - 0.0005, 0.0), inner, upright).called("display", FRONT)
    if draws.chance("stub", 0.4):  # of an antenna
        y, top = 0.6 * draws.side("stub_side") * half, start + length * draws.number("stub_top", (1.08, 1.4))
        body += rod(0, y, (start + 0.9 * length, top), 0.25 * thick, 0.18 * thick, 12)
    lift = prismatic("dock", (0, 0, 1), 0.0, draws.length("handset_travel", (0.4, 1.2), of=length), (0, 0, start))
    phone.add("handset", body, lift, density=900.0)
    height = draws.length("key_height", (0.0011, 0.002))
    add_keypad(draws, phone, "handset", face, inner, (rise + 0.05 * length, 0.66 * length), height)


def _desk_set(draws: Draws, phone: Assembly) -> None:
    """A sloping base with keys or a dial, and a handset across its left side or along its back."""
    depth, width, front = draws.lengths(depth=(0.14, 0.26), width=(0.13, 0.3), front_height=(0.012, 0.04))
    back = max(draws.length("height", (0.03, 0.13)), front)
    inset = draws.number("deck_inset", (0.0, 0.18)) * min(width, depth)
    reach = depth - inset  # of the deck
    slope = unit((reach, 0.0, back - front))
    corners = [(x, y) for x in (-0.5 * depth, 0.5 * depth) for y in (-0.5 * width, 0.5 * width)]
    deeper, wider = 1 - inset / depth, 1 - inset / width
    upper = [(x * deeper, y * wider, front + (x / depth + 0.5) * (back - front)) for x, y in corners]
    base = hull([(x, y, z) for x, y in corners for z in (0.0, 0.3 * front)] + upper)
    across, grip = draws.chance("handset_at_back", 0.4), draws.length("handset_width", (0.018, 0.03))
    deck = Face(np.array([-0.5 * reach, 0.0, front]), np.array([0.0, -1.0, 0.0]), slope)
    run = reach / slope[0]
    if across:
        length = max(draws.length("handset_length", (0.8, 1.15), of=width), 0.15)
        middle = deck.at(0.0, run - 1.4 * grip)
        along = np.array([0.0, 1.0, 0.0])
        keys_u, keys_v = (-0.42, 0.42), (0.1, 1.0 - 3.2 * grip / run)
    else:
        length = max(draws.length("handset_length", (0.85, 1.15), of=run), 0.15)
        middle = deck.at(-0.5 * width + 1.3 * grip + 0.5 * inset, 0.5 * run)
        along = slope
        keys_u, keys_v = (-0.5 + (3.0 * grip + 0.5 * inset) / width, 0.42), (0.1, 0.9)
    out = deck.outward
    side = np.cross(out, along)
    lift = draws.length("cradle_height", (0.006, 0.022))
    for s in (-1.0, 1.0):  # the cradle
        spot = middle + s * 0.33 * length * along
        base += hull([spot + a * 0.4 * grip * along + b * grip * w * side + z * out for a in (-1, 1) for b in (-1, 1)
                      for z, w in ((-0.004, 0.9), (lift, 0.7))])  # fmt: skip
    phone.add("base", base, density=700.0)
    _handset(draws.within("handset"), phone, middle + (lift + GAP) * out, along, side, out, length, grip)
    u0, u1 = keys_u[0] * width, (keys_u[1] * width - 0.5 * inset)
    v0, v1 = keys_v[0] * run, keys_v[1] * run
    middle_u, half = 0.5 * (u0 + u1), 0.5 * (u1 - u0)
    shifted = Face(deck.at(middle_u, 0.0), deck.right, deck.up)
    if draws.chance("dial", 0.25):
        _dial(draws, phone, shifted, 0.5 * (v0 + v1), min(half, 0.5 * (v1 - v0), 0.045))
        return
    split = v0 + (v1 - v0) * draws.number("keypad_top", (0.55, 0.95))
    deep = min(split - v0, draws.number("keypad_length", (1.2, 2.4)) * half * 2)
    wide, height = half * draws.number("keypad_width", (0.7, 0.95)), draws.length("key_height", (0.0015, 0.005))
    add_keypad(draws, phone, "base", shifted, wide, (split - deep, split), height)
    room = v1 - split
    if room > 0.02:
        _display(draws, phone, shifted, split + 0.12 * room, 0.8 * room, 0.9 * half)


def _handset(
    draws: Draws, phone: Assembly, foot: Array, along: Array, side: Array, out: Array, length: float, grip: float
) -> None:
    """A bar between two round or square ends that lie on the cradle; it is lifted off."""
    thick = grip * draws.number("thickness", (0.7, 1.2))
    bow, square = draws.number("bow", (0.1, 0.9)) * thick, draws.chance("square_ends", 0.5)
    rings = []
    for s in np.linspace(-1.0, 1.0, 7):
        rise = thick + bow * (1.0 - s * s)
        center = foot + 0.5 * s * length * along + rise * out
        wide = grip * (0.75 + 0.25 * s * s)
        section = ((-1, -1), (1, -1), (0.7, 1), (-0.7, 1))
        rings.append(np.array([center + a * wide * side + b * 0.5 * thick * out for a, b in section]))
    solid = loft(rings)
    for s in (-1.0, 1.0):
        center = foot + s * 0.5 * (length - 1.9 * grip) * along
        if square:
            solid += hull([center + a * 0.95 * grip * along + b * grip * w * side + z * out for a in (-1, 1)
                           for b in (-1, 1) for z, w in ((0.0, 0.9), (0.9 * thick, 1.0))])  # fmt: skip
        else:
            solid += cylinder(center, center + 0.9 * thick * out, 0.95 * grip, 0.8 * grip, 20)
    lift = prismatic("base", out, 0.0, draws.length("travel", (0.06, 0.2)), tuple(foot))
    phone.add("handset", solid, lift, density=500.0)


def _dial(draws: Draws, phone: Assembly, face: Face, v: float, radius: float) -> None:
    """A dial with ten holes that turns."""
    center, out = face.at(0.0, v, 0.001), face.outward
    thick = draws.length("dial_thickness", (0.0025, 0.006))
    solid = cylinder(center, center + 0.4 * thick * out, radius, sections=30)
    for inner, outer in ((0.86, 1.0), (0.3, 0.5)):
        solid += ring(center + 0.5 * thick * out, out, inner * radius, outer * radius, thick, 24)
    for k in range(11):
        angle = 0.5 * k
        spoke = cos(angle) * face.right + sin(angle) * face.up
        solid += tube([center + 0.6 * thick * out + r * radius * spoke for r in (0.45, 0.9)], 0.35 * thick, 6)
    turn = revolute("base", -out, tuple(center), 0.0, draws.angle("dial_angle", (4.2, 5.4)))
    phone.add("dial", solid, turn, density=1200.0)


def _display(draws: Draws, phone: Assembly, face: Face, v: float, deep: float, half: float) -> None:
    """A display above the keys, hinged at its lower edge."""
    thick = draws.length("display_thickness", (0.006, 0.012))
    solid = hull([face.at(u, w, h) for u in (-half, half) for w in (v, v + deep) for h in (0.001, thick)])
    inner = [face.at(u, w, h) for u in (-0.85 * half, 0.85 * half) for w in (v + 0.15 * deep, v + 0.85 * deep)
             for h in (0.5 * thick, thick + 0.0006)]  # fmt: skip
    hinge = revolute("base", face.right, tuple(face.at(0.0, v, 0.001)), 0.0, draws.angle("display_angle", (0.4, 1.2)))
    phone.add("display", solid + hull(inner).called("display", face.outward), hinge, density=900.0)
