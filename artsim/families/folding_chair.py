"""Folding chairs: chairs and stools whose legs swing together, whose seat or back folds up.

What varies: how it folds (crossed legs with or without a seat that follows them, legs that fold under the seat, a back
that folds down on the seat, a seat that tips up between its sides), tubes or bars, size, lean, seat and back (slats,
board, fabric, frame), arms, stretchers.
"""

import numpy as np

from artsim.common.elementary import arctan2, cos, hypot, sin
from artsim.common.products import norm, unit
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import SIDE, Array, Vector, about
from artsim.making.solids import Solid, box, cylinder, frame, hull, rod, union

GAP = 0.004


class _Bar:
    """What the frame is made of: tubes or bars."""

    def __init__(self, draws: Draws) -> None:
        self.round = draws.chance("round_bars", 0.55)
        # Half its width along Y, and half its depth across its length, in the XZ plane.
        self.thick = 0.5 * draws.length("bar_width", (0.018 if self.round else 0.016, 0.028))
        self.deep = self.thick if self.round else 0.5 * draws.length("bar_depth", (0.024, 0.044))

    def between(self, start: Vector, end: Vector) -> Solid:
        """A bar along a line in a plane of constant Y."""
        start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
        if self.round:
            return cylinder(start, end, self.thick, sections=12)
        across = self.deep * np.cross(SIDE, unit(end - start))
        wide = self.thick * SIDE
        return hull([p + s * across + t * wide for p in (start, end) for s in (-1, 1) for t in (-1, 1)])

    def across(self, x: float, z: float, half: float) -> Solid:
        """A stretcher along Y."""
        size = min(self.thick, self.deep)
        if self.round:
            return rod(x, (-half, half), z, 0.9 * size, sections=12)
        return box(about(x, size), half, about(z, size))

    def inner_pair(self, foot: Array, head: Array, pivot: Array, inner: float, outer: float) -> Solid:
        """Two bars, ``inner`` beside the middle, with pins into an outer pair that they cross at the pivot."""
        solid = Solid()
        for s in (-1, 1):
            solid += self.between(foot + s * inner * SIDE, head + s * inner * SIDE)
            pin0, pin1 = (inner + self.thick - 0.002) * s * SIDE, (outer - self.thick - 0.0015) * s * SIDE
            solid += cylinder(pivot + pin0, pivot + pin1, 0.7 * self.thick, sections=10)
        return solid


def build(draws: Draws) -> Assembly:
    """A folding chair, unfolded at rest; one sits down facing -X."""
    kinds = {"crossed": _crossed, "legs_under": _under, "tip_up": _tip_up, "stool": _stool}
    return draws.one_of("kind", kinds, (0.45, 0.2, 0.2, 0.15))(draws)


def _panel(draws: Draws, low: Vector, high: Vector, axis: int) -> Solid:
    """A seat or a back within a box: board, slats along Y, a frame with a board, or a bulging cushion.

    ``axis`` is the direction that slats follow one another in.
    """
    kind = draws.pick("panel", {"board": 0.35, "slats": 0.3, "frame": 0.15, "cushion": 0.2})
    thick = 2 if axis == 0 else 0
    low, high = np.array(low, dtype=np.float64), np.array(high, dtype=np.float64)
    middle = 0.5 * (low[thick] + high[thick])
    if kind == "slats":
        count = int(np.clip((high[axis] - low[axis]) / draws.length("slat_pitch", (0.035, 0.09)), 1, 9))
        edges = np.linspace(low[axis], high[axis], count + 1)
        solid = Solid()
        for k in range(count):
            a, b = low.copy(), high.copy()
            a[axis], b[axis] = edges[k] + (0.004 if k else 0.0), edges[k + 1] - (0.004 if k < count - 1 else 0.0)
            solid += box(a, b)
        for y in (low[1] + 0.12 * (high[1] - low[1]), high[1] - 0.12 * (high[1] - low[1])):  # battens below hold them
            a, b = low.copy(), high.copy()
            (a[1], b[1]), b[thick] = about(y, 0.012), middle
            solid += box(a, b)
        return solid
    if kind == "frame":
        a, b = low + 0.02, high - 0.02
        a[thick], b[thick] = about(middle, 0.0025)
        return frame(low, high, [0.025] * 4, 1, axis) + box(a, b)
    if kind == "cushion":
        return box(low, high, fillet=0.45 * (high[thick] - low[thick]))
    return box(low, high, fillet=draws.length("corner", (0.01, 0.09)), axis=thick, steps=4)


def _crossed(draws: Draws) -> Assembly:
    """Two pairs of legs that cross; the front legs go on up to the back rest."""
    bar = _Bar(draws)
    half = 0.5 * draws.length("width", (0.38, 0.54))  # to the middle of the outer bars
    seat_z, spread = draws.length("seat_height", (0.4, 0.48)), 0.5 * draws.length("depth", (0.38, 0.54))
    high = draws.length("height", (0.74, 1.0))
    lean = draws.angle("lean", (0.38, 0.62))  # of the front legs, from the vertical
    foot = np.array([-spread, 0.0, 0.0])
    direction = np.array([sin(lean), 0.0, cos(lean)])
    bend = draws.angle("bend", (0.0, lean))  # above the seat the frame stands steeper
    joint_at = foot + seat_z / cos(lean) * direction
    upright = np.array([sin(lean - bend), 0.0, cos(lean - bend)])
    above = (high - seat_z) / cos(lean - bend)
    head = joint_at + above * upright

    apart = 2.0 * bar.thick + GAP
    frame_solid = Solid()
    for s in (-1, 1):
        y = s * half * SIDE
        frame_solid += bar.between(foot + y, joint_at + y) + bar.between(joint_at + y - 0.004 * upright, head + y)
    front = foot + draws.length("stretcher_height", (0.08, 0.16)) * direction
    frame_solid += bar.across(front[0], front[2], half)
    depth, thick = draws.lengths(seat_depth=(0.32, 0.42), back_thickness=(0.012, 0.03))
    # The back rest is in the upper part of the frame, so that the seat has room below it.
    back_low = max(0.35 * above, 0.12)
    tall = (above - back_low) * draws.number("back_share", (0.5, 1.0))
    panel = _panel(draws.within("back"), (-0.5 * thick, -half, above - tall), (0.5 * thick, half, above), 2)
    frame_solid += panel.turned(SIDE, lean - bend).moved(joint_at)
    chair = Assembly("frame", frame_solid, 900.0)

    # Rear legs: inside the front ones, from behind the frame's foot to below the seat's front.
    inner = half - apart
    rear_foot = np.array([spread * draws.number("rear_feet", (0.75, 1.2)), 0.0, 0.0])
    seat_thick = draws.length("seat_thickness", (0.015, 0.04))
    seat_low = seat_z + bar.deep + GAP
    rear_head = np.array([joint_at[0] - depth * draws.number("rear_legs", (0.7, 0.95)), 0.0, seat_z - bar.deep])
    along = rear_head - rear_foot
    line = rear_foot + np.linspace(0.0, 1.0, 400)[:, None] * along
    pivot = line[int(np.argmin(np.abs(np.cross(line - foot, direction)[:, 1])))]
    legs = bar.inner_pair(rear_foot, rear_head, pivot, inner, half)
    back_bar = rear_foot + 0.12 * along
    legs += bar.across(back_bar[0], back_bar[2], inner)
    # Folded, the rear legs lie along the front legs, but for what the stretchers need.
    angle = float(arctan2(direction[2], direction[0]) - arctan2(along[2], along[0]))
    closing = abs((angle + np.pi) % (2.0 * np.pi) - np.pi)
    reach = min(float(norm(front - pivot)), float(norm(back_bar - pivot)))
    limit = max(closing - 2.6 * max(bar.deep, bar.thick) / reach - 0.06, 0.15)
    # A turn about +Y lifts the legs' upper end, which is at -X, towards the front legs' upper end.
    chair.add("legs", legs, revolute("frame", SIDE, pivot, 0.0, limit))

    seat_half = inner - bar.thick - GAP
    hinge_x = joint_at[0] - 0.012 - bar.deep
    near, far = (hinge_x - depth, -seat_half, seat_low), (hinge_x, seat_half, seat_low + seat_thick)
    seat = _panel(draws.within("seat"), near, far, 0)
    swing = np.pi / 2 + (lean - bend) - 0.08 - float(arctan2(0.5 * seat_thick + thick + 0.02, back_low))
    how = draws.pick("seat_moves", {"follows": 0.4, "free": 0.45, "barely": 0.15})
    if how == "barely":
        swing = draws.angle("seat_angle", (0.1, 0.3))
    mimic = ("legs", swing / limit) if how == "follows" else None
    hinge_at = (hinge_x, 0.0, seat_low + 0.5 * seat_thick)
    chair.add("seat", seat, revolute("frame", SIDE, hinge_at, 0.0, swing, mimic=mimic), density=600.0)
    return chair


def _under(draws: Draws) -> Assembly:
    """A seat whose back folds down on it and whose legs fold up under it."""
    bar = _Bar(draws)
    half, depth = 0.5 * draws.length("width", (0.4, 0.6)), draws.length("depth", (0.36, 0.5))
    seat_z, thick = draws.lengths(seat_height=(0.25, 0.48), seat_thickness=(0.02, 0.04))
    x0, x1 = -0.5 * depth, 0.5 * depth
    rail = max(bar.deep, bar.thick)
    low, high = (x0, -half + 0.5 * bar.thick, seat_z), (x1, half - 0.5 * bar.thick, seat_z + thick)
    seat = _panel(draws.within("seat"), low, high, 0)
    for s in (-1, 1):
        seat += bar.between((x0, s * half, seat_z + 0.5 * thick), (x1, s * half, seat_z + 0.5 * thick))
    under = seat_z - rail - GAP
    knee = under - rail
    legs = []
    for name, x, ahead, way in (("front_legs", x0 + 0.05, -1.0, 1.0), ("rear_legs", x1 - 0.05, 1.0, -1.0)):
        y = half - (0.0 if ahead < 0 else 2.0 * bar.thick + GAP)
        slope = ahead * draws.number(f"{name}_slant", (0.0, 0.3))
        solid = union(bar.between((x, t * y, knee), (x + slope * knee, t * y, 0.0)) for t in (-1, 1))
        z = knee * draws.number(f"{name}_stretcher", (0.15, 0.6))
        solid += bar.across(x + slope * (knee - z), z, y)
        legs.append((name, solid, way, (x, 0.0, knee), float(hypot(knee, slope * knee)), slope, knee - z))
        for t in (-1, 1):  # lugs
            seat += box(about(x, 0.02), about(t * y, bar.thick), (under + 0.001, seat_z + 0.002))
    chair = Assembly("seat", seat, 600.0)
    bar_at = np.zeros(2)  # X and Z of the front legs' stretcher, folded, before which the rear legs stop
    for name, solid, way, at, length, slope, below in legs:
        # They stop a little below the seat; those in front fold back, those behind fold forward, to the inside.
        slant = way * float(arctan2(slope, 1.0))
        limit = 0.45 * (np.pi / 2 - slant - 0.12 - 2.0 * rail / length)
        limit *= 1.0 if draws.chance(f"{name}_fold_flat", 0.7) else draws.number(f"{name}_fold", (0.5, 1.0))
        if name == "front_legs":
            reach = hypot(below, slope * below)
            bar_at = np.array([at[0] + reach * sin(limit + slant), knee - reach * cos(limit + slant)])
        else:
            ahead, down = at[0] - bar_at[0], knee - bar_at[1]
            away, clear = float(hypot(ahead, down)), bar.deep + 1.5 * min(bar.thick, bar.deep) + GAP
            if away < length + clear:
                limit = min(limit, float(arctan2(ahead, down)) - clear / away - slant)
        chair.add(name, solid, revolute("seat", -way * SIDE, at, 0.0, limit), density=900.0)
    if draws.chance("back", 0.85):
        tall, back_thick = draws.lengths(back_height=(0.25, 0.65), back_thickness=(0.012, 0.03))
        hinge = np.array([x1 + rail + GAP + 0.012, 0.0, seat_z + thick + 0.012])
        wide = half - 0.01
        near, far = hinge + (-0.5 * back_thick, -wide, 0.05), hinge + (0.5 * back_thick, wide, tall)
        back = _panel(draws.within("back"), near, far, 2)
        for y in (bar.thick - wide, wide - bar.thick):
            back += bar.between(hinge + (0, y, 0), hinge + (0, y, tall - 0.02))
        lean = draws.angle("back_lean", (0.08, 0.6))
        fold = np.pi / 2 + lean - 0.06 - float(arctan2(rail + 0.5 * back_thick + 0.012, 0.08))
        hinged = revolute("seat", -SIDE, hinge, 0.0, max(fold, 0.3))
        chair.add("back", back.turned(SIDE, lean, hinge), hinged, density=700.0)
    return chair


def _tip_up(draws: Draws) -> Assembly:
    """Seats that tip up between fixed sides, as in a hall; one or more in a row."""
    count = draws.pick("seats", {1: 0.55, 2: 0.3, 3: 0.15})
    width, depth, side_thick = draws.lengths(seat_width=(0.42, 0.56), depth=(0.36, 0.48), side_thickness=(0.02, 0.06))
    seat_z, thick = draws.lengths(seat_height=(0.38, 0.46), seat_thickness=(0.03, 0.1))
    lean = draws.angle("back_lean", (0.05, 0.3))
    back_tall, back_thick = draws.lengths(back_height=(0.35, 0.6), back_thickness=(0.03, 0.09))
    arm_z = seat_z + draws.length("arm_height", (0.15, 0.25))
    pitch = width + side_thick
    start = -0.5 * count * pitch
    body = Solid()
    chair = Assembly("frame", density=700.0)
    x0, x1 = -0.5 * depth, 0.5 * depth
    on_post = draws.chance("on_posts", 0.5)
    for k in range(count + 1):
        a, b = about(start + k * pitch, 0.5 * side_thick)
        if on_post:
            body += box((-0.02, 0.06), (a, b), (0.0, arm_z)) + box((x0 + 0.05, x1 + 0.06), (a, b), (0.0, 0.025))
            body += box((-0.02, x1 + 0.03 + back_thick), (a, b), (seat_z - 0.05, seat_z + thick + 0.1))
        else:
            foot, arm = ((x0 + 0.05, 0.0), (x1 + 0.05, 0.0)), ((x1 + 0.05 + back_thick, arm_z), (x0 + 0.08, arm_z))
            body += hull([(x, t, z) for t in (a, b) for x, z in foot + arm])
        body += box((x0 + 0.02, x1 + 0.04), (a - 0.006, b + 0.006), (arm_z - 0.002, arm_z + 0.03), fillet=0.01)
    hinge_x = x1 - 0.04
    lift = seat_z + thick + 0.02
    for k in range(count):
        a, b = start + k * pitch + 0.5 * side_thick, start + (k + 1) * pitch - 0.5 * side_thick
        low, high = (x1 + 0.01, a - 0.002, lift), (x1 + 0.01 + back_thick, b + 0.002, lift + back_tall)
        body += _panel(draws.within("back"), low, high, 2).turned(SIDE, lean, (x1 + 0.01, 0, lift))
        low, high = (x0, a + GAP + 0.008, seat_z), (hinge_x + 0.01, b - GAP - 0.008, seat_z + thick)
        seat = _panel(draws.within("seat"), low, high, 0)
        at = (hinge_x, 0.5 * (a + b), seat_z + 0.5 * thick)
        seat += rod(at[0], (a + GAP, b - GAP), at[2], 0.012, sections=12)
        room = x1 + 0.01 - hinge_x
        limit = np.pi / 2 - max(0.0, (0.5 * thick + 0.006 - room)) / 0.1 - 0.05
        joint = revolute("frame", SIDE, at, 0.0, min(limit, 1.45) * draws.number("seat_turn", (0.9, 1.0)))
        chair.add(f"seat_{k}" if count > 1 else "seat", seat, joint, density=400.0)
    chair.body = body
    return chair


def _stool(draws: Draws) -> Assembly:
    """Two crossed frames; the seat hangs on one of them and rests on the other."""
    bar = _Bar(draws)
    half, height = 0.5 * draws.length("width", (0.32, 0.52)), draws.length("height", (0.35, 0.6))
    spread = 0.5 * draws.length("depth", (0.28, 0.48))
    apart = 2.0 * bar.thick + GAP
    a_foot, a_head = np.array([-spread, 0.0, 0.0]), np.array([spread, 0.0, height])
    b_foot, b_head = np.array([spread, 0.0, 0.0]), np.array([-spread, 0.0, height])
    pivot = 0.5 * (a_foot + a_head)
    rail = max(bar.deep, bar.thick)
    thick = draws.length("seat_thickness", (0.012, 0.035))
    outer = union(bar.between(a_foot + s * half * SIDE, a_head + s * half * SIDE) for s in (-1, 1))
    inner = bar.inner_pair(b_foot, b_head, pivot, half - apart, half)
    for share in (0.12, 0.98):
        p = a_foot + share * (a_head - a_foot)
        outer += bar.across(p[0], p[2], half)
        p = b_foot + share * (b_head - b_foot)
        inner += bar.across(p[0], p[2], half - apart)
    length = float(norm(a_head - pivot))
    # The second frame's foot swings up to the first one's head, so that nothing rises under the seat.
    limit = 2.0 * float(arctan2(0.5 * height, spread)) - 3.0 * rail / length - 0.1
    stool = Assembly("frame", outer, 900.0)
    stool.add("legs", inner, revolute("frame", -SIDE, pivot, 0.0, max(limit, 0.2)))
    if draws.chance("seat", 0.8):
        low = height + rail + GAP + 0.006
        x = spread + 0.02
        long = 2.0 * spread + draws.length("seat_overhang", (0.02, 0.1))
        seat = _panel(draws.within("seat"), (x - long, -half, low), (x, half, low + thick), 0)
        hinge = revolute("frame", SIDE, (x, 0.0, low + 0.5 * thick), 0.0, draws.angle("seat_angle", (1.2, 1.9)))
        stool.add("seat", seat, hinge, density=500.0)
    return stool
