"""Laptops: a base with keyboard and touchpad, and a lid with a screen on a hinge at the back.

What varies: proportions, thickness (from tablets with a keyboard to thick old ones), round or bevelled shells, a base
that is shorter than the lid or reaches behind the hinge, one long hinge or two short ones, keyboard with or without
number block, touchpad and its buttons, the screen's frame, badges, feet, how far the lid opens.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import tan
from artsim.making.assembly import Assembly, Rng, pick, revolute
from artsim.making.solids import Solid, box, frame, hull_of, posts, rod

GAP = 0.0008


class _Shape:
    """Main measures. The lid reaches from x = ``front`` to ``back``; the base starts at ``base_front``."""

    def __init__(self, rng: Rng) -> None:
        self.width = width = rng.uniform(0.18, 0.48)
        if rng.random() < 0.4:
            self.depth = width * rng.triangular(0.54, 0.67, 0.9)
            self.height = max(width * rng.triangular(0.012, 0.035, 0.11), 0.006)  # of the base
            self.lid = max(width * rng.triangular(0.01, 0.018, 0.055), 0.004)  # height of the lid
        elif rng.random() < 0.16:  # as thin as tablets
            self.depth = width * rng.uniform(0.42, 1.12)
            self.height = max(width * rng.uniform(0.009, 0.025), 0.004)
            self.lid = max(width * rng.uniform(0.007, 0.018), 0.0028)
        else:  # netbooks, tablets with a keyboard, thick old ones, square and very wide ones
            self.depth = width * rng.uniform(0.42, 1.12)
            self.height = max(width * rng.uniform(0.01, 0.15), 0.006)
            self.lid = max(width * rng.uniform(0.008, 0.08), 0.004)
        # The lid turns about a barrel between the two shells, in notches behind both.
        self.hinge_radius = rng.uniform(0.2, 0.45) * min(self.height, self.lid, 0.009)
        self.hinge_x = self.depth / 2 + self.hinge_radius * rng.uniform(-0.4, 0.9)
        self.back = min(self.depth / 2, self.hinge_x - self.hinge_radius - 0.0008)
        self.front = self.base_front = -self.depth / 2
        self.tilt, odd = 0.0, rng.random()  # of the base, its front lower, radians
        if odd < 0.1:  # a flat keyboard dock, propped up by a thick bar at the back
            self.height, self.tilt = max(width * rng.uniform(0.012, 0.03), 0.005), rng.uniform(0.03, 0.2)
            self.base_front += rng.uniform(0.05, 0.22) * self.depth
        elif odd < 0.16:
            self.base_front += rng.uniform(0.01, 0.2) * self.depth
        elif odd < 0.3:
            self.front += rng.uniform(0.005, 0.06) * self.depth
        self.corner = self.depth * rng.choice([rng.uniform(0.005, 0.03), rng.uniform(0.03, 0.13)])
        self.hinge_z = self.height + 0.5 * GAP


def build(rng: Rng) -> Assembly:
    """A laptop, closed at rest. The lid opens about the Y axis at the back."""
    shape = _Shape(rng)
    laptop = Assembly("base", _propped(rng, shape) if shape.tilt else _base(rng, shape), 1400.0)
    opening = np.deg2rad(rng.uniform(88.0, 180.0) if rng.random() < 0.9 else rng.uniform(42.0, 88.0))
    hinge = (shape.hinge_x, 0, shape.hinge_z)
    lid = _lid(rng, shape) + _hinges(rng, shape)
    laptop.add("lid", lid, revolute("base", (0, 1, 0), hinge, 0.0, opening))
    return laptop


def _shell(rng: Rng, low: tuple[float, ...], high: tuple[float, ...], corner: float, side: int) -> Solid:
    """Plate whose upper (side 1) or lower (-1) edges are bevelled or, seen from the side, wedge-shaped."""
    plate = box(low, high, fillet=corner, axis=2)
    kind = pick(rng, {"plain": 0.45, "bevel": 0.4, "wedge": 0.15})
    if kind == "plain":
        return plate
    z0, z1 = low[2], high[2]
    thick = z1 - z0
    seam = thick * rng.uniform(0.3, 0.7)
    outer = (z0, z0 + seam) if side > 0 else (z1 - seam, z1)
    inner = (z1 - 0.001, z1) if side > 0 else (z0, z0 + 0.001)
    bevel = rng.uniform(0.3, 2.0) * thick if kind == "bevel" else 0.1 * thick
    recess = bevel if kind == "bevel" else rng.uniform(0.1, 0.5) * (high[0] - low[0])
    return hull_of(
        box((*low[:2], outer[0]), (*high[:2], outer[1]), fillet=corner, axis=2),
        box(
            (low[0] + recess, low[1] + bevel, inner[0]), (high[0] - min(bevel, 0.005), high[1] - bevel, inner[1]),
            fillet=corner, axis=2,
        ),
    )  # fmt: skip


def _base(rng: Rng, shape: _Shape) -> Solid:
    """The lower shell: keys and touchpad lie in a sunken deck, so that the lid can close on the rim."""
    width, height, front, back = shape.width, shape.height, shape.base_front, shape.back
    sink = min(0.0015, 0.2 * height)
    deck = height - sink
    rim = width * rng.uniform(0.01, 0.03)
    solid = _shell(rng, (front, -width / 2, 0), (back, width / 2, deck), shape.corner, -1)
    for y in (-width / 2, width / 2 - rim):
        solid += box((front + shape.corner, back - shape.corner), (y, y + rim), (deck - 0.001, height))
    solid += _keyboard(rng, shape, deck, rim)
    # Behind the hinge the base is low enough for the lid to swing past it.
    room = shape.hinge_z - max(shape.hinge_radius, shape.lid + GAP) - 0.0015
    if room > 0.004 and rng.random() < 0.6:
        reach = shape.hinge_x + rng.uniform(0.0, 0.07 if rng.random() < 0.6 else 0.2) * shape.depth
        half = width / 2 - rng.choice([0.0, rng.uniform(0.0, 0.2) * width]) - 0.5 * shape.corner
        solid += box((back - 0.02, reach), half, (0.15 * room, room), fillet=0.3 * room)
    if rng.random() < 0.7:
        foot = 0.02 * width
        across = (front + 3.5 * foot, back - 2.5 * foot)
        solid += posts(across, width / 2 - 3.5 * foot, (-0.15 * foot, 0.5 * height), foot, sections=16)
    if rng.random() < 0.15:  # a catch or a lip at the front
        half, reach = rng.uniform(0.03, 0.2) * width, rng.uniform(0.002, 0.012)
        solid += box((front - reach, front + 0.2 * shape.depth), half, (0.3 * deck, 0.8 * deck))
    return solid


def _propped(rng: Rng, shape: _Shape) -> Solid:
    """A tilted plate with the keyboard, held up by a bar below its back edge."""
    half, height, back = shape.width / 2, shape.height, shape.back
    deck = height - 0.0015
    plate = box((shape.base_front, back), half, (0, deck), fillet=shape.corner, axis=2)
    plate += _keyboard(rng, shape, deck, 0.01 * shape.width)
    drop = tan(shape.tilt) * (back - shape.base_front) + height
    radius = 0.5 * drop * rng.uniform(0.7, 1.1)
    x, z = back - radius, height - 0.0015 - radius
    end = half - rng.uniform(0.0, 0.1) * shape.width
    return plate.turned((0, 1, 0), -shape.tilt, (back, 0, height)) + rod(x, (-end, end), z, radius)


def _keyboard(rng: Rng, shape: _Shape, deck: float, rim: float) -> Solid:
    """Five or six rows of keys, a touchpad before them where there is room, its buttons."""
    top = shape.height - 0.0003
    length = shape.back - shape.base_front
    rows = int(rng.integers(5, 7))
    pitch = 0.55 * length / rows * rng.uniform(0.75, 1.05)
    half = shape.width / 2 - rim - shape.width * rng.uniform(0.005, 0.06)
    keys_back = shape.back - length * rng.uniform(0.05, 0.14)
    slit = 0.05 * pitch
    blocks = [(-half, half)]
    if shape.width > 0.36 and rng.random() < 0.5:  # a number block on the right (-Y)
        split = -half + 0.24 * half * 2
        blocks = [(split, half), (-half, split - 0.02 * half)]
    solid = Solid()
    for block, (right, left) in enumerate(blocks):
        for row in range(rows):
            count = 4 if block else int(rng.integers(9, 14))
            edges = np.linspace(right, left, count + 1)
            if row == rows - 1 and not block:  # the row with the space bar
                edges = right + (left - right) * np.array([0.0, 0.13, 0.27, 0.7, 0.86, 1.0])
            x = keys_back - row * pitch
            for near, far in pairwise(edges):
                solid += box((x - pitch + slit, x - slit), (near + slit, far - slit), (deck - 0.001, top))
    pad_front, pad_back = shape.base_front + length * 0.04, keys_back - rows * pitch - length * 0.03
    if pad_back - pad_front > 0.03:
        half_pad, middle = shape.width * rng.uniform(0.1, 0.2), shape.width * rng.choice([0.0, rng.uniform(-0.05, 0.1)])
        left, right = middle + half_pad, middle - half_pad
        if rng.random() < 0.4:  # two buttons before the pad
            split = pad_front + 0.2 * (pad_back - pad_front)
            for near, far in ((right, middle - 0.0005), (middle + 0.0005, left)):
                solid += box((pad_front, split - 0.001), (near, far), (deck - 0.001, 0.5 * (deck + top)))
            pad_front = split
        solid += box((pad_front, pad_back), (right, left), (deck - 0.001, deck + 0.3 * (top - deck)))
    return solid


def _lid(rng: Rng, shape: _Shape) -> Solid:
    """The upper shell with a frame around the screen, a badge or ribs on its back."""
    low = shape.height + GAP
    top = low + shape.lid
    front, back, half = shape.front, shape.back, shape.width / 2
    sunken = rng.uniform(0.15, 0.4) * min(shape.lid, 0.006) if rng.random() < 0.75 else 0.0
    solid = _shell(rng, (front, -half, low + sunken), (back, half, top), shape.corner, 1)
    if sunken > 0:
        inset = 0.3 * shape.corner
        side, brow, chin = shape.width * rng.uniform(0.01, 0.05, 3) + inset
        chin += shape.depth * rng.uniform(0.0, 0.06)
        solid += frame(
            (front + inset, -half + inset, low), (back - inset, half - inset, low + sunken + 0.0008),
            [brow, chin, side, side], 0, 1,
        )  # fmt: skip
    middle = 0.5 * (front + back)
    badge = rng.random()
    if badge < 0.35:
        radius = shape.width * rng.uniform(0.03, 0.07)
        x = middle + rng.uniform(-0.1, 0.1) * shape.depth
        solid += rod(x, 0, (top - 0.0015, top + 0.0006), radius)
    elif badge < 0.5:
        long, wide = shape.width * rng.uniform(0.05, 0.12), shape.width * rng.uniform(0.02, 0.05)
        solid += box((middle - wide, middle + wide), long, (top - 0.0015, top + 0.0007), fillet=0.01, axis=2)
    elif badge < 0.65:
        rib = shape.width * rng.uniform(0.01, 0.03)
        for y in (-0.3 * shape.width, 0.3 * shape.width):
            solid += box((front + 0.12 * shape.depth, middle), (y - rib, y + rib), (top - 0.0015, top + 0.0012))
    return solid


def _hinges(rng: Rng, shape: _Shape) -> Solid:
    """Barrels on the hinge axis, joined to the lid by short arms above the gap."""
    inner, outer = rng.uniform(0.2, 0.34), rng.uniform(0.38, 0.46)
    spans = [(-outer, -inner), (inner, outer)] if rng.random() < 0.4 else [(-outer, outer)]
    x, z, radius = shape.hinge_x, shape.hinge_z, shape.hinge_radius
    arm = z + 0.0004
    solid = Solid()
    for first, last in spans:
        right, left = first * shape.width, last * shape.width
        solid += rod(x, (right, left), z, radius, sections=16)
        upright = (arm + 0.0004, arm + max(min(0.8 * shape.lid, radius), 0.0015))
        solid += box((shape.back - 0.012, x), (right, left), upright)
    return solid
