"""Pens, pencils and markers: a barrel that stands on its tip, with what covers the tip or moves it.

What varies: kind (cap that slides or screws off, one at either end, push button, several sliders, barrel that twists),
length, thickness, cross-section (round, with edges, flat), bulges and grips of the barrel, clip, tip and end.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, prismatic, screw, swivel
from artsim.making.draws import Draws
from artsim.making.outlines import UP, Array
from artsim.making.solids import Solid, box, hull, loft, union

GAP = 0.0004
_ROUND = 16  # sides of a barrel that looks round


@dataclass(frozen=True)
class _Section:
    """Cross-section that all pieces of a pen share: a polygon, drawn out along Y."""

    sides: int
    flat: float  # width along X over that along Y

    def rod(self, profile: Sequence[tuple[float, float]] | Array) -> Solid:
        """Full body with (radius, height) from the bottom up."""
        return loft([r * self._outline() + (0.0, 0.0, z) for r, z in profile])

    def sleeve(self, inner: float, profile: Sequence[tuple[float, float]] | Array) -> Solid:
        """Pipe with a straight bore."""
        outline = self._outline()
        solid = Solid()
        for (r0, z0), (r1, z1) in pairwise(profile):
            rings = [r * outline + (0.0, 0.0, z) for r, z in ((inner, z0), (r0, z0), (inner, z1), (r1, z1))]
            solid += union(hull([ring[k - j] for ring in rings for j in (0, 1)]) for k in range(self.sides))
        return solid

    def _outline(self) -> Array:
        """(sides, 3) corners at radius 1."""
        angles = (np.arange(self.sides) + 0.5) * 2.0 * np.pi / self.sides
        return np.column_stack([self.flat * cos(angles), sin(angles), np.zeros(self.sides)])


def build(draws: Draws) -> Assembly:
    """A pen; its long axis is upright. Half of those with a cap stand on their end."""
    length, slim = draws.log_length("length", 0.127, -0.6, 0.5), draws.chance("slim", 0.3)
    radius = length * draws.number("width", (0.02, 0.045) if slim else (0.045, 0.14))
    kind = draws.pick("kind", {"cap": 0.42, "button": 0.27, "twist": 0.13, "sliders": 0.09, "double": 0.09})
    turning = kind == "twist" or (kind == "cap" and draws.chance("cap_screws", 0.3))
    sides = draws.pick("sides", {_ROUND: 0.5, 3: 0.1, 4: 0.12, 6: 0.18, 8: 0.1})
    flat = 1.0 if draws.chance("even", 0.6) else draws.number("flatness", (0.4, 1.0))
    # What turns about the barrel's axis is round, or it would run into its neighbour.
    section = _Section(_ROUND, 1.0) if turning else _Section(sides, flat)
    if kind == "cap":
        return _capped(draws, section, length, radius, turning)
    if kind == "double":
        return _double(draws, section, length, radius)
    if kind == "twist":
        return _twisted(draws, section, length, radius)
    if kind == "sliders":
        return _sliders(draws, length, max(radius, 0.005))
    return _clicked(draws, section, length, radius)


def _barrel(draws: Draws, low: float, high: float, first: float, last: float) -> Array:
    """(N, 2) radius and height of a barrel between two radii: straight, bulging, waisted or stepped."""
    shares = np.linspace(0.0, 1.0, draws.pick("barrel_points", [2, 4, 6]))
    radii = first + shares * (last - first)
    radii = radii * (1.0 + draws.number("barrel_swell", (-0.3, 0.45)) * np.square(sin(np.pi * shares)))
    return np.column_stack([radii, low + shares * (high - low)])


def _tip(draws: Draws, section: _Section, radius: float, length: float) -> Solid:
    """What writes, from z = 0 up to where its neck is ``radius`` wide: a cone, a nib, a felt block or a ball."""
    kind = draws.pick("point", {"cone": 0.45, "nib": 0.15, "felt": 0.2, "stub": 0.2})
    neck = (radius, length + 0.0002)
    if kind == "nib":
        flat = [(-0.6 * radius, length), (0.6 * radius, length), (0.0, 0.0)]
        nib = hull([(x, y, z) for x in (-0.0004, 0.0004) for y, z in flat])
        return nib + section.rod([(0.55 * radius, 0.55 * length), neck])
    if kind == "felt":
        felt = section.rod([(0.5 * radius, 0.0), (0.55 * radius, 0.45 * length)])
        return felt + section.rod([(0.8 * radius, 0.4 * length), neck])
    point = 0.12 * radius if kind == "cone" else 0.3 * radius
    return section.rod([(point, 0.0), (draws.number("point_bend", (0.45, 0.75)) * radius, 0.5 * length), neck])


def _clip(draws: Draws, section: _Section, radius: float, top: float, length: float) -> Solid:
    """A strip beside the barrel, held at its top end, on the side of -X."""
    if not draws.chance("clip", 0.8, upper=True):
        return Solid()
    thick, half = 0.0008 + 0.05 * radius, radius * draws.number("clip_width", (0.15, 0.5))
    out = radius * draws.number("clip_reach", (1.25, 1.7))
    near = -section.flat * radius
    reach = min(near - 0.0008, near - (out - radius))
    strip = box((reach - thick, reach), half, (top - length, top), fillet=0.4 * thick, axis=1)
    if draws.chance("clip_ball", 0.5):  # it narrows to a ball at the free end
        ball = 1.1 * thick
        ends = ((1.0, top), (0.5, top - length))
        strip = hull([(reach - a, s * half * w, z) for a in (0.0, thick) for s in (-1, 1) for w, z in ends])
        deep = (reach - thick, min(reach + 0.5 * thick, near - GAP))
        strip += box(deep, ball, (top - length, top - length + 2 * ball), fillet=0.4 * ball)
    return strip + box((reach - 0.5 * thick, 0.4 * near), 0.8 * half, (top - 1.6 * thick, top))


def _capped(draws: Draws, section: _Section, length: float, radius: float, turning: bool) -> Assembly:
    """A body with a cap over its tip, which slides off or unscrews."""
    covered = length * draws.number("cap_length", (0.18, 0.6))
    wall, flush = radius * draws.number("cap_wall", (0.1, 0.18)), draws.chance("cap_flush", 0.5)
    outer = radius * (1.0 if flush else draws.number("cap_width", (1.04, 1.25)))
    inner = outer - wall
    neck = inner - GAP - 0.02 * radius
    tip = min(covered * draws.number("point_length", (0.3, 0.7)), 5.0 * radius)
    body = _tip(draws, section, 0.55 * neck, tip).moved((0, 0, 0.002))
    body += section.rod([(0.55 * neck, tip + 0.002), (neck, min(tip + 0.004, covered)), (neck, covered + 0.001)])
    profile = _barrel(draws, covered, length, radius, radius * draws.number("end_width", (0.55, 1.0)))
    last = profile[-1, 0]
    end, rise = draws.number("end_taper", (0.1, 1.0)) * last, draws.number("end_length", (0.2, 1.5)) * radius
    body += section.rod(profile) + section.rod([(last, length - 0.0002), (end, length + rise)])

    # The cap reaches from the barrel's shoulder past the tip; its lower end is closed.
    close = draws.number("cap_end_length", (0.0, 1.2)) * radius
    taper = 1.0 if flush else draws.number("cap_taper", (0.8, 1.15))
    bottom, widest = -0.001, max(outer * taper, inner + 0.5 * wall)
    cap = section.sleeve(inner, [(widest, bottom), (outer, covered - GAP)])
    last = widest * draws.number("cap_end_width", (0.4, 1.0))
    cap += section.rod([(last, bottom - max(close, wall)), (widest, bottom + 0.0002)])
    long = covered * draws.number("clip_length", (0.55, 0.95))
    # The clip's root is at the closed end.
    cap += _clip(draws, section, max(outer, widest), 0.0, long).mirrored(2).moved((0, 0, bottom + 0.0002))
    if draws.chance("cap_band", 0.3):  # around the mouth
        band = max(outer, widest) * 1.08
        cap += section.sleeve(inner, [(band, covered - GAP - 0.4 * radius), (band, covered - GAP)])
    travel, over = covered * draws.number("cap_travel", (1.0, 1.3)) + radius, draws.chance("upside_down", 0.5)

    def place(solid: Solid) -> Solid:
        return solid.turned((1, 0, 0), np.pi) if over else solid

    down = (0.0, 0.0, 1.0 if over else -1.0)
    pen = Assembly("body", place(body), 1100.0)
    if turning:
        turns = 2.0 * np.pi * draws.number("cap_turns", (1.0, 4.0))
        joint = screw("body", down, (0.0, 0.0, 0.0), 0.0, turns, travel / turns)
    else:
        joint = prismatic("body", down, 0.0, travel)
    pen.add("cap", place(cap), joint, density=1000.0)
    return pen


def _double(draws: Draws, section: _Section, length: float, radius: float) -> Assembly:
    """A marker with a tip and a cap at either end."""
    wall = 0.12 * radius
    wide = radius * draws.number("barrel_width", (0.85, 1.15))
    pen = Assembly("body", section.rod(_barrel(draws, -0.25 * length, 0.25 * length, wide, wide)), 1000.0)
    for side in (-1, 1):
        covered = length * draws.number("cap_length", (0.16, 0.25))
        neck = (radius - wall - GAP) * 0.97
        tip = min(0.6 * covered, 3.0 * radius)
        half = _tip(draws, section, 0.6 * neck, tip)
        half += section.rod([(0.6 * neck, tip), (neck, tip + 0.001), (neck, covered + 0.001)])
        half = half.moved((0, 0, -covered - 0.25 * length))
        low = -covered - 0.25 * length - 0.001
        widest = radius * draws.number("cap_taper", (0.95, 1.1))
        cap = section.sleeve(radius - wall, [(widest, low), (radius, -0.25 * length - GAP)])
        end = radius * draws.number("cap_end_width", (0.4, 0.9))
        close = draws.number("cap_end_length", (0.2, 1.2)) * radius
        cap += section.rod([(end, low - close), (0.94 * radius, low + 0.0003)])
        pen.body += half if side < 0 else half.mirrored(2)
        slide = prismatic("body", (0.0, 0.0, float(side)), 0.0, covered + radius)
        pen.add_numbered("cap", cap if side < 0 else cap.mirrored(2), slide)
    return pen


def _clicked(draws: Draws, section: _Section, length: float, radius: float) -> Assembly:
    """A button at the end, which sometimes pushes the tip out of a bore at the bottom."""
    bore = 0.22 * radius
    cone = min(length * draws.number("point_length", (0.08, 0.25)), 5.0 * radius)
    waist = radius * draws.number("waist", (0.75, 1.0))
    mouth = max(bore + 0.1 * radius, draws.number("mouth", (0.3, 0.55)) * radius)
    profile = _barrel(draws, cone, length, waist, radius)
    shell = section.sleeve(bore, [(mouth, 0.0), (waist, cone)]) + section.rod(profile)
    if draws.chance("grip", 0.4):  # of rings
        for z in cone + np.linspace(0.05, 0.3, draws.integer("grip_rings", 3, 6)) * (length - cone):
            at = float(np.interp(z, profile[:, 1], profile[:, 0])) * draws.number("grip_width", (1.06, 1.14))
            shell += section.rod([(at, z), (at, z + 0.25 * radius)])
    out = radius * draws.number("button_length", (0.8, 2.6))
    travel = out * draws.number("button_travel", (0.35, 0.8))
    push, wide = radius * draws.number("button_width", (0.35, 0.85)), draws.chance("button_disc", 0.25)
    collar = draws.number("collar_length", (0.3, 1.5)) * radius
    shell += _clip(draws, section, radius, length, length * draws.number("clip_length", (0.2, 0.45)))
    rim = radius * draws.number("collar_width", (0.85, 1.0))
    shell += section.sleeve(push + GAP, [(radius, length - 0.0002), (rim, length + collar)])
    pen = Assembly("body", shell, 1100.0)
    # The button stands in the collar with room below for its travel.
    reach = max(collar - travel - GAP, 0.0) if collar > travel + 2 * GAP else 0.0
    low = length + collar - reach if reach > 0 else length + travel + GAP
    top = max(length + collar, low) + out
    button = section.rod([(push, low), (push * draws.number("button_taper", (0.8, 1.0)), top)])
    if wide and top - 0.35 * out - travel > length + collar + GAP:  # an eraser or a disc on it
        button += section.rod([(1.3 * push, top - 0.35 * out), (1.2 * push, top)])
    pen.add("button", button, prismatic("body", (0, 0, -1), 0.0, travel * 0.98, (0, 0, top)), density=1000.0)
    if cone > 3.0 * travel:
        wide_bore = 0.9 * bore - 0.0001
        refill = section.rod([(0.35 * bore, -0.5 * travel), (wide_bore, 0.4 * cone), (wide_bore, cone - travel)])
        joint = prismatic("body", (0, 0, -1), 0.0, travel * 0.98, mimic=("button", 1.0))
        pen.add("tip", refill.moved((0, 0, 0.5 * travel)), joint, density=2000.0)
    return pen


def _twisted(draws: Draws, section: _Section, length: float, radius: float) -> Assembly:
    """An upper barrel that turns on the lower one, which carries the tip."""
    split = length * draws.number("split", (0.35, 0.7))
    tip = min(length * draws.number("point_length", (0.06, 0.2)), 5.0 * radius)
    band = radius * draws.number("band_width", (1.0, 1.2))
    body = _tip(draws, section, 0.5 * radius, tip) + section.rod(_barrel(draws, tip, split, 0.5 * radius, radius))
    body += section.rod([(band, split - 0.5 * radius), (band, split)])
    end = radius * draws.number("end_width", (0.6, 1.0))
    upper = section.rod(_barrel(draws.within("upper"), split + GAP, length, radius, end))
    last = upper.bounds()[1, 1] * draws.number("stub_width", (0.2, 0.6))
    taper, rise = draws.number("end_taper", (0.3, 1.0)), draws.number("end_length", (0.1, 2.0)) * radius
    upper += section.rod([(last, length - 0.0002), (last * taper, length + rise)])
    upper += _clip(draws, section, radius, length, (length - split) * draws.number("clip_length", (0.5, 0.9)))
    pen = Assembly("body", body, 1100.0)
    limit = None if draws.chance("turns_freely", 0.5) else draws.angle("barrel_angle", (1.5, 2.0 * np.pi))
    pen.add("barrel", upper, swivel("body", UP, (0, 0, split), limit, 0.0))
    return pen


def _sliders(draws: Draws, length: float, radius: float) -> Assembly:
    """A pen of several colours: sliders in slots around its end."""
    section = _Section(_ROUND, 1.0)
    count = draws.integer("sliders", 2, 6)
    tip = min(length * draws.number("point_length", (0.08, 0.2)), 4.0 * radius)
    start = length * draws.number("split", (0.55, 0.7))
    body = _tip(draws, section, 0.6 * radius, tip) + section.rod(_barrel(draws, tip, start, 0.6 * radius, radius))
    core = 0.55 * radius
    body += section.rod([(core, start - 0.001), (core, length)])
    end = radius * draws.number("end_width", (0.5, 0.95))
    body += section.rod([(radius, length - 0.4 * radius), (end, length + radius)])
    half = min(0.28 * np.pi / count, 0.5) * radius
    rib = box((-0.98 * radius, 0.0), 0.4 * half, (start - 0.001, length - 0.2 * radius))  # between two slots
    body += union(rib.turned(UP, 2.0 * np.pi * (k + 0.5) / count) for k in range(count))
    body += _clip(draws, section, radius, length + 0.3 * radius, (length - start) * 0.9).turned(UP, np.pi / count)
    pen = Assembly("body", body, 1100.0)
    top = length - 0.4 * radius - GAP
    room = length - 0.4 * radius - start - 2 * GAP
    size = room * draws.number("slider_length", (0.3, 0.5))
    half = min(half, 0.3 * core)
    slider = box((-1.0 * radius, -core - GAP), half, (top - size, top))
    slider += box((-1.25 * radius, -0.9 * radius), half, (top - 0.5 * size, top), fillet=0.2 * half)
    for k in range(count):
        angle = 2.0 * np.pi * k / count
        origin = (-radius * cos(angle), -radius * sin(angle), top)
        slide = prismatic("body", (0, 0, -1), 0.0, (room - size) * 0.95, origin)
        pen.add(f"slider_{k}", slider.turned(UP, angle), slide, density=1000.0)
    return pen
