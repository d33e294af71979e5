"""Lighters: pocket lighters with a hinged lid, disposable ones, and long ones with a trigger.

What varies: kind, size and cross-section; the spark wheel and the lever or button below the flame; the lid, its hinge
and limits; slots and vents; the length and bend of a long lighter's nozzle, its trigger, safety switch and gas wheel.
"""

import numpy as np

from artsim.common.elementary import arctan2, cos, sin
from artsim.families.details import cheeks
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import SIDE, Array, about, ends, lifted, superellipse
from artsim.making.solids import Solid, box, cylinder, deferred, frame, hull, hull_of, loft, ring, rod, tube, union

GAP = 0.0005


def build(draws: Draws) -> Assembly:
    """A lighter that stands upright; what one presses or opens is towards -X at its top."""
    makers = {"pocket": _pocket, "disposable": _disposable, "long": _long, "table": _table}
    return draws.one_of("kind", makers, (0.36, 0.3, 0.22, 0.12))(draws)


@deferred
def _spark_wheel(center: Array, radius: float, half: float, notched: bool) -> Solid:
    """A wheel about the Y axis, with a few teeth."""
    wheel = cylinder(center - half * SIDE, center + half * SIDE, radius, sections=18)
    if notched:
        tooth = box(1.04 * radius, 0.9 * half, 0.12 * radius)
        wheel += union(tooth.turned(SIDE, np.pi * k / 6).moved(center) for k in range(6))
    return wheel


def _outline(draws: Draws, half_x: float, half_y: float) -> Array:
    """(N, 2) cross-section: oval, rounded rectangle or with a round front."""
    round_, square = draws.number("round_section", (2.2, 4.0)), draws.number("square_section", (5.0, 12.0))
    return superellipse(draws.one_of("section", {"oval": 2.0, "round": round_, "square": square}), half_x, half_y, 20)


def _layers(outline: Array, levels: list[tuple[float, float]]) -> Solid:
    """Loft of one outline, scaled, at several heights."""
    return loft([lifted(scale * outline, z) for scale, z in levels])


def _axle(center: Array, size: float, near: float, thick: float, base: float) -> Solid:
    """Two cheeks, on what ends just above ``base``, that hold a wheel about the Y axis."""
    x, _, z = center
    return cheeks((x, z), size, near, near + thick, (x - size, x + size), (base, base + 0.001))


def _pocket(draws: Draws) -> Assembly:
    """A case with a lid that swings over the chimney; the hinge is behind, at +X."""
    half_x = 0.5 * draws.length("depth", (0.026, 0.06))
    half_y = max(half_x * draws.number("width", (0.25, 0.6)), 0.0055)
    height, lid_tall, wall = draws.lengths(height=(0.03, 0.055), lid_height=(0.014, 0.03), wall=(0.0008, 0.0014))
    corner = draws.number("rounding", (0.1, 0.95)) * half_y
    body = box(half_x, half_y, (0, height), fillet=corner, axis=2)
    if draws.chance("foot", 0.5):  # bevelled
        body += box(0.93 * half_x, 0.9 * half_y, (-0.002, 0.001), fillet=corner, axis=2)
    # Insert: a chimney with the wick, and the wheel before it.
    room_y, top = half_y - wall - 2 * GAP, height + lid_tall - wall - 2 * GAP
    radius = min(draws.length("wheel_radius", (0.003, 0.0045)), 0.28 * lid_tall, 0.22 * half_x)
    wheel_half = 0.45 * room_y
    center = np.array([-0.45 * half_x, 0.0, min(height + 0.35 * lid_tall + radius, top - 1.1 * radius)])
    chimney_high = height + (lid_tall - wall) * draws.number("chimney_height", (0.5, 0.85))
    x0, x1 = center[0] + 1.25 * radius, 0.55 * half_x
    body += frame((x0, -0.85 * room_y, height - 0.001), (x1, 0.85 * room_y, chimney_high), [wall] * 4, 0, 1)
    body += rod((x0 + x1) / 2, 0, (height - 0.001, chimney_high - 0.003), 0.25 * room_y, sections=10)
    body += _axle(center, 0.7 * radius, wheel_half + GAP, 0.3 * room_y, height - 0.001)
    hinge_x, knuckle = half_x + 0.0012, 0.0012
    low, high = height + GAP, height + lid_tall
    body += rod(hinge_x, (-0.5 * half_y, 0.5 * half_y), height, 0.8 * knuckle, sections=10)
    body += box((half_x - 0.001, hinge_x), 0.45 * half_y, (height - 0.004, height - 0.0001))
    lighter = Assembly("body", body, 4000.0)
    # The lid is a cap with walls, open at the bottom.
    dome = draws.number("dome", (0.0, 0.4)) * lid_tall if draws.chance("domed", 0.4) else 0.0
    lid = Solid()
    outline = box(half_x, half_y, (0, 1), fillet=corner, axis=2).union()[0]
    plan = outline[outline[:, 2] > 0.5][:, :2]
    plan = plan[np.argsort(arctan2(plan[:, 1], plan[:, 0]))]
    inside = plan * (1.0 - wall / half_x, 1.0 - wall / half_y)
    for k in range(len(plan)):
        lid += hull([np.append(o[k - j], z) for o in (plan, inside) for j in (0, 1) for z in (low, high - wall)])
    lid += loft([lifted(plan, high - wall - 0.0002), lifted(plan * (0.85 if dome else 0.97), high + dome)])
    for side in (-1, 1):
        y = ends((side * 0.53 * half_y, side * 0.85 * half_y))
        lid += rod(hinge_x, y, height, knuckle, sections=10) + box((half_x - 0.0005, hinge_x), y, (low, low + 0.004))
    limit = draws.angle("lid_angle", (1.6, 2.6))
    lighter.add("lid", lid, revolute("body", (0, 1, 0), (hinge_x, 0, height), 0.0, limit), density=7000.0)
    if draws.chance("wheel", 0.85):
        wheel = _spark_wheel(center, radius, wheel_half, True)
        lighter.add("wheel", wheel, continuous("body", (0, 1, 0), center), density=7000.0)
    return lighter


def _disposable(draws: Draws) -> Assembly:
    """A tank with a metal hood, a wheel and a lever or button under the thumb."""
    half_x, half_y = 0.5 * draws.length("depth", (0.018, 0.034)), 0.5 * draws.length("width", (0.01, 0.017))
    height = draws.length("height", (0.045, 0.085))
    outline = _outline(draws, half_x, half_y)
    waist = draws.number("waist", (0.85, 1.1))
    body = _layers(outline, [(0.95, 0.0), (1.0, 0.002), (waist, 0.5 * height), (1.0, height)])
    hood_tall = draws.length("hood_height", (0.009, 0.018))
    back, front = 0.95 * half_x, -0.1 * half_x
    thin = 0.0008
    side, base = 0.86 * half_y, height - 0.001
    radius = draws.number("wheel_size", (0.3, 0.45)) * hood_tall
    wheel_half = side - thin - 3 * GAP - 0.0008
    electric = draws.chance("electric", 0.35)  # a button instead of wheel and lever
    hood = box((front + 0.15 * half_x, back * 0.96), (-side, -side + thin), (base, height + hood_tall))
    hood += hood.mirrored(1)
    hood += box((back * 0.8, back * 0.96), side, (base, height + hood_tall * draws.number("hood_back", (0.6, 1.0))))
    body += hood + rod(0.5 * half_x, 0, (base, height + 0.55 * hood_tall), 0.002, sections=10)
    lighter = Assembly("body", body, 1100.0)
    if electric:
        travel = draws.length("button_travel", (0.003, 0.006))
        top = height + hood_tall * draws.number("button_rise", (0.7, 1.3)) + travel
        x0, x1 = -0.85 * half_x, front + 0.1 * half_x - 0.001
        low, wide = height + travel + GAP, 0.6 * half_y
        button = hull_of(
            box((x0, x1), wide, (low, low + 0.001)),
            box((x0 + draws.number("button_slope", (0, 0.3)) * half_x, x1), wide, (top - 0.003, top), fillet=0.001),
        )
        lighter.add("button", button, prismatic("body", (0, 0, -1), 0.0, travel, (0.5 * (x0 + x1), 0, top)))
        return lighter
    center = np.array([front - 0.15 * half_x - 0.001, 0.0, height + hood_tall - 0.35 * radius])
    lighter.body += _axle(center, 0.5 * radius, wheel_half + GAP, 0.0008, base)
    discs = draws.chance("wheel_discs", 0.6)  # toothed discs at either side of a narrower wheel
    wheel = _spark_wheel(center, radius * (0.85 if discs else 1.0), wheel_half, not discs)
    if discs:
        for s in (-1, 1):
            a, b = center + (0, s * 0.5 * wheel_half, 0), center + (0, s * wheel_half, 0)
            wheel += cylinder(a, b, radius, sections=16)
    lighter.add("wheel", wheel, continuous("body", (0, 1, 0), center), density=4000.0)
    # The lever lies before the wheel, below the thumb.
    under = center[2] - radius - 2 * GAP
    end = center[0] - radius * 1.04 - GAP
    reach = -half_x - draws.number("lever_reach", (0.0, 0.35)) * half_x
    if under - height < 0.0025 or end - reach < 0.004:
        return lighter
    thick, slides = draws.length("lever_thickness", (0.0012, 0.002)), draws.chance("lever_slides", 0.5)
    travel = 0.5 * (under - height - thick)
    wide, low = 0.8 * half_y, height + travel + GAP if slides else under - thick - GAP
    lever = box((reach, end), wide, (low, low + thick), fillet=0.0005)
    if slides:
        lever += box((reach, 0.5 * (reach + end)), wide, (low, min(low + 2 * thick, center[2])), fillet=0.0005)
        joint = prismatic("body", (0, 0, -1), 0.0, travel, (reach, 0, low))
    else:
        turn = 0.8 * float(arctan2(low - height - GAP, end - reach))
        joint = revolute("body", (0, -1, 0), (end, 0, low + 0.5 * thick), 0.0, max(turn, 0.03))
    lighter.add("lever", lever, joint)
    return lighter


def _long(draws: Draws) -> Assembly:
    """A handle with a trigger and a long nozzle that points up; it may be bent."""
    handle, nozzle = draws.lengths(handle_length=(0.08, 0.14), nozzle_length=(0.06, 0.2))
    half_x, half_y = 0.5 * draws.length("depth", (0.02, 0.04)), 0.5 * draws.length("width", (0.012, 0.022))
    outline = _outline(draws, half_x, half_y)
    waist = draws.number("waist", (0.75, 1.1))
    slot_low = 0.55 * handle
    slot_high = slot_low + min(draws.length("trigger_height", (0.02, 0.034)), 0.35 * handle)
    depth = draws.number("trigger_depth", (0.4, 0.7)) * half_x
    body = _layers(outline, [(0.8, 0.0), (1.0, 0.1 * handle), (waist, 0.35 * handle), (1.0, slot_low)])
    neck = draws.number("neck", (0.5, 0.9))
    body += _layers(outline, [(1.0, slot_high), (neck, handle)])
    body += box((-half_x + depth + 0.004, 0.9 * half_x), 0.55 * half_y, (slot_low - 0.001, slot_high + 0.001))
    guard, out = draws.chance("guard", 0.4), draws.length("trigger_reach", (0.004, 0.01))
    if guard:
        low, high = (-half_x - out - 0.008, 0, slot_low - 0.002), (-half_x - out - 0.01, 0, slot_high + 0.002)
        bow = [(-0.8 * half_x, 0, slot_low - 0.006), low, high, (-0.75 * half_x, 0, slot_high + 0.01)]
        body += tube(bow, 0.002, 10)
    radius = min(neck * half_x, neck * half_y, draws.length("nozzle_radius", (0.0035, 0.006)))
    lean = draws.one_of("nozzle", {"straight": 0.0, "bent": draws.angle("nozzle_bend", (0.0, 0.5))})
    mouth = [-0.7 * nozzle * sin(lean), 0, handle + (0.3 + 0.7 * cos(lean)) * nozzle]
    path = np.array([[0, 0, slot_high + 0.002], [0, 0, handle + 0.3 * nozzle], mouth])
    tip = path[2] - path[1]
    body += tube(path, radius, 14) + cylinder(path[2] - 0.1 * tip, path[2] + 0.02 * tip, 1.25 * radius, sections=14)
    if draws.chance("ring", 0.3):  # to hang it up
        body += ring((0, 0, -0.006), (0, 1, 0), 0.004, 0.0065, 0.003, 16)
    lighter = Assembly("body", body, 1100.0)
    wide = 0.5 * half_y
    travel = min(depth * 0.5, out * 0.9)
    z0, z1 = slot_low + GAP, slot_high - GAP
    if draws.chance("trigger_slides", 0.55):
        trigger = box((-half_x - 0.2 * out, -half_x + depth - travel), wide, (z0, z1))
        upper = z1 - draws.number("trigger_slope", (0, 0.3)) * (z1 - z0)
        trigger += hull_of(
            box((-half_x, -half_x + 0.001), wide, (z0, z1)),
            box((-half_x - out, -half_x), wide, (z0 + 0.3 * (z1 - z0), upper)),
        )
        joint = prismatic("body", (1, 0, 0), 0.0, travel, (-half_x - out, 0, 0.5 * (z0 + z1)))
    else:
        pivot = np.array([-half_x + 0.35 * depth, 0.0, z1 - 0.003])
        long = z1 - z0 - 0.004
        trigger = cylinder(pivot - (0, wide, 0), pivot + (0, wide, 0), 0.0024, sections=12)
        trigger += hull_of(
            box(pivot - (0.0024, wide, 0.001), pivot + (0.001, wide, 0)),
            box((-half_x - out, -half_x - out + 0.004), wide, (z0 + 0.0015, z0 + 0.3 * long)),
        )
        joint = revolute("body", (0, -1, 0), pivot, 0.0, max(min(0.7 * travel / long, 0.5), 0.05))
    lighter.add("trigger", trigger, joint)
    if draws.chance("switch", 0.55):  # a safety catch on the back, which slides
        z = 0.3 * handle
        if handle - slot_high > 0.026:
            z = draws.length("switch_height", (slot_high + 0.01, handle - 0.012))
        share = float(np.interp(z, [0.1 * handle, 0.35 * handle, slot_low, slot_high, handle], [1, waist, 1, 1, neck]))
        x = max(share, 0.0) * half_x + 0.0025
        catch = box((x, x + 0.003), 0.4 * half_y, (z - 0.004, z + 0.004), fillet=0.001)
        lighter.add("switch", catch, prismatic("body", (0, 0, 1), 0.0, 0.005, (x, 0, z)))
    return lighter


def _table(draws: Draws) -> Assembly:
    """A torch or a table lighter: a stout body with a button on top and sometimes a flap over the flame."""
    half_x, half_y = 0.5 * draws.length("depth", (0.024, 0.056)), 0.5 * draws.length("width", (0.02, 0.048))
    height = draws.length("height", (0.03, 0.1))
    outline = _outline(draws, half_x, half_y)
    foot, waist = draws.number("foot_width", (0.85, 1.35)), draws.number("waist", (0.75, 1.0))
    body = _layers(outline, [(foot, 0.0), (foot, 0.004), (waist, 0.3 * height), (1.0, height)])
    flap_tall = draws.length("lid_height", (0.005, 0.012))
    split = draws.number("button_end", (-0.25, 0.15)) * half_x
    travel = draws.length("button_travel", (0.003, 0.006))
    lighter = Assembly("body", body, 2500.0)
    wide, hinge_x = 0.75 * half_y, 0.78 * half_x
    flame = 0.5 * (split + hinge_x)
    burner = min(0.22 * half_y, 0.5 * (hinge_x - split) - 0.0035)  # before the flap's tongue
    lighter.body += rod(flame, 0, (height - 0.001, height + 0.5 * flap_tall), burner, sections=12)
    low = height + travel + GAP
    top = low + draws.length("button_height", (0.004, 0.014))
    fillet = draws.length("button_rounding", (0.001, 0.004))
    button = box((-0.8 * half_x, split - 2 * GAP - 0.001), 0.7 * wide, (low, top), fillet=fillet)
    thin = 0.0012
    if draws.chance("lid", 0.7):
        at = height + 0.0016
        deep, upright = about(hinge_x, 0.0012), (height - 0.001, at - 0.0004)
        lighter.body += union(box(deep, about(s * 0.5 * wide, 0.0015), upright) for s in (-1, 1))
        base = at + GAP
        flap = frame((split, -wide, base), (hinge_x - 0.0015, wide, base + flap_tall), [thin] * 4, 0, 1)
        flap += box((split, hinge_x - 0.0015), wide, (base + flap_tall - thin, base + flap_tall))
        flap += box((hinge_x - 0.003, hinge_x + 0.001), 0.3 * wide, (base, base + 0.5 * flap_tall))
        limit = draws.angle("lid_angle", (1.2, 1.9))
        lighter.add("lid", flap, revolute("body", (0, 1, 0), (hinge_x + 0.001, 0, at + GAP), 0.0, limit))
    else:
        lighter.body += frame((split, -wide, height - 0.001), (hinge_x, wide, height + flap_tall), [thin] * 4, 0, 1)
    lighter.add("button", button, prismatic("body", (0, 0, -1), 0.0, travel, (-0.4 * half_x, 0, top)), density=1500.0)
    if draws.chance("dial", 0.35):  # a wheel below for the gas
        radius = 0.4 * half_y
        wheel = rod(0, 0, (-0.003 - GAP, -GAP), radius, 0.9 * radius, 16)
        lighter.add("dial", wheel, continuous("body", (0, 0, 1), (0, 0, 0)), density=1500.0)
    return lighter
