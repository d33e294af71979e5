"""Folding chairs: chairs and stools whose legs swing together, whose seat or back folds up.

What varies: how it folds (crossed legs with or without a seat that follows them, legs that fold under the seat, a back
that folds down on the seat, a seat that tips up between its sides), tubes or bars, size, lean, seat and back (slats,
board, fabric, frame), arms, stretchers.
"""

import numpy as np

from artsim.common.elementary import arctan2, cos, hypot, sin
from artsim.common.products import norm, unit
from artsim.making.assembly import Assembly, Rng, pick, revolute
from artsim.making.outlines import SIDE, Vector
from artsim.making.solids import Solid, box, cylinder, frame, hull, rod, union
from artsim.model.kinematics import Array

GAP = 0.004


class _Bar:
    """What the frame is made of: tubes or bars."""

    def __init__(self, rng: Rng) -> None:
        self.round = rng.random() < 0.55
        self.thick = rng.uniform(0.009, 0.014) if self.round else rng.uniform(0.008, 0.014)  # half its width along Y
        # Half its depth across its length, in the XZ plane.
        self.deep = self.thick if self.round else rng.uniform(0.012, 0.022)

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
        return box((x - size, x + size), half, (z - size, z + size))


def build(rng: Rng) -> Assembly:
    """A folding chair, unfolded at rest; one sits down facing -X."""
    return pick(rng, {_crossed: 0.45, _under: 0.2, _tip_up: 0.2, _stool: 0.15})(rng)


def _panel(rng: Rng, low: Array, high: Array, axis: int) -> Solid:
    """A seat or a back within a box: board, slats along Y, a frame with a board, or a bulging cushion.

    ``axis`` is the direction that slats follow one another in.
    """
    kind = pick(rng, {"board": 0.35, "slats": 0.3, "frame": 0.15, "cushion": 0.2})
    thick = 2 if axis == 0 else 0
    if kind == "slats":
        count = int(np.clip((high[axis] - low[axis]) / rng.uniform(0.035, 0.09), 1, 9))
        edges = np.linspace(low[axis], high[axis], count + 1)
        solid = Solid()
        for k in range(count):
            a, b = low.copy(), high.copy()
            a[axis], b[axis] = edges[k] + (0.004 if k else 0.0), edges[k + 1] - (0.004 if k < count - 1 else 0.0)
            solid += box(a, b)
        # Battens below the slats hold them together.
        for y in (low[1] + 0.12 * (high[1] - low[1]), high[1] - 0.12 * (high[1] - low[1])):
            a, b = low.copy(), high.copy()
            a[1], b[1] = y - 0.012, y + 0.012
            b[thick] = 0.5 * (low[thick] + high[thick])
            solid += box(a, b)
        return solid
    if kind == "frame":
        sides = [0.025] * 4
        solid = frame(low, high, sides, 1, axis)
        a, b = low + 0.02, high - 0.02
        middle = 0.5 * (low[thick] + high[thick])
        a[thick], b[thick] = middle - 0.0025, middle + 0.0025
        return solid + box(a, b)
    if kind == "cushion":
        return box(low, high, fillet=0.45 * (high[thick] - low[thick]))
    return box(low, high, fillet=rng.uniform(0.01, 0.09), axis=thick, steps=4)


def _crossed(rng: Rng) -> Assembly:
    """Two pairs of legs that cross; the front legs go on up to the back rest."""
    bar = _Bar(rng)
    half = rng.uniform(0.19, 0.27)  # to the middle of the outer bars
    seat_z, spread = rng.uniform(0.4, 0.48), rng.uniform(0.19, 0.27)
    high = rng.uniform(0.74, 1.0)
    lean = rng.uniform(0.38, 0.62)  # of the front legs, from the vertical
    foot = np.array([-spread, 0.0, 0.0])
    direction = np.array([sin(lean), 0.0, cos(lean)])
    knee_share = seat_z / cos(lean)
    bend = rng.uniform(0.0, lean)  # above the seat the frame stands steeper
    joint_at = foot + knee_share * direction
    upright = np.array([sin(lean - bend), 0.0, cos(lean - bend)])
    above = (high - seat_z) / cos(lean - bend)
    head = joint_at + above * upright

    apart = 2.0 * bar.thick + GAP
    frame_solid = Solid()
    for s in (-1, 1):
        y = s * half * SIDE
        frame_solid += bar.between(foot + y, joint_at + y) + bar.between(joint_at + y - 0.004 * upright, head + y)
    low_bar = rng.uniform(0.08, 0.16)
    front = foot + low_bar * direction
    frame_solid += bar.across(front[0], front[2], half)
    depth = rng.uniform(0.32, 0.42)
    # The back rest is in the upper part of the frame, so that the seat has room below it.
    thick = rng.uniform(0.012, 0.03)
    back_low = max(0.35 * above, 0.12)
    tall = (above - back_low) * rng.uniform(0.5, 1.0)
    panel = _panel(rng, np.array([-0.5 * thick, -half, above - tall]), np.array([0.5 * thick, half, above]), 2)
    frame_solid += panel.turned(SIDE, lean - bend).moved(joint_at)
    chair = Assembly("frame", frame_solid, 900.0)

    # Rear legs: inside the front ones, from behind the frame's foot to below the seat's front.
    inner = half - apart
    rear_foot = np.array([spread * rng.uniform(0.75, 1.2), 0.0, 0.0])
    seat_thick = rng.uniform(0.015, 0.04)
    seat_low = seat_z + bar.deep + GAP
    rear_head = np.array([joint_at[0] - depth * rng.uniform(0.7, 0.95), 0.0, seat_z - bar.deep])
    along = rear_head - rear_foot
    share = np.linspace(0.0, 1.0, 400)
    line = rear_foot + share[:, None] * along
    gap = np.abs(np.cross(line - foot, direction)[:, 1])
    pivot = line[int(np.argmin(gap))]
    legs = Solid()
    for s in (-1, 1):
        y = s * inner * SIDE
        legs += bar.between(rear_foot + y, rear_head + y)
        pin0, pin1 = (inner + bar.thick - 0.002) * s * SIDE, (half - bar.thick - 0.0015) * s * SIDE
        legs += cylinder(pivot + pin0, pivot + pin1, 0.7 * bar.thick, sections=10)
    back_bar = rear_foot + 0.12 * along
    legs += bar.across(back_bar[0], back_bar[2], inner)
    # Folded, the rear legs lie along the front legs, but for what the stretchers need.
    angle = float(arctan2(direction[2], direction[0]) - arctan2(along[2], along[0]))
    closing = abs((angle + np.pi) % (2.0 * np.pi) - np.pi)
    thick_bar = max(bar.deep, bar.thick)
    reach = min(float(norm(front - pivot)), float(norm(back_bar - pivot)))
    limit = max(closing - 2.6 * thick_bar / reach - 0.06, 0.15)
    # A turn about +Y lifts the legs' upper end, which is at -X, towards the front legs' upper end.
    chair.add("legs", legs, revolute("frame", SIDE, pivot, 0.0, limit))

    seat_half = inner - bar.thick - GAP
    hinge_at = np.array([joint_at[0] - 0.012 - bar.deep, 0.0, seat_low + 0.5 * seat_thick])
    corners = np.array([(-depth, -seat_half, seat_low), (0.0, seat_half, seat_low + seat_thick)])
    seat = _panel(rng, corners[0] + (hinge_at[0], 0, 0), corners[1] + (hinge_at[0], 0, 0), 0)
    steep = np.pi / 2 + (lean - bend)
    swing = steep - 0.08 - float(arctan2(0.5 * seat_thick + thick + 0.02, back_low))
    how = pick(rng, {"follows": 0.4, "free": 0.45, "fixed": 0.15})
    if how == "fixed":
        swing = rng.uniform(0.1, 0.3)
    if how == "follows":
        mimic = revolute("frame", SIDE, hinge_at, 0.0, swing, mimic=("legs", swing / limit))
        chair.add("seat", seat, mimic, density=600.0)
    else:
        chair.add("seat", seat, revolute("frame", SIDE, hinge_at, 0.0, swing), density=600.0)
    return chair


def _under(rng: Rng) -> Assembly:
    """A seat whose back folds down on it and whose legs fold up under it."""
    bar = _Bar(rng)
    half, depth = rng.uniform(0.2, 0.3), rng.uniform(0.36, 0.5)
    seat_z, thick = rng.uniform(0.25, 0.48), rng.uniform(0.02, 0.04)
    x0, x1 = -0.5 * depth, 0.5 * depth
    rail = max(bar.deep, bar.thick)
    seat = _panel(
        rng, np.array([x0, -half + 0.5 * bar.thick, seat_z]), np.array([x1, half - 0.5 * bar.thick, seat_z + thick]), 0
    )
    for s in (-1, 1):
        seat += bar.between((x0, s * half, seat_z + 0.5 * thick), (x1, s * half, seat_z + 0.5 * thick))
    under = seat_z - rail - GAP
    knee = under - rail
    legs = []
    for name, x, ahead, way in (("front_legs", x0 + 0.05, -1.0, 1.0), ("rear_legs", x1 - 0.05, 1.0, -1.0)):
        y = half - (0.0 if ahead < 0 else 2.0 * bar.thick + GAP)
        slant = rng.uniform(0.0, 0.3)
        foot_x = x + ahead * slant * knee
        solid = union(bar.between((x, t * y, knee), (foot_x, t * y, 0.0)) for t in (-1, 1))
        z = knee * rng.uniform(0.15, 0.6)
        solid += bar.across(x + ahead * slant * (knee - z), z, y)
        length = float(hypot(knee, ahead * slant * knee))
        legs.append((name, solid, way, (x, 0.0, knee), length, ahead * slant))
        for t in (-1, 1):  # lugs
            seat += box((x - 0.02, x + 0.02), (t * y - bar.thick, t * y + bar.thick), (under + 0.001, seat_z + 0.002))
    chair = Assembly("seat", seat, 600.0)
    for name, solid, way, at, length, slope in legs:
        # They stop a little below the seat; those in front fold back, those behind fold forward, to the inside.
        stop = np.pi / 2 + way * float(arctan2(slope, 1.0)) * -1.0 - 0.12 - 2.0 * rail / length
        other = 0.45 * stop
        limit = other if rng.random() < 0.7 else other * rng.uniform(0.5, 1.0)
        chair.add(name, solid, revolute("seat", -way * SIDE, at, 0.0, limit), density=900.0)
    if rng.random() < 0.85:
        tall = rng.uniform(0.25, 0.65)
        hinge = np.array([x1 + rail + GAP + 0.012, 0.0, seat_z + thick + 0.012])
        back_thick = rng.uniform(0.012, 0.03)
        wide = half - 0.01
        low, high = hinge + (-0.5 * back_thick, -wide, 0.05), hinge + (0.5 * back_thick, wide, tall)
        back = _panel(rng, low, high, 2)
        for t in (-1, 1):
            back += bar.between(
                hinge + (0, t * (wide - bar.thick), 0), hinge + (0, t * (wide - bar.thick), tall - 0.02)
            )
        lean = rng.uniform(0.08, 0.6)
        fold = np.pi / 2 + lean - 0.06 - float(arctan2(rail + 0.5 * back_thick + 0.012, 0.08))
        back = back.turned(SIDE, lean, hinge)
        chair.add("back", back, revolute("seat", -SIDE, hinge, 0.0, max(fold, 0.3)), density=700.0)
    return chair


def _tip_up(rng: Rng) -> Assembly:
    """Seats that tip up between fixed sides, as in a hall; one or more in a row."""
    count = pick(rng, {1: 0.55, 2: 0.3, 3: 0.15})
    width, depth = rng.uniform(0.42, 0.56), rng.uniform(0.36, 0.48)
    side_thick = rng.uniform(0.02, 0.06)
    seat_z, thick = rng.uniform(0.38, 0.46), rng.uniform(0.03, 0.1)
    lean = rng.uniform(0.05, 0.3)
    back_tall, back_thick = rng.uniform(0.35, 0.6), rng.uniform(0.03, 0.09)
    arm_z = seat_z + rng.uniform(0.15, 0.25)
    pitch = width + side_thick
    start = -0.5 * count * pitch
    body = Solid()
    chair = Assembly("frame", density=700.0)
    x0, x1 = -0.5 * depth, 0.5 * depth
    on_post = rng.random() < 0.5
    for k in range(count + 1):
        y = start + k * pitch
        a, b = y - 0.5 * side_thick, y + 0.5 * side_thick
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
        low = np.array([x1 + 0.01, a - 0.002, lift])
        back = _panel(rng, low, np.array([x1 + 0.01 + back_thick, b + 0.002, lift + back_tall]), 2)
        body += back.turned(SIDE, lean, (x1 + 0.01, 0, lift))
        seat = _panel(
            rng, np.array([x0, a + GAP + 0.008, seat_z]), np.array([hinge_x + 0.01, b - GAP - 0.008, seat_z + thick]), 0
        )
        at = (hinge_x, 0.5 * (a + b), seat_z + 0.5 * thick)
        seat += rod(at[0], (a + GAP, b - GAP), at[2], 0.012, sections=12)
        room = x1 + 0.01 - hinge_x
        limit = np.pi / 2 - max(0.0, (0.5 * thick + 0.006 - room)) / 0.1 - 0.05
        joint = revolute("frame", SIDE, at, 0.0, min(limit, 1.45) * rng.uniform(0.9, 1.0))
        chair.add(f"seat_{k}" if count > 1 else "seat", seat, joint, density=400.0)
    chair.body = body
    return chair


def _stool(rng: Rng) -> Assembly:
    """Two crossed frames; the seat hangs on one of them and rests on the other."""
    bar = _Bar(rng)
    half, height = rng.uniform(0.16, 0.26), rng.uniform(0.35, 0.6)
    spread = rng.uniform(0.14, 0.24)
    apart = 2.0 * bar.thick + GAP
    a_foot, a_head = np.array([-spread, 0.0, 0.0]), np.array([spread, 0.0, height])
    b_foot, b_head = np.array([spread, 0.0, 0.0]), np.array([-spread, 0.0, height])
    pivot = 0.5 * (a_foot + a_head)
    rail = max(bar.deep, bar.thick)
    thick = rng.uniform(0.012, 0.035)
    outer, inner = Solid(), Solid()
    for s in (-1, 1):
        outer += bar.between(a_foot + s * half * SIDE, a_head + s * half * SIDE)
        inner += bar.between(b_foot + s * (half - apart) * SIDE, b_head + s * (half - apart) * SIDE)
        p0, p1 = s * (half - apart + bar.thick - 0.002) * SIDE, s * (half - bar.thick - 0.0015) * SIDE
        inner += cylinder(pivot + p0, pivot + p1, 0.7 * bar.thick, sections=10)
    for solid_share in (0.12, 0.98):
        p = a_foot + solid_share * (a_head - a_foot)
        outer += bar.across(p[0], p[2], half)
        p = b_foot + solid_share * (b_head - b_foot)
        inner += bar.across(p[0], p[2], half - apart)
    length = float(norm(a_head - pivot))
    # The second frame's foot swings up to the first one's head, so that nothing rises under the seat.
    limit = 2.0 * float(arctan2(0.5 * height, spread)) - 3.0 * rail / length - 0.1
    stool = Assembly("frame", outer, 900.0)
    stool.add("legs", inner, revolute("frame", -SIDE, pivot, 0.0, max(limit, 0.2)))
    if rng.random() < 0.8:
        low = height + rail + GAP + 0.006
        hinge = np.array([spread + 0.02, 0.0, low + 0.5 * thick])
        long = 2.0 * spread + rng.uniform(0.02, 0.1)
        seat = _panel(rng, np.array([hinge[0] - long, -half, low]), np.array([hinge[0], half, low + thick]), 0)
        up = rng.uniform(1.2, 1.9)
        stool.add("seat", seat, revolute("frame", SIDE, hinge, 0.0, up), density=500.0)
    return stool
