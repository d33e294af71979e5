"""USB sticks: a connector towards -X, and a cap, a sleeve, a swivel cover or a slider that keeps it.

What varies: how the connector is kept (cap, cap at either end, swivel cover, sleeve, retracting slider); its type;
length, width, thickness and outline of the body (rectangle, oval, tapered, waisted, drum), bevels, ribs, studs; eyelets
and hinged bails; a switch on the side.
"""

from dataclasses import dataclass, replace

import numpy as np

from artsim.families.keys import key_outline, sleeve
from artsim.making.assembly import Assembly, prismatic, revolute, swivel
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, UP, Array, rounded_rectangle
from artsim.making.solids import Solid, box, deferred, hull, hull_of, prism, ring, rod, tube, union

GAP = 0.0004


@dataclass(frozen=True)
class _Stick:
    """Body from x = 0 to ``length``, half its width and half its thickness; its plug, which stands out by ``reach``."""

    length: float
    half: float
    thick: float
    reach: float
    plug: Array
    """(2,) half its width and half its thickness."""


_PLUGS = {"A": (0.0135, 0.006, 0.00225), "C": (0.0075, 0.0042, 0.00125), "micro": (0.0065, 0.0034, 0.0009)}
"""Measures of the plugs."""


def build(draws: Draws) -> Assembly:
    """A USB stick that lies flat, its connector covered or drawn in at rest."""
    scale = draws.number("scale", (0.75, 1.9))  # novelty sticks are larger than their connectors ask for
    sides = zip(("length", "width", "thickness"), draws.one_of("plug", _PLUGS, (0.7, 0.2, 0.1)), strict=True)
    reach, *plug = (v * scale * draws.number(f"plug_{name}", (0.9, 1.15)) for name, v in sides)
    half = plug[0] * draws.number("width", (1.25, 2.6))
    thick = plug[1] * draws.triangular("height", 1.4, 1.9, 4.2)
    stick = _Stick(reach * draws.number("length", (1.1, 4.2)), half, thick, reach, np.array(plug))
    usb = Assembly(density=1200.0)
    kinds = {"capped": _capped, "two_caps": _two_caps, "swivel": _swivel, "sleeve": _sleeved, "retracting": _retracting}
    draws.one_of("kind", kinds, (0.3, 0.1, 0.28, 0.14, 0.18))(draws, usb, stick)
    return usb


@deferred
def _plug(stick: _Stick, x: float, sign: float = -1.0) -> Solid:
    """Connector that stands out from a plane at x towards -X (sign -1) or +X: a shell around a tongue."""
    half, thick = stick.plug
    wall = 0.14 * thick
    first, last = sorted((x - sign * 0.002, x + sign * stick.reach))
    hole = stick.plug - wall
    solid = sleeve((first, *-stick.plug), (last, *stick.plug), -hole, hole, 0.2 * thick, 1)
    tongue = x - sign * 0.002, x + sign * 0.93 * stick.reach
    return solid + box(tongue, half - 0.5 * wall, (-0.05 * thick, 0.5 * thick))


def _outline(draws: Draws, kind: str, x0: float, x1: float, half: float) -> list[Array]:
    """Convex outlines in x and y whose union is the body's, seen from above."""
    radius = half * draws.number("rounding", (0.1, 0.95))
    if kind == "oval":
        return [key_outline("round", (2.0 * (0.5 * (x1 - x0)), 2.0 * half), 24) + (0.5 * (x0 + x1), 0.0)]
    if kind == "tapered":
        end = draws.number("end_width", (0.35, 0.9)) * half
        return [np.array([(x0, -half), (x0, half), (x1 - 0.3 * radius, end), (x1, 0.6 * end), (x1, -0.6 * end),
                          (x1 - 0.3 * radius, -end)])]  # fmt: skip
    if kind == "waisted":
        waist = draws.number("waist_width", (0.6, 0.88)) * half
        middle = x0 + draws.number("waist_place", (0.35, 0.65)) * (x1 - x0)
        ends = [
            np.array([(x, s * half) for x in (a, a + 0.15 * (b - a)) for s in (-1, 1)]) for a, b in ((x0, x1), (x1, x0))
        ]
        return [np.concatenate([end, [(middle, waist), (middle, -waist)]]) for end in ends]
    if kind == "round_end":
        bow = key_outline("round", (2.0 * half, 2.0 * half), 20)
        bow = bow[bow[:, 0] > 0] * (min(1.0, 0.8 * (x1 - x0) / half), 1.0)
        return [np.concatenate([bow + (x1 - bow[:, 0].max(), 0.0), [(x0, -half), (x0, half)]])]
    return [rounded_rectangle((x0, -half), (x1, half), min(radius, 0.4 * (x1 - x0)), 3)]


def _body(draws: Draws, stick: _Stick, x0: float, x1: float, plain: bool = False) -> Solid:
    """The body between two x, with bevels, ribs or studs unless it is to be plain."""
    kinds = {"rectangle": 0.3, "tapered": 0.14, "waisted": 0.16, "oval": 0.12, "round_end": 0.16, "drum": 0.12}
    kind = "rectangle" if plain else draws.pick("shape", kinds)
    half, thick, span = stick.half, stick.thick, x1 - x0
    if kind == "drum":
        rounding = draws.number("drum_rounding", (0.6, 1.0)) * min(half, thick)
        return box((x0, -half, -thick), (x1, half, thick), fillet=rounding, axis=0, steps=4)
    bevel = draws.one_of("edges", {"sharp": 0.0, "bevelled": draws.number("bevel", (0.2, 0.9))})
    solid = Solid()
    for outline in _outline(draws, kind, x0, x1, half):
        middle = outline.mean(axis=0)
        inner = middle + (1.0 - 0.25 * bevel) * (outline - middle)
        seam = thick * (1.0 - 0.8 * bevel)
        solid += hull_of(prism(outline, -seam, seam), prism(inner, -thick, thick))
    if plain:
        return solid
    relief = draws.pick("relief", {"ribs": 0.25, "studs": 0.15, "plate": 0.2, "none": 0.4})
    if relief == "ribs":  # to hold it by
        for share in np.linspace(0.45, 0.75, draws.integer("ribs", 2, 5)):
            x = x0 + share * span
            solid += box((x, x + 0.03 * span), 0.5 * half, 1.08 * thick)
    elif relief == "studs":  # of a toy brick
        columns = draws.integer("stud_columns", 2, 4)
        size = 0.3 * min(span / columns, half)
        for share in (np.arange(columns) + 0.5) / columns:
            x = x0 + (0.12 + 0.76 * share) * span
            solid += union(rod(x, s * 0.42 * half, (0, thick + 0.6 * size), size, sections=12) for s in (-1, 1))
    elif relief == "plate":
        solid += box((x0 + 0.3 * span, x0 + 0.7 * span), 0.5 * half, (0, 1.1 * thick), fillet=0.2 * half, axis=2)
    return solid


def _capped(draws: Draws, usb: Assembly, stick: _Stick) -> None:
    """A cap that pulls off to -X; a wire loop at the back and a small slide switch on top, on some."""
    half, thick, length = stick.half, stick.thick, stick.length
    usb.add("body", (_body(draws, stick, 0.0, length) + _plug(stick, 0.0)) + _eyelet(draws, stick, length))
    _cap(draws, usb, stick, "cap", 0.0, -1.0)
    if draws.chance("loop", 0.25, upper=True):
        wire = draws.length("loop_wire", (0.0006, 0.0012))
        side, x = 1.12 * half + wire + GAP, 0.8 * length
        reach = 0.35 * length + draws.number("loop_reach", (0.6, 1.5)) * half + thick
        path = [(x, -side, 0), (x + 0.8 * reach, -side, 0), (x + reach, -0.5 * side, 0)]
        path += [(a, -b, c) for a, b, c in path[::-1]]
        usb.add("loop", tube(path, wire, 8), revolute("body", (0, 1, 0), (x, 0, 0), -0.2, 0.2), density=7000.0)
    if draws.chance("switch", 0.2, upper=True):
        x, top, size = 0.2 * length, 1.12 * thick + 0.4 * half + GAP, 0.1 * length
        knob = box((x, x + size), 0.6 * size, (top, top + 0.001), fillet=0.0003, axis=2)
        usb.add("switch", knob, prismatic("body", (1, 0, 0), 0.0, size, (x, 0, top)))


def _two_caps(draws: Draws, usb: Assembly, stick: _Stick) -> None:
    """A connector and a cap at either end."""
    usb.add("body", _body(draws, stick, 0.0, stick.length) + _plug(stick, 0.0) + _plug(stick, stick.length, 1.0))
    _cap(draws, usb, stick, "cap_0", 0.0, -1.0)
    _cap(draws, usb, stick, "cap_1", stick.length, 1.0)


def _cap(draws: Draws, usb: Assembly, stick: _Stick, name: str, x: float, sign: float) -> None:
    """A cap over the connector that stands out from the plane at x."""
    draws = draws.within("cap")
    half = max(stick.half * draws.number("width", (0.85, 1.15)), 1.2 * stick.plug[0] + GAP)
    thick = max(stick.thick * draws.number("thickness", (0.85, 1.15)), 1.3 * stick.plug[1] + GAP)
    inner = stick.plug + GAP
    radius = draws.number("rounding", (0.15, 0.95)) * min(half, thick)
    end = x + sign * (stick.reach + GAP)
    far = x + sign * (stick.reach + draws.number("end", (0.15, 0.9)) * stick.plug[0])
    first, last = sorted((x + sign * GAP, end + sign * 0.0002))
    solid = sleeve((first, -half, -thick), (last, half, thick), -inner, inner, radius, 3)
    shrink = draws.number("end_width", (0.5, 1.0))
    tips = [(end, 1.0), (0.5 * (end + far), 0.8 + 0.2 * shrink), (far, shrink)]
    rim = rounded_rectangle((-half, -thick), (half, thick), radius, 3)
    solid += hull([(a, *(s * point)) for a, s in tips for point in rim])
    pull = stick.reach * draws.number("travel", (1.1, 2.5))
    usb.add(name, solid, prismatic("body", (sign, 0, 0), 0.0, pull, (x, 0, 0)), density=1100.0)


def _swivel(draws: Draws, usb: Assembly, stick: _Stick) -> None:
    """A bent sheet about the stick that turns about an upright pivot."""
    half, back = stick.half, stick.length
    pivot = back - half * draws.number("pivot_place", (0.6, 1.0))
    pivot -= draws.number("pivot_inset", (0.0, 0.25)) * max(back - 2.0 * half, 0.0)
    body = _body(draws, stick, 0.0, back, plain=draws.chance("plain", 0.6)) + _plug(stick, 0.0)
    span = body.bounds()
    low, high = float(span[0, 2]) - GAP, float(span[1, 2]) + GAP
    pin = half * draws.number("pivot_radius", (0.2, 0.5))
    eyelet = _eyelet(draws, stick, back)
    usb.add("body", body + eyelet, density=1500.0)
    sheet = draws.length("cover_thickness", (0.0006, 0.0014))
    # The bridge before the connector's end also passes the corners of the body, and the eyelet.
    behind = back + (1.5 if eyelet.pieces else 0.0) * half
    corners = np.array([(-stick.reach, stick.plug[0]), (0.0, half), (behind, half)])
    reach = float(np.sqrt(np.square(corners - (pivot, 0.0)).sum(axis=1)).max()) + GAP
    tail, wide = half * draws.number("cover_tail", (0.5, 1.0)), half * draws.number("cover_width", (0.7, 1.1))
    end = key_outline("round", (2.0 * tail, 2.0 * wide), 16) + (pivot, 0.0)
    outline = np.concatenate([end[end[:, 0] > pivot], [(pivot - reach - sheet, -wide), (pivot - reach - sheet, wide)]])
    cover = prism(outline, low - sheet, low) + prism(outline, high, high + sheet)
    cover += box((pivot - reach - sheet, pivot - reach), wide, (low - sheet, high + sheet))
    for z, out in ((low - sheet, -1.0), (high + sheet, 1.0)):
        cover += rod(pivot, 0, (z - out * 0.5 * sheet, z + out * 0.0006), pin, sections=16)
    axis = draws.one_of("cover_opens", {"left": (0, 0, -1), "right": (0, 0, 1)})
    limit = None if draws.chance("cover_turns_freely", 0.3) else draws.angle("cover_angle", (1.6, 3.3))
    usb.add("cover", cover, swivel("body", axis, (pivot, 0, 0), limit, 0.0), density=4000.0)


def _sleeved(draws: Draws, usb: Assembly, stick: _Stick) -> None:
    """A sleeve over body and connector that slides back."""
    half, thick = stick.half, stick.thick
    length = max(stick.length, 1.5 * stick.reach)
    thinner = replace(stick, half=half - 0.0016, thick=thick - 0.0014)
    inner = thinner if thick > stick.plug[1] + 0.0022 else stick
    body = _body(draws, inner, 0.0, length, plain=True) + _plug(stick, 0.0)
    grip = draws.number("grip_length", (0.12, 0.3)) * length
    start = length - grip
    travel = stick.reach * draws.number("sleeve_travel", (0.9, 1.1))
    end = start - GAP
    # Behind the sleeve is a grip that is thinner than the sleeve's hole, so that the sleeve slides over it.
    body += _body(draws.within("grip"), inner, start, length + travel - grip + 0.004, plain=True)
    usb.add("body", body, density=1300.0)
    hole = np.maximum([inner.half, inner.thick], stick.plug) + GAP
    outer = hole + draws.length("sleeve_wall", (0.0009, 0.003))
    radius = draws.number("sleeve_rounding", (0.2, 0.95)) * float(outer.min())
    shell = sleeve((-stick.reach, *-outer), (end, *outer), -hole, hole, radius, 3)
    if draws.chance("sleeve_ribs", 0.5):
        x = end - 0.2 * length
        shell += union(box((x + d, -0.5 * half, outer[1] - 0.0003), (x + d + 0.0012, 0.5 * half, outer[1] + 0.0008))
                       for d in (0.0, 0.003, 0.006))  # fmt: skip
    usb.add("sleeve", shell, prismatic("body", (1, 0, 0), 0.0, travel, (0, 0, 0)), density=1500.0)


def _retracting(draws: Draws, usb: Assembly, stick: _Stick) -> None:
    """A connector on a slider with a knob, inside a hollow body: it comes out to -X."""
    wall = draws.length("wall", (0.0012, 0.0022))
    inner = np.array([max(stick.plug[0] + GAP, stick.half - wall), stick.plug[1] + 0.0008 + GAP])
    half, thick = inner[0] + wall, inner[1] + wall * draws.number("roof", (1.0, 2.2))
    carriage = stick.reach * draws.number("carriage_length", (0.6, 1.2))
    length = 2.0 * stick.reach + carriage + 2.0 * wall
    slot = inner[0] * draws.number("slot_width", (0.25, 0.45))
    back = length - wall
    radius = draws.number("rounding", (0.2, 0.95)) * min(half, thick)
    rim = rounded_rectangle((-half, -thick), (half, thick), radius, 3)
    knob_start = stick.reach + 0.15 * carriage
    knob_end = knob_start + draws.number("knob_length", (0.5, 0.8)) * carriage
    first, last = knob_start - stick.reach - 2 * GAP, knob_end + 2 * GAP
    solid = box((0, -half, -thick), (back, half, -inner[1])) if radius < 0.3 * thick else prism(
        np.column_stack([rim[:, 0], np.minimum(rim[:, 1], -inner[1])]), 0.0, back, 0)  # fmt: skip
    for s in (-1.0, 1.0):
        side = rim[s * rim[:, 0] > 0]
        outer = np.where(s * side[:, :1] > inner[0], side, (s * inner[0], 0.0))
        solid += prism(np.concatenate([outer, [(s * inner[0], -inner[1]), (s * inner[0], inner[1])]]), 0.0, back, 0)
        roof = np.column_stack([s * np.maximum(s * side[:, 0], slot), np.maximum(side[:, 1], inner[1])])
        solid += prism(np.concatenate([roof, [(s * slot, inner[1]), (s * slot, thick)]]), 0.0, back, 0)
    top = np.array([(y, z) for y in (-slot - 1e-4, slot + 1e-4) for z in (inner[1], thick)])
    solid += prism(top, 0.0, max(first, 0.0005), 0) + prism(top, last, back, 0) + prism(rim, back - 1e-4, length, 0)
    usb.add("body", solid + _eyelet(draws, replace(stick, half=half, thick=thick), length))
    slider = _plug(stick, stick.reach)
    low = inner - GAP
    slider += box((stick.reach, *-low), (stick.reach + carriage, *low))
    knob_top = thick + draws.length("knob_height", (0.0006, 0.003))
    slider += box((knob_start, knob_end), slot - GAP, (0, knob_top))
    across = (-draws.number("knob_width", (0.8, 1.6)) * slot, draws.number("knob_width", (0.8, 1.6)) * slot)
    knob = box((knob_start, knob_end), across, (thick + GAP, knob_top + 0.0006), fillet=0.001, axis=2)
    slider += knob.called("knob", UP)
    usb.add("connector", slider, prismatic("body", FRONT, 0.0, stick.reach, (stick.reach, 0, 0)), density=2000.0)


def _eyelet(draws: Draws, stick: _Stick, x: float) -> Solid:
    """A ring at the back for a cord, on some."""
    if not draws.chance("eyelet", 0.4, upper=True):
        return Solid()
    outer = stick.half * draws.number("eyelet_radius", (0.3, 0.8))
    thick = 1.2 * stick.thick * draws.number("eyelet_thickness", (0.3, 1.0))
    return ring((x + 0.75 * outer, 0, 0), (0, 0, 1), 0.55 * outer, outer, thick, 14)
