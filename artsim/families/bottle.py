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
from artsim.families.vessels import GAP, cap, cross_section, dome, grip_loop, moulded, neck, pump_head, ribs
from artsim.making.assembly import Assembly, JointSpec, continuous, prismatic, revolute, screw
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, UP, arch
from artsim.making.solids import Solid, box, ellipsoid, hull_of, ring, rod, tube

DENSITY = 300.0  # kg/m^3, as the pieces are solid and real ones are hollow
SHAPES = {"wine": 0.1, "beer": 0.08, "water": 0.12, "shampoo": 0.16, "cone": 0.08, "ball": 0.07, "jar": 0.12,
          "flask": 0.1, "tube": 0.09, "waist": 0.08}  # fmt: skip


@dataclass(frozen=True)
class Mouth:
    """The neck of a bottle: outer radius, bore, height of its foot and of its rim.

    ``shoulder`` is the height up to which a body stands out on one side, where its neck is not in its middle.
    """

    radius: float
    bore: float
    foot: float
    rim: float
    shoulder: float


def build(draws: Draws) -> Assembly:
    """A bottle, closed at rest; nozzles, triggers and the free edge of flip tops are at -X, handles at +X."""
    closures = {"screw_cap": _screw_cap, "pump": _pump, "flip_top": _flip_top, "stopper": _stopper,
                "sprayer": _sprayer, "cup": _cup, "bail": _bail}  # fmt: skip
    close = draws.one_of("closure", closures, (0.34, 0.15, 0.16, 0.12, 0.09, 0.07, 0.07))
    shape = draws.pick("shape", SHAPES)
    wide_mouth = shape == "jar" and close not in (_pump, _sprayer)
    body, mouth = _body(draws, shape, wide_mouth, 0.022 if close in (_pump, _sprayer, _bail) else 0.012)
    bottle = Assembly("body", body, DENSITY)
    close(draws, bottle, mouth)
    return bottle


def _body(draws: Draws, shape: str, wide: bool, tall: float) -> tuple[Solid, Mouth]:
    """Body without its closure; its neck is at least ``tall`` above the shoulder."""
    kinds = {"wine": ["round"], "beer": ["round"], "flask": ["flask", "square"], "ball": ["round", "octagon"]}
    kind = draws.pick("outline", kinds.get(shape, ["round", "round", "square", "square", "octagon", "hexagon"]))
    outline = cross_section(kind, draws.number("corner_sharpness", (0.0, 1.0)))
    half = 0.5 * draws.length("width", (0.044, 0.15))
    depth = half * draws.number("depth", (0.4, 1.0)) if kind != "round" or draws.chance("oval", 0.3) else half
    if kind == "flask":
        depth = half * draws.number("flask_depth", (0.3, 0.6))
    slim = {"wine": (5.0, 8.5), "beer": (4.5, 7.0), "jar": (1.3, 3.2), "ball": (1.7, 2.4), "flask": (2.2, 4.0)}
    height = min(half * draws.number("height", slim.get(shape, (2.4, 7.0))), 0.42)
    small = min(depth, half)
    radius = max(draws.number("neck_radius", (0.62, 0.9) if wide else (0.22, 0.55)) * small, 0.007, 0.2 * half)
    slender = shape in ("wine", "beer")
    if slender:
        radius = 0.34 * small
    levels = [(z * height, x * depth, x * half, r) for z, x, r in _profile(draws, shape)]
    lead, last = 1.15 * radius, levels[-1]
    foot = height + (0.004 if slender else draws.number("shoulder_rise", (0.1, 0.5)) * small)
    levels.append((foot, min(lead, last[1]), min(lead, last[2]), 1.0))
    if slender or draws.chance("long_neck", 0.12):
        foot += draws.number("neck_length", (0.5, 2.2)) * half
        levels.append((foot, 1.04 * radius, 1.04 * radius, 1.0))
    plain = shape in ("shampoo", "water", "waist", "jar", "tube") and not wide
    shift = 0.0
    if plain and draws.chance("neck_aside", 0.2):  # a can
        shift = draws.one_of("neck_at", {"back": -1.0, "front": 1.0}) * draws.number("neck_shift", (0.2, 0.8))
        shift *= max(depth - 1.2 * radius, 0.0)
    (z, x, y, r), top = levels[0], levels[1][0]
    cut = min(0.003, 0.3 * (top - z))  # a small bevel at the foot
    body = moulded([(z, x - cut, y - cut, r), (z + cut, x, y, r), *levels[1:]], outline, shift)
    wall = radius * draws.number("neck_wall", (0.12, 0.25))
    rim = foot + max(tall, radius * draws.number("neck_height", (0.5, 1.1)))
    body += neck(radius, radius - wall, foot - 0.0005, rim)
    mouth = Mouth(radius, radius - wall, foot, rim, height if shift else 0.0)
    if plain and draws.chance("handle", 0.25):
        z0, z1 = sorted(draws.numbers("handle_ends", 0.15, 0.9, 2) * height)
        if z1 - z0 > 0.3 * height:
            reach, root = depth + draws.length("handle_reach", (0.02, 0.035)), 0.45 * depth
            upper, lower = z1 - 0.15 * (z1 - z0), z0 + 0.3 * (z1 - z0)
            points = [(root, z1), (0.85 * reach, z1), (reach, upper), (reach, lower), (0.8 * reach, z0), (root, z0)]
            broad = min(0.5 * draws.length("handle_width", (0.012, 0.024)), 0.5 * half)
            grip = grip_loop(points, broad, 0.5 * draws.length("handle_thickness", (0.008, 0.012)))
            body += grip.called("handle", -FRONT).moved((shift, 0, 0))
    if draws.chance("band", 0.2):  # a label or a moulded band
        z0 = draws.number("band_low", (0.2, 0.4)) * height
        z1 = z0 + draws.number("band_height", (0.1, 0.35)) * height
        table = np.array(levels)
        x, y, r = (float(np.interp(0.5 * (z0 + z1), table[:, 0], table[:, i])) for i in (1, 2, 3))
        body += moulded([(z, 1.02 * x, 1.02 * y, r) for z in (z0, z1)], outline, shift)
    return body, mouth


def _profile(draws: Draws, shape: str) -> list[tuple[float, float, float]]:
    """Height and half width over those of the body, and roundness, from the foot to the shoulder."""
    soft = draws.number("shoulder_softness", (0.0, 0.3))
    if shape in ("wine", "beer"):
        shoulder = draws.number("shoulder_height", (0.5, 0.72))
        if shape == "wine" and draws.chance("sloping", 0.5):  # sloping, as in Burgundy
            return [(0.0, 1.0, 0.0), (0.45, 1.0, 0.0), (0.65, 0.85, 0.3), (0.82, 0.55, 0.8), (1.0, 0.36, 1.0)]
        return [(0.0, 1.0, 0.0), (shoulder, 1.0, 0.0), (shoulder + 0.1, 0.84, 0.4), (shoulder + 0.18, 0.5, 1.0),
                (1.0, 0.36, 1.0)]  # fmt: skip
    if shape == "water":
        levels = [(0.0, 0.94, 0.0), (0.06, 1.0, 0.0)]
        rings = np.linspace(0.15, 0.7, draws.integer("rings", 2, 5)).tolist()
        dent = draws.number("ring_depth", (0.03, 0.1))
        for z in rings:
            levels += [(z - 0.025, 1.0, 0.0), (z, 1.0 - dent, 0.0), (z + 0.025, 1.0, 0.0)]
        return [*levels, (0.8, 1.0, soft), (0.93, 0.72, 0.6), (1.0, 0.5, 1.0)]
    if shape == "cone":
        top = draws.number("shoulder_width", (0.3, 0.75))
        return [(0.0, 0.94, 0.0), (0.04, 1.0, 0.0), (0.9, top, 0.4), (1.0, 0.8 * top, 1.0)]
    if shape == "ball":
        heights = np.linspace(-1.0, 1.0, 9)
        flat = draws.number("end_width", (0.35, 0.6))
        return [(0.5 + 0.5 * z, max(cos(0.5 * np.pi * z), flat), 0.0) for z in (0.93 * heights).tolist()]
    if shape == "jar":
        edge = draws.number("shoulder_width", (0.86, 1.0))
        return [(0.0, 0.92 * edge, 0.0), (0.07, 1.0, 0.0), (0.9, edge, soft), (1.0, 0.92 * edge, 0.7)]
    if shape == "flask":
        broad = draws.number("shoulder_width", (0.85, 1.1))
        return [(0.0, 0.9, 0.0), (0.05, 1.0, 0.0), (0.75, broad, 0.0), (1.0, 0.62, 0.3)]
    if shape == "tube":  # the whole is one width up to a flat shoulder
        return [(0.0, 1.0, 0.0), (1.0, draws.number("shoulder_width", (0.85, 1.0)), soft)]
    if shape == "waist":
        thin, at = draws.number("waist", (0.6, 0.88)), draws.number("waist_height", (0.4, 0.65))
        between, broad = 0.5 + 0.5 * thin, draws.number("shoulder_width", (0.85, 1.0))
        return [(0.0, 0.9, 0.0), (0.08, 1.0, 0.0), (at - 0.15, between, soft), (at, thin, soft),
                (at + 0.15, between, soft), (0.85, broad, soft), (1.0, 0.6, 0.8)]  # fmt: skip
    taper = draws.number("shoulder_width", (0.7, 1.0))  # shampoo
    return [(0.0, draws.number("foot_width", (0.8, 0.96)), 0.0), (0.06, 1.0, 0.0), (0.55, 0.5 + 0.5 * taper, 0.0),
            (0.88, taper, soft), (1.0, 0.7 * taper, 0.6)]  # fmt: skip


def _closing(draws: Draws, mouth: Mouth, height: float) -> JointSpec:
    """Joint of a cap that covers the neck: on a thread mostly; some slide off, some only turn."""
    kind = draws.pick("cap_joint", {"screw": 0.62, "slide": 0.23, "turn": 0.15})
    at = (0.0, 0.0, mouth.rim)
    if kind == "slide":
        return prismatic("body", UP, 0.0, height * draws.number("cap_travel", (0.8, 3.0)), at)
    if kind == "turn":
        return continuous("body", UP, at)
    turns = 2.0 * np.pi * draws.number("cap_turns", (0.5, 4.0))
    return screw("body", UP, at, 0.0, turns, height * draws.number("cap_pitch", (0.6, 1.5)) / turns)


def _cover(draws: Draws, mouth: Mouth, bore: float = 0.0) -> tuple[Solid, float, float, float]:
    """A cap over the neck: the solid, its radius at the top, its underside and its top."""
    sections = draws.pick("cap_sides", [24, 24, 8, 16])
    inside = (mouth.radius * 1.02 + GAP) / cos(np.pi / sections)
    wall = draws.number("cap_wall", (0.1, 0.35))
    wall = max(draws.one_of("cap", {"thin": 0.1, "thick": wall}) * mouth.radius, 0.0016)
    upper = inside + wall
    radius = upper * (draws.number("cap_flare", (1.0, 1.2)) if draws.chance("cap_flared", 0.4) else 1.0)
    low, high = mouth.foot + GAP, mouth.rim + GAP + wall
    if bore == 0.0 and draws.chance("tall_cap", 0.35):
        high += mouth.radius * draws.number("cap_height", (0.1, 2.0))
    return cap(radius, wall, low, high, bore, upper, sections), upper, low, high


def _screw_cap(draws: Draws, bottle: Assembly, mouth: Mouth) -> None:
    lid, radius, low, high = _cover(draws, mouth)
    tall = high - low
    if draws.chance("cap_rib", 0.5):
        lid += ribs(radius, low + 0.12 * tall, high - 0.1 * tall, draws.integer("cap_ribs", 10, 19), 0.07 * radius)
    style = draws.number("cap_top", (0.0, 1.0))
    if style < 0.2:
        lid += dome(0.97 * radius, high - 0.0005, draws.number("cap_dome", (0.15, 0.9)) * radius)
    elif style < 0.3:  # a spout with a knob
        lid += rod(0, 0, (high - 0.0005, high + 0.5 * radius), 0.75 * radius, 0.35 * radius)
        lid += rod(0, 0, (high, high + radius), 0.3 * radius) + dome(0.42 * radius, high + radius, 0.004)
    elif style < 0.4:  # a loop to carry it by
        r = 0.7 * radius
        lid += tube([(0.0, y, high - 0.001 + z) for y, z in arch(r, 1.1 * r, 8)], 0.16 * radius, 8)
    if draws.chance("neck_bead", 0.3):  # below the cap
        bottle.body += ring((0, 0, mouth.foot - 0.0005), UP, 0.6 * mouth.bore, 1.12 * radius, 0.001, 20)
    bottle.add("lid", lid, _closing(draws, mouth, high - low))


def _stopper(draws: Draws, bottle: Assembly, mouth: Mouth) -> None:
    """A cork, a glass ball or a disc on a plug that sits in the neck."""
    plug = (mouth.bore - GAP) * cos(np.pi / 18) * 0.98
    low, rim = mouth.rim - 0.7 * (mouth.rim - mouth.foot), mouth.rim + GAP
    lid = rod(0, 0, (low, rim + 0.002), 0.9 * plug, plug, 18)
    r = mouth.radius
    kind = draws.pick("stopper", ["cork", "ball", "disc", "crystal", "knob"])
    if kind == "cork":
        top = rim + r * draws.number("stopper_height", (0.4, 1.2))
        lid += rod(0, 0, (rim, top), r * draws.number("stopper_foot", (0.9, 1.1)), r, 20)
    elif kind == "ball":
        size = r * draws.number("stopper_size", (1.0, 1.8))
        lid += rod(0, 0, (rim, rim + 0.3 * r), r, 0.8 * r, 20)
        lid += ellipsoid((0, 0, rim + 0.9 * size), (size, size, 0.9 * size), 16)
    elif kind == "disc":
        lid += rod(0, 0, (rim, rim + 0.3 * r), 1.3 * r, 1.2 * r) + dome(0.5 * r, rim + 0.3 * r, 0.5 * r)
    elif kind == "crystal":
        top = rim + r * draws.number("stopper_height", (1.2, 2.4))
        lid += rod(0, 0, (rim, 0.5 * (rim + top)), 0.7 * r, 1.4 * r, 8)
        lid += rod(0, 0, (0.5 * (rim + top) - 1e-4, top), 1.4 * r, 0.5 * r, 8)
    else:
        knob = rod(0, 0, (rim, rim + 1.1 * r), 0.35 * r) + ellipsoid((0, 0, rim + 1.4 * r), 0.6 * r, 12)
        lid += rod(0, 0, (rim, rim + 0.25 * r), 1.15 * r) + knob.called("knob", UP)
    depth = mouth.rim - low
    bottle.add("lid", lid, prismatic("body", UP, 0.0, depth * draws.number("stopper_travel", (1.0, 3.0)), (0, 0, rim)))


def _flip_top(draws: Draws, bottle: Assembly, mouth: Mouth) -> None:
    """A lid that swings back about a hinge at the edge of a collar."""
    collar, radius, low, high = _cover(draws, mouth)
    tall = radius * draws.number("lid_height", (0.15, 0.9))
    base = high + GAP
    r = max(0.07 * radius, 0.0012)
    x, half = radius + 0.8 * r, radius * draws.number("hinge_width", (0.25, 0.55))
    wall = 0.12 * radius
    lid = cap(0.98 * radius, wall, base, base + tall, top=0.98 * radius * draws.number("lid_taper", (0.75, 1.0)))
    z = base + r
    lid += rod(x, (-half, half), z, r, sections=12) + box((0.8 * radius, x), half, (base, base + 1.6 * r))
    roots = (0.7 * radius, x), (max(high - 2.5 * r, mouth.rim + GAP), high - r)
    collar += cheeks((x, z), r, half + 0.0006, half + 0.0006 + 1.5 * r, *roots, 10)
    if draws.chance("thumb_rest", 0.6):  # at the front
        along = (-0.98 * radius - 0.2 * radius, -0.9 * (0.98 * radius))
        lid += box(along, 0.3 * radius, (base + 0.05 * tall, base + 0.3 * tall), fillet=0.1 * tall)
    spout = 0.6 * (0.98 * radius - wall)
    if tall > 0.35 * radius:
        collar += rod(0, 0, (high - 0.0005, high + 0.4 * tall), 0.5 * spout, 0.35 * spout, 14)
    # Beyond 90 degrees the lid's back dips beside the collar, above the shoulder.
    limit = draws.turn("lid_angle", (80, 135 if tall < 0.6 * (high - low) else 95))
    turning = draws.chance("collar", 0.35)
    if turning:
        bottle.add("collar", collar, _closing(draws, mouth, high - low))
    else:
        bottle.body += collar
    bottle.add("lid", lid, revolute("collar" if turning else "body", SIDE, (x, 0, z), 0.0, limit))


def _pump(draws: Draws, bottle: Assembly, mouth: Mouth) -> None:
    """A collar that turns on the neck, and a head that is pressed down in it."""
    stem = min(mouth.bore * draws.number("stem_radius", (0.3, 0.5)), 0.005)
    collar, radius, low, high = _cover(draws, mouth, stem + GAP)
    stroke = (mouth.rim - mouth.foot) * draws.number("pump_travel", (0.4, 0.7))
    stage = radius * draws.number("collar_tube", (0.0, 0.8))  # a smaller tube on the collar
    if stage > 0.2 * radius:
        tube_radius = radius * draws.number("collar_tube_radius", (0.45, 0.8))
        collar += ring((0, 0, high + 0.5 * stage - 0.0005), UP, stem + GAP, tube_radius, stage, 16)
    else:
        stage = 0.0
    head = high + stage + stroke + 0.0015
    size = max(radius * draws.number("head_size", (0.6, 1.1)), 1.8 * stem)
    reach = max(size * 1.3, radius * draws.number("nozzle_length", (1.4, 3.0)))
    # The nozzle droops by up to a quarter of its reach and must stay above the collar when pressed.
    head += 0.25 * reach if reach > radius else 0.0
    solid = pump_head(draws, head, stem, size, reach, head - high + 0.0035)
    bottle.add("collar", collar, _closing(draws, mouth, high - low))
    bottle.add("pump", solid, prismatic("collar", -UP, 0.0, stroke, (0, 0, head)))


def _sprayer(draws: Draws, bottle: Assembly, mouth: Mouth) -> None:
    """A sprayer's head on a collar, with a trigger that swings back."""
    head, radius, low, high = _cover(draws, mouth)
    wide = radius * draws.number("head_width", (0.5, 0.8))
    tall, reach = radius * draws.number("head_height", (1.2, 2.0)), radius * draws.number("head_length", (2.0, 3.2))
    top = high + tall
    deck = high + 0.45 * tall  # the trigger hangs below it
    root = rod(0, 0, (high - 0.001, high + 0.001), 0.8 * radius, sections=16)
    head += hull_of(root, box((-0.35 * radius, 0.9 * radius), 0.8 * wide, (deck, deck + 0.001)))
    head += box((-reach, radius * draws.number("head_back", (1.0, 1.9))), wide, (deck, top), fillet=0.35 * wide)
    nozzle = 0.55 * min(wide, 0.5 * (top - deck))
    middle = 0.5 * (deck + top)
    head += rod((-reach - 0.35 * radius, -reach + 0.002), 0, middle, nozzle, 1.2 * nozzle, 6)
    x = -0.72 * reach
    z = deck - 0.0018
    length = min(radius * draws.number("trigger_length", (1.4, 2.4)), z - mouth.shoulder - 0.002)
    thin = 0.45 * wide
    points = [(x, z - 0.001), (x - 0.12 * length, z - 0.4 * length), (x - 0.05 * length, z - 0.75 * length),
              (x - 0.3 * length, z - length)]  # fmt: skip
    trigger = grip_loop(points, thin, 0.0016)
    # Pulled, its tip comes no nearer than the collar.
    room = (abs(x) - 1.05 * radius - 0.003) / length
    limit = min(draws.angle("trigger_angle", (0.25, 0.6)), max(0.8 * room, 0.08))
    bottle.add("head", head, _closing(draws, mouth, high - low))
    bottle.add("trigger", trigger, revolute("head", (0, -1, 0), (x, 0, z), 0.0, limit))


def _cup(draws: Draws, bottle: Assembly, mouth: Mouth) -> None:
    """A vacuum flask: a screwed stopper, and a cup over it."""
    plug = (mouth.bore - GAP) * cos(np.pi / 18) * 0.98
    rim = mouth.rim + GAP
    tall = mouth.radius * draws.number("stopper_height", (0.4, 0.9))
    stopper = rod(0, 0, (0.5 * (mouth.foot + mouth.rim), rim + 0.001), plug, sections=18)
    stopper += rod(0, 0, (rim, rim + tall), mouth.radius, 0.9 * mouth.radius, 20)
    turns = 2.0 * np.pi * draws.number("stopper_turns", (0.5, 2.0))
    depth = 0.5 * (mouth.rim - mouth.foot)
    inner = (mouth.radius * 1.04 + GAP) / cos(np.pi / 24)
    wall = 0.12 * mouth.radius
    top = rim + tall + depth + 2 * GAP + wall
    radius = inner + wall
    cup = cap(radius, wall, mouth.foot + GAP, top, top=radius * draws.number("cup_taper", (1.0, 1.08)))
    if draws.chance("cup_ear", 0.5):
        side = draws.side("cup_ear_side")
        points = [(0.9 * radius, top - 0.2 * tall - wall), (1.5 * radius, top - 0.3 * tall - wall),
                  (1.5 * radius, mouth.rim), (0.97 * radius, mouth.rim - 0.002)]  # fmt: skip
        ear = grip_loop(points, 0.15 * radius, 0.06 * radius).called("handle", -FRONT)
        cup += ear.turned(UP, side * draws.angle("cup_ear_angle", (0.0, 0.5)))
    bottle.add("stopper", stopper, screw("body", UP, (0, 0, rim), 0.0, turns, 0.95 * depth / turns))
    lift = (top - mouth.foot) * draws.number("cup_travel", (1.0, 1.8))
    bottle.add("cup", cup, prismatic("body", UP, 0.0, lift, (0, 0, top)))


def _bail(draws: Draws, bottle: Assembly, mouth: Mouth) -> None:
    """A preserving jar or a swing-top bottle: a flat lid on a hinge at the back, with a wire bow at the front."""
    r = 0.09 * mouth.radius
    rim = mouth.rim + GAP
    radius = mouth.radius * draws.number("lid_radius", (1.02, 1.15))
    tall = radius * draws.number("lid_height", (0.14, 0.4))
    x, half = radius + 1.2 * r, radius * draws.number("hinge_width", (0.2, 0.4))
    z = rim + r
    lid = rod(0, 0, (rim, rim + tall), radius, 0.92 * radius)
    if draws.chance("domed_lid", 0.6):
        lid += dome(0.85 * radius, rim + tall - 1e-4, draws.number("lid_dome", (0.1, 0.45)) * radius)
    lid += rod(x, (-half, half), z, r, sections=12) + box((0.7 * radius, x), half, (rim, rim + r))
    low = 0.5 * (mouth.foot + mouth.rim)
    bottle.body += ring((0, 0, low), UP, 0.98 * mouth.radius, mouth.radius + r, 1.6 * r, 20)
    for s in (-1.0, 1.0):
        y = s * (half + 0.0006 + 0.8 * r)
        bottle.body += tube([(0.9 * mouth.radius, y, low), (x, y, low), (x, y, z)], 0.7 * r, 8)
    limit = draws.turn("lid_angle", (80, 110))
    bottle.add("lid", lid, revolute("body", SIDE, (x, 0, z), 0.0, limit))
    wire = 0.5 * r
    drop = low - mouth.foot - 2.5 * wire
    if draws.chance("latch", 0.7) and drop > 0.004:  # the wire that locks it, before the neck
        out = -(mouth.radius + r + wire + 0.0015)
        wide = 0.5 * mouth.radius
        path = [(out, -wide, low), (out, -0.8 * wide, low - drop), (out, 0.8 * wide, low - drop), (out, wide, low)]
        bow = tube(path, wire, 8) + tube([path[0], path[-1]], wire, 8)
        limit = draws.turn("latch_angle", (60, 120))
        bottle.add("latch", bow, revolute("body", SIDE, (out, 0, low), 0.0, limit))
