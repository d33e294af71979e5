"""Wheels and casters of carts, and the bars of their frames."""

from collections.abc import Sequence

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, continuous
from artsim.making.draws import Draws, Interval
from artsim.making.outlines import UP, Array, Vector, about, ends, turns
from artsim.making.solids import Solid, box, cylinder, hull_of, ring, rod, tube

GAP = 0.003
STEEL = 1500.0  # kg/m^3, as real tubes are hollow
ROLL = np.array([0.0, -1.0, 0.0])
"""Axis of wheels: a cart that moves towards -X turns them by a positive angle."""


class Wheels:
    """The wheels of one cart: all of one form, numbered as they come.

    Radius and width are drawn from two ranges; the radius is at most ``most``. Large wheels are those of hand carts.
    """

    def __init__(self, draws: Draws, radius: Interval, wide: Interval, most: float = np.inf, large: bool = False):
        draws = draws.within("wheel")
        self.radius, self.wide = min(draws.length("radius", radius), most), draws.length("width", wide)
        self.style = draws.pick("style", ["rim", "spokes", "spokes"] if large else ["disc", "rim", "spokes"])
        self.spokes = draws.integer("spokes", *((6, 10) if large else (3, 6)))
        self.hub = self.radius * draws.number("hub", (0.12, 0.25) if large else (0.2, 0.45))
        self.sections = 20 if self.radius > 0.1 else 14  # small wheels need fewer to look round
        self.count = 0

    def solid(self, center: Vector) -> Solid:
        """A wheel in the plane across Y."""
        middle = np.asarray(center, dtype=np.float64)
        half = np.array([0.0, 0.5 * self.wide, 0.0])
        r = self.radius
        hub = cylinder(middle - half, middle + half, self.hub, sections=12)
        if self.style == "disc":
            tyre = cylinder(middle - 0.8 * half, middle + 0.8 * half, r, sections=self.sections)
            return tyre + hub
        if self.style == "rim":
            web = cylinder(middle - 0.3 * half, middle + 0.3 * half, 0.85 * r, sections=self.sections)
            return web + ring(middle, (0, 1, 0), 0.78 * r, r, 0.9 * self.wide, self.sections) + hub
        solid = ring(middle, (0, 1, 0), 0.8 * r, r, 0.9 * self.wide, self.sections) + hub
        for a in turns(self.spokes):
            out = np.array([cos(a), 0.0, sin(a)])
            solid += tube([middle + 0.5 * self.hub * out, middle + 0.85 * r * out], 0.22 * self.wide, 4)
        return solid

    def brackets(self, spots: Sequence[tuple[float, float]], top: float) -> Solid:
        """Two cheeks at each of several places (x, y), that hold a wheel below ``top``; part of the cart."""
        solid = Solid()
        r = self.radius
        for x, y in spots:
            for s in (-1.0, 1.0):
                across = ends((y + s * (0.5 * self.wide + 0.003), y + s * (0.5 * self.wide + 0.007)))
                plate = box(about(x, 0.7 * r), across, (top - 0.006, top))
                solid += hull_of(plate, rod(x, across, r, 0.3 * r, sections=8))
            across = (y - 0.5 * self.wide - 0.007, y + 0.5 * self.wide + 0.007)
            solid += box(about(x, 0.7 * r), across, (max(2.0 * r + GAP, top - 0.006), top))
        return solid

    def add(self, cart: Assembly, center: Vector, parent: str = "body") -> None:
        """A wheel that turns on its axle."""
        cart.add(f"wheel_{self.count}", self.solid(center), continuous(parent, ROLL, center), density=900.0)
        self.count += 1

    def add_under(self, cart: Assembly, spots: Sequence[tuple[float, float]], casters: int, top: float) -> None:
        """Wheels at several places (x, y); the first of them are casters, which hang ``top`` above the floor."""
        for number, (x, y) in enumerate(spots):
            if number < casters:
                self.add_caster(cart, x, y, top)
            else:
                self.add(cart, (x, y, self.radius))

    def add_caster(self, cart: Assembly, x: float, y: float, top: float) -> None:
        """A fork that swivels below ``top`` about an upright axis, and a wheel in it that stands on the floor."""
        plate, disc = 0.008, top - GAP
        axle = np.array([x + self.radius * 0.5, y, self.radius])
        cheek = 0.5 * self.wide + 0.002
        along = (x - 0.3 * self.radius, x + 0.4 * self.radius)
        fork = rod(x, y, (disc - plate, disc), max(0.5 * self.radius, cheek), sections=12)
        for s in (-1.0, 1.0):
            across = ends((y + s * cheek, y + s * (cheek + 0.003)))
            fork += hull_of(
                box(along, across, (disc - plate, disc - plate + 0.004)),
                rod(axle[0], across, axle[2], 0.3 * self.radius, sections=8),
            )
            fork += box(along, across, (disc - plate, disc - 0.001))
        name = f"caster_{self.count}"
        cart.add(name, fork, continuous("body", UP, (x, y, disc)), density=STEEL)
        self.add(cart, axle, name)

    @property
    def caster_height(self) -> float:
        """What a caster needs below a floor."""
        return 2.0 * self.radius + 0.008 + 2.0 * GAP


def bar(start: Vector, end: Vector, radius: float, sections: int = 8) -> Solid:
    """Straight rod."""
    return tube([np.asarray(start), np.asarray(end)], radius, sections)


def slab(corners: Sequence[Array], half: float) -> Solid:
    """Plate between its corners, which lie ``half`` of its thickness below its faces."""
    return hull_of(*(box(corner - half, corner + half) for corner in corners))
