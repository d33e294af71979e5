"""Carts: shopping carts, hand trucks, platform and service trolleys, wheelbarrows, wagons, hand carts.

What varies: the kind, the proportions, baskets of bars or of one piece, wheels (spokes, tread, size), which of them
hang in casters that swivel, handles that fold, slide out or are fixed, a flap, a toe plate that folds up, shelves,
drawers and doors, an axle that steers with a drawbar, a tailgate. One to fourteen parts move.
"""

import numpy as np

from artsim.families.details import front_handle, side_hinge
from artsim.families.shopping_carts import shopping_cart
from artsim.families.wagons import hand_cart, wagon
from artsim.families.wheels import GAP, STEEL, Wheels, bar
from artsim.making.assembly import Assembly, Rng, pick, prismatic, revolute
from artsim.making.outlines import UP, about, arch
from artsim.making.solids import Solid, box, hull_of, posts, rod, tray, tube, union


def build(rng: Rng) -> Assembly:
    """A cart that moves towards -X; whoever pushes it stands at +X. Everything is folded out and shut at rest."""
    kinds = {shopping_cart: 0.2, _platform_trolley: 0.15, _hand_truck: 0.16, _service_trolley: 0.2, _wheelbarrow: 0.09,
             wagon: 0.1, hand_cart: 0.1}  # fmt: skip
    return pick(rng, kinds)(rng)


def _platform_trolley(rng: Rng) -> Assembly:
    """A deck on four wheels with a handle at the back that folds down, or two fixed ones."""
    length, half = rng.uniform(0.55, 1.2), rng.uniform(0.2, 0.38)
    wheels = Wheels(rng, min(rng.uniform(0.035, 0.075), 0.3 * (half - 0.04)), rng.uniform(0.02, 0.035))
    floor = wheels.caster_height + 0.006
    thick = rng.uniform(0.02, 0.05)
    top = floor + thick
    body = box(0.5 * length, half, (floor, top), fillet=rng.uniform(0.01, 0.06), axis=2)
    if rng.random() < 0.5:
        for y in np.linspace(-0.8, 0.8, int(rng.integers(3, 7))).tolist():
            body += box((-0.46 * length, 0.4 * length), about(y * half, 0.006), (top - 0.001, top + 0.002))
    x_front, x_back = -0.5 * length + 2.0 * wheels.radius, 0.5 * length - 2.0 * wheels.radius
    spread = half - 1.6 * wheels.radius - 0.5 * wheels.wide
    swivels = pick(rng, {2: 0.7, 4: 0.3})
    spots = [(x_back, -spread), (x_back, spread), (x_front, -spread), (x_front, spread)]
    body += union(wheels.bracket(x, y, floor + 0.004) for x, y in spots[swivels:])
    r = rng.uniform(0.01, 0.016)
    rise = rng.uniform(0.7, 0.95)
    wide = half - 2.5 * r
    x = 0.5 * length - 2.0 * r - 0.01
    folds = rng.random() < 0.75
    foot = top + 2.2 * r
    kind = pick(rng, ["bow", "ladder", "panel"])
    lift = foot if folds else top - 0.005
    bend = min(0.06, 0.4 * wide)
    handle = tube([(x, -wide, lift), (x, -wide, top + rise - bend), (x, -wide + bend, top + rise), (x, wide - bend,
                   top + rise), (x, wide, top + rise - bend), (x, wide, lift)], r, 10)  # fmt: skip
    if kind != "bow":
        for share in (0.3, 0.6) if kind == "ladder" else (0.25, 0.35, 0.45, 0.55, 0.65):
            handle += bar((x, -wide, lift + share * rise), (x, wide, lift + share * rise), 0.7 * r)
    cart = Assembly("body", body, STEEL)
    if folds:
        handle += rod(x, (-wide, wide), foot, r, sections=12)
        for s in (-1.0, 1.0):
            across = (s * (wide + r + 0.002), s * (wide + r + 0.006))
            cart.body += box((x - 1.5 * r, x + 1.5 * r), across, (top - 0.004, foot + 1.5 * r))
        limit = rng.uniform(1.2, 0.5 * np.pi)
        cart.add("handle", handle, revolute("body", (0, -1, 0), (x, 0, foot), 0.0, limit))
    else:
        cart.body += handle
        if rng.random() < 0.5:
            cart.body += handle.moved((-2.0 * x, 0, 0))
    for number, (px, py) in enumerate(spots):
        if number < swivels:
            wheels.add_caster(cart, px, py, floor)
        else:
            wheels.add(cart, (px, py, wheels.radius))
    return cart


def _hand_truck(rng: Rng) -> Assembly:
    """An upright frame on two wheels, with a toe plate in front and a handle on top."""
    wheels = Wheels(rng, rng.uniform(0.07, 0.14), rng.uniform(0.03, 0.06))
    half, height = rng.uniform(0.15, 0.25), rng.uniform(0.7, 1.25)
    r = rng.uniform(0.01, 0.016)
    x = 0.0
    slides = rng.random() < 0.45
    shape = pick(rng, ["bow", "bar", "grips"])
    body = union(tube([(x, s * half, 0.02), (x, s * half, height)], r, 10) for s in (-1.0, 1.0))
    for share in np.linspace(0.08, 0.95 if slides else 0.75, int(rng.integers(3, 6))).tolist():
        z = share * height
        bulge = rng.choice([0.0, 0.03])
        body += tube(
            [(x, -half, z), (x + bulge, -0.4 * half, z), (x + bulge, 0.4 * half, z), (x, half, z)], 0.75 * r, 8
        )
    if rng.random() < 0.4:
        body += box((x - 0.003, x + 0.003), 0.3 * half, (0.08 * height, 0.75 * height))
    axle_x = x + wheels.radius + r + 0.02
    inner = half - (0.0 if rng.random() < 0.5 else wheels.wide + 0.02)
    for s in (-1.0, 1.0):
        y = s * (inner - r)
        body += tube([(x, y, 0.35 * height), (axle_x, y, wheels.radius + 0.02), (axle_x, y, wheels.radius)], 0.8 * r, 8)
        body += tube([(axle_x, y, wheels.radius), (x, y, 0.06)], 0.8 * r, 8)
    body += union(bar((x, -half, z), (x, half, z), 0.8 * r) for z in (0.06, 0.35 * height))
    body += rod(axle_x, (-inner, inner), wheels.radius, 0.7 * r, sections=10)
    folding = rng.random() < 0.45
    toe_x, toe = x - r - 0.006, rng.uniform(0.12, 0.3)
    wide = half * rng.uniform(0.9, 1.3)
    plate = box((toe_x - toe, toe_x if folding else x + r), wide, (0.0, 0.006), fillet=0.02, axis=2)
    top = _truck_handle(rng, shape, x, half, height, r, slides)
    if not folding:
        body += plate + box((x - r, x + r), wide, (0.0, 0.03))
    if not slides:
        body += top
    cart = Assembly("body", body, STEEL)
    if folding:
        plate += rod(toe_x, (-0.7 * half, 0.7 * half), 0.006, 0.0058, sections=12)
        turn = revolute("body", (0, 1, 0), (toe_x, 0, 0.006), 0.0, rng.uniform(1.2, 0.5 * np.pi))
        cart.add("toe_plate", plate, turn, label="plate")
    for s in (-1.0, 1.0):
        wheels.add(cart, (axle_x, s * (inner + 0.5 * wheels.wide + r), wheels.radius))
    if slides:
        cart.add("handle", top, prismatic("body", UP, 0.0, rng.uniform(0.15, 0.4) * height, (x, 0, height)))
    return cart


def _truck_handle(rng: Rng, shape: str, x: float, half: float, height: float, r: float, slides: bool) -> Solid:
    """What the hands hold; one that slides has two legs before the frame."""
    rise = rng.uniform(0.1, 0.3)
    low, y, front = height - 0.005, half, x
    if slides:
        low, y, front = 0.35 * height, 0.72 * half, x - 2.2 * r - 0.75 * r
    top = height + rise
    legs = union(tube([(front, s * y, low), (front, s * y, top - 0.03)], r, 8) for s in (-1.0, 1.0))
    if shape == "bow":
        return legs + tube([(front, u, top - 0.03 + v) for u, v in arch(y, 0.7 * y, 9)], r, 8)
    if shape == "bar":
        return legs + rod(front, (-1.15 * y, 1.15 * y), top - 0.03, 1.4 * r, sections=12)
    grips = union(tube([(front, s * y, top - 0.035), (front + 0.02, s * y, top), (front + 0.14, s * y, top + 0.02)],
                       1.2 * r, 8) for s in (-1.0, 1.0))  # fmt: skip
    return legs + grips + bar((front, -y, top - 0.06), (front, y, top - 0.06), 0.8 * r)


def _service_trolley(rng: Rng) -> Assembly:
    """Shelves between posts, or a cabinet with drawers or doors, on four casters."""
    depth, half = rng.uniform(0.17, 0.3), rng.uniform(0.2, 0.42)  # half of each
    wheels = Wheels(rng, min(rng.uniform(0.025, 0.055), 0.28 * (depth - 0.02)), rng.uniform(0.016, 0.028))
    base = wheels.caster_height + 0.004
    height = rng.uniform(0.45, 0.9)
    top = base + height
    post = rng.uniform(0.008, 0.016)
    body = Solid()
    closed = rng.random() < 0.5
    cart = Assembly("body", density=500.0)
    if closed:
        wall = rng.uniform(0.006, 0.015)
        body += tray((-depth, -half, base), (depth, half, top), wall, axis=0, side=-1)
        rows = int(rng.integers(1, 6))
        edges = np.linspace(base + wall, top - wall, rows + 1)
        face = rng.uniform(0.01, 0.018)
        doors = rows == 1 or rng.random() < 0.35  # in the top row
        kind = pick(rng, ["bar", "bow", "flat"])
        for row in range(rows):
            z0, z1 = float(edges[row]) + 0.002, float(edges[row + 1]) - 0.002
            if row < rows - 1:
                body += box((-depth, depth - 0.5 * wall), half - 0.5 * wall, (z1 + 0.0005, z1 + 0.0035))
            if doors and row == rows - 1:
                _add_doors(rng, cart, depth, half, z0, z1, face, kind)
                continue
            inner = half - wall - 0.003
            drawer = box((-depth - face, -depth - GAP), half - 0.002, (z0, z1))
            tall = max(0.75 * (z1 - z0 - 0.012), 0.01)
            drawer += tray((-depth - 0.006, -inner, z0 + 0.004), (depth - wall - 0.02, inner, z0 + 0.004 + tall), 0.005)
            span = half * rng.uniform(0.25, 0.6)
            z = 0.5 * (z0 + z1)
            drawer += front_handle(kind, (-depth - face, -span, z), (-depth - face, span, z), 0.03, 0.005)
            slide = prismatic("body", (-1, 0, 0), 0.0, 2.0 * depth * rng.uniform(0.4, 0.8), (-depth, 0, z))
            cart.add_numbered("drawer", drawer, slide)
        if rng.random() < 0.6:
            body += box(depth + 0.01, half + 0.01, (top - 0.002, top + 0.018), fillet=0.01, axis=2)
    else:
        body += posts(depth - post, half - post, (base, top), post, sections=10)
        count = int(rng.integers(2, 5))
        for z in np.linspace(base + 0.01, top - 0.06 * rng.integers(0, 2), count).tolist():
            rail = rng.choice([0.0, rng.uniform(0.02, 0.09)])
            if rail > 0:
                body += tray((-depth, -half, z - 0.008), (depth, half, z - 0.008 + rail), 0.004)
            else:
                body += box(depth, half, (z - 0.012, z), fillet=0.02, axis=2)
        body += box(depth, half, (base, base + 0.008))
    if rng.random() < 0.75:  # a handle at the pusher's side
        z = top - rng.uniform(0.0, 0.06)
        out = depth + rng.uniform(0.04, 0.09)
        r = max(0.8 * post, 0.007)
        y = 0.9 * half if closed else half - post
        body += tube([(depth - 0.01, -y, z - 0.03), (out, -y, z), (out, y, z), (depth - 0.01, y, z - 0.03)], r, 10)
    cart.body = body
    reach = 1.7 * wheels.radius
    for sx, sy in ((1, -1), (1, 1), (-1, -1), (-1, 1)):
        wheels.add_caster(cart, sx * (depth - reach), sy * (half - reach), base)
    return cart


def _add_doors(
    rng: Rng, cart: Assembly, depth: float, half: float, z0: float, z1: float, face: float, kind: str
) -> None:
    """One or two doors before a compartment."""
    two = rng.random() < 0.6
    x = -depth - face
    limit = rng.uniform(1.2, 1.9)
    leaves = (
        [(0.001, half - 0.002, True), (-half + 0.002, -0.001, False)] if two else [(-half + 0.002, half - 0.002, True)]
    )
    for y0, y1, left in leaves:
        leaf = box((x, -depth - GAP), (y0, y1), (z0, z1))
        y = y0 + 0.03 if left else y1 - 0.03
        middle, span = 0.5 * (z0 + z1), 0.2 * (z1 - z0)
        leaf += front_handle(kind, (x, y, middle - span), (x, y, middle + span), 0.03, 0.005)
        cart.add_numbered("door", leaf, side_hinge(x, y1 if left else y0, limit, left))


def _wheelbarrow(rng: Rng) -> Assembly:
    """A tray between two long shafts, one or two wheels in front, two legs."""
    wheels = Wheels(rng, rng.uniform(0.13, 0.2), rng.uniform(0.05, 0.09))
    half, length = rng.uniform(0.24, 0.36), rng.uniform(0.55, 0.85)
    low = wheels.radius + rng.uniform(0.02, 0.1)
    deep = rng.uniform(0.15, 0.32)
    flare = rng.uniform(0.05, 0.16)
    thick = 0.005
    x0, x1 = 0.0, length
    floor = [(x0 + flare, -half + flare), (x0 + flare, half - flare), (x1 - 0.6 * flare, half - flare),
             (x1 - 0.6 * flare, -half + flare)]  # fmt: skip
    front, _ = x0 - rng.uniform(0.0, 0.15), rng.uniform(0.0, 0.15)
    rim = [(front, -0.85 * half), (front, 0.85 * half), (x1, half), (x1, -half)]
    corners = [[np.array([*p, low]) for p in floor], [np.array([*p, low + deep]) for p in rim]]
    body = hull_of(*(box(p - thick, p + thick) for p in corners[0]))
    for k in range(4):
        body += hull_of(*(box(p - thick, p + thick) for p in (corners[0][k - 1], corners[0][k], corners[1][k - 1],
                                                              corners[1][k])))  # fmt: skip
    body += tube(np.array(corners[1]), 0.012, 8, closed=True)
    r = rng.uniform(0.014, 0.02)
    twin = rng.random() < 0.25
    # The wheel stands clear of the front wall, which leans forward.
    levels = np.linspace(low, 2.0 * wheels.radius, 12)
    wall = x0 + flare + (front - x0 - flare) * (levels - low) / deep
    chord = np.sqrt(np.maximum(levels * (2.0 * wheels.radius - levels), 0.0))
    axle_x = min(float((wall - chord).min()) - 0.03, x0) - rng.uniform(0.0, 0.1)
    track = (1.0 if twin else 0.5) * wheels.wide + r + 2.0 * GAP
    reach, grip = x1 + rng.uniform(0.4, 0.6), low + rng.uniform(0.0, 0.25)
    under = low - thick - 0.8 * r
    for s in (-1.0, 1.0):
        start = (axle_x, s * track, wheels.radius)
        path = [
            start,
            (x0 + flare + 0.05, s * (half - flare) * 0.7, under),
            (x1 - 0.6 * flare, s * (half - flare), under),
            (reach, s * 0.95 * half, grip),
        ]
        body += tube(path, r, 10)
        body += tube([path[3], (reach + 0.1, s * 0.95 * half, grip)], 1.25 * r, 10)
        leg = 0.55 * (x0 + x1) + 0.1
        upper = (leg - 0.05, s * 0.75 * (half - flare), under), (x1 - 0.4 * flare, s * 0.85 * half, under)
        body += tube([upper[0], (leg, s * 0.8 * half, r), (leg + 0.08, s * 0.8 * half, r), upper[1]], r, 8)
    spots = [0.0]
    if twin:
        spots = [s * 0.5 * (wheels.wide + GAP) for s in (-1.0, 1.0)]
    cart = Assembly("body", body, STEEL)
    for y in spots:
        wheels.add(cart, (axle_x, y, wheels.radius))
    return cart
