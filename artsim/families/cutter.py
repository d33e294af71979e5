"""Cutters (slide knives): a handle with a channel, a blade that slides out to -X by a button, and some end caps.

Varied: size (slim ones of sheet steel to wide box cutters), nose of the handle, angle of the blade's point, button,
grooves and bulges of the handle, a cap at the back that pulls out, and a locking wheel on the blade's button.
"""

import numpy as np

from artsim.common.elementary import cos, sin, tan
from artsim.making.assembly import Assembly, continuous, prismatic
from artsim.making.draws import Draws
from artsim.making.outlines import UP, about, rounded_rectangle
from artsim.making.solids import Solid, box, cylinder, prism, rod, union

GAP = 0.0005


class _Case:
    """Measures of a cutter, metres: its handle from x = ``front`` to ``end``, the channel and slot of its blade."""

    def __init__(self, draws: Draws) -> None:
        self.length = length = draws.log_length("length", 0.145, -0.73, 0.73)
        self.half = 0.5 * length * draws.number("width", (0.075, 0.45))
        self.height = max(min(2 * self.half * draws.number("height", (0.2, 1.0)), 0.26 * length), 0.009)
        if draws.chance("slim", 0.15):  # of sheet steel
            self.height = max(length * draws.number("slim_thickness", (0.02, 0.05)), 0.006)
        self.wall = min(draws.length("wall", (0.0016, 0.003)), 0.22 * self.height)
        self.blade_half = (self.half - self.wall - GAP) * draws.number("blade_width", (0.8, 1.0))
        self.slot = self.blade_half * draws.number("slot_width", (0.3, 0.5))
        self.nose, self.capped = length * draws.number("nose_length", (0.02, 0.16)), draws.chance("cap", 0.45)
        self.front = -0.5 * length
        self.end = 0.5 * length - (draws.length("cap_length", (0.008, 0.018)) if self.capped else 0.0)
        self.channel, self.sheet = 0.5 * self.height - 0.0006, 0.0014  # bottom and thickness of the blade
        self.roof, self.inner = self.channel + self.sheet + GAP, self.blade_half + GAP


def build(draws: Draws) -> Assembly:
    """A cutter lying flat, its blade drawn in at rest."""
    c = _Case(draws)
    front, end, half, height = c.front, c.end, c.half, c.height
    cutter = Assembly("body", _body(draws, c), 1100.0)
    blade_end = end - max(c.wall + 0.002, 0.005) - c.length * draws.number("blade_inset", (0.0, 0.1))
    point = front + draws.length("point_inset", (0.0005, 0.003))
    slant = point + 2 * c.blade_half * tan(draws.angle("point_angle", (0.35, 1.0)))
    side = draws.side("back_side") * c.blade_half
    outline = [(point, -side), (slant, side), (blade_end, side), (blade_end, -side)]
    blade = prism(outline, c.channel, c.channel + c.sheet)
    button = min(c.length * draws.number("button_length", (0.05, 0.2)), 0.03)
    forward = draws.number("button_forward", (0.0, 0.2)) * c.length
    button_end = blade_end - draws.one_of("button_place", {"end": 0.0, "forward": forward})
    top = height + draws.length("button_height", (0.002, 0.006) if height > 0.009 else (0.0012, 0.003))
    blade += _button(draws, button_end - button, button_end, top, c).called("button", UP)
    # The button stops before the bridge over the slot at the nose.
    travel = (button_end - button) - (front + c.nose) - 0.004
    travel *= draws.number("travel", (0.8, 1.0))
    cutter.add("blade", blade, prismatic("body", (-1, 0, 0), 0.0, travel, (front, 0, c.channel)), density=5000.0)
    if c.capped:
        plug = box((end + GAP, 0.5 * c.length), half * 0.97, (0.03 * height, 0.97 * height), fillet=0.002)
        plug += box((end - c.wall, end + 0.003), 0.8 * c.inner, (c.channel, c.channel + c.sheet))
        pull = draws.length("cap_travel", (0.015, 0.03))
        cutter.add("cap", plug, prismatic("body", (1, 0, 0), 0.0, pull, (end, 0, 0.5 * height)), density=1000.0)
    if draws.chance("wheel", 0.25):
        at, radius = button_end - 0.5 * button, min(0.35 * button, 0.9 * half)
        wheel = rod(at, 0, (top + 0.001, top + 0.004), radius, sections=20)
        wheel += union(
            rod(at + radius * cos(a), radius * sin(a), (top + 0.001, top + 0.0034), 0.14 * radius, sections=6)
            for a in np.arange(12) * np.pi / 6
        )
        cutter.add("wheel", wheel, continuous("blade", (0, 0, 1), (at, 0, top)))
    return cutter


def _body(draws: Draws, c: _Case) -> Solid:
    """Floor, two sides and two lips that leave a slot along the top, closed over it at the back."""
    front, back, half, height = c.front, c.end, c.half, c.height
    mouth = c.nose * draws.number("mouth", (0.0, 0.4))  # one side of the channel begins further back
    narrow = c.inner + 0.3 * (half - c.inner)
    outer = np.array([(front, narrow), (front + c.nose, half), (back, half)])
    bulge, bulges = half * draws.number("bulge", (0.0, 0.6)), draws.chance("bulges", 0.5)
    plan = np.concatenate([outer, outer * (1, -1)])
    solid = prism(plan, 0.12 * height, c.channel - GAP) + prism(plan * (0.99, 0.86), 0.0, 0.2 * height)
    for side in (-1, 1):
        inside = np.array([(back, c.inner), (front + mouth * (side < 0), c.inner)])
        solid += prism(np.concatenate([outer, inside]) * (1, side), 0.12 * height, 0.88 * height)
        lip = np.array([(front + c.nose, c.slot + GAP), (back, c.slot + GAP)])
        solid += prism(np.concatenate([outer, lip]) * (1, side), c.roof, 0.9 * height)
        solid += prism(np.concatenate([outer * (0.99, 0.86), lip * (0.99, 1.0)]) * (1, side), 0.85 * height, height)
    tail = 0.004
    if c.capped:
        solid += box((back - tail, back), half, (c.roof, 0.9 * height))
    else:
        outline = rounded_rectangle((back - 2 * tail, -half), (back + 0.3 * half, half), 0.6 * half)
        solid += prism(outline[outline[:, 0] > back - tail - 1e-6], 0.05 * height, 0.95 * height)
    grooved = 0.15 + 0.04 * draws.integer("groove_span", 0, 6)
    for x in np.linspace(0.15, grooved, draws.integer("grooves", 0, 5)):
        at = front + c.nose + x * (back - front)
        for side in (-1, 1):
            rib = (at, side * half)  # no deeper than the wall
            solid += cylinder((*rib, 0.2 * height), (*rib, 0.8 * height), min(0.0014, 0.8 * c.wall), sections=8)
    if bulges:
        start, stop = front + c.nose + 0.3 * (back - front), back - 0.005
        grip = np.array([(start, half - 0.001), (start + 0.02, half + bulge), (stop - 0.02, half + bulge),
                         (stop, half - 0.001)])  # fmt: skip
        solid += union(prism(grip * (1, side), 0.2 * height, 0.8 * height) for side in (-1, 1))
    return solid


def _button(draws: Draws, start: float, end: float, top: float, c: _Case) -> Solid:
    """Stem through the slot and a ribbed button above it."""
    solid = box((start, end), c.slot, (c.roof - GAP - 0.0008, top - 0.0005))
    wide = min(c.slot * draws.number("button_width", (1.2, 2.2)), 0.9 * c.half)
    solid += box((start, end), wide, (c.height + GAP, top), fillet=0.002)
    for x in np.linspace(start + 0.003, end - 0.003, draws.integer("button_ribs", 0, 5)):
        solid += box(about(x, 0.0006), 0.9 * wide, (top - 0.001, top + 0.0005))
    return solid
