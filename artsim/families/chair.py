"""Chairs that turn, slide or lean: office chairs, task chairs and stools on a star of legs or a disc.

What varies: legs or disc, castors (with or without wheels of their own) or glides, a piston that lifts the seat or a
fixed column, seat, back (fixed or tilting, framed or solid), head rest, arm rests (fixed or sliding up), a lever below
the seat, a knob at its side.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import SIDE, UP, Array, about, turns
from artsim.making.solids import Solid, box, cylinder, frame, hull_of, ring, rod, tube, union

GAP = 0.0025
_ARMRESTS = {False: {"none": 0.4, "fixed": 0.4, "sliding": 0.2}, True: {"none": 1.0, "fixed": 0.0, "sliding": 0.0}}
"""How often a chair or a stool has arm rests."""


def build(draws: Draws) -> Assembly:
    """A chair; one sits down facing -X. At rest the seat is at its lowest and faces forward."""
    legs = draws.pick("leg_count", {0: 0.15, 3: 0.07, 4: 0.18, 5: 0.5, 6: 0.1})  # none: a disc
    span = 0.5 * draws.length("width", (0.44, 0.72))  # of legs or disc, which stand out below the seat
    castors = legs > 2 and draws.chance("caster", 0.75)
    lifted = draws.chance("piston", 0.7)
    wheel, column = draws.lengths(wheel_radius=(0.022, 0.032), column_radius=(0.022, 0.03))
    floor = 2.0 * wheel + 0.024 if castors else 0.0
    piston = column - 0.004 - GAP
    stool, hub = draws.chance("stool", 0.25), floor + draws.length("hub_height", (0.05, 0.09))
    sleeve = hub + draws.length("column_height", (0.1, 0.45) if stool else (0.08, 0.22))
    travel = 0.6 * (sleeve - hub)
    low = sleeve + draws.length("seat_gap", (0.05, 0.1))

    base = _star(draws, legs, span, floor, hub, column, sleeve)
    if not lifted:
        base += rod(0, 0, (hub - 0.01, low - 0.002), column, sections=18)
    chair = Assembly("base", base, 1500.0)
    chair.record(legs=True)
    if castors:
        _castors(draws, chair, legs, span, floor, wheel)
    if lifted:
        stem = rod(0, 0, (sleeve - travel - 0.03, low - 0.002), piston, sections=18)
        chair.add("piston", stem, prismatic("base", UP, 0.0, travel, (0, 0, sleeve)), density=4000.0)

    depth = draws.length("seat_depth", (0.32, 0.4) if stool else (0.42, 0.5))
    width = depth if stool else draws.length("seat_width", (0.42, 0.52))
    thick = draws.length("seat_thickness", (0.04, 0.09))
    seat = _seat(draws, depth, width, thick, low, stool)
    back = draws.chance("back", 0.3 if stool else 1.0)
    tilting = back and draws.chance("back_tilts", 0.5)
    top = low + 0.03 + thick
    hinge = np.array([0.5 * depth + 0.03, 0.0, low + 0.025])
    rest = Solid()
    if back:
        rest = _back(draws, width, top, hinge)
        seat += box((0.2 * depth, hinge[0] - (0.018 if tilting else 0.0)), 0.04, (low + 0.005, low + 0.045))
    if tilting:  # forks either side of the hinge
        for side in (-1, 1):
            beside = side * (0.03 + GAP), side * 0.05
            seat += box((0.2 * depth, hinge[0] + 0.012), beside, (low + 0.005, low + 0.045))
    arms = draws.pick("armrests", _ARMRESTS[stool])
    if arms == "fixed":
        seat += _arms(draws, depth, width, low, top)
    elif arms == "sliding":  # sleeves for them, on beams from below the seat
        y = 0.5 * width + 0.04
        sleeves = box(0.02, (0.08, y), (low + 0.004, low + 0.026))
        sleeves += frame((-0.024, y - 0.014, low + 0.004), (0.024, y + 0.014, top + 0.08), [0.005] * 4, 0, 1)
        seat += sleeves + sleeves.mirrored(1)
    joint = continuous("piston" if lifted else "base", UP, (0, 0, low))
    chair.add("seat", seat if tilting else seat + rest, joint, density=400.0)
    if tilting:
        chair.add("back", rest, revolute("seat", SIDE, hinge, 0.0, draws.turn("back_angle", (12, 28))), density=400.0)
    if arms == "sliding":
        _sliding_arms(draws, chair, depth, width, top)
    _controls(draws, chair, low)
    return chair


def _sliding_arms(draws: Draws, chair: Assembly, depth: float, width: float, top: float) -> None:
    """Pads on bars that slide in their sleeves."""
    y, z = 0.5 * width + 0.04, top + 0.08 + GAP
    half = 0.5 * draws.length("armrest_width", (0.05, 0.1))
    fore = draws.number("armrest_front", (0.2, 0.35)) * depth
    aft, travel = draws.number("armrest_back", (0.15, 0.3)) * depth, draws.length("armrest_travel", (0.04, 0.09))
    for number, side in enumerate((-1, 1)):
        arm = box((-fore, aft), about(side * y, half), (z, z + 0.03), fillet=0.012)
        arm += box(0.016, about(side * y, 0.006), (z - travel - 0.03, z + 0.01))
        chair.add(f"arm_{number}", arm, prismatic("seat", UP, 0.0, travel, (0.0, side * y, z)), density=500.0)


def _controls(draws: Draws, chair: Assembly, low: float) -> None:
    """A lever and a knob at the plate below the seat."""
    side = draws.side("lever_side")
    reach, z = draws.length("lever_length", (0.1, 0.2)), low + 0.002
    if draws.chance("lever", 0.45):
        start, tip = np.array([-0.06, side * (0.09 + GAP), z]), np.array([-0.06, side * (0.09 + reach), z - 0.01])
        lever = cylinder(start, tip, 0.006, sections=12) + cylinder(start + 0.6 * (tip - start), tip, 0.011, 0.009, 12)
        turn = revolute("seat", (-side, 0, 0), start, 0.0, draws.angle("lever_angle", (0.1, 0.3)))
        chair.add("lever", lever, turn, density=1200.0)
    if draws.chance("knob", 0.3):
        foot = np.array([0.055, -side * (0.09 + GAP), low - 0.01])
        knob = cylinder(foot, foot - (0, side * 0.03, 0), 0.006, sections=10)
        knob += cylinder(foot - (0, side * 0.028, 0), foot - (0, side * 0.055, 0), 0.019, sections=8)
        chair.add("knob", knob, continuous("seat", SIDE, foot), density=1200.0)


def _star(draws: Draws, legs: int, span: float, floor: float, hub: float, column: float, sleeve: float) -> Solid:
    """Legs around a column with a bore for the piston, or a disc; castors below lift it to a floor above 0."""
    low = floor + (0.004 if floor > 0 else 0.012)
    bore, tall = column - 0.004 - GAP + GAP, sleeve - hub + 0.03
    solid = ring((0, 0, 0.5 * (hub - 0.03 + sleeve)), UP, bore, column + 0.002, tall, 14)
    solid += rod(0, 0, (low, hub), 1.7 * column, 1.35 * column, 20)
    if not legs:
        thick = draws.length("disc_thickness", (0.012, 0.03))
        solid += rod(0, 0, (0, thick), 0.85 * span, 0.8 * span, 36)
        return solid + rod(0, 0, (thick - 0.002, hub), 0.5 * span, 1.35 * column, 24)
    wide = 0.5 * draws.length("leg_width", (0.044, 0.06))
    narrow, slope = 0.5 * draws.length("leg_tip_width", (0.028, 0.04)), draws.number("leg_slope", (0.0, 0.7))
    root = box(0.01, wide, (low + slope * (hub - low - 0.04), hub - 0.006), fillet=0.006)
    leg = hull_of(root, box((span - 0.02, span + 0.02), narrow, (low, low + 0.022), fillet=0.006))
    if floor == 0:
        leg += rod(span, 0, (0, low + 0.01), 0.9 * narrow, sections=14)
    return solid + union(leg.turned(UP, angle) for angle in turns(legs, 0.5))


def _castors(draws: Draws, chair: Assembly, legs: int, span: float, floor: float, wheel: float) -> None:
    """A swivelling fork under every leg, with two wheels, which are parts of their own by chance."""
    rolling = draws.chance("wheel", 0.5)
    trail, gap, bore = 0.6 * wheel, 0.004, 0.2 * wheel
    fork = rod(0, 0, (floor - 0.018, floor + 0.004 - GAP), 0.011, sections=14)
    if rolling:  # both wheels sit on an axle through the fork, in a bore wider than it
        fork += box(0.011, gap, (floor - 0.024, floor - 0.012))
        fork += ring((trail, 0, wheel), SIDE, bore + GAP, 0.62 * wheel, 2 * gap, 10)
        arm = box((trail - 0.35 * wheel, trail + 0.3 * wheel), gap, (1.42 * wheel, 1.5 * wheel))
        fork += hull_of(box(0.009, gap, (floor - 0.02, floor - 0.012)), arm)
    else:
        arm = rod(trail, (-gap, gap), wheel, 0.5 * wheel, sections=14)
        fork += hull_of(box(0.009, gap, (floor - 0.02, floor - 0.01)), arm)
    near = gap + (GAP if rolling else -0.001)
    wheels = union(rod(trail, (s * near, s * (near + 0.012)), wheel, wheel, 0.93 * wheel, 14) for s in (-1.0, 1.0))
    if rolling:
        wheels += rod(trail, (-gap - 0.004, gap + 0.004), wheel, bore, sections=10)
    for k, angle in enumerate(turns(legs, 0.5)):
        pose = np.array([span * cos(angle), span * sin(angle), 0.0])
        solid = (fork if rolling else fork + wheels).turned(UP, angle).moved(pose)
        chair.add(f"caster_{k}", solid, continuous("base", UP, pose), density=1200.0)
        if rolling:
            center = np.array([trail * cos(angle), trail * sin(angle), wheel]) + pose
            turn = continuous(f"caster_{k}", (-sin(angle), cos(angle), 0.0), center)
            chair.add(f"wheel_{k}", wheels.turned(UP, angle).moved(pose), turn, density=1200.0)


def _seat(draws: Draws, depth: float, width: float, thick: float, low: float, stool: bool) -> Solid:
    """Cushion on a plate."""
    z = low + 0.03
    solid = box(0.1, 0.09, (low, z + 0.01)) + rod(0, 0, (low, z), 0.06)
    if stool and draws.chance("round_seat", 0.7):
        r = 0.5 * depth
        solid += rod(0, 0, (z, z + 0.7 * thick), r, sections=32)
        return solid + rod(0, 0, (z + 0.69 * thick, z + thick), r, 0.88 * r, 32)
    corner = draws.length("seat_corner", (0.05, 0.12))
    plan = box(0.5 * depth, 0.5 * width, (z, z + 0.65 * thick), fillet=corner, axis=2)
    return solid + hull_of(plan, box(0.47 * depth, 0.46 * width, (z, z + thick), fillet=corner, axis=2))


def _back(draws: Draws, width: float, top: float, hinge: Array) -> Solid:
    """Back rest on a spine that starts at the hinge; it may carry a head rest."""
    tall, low = draws.length("back_height", (0.35, 0.65)), top + draws.length("back_gap", (0.03, 0.1))
    half = 0.5 * width * draws.number("back_width", (0.75, 1.0))
    thick, lean = draws.length("back_thickness", (0.03, 0.06)), draws.angle("back_lean", (0.05, 0.2))
    x = hinge[0] + 0.025
    solid = rod(hinge[0], (-0.028, 0.028), hinge[2], 0.012, sections=16)
    solid += tube(np.array([[*hinge], [x + 0.02, 0, hinge[2] + 0.01], [x + 0.03, 0, low + 0.3 * tall]]), 0.016, 10)
    corner = min(half, 0.5 * tall) * draws.number("back_corner", (0.2, 0.7))
    if draws.chance("upholstered", 0.7):
        outer = box((x, x + thick), half, (low, low + tall), fillet=corner, axis=0, steps=4)
        inner = box((x - 0.012, -0.85 * half, low + 0.06 * tall), (x + thick, 0.85 * half, low + 0.94 * tall),
                            fillet=corner, axis=0, steps=4)  # fmt: skip
        panel = hull_of(outer, inner)
    else:  # a frame with slats
        panel = frame((x, -half, low), (x + 0.025, half, low + tall), [0.03] * 4)
        slats = draws.integer("back_slats", 2, 5)
        for z in low + tall * (np.arange(slats) + 1) / (slats + 1):
            panel += box((x + 0.004, x + 0.02), half - 0.01, (z - 0.02, z + 0.02))
        panel += box((x + 0.006, x + 0.024), 0.03, (low + 0.01, low + tall - 0.01))
    if draws.chance("headrest", 0.25):
        z = low + tall
        panel += box((x + 0.008, x + 0.022), 0.02, (z - 0.03, z + 0.06))
        panel += box((x - 0.01, x + 0.04), 0.5 * half, (z + 0.03, z + 0.16), fillet=0.02)
    # The head end leans back; the bottom stays over the spine.
    return solid + panel.turned(SIDE, lean, (x + 0.02, 0, low))


def _arms(draws: Draws, depth: float, width: float, low: float, top: float) -> Solid:
    """Two arm rests: posts from under the seat with pads, or closed loops."""
    z = top + draws.length("armrest_height", (0.14, 0.22))
    y = 0.5 * width + 0.035
    pad = box((-0.3 * depth, 0.25 * depth), (y - 0.03, y + 0.03), (z - 0.015, z + 0.015), fillet=0.012)
    foot = (0.0, 0.3 * width, low + 0.025)
    if draws.chance("armrest_post", 0.5):
        post = tube([foot, (0, y - 0.01, low + 0.025), (0, y, low + 0.05), (0, y, z)], 0.014, 10)
    else:
        post = tube([foot, (0, y, low + 0.03), (-0.22 * depth, y, z)], 0.013, 10)
        post += tube([(0, y, low + 0.03), (0.2 * depth, y, z)], 0.013, 10)
    return (pad + post) + (pad + post).mirrored(1)
