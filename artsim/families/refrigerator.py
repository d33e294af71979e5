"""Refrigerators: small ones with one door, two doors above or beside each other, French doors over drawers.

What varies: layout, side of the hinges, freezer above or below, doors or drawers; handles upright or level; bins in the
doors, shelves, crispers; dispenser, feet, round edges, overhanging top.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from artsim.families.details import front_handle, rounded_shell, side_hinge
from artsim.making.assembly import Assembly, Rng, pick, prismatic
from artsim.making.outlines import about
from artsim.making.solids import Solid, box, frame, posts, tray, union
from artsim.model.kinematics import Array

GAP = 0.003
Front = tuple[int, float, float, float, float]
"""Side of the hinge (1: at +Y, -1: at -Y, 0: a drawer), then y and z from low to high."""


class Style:
    """What the doors of one refrigerator share; lengths in metres."""

    def __init__(self, rng: Rng) -> None:
        self.thick = rng.uniform(0.03, 0.075)
        self.corner = rng.choice([0.003, rng.uniform(0.005, 0.025)])  # radius of the edges
        self.wall = rng.uniform(0.035, 0.06)  # of the body
        self.bins = rng.uniform(0.06, 0.1) if rng.random() < 0.7 else 0.0  # how far the bins reach into the body
        self.handle = pick(rng, {"bar": 0.35, "bow": 0.25, "flat": 0.2, "none": 0.2})
        self.level = rng.random() < 0.2  # whether handles lie level along an edge instead of upright
        self.reach = rng.uniform(0.035, 0.06)
        self.radius = rng.uniform(0.007, 0.013)


def build(rng: Rng) -> Assembly:
    """A refrigerator, closed at rest. The back of its doors is the plane x = 0."""
    layout = pick(rng, {"single": 0.38, "stacked": 0.27, "beside": 0.17, "french": 0.18})
    small = layout == "single" and rng.random() < 0.65
    width = rng.uniform(0.78, 0.95) if layout in ("beside", "french") else rng.uniform(0.45, 0.72)
    width = min(width, 0.6) if small else width
    tall = max(rng.uniform(0.5, 0.9), 1.02 * width) if small else rng.uniform(1.35, 1.9)
    half, depth = 0.5 * width, rng.uniform(0.45, 0.6) if small else rng.uniform(0.5, 0.72)
    foot = rng.uniform(0.015, 0.1)
    style = Style(rng)
    top, side = foot + tall, int(rng.choice([-1, 1]))
    fronts: list[Front] = []
    if layout == "single":
        fronts.append((side, -half, half, foot, top))
    elif layout == "stacked":
        share = rng.uniform(0.28, 0.42) if rng.random() < 0.5 else rng.uniform(0.6, 0.72)
        split = foot + share * tall
        drawer = share < 0.5 and rng.random() < 0.3
        fronts += [(side, -half, half, split, top), (0 if drawer else side, -half, half, foot, split)]
    else:
        split = foot if layout == "beside" else foot + rng.uniform(0.28, 0.42) * tall
        middle = rng.uniform(-0.15, 0.15) * half if layout == "beside" else 0.0
        fronts += [(1, middle, half, split, top), (-1, -half, middle, split, top)]
        lower = np.linspace(foot, split, int(rng.integers(2, 4)) if layout == "french" else 1)
        fronts += [(0, -half, half, a, b) for a, b in pairwise(lower)]

    fridge = Assembly("body", _body(rng, half, depth, foot, top, style, fronts, small), 120.0)
    fridge.record(handles=style.handle != "none")
    opening = np.deg2rad(rng.uniform(90.0, 179.0))
    doors = drawers = 0
    dispenser = layout in ("beside", "french") and rng.random() < 0.5
    for side, right, left, low, high in fronts:
        corner_low = np.array([-style.thick, right + 0.5 * GAP, low + 0.5 * GAP])
        corner_high = np.array([0.0, left - 0.5 * GAP, high - 0.5 * GAP])
        if side == 0:
            drawers += 1
            solid = _drawer(rng, corner_low, corner_high, depth, style)
            travel = rng.uniform(0.4, 0.6) * depth
            slide = prismatic("body", (-1, 0, 0), 0.0, travel, (0, 0, 0.5 * (low + high)))
            fridge.add(f"drawer_{drawers}", solid, slide, density=200.0)
            continue
        doors += 1
        grip_at_top = low < foot + 0.01 and layout in ("single", "stacked")
        solid = _door(rng, corner_low, corner_high, style, side, grip_at_top, layout in ("beside", "french"))
        if dispenser and side > 0:
            y, z = 0.5 * (right + left), low + rng.uniform(0.45, 0.6) * (high - low)
            solid += frame(
                (-style.thick - 0.008, y - 0.08, z - 0.14), (0.5 * -style.thick, y + 0.08, z + 0.14), [0.014] * 4
            )
            solid += box((-style.thick - 0.014, -0.5 * style.thick), about(y, 0.05), (z + 0.08, z + 0.13), fillet=0.004)
        name = f"door_{doors}" if layout != "single" else "door"
        edge = left if side > 0 else right
        fridge.add(name, solid, side_hinge(0.0, edge, opening, side > 0), density=200.0)
    return fridge


def _body(
    rng: Rng, half: float, depth: float, low: float, high: float, style: Style, fronts: Sequence[Front], small: bool
) -> Solid:
    wall = style.wall
    solid = rounded_shell((GAP, -half, low), (depth, half, high), wall, min(style.corner, 0.9 * wall), 2)
    solid += box((depth - wall, depth - 0.001), half - 0.01, (low + 0.01, high - 0.01))
    inner_back, inner = depth - wall + 0.002, half - wall + 0.002
    solid += union(box((GAP, inner_back), inner, (z - 0.02, z + 0.02)) for z in {front[3] for front in fronts} - {low})
    beside = [f for f in fronts if f[0] == -1 and f[3] == low and f[2] < 0.9 * half]
    if beside:
        solid += box((GAP, inner_back), (beside[0][2] - 0.02, beside[0][2] + 0.02), (low + 0.01, high - 0.01))
    for side, right, left, bottom, top in fronts:
        if side == 0:
            continue
        shelf_low, shelf_high = max(right, -inner) - 0.0, min(left, inner)
        front = style.bins + rng.uniform(0.02, 0.05)
        for z in np.linspace(bottom + wall, top - wall, int(2 + (top - bottom) // 0.25))[1:-1]:
            solid += box((front, inner_back), (shelf_low, shelf_high), (z, z + 0.008))
        if rng.random() < 0.5 and side != 0 and top - bottom > 0.6:  # a crisper
            upright = (bottom + wall - 0.002, bottom + wall + 0.12)
            solid += box((front + 0.01, inner_back), (shelf_low, shelf_high), upright)
    if rng.random() < 0.5:
        solid += box((rng.uniform(0.0, 0.05) + GAP, depth - 0.01), half - 0.01, (0.0, low + 0.01))
    else:
        solid += posts((0.06, depth - 0.06), half - 0.06, (0, low + 0.01), 0.022)
    if small and rng.random() < 0.4:  # a top that lies over the door
        solid += box((-style.thick * rng.uniform(0.0, 1.2), -half - 0.002, high - 0.001),
                             (depth, half + 0.002, high + rng.uniform(0.012, 0.03)), fillet=0.004)  # fmt: skip
    return solid


def _door(rng: Rng, low: Array, high: Array, style: Style, side: int, grip_at_top: bool, inner_edge: bool) -> Solid:
    """Door with its handle at the side away from the hinge."""
    solid = box(low, high, fillet=style.corner, axis=None if rng.random() < 0.5 else 2)
    wide, tall = high[1] - low[1], high[2] - low[2]
    if rng.random() < 0.2:  # a raised board
        solid += box(low + (-0.004, 0.09, 0.06), high - (0.006, 0.09, 0.06), fillet=0.003)
    free = low[1] if side > 0 else high[1]
    if style.level:
        z = high[2] - 0.05 if grip_at_top else low[2] + 0.05
        start, end = (low[0], low[1] + 0.12 * wide, z), (low[0], high[1] - 0.12 * wide, z)
    else:
        y = free + side * 0.045
        length = rng.uniform(0.25, 0.85) * tall
        bottom = low[2] + rng.uniform(0.2, 0.8) * (tall - length)
        start, end = (low[0], y, bottom), (low[0], y, bottom + length)
    solid += front_handle(style.handle, start, end, style.reach, style.radius)
    if style.bins > 0:
        # The bins swing past the side wall, or past the bins of the other door.
        margin = style.wall + 0.008
        clear = (0.03 if inner_edge else margin) + style.bins * style.bins / (2.0 * (wide - margin)) + 0.004
        right, left = (low[1] + clear, high[1] - margin) if side > 0 else (low[1] + margin, high[1] - clear)
        for z in np.linspace(low[2], high[2], int(2 + tall // 0.32))[:-1]:
            bottom = z + 0.085
            if bottom + 0.1 < high[2] - 0.05:
                solid += tray((-0.002, right, bottom), (style.bins, left, bottom + rng.uniform(0.06, 0.09)), 0.004)
    return solid


def _drawer(rng: Rng, low: Array, high: Array, depth: float, style: Style) -> Solid:
    """Freezer drawer: a front with a tray behind it."""
    solid = box(low, high, fillet=style.corner, axis=None if rng.random() < 0.5 else 2)
    half = high[1] - style.wall - 0.012
    solid += tray(
        (-0.003, -half, low[2] + style.wall + 0.008), (depth - style.wall - 0.02, half, high[2] - 0.08), 0.006
    )
    span, z = half * rng.uniform(0.5, 0.95), high[2] - rng.uniform(0.05, 0.08)
    return solid + front_handle(style.handle, (low[0], -span, z), (low[0], span, z), style.reach, style.radius)
