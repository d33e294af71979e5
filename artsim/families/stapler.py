"""Staplers: a base with an anvil, a magazine and a pressing arm on one hinge at the back; the arm closed at rest.

Varied: length and slenderness, a low or thick desk base, a wide round base or a long plate behind the hinge, magazine
apart from the arm or one part with it, the profile of the arm (straight, arched, with a nose, stepped), its plan,
cheeks at the hinge, a rubber pad, and how far each opens.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import about, ends, rounded_rectangle
from artsim.making.solids import Solid, box, hull_of, loft, prism, rod

GAP = 0.0008
SKIRT = 0.0016
"""Thickness of the arm's sides beside the magazine."""


class Layout:
    """Measures in metres. The hinge lies at x = 0, the front at x = -length."""

    def __init__(self, draws: Draws) -> None:
        self.length = draws.length("length", (0.065, 0.25))  # from the hinge to the front of the arm
        self.width = draws.length("magazine_width", (0.009, 0.018))
        if draws.chance("low_base", 0.75):
            self.base = draws.length("base_height", (0.004, 0.011))
        else:
            self.base = self.length * draws.number("high_base", (0.06, 0.16))
        self.tail = draws.length("hinge_radius", (0.0065, 0.01))  # of what turns about the hinge
        self.hinge = self.base + self.tail + draws.length("hinge_height", (0.001, 0.004))
        self.magazine = self.hinge + draws.number("magazine_height", (0.3, 0.6)) * self.tail  # of its top
        self.inside = 0.5 * self.width + SKIRT + 2 * GAP  # from the middle to a cheek beside the hinge
        self.run = draws.number("cheek_reach", (1.2, 2.5)) * self.tail  # by how far the cheeks reach forward
        kind = draws.pick("base_tail", {"none": 0.45, "short": 0.35, "long": 0.2})  # what is behind the hinge
        behind = {"none": (0.5, 0.8), "short": (1.0, 2.2), "long": (0.1, 1.1)}[kind]
        self.back = draws.number("base_tail_length", behind) * (self.length if kind == "long" else self.tail)


def build(draws: Draws) -> Assembly:
    """A stapler, closed at rest; what turns about the hinge opens upwards."""
    lay = Layout(draws)
    length = lay.length
    arm_width = max(lay.width * draws.number("width", (1.25, 2.6)), 2 * lay.inside)
    if draws.chance("mini", 0.15):  # short and wide, like those for a schoolbag
        arm_width = min(arm_width * draws.number("mini_width", (1.4, 2.1)), 0.5 * length)
    stapler = Assembly("base", _base(draws.within("base"), lay, arm_width), 2500.0)
    magazine, arm = _magazine(draws.within("magazine"), lay), _arm(draws.within("arm"), lay, arm_width)
    wide = min(draws.turn("arm_angle", (80, 125), (80, 206), tails=0.45), _opening(arm, lay))
    axis, origin = (0, 1, 0), (0, 0, lay.hinge)
    if draws.chance("magazine", 0.55):
        lift = min(draws.turn("magazine_angle", (12, 50)), 0.5 * wide)
        stapler.add("magazine", magazine, revolute("base", axis, origin, 0.0, lift), density=3500.0)
        stapler.add("arm", arm, revolute("magazine", axis, origin, 0.0, wide - lift), density=2000.0)
    else:
        joined = box((-0.9 * length, 0), 0.3 * lay.width, (lay.magazine - 0.001, lay.magazine + 0.002))
        stapler.add("arm", magazine + joined + arm, revolute("base", axis, origin, 0.0, wide))
    return stapler


def _opening(solid: Solid, lay: Layout) -> float:
    """Angle up to which what turns stays above the base, or behind it."""
    corners = np.concatenate([vertices[faces] for vertices, faces in solid.piece_meshes()])
    points = np.concatenate([corners + t * (np.roll(corners, 1, axis=1) - corners) for t in (0.0, 0.25, 0.5, 0.75)])
    points = points.reshape(-1, 3)
    angles = np.deg2rad(np.arange(0.0, 207.0, 2.0))
    heights = lay.hinge + (points[:, 2] - lay.hinge) * cos(angles)[:, None] - points[:, 0] * sin(angles)[:, None]
    forward = points[:, 0] * cos(angles)[:, None] + (points[:, 2] - lay.hinge) * sin(angles)[:, None]
    low = ((heights < lay.base + 2 * GAP) & (forward < lay.back + 2 * GAP)).any(axis=1)
    low[angles < 0.5] = False  # near rest only the front is low, and it rises
    return float(angles[np.argmax(low) - 1]) if low.any() else float(angles[-1])


def _base(draws: Draws, lay: Layout, arm_width: float) -> Solid:
    """Plate with an anvil at the front and cheeks beside the hinge."""
    front, back = -lay.length - draws.length("reach", (0.0, 0.012)), lay.back
    cheek = draws.length("cheek", (0.0015, 0.003))
    inside, run = lay.inside, lay.run
    half = max(0.5 * arm_width * draws.number("width", (0.95, 1.35)), inside + cheek + 0.001)
    kind = draws.pick("shape", {"plain": 0.5, "boat": 0.3, "round": 0.2})
    if kind == "round":
        half = max(half, min(half * draws.number("round_width", (1.3, 1.9)), 0.3 * (back - front)))
        solid = hull_of(*(rod(x, 0, (0, 0.6 * lay.base), half, 0.94 * half, 32) for x in (front + half, back - half)))
        solid += box((front + 0.4 * half, back), 0.5 * arm_width, (0.001, lay.base), fillet=0.003, axis=2)
    else:
        outline = rounded_rectangle((front, -half), (back, half), draws.number("rounding", (0.1, 0.9)) * half, 5)
        inner = outline * (1.0, draws.number("slope", (0.8, 0.97)))
        solid = hull_of(prism(outline, 0, 0.6 * lay.base), prism(inner, 0.5 * lay.base, lay.base))
        if kind == "boat":  # a rounded rear block
            solid += box((-0.3 * lay.length, back), 0.9 * half, (0.001, lay.base), fillet=0.002)
    anvil = -lay.length + 0.012
    solid += box(about(anvil, 0.006), 0.0065, (lay.base - 0.002, lay.base + 0.0005))
    if draws.chance("rib", 0.5):
        step = draws.number("rib_end", (0.15, 0.3)) * lay.length
        solid += box((anvil + 0.012, -step), 0.4 * inside, (lay.base - 0.002, lay.base + 0.0006), fillet=0.001, axis=2)
    rise = lay.hinge + draws.number("cheek_height", (0.3, 0.6)) * lay.tail
    foot = [(-run, lay.base - 0.002), (min(0.95 * lay.tail, 0.98 * back), lay.base - 0.002)]
    crown = [(-0.5 * lay.tail, rise), (0.4 * lay.tail, rise), (min(0.9 * lay.tail, 0.98 * back), lay.hinge)]
    for side in (-1, 1):
        head = side * (inside + cheek)
        solid += prism(foot + crown, *ends((side * inside, head)), axis=1)
        solid += rod(0, (head - side * 0.001, head + side * 0.0008), lay.hinge, 0.3 * lay.tail)
    if draws.chance("pad", 0.4):
        solid += box((front + 0.008, back - 0.006), 0.8 * half, (-0.0015, 0.001), fillet=0.003, axis=2)
    return solid


def _magazine(draws: Draws, lay: Layout) -> Solid:
    """Channel of the staples: a long box that ends in a round tongue at the hinge."""
    half = 0.5 * lay.width
    low, high = lay.base + draws.length("clearance", (0.0025, 0.005)), lay.magazine
    start = -lay.length + draws.length("inset", (0.0, 0.004))
    solid = box((start, -1.4 * lay.tail), half, (low, high))
    tongue = rod(0, (-half, half), lay.hinge, high - lay.hinge, sections=20)
    solid += hull_of(tongue, box((-1.6 * lay.tail, -1.4 * lay.tail), half, (low, high)))
    return solid + box((start - 0.0015, start + 0.001), 0.8 * half, (low + 0.001, high - 0.001))


def _arm(draws: Draws, lay: Layout, width: float) -> Solid:
    """Shell above the magazine, with skirts that reach down beside it; narrow between the cheeks."""
    low = lay.magazine + GAP
    tall = lay.length * draws.number("height", (0.06, 0.28))
    narrow = lay.inside - GAP
    front = -lay.length - draws.length("reach", (0.0, 0.006))
    neck, tail = -lay.run - 0.001, draws.number("tail", (0.3, 0.6)) * lay.tail
    x = np.array([front, 0.85 * front, 0.6 * front, min(neck - 0.004, 0.35 * front), neck, 0.0, tail])
    kind = draws.pick("shape", ["straight", "arched", "nosed", "wedge", "tapered"])
    if lay.back < lay.tail and draws.chance("turns_over", 0.3):  # nothing behind the hinge keeps it from that
        kind = "tapered"
    heights = {
        "straight": (0.85, 0.95, 1.0, 1.0, 0.9, 0.8, 0.5),
        "arched": (0.5, 0.8, 1.05, 1.05, 0.85, 0.7, 0.4),
        "nosed": (1.0, 1.1, 0.85, 0.75, 0.7, 0.65, 0.45),
        "wedge": (1.15, 1.1, 0.95, 0.8, 0.7, 0.6, 0.45),
        "tapered": (1.0, 1.05, 0.95, 0.6, 0.25, 0.15, 0.1),  # low at the hinge: turns over to lie behind
    }[kind]
    top = low + np.maximum(tall * np.array(heights), 0.004)
    waist, nose = draws.number("waist", (0.75, 1.0)), 0.5 * width * draws.number("nose", (0.8, 1.0))
    plan = np.maximum([nose, 0.5 * width, 0.5 * width, 0.5 * waist * width, 0, 0, 0], narrow)
    plan[-1] = 0.9 * narrow
    bevel = draws.number("bevel", (0.15, 0.6))
    sections = []
    for k in range(len(x)):
        cut = bevel * min(plan[k], top[k] - low)
        corners = [(plan[k], low), (plan[k], top[k] - cut), (plan[k] - 0.5 * cut, top[k] - 0.3 * cut)]
        corners.append((plan[k] - 1.2 * cut, top[k]))
        sections.append(np.array([(x[k], side * max(y, 0.0), z) for y, z in corners for side in (-1, 1)]))
    solid = loft(sections)
    hem = draws.number("skirt", (0.15, 0.85)) * (low - lay.base - 0.003)
    for side in (-1, 1):
        y = ends((side * (0.5 * lay.width + GAP), side * narrow))
        skirt = [(0.92 * front, low + 0.001), (0.88 * front, low - hem), (neck, low - hem), (neck, low + 0.001)]
        solid += prism(skirt, *y, axis=1)
        eye = rod(0, y, lay.hinge, 0.7 * lay.tail, sections=16)
        solid += hull_of(eye, box((neck, 0.3 * lay.tail), y, (low, low + 0.002)))
    return solid
