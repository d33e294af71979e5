"""Toilets: a bowl with a seat and a lid, and what flushes it.

What varies: bowl (long, round or square), foot (pedestal, closed to the wall, hung), cistern (low, high on a pipe, in
the wall), its lid (fixed or lifted off), lever or one or two buttons and where they are, seat (closed or open ring),
lid, hinges.
"""

from itertools import pairwise

import numpy as np

from artsim.making.assembly import Assembly, JointSpec, Rng, pick, prismatic, revolute
from artsim.making.outlines import about, lifted, superellipse
from artsim.making.solids import Solid, box, cylinder, frame, hull, hull_of, loft, rod, tray, tube, union
from artsim.model.kinematics import Array

GAP = 0.002
_AROUND = 24  # sides of the bowl
Point = tuple[float, float, float]
Moving = tuple[str, Solid, JointSpec]
BACK = (0.0, 1.0, 0.0)  # a positive turn about this axis lifts the front edge


class _Cover:
    """Seat and lid; metres."""

    def __init__(self, rng: Rng) -> None:
        self.over = rng.uniform(0.0, 0.012)  # how far they reach beyond the bowl
        self.thick = rng.uniform(0.014, 0.028)  # of the seat
        self.lid = rng.uniform(0.012, 0.03)  # thickness of the lid
        self.axis = rng.uniform(0.015, 0.03)  # distance of the hinges' axis from the seat's end
        self.rise = 0.5 * self.thick + GAP + self.lid  # of the lid's top over the axis


def build(rng: Rng) -> Assembly:
    """A toilet; one sits down facing -X. Seat and lid lie on the bowl at rest."""
    length, width = rng.uniform(0.38, 0.56), rng.uniform(0.33, 0.42)
    height = rng.uniform(0.34, 0.48)
    power = rng.choice([2.0, rng.uniform(2.0, 2.6), rng.uniform(3.0, 6.0)], p=[0.4, 0.4, 0.2])
    tank = pick(rng, {"low": 0.7, "high": 0.1, "wall": 0.2})
    hung = tank == "wall" and rng.random() < 0.7
    cover = _Cover(rng)
    lean = rng.uniform(0.0, 0.2)  # beyond upright
    # Behind the axis there is room for the lid as it stands up, and for a lever on the cistern.
    back = 0.5 * length + cover.over + cover.axis + cover.rise + 0.045 + lean * (length + 0.05)
    body = _bowl(rng, length, width, height, power, back, hung)
    moving: list[Moving] = []
    if tank == "low":
        body += _low_cistern(rng, moving, back, width, height)
    elif tank == "high":
        body += _high_cistern(rng, moving, back, height)
    else:
        body += _wall(rng, moving, back, width, height, hung)
    fixed, covers = _seat_and_lid(rng, length, width, height, power, cover, np.pi / 2 + lean)
    toilet = Assembly("body", body + fixed, 2300.0)
    for name, solid, joint in covers + moving:
        toilet.add(name, solid, joint, density=1200.0)
    return toilet


def _oval(length: float, width: float, power: float, z: float, shift: float = 0.0) -> Array:
    """(N, 3) outline, a superellipse about x = shift, longer towards the front."""
    return lifted(superellipse(power, 0.5 * length, 0.5 * width, _AROUND) + (shift, 0.0), z)


def _rim(outer: tuple[Array, Array], inner: tuple[Array, Array], first: int = 0, last: int = _AROUND) -> Solid:
    """Wedges between outlines, each (bottom, top); only those from ``first`` to ``last`` where the ring is open."""
    rings = [*outer, *inner]
    return union(
        hull([r[k % _AROUND] for r in rings] + [r[(k + 1) % _AROUND] for r in rings]) for k in range(first, last)
    )


def _bowl(rng: Rng, length: float, width: float, height: float, power: float, back: float, hung: bool) -> Solid:
    """Hollow bowl on a foot, with a deck behind it that carries the hinges."""
    wall = rng.uniform(0.03, 0.05)
    low = height * rng.uniform(0.35, 0.5)
    narrow = rng.uniform(0.5, 0.75)
    levels = [(low, narrow), (0.5 * (low + height), 0.5 * (1.0 + narrow) + 0.06), (height, 1.0)]
    solid = Solid()
    for (z0, s0), (z1, s1) in pairwise(levels):
        outer = (_oval(s0 * length, s0 * width, power, z0), _oval(s1 * length, s1 * width, power, z1))
        inner = tuple(_oval(s * length - 2 * wall, s * width - 2 * wall, power, z) for s, z in ((s0, z0), (s1, z1)))
        solid += _rim(outer, (inner[0], inner[1]))
    solid += loft([_oval(narrow * length, narrow * width, power, z) for z in (low - 0.02, low + 0.02)])
    deck = rng.uniform(0.04, 0.12)
    half = 0.5 * width * rng.uniform(0.75, 1.0)
    solid += box((0.5 * length - wall, back), half, (height - deck, height))
    solid += hull_of(
        box((0.3 * length, back), 0.8 * half, (height - deck - 0.03, height - deck + 0.01)),
        box((0.2 * length, back), 0.4 * half, (low - 0.02, low)),
    )
    if hung:
        return solid
    kind = pick(rng, ["pedestal", "skirt", "box"])
    foot = rng.uniform(0.5, 0.85)
    if kind == "pedestal":
        waist = rng.uniform(0.35, 0.5)
        rings = [
            _oval(foot * length, 0.7 * foot * width, 3.0, 0.0, 0.12 * length),
            _oval(0.95 * foot * length, 0.66 * foot * width, 3.0, 0.04, 0.12 * length),
            _oval(waist * length, waist * width, 2.2, 0.6 * low, 0.1 * length),
            _oval(narrow * length, narrow * width, power, low),
        ]
        solid += loft(rings)
        if rng.random() < 0.6:
            solid += hull_of(
                box((0.1 * length, back - 0.02), 0.08, (0.01, 0.03)), box((0.2 * length, back), 0.09, (low, low + 0.02))
            )
    elif kind == "skirt":
        shift = 0.5 * (back - 0.5 * foot * length) * 0.5
        below = _oval(foot * length + 0.1, foot * width, 4.0, 0.0, shift)
        solid += loft([below, _oval(narrow * length, narrow * width, power, low)])
        solid += box((0.1, back), 0.4 * foot * width, (0, low))
    else:
        solid += box((-0.4 * foot * length, back), 0.42 * foot * width, (0, low), fillet=0.05, axis=2)
    return solid


def _low_cistern(rng: Rng, moving: list[Moving], back: float, width: float, height: float) -> Solid:
    """On the deck, right behind the bowl."""
    deep, tall = rng.uniform(0.14, 0.22), rng.uniform(0.28, 0.42)
    half = 0.5 * width * rng.uniform(0.85, 1.35)
    start = back - 0.001
    foot = height - rng.uniform(0.0, 0.04)
    wall = 0.02
    taper = rng.uniform(0.85, 1.0)
    solid = hull_of(
        box((start, start + taper * deep), taper * half, (foot, foot + 0.05)),
        box((start, start + deep), half, (foot + 0.04, foot + 0.1)),
    )
    top = foot + tall
    solid += tray((start, -half, foot + 0.06), (start + deep, half, top), wall)
    # The deck below, down to the floor or a slope.
    solid += hull_of(
        box((start, start + 0.7 * deep), 0.6 * taper * half, (foot - 0.06, foot + 0.01)),
        box((start - 0.05, start + 0.02), 0.3 * half, (0.5 * height, 0.5 * height + 0.03)),
    )
    flush = pick(rng, {"lever": 0.35, "side lever": 0.15, "button": 0.25, "two buttons": 0.25})
    over, thick = rng.uniform(0.004, 0.02), rng.uniform(0.02, 0.045)
    low, high = (start - over, -half - over, top + GAP), (start + deep + over, half + over, top + GAP + thick)
    middle = (start + 0.5 * deep, 0.0)
    buttons = flush.endswith(("button", "buttons"))
    lifts = rng.random() < 0.5
    if buttons:
        lid, parts = _button_lid(rng, low, high, middle, 2 if flush == "two buttons" else 1)
    else:
        lid, parts = box(low, high, fillet=rng.uniform(0.15, 0.45) * thick), []
    if lifts:
        joint = prismatic("body", (0, 0, 1), 0.0, rng.uniform(0.1, 0.3), (middle[0], 0.0, low[2]))
        moving.append(("cistern_lid", lid, joint))
    else:
        solid += lid + frame((start, -half, top - 0.01), (start + deep, half, low[2] + 0.002), [wall] * 4, 0, 1)
    parent = "cistern_lid" if lifts else "body"
    for number, button in enumerate(parts):
        moving.append(
            (f"button_{number}", button, prismatic(parent, (0, 0, -1), 0.0, 0.006, tuple(button.bounds().mean(axis=0))))
        )
    if not buttons:
        hand = rng.choice([-1.0, 1.0])
        level = top - rng.uniform(0.03, 0.08)
        if flush == "lever":
            foot_at, out = (start, hand * (half - rng.uniform(0.05, 0.08)), level), np.array([-1.0, 0.0, 0.0])
            along = np.array([0.0, -hand, 0.0])
        else:
            foot_at, out = (start + 0.04, hand * half, level), np.array([0.0, hand, 0.0])
            along = np.array([-1.0, 0.0, 0.0])
        moving.append(_lever(rng, np.array(foot_at), out, along))
    return solid


def _lever(rng: Rng, foot: Array, out: Array, along: Array) -> Moving:
    """A handle on a pivot in a wall; pressed down it turns."""
    long, thick = rng.uniform(0.05, 0.1), rng.uniform(0.004, 0.008)
    reach = 0.02
    solid = cylinder(foot + GAP * out, foot + (reach + thick) * out, rng.uniform(0.009, 0.014), sections=16)
    tip = foot + reach * out + long * along
    drop = np.array([0.0, 0.0, -rng.uniform(0.0, 0.015)])
    solid += tube([foot + reach * out, tip + drop], [thick, rng.uniform(0.8, 1.5) * thick], 12)
    down = np.cross(along, (0.0, 0.0, -1.0))
    return "lever", solid, revolute("body", down, foot, 0.0, rng.uniform(0.4, 0.8))


def _button_lid(
    rng: Rng, low: Point, high: Point, middle: tuple[float, float], count: int
) -> tuple[Solid, list[Solid]]:
    """Lid with a square well and the buttons in it."""
    half = rng.uniform(0.02, 0.035)
    x, y = middle
    well = frame(low, high, [x - half - low[0], high[0] - x - half, y - half - low[1], high[1] - y - half], 0, 1)
    floor = low[2] + 0.25 * (high[2] - low[2])
    well += box((x - half - 0.001, x + half + 0.001), (y - half - 0.001, y + half + 0.001), (low[2], floor))
    buttons = []
    share = rng.uniform(0.4, 0.65) if count == 2 else 1.0
    edges = [(-half, half)] if count == 1 else [(-half, -half + 2 * half * share), (-half + 2 * half * share, half)]
    low_z = max(floor + 0.007, high[2] - 0.01)
    round_off = 0.99 if count == 1 and rng.random() < 0.5 else 0.2
    for y0, y1 in edges:
        corner = round_off * 0.5 * min(y1 - y0, 2 * half)
        deep, across = (x - half + GAP / 2, x + half - GAP / 2), (y + y0 + GAP / 2, y + y1 - GAP / 2)
        upright = (low_z, high[2] + rng.uniform(0.0065, 0.01))
        buttons.append(box(deep, across, upright, fillet=corner, axis=2, steps=5))
    return well, buttons


def _high_cistern(rng: Rng, moving: list[Moving], back: float, height: float) -> Solid:
    """Up on a pipe, with a chain to pull."""
    up = rng.uniform(0.6, 1.3)
    half, deep, tall = rng.uniform(0.17, 0.26), rng.uniform(0.15, 0.2), rng.uniform(0.2, 0.32)
    x = back + 0.05
    pipe = tube([(back - 0.03, 0, height - 0.06), (x, 0, height - 0.04), (x, 0, height + up + 0.01)], 0.02, 14)
    low = height + up
    start = x - 0.5 * deep
    solid = pipe + box((start, start + deep), half, (low, low + tall), fillet=0.02)
    upright = (low + tall - 0.01, low + tall + 0.02)
    solid += box((start - 0.012, start + deep + 0.012), half + 0.012, upright, fillet=0.008)
    side = rng.choice([-1.0, 1.0])
    y = side * (half + 0.03)
    upright = (low + 0.6 * tall, low + 0.6 * tall + 0.015)
    solid += box(about(x, 0.012), (side * (half - 0.01), y + side * 0.012), upright)
    long = rng.uniform(0.3, 0.55) * up + 0.2
    top = low + 0.6 * tall - GAP
    chain = tube([(x, y, top), (x, y, top - long)], 0.0035, 8)
    chain += rod(x, y, (top - long - 0.06, top - long + 0.005), 0.013, 0.008, 14)
    moving.append(("chain", chain, prismatic("body", (0, 0, -1), 0.0, rng.uniform(0.04, 0.1), (x, y, top))))
    return solid


def _wall(rng: Rng, moving: list[Moving], back: float, width: float, height: float, hung: bool) -> Solid:
    """A panel behind the bowl with a plate for one or two buttons, or only a deck with a lever."""
    half, top = 0.5 * width + rng.uniform(0.03, 0.2), height + rng.uniform(0.45, 0.75)
    solid = box(
        (back - 0.001, -half, 0.0 if hung or rng.random() < 0.7 else 0.1), (back + rng.uniform(0.06, 0.16), half, top)
    )
    z = top - rng.uniform(0.08, 0.14)
    wide, high = rng.uniform(0.09, 0.13), rng.uniform(0.06, 0.09)
    solid += frame((back - 0.012, -wide, z - high), (back, wide, z + high), [0.012] * 4, 1, 2)
    count = int(rng.integers(1, 3))
    inner = wide - 0.012 - GAP
    split = 0.0 if count == 1 else inner * rng.uniform(-0.3, 0.3)
    edges = [(-inner, inner)] if count == 1 else [(-inner, split - GAP / 2), (split + GAP / 2, inner)]
    for number, (y0, y1) in enumerate(edges):
        upright = (z - high + 0.012 + GAP, z + high - 0.012 - GAP)
        button = box((back - 0.016, back - 0.008), (y0, y1), upright, fillet=0.002)
        joint = prismatic("body", (1, 0, 0), 0.0, 0.006, (back - 0.016, 0.5 * (y0 + y1), z))
        moving.append((f"button_{number}", button, joint))
    return solid


def _seat_and_lid(
    rng: Rng, length: float, width: float, height: float, power: float, cover: _Cover, limit: float
) -> tuple[Solid, list[Moving]]:
    """What of seat and lid belongs to the body, and what turns about one axis behind the bowl.

    The lid lies on the seat: it hangs on it, goes ahead of it in step, or only one of the two moves. So neither can go
    through the other.
    """
    low = height + 0.004
    top, at = low + cover.thick, low + 0.5 * cover.thick
    long, wide = length + 2 * cover.over, width + 2 * cover.over
    edge = 0.5 * long
    axis_x = edge + cover.axis
    half = rng.uniform(0.02, 0.04)
    apart = 0.5 * width * rng.uniform(0.3, 0.55)
    seat = _ring(rng, long, wide, power, low, top)
    round_off = 0.45 * cover.thick
    for y in (-apart, apart):
        near, far = y - half / 2 + 0.001, y + half / 2 - 0.001
        seat += box((edge - 0.06, axis_x), (near, far), (low + 0.15 * cover.thick, low + 0.85 * cover.thick))
        seat += rod(axis_x, (near, far), at, round_off, sections=14)
    lid = _lid(rng, long, wide, power, top + GAP, cover.lid)
    for y in (-apart - half, apart + half):  # arms from the plate down to the axis, beside the seat's
        near, far = y - half / 2 + 0.001, y + half / 2 - 0.001
        arm = box((edge - 0.07, axis_x), (near, far), (top + GAP, top + GAP + 0.5 * cover.lid))
        lid += arm + hull_of(
            rod(axis_x, (near, far), at, 0.3 * cover.thick, sections=14),
            box((axis_x - 0.01, axis_x), (near, far), (top + GAP, top + GAP + 0.5 * cover.lid)),
        )
    hinge = (axis_x, 0.0, at)
    kind = pick(rng, {"both": 0.45, "in step": 0.2, "lid": 0.25, "seat": 0.1})
    if kind == "lid":
        stops = union(
            rod(0.3 * length, y, (height - 0.002, low + 0.002), 0.01, sections=10)
            for y in (-0.36 * width, 0.36 * width)
        )
        return seat + stops, [("lid", lid, revolute("body", BACK, hinge, 0.0, limit))]
    share = rng.uniform(0.3, 0.7)
    first = share * limit if kind == "both" else limit * rng.uniform(0.96, 1.0)
    covers: list[Moving] = [("seat", seat, revolute("body", BACK, hinge, 0.0, first))]
    if kind == "both":
        covers.append(("lid", lid, revolute("seat", BACK, hinge, 0.0, (1.0 - share) * limit)))
    elif kind == "in step":
        covers.append(("lid", lid, revolute("body", BACK, hinge, 0.0, limit, mimic=("seat", limit / first))))
    return Solid(), covers


def _ring(rng: Rng, long: float, wide: float, power: float, low: float, top: float) -> Solid:
    """Seat: a ring, closed or open at the front."""
    broad = rng.uniform(0.16, 0.24)
    inner_long, inner_wide = long - broad * rng.uniform(0.8, 1.0), wide - broad * rng.uniform(0.7, 0.95)
    outer = (_oval(long, wide, power, low), _oval(0.985 * long, 0.985 * wide, power, top))
    inner = (_oval(inner_long, inner_wide, 2.0, low, 0.01), _oval(1.03 * inner_long, 1.03 * inner_wide, 2.0, top, 0.01))
    first = _AROUND // 2 + 2
    return _rim(outer, inner, first, first + _AROUND - 4) if rng.random() < 0.2 else _rim(outer, inner)


def _lid(rng: Rng, long: float, wide: float, power: float, low: float, thick: float) -> Solid:
    """A plate whose upper edge is bevelled."""
    scale = rng.uniform(0.96, 1.02)
    long, wide = scale * long, scale * wide
    bevel = rng.uniform(0.02, 0.25)
    levels = ((1.0, low), (1.0, low + 0.6 * thick), (1.0 - bevel, low + thick))
    return loft([_oval(share * long, share * wide, power, z) for share, z in levels])
