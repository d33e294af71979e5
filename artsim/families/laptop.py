"""Laptops: a base with keyboard and touchpad, and a lid with a screen on a hinge at the back."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from artsim.assembly import Assembly, revolute
from artsim.solids import Solid, box, cylinder, rounded_box, union


def build(rng: np.random.Generator) -> Assembly:
    """A laptop, closed at rest. The lid opens about the Y axis at the back."""
    width = rng.uniform(0.26, 0.42)
    depth = width * rng.uniform(0.6, 0.78)
    base_height = width * rng.uniform(0.025, 0.075)
    lid_height = max(width * rng.uniform(0.015, 0.045), 0.004)
    gap = 0.0008
    corner = depth * rng.uniform(0.01, 0.08)
    hinge_radius = rng.uniform(0.35, 0.5) * min(base_height, lid_height)
    hinge_x = depth / 2 + hinge_radius * rng.uniform(-0.2, 1.1)
    # The lid turns about a barrel between the two shells, in notches behind both.
    hinge_z = base_height + 0.5 * gap
    clear = hinge_radius + 0.0015
    back = min(depth / 2, hinge_x - clear)

    base = _base(rng, width, depth, base_height, corner, back)
    lid = rounded_box(
        (-depth / 2, -width / 2, base_height + gap), (back, width / 2, base_height + gap + lid_height), corner, axis=2
    )
    lid += _screen(rng, width, back, depth, base_height + gap, lid_height)
    lid += _hinges(rng, width, back, hinge_x, hinge_z, hinge_radius, lid_height)

    laptop = Assembly()
    laptop.add("base", base, density=1400.0)
    opening = np.deg2rad(rng.uniform(100.0, 178.0 if rng.random() < 0.7 else 135.0))
    laptop.add("lid", lid, revolute("base", (0, 1, 0), (hinge_x, 0, hinge_z), 0.0, opening), density=1400.0)
    return laptop


def _base(rng: np.random.Generator, width: float, depth: float, height: float, corner: float, back: float) -> Solid:
    """The lower shell: keys and touchpad lie in a sunken deck, so that the lid can close on the rim."""
    sink = min(0.0015, 0.2 * height)
    deck = height - sink
    rim = width * rng.uniform(0.01, 0.03)
    solid = rounded_box((-depth / 2, -width / 2, 0), (back, width / 2, deck), corner, axis=2)
    for y in (-width / 2, width / 2 - rim):
        solid += box((-depth / 2 + corner, y, deck), (back - corner, y + rim, height))
    key_depth = 0.5 * depth / 5 * rng.uniform(0.75, 1.0)
    rows = 5
    row_pitch = key_depth * rng.uniform(1.08, 1.2)
    half = width / 2 - rim - width * rng.uniform(0.01, 0.06)
    keys_back = back - depth * rng.uniform(0.06, 0.12)
    for row in range(rows):
        count = int(rng.integers(9, 14))
        edges = np.linspace(-half, half, count + 1)
        if row == rows - 1:  # the row with the space bar
            edges = np.array([-half, -0.75 * half, -0.45 * half, 0.4 * half, 0.7 * half, half])
        x = keys_back - row * row_pitch
        slit = 0.06 * key_depth
        for left, right in pairwise(edges):
            solid += box((x - key_depth, left + slit, deck - 0.001), (x, right - slit, height - 0.0003))
    pad_front, pad_back = -depth / 2 + depth * 0.04, keys_back - rows * row_pitch - depth * 0.03
    if pad_back - pad_front > 0.03:
        half_pad = width * rng.uniform(0.1, 0.2)
        solid += box((pad_front, -half_pad, deck - 0.001), (pad_back, half_pad, deck + 0.3 * sink))
    if rng.random() < 0.7:
        foot = 0.02 * width
        solid += union(
            cylinder((x, y, -0.5 * foot * 0.3), (x, y, 0.001), foot)
            for x in (-depth / 2 + 2.5 * foot, back - 2.5 * foot)
            for y in (-width / 2 + 2.5 * foot, width / 2 - 2.5 * foot)
        )
    return solid


def _screen(rng: np.random.Generator, width: float, back: float, depth: float, low: float, lid_height: float) -> Solid:
    """Details of the lid: a badge or ribs on its back; the panel itself is flush with the lid's inside."""
    solid = Solid()
    top = low + lid_height
    if rng.random() < 0.5:
        radius = width * rng.uniform(0.03, 0.07)
        x = rng.uniform(-0.1, 0.1) * depth
        solid += cylinder((x, 0, top - 0.001), (x, 0, top + 0.0006), radius)
    elif rng.random() < 0.4:
        rib = width * rng.uniform(0.01, 0.03)
        for y in (-0.3 * width, 0.3 * width):
            solid += box((-0.4 * depth, y - rib, top - 0.001), (back - 0.1 * depth, y + rib, top + 0.0015))
    return solid


def _hinges(
    rng: np.random.Generator, width: float, back: float, hinge_x: float, hinge_z: float, radius: float, lid: float
) -> Solid:
    """Barrels on the hinge axis, joined to the lid by short arms above the gap."""
    spans = [(-0.42, -0.28), (0.28, 0.42)] if rng.random() < 0.7 else [(-0.4, 0.4)]
    solid = Solid()
    for first, last in spans:
        solid += cylinder((hinge_x, first * width, hinge_z), (hinge_x, last * width, hinge_z), radius, sections=16)
        arm_low = hinge_z + 0.0004
        solid += box((back - 0.004, first * width, arm_low), (hinge_x, last * width, arm_low + min(0.8 * lid, radius)))
    return solid
