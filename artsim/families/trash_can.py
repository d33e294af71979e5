"""Trash cans: pedal bins, bins with a swinging flap, bins with two lids, wheelie bins.

Round or rectangular, low to slim and tall, straight or tapered; the lid turns at the back, about its middle, or in two
halves at the sides. A pedal follows the lid; wheelie bins have two wheels and a grip at the back.
"""

import numpy as np

from artsim.families.details import rounded_tray
from artsim.families.proportions import with_tails
from artsim.making.assembly import Assembly, Rng, continuous, pick, revolute
from artsim.making.solids import Solid, box, hull_of, rod, tube, union

GAP = 0.0015


class Bin:
    """Half depth, half width and height of a bin, radius of its corners, how much it narrows below; metres."""

    def __init__(self, rng: Rng) -> None:
        self.x, self.y = rng.uniform(0.09, 0.24), rng.uniform(0.09, 0.28)
        self.height = min(with_tails(rng, (1.3, 4.2), (0.9, 4.5), 0.2) * max(self.x, self.y), 0.8)
        if rng.random() < 0.15:  # slim and tall
            (self.x, self.y), self.height = rng.uniform(0.06, 0.1, 2), rng.uniform(0.55, 1.0)
        self.radius, self.steps = rng.uniform(0.015, 0.5) * min(self.x, self.y), 3
        if rng.random() < 0.35:  # round
            self.y, self.radius, self.steps = self.x, 0.999 * self.x, 6
        self.taper = float(rng.choice([0.0, rng.uniform(0.02, 0.16)])) * min(self.x, self.y)
        self.foot = rng.uniform(0.02, 0.05)  # height of the base


def build(rng: Rng) -> Assembly:
    """A bin, closed at rest."""
    kind = pick(rng, {"pedal": 0.45, "swing": 0.2, "wheelie": 0.2, "halves": 0.15})
    if kind == "wheelie":
        return _wheelie(rng)
    size = Bin(rng)
    can = Assembly("body", _body(rng, size), 500.0)
    {"pedal": _pedal_bin, "swing": _swinging_flap, "halves": _two_lids}[kind](rng, can, size)
    return can


def _body(rng: Rng, size: Bin) -> Solid:
    x, y, wall = size.x, size.y, 0.003
    body = rounded_tray((-x, -y, size.foot), (x, y, size.height), wall, size.radius, [(0.0, size.taper), (1.0, 0.0)],
                        steps=size.steps)  # fmt: skip
    out = rng.choice([0.004, -0.006]) - size.taper
    body += box(x + out, y + out, (0, size.foot + 0.002), fillet=size.radius, axis=2, steps=size.steps)
    if rng.random() < 0.5:  # a collar around the opening
        body += rounded_tray((-x - 0.003, -y - 0.003, size.height - rng.uniform(0.01, 0.04)),
                             (x + 0.003, y + 0.003, size.height), 0.005, size.radius, floor=0.0,
                             steps=size.steps)  # fmt: skip
    return body


def _pedal_bin(rng: Rng, can: Assembly, size: Bin) -> None:
    """A lid hinged at the back, mostly with a pedal."""
    x, seam = size.x, size.height + GAP
    hinge = (x + 0.013, 0.0, seam)
    half = 0.4 * (size.y - 0.5 * size.radius)
    rise = max(with_tails(rng, (0.08, 0.6), (0.03, 0.8), 0.3) * min(size.x, size.y), 0.006)
    inset = rng.choice([0.25, 0.7, 1.0]) * rise
    profile = [(0.0, inset), (0.12, 0.45 * inset), (0.5, 0.06 * inset), (1.0, 0.0)]
    lid = rounded_tray((-x - 0.003, -size.y - 0.003, seam), (x + 0.003, size.y + 0.003, seam + rise), 0.003,
                       size.radius, profile, side=-1, steps=size.steps)  # fmt: skip
    lid += box((x - 0.012, hinge[0]), half, (seam, seam + 0.007))
    lid += rod(hinge[0], (-half, half), seam + 0.002, 0.006, sections=12)
    if rng.random() < 0.6:  # housing of the hinge
        can.body += box((x - 0.006 - size.taper, x + 0.014), 0.8 * half, (size.height - 0.14, size.height - 0.02))
    falls = rng.random() < 0.35  # over the back, past the upright, as far as the hinge lets it
    turned_over = 180.0 if rng.random() < 0.5 else rng.uniform(110.0, 205.0)  # many real lids turn by half a turn
    limit = np.deg2rad(turned_over if falls else rng.uniform(60.0, 110.0))
    joint = revolute("body", (0, 1, 0), hinge, 0.0, limit)
    if rng.random() < (0.7 if falls else 0.25):  # no pedal, perhaps a lip to lift it by
        if rng.random() < 0.6:
            lip = (-x - rng.uniform(0.015, 0.03), -0.4 * half, seam + 0.002)
            lid += box(lip, (-x + 0.002, 0.4 * half, seam + 0.008), fillet=0.003)
        can.add("lid", lid, joint)
        return
    wide = rng.uniform(0.025, 0.05)
    base = -x + size.taper - 0.005
    cheeks = [s * (wide + 0.007) for s in (-1, 1)]
    can.body += union(box((base - 0.025, base + 0.03), (c - 0.004, c + 0.004), (0, size.foot + 0.012)) for c in cheeks)
    can.add("lid", lid, joint)
    tip, middle = base - rng.uniform(0.03, 0.06), 0.5 * size.foot + 0.01
    pedal = hull_of(
        box((tip, tip + 0.02), wide, (middle - 0.004, middle + 0.004), fillet=0.004, axis=1),
        box((base - 0.003, base - 0.0015), wide, (middle - 0.003, middle + 0.003)),
    )
    ratio = min(0.2, 0.8 * (middle - 0.006) / (base - tip)) / limit
    turn = revolute("body", (0, -1, 0), (base - 0.002, 0.0, middle), 0.0, ratio * limit, mimic=("lid", ratio))
    can.add("pedal", pedal, turn, density=800.0)


def _swinging_flap(rng: Rng, can: Assembly, size: Bin) -> None:
    """A hood that narrows to an opening, in which a flap turns about its middle."""
    rise = rng.uniform(0.3, 1.0) * size.x
    shrink = rng.uniform(0.1, 0.3) * size.x
    x, y, top = size.x, size.y, size.height + rise
    profile = [(0.0, 0.0), (1.0, shrink)]
    can.body += rounded_tray((-x, -y, size.height - 0.001), (x, y, top), 0.004, size.radius, profile, floor=0.0,
                         steps=size.steps)  # fmt: skip
    rim = shrink + 0.004 + 0.003
    flap = box((-x + rim, -y + rim, top - 0.012), (x - rim, y - rim, top - 0.006),
                       fillet=max(size.radius - rim, 0.002), axis=2, steps=size.steps)  # fmt: skip
    flap += box(0.006, 0.8 * (y - rim), (top - 0.016, top - 0.011))
    limit = np.deg2rad(rng.uniform(40.0, 80.0))
    can.add("flap", flap, revolute("body", (0, 1, 0), (0, 0, top - 0.009), -limit, limit), label="lid")


def _two_lids(rng: Rng, can: Assembly, size: Bin) -> None:
    """Two leaves that turn at the left and the right and meet in the middle."""
    seam, thick = size.height + GAP, rng.uniform(0.006, 0.012)
    limit = np.deg2rad(rng.uniform(70.0, 95.0))
    whole = box(size.x, size.y, (seam, seam + thick), fillet=size.radius, axis=2, steps=6)
    for number, s in enumerate((1.0, -1.0)):
        hinge = s * (size.y + 0.009)
        lid = Solid((whole.pieces[0].trim_by_plane((0.0, s, 0.0), GAP),))
        barrel = 0.25 * size.x
        lid += rod((-barrel, barrel), hinge, seam + 0.001, 0.0045, sections=12)
        inner = s * 0.9 * size.y
        lid += box(barrel, (min(hinge, inner), max(hinge, inner)), (seam + 0.0005, seam + 0.005))
        can.add(f"lid_{number}", lid, revolute("body", (-s, 0, 0), (0, hinge, seam), 0.0, limit))


def _wheelie(rng: Rng) -> Assembly:
    """Household bin: tapered body, lid hinged at the grip, two wheels below the back."""
    x, y = rng.uniform(0.22, 0.34), rng.uniform(0.2, 0.32)
    height = rng.uniform(0.75, 1.05)
    radius, taper, wheel = rng.uniform(0.02, 0.06), rng.uniform(0.03, 0.07), rng.uniform(0.07, 0.12)
    lift = rng.uniform(0.01, 0.03)
    profile = [(0.0, taper), (0.86, 0.012), (0.865, 0.0), (1.0, 0.0)]
    body = rounded_tray((-x, -y, lift), (x, y, height), 0.006, radius, profile)
    inner = y - 0.6 * taper
    wide = rng.uniform(0.035, 0.05)
    axle = (x - taper + rng.uniform(0.0, 0.4) * wheel, wheel)
    body += rod(axle[0], (-inner + 0.001, inner - 0.001), axle[1], 0.012, sections=16)
    body += box((x - taper - 0.02, axle[0] + 0.014), 0.6 * y, (axle[1] - 0.03, axle[1] + 0.03))
    front = -x + taper
    body += box((front + 0.002, front + 0.05), 0.6 * y, (0.0, lift + 0.003))
    grip_z, grip_x = height - rng.uniform(0.06, 0.08), x + rng.uniform(0.045, 0.06)
    for s in (-1.0, 1.0):
        body += tube([(x - 0.004, s * 0.7 * y, grip_z - 0.02), (grip_x, s * 0.7 * y, grip_z)], 0.011, 10)
    body += rod(grip_x, (-0.75 * y, 0.75 * y), grip_z, 0.014, sections=16)

    can = Assembly("body", body, 600.0)
    seam = height + GAP
    hinge = (x + 0.012, 0.0, seam)
    rise = rng.uniform(0.03, 0.07)
    shape = [(0.0, rng.uniform(0.2, 0.9) * rise + 0.02), (0.6, 0.01), (0.62, 0.0), (1.0, 0.0)]
    lid = rounded_tray((-x - 0.02, -y - 0.012, seam), (x, y + 0.012, seam + rise), 0.005, radius, shape, side=-1)
    lid += box((x - 0.02, hinge[0]), 0.6 * y, (seam, seam + 0.009))
    lid += rod(hinge[0], (-0.6 * y, 0.6 * y), seam + 0.002, 0.008, sections=12)
    limit = np.deg2rad(rng.uniform(75.0, 108.0) if rng.random() < 0.6 else rng.uniform(108.0, 205.0))
    can.add("lid", lid, revolute("body", (0, 1, 0), hinge, 0.0, limit))
    for number, s in enumerate((1.0, -1.0)):
        near, far = s * inner, s * (inner + wide)
        tyre = rod(axle[0], (near, far), wheel, wheel, sections=28)
        tyre += rod(axle[0], (far - s * 0.001, far + s * 0.008), wheel, 0.45 * wheel, 0.3 * wheel, 20)
        can.add(
            f"wheel_{number}", tyre, continuous("body", (0, 1, 0), (axle[0], 0.5 * (near + far), wheel)), density=900.0
        )
    return can
