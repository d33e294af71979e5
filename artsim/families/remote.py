"""Remote controls that stand upright: keys on the front towards -X, a battery cover on the back.

What varies: the outline and the back; bands of keys (numbers, rows, rockers, a slide switch, a pad or a dial); a
battery cover and a front cover that slide or swing; a hinged antenna.
"""

import numpy as np

from artsim.common.elementary import exp, sin
from artsim.families.details import dial
from artsim.families.keys import Face, add_buttons, add_key, front_face, key, key_cells, key_outline, pill
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import Array, cross_sections
from artsim.making.solids import Solid, box, deferred, loft, ring, rod

GAP = 0.0005
MOST_KEYS = 34
_BANDS = {"numbers": (3, 4, 4.0), "rockers": (2, 1, 2.6), "slider": (1, 1, 2.2), "pad": (5, 1, 0.0)}
"""Columns and rows of keys of a band, and its height in pitches."""


class _Body:
    """Cross-sections of the body: x of front and back and half of the width at heights; the keys stand at x = 0."""

    def __init__(self, draws: Draws) -> None:
        length = draws.log_length("height", 0.17, -0.75, 0.6)
        half = 0.5 * draws.triangular("width", 0.16, 0.26, 0.62, of=length, unit="m")
        thick = max(draws.triangular("depth", 0.035, 0.1, 0.26, of=length, unit="m"), 0.006)
        low, high = draws.number("keys_bottom", (0.06, 0.3)), draws.number("keys_top", (0.9, 0.96))
        share = np.unique([*np.linspace(0.0, 1.0, 8), low, high])  # the face between low and high is flat
        self.levels = levels = length * share
        kind = draws.pick("outline", {"straight": 0.34, "tapered": 0.24, "waisted": 0.24, "oval": 0.18})
        amount = draws.number("outline_amount", (0.12, 0.5))
        if kind == "tapered":
            widths = 1.0 - amount * (share if draws.chance("narrow_top", 0.5) else 1.0 - share)
        elif kind == "waisted":
            shifted = np.clip((share - draws.number("waist_place", (0.0, 0.2))) / 0.8, 0.0, 1.0)
            widths = 1.0 - amount * np.square(sin(np.pi * shifted))
        elif kind == "oval":
            widths = np.sqrt(1.0 - (0.9 + 0.08 * amount) * np.square(2.0 * share - 1.0))
        else:
            widths = np.ones(len(levels))
        round_end = draws.number("round_ends", (0.0, 0.6)) if kind != "oval" else 0.0
        at_end = (levels == 0) | (levels == length)
        widths = widths * np.where(at_end, 1.0 - round_end, 1.0)
        # Ends of the front bend back or forward beyond the keys; the back has humps.
        bends = draws.numbers("end_bend", -0.1, 0.3, 2) * length * draws.pick("bent", {False: 0.35, True: 0.65})
        below, above = np.clip((low - share) / low, 0.0, 1.0), np.clip((share - high) / (1 - high), 0.0, 1.0)
        self.fronts = fronts = bends[0] * low * 2.0 * np.square(below) + 0.15 * bends[1] * np.square(above)
        hump = draws.number("hump", (0.0, 1.2)) * draws.pick("humped", [False, True])
        spot, wide = draws.number("hump_place", (0.1, 0.9)), draws.number("hump_width", (0.15, 0.4))
        slim = draws.number("bottom_depth", (0.45, 1.0))
        depth = thick * (slim + (1.0 - slim) * share + hump * exp(-np.square((share - spot) / wide)))
        backs = fronts + depth * np.where(at_end, draws.number("end_depth", (0.6, 1.0)), 1.0)
        self.backs = np.maximum(backs, np.maximum(fronts, 0.0) + 0.004)
        self.halves = half * widths
        roundness = draws.number("roundness", (0.1, 0.95))
        inside = (share >= low - 1e-9) & (share <= high + 1e-9)
        # Edges as round as the body is thick leave no room for keys on a narrow one.
        edge = 0.5 * np.minimum(self.backs - fronts, 2.0 * half * widths)
        self.roundness = min(roundness, float((0.55 * half * widths / edge)[inside].min()))
        self.key_low, self.key_high = low * length, high * length
        room = float((self.halves - self.roundness * edge)[inside].min())
        self.key_half = room * draws.number("keys_width", (0.82, 0.97))

    def at(self, z: float | Array) -> tuple[Array, Array, Array]:
        """Front, back and half width at a height."""
        return tuple(np.interp(z, self.levels, row) for row in (self.fronts, self.backs, self.halves))  # type: ignore[return-value]

    @deferred
    def between(self, low: float, high: float, inset: float = 0.0) -> Solid:
        """The body between two heights, its back set forward by ``inset``."""
        inside = self.levels[(self.levels > low + 1e-5) & (self.levels < high - 1e-5)]
        levels = np.concatenate([[low], inside, [high]])
        fronts, backs, halves = self.at(levels)
        return loft(cross_sections(levels, fronts, backs - inset, halves, self.roundness))


def build(draws: Draws) -> Assembly:
    """A remote control; no key is pressed and all covers are closed at rest."""
    body = _Body(draws)
    remote = Assembly(density=1100.0)
    if not _battery_cover(draws, remote, body):
        remote.add("body", body.between(body.levels[0], body.levels[-1]), density=900.0)
    height = _keys(draws, remote, body)
    if draws.chance("cover", 0.2) and body.fronts.min() > -1e-6:  # no end that is bent forward is in the way
        _front_cover(draws, remote, body, height)
    if draws.chance("antenna", 0.08):
        _antenna(draws, remote, body)
    return remote


def _battery_cover(draws: Draws, remote: Assembly, body: _Body) -> bool:
    """Add the body with a recess in the back and a cover over it; False where there is none."""
    length = float(body.levels[-1])
    thick = draws.length("battery_cover_thickness", (0.0012, 0.0022))
    thick = min(thick, 0.3 * float((body.backs - body.fronts).min()))
    if not draws.chance("battery_cover", 0.7, upper=True):
        return False
    end = draws.number("battery_cover_length", (0.3, 0.62)) * length
    levels = np.concatenate([[0.0], body.levels[(body.levels > 0) & (body.levels < end - 0.001)], [end - GAP]])
    fronts, backs, halves = body.at(levels)
    even = np.ptp(backs) < 0.06 * length and backs.min() - thick > fronts.max() + 0.003
    slides = bool(even and np.ptp(halves) < 0.3 * halves.max()) and draws.chance("battery_cover_slides", 0.75)
    if not slides and backs[0] > backs.min() + 0.1 * end:
        return False  # the bent end of the body would stop a cover that swings
    solid = body.between(end, length)
    if slides:  # over a flat back
        backs, lower = np.full(len(levels), backs.min()), np.append(levels[:-1], end + 0.0004)
        solid += loft(cross_sections(lower, fronts, backs - thick, halves, body.roundness))
    else:
        solid += body.between(0.0, end + 0.0004, thick)
    remote.add("body", solid, density=900.0)
    cover = loft(cross_sections(levels, backs - thick + GAP, backs, 0.96 * halves, 0.9, 1))
    if slides:
        travel = draws.number("battery_cover_travel", (0.3, 1.0)) * end
        joint = prismatic("body", (0, 0, -1), 0.0, travel, (float(backs[0]), 0, 0))
    else:
        # All of it lies on one side of the axis, so that none of it moves towards the body.
        angle = draws.angle("battery_cover_angle", (0.9, 1.9))
        joint = revolute("body", (0, 1, 0), (float(backs.min()) - thick, 0, 0), 0.0, angle)
    remote.add("battery_cover", cover, joint, density=900.0)
    return True


def _keys(draws: Draws, remote: Assembly, body: _Body) -> float:
    """Bands of keys from the top down; returns how far they stand out."""
    face, half = front_face(0.0), body.key_half
    height, travel = draws.lengths(key_height=(0.0009, 0.0035), key_travel=(0.0003, 0.0008))
    pitch = min(max(half * draws.number("key_pitch", (0.45, 0.8)), 0.0055), 0.02)
    kind = draws.pick("key_shape", {"square": 0.3, "pill": 0.35, "round": 0.3, "diamond": 0.05})
    fill, shrink = draws.number("key_fill", (0.55, 0.85)), draws.number("key_taper", (0.0, 0.35))
    bands = _plan(draws, half, body.key_high - body.key_low, pitch)
    spare = body.key_high - body.key_low - sum(deep for _, _, _, deep in bands)
    gap = min(spare / len(bands), draws.number("band_gap", (0.2, 2.0)) * pitch)
    top, count, tallest = body.key_high, 0, height
    for band, columns, rows, deep in bands:
        if band == "pad":
            tallest = max(tallest, _pad(draws, remote, face, top - 0.5 * deep, 0.46 * deep, height, travel))
        elif band == "slider":
            outline, start = pill(min(half, 1.6 * pitch), 0.8 * pitch), top - deep + 0.5 * pitch
            slide = prismatic("body", (0, 0, 1), 0.0, deep - pitch, tuple(face.at(0.0, start)))
            remote.add("slider", key(face, 0.0, start, outline, 0.0004, height + 0.0006), slide)
        else:
            size = np.array([min(fill * 2.0 * half / columns, 1.9 * pitch), fill * deep / rows])
            outline = key_outline("pill" if band == "rockers" else kind, size, 10)
            spots = list(key_cells((-half, half), (top - deep, top), columns, rows))
            if band == "rockers" and height > 0.0016 and draws.chance("rockers_tilt", 0.7):
                tilt = 0.6 * (0.8 * (height - 0.0004) / float(size[1]))
                for number, (u, v) in enumerate(spots, count):
                    solid = key(face, u, v, outline, 0.5 * height, height + 0.0004, shrink)
                    hinge = revolute("body", (0, 1, 0), face.at(u, v, 0.5 * height), -tilt, tilt)
                    remote.add(f"button_{number}", solid, hinge)
                tallest = max(tallest, 1.8 * height)
            else:
                add_buttons(remote, "body", face, spots, outline, height, travel, shrink, count)
            count += len(spots)
        top -= deep + gap
    return tallest


def _plan(draws: Draws, half: float, room: float, pitch: float) -> list[tuple[str, int, int, float]]:
    """Kind, columns, rows and height of each band of keys; at least one, at most ``MOST_KEYS`` keys."""
    wanted = list(draws.rng.permutation(["pad", "numbers", "rockers", "row", "row", "slider"]))
    wanted = ["row", *wanted[: draws.integer("band_kinds", 1, 5)], "numbers", "row"][: draws.integer("bands", 1, 8)]
    bands: list[tuple[str, int, int, float]] = []
    count, left = 0, room
    for band in wanted:
        columns = draws.integer("key_columns", *((2, 4) if half > 0.009 else (1, 2)))
        columns, rows, pitches = _BANDS.get(band, (columns, 1, 1.0))
        deep = min(2.0 * half, 0.06) if band == "pad" else pitches * pitch
        narrow = band != "pad" and 2.0 * half / columns < 0.003
        if deep <= left and count + rows * columns <= MOST_KEYS and not narrow:
            bands.append((band, columns, rows, deep))
            count, left = count + rows * columns, left - deep
    return bands or [("row", 1, 1, min(room, 2.0 * half))]


def _pad(draws: Draws, remote: Assembly, face: Face, v: float, radius: float, height: float, travel: float) -> float:
    """Four keys about a fifth, or a dial; returns how far that stands out."""
    center = tuple(face.at(0.0, v))
    if draws.chance("dial", 0.2):
        reach = max(height + 0.001, 0.004)
        solid = dial(center, (-1, 0, 0), reach, radius, 20)
        remote.add("dial", solid, continuous("body", (-1, 0, 0), center))
        return reach
    inner = radius * draws.number("select_radius", (0.38, 0.55))
    low, high = travel + 0.0003, max(height, travel + 0.0008) * draws.number("arrow_height", (0.8, 1.3))
    middle = tuple(face.at(0.0, v, 0.5 * (low + high)))
    for k in range(4):
        turn = k * 0.5 * np.pi
        solid = ring(middle, (-1, 0, 0), inner + 0.0004, radius, high - low, 3, (turn - 0.7, turn + 0.7))
        remote.add(f"arrow_{k}", solid, prismatic("body", (1, 0, 0), 0.0, travel, middle))
    outline = key_outline("round", (1.7 * inner, 1.7 * inner), 14)
    add_key(remote, "body", "select", face, (0.0, v), outline, height, travel)
    return max(high, height)


def _front_cover(draws: Draws, remote: Assembly, body: _Body, height: float) -> None:
    """A cover over the lower keys, which swings down or slides down."""
    low, share = body.key_low, draws.number("cover_length", (0.3, 0.7))
    high = low + share * (body.key_high - low)
    _, _, halves = body.at(np.linspace(low, high, 8))
    half = float(halves.min())
    back, thick = -height - 0.0006, draws.length("cover_thickness", (0.0012, 0.003))
    cover = box((back - thick, back), half, (low, high), fillet=0.3 * half, axis=0)
    if draws.chance("cover_slides", 0.5):
        travel = draws.number("cover_travel", (0.6, 1.0)) * (high - low)
        joint = prismatic("body", (0, 0, -1), 0.0, travel, (back, 0, low))
    else:
        cover += rod(back - thick, (-half, half), low, 0.8 * thick, sections=10)
        joint = revolute("body", (0, -1, 0), (back - thick, 0, low), 0.0, draws.angle("cover_angle", (1.2, 2.6)))
    remote.add("cover", cover, joint, density=1000.0)


def _antenna(draws: Draws, remote: Assembly, body: _Body) -> None:
    """A rod at the top that turns from side to side."""
    length = float(body.levels[-1])
    radius = draws.length("antenna_radius", (0.0015, 0.003))
    x, z = float(body.fronts[-1] + 0.5 * (body.backs[-1] - body.fronts[-1])), length + radius + GAP
    stalk = rod(x, 0, (z, z + length * draws.number("antenna_length", (0.2, 0.8))), radius, 0.7 * radius, 12)
    stalk += rod((x - radius, x + radius), 0, z, radius, sections=12)
    remote.add("antenna", stalk, revolute("body", (1, 0, 0), (x, 0, z), -0.35, 0.35), density=2000.0)
