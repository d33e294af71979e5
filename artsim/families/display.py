"""Displays, their screens towards -X: monitors on stands, television sets on feet, tubes on swivels, panels on easels.

What varies: the kind; the panel, one to three of them on a bar; the foot; which of turn, height, tilt and portrait
joints there are; keys, knobs and rabbit ears.
"""

from dataclasses import dataclass

import numpy as np

from artsim.common.elementary import arcsin, cos, hypot, sin
from artsim.families.details import dial, drawn_from
from artsim.families.keys import Face, add_buttons, add_key, front_face, key_outline, pill, side_face
from artsim.making.assembly import Assembly, JointSpec, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, UP, Array, about, rounded_rectangle
from artsim.making.solids import Solid, box, cylinder, frame, hull, loft, ring, rod, tube

GAP = 0.0015


@dataclass(frozen=True)
class Panel:
    """A flat or bent screen about the origin, its back at x = 0."""

    half: float  # of the width
    rise: float  # half of the height
    thick: float  # of the whole panel, before x = 0
    bend: float  # how far the left and right edges come forward


def build(draws: Draws) -> Assembly:
    """A display; upright and at its lowest, no key pressed at rest."""
    display = Assembly()
    makers = {"stand": _on_stand, "feet": _on_feet, "tube": _tube, "easel": _on_easel}
    draws.one_of("kind", makers, (0.58, 0.14, 0.16, 0.12))(draws, display)
    return display


def _keys(draws: Draws, display: Assembly, parent: str, face: Face, half: float, size: float) -> int:
    """A row of keys to one side of a chin, on some; returns how many."""
    if not draws.chance("button", 0.65, upper=True) or size < 0.004:
        return 0
    count, wide = draws.integer("buttons", 1, 6), min(draws.number("button_width", (0.8, 2.5)) * size, 0.028)
    kind = draws.pick("button_shape", ["round", "square", "pill"])
    side = draws.one_of("button_side", {"left": -1.0, "middle": 0.0, "right": 1.0})
    travel = draws.length("button_travel", (0.0008, 0.0015))
    pitch = 1.3 * max(wide, size)
    middle = side * (half - 0.5 * count * pitch - 0.01)
    outline = key_outline(kind, (size if kind == "round" else wide, size), 12)
    for k, reach in enumerate(draws.numbers("button_reach", 0.0015, 0.004, count, unit="m")):
        u = middle + (k - 0.5 * (count - 1)) * pitch
        add_key(display, parent, f"button_{k}", face, (u, 0.0), outline, travel + reach, travel)
    return count


def _foot(draws: Draws, half: float, depth: float, thick: float) -> Solid:
    """What stands on the table, below z = ``thick``; the middle of it is solid."""
    kind = draws.pick("foot", {"plate": 0.27, "disc": 0.22, "legs": 0.15, "ring": 0.08, "tapered": 0.18, "arc": 0.1})
    back = 0.45 * depth
    front = back - depth
    if kind == "disc":
        return rod(0, 0, (0, thick), 0.5 * depth, 0.5 * depth * draws.number("foot_taper", (0.7, 1.0)), 32)
    if kind == "legs":  # two legs that spread to the front
        width = draws.length("foot_leg_width", (0.02, 0.05))
        solid = box((-0.3 * back, back), 1.5 * width, (0, thick))
        for s in (-1.0, 1.0):
            solid += hull([(x, y, z) for x, y in ((0.5 * back, s * 0.2 * width), (0.5 * back, s * 1.2 * width),
                           (front, s * half), (front, s * (half - width))) for z in (0, thick)])  # fmt: skip
        return solid
    if kind == "ring":
        outer = 0.5 * depth
        inner = outer * draws.number("foot_hole", (0.6, 0.8))
        bar = box((-0.02, 0.03), 0.95 * outer, (0, thick))
        return ring((0, 0, 0.5 * thick), UP, inner, outer, thick, 28) + bar
    if kind == "arc":
        width = draws.length("foot_leg_width", (0.025, 0.05))
        bow = [(front + 0.6 * (back - front) * a * a, half * a) for a in np.linspace(-1.0, 1.0, 9)]
        rings = [[(x + d, y, z) for d in (0.0, width) for z in (0.0, thick)] for x, y in bow]
        return loft(rings) + box((front + 0.5 * width, 0.6 * back), width, (0, thick))
    radius = draws.number("foot_corner", (0.02, 0.95)) * min(half, 0.5 * depth)
    outline = rounded_rectangle((front, -half), (back, half), radius, 4)
    top = draws.number("foot_taper", (0.55, 0.9) if kind == "tapered" else (0.96, 1.0))
    return hull([(x, y, 0.0) for x, y in outline] + [(x, y, 0.4 * thick) for x, y in outline]
                + [(top * x, top * y, thick) for x, y in outline])  # fmt: skip


class _Chain:
    """Parts in a row, each on the one before it; what no joint parts goes into the same part."""

    def __init__(self, display: Assembly, root: str = "base") -> None:
        self.display = display
        self.name, self.joint, self.solid = root, None, Solid()  # type: tuple[str, JointSpec | None, Solid]

    def part(self, name: str, joint: JointSpec) -> None:
        """Finish the part so far, and begin one that hangs on it."""
        self.finish()
        self.name, self.joint, self.solid = name, joint, Solid()

    def finish(self) -> str:
        """Add the part so far to the display; returns its name."""
        return self.display.add(self.name, self.solid, self.joint, density=1500.0)


def _on_stand(draws: Draws, display: Assembly) -> None:
    """Screens on a column that turns, slides, tilts and turns to portrait, or some of these."""
    panel = _draw_panel(draws)
    count = draws.pick("screens", {1: 0.84, 2: 0.1, 3: 0.06}) if not panel.bend and panel.half < 0.3 else 1
    swivels, slides = draws.chance("neck", 0.5), draws.chance("slider", 0.45)
    tilts, pivots = draws.chance("tilts", 0.85), draws.chance("turns_to_portrait", 0.3)
    tilts = tilts or count > 1 or not (swivels or slides)
    pivots = pivots and count == 1 and not panel.bend
    below = float(hypot(panel.half, panel.rise)) if pivots else panel.rise  # how far the panel reaches from its middle
    radius, knuckle = draws.lengths(column_radius=(0.012, 0.026), hinge_radius=(0.006, 0.012))
    front = -radius - (GAP + 0.006 if slides else 0.0)  # of what the hinge is fixed to
    axis = front - knuckle - 0.004
    plane = axis - knuckle - draws.length("hinge_reach", (0.008, 0.03))  # of the panel's back
    forward = _forward_tilt(axis - plane, below, axis, -radius) if tilts else 0.0
    forward = min(forward, draws.angle("forward_tilt", (0.03, 0.12)))
    thick = draws.length("foot_thickness", (0.006, 0.03))
    drop = (axis - plane + panel.thick + panel.bend) * float(sin(forward))
    middle = thick + below + drop + draws.length("clearance", (0.02, 0.16))
    half_sleeve = draws.length("slider_height", (0.015, 0.035))
    top = middle + (half_sleeve + draws.number("column_height", (0.0, 0.6)) * panel.rise if slides else 0.0)

    chain = _Chain(display)
    wide = 0.5 * draws.length("foot_width", (0.35, 0.85), of=2.0 * panel.half)
    chain.solid = _foot(draws, wide, max(draws.length("foot_depth", (0.5, 1.0), of=panel.half), 0.13), thick)
    foot = thick
    if swivels:
        turn = draws.angle("neck_angle", (0.35, 1.57))
        foot += GAP
        chain.part("neck", revolute("base", (0, 0, 1), (0, 0, foot), -turn, turn))
        chain.solid = rod(0, 0, (foot, foot + 0.006), draws.number("neck_radius", (1.6, 2.4)) * radius, sections=24)
    chain.solid += _column(draws, radius, foot + (0.004 if swivels else -0.004), top, not slides)
    if slides:
        travel = (top - middle) * draws.number("slider_travel", (0.5, 0.9))
        travel += draws.length("slider_spare", (0.0, half_sleeve))
        chain.part("slider", prismatic(chain.name, (0, 0, 1), 0.0, travel, (0, 0, middle)))
        outer, (low, high) = radius + GAP + 0.006, about(middle, half_sleeve)
        chain.solid = frame((-outer, -outer, low), (outer, outer, high), [0.006] * 4, 0, 1)
    offsets = (np.arange(count) - 0.5 * (count - 1)) * (2.0 * panel.half + 0.02)
    if count > 1:
        reach = float(offsets[-1]) + 0.03
        chain.solid += box((front - 0.004, front + 0.005), reach, about(middle, 0.014), fillet=0.004)
    ear = 0.6 * radius
    for y in offsets:
        chain.solid += box((axis, front + 0.004), about(y, ear), about(middle, 0.8 * knuckle))
        if tilts:
            chain.solid += rod(axis, about(y, ear), middle, knuckle, sections=14)
    parent = chain.name
    if count > 1:
        chain.finish()
    back_tilt = _forward_tilt(axis - plane, below, axis, -radius) if slides else 0.5
    for k, y in enumerate(offsets):
        name = "screen" if count == 1 else f"screen_{k}"
        limits = (-forward, min(back_tilt, draws.angle("back_tilt", (0.15, 0.5))))
        tilt = revolute(parent, (0, 1, 0), (axis, float(y), middle), *limits)
        head = _head(plane + (GAP if pivots else -0.001), axis, float(y), middle, ear, knuckle, panel, tilts)
        if count > 1:
            chain.name, chain.joint, chain.solid = name, tilt, head
        elif tilts:
            chain.part("head" if pivots else name, tilt)
            chain.solid = head
        else:
            chain.solid += head
        if pivots:
            chain.part(name, revolute(chain.name, (-1, 0, 0), (plane, 0, middle), -1.5708, 1.5708))
        _finish_screen(draws, chain, panel, np.array([plane, y, middle]), k)


def _forward_tilt(reach: float, below: float, axis: float, column: float) -> float:
    """How far a panel whose back lies ``reach`` before its hinge tilts until its edge is 5 mm from the column."""
    far = float(hypot(reach, below))
    return max(float(arcsin(min(reach / far, 1.0))) + float(arcsin(min((column - axis - 0.005) / far, 1.0))), 0.01)


def _column(draws: Draws, radius: float, low: float, high: float, free: bool) -> Solid:
    """The upright of a stand; a square one, unless its shape is free."""
    kind = draws.pick("column", ["square", "round", "wide", "tapered"]) if free else "square"
    if kind == "round":
        return rod(0, 0, (low, high), radius, sections=20)
    wide = draws.number("column_width", (1.5, 4.0))
    wide = radius * wide if kind == "wide" else radius
    foot = wide * (draws.number("column_spread", (1.2, 4.0)) if kind == "tapered" else 1.0)
    deep = radius if not free else radius * draws.number("column_depth", (0.5, 1.0))
    ends = ((low, foot), (high, wide))
    return hull([(x, y, z) for z, w in ends for x in (-radius, 2.0 * deep - radius) for y in (-w, w)])


def _head(plane: float, axis: float, y: float, z: float, ear: float, barrel: float, panel: Panel, tilts: bool) -> Solid:
    """What holds a screen: a plate behind it, and ears on either side of the hinge, or an arm where nothing tilts."""
    size, upright = min(0.045, 0.5 * panel.rise), about(z, 0.8 * barrel)
    solid = box((plane, plane + 0.006), about(y, 0.8 * size), about(z, size))
    if not tilts:
        return solid + box((plane, axis + 0.001), about(y, ear), upright)
    for s in (-1.0, 1.0):
        first, last = sorted((y + s * (ear + 0.001), y + s * (ear + 0.006)))
        solid += rod(axis, (first, last), z, barrel, sections=14) + box((plane, axis), (first, last), upright)
    return solid


def _finish_screen(draws: Draws, chain: _Chain, panel: Panel, at: Array, number: int) -> None:
    """Add the panel to the chain's last part, finish that, and put keys on the first one."""
    chin = draws.number("chin", (0.0, 0.16)) * panel.rise * draws.pick("has_chin", {False: 0.4, True: 0.6})
    chain.solid += _screen(draws, panel, chin).moved(at)
    name, size = chain.finish(), min(0.4 * panel.thick, 0.008)
    if number > 0:
        return
    if chin > 0.012 and not panel.bend:
        face = front_face(float(at[0]) - panel.thick, float(at[1]), float(at[2]) - panel.rise + 0.5 * chin)
        _keys(draws, chain.display, name, face, 0.9 * panel.half, 0.6 * chin)
    elif draws.chance("button", 0.5, upper=True) and size >= 0.002:  # above one another, on the right edge
        pitch = 2.6 * size
        count = min(draws.integer("buttons", 1, 5), int(0.8 * panel.rise / pitch))
        face = side_face(-1.0, *(at + (-0.5 * panel.thick - panel.bend, -panel.half, 0.0)))
        spots = [(0.0, (k - 3.0) * pitch) for k in range(count)]
        add_buttons(chain.display, name, face, spots, pill(size, 1.8 * size), 0.003, 0.001)


def _on_feet(draws: Draws, display: Assembly) -> None:
    """A television set on two feet that fold in below it."""
    panel = _draw_panel(draws, 1.5)
    foot = draws.length("foot_height", (0.02, 0.1))
    middle = foot + GAP + panel.rise
    _finish_screen(draws, _Chain(display, "body"), panel, np.array([0.0, 0.0, middle]), 0)
    x = -0.5 * panel.thick
    spread = panel.half * draws.number("foot_place", (0.45, 0.85))
    reach = min(0.5 * draws.length("foot_depth", (0.2, 0.5), of=2.0 * panel.half), 0.8 * spread)
    wide, leg = 0.5 * draws.length("foot_width", (0.012, 0.06)), min(0.3 * panel.thick, 0.012)
    limit = draws.angle("foot_angle", (0.8, 1.57))
    for k, s in enumerate((-1.0, 1.0)):
        y = s * spread
        solid = hull([(x + a * reach, y + b * wide, z) for a in (-1, 1) for b in (-1, 1) for z in (0.0, 0.006)])
        if draws.chance("foot_slopes", 0.5):
            rim = ((0.8, 0.004), (0.3, foot))
            solid += hull([(x + a * r * reach * 0.9, y + b * leg, z) for a in (-1, 1) for b in (-1, 1) for r, z in rim])
        else:
            solid += rod(x, y, (0.004, foot), leg, sections=14)
        display.add(f"foot_{k}", solid, revolute("body", (0, 0, s), (x, y, foot), 0.0, limit), density=2000.0)


def _on_easel(draws: Draws, display: Assembly) -> None:
    """A thin panel with a leaf or two legs on its back that fold out."""
    panel = _draw_panel(draws, 0.6)
    _finish_screen(draws, _Chain(display, "body"), panel, np.array([0.0, 0.0, panel.rise]), 0)
    z = 2.0 * panel.rise * draws.number("prop_height", (0.3, 0.85))
    low, thick = 0.04 * panel.rise, draws.length("prop_thickness", (0.002, 0.008))
    count = draws.integer("props", 1, 2)
    wide = panel.half * draws.number("prop_width", (0.2, 0.85) if count == 1 else (0.04, 0.15))
    for k in range(count):
        y = 0.0 if count == 1 else (k - 0.5) * 1.2 * panel.half
        leaf = box((GAP, GAP + thick), about(y, wide), (low, z))
        leaf += rod(GAP + 0.5 * thick, about(y, wide), z, 0.5 * thick, sections=12)
        hinge = revolute("body", (0, -1, 0), (GAP + 0.5 * thick, y, z), 0.0, draws.angle("prop_angle", (0.5, 1.6)))
        display.add("stand" if count == 1 else f"leg_{k}", leaf, hinge, density=1500.0)


def _tube(draws: Draws, display: Assembly) -> None:
    """A deep set with a picture tube, on a swivel, or a television set on legs with knobs and rabbit ears."""
    half = 0.5 * draws.length("width", (0.28, 0.76))
    rise = 0.5 * draws.length("height", (0.7, 1.05), of=2.0 * half)
    depth = draws.length("depth", (1.2, 2.3), of=half)
    cabinet, foot = draws.length("cabinet_depth", (0.2, 0.6), of=depth), draws.length("foot_height", (0.02, 0.07))
    chain = _Chain(display)
    swivels = draws.chance("swivels", 0.65)
    if swivels:
        thick = 0.4 * foot
        chain.solid = _foot(draws, 0.6 * half, draws.length("foot_depth", (0.8, 1.3), of=half), thick)
        turn = draws.angle("swivel_angle", (0.5, 1.57))
        chain.part("screen", revolute("base", (0, 0, 1), (0, 0, thick), -turn, turn))
        chain.solid = rod(0, 0, (thick + GAP, foot + 0.004), 0.35 * half, 0.5 * half, 24)
    else:
        chain.name = "body"
        splay, leg = draws.number("leg_splay", (1.0, 1.3)), draws.length("leg_radius", (0.008, 0.02))
        x0 = -0.5 * cabinet
        for a, s in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            tip = (x0 + a * splay * 0.4 * cabinet, s * splay * 0.75 * half, 0.0)
            head = (x0 + a * 0.4 * cabinet, s * 0.75 * half, foot + 0.003)
            chain.solid += cylinder(tip, head, 0.7 * leg, leg, 12)
    front = -0.5 * cabinet - 0.2 * depth if swivels else -cabinet
    low, high = foot, foot + 2.0 * rise
    rim = draws.number("rim", (0.06, 0.16)) * half
    # A strip for knobs, on the right.
    side = draws.number("knob_strip", (0.3, 0.6)) * half if draws.chance("knob", 0.4) else 0.0
    chin = draws.number("chin", (0.1, 0.3)) * rise if side == 0 else 0.0
    lip, corner = draws.length("lip", (0.006, 0.02)), draws.number("corner", (0.02, 0.2)) * rise
    shell = box((front + lip, front + cabinet), half, (low, high), fillet=corner, axis=0)
    inset = 0.08 * rise
    corners = (front, inset - half, low + inset), (front + lip + 0.001, half - inset, high - inset)
    shell += frame(*corners, [rim + side, rim, rim + chin, rim])
    shrink = draws.number("back_taper", (0.4, 0.8))
    shell += hull([(x, s * half * 0.96 * t, z) for x, t in ((front + cabinet - 0.001, 1.0), (front + depth, shrink))
                   for s in (-1, 1) for z in (low + 0.02 * rise, low + rise * (1.0 + 0.96 * t))])  # fmt: skip
    glass = np.array([front + lip, 0.5 * side, low + rise + 0.5 * chin])
    half_glass, rise_glass = half - inset - rim - 0.5 * side, rise - inset - rim - 0.5 * chin
    bulge = ((0.001, 0.98), (-0.3 * lip, 0.8), (-0.5 * lip, 0.4))
    corners_of_glass = [(x, s * half_glass * t, u * rise_glass * t) for x, t in bulge for s in (-1, 1) for u in (-1, 1)]
    shell += hull([glass + corner for corner in corners_of_glass]).called("display", FRONT)
    chain.solid += shell
    name, keys = chain.finish(), 0
    if side:
        face = front_face(front, inset + 0.5 * (side + rim) - half, low + rise)
        for k in range(draws.integer("knobs", 1, 3)):
            size = min(0.3 * side, 0.2 * rise)
            center = face.at(0.0, (0.65 - 0.5 * k) * rise)
            knob = dial(center, FRONT, draws.number("knob_reach", (0.6, 1.2)) * size, size, 18)
            display.add(f"knob_{k}", knob, continuous(name, FRONT, tuple(center)), density=900.0)
    else:
        face = front_face(front, 0.0, low + inset + 0.5 * (chin + rim))
        keys = _keys(draws, display, name, face, half - inset, 0.5 * (chin + rim))
    if draws.chance("antenna", 0.4) or not (swivels or side or keys):
        _rabbit_ears(draws, display, name, np.array([front + 0.6 * cabinet, 0.0, high]), half)


def _rabbit_ears(draws: Draws, display: Assembly, parent: str, foot: Array, half: float) -> None:
    """Two rods that turn about a block's axes."""
    length, lean = half * draws.number("antenna_length", (0.8, 2.2)), draws.angle("antenna_lean", (0.25, 0.6))
    for k, s in enumerate((-1.0, 1.0)):
        pivot = foot + (0.0, s * 0.05, 0.012)
        tip = pivot + length * np.array([0.0, s * float(sin(lean)), float(cos(lean))])
        ear = tube([pivot, tip], [0.003, 0.0018], 8)
        ear += cylinder(pivot - (0.007, 0, 0), pivot + (0.007, 0, 0), 0.008, sections=12)
        hinge = revolute(parent, (s, 0, 0), tuple(pivot), -draws.angle("antenna_angle", (0.3, 0.8)), lean * 0.8)
        display.add(f"antenna_{k}", ear, hinge, density=3000.0)


def _draw_panel(draws: Draws, most: float = 0.95) -> Panel:
    """A panel at most so wide, metres."""
    width = draws.triangular("width", 0.22, 0.52, most, unit="m")
    formats = {"wide": (0.36, 0.48), "usual": (0.54, 0.68), "square": (0.72, 0.85)}
    ratio = drawn_from(draws, "format", formats, (0.2, 0.5, 0.3))
    thick = draws.triangular("thickness", 0.015, 0.05, 0.16, of=width, unit="m")
    bend = draws.length("bend", (0.03, 0.14), of=width) if ratio < 0.6 and draws.chance("bent", 0.4) else 0.0
    return Panel(0.5 * width, 0.5 * width * ratio, thick, bend)


def _screen(draws: Draws, panel: Panel, chin: float) -> Solid:
    """The panel: a shell with a frame around the sunken screen, and a hump on its back."""
    half, rise, thick = panel.half, panel.rise, panel.thick
    rim = draws.number("rim", (0.008, 0.07)) * half + 0.002
    lip = min(0.12 * thick, 0.004)  # how far the frame stands before the screen
    # What the shell leaves of the thickness goes to the hump.
    back = -thick * (draws.number("hump", (0.0, 0.65)) * draws.pick("humped", [False, True]))
    solid = Solid()
    if panel.bend:
        edges = np.linspace(-half, half, 8)
        forward = panel.bend * np.square(edges / half)
        for k in range(7):
            corners = list(zip(edges[k : k + 2], forward[k : k + 2], strict=True))
            for x0, x1, z0, z1 in (
                (lip - thick, back, -rise, rise),
                (-thick, lip - thick + 0.0005, -rise, chin + rim - rise),
                (-thick, lip - thick + 0.0005, rise - rim, rise),
            ):
                solid += hull([(x - f, y, z) for y, f in corners for x in (x0, x1) for z in (z0, z1)])
    else:
        radius = draws.number("corner", (0.01, 0.12)) * rise
        solid += box((lip - thick, back), half, rise, fillet=radius, axis=0)
        inset = 0.3 * radius
        solid += frame((-thick, inset - half, inset - rise), (lip - thick + 0.0005, half - inset, rise - inset),
                       [rim, rim, chin + rim, rim])  # fmt: skip
    solid = solid.called("display", FRONT)
    if back < 0:
        wide, high = draws.number("hump_width", (0.25, 0.85)) * half, draws.number("hump_height", (0.3, 0.85)) * rise
        wide, inner = min(wide, 0.35 * half) if panel.bend else wide, draws.number("hump_taper", (0.5, 0.95))
        solid += hull([(x, s * wide * t, u * high * t) for x, t in ((back - 0.001, 1.0), (0.0, inner))
                       for s in (-1, 1) for u in (-1, 1)])  # fmt: skip
    return solid
