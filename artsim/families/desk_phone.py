"""Desk sets among the telephones: a sloping base with keys or a dial, a handset on it."""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.common.products import unit
from artsim.families.keys import Face, add_keypad
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.solids import cylinder, hull, loft, ring, tube
from artsim.model.kinematics import Array

GAP = 0.0005


def desk_set(draws: Draws, phone: Assembly) -> None:
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
