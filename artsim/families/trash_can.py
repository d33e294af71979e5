"""Trash cans: pedal bins, bins with a swinging flap, bins with two lids, wheelie bins.

Round or rectangular, low to slim and tall, straight or tapered; the lid turns at the back, about its middle, or in two
halves at the sides. A pedal follows the lid; wheelie bins have two wheels and a grip at the back.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from artsim.common.elementary import cos, hypot, sin
from artsim.families.details import rounded_tray
from artsim.making.assembly import Assembly, continuous, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, about, ends
from artsim.making.solids import Solid, box, deferred, hull_of, rod, tube, union

GAP = 0.0015


class Bin:
    """Half depth, half width and height of a bin, radius of its corners, how much it narrows below; metres."""

    def __init__(self, draws: Draws) -> None:
        self.x, self.y = 0.5 * draws.length("depth", (0.18, 0.48)), 0.5 * draws.length("width", (0.18, 0.56))
        self.height = min(draws.number("height", (1.3, 4.2), (0.9, 4.5), tails=0.2) * max(self.x, self.y), 0.8)
        if draws.chance("slim", 0.15):  # and tall
            self.x, self.y = draws.numbers("slim_radius", 0.06, 0.1, 2, unit="m").tolist()
            self.height = draws.length("slim_height", (0.55, 1.0))
        self.radius, self.steps = draws.number("corner", (0.015, 0.5)) * min(self.x, self.y), 3
        if draws.chance("round", 0.35):
            self.y, self.radius, self.steps = self.x, 0.999 * self.x, 6
        taper = draws.one_of("sides", {"straight": 0.0, "tapered": draws.number("taper", (0.02, 0.16))})
        self.taper = taper * min(self.x, self.y)
        self.foot = draws.length("foot_height", (0.02, 0.05))  # height of the base


def build(draws: Draws) -> Assembly:
    """A bin, closed at rest."""
    lids = {"pedal": _pedal_bin, "swing": _swinging_flap, "wheelie": None, "halves": _two_lids}
    add_lid = draws.one_of("kind", lids, (0.45, 0.2, 0.2, 0.15))
    if add_lid is None:
        return _wheelie(draws)
    size = Bin(draws)
    x, y, top, radius = size.x, size.y, size.height, size.radius
    sides = [(0.0, size.taper), (1.0, 0.0)]
    body = rounded_tray((-x, -y, size.foot), (x, y, top), 0.003, radius, sides, steps=size.steps)
    out = draws.one_of("base", {"wide": 0.004, "narrow": -0.006}) - size.taper
    body += box(x + out, y + out, (0, size.foot + 0.002), fillet=radius, axis=2, steps=size.steps)
    if draws.chance("collar", 0.5):  # around the opening
        low = (-x - 0.003, -y - 0.003, top - draws.length("collar_height", (0.01, 0.04)))
        body += rounded_tray(low, (x + 0.003, y + 0.003, top), 0.005, radius, floor=0.0, steps=size.steps)
    can = Assembly("body", body, 500.0)
    add_lid(draws, can, size)
    return can


def _pedal_bin(draws: Draws, can: Assembly, size: Bin) -> None:
    """A lid hinged at the back, mostly with a pedal."""
    x, seam = size.x, size.height + GAP
    hinge = (x + 0.013, 0.0, seam)
    half = 0.4 * (size.y - 0.5 * size.radius)
    rise = max(draws.number("lid_rise", (0.08, 0.6), (0.03, 0.8), tails=0.3) * min(size.x, size.y), 0.006)
    inset = draws.one_of("lid_edge", {"sharp": 0.25, "bevelled": 0.7, "domed": 1.0}) * rise
    profile = [(0.0, inset), (0.12, 0.45 * inset), (0.5, 0.06 * inset), (1.0, 0.0)]
    lid = rounded_tray((-x - 0.003, -size.y - 0.003, seam), (x + 0.003, size.y + 0.003, seam + rise), 0.003,
                       size.radius, profile, side=-1, steps=size.steps)  # fmt: skip
    lid += box((x - 0.012, hinge[0]), half, (seam, seam + 0.007))
    lid += rod(hinge[0], (-half, half), seam + 0.002, 0.006, sections=12)
    housing = draws.chance("hinge_housing", 0.6)
    if housing:
        can.body += box((x - 0.006 - size.taper, x + 0.014), 0.8 * half, (size.height - 0.14, size.height - 0.02))
    falls = draws.chance("falls_over", 0.35)  # over the back, past the upright, as far as the hinge lets it
    turned_over = 180.0 if draws.chance("half_turn", 0.5) else draws.degrees("fall_angle", (110.0, 205.0))
    limit = np.deg2rad(turned_over if falls else draws.degrees("lid_angle", (60.0, 110.0)))
    limit = min(limit, _turned_over(profile, 0.01, rise, 0.002 if housing else -0.009))
    if not draws.chance("pedal", 0.3 if falls else 0.75, upper=True):
        if draws.chance("lip", 0.6):  # to lift it by
            lip = (-x - draws.length("lip_length", (0.015, 0.03)), -0.4 * half, seam + 0.002)
            lid += box(lip, (-x + 0.002, 0.4 * half, seam + 0.008), fillet=0.003).called("handle", FRONT)
        can.add("lid", lid, revolute("body", SIDE, hinge, 0.0, limit))
        return
    wide = 0.5 * draws.length("pedal_width", (0.05, 0.1))
    base = -x + size.taper - 0.005
    cheeks = (about(s * (wide + 0.007), 0.004) for s in (-1, 1))
    can.body += union(box((base - 0.025, base + 0.03), across, (0, size.foot + 0.012)) for across in cheeks)
    can.add("lid", lid, revolute("body", SIDE, hinge, 0.0, limit))
    tip, middle = base - draws.length("pedal_reach", (0.03, 0.06)), 0.5 * size.foot + 0.01
    pedal = hull_of(
        box((tip, tip + 0.02), wide, about(middle, 0.004), fillet=0.004, axis=1),
        box((base - 0.003, base - 0.0015), wide, about(middle, 0.003)),
    )
    ratio = min(0.2, 0.8 * (middle - 0.006) / (base - tip)) / limit
    turn = revolute("body", (0, -1, 0), (base - 0.002, 0.0, middle), 0.0, ratio * limit, mimic=("lid", ratio))
    can.add("pedal", pedal, turn, density=800.0)


def _turned_over(
    profile: Sequence[tuple[float, float]], near: float, rise: float, back: float, grip: ArrayLike = ((9.0, 9.0),)
) -> float:
    """Angle up to which a lid clears the bin as it turns over the back; X and Z are those from the hinge.

    ``profile`` is that of the lid, whose rim begins ``near`` before the hinge; it stays behind ``back``, and clear of
    the points (N, 2) of a grip.
    """
    shares = np.linspace(0.0, 1.0, 50)
    edge = -near - np.interp(shares, *np.transpose(profile))
    x, z = np.append(edge, edge[0] - 0.15 * shares), rise * np.append(1.0 - shares, np.ones(50))
    angles = np.deg2rad(np.arange(60.0, 206.0))[:, None]
    along, up = x * cos(angles) + z * sin(angles), z * cos(angles) - x * sin(angles)
    clear = ((along > back) | (up > 0.0)).all(axis=1)
    for px, pz in np.asarray(grip):
        clear &= (hypot(along - px, up - pz) > 0.017).all(axis=1)
    return float(angles[-1 if clear.all() else int(np.argmin(clear)) - 1, 0])


def _swinging_flap(draws: Draws, can: Assembly, size: Bin) -> None:
    """A hood that narrows to an opening, in which a flap turns about its middle."""
    rise = draws.number("hood_height", (0.3, 1.0)) * size.x
    shrink = draws.number("hood_taper", (0.1, 0.3)) * size.x
    x, y, top = size.x, size.y, size.height + rise
    can.body += rounded_tray((-x, -y, size.height - 0.001), (x, y, top), 0.004, size.radius,
                             [(0.0, 0.0), (1.0, shrink)], floor=0.0, steps=size.steps)  # fmt: skip
    rim = shrink + 0.004 + 0.003
    corner = max(size.radius - rim, 0.002)
    flap = box(x - rim, y - rim, (top - 0.012, top - 0.006), fillet=corner, axis=2, steps=size.steps)
    flap += box(0.006, 0.8 * (y - rim), (top - 0.016, top - 0.011))
    limit = draws.turn("flap_angle", (40.0, 80.0))
    can.add("flap", flap, revolute("body", SIDE, (0, 0, top - 0.009), -limit, limit), label="lid")


def _two_lids(draws: Draws, can: Assembly, size: Bin) -> None:
    """Two leaves that turn at the left and the right and meet in the middle."""
    seam, thick = size.height + GAP, draws.length("lid_thickness", (0.006, 0.012))
    limit = draws.turn("lid_angle", (70.0, 95.0))
    whole = box(size.x, size.y, (seam, seam + thick), fillet=size.radius, axis=2, steps=6)
    for s in (1.0, -1.0):
        hinge = s * (size.y + 0.009)
        barrel = 0.25 * size.x
        lid = _half_of(whole, s) + rod((-barrel, barrel), hinge, seam + 0.001, 0.0045, sections=12)
        lid += box(barrel, ends((hinge, s * 0.9 * size.y)), (seam + 0.0005, seam + 0.005))
        can.add_numbered("lid", lid, revolute("body", (-s, 0, 0), (0, hinge, seam), 0.0, limit))


@deferred
def _half_of(plate: Solid, side: float) -> Solid:
    """What lies beyond the gap in the middle of a plate, on one side."""
    return Solid((plate.pieces[0].trim_by_plane((0.0, side, 0.0), GAP),))


def _wheelie(draws: Draws) -> Assembly:
    """Household bin: tapered body, lid hinged at the grip, two wheels below the back."""
    x, y = 0.5 * draws.length("depth", (0.44, 0.68)), 0.5 * draws.length("width", (0.4, 0.64))
    height, radius, taper = draws.lengths(height=(0.75, 1.05), corner_radius=(0.02, 0.06), narrowing=(0.03, 0.07))
    wheel, lift = draws.lengths(wheel_radius=(0.07, 0.12), clearance=(0.01, 0.03))
    profile = [(0.0, taper), (0.86, 0.012), (0.865, 0.0), (1.0, 0.0)]
    body = rounded_tray((-x, -y, lift), (x, y, height), 0.006, radius, profile)
    inner = y - 0.6 * taper
    wide = draws.length("wheel_width", (0.035, 0.05))
    axle = (x - taper + draws.number("axle_shift", (0.0, 0.4)) * wheel, wheel)
    body += rod(axle[0], (-inner + 0.001, inner - 0.001), axle[1], 0.012, sections=16)
    body += box((x - taper - 0.02, axle[0] + 0.014), 0.6 * y, about(axle[1], 0.03))
    body += box((-x + taper + 0.002, -x + taper + 0.05), 0.6 * y, (0.0, lift + 0.003))
    grip_z, grip_x = height - draws.length("grip_drop", (0.06, 0.08)), x + draws.length("grip_reach", (0.045, 0.06))
    for s in (-1.0, 1.0):
        body += tube([(x - 0.004, s * 0.7 * y, grip_z - 0.02), (grip_x, s * 0.7 * y, grip_z)], 0.011, 10)
    body += rod(grip_x, (-0.75 * y, 0.75 * y), grip_z, 0.014, sections=16).called("handle", -FRONT)

    can = Assembly("body", body, 600.0)
    seam = height + GAP
    hinge = (x + 0.012, 0.0, seam)
    rise = draws.length("lid_height", (0.03, 0.07))
    shape = [(0.0, draws.number("lid_bevel", (0.2, 0.9)) * rise + 0.02), (0.6, 0.01), (0.62, 0.0), (1.0, 0.0)]
    lid = rounded_tray((-x - 0.02, -y - 0.012, seam), (x, y + 0.012, seam + rise), 0.005, radius, shape, side=-1)
    lid += box((x - 0.02, hinge[0]), 0.6 * y, (seam, seam + 0.009))
    lid += rod(hinge[0], (-0.6 * y, 0.6 * y), seam + 0.002, 0.008, sections=12)
    limit = draws.turn("lid_angle", (75.0, 108.0) if draws.chance("lid_stops", 0.6) else (108.0, 205.0))
    over = np.linspace((-0.012, grip_z - 0.02 - seam), (grip_x - hinge[0], grip_z - seam), 8)
    limit = min(limit, _turned_over(shape, 0.012, rise, -0.011, over))
    can.add("lid", lid, revolute("body", SIDE, hinge, 0.0, limit))
    for s in (1.0, -1.0):
        near, far = s * inner, s * (inner + wide)
        tyre = rod(axle[0], (near, far), wheel, wheel, sections=28)
        tyre += rod(axle[0], (far - s * 0.001, far + s * 0.008), wheel, 0.45 * wheel, 0.3 * wheel, 20)
        can.add_numbered("wheel", tyre, continuous("body", SIDE, (axle[0], 0.5 * (near + far), wheel)), density=900.0)
    return can
