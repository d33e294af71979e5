"""Valves: gate and globe valves with a handwheel on a thread, and ball valves with a lever.

What varies: one to three valves on a pipe, flanges or threaded ends, the bonnet, a yoke, the wheel's size and spokes,
whether the stem rises with the wheel (screw joint) or the wheel only turns.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, continuous, revolute, screw
from artsim.making.draws import Draws
from artsim.making.outlines import UP, circle, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull_of, ring, rod, tube, union

GAP = 0.0015
IRON = 4000.0  # kg/m^3, as real ones are hollow
FLANGE = 1.9
"""Radius of the widest flange over that of the pipe."""


def build(draws: Draws) -> Assembly:
    """Valves on a pipe along Y, with their stems up or towards the front; all are shut at rest."""
    pipe, count = 0.5 * draws.length("diameter", (0.04, 0.1)), draws.pick("valves", {1: 0.7, 2: 0.2, 3: 0.1})
    lever, spacing = draws.chance("lever", 0.3), draws.length("spacing", (5.5, 7.5), of=pipe)
    room = 0.47 * spacing if count > 1 else np.inf
    half = 0.5 * count * spacing * (1.0 if count > 1 else draws.number("pipe_length", (0.55, 0.9)))
    valve = Assembly("body", tube([(0, -half, 0), (0, half, 0)], pipe, 24) + _ends(draws, half, pipe), IRON)
    alike = draws.fork("", [draws.seed("valve_seed") // 2, draws.seed("more_seed") // 2])
    rises, axis = draws.chance("wheel_rises", 0.75), draws.one_of("wheel_axis", {"down": -UP, "up": UP})
    fixed, moving, top, travel = (_ball_valve if lever else _gate_valve)(alike, pipe, room)
    for k in range(count):
        y = (k - 0.5 * (count - 1)) * spacing
        valve.body += fixed.moved((0, y, 0))
        pivot = np.array([0.0, y, top])
        joint = revolute("body", -UP, pivot, 0.0, 0.5 * np.pi) if lever else continuous("body", axis, pivot)
        if rises and not lever:
            angle = 2.0 * np.pi * draws.number("wheel_turns", (2.0, 6.0))
            joint = screw("body", UP, pivot, 0.0, angle, travel / angle)
        valve.add_numbered("lever" if lever else "handwheel", moving.moved((0, y, 0)), joint)
    return valve


def _ends(draws: Draws, half: float, pipe: float) -> Solid:
    """Flanges with bolts, or threaded collars with six sides, at both ends of the pipe."""
    solid = Solid()
    flanged, bolts = draws.chance("flanges", 0.65), draws.pick("flange_bolts", [4, 6, 8])
    thick, wide = draws.lengths(flange_thickness=(0.25, 0.4), flange_radius=(1.6, FLANGE), of=pipe)
    for side in (-1.0, 1.0):
        end = np.array([0.0, side * half, 0.0])
        inward = np.array([0.0, -side, 0.0])
        if not flanged:
            solid += cylinder(end, end + 0.9 * pipe * inward, 1.3 * pipe, sections=6)
            continue
        solid += cylinder(end, end + thick * inward, wide, sections=24)
        head, tail = -0.12 * pipe * inward, (thick + 0.15 * pipe) * inward
        for spot in circle(end, inward, 0.5 * (wide + pipe), bolts):
            solid += cylinder(spot + head, spot + tail, 0.14 * pipe, sections=6)
    return solid


def _gate_valve(draws: Draws, pipe: float, room: float) -> tuple[Solid, Solid, float, float]:
    """Body and bonnet; the handwheel with its stem; the height where they join; how far the wheel rises."""
    belly = draws.length("body_radius", (1.15, 1.45), of=pipe)
    solid = ellipsoid((0, 0, 0), (belly, 1.25 * belly, draws.length("body_height", (1.0, 1.3), of=belly)), 20)
    neck = draws.length("neck_radius", (0.7, 0.95), of=pipe)
    seat = draws.length("neck_height", (1.2, 1.7), of=belly)
    solid += rod(0, 0, (0, seat), neck)
    wide = draws.length("bonnet_radius", (1.35, 1.6), of=neck)
    thick = draws.length("bonnet_thickness", (0.2, 0.3), of=pipe)
    solid += rod(0, 0, (seat - thick, seat + thick), wide, sections=24)
    for spot in circle((0, 0, seat), UP, 0.5 * (wide + neck), draws.pick("bonnet_bolts", [4, 6])):
        solid += cylinder(spot - (0, 0, 1.4 * thick), spot + (0, 0, 1.5 * thick), 0.13 * pipe, sections=6)
    stem, travel = draws.lengths(stem_radius=(0.16, 0.24), wheel_travel=(0.6, 1.4), of=pipe)
    gland = max(2.2 * stem, 0.45 * neck)
    bottom = seat + 0.5 * thick
    top = bottom + travel + draws.length("gland_height", (0.3, 0.7), of=pipe)
    bore = stem + GAP
    solid += ring((0, 0, 0.5 * (bottom + top)), UP, bore, gland, top - bottom, 12)
    if draws.chance("gland_nut", 0.5):
        solid += ring((0, 0, top - 0.12 * pipe), UP, bore, 1.35 * gland, 0.24 * pipe, 6)
    hub = top + GAP
    if draws.chance("yoke", 0.4):  # it carries a nut for the stem
        hub = top + draws.length("yoke_height", (0.3, 0.8), of=travel) + 0.3 * pipe
        leg = 0.14 * pipe
        reach = 0.9 * wide - leg
        for side in (-1, 1):
            solid += tube([(0, side * reach, seat), (0, side * reach, hub - 0.35 * pipe), (0, side * (bore + 1.6 * leg),
                           hub - 0.15 * pipe - GAP)], leg, 10)  # fmt: skip
        solid += ring((0, 0, hub - GAP - 0.15 * pipe), UP, bore, bore + 2.5 * leg, 0.3 * pipe, 12)
    wheel = _wheel(draws, hub, min(draws.length("wheel_radius", (1.5, 2.4), of=pipe), room), stem, pipe)
    wheel += rod(0, 0, (bottom + 0.2 * pipe, hub + 0.3 * pipe), stem, sections=16)
    return solid, wheel, hub, travel


def _wheel(draws: Draws, hub: float, radius: float, stem: float, pipe: float) -> Solid:
    """Handwheel: a rim, spokes (dished by chance) and a hub with a nut."""
    rim, spokes = draws.length("rim_radius", (0.07, 0.12), of=radius), draws.integer("spokes", 3, 6)
    level = hub + rim + draws.length("wheel_dish", (0.0, 0.25), of=radius)
    tall = 0.35 * pipe
    solid = tube(circle((0, 0, level), UP, radius - rim, 18), rim, 8, closed=True)
    solid += rod(0, 0, (hub, hub + tall), 2.0 * stem, 1.7 * stem, 16)
    solid += rod(0, 0, (hub + tall - 0.001, hub + tall + 0.8 * stem), 1.2 * stem, sections=6)
    flat = draws.chance("spokes_flat", 0.5)
    for angle in turns(spokes):
        out = np.array([cos(angle), sin(angle), 0.0])
        root, tip = out * stem + (0, 0, hub + 0.5 * tall), out * (radius - rim) + (0, 0, level)
        if flat:
            across = np.cross(UP, out)
            cube = box(-0.4 * rim * np.ones(3), 0.4 * rim * np.ones(3))
            solid += hull_of(*[cube.moved(p + s * 0.9 * rim * across) for p in (root, tip) for s in (-1, 1)])
        else:
            solid += tube([root, tip], [0.9 * rim, 0.7 * rim], 8)
    return solid


def _ball_valve(draws: Draws, pipe: float, room: float) -> tuple[Solid, Solid, float, float]:
    """Body and neck; the lever on its nut; the height where they join; 0, as it does not rise."""
    belly = draws.length("body_radius", (1.25, 1.5), of=pipe)
    solid = ellipsoid((0, 0, 0), (belly, 1.2 * belly, belly), 18)
    sides = draws.pick("body_sides", [6, 8])
    solid += union(rod(0, (side * 0.5 * belly, side * 1.4 * belly), 0, 1.2 * pipe, sections=sides) for side in (-1, 1))
    neck, top = 0.45 * pipe, belly + draws.length("neck_height", (0.25, 0.7), of=pipe)
    solid += rod(0, 0, (0, top), neck, sections=18)
    z = top + GAP
    thick = draws.length("lever_thickness", (0.003, 0.005))
    half = 0.5 * draws.length("lever_width", (0.22, 0.35), of=2 * pipe)
    length = min(draws.length("lever_length", (2.8, 4.2), of=pipe), 2.0 * room - 1.5 * neck)
    # Open, the grip lies over a flange.
    rise = max(draws.length("lever_rise", (0.2, 0.8), of=pipe), FLANGE * pipe + thick + GAP - z)
    # Shut, the lever stands across the pipe, towards the front.
    a = box(0.9 * neck, 1.1 * half, (z, z + thick), fillet=0.4 * thick)
    b = box((-0.35 * length, -0.35 * length + 0.008), half, (z + rise, z + rise + thick), fillet=0.4 * thick)
    c = box((-length, -length + 0.01), half, (z + rise, z + rise + thick), fillet=0.4 * thick)
    lever = a + hull_of(box((-neck, -0.3 * neck), half, (z, z + thick), fillet=0.4 * thick), b)
    if draws.chance("lever_sleeve", 0.6):
        grip = (z + rise - 0.3 * thick, z + rise + 1.5 * thick)
        lever += box((-length - 0.002, -0.4 * length), 1.2 * half, grip, fillet=0.6 * thick)
    lever += hull_of(b, c)
    if draws.chance("lever_winged", 0.25) and length + 2 * GAP < room:  # a second wing: a butterfly handle
        lever += lever.mirrored(0)
    lever += rod(0, 0, (z + 0.5 * thick, z + thick + 0.25 * pipe), 0.35 * pipe, sections=6)
    return solid, lever, top, 0.0
