"""Buckets and pails: a vessel with a bail on two pins.

Round or oval, small to large, flat to deep, tapered, straight or bulging; rims, hoops, feet, round or D-shaped bails of
wire or straps, with or without a grip, where the pins are, and how far the bail swings vary. The bail stands upright at
rest.
"""

import numpy as np

from artsim.common.elementary import cos, hypot, power, sin
from artsim.common.products import norm
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import SIDE, UP, Array, ends
from artsim.making.solids import Solid, box, ring, rod, tube, union, vessel

SIDES = 20
"""Segments of the vessel's circle."""


def build(draws: Draws) -> Assembly:
    """A bucket whose bail stands up at rest and swings to both sides."""
    top = 0.5 * draws.length("width", (0.18, 0.36), (0.12, 0.68), tails=0.25)
    height = top * draws.number("height", (0.85, 3.2), (0.55, 5.4), tails=0.3)
    wall = draws.length("wall", (0.0018, 0.004))
    profile = _profile(draws, top, height)
    body = vessel(profile, wall, sections=SIDES) + _rim(draws, top, height, wall, profile)
    # Its depth over its width.
    oval = draws.number("depth", (0.7, 0.98), (0.45, 1.9), tails=0.5) if draws.chance("oval", 0.4) else 1.0
    body = body.scaled((oval, 1.0, 1.0))

    pin = draws.length("pin_radius", (0.0022, 0.005), (0.0012, 0.005))
    # Pins lie near the rim: a bail bends inwards as it rises, and has to pass the rim outside.
    pivot = height - top * draws.number("pin_height", (0.06, 0.22))
    # Of the pins from the middle.
    ahead = oval * top * draws.number("pin_shift", (-0.32, 0.32)) if draws.chance("pins_ahead", 0.3) else 0.0
    wire = draws.length("wire_radius", (0.0012, 0.0045), (0.0008, 0.008)) if pin > 0.0017 else 0.0008
    outer = top + 0.012  # beyond the rim
    bail_y = outer + 0.0015 + max(wire, 0.0025)
    across = float(np.sqrt(1.0 - np.square(ahead / (oval * top))))
    wall_y = across * float(np.interp(pivot, profile[:, 1], profile[:, 0])) - 0.7 * wall
    half, boxy = draws.length("ear_radius", (0.008, 0.016)), draws.chance("flat_ears", 0.5)
    for side in (-1.0, 1.0):
        ear = _ear(side, (wall_y, outer, bail_y + max(wire, 0.0025) + 0.001), pivot, pin, half, boxy)
        body += ear.moved((ahead, 0, 0))
    # Up to the level, a point of a round bail lies this far from the middle of the pins; the rim keeps within.
    reach = hypot(max(1.0, oval) * outer + abs(ahead), height + 0.004 - pivot) + 2 * wire + 0.006
    bail, path, thick = _bail(draws, bail_y, max(reach, bail_y), pivot, pin, wire)

    longest = profile * (max(1.0, oval), 1.0)
    limits = [_swing(side, path, thick, longest, outer + 0.5 * wire, pivot, ahead) for side in (-1.0, 1.0)]
    shares = draws.numbers("swing", 0.5, 1.0, 2).tolist()
    if draws.chance("even_swing", 0.5):  # as far to both sides
        limits, shares = [min(limits)] * 2, [shares[0]] * 2
    low, high = (share * limit for share, limit in zip(shares, limits, strict=True))
    joint = revolute("body", SIDE, (ahead, 0, pivot), -low, high)
    bail = bail.moved((ahead, 0, 0))
    if oval == 1.0 and draws.chance("pins_turned", 0.3):  # pins not quite at the sides
        turn = draws.angle("pin_turn", (-0.2, 0.2))
        body, bail = (solid.turned(UP, turn) for solid in (body, bail))
        origin = (ahead * cos(turn), ahead * sin(turn), pivot)
        joint = revolute("body", (-sin(turn), cos(turn), 0), origin, -low, high)
    bucket = Assembly("body", body, 1500.0)
    bucket.add("handle", bail, joint, density=3000.0)
    return bucket


def _swing(side: float, path: Array, thick: Array, profile: Array, outer: float, pivot: float, ahead: float) -> float:
    """Angle from upright, up to which a bail clears the bucket and the ground as it swings to a side: 1 +X, -1 -X.

    ``path`` (N, 3) is the middle line of the bail over the pins, ``thick`` (N,) its radius; ``profile`` (M, 2) the
    outer radius and height of the bucket. Beyond ``outer`` from the middle plane there are only the ends of the pins.
    """
    angles = np.deg2rad(np.arange(60.0, 175.0, 2.0))[:, None]
    arm = path[:, 2] - pivot
    x, z = ahead + side * sin(angles) * arm, pivot + cos(angles) * arm
    wide = np.interp(z, profile[:, 1], profile[:, 0]) + 0.009 + thick  # beyond hoops and the rim
    beside = (np.abs(path[:, 1]) >= outer) | (hypot(x, path[:, 1]) >= wide)
    above = z >= profile[-1, 1] + 0.006 + thick
    clear = (above | (beside & (z >= thick))).all(axis=1)
    first = len(angles) if clear.all() else int(np.argmin(clear))
    return float(angles[max(first - 1, 0), 0])


def _profile(draws: Draws, top: float, height: float) -> Array:
    """Outer radius and height, from the bottom up."""
    bottom = top * draws.number("bottom", (0.6, 0.98))
    kind = draws.pick("shape", {"taper": 0.5, "steps": 0.2, "belly": 0.15, "foot": 0.15})
    if kind == "steps":
        bend = draws.number("bend", (0.6, 0.8))
        middle = bottom + (top - bottom) * bend
        low, high = (0.97 * middle, bend * height), (middle, (bend + 0.03) * height)
        return np.array([(bottom, 0.0), low, high, (top, height)])
    if kind == "belly":
        shares = np.linspace(0.0, 1.0, 4)
        bulge = sin(np.pi * shares) * top * draws.number("bulge", (0.02, 0.06))
        return np.column_stack([bottom + (top - bottom) * shares + bulge * (shares < 1), shares * height])
    if kind == "foot":
        return np.array([(bottom, 0.0), (0.97 * bottom, 0.1 * height), (top, height)])
    return np.array([(bottom, 0.0), (top, height)])


def _rim(draws: Draws, top: float, height: float, wall: float, profile: Array) -> Solid:
    """Rolled rim, hoops around the side, and a spout."""
    width = draws.length("rim_width", (0.002, 0.006))
    solid = ring((0, 0, height), UP, top - wall - 0.001, top + width, 0.006, SIDES)
    slack = np.abs(np.diff(profile[:, 0])).max() * 0.06
    for share in draws.numbers("hoop_at", 0.2, 0.8, draws.pick("hoops", {0: 0.5, 1: 0.35, 2: 0.15})).tolist():
        radius = float(np.interp(share * height, profile[:, 1], profile[:, 0]))
        width = draws.length("hoop_width", (0.006, 0.02))
        solid += ring((0, 0, share * height), UP, radius - wall, radius + slack + 0.002, width, SIDES)
    if draws.chance("foot", 0.3):
        foot = profile[0, 0]
        solid += ring((0, 0, -0.003), UP, foot - 0.012, foot - 0.001, 0.012, SIDES)
    return solid


def _ear(side: float, span: tuple[float, float, float], pivot: float, pin: float, half: float, boxy: bool) -> Solid:
    """Plate or boss from the wall outward, with the pin that the bail hangs on; ``span`` holds where they end in Y."""
    wall, outer, tip = (side * y for y in span)
    if boxy:
        solid = box(half, ends((wall, outer)), (pivot - 1.3 * half, pivot + half))
    else:
        solid = rod(0, (wall, outer), pivot, 1.2 * half, 0.9 * half, 20)
    solid += rod(0, (outer - side * 0.001, tip), pivot, 0.85 * pin, sections=12)
    return solid + rod(0, (tip, tip + side * 0.002), pivot, 1.6 * pin, sections=12)


def _bail(draws: Draws, half: float, reach: float, pivot: float, pin: float, wire: float) -> tuple[Solid, Array, Array]:
    """Wire or strap from eye to eye over the opening, with a grip in the middle; its middle line and its radius."""
    curved = draws.chance("round_bail", 0.85)
    height = reach * draws.number("bail_height", (1.0, 1.3) if draws.chance("low_bail", 0.6) else (1.2, 1.7))
    if curved:  # from a half circle to a rounded rectangle
        angles = np.linspace(0.0, np.pi, 17)
        cosine, sine = cos(angles), sin(angles)
        bend = draws.one_of("bail", {"circle": 0.95, "squarish": draws.number("bail_bend", (0.5, 0.95))})
        across = half * np.sign(cosine) * power(np.abs(cosine), bend)
        path = np.column_stack([np.zeros(17), across, pivot + height * power(sine, bend)])
    else:
        straight, flat = 0.55 * height, draws.number("bail_top", (0.4, 0.8))
        side = [(0.0, half, pivot), (0.0, half, pivot + straight), (0.0, flat * half, pivot + height)]
        path = np.array(side + [(0.0, -y, z) for _, y, z in side[::-1]])
    lift = (2.2 * pin + 0.6 * wire) / norm(path[1] - path[0])
    path[0] += (path[1] - path[0]) * lift
    path[-1] += (path[-2] - path[-1]) * lift
    solid, radius = tube(path, wire, 8), wire
    if draws.chance("strap", 0.25):  # wide along X
        wide = draws.number("strap_width", (1.5, 5.0))
        solid, radius = solid.scaled((wide, 1.0, 1.0)), wide * wire
    solid += union(ring((0, side_y, pivot), SIDE, 1.1 * pin, 2.0 * pin + wire, 0.004, 10) for side_y in (-half, half))
    if draws.chance("grip", 0.6):
        z = path[:, 2].max()
        grip, length = draws.length("grip_radius", (0.007, 0.013)), 0.35 * half
        solid += rod(0, (-length, length), z, grip, sections=16)
        radius = max(radius, grip)
    steps = np.linspace(0.0, len(path) - 1.0, 8 * len(path))
    line = np.column_stack([np.interp(steps, np.arange(len(path)), column) for column in path.T])
    return solid, line, np.full(len(line), radius)
