"""Faucets: basin mixers, kitchen taps, three-piece sets, pillar taps and wall-mounted bath taps.

What varies: the layout, how far, high and wide it reaches (a few are tall, far or wide), whether the spout turns, the
spout (gooseneck, bow, straight tube, flat bar), one or two handles (levers, paddles, crosses, round knobs), how they
turn and lean, the body and its feet.
"""

import numpy as np

from artsim.common.elementary import arcsin, cos, sin
from artsim.common.products import unit
from artsim.making.assembly import Assembly, revolute, screw, swivel
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, UP, Array, circle, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull, hull_of, rod, tube, union

GAP = 0.001
BRASS = 3000.0  # kg/m^3, as the pieces are solid and real ones are hollow


def build(draws: Draws) -> Assembly:
    """A faucet; the water comes out towards -X. All handles are shut at rest."""
    makers = {"basin": _basin_mixer, "kitchen": _kitchen_mixer, "set": _three_piece, "pillar": _pillar_tap,
              "wall": _wall_tap}  # fmt: skip
    return draws.one_of("kind", makers, (0.34, 0.26, 0.2, 0.1, 0.1))(draws)


def _basin_mixer(draws: Draws) -> Assembly:
    """A body with a fixed spout, and one handle on its top."""
    radius = draws.length("body_radius", (0.017, 0.028), (0.01, 0.028), tails=0.2)
    height = draws.length("height", (0.06, 0.2), (0.04, 0.5), tails=0.3)
    reach = draws.length("depth", (0.08, 0.17), (0.05, 0.8), tails=0.3)
    body = _body(draws, radius, height)
    r = draws.length("spout_radius", (0.5, 0.8), of=radius)
    kind = draws.pick("spout", ["straight", "bar", "drooping", "bow"])
    root = np.array([0.0, 0.0, draws.length("spout_root", (0.35, 0.75), of=height)])
    if kind == "straight":
        rise = min(draws.length("spout_rise", (-0.3, 0.35), of=reach), height - root[2] - 2 * r)
        tip = root + (-reach, 0, rise)
        body += tube([root, tip], [r, 0.85 * r], 16) + _nozzle(draws, tip + (0.75 * r, 0, 0), -UP, 0.7 * r, 1.2 * r)
    elif kind == "bar":
        half = 0.5 * draws.length("spout_width", (0.8, 1.5), of=2 * r)
        thick = 0.5 * draws.length("spout_thickness", (0.35, 0.6), of=2 * r)
        rise = min(draws.length("spout_rise", (-0.1, 0.25), of=reach), height - root[2] - 2 * r)
        tip = root + (-reach, 0, rise)
        ends = [box(p - (0.006, half, thick), p + (0.006, half, thick), fillet=0.4 * thick) for p in (root, tip)]
        body += hull_of(*ends) + _nozzle(draws, tip + (0.008, 0, 0), -UP, 0.6 * thick, 1.4 * thick)
    else:
        rise = (height - root[2] - 1.3 * r) if kind == "bow" else 0.1 * reach
        drop = min(0.35 * reach, root[2] + rise - 0.04)
        s = np.linspace(0.0, 1.0, 9)
        z = root[2] + rise * sin(np.pi * np.minimum(0.75 * s, 1.0)) - drop * s * s * s
        path = np.stack([-reach * s, 0 * s, z], axis=1)
        body += tube(path, (np.linspace(1.0, 0.75, 9) * r).tolist(), 14)
        body += _nozzle(draws, path[-1] + 0.2 * (path[-2] - path[-1]), path[-1] - path[-2], 0.85 * r, 0.9 * r)
    lean = 0.0  # towards the front
    if draws.chance("handle_leans", 0.35):
        lean = draws.one_of("handle_leans_to", {"back": -1.0, "front": 1.0}) * draws.angle("handle_tilt", (0.1, 0.5))
    axis, start = (cos(lean) * UP + sin(lean) * FRONT, cos(lean) * FRONT - sin(lean) * UP)
    pivot = np.array([0.0, 0.0, height]) + 2.0 * radius * sin(abs(lean)) * axis
    if lean:  # the axis stands on a stub, so that the hub's rim clears the body's top
        body += cylinder(pivot - 2.5 * radius * sin(abs(lean)) * axis, pivot, 0.9 * radius)
    tap = Assembly("base", body, BRASS)
    hub = draws.length("handle_radius", (0.9, 1.0), of=radius)
    handle = _handle(draws, hub, draws.length("handle_length", (0.05, 0.12)), True)
    mixes = draws.chance("handle_turns_both_ways", 0.7) and lean <= 0
    low, high = (-0.5 * np.pi, 0.5 * np.pi) if mixes else (0.0, draws.angle("handle_travel", (0.8, 1.9)))
    tap.add("handle", _placed(handle, pivot, axis, start), revolute("base", axis, pivot, low, high))
    return tap


def _kitchen_mixer(draws: Draws) -> Assembly:
    """A column with a high spout, which mostly turns, and a handle at its side."""
    radius, height = draws.lengths(body_radius=(0.018, 0.026), body_height=(0.07, 0.14))
    body = _body(draws, radius, height)
    side = draws.side("handle_side")
    out = np.array([0.0, side, 0.0])
    level = draws.length("handle_level", (0.45, 0.7), of=height)
    stem = draws.length("handle_stem", (1.15, 1.6), of=radius)
    hub = min(draws.length("hub_radius", (0.6, 0.85), of=radius), level - 0.012, height - level - 0.002)
    body += rod(0, (0, side * stem), level, hub, sections=20)
    length = draws.length("handle_length", (0.05, 0.09), (0.05, 0.15), tails=0.2)
    # A turning spout passes over the lever, wherever that points.
    lowest = level + 1.2 * length + 0.02
    r = draws.length("spout_radius", (0.4, 0.7), of=radius)
    reach = draws.length("depth", (0.13, 0.24), (0.1, 0.5), tails=0.2)
    tip = max(lowest, height + 0.03) + draws.length("spout_lift", (0.0, 0.1), (0.0, 0.4), tails=0.2)
    spout = _gooseneck(draws, height, r, reach, tip)
    tap = Assembly("base", body, BRASS)
    pivot = np.array([0.0, side * stem, level])
    _add_spout(draws, tap, spout, height, 0.75, 0.5)
    upright = draws.chance("handle_upright", 0.6)
    handle = _handle(draws, draws.length("handle_radius", (0.9, 1.0), of=hub), length, False)
    travel = draws.angle("handle_travel", (0.8, 1.57))
    axis = -out * side if upright else out * side  # towards the user, or up
    tap.add("handle", _placed(handle, pivot, out, UP if upright else FRONT), revolute("base", axis, pivot, 0.0, travel))
    return tap


def _three_piece(draws: Draws) -> Assembly:
    """A spout between two handles on one plate."""
    spread = 0.5 * draws.length("width", (0.16, 0.26), (0.14, 0.76), tails=0.25)
    radius, height = draws.lengths(foot_radius=(0.018, 0.026), foot_height=(0.02, 0.07))
    plate = draws.length("plate_thickness", (0.005, 0.012))
    half = radius + draws.length("plate_margin", (0.003, 0.012))
    base = box(half, spread + half, (0, plate), fillet=half, axis=2, steps=5)
    hub = draws.length("foot_top_radius", (0.45, 0.9), of=radius)
    for y in (-spread, spread):
        base += rod(0, y, (0.5 * plate, height), radius, hub) + rod(0, y, (0.5 * plate, plate + 0.004), 1.1 * radius)
    r = draws.length("spout_radius", (0.4, 0.6), of=radius)
    column = draws.length("column_height", (0.6, 1.3), of=height) + 0.01
    base += rod(0, 0, (0.5 * plate, column), radius, max(hub, 1.2 * r))
    reach = draws.length("depth", (0.1, 0.18), (0.06, 0.35), tails=0.25)
    length = min(draws.length("handle_length", (0.05, 0.08)), spread - radius - 0.012)
    tip = height + 0.06 + draws.length("spout_lift", (0.0, 0.06), (0.0, 0.3), tails=0.2)
    spout = _gooseneck(draws, column, r, reach, tip)
    tap = Assembly("base", base, BRASS)
    _add_spout(draws, tap, spout, column, 0.6, 0.6)
    alike, outward = draws.fork("", draws.seed("handle_seed") // 2), draws.chance("handle_outward", 0.6)
    handle = _handle(alike, hub, length, False)
    for number, side in enumerate((-1.0, 1.0)):
        pivot = np.array([0.0, side * spread, height])
        turn = -side if outward else side
        solid = _placed(handle, pivot, UP, side * SIDE if outward else FRONT)
        tap.add(f"handle_{number}", solid, revolute("base", turn * UP, pivot, 0.0, 1.57))
    return tap


def _pillar_tap(draws: Draws) -> Assembly:
    """A single tap with a knob on its top that rises as it is turned open."""
    radius, height = draws.lengths(body_radius=(0.014, 0.022), height=(0.06, 0.11))
    body = _body(draws, radius, height)
    reach, r = draws.length("depth", (0.06, 0.11)), 0.7 * radius
    s = np.linspace(0.0, 0.5 * np.pi, 7)
    bow = min(0.4 * reach, 0.5 * height)
    path = np.stack([-(reach - bow) - bow * sin(s), 0 * s, 0.65 * height - bow * (1 - cos(s))], axis=1)
    path = np.concatenate([[[0, 0, 0.55 * height]], path])
    body += tube(path, (np.linspace(1.0, 0.8, 8) * r).tolist(), 14)
    body += _nozzle(draws, path[-1] + (0, 0, 0.004), -UP, 0.95 * r, r)
    body += rod(0, 0, (height - 0.002, height + 0.02), 0.45 * radius, sections=16)
    tap = Assembly("base", body, BRASS)
    pivot = np.array([0.0, 0.0, height + 0.02])
    knob = _knob(draws, draws.length("knob_radius", (1.2, 1.7), of=radius))
    travel = draws.number("handle_turns", (0.5, 2.5)) * 2.0 * np.pi
    tap.add("handle", _placed(knob, pivot, UP, FRONT), screw("base", UP, pivot, 0.0, travel, 0.0005))
    return tap


def _wall_tap(draws: Draws) -> Assembly:
    """A bar on two wall flanges, a knob at each end, and a spout that swings below."""
    half = 0.5 * draws.length("width", (0.16, 0.26), (0.1, 1.0), tails=0.4)
    radius = draws.length("pipe_radius", (0.016, 0.024), (0.011, 0.024), tails=0.3)
    body = tube([(0, -half, 0), (0, half, 0)], radius, 20)
    wall = radius + draws.length("wall_distance", (0.02, 0.05))
    for y in (-0.6 * half, 0.6 * half):
        body += tube([(0, y, 0), (wall, y, 0)], 0.8 * radius, 16)
        body += rod((wall - 0.006, wall + 0.004), y, 0, 1.5 * radius, sections=24)
    drop = radius + draws.length("spout_drop", (0.008, 0.02))
    body += rod(0, 0, (0, -drop), 0.85 * radius, sections=20)
    reach, r = draws.length("depth", (0.12, 0.2), (0.05, 0.75), tails=0.4), 0.6 * radius
    s = np.linspace(0.0, 0.5 * np.pi, 6)
    bend = 2.2 * r
    low = -drop - GAP
    path = np.stack([bend * (cos(s) - 1), 0 * s, low - 0.7 * r - bend * sin(s)], axis=1)
    rise = draws.length("spout_rise", (-0.1, 0.25), of=reach)
    path = np.concatenate([[[0, 0, low]], path, path[-1:] + [[-reach, 0, rise]]])
    spout = tube(path, r, 14) + _nozzle(draws, path[-1] + (r, 0, 0), -UP, 0.8 * r, 1.4 * r)
    tap = Assembly("base", body, BRASS)
    limit = min(arcsin(min((half - 0.03) / (reach + bend + 2 * r), 1.0)), 1.2)
    tap.add("spout", spout, revolute("base", UP, (0, 0, low), -limit, limit))
    alike = draws.fork("", draws.seed("handle_seed") // 2)
    knob = _knob(alike, draws.length("knob_radius", (1.3, 2.2), of=radius))
    turn = min(draws.angle("handle_travel", (1.57, 3.0), (0.8, 3.4), tails=0.4), np.pi)
    for number, side in enumerate((-1.0, 1.0)):
        pivot, out = np.array([0.0, side * half, 0.0]), np.array([0.0, side, 0.0])
        tap.add(f"handle_{number}", _placed(knob, pivot, out, FRONT), revolute("base", out, pivot, 0.0, turn))
    return tap


def _body(draws: Draws, radius: float, height: float) -> Solid:
    """Upright body on a foot."""
    foot, thick = draws.length("base_radius", (1.1, 1.5), of=radius), draws.length("base_height", (0.004, 0.012))
    kind = draws.pick("body", {"round": 0.4, "tapered": 0.25, "square": 0.15, "turned": 0.2})
    if kind == "square":
        s = 0.95 * radius
        solid = box(s, s, (0, height), fillet=0.25 * s, axis=2)
        return solid + box(foot, foot, (0, thick), fillet=0.3 * s, axis=2)
    low = radius * (draws.number("body_taper", (1.05, 1.35)) if kind == "tapered" else 1.0)
    solid = rod(0, 0, (0, height), low, radius) + rod(0, 0, (0, thick), 1.1 * foot, foot)
    if kind == "turned":
        for level in draws.numbers("body_ring_level", 0.12, 0.9, 3) * height:
            h = 0.1 * radius
            solid += rod(0, 0, (level - h, level + h), draws.length("body_ring_radius", (1.05, 1.2), of=radius))
    return solid


def _add_spout(draws: Draws, tap: Assembly, spout: Solid, z: float, share: float, freely: float) -> None:
    """A spout that by chance turns on its foot at a height, and then by chance without end."""
    if draws.chance("spout_turns", share):
        limit = None if draws.chance("spout_turns_freely", freely) else draws.angle("spout_angle", (0.9, 2.6))
        tap.add("spout", spout, swivel("base", UP, (0, 0, z), limit))
    else:
        tap.body += spout.moved((0, 0, -GAP - 0.001))


def _gooseneck(draws: Draws, foot: float, r: float, reach: float, tip: float) -> Solid:
    """High spout that stands at height ``foot``, bends over and ends at height ``tip``."""
    z0 = foot + GAP
    bow = 0.5 * reach
    kind = draws.pick("spout", {"bow": 0.6, "swan": 0.25, "square": 0.15})
    if kind == "square":
        crest = tip + draws.length("spout_crest", (0.02, 0.05))
        points = [(0, z0), (0, crest - 0.02), (0.006, crest - 0.006), (0.02, crest)]
        points += [(reach - 0.02, crest), (reach - 0.006, crest - 0.006), (reach, crest - 0.02), (reach, tip)]
    else:
        spring = max(tip + draws.length("spout_crest", (0.0, 0.04)), z0 + 0.01)
        end = np.pi if kind == "bow" else draws.number("spout_bend", (0.75, 0.92)) * np.pi
        flat = 1.0 if kind == "bow" else draws.number("spout_flatness", (0.6, 0.9))
        angles = np.linspace(0.0, end, 13)
        points = [(0.0, z0)] + [(bow - bow * cos(a), spring + flat * bow * sin(a)) for a in angles]
        if kind == "bow" and spring - tip > 0.004:
            points.append((reach, tip))
    path = np.array([(-x, 0.0, z) for x, z in points])
    ending = path[-1] - path[-2]
    solid = tube(path, r, 14) + rod(0, 0, (z0, z0 + 1.2 * r), 1.35 * r, 1.15 * r, 20)
    return solid + _nozzle(draws, path[-1] - 0.3 * ending, ending, 1.15 * r, 1.2 * r)


def _nozzle(draws: Draws, start: Array, direction: Array, radius: float, length: float) -> Solid:
    """The aerator at the mouth."""
    wide = draws.length("nozzle_radius", (1.0, 1.15), of=radius)
    return cylinder(start, start + length * unit(direction), wide, sections=18)


def _placed(handle: Solid, pivot: Array, axis: Array, start: Array) -> Solid:
    """An upright handle, whose lever points to the front, moved to its pivot and turned to an axis and a direction."""
    return handle.rotated(np.column_stack([-start, np.cross(start, axis), axis])).moved(pivot)


def _handle(draws: Draws, radius: float, length: float, crowned: bool) -> Solid:
    """A handle on a hub at the origin: a lever, a paddle, or a knob.

    ``length`` is that from the axis to the lever's end. A hub that crowns a body is never a cross.
    """
    kind = draws.pick("handle", {"rod": 0.4, "paddle": 0.35, "ball": 0.12, "knob": 0.13})
    if kind == "knob" and not crowned:
        return _knob(draws, min(1.5 * radius, 0.4 * length))
    tall, taper = draws.length("hub_height", (0.9, 1.7), of=radius), draws.number("hub_taper", (0.85, 1.0))
    if draws.chance("hub_domed", 0.5):
        hub = rod(0, 0, (GAP, GAP + 0.75 * tall), radius) + _dome(GAP + 0.75 * tall, radius)
    else:
        hub = rod(0, 0, (GAP, GAP + tall), radius, radius * taper)
    lean = draws.angle("lever_rise", (0.0, 0.45))
    root = (GAP + 0.65 * tall) * UP
    tip = root + length * (cos(lean) * FRONT + sin(lean) * UP)
    r = max(draws.length("lever_radius", (0.18, 0.3), of=radius), 0.003)
    if kind == "paddle":
        wide = 0.5 * draws.length("paddle_width", (0.45, 0.9), of=2 * radius)
        thick = max(0.5 * draws.length("paddle_thickness", (0.12, 0.22), of=2 * radius), 0.002)
        middle = 0.5 * (root + tip) + draws.number("paddle_bulge", (0.0, 1.0)) * 0.1 * length * UP
        narrow = 0.5 * draws.length("paddle_tip_width", (0.5, 1.0), of=2 * wide)
        slabs = [
            hull_of(*(ellipsoid(p + s * (w - thick) * SIDE, thick, 8) for s in (-1, 1)))
            for p, w in ((root, wide), (middle, wide), (tip, narrow))
        ]
        return hub + hull_of(slabs[0], slabs[1]) + hull_of(slabs[1], slabs[2])
    end = draws.length("lever_tip_radius", (0.8, 1.2), of=r)
    if kind == "ball":
        return hub + tube([root, tip], 0.7 * r, 12) + ellipsoid(tip, 1.6 * r, 14)
    return hub + tube([root, tip], [r, end], 12) + ellipsoid(tip, r, 12)


def _dome(z: float, radius: float) -> Solid:
    """A low round cap."""
    levels = [(-0.01, 1.0), (0.0, 1.0), (0.2, 0.9), (0.36, 0.6), (0.4, 0.3)]
    return hull(np.concatenate([circle((0, 0, z + h * radius), UP, s * radius) for h, s in levels]))


def _knob(draws: Draws, radius: float) -> Solid:
    """A cross or a round knob at the origin, to turn with the whole hand."""
    tall = draws.length("knob_height", (0.6, 0.9), of=radius)
    if draws.chance("knob_crossed", 0.55):
        center = (0, 0, GAP + 0.55 * tall)
        arms = [(radius * cos(a), radius * sin(a), center[2]) for a in turns(draws.integer("knob_arms", 3, 5))]
        r = draws.length("knob_arm_radius", (0.14, 0.2), of=radius)
        solid = rod(0, 0, (GAP, GAP + tall), 0.45 * radius, 0.35 * radius, 18)
        return solid + union(tube([center, tip], r, 10) + ellipsoid(tip, 1.35 * r, 10) for tip in arms)
    solid = rod(0, 0, (GAP, GAP + tall), radius, 0.85 * radius) + _dome(GAP + tall, 0.7 * radius)
    for a in turns(draws.integer("knob_ribs", 6, 11)):
        x, y = 0.93 * radius * cos(a), 0.93 * radius * sin(a)
        ends = (x, y, GAP + 0.1 * tall), (0.9 * x, 0.9 * y, GAP + 0.85 * tall)
        solid += cylinder(*ends, 0.14 * radius, sections=8)
    return solid
