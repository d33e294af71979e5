"""Carts: shopping carts, hand trucks, platform and service trolleys, wheelbarrows, wagons, hand carts.

What varies: the kind, the proportions, baskets of bars or of one piece, wheels (spokes, tread, size), which of them
hang in casters that swivel, handles that fold, slide out or are fixed, a flap, a toe plate that folds up, shelves,
drawers and doors, an axle that steers with a drawbar, a tailgate. One to fourteen parts move.
"""

import numpy as np

from artsim.families.details import front_handle, side_hinge
from artsim.families.wagons import hand_cart, wagon
from artsim.families.wheels import GAP, STEEL, Wheels, bar, slab
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.draws import Draws, Interval
from artsim.making.outlines import FRONT, SIDE, UP, Array, about, arch
from artsim.making.solids import Solid, box, posts, rod, tray, tube, union


def build(draws: Draws) -> Assembly:
    """A cart that moves towards -X; whoever pushes it stands at +X. Everything is folded out and shut at rest."""
    makers = {"shopping_cart": _shopping_cart, "platform_trolley": _platform_trolley, "hand_truck": _hand_truck,
              "service_trolley": _service_trolley, "wheelbarrow": _wheelbarrow, "wagon": wagon,
              "hand_cart": hand_cart}  # fmt: skip
    return draws.one_of("kind", makers, (0.2, 0.15, 0.16, 0.2, 0.09, 0.1, 0.1))(draws)


def _platform_trolley(draws: Draws) -> Assembly:
    """A deck on four wheels with a handle at the back that folds down, or two fixed ones."""
    length, half = draws.length("depth", (0.55, 1.2)), 0.5 * draws.length("width", (0.4, 0.76))
    wheels = Wheels(draws, (0.035, 0.075), (0.02, 0.035), 0.3 * (half - 0.04))
    floor = wheels.caster_height + 0.006
    top = floor + draws.length("deck_thickness", (0.02, 0.05))
    body = box(0.5 * length, half, (floor, top), fillet=draws.length("deck_corner", (0.01, 0.06)), axis=2)
    if draws.chance("tread", 0.5):
        for y in np.linspace(-0.8, 0.8, draws.integer("treads", 3, 6)).tolist():
            body += box((-0.46 * length, 0.4 * length), about(y * half, 0.006), (top - 0.001, top + 0.002))
    x_front, x_back = -0.5 * length + 2.0 * wheels.radius, 0.5 * length - 2.0 * wheels.radius
    spread = half - 1.6 * wheels.radius - 0.5 * wheels.wide
    swivels = draws.pick("casters", {2: 0.7, 4: 0.3})
    spots = [(x_back, -spread), (x_back, spread), (x_front, -spread), (x_front, spread)]
    cart = Assembly("body", body, STEEL)
    cart.body += wheels.brackets(spots[swivels:], floor + 0.004)
    r, rise = draws.lengths(handle_radius=(0.01, 0.016), handle_height=(0.7, 0.95))
    wide = half - 2.5 * r
    x = 0.5 * length - 2.0 * r - 0.01
    folds = draws.chance("handle_folds", 0.75)
    foot = top + 2.2 * r
    kind = draws.pick("handle", ["bow", "ladder", "panel"])
    lift = foot if folds else top - 0.005
    bend = min(0.06, 0.4 * wide)
    handle = tube([(x, -wide, lift), (x, -wide, top + rise - bend), (x, -wide + bend, top + rise), (x, wide - bend,
                   top + rise), (x, wide, top + rise - bend), (x, wide, lift)], r, 10)  # fmt: skip
    if kind != "bow":
        for share in (0.3, 0.6) if kind == "ladder" else (0.25, 0.35, 0.45, 0.55, 0.65):
            handle += bar((x, -wide, lift + share * rise), (x, wide, lift + share * rise), 0.7 * r)
    if folds:
        handle += rod(x, (-wide, wide), foot, r, sections=12)
        for s in (-1.0, 1.0):
            across = (s * (wide + r + 0.002), s * (wide + r + 0.006))
            cart.body += box(about(x, 1.5 * r), across, (top - 0.004, foot + 1.5 * r))
        limit = draws.angle("handle_angle", (1.2, 0.5 * np.pi))
        cart.add("handle", handle, revolute("body", (0, -1, 0), (x, 0, foot), 0.0, limit))
    else:
        cart.body += handle.called("handle", -FRONT)
        if draws.chance("two_handles", 0.5):
            cart.body += handle.called("handle", FRONT).moved((-2.0 * x, 0, 0))
    wheels.add_under(cart, spots, swivels, floor)
    return cart


def _hand_truck(draws: Draws) -> Assembly:
    """An upright frame on two wheels, with a toe plate in front and a handle on top."""
    wheels = Wheels(draws, (0.07, 0.14), (0.03, 0.06))
    half, height = 0.5 * draws.length("width", (0.3, 0.5)), draws.length("height", (0.7, 1.25))
    r, slides = draws.length("tube_radius", (0.01, 0.016)), draws.chance("handle_slides", 0.45)
    shape = draws.pick("handle", ["bow", "bar", "grips"])
    body = union(tube([(0.0, s * half, 0.02), (0.0, s * half, height)], r, 10) for s in (-1.0, 1.0))
    for share in np.linspace(0.08, 0.95 if slides else 0.75, draws.integer("crossbars", 3, 5)).tolist():
        z = share * height
        bulge = draws.one_of("crossbar_shape", {"straight": 0.0, "bowed": 0.03})
        body += tube([(0.0, -half, z), (bulge, -0.4 * half, z), (bulge, 0.4 * half, z), (0.0, half, z)], 0.75 * r, 8)
    if draws.chance("back_plate", 0.4):
        body += box(0.003, 0.3 * half, (0.08 * height, 0.75 * height))
    x = wheels.radius + r + 0.02
    inner = half - (0.0 if draws.chance("wheels_outside", 0.5) else wheels.wide + 0.02)
    for s in (-1.0, 1.0):
        y = s * (inner - r)
        body += tube([(0.0, y, 0.35 * height), (x, y, wheels.radius + 0.02), (x, y, wheels.radius)], 0.8 * r, 8)
        body += tube([(x, y, wheels.radius), (0.0, y, 0.06)], 0.8 * r, 8)
    body += union(bar((0.0, -half, z), (0.0, half, z), 0.8 * r) for z in (0.06, 0.35 * height))
    body += rod(x, (-inner, inner), wheels.radius, 0.7 * r, sections=10)
    folding = draws.chance("toe_plate_folds", 0.45)
    toe_x, toe = -r - 0.006, draws.length("toe_plate_depth", (0.12, 0.3))
    wide = half * draws.number("toe_plate_width", (0.9, 1.3))
    plate = box((toe_x - toe, toe_x if folding else r), wide, (0.0, 0.006), fillet=0.02, axis=2)
    top = _truck_handle(draws, shape, half, height, r, slides)
    if not folding:
        body += plate + box(r, wide, (0.0, 0.03))
    if not slides:
        body += top.called("handle", -FRONT)
    cart = Assembly("body", body, STEEL)
    if folding:
        plate += rod(toe_x, (-0.7 * half, 0.7 * half), 0.006, 0.0058, sections=12)
        turn = revolute("body", SIDE, (toe_x, 0, 0.006), 0.0, draws.angle("toe_plate_angle", (1.2, 0.5 * np.pi)))
        cart.add("toe_plate", plate, turn, label="plate")
    for s in (-1.0, 1.0):
        wheels.add(cart, (x, s * (inner + 0.5 * wheels.wide + r), wheels.radius))
    if slides:
        travel = draws.number("handle_travel", (0.15, 0.4)) * height
        cart.add("handle", top, prismatic("body", UP, 0.0, travel, (0.0, 0, height)))
    return cart


def _truck_handle(draws: Draws, shape: str, half: float, height: float, r: float, slides: bool) -> Solid:
    """What the hands hold; one that slides has two legs before the frame."""
    rise = draws.length("handle_rise", (0.1, 0.3))
    low, y, front = height - 0.005, half, 0.0
    if slides:
        low, y, front = 0.35 * height, 0.72 * half, -2.2 * r - 0.75 * r
    top = height + rise
    legs = union(tube([(front, s * y, low), (front, s * y, top - 0.03)], r, 8) for s in (-1.0, 1.0))
    if shape == "bow":
        return legs + tube([(front, u, top - 0.03 + v) for u, v in arch(y, 0.7 * y, 9)], r, 8)
    if shape == "bar":
        return legs + rod(front, (-1.15 * y, 1.15 * y), top - 0.03, 1.4 * r, sections=12)
    grips = union(tube([(front, s * y, top - 0.035), (front + 0.02, s * y, top), (front + 0.14, s * y, top + 0.02)],
                       1.2 * r, 8) for s in (-1.0, 1.0))  # fmt: skip
    return legs + grips + bar((front, -y, top - 0.06), (front, y, top - 0.06), 0.8 * r)


def _service_trolley(draws: Draws) -> Assembly:
    """Shelves between posts, or a cabinet with drawers or doors, on four casters."""
    depth, half = 0.5 * draws.length("depth", (0.34, 0.6)), 0.5 * draws.length("width", (0.4, 0.84))  # half of each
    wheels = Wheels(draws, (0.025, 0.055), (0.016, 0.028), 0.28 * (depth - 0.02))
    base = wheels.caster_height + 0.004
    top, post = base + draws.length("height", (0.45, 0.9)), draws.length("post_radius", (0.008, 0.016))
    body = Solid()
    closed = draws.chance("cabinet", 0.5)
    cart = Assembly("body", density=500.0)
    if closed:
        wall = draws.length("wall", (0.006, 0.015))
        body += tray((-depth, -half, base), (depth, half, top), wall, axis=0, side=-1)
        rows = draws.integer("rows", 1, 5)
        edges = np.linspace(base + wall, top - wall, rows + 1)
        face = draws.length("front_thickness", (0.01, 0.018))
        doors = rows == 1 or draws.chance("door", 0.35)  # in the top row
        kind = draws.pick("handle", ["bar", "bow", "flat"])
        for row in range(rows):
            z0, z1 = float(edges[row]) + 0.002, float(edges[row + 1]) - 0.002
            if row < rows - 1:
                body += box((-depth, depth - 0.5 * wall), half - 0.5 * wall, (z1 + 0.0005, z1 + 0.0035))
            if doors and row == rows - 1:
                _add_doors(draws, cart, depth, half, (z0, z1), face, kind)
                continue
            inner = half - wall - 0.003
            drawer = box((-depth - face, -depth - GAP), half - 0.002, (z0, z1))
            tall = max(0.75 * (z1 - z0 - 0.012), 0.01)
            drawer += tray((-depth - 0.006, -inner, z0 + 0.004), (depth - wall - 0.02, inner, z0 + 0.004 + tall), 0.005)
            span = half * draws.number("drawer_handle_length", (0.25, 0.6))
            z = 0.5 * (z0 + z1)
            drawer += front_handle(kind, (-depth - face, -span, z), (-depth - face, span, z), 0.03, 0.005)
            travel = 2.0 * depth * draws.number("drawer_travel", (0.4, 0.8))
            cart.add_numbered("drawer", drawer, prismatic("body", FRONT, 0.0, travel, (-depth, 0, z)))
        if draws.chance("top_board", 0.6):
            body += box(depth + 0.01, half + 0.01, (top - 0.002, top + 0.018), fillet=0.01, axis=2)
    else:
        body += posts(depth - post, half - post, (base, top), post, sections=10)
        count, lower = draws.integer("shelves", 2, 4), draws.one_of("top_shelf", {"at_the_top": 0.0, "lower": 0.06})
        for z in np.linspace(base + 0.01, top - lower, count).tolist():
            rim = draws.length("shelf_rim", (0.02, 0.09))
            if draws.pick("shelf", ["flat", "rimmed"]) == "rimmed":
                body += tray((-depth, -half, z - 0.008), (depth, half, z - 0.008 + rim), 0.004)
            else:
                body += box(depth, half, (z - 0.012, z), fillet=0.02, axis=2)
        body += box(depth, half, (base, base + 0.008))
    if draws.chance("push_handle", 0.75):  # a handle at the pusher's side
        z = top - draws.length("push_handle_drop", (0.0, 0.06))
        out = depth + draws.length("push_handle_reach", (0.04, 0.09))
        r = max(0.8 * post, 0.007)
        y = 0.9 * half if closed else half - post
        path = [(depth - 0.01, -y, z - 0.03), (out, -y, z), (out, y, z), (depth - 0.01, y, z - 0.03)]
        body += tube(path, r, 10).called("handle", -FRONT)
    cart.body = body
    reach = 1.7 * wheels.radius
    for sx, sy in ((1, -1), (1, 1), (-1, -1), (-1, 1)):
        wheels.add_caster(cart, sx * (depth - reach), sy * (half - reach), base)
    return cart


def _add_doors(draws: Draws, cart: Assembly, depth: float, half: float, z: Interval, face: float, kind: str) -> None:
    """One or two doors before a compartment."""
    leaves = [(0.001, half - 0.002, True), (-half + 0.002, -0.001, False)]
    if not draws.chance("double_doors", 0.6):
        leaves = [(-half + 0.002, half - 0.002, True)]
    x = -depth - face
    limit = draws.angle("door_angle", (1.2, 1.9))
    for y0, y1, left in leaves:
        leaf = box((x, -depth - GAP), (y0, y1), z)
        y = y0 + 0.03 if left else y1 - 0.03
        middle, span = 0.5 * (z[0] + z[1]), 0.2 * (z[1] - z[0])
        leaf += front_handle(kind, (x, y, middle - span), (x, y, middle + span), 0.03, 0.005)
        cart.add_numbered("door", leaf, side_hinge(x, y1 if left else y0, limit, left))


def _wheelbarrow(draws: Draws) -> Assembly:
    """A tray between two long shafts, one or two wheels in front, two legs."""
    wheels = Wheels(draws, (0.13, 0.2), (0.05, 0.09))
    half, length = 0.5 * draws.length("width", (0.48, 0.72)), draws.length("tray_length", (0.55, 0.85))
    low = wheels.radius + draws.length("tray_clearance", (0.02, 0.1))
    deep, flare = draws.lengths(tray_depth=(0.15, 0.32), tray_flare=(0.05, 0.16))
    thick = 0.005
    inner, back = half - flare, length - 0.6 * flare
    front = -draws.length("tray_lean", (0.0, 0.15))
    floor = [np.array([x, y, low]) for x, y in ((flare, -inner), (flare, inner), (back, inner), (back, -inner))]
    plan = ((front, -0.85 * half), (front, 0.85 * half), (length, half), (length, -half))
    rim = [np.array([x, y, low + deep]) for x, y in plan]
    body = slab(floor, thick) + union(slab([floor[k - 1], floor[k], rim[k - 1], rim[k]], thick) for k in range(4))
    body += tube(np.array(rim), 0.012, 8, closed=True)
    r, twin = draws.length("shaft_radius", (0.014, 0.02)), draws.chance("twin_wheels", 0.25)
    # The wheel stands clear of the front wall, which leans forward.
    levels = np.linspace(low, 2.0 * wheels.radius, 12)
    wall = flare + (front - flare) * (levels - low) / deep
    chord = np.sqrt(np.maximum(levels * (2.0 * wheels.radius - levels), 0.0))
    axle_x = min(float((wall - chord).min()) - 0.03, 0.0) - draws.length("axle_ahead", (0.0, 0.1))
    track = (1.0 if twin else 0.5) * wheels.wide + r + 2.0 * GAP
    reach, grip = length + draws.length("shaft_length", (0.4, 0.6)), low + draws.length("shaft_rise", (0.0, 0.25))
    under = low - thick - 0.8 * r
    leg = 0.55 * length + 0.1
    for s in (-1.0, 1.0):
        end = (reach, s * 0.95 * half, grip)
        path = [(axle_x, s * track, wheels.radius), (flare + 0.05, s * inner * 0.7, under), (back, s * inner, under)]
        body += tube([*path, end], r, 10)
        body += tube([end, (reach + 0.1, s * 0.95 * half, grip)], 1.25 * r, 10).called("handle", -FRONT)
        path = [(leg - 0.05, s * 0.75 * inner, under), (leg, s * 0.8 * half, r), (leg + 0.08, s * 0.8 * half, r)]
        body += tube([*path, (length - 0.4 * flare, s * 0.85 * half, under)], r, 8)
    cart = Assembly("body", body, STEEL)
    for s in (-1.0, 1.0) if twin else (0.0,):
        wheels.add(cart, (axle_x, s * 0.5 * (wheels.wide + GAP), wheels.radius))
    return cart


def _shopping_cart(draws: Draws) -> Assembly:
    """A basket that narrows to the front, over a frame on four wheels."""
    length, half = draws.length("depth", (0.55, 0.95)), 0.5 * draws.length("width", (0.4, 0.64))
    narrow, track = draws.number("front_width", (0.7, 0.98)), draws.number("track", (0.75, 0.95)) * half
    # Two casters beside each other have room to swivel.
    wheels = Wheels(draws, (0.045, 0.07), (0.024, 0.036), 0.5 * narrow * track)
    low, high, lean = draws.lengths(basket_floor=(0.35, 0.55), height=(0.75, 0.95), basket_lean=(0.02, 0.14))

    # Corners of the basket: front then back, at the floor then at the rim.
    def corner(end: tuple[bool, float], up: bool) -> Array:
        front, side = end
        inset = 0.0 if up else lean
        x = inset - 0.5 * length if front else 0.5 * length - 0.3 * inset
        y = side * half * (narrow if front else 1.0) * (1.0 if up else 0.82)
        return np.array([x, y, high if up else low + (0.06 if front else 0.0)])

    ends = [(True, -1.0), (True, 1.0), (False, 1.0), (False, -1.0)]
    body = Solid()
    r = 0.004
    if draws.chance("wire_basket", 0.6):  # bars
        for up in (False, True):
            body += tube(np.array([corner(e, up) for e in ends]), 1.6 * r if up else 1.2 * r, 6, closed=True)
        for a, b in ((ends[0], ends[3]), (ends[1], ends[2]), (ends[0], ends[1]), (ends[3], ends[2])):
            for share in np.linspace(0.0, 1.0, draws.integer("wall_bars", 4, 6)).tolist():
                low_end, high_end = (corner(a, up) + share * (corner(b, up) - corner(a, up)) for up in (False, True))
                body += bar(low_end, high_end, r, 4)
            for share in np.linspace(0.0, 1.0, draws.integer("wall_rails", 3, 4))[1:-1].tolist():
                start, end = (corner(e, False) + share * (corner(e, True) - corner(e, False)) for e in (a, b))
                body += bar(start, end, r, 4)
        left, right = ([corner((front, side), False) for front in (True, False)] for side in (-1.0, 1.0))
        for share in np.linspace(0.0, 1.0, draws.integer("floor_bars", 4, 6))[1:-1].tolist():
            start, end = (a + share * (b - a) for a, b in zip(left, right, strict=True))
            body += bar(start, end, r, 4)
    else:  # one piece of plastic: each wall and the floor is a slab between its corners
        for a, b in zip(ends, [*ends[1:], ends[0]], strict=True):
            body += slab([corner(e, up) for e in (a, b) for up in (False, True)], r)
        body += slab([corner(e, False) for e in ends], r)
        body += tube(np.array([corner(e, True) for e in ends]), 0.01, 6, closed=True)
    tubes = draws.length("tube_radius", (0.01, 0.015))
    base = wheels.caster_height + tubes
    front, back = -0.42 * length, 0.46 * length
    for s in (-1.0, 1.0):
        y, foot = s * track, s * track * narrow
        path = [(front - 0.03, foot, base), (back, y, base), (0.5 * length + 0.02 - 0.04, y, base + 0.08),
                (0.5 * length - 0.3 * lean - 0.02, s * 0.8 * half, low - 0.01)]  # fmt: skip
        body += tube(path, tubes, 8)
        body += bar((front + 0.05, foot, base), (front + 0.1 + lean, s * 0.6 * half * narrow, low + 0.05), 0.8 * tubes)
    body += union(bar((x, -y, base), (x, y, base), tubes) for x, y in ((back, track), (front, track * narrow)))
    if draws.chance("rack", 0.5):
        rack = 0.7 * narrow * track
        body += union(bar((front, y, base), (back, y, base), 0.005, 4) for y in np.linspace(-rack, rack, 5).tolist())
    grip = high + draws.length("handle_rise", (0.02, 0.1))
    reach = 0.5 * length + draws.length("handle_reach", (0.06, 0.14))
    body += union(bar((0.5 * length - 0.02, s * half, high), (reach, s * half, grip), tubes) for s in (-1.0, 1.0))
    body += rod(reach, (-half - 0.02, half + 0.02), grip, 1.3 * tubes, sections=14).called("handle", -FRONT)
    spots = [(front, -track * narrow), (front, track * narrow), (back, -track), (back, track)]
    swivels = draws.pick("casters", {2: 0.6, 4: 0.4})
    body += wheels.brackets(spots[swivels:], base - 0.5 * tubes)
    seat = draws.chance("seat", 0.5)
    seat_x, hinge_z = 0.5 * length - 0.05 - 0.3 * lean, high - 0.03
    if seat:
        body += bar((seat_x, -0.97 * half, hinge_z + 0.008), (seat_x, 0.97 * half, hinge_z + 0.008), 0.005)
    cart = Assembly("body", body, STEEL)
    wheels.add_under(cart, spots, swivels, base - tubes)
    if seat:  # the flap of the child seat, inside of the back wall
        low_z = low + 0.55 * (high - low)
        flap = box((seat_x - 0.004, seat_x), 0.6 * half, (low_z, hinge_z), fillet=0.002, axis=0)
        turn = revolute("body", SIDE, (seat_x, 0, hinge_z), 0.0, draws.angle("seat_angle", (0.5, 1.3)))
        cart.add("flap", flap, turn, label="seat", density=900.0)
    return cart
