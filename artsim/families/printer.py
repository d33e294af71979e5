"""Printers that face -X: table-top and floor-standing ones, with scanners or without.

What varies: size and kind (inkjet, laser, copier, photo and label printers); the bands of the front from the bottom up:
paper drawers, a flap or a sliding tray before the output, a door, a panel with keys that is fixed or tilts; the top: a
scanner's lid with or without a feeder and its tray, an output slope with a stop, a cover; a paper support at the back;
round edges, feet, casters.
"""

from dataclasses import dataclass

import numpy as np

from artsim.families.keys import add_key, front_face, key_cells, key_outline, top_face
from artsim.making.assembly import Assembly, Rng, pick, prismatic, revolute
from artsim.making.outlines import FRONT, about, rounded_rectangle
from artsim.making.solids import Solid, box, hull, posts, prism, rod, tray, union
from artsim.model.kinematics import Array

GAP = 0.002
SHELF = 0.005


@dataclass(frozen=True, eq=False)
class _Case:
    """The body, seen from above."""

    x: float  # half of the depth and of the width
    y: float  # half of the depth and of the width
    outline: Array  # (N, 2) rounded rectangle of x and y

    def block(
        self, low: float, high: float, x: tuple[float, float] = (-9.0, 9.0), y: tuple[float, float] = (-9.0, 9.0)
    ) -> Solid:
        """The body between two heights, cut to a range of x and of y."""
        return prism(np.clip(self.outline, (x[0], y[0]), (x[1], y[1])), low, high)

    def around(self, low: float, high: float, half: float, depth: float) -> Solid:
        """The body between two heights with a niche in front, ``depth`` deep, that reaches ``half`` to either side."""
        inner = -self.x + depth
        return (self.block(low, high, (inner, 9.0)) + self.block(low, high, (-9.0, inner + 1e-3), (half, 9.0))
                + self.block(low, high, (-9.0, inner + 1e-3), (-9.0, -half)))  # fmt: skip


@dataclass(frozen=True)
class _Band:
    """A band of the front: what fills it and how high it is."""

    kind: str
    height: float


def build(rng: Rng) -> Assembly:
    """A printer; drawers, lids and flaps are shut and no key is pressed at rest."""
    kind = pick(rng, {"inkjet": 0.4, "laser": 0.24, "copier": 0.18, "small": 0.18})
    size = {
        "inkjet": ((0.14, 0.17), (0.26, 0.28)),
        "laser": ((0.15, 0.16), (0.26, 0.28)),
        "copier": ((0.22, 0.22), (0.36, 0.4)),
        "small": ((0.05, 0.05), (0.13, 0.13)),
    }[kind]
    x, y = rng.uniform(*size)
    radius = min(x, y) * rng.choice([rng.uniform(0.01, 0.1), rng.uniform(0.1, 0.35)])
    case = _Case(x, y, rounded_rectangle((-x, -y), (x, y), radius, 3))
    foot = rng.uniform(0.02, 0.05) if kind == "copier" else rng.uniform(0.002, 0.012)
    bands = _bands(rng, kind, min(x, y))
    levels = foot + SHELF + np.concatenate([[0.0], np.cumsum([band.height + SHELF for band in bands])])
    body = case.block(foot, foot + SHELF) + _feet(case, foot, kind == "copier")
    half = (y - max(radius * 0.3, 0.008)) * rng.uniform(0.75, 0.98)
    cavity = 2.0 * x * rng.uniform(0.55, 0.85)
    for band, low in zip(bands, levels[:-1], strict=True):
        high = float(low) + band.height
        deep = {"solid": 0.0, "panel": 0.0, "tilting panel": min(0.05, 0.5 * x), "slit": 0.3 * x}.get(band.kind, cavity)
        if deep:
            body += case.around(float(low) - 1e-4, high + 1e-4, half, deep)
        else:
            body += case.block(float(low) - 1e-4, high + 1e-4)
        body += case.block(high, high + SHELF)
    top = float(levels[-1])
    slopes = kind == "laser" and rng.random() < 0.65
    rise = x * rng.uniform(0.15, 0.4)
    if slopes:
        body += _slope(case, top, rise, y * rng.uniform(0.75, 0.9))
    printer = Assembly("body", body, 350.0)
    for number, (band, low) in enumerate(zip(bands, levels[:-1], strict=True)):
        _fill(rng, printer, case, band, number, float(low), half, cavity)
    if slopes:
        _paper_stop(rng, printer, case, top + 0.75 * rise)
    else:
        _lid(rng, printer, case, kind, top)
    return printer


def _bands(rng: Rng, kind: str, size: float) -> list[_Band]:
    """The front from the bottom up."""
    deep = {"inkjet": (0.03, 0.06), "laser": (0.04, 0.08), "copier": (0.09, 0.16), "small": (0.02, 0.04)}[kind]
    drawers = {"inkjet": (0, 3), "laser": (1, 4), "copier": (1, 5), "small": (0, 2)}[kind]
    bands = [_Band("drawer", rng.uniform(*deep)) for _ in range(int(rng.integers(*drawers)))]
    output = size * rng.uniform(0.3, 0.7)
    kinds = {"inkjet": ["flap", "sliding tray", "niche"], "laser": ["flap", "solid", "flap"],
             "copier": ["niche", "flap", "solid"], "small": ["slit", "flap", "sliding tray"]}[kind]  # fmt: skip
    bands.append(_Band(pick(rng, kinds), output))
    if kind == "laser" and rng.random() < 0.5:
        bands.append(_Band("flap", size * rng.uniform(0.3, 0.8)))
    panel = pick(rng, {"panel": 0.45, "tilting panel": 0.35, "solid": 0.2})
    bands.append(_Band(panel, size * rng.uniform(0.2, 0.5)))
    return bands


def _feet(case: _Case, height: float, casters: bool) -> Solid:
    """Four feet, or casters."""
    if casters:
        radius = 0.45 * height
        spots = [(a * 0.75 * case.x, b * 0.75 * case.y) for a in (-1, 1) for b in (-1, 1)]
        return union(
            rod(x, (y - 0.4 * radius, y + 0.4 * radius), radius, radius, sections=14)
            + box(about(x, 0.5 * radius), about(y, 0.6 * radius), (radius, height + 0.001))
            for x, y in spots
        )
    size = 0.1 * min(case.x, case.y)
    return posts(0.75 * case.x, 0.75 * case.y, (0, height + 0.001), 0.8 * size, size, 12)


# --- the front -------------------------------------------------------------------------------------------------------


def _fill(
    rng: Rng, printer: Assembly, case: _Case, band: _Band, number: int, low: float, half: float, cavity: float
) -> None:
    """What moves in a band of the front."""
    front, high = -case.x, low + band.height
    wide = half - GAP
    thick = min(rng.uniform(0.006, 0.014), 0.3 * band.height)
    solid = box((front, front + thick), wide, (low + GAP, high - GAP), fillet=0.03 * wide, axis=0, steps=2)
    if band.kind == "drawer":
        depth = cavity - 2.0 * GAP
        rise = (high - low) * rng.uniform(0.5, 0.85)
        solid += tray((front + 0.5 * thick, -0.96 * wide, low + GAP), (front + depth, 0.96 * wide, low + rise), 0.003)
        solid += _pull(rng, front, 0.35 * wide, low + GAP, high - GAP)
        slide = prismatic("body", FRONT, 0.0, depth * rng.uniform(0.6, 0.9), (front, 0, low))
        printer.add(f"drawer_{number}", solid, slide, density=700.0)
    elif band.kind == "flap":
        if rng.random() < 0.6:
            solid += box((front - 0.006, front + 0.5 * thick), 0.15 * wide, (high - GAP - 0.012, high - GAP - 0.004))
        if rng.random() < 0.4:  # guides for paper on its inner side
            deep = (front + thick - 0.001, front + thick + 0.006)
            tall = (low + 0.2 * band.height, high - 0.1 * band.height)
            solid += union(box(deep, about(s * 0.7 * wide, 0.003), tall) for s in (-1, 1))
        hinge = revolute("body", (0, -1, 0), (front, 0, low + GAP), 0.0, rng.uniform(0.9, 1.55))
        printer.add(f"flap_{number}", solid, hinge, density=900.0)
    elif band.kind == "sliding tray":
        depth = cavity * rng.uniform(0.6, 0.95)
        z = low + GAP
        solid = box((front, front + depth), 0.9 * wide, (z, z + 0.004))
        solid += box((front, front + 0.005), 0.9 * wide, (z, z + min(0.3 * band.height, 0.014)))
        slide = prismatic("body", FRONT, 0.0, 0.85 * depth, (front, 0, low))
        printer.add(f"tray_{number}", solid, slide, density=900.0)
    elif band.kind == "tilting panel":
        hinge = revolute("body", (0, 1, 0), (front, 0, high - GAP), 0.0, rng.uniform(0.4, 1.2))
        name = printer.add(f"panel_{number}", solid, hinge, density=900.0)
        _keys(rng, printer, name, front, wide, low + GAP, high - GAP)
    elif band.kind == "panel":
        _keys(rng, printer, "body", front, half, low, high)


def _pull(rng: Rng, front: float, half: float, low: float, high: float) -> Solid:
    """Handle of a drawer: a lip, a bar or nothing."""
    kind, reach = rng.random(), rng.uniform(0.006, 0.016)
    if kind < 0.35:
        return box((front - reach, front + 0.003), half, (high - 0.3 * (high - low), high - 0.15 * (high - low)))
    if kind < 0.6:
        z = 0.5 * (low + high)
        deep = min(0.2 * (high - low), 0.01)
        return box((front - reach, front + 0.003), half, (z - deep, z + deep), fillet=0.4 * deep, axis=1, steps=2)
    return Solid()


def _keys(rng: Rng, printer: Assembly, parent: str, front: float, half: float, low: float, high: float) -> None:
    """Keys on a panel in front: a group on one side, or on both."""
    face = front_face(front, 0.0, 0.5 * (low + high))
    rise = high - low
    if rise < 0.012:
        return
    rows = int(rng.integers(1, 4)) if rise > 0.035 else 1
    pitch = min(0.85 * rise / rows, 0.03)
    columns = int(rng.integers(1, 6))
    travel = rng.uniform(0.0008, 0.0015)
    outline = key_outline(pick(rng, ["round", "square", "pill"]), (0.68 * pitch, 0.6 * pitch), 10)
    sides = [-1.0, 1.0] if rng.random() < 0.3 else [float(rng.choice([-1.0, 1.0]))]
    columns = min(columns, int(0.6 * half / pitch), 12 // (rows * len(sides)))
    number = 0
    for side in sides:
        middle = side * (0.9 * half - 0.5 * columns * pitch)
        reach = 0.5 * columns * pitch
        for _, _, u, v in key_cells(
            (middle - reach, middle + reach), (-0.45 * rise, 0.45 * rise), max(columns, 1), rows
        ):
            add_key(printer, parent, f"button_{number}", face, (u, v), outline, travel + 0.002, travel)
            number += 1


# --- the top ---------------------------------------------------------------------------------------------------------


def _slope(case: _Case, top: float, rise: float, side: float) -> Solid:
    """The top of a laser printer: walls around a slope for printed paper, which reaches ``side`` to either side."""
    high = top + rise
    solid = case.block(top - 1e-4, high, y=(side, 9.0)) + case.block(top - 1e-4, high, y=(-9.0, -side))
    solid += case.block(top - 1e-4, high, x=(0.75 * case.x, 9.0))
    slope = [(-0.9, top - 1e-4), (0.76, top - 1e-4), (-0.9, top + 0.75 * rise), (-0.2, top + 0.7 * rise)]
    return solid + hull([(x * case.x, s * (side + 1e-4), z) for x, z in slope for s in (-1, 1)])


def _paper_stop(rng: Rng, printer: Assembly, case: _Case, level: float) -> None:
    """A flap that lies on the front end of the slope and folds up, on some."""
    if rng.random() < 0.3:
        return
    thick, z = 0.004, level + GAP
    wide, first = case.y * rng.uniform(0.1, 0.6), -0.86 * case.x
    flap = box((first, rng.uniform(-0.6, -0.3) * case.x), wide, (z, z + thick), fillet=0.008, axis=2, steps=2)
    hinge = revolute("body", (0, -1, 0), (first, 0, z), 0.0, rng.uniform(0.6, 1.6))
    printer.add("paper_stop", flap, hinge, density=900.0)


def _lid(rng: Rng, printer: Assembly, case: _Case, kind: str, top: float) -> None:
    """The lid of a scanner, at times with a feeder; keys before it and a paper support behind it."""
    seam = top + GAP
    back = case.x
    if kind in ("inkjet", "small") and rng.random() < 0.45:
        back = case.x * rng.uniform(0.45, 0.65)
        _paper_support(rng, printer, case, seam, back)
    thick = rng.uniform(0.1, 0.35) * min(case.x, 0.18)
    front = -case.x
    if rng.random() < 0.4:  # a strip with keys before the lid
        front += case.x * rng.uniform(0.2, 0.5)
        _top_keys(rng, printer, case, top, front)
    outline = np.clip(case.outline, (front, -9.0), (back - (0.0 if back == case.x else thick + GAP), 9.0))
    edge = float(outline[:, 0].max())
    shrink = rng.uniform(0.9, 1.0)
    middle = outline.mean(axis=0)
    lid = prism(outline, seam, seam + 0.6 * thick)
    lid += hull(
        [(*p, seam + 0.5 * thick) for p in outline]
        + [(*(middle + shrink * (p - middle)), seam + thick) for p in outline]
    )
    crown = seam + thick
    feeder = back == case.x and kind != "small" and rng.random() < (0.6 if kind == "copier" else 0.35)
    if feeder:
        rise = rng.uniform(0.03, 0.09)
        y0, y1 = 0.15 * case.y, 0.8 * case.y
        deep = (front + 0.15 * case.x, edge - 0.1 * case.x)
        lid += box(deep, (y0, y1), (crown - 0.002, crown + rise), fillet=0.3 * rise, axis=0)
    printer.add("lid", lid, revolute("body", (0, 1, 0), (edge, 0, seam), 0.0, rng.uniform(0.7, 1.5)), density=300.0)
    if feeder:
        z, wide = crown + GAP, 0.6 * (edge - front) * rng.uniform(0.5, 0.9)
        x = 0.5 * (front + edge)
        end = -0.85 * case.y
        solid = box((x - 0.5 * wide, x + 0.5 * wide), (end, y0 - GAP), (z, z + 0.006), fillet=0.01, axis=2)
        turn = revolute("lid", (-1, 0, 0), (x, y0 - GAP, z + 0.006), 0.0, rng.uniform(0.25, 0.9))
        printer.add("feeder_tray", solid, turn, density=600.0)


def _top_keys(rng: Rng, printer: Assembly, case: _Case, top: float, back: float) -> None:
    """Keys on top, before the lid."""
    room = back + case.x
    pitch = min(0.6 * room, 0.03)
    columns = min(int(rng.integers(2, 8)), int(1.2 * case.y / pitch))
    travel = rng.uniform(0.0008, 0.0015)
    outline = key_outline(pick(rng, ["round", "square", "pill"]), (0.7 * pitch, 0.6 * pitch), 10)
    face = top_face(top, -case.x + 0.5 * room, 0.0)
    middle = rng.uniform(-0.3, 0.3) * case.y
    for _, column, u, v in key_cells(
        (middle - 0.5 * columns * pitch, middle + 0.5 * columns * pitch), (-0.01, 0.01), columns, 1
    ):
        add_key(printer, "body", f"top_button_{column}", face, (u, v), outline, travel + 0.002, travel)


def _paper_support(rng: Rng, printer: Assembly, case: _Case, seam: float, front: float) -> None:
    """A flap that lies over the paper's slot at the back and folds up and back."""
    thick, wide = rng.uniform(0.004, 0.01), case.y * rng.uniform(0.5, 0.85)
    solid = box((front + GAP, case.x - 0.004), wide, (seam, seam + thick), fillet=0.01, axis=2)
    x, z = case.x - 0.004, seam + 0.5 * thick
    solid += rod(x, (-wide, wide), z, 0.5 * thick, sections=12)
    hinge = revolute("body", (0, 1, 0), (x, 0, z), 0.0, rng.uniform(1.3, 2.1))
    printer.add("paper_support", solid, hinge, density=800.0)
