"""Scissors: two blades with ring handles that cross at a pivot, closed at rest, lying flat with the points at +Y.

The frame is that of PartNet-Mobility's scissors: rings at -Y, the root's towards -X, and the other blade opens about
+Z. Both blades are built with their points at -X, and turned in the end.

Varied: length, the share of the blades, their width, points and backs, handles of metal rods or thick plastic, rings
round or long, alike or one longer than the other, offset to one side, apart, level or bent up, open finger rests, and
the pivot.
"""

import numpy as np

from artsim.common.elementary import arcsin, arctan2, cos, hypot, sin, tan
from artsim.common.products import matmul, norm
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import Array, normals, strips
from artsim.making.solids import Solid, deferred, ellipsoid, hull, hull_of, loft, prism, rod, tube, union

GAP = 0.0005
_POINTS_TO_Y = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""Quarter turn that takes -X, where blades are built with their points, to +Y, and rings at -Y to -X."""
LENGTHS = {False: ((0.17, 0.27), (0.13, 0.27)), True: ((0.27, 0.35), (0.27, 0.38))}
"""Half the length of a ring over that of the handle, usual and widest, of round and of long ones."""


class Ring:
    """A finger ring at the +Y side, clear of the middle by its bar; the second of two unlike ones is long.

    It lies level, or rises towards the back, as those of dressmakers' shears do over the cloth. It ends at ``front``.
    """

    def __init__(
        self, draws: Draws, front: float, reach: float, bar: float, kind: str, second: bool, plastic: bool, slope: float
    ) -> None:
        self.slope = slope
        long = kind != "same" and second
        along = reach * draws.number("length", *LENGTHS[long]) * (1.1 if plastic else 1.0)
        shift = reach * draws.number("offset", (0.05, 0.12)) if kind == "offset" and not second else 0.0
        along = min(along, 0.5 * (reach - bar - shift - front))
        oval = long or draws.chance("oval", 0.5)
        across = min(along, reach * draws.number("width", (0.13, 0.2), (0.11, 0.22))) if oval else along * 0.95
        self.radii = np.array([along, across])  # of its middle line, along and across
        self.turn = draws.angle("turn", (0.0, 0.3))  # of its long axis from X
        self.egg = draws.number("egg", (0.0, 0.35))  # by how much it is wider at the back than at the front
        half = hypot(along * sin(self.turn), (1 + self.egg) * across * cos(self.turn)) + 0.6 * bar
        y = half + GAP + reach * draws.number("spacing", (0.0, 0.05), (0.0, 0.08))
        self.center = np.array([reach - along - bar - shift, y])

    def loop(self) -> Array:
        """(22, 3) points of the ring's middle line, which is level as far as where it comes nearest to the pivot."""
        angles = np.linspace(0.0, 2.0 * np.pi, 22, endpoint=False)
        wide = self.radii[1] * (1 + self.egg * cos(angles))
        u = np.column_stack([self.radii[0] * cos(angles), wide * sin(angles)])
        c, s = cos(self.turn), sin(self.turn)
        plan = self.center + matmul(u, [[c, s], [-s, c]])
        return np.column_stack([plan, self.slope * np.maximum(plan[:, 0] - plan[np.argmin(norm(plan)), 0], 0.0)])


def build(draws: Draws) -> Assembly:
    """Scissors, closed at rest. One blade turns about the vertical pivot."""
    length = draws.length("length", (0.09, 0.3), (0.08, 0.33))  # from scissors for nails to tailors' shears
    blade = length * draws.number("blade_length", (0.36, 0.6), (0.3, 0.66))
    width = min(max(blade * draws.number("blade_width", (0.09, 0.19), (0.07, 0.24)), 0.005), 0.028)
    sheet = max(length * draws.number("blade_thickness", (0.008, 0.013)), 0.0016)
    plastic = draws.chance("plastic", 0.6)
    bar = length * draws.number("bar_width", (0.026, 0.046) if plastic else (0.014, 0.024))
    height = bar * draws.number("bar_height", (0.8, 1.3)) if plastic else max(bar, 2.6 * sheet)
    reach = length - blade
    kind = draws.pick("rings", {"same": 0.4, "long": 0.4, "offset": 0.2})
    slope = tan(draws.angle("ring_slope", (0.1, 0.3))) if draws.chance("bent_handles", 0.08) else 0.0
    front = 0.6 * width + 0.7 * bar  # clear of the other blade's tang
    ringed = draws.within("ring")
    rings = [Ring(ringed, front, reach, bar, kind, second, plastic, slope) for second in (False, True)]
    if kind == "same":
        rings[1] = rings[0]
    point = _blade(draws, blade, width)
    rests = not plastic and draws.chance("finger_rest", 0.3)
    rest = draws.number("finger_rest_length", (0.15, 0.3)) * reach if rests else 0.0
    pivot = width * draws.number("pivot_radius", (0.22, 0.38))
    button, opening = sheet * draws.number("pivot_height", (0.4, 1.0)), draws.turn("blade_angle", (45.0, 100.0))

    middle = sheet + GAP / 2
    blades = []
    for k in range(2):
        # The second blade lies on the first; each handle is as thick as both, on its own side of the middle.
        low = k * (sheet + GAP)
        side = 1.0 if k == 0 else -1.0
        solid = union(prism(piece * (1.0, side), low, low + sheet) for piece in point)
        handle = _handle(rings[k], side, low, sheet, width, bar, height, plastic)
        opening = min(opening, _clear_opening(handle, low, low + sheet, width))
        solid += handle.called("handle", (1, 0, 0))
        if k == 0 and rests:
            solid += _finger_rest(rings[k], rest, bar, middle)
        outward = -side
        face = low + sheet if k else low
        solid += rod(0, 0, (face - 0.5 * outward * sheet, face + outward * button), pivot, 0.85 * pivot, 20)
        blades.append(solid.rotated(_POINTS_TO_Y))
    scissors = Assembly(density=4500.0)
    # The upper blade is the root: its ring is the one towards -X.
    scissors.add("blade_1", blades[1], label="blade")
    scissors.add("blade_2", blades[0], revolute("blade_1", (0, 0, 1), (0, 0, middle), 0.0, opening), label="blade")
    return scissors


def _blade(draws: Draws, length: float, width: float) -> list[Array]:
    """Convex outlines of the blade whose handle is at +Y: the edge just beyond the middle, the back at -Y."""
    edge, back = 0.2 * width, -0.8 * width
    kind = draws.pick("blade_shape", ["straight", "bellied", "blunt", "narrow"])
    blunt = kind == "blunt"
    tip = {"blunt": 0.55, "narrow": 0.05}.get(kind, 0.14) * width
    turn = draws.number("blade_taper", (0.75, 0.9) if blunt else (0.3, 0.6))
    sag = {"bellied": 0.7, "straight": 0.2, "narrow": 0.0}.get(kind, 0.5)
    x = np.linspace(0.0, 1.0, 9)
    falling = np.clip((x - turn) / (1 - turn), 0, 1)
    backs = back + (edge - tip - back) * ((1 - sag) * falling + sag * np.square(falling))
    backs[0] = 0.8 * back
    edges = np.full(9, edge)
    if blunt:
        backs[-1], edges[-1] = edge - 0.3 * width, edge - 0.1 * width
    return strips(np.column_stack([-x * length, edges]), np.column_stack([-x * length, backs]))


@deferred
def _handle(
    ring: Ring, side: float, low: float, sheet: float, width: float, bar: float, height: float, plastic: bool
) -> Solid:
    """Ring and the shank that joins it to the pivot; half as thick as both blades near the pivot."""
    middle, tang = sheet + GAP / 2, 0.42 * width
    path = ring.loop() * (1.0, side, 1.0) + (0.0, 0.0, middle)
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False) + np.pi / 8
    out = side * normals(path[:, :2], closed=True)
    flat = path[:, None, :2] + (0.54 * bar * cos(angles))[:, None] * out[:, None]
    sections = list(np.dstack([flat, path[:, 2:] + 0.54 * height * sin(angles)]))  # upright ellipses
    solid = loft(sections, closed=True)
    # The shank meets the ring where it comes nearest to the pivot.
    k = int(np.argmin(norm(path[:, :2])))
    near, top = path[k], low + sheet
    rear = np.array([(x, side * y) for x in (-0.3, -0.2) for y in (-0.78, 0.2)]) * width
    end = rod(near[0], near[1], (low, top), 0.5 * bar, sections=16)
    solid += hull_of(rod(0, 0, (low, top), tang, sections=20), prism(rear, low, top), end)
    if plastic:
        # A moulded body around the shank, from where it is clear of the other blade.
        share = min(max(0.35, 2.4 * width / near[0]), 0.8)
        neck = near * (share, share, 1.0)
        neck[1] = side * max(abs(neck[1]), 0.5 * bar + GAP)
        start = ellipsoid(neck, (0.5 * bar, 0.5 * bar, 0.5 * height), 12)
        for first, second in ((k - 2, k - 1), (k - 1, k), (k, k + 1), (k + 1, k + 2)):
            ends = np.concatenate([sections[i % len(sections)] for i in (first, second)])
            solid += hull_of(start, hull(ends))
    return solid


def _clear_opening(handle: Solid, low: float, high: float, width: float) -> float:
    """Angle up to which what is thicker than a blade's layer stays clear of the other blade's back."""
    points = np.concatenate([vertices for vertices, _ in handle.piece_meshes()])
    thick = points[(points[:, 2] < low - 1e-6) | (points[:, 2] > high + 1e-6)]
    away = hypot(thick[:, 0], thick[:, 1])
    turned = np.abs(arctan2(thick[:, 1], thick[:, 0])) + arcsin(np.minimum(1.0, 0.9 * width / away))
    return float(np.pi - turned.max() - 0.05)


@deferred
def _finger_rest(ring: Ring, length: float, bar: float, middle: float) -> Solid:
    """Curved hook behind the ring, as hairdressers' scissors have it."""
    loop = ring.loop()
    start = loop[np.argmax(loop[:, 0])]
    share = np.linspace(0.0, 1.0, 6)
    behind = np.column_stack([share, 0.5 * np.square(share), np.zeros(6)])
    return tube(start + length * behind + (0.0, 0.0, middle), list(0.35 * bar * (1 - 0.3 * share)), 8)
