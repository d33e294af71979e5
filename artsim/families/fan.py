"""Fans: table, standing and ceiling fans, and box fans in a square frame.

What varies: the kind, 3 to 6 blades and their shape, the cage, a telescopic column, whether the head turns from side to
side, tilts, or both.
"""

from dataclasses import replace

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.common.products import norm
from artsim.making.assembly import Assembly, JointSpec, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, UP, circle, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, frame, loft, ring, rod, tube, union

GAP = 0.002


def build(draws: Draws) -> Assembly:
    """A fan that blows towards -X (a ceiling fan: downward)."""
    return draws.one_of("kind", {"head": _head_fan, "ceiling": _ceiling_fan, "box": _box_fan}, (0.7, 0.17, 0.13))(draws)


def _head_fan(draws: Draws) -> Assembly:
    """A head with a cage on a neck, on a table stand or a tall column."""
    standing = draws.chance("standing", 0.5)
    cage = 0.5 * draws.length("diameter", (0.34, 0.5) if standing else (0.26, 0.4))
    column = draws.length("column_radius", (0.08, 0.12), of=cage)
    height = draws.length("height", (0.7, 1.1)) if standing else draws.length("height", (1.15, 1.5), of=cage)
    sliding = standing and draws.chance("telescopic", 0.6)
    swings, tilts = draws.chance("oscillates", 0.75), draws.chance("tilts", 0.75)
    motor = draws.length("motor_radius", (0.26, 0.36), of=cage)
    level = height + 1.3 * motor + 0.02
    base = _foot(draws, cage, standing)
    stages: list[tuple[str, Solid, JointSpec | None]] = []  # each on the one before, or, without a joint, part of it
    if sliding:
        sleeve = draws.length("sleeve_height", (0.5, 0.65), of=height)
        wide = 1.45 * column
        base += rod(0, 0, (0.005, 0.04), wide, sections=20)
        base += ring((0, 0, 0.5 * (0.02 + sleeve)), UP, column + GAP, wide, sleeve - 0.02, 16)
        base += ring((0, 0, sleeve - 0.02), UP, column + GAP, 1.25 * wide, 0.05, 16)
        deep = draws.length("pole_depth", (0.4, 0.8), of=sleeve - 0.06)
        pole = rod(0, 0, (sleeve - deep, height), column, sections=18)
        stages.append(("pole", pole, prismatic("", UP, 0.0, 0.75 * deep, (0, 0, sleeve))))
    else:
        base += rod(0, 0, (0.005, height), column * (1.0 if standing else 1.5), column, 20)
    swing = draws.turn("swing", (30.0, 75.0))
    turn = revolute("", UP, (0, 0, height), -swing, swing) if swings else None
    stages.append(("neck", _neck(column, motor, height + (GAP if swings else -0.002), level, 0.85 * motor), turn))
    pins = 0.85 * motor + (-GAP if tilts else 0.002)
    back = -max(0.55 * motor, 1.7 * column + 0.008)  # where the cage starts, before the neck
    head, middle = _head(draws, cage, motor, level, pins, back)
    nod = None
    if tilts:
        down = _steepest(cage, back, middle, 1.9 * column + 0.008)
        nod = revolute("", SIDE, (0, 0, level), -down, draws.turn("tilt_up", (15.0, 35.0)))
    stages.append(("head", head, nod))
    blades = _blades(draws, cage, 2.0 * abs(middle - back)).moved((middle, 0, level))
    blades += rod((middle, back - GAP), 0, level, 0.03 * cage, sections=10)
    stages.append(("blades", blades, continuous("", FRONT, (middle, 0, level))))
    fan = Assembly(density=1200.0)
    below: tuple[str, Solid, JointSpec | None] = ("base", base, None)
    for name, solid, joint in stages:
        if joint is None:
            below = below[0], below[1] + solid, below[2]
        else:
            fan.add(*below)
            below = name, solid, replace(joint, parent=below[0])
    fan.add(*below)
    return fan


def _steepest(cage: float, back: float, middle: float, column: float) -> float:
    """Radians by which a head can look down before its cage meets the column."""
    angles = np.linspace(0.0, np.deg2rad(30), 31)
    profile = np.array([(back, 0.3 * cage), (middle, 1.04 * cage)])
    x = profile[:, :1] * cos(angles) + profile[:, 1:] * sin(angles)
    clear = angles[(x < -column).all(axis=0)]
    return float(clear.max()) if len(clear) else 0.01


def _neck(column: float, motor: float, z: float, level: float, side: float) -> Solid:
    """A knuckle with two cheeks that carry the motor."""
    cheek = 0.01
    solid = rod(0, 0, (z, z + 0.014), 1.4 * column, sections=18) + box(column, side + cheek, (z + 0.004, z + 0.014))
    for s in (-1, 1):
        y0, y1 = sorted((s * side, s * (side + cheek)))
        solid += box(0.9 * column, (y0, y1), (z + 0.005, level)) + rod(0, (y0, y1), level, 1.1 * column, sections=18)
    return solid


def _head(draws: Draws, cage: float, motor: float, level: float, pins: float, back: float) -> tuple[Solid, float]:
    """Motor with the cage before it; and the x of the middle of the cage."""
    half = 0.5 * draws.length("cage_depth", (0.17, 0.26), of=2 * cage)
    middle = back - half
    wide = 0.75 * motor
    solid = rod((back, 0.6 * motor), 0, 0, wide) + rod((0.59 * motor, 0.85 * motor), 0, 0, wide, 0.6 * wide)
    solid += rod(0, (-pins, pins), 0, 0.35 * motor, sections=16) + _cage(draws, cage, half, wide).moved((middle, 0, 0))
    return solid.moved((0, 0, level)), middle


def _cage(draws: Draws, cage: float, half: float, motor: float) -> Solid:
    """Wires before and behind the blades, about the X axis; the front badge at -X, the motor at +X."""
    wire = max(0.009 * cage, 0.0016)
    wires = circle((0, 0, 0), FRONT, 1.0, draws.integer("cage_wires", 10, 16))
    badge = draws.length("badge_radius", (0.14, 0.26), of=cage)
    solid = tube(circle((0, 0, 0), FRONT, cage, 24), 2.2 * wire, 8, closed=True)
    solid += rod((-half - 1.5 * wire, -half + wire), 0, 0, 0.85 * badge, badge)
    for name, x, hub in (("front", -half, 0.85 * badge), ("back", half, 0.8 * motor)):
        path = np.array([(hub, x), (draws.number(f"cage_{name}", (0.82, 0.9)) * cage, x), (cage, 0.0)])
        solid += union(tube(path[:, :1] * spot + path[:, 1:] * np.array([1.0, 0.0, 0.0]), wire, 5) for spot in wires)
    return solid + tube(circle((-half, 0, 0), FRONT, 0.55 * cage, 16), 1.1 * wire, 5, closed=True)


def _blades(draws: Draws, cage: float, depth: float) -> Solid:
    """A propeller about the X axis, within a cage of the given radius and depth."""
    count = draws.integer("blades", 3, 6)
    hub, tip = draws.lengths(hub_radius=(0.13, 0.2), blade_length=(0.78, 0.86), of=cage)
    reach = 0.2 * depth
    solid = rod((-reach, reach), 0, 0, 0.85 * hub, hub)
    broad = draws.number("blade_spread", (0.45, 0.75)) * 2.0 * np.pi / count
    sweep = draws.angle("blade_sweep", (-0.5, 0.5))
    shares = np.array([0.0, 0.35, 0.75, 1.0])
    widths = np.array([0.75, 1.0, 1.0, draws.number("blade_tip_width", (0.4, 0.8))])
    sections = []
    for share, width in zip(shares, widths, strict=True):
        radius = 0.8 * hub + share * (tip - 0.8 * hub)
        chord = min(broad * width * radius + 0.25 * hub, 0.55 * cage)
        rise = min(0.35 * chord, reach)
        center = np.array([0.0, -sin(sweep * share), cos(sweep * share)]) * radius
        across = np.array([2.0 * rise, -chord * cos(sweep * share), -chord * sin(sweep * share)]) * 0.5
        thick = np.array([0.0012, 0.0, 0.0])
        sections.append([center + a * across + b * thick for a in (-1, 1) for b in (-1, 1)])
    blade = loft(sections)
    # The corners of a broad blade reach further out than its middle.
    bounds = max(float(norm(np.array(s)[:, 1:]).max()) for s in sections)
    if bounds > 0.88 * cage:
        blade = blade.scaled((1.0, 0.88 * cage / bounds, 0.88 * cage / bounds))
    return solid + union(blade.turned(FRONT, angle) for angle in turns(count))


def _box_fan(draws: Draws) -> Assembly:
    """Blades in a square frame, with a knob by chance."""
    cage = 0.5 * draws.length("diameter", (0.28, 0.52))
    half = 0.5 * draws.length("depth", (0.22, 0.32), of=2 * cage)
    wall, outer = 0.014, 1.06 * cage + 0.014
    base = frame((-half, -outer, -outer), (half, outer, outer), [wall] * 4)
    for y in (-0.7 * outer, 0.7 * outer):
        base += box(1.3 * half, (y - 0.015, y + 0.015), (-outer - 0.02, -outer + 0.004), fillet=0.004)
    if draws.chance("handle", 0.5):
        spots = [(-0.3, -0.004), (-0.25, 0.03), (0.25, 0.03), (0.3, -0.004)]
        base += tube([(0, y * outer, outer + z) for y, z in spots], 0.006, 10).called("handle", UP)
    bars, bar = draws.integer("grille_bars", 7, 13), 0.0022
    for x in (-half + 2 * bar, half - 2 * bar):
        for y in np.linspace(-1.0, 1.0, bars + 2)[1:-1] * cage:
            base += box((x - bar, x + bar), (y - bar, y + bar), outer - 0.5 * wall)
        for z in (-0.5 * cage, 0.0, 0.5 * cage):
            base += box((x - 0.8 * bar, x + 0.8 * bar), outer - 0.5 * wall, (z - bar, z + bar))
    motor = 0.25 * cage
    back = half - 0.35 * half
    base += rod((back, half - bar), 0, 0, motor) + rod((-half + bar, -half - 0.002), 0, 0, 0.16 * cage)
    corner = np.array([-half, outer - 0.035, outer - 0.035])
    with_knob = draws.chance("knob", 0.5)
    if with_knob:
        base += box(corner - (0, 0.03, 0.03), corner + (half, 0.03, 0.03), fillet=0.006, axis=0)
    fan = Assembly("base", base, 500.0)
    blades = _blades(draws, cage, 1.5 * half) + rod((0, back - GAP), 0, 0, 0.03 * cage, sections=10)
    fan.add("blades", blades, continuous("base", FRONT, (0, 0, 0)), density=1200.0)
    if with_knob:
        at = corner + GAP * FRONT
        knob = cylinder(at, at + 0.014 * FRONT, 0.02, 0.017, 20)
        knob += box(at + (-0.02, -0.003, -0.016), at + (-0.01, 0.003, 0.016))
        fan.add("knob", knob, revolute("base", FRONT, at, 0.0, 4.2), density=1200.0)
    return fan


def _ceiling_fan(draws: Draws) -> Assembly:
    """Long paddles under a ceiling at z = 0, by chance with a lamp below."""
    reach, drop = 0.5 * draws.length("diameter", (0.9, 1.5)), draws.length("drop", (0.12, 0.4))
    count, body = draws.integer("blades", 3, 6), draws.length("motor_radius", (0.08, 0.13))
    mount = rod(0, 0, (-0.05, 0), 0.045, 0.07) + rod(0, 0, (-drop, -0.02), 0.013, sections=14)
    low = -drop - GAP
    tall = draws.length("motor_height", (0.7, 1.2), of=body)
    rotor = rod(0, 0, (low - 0.25 * tall, low), body, 0.5 * body, 28)
    rotor += rod(0, 0, (low - tall, low - 0.24 * tall), 0.9 * body, body, 28)
    if draws.chance("lamp", 0.6):
        bowl = (0.75 * body, 0.75 * body, draws.length("lamp_height", (0.4, 0.8), of=body))
        rotor += ellipsoid((0, 0, low - tall), bowl, 20)
    half, z = 0.5 * draws.length("blade_width", (0.1, 0.16)), low - 0.6 * tall
    pitch, root = draws.turn("blade_pitch", (8.0, 15.0)), body + draws.length("blade_arm", (0.03, 0.08))
    corner = draws.length("blade_corner", (0.2, 1.0), of=half)
    paddle = box((-reach, -root), half, 0.004, fillet=corner, axis=2, steps=4)
    blade = (paddle + box((-root - 0.06, -0.8 * body), 0.02, 0.0055)).turned(FRONT, pitch).moved((0, 0, z))
    rotor += union(blade.turned(UP, angle) for angle in turns(count))
    fan = Assembly("base", mount, 1500.0)
    fan.add("blades", rotor, continuous("base", UP, (0, 0, -drop)), density=900.0)
    return fan


def _foot(draws: Draws, cage: float, standing: bool) -> Solid:
    """Disc, or a cross of bars."""
    wide = draws.length("foot_radius", (0.85, 1.05), of=cage)
    if standing and draws.chance("foot_crossed", 0.4):
        half = 0.022
        return box(wide, half, (0, 0.025)) + box(half, wide, (0, 0.025))
    if draws.chance("foot_square", 0.25):
        return box(0.8 * wide, 0.8 * wide, (0, 0.03), fillet=0.25 * wide, axis=2)
    tall = draws.length("foot_height", (0.015, 0.03))
    return rod(0, 0, (0, tall), wide, 0.9 * wide, 32) + rod(0, 0, (tall - 0.001, 2 * tall), 0.85 * wide, 0.3 * wide, 28)
