"""Bottles, flasks, jars and canisters with what closes them.

What varies: the outline seen from above (round, square, six or eight sides, flat) and from the side (wine, beer, water,
shampoo, cone, ball, jar, flask, a can with its neck at the front or the back), the handle, and the closure. Screw caps
ride on a thread, slide or only turn; stoppers and lids lift off; flip tops swing about a hinge, on a collar that screws
on or that is fixed; pumps slide in a collar that turns; sprayers have a trigger; flasks have a cup over their stopper;
preserving jars have a bail. One to three parts move.
"""

from dataclasses import dataclass

import numpy as np

from artsim.common.elementary import cos
from artsim.families.details import cheeks
from artsim.families.vessels import GAP, Level, cap, cross_section, dome, grip_loop, moulded, neck, pump_head, ribs
from artsim.making.assembly import Assembly, JointSpec, Rng, continuous, pick, prismatic, revolute, screw
from artsim.making.outlines import UP, arch
from artsim.making.solids import Solid, box, ellipsoid, hull_of, ring, rod, tube

DENSITY = 300.0  # kg/m^3, as the pieces are solid and real ones are hollow
SHAPES = {"wine": 0.1, "beer": 0.08, "water": 0.12, "shampoo": 0.16, "cone": 0.08, "ball": 0.07, "jar": 0.12,
          "flask": 0.1, "tube": 0.09, "waist": 0.08}  # fmt: skip


@dataclass(frozen=True)
class Mouth:
    """The neck of a bottle: outer radius, bore, height of its foot and of its rim; half depth of the shoulder."""

    radius: float
    bore: float
    foot: float
    rim: float
    shoulder: float


def build(rng: Rng) -> Assembly:
    """A bottle, closed at rest; nozzles, triggers and the free edge of flip tops are at -X, handles at +X."""
    closure = pick(
        rng, {_screw_cap: 0.34, _pump: 0.15, _flip_top: 0.16, _stopper: 0.12, _sprayer: 0.09, _cup: 0.07, _bail: 0.07}
    )
    shape = pick(rng, SHAPES)
    wide_mouth = shape == "jar" and closure in (_screw_cap, _flip_top, _stopper, _cup, _bail)
    body, mouth = _body(rng, shape, wide_mouth, 0.022 if closure in (_pump, _sprayer, _bail) else 0.012)
    bottle = Assembly("body", body, DENSITY)
    closure(rng, bottle, mouth)
    return bottle


def _body(rng: Rng, shape: str, wide: bool, tall: float) -> tuple[Solid, Mouth]:
    """Body without its closure; its neck is at least ``tall`` above the shoulder."""
    kinds = {"wine": ["round"], "beer": ["round"], "flask": ["flask", "square"], "ball": ["round", "octagon"]}
    kind = pick(rng, kinds.get(shape, ["round", "round", "square", "square", "octagon", "hexagon"]))
    outline = cross_section(kind, rng.uniform(0.0, 1.0))
    half = rng.uniform(0.022, 0.075)
    depth = half
    if kind != "round" or rng.random() < 0.3:
        depth = half * rng.uniform(0.4, 1.0)
    if kind == "flask":
        depth = half * rng.uniform(0.3, 0.6)
    slim = {"wine": (5.0, 8.5), "beer": (4.5, 7.0), "jar": (1.3, 3.2), "ball": (1.7, 2.4), "flask": (2.2, 4.0)}
    height = half * rng.uniform(*slim.get(shape, (2.4, 7.0)))
    height = min(height, 0.42)
    small = min(depth, half)
    radius = (rng.uniform(0.62, 0.9) if wide else rng.uniform(0.22, 0.55)) * small
    radius = max(radius, 0.007, 0.2 * half)
    if shape in ("wine", "beer"):
        radius = 0.34 * small
    foot = height
    levels = [(z * height, x * depth, x * half, r) for z, x, r in _profile(rng, shape)]
    lead = 1.15 * radius
    last = levels[-1]
    rise = (rng.uniform(0.1, 0.5) * small) if shape not in ("wine", "beer") else 0.004
    levels.append((foot + rise, min(lead, last[1]), min(lead, last[2]), 1.0))
    foot += rise
    if shape in ("wine", "beer") or rng.random() < 0.12:
        long = rng.uniform(0.5, 2.2) * half
        levels.append((foot + long, 1.04 * radius, 1.04 * radius, 1.0))
        foot += long
    shift = 0.0
    if shape in ("shampoo", "water", "tube", "waist", "jar") and not wide and rng.random() < 0.2:
        shift = rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.8) * max(depth - 1.2 * radius, 0.0)  # a can
    body = moulded(_bevelled(levels), outline, shift)
    wall = radius * rng.uniform(0.12, 0.25)
    rim = foot + max(tall, radius * rng.uniform(0.5, 1.1))
    body += neck(radius, radius - wall, foot - 0.0005, rim)
    mouth = Mouth(radius, radius - wall, foot, rim, last[1])
    if shape in ("shampoo", "water", "waist", "jar", "tube") and not wide and rng.random() < 0.25:
        z0, z1 = sorted(rng.uniform(0.15, 0.9, 2) * height)
        if z1 - z0 > 0.3 * height:
            body += _jug_handle(rng, depth, half, z0, z1).moved((shift, 0, 0))
    if rng.random() < 0.2:  # a label or a moulded band
        z0 = rng.uniform(0.2, 0.4) * height
        z1 = z0 + rng.uniform(0.1, 0.35) * height
        table = np.array(levels)
        x, y, r = (float(np.interp(0.5 * (z0 + z1), table[:, 0], table[:, i])) for i in (1, 2, 3))
        body += moulded([(z, 1.02 * x, 1.02 * y, r) for z in (z0, z1)], outline, shift)
    return body, mouth


def _profile(rng: Rng, shape: str) -> list[tuple[float, float, float]]:
    """Height and half width over those of the body, and roundness, from the foot to the shoulder."""
    soft = rng.uniform(0.0, 0.3)
    if shape in ("wine", "beer"):
        shoulder = rng.uniform(0.5, 0.72)
        if shape == "wine" and rng.random() < 0.5:  # sloping, as in Burgundy
            return [(0.0, 1.0, 0.0), (0.45, 1.0, 0.0), (0.65, 0.85, 0.3), (0.82, 0.55, 0.8), (1.0, 0.36, 1.0)]
        return [(0.0, 1.0, 0.0), (shoulder, 1.0, 0.0), (shoulder + 0.1, 0.84, 0.4), (shoulder + 0.18, 0.5, 1.0),
                (1.0, 0.36, 1.0)]  # fmt: skip
    if shape == "water":
        ribs_at = np.linspace(0.15, 0.7, int(rng.integers(2, 6)))
        levels = [(0.0, 0.94, 0.0), (0.06, 1.0, 0.0)]
        dent = rng.uniform(0.03, 0.1)
        for z in ribs_at.tolist():
            levels += [(z - 0.025, 1.0, 0.0), (z, 1.0 - dent, 0.0), (z + 0.025, 1.0, 0.0)]
        return [*levels, (0.8, 1.0, soft), (0.93, 0.72, 0.6), (1.0, 0.5, 1.0)]
    if shape == "cone":
        top = rng.uniform(0.3, 0.75)
        return [(0.0, 0.94, 0.0), (0.04, 1.0, 0.0), (0.9, top, 0.4), (1.0, 0.8 * top, 1.0)]
    if shape == "ball":
        heights = np.linspace(-1.0, 1.0, 9)
        flat = rng.uniform(0.35, 0.6)
        return [(0.5 + 0.5 * z, max(cos(0.5 * np.pi * z), flat), 0.0) for z in (0.93 * heights).tolist()]
    if shape == "jar":
        edge = rng.uniform(0.86, 1.0)
        return [(0.0, 0.92 * edge, 0.0), (0.07, 1.0, 0.0), (0.9, edge, soft), (1.0, 0.92 * edge, 0.7)]
    if shape == "flask":
        return [(0.0, 0.9, 0.0), (0.05, 1.0, 0.0), (0.75, rng.uniform(0.85, 1.1), 0.0), (1.0, 0.62, 0.3)]
    if shape == "tube":  # the whole is one width up to a flat shoulder
        return [(0.0, 1.0, 0.0), (1.0, rng.uniform(0.85, 1.0), soft)]
    if shape == "waist":
        thin, at = rng.uniform(0.6, 0.88), rng.uniform(0.4, 0.65)
        return [(0.0, 0.9, 0.0), (0.08, 1.0, 0.0), (at - 0.15, 0.5 + 0.5 * thin, soft), (at, thin, soft),
                (at + 0.15, 0.5 + 0.5 * thin, soft), (0.85, rng.uniform(0.85, 1.0), soft), (1.0, 0.6, 0.8)]  # fmt: skip
    taper = rng.uniform(0.7, 1.0)  # shampoo
    return [(0.0, rng.uniform(0.8, 0.96), 0.0), (0.06, 1.0, 0.0), (0.55, 0.5 + 0.5 * taper, 0.0),
            (0.88, taper, soft), (1.0, 0.7 * taper, 0.6)]  # fmt: skip


def _bevelled(levels: list[Level]) -> list[Level]:
    """The levels, with a small bevel at the foot."""
    (z, x, y, r), top = levels[0], levels[1][0]
    cut = min(0.003, 0.3 * (top - z))
    return [(z, x - cut, y - cut, r), (z + cut, x, y, r), *levels[1:]]


def _jug_handle(rng: Rng, depth: float, half: float, low: float, high: float) -> Solid:
    reach = depth + rng.uniform(0.02, 0.035)
    root = 0.45 * depth
    upper, lower = high - 0.15 * (high - low), low + 0.3 * (high - low)
    points = [(root, high), (0.85 * reach, high), (reach, upper), (reach, lower), (0.8 * reach, low), (root, low)]
    return grip_loop(points, min(rng.uniform(0.006, 0.012), 0.5 * half), rng.uniform(0.004, 0.006))


def _closing(rng: Rng, mouth: Mouth, height: float) -> JointSpec:
    """Joint of a cap that covers the neck: on a thread mostly; some slide off, some only turn."""
    kind = pick(rng, {"screw": 0.62, "slide": 0.23, "turn": 0.15})
    at = (0.0, 0.0, mouth.rim)
    if kind == "slide":
        return prismatic("body", UP, 0.0, height * rng.uniform(0.8, 3.0), at)
    if kind == "turn":
        return continuous("body", UP, at)
    turns = 2.0 * np.pi * rng.uniform(0.5, 4.0)
    return screw("body", UP, at, 0.0, turns, height * rng.uniform(0.6, 1.5) / turns)


def _cover(rng: Rng, mouth: Mouth, bore: float = 0.0) -> tuple[Solid, float, float, float]:
    """A cap over the neck: the solid, its radius at the top, its underside and its top."""
    sections = int(rng.choice([24, 24, 8, 16]))
    inside = (mouth.radius * 1.02 + GAP) / cos(np.pi / sections)
    wall = max(rng.choice([0.1, rng.uniform(0.1, 0.35)]) * mouth.radius, 0.0016)
    upper = inside + wall
    radius = upper * (rng.uniform(1.0, 1.2) if rng.random() < 0.4 else 1.0)
    low, high = mouth.foot + GAP, mouth.rim + GAP + wall
    if bore == 0.0 and rng.random() < 0.35:
        high += mouth.radius * rng.uniform(0.1, 2.0)
    return cap(radius, wall, low, high, bore, upper, sections), upper, low, high


def _screw_cap(rng: Rng, bottle: Assembly, mouth: Mouth) -> None:
    lid, radius, low, high = _cover(rng, mouth)
    tall = high - low
    if rng.random() < 0.5:
        lid += ribs(radius, low + 0.12 * tall, high - 0.1 * tall, int(rng.integers(10, 20)), 0.07 * radius)
    style = rng.random()
    if style < 0.2:
        lid += dome(0.97 * radius, high - 0.0005, rng.uniform(0.15, 0.9) * radius)
    elif style < 0.3:  # a spout with a knob
        lid += rod(0, 0, (high - 0.0005, high + 0.5 * radius), 0.75 * radius, 0.35 * radius)
        lid += rod(0, 0, (high, high + radius), 0.3 * radius) + dome(0.42 * radius, high + radius, 0.004)
    elif style < 0.4:  # a loop to carry it by
        r = 0.7 * radius
        lid += tube([(0.0, y, high - 0.001 + z) for y, z in arch(r, 1.1 * r, 8)], 0.16 * radius, 8)
    if rng.random() < 0.3:  # a bead below the cap
        bottle.body += ring((0, 0, mouth.foot - 0.0005), UP, 0.6 * mouth.bore, 1.12 * radius, 0.001, 20)
    bottle.add("lid", lid, _closing(rng, mouth, high - low))


def _stopper(rng: Rng, bottle: Assembly, mouth: Mouth) -> None:
    """A cork, a glass ball or a disc on a plug that sits in the neck."""
    plug = (mouth.bore - GAP) * cos(np.pi / 18) * 0.98
    low, rim = mouth.rim - 0.7 * (mouth.rim - mouth.foot), mouth.rim + GAP
    lid = rod(0, 0, (low, rim + 0.002), 0.9 * plug, plug, 18)
    r = mouth.radius
    kind = pick(rng, ["cork", "ball", "disc", "crystal", "knob"])
    if kind == "cork":
        lid += rod(0, 0, (rim, rim + r * rng.uniform(0.4, 1.2)), r * rng.uniform(0.9, 1.1), r, 20)
    elif kind == "ball":
        size = r * rng.uniform(1.0, 1.8)
        lid += rod(0, 0, (rim, rim + 0.3 * r), r, 0.8 * r, 20)
        lid += ellipsoid((0, 0, rim + 0.9 * size), (size, size, 0.9 * size), 16)
    elif kind == "disc":
        lid += rod(0, 0, (rim, rim + 0.3 * r), 1.3 * r, 1.2 * r) + dome(0.5 * r, rim + 0.3 * r, 0.5 * r)
    elif kind == "crystal":
        top = rim + r * rng.uniform(1.2, 2.4)
        lid += rod(0, 0, (rim, 0.5 * (rim + top)), 0.7 * r, 1.4 * r, 8)
        lid += rod(0, 0, (0.5 * (rim + top) - 1e-4, top), 1.4 * r, 0.5 * r, 8)
    else:
        lid += rod(0, 0, (rim, rim + 0.25 * r), 1.15 * r)
        lid += rod(0, 0, (rim, rim + 1.1 * r), 0.35 * r) + ellipsoid((0, 0, rim + 1.4 * r), 0.6 * r, 12)
    depth = mouth.rim - low
    bottle.add("lid", lid, prismatic("body", UP, 0.0, depth * rng.uniform(1.0, 3.0), (0, 0, rim)))


def _flip_top(rng: Rng, bottle: Assembly, mouth: Mouth) -> None:
    """A lid that swings back about a hinge at the edge of a collar."""
    collar, radius, low, high = _cover(rng, mouth)
    tall = radius * rng.uniform(0.15, 0.9)
    base = high + GAP
    r = max(0.07 * radius, 0.0012)
    x, half = radius + 0.8 * r, radius * rng.uniform(0.25, 0.55)
    wall = 0.12 * radius
    lid = cap(0.98 * radius, wall, base, base + tall, top=0.98 * radius * rng.uniform(0.75, 1.0))
    z = base + r
    lid += rod(x, (-half, half), z, r, sections=12)
    lid += box((0.8 * radius, x), half, (base, base + 1.6 * r))
    roots = (0.7 * radius, x), (high - 2.5 * r, high - r)
    collar += cheeks((x, z), r, half + 0.0006, half + 0.0006 + 1.5 * r, *roots, 10)
    if rng.random() < 0.6:  # a thumb rest at the front
        tip = 0.98 * radius
        lid += box((-tip - 0.2 * radius, -0.3 * radius, base + 0.05 * tall),
                           (-0.9 * tip, 0.3 * radius, base + 0.3 * tall), fillet=0.1 * tall)  # fmt: skip
    spout = 0.6 * (0.98 * radius - wall)
    if tall > 0.35 * radius:
        collar += rod(0, 0, (high - 0.0005, high + 0.4 * tall), 0.5 * spout, 0.35 * spout, 14)
    # Beyond 90 degrees the lid's back dips beside the collar, above the shoulder.
    limit = np.deg2rad(rng.uniform(80, 135 if tall < 0.6 * (high - low) else 95))
    turning = rng.random() < 0.35
    if turning:
        bottle.add("collar", collar, _closing(rng, mouth, high - low))
    else:
        bottle.body += collar
    bottle.add("lid", lid, revolute("collar" if turning else "body", (0, 1, 0), (x, 0, z), 0.0, limit))


def _pump(rng: Rng, bottle: Assembly, mouth: Mouth) -> None:
    """A collar that turns on the neck, and a head that is pressed down in it."""
    stem = min(mouth.bore * rng.uniform(0.3, 0.5), 0.005)
    collar, radius, low, high = _cover(rng, mouth, stem + GAP)
    stroke = (mouth.rim - mouth.foot) * rng.uniform(0.4, 0.7)
    stage = radius * rng.uniform(0.0, 0.8)  # a smaller tube on the collar
    if stage > 0.2 * radius:
        collar += ring((0, 0, high + 0.5 * stage - 0.0005), UP, stem + GAP, radius * rng.uniform(0.45, 0.8), stage, 16)
    else:
        stage = 0.0
    head = high + stage + stroke + 0.0015
    size = max(radius * rng.uniform(0.6, 1.1), 1.8 * stem)
    reach = max(size * 1.3, radius * rng.uniform(1.4, 3.0))
    # The nozzle droops by up to a quarter of its reach and must stay above the collar when pressed.
    head += 0.25 * reach if reach > radius else 0.0
    down = head - high + 0.0035
    solid = pump_head(rng, head, stem, size, reach, down)
    bottle.add("collar", collar, _closing(rng, mouth, high - low))
    bottle.add("pump", solid, prismatic("collar", -UP, 0.0, stroke, (0, 0, head)))


def _sprayer(rng: Rng, bottle: Assembly, mouth: Mouth) -> None:
    """A sprayer's head on a collar, with a trigger that swings back."""
    head, radius, low, high = _cover(rng, mouth)
    wide = radius * rng.uniform(0.5, 0.8)
    tall, reach = radius * rng.uniform(1.2, 2.0), radius * rng.uniform(2.0, 3.2)
    top = high + tall
    deck = high + 0.45 * tall  # the trigger hangs below it
    head += hull_of(rod(0, 0, (high - 0.001, high + 0.001), 0.8 * radius, sections=16),
                    box((-0.35 * radius, -0.8 * wide, deck), (0.9 * radius, 0.8 * wide, deck + 0.001)))  # fmt: skip
    head += box((-reach, radius * rng.uniform(1.0, 1.9)), wide, (deck, top), fillet=0.35 * wide)
    nozzle = 0.55 * min(wide, 0.5 * (top - deck))
    middle = 0.5 * (deck + top)
    head += rod((-reach - 0.35 * radius, -reach + 0.002), 0, middle, nozzle, 1.2 * nozzle, 6)
    x = -0.72 * reach
    length = radius * rng.uniform(1.4, 2.4)
    z = deck - 0.0018
    thin = 0.45 * wide
    points = [(x, z - 0.001), (x - 0.12 * length, z - 0.4 * length), (x - 0.05 * length, z - 0.75 * length),
              (x - 0.3 * length, z - length)]  # fmt: skip
    trigger = grip_loop(points, thin, 0.0016)
    # Pulled, its tip comes no nearer than the collar.
    room = (abs(x) - 1.05 * radius - 0.003) / length
    limit = min(rng.uniform(0.25, 0.6), max(0.8 * room, 0.08))
    bottle.add("head", head, _closing(rng, mouth, high - low))
    bottle.add("trigger", trigger, revolute("head", (0, -1, 0), (x, 0, z), 0.0, limit))


def _cup(rng: Rng, bottle: Assembly, mouth: Mouth) -> None:
    """A vacuum flask: a screwed stopper, and a cup over it."""
    plug = (mouth.bore - GAP) * cos(np.pi / 18) * 0.98
    rim = mouth.rim + GAP
    tall = mouth.radius * rng.uniform(0.4, 0.9)
    stopper = rod(0, 0, (0.5 * (mouth.foot + mouth.rim), rim + 0.001), plug, sections=18)
    stopper += rod(0, 0, (rim, rim + tall), mouth.radius, 0.9 * mouth.radius, 20)
    turns = 2.0 * np.pi * rng.uniform(0.5, 2.0)
    depth = 0.5 * (mouth.rim - mouth.foot)
    inner = (mouth.radius * 1.04 + GAP) / cos(np.pi / 24)
    wall = 0.12 * mouth.radius
    top = rim + tall + depth + 2 * GAP + wall
    radius = inner + wall
    cup = cap(radius, wall, mouth.foot + GAP, top, top=radius * rng.uniform(1.0, 1.08))
    if rng.random() < 0.5:  # the cup's ear
        side = float(rng.choice([-1.0, 1.0]))
        ear = grip_loop([(0.9 * radius, top - 0.2 * tall - wall), (1.5 * radius, top - 0.3 * tall - wall),
                         (1.5 * radius, mouth.rim), (0.97 * radius, mouth.rim - 0.002)], 0.15 * radius,
                        0.06 * radius)  # fmt: skip
        cup += ear.turned(UP, side * rng.uniform(0.0, 0.5))
    bottle.add("stopper", stopper, screw("body", UP, (0, 0, rim), 0.0, turns, 0.95 * depth / turns))
    lift = (top - mouth.foot) * rng.uniform(1.0, 1.8)
    bottle.add("cup", cup, prismatic("body", UP, 0.0, lift, (0, 0, top)))


def _bail(rng: Rng, bottle: Assembly, mouth: Mouth) -> None:
    """A preserving jar or a swing-top bottle: a flat lid on a hinge at the back, with a wire bow at the front."""
    r = 0.09 * mouth.radius
    rim = mouth.rim + GAP
    radius = mouth.radius * rng.uniform(1.02, 1.15)
    tall = radius * rng.uniform(0.14, 0.4)
    x, half = radius + 1.2 * r, radius * rng.uniform(0.2, 0.4)
    z = rim + r
    lid = rod(0, 0, (rim, rim + tall), radius, 0.92 * radius)
    if rng.random() < 0.6:
        lid += dome(0.85 * radius, rim + tall - 1e-4, rng.uniform(0.1, 0.45) * radius)
    lid += rod(x, (-half, half), z, r, sections=12) + box((0.7 * radius, x), half, (rim, rim + r))
    low = 0.5 * (mouth.foot + mouth.rim)
    bottle.body += ring((0, 0, low), UP, 0.98 * mouth.radius, mouth.radius + r, 1.6 * r, 20)
    for s in (-1.0, 1.0):
        y = s * (half + 0.0006 + 0.8 * r)
        bottle.body += tube([(0.9 * mouth.radius, y, low), (x, y, low), (x, y, z)], 0.7 * r, 8)
    limit = np.deg2rad(rng.uniform(80, 110))
    bottle.add("lid", lid, revolute("body", (0, 1, 0), (x, 0, z), 0.0, limit))
    wire = 0.5 * r
    drop = low - mouth.foot - 2.5 * wire
    if rng.random() < 0.7 and drop > 0.004:  # the wire that locks it, before the neck
        out = -(mouth.radius + r + wire + 0.0015)
        wide = 0.5 * mouth.radius
        bow = tube([(out, -wide, low), (out, -0.8 * wide, low - drop), (out, 0.8 * wide, low - drop),
                    (out, wide, low)], wire, 8)  # fmt: skip
        bow += tube([(out, -wide, low), (out, wide, low)], wire, 8)
        bottle.add("latch", bow, revolute("body", (0, 1, 0), (out, 0, low), 0.0, np.deg2rad(rng.uniform(60, 120))))
