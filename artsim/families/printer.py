"""Printers that face -X: table-top and floor-standing ones, with scanners or without.

What varies: the kind; the bands of the front from the bottom up: paper drawers, a flap or a sliding tray, a panel with
keys that is fixed or tilts; the top: a scanner's lid, a feeder, an output slope with a stop, a paper support.
"""

from dataclasses import dataclass

import numpy as np

from artsim.families.details import drawn_from
from artsim.families.keys import add_buttons, front_face, key_cells, key_outline, top_face
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.draws import Draws, Interval
from artsim.making.outlines import FRONT, Array, about, lifted, rounded_rectangle
from artsim.making.solids import Solid, box, hull, posts, prism, rod, tray, union

GAP = 0.002
SHELF = 0.005
_MEASURES = {
    "inkjet": ((0.28, 0.52), (0.34, 0.56)),
    "laser": ((0.3, 0.52), (0.32, 0.56)),
    "copier": ((0.44, 0.72), (0.44, 0.8)),
    "small": ((0.1, 0.26), (0.1, 0.26)),
}
"""Depth and width, metres."""
_DRAWERS = {"inkjet": ((0.03, 0.06), (0, 2)), "laser": ((0.04, 0.08), (1, 3)), "copier": ((0.09, 0.16), (1, 4)),
            "small": ((0.02, 0.04), (0, 1))}  # fmt: skip
"""Height of the drawers, metres, and how many there are."""
_OUTPUTS = {"inkjet": ["flap", "tray", "niche"], "laser": ["flap", "solid", "flap"],
            "copier": ["niche", "flap", "solid"], "small": ["slit", "flap", "tray"]}  # fmt: skip
"""What the band where paper comes out may be."""


@dataclass(frozen=True, eq=False)
class _Case:
    """The body, seen from above."""

    x: float  # half of the depth
    y: float  # half of the width
    outline: Array  # (N, 2) rounded rectangle of x and y

    def block(self, low: float, high: float, x: Interval = (-9.0, 9.0), y: Interval = (-9.0, 9.0)) -> Solid:
        """The body between two heights, cut to a range of x and of y."""
        return prism(np.clip(self.outline, (x[0], y[0]), (x[1], y[1])), low, high)

    def around(self, low: float, high: float, half: float, depth: float) -> Solid:
        """The body between two heights with a niche in front, ``depth`` deep, that reaches ``half`` to either side."""
        inner = -self.x + depth
        return (self.block(low, high, (inner, 9.0)) + self.block(low, high, (-9.0, inner + 1e-3), (half, 9.0))
                + self.block(low, high, (-9.0, inner + 1e-3), (-9.0, -half)))  # fmt: skip


def build(draws: Draws) -> Assembly:
    """A printer; drawers, lids and flaps are shut and no key is pressed at rest."""
    kind = draws.pick("kind", {"inkjet": 0.4, "laser": 0.24, "copier": 0.18, "small": 0.18})
    depths, widths = _MEASURES[kind]
    x, y = 0.5 * draws.length("depth", depths), 0.5 * draws.length("width", widths)
    radius = min(x, y) * drawn_from(draws, "corner", {"sharp": (0.01, 0.1), "round": (0.1, 0.35)})
    case = _Case(x, y, rounded_rectangle((-x, -y), (x, y), radius, 3))
    foot = draws.length("foot_height", (0.02, 0.05) if kind == "copier" else (0.002, 0.012))
    bands = _bands(draws, kind, min(x, y))
    levels = (foot + SHELF + np.concatenate([[0.0], np.cumsum([tall + SHELF for _, tall in bands])])).tolist()
    printer = Assembly("body", case.block(foot, foot + SHELF) + _feet(case, foot, kind == "copier"), 350.0)
    half = (y - max(radius * 0.3, 0.008)) * draws.number("drawer_width", (0.75, 0.98))
    cavity = 2.0 * x * draws.number("drawer_depth", (0.55, 0.85))
    slopes = kind == "laser" and draws.chance("output_slope", 0.65)
    rise = x * draws.number("slope_height", (0.15, 0.4))
    side = y * draws.number("slope_width", (0.75, 0.9)) if slopes else 0.0
    for number, ((band, tall), low) in enumerate(zip(bands, levels[:-1], strict=True)):
        high = low + tall
        deep = {"solid": 0.0, "panel": 0.0, "tilting": min(0.05, 0.5 * x), "slit": 0.3 * x}.get(band, cavity)
        if deep:
            printer.body += case.around(low - 1e-4, high + 1e-4, half, deep)
        else:
            printer.body += case.block(low - 1e-4, high + 1e-4)
        printer.body += case.block(high, high + SHELF)
        piece = draws.within("panel" if band == "tilting" else band)
        _fill(piece, printer, -x, band, number, (low, tall), half, cavity)
    if slopes:
        printer.body += _slope(case, levels[-1], rise, side)
        if draws.chance("paper_stop", 0.7, upper=True):
            _paper_stop(draws.within("paper_stop"), printer, case, levels[-1] + 0.75 * rise)
    else:
        _lid(draws, printer, case, kind, levels[-1])
    return printer


def _bands(draws: Draws, kind: str, size: float) -> list[tuple[str, float]]:
    """What fills the bands of the front, from the bottom up, and their heights."""
    tall, count = _DRAWERS[kind]
    bands = [("drawer", draws.length("drawer_height", tall)) for _ in range(draws.integer("drawers", *count))]
    output = size * draws.number("output_height", (0.3, 0.7))
    bands.append((draws.pick("output", _OUTPUTS[kind]), output))
    if kind == "laser" and draws.chance("upper_flap", 0.5):
        bands.append(("flap", size * draws.number("upper_flap_height", (0.3, 0.8))))
    panel = draws.pick("controls", {"panel": 0.45, "tilting": 0.35, "solid": 0.2})
    return [*bands, (panel, size * draws.number("controls_height", (0.2, 0.5)))]


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
    draws: Draws, printer: Assembly, front: float, kind: str, number: int, span: Interval, half: float, cavity: float
) -> None:
    """What moves in a band of the front, whose lower end and height are given."""
    low, tall = span
    high, wide = low + tall, half - GAP
    thick = min(draws.length("thickness", (0.006, 0.014)), 0.3 * tall)
    solid = box((front, front + thick), wide, (low + GAP, high - GAP), fillet=0.03 * wide, axis=0, steps=2)
    if kind == "drawer":
        depth = cavity - 2.0 * GAP
        rise = (high - low) * draws.number("wall_height", (0.5, 0.85))
        solid += tray((front + 0.5 * thick, -0.96 * wide, low + GAP), (front + depth, 0.96 * wide, low + rise), 0.003)
        solid += _pull(draws, front, 0.35 * wide, low + GAP, high - GAP)
        slide = prismatic("body", FRONT, 0.0, depth * draws.number("travel", (0.6, 0.9)), (front, 0, low))
        printer.add(f"drawer_{number}", solid, slide, density=700.0)
    elif kind == "flap":
        if draws.chance("handle", 0.6):
            upright = (high - GAP - 0.012, high - GAP - 0.004)
            solid += box((front - 0.006, front + 0.5 * thick), 0.15 * wide, upright).called("handle", FRONT)
        if draws.chance("guides", 0.4):  # for paper, on its inner side
            deep = (front + thick - 0.001, front + thick + 0.006)
            upright = (low + 0.2 * tall, high - 0.1 * tall)
            solid += union(box(deep, about(s * 0.7 * wide, 0.003), upright) for s in (-1, 1))
        hinge = revolute("body", (0, -1, 0), (front, 0, low + GAP), 0.0, draws.angle("angle", (0.9, 1.55)))
        printer.add(f"flap_{number}", solid, hinge, density=900.0)
    elif kind == "tray":
        depth = cavity * draws.number("depth", (0.6, 0.95))
        z = low + GAP
        solid = box((front, front + depth), 0.9 * wide, (z, z + 0.004))
        solid += box((front, front + 0.005), 0.9 * wide, (z, z + min(0.3 * tall, 0.014)))
        slide = prismatic("body", FRONT, 0.0, 0.85 * depth, (front, 0, low))
        printer.add(f"tray_{number}", solid, slide, density=900.0)
    elif kind == "tilting":
        hinge = revolute("body", (0, 1, 0), (front, 0, high - GAP), 0.0, draws.angle("angle", (0.4, 1.2)))
        name = printer.add(f"panel_{number}", solid, hinge, density=900.0)
        _keys(draws, printer, name, front, wide, low + GAP, high - GAP)
    elif kind == "panel":
        _keys(draws, printer, "body", front, half, low, high)


def _pull(draws: Draws, front: float, half: float, low: float, high: float) -> Solid:
    """Handle of a drawer: a lip, a bar or nothing."""
    kind = draws.pick("handle", {"lip": 0.35, "bar": 0.25, "none": 0.4})
    deep, tall = (front - draws.length("handle_reach", (0.006, 0.016)), front + 0.003), high - low
    if kind == "lip":
        return box(deep, half, (high - 0.3 * tall, high - 0.15 * tall)).called("handle", FRONT)
    if kind == "bar":
        r = min(0.2 * tall, 0.01)
        return box(deep, half, about(0.5 * (low + high), r), fillet=0.4 * r, axis=1, steps=2).called("handle", FRONT)
    return Solid()


def _keys(draws: Draws, printer: Assembly, parent: str, front: float, half: float, low: float, high: float) -> None:
    """Keys on a panel in front: a group on one side, or on both."""
    face = front_face(front, 0.0, 0.5 * (low + high))
    rise = high - low
    if rise < 0.012:
        return
    rows = draws.integer("key_rows", 1, 3) if rise > 0.035 else 1
    pitch = min(0.85 * rise / rows, 0.03)
    columns, travel = draws.integer("key_columns", 1, 5), draws.length("key_travel", (0.0008, 0.0015))
    outline = key_outline(draws.pick("key_shape", ["round", "square", "pill"]), (0.68 * pitch, 0.6 * pitch), 10)
    sides = [-1.0, 1.0] if draws.chance("keys_on_both_sides", 0.3) else [draws.side("keys_side")]
    columns = min(columns, int(0.6 * half / pitch), 12 // (rows * len(sides)))
    number = 0
    for side in sides:
        middle = side * (0.9 * half - 0.5 * columns * pitch)
        spots = key_cells(about(middle, 0.5 * columns * pitch), about(0.0, 0.45 * rise), max(columns, 1), rows)
        number = add_buttons(printer, parent, face, spots, outline, travel + 0.002, travel, first=number)


# --- the top ---------------------------------------------------------------------------------------------------------


def _slope(case: _Case, top: float, rise: float, side: float) -> Solid:
    """The top of a laser printer: walls around a slope for printed paper, which reaches ``side`` to either side."""
    high = top + rise
    solid = case.block(top - 1e-4, high, y=(side, 9.0)) + case.block(top - 1e-4, high, y=(-9.0, -side))
    solid += case.block(top - 1e-4, high, x=(0.75 * case.x, 9.0))
    slope = [(-0.9, top - 1e-4), (0.76, top - 1e-4), (-0.9, top + 0.75 * rise), (-0.2, top + 0.7 * rise)]
    return solid + hull([(x * case.x, s * (side + 1e-4), z) for x, z in slope for s in (-1, 1)])


def _paper_stop(draws: Draws, printer: Assembly, case: _Case, level: float) -> None:
    """A flap that lies on the front end of the slope and folds up."""
    z, first = level + GAP, -0.86 * case.x
    wide, end = case.y * draws.number("width", (0.1, 0.6)), draws.number("end", (-0.6, -0.3))
    flap = box((first, end * case.x), wide, (z, z + 0.004), fillet=0.008, axis=2, steps=2)
    hinge = revolute("body", (0, -1, 0), (first, 0, z), 0.0, draws.angle("angle", (0.6, 1.6)))
    printer.add("paper_stop", flap, hinge, density=900.0)


def _lid(draws: Draws, printer: Assembly, case: _Case, kind: str, top: float) -> None:
    """The lid of a scanner, at times with a feeder; keys before it and a paper support behind it."""
    seam = top + GAP
    back = case.x
    if kind in ("inkjet", "small") and draws.chance("paper_support", 0.45):
        back = case.x * draws.number("lid_end", (0.45, 0.65))
        _paper_support(draws.within("paper_support"), printer, case, seam, back)
    thick = draws.number("lid_thickness", (0.1, 0.35)) * min(case.x, 0.18)
    front = -case.x
    if draws.chance("top_controls", 0.4):  # a strip with keys before the lid
        front += case.x * draws.number("top_controls_depth", (0.2, 0.5))
        _top_keys(draws.within("top"), printer, case, top, front)
    outline = np.clip(case.outline, (front, -9.0), (back - (0.0 if back == case.x else thick + GAP), 9.0))
    edge = float(outline[:, 0].max())
    shrink = draws.number("lid_taper", (0.9, 1.0))
    middle = outline.mean(axis=0)
    lid = prism(outline, seam, seam + 0.6 * thick)
    crown = seam + thick
    crest = lifted(middle + shrink * (outline - middle), crown)
    lid += hull(np.concatenate([lifted(outline, seam + 0.5 * thick), crest]))
    feeder = back == case.x and kind != "small" and draws.chance("feeder_tray", 0.6 if kind == "copier" else 0.35)
    if feeder:
        rise = draws.length("feeder_height", (0.03, 0.09))
        y0, y1 = 0.15 * case.y, 0.8 * case.y
        deep = (front + 0.15 * case.x, edge - 0.1 * case.x)
        lid += box(deep, (y0, y1), (crown - 0.002, crown + rise), fillet=0.3 * rise, axis=0)
    hinge = revolute("body", (0, 1, 0), (edge, 0, seam), 0.0, draws.angle("lid_angle", (0.7, 1.5)))
    printer.add("lid", lid, hinge, density=300.0)
    if feeder:
        z, wide = crown + GAP, 0.6 * (edge - front) * draws.number("feeder_tray_width", (0.5, 0.9))
        x = 0.5 * (front + edge)
        solid = box(about(x, 0.5 * wide), (-0.85 * case.y, y0 - GAP), (z, z + 0.006), fillet=0.01, axis=2)
        turn = revolute("lid", FRONT, (x, y0 - GAP, z + 0.006), 0.0, draws.angle("feeder_tray_angle", (0.25, 0.9)))
        printer.add("feeder_tray", solid, turn, density=600.0)


def _top_keys(draws: Draws, printer: Assembly, case: _Case, top: float, back: float) -> None:
    """Keys on top, before the lid."""
    room = back + case.x
    pitch = min(0.6 * room, 0.03)
    columns = min(draws.integer("key_columns", 2, 7), int(1.2 * case.y / pitch))
    travel = draws.length("key_travel", (0.0008, 0.0015))
    outline = key_outline(draws.pick("key_shape", ["round", "square", "pill"]), (0.7 * pitch, 0.6 * pitch), 10)
    face = top_face(top, -case.x + 0.5 * room, 0.0)
    middle = draws.number("key_place", (-0.3, 0.3)) * case.y
    spots = key_cells(about(middle, 0.5 * columns * pitch), (-0.01, 0.01), columns, 1)
    add_buttons(printer, "body", face, spots, outline, travel + 0.002, travel, label="top_button")


def _paper_support(draws: Draws, printer: Assembly, case: _Case, seam: float, front: float) -> None:
    """A flap that lies over the paper's slot at the back and folds up and back."""
    thick, wide = draws.length("thickness", (0.004, 0.01)), case.y * draws.number("width", (0.5, 0.85))
    solid = box((front + GAP, case.x - 0.004), wide, (seam, seam + thick), fillet=0.01, axis=2)
    x, z = case.x - 0.004, seam + 0.5 * thick
    solid += rod(x, (-wide, wide), z, 0.5 * thick, sections=12)
    hinge = revolute("body", (0, 1, 0), (x, 0, z), 0.0, draws.angle("angle", (1.3, 2.1)))
    printer.add("paper_support", solid, hinge, density=800.0)
