"""Details that several families share: handles, hinged panels, unusual proportions."""

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from artsim.common.elementary import arccos, arcsin, arctan2, cos, sin
from artsim.common.products import unit
from artsim.making.assembly import Assembly, JointSpec, prismatic, revolute
from artsim.making.draws import Draws, Interval
from artsim.making.outlines import FRONT, Array, Span, Vector, ends, rounded_rectangle
from artsim.making.solids import Solid, box, cylinder, deferred, frame, hull, hull_of, prism, rod, tube, union


def drawn_from(draws: Draws, name: str, spans: Mapping[str, Interval], chances: Sequence[float] = ()) -> float:
    """A number from one of several ranges: all are drawn from (``corner_round``), and one is picked (``corner``)."""
    return draws.one_of(name, {word: draws.number(f"{name}_{word}", span) for word, span in spans.items()}, chances)


def unusual_sides(draws: Draws, low: Vector, high: Vector, least: Vector) -> tuple[float, float, float]:
    """Depth, width and height of a box, metres, one of which is near the end of its range.

    ``low`` and ``high`` are the smallest and largest share of each side in the diagonal. The box is up to a third
    larger than the metres ask for that each side needs at least. Few objects of a family are so: a flat draw would make
    most of them odd.
    """
    sides = ["depth", "width", "height"]
    axis = sides.index(draws.pick("unusual_side", sides))
    b, c = (k for k in range(3) if k != axis)
    near, small = draws.number("near_end", (0.0, 0.2)), draws.chance("unusually_small", 0.5)
    value = low[axis] * (1.0 + near) if small else high[axis] - near * (1.0 - high[axis])
    rest = float(np.sqrt(1.0 - value * value))
    # Angle of the other two sides in their plane.
    first = max(arccos(min(high[b] / rest, 1.0)), arcsin(min(low[c] / rest, 1.0)))
    last = min(arccos(min(low[b] / rest, 1.0)), arcsin(min(high[c] / rest, 1.0)))
    angle = draws.angle("other_sides", (first, last)) if first < last else 0.5 * (first + last)
    shares = np.empty(3)
    shares[[axis, b, c]] = value, rest * cos(angle), rest * sin(angle)
    depth, width, height = shares * (np.asarray(least) / shares).max() * draws.number("unusual_scale", (1.0, 1.3))
    return float(depth), float(width), float(height)


@deferred
def bar_handle(start: Vector, end: Vector, outward: Vector, reach: float, radius: float) -> Solid:
    """Straight bar between two points of a surface, ``reach`` before it along its unit normal, on two posts."""
    start, end, outward = (np.asarray(v, dtype=np.float64) for v in (start, end, outward))
    lifted = outward * reach
    posts = (start + share * (end - start) for share in (0.1, 0.9))
    bar = tube([start + lifted, end + lifted], radius)
    bar += union(tube([foot - 0.002 * outward, foot + lifted], 0.8 * radius, 10) for foot in posts)
    return bar.called("handle", outward)


@deferred
def bow_handle(start: Vector, end: Vector, outward: Vector, reach: float, radius: float) -> Solid:
    """Round bow from one point of the surface to another."""
    start, end, outward = (np.asarray(v, dtype=np.float64) for v in (start, end, outward))
    angles = np.linspace(0.0, np.pi, 9)
    shares = 0.5 - 0.5 * cos(angles)
    path: Array = start + shares[:, None] * (end - start) + (reach * sin(angles) - 0.002)[:, None] * outward
    return tube(path, radius, 10).called("handle", outward)


@deferred
def knob(foot: Vector, outward: Vector, reach: float, radius: float) -> Solid:
    """Round knob on a thinner stem."""
    foot, outward = np.asarray(foot, dtype=np.float64), np.asarray(outward, dtype=np.float64)
    neck = foot + reach * outward
    stem = cylinder(foot - 0.002 * outward, neck, 0.4 * radius, sections=12)
    return (stem + cylinder(neck, neck + 0.5 * radius * outward, radius, 0.8 * radius, 20)).called("knob", outward)


@deferred
def panel(kind: str, low: Vector, high: Vector, rail: float, recess: float) -> Solid:
    """Upright panel between two corners whose front faces -X: the face of a door or of a drawer.

    It is a "slab", or a frame, ``rail`` wide, around a board that is sunken by ``recess`` ("shaker"), rises again in
    its middle ("raised") or is of "planks", or around a pane with glazing bars ("glass"). Small ones are slabs.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    sides = high - low
    if kind == "slab" or min(sides[1:]) < 3.2 * rail:
        return box(low, high, fillet=0.15 * sides[0], steps=2)
    bars = frame(low, high, [rail] * 4)
    inside = np.array([0.0, rail - 0.002, rail - 0.002])
    inner_low, inner_high = low + inside, high - inside
    if kind == "glass":
        middle = 0.5 * (low[0] + high[0])
        for axis in (1, 2):
            for edge in np.linspace(inner_low[axis], inner_high[axis], int(2 + sides[axis] // 0.35))[1:-1]:
                bar_low, bar_high = inner_low + (0.003, 0, 0), inner_high - (0.003, 0, 0)
                bar_low[axis], bar_high[axis] = edge - 0.2 * rail, edge + 0.2 * rail
                bars += box(bar_low, bar_high)
        inner_low[0], inner_high[0] = middle - 0.002, middle + 0.002
        return bars + box(inner_low, inner_high).called("glass", FRONT)
    board = box(inner_low + (recess, 0, 0), inner_high - (0.001, 0, 0))
    if kind == "raised":
        ledge = 0.25 * rail
        (y0, z0), (y1, z1) = inner_low[1:], inner_high[1:]
        rise = [(low[0] + x, y, z) for x, s in ((recess + 0.001, ledge), (0.2 * recess, 2.0 * ledge))
                for y in (y0 + s, y1 - s) for z in (z0 + s, z1 - s)]  # fmt: skip
        return bars + board + hull(rise)
    if kind == "planks":
        edges = np.linspace(inner_low[1], inner_high[1], int(2 + sides[1] // 0.09))
        for left, right in pairwise(edges):
            board += box((low[0] + 0.4 * recess, left + 0.002, inner_low[2]),
                         (high[0] - 0.002, right - 0.002, inner_high[2]))  # fmt: skip
    return bars + board


@deferred
def flat_handle(start: Vector, end: Vector, reach: float, thickness: float, depth: float) -> Solid:
    """Flat bar along Y or Z on two posts, on a panel that faces -X; its start is below or to the -Y side of its end.

    Its front is ``reach`` before the panel; it is ``thickness`` wide in the panel's plane and ``depth`` along X.
    """
    start, end = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    half = np.array([0.0, 0.5 * thickness, 0.5 * thickness])
    along = unit(end - start)
    side = half * (1.0 - along)
    front, back = np.array([-reach, 0.0, 0.0]), np.array([depth - reach, 0.0, 0.0])
    solid = box(start - side + front, end + side + back, fillet=0.25 * min(thickness, depth))
    for share in (0.06, 0.94):
        foot = start + share * (end - start)
        solid += box(foot - half + 0.5 * (front + back), foot + half + (0.002, 0.0, 0.0))
    return solid.called("handle", FRONT)


@deferred
def dial(foot: Vector, outward: Vector, reach: float, radius: float, sections: int = 24) -> Solid:
    """Control knob 1 mm clear of its panel; a grip across it shows how far it is turned."""
    foot, outward = np.asarray(foot, dtype=np.float64), np.asarray(outward, dtype=np.float64)
    up = np.array([0.0, 0.0, 1.0]) if abs(outward[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    side = np.cross(up, outward)
    skirt = 0.35 * reach
    solid = cylinder(foot + 0.001 * outward, foot + skirt * outward, radius, 0.9 * radius, sections)
    corners = [
        foot + lift * outward + a * wide * side + b * 0.88 * radius * up
        for lift, wide in ((0.9 * skirt, 0.24 * radius), (reach, 0.16 * radius))
        for a in (-1, 1)
        for b in (-1, 1)
    ]
    return (solid + hull(corners)).called("knob", outward)


@deferred
def holed_plate(low: Vector, high: Vector, center: Vector, radius: float, axis: int = 0, sections: int = 24) -> Solid:
    """Box with a round hole along a coordinate axis, about a center (2,) in the two other coordinates.

    ``radius`` is that of the circle inside the hole's polygon.
    """
    low, high, middle = (np.asarray(v, dtype=np.float64) for v in (low, high, center))
    across = [i for i in range(3) if i != axis]
    reach = np.stack([low[across], high[across]]) - middle
    corners = np.array([(u, v) for u in reach[:, 0] for v in reach[:, 1]])
    corner_angles = np.mod(arctan2(corners[:, 1], corners[:, 0]), 2 * np.pi)
    angles = np.linspace(0.0, 2.0 * np.pi, sections + 1)
    rays = np.stack([cos(angles), sin(angles)], axis=1)
    limits = np.where(rays > 0, reach[1], reach[0])
    outer = rays * np.min(limits / np.where(np.abs(rays) > 1e-12, rays, 1e-12 * np.sign(limits)), axis=1)[:, None]
    inner = rays * radius / cos(np.pi / sections)
    solid = Solid()
    for k in range(sections):
        between = corners[(corner_angles > angles[k]) & (corner_angles < angles[k + 1])]
        outline = np.concatenate([inner[k : k + 2], outer[k : k + 2], between]) + middle
        solid += prism(outline, low[axis], high[axis], axis)
    return solid


@deferred
def windowed_panel(low: Vector, high: Vector, margins: Sequence[float], pane: float, inset: float) -> Solid:
    """Panel that faces -X, with a window: a frame, and a pane ``inset`` behind its front and ``pane`` thick.

    ``margins`` are the widths of the frame at low Y, high Y, the bottom and the top.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    left, right, bottom, top = np.asarray(margins, dtype=np.float64) - 0.002
    x = low[0] + inset
    glass = box((x, x + pane), (low[1] + left, high[1] - right), (low[2] + bottom, high[2] - top))
    return frame(low, high, margins) + glass.called("glass", FRONT)


@deferred
def wire_shelf(low: Vector, high: Vector, bars: int, wire: float) -> Solid:
    """Flat grid within a box: a square rim, as high as the box, and bars along X."""
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    solid = frame(low, high, [wire] * 4, 0, 1)
    for y in np.linspace(low[1], high[1] - wire, bars + 2)[1:-1]:
        solid += box((low[0], high[0]), (y, y + wire), (low[2], low[2] + min(wire, high[2] - low[2])))
    return solid


@deferred
def rounded_tray(
    low: Vector, high: Vector, wall: float, radius: float, profile: ArrayLike = ((0.0, 0.0), (1.0, 0.0)),
    axis: int = 2, side: int = 1, floor: float | None = None, steps: int = 3,
) -> Solid:  # fmt: skip
    """Open box with one wall around, its corners round as seen along ``axis``, open towards that axis's ``side`` (+-1).

    The floor is as thick as the wall by default; 0 leaves it out. ``profile`` (N, 2) holds, from the floor (0) to the
    opening (1), the share of the depth, and metres by which the outline shrinks there: for tapers and bevels.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    depth = wall if floor is None else floor
    across = [i for i in range(3) if i != axis]
    start, end = (low[axis], high[axis]) if side > 0 else (high[axis], low[axis])

    def outline(inset: float, share: float, thickness: float = 0.0) -> Array:
        inset += thickness
        plane = rounded_rectangle(low[across] + inset, high[across] - inset, max(radius - inset, 0.001), steps)
        points = np.empty((len(plane), 3))
        points[:, across], points[:, axis] = plane, start + share * (end - start)
        return points

    pieces = []
    for (share0, inset0), (share1, inset1) in pairwise(np.asarray(profile, dtype=np.float64)):
        rings = [outline(inset, share, w) for inset, share in ((inset0, share0), (inset1, share1)) for w in (0.0, wall)]
        pieces += [hull(np.concatenate([r[[k - 1, k]] for r in rings])) for k in range(len(rings[0]))]
    if depth > 0:
        profile = np.asarray(profile, dtype=np.float64)
        share = depth / abs(end - start)
        levels = [0.0, *(s for s in profile[1:, 0] if s < share), share]
        insets = np.interp(levels, profile[:, 0], profile[:, 1])
        pieces.append(hull(np.concatenate([outline(i + 0.0002, s) for i, s in zip(insets, levels, strict=True)])))
    return union(pieces)


@deferred
def push_button(face: Vector, size: Vector, round_off: float) -> Solid:
    """Button on a panel that faces -X, its front 8 mm before the panel, with 1.5 mm to travel and more to spare.

    ``face`` is its centre on the panel, ``size`` its extent along Y and Z, ``round_off`` the radius of its corners.
    """
    face = np.asarray(face, dtype=np.float64)
    half = np.array([0.0, 0.5 * size[0], 0.5 * size[1]])
    button = box(face - half - (0.008, 0, 0), face + half - (0.0022, 0, 0), fillet=round_off, axis=0)
    return button.called("button", FRONT)


def add_push_button(machine: Assembly, number: int, face: Vector, size: Vector, round_off: float) -> None:
    """Add a :func:`push_button` to a body that faces -X."""
    machine.add(f"button_{number}", push_button(face, size, round_off), prismatic("body", (1, 0, 0), 0.0, 0.0015, face))


@deferred
def cheeks(
    axle: tuple[float, float], radius: float, near: float, far: float, root_x: Span, root_z: Span, sections: int = 12
) -> Solid:
    """Two cheeks, from ``near`` to ``far`` on either side, that join an axle along Y at (x, z) to what lies below."""
    x, z = axle
    sides = [ends((s * near, s * far)) for s in (-1.0, 1.0)]
    return union(hull_of(rod(x, y, z, radius, sections=sections), box(root_x, y, root_z)) for y in sides)


def side_hinge(x: float, y: float, upper: float, left: bool) -> JointSpec:
    """Upright hinge, at (x, y), of a door in a front that faces -X.

    It opens by up to ``upper`` radians. Where ``left``, the door reaches from the axis towards -Y: its hinge is on the
    left of someone who looks at the front.
    """
    return revolute("body", (0, 0, -1 if left else 1), (x, y, 0.0), 0.0, upper)


def front_handle(kind: str, start: Vector, end: Vector, reach: float, radius: float) -> Solid:
    """Handle on a front that faces -X: "bar", "bow" or "flat"; of another kind, nothing.

    It lies upright or level; its start is below or to the -Y side of its end.
    """
    if kind == "bar":
        return bar_handle(start, end, (-1, 0, 0), reach, radius)
    if kind == "bow":
        return bow_handle(start, end, (-1, 0, 0), reach, radius)
    return flat_handle(start, end, reach, 2.5 * radius, radius) if kind == "flat" else Solid()


@deferred
def rounded_shell(low: Vector, high: Vector, wall: float, radius: float, steps: int = 4) -> Solid:
    """Tunnel along X between two corners, open at both ends, its outer edges round."""
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    outer = rounded_rectangle(low[1:], high[1:], radius, steps)
    inner = rounded_rectangle(low[1:] + wall, high[1:] - wall, max(radius - wall, 0.1 * wall), steps)
    corners = np.stack([outer, inner], axis=1)
    pairs = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    return union(prism(np.concatenate(pair), low[0], high[0], 0) for pair in pairs)


@deferred
def grid_panel(
    low: Vector, high: Vector, widths: Vector, columns: Vector, rows: Vector, bar: float, board: float,
    bore: tuple[float, float, float] | None = None, glass: bool = True,
) -> Solid:  # fmt: skip
    """Frame across the X axis with crossbars and a thinner board or pane between them: a door's leaf, a window's sash.

    ``widths`` are those of the frame at low Y, high Y, low Z, high Z; ``columns`` and ``rows`` are the Y of upright
    bars and the Z of level ones, ``bar`` wide; ``board`` is the board's thickness, which ``glass`` marks as such.
    ``bore`` is Y, Z and radius of a hole through one of the upright sides of the frame, as for a handle.
    """
    low, high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
    inner_low, inner_high = low + (0, widths[0], widths[2]), high - (0, widths[1], widths[3])
    deep, across = (low[0], high[0]), (inner_low[1], inner_high[1])
    solid = box(deep, across, (low[2], inner_low[2])) + box(deep, across, (inner_high[2], high[2]))
    for y0, y1 in ((low[1], inner_low[1]), (inner_high[1], high[1])):
        if bore is None or not y0 < bore[0] < y1:
            solid += box(deep, (y0, y1), (low[2], high[2]))
            continue
        z0, z1 = bore[1] - 2 * bore[2], bore[1] + 2 * bore[2]
        solid += box(deep, (y0, y1), (low[2], z0)) + box(deep, (y0, y1), (z1, high[2]))
        solid += holed_plate((low[0], y0, z0), (high[0], y1, z1), bore[:2], bore[2], sections=12)
    inset = np.array([0.1 * (high[0] - low[0]), 0.0, 0.0])
    for y in columns:
        solid += box(inner_low + inset + (0, y - inner_low[1] - bar / 2, -0.001),
                     (high[0] - inset[0], y + bar / 2, inner_high[2] + 0.001))  # fmt: skip
    for z in rows:
        solid += box(inner_low + inset + (0, -0.001, z - inner_low[2] - bar / 2),
                     (high[0] - inset[0], inner_high[1] + 0.001, z + bar / 2))  # fmt: skip
    middle = 0.5 * (low[0] + high[0])
    pane_low, pane_high = inner_low - 0.001, inner_high + 0.001
    pane_low[0], pane_high[0] = middle - board / 2, middle + board / 2
    pane = box(pane_low, pane_high)
    return solid + (pane.called("glass", FRONT) if glass else pane)


def swing_limits(near: float, reach: float) -> tuple[float, float]:
    """How far a hinged panel may open, radians: so as to stay in front of its own opening, and at all.

    What stands out of the panel begins ``near`` from the hinge and reaches ``reach`` beyond its plane, 0 for nothing.
    """
    slant = float(arctan2(max(reach, 0.0), near))
    return min(np.pi / 2 - slant - 0.01, np.deg2rad(88.0)), np.pi - max(slant, 0.03) - 0.05
