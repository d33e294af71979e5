"""USB sticks: a connector towards -X, and a cap, a sleeve, a swivel cover or a slider that keeps it.

What varies: how the connector is kept (cap, cap at either end, swivel cover, sleeve, retracting slider); its type;
length, width, thickness and outline of the body (rectangle, oval, tapered, waisted, drum), bevels, ribs, studs; eyelets
and hinged bails; a switch on the side.
"""

from dataclasses import dataclass

import numpy as np

from artsim.families.keys import key_outline, sleeve
from artsim.making.assembly import Assembly, Rng, continuous, pick, prismatic, revolute
from artsim.making.outlines import FRONT, rounded_rectangle
from artsim.making.solids import Solid, box, hull, hull_of, prism, ring, rod, tube, union
from artsim.model.kinematics import Array

GAP = 0.0004


@dataclass(frozen=True)
class _Plug:
    """Connector: how far it stands out, half its width and half its thickness."""

    reach: float
    half: float
    thick: float


@dataclass(frozen=True)
class _Stick:
    """Body from x = 0 to ``length``; half its width and half its thickness."""

    length: float
    half: float
    thick: float
    plug: _Plug


def build(rng: Rng) -> Assembly:
    """A USB stick that lies flat, its connector covered or drawn in at rest."""
    scale = rng.uniform(0.75, 1.9)  # novelty sticks are larger than their connectors ask for
    plug = _Plug(*(v * scale * rng.uniform(0.9, 1.15) for v in pick(rng, _PLUGS)))
    half = plug.half * rng.uniform(1.25, 2.6)
    thick = plug.thick * rng.triangular(1.4, 1.9, 4.2)
    length = plug.reach * rng.uniform(1.1, 4.2)
    stick = _Stick(length, half, thick, plug)
    usb = Assembly(density=1200.0)
    pick(rng, {_capped: 0.3, _two_caps: 0.1, _swivel: 0.28, _sleeved: 0.14, _retracting: 0.18})(rng, usb, stick)
    return usb


_PLUGS = {(0.0135, 0.006, 0.00225): 0.7, (0.0075, 0.0042, 0.00125): 0.2, (0.0065, 0.0034, 0.0009): 0.1}
"""Measures of the plugs A, C and Micro, and how common they are."""


def _plug(plug: _Plug, x: float, sign: float = -1.0) -> Solid:
    """Connector that stands out from a plane at x towards -X (sign -1) or +X: a shell around a tongue."""
    wall = 0.14 * plug.thick
    first, last = sorted((x - sign * 0.002, x + sign * plug.reach))
    outer, hole = np.array([plug.half, plug.thick]), np.array([plug.half - wall, plug.thick - wall])
    solid = sleeve((first, *-outer), (last, *outer), -hole, hole, 0.2 * plug.thick, 1)
    tongue = x - sign * 0.002, x + sign * 0.93 * plug.reach
    return solid + box(tongue, plug.half - 0.5 * wall, (-0.05 * plug.thick, 0.5 * plug.thick))


def _outline(kind: str, x0: float, x1: float, half: float, rng: Rng) -> list[Array]:
    """Convex outlines in x and y whose union is the body's, seen from above."""
    radius = half * rng.uniform(0.1, 0.95)
    if kind == "oval":
        middle, reach = 0.5 * (x0 + x1), 0.5 * (x1 - x0)
        return [key_outline("round", (2.0 * reach, 2.0 * half), 24) + (middle, 0.0)]
    if kind == "tapered":
        end = rng.uniform(0.35, 0.9) * half
        return [np.array([(x0, -half), (x0, half), (x1 - 0.3 * radius, end), (x1, 0.6 * end), (x1, -0.6 * end),
                          (x1 - 0.3 * radius, -end)])]  # fmt: skip
    if kind == "waisted":
        waist, middle = rng.uniform(0.6, 0.88) * half, x0 + rng.uniform(0.35, 0.65) * (x1 - x0)
        ends = [
            np.array([(x, s * half) for x in (a, a + 0.15 * (b - a)) for s in (-1, 1)]) for a, b in ((x0, x1), (x1, x0))
        ]
        return [np.concatenate([end, [(middle, waist), (middle, -waist)]]) for end in ends]
    if kind == "round end":
        bow = key_outline("round", (2.0 * half, 2.0 * half), 20)
        bow = bow[bow[:, 0] > 0] * (min(1.0, 0.8 * (x1 - x0) / half), 1.0)
        return [np.concatenate([bow + (x1 - bow[:, 0].max(), 0.0), [(x0, -half), (x0, half)]])]
    return [rounded_rectangle((x0, -half), (x1, half), min(radius, 0.4 * (x1 - x0)), 3)]


def _body(rng: Rng, stick: _Stick, x0: float, x1: float, plain: bool = False) -> Solid:
    """The body between two x, with bevels, ribs or studs unless it is to be plain."""
    kinds = {"rectangle": 0.3, "tapered": 0.14, "waisted": 0.16, "oval": 0.12, "round end": 0.16, "drum": 0.12}
    kind = "rectangle" if plain else pick(rng, kinds)
    half, thick = stick.half, stick.thick
    if kind == "drum":
        low, high = np.array([x0, -half, -thick]), np.array([x1, half, thick])
        return box(low, high, fillet=rng.uniform(0.6, 1.0) * min(half, thick), axis=0, steps=4)
    bevel = rng.choice([0.0, rng.uniform(0.2, 0.9)])
    solid = Solid()
    for outline in _outline(kind, x0, x1, half, rng):
        middle = outline.mean(axis=0)
        inner = middle + (1.0 - 0.25 * bevel) * (outline - middle)
        seam = thick * (1.0 - 0.8 * bevel)
        solid += hull_of(prism(outline, -seam, seam), prism(inner, -thick, thick))
    if plain:
        return solid
    extra, span = rng.random(), x1 - x0
    if extra < 0.25:  # ribs to hold it by
        for share in np.linspace(0.45, 0.75, int(rng.integers(2, 6))):
            x = x0 + share * span
            solid += box((x, x + 0.03 * span), 0.5 * half, 1.08 * thick)
    elif extra < 0.4:  # studs of a toy brick
        columns = int(rng.integers(2, 5))
        size = 0.3 * min(span / columns, half)
        for share in (np.arange(columns) + 0.5) / columns:
            x = x0 + (0.12 + 0.76 * share) * span
            solid += union(rod(x, s * 0.42 * half, (0, thick + 0.6 * size), size, sections=12) for s in (-1, 1))
    elif extra < 0.6:
        solid += box((x0 + 0.3 * span, x0 + 0.7 * span), 0.5 * half, (0, 1.1 * thick), fillet=0.2 * half, axis=2)
    return solid


def _capped(rng: Rng, usb: Assembly, stick: _Stick) -> None:
    """A cap that pulls off to -X."""
    body = _body(rng, stick, 0.0, stick.length) + _plug(stick.plug, 0.0)
    usb.add("body", body + _eyelet(rng, stick, stick.length))
    _cap(rng, usb, stick, "cap", 0.0, -1.0)
    _bail(rng, usb, stick)
    _switch(rng, usb, stick)


def _two_caps(rng: Rng, usb: Assembly, stick: _Stick) -> None:
    """A connector and a cap at either end."""
    body = _body(rng, stick, 0.0, stick.length)
    usb.add("body", body + _plug(stick.plug, 0.0) + _plug(stick.plug, stick.length, 1.0))
    _cap(rng, usb, stick, "cap_0", 0.0, -1.0)
    _cap(rng, usb, stick, "cap_1", stick.length, 1.0)


def _cap(rng: Rng, usb: Assembly, stick: _Stick, name: str, x: float, sign: float) -> None:
    """A cap over the connector that stands out from the plane at x."""
    plug = stick.plug
    half = max(stick.half * rng.uniform(0.85, 1.15), 1.2 * plug.half + GAP)
    thick = max(stick.thick * rng.uniform(0.85, 1.15), 1.3 * plug.thick + GAP)
    inner = np.array([plug.half + GAP, plug.thick + GAP])
    radius = rng.uniform(0.15, 0.95) * min(half, thick)
    end, far = x + sign * (plug.reach + GAP), x + sign * (plug.reach + rng.uniform(0.15, 0.9) * plug.half)
    first, last = sorted((x + sign * GAP, end + sign * 0.0002))
    solid = sleeve((first, -half, -thick), (last, half, thick), -inner, inner, radius, 3)
    shrink = rng.uniform(0.5, 1.0)
    tips = [(end, 1.0), (0.5 * (end + far), 0.8 + 0.2 * shrink), (far, shrink)]
    rim = rounded_rectangle((-half, -thick), (half, thick), radius, 3)
    solid += hull([(a, *(s * point)) for a, s in tips for point in rim])
    pull = plug.reach * rng.uniform(1.1, 2.5)
    usb.add(name, solid, prismatic("body", (sign, 0, 0), 0.0, pull, (x, 0, 0)), density=1100.0)


def _swivel(rng: Rng, usb: Assembly, stick: _Stick) -> None:
    """A bent sheet about the stick that turns about an upright pivot."""
    half = stick.half
    back = stick.length
    pivot = back - half * rng.uniform(0.6, 1.0) - rng.uniform(0.0, 0.25) * max(back - 2.0 * half, 0.0)
    body = _body(rng, stick, 0.0, back, plain=rng.random() < 0.6) + _plug(stick.plug, 0.0)
    span = body.bounds()
    low, high = float(span[0, 2]) - GAP, float(span[1, 2]) + GAP
    pin = half * rng.uniform(0.2, 0.5)
    eyelet = _eyelet(rng, stick, back)
    usb.add("body", body + eyelet, density=1500.0)
    sheet = rng.uniform(0.0006, 0.0014)
    # The bridge before the connector's end also passes the corners of the body, and the eyelet.
    corners = np.array(
        [(-stick.plug.reach, stick.plug.half), (0.0, half), (back + (1.5 if eyelet.pieces else 0.0) * half, half)]
    )
    reach = float(np.sqrt(np.square(corners - (pivot, 0.0)).sum(axis=1)).max()) + GAP
    tail = half * rng.uniform(0.5, 1.0)
    wide = half * rng.uniform(0.7, 1.1)
    end = key_outline("round", (2.0 * tail, 2.0 * wide), 16) + (pivot, 0.0)
    outline = np.concatenate([end[end[:, 0] > pivot], [(pivot - reach - sheet, -wide), (pivot - reach - sheet, wide)]])
    cover = prism(outline, low - sheet, low) + prism(outline, high, high + sheet)
    cover += box((pivot - reach - sheet, pivot - reach), wide, (low - sheet, high + sheet))
    for z, out in ((low - sheet, -1.0), (high + sheet, 1.0)):
        cover += rod(pivot, 0, (z - out * 0.5 * sheet, z + out * 0.0006), pin, sections=16)
    side = float(rng.choice([-1.0, 1.0]))
    turn = continuous("body", (0, 0, side), (pivot, 0, 0)) if rng.random() < 0.3 else revolute(
        "body", (0, 0, side), (pivot, 0, 0), 0.0, rng.uniform(1.6, 3.3))  # fmt: skip
    usb.add("cover", cover, turn, density=4000.0)


def _sleeved(rng: Rng, usb: Assembly, stick: _Stick) -> None:
    """A sleeve over body and connector that slides back."""
    half, thick, plug = stick.half, stick.thick, stick.plug
    length = max(stick.length, 1.5 * plug.reach)
    inner = _Stick(length, half - 0.0016, thick - 0.0014, plug) if thick > plug.thick + 0.0022 else stick
    body = _body(rng, inner, 0.0, length, plain=True) + _plug(plug, 0.0)
    grip = rng.uniform(0.12, 0.3) * length
    start = length - grip
    travel = plug.reach * rng.uniform(0.9, 1.1)
    end = start - GAP
    # Behind the sleeve is a grip that is thinner than the sleeve's hole, so that the sleeve slides over it.
    body += _body(rng, inner, start, length + travel - grip + 0.004, plain=True)
    usb.add("body", body, density=1300.0)
    hole = np.array([max(inner.half, plug.half) + GAP, max(inner.thick, plug.thick) + GAP])
    outer = hole + rng.uniform(0.0009, 0.003)
    shell = sleeve((-plug.reach, *-outer), (end, *outer), -hole, hole, rng.uniform(0.2, 0.95) * float(outer.min()), 3)
    if rng.random() < 0.5:
        x = end - 0.2 * length
        shell += union(box((x + d, -0.5 * half, outer[1] - 0.0003), (x + d + 0.0012, 0.5 * half, outer[1] + 0.0008))
                       for d in (0.0, 0.003, 0.006))  # fmt: skip
    usb.add("sleeve", shell, prismatic("body", (1, 0, 0), 0.0, travel, (0, 0, 0)), density=1500.0)


def _retracting(rng: Rng, usb: Assembly, stick: _Stick) -> None:
    """A connector on a slider with a knob, inside a hollow body: it comes out to -X."""
    plug = stick.plug
    wall = rng.uniform(0.0012, 0.0022)
    inner = np.array([max(plug.half + GAP, stick.half - wall), plug.thick + 0.0008 + GAP])
    half, thick = inner[0] + wall, inner[1] + wall * rng.uniform(1.0, 2.2)
    carriage = plug.reach * rng.uniform(0.6, 1.2)
    length = 2.0 * plug.reach + carriage + 2.0 * wall
    slot = inner[0] * rng.uniform(0.25, 0.45)
    back = length - wall
    radius = rng.uniform(0.2, 0.95) * min(half, thick)
    solid = Solid()
    rim = rounded_rectangle((-half, -thick), (half, thick), radius, 3)
    knob_start = plug.reach + 0.15 * carriage
    knob_end = knob_start + rng.uniform(0.5, 0.8) * carriage
    first, last = knob_start - plug.reach - 2 * GAP, knob_end + 2 * GAP
    solid += box((0, -half, -thick), (back, half, -inner[1])) if radius < 0.3 * thick else prism(
        np.column_stack([rim[:, 0], np.minimum(rim[:, 1], -inner[1])]), 0.0, back, 0)  # fmt: skip
    for s in (-1.0, 1.0):
        side = rim[s * rim[:, 0] > 0]
        outer = np.where(s * side[:, :1] > inner[0], side, (s * inner[0], 0.0))
        solid += prism(np.concatenate([outer, [(s * inner[0], -inner[1]), (s * inner[0], inner[1])]]), 0.0, back, 0)
        roof = np.column_stack([s * np.maximum(s * side[:, 0], slot), np.maximum(side[:, 1], inner[1])])
        solid += prism(np.concatenate([roof, [(s * slot, inner[1]), (s * slot, thick)]]), 0.0, back, 0)
    top = np.array([(y, z) for y in (-slot - 1e-4, slot + 1e-4) for z in (inner[1], thick)])
    solid += prism(top, 0.0, max(first, 0.0005), 0) + prism(top, last, back, 0)
    solid += prism(rim, back - 1e-4, length, 0)
    usb.add("body", solid + _eyelet(rng, _Stick(length, half, thick, plug), length))
    slider = _plug(plug, plug.reach)
    low = inner - GAP
    slider += box((plug.reach, *-low), (plug.reach + carriage, *low))
    knob_top = thick + rng.uniform(0.0006, 0.003)
    slider += box((knob_start, knob_end), slot - GAP, (0, knob_top))
    across = (-rng.uniform(0.8, 1.6) * slot, rng.uniform(0.8, 1.6) * slot)
    slider += box((knob_start, knob_end), across, (thick + GAP, knob_top + 0.0006), fillet=0.001, axis=2)
    usb.add("connector", slider, prismatic("body", FRONT, 0.0, plug.reach, (plug.reach, 0, 0)), density=2000.0)


def _eyelet(rng: Rng, stick: _Stick, x: float) -> Solid:
    """A ring at the back for a cord, on some."""
    if rng.random() < 0.6:
        return Solid()
    outer = stick.half * rng.uniform(0.3, 0.8)
    thick = 1.2 * stick.thick * rng.uniform(0.3, 1.0)
    return ring((x + 0.75 * outer, 0, 0), (0, 0, 1), 0.55 * outer, outer, thick, 14)


def _bail(rng: Rng, usb: Assembly, stick: _Stick) -> None:
    """A hinged wire loop at the back, on some."""
    if rng.random() < 0.75:
        return
    wire = rng.uniform(0.0006, 0.0012)
    side, x = 1.12 * stick.half + wire + GAP, 0.8 * stick.length
    reach = 0.35 * stick.length + rng.uniform(0.6, 1.5) * stick.half + stick.thick
    path = [(x, -side, 0), (x + 0.8 * reach, -side, 0), (x + reach, -0.5 * side, 0), (x + reach, 0.5 * side, 0),
            (x + 0.8 * reach, side, 0), (x, side, 0)]  # fmt: skip
    usb.add("loop", tube(np.array(path), wire, 8), revolute("body", (0, 1, 0), (x, 0, 0), -0.2, 0.2), density=7000.0)


def _switch(rng: Rng, usb: Assembly, stick: _Stick) -> None:
    """A small slide switch on top, on some."""
    if rng.random() < 0.8:
        return
    x, top = 0.2 * stick.length, 1.12 * stick.thick + 0.4 * stick.half + GAP
    size = 0.1 * stick.length
    knob = box((x, x + size), 0.6 * size, (top, top + 0.001), fillet=0.0003, axis=2)
    usb.add("switch", knob, prismatic("body", (1, 0, 0), 0.0, size, (x, 0, top)))
