"""Folding knives: a handle with one or more blades and tools that turn out of it; folded at rest, lying flat.

Varied: length, outline and thickness of the handle (straight, curved, swelling), bolsters and rivets, the outline of
the blades (drop point, clip, sheep's foot, spear), a pocket knife with up to six blades and tools in several layers
from both ends, and the angle to which each opens.
"""

import numpy as np

from artsim.common.elementary import cos, power, sin
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import Array, about, strips
from artsim.making.solids import Solid, box, deferred, loft, prism, rod, union

GAP = 0.0005
RING = 16


def build(draws: Draws) -> Assembly:
    """A knife, folded at rest. Blades turn about vertical pins at the ends of the handle."""
    length, stout = draws.log_length("length", 0.125, -0.733, 0.733), draws.chance("stout", 0.1, upper=True)
    half = 0.5 * length * draws.number("width", (0.42, 0.54) if stout else (0.11, 0.42))
    many = draws.chance("pocket_knife", 0.4)
    layers = draws.integer("layers", 2, 4) if many else 1
    sheet = draws.length("blade_thickness", (0.0012, 0.0028))
    liner = 0.0016
    thin = draws.chance("thin_scales", 0.15, upper=True)
    scale = length * draws.number("scale_thickness", (0.007, 0.012) if thin else (0.012, 0.045 if many else 0.09))
    pin = draws.number("tang_radius", (0.55, 0.75)) * half  # of the blades
    pitch = sheet + 2 * GAP + liner
    ends = np.array([-0.5 * length + half, 0.5 * length - half])

    handle = Solid()
    bow = 0.0 if many else half * draws.number("bow", (-0.8, 1.0))
    outline = _outline(length, half, bow, draws.number("swell", (0.0, 0.3)))
    low = scale + liner
    for k in range(layers + 1):  # liners, and the scales outside
        z = low - liner + k * pitch
        handle += _plate(outline, z, z + liner)
    thick = low + layers * pitch
    handle += _plate(outline, 0.35 * scale, scale + 0.0005) + _plate(outline * (0.985, 0.85), 0.0, 0.4 * scale)
    handle += _plate(outline, thick - 0.0005, thick + 0.65 * scale)
    handle += _plate(outline * (0.985, 0.85), thick + 0.6 * scale, thick + scale)
    # The back holds the layers together; it leaves room for the tangs at the ends.
    spine = half * draws.number("spine", (0.25, 0.4))
    back = _back(outline, spine, ends - np.array([-1.0, 1.0]) * (pin + 2 * GAP))
    handle += union(prism(piece, low - 0.0005, thick + 0.0005) for piece in back)
    pins = np.column_stack([ends, [float(np.interp(x, outline[0, :, 0], outline.mean(axis=0)[:, 1])) for x in ends]])
    knife = Assembly("handle", handle + _details(draws, outline, pins, thick + scale), 1600.0)

    span = ends[1] - ends[0]
    edge = min(float(piece[:, 1].min()) for piece in back) - pins[0, 1] - 2 * GAP
    open_to = draws.degrees("blade_angle", (165.0, 180.0))
    number = 0
    for k in range(layers):
        z = low + k * pitch + GAP
        pair = many and draws.chance("pair", 0.5)
        for side in (-1, 1) if pair else (-1,):
            # Of a pair, the upper corner of each point stays before the middle while the blade turns.
            room = np.sqrt(0.23 * (span * span) - edge * edge) if pair else span + 0.5 * half
            kind = "blade" if number == 0 or draws.chance("second_blade", 0.5) else "tool"
            back_edge = -half * draws.number("blade_width", (0.7, 1.05))
            long = room * draws.number("blade_length", (0.88, 1.0))
            pieces = _blade(draws.within(kind), long, back_edge, edge, pin, kind)
            blade = union(prism(piece, z, z + sheet) for piece in pieces)
            x, y = pins[0 if side < 0 else 1]
            blade = (blade if side < 0 else blade.mirrored(0)).moved((x, y, 0))
            angle = np.deg2rad(open_to if kind == "blade" else draws.degrees("tool_angle", (85.0, 180.0)))
            joint = revolute("handle", (0, 0, side), (x, y, z), 0.0, angle)
            knife.add(f"{kind}_{number}" if many else kind, blade, joint, density=6000.0)
            number += 1
    return knife


def _outline(length: float, half: float, bow: float, swell: float) -> Array:
    """(2, N, 2) lower and upper edge of the handle, the ends round."""
    cap = 0.5 * length - half * (1 - cos(np.linspace(0.0, 0.5 * np.pi, 6)))
    x = np.concatenate([-cap, np.linspace(-cap[-1], cap[-1], 7)[1:-1], cap[::-1]])
    share = 2 * x / length
    over = np.clip((np.abs(x) - (0.5 * length - half)) / half, 0.0, 0.995)
    width = half * np.sqrt(1 - np.square(over)) * (1 - swell + swell * np.square(cos(0.5 * np.pi * share)))
    middle = bow * (np.square(share) - 0.5)
    return np.stack([np.column_stack([x, middle - width]), np.column_stack([x, middle + width])])


@deferred
def _plate(outline: Array, low: float, high: float) -> Solid:
    """Plate with the handle's outline; a single piece where the outline is symmetric, and so convex."""
    if np.allclose(outline[0, :, 1], -outline[1, :, 1]):
        return prism(outline.reshape(-1, 2), low, high)
    rings = [np.array([(*point, z) for point in (a, b) for z in (low, high)]) for a, b in zip(*outline, strict=True)]
    return loft(rings)


def _back(outline: Array, spine: float, reach: Array) -> list[Array]:
    """Convex outlines along the upper edge between the tangs."""
    x = np.linspace(reach[0], reach[1], 8)
    edge = np.interp(x, outline[1][:, 0], outline[1][:, 1])
    return strips(np.column_stack([x, edge]), np.column_stack([x, edge - spine]))


def _blade(draws: Draws, length: float, low: float, high: float, pin: float, kind: str) -> list[Array]:
    """Convex outlines of a blade along +X from its pin at the origin: its back at ``low``, its edge at ``high``."""
    x = np.linspace(0.0, 1.0, 10)
    if kind == "tool":
        narrowed = 1 - (1 - draws.number("taper", (0.4, 1.0))) * x
        back, edge = low * narrowed, high * narrowed
        back[-1], edge[-1] = 0.8 * back[-1], 0.8 * edge[-1]
    else:
        shape = draws.pick("shape", ["drop", "clip", "sheep", "spear"])
        bend, level, turn = {
            "drop": (2.2, 0.4, 0.5),
            "clip": (1.0, 0.45, draws.number("clip", (0.55, 0.7))),
            "sheep": (2.5, 0.92, 0.75),
            "spear": (2.0, 0.5, 0.6),
        }[shape]
        point = low + level * (high - low)
        falling = power(np.clip((x - turn) / (1 - turn), 0, 1), bend)
        if shape == "sheep":  # the back falls to a straight edge
            back, edge = low + (point - low) * falling, np.full(10, high)
        else:
            back = low + (point - low - 0.0003) * falling
            edge = high - (high - point) * power(np.clip((x - 0.45) / 0.55, 0, 1), 2.2)
        edge = np.where(x < 0.12, 0.7 * high, edge)  # the choil
    angles = np.arange(RING) * (2.0 * np.pi / RING)
    tang = pin * np.column_stack([cos(angles), sin(angles)])
    upper = np.maximum(edge, back + 0.0006)
    return [tang, *strips(np.column_stack([x * length, back]), np.column_stack([x * length, upper]))]


def _details(draws: Draws, outline: Array, pins: Array, top: float) -> Solid:
    """Rivets, bolsters or a badge on both faces of the handle."""
    solid = Solid()
    x, half = 0.5 * (pins[0, 0] + pins[1, 0]), pins[1, 0] - pins[0, 0]
    radius = draws.length("rivet_radius", (0.0012, 0.0025))
    for face, outward in ((0.0, -1), (top, 1)):
        for px, py in pins:
            solid += rod(px, py, (face - outward * 0.001, face + outward * 0.0005), radius, sections=12)
    kind = draws.pick("detail", ["none", "bolster", "badge", "clip"])
    middle = float(outline[:, len(outline[0]) // 2, 1].mean())
    if kind == "bolster":
        shown = outline[:, outline[0, :, 0] < pins[0, 0] + draws.number("bolster_length", (0.05, 0.2)) * half] * 0.97
        solid += _plate(shown, top - 0.0008, top + 0.0006) + _plate(shown, -0.0006, 0.0008)
    elif kind == "badge":
        size = draws.number("badge_size", (0.04, 0.09)) * half
        solid += box(about(x, 1.4 * size), about(middle, size), (top - 0.001, top + 0.0005))
    elif kind == "clip":  # belt clip
        y, lift = about(middle, 0.003), top + 0.0025
        solid += box((x + 0.32 * half, x + 0.42 * half), y, (top - 0.001, lift + 0.0015))
        solid += box((x - 0.25 * half, x + 0.42 * half), y, (lift, lift + 0.0015))
    return solid
