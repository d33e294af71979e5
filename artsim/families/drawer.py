"""Cabinets with a grid of 1 to 6 drawers: chests, desks' pedestals, tables with drawers."""

from __future__ import annotations

import numpy as np

from artsim.assembly import Assembly, JointSpec, prismatic
from artsim.families.details import bar_handle, bow_handle, knob
from artsim.kinematics import Array
from artsim.solids import Solid, box, cylinder, frame, rounded_box, tray, union

GAP = 0.002


def build(rng: np.random.Generator) -> Assembly:
    """A body with drawers that slide out towards -X, closed at rest."""
    columns = int(rng.choice([1, 2, 3], p=[0.65, 0.25, 0.1]))
    rows = int(rng.integers(1, max(2, 6 // columns) + 1))
    on_legs = rng.random() < 0.4
    width = columns * rng.uniform(0.28, 0.6)
    depth = rng.uniform(0.3, 0.65)
    height = rows * rng.uniform(0.1, 0.26)
    wall = rng.uniform(0.012, 0.03)
    legs = rng.uniform(0.08, 0.55) if on_legs else rng.uniform(0.0, 0.08)
    bottom, top = legs, legs + height

    edges_y = np.linspace(-width / 2 + wall, width / 2 - wall, columns + 1)
    edges_z = np.linspace(bottom + wall, top - wall, rows + 1)
    if rows > 1 and rng.random() < 0.5:  # rows of different heights
        inner = (
            np.sort(rng.uniform(0.25, 0.75, rows - 1)) if rows == 2 else np.cumsum(rng.dirichlet([12.0] * rows))[:-1]
        )
        edges_z[1:-1] = edges_z[0] + inner * (edges_z[-1] - edges_z[0])

    cabinet = Assembly()
    cabinet.add("body", _body(rng, width, depth, bottom, top, wall, edges_y, edges_z, on_legs), density=650.0)
    overlay = rng.random() < 0.5  # fronts lie before the body, or within it
    style = _handle_style(rng)
    travel = depth * rng.uniform(0.5, 0.85)
    number = 0
    for row in range(rows - 1, -1, -1):
        for column in range(columns):
            low = np.array([-depth / 2, edges_y[column] + wall / 4, edges_z[row] + wall / 4])
            high = np.array([depth / 2 - wall, edges_y[column + 1] - wall / 4, edges_z[row + 1] - wall / 4])
            drawer = _drawer(rng, low + GAP, high - GAP, 0.018, wall, overlay, style)
            cabinet.add(f"drawer_{number}", drawer, _slide(low, high, travel))
            number += 1
    return cabinet


def _slide(low: Array, high: Array, travel: float) -> JointSpec:
    center = 0.5 * (low + high)
    return prismatic("body", (-1, 0, 0), 0.0, travel, (low[0], center[1], center[2]))


def _body(
    rng: np.random.Generator,
    width: float,
    depth: float,
    bottom: float,
    top: float,
    wall: float,
    edges_y: Array,
    edges_z: Array,
    on_legs: bool,
) -> Solid:
    x0, x1, y = -depth / 2, depth / 2, width / 2
    solid = tray((x0, -y, bottom), (x1, y, top), wall, wall / 2, axis=0, side=-1)
    thin = wall / 4
    for z in edges_z[1:-1]:
        solid += box((x0, -y + wall, z - thin), (x1 - wall / 2, y - wall, z + thin))
    for edge in edges_y[1:-1]:
        solid += box((x0, edge - thin, bottom + wall), (x1 - wall / 2, edge + thin, top - wall))
    if rng.random() < 0.5:  # a top that stands over
        over = rng.uniform(0.005, 0.04)
        solid += box((x0 - over, -y - over, top), (x1, y + over, top + rng.uniform(0.01, 0.035)))
    if bottom > 0.005:
        solid += _feet(rng, x0, x1, y, bottom, wall, on_legs)
    return solid


def _feet(rng: np.random.Generator, x0: float, x1: float, y: float, height: float, wall: float, on_legs: bool) -> Solid:
    if not on_legs:
        recess = rng.uniform(0.0, 0.05)
        return frame((x0 + recess, -y + 0.01, 0), (x1 - 0.01, y - 0.01, height), [wall] * 4, 0, 1)
    radius = rng.uniform(0.012, 0.03)
    taper = rng.uniform(0.5, 1.0)
    corners = [(x, s * (y - radius)) for x in (x0 + radius, x1 - radius) for s in (-1, 1)]
    if rng.random() < 0.5:
        return union(cylinder((x, w, 0), (x, w, height), radius * taper, radius, 16) for x, w in corners)
    return union(box((x - radius, w - radius, 0), (x + radius, w + radius, height)) for x, w in corners)


def _handle_style(rng: np.random.Generator) -> dict[str, float | str]:
    """One style for all drawers of a cabinet."""
    kind = str(rng.choice(["bar", "knob", "bow", "none"], p=[0.35, 0.35, 0.2, 0.1]))
    return {
        "kind": kind,
        "size": rng.uniform(0.2, 0.6),
        "reach": rng.uniform(0.018, 0.04),
        "rise": rng.uniform(-0.2, 0.3),
    }


def _drawer(
    rng: np.random.Generator,
    low: Array,
    high: Array,
    front: float,
    wall: float,
    overlay: bool,
    style: dict[str, float | str],
) -> Solid:
    """Box open at the top behind a front panel with a handle."""
    face = low[0] - front - GAP if overlay else low[0]
    spread = wall / 4 if overlay else 0.0
    panel_low = np.array([face, low[1] - spread, low[2] - spread])
    panel_high = np.array([face + front, high[1] + spread, high[2] + spread])
    solid = rounded_box(panel_low, panel_high, 0.004)
    side_top = high[2] - 0.15 * (high[2] - low[2])
    solid += tray((face + front - 0.001, low[1] + 0.004, low[2]), (high[0], high[1] - 0.004, side_top), 0.010)
    return solid + _handle(style, panel_low, panel_high)


def _handle(style: dict[str, float | str], low: Array, high: Array) -> Solid:
    kind, size, reach = str(style["kind"]), float(style["size"]), float(style["reach"])
    width, height = high[1] - low[1], high[2] - low[2]
    x, y = low[0], 0.5 * (low[1] + high[1])
    z = 0.5 * (low[2] + high[2]) + float(style["rise"]) * height
    half = 0.5 * min(size * width, 0.3)
    radius = min(0.006, 0.08 * height)
    left, right, outward = (x, y - half, z), (x, y + half, z), (-1.0, 0.0, 0.0)
    if kind == "bar":
        return bar_handle(left, right, outward, reach, radius)
    if kind == "knob":
        return knob((x, y, z), outward, reach, min(0.018, 0.2 * height))
    if kind == "bow":
        return bow_handle(left, right, outward, reach, radius)
    return Solid()
