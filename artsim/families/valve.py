"""Valves: gate and globe valves with a handwheel on a thread, and ball valves with a lever.

What varies: one to three valves on a pipe, flanges or threaded ends, the bonnet, a yoke, the wheel's size and spokes,
whether the stem rises with the wheel (screw joint) or the wheel only turns.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, Rng, continuous, pick, revolute, screw
from artsim.making.outlines import UP, circle, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull_of, ring, rod, tube
from artsim.model.kinematics import Array

GAP = 0.0015
IRON = 4000.0  # kg/m^3, as real ones are hollow
FLANGE = 1.9
"""Radius of the widest flange over that of the pipe."""


def build(rng: Rng) -> Assembly:
    """Valves on a pipe along Y, with their stems up or towards the front; all are shut at rest."""
    pipe = rng.uniform(0.02, 0.05)  # outer radius
    count = pick(rng, {1: 0.7, 2: 0.2, 3: 0.1})
    lever = rng.random() < 0.3
    spacing = pipe * rng.uniform(5.5, 7.5)
    room = 0.47 * spacing if count > 1 else np.inf
    half = 0.5 * count * spacing * (1.0 if count > 1 else rng.uniform(0.55, 0.9))
    valve = Assembly("body", tube([(0, -half, 0), (0, half, 0)], pipe, 24) + _ends(rng, half, pipe), IRON)
    style, joint_style = int(rng.integers(1 << 30)), int(rng.integers(1 << 30))
    rises = rng.random() < 0.75
    direction = float(rng.choice([-1.0, 1.0]))
    for k in range(count):
        y = (k - 0.5 * (count - 1)) * spacing
        alike = np.random.default_rng([style, joint_style])
        make = _ball_valve if lever else _gate_valve
        fixed, moving, pivot, travel = make(alike, pipe, room)
        valve.body += fixed.moved((0, y, 0))
        pivot = pivot + (0, y, 0)
        if lever:
            joint = revolute("body", -UP, pivot, 0.0, 0.5 * np.pi)
        elif rises:
            turns = 2.0 * np.pi * rng.uniform(2.0, 6.0)
            joint = screw("body", UP, pivot, 0.0, turns, travel / turns)
        else:
            joint = continuous("body", direction * UP, pivot)
        valve.add_numbered("lever" if lever else "handwheel", moving.moved((0, y, 0)), joint)
    return valve


def _ends(rng: Rng, half: float, pipe: float) -> Solid:
    """Flanges with bolts, or threaded collars with six sides, at both ends of the pipe."""
    solid = Solid()
    flanged = rng.random() < 0.65
    bolts, thick = int(rng.choice([4, 6, 8])), pipe * rng.uniform(0.25, 0.4)
    wide = pipe * rng.uniform(1.6, FLANGE)
    for side in (-1.0, 1.0):
        end = np.array([0.0, side * half, 0.0])
        inward = np.array([0.0, -side, 0.0])
        if not flanged:
            solid += cylinder(end, end + 0.9 * pipe * inward, 1.3 * pipe, sections=6)
            continue
        solid += cylinder(end, end + thick * inward, wide, sections=24)
        for spot in circle(end, inward, 0.5 * (wide + pipe), bolts):
            solid += cylinder(
                spot - 0.12 * pipe * inward, spot + (thick + 0.15 * pipe) * inward, 0.14 * pipe, sections=6
            )
    return solid


def _gate_valve(rng: Rng, pipe: float, room: float) -> tuple[Solid, Solid, Array, float]:
    """Body and bonnet; the handwheel with its stem; where they join; how far the wheel rises."""
    belly = pipe * rng.uniform(1.15, 1.45)
    solid = ellipsoid((0, 0, 0), (belly, 1.25 * belly, belly * rng.uniform(1.0, 1.3)), 20)
    neck = pipe * rng.uniform(0.7, 0.95)
    seat = belly * rng.uniform(1.2, 1.7)
    solid += rod(0, 0, (0, seat), neck)
    wide = neck * rng.uniform(1.35, 1.6)
    thick = pipe * rng.uniform(0.2, 0.3)
    solid += rod(0, 0, (seat - thick, seat + thick), wide, sections=24)
    for spot in circle((0, 0, seat), UP, 0.5 * (wide + neck), int(rng.choice([4, 6]))):
        solid += cylinder(spot - (0, 0, 1.4 * thick), spot + (0, 0, 1.5 * thick), 0.13 * pipe, sections=6)
    stem = pipe * rng.uniform(0.16, 0.24)
    travel = pipe * rng.uniform(0.6, 1.4)
    gland = max(2.2 * stem, 0.45 * neck)
    bottom = seat + 0.5 * thick
    top = bottom + travel + pipe * rng.uniform(0.3, 0.7)
    bore = stem + GAP
    solid += ring((0, 0, 0.5 * (bottom + top)), UP, bore, gland, top - bottom, 12)
    if rng.random() < 0.5:
        solid += ring((0, 0, top - 0.12 * pipe), UP, bore, 1.35 * gland, 0.24 * pipe, 6)
    hub = top + GAP
    if rng.random() < 0.4:  # a yoke that carries a nut for the stem
        hub = top + travel * rng.uniform(0.3, 0.8) + 0.3 * pipe
        leg = 0.14 * pipe
        reach = 0.9 * wide - leg
        for side in (-1, 1):
            solid += tube([(0, side * reach, seat), (0, side * reach, hub - 0.35 * pipe), (0, side * (bore + 1.6 * leg),
                           hub - 0.15 * pipe - GAP)], leg, 10)  # fmt: skip
        solid += ring((0, 0, hub - GAP - 0.15 * pipe), UP, bore, bore + 2.5 * leg, 0.3 * pipe, 12)
    wheel = _wheel(rng, hub, min(pipe * rng.uniform(1.5, 2.4), room), stem, pipe)
    wheel += rod(0, 0, (bottom + 0.2 * pipe, hub + 0.3 * pipe), stem, sections=16)
    return solid, wheel, np.array([0.0, 0.0, hub]), travel


def _wheel(rng: Rng, hub: float, radius: float, stem: float, pipe: float) -> Solid:
    """Handwheel: a rim, spokes (dished by chance) and a hub with a nut."""
    rim = radius * rng.uniform(0.07, 0.12)
    spokes = int(rng.integers(3, 7))
    level = hub + rim + radius * rng.uniform(0.0, 0.25)
    tall = 0.35 * pipe
    solid = tube(circle((0, 0, level), UP, radius - rim, 18), rim, 8, closed=True)
    solid += rod(0, 0, (hub, hub + tall), 2.0 * stem, 1.7 * stem, 16)
    solid += rod(0, 0, (hub + tall - 0.001, hub + tall + 0.8 * stem), 1.2 * stem, sections=6)
    flat = rng.random() < 0.5
    for angle in turns(spokes):
        out = np.array([cos(angle), sin(angle), 0.0])
        root, tip = out * stem + (0, 0, hub + 0.5 * tall), out * (radius - rim) + (0, 0, level)
        if flat:
            across = np.cross(UP, out)
            cube = box(-0.4 * rim * np.ones(3), 0.4 * rim * np.ones(3))
            ends = [cube.moved(p + s * 0.9 * rim * across) for p in (root, tip) for s in (-1, 1)]
            solid += hull_of(*ends)
        else:
            solid += tube([root, tip], [0.9 * rim, 0.7 * rim], 8)
    return solid


def _ball_valve(rng: Rng, pipe: float, room: float) -> tuple[Solid, Solid, Array, float]:
    """Body and neck; the lever on its nut; where they join."""
    belly = pipe * rng.uniform(1.25, 1.5)
    solid = ellipsoid((0, 0, 0), (belly, 1.2 * belly, belly), 18)
    sides = int(rng.choice([6, 8]))
    for side in (-1, 1):
        solid += rod(0, (side * 0.5 * belly, side * 1.4 * belly), 0, 1.2 * pipe, sections=sides)
    neck, top = 0.45 * pipe, belly + pipe * rng.uniform(0.25, 0.7)
    solid += rod(0, 0, (0, top), neck, sections=18)
    z = top + GAP
    thick, half = rng.uniform(0.003, 0.005), pipe * rng.uniform(0.22, 0.35)
    length = min(pipe * rng.uniform(2.8, 4.2), 2.0 * room - 1.5 * neck)
    rise = max(pipe * rng.uniform(0.2, 0.8), FLANGE * pipe + thick + GAP - z)  # open, the grip lies over a flange
    # Shut, the lever stands across the pipe, towards the front.
    a = box(0.9 * neck, 1.1 * half, (z, z + thick), fillet=0.4 * thick)
    b = box((-0.35 * length, -0.35 * length + 0.008), half, (z + rise, z + rise + thick), fillet=0.4 * thick)
    c = box((-length, -length + 0.01), half, (z + rise, z + rise + thick), fillet=0.4 * thick)
    lever = a + hull_of(box((-neck, -0.3 * neck), half, (z, z + thick), fillet=0.4 * thick), b)
    if rng.random() < 0.6:  # a sleeve on the grip
        grown = box((-length - 0.002, -1.2 * half, z + rise - 0.3 * thick),
                            (-0.4 * length, 1.2 * half, z + rise + 1.5 * thick), fillet=0.6 * thick)  # fmt: skip
        lever += grown
    lever += hull_of(b, c)
    if rng.random() < 0.25 and length + 2 * GAP < room:  # a second wing: a butterfly handle
        lever += lever.mirrored(0)
    lever += rod(0, 0, (z + 0.5 * thick, z + thick + 0.25 * pipe), 0.35 * pipe, sections=6)
    return solid, lever, np.array([0.0, 0.0, top]), 0.0
