"""Refrigerators: small ones with one door, two doors above or beside each other, French doors over drawers.

What varies: layout, hinges, freezer; handles upright or level; bins, shelves, crispers, dispenser, feet, edges, top.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from artsim.families.details import front_handle, rounded_shell, side_hinge
from artsim.making.assembly import Assembly, prismatic
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, Array, about
from artsim.making.solids import Solid, box, frame, posts, tray, union

GAP = 0.003
Front = tuple[float, float, float, float, float]
"""Side of the hinge (1: at +Y, -1: at -Y, 0: a drawer), then y and z from low to high."""


class Style:
    """What the doors of one refrigerator share; lengths in metres."""

    def __init__(self, draws: Draws) -> None:
        self.thick = draws.length("door_thickness", (0.03, 0.075), (0.008, 0.075), tails=0.15)
        self.corner = draws.one_of("edges", {"sharp": 0.003, "round": draws.length("edge_radius", (0.005, 0.025))})
        self.wall = draws.length("wall", (0.035, 0.06))  # of the body
        # How far the bins reach into the body.
        self.bins = draws.length("bin_depth", (0.06, 0.1)) if draws.chance("door_bins", 0.7) else 0.0
        self.handle = draws.pick("handle", {"bar": 0.35, "bow": 0.25, "flat": 0.2, "none": 0.2})
        self.level = draws.chance("handle_level", 0.2)  # along an edge instead of upright
        self.reach, self.radius = draws.lengths(handle_reach=(0.035, 0.06), handle_radius=(0.007, 0.013))


def build(draws: Draws) -> Assembly:
    """A refrigerator, closed at rest. The back of its doors is the plane x = 0."""
    layout = draws.pick("layout", {"single": 0.38, "stacked": 0.27, "beside": 0.17, "french": 0.18})
    small = layout == "single" and draws.chance("small", 0.65)
    broad = layout in ("beside", "french")
    width = draws.length("width", (0.78, 0.95) if broad else (0.45, 0.72))
    width = min(width, 0.6) if small else width
    usual, widest = ((0.5, 0.9), (0.5, 1.0)) if small else ((1.35, 1.9), (1.0, 1.9))
    tall = max(draws.length("height", usual, widest, tails=0.15), 1.02 * width)
    usual, widest = ((0.45, 0.6), (0.42, 0.6)) if small else ((0.5, 0.72), (0.42, 0.72))
    half, depth = 0.5 * width, draws.length("depth", usual, widest)
    foot = draws.length("foot_height", (0.015, 0.1))
    style = Style(draws)
    top, side = foot + tall, draws.side("hinge_side")
    fronts: list[Front] = []
    if layout == "single":
        fronts.append((side, -half, half, foot, top))
    elif layout == "stacked":
        below = draws.chance("freezer_below", 0.5)
        split = foot + draws.number("lower_share", (0.28, 0.42) if below else (0.6, 0.72)) * tall
        drawer = below and draws.pick("freezer", {"drawer": 0.3, "door": 0.7}) == "drawer"
        fronts += [(side, -half, half, split, top), (0 if drawer else side, -half, half, foot, split)]
    else:
        split = foot if layout == "beside" else foot + draws.number("lower_share", (0.28, 0.42)) * tall
        middle = draws.number("seam_aside", (-0.15, 0.15)) * half if layout == "beside" else 0.0
        fronts += [(1, middle, half, split, top), (-1, -half, middle, split, top)]
        drawers = draws.integer("drawers", 1, 2) if layout == "french" else 0
        fronts += [(0, -half, half, a, b) for a, b in pairwise(np.linspace(foot, split, drawers + 1))]

    fridge = Assembly("body", _body(draws, half, depth, foot, top, style, fronts, small), 120.0)
    fridge.record(handles=style.handle != "none")
    opening = draws.turn("door_angle", (85.0, 180.0))
    doors = drawers = 0
    dispenser = broad and draws.chance("dispenser", 0.5)
    for side, right, left, low, high in fronts:
        corner_low = np.array([-style.thick, right + 0.5 * GAP, low + 0.5 * GAP])
        corner_high = np.array([0.0, left - 0.5 * GAP, high - 0.5 * GAP])
        if side == 0:
            drawers += 1
            solid = _drawer(draws, corner_low, corner_high, depth, style)
            travel = draws.number("drawer_travel", (0.4, 0.6)) * depth
            slide = prismatic("body", FRONT, 0.0, travel, (0, 0, 0.5 * (low + high)))
            fridge.add(f"drawer_{drawers}", solid, slide, density=200.0)
            continue
        doors += 1
        grip_at_top = low < foot + 0.01 and not broad
        solid = _door(draws, corner_low, corner_high, style, side, grip_at_top, broad)
        if dispenser and side > 0:
            y, z = 0.5 * (right + left), low + draws.number("dispenser_place", (0.45, 0.6)) * (high - low)
            x0, x1 = -style.thick, -0.5 * style.thick
            solid += frame((x0 - 0.008, y - 0.08, z - 0.14), (x1, y + 0.08, z + 0.14), [0.014] * 4)
            keys = box((x0 - 0.014, x1), about(y, 0.05), (z + 0.08, z + 0.13), fillet=0.004)
            solid += keys.called("panel", FRONT)
        name = f"door_{doors}" if layout != "single" else "door"
        fridge.add(name, solid, side_hinge(0.0, left if side > 0 else right, opening, side > 0), density=200.0)
    return fridge


def _body(
    draws: Draws, half: float, depth: float, low: float, high: float, style: Style, fronts: Sequence[Front], small: bool
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
        across = max(right, -inner), min(left, inner)
        front = style.bins + draws.length("shelf_setback", (0.02, 0.05))
        for z in np.linspace(bottom + wall, top - wall, int(2 + (top - bottom) // 0.25))[1:-1]:
            solid += box((front, inner_back), across, (z, z + 0.008))
        if draws.chance("crisper", 0.5) and top - bottom > 0.6:
            solid += box((front + 0.01, inner_back), across, (bottom + wall - 0.002, bottom + wall + 0.12))
    if draws.chance("plinth", 0.5):
        solid += box((draws.length("plinth_setback", (0.0, 0.05)) + GAP, depth - 0.01), half - 0.01, (0.0, low + 0.01))
    else:
        solid += posts((0.06, depth - 0.06), half - 0.06, (0, low + 0.01), 0.022)
    if small and draws.chance("worktop", 0.4):  # it lies over the door
        front = -style.thick * draws.number("worktop_overhang", (0.0, 1.2))
        upright = high - 0.001, high + draws.length("worktop_thickness", (0.012, 0.03))
        solid += box((front, depth), half + 0.002, upright, fillet=0.004)
    return solid


def _front(draws: Draws, low: Array, high: Array, style: Style) -> Solid:
    return box(low, high, fillet=style.corner, axis=None if draws.chance("round_all_edges", 0.5) else 2)


def _door(draws: Draws, low: Array, high: Array, style: Style, side: float, grip_at_top: bool, broad: bool) -> Solid:
    """Door with its handle at the side away from the hinge; ``broad``: another door is beside it."""
    solid = _front(draws, low, high, style)
    wide, tall = high[1] - low[1], high[2] - low[2]
    if draws.chance("door_board", 0.2):
        solid += box(low + (-0.004, 0.09, 0.06), high - (0.006, 0.09, 0.06), fillet=0.003)
    if style.level:
        z = high[2] - 0.05 if grip_at_top else low[2] + 0.05
        start, end = (low[0], low[1] + 0.12 * wide, z), (low[0], high[1] - 0.12 * wide, z)
    else:
        y = (low[1] if side > 0 else high[1]) + side * 0.045
        length = draws.number("handle_length", (0.25, 0.85)) * tall
        bottom = low[2] + draws.number("handle_place", (0.2, 0.8)) * (tall - length)
        start, end = (low[0], y, bottom), (low[0], y, bottom + length)
    solid += front_handle(style.handle, start, end, style.reach, style.radius)
    if style.bins > 0:
        # The bins swing past the side wall, or past the bins of the other door.
        margin = style.wall + 0.008
        clear = (0.03 if broad else margin) + style.bins * style.bins / (2.0 * (wide - margin)) + 0.004
        right, left = (low[1] + clear, high[1] - margin) if side > 0 else (low[1] + margin, high[1] - clear)
        for z in np.linspace(low[2], high[2], int(2 + tall // 0.32))[:-1]:
            bottom = z + 0.085
            if bottom + 0.1 < high[2] - 0.05:
                rim = bottom + draws.length("bin_height", (0.06, 0.09))
                solid += tray((-0.002, right, bottom), (style.bins, left, rim), 0.004)
    return solid


def _drawer(draws: Draws, low: Array, high: Array, depth: float, style: Style) -> Solid:
    """Freezer drawer: a front with a tray behind it."""
    solid = _front(draws, low, high, style)
    wall = style.wall
    half = high[1] - wall - 0.012
    solid += tray((-0.003, -half, low[2] + wall + 0.008), (depth - wall - 0.02, half, high[2] - 0.08), 0.006)
    span = half * draws.number("drawer_handle_length", (0.5, 0.95))
    z = high[2] - draws.length("drawer_handle_below_top", (0.05, 0.08))
    return solid + front_handle(style.handle, (low[0], -span, z), (low[0], span, z), style.reach, style.radius)
