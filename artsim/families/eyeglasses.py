"""Eyeglasses: a frame with lenses, bridge and nose pads, and two temples that fold inwards, open at rest.

Varied: the outline of the lenses (round, rectangular, aviator, cat eye), one lens each or a shield, the rim (wire,
thick, above only, none), the bridge (one bar, two, saddle), nose pads, the wrap of the front, the temples (flat or
wire, tapered, bent ends, sleeves, or slim, on hinges without knuckles), and which temple folds above the other.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import arcsin, cos, hypot, power, sin
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, Array, about, normals
from artsim.making.solids import Solid, box, deferred, ellipsoid, hull, hull_of, loft, rod, tube, union

GAP = 0.0006
MM = 0.001
STEEPEST = np.deg2rad(8.5)
"""Largest tilt of the hinges from the vertical."""
SLIM = 0.4
"""Share of the glasses whose temples are slim."""
APART = 0.16
"""Share of the glasses whose temples stay each on its own side: their hinges are upright, and their ends may hang."""


def _mm(draws: Draws, name: str, low: float, high: float) -> float:
    """A length in metres that is drawn in millimetres, as opticians have it."""
    return draws.number(name, (low, high), unit="mm") * MM


class Front:
    """Measures of the front, metres. The hinges lie at x = 0, the lenses before them."""

    def __init__(self, draws: Draws, shield: bool, outline: Array, rim: float, scale: float, flat: bool) -> None:
        height = draws.number("temple_height", (5.0, 13.0 if shield else 10.0) if flat else (2.2, 4.0), unit="mm")
        # The front lies at x = -ahead in the middle, and further back by wrap at the hinges.
        self.wrap = scale * draws.number("wrap", (1.0, 20.0) if shield else (0.5, 9.0), unit="mm") * MM
        low, high = outline[:, 1].min(), outline[:, 1].max()
        self.half = float(outline[:, 0].max()) + rim + _mm(draws, "hinge_outset", 0.5, 4.0)  # from the middle
        self.ahead = self.wrap + _mm(draws, "endpiece_depth", 4.0, 11.0)
        self.hinge_z = float(high - draws.number("hinge_drop", (0.08, 0.42)) * (high - low)) - 0.2 * height * MM
        self.height = height * MM  # of the temples at the hinges
        self.thickness = _mm(draws, "temple_thickness", *((2.4, 4.2) if flat else (1.8, 2.6)))
        self.barrel = _mm(draws, "barrel_radius", 1.0, 1.4)  # of the hinges; 0 for those without knuckles

    def x(self, y: Array | float) -> Array:
        """Middle surface of the front over y."""
        depth: Array = self.wrap * np.square(np.asarray(y) / self.half) - self.ahead
        return depth


def build(draws: Draws) -> Assembly:
    """Eyeglasses, open at rest; each temple turns inwards about its hinge."""
    style = draws.pick("style", {"wire": 0.27, "thick": 0.36, "half": 0.15, "rimless": 0.08, "shield": 0.14})
    scale = draws.number("scale", (0.87, 1.13) if draws.chance("adult", 0.85) else (0.75, 0.9))
    outline = scale * _outline(draws.within("lens"))
    apart = scale * draws.number("bridge_width", (14.0, 24.0), unit="mm") * MM + float(np.ptp(outline[:, 0]))
    outline[:, 0] += apart / 2 - 0.5 * (outline[:, 0].min() + outline[:, 0].max())
    thick, half = _mm(draws, "thick_rim", 2.0, 4.5), _mm(draws, "half_rim", 1.5, 3.5)
    rim = {"wire": 1.3 * MM, "thick": thick, "half": half}.get(style, 1.0 * MM)
    flat = style in ("thick", "shield") or draws.chance("flat_temples", 0.4)
    front = Front(draws, style == "shield", outline, rim, scale, flat)

    depth = max(rim * draws.number("rim_depth", (0.8, 1.2)), 2.2 * MM)
    # A generator of its own, so that glasses without slim temples do not depend on how these are drawn.
    others = draws.fork("", draws.rng.spawn(1)[0])
    slim = others.chance("slim_temples", SLIM)
    sheet = slim and others.chance("plate_front", 0.6)
    if slim:
        front.thickness, front.barrel = _mm(others, "slim_temple_thickness", 0.9, 2.2), 0.0
    if sheet:  # as thin as real frames that were modelled as plates
        depth = _mm(others, "plate_thickness", 0.7, 3.2)
        front.wrap, front.ahead = 0.0, 0.5 * depth + GAP
    frame = _glass(draws, style, outline, front, rim, depth)
    if style != "shield":
        frame += _bridge(draws, style, outline, front, rim)
    if sheet:
        low, high = frame.bounds()
        frame = frame.moved((front.ahead, 0, 0)).scaled((depth / (high - low)[0], 1, 1)).moved((-front.ahead, 0, 0))
    else:
        frame += _nose_pads(draws, style, outline, front, rim)

    # The temples sweep two parallel planes: hinges tilted sideways by one angle keep one above the other however far
    # each is folded, as real ones lie across one another. The tilt bounds how far their ends may bend down.
    bend = min(_mm(draws, "temple_bend", 3.0, 26.0), 2 * front.half * sin(STEEPEST) - front.height - 2.5 * MM)
    aside = others.chance("temples_apart", APART)
    if aside:
        bend = others.number("hanging_bend", (0.02, 0.62)) * 2 * front.half
    temple = _temple(draws, front, max(bend, 0.0), flat)
    rise = float(np.ptp(temple.bounds()[:, 2])) + 2.0 * MM
    tilt = draws.one_of("upper_temple", {"left": -1, "right": 1}) * arcsin(min(rise / (2 * front.half), 1.0))
    limit = draws.turn("temple_angle", (77.0, 87.0))
    if aside:  # no temple passes the middle
        tilt, reach = 0.0, float(temple.bounds()[1, 0])
        limit = min(limit, arcsin(min((front.half - front.thickness - 1.0 * MM) / reach, 1.0)))
    hinge = _hinge(front)
    glasses = Assembly("frame", density=1200.0)
    for name, side in (("temple_left", -1), ("temple_right", 1)):
        place = np.array([0.0, side * front.half, front.hinge_z])
        corner = _plate_corner if sheet else _endpiece
        fixed, moving, end, arm = (
            solid if side > 0 else solid.mirrored(1) for solid in (*hinge, corner(front, outline, depth), temple)
        )
        frame += fixed.turned((1, 0, 0), -tilt).moved(place) + end
        axis = (0.0, -side * sin(tilt), -side * cos(tilt))
        solid = arm.moved(place) + moving.turned((1, 0, 0), -tilt).moved(place)
        glasses.add(name, solid, revolute("frame", axis, place, 0.0, limit))
    glasses.body = frame
    return glasses


def _outline(draws: Draws) -> Array:
    """(N, 2) y and z of the rim of the lens at +y, the outer side at larger y."""
    kind = draws.pick("shape", ["round", "rectangular", "aviator", "cat", "panto"])
    wide = {"round": (42.0, 52.0), "aviator": (54.0, 62.0)}.get(kind, (47.0, 58.0))
    tall = {"round": (0.9, 1.0), "rectangular": (0.48, 0.75), "aviator": (0.78, 0.92), "cat": (0.6, 0.82)}
    exponent = {"round": (2.0, 2.2), "rectangular": (2.8, 5.0)}.get(kind, (2.2, 3.0))
    a = 0.5 * _mm(draws, "width", *wide)
    b, n = a * draws.number("height", tall.get(kind, (0.72, 0.95))), draws.number("squareness", exponent)
    angles = np.linspace(0.0, 2.0 * np.pi, 26, endpoint=False)
    y, z = (np.sign(share) * power(np.abs(share), 2 / n) for share in (cos(angles), sin(angles)))
    nasal = {"aviator": (0.25, 0.45), "round": (0.0, 0.05)}.get(kind, (0.05, 0.25))
    y = y + draws.number("nose_cut", nasal) * np.square(1 - z) / 4 * np.clip(-y, 0, 1)  # room for the nose below
    y = y * (1 + draws.number("flare", (0.0, 0.12)) * z * (kind != "round"))
    if kind == "cat":
        z = z + draws.number("wing", (0.12, 0.35)) * np.square(np.clip(y, 0, 2)) * np.clip(z + 0.3, 0, 1)
    if kind == "aviator":
        z = z - draws.number("drop", (0.0, 0.15)) * y * np.clip(-z, 0, 1)
    return np.stack([a * y, b * z], axis=1)


def _chains(outline: Array, y: Array) -> tuple[Array, Array]:
    """Lower and upper z of the outline over y."""
    turned = np.roll(outline, -int(np.argmax(outline[:, 0])), axis=0)
    half = int(np.argmin(turned[:, 0]))
    upper, lower = turned[: half + 1], np.concatenate([turned[half:], turned[:1]])
    chains = [chain[np.argsort(chain[:, 0], kind="stable")] for chain in (lower, upper)]
    low, high = (np.interp(y, chain[:, 0], chain[:, 1]) for chain in chains)
    return low, high


@deferred
def _sheet(front: Front, y: Array, low: Array, high: Array, thickness: float) -> Solid:
    """Curved pane along the front between two heights over y."""
    x = front.x(y)
    columns = [[(x[k] + s * thickness / 2, y[k], z) for z in (low[k], high[k]) for s in (-1, 1)] for k in range(len(y))]
    return union(hull([*a, *b]) for a, b in pairwise(columns))


def _glass(draws: Draws, style: str, outline: Array, front: Front, rim: float, depth: float) -> Solid:
    """Lenses and rims."""
    inner, outer = outline[:, 0].min(), outline[:, 0].max()
    y = 0.5 * (inner + outer) - 0.5 * (outer - inner) * cos(np.linspace(0.08, np.pi - 0.08, 10))
    low, high = _chains(outline, y)
    lens = _sheet(front, y, low, high, 1.8 * MM).called("glass", FRONT)
    if style in ("wire", "thick"):
        lens += _rim(front, outline, rim, depth, closed=True)
    elif style == "half":
        lens += _rim(front, np.roll(outline, 1, axis=0)[: len(outline) // 2 + 3], rim, depth, closed=False)
    solid = lens + lens.mirrored(1)
    if style == "shield":
        edge = inner + 0.3 * (outer - inner)
        y = np.linspace(-edge, edge, 9)
        top = float(_chains(outline, np.array(edge))[1])
        span = top - outline[:, 1].min()
        nose = top - span * (draws.number("nose_notch", (0.25, 0.4)) + 0.5 * np.square(y / edge))
        solid = (solid + _sheet(front, y, nose, np.full(9, top), 1.8 * MM)).called("glass", FRONT)
        if draws.chance("brow", 0.6):
            y = np.linspace(-outer, outer, 15)
            brow = np.where(np.abs(y) < edge, top, _chains(outline, np.clip(np.abs(y), edge, 0.97 * outer))[1])
            tall, thick = _mm(draws, "brow_height", 3.0, 7.0), _mm(draws, "brow_thickness", 2.4, 4.0)
            solid += _sheet(front, y, brow - tall, brow + 1.0 * MM, thick)
    return solid


@deferred
def _rim(front: Front, points: Array, width: float, depth: float, closed: bool) -> Solid:
    """Bar of rounded section along an outline; reaches inwards over the lens's edge."""
    section = _octagon(0.5 * width + 0.4 * MM, 0.5 * depth) + (0.5 * width - 0.4 * MM, 0.0)
    flat = points[:, None] + section[:, :1] * normals(points, closed)[:, None]
    return loft(list(np.dstack([front.x(points[:, 0])[:, None] + section[:, 1], flat])), closed)


def _octagon(a: float, b: float) -> Array:
    """(8, 2) rectangle of half sides a and b with cut corners."""
    cut = 0.55 * min(a, b)
    corners = [(a, b - cut), (a - cut, b), (cut - a, b), (-a, b - cut), (-a, cut - b), (cut - a, -b), (a - cut, -b)]
    return np.array([*corners, (a, cut - b)])


def _bridge(draws: Draws, style: str, outline: Array, front: Front, rim: float) -> Solid:
    """One bar, two, or a thick saddle between the rims."""
    low, high = outline[:, 1].min(), outline[:, 1].max()
    thick = style == "thick"
    radius = 0.5 * (_mm(draws, "bridge_thickness", 3.0, 6.0) if thick else max(rim, 1.8 * MM))

    def bar(level: float, arch: float) -> Solid:
        z = low + level * (high - low)
        y = _edge(outline, z, False) + (3.0 if style == "rimless" else 0.3) * MM
        share = np.linspace(-1.0, 1.0, 7)
        bow = arch * (1 - np.square(share))
        return tube(np.column_stack([front.x(share * y) - 0.4 * bow, share * y, z + bow]), radius, 8)

    solid = bar(draws.number("bridge_level", (0.6, 0.78)), _mm(draws, "bridge_arch", 0.5, 4.0))
    if not thick and style != "rimless" and draws.chance("second_bridge", 0.3):
        solid += bar(0.95, _mm(draws, "second_bridge_arch", 0.0, 1.5))
    return solid


def _nose_pads(draws: Draws, style: str, outline: Array, front: Front, rim: float) -> Solid:
    """Two pads that slope along the nose, on wires or grown to the rims."""
    low, high = outline[:, 1].min(), outline[:, 1].max()
    z = low + draws.number("pad_level", (0.38, 0.55)) * (high - low)
    edge = _edge(outline, z, False)
    x = float(front.x(edge))
    if style == "shield":
        return Solid()
    if style == "thick" and draws.chance("pads_on_rim", 0.8):
        radii = (2.6 * MM, 0.5 * rim + 1.2 * MM, _mm(draws, "pad_height", 4.5, 7.0))
        pad = ellipsoid((0, 0, 0), radii, 12).turned((1, 0, 0), 0.3).moved((x + 2.0 * MM, edge - 0.4 * rim, z))
        return pad + pad.mirrored(1)
    back = min(_mm(draws, "pad_depth", 4.5, 7.5), -x - 2.0 * MM)
    y = edge - rim - _mm(draws, "pad_offset", 0.5, 2.0)
    pad = ellipsoid((0, 0, 0), (2.6 * MM, 1.1 * MM, _mm(draws, "pad_height", 4.5, 6.5)), 12)
    pad = pad.turned((1, 0, 0), 0.3).turned((0, 0, 1), -0.5).moved((x + back, y, z - 1.0 * MM))
    start = (x, edge - 0.3 * rim, z + 1.0 * MM)
    pad += tube([start, (x + 0.6 * back, edge, z + 3.0 * MM), (x + back, y, z)], 0.6 * MM, 6)
    return pad + pad.mirrored(1)


def _edge(outline: Array, z: float, outer: bool) -> float:
    """y of the outline's outer or inner side at a height."""
    return float(_chains(outline[:, ::-1], np.array(z))[0 if outer else 1])


@deferred
def _endpiece(front: Front, outline: Array, depth: float) -> Solid:
    """Corner at +y from the lens or rim out and back to the hinge."""
    z = about(front.hinge_z, 0.5 * front.height)
    y = _edge(outline, front.hinge_z, True)
    x = float(front.x(front.half))
    near, far = front.half + front.barrel, front.half + front.barrel + front.thickness
    at_lens = box(about(float(front.x(y)), depth / 2), (y - 1.2 * MM, y), z)
    corner = box((x - depth / 2, x + 0.7 * depth), (near, far - 0.3 * front.thickness), z)
    ahead = box((x, x + depth), (near, far), z)
    back = box((-3.0 * MM, -GAP), (near, far), z)
    return hull_of(at_lens, corner) + hull_of(corner, ahead) + hull_of(ahead, back)


@deferred
def _plate_corner(front: Front, outline: Array, depth: float) -> Solid:
    """Corner at +y of a frame that is a plate, from the lens out to the hinge within the plate."""
    across = (_edge(outline, front.hinge_z, True) - 1.2 * MM, front.half + front.thickness)
    return box((-depth - GAP, -GAP), across, about(front.hinge_z, 0.5 * front.height))


def _hinge(front: Front) -> tuple[Solid, Solid]:
    """Knuckles on the axis of the hinge at +y: the frame's, above and below, and the temple's between them."""
    if front.barrel == 0.0:
        return Solid(), Solid()
    half, b = 0.5 * max(min(0.8 * front.height, 6.0 * MM), 3.6 * MM), front.barrel
    third = half / 3

    def knuckle(low: float, high: float, x0: float, x1: float) -> Solid:
        leaf = box((x0, x1), (-0.3 * b, b + 0.8 * MM), (low, high))
        return rod(0, 0, (low, high), 0.9 * b, sections=12) + leaf

    fixed = knuckle(third, half, -3.0 * MM, -GAP) + knuckle(-half, -third, -3.0 * MM, -GAP)
    return fixed, knuckle(-third + 0.3 * MM, third - 0.3 * MM, GAP, 3.0 * MM)


def _temple(draws: Draws, front: Front, bend: float, flat: bool) -> Solid:
    """Temple of the hinge at +y, along +x from the hinge at the origin, its end bent down."""
    shares = {"usual": (0.92, 1.06), "long": (1.06, 1.24), "short": (0.42, 0.92)}
    length = 2 * front.half * draws.number("temple_length", draws.one_of("temple_reach", shares, (0.55, 0.2, 0.25)))
    x = np.concatenate([np.linspace(GAP, 0.6 * length, 4), np.linspace(0.68, 1.0, 8) * length])
    share = np.clip(x / length - draws.number("bend_start", (0.66, 0.74)), 0, 1)
    z = -bend * power(share / share[-1], draws.number("bend_sharpness", (1.2, 1.8)))
    bow = _mm(draws, "temple_bow", 0.0, 3.0) * (0.2 if front.barrel == 0.0 else 1.0)
    y = front.barrel + 0.5 * front.thickness - bow * np.square(x / length)
    waist = draws.number("temple_waist", (0.45, 0.95)) if flat else 0.8
    heights = front.height * (1 - (1 - waist) * np.clip(x / (0.55 * length), 0, 1))
    thick = front.thickness * (1 - (0.3 if flat else 0.15) * x / length)
    paddle = draws.number("temple_paddle", (1.0, 1.5)) if flat else 1.0
    heights = np.minimum(heights * (1 + (paddle - 1) * share / share[-1]), front.height)
    if not flat and draws.chance("temple_sleeves", 0.8):  # over the end of the wire
        sleeve = x > 0.64 * length
        heights = np.where(sleeve, 4.0 * MM, heights)
        thick = thick if front.barrel == 0.0 else np.where(sleeve, 2.8 * MM, thick)
    heights[-1] *= 0.75
    slopes = np.gradient(z, x)
    slopes[0] = 0.0
    rings = []
    for k in range(len(x)):
        section = _octagon(0.5 * thick[k], 0.5 * heights[k])
        up = np.array([-slopes[k], 0.0, 1.0]) / hypot(slopes[k], 1.0)
        rings.append((x[k], y[k], z[k]) + section[:, :1] * (0, 1, 0) + section[:, 1:] * up)
    return loft(rings)
