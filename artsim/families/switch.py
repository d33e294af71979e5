"""Wall switches: one to four rockers, toggles or dimmer knobs on a plate.

What varies: how many, what kind, side by side or above one another, square and long plates, how deep they are, screws,
bevels, how long toggles are.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import arctan, sin, tan
from artsim.families.proportions import with_tails
from artsim.making.assembly import Assembly, Rng, pick, revolute
from artsim.making.solids import Solid, box, frame, hull_of, rod, union
from artsim.model.kinematics import Array

GAP = 0.0007


def build(rng: Rng) -> Assembly:
    """A switch on a wall at x = 0; its front faces -X. A switch is off, its upper half out, or
    in the middle at rest."""
    kind = pick(rng, {"rocker": 0.65, "toggle": 0.25, "dimmer": 0.1})
    count = pick(rng, {1: 0.35, 2: 0.35, 3: 0.18, 4: 0.12})
    upright = kind == "rocker" and count > 1 and rng.random() < 0.2
    depth = with_tails(rng, (0.007, 0.022), (0.006, 0.032), 0.15)
    height = rng.uniform(0.065, 0.15)
    border = height * rng.uniform(0.08, 0.2)
    pitch = {"rocker": rng.uniform(0.022, 0.045), "toggle": rng.uniform(0.036, 0.046), "dimmer": 0.06}[kind]
    width = max(count * pitch + 2 * border, 0.06 if upright else 0.07)
    if upright:
        width, height = rng.uniform(0.07, 0.09), max(count * pitch + 2 * border, 0.08)
    bar = rng.uniform(0.0015, 0.006) if kind == "rocker" else 0.0
    inner = np.array([[-width / 2 + border, -height / 2 + border], [width / 2 - border, height / 2 - border]])
    cells = _cells(inner, count, 1 if upright else 0, bar)

    plate = _plate(rng, width, height, depth, kind != "rocker" or border > 0.013)
    if kind == "rocker":
        half = 0.5 * np.array([width, height]) - 0.004
        plate += frame((-depth, *-half), (0, *half), [border - 0.004] * 4)
        plate += union(_bar(a, b, 1 if upright else 0, depth) for a, b in pairwise(cells))
    else:
        plate += box((-depth, 0), width / 2, height / 2, fillet=0.004)
    switch = Assembly("frame", density=1200.0)
    # The end of a rocker that is pressed in stays before the plate's back.
    room = 0.8 * depth - 0.0028 - 0.3 * min(0.3 * depth, 0.004)
    steepest = arctan(2.0 * room / (0.5 * (cells[0][1, 1] - cells[0][0, 1])))
    tilt, style = min(np.deg2rad(rng.uniform(2.0, 8.0)), steepest), int(rng.integers(1 << 30))
    level = rng.random() < 0.35  # rockers rest in the middle and tip either way
    live = int(rng.integers(1, count + 1)) if rng.random() < 0.3 else count  # how many move; the others are set
    order = rng.permutation(count)
    for cell, place in zip(cells, order, strict=True):
        center = cell.mean(axis=0)
        alike = np.random.default_rng(style)
        if kind == "rocker":
            solid = _rocker(alike, cell, depth, tilt)
            lower = -tilt if level else 0.0
            if level:
                solid = solid.turned((0, 1, 0), tilt, (-0.8 * depth, *center))
            joint = revolute("frame", (0, 1, 0), (-0.8 * depth, *center), lower, lower + 2 * tilt)
        elif kind == "toggle":
            low, high = center - (0.0095, 0.013), center + (0.0095, 0.013)
            plate += frame((-depth - 0.0025, *low), (-depth + 0.001, *high), [0.002, 0.002, 0.003, 0.003])
            swing = alike.uniform(0.3, 0.5)
            solid = _toggle(alike, center, depth).turned((0, 1, 0), -swing, (-depth - 0.006, *center))
            joint = revolute("frame", (0, 1, 0), (-depth - 0.006, *center), 0.0, 2 * swing)
        else:
            solid = _dimmer(alike, center, depth, min(0.4 * pitch, 0.35 * height))
            joint = revolute("frame", (-1, 0, 0), (-depth, *center), 0.0, alike.uniform(3.5, 5.2))
        if place < live:
            switch.add_numbered("button", solid, joint)
        else:
            plate += solid
    switch.body = plate
    return switch


def _cells(inner: Array, count: int, axis: int, bar: float) -> list[Array]:
    """(2, 2) corners in y and z of every cell of a row."""
    edges = np.linspace(inner[0, axis], inner[1, axis], count + 1)
    cells = []
    for k in range(count):
        cell = inner.copy()
        cell[0, axis] = edges[k] + (bar / 2 if k else 0.0)
        cell[1, axis] = edges[k + 1] - (bar / 2 if k < count - 1 else 0.0)
        cells.append(cell)
    return cells


def _bar(first: Array, second: Array, axis: int, depth: float) -> Solid:
    """The bar between two neighbouring cells."""
    low, high = first[0].copy(), first[1].copy()
    low[axis], high[axis] = first[1, axis], second[0, axis]
    low[1 - axis] -= 0.001
    high[1 - axis] += 0.001
    return box((-0.9 * depth, *low), (0, *high))


def _plate(rng: Rng, width: float, height: float, depth: float, screws: bool) -> Solid:
    """The back, a rounded rim, and screws by chance."""
    half = 0.5 * np.array([width, height])
    rim = 0.0065
    edge = depth * rng.uniform(0.7, 1.0)
    solid = box((-0.0025, *(-half + 0.002)), (0, *(half - 0.002)))
    for axis in (0, 1):
        for side in (-1, 1):
            low, high = -half.copy(), half.copy()
            low[axis], high[axis] = (-half[axis], -half[axis] + rim) if side < 0 else (half[axis] - rim, half[axis])
            solid += box((-edge, *low), (0, *high), fillet=0.0025)
    if screws and rng.random() < 0.5:
        z = half[1] - 0.008
        solid += union(rod((-depth - 0.0006, -0.001), 0, s * z, 0.0028, sections=14) for s in (-1, 1))
    return solid


def _rocker(rng: Rng, cell: Array, depth: float, tilt: float) -> Solid:
    """A plate bent in its middle: at rest its upper half stands out, and tips in when pressed."""
    low, high = cell
    x, center = -0.8 * depth, cell.mean(axis=0)
    half_y = 0.5 * (high[0] - low[0]) - GAP
    thick = min(0.3 * depth, 0.004)
    proud = rng.uniform(0.0005, 0.0025)
    half_z = 0.5 * (high[1] - low[1]) - GAP - (thick + proud) * sin(2 * tilt) - 0.0003
    ridge = box((x - thick, x + 0.3 * thick), half_y, 0.001, fillet=0.0008)
    solid = Solid()
    for side in (-1.0, 1.0):
        # Bent outward by the tilt: either half stands flush when the switch is tipped its way.
        end = box((x - thick - proud, x + 0.2 * thick), half_y, 0.0015, fillet=0.001)
        solid += hull_of(ridge, end.moved((-0.5 * half_z * tan(tilt), 0, side * (half_z - 0.0015))))
    if rng.random() < 0.5:
        mark = 0.12 * half_z
        z, w = 0.7 * half_z, 0.1 * half_y
        front = x - thick - proud - 0.45 * half_z * tan(tilt)
        solid += box((front - 0.0006, x), w, (z - mark, z))
    return solid.moved((0, *center)).turned((0, 1, 0), -tilt, (x, *center))


def _toggle(rng: Rng, center: Array, depth: float) -> Solid:
    """A bat on a round hub, straight out."""
    x = -depth - 0.006
    wide, r = rng.uniform(0.0035, 0.006), 0.0045
    length = with_tails(rng, (0.012, 0.02), (0.007, 0.028), 0.3)
    hub = rod(x, (-wide, wide), 0, r, sections=18)
    root = box((x - 0.003, x), wide, 0.003, fillet=0.001)
    tip_half = rng.uniform(0.003, 0.0043)
    tip = box((x - length, x - length + 0.004), wide * 1.1, tip_half, fillet=0.0015)
    return (hub + hull_of(root, tip)).moved((0, *center))


def _dimmer(rng: Rng, center: Array, depth: float, radius: float) -> Solid:
    """A round knob with a pointer."""
    r, tall = min(radius, rng.uniform(0.012, 0.02)), rng.uniform(0.009, 0.016)
    x = -depth - GAP
    solid = rod((x, x - tall), 0, 0, r, rng.uniform(0.8, 0.98) * r, 32)
    solid += box((x - tall - 0.0008, x - 0.5 * tall), 0.0012, (0.2 * r, 0.75 * r))
    return solid.moved((0, *center))
