"""Faucets: basin mixers, kitchen taps, three-piece sets, pillar taps and wall-mounted bath taps.

What varies: the layout, how far, high and wide it reaches (a few are tall, far or wide), whether the spout turns, the
spout (gooseneck, bow, straight tube, flat bar), one or two handles (levers, paddles, crosses, round knobs), how they
turn and lean, the body and its feet.
"""

import numpy as np

from artsim.common.elementary import arcsin, cos, sin
from artsim.common.products import unit
from artsim.families.proportions import with_tails
from artsim.making.assembly import Assembly, Rng, pick, revolute, screw, swivel
from artsim.making.outlines import FRONT, UP
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull_of, rod, tube, union
from artsim.model.kinematics import Array

GAP = 0.001
BRASS = 3000.0  # kg/m^3, as the pieces are solid and real ones are hollow


def build(rng: Rng) -> Assembly:
    """A faucet; the water comes out towards -X. All handles are shut at rest."""
    layouts = {_basin_mixer: 0.34, _kitchen_mixer: 0.26, _three_piece: 0.2, _pillar_tap: 0.1, _wall_tap: 0.1}
    return pick(rng, layouts)(rng)


def _basin_mixer(rng: Rng) -> Assembly:
    """A body with a fixed spout, and one handle on its top."""
    radius, height = with_tails(rng, (0.017, 0.028), (0.01, 0.028), 0.2), with_tails(rng, (0.06, 0.2), (0.04, 0.5), 0.3)
    reach = with_tails(rng, (0.08, 0.17), (0.05, 0.8), 0.3)
    body, top = _body(rng, radius, height)
    r = radius * rng.uniform(0.5, 0.8)
    kind = rng.choice(["straight", "bar", "drooping", "bow"])
    root = np.array([0.0, 0.0, height * rng.uniform(0.35, 0.75)])
    if kind == "straight":
        tip = root + (-reach, 0, min(rng.uniform(-0.3, 0.35) * reach, top - root[2] - 2 * r))
        body += tube([root, tip], [r, 0.85 * r], 16) + _nozzle(rng, tip + (0.75 * r, 0, 0), -UP, 0.7 * r, 1.2 * r)
    elif kind == "bar":
        half, thick = r * rng.uniform(0.8, 1.5), r * rng.uniform(0.35, 0.6)
        tip = root + (-reach, 0, min(rng.uniform(-0.1, 0.25) * reach, top - root[2] - 2 * r))
        ends = [box(p - (0.006, half, thick), p + (0.006, half, thick), fillet=0.4 * thick) for p in (root, tip)]
        body += hull_of(*ends) + _nozzle(rng, tip + (0.008, 0, 0), -UP, 0.6 * thick, 1.4 * thick)
    else:
        rise = (top - root[2] - 1.3 * r) if kind == "bow" else 0.1 * reach
        drop = min(0.35 * reach, root[2] + rise - 0.04)
        s = np.linspace(0.0, 1.0, 9)
        z = root[2] + rise * sin(np.pi * np.minimum(0.75 * s, 1.0)) - drop * s * s * s
        path = np.stack([-reach * s, 0 * s, z], axis=1)
        body += tube(path, (np.linspace(1.0, 0.75, 9) * r).tolist(), 14)
        body += _nozzle(rng, path[-1] + 0.2 * (path[-2] - path[-1]), path[-1] - path[-2], 0.85 * r, 0.9 * r)
    # A leaning axis stands on a stub, so that the hub's rim clears the body's top.
    lean = rng.choice([-1.0, 1.0]) * rng.uniform(0.1, 0.5) if rng.random() < 0.35 else 0.0
    axis, start = (cos(lean) * UP + sin(lean) * FRONT, cos(lean) * FRONT - sin(lean) * UP)
    pivot = np.array([0.0, 0.0, top]) + 2.0 * radius * sin(abs(lean)) * axis
    if lean:
        body += cylinder(pivot - 2.5 * radius * sin(abs(lean)) * axis, pivot, 0.9 * radius)
    tap = Assembly("base", body, BRASS)
    handle = _handle(rng, pivot, axis, start, radius * rng.uniform(0.9, 1.0), rng.uniform(0.05, 0.12), True)
    low, high = (-0.5 * np.pi, 0.5 * np.pi) if rng.random() < 0.7 and lean <= 0 else (0.0, rng.uniform(0.8, 1.9))
    tap.add("handle", handle, revolute("base", axis, pivot, low, high))
    return tap


def _kitchen_mixer(rng: Rng) -> Assembly:
    """A column with a high spout, which mostly turns, and a handle at its side."""
    radius, height = rng.uniform(0.018, 0.026), rng.uniform(0.07, 0.14)
    body, top = _body(rng, radius, height)
    side = float(rng.choice([-1.0, 1.0]))
    out = np.array([0.0, side, 0.0])
    level = height * rng.uniform(0.45, 0.7)
    stem = radius * rng.uniform(1.15, 1.6)
    hub = radius * rng.uniform(0.6, 0.85)
    hub = min(hub, level - 0.012, top - level - 0.002)
    body += rod(0, (0, side * stem), level, hub, sections=20)
    length = with_tails(rng, (0.05, 0.09), (0.05, 0.15), 0.2)
    # A turning spout passes over the lever, wherever that points.
    lowest = level + 1.2 * length + 0.02
    r = radius * rng.uniform(0.4, 0.7)
    reach = with_tails(rng, (0.13, 0.24), (0.1, 0.5), 0.2)
    tip = max(lowest, top + 0.03) + with_tails(rng, (0.0, 0.1), (0.0, 0.4), 0.2)
    spout = _gooseneck(rng, np.array([0.0, 0.0, top]), r, reach, tip)
    tap = Assembly("base", body, BRASS)
    pivot = np.array([0.0, side * stem, level])
    _add_spout(rng, tap, spout, top, 0.75, 0.5)
    start = UP if rng.random() < 0.6 else FRONT
    handle = _handle(rng, pivot, out, start, hub * rng.uniform(0.9, 1.0), length, False)
    travel = rng.uniform(0.8, 1.57)
    axis = -out * side if start is UP else out * side  # towards the user, or up
    tap.add("handle", handle, revolute("base", axis, pivot, 0.0, travel))
    return tap


def _three_piece(rng: Rng) -> Assembly:
    """A spout between two handles on one plate."""
    spread = with_tails(rng, (0.08, 0.13), (0.07, 0.38), 0.25)
    foot_radius, foot_height = rng.uniform(0.018, 0.026), rng.uniform(0.02, 0.07)
    plate = rng.uniform(0.005, 0.012)
    half = foot_radius + rng.uniform(0.003, 0.012)
    base = box(half, spread + half, (0, plate), fillet=half, axis=2, steps=5)
    taper = rng.uniform(0.45, 0.9)
    for y in (-spread, spread):
        base += rod(0, y, (0.5 * plate, foot_height), foot_radius, taper * foot_radius)
        base += rod(0, y, (0.5 * plate, plate + 0.004), 1.1 * foot_radius)
    r = foot_radius * rng.uniform(0.4, 0.6)
    column = foot_height * rng.uniform(0.6, 1.3) + 0.01
    base += rod(0, 0, (0.5 * plate, column), foot_radius, max(taper * foot_radius, 1.2 * r))
    reach = with_tails(rng, (0.1, 0.18), (0.06, 0.35), 0.25)
    length = min(rng.uniform(0.05, 0.08), spread - foot_radius - 0.012)
    tip = foot_height + 0.06 + with_tails(rng, (0.0, 0.06), (0.0, 0.3), 0.2)
    spout = _gooseneck(rng, np.array([0.0, 0.0, column]), r, reach, tip)
    tap = Assembly("base", base, BRASS)
    _add_spout(rng, tap, spout, column, 0.6, 0.6)
    style = int(rng.integers(1 << 30))
    outward = rng.random() < 0.6
    for number, side in enumerate((-1.0, 1.0)):
        pivot = np.array([0.0, side * spread, foot_height])
        start = np.array([0.0, side, 0.0]) if outward else FRONT
        alike = np.random.default_rng(style)
        handle = _handle(alike, pivot, UP, start, taper * foot_radius, length, False)
        turn = -side if outward else side
        tap.add(f"handle_{number}", handle, revolute("base", turn * UP, pivot, 0.0, 1.57))
    return tap


def _pillar_tap(rng: Rng) -> Assembly:
    """A single tap with a knob on its top that rises as it is turned open."""
    radius, height = rng.uniform(0.014, 0.022), rng.uniform(0.06, 0.11)
    body, top = _body(rng, radius, height)
    reach, r = rng.uniform(0.06, 0.11), 0.7 * radius
    s = np.linspace(0.0, 0.5 * np.pi, 7)
    bow = min(0.4 * reach, 0.5 * height)
    path = np.stack([-(reach - bow) - bow * sin(s), 0 * s, 0.65 * height - bow * (1 - cos(s))], axis=1)
    path = np.concatenate([[[0, 0, 0.55 * height]], path])
    body += tube(path, (np.linspace(1.0, 0.8, 8) * r).tolist(), 14) + _nozzle(
        rng, path[-1] + (0, 0, 0.004), -UP, 0.95 * r, r
    )
    body += rod(0, 0, (top - 0.002, top + 0.02), 0.45 * radius, sections=16)
    tap = Assembly("base", body, BRASS)
    pivot = np.array([0.0, 0.0, top + 0.02])
    knob = _knob(rng, pivot, UP, radius * rng.uniform(1.2, 1.7))
    turns = rng.uniform(0.5, 2.5) * 2.0 * np.pi
    tap.add("handle", knob, screw("base", UP, pivot, 0.0, turns, 0.0005))
    return tap


def _wall_tap(rng: Rng) -> Assembly:
    """A bar on two wall flanges, a knob at each end, and a spout that swings below."""
    half, radius = with_tails(rng, (0.08, 0.13), (0.05, 0.5), 0.4), with_tails(rng, (0.016, 0.024), (0.011, 0.024), 0.3)
    body = tube([(0, -half, 0), (0, half, 0)], radius, 20)
    wall = radius + rng.uniform(0.02, 0.05)
    for y in (-0.6 * half, 0.6 * half):
        body += tube([(0, y, 0), (wall, y, 0)], 0.8 * radius, 16)
        body += rod((wall - 0.006, wall + 0.004), y, 0, 1.5 * radius, sections=24)
    drop = radius + rng.uniform(0.008, 0.02)
    body += rod(0, 0, (0, -drop), 0.85 * radius, sections=20)
    reach, r = with_tails(rng, (0.12, 0.2), (0.05, 0.75), 0.4), 0.6 * radius
    s = np.linspace(0.0, 0.5 * np.pi, 6)
    bend = 2.2 * r
    low = -drop - GAP
    path = np.stack([bend * (cos(s) - 1), 0 * s, low - 0.7 * r - bend * sin(s)], axis=1)
    path = np.concatenate([[[0, 0, low]], path, path[-1:] + [[-reach, 0, rng.uniform(-0.1, 0.25) * reach]]])
    spout = tube(path, r, 14) + _nozzle(rng, path[-1] + (r, 0, 0), -UP, 0.8 * r, 1.4 * r)
    tap = Assembly("base", body, BRASS)
    limit = min(arcsin(min((half - 0.03) / (reach + bend + 2 * r), 1.0)), 1.2)
    tap.add("spout", spout, revolute("base", UP, (0, 0, low), -limit, limit))
    style = int(rng.integers(1 << 30))
    size, turn = radius * rng.uniform(1.3, 2.2), min(with_tails(rng, (1.57, 3.0), (0.8, 3.4), 0.4), np.pi)
    for number, side in enumerate((-1.0, 1.0)):
        pivot, out = np.array([0.0, side * half, 0.0]), np.array([0.0, side, 0.0])
        knob = _knob(np.random.default_rng(style), pivot, out, size)
        tap.add(f"handle_{number}", knob, revolute("base", out, pivot, 0.0, turn))
    return tap


def _body(rng: Rng, radius: float, height: float) -> tuple[Solid, float]:
    """Upright body on a foot; and the height of its top."""
    foot = radius * rng.uniform(1.1, 1.5)
    thick = rng.uniform(0.004, 0.012)
    kind = pick(rng, {"round": 0.4, "tapered": 0.25, "square": 0.15, "turned": 0.2})
    if kind == "square":
        s = 0.95 * radius
        solid = box(s, s, (0, height), fillet=0.25 * s, axis=2)
        return solid + box(foot, foot, (0, thick), fillet=0.3 * s, axis=2), height
    low = radius * (rng.uniform(1.05, 1.35) if kind == "tapered" else 1.0)
    solid = rod(0, 0, (0, height), low, radius) + rod(0, 0, (0, thick), 1.1 * foot, foot)
    if kind == "turned":
        for level in rng.uniform(0.12, 0.9, 3) * height:
            h = 0.1 * radius
            solid += rod(0, 0, (level - h, level + h), radius * rng.uniform(1.05, 1.2))
    return solid, height


def _add_spout(rng: Rng, tap: Assembly, spout: Solid, z: float, turns: float, freely: float) -> None:
    """A spout that by chance turns on its foot at a height, and then by chance without end."""
    if rng.random() < turns:
        limit = None if rng.random() < freely else rng.uniform(0.9, 2.6)
        tap.add("spout", spout, swivel("base", UP, (0, 0, z), limit))
    else:
        tap.body += spout.moved((0, 0, -GAP - 0.001))


def _gooseneck(rng: Rng, foot: Array, r: float, reach: float, tip: float) -> Solid:
    """High spout that stands on ``foot``, bends over and ends at height ``tip``."""
    z0 = foot[2] + GAP
    bow = 0.5 * reach
    kind = pick(rng, {"bow": 0.6, "swan": 0.25, "square": 0.15})
    if kind == "square":
        crest = tip + rng.uniform(0.02, 0.05)
        points = [(0, z0), (0, crest - 0.02), (0.006, crest - 0.006), (0.02, crest)]
        points += [(reach - 0.02, crest), (reach - 0.006, crest - 0.006), (reach, crest - 0.02), (reach, tip)]
    else:
        spring = max(tip + rng.uniform(0.0, 0.04), z0 + 0.01)
        end = np.pi if kind == "bow" else rng.uniform(0.75, 0.92) * np.pi
        flat = 1.0 if kind == "bow" else rng.uniform(0.6, 0.9)
        angles = np.linspace(0.0, end, 13)
        points = [(0.0, z0)] + [(bow - bow * cos(a), spring + flat * bow * sin(a)) for a in angles]
        if kind == "bow" and spring - tip > 0.004:
            points.append((reach, tip))
    path = np.array([(-x, 0.0, z) for x, z in points])
    ending = path[-1] - path[-2]
    solid = tube(path, r, 14) + rod(0, 0, (z0, z0 + 1.2 * r), 1.35 * r, 1.15 * r, 20)
    return solid + _nozzle(rng, path[-1] - 0.3 * ending, ending, 1.15 * r, 1.2 * r)


def _nozzle(rng: Rng, start: Array, direction: Array, radius: float, length: float) -> Solid:
    """The aerator at the mouth."""
    wide = radius * rng.uniform(1.0, 1.15)
    return cylinder(start, start + length * unit(direction), wide, sections=18)


def _handle(rng: Rng, pivot: Array, axis: Array, start: Array, radius: float, length: float, crowned: bool) -> Solid:
    """A handle on a hub: a lever along ``start``, a paddle, or a knob.

    ``length`` is that from the axis to the lever's end. A hub that crowns a body is never a cross.
    """
    foot = pivot + GAP * axis
    kind = pick(rng, {"rod": 0.4, "paddle": 0.35, "ball": 0.12, "knob": 0.13})
    if kind == "knob" and not crowned:
        return _knob(rng, pivot, axis, min(1.5 * radius, 0.4 * length))
    tall = radius * rng.uniform(0.9, 1.7)
    hub = cylinder(foot, foot + tall * axis, radius, radius * rng.uniform(0.85, 1.0))
    if rng.random() < 0.5:
        hub = cylinder(foot, foot + 0.75 * tall * axis, radius) + _dome(foot + 0.75 * tall * axis, axis, radius)
    across = np.cross(axis, start)
    lean = rng.uniform(0.0, 0.45)
    direction = cos(lean) * start + sin(lean) * axis
    root = foot + 0.65 * tall * axis
    tip = root + length * direction
    r = max(radius * rng.uniform(0.18, 0.3), 0.003)
    if kind == "paddle":
        wide, thick = radius * rng.uniform(0.45, 0.9), max(radius * rng.uniform(0.12, 0.22), 0.002)
        bulge = 0.1 * length * np.array(axis)
        middle = 0.5 * (root + tip) + rng.uniform(0.0, 1.0) * bulge
        slabs = [
            hull_of(*(ellipsoid(p + s * (w - thick) * across, thick, 8) for s in (-1, 1)))
            for p, w in ((root, wide), (middle, wide), (tip, wide * rng.uniform(0.5, 1.0)))
        ]
        return hub + hull_of(slabs[0], slabs[1]) + hull_of(slabs[1], slabs[2])
    lever = tube([root, tip], [r, r * rng.uniform(0.8, 1.2)], 12)
    if kind == "ball":
        return hub + tube([root, tip], 0.7 * r, 12) + ellipsoid(tip, 1.6 * r, 14)
    return hub + lever + ellipsoid(tip, r, 12)


def _dome(center: Array, axis: Array, radius: float) -> Solid:
    """A low round cap."""
    levels = [(0.0, 1.0), (0.2, 0.9), (0.36, 0.6), (0.4, 0.3)]
    return hull_of(*(cylinder(center - 0.01 * radius * axis, center + (h * radius + 1e-5) * axis, s * radius)
                     for h, s in levels))  # fmt: skip


def _knob(rng: Rng, pivot: Array, axis: Array, radius: float) -> Solid:
    """A cross or a round knob to turn with the whole hand."""
    foot = pivot + GAP * axis
    u = np.eye(3)[np.argmin(np.abs(axis))]
    v = np.cross(axis, u)
    tall = radius * rng.uniform(0.6, 0.9)
    if rng.random() < 0.55:
        arms = int(rng.integers(3, 6))
        r = radius * rng.uniform(0.14, 0.2)
        center = foot + 0.55 * tall * axis
        solid = cylinder(foot, foot + tall * axis, 0.45 * radius, 0.35 * radius, 18)
        for angle in np.arange(arms) * 2.0 * np.pi / arms:
            tip = center + radius * (cos(angle) * u + sin(angle) * v)
            solid += tube([center, tip], r, 10) + ellipsoid(tip, 1.35 * r, 10)
        return solid
    ribs = int(rng.integers(6, 12))
    solid = cylinder(foot, foot + tall * axis, radius, 0.85 * radius) + _dome(foot + tall * axis, axis, 0.7 * radius)
    return solid + union(
        cylinder(foot + 0.1 * tall * axis + s, foot + 0.85 * tall * axis + 0.9 * s, 0.14 * radius, sections=8)
        for s in (0.93 * radius * (cos(a) * u + sin(a) * v) for a in np.arange(ribs) * 2.0 * np.pi / ribs)
    )
