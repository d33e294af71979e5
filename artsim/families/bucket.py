"""Buckets and pails: a vessel with a bail on two pins.

Round or oval, tapered, straight or bulging; rims, hoops, ribs, feet and spouts, round or D-shaped bails with or without
a grip, and how far the bail swings to either side vary. At rest the bail stands upright, leans, lies or hangs down.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from artsim.common.elementary import cos, hypot, power, sin
from artsim.common.products import norm
from artsim.making.assembly import Assembly, revolute
from artsim.making.solids import Solid, box, cylinder, ring, tube, vessel
from artsim.model.kinematics import Array

SIDES = 20
"""Segments of the vessel's circle."""


def build(rng: np.random.Generator) -> Assembly:
    """A bucket whose bail swings to both sides."""
    top = rng.uniform(0.09, 0.18)
    height = top * rng.uniform(0.9, 2.9)
    wall = rng.uniform(0.0018, 0.004)
    profile = _profile(rng, top, height)
    body = vessel(profile, wall, sections=SIDES) + _rim(rng, top, height, wall, profile)
    oval = rng.uniform(0.7, 0.95) if rng.random() < 0.15 else 1.0  # narrower from front to back
    body = body.scaled((oval, 1.0, 1.0))
    rim_z = height + 0.004

    pin = rng.uniform(0.003, 0.005)
    pivot = height * (rng.uniform(0.88, 0.97) if rng.random() < 0.6 else rng.uniform(0.72, 0.88))
    wire = rng.uniform(0.0022, 0.0045)
    outer = top + 0.012  # beyond the rim
    bail_y = outer + 0.0015 + max(wire, 0.0025)
    wall_y = float(np.interp(pivot, profile[:, 1], profile[:, 0])) - 0.7 * wall
    half, boxy = rng.uniform(0.008, 0.016), rng.random() < 0.5
    for side in (-1.0, 1.0):
        body += _ear(side, (wall_y, outer, bail_y + max(wire, 0.0025) + 0.001), pivot, pin, half, boxy)
    # In every position a point of a round bail lies this far from the middle of the pins; the rim keeps within.
    reach = hypot(outer, rim_z - pivot) + 2 * wire + 0.006
    path, grip = _bail_path(rng, bail_y, max(reach, bail_y), pivot, pin)
    bail = _bail(path, grip, (bail_y, pivot), pin, wire)

    outline = profile + (0.007, 0.0)  # rims and hoops stand out
    most = _clear_swing(path, wire + 0.003, grip + 0.003, outline, pivot, rim_z)
    limits = most * np.where(rng.random(2) < 0.6, 1.0, rng.uniform(0.55, 1.0, 2))
    rest = _rest(rng, limits)
    bail = bail.turned((0, 1, 0), rest, (0, 0, pivot))
    swing = revolute("body", (0, 1, 0), (0, 0, pivot), -limits[0] - rest, limits[1] - rest)
    bucket = Assembly()
    bucket.add("body", body, density=1500.0)
    bucket.add("handle", bail, swing, density=3000.0)
    return bucket


def _rest(rng: np.random.Generator, limits: Array) -> float:
    """Angle of the bail from upright at rest: upright, leaning, or at one of its limits."""
    kind = str(rng.choice(["upright", "lean", "end"], p=[0.45, 0.2, 0.35]))
    side = int(rng.integers(2))
    if kind == "upright":
        return 0.0
    share = 1.0 if kind == "end" else rng.uniform(0.1, 0.9)
    return float((2 * side - 1) * share * limits[side])


def _clear_swing(path: Array, wire: float, grip: float, outline: Array, pivot: float, rim: float) -> float:
    """Largest angle from upright at which a bail beside the vessel still keeps clear of it.

    Parameters
    ----------
    path : (N, 3) float
        The bail's wire, upright.
    wire, grip : float
        Distance that the wire and its middle third keep.
    outline : (N, 2) float
        Radius and height of the vessel.
    """
    shares = np.linspace(0.0, 1.0, 8)[:, None]
    points = np.concatenate([a + shares * (b - a) for a, b in pairwise(path[:, 1:])])
    room = np.full(len(points), wire)
    if grip > wire:
        half = 0.36 * np.abs(points[:, 0]).max()
        points = np.concatenate([points, [(-half, points[:, 1].max()), (half, points[:, 1].max())]])
        room = np.append(np.where(np.abs(points[:-2, 0]) < half, grip, wire), [grip, grip])
    across, lift = points[:, 0], points[:, 1] - pivot
    far = lift > 0.1 * lift.max()  # the eyes hang beside the rim in any case
    for angle in np.deg2rad(np.arange(85.0, 165.0, 2.5)):
        out, z = lift * sin(angle), pivot + lift * cos(angle)
        radius = np.max([np.interp(z + d * room, outline[:, 1], outline[:, 0]) for d in (-2, -1, 0, 1, 2)], axis=0)
        beside = (z - room > rim) | (hypot(out, across) > radius + room)
        if not beside[far].all():
            return float(angle - np.deg2rad(3.0))
    return float(np.deg2rad(160.0))


def _profile(rng: np.random.Generator, top: float, height: float) -> Array:
    """Outer radius and height, from the bottom up."""
    bottom = top * rng.uniform(0.6, 0.98)
    kind = str(rng.choice(["taper", "steps", "belly", "foot"], p=[0.5, 0.2, 0.15, 0.15]))
    if kind == "steps":
        bend = rng.uniform(0.6, 0.8)
        middle = bottom + (top - bottom) * bend
        return np.array(
            [(bottom, 0.0), (0.97 * middle, bend * height), (middle, (bend + 0.03) * height), (top, height)]
        )
    if kind == "belly":
        shares = np.linspace(0.0, 1.0, 4)
        bulge = sin(np.pi * shares) * top * rng.uniform(0.02, 0.06)
        return np.column_stack([bottom + (top - bottom) * shares + bulge * (shares < 1), shares * height])
    if kind == "foot":
        return np.array([(bottom, 0.0), (0.97 * bottom, 0.1 * height), (top, height)])
    return np.array([(bottom, 0.0), (top, height)])


def _rim(rng: np.random.Generator, top: float, height: float, wall: float, profile: Array) -> Solid:
    """Rolled rim, hoops around the side, and a spout."""
    solid = ring((0, 0, height), (0, 0, 1), top - wall - 0.001, top + rng.uniform(0.002, 0.006), 0.006, SIDES)
    for share in rng.uniform(0.2, 0.8, int(rng.choice([0, 1, 2], p=[0.5, 0.35, 0.15]))):
        radius = float(np.interp(share * height, profile[:, 1], profile[:, 0]))
        slack = np.abs(np.diff(profile[:, 0])).max() * 0.06
        solid += ring(
            (0, 0, share * height), (0, 0, 1), radius - wall, radius + slack + 0.002, rng.uniform(0.006, 0.02), SIDES
        )
    if rng.random() < 0.3:
        foot = profile[0, 0]
        solid += ring((0, 0, -0.003), (0, 0, 1), foot - 0.012, foot - 0.001, 0.012, SIDES)
    return solid


def _ear(side: float, span: tuple[float, float, float], pivot: float, pin: float, half: float, boxy: bool) -> Solid:
    """Plate or boss from the wall outward, with the pin that the bail hangs on; ``span`` holds where they end in Y."""
    wall, outer, tip = (side * y for y in span)
    if boxy:
        solid = box((-half, min(wall, outer), pivot - 1.3 * half), (half, max(wall, outer), pivot + half))
    else:
        solid = cylinder((0, wall, pivot), (0, outer, pivot), 1.2 * half, 0.9 * half, 20)
    solid += cylinder((0, outer - side * 0.001, pivot), (0, tip, pivot), 0.85 * pin, sections=12)
    return solid + cylinder((0, tip, pivot), (0, tip + side * 0.002, pivot), 1.6 * pin, sections=12)


def _bail_path(rng: np.random.Generator, half: float, reach: float, pivot: float, pin: float) -> tuple[Array, float]:
    """(17, 3) or (6, 3) middle of the wire from eye to eye over the opening; and the grip's radius, 0 for none."""
    curved = rng.random() < 0.85
    height = reach * rng.uniform(1.0, 1.35)
    if curved:  # from a half circle to a rounded rectangle
        angles = np.linspace(0.0, np.pi, 17)
        cosine, sine, bend = cos(angles), sin(angles), rng.choice([0.95, rng.uniform(0.5, 0.95)])
        path = np.column_stack(
            [np.zeros(17), half * np.sign(cosine) * power(np.abs(cosine), bend), pivot + height * power(sine, bend)]
        )
    else:
        straight, flat = 0.55 * height, rng.uniform(0.4, 0.8)
        side = [(0.0, half, pivot), (0.0, half, pivot + straight), (0.0, flat * half, pivot + height)]
        path = np.array(side + [(0.0, -y, z) for _, y, z in side[::-1]])
    lift = (2.2 * pin) / norm(path[1] - path[0])
    path[0] += (path[1] - path[0]) * lift
    path[-1] += (path[-2] - path[-1]) * lift
    return path, rng.uniform(0.007, 0.013) if rng.random() < 0.6 else 0.0


def _bail(path: Array, grip: float, eye: tuple[float, float], pin: float, wire: float) -> Solid:
    """Wire along a path with an eye around either pin, at a Y and Z, and perhaps a grip in the middle."""
    half, pivot = eye
    solid = tube(path, wire, 8)
    for side_y in (-half, half):
        solid += ring((0, side_y, pivot), (0, 1, 0), 1.1 * pin, 2.0 * pin + wire, 0.004, 10)
    if grip > 0:
        z, length = path[:, 2].max(), 0.35 * half
        solid += cylinder((0, -length, z), (0, length, z), grip, sections=16)
    return solid
