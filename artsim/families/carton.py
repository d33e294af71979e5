"""Cartons: cardboard boxes with flaps.

Flaps share the opening without overlapping one another, so each of them moves freely: mitred, one pair between the
other, around a hole, or with the inner pair folding down into the carton. Sizes (a few are flat, long or tall), how far
flaps reach and turn, and hand holes vary.
"""

import numpy as np

from artsim.families.proportions import unusual_sides
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.solids import Solid, box, deferred, frame, hull, tray
from artsim.model.kinematics import Array

GAP = 0.0015
LEAST_SHARES, MOST_SHARES = (0.29, 0.43, 0.075), (0.765, 0.95, 0.79)
"""Depth, width and height of unusual boxes over their diagonal."""


def carton(draws: Draws) -> Assembly:
    """Cardboard box; the longer flaps hang on the front and the back."""
    width = draws.length("width", (0.18, 0.6))
    depth, height = width * draws.number("depth", (0.5, 1.0)), width * draws.number("height", (0.3, 1.3))
    if draws.chance("unusual", 0.3):
        depth, width, height = unusual_sides(draws, LEAST_SHARES, MOST_SHARES, (0.14, 0.18, 0.06))
    wall = draws.length("wall", (0.003, 0.005))
    x, y = depth / 2, width / 2
    result = Assembly("body", _carton_body(draws, x, y, height, wall), 150.0)
    kinds = {"one": 0.12, "two": 0.25, "mitred": 0.14, "long": 0.16, "short": 0.11, "wheel": 0.1, "inner": 0.12}
    kind = draws.pick("flap_pattern", kinds)
    flaps = _flaps(draws, kind, x, y, wall, height)
    limit = np.deg2rad(_limit(draws, 100.0))
    for number, (side, inward, outline) in enumerate(flaps):
        across, sign, axis = _SIDES[side]
        edge = (x, y)[across]
        origin = np.zeros(3)
        if inward:  # below the others, within the walls: it folds down into the carton
            edge = edge - wall - GAP
            solid = _flap(side, outline, edge, height - wall, height)
            origin[across], origin[2] = sign * edge, height - wall
            joint = revolute("body", -np.asarray(axis), origin, 0.0, np.deg2rad(86.0))
        else:  # it lies on the walls, and turns about its upper edge, so that it may hang down outside
            own_limit = limit if draws.chance("flaps_alike", 0.7) else np.deg2rad(_limit(draws, 95.0))
            z = height + GAP + (0.0007 if side in ("left", "right") else 0.0)
            solid = _flap(side, outline, edge, z, z + wall)
            if kind == "one" and draws.chance("lipped", 0.5):  # over the front
                lip = min(draws.length("lip", (0.03, 0.08)), 0.6 * height)
                solid += box((-x - GAP - wall, -x - GAP), y, (z - lip, z + wall))
                solid += box((-x - GAP - wall, 0), y, (z, z + wall))
            # The axis lies beyond the wall, which a flap turned by 270 degrees hangs beside.
            origin[across], origin[2] = sign * (edge + GAP), z + wall
            joint = revolute("body", axis, origin, 0.0, own_limit)
        result.add(f"flap_{number}", solid, joint)
    return result


def _limit(draws: Draws, least: float) -> float:
    """Degrees that a flap turns by; some hang down flat against the outside."""
    return 270.0 if draws.chance("hangs_down", 0.2) else draws.degrees("flap_angle", (least, 250.0))


def _carton_body(draws: Draws, x: float, y: float, height: float, wall: float) -> Solid:
    if not (draws.chance("hand_holes", 0.35) and min(x, y) > 0.1 and height > 0.15):
        return tray((-x, -y, 0), (x, y, height), wall)
    solid = box(x, y, (0, wall)) + box((-x, -x + wall), y, (0, height)) + box((x - wall, x), y, (0, height))
    low, high = height * draws.number("hole_bottom", (0.6, 0.68)), height * draws.number("hole_top", (0.75, 0.82))
    half = min(draws.length("hole_width", (0.035, 0.05)), 0.6 * x)
    for end in (-y, y - wall):
        solid += frame((-x, end, 0), (x, end + wall, height), [x - half, x - half, low, height - high], 0, 2)
    return solid


Flap = tuple[str, bool, Array]
"""Where it hangs, whether it folds inward, and its outline (N, 2): distance from the hinge, and position along it."""


def _flaps(draws: Draws, kind: str, x: float, y: float, wall: float, height: float) -> list[Flap]:
    c = 0.002  # between flaps

    def bar(reach: float, low: float, high: float, tip: float = 0.0) -> Array:
        return np.array([(0.0, low), (0.0, high), (reach, high - tip), (reach, low + tip)])

    tip = draws.one_of("flap_ends", {"square": 0.0, "tapered": draws.length("flap_taper", (0.0, 0.03))})
    if kind == "one":
        return [("back", False, bar(2 * x, -y, y, 0.0))]
    if kind == "two":
        uneven, short = draws.number("first_reach", (0.5, 1.5)), draws.number("short_reach", (0.4, 0.9))
        first = {"even": 1.0, "uneven": uneven, "short": short}
        share = first[draws.pick("flaps_reach", ["even", "even", "uneven", "short"])]
        second = 2.0 - share if share > 1.0 or draws.chance("flaps_meet", 0.5) else share
        if draws.chance("wide_flaps", 0.7):
            return [("front", False, bar(share * x - c, -y, y, tip)), ("back", False, bar(second * x - c, -y, y, tip))]
        return [("left", False, bar(share * y - c, -x, x, tip)), ("right", False, bar(second * y - c, -x, x, tip))]
    if kind == "wheel":  # each flap ends at the next one's side
        p = y * draws.number("flap_width", (0.4, 0.9))
        return [
            ("front", False, bar(x - c, -y, y - p - c)),
            ("left", False, bar(p - c, -x, -c)),
            ("back", False, bar(x - c, -y + p + c, y)),
            ("right", False, bar(p - c, c, x)),
        ]
    if kind == "mitred":  # at 45 degrees, whatever their reach; a raised flap's inner edge clears the next one's corner
        corner, least = wall + c, min(x, y)
        long, short = least * draws.number("long_reach", (0.6, 1.0)), least * draws.number("short_reach", (0.6, 0.95))
        longs = bar(long - c, -y + corner, y - corner, long - c)
        ends = bar(short - c, -x + corner, x - corner, short - 2 * c - wall)
    elif kind == "long":  # short flaps reach a little way, long ones lie between them
        short = y * draws.number("short_reach", (0.15, 0.6))
        longs = bar(x * draws.pick("long_reach", [1.0, 0.8]) - c, -y + short + 2 * c, y - short - 2 * c, tip)
        ends = bar(short, -x, x, min(tip, 0.2 * x))
    elif kind == "short":
        reach = x * draws.number("long_reach", (0.25, 0.6))
        longs = bar(reach, -y, y, min(tip, 0.2 * y))
        ends = bar(y * draws.pick("short_reach", [1.0, 0.7]) - c, -x + reach + 2 * c, x - reach - 2 * c, tip)
    else:
        longs = bar(x - c, -y, y, tip)
        short = min(y * draws.number("short_reach", (0.5, 0.95)), height - 0.02)
        ends = bar(short, -x + wall + c, x - wall - c, 0.01)
    inward = kind == "inner"
    return [(side, False, longs) for side in ("front", "back")] + [(side, inward, ends) for side in ("left", "right")]


# Of each side: the axis across the hinge (0: X, 1: Y), its sign at that side, and the direction of the hinge.
_SIDES = {"front": (0, -1.0, (0.0, -1.0, 0.0)), "back": (0, 1.0, (0.0, 1.0, 0.0)),
          "left": (1, 1.0, (-1.0, 0.0, 0.0)), "right": (1, -1.0, (1.0, 0.0, 0.0))}  # fmt: skip


@deferred
def _flap(side: str, outline: Array, edge: float, low: float, high: float) -> Solid:
    """Flat piece between two heights from an outline along a hinge at distance ``edge`` from the middle."""
    across, sign, _ = _SIDES[side]
    points = np.empty((2, len(outline), 3))
    points[:, :, across] = sign * (edge - outline[:, 0])
    points[:, :, 1 - across] = outline[:, 1]
    points[0, :, 2], points[1, :, 2] = low, high
    return hull(points.reshape(-1, 3))
