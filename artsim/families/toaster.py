"""Toasters: a body with one to four slots, levers at the front end, a dial to set them.

What varies: slots, levers and their guides; box, arch, loaf or block; knobs, buttons, crumb tray, feet, bun rack.
"""

import numpy as np

from artsim.families.details import add_push_button, dial
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, Array, about, rounded_rectangle
from artsim.making.solids import Solid, box, deferred, frame, hull_of, posts, prism, rod, tube, union

GAP = 0.001


def build(draws: Draws) -> Assembly:
    """A toaster with its levers up at rest. The slots run along X, the levers are at -X."""
    kind = draws.pick("slot_layout", {"two": 0.6, "four": 0.2, "long": 0.2})
    count = {"two": 2, "four": 4, "long": draws.integer("long_slots", 1, 2)}[kind]
    length = draws.length("depth", (0.34, 0.5) if kind == "long" else (0.23, 0.36))
    wide = draws.length("slot_width", (0.024, 0.044))
    pitch = wide + draws.length("slot_gap", (0.02, 0.035))
    half = 0.5 * (count - 1) * pitch + 0.5 * wide + draws.length("side_width", (0.024, 0.065))
    foot, height = draws.lengths(foot_height=(0.005, 0.025), height=(0.13, 0.25))
    low, high = np.array([0.0, -half, foot]), np.array([length, half, foot + height])
    shape = draws.pick("shape", ["box", "arch", "loaf", "block"])
    block = _block(draws, shape, low, high, half - 0.5 * (count - 1) * pitch - 0.5 * wide)

    margin = draws.length("end_margin", (0.03, 0.05)) + (0.03 if shape == "loaf" else 0.0)
    slots = np.asarray((np.arange(count) - 0.5 * (count - 1)) * pitch, dtype=np.float64)
    body = _slotted(block, slots, wide, (margin, length - margin), foot + 0.03)
    stands = draws.pick("base", {"feet": 0.6, "plate": 0.4}) == "feet"
    if stands:
        body += posts((0.04, length - 0.04), 0.75 * half, (0, foot + 0.012), 0.011, 0.014)
    else:
        body += box((0.012, length - 0.012), half - 0.008, (0.0, foot + 0.012), fillet=0.01, axis=2)
    if draws.chance("collar", 0.5):  # around the slots
        start = (margin - 0.01, slots[0] - 0.5 * wide - 0.008, high[2] - 0.006)
        end = (length - margin + 0.01, slots[-1] + 0.5 * wide + 0.008, high[2] + 0.002)
        body += frame(start, end, [0.01, 0.01, 0.007, 0.007], 0, 1)
    if draws.chance("bun_rack", 0.12):
        body += _bun_rack(length, half, high[2])

    toaster = Assembly()
    places = [-0.5 * half, 0.5 * half]
    if count < 4:
        aside = draws.number("lever_aside", (-0.35, 0.35))
        places = [half * draws.one_of("lever_place", {"middle": 0.0, "aside": aside})]
    top = foot + height * draws.number("lever_height", (0.62, 0.78))
    travel = draws.number("lever_travel", (0.25, 1.0)) * min(0.11, top - foot - 0.055)
    if draws.chance("lever_guide", 0.8):
        upright = (top - travel - 0.014, top + 0.014)
        for y in places:
            body += frame((-0.0035, y - 0.012, upright[0]), (0.005, y + 0.012, upright[1]), [0.007] * 4)
    toaster.add("body", body, density=500.0)
    lever = _lever(draws)
    for number, y in enumerate(places, 1):
        name = f"lever_{number}" if len(places) > 1 else "lever"
        slide = prismatic("body", (0, 0, -1), 0.0, travel, (0, y, top))
        toaster.add(name, lever.moved((0, y, top)), slide, density=1000.0)
    if draws.chance("levers_alone", 0.3):  # nothing else moves
        return toaster
    _controls(draws, toaster, places, half, top - travel - 0.02, foot)
    if stands and draws.chance("crumb_tray", 0.4):
        tray = box((0.06, length + 0.001), 0.75 * half - 0.017, (foot - 0.0045, foot - 0.0015))
        grip = box((length + 0.0015, length + 0.012), 0.4 * half, (foot - 0.0045, foot + 0.008), fillet=0.002)
        tray += grip.called("handle", -FRONT)
        tray += box((length, length + 0.004), 0.4 * half, (foot - 0.0045, foot - 0.0015))
        toaster.add("crumb_tray", tray, prismatic("body", (1, 0, 0), 0.0, 0.6 * length, (length, 0, foot)))
    return toaster


def _block(draws: Draws, shape: str, low: Array, high: Array, side: float) -> Solid:
    """Convex body, still without slots; its top is level where they will be, ``side`` from its edges."""
    if shape in ("arch", "loaf"):  # round edges along the slots, or over the ends
        axis = 0 if shape == "arch" else 1
        across = [1 - axis, 2]
        r = draws.number("arch_radius", (0.5, 0.95)) * side if axis == 0 else draws.length("loaf_radius", (0.03, 0.06))
        outline = rounded_rectangle(low[across] - (0.0, 0.1), high[across], r, 6 + axis)
        outline = np.stack([outline[:, 0], np.maximum(outline[:, 1], low[2])], axis=1)
        return prism(outline, low[axis], high[axis], axis)
    if shape == "block":  # wider below
        narrow = 0.3 * side
        upper = box((low[0] + 0.008, low[1] + narrow, high[2] - 0.02), high - (0.008, narrow, 0.0), fillet=0.009)
        return hull_of(upper, box(low, (high[0], high[1], low[2] + 0.03), fillet=0.012, axis=2))
    return box(low, high, fillet=draws.length("edge_radius", (0.006, 0.02)))


@deferred
def _slotted(block: Solid, slots: Array, wide: float, span: tuple[float, float], floor: float) -> Solid:
    """The block cut into convex pieces that leave the slots free, each piece overlapping its neighbours."""

    def cut(*planes: tuple[int, float, float]) -> Solid:
        piece = block.pieces[0]
        for axis, low, high in planes:
            normal = np.eye(3)[axis]
            piece = piece.trim_by_plane(normal, low).trim_by_plane(-normal, -high)
        return Solid((piece,))

    far = 1.0
    edges = np.concatenate([[-far], np.stack([slots - 0.5 * wide, slots + 0.5 * wide], axis=1).ravel(), [far]])
    solid = union(cut((1, a, b)) for a, b in edges.reshape(-1, 2))
    for y in slots:
        across = (1, y - 0.5 * wide - 0.001, y + 0.5 * wide + 0.001)
        solid += cut(across, (0, -far, span[0])) + cut(across, (0, span[1], far))
        solid += cut(across, (0, span[0] - 0.001, span[1] + 0.001), (2, -far, floor))
        for x in np.linspace(*span, 5)[1:-1]:  # wires that hold the bread
            for side in (-1, 1):
                v = y + side * 0.5 * wide
                solid += box(about(x, 0.0015), about(v, 0.002), (floor - 0.001, block.bounds()[1, 2] - 0.012))
    return solid


def _lever(draws: Draws) -> Solid:
    """Lever before the plane x = 0, centred on the origin, with a tongue in its guide."""
    half = 0.5 * draws.length("lever_width", (0.024, 0.052))
    kind = draws.pick("lever_grip", ["bar", "wedge", "round"])
    if kind == "bar":
        grip = box((-0.032, -0.006), half, 0.007, fillet=0.004)
    elif kind == "wedge":
        tip = box((-0.034, -0.028), half, 0.004, fillet=0.0015)
        grip = hull_of(tip, box((-0.012, -0.006), 0.6 * half, 0.009, fillet=0.0015))
    else:
        grip = rod((-0.006, -0.026), 0, 0, 0.5 * half + 0.003, 0.6 * half + 0.004, 18)
    return box((-0.014, -GAP), 0.0035, 0.006) + grip.called("handle", FRONT)


def _controls(draws: Draws, toaster: Assembly, places: list[float], half: float, top: float, foot: float) -> None:
    """A dial below each lever or beside it, and buttons in a row."""
    room = top - foot - 0.004
    for number, y in enumerate(places, 1):
        radius = min(draws.length("knob_radius", (0.012, 0.018)), 0.42 * room)
        spot = (0.0, y, foot + 0.012 + 0.45 * room)
        if draws.chance("knob", 0.8) and radius > 0.006:
            name = f"knob_{number}" if len(places) > 1 else "knob"
            turn = revolute("body", FRONT, spot, 0.0, draws.turn("knob_angle", (180.0, 290.0)))
            toaster.add(name, dial(spot, FRONT, draws.length("knob_reach", (0.012, 0.02)), radius), turn)
    if len(places) == 1 and draws.chance("button_row", 0.6):
        y = places[0] - 0.6 * half if places[0] >= 0 else places[0] + 0.6 * half
        y = float(np.clip(y, 0.02 - half, half - 0.02))
        if abs(y - places[0]) < 0.042:
            return
        for number, z in enumerate(np.linspace(0.0, 0.05, draws.integer("buttons", 1, 3)), 1):
            corner = draws.one_of("button_shape", {"square": 0.002, "round": 0.0045})
            add_push_button(toaster, number, (0.0, y, foot + 0.03 + z), (0.016, 0.009), corner)


def _bun_rack(length: float, half: float, z: float) -> Solid:
    """Wire rack that stands on the top."""
    lift, solid = z + 0.03, Solid()
    for y in (-0.6 * half, 0.6 * half):
        path = [(0.06, y, z - 0.006), (0.07, y, lift), (length - 0.07, y, lift), (length - 0.06, y, z - 0.006)]
        solid += tube(path, 0.002, 8)
    return solid + union(tube([(x, -0.6 * half, lift), (x, 0.6 * half, lift)], 0.002, 8) for x in (0.08, length - 0.08))
