"""Laptops: a base with keyboard and touchpad, and a lid with a screen on a hinge at the back.

What varies: proportions and thickness, round or bevelled shells, a base that is shorter than the lid or reaches behind
the hinge, hinges, keyboard and touchpad, the screen's frame, badges, feet, how far the lid opens.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import tan
from artsim.families.details import drawn_from
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, UP
from artsim.making.solids import Solid, box, frame, hull_of, posts, rod, union

GAP = 0.0008


class _Shape:
    """Main measures. The lid reaches from x = ``front`` to ``back``; the base starts at ``base_front``."""

    def __init__(self, draws: Draws) -> None:
        # A generator of its own, so that laptops of usual sizes do not depend on the others.
        size = draws.fork("", draws.rng.spawn(1)[0]).pick("format", {"usual": 0.88, "palmtop": 0.06, "huge": 0.06})
        widths = {"usual": (0.18, 0.48), "palmtop": (0.13, 0.18), "huge": (0.48, 0.56)}[size]
        self.width = width = draws.length("width", widths)
        if draws.chance("usual", 0.4):
            self.depth = draws.triangular("depth", 0.54, 0.67, 0.9, of=width, unit="m")
            self.height = max(draws.triangular("height", 0.012, 0.035, 0.11, of=width, unit="m"), 0.006)  # of the base
            self.lid = max(draws.triangular("lid_thickness", 0.01, 0.018, 0.055, of=width, unit="m"), 0.004)
        else:  # netbooks, tablets with a keyboard, thick old ones, square and very wide ones
            thin = draws.chance("thin", 0.16)  # as tablets are
            self.depth = draws.length("depth", (0.42, 1.12), of=width)
            height = draws.length("height", (0.009, 0.025) if thin else (0.01, 0.15), of=width)
            lid = draws.length("lid_thickness", (0.007, 0.018) if thin else (0.008, 0.08), of=width)
            self.height, self.lid = max(height, 0.004 if thin else 0.006), max(lid, 0.0028 if thin else 0.004)
        # The lid turns about a barrel between the two shells, in notches behind both.
        self.hinge_radius = draws.number("hinge_radius", (0.2, 0.45)) * min(self.height, self.lid, 0.009)
        self.hinge_x = self.depth / 2 + self.hinge_radius * draws.number("hinge_place", (-0.4, 0.9))
        self.back = min(self.depth / 2, self.hinge_x - self.hinge_radius - 0.0008)
        self.front = self.base_front = -self.depth / 2
        self.tilt = 0.0  # of the base, its front lower, radians
        base = draws.pick("base", {"propped": 0.1, "short": 0.06, "long": 0.14, "usual": 0.7})
        if base == "propped":  # a flat keyboard dock, propped up by a thick bar at the back
            self.height = max(draws.length("dock_height", (0.012, 0.03), of=width), 0.005)
            self.tilt = draws.angle("base_tilt", (0.03, 0.2))
        if base in ("propped", "short"):
            self.base_front += draws.number("base_inset", (0.05, 0.22) if self.tilt else (0.01, 0.2)) * self.depth
        elif base == "long":
            self.front += draws.number("lid_inset", (0.005, 0.06)) * self.depth
        self.corner = self.depth * drawn_from(draws, "corner", {"sharp": (0.005, 0.03), "round": (0.03, 0.13)})
        self.hinge_z = self.height + 0.5 * GAP


def build(draws: Draws) -> Assembly:
    """A laptop, closed at rest. The lid opens about the Y axis at the back."""
    shape = _Shape(draws)
    laptop = Assembly("base", _propped(draws, shape) if shape.tilt else _base(draws, shape), 1400.0)
    far = draws.chance("opens_far", 0.9)
    opening = draws.turn("lid_angle", (88.0, 180.0) if far else (42.0, 88.0))
    hinge = revolute("base", (0, 1, 0), (shape.hinge_x, 0, shape.hinge_z), 0.0, opening)
    laptop.add("lid", _lid(draws, shape) + _hinges(draws, shape), hinge)
    return laptop


def _shell(draws: Draws, low: tuple[float, ...], high: tuple[float, ...], corner: float, side: int) -> Solid:
    """Plate whose upper (side 1) or lower (-1) edges are bevelled or, seen from the side, wedge-shaped."""
    plate = box(low, high, fillet=corner, axis=2)
    kind = draws.pick("edges", {"plain": 0.45, "bevel": 0.4, "wedge": 0.15})
    if kind == "plain":
        return plate
    z0, z1 = low[2], high[2]
    thick = z1 - z0
    seam = thick * draws.number("seam", (0.3, 0.7))
    outer = (z0, z0 + seam) if side > 0 else (z1 - seam, z1)
    inner = (z1 - 0.001, z1) if side > 0 else (z0, z0 + 0.001)
    bevel = draws.number("bevel", (0.3, 2.0)) * thick if kind == "bevel" else 0.1 * thick
    recess = bevel if kind == "bevel" else draws.number("wedge", (0.1, 0.5)) * (high[0] - low[0])
    edge = box((*low[:2], outer[0]), (*high[:2], outer[1]), fillet=corner, axis=2)
    face_low, face_high = (low[0] + recess, low[1] + bevel), (high[0] - min(bevel, 0.005), high[1] - bevel)
    return hull_of(edge, box((*face_low, inner[0]), (*face_high, inner[1]), fillet=corner, axis=2))


def _base(draws: Draws, shape: _Shape) -> Solid:
    """The lower shell: keys and touchpad lie in a sunken deck, so that the lid can close on the rim."""
    width, height, front, back = shape.width, shape.height, shape.base_front, shape.back
    deck = height - min(0.0015, 0.2 * height)
    rim = width * draws.number("rim", (0.01, 0.03))
    solid = _shell(draws.within("base"), (front, -width / 2, 0), (back, width / 2, deck), shape.corner, -1)
    for y in (-width / 2, width / 2 - rim):
        solid += box((front + shape.corner, back - shape.corner), (y, y + rim), (deck - 0.001, height))
    solid += _keyboard(draws, shape, deck, rim)
    # Behind the hinge the base is low enough for the lid to swing past it.
    room = shape.hinge_z - max(shape.hinge_radius, shape.lid + GAP) - 0.0015
    if room > 0.004 and draws.chance("back_shelf", 0.6):
        short = draws.chance("short_back_shelf", 0.6)
        reach = shape.hinge_x + draws.number("back_shelf_depth", (0.0, 0.07 if short else 0.2)) * shape.depth
        inset = draws.number("back_shelf_inset", (0.0, 0.2)) * width
        half = width / 2 - inset * draws.pick("back_shelf_narrow", [False, True]) - 0.5 * shape.corner
        solid += box((back - 0.02, reach), half, (0.15 * room, room), fillet=0.3 * room)
    if draws.chance("feet", 0.7):
        foot = 0.02 * width
        across = (front + 3.5 * foot, back - 2.5 * foot)
        solid += posts(across, width / 2 - 3.5 * foot, (-0.15 * foot, 0.5 * height), foot, sections=16)
    if draws.chance("latch", 0.15):  # or a lip, at the front
        half, reach = draws.number("latch_width", (0.03, 0.2)) * width, draws.length("latch_reach", (0.002, 0.012))
        solid += box((front - reach, front + 0.2 * shape.depth), half, (0.3 * deck, 0.8 * deck)).called("latch", FRONT)
    return solid


def _propped(draws: Draws, shape: _Shape) -> Solid:
    """A tilted plate with the keyboard, held up by a bar below its back edge."""
    half, height, back = shape.width / 2, shape.height, shape.back
    deck = height - 0.0015
    plate = box((shape.base_front, back), half, (0, deck), fillet=shape.corner, axis=2)
    plate += _keyboard(draws, shape, deck, 0.01 * shape.width)
    drop = tan(shape.tilt) * (back - shape.base_front) + height
    radius = 0.5 * drop * draws.number("bar_radius", (0.7, 1.1))
    x, z = back - radius, height - 0.0015 - radius
    end = half - draws.number("bar_inset", (0.0, 0.1)) * shape.width
    return plate.turned((0, 1, 0), -shape.tilt, (back, 0, height)) + rod(x, (-end, end), z, radius)


def _keyboard(draws: Draws, shape: _Shape, deck: float, rim: float) -> Solid:
    """Five or six rows of keys, a touchpad before them where there is room, its buttons."""
    top = shape.height - 0.0003
    length = shape.back - shape.base_front
    rows = draws.integer("key_rows", 5, 6)
    pitch = 0.55 * length / rows * draws.number("key_pitch", (0.75, 1.05))
    half = shape.width / 2 - rim - shape.width * draws.number("keys_margin", (0.005, 0.06))
    keys_back = shape.back - length * draws.number("keys_back", (0.05, 0.14))
    slit = 0.05 * pitch
    blocks = [(-half, half)]
    if shape.width > 0.36 and draws.chance("number_block", 0.5):  # on the right (-Y)
        split = -half + 0.24 * half * 2
        blocks = [(split, half), (-half, split - 0.02 * half)]
    solid = Solid()
    for block, (right, left) in enumerate(blocks):
        for row in range(rows):
            edges = np.linspace(right, left, (4 if block else draws.integer("row_keys", 9, 13)) + 1)
            if row == rows - 1 and not block:  # the row with the space bar
                edges = right + (left - right) * np.array([0.0, 0.13, 0.27, 0.7, 0.86, 1.0])
            x = keys_back - row * pitch
            for near, far in pairwise(edges):
                solid += box((x - pitch + slit, x - slit), (near + slit, far - slit), (deck - 0.001, top))
    pad_front, pad_back = shape.base_front + length * 0.04, keys_back - rows * pitch - length * 0.03
    if pad_back - pad_front > 0.03:
        half_pad, shift = shape.width * draws.number("pad_width", (0.1, 0.2)), draws.number("pad_shift", (-0.05, 0.1))
        middle = shape.width * (shift * draws.pick("pad_shifted", [False, True]))
        left, right = middle + half_pad, middle - half_pad
        if draws.chance("pad_buttons", 0.4):  # two, before the pad
            split = pad_front + 0.2 * (pad_back - pad_front)
            for near, far in ((right, middle - 0.0005), (middle + 0.0005, left)):
                solid += box((pad_front, split - 0.001), (near, far), (deck - 0.001, 0.5 * (deck + top)))
            pad_front = split
        solid += box((pad_front, pad_back), (right, left), (deck - 0.001, deck + 0.3 * (top - deck)))
    return solid.called("panel", UP)


def _lid(draws: Draws, shape: _Shape) -> Solid:
    """The upper shell with a frame around the screen, a badge or ribs on its back."""
    low = shape.height + GAP
    top = low + shape.lid
    front, back, half = shape.front, shape.back, shape.width / 2
    depth = min(shape.lid, 0.006)
    sunken = draws.number("screen_depth", (0.15, 0.4)) * depth if draws.chance("screen_frame", 0.75) else 0.0
    solid = _shell(draws.within("lid"), (front, -half, low + sunken), (back, half, top), shape.corner, 1)
    if sunken > 0:
        inset = 0.3 * shape.corner
        edges = ("side", "brow", "chin")
        side, brow, chin = (shape.width * draws.number(f"screen_{edge}", (0.01, 0.05)) + inset for edge in edges)
        chin += shape.depth * draws.number("deeper_chin", (0.0, 0.06))
        corners = (front + inset, inset - half, low), (back - inset, half - inset, low + sunken + 0.0008)
        solid += frame(*corners, [brow, chin, side, side], 0, 1)
    middle = 0.5 * (front + back)
    badge = draws.pick("badge", {"disc": 0.35, "plate": 0.15, "ribs": 0.15, "none": 0.35})
    if badge == "disc":
        radius = shape.width * draws.number("badge_radius", (0.03, 0.07))
        x = middle + draws.number("badge_place", (-0.1, 0.1)) * shape.depth
        solid += rod(x, 0, (top - 0.0015, top + 0.0006), radius)
    elif badge == "plate":
        long = shape.width * draws.number("badge_width", (0.05, 0.12))
        wide = shape.width * draws.number("badge_depth", (0.02, 0.05))
        solid += box((middle - wide, middle + wide), long, (top - 0.0015, top + 0.0007), fillet=0.01, axis=2)
    elif badge == "ribs":
        rib = shape.width * draws.number("rib_width", (0.01, 0.03))
        for y in (-0.3 * shape.width, 0.3 * shape.width):
            solid += box((front + 0.12 * shape.depth, middle), (y - rib, y + rib), (top - 0.0015, top + 0.0012))
    return solid


def _hinges(draws: Draws, shape: _Shape) -> Solid:
    """Barrels on the hinge axis, joined to the lid by short arms above the gap."""
    inner = draws.number("hinge_inner", (0.2, 0.34)) * shape.width
    outer = draws.number("hinge_outer", (0.38, 0.46)) * shape.width
    spans = [(-outer, -inner), (inner, outer)] if draws.chance("two_hinges", 0.4) else [(-outer, outer)]
    x, z, radius = shape.hinge_x, shape.hinge_z, shape.hinge_radius
    arm = z + 0.0004
    deep, upright = (shape.back - 0.012, x), (arm + 0.0004, arm + max(min(0.8 * shape.lid, radius), 0.0015))
    return union(rod(x, across, z, radius, sections=16) + box(deep, across, upright) for across in spans)
