"""Lenses of cameras: rings that turn, tubes that slide out of each other, caps."""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, JointSpec, continuous, prismatic, revolute, swivel
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, Array, Vector, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, ring

DENSITY = 900.0


class Lens:
    """A lens in the plane x = 0: what is fixed to the body, and the parts that turn or slide, in a row.

    Its axis meets the body's front at ``center``; it is at most ``radius`` wide. Its style is "tubes" (one to three
    that slide in a collar), "prime" (rings that turn), or "zoom" (both).
    """

    def __init__(self, draws: Draws, center: Vector, radius: float, style: str):
        self.center = np.asarray(center, dtype=np.float64)
        self.fixed = Solid()
        self.parts: list[tuple[str, Solid, JointSpec]] = []
        if style == "tubes":
            long, count = radius * draws.number("lens_length", (0.25, 0.8)), draws.integer("tube_count", 1, 3)
            wall = 0.1 * radius
            self.fixed += self._ring(0.5 * long, radius - wall, radius, long, 24)
            if draws.chance("lens_collar", 0.6):
                outer, near, far = 1.15 * radius if radius < 0.02 else radius * 1.05, -0.001, 0.35 * long
                self.fixed += self._ring(0.5 * (near + far), radius - wall, outer, far - near, 24)
            self._sliding(draws, radius - wall - 0.0006, 0.0, long, count)
            return
        long = radius * draws.number("lens_length", (0.5, 1.4) if style == "prime" else (1.0, 3.0))
        radius *= draws.number("lens_width", (0.75, 1.0))
        core = 0.86 * radius
        self.fixed += cylinder(self._at(-0.001), self._at(0.12 * long), radius, sections=28)
        slots = [(0.18, 0.4), (0.5, 0.8)] if draws.chance("zoom_ring", 0.6) else [(0.3, 0.75)]
        hollow = style == "zoom"
        bore = 0.72 * radius
        hole = bore if hollow else 0.5 * core
        if hollow:
            self.fixed += self._ring(0.5 * long, bore, core, long, 24)
        else:
            self.fixed += cylinder(self.center, self._at(long), core, sections=28)
            self.fixed += self._ring(long + 0.03 * core, 0.8 * core, core, 0.08 * core, 24)
            self.fixed += self._glass(core, 0.7, long, 16)
        self.fixed += self._ring(0.95 * long, hole, radius, 0.1 * long, 24)
        if len(slots) == 2:
            self.fixed += self._ring(0.45 * long, hole, radius, 0.06 * long, 24)
        for number, (a, b) in enumerate(slots):
            name = "focus_ring" if number == len(slots) - 1 else "zoom_ring"
            wall = radius * draws.number(f"{name}_width", (1.0, 1.08))
            grip = self._ring(0.5 * (a + b) * long, 1.004 * core + 0.0006, wall, (b - a) * long, 20)
            for angle in turns(draws.pick(f"{name}_ribs", [0, 6, 10])):
                out = self.center + (0, wall * cos(angle), wall * sin(angle))
                inset = 0.15 * (b * long - a * long)
                ends = out - (a * long + inset, 0, 0), out - (b * long - inset, 0, 0)
                grip += cylinder(*ends, 0.06 * wall, sections=4)
            limit = draws.angle(f"{name}_angle", (0.8, 4.5)) if draws.chance(f"{name}_stops", 0.5) else None
            self.parts.append((name, grip, swivel("body", FRONT, self.center, limit, 0.0)))
        if hollow:
            self._sliding(draws, bore - 0.0008, 0.12 * long, long, draws.integer("tube_count", 1, 2))

    def _at(self, before: float) -> Array:
        """(3,) point of the axis so far before the body's front."""
        return self.center - (before, 0, 0)

    def _ring(self, before: float, inner: float, outer: float, thick: float, sections: int) -> Solid:
        """A ring about the axis, the middle of its thickness so far before the body's front."""
        return ring(self._at(before), FRONT, inner, outer, thick, sections)

    def _glass(self, radius: float, share: float, front: float, sections: int) -> Solid:
        """The front glass, ``share`` of a radius wide; its dome stands a little out."""
        sizes = 0.06 * radius, share * radius, share * radius
        return ellipsoid(self._at(front), sizes, sections).called("glass", FRONT)

    def _sliding(self, draws: Draws, radius: float, near: float, long: float, count: int) -> None:
        """Tubes in each other, the first in a bore from ``near`` to ``long`` before the body's front."""
        parent, outer = "body", long
        for k in range(count):
            last = k == count - 1
            start, front = near + 0.0015 + 0.0008 * k, outer + draws.number("tube_length", (-0.05, 0.25)) * long
            wall = 0.12 * radius
            if last:
                solid = cylinder(self._at(start), self._at(front), radius, sections=24)
                solid += self._ring(front + 0.02 * radius, 0.75 * radius, 0.97 * radius, 0.06 * radius, 20)
                solid += self._glass(radius, 0.6, front, 14)
            else:
                solid = self._ring(0.5 * (start + front), radius - wall, radius, front - start, 22)
            travel = (min(front, outer) - start) * draws.number("tube_travel", (0.5, 0.9))
            at = self._at(front)
            turning = last and k > 0 and draws.chance("last_tube_turns", 0.25)
            joint = continuous(parent, FRONT, at) if turning else prismatic(parent, FRONT, 0.0, travel, at)
            part = "lens" if k == 0 else f"lens_{k}"
            self.parts.append((part, solid, joint))
            if last and draws.chance("cap", 0.25):
                self._cap(draws, part, radius, max(front + 0.06 * radius, long))
            parent, outer, radius = part, front, radius - wall - 0.0006

    def _cap(self, draws: Draws, parent: str, radius: float, front: float) -> None:
        """A lid before the glass: it pulls off, or swings aside."""
        thick = 0.12 * radius
        near = self._at(front + 0.0006)
        lid = cylinder(near, near - (thick, 0, 0), 0.98 * radius, 0.9 * radius, 22)
        if draws.chance("cap_pulls_off", 0.5):
            joint = prismatic(parent, FRONT, 0.0, radius * draws.number("cap_travel", (0.3, 1.5)), near)
        else:
            pivot = near + (-thick, 0, 1.02 * radius)
            lid += cylinder(pivot - (0, 0.2 * radius, 0), pivot + (0, 0.2 * radius, 0), 0.5 * thick, sections=10)
            lid += box(near + (-thick, -0.2 * radius, 0.7 * radius), near + (0, 0.2 * radius, 1.02 * radius))
            joint = revolute(parent, (0, 1, 0), pivot, 0.0, draws.angle("cap_angle", (1.0, 1.9)))
        self.parts.append(("cap", lid, joint))

    def add_to(self, camera: Assembly) -> None:
        """Add the moving parts."""
        for name, solid, joint in self.parts:
            camera.add(name, solid, joint, label="lens" if name.startswith("lens") else name, density=DENSITY)
