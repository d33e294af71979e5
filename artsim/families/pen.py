"""Pens, pencils and markers: a barrel that stands on its tip, with what covers the tip or moves it.

What varies: kind (cap that slides or screws off, one at either end, push button, several sliders, barrel that twists),
length, thickness, cross-section (round, with edges, flat), bulges and grips of the barrel, clip, tip and end.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute, screw
from artsim.making.outlines import UP
from artsim.making.solids import Solid, box, hull, loft, union
from artsim.model.kinematics import Array

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


def build(rng: Rng) -> Assembly:
    """A pen; its long axis is upright. Half of those with a cap stand on their end."""
    length = rng.uniform(0.08, 0.2)
    slim = rng.random() < 0.3
    radius = length * (rng.uniform(0.02, 0.045) if slim else rng.uniform(0.045, 0.14))
    kind = pick(rng, {"cap": 0.42, "button": 0.27, "twist": 0.13, "sliders": 0.09, "two caps": 0.09})
    turning = kind == "twist" or (kind == "cap" and rng.random() < 0.3)
    sides = pick(rng, {_ROUND: 0.5, 3: 0.1, 4: 0.12, 6: 0.18, 8: 0.1})
    flat = 1.0 if rng.random() < 0.6 else rng.uniform(0.4, 1.0)
    # What turns about the barrel's axis is round, or it would run into its neighbour.
    section = _Section(_ROUND, 1.0) if turning else _Section(sides, flat)
    if kind == "cap":
        return _capped(rng, section, length, radius, turning)
    if kind == "two caps":
        return _double(rng, section, length, radius)
    if kind == "twist":
        return _twisted(rng, section, length, radius)
    if kind == "sliders":
        return _sliders(rng, length, max(radius, 0.005))
    return _clicked(rng, section, length, radius)


def _barrel(rng: Rng, low: float, high: float, first: float, last: float) -> Array:
    """(N, 2) radius and height of a barrel between two radii: straight, bulging, waisted or stepped."""
    count = int(rng.choice([2, 4, 6]))
    shares = np.linspace(0.0, 1.0, count)
    radii = first + shares * (last - first)
    swell = rng.uniform(-0.3, 0.45)
    radii = radii * (1.0 + swell * np.square(sin(np.pi * shares)))
    return np.column_stack([radii, low + shares * (high - low)])


def _tip(rng: Rng, section: _Section, radius: float, length: float) -> Solid:
    """What writes, from z = 0 up to where its neck is ``radius`` wide: a cone, a nib, a felt block or a ball."""
    kind = pick(rng, {"cone": 0.45, "nib": 0.15, "felt": 0.2, "stub": 0.2})
    if kind == "nib":
        flat = [(-0.0004, -0.6 * radius, length), (-0.0004, 0.6 * radius, length), (-0.0004, 0.0, 0.0)]
        nib = hull([*flat, *((0.0004, y, z) for _, y, z in flat)])
        return nib + section.rod([(0.55 * radius, 0.55 * length), (radius, length + 0.0002)])
    if kind == "felt":
        felt = section.rod([(0.5 * radius, 0.0), (0.55 * radius, 0.45 * length)])
        return felt + section.rod([(0.8 * radius, 0.4 * length), (radius, length + 0.0002)])
    point = 0.12 * radius if kind == "cone" else 0.3 * radius
    bend = rng.uniform(0.45, 0.75)
    return section.rod([(point, 0.0), (bend * radius, 0.5 * length), (radius, length + 0.0002)])


def _clip(rng: Rng, section: _Section, radius: float, top: float, length: float) -> Solid:
    """A strip beside the barrel, held at its top end, on the side of -X."""
    if rng.random() < 0.2:
        return Solid()
    thick, half = 0.0008 + 0.05 * radius, radius * rng.uniform(0.15, 0.5)
    out = radius * rng.uniform(1.25, 1.7)
    near = -section.flat * radius
    reach = min(near - 0.0008, near - (out - radius))
    strip = box((reach - thick, reach), half, (top - length, top), fillet=0.4 * thick, axis=1)
    if rng.random() < 0.5:  # it narrows to a ball at the free end
        ball = 1.1 * thick
        ends = ((1.0, top), (0.5, top - length))
        strip = hull([(reach - a, s * half * w, z) for a in (0.0, thick) for s in (-1, 1) for w, z in ends])
        deep = (reach - thick, min(reach + 0.5 * thick, near - GAP))
        strip += box(deep, ball, (top - length, top - length + 2 * ball), fillet=0.4 * ball)
    return strip + box((reach - 0.5 * thick, 0.4 * near), 0.8 * half, (top - 1.6 * thick, top))


def _capped(rng: Rng, section: _Section, length: float, radius: float, turning: bool) -> Assembly:
    """A body with a cap over its tip, which slides off or unscrews."""
    covered = length * rng.uniform(0.18, 0.6)
    wall = radius * rng.uniform(0.1, 0.18)
    flush = rng.random() < 0.5
    outer = radius * (1.0 if flush else rng.uniform(1.04, 1.25))
    inner = outer - wall
    neck = inner - GAP - 0.02 * radius
    tip = min(covered * rng.uniform(0.3, 0.7), 5.0 * radius)
    body = _tip(rng, section, 0.55 * neck, tip).moved((0, 0, 0.002))
    body += section.rod([(0.55 * neck, tip + 0.002), (neck, min(tip + 0.004, covered)), (neck, covered + 0.001)])
    profile = _barrel(rng, covered, length, radius, radius * rng.uniform(0.55, 1.0))
    body += section.rod(profile)
    end = rng.uniform(0.1, 1.0) * profile[-1, 0]
    body += section.rod([(profile[-1, 0], length - 0.0002), (end, length + rng.uniform(0.2, 1.5) * radius)])

    # The cap reaches from the barrel's shoulder past the tip; its lower end is closed.
    close = rng.uniform(0.0, 1.2) * radius
    taper = rng.uniform(0.8, 1.15) if not flush else 1.0
    bottom, widest = -0.001, max(outer * taper, inner + 0.5 * wall)
    cap = section.sleeve(inner, [(widest, bottom), (outer, covered - GAP)])
    cap += section.rod([(widest * rng.uniform(0.4, 1.0), bottom - max(close, wall)), (widest, bottom + 0.0002)])
    clip = _clip(rng, section, max(outer, widest), 0.0, covered * rng.uniform(0.55, 0.95))
    if clip.pieces:  # its root is at the closed end
        cap += clip.mirrored(2).moved((0, 0, bottom + 0.0002))
    if rng.random() < 0.3:  # a band around the mouth
        band = max(outer, widest) * 1.08
        cap += section.sleeve(inner, [(band, covered - GAP - 0.4 * radius), (band, covered - GAP)])
    travel = covered * rng.uniform(1.0, 1.3) + radius
    over = rng.random() < 0.5

    def place(solid: Solid) -> Solid:
        return solid.turned((1, 0, 0), np.pi) if over else solid

    down = (0.0, 0.0, 1.0 if over else -1.0)
    pen = Assembly("body", place(body), 1100.0)
    if turning:
        turns = 2.0 * np.pi * rng.uniform(1.0, 4.0)
        joint = screw("body", down, (0.0, 0.0, 0.0), 0.0, turns, travel / turns)
    else:
        joint = prismatic("body", down, 0.0, travel)
    pen.add("cap", place(cap), joint, density=1000.0)
    return pen


def _double(rng: Rng, section: _Section, length: float, radius: float) -> Assembly:
    """A marker with a tip and a cap at either end."""
    wall = 0.12 * radius
    wide = radius * rng.uniform(0.85, 1.15)
    pen = Assembly("body", section.rod(_barrel(rng, -0.25 * length, 0.25 * length, wide, wide)), 1000.0)
    for side in (-1, 1):
        covered = length * rng.uniform(0.16, 0.25)
        neck = (radius - wall - GAP) * 0.97
        tip = min(0.6 * covered, 3.0 * radius)
        half = _tip(rng, section, 0.6 * neck, tip)
        half += section.rod([(0.6 * neck, tip), (neck, tip + 0.001), (neck, covered + 0.001)])
        half = half.moved((0, 0, -covered - 0.25 * length))
        low = -covered - 0.25 * length - 0.001
        cap = section.sleeve(radius - wall, [(radius * rng.uniform(0.95, 1.1), low), (radius, -0.25 * length - GAP)])
        cap += section.rod(
            [(radius * rng.uniform(0.4, 0.9), low - rng.uniform(0.2, 1.2) * radius), (0.94 * radius, low + 0.0003)]
        )
        travel = covered + radius
        pen.body += half if side < 0 else half.mirrored(2)
        slide = prismatic("body", (0.0, 0.0, float(side)), 0.0, travel)
        pen.add_numbered("cap", cap if side < 0 else cap.mirrored(2), slide)
    return pen


def _shell(rng: Rng, section: _Section, length: float, radius: float, bore: float) -> tuple[Solid, float]:
    """Barrel with a bore at the bottom for the refill; returns it and how far up the bore goes."""
    cone = min(length * rng.uniform(0.08, 0.25), 5.0 * radius)
    waist = radius * rng.uniform(0.75, 1.0)
    mouth = max(bore + 0.1 * radius, rng.uniform(0.3, 0.55) * radius)
    low = section.sleeve(bore, [(mouth, 0.0), (waist, cone)])
    profile = _barrel(rng, cone, length, waist, radius)
    shell = low + section.rod(profile)
    if rng.random() < 0.4:  # rings of a grip
        for z in cone + np.linspace(0.05, 0.3, int(rng.integers(3, 7))) * (length - cone):
            at = float(np.interp(z, profile[:, 1], profile[:, 0])) * rng.uniform(1.06, 1.14)
            shell += section.rod([(at, z), (at, z + 0.25 * radius)])
    return shell, cone


def _clicked(rng: Rng, section: _Section, length: float, radius: float) -> Assembly:
    """A button at the end, which sometimes pushes the tip out; it may be a second one at the side instead."""
    bore = 0.22 * radius
    shell, cone = _shell(rng, section, length, radius, bore)
    out = radius * rng.uniform(0.8, 2.6)
    travel = out * rng.uniform(0.35, 0.8)
    push = radius * rng.uniform(0.35, 0.85)
    wide = rng.random() < 0.25
    collar = rng.uniform(0.3, 1.5) * radius
    shell += _clip(rng, section, radius, length, length * rng.uniform(0.2, 0.45))
    shell += section.sleeve(push + GAP, [(radius, length - 0.0002), (radius * rng.uniform(0.85, 1.0), length + collar)])
    pen = Assembly("body", shell, 1100.0)
    # The button stands in the collar with room below for its travel.
    reach = max(collar - travel - GAP, 0.0) if collar > travel + 2 * GAP else 0.0
    low = length + collar - reach if reach > 0 else length + travel + GAP
    top = max(length + collar, low) + out
    button = section.rod([(push, low), (push * rng.uniform(0.8, 1.0), top)])
    if wide and top - 0.35 * out - travel > length + collar + GAP:  # an eraser or a disc on it
        button += section.rod([(1.3 * push, top - 0.35 * out), (1.2 * push, top)])
    pen.add("button", button, prismatic("body", (0, 0, -1), 0.0, travel * 0.98, (0, 0, top)), density=1000.0)
    if cone > 3.0 * travel:
        wide_bore = 0.9 * bore - 0.0001
        refill = section.rod([(0.35 * bore, -0.5 * travel), (wide_bore, 0.4 * cone), (wide_bore, cone - travel)])
        joint = prismatic("body", (0, 0, -1), 0.0, travel * 0.98, mimic=("button", 1.0))
        pen.add("tip", refill.moved((0, 0, 0.5 * travel)), joint, density=2000.0)
    return pen


def _twisted(rng: Rng, section: _Section, length: float, radius: float) -> Assembly:
    """An upper barrel that turns on the lower one, which carries the tip."""
    split = length * rng.uniform(0.35, 0.7)
    tip = min(length * rng.uniform(0.06, 0.2), 5.0 * radius)
    band = radius * rng.uniform(1.0, 1.2)
    body = _tip(rng, section, 0.5 * radius, tip)
    profile = _barrel(rng, tip, split, 0.5 * radius, radius)
    body += section.rod(profile) + section.rod([(band, split - 0.5 * radius), (band, split)])
    upper = section.rod(_barrel(rng, split + GAP, length, radius, radius * rng.uniform(0.6, 1.0)))
    last = upper.bounds()[1, 1] * rng.uniform(0.2, 0.6)
    upper += section.rod(
        [(last, length - 0.0002), (last * rng.uniform(0.3, 1.0), length + rng.uniform(0.1, 2.0) * radius)]
    )
    upper += _clip(rng, section, radius, length, (length - split) * rng.uniform(0.5, 0.9))
    pen = Assembly("body", body, 1100.0)
    if rng.random() < 0.5:
        joint = continuous("body", UP, (0, 0, split))
    else:
        joint = revolute("body", UP, (0, 0, split), 0.0, rng.uniform(1.5, 2.0 * np.pi))
    pen.add("barrel", upper, joint)
    return pen


def _sliders(rng: Rng, length: float, radius: float) -> Assembly:
    """A pen of several colours: sliders in slots around its end."""
    section = _Section(_ROUND, 1.0)
    count = int(rng.integers(2, 7))
    tip = min(length * rng.uniform(0.08, 0.2), 4.0 * radius)
    start = length * rng.uniform(0.55, 0.7)
    body = _tip(rng, section, 0.6 * radius, tip)
    body += section.rod(_barrel(rng, tip, start, 0.6 * radius, radius))
    core = 0.55 * radius
    body += section.rod([(core, start - 0.001), (core, length)])
    body += section.rod([(radius, length - 0.4 * radius), (radius * rng.uniform(0.5, 0.95), length + radius)])
    half = min(0.28 * np.pi / count, 0.5) * radius
    for k in range(count):  # ribs between the slots
        rib = box((-0.98 * radius, 0.0), 0.4 * half, (start - 0.001, length - 0.2 * radius))
        body += rib.turned(UP, 2.0 * np.pi * (k + 0.5) / count)
    body += _clip(rng, section, radius, length + 0.3 * radius, (length - start) * 0.9).turned(UP, np.pi / count)
    pen = Assembly("body", body, 1100.0)
    room = length - 0.4 * radius - start - 2 * GAP
    size = room * rng.uniform(0.3, 0.5)
    for k in range(count):
        top = length - 0.4 * radius - GAP
        half_here = min(half, 0.3 * core)
        slider = box((-1.0 * radius, -core - GAP), half_here, (top - size, top))
        slider += box((-1.25 * radius, -0.9 * radius), half_here, (top - 0.5 * size, top), fillet=0.2 * half_here)
        angle = 2.0 * np.pi * k / count
        origin = (-radius * cos(angle), -radius * sin(angle), top)
        slide = prismatic("body", (0, 0, -1), 0.0, (room - size) * 0.95, origin)
        pen.add(f"slider_{k}", slider.turned(UP, angle), slide, density=1000.0)
    return pen
