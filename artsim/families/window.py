"""Windows: one to three sashes in a frame, hinged at a side, at the top or bottom, or sliding sideways or upward.

Sashes open towards -X, the room; hinged ones mostly have a handle that turns, and some stand ajar. Sizes, glazing bars,
mullions, fixed lights, sills, the surrounding wall, and how far the sashes open vary.
"""

import numpy as np

from artsim.families.details import bar_handle, grid_panel, swing_limits
from artsim.families.fronts import HINGES
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, UP, Array, about
from artsim.making.solids import Solid, box, cylinder, frame

GAP = 0.003
PANE = 0.006


class Style:
    """What the sashes of a window share."""

    def __init__(self, draws: Draws, most: float) -> None:
        self.thick = min(draws.length("sash_thickness", (0.03, 0.045)), most)
        self.columns = draws.pick("pane_columns", {1: 0.6, 2: 0.25, 3: 0.15})
        self.rows = draws.pick("pane_rows", {1: 0.55, 2: 0.3, 3: 0.15})
        self.rail = draws.length("sash_rail", (0.035, 0.065))

    def sash(self, low: Array, high: Array) -> Solid:
        """A sash with these corners: a frame around panes."""
        columns = np.linspace(low[1] + self.rail, high[1] - self.rail, self.columns + 1)[1:-1]
        rows = np.linspace(low[2] + self.rail, high[2] - self.rail, self.rows + 1)[1:-1]
        return grid_panel(low, high, [self.rail] * 4, columns, rows, 0.022, PANE)


def build(draws: Draws) -> Assembly:
    """A window, mostly closed at rest."""
    kind = draws.pick("kind", {"hinged": 0.6, "sliding": 0.22, "hung": 0.18})
    count = draws.pick("lights", {1: 0.4, 2: 0.4, 3: 0.2})  # side by side, each with a sash or fixed
    if kind == "sliding":
        count = max(count, 2)
    width = draws.length("width", (0.35, 1.0)) * (count if kind != "hung" else 1)  # drawn for one light
    height = draws.length("height", (0.5, 1.8)) if kind != "hung" else draws.length("height", (1.3, 2.0), of=width)
    bar, depth = draws.lengths(frame_width=(0.035, 0.065), depth=(0.05, 0.22))
    style = Style(draws, 1.0 if kind == "hinged" else 0.035)
    if kind != "hinged":
        depth = max(depth, (count if kind == "sliding" else 2) * (style.thick + GAP) + 0.015)
    window = Assembly("frame", _frame(draws, width, height, depth, bar), 700.0)
    if kind == "hung":
        _hung(draws, window, width, height, depth, style)
    else:
        {"hinged": _swing, "sliding": _slide}[kind](draws, window, width, height, depth, style, count)
    return window


def _frame(draws: Draws, width: float, height: float, depth: float, bar: float) -> Solid:
    """Frame around an opening of ``width`` x ``height`` above Z = 0, with a sill, a casing or a piece of wall."""
    x0, x1, y = -depth / 2, depth / 2, width / 2
    solid = frame((x0, -y - bar, -bar), (x1, y + bar, height + bar), [bar] * 4)
    if draws.chance("sill", 0.4):
        out, over = draws.lengths(sill_depth=(0.02, 0.12), sill_overhang=(0.0, 0.08))
        solid += box((x0 - out, x1), y + bar + over, (-bar - 0.02, -bar + 0.006), fillet=0.006, axis=1)
    around = draws.pick("surround", {"casing": 0.25, "some wall": 0.15, "wall": 0.15, "none": 0.45})
    if around == "casing":  # level with the frame so that sashes can pass
        wide = draws.length("casing_width", (0.04, 0.09))
        low, high = (x0, -y - bar - wide, -bar - wide), (x0 + 0.018, y + bar + wide, height + bar + wide)
        solid += frame(low, high, [wide + 0.001] * 4)
    elif around != "none":  # on each side as wide as it happens to be
        left, right, below, above = draws.numbers("wall_width", 0.05, 1.0 if around == "wall" else 0.35, 4, unit="m")
        low, high = (x0 + 0.005, -y - bar - left, -bar - below), (x1 - 0.004, y + bar + right, height + bar + above)
        solid += frame(low, high, [w + 0.002 for w in (left, right, below, above)])
    return solid


def _swing(draws: Draws, window: Assembly, width: float, height: float, depth: float, style: Style, count: int) -> None:
    """Lights side by side between mullions; each hinged or fixed. Two may meet without a mullion between them."""
    x0 = -depth / 2
    mullion = draws.length("mullion_width", (0.03, 0.06))
    top = height
    if draws.chance("top_light", 0.2) and height > 0.9:  # fixed
        top = draws.length("top_light_sill", (0.68, 0.78), of=height)
        window.body += box((x0, depth / 2), width / 2 + 0.001, (top, top + mullion))
        window.body += box(PANE / 2, width / 2 + 0.001, (top, height + 0.001)).called("glass", FRONT)
    meeting = count == 2 and draws.chance("sashes_meet", 0.45)
    edges = np.linspace(-width / 2, width / 2, count + 1)
    sideways = draws.chance("hinged_at_side", 0.65) or meeting
    own = draws.pick("hinge", ["left", "right"] if sideways else ["top", "top", "bottom"])
    limit = draws.turn("sash_angle", (40.0, 178.0) if sideways else (20.0, 75.0))
    ajar = draws.number("open_share", (0.1, 0.6)) if draws.chance("ajar", 0.25) else 0.0
    one_fixed = count > 1 and not meeting and draws.chance("one_fixed", 0.35)
    fixed = draws.integer("fixed_light", 0, count - 1) if one_fixed else -1
    leaves = []
    lever_turns = draws.chance("handle", 0.7)
    for k in range(count):
        first = edges[k] + (mullion / 2 if k > 0 and not meeting else 0.0)
        last = edges[k + 1] - (mullion / 2 if k < count - 1 and not meeting else 0.0)
        if k < count - 1 and not meeting:
            window.body += box((x0, depth / 2), about(edges[k + 1], mullion / 2), (-0.001, top + 0.001))
        if k == fixed:
            low = np.array([x0 + 0.01, first - 0.001, -0.001])
            window.body += style.sash(low, np.array([x0 + 0.01 + style.thick, last + 0.001, top + 0.001]))
            continue
        hinge = {0: "right", count - 1: "left"}.get(k, own) if sideways and count > 1 else own
        low, high = np.array([x0, first + GAP, GAP]), np.array([x0 + style.thick, last - GAP, top - GAP])
        outer = (hinge == "left" and k == count - 1) or (hinge == "right" and k == 0)
        leaves.append((hinge, low, high, outer))
    for number, (hinge, low, high, outer) in enumerate(leaves):
        name = "sash" if len(leaves) == 1 else f"sash_{number}"
        _leaf(window, name, hinge, low, high, style, limit, outer, lever_turns)
        if ajar > 0 and number == 0:
            window.open_at_rest(name, ajar * min(limit, 1.2))


def _leaf(
    window: Assembly, name: str, hinge: str, low: Array, high: Array, style: Style, limit: float, outer: bool,
    lever_turns: bool,
) -> None:  # fmt: skip
    """A hinged sash, mostly with a handle that turns on it, on the edge that opens."""
    rail, (across, end, axis) = style.rail, HINGES[hinge]
    along = 3 - across
    edge = high[across] if end > 0 else low[across]
    foot = 0.5 * (low + high)
    foot[0], foot[across] = low[0], edge - end * (high[across] - low[across] - rail / 2)
    solid = style.sash(low, high)
    half = np.array([0.005, min(0.011, 0.35 * rail), min(0.011, 0.35 * rail)])
    half[along] = 0.03
    solid += box(foot - half - (0.004, 0, 0), foot + half, fillet=0.003, steps=2)
    origin = foot.copy()
    origin[0], origin[across] = low[0] - 0.001, edge
    stay, most = swing_limits(abs(foot[across] - edge) - 0.12, 0.05)  # whichever way the lever points
    angle = min(limit, most if outer else stay)
    window.add(name, solid, revolute("frame", axis, tuple(origin), 0.0, angle), label="sash", density=900.0)

    if not lever_turns:
        return
    # The lever lies along the rail at rest and turns towards the glass.
    reach = 0.042
    tip = foot.copy()
    tip[along] -= 0.11
    lever = cylinder(foot - (0.010, 0, 0), foot - (reach, 0, 0), 0.008, sections=12)
    corner_low, corner_high = np.minimum(foot, tip) - 0.007, np.maximum(foot, tip) + 0.007
    corner_low[0], corner_high[0] = foot[0] - reach - 0.004, foot[0] - reach + 0.008
    lever += box(corner_low, corner_high, fillet=0.005, steps=2)
    joint = revolute(name, (float(end if along == 2 else -end), 0, 0), tuple(foot), 0.0, np.pi / 2)
    window.add(name.replace("sash", "handle"), lever, joint, label="handle", density=2500.0)


def _slide(draws: Draws, window: Assembly, width: float, height: float, depth: float, style: Style, count: int) -> None:
    """Sashes on as many tracks; each may slide over all others."""
    rail, pitch = style.rail, width / count
    order = draws.rng.permutation(count)
    for k in range(count):
        x = -depth / 2 + 0.006 + order[k] * (style.thick + GAP)
        overlap = rail / 2
        first = -width / 2 + k * pitch - (overlap if k > 0 else -GAP)
        last = -width / 2 + (k + 1) * pitch + (overlap if k < count - 1 else -GAP)
        low, high = np.array([x, first, GAP]), np.array([x + style.thick, last, height - GAP])
        solid = style.sash(low, high)
        y = first + rail / 2 if k == 0 else last - rail / 2
        pull = box((x - 0.0018, x + 0.002), about(y, 0.3 * rail), (0.4 * height, 0.4 * height + 0.14))
        solid += pull.called("handle", FRONT)
        right, left = first + width / 2 - GAP, width / 2 - last - GAP  # travel to either side
        joint = prismatic("frame", SIDE, min(0.0, -right), max(0.0, left), tuple(0.5 * (low + high)))
        window.add(f"sash_{k}", solid, joint, density=900.0)


def _hung(draws: Draws, window: Assembly, width: float, height: float, depth: float, style: Style) -> None:
    """A lower sash in front that slides up, and an upper one behind it that slides down or is fixed."""
    rail = style.rail
    both, meet = draws.chance("both_slide", 0.6), draws.length("meeting_rail", (0.45, 0.55), of=height)
    solids = []
    for track, (first, last) in enumerate(((GAP, meet + rail / 2), (meet - rail / 2, height - GAP))):
        x = -depth / 2 + 0.006 + track * (style.thick + GAP)
        low, high = np.array([x, -width / 2 + GAP, first]), np.array([x + style.thick, width / 2 - GAP, last])
        solid = style.sash(low, high)
        if track == 0:  # two lifts on the lower rail
            z = first + rail / 2
            for y in (-0.25 * width, 0.25 * width):
                solid += bar_handle((x, y - 0.04, z), (x, y + 0.04, z), (-1, 0, 0), 0.022, 0.005)
        solids.append((solid, tuple(0.5 * (low + high))))
    if not both:
        stop = (-depth / 2 + 0.006 + style.thick + 2 * GAP, depth / 2 - 0.002), (-width / 2 - 0.001, -width / 2 + 0.01)
        window.body += solids[1][0] + box(*stop, (meet, height + 0.001))
    up = prismatic("frame", UP, 0.0, height - meet - rail / 2 - GAP, solids[0][1])
    window.add("sash_0" if both else "sash", solids[0][0], up, density=900.0)
    if both:
        down = prismatic("frame", (0, 0, -1), 0.0, meet - rail / 2 - GAP, solids[1][1])
        window.add("sash_1", solids[1][0], down, density=900.0)
