"""Wall switches: one to four rockers, toggles or dimmer knobs on a plate.

What varies: how many, what kind, side by side or above one another, square and long plates, how deep they are, screws,
bevels, how long toggles are.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import arctan, sin, tan
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, Array
from artsim.making.solids import Solid, box, deferred, frame, hull_of, rod, union

GAP = 0.0007


def build(draws: Draws) -> Assembly:
    """A switch on a wall at x = 0; its front faces -X. A switch is off, its upper half out, or
    in the middle at rest."""
    kind = draws.pick("kind", {"rocker": 0.65, "toggle": 0.25, "dimmer": 0.1})
    count = draws.pick("gangs", {1: 0.35, 2: 0.35, 3: 0.18, 4: 0.12})
    upright = kind == "rocker" and count > 1 and draws.chance("stacked", 0.2)
    depth = draws.length("depth", (0.007, 0.022), (0.006, 0.032), tails=0.15)
    height = draws.length("height", (0.065, 0.15))
    border = draws.length("border", (0.08, 0.2), of=height)
    pitches = draws.length("rocker_width", (0.022, 0.045)), draws.length("toggle_spacing", (0.036, 0.046))
    pitch = {"rocker": pitches[0], "toggle": pitches[1], "dimmer": 0.06}[kind]
    width = max(count * pitch + 2 * border, 0.06 if upright else 0.07)
    if upright:
        width, height = draws.length("width", (0.07, 0.09)), max(count * pitch + 2 * border, 0.08)
    bar = draws.length("bar_width", (0.0015, 0.006)) if kind == "rocker" else 0.0
    half = 0.5 * np.array([width, height])
    cells = _cells(np.array([border - half, half - border]), count, 1 if upright else 0, bar)

    plate = _plate(draws, width, height, depth, kind != "rocker" or border > 0.013)
    if kind == "rocker":
        half = half - 0.004
        plate += frame((-depth, *-half), (0, *half), [border - 0.004] * 4)
        plate += union(_bar(a, b, 1 if upright else 0, depth) for a, b in pairwise(cells))
    else:
        plate += box((-depth, 0), width / 2, height / 2, fillet=0.004)
    switch = Assembly("frame", density=1200.0)
    # The end of a rocker that is pressed in stays before the plate's back.
    room = 0.8 * depth - 0.0028 - 0.3 * min(0.3 * depth, 0.004)
    steepest = arctan(2.0 * room / (0.5 * (cells[0][1, 1] - cells[0][0, 1])))
    tilt = min(draws.turn("rocker_tilt", (2.0, 8.0)), steepest)
    alike = draws.fork("", draws.seed("button_seed") // 2)
    level = draws.chance("rocker_level", 0.35)  # rockers rest in the middle and tip either way
    live = draws.integer("buttons", 1, count) if draws.chance("some_fixed", 0.3) else count
    if kind == "rocker":
        bulge, marked = alike.length("rocker_bulge", (0.0005, 0.0025)), alike.chance("rocker_mark", 0.5)
    elif kind == "toggle":
        swing, bat = alike.angle("toggle_swing", (0.3, 0.5)), _toggle(alike, depth)
    else:
        knob, turn = _dimmer(alike, depth, min(0.4 * pitch, 0.35 * height)), alike.angle("knob_travel", (3.5, 5.2))
    for cell, place in zip(cells, draws.rng.permutation(count), strict=True):
        center = cell.mean(axis=0)
        if kind == "rocker":
            pivot = (-0.8 * depth, *center)
            solid = _rocker(cell, depth, tilt, bulge, marked)
            lower = -tilt if level else 0.0
            joint = revolute("frame", SIDE, pivot, lower, lower + 2 * tilt)
            if level:
                solid = solid.turned(SIDE, tilt, pivot)
        elif kind == "toggle":
            pivot = (-depth - 0.006, *center)
            low, high = center - (0.0095, 0.013), center + (0.0095, 0.013)
            plate += frame((-depth - 0.0025, *low), (-depth + 0.001, *high), [0.002, 0.002, 0.003, 0.003])
            solid = bat.moved((0, *center)).turned(SIDE, -swing, pivot)
            joint = revolute("frame", SIDE, pivot, 0.0, 2 * swing)
        else:
            solid = knob.moved((0, *center))
            joint = revolute("frame", FRONT, (-depth, *center), 0.0, turn)
        if place < live:
            switch.add_numbered("button", solid, joint)
        else:
            plate += solid.called("button", FRONT)
    switch.body = plate
    return switch


def _cells(inner: Array, count: int, axis: int, bar: float) -> Array:
    """(N, 2, 2) corners in y and z of every cell of a row."""
    edges = np.linspace(inner[0, axis], inner[1, axis], count + 1)
    cells = np.tile(inner, (count, 1, 1))
    cells[:, 0, axis], cells[:, 1, axis] = edges[:-1], edges[1:]
    cells[1:, 0, axis] += bar / 2
    cells[:-1, 1, axis] -= bar / 2
    return cells


def _bar(first: Array, second: Array, axis: int, depth: float) -> Solid:
    """The bar between two neighbouring cells."""
    low, high = first[0].copy(), first[1].copy()
    low[axis], high[axis] = first[1, axis], second[0, axis]
    low[1 - axis] -= 0.001
    high[1 - axis] += 0.001
    return box((-0.9 * depth, *low), (0, *high))


def _plate(draws: Draws, width: float, height: float, depth: float, screws: bool) -> Solid:
    """The back, a rounded rim, and screws by chance."""
    half = 0.5 * np.array([width, height])
    rim = 0.0065
    edge = draws.length("rim_depth", (0.7, 1.0), of=depth)
    solid = box((-0.0025, *(-half + 0.002)), (0, *(half - 0.002)))
    for axis in (0, 1):
        for side in (-1, 1):
            low, high = -half.copy(), half.copy()
            low[axis], high[axis] = (-half[axis], -half[axis] + rim) if side < 0 else (half[axis] - rim, half[axis])
            solid += box((-edge, *low), (0, *high), fillet=0.0025)
    if screws and draws.chance("screws", 0.5):
        z = half[1] - 0.008
        solid += union(rod((-depth - 0.0006, -0.001), 0, s * z, 0.0028, sections=14) for s in (-1, 1))
    return solid


@deferred
def _rocker(cell: Array, depth: float, tilt: float, bulge: float, marked: bool) -> Solid:
    """A plate bent in its middle: at rest its upper half stands out, and tips in when pressed."""
    x, thick = -0.8 * depth, min(0.3 * depth, 0.004)
    pivot = (x, *cell.mean(axis=0))
    half_y, half_z = 0.5 * (cell[1] - cell[0]) - GAP
    half_z = half_z - (thick + bulge) * sin(2 * tilt) - 0.0003
    ridge = box((x - thick, x + 0.3 * thick), half_y, 0.001, fillet=0.0008)
    solid = Solid()
    for side in (-1.0, 1.0):
        # Bent outward by the tilt: either half stands flush when the switch is tipped its way.
        end = box((x - thick - bulge, x + 0.2 * thick), half_y, 0.0015, fillet=0.001)
        solid += hull_of(ridge, end.moved((-0.5 * half_z * tan(tilt), 0, side * (half_z - 0.0015))))
    if marked:
        z, front = 0.7 * half_z, x - thick - bulge - 0.45 * half_z * tan(tilt)
        solid += box((front - 0.0006, x), 0.1 * half_y, (z - 0.12 * half_z, z))
    return solid.moved((0, *pivot[1:])).turned(SIDE, -tilt, pivot)


def _toggle(draws: Draws, depth: float) -> Solid:
    """A bat on a round hub, straight out."""
    x = -depth - 0.006
    wide = 0.5 * draws.length("toggle_width", (0.007, 0.012))
    length = draws.length("toggle_length", (0.012, 0.02), (0.007, 0.028), tails=0.3)
    root = box((x - 0.003, x), wide, 0.003, fillet=0.001)
    tip_half = 0.5 * draws.length("toggle_tip", (0.006, 0.0086))
    tip = box((x - length, x - length + 0.004), wide * 1.1, tip_half, fillet=0.0015)
    return rod(x, (-wide, wide), 0, 0.0045, sections=18) + hull_of(root, tip)


def _dimmer(draws: Draws, depth: float, radius: float) -> Solid:
    """A round knob with a pointer."""
    r, tall = min(radius, draws.length("knob_radius", (0.012, 0.02))), draws.length("knob_height", (0.009, 0.016))
    x = -depth - GAP
    solid = rod((x, x - tall), 0, 0, r, draws.length("knob_top_radius", (0.8, 0.98), of=r), 32)
    return solid + box((x - tall - 0.0008, x - 0.5 * tall), 0.0012, (0.2 * r, 0.75 * r))
