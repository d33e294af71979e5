"""Chairs that turn, slide or lean: office chairs, task chairs and stools on a star of legs or a disc.

What varies: legs or disc, castors (with or without wheels of their own) or glides, a piston that lifts the seat or a
fixed column, seat, back (fixed or tilting, framed or solid), head rest, arm rests (fixed or sliding up), a lever below
the seat, a knob at its side.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute
from artsim.making.outlines import SIDE, UP
from artsim.making.solids import Solid, box, cylinder, frame, hull_of, ring, rod, tube
from artsim.model.kinematics import Array

GAP = 0.0025


def build(rng: Rng) -> Assembly:
    """A chair; one sits down facing -X. At rest the seat is at its lowest and faces forward."""
    legs = pick(rng, {0: 0.15, 3: 0.07, 4: 0.18, 5: 0.5, 6: 0.1})  # none: a disc
    span = rng.uniform(0.22, 0.36)
    castors = legs > 2 and rng.random() < 0.75
    lifted = rng.random() < 0.7
    wheel = rng.uniform(0.022, 0.032)
    floor = 2.0 * wheel + 0.024 if castors else 0.0
    column = rng.uniform(0.022, 0.03)
    piston = column - 0.004 - GAP
    stool = rng.random() < 0.25
    hub = floor + rng.uniform(0.05, 0.09)
    sleeve = hub + (rng.uniform(0.1, 0.45) if stool else rng.uniform(0.08, 0.22))
    travel = 0.6 * (sleeve - hub)
    seat_low = sleeve + rng.uniform(0.05, 0.1)

    base = _star(rng, legs, span, floor, hub, column, sleeve)
    if not lifted:
        base += rod(0, 0, (hub - 0.01, seat_low - 0.002), column, sections=18)
    chair = Assembly("base", base, 1500.0)
    chair.record(legs=True)
    if castors:
        _castors(rng, chair, legs, span, floor, wheel)
    stem = rod(0, 0, (sleeve - travel - 0.03, seat_low - 0.002), piston, sections=18)
    if lifted:
        chair.add("piston", stem, prismatic("base", UP, 0.0, travel, (0, 0, sleeve)), density=4000.0)

    depth, width = (rng.uniform(0.32, 0.4),) * 2 if stool else (rng.uniform(0.42, 0.5), rng.uniform(0.42, 0.52))
    thick = rng.uniform(0.04, 0.09)
    seat = _seat(rng, depth, width, thick, seat_low, stool)
    joint = continuous("piston" if lifted else "base", UP, (0, 0, seat_low))
    back = rng.random() < (0.3 if stool else 1.0)
    tilting = back and rng.random() < 0.5
    top = seat_low + 0.03 + thick
    hinge = np.array([0.5 * depth + 0.03, 0.0, seat_low + 0.025])
    rest = _back(rng, width, top, hinge, tilting) if back else Solid()
    if back:
        seat += box((0.2 * depth, hinge[0] - (0.018 if tilting else 0.0)), 0.04, (seat_low + 0.005, seat_low + 0.045))
        if tilting:  # forks either side of the hinge
            for side in (-1, 1):
                beside = side * (0.03 + GAP), side * 0.05
                seat += box((0.2 * depth, hinge[0] + 0.012), beside, (seat_low + 0.005, seat_low + 0.045))
    arms = str(rng.choice(["none", "fixed", "sliding"], p=[1, 0, 0] if stool else [0.4, 0.4, 0.2]))
    if arms == "fixed":
        seat += _arms(rng, depth, width, seat_low, top)
    elif arms == "sliding":
        seat += _arm_sleeves(width, seat_low, top)
    chair.add("seat", seat if tilting else seat + rest, joint, density=400.0)
    if tilting:
        chair.add("back", rest, revolute("seat", (0, 1, 0), hinge, 0.0, np.deg2rad(rng.uniform(12, 28))), density=400.0)
    if arms == "sliding":
        _sliding_arms(rng, chair, depth, width, top)
    _controls(rng, chair, width, seat_low)
    return chair


def _arm_sleeves(width: float, low: float, top: float) -> Solid:
    """Upright tubes beside the seat, on beams from below it."""
    y = 0.5 * width + 0.04
    side = box(0.02, (0.08, y), (low + 0.004, low + 0.026))
    side += frame((-0.024, y - 0.014, low + 0.004), (0.024, y + 0.014, top + 0.08), [0.005] * 4, 0, 1)
    return side + side.mirrored(1)


def _sliding_arms(rng: Rng, chair: Assembly, depth: float, width: float, top: float) -> None:
    """Pads on bars that slide in their sleeves."""
    y, z = 0.5 * width + 0.04, top + 0.08 + GAP
    half, fore, aft = rng.uniform(0.025, 0.05), rng.uniform(0.2, 0.35) * depth, rng.uniform(0.15, 0.3) * depth
    travel = rng.uniform(0.04, 0.09)
    for number, side in enumerate((-1, 1)):
        arm = box((-fore, aft), (side * y - half, side * y + half), (z, z + 0.03), fillet=0.012)
        arm += box(0.016, (side * y - 0.006, side * y + 0.006), (z - travel - 0.03, z + 0.01))
        chair.add(f"arm_{number}", arm, prismatic("seat", UP, 0.0, travel, (0.0, side * y, z)), density=500.0)


def _controls(rng: Rng, chair: Assembly, width: float, low: float) -> None:
    """A lever and a knob at the plate below the seat."""
    side = float(rng.choice([-1.0, 1.0]))
    reach, z = rng.uniform(0.1, 0.2), low + 0.002
    if rng.random() < 0.45:
        start, tip = np.array([-0.06, side * (0.09 + GAP), z]), np.array([-0.06, side * (0.09 + reach), z - 0.01])
        lever = cylinder(start, tip, 0.006, sections=12)
        lever += cylinder(start + 0.6 * (tip - start), tip, 0.011, 0.009, 12)
        chair.add("lever", lever, revolute("seat", (-side, 0, 0), start, 0.0, rng.uniform(0.1, 0.3)), density=1200.0)
    if rng.random() < 0.3:
        foot = np.array([0.055, -side * (0.09 + GAP), low - 0.01])
        knob = cylinder(foot, foot - (0, side * 0.03, 0), 0.006, sections=10)
        knob += cylinder(foot - (0, side * 0.028, 0), foot - (0, side * 0.055, 0), 0.019, sections=8)
        chair.add("knob", knob, continuous("seat", SIDE, foot), density=1200.0)


def _star(rng: Rng, legs: int, span: float, floor: float, hub: float, column: float, sleeve: float) -> Solid:
    """Legs around a column with a bore for the piston, or a disc; castors below lift it to a floor above 0."""
    low = floor + (0.004 if floor > 0 else 0.012)
    bore, tall = column - 0.004 - GAP + GAP, sleeve - hub + 0.03
    solid = ring((0, 0, 0.5 * (hub - 0.03 + sleeve)), UP, bore, column + 0.002, tall, 14)
    solid += rod(0, 0, (low, hub), 1.7 * column, 1.35 * column, 20)
    if not legs:
        thick = rng.uniform(0.012, 0.03)
        solid += rod(0, 0, (0, thick), 0.85 * span, 0.8 * span, 36)
        return solid + rod(0, 0, (thick - 0.002, hub), 0.5 * span, 1.35 * column, 24)
    wide, narrow = rng.uniform(0.022, 0.03), rng.uniform(0.014, 0.02)
    slope = rng.uniform(0.0, 0.7)
    for k in range(legs):
        tip_top = low + 0.022
        root = box(0.01, wide, (low + slope * (hub - low - 0.04), hub - 0.006), fillet=0.006)
        tip = box((span - 0.02, span + 0.02), narrow, (low, tip_top), fillet=0.006)
        leg = hull_of(root, tip)
        if floor == 0:
            leg += rod(span, 0, (0, low + 0.01), 0.9 * narrow, sections=14)
        solid += leg.turned(UP, 2.0 * np.pi * (k + 0.5) / legs)
    return solid


def _castors(rng: Rng, chair: Assembly, legs: int, span: float, floor: float, wheel: float) -> None:
    """A swivelling fork under every leg, with two wheels, which are parts of their own by chance."""
    rolling = rng.random() < 0.5
    trail = 0.6 * wheel
    gap, broad = 0.004, 0.012
    for k in range(legs):
        angle = 2.0 * np.pi * (k + 0.5) / legs
        x, y = span * cos(angle), span * sin(angle)
        fork = rod(0, 0, (floor - 0.018, floor + 0.004 - GAP), 0.011, sections=14)
        fork += hull_of(
            box(0.009, gap, (floor - 0.02, floor - 0.01)), rod(trail, (-gap, gap), wheel, 0.5 * wheel, sections=14)
        )
        wheels = Solid()
        clear = GAP if rolling else -0.001
        for side in (-1.0, 1.0):
            y0, y1 = side * (gap + clear), side * (gap + clear + broad)
            wheels += rod(trail, (y0, y1), wheel, wheel, 0.93 * wheel, 14)
        # Both wheels of a rolling pair sit on an axle through the fork, in a bore wider than it.
        if rolling:
            bore = 0.2 * wheel
            fork = rod(0, 0, (floor - 0.018, floor + 0.004 - GAP), 0.011, sections=14)
            fork += box(0.011, gap, (floor - 0.024, floor - 0.012))
            fork += ring((trail, 0, wheel), (0, 1, 0), bore + GAP, 0.62 * wheel, 2 * gap, 10)
            fork += hull_of(
                box(0.009, gap, (floor - 0.02, floor - 0.012)),
                box((trail - 0.35 * wheel, trail + 0.3 * wheel), gap, (1.42 * wheel, 1.5 * wheel)),
            )
            wheels += rod(trail, (-gap - 0.004, gap + 0.004), wheel, bore, sections=10)
        pose = (x, y, 0.0)
        name = f"caster_{k}"
        if not rolling:
            fork += wheels
        chair.add(name, fork.turned(UP, angle).moved(pose), continuous("base", UP, pose), density=1200.0)
        if rolling:
            axis = np.array([-sin(angle), cos(angle), 0.0])
            center = np.array([trail * cos(angle), trail * sin(angle), wheel]) + pose
            chair.add(
                f"wheel_{k}", wheels.turned(UP, angle).moved(pose), continuous(name, axis, center), density=1200.0
            )


def _seat(rng: Rng, depth: float, width: float, thick: float, low: float, stool: bool) -> Solid:
    """Cushion on a plate."""
    z = low + 0.03
    solid = box(0.1, 0.09, (low, z + 0.01)) + rod(0, 0, (low, z), 0.06)
    if stool and rng.random() < 0.7:
        r = 0.5 * depth
        solid += rod(0, 0, (z, z + 0.7 * thick), r, sections=32)
        return solid + rod(0, 0, (z + 0.69 * thick, z + thick), r, 0.88 * r, 32)
    corner = rng.uniform(0.05, 0.12)
    plan = box(0.5 * depth, 0.5 * width, (z, z + 0.65 * thick), fillet=corner, axis=2)
    a, b = 0.47 * depth, 0.46 * width
    return solid + hull_of(plan, box(a, b, (z, z + thick), fillet=corner, axis=2))


def _back(rng: Rng, width: float, top: float, hinge: Array, tilting: bool) -> Solid:
    """Back rest on a spine that starts at the hinge; it may carry a head rest."""
    tall = rng.uniform(0.35, 0.65)
    low = top + rng.uniform(0.03, 0.1)
    half = 0.5 * width * rng.uniform(0.75, 1.0)
    thick = rng.uniform(0.03, 0.06)
    lean = rng.uniform(0.05, 0.2)
    x = hinge[0] + 0.025
    spine = 0.028
    solid = rod(hinge[0], (-spine, spine), hinge[2], 0.012, sections=16)
    path = np.array([[*hinge], [x + 0.02, 0, hinge[2] + 0.01], [x + 0.03, 0, low + 0.3 * tall]])
    solid += tube(path, 0.016, 10)
    corner = min(half, 0.5 * tall) * rng.uniform(0.2, 0.7)
    if rng.random() < 0.7:
        outer = box((x, x + thick), half, (low, low + tall), fillet=corner, axis=0, steps=4)
        inner = box((x - 0.012, -0.85 * half, low + 0.06 * tall), (x + thick, 0.85 * half, low + 0.94 * tall),
                            fillet=corner, axis=0, steps=4)  # fmt: skip
        panel = hull_of(outer, inner)
    else:  # a frame with slats
        bar = 0.03
        panel = frame((x, -half, low), (x + 0.025, half, low + tall), [bar] * 4)
        slats = int(rng.integers(2, 6))
        for z in low + tall * (np.arange(slats) + 1) / (slats + 1):
            panel += box((x + 0.004, x + 0.02), half - 0.01, (z - 0.02, z + 0.02))
        panel += box((x + 0.006, x + 0.024), 0.03, (low + 0.01, low + tall - 0.01))
    if rng.random() < 0.25:
        z = low + tall
        panel += box((x + 0.008, x + 0.022), 0.02, (z - 0.03, z + 0.06))
        panel += box((x - 0.01, x + 0.04), 0.5 * half, (z + 0.03, z + 0.16), fillet=0.02)
    # The head end leans back; the bottom stays over the spine.
    panel = panel.turned((0, 1, 0), lean, (x + 0.02, 0, low))
    return solid + panel


def _arms(rng: Rng, depth: float, width: float, low: float, top: float) -> Solid:
    """Two arm rests: posts from under the seat with pads, or closed loops."""
    z = top + rng.uniform(0.14, 0.22)
    y = 0.5 * width + 0.035
    pad = box((-0.3 * depth, 0.25 * depth), (y - 0.03, y + 0.03), (z - 0.015, z + 0.015), fillet=0.012)
    foot = (0.0, 0.3 * width, low + 0.025)
    if rng.random() < 0.5:
        post = tube([foot, (0, y - 0.01, low + 0.025), (0, y, low + 0.05), (0, y, z)], 0.014, 10)
    else:
        post = tube([foot, (0, y, low + 0.03), (-0.22 * depth, y, z)], 0.013, 10)
        post += tube([(0, y, low + 0.03), (0.2 * depth, y, z)], 0.013, 10)
    arm = pad + post
    return arm + arm.mirrored(1)
