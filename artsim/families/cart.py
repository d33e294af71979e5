"""Carts: shopping carts, hand trucks, platform and service trolleys, wheelbarrows, wagons.

What varies: the kind, the proportions, baskets of bars or of one piece, wheels (spokes, tread, size), which of them hang in
casters that swivel, handles that fold, slide out or are fixed, a flap, a toe plate that folds up, shelves, drawers and
doors, an axle that steers with a drawbar. One to thirteen parts move.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from artsim.common.elementary import arctan2, cos, sin
from artsim.families.details import front_handle, rounded_tray, side_hinge
from artsim.making.assembly import Assembly, continuous, prismatic, revolute
from artsim.making.solids import Solid, Vector, box, cylinder, hull_of, ring, rounded_box, tray, tube, union
from artsim.model.kinematics import Array

GAP = 0.003
UP = np.array([0.0, 0.0, 1.0])
ROLL = np.array([0.0, -1.0, 0.0])
"""Axis of wheels: a cart that moves towards -X turns them by a positive angle."""
STEEL = 1500.0  # kg/m^3, as real tubes are hollow


def build(rng: np.random.Generator) -> Assembly:
    """A cart that moves towards -X; whoever pushes it stands at +X. Everything is folded out and shut at rest."""
    kinds: tuple[Callable[[np.random.Generator], Assembly], ...] = (
        _shopping_cart, _platform_trolley, _hand_truck, _service_trolley, _wheelbarrow, _wagon
    )  # fmt: skip
    return kinds[int(rng.choice(len(kinds), p=[0.22, 0.17, 0.17, 0.22, 0.1, 0.12]))](rng)


# --- wheels ----------------------------------------------------------------------------------------------------------


class Wheels:
    """The wheels of one cart: all of one form, numbered as they come."""

    def __init__(self, rng: np.random.Generator, radius: float, wide: float):
        self.rng, self.radius, self.wide = rng, radius, wide
        self.style = str(rng.choice(["disc", "rim", "spokes"]))
        self.spokes = int(rng.integers(3, 7))
        self.hub = radius * rng.uniform(0.2, 0.45)
        self.count = 0

    def solid(self, center: Vector) -> Solid:
        """A wheel in the plane across Y."""
        middle = np.asarray(center, dtype=np.float64)
        half = np.array([0.0, 0.5 * self.wide, 0.0])
        r = self.radius
        hub = cylinder(middle - half, middle + half, self.hub, sections=12)
        if self.style == "disc":
            tyre = cylinder(middle - 0.8 * half, middle + 0.8 * half, r, sections=20)
            return tyre + hub
        if self.style == "rim":
            web = cylinder(middle - 0.3 * half, middle + 0.3 * half, 0.85 * r, sections=16)
            return web + ring(middle, (0, 1, 0), 0.78 * r, r, 0.9 * self.wide, 16) + hub
        solid = ring(middle, (0, 1, 0), 0.8 * r, r, 0.9 * self.wide, 16) + hub
        for k in range(self.spokes):
            a = 2.0 * np.pi * k / self.spokes
            out = np.array([cos(a), 0.0, sin(a)])
            solid += tube([middle + 0.5 * self.hub * out, middle + 0.85 * r * out], 0.22 * self.wide, 4)
        return solid

    def add(self, cart: Assembly, center: Vector, parent: str = "body") -> None:
        """A wheel that turns on its axle."""
        joint = continuous(parent, ROLL, center)
        cart.add(f"wheel_{self.count}", self.solid(center), joint, density=900.0)
        self.count += 1

    def add_caster(self, cart: Assembly, x: float, y: float, top: float) -> None:
        """A fork that swivels below ``top`` about an upright axis, and a wheel in it that stands on the floor."""
        plate = 0.008
        trail = self.radius * 0.5
        axle = np.array([x + trail, y, self.radius])
        disc = top - GAP
        cheek = 0.5 * self.wide + 0.002
        fork = cylinder((x, y, disc - plate), (x, y, disc), max(0.5 * self.radius, cheek), sections=12)
        for s in (-1.0, 1.0):
            y0, y1 = sorted((y + s * cheek, y + s * (cheek + 0.003)))
            fork += hull_of(
                box((x - 0.3 * self.radius, y0, disc - plate), (x + 0.4 * self.radius, y1, disc - plate + 0.004)),
                cylinder((axle[0], y0, axle[2]), (axle[0], y1, axle[2]), 0.3 * self.radius, sections=8),
            )
            fork += box((x - 0.3 * self.radius, y0, disc - plate), (x + 0.4 * self.radius, y1, disc - 0.001))
        name = f"caster_{self.count}"
        cart.add(name, fork, continuous("body", UP, (x, y, disc)), density=STEEL)
        self.add(cart, axle, name)

    @property
    def caster_height(self) -> float:
        """What a caster needs below a floor."""
        return 2.0 * self.radius + 0.008 + 2.0 * GAP


def _bar(start: Vector, end: Vector, radius: float, sections: int = 8) -> Solid:
    return tube([start, end], radius, sections)


# --- kinds -----------------------------------------------------------------------------------------------------------


def _shopping_cart(rng: np.random.Generator) -> Assembly:
    """A basket that narrows to the front, over a frame on four wheels."""
    wheels = Wheels(rng, rng.uniform(0.045, 0.07), rng.uniform(0.024, 0.036))
    length, half = rng.uniform(0.55, 0.95), rng.uniform(0.2, 0.32)
    low, high = rng.uniform(0.35, 0.55), rng.uniform(0.75, 0.95)
    narrow = rng.uniform(0.7, 0.98)
    lean = rng.uniform(0.02, 0.14)
    # Corners of the basket: front then back, at the floor then at the rim.
    def corner(front: bool, side: float, up: bool) -> Array:
        x = (-0.5 * length - (0.0 if up else -lean)) if front else (0.5 * length - (0.0 if up else 0.3 * lean))
        y = side * half * (narrow if front else 1.0) * (1.0 if up else 0.82)
        return np.array([x, y, high if up else low + (0.06 if front else 0.0)])

    body = Solid()
    r = 0.004
    if rng.random() < 0.6:  # bars
        for up in (False, True):
            loop = [corner(True, -1, up), corner(True, 1, up), corner(False, 1, up), corner(False, -1, up)]
            body += tube(np.array(loop), 1.6 * r if up else 1.2 * r, 6, closed=True)
        sides = [((True, -1.0), (False, -1.0)), ((True, 1.0), (False, 1.0)), ((True, -1.0), (True, 1.0)),
                 ((False, -1.0), (False, 1.0))]  # fmt: skip
        for a, b in sides:
            count = int(rng.integers(4, 7))
            for share in np.linspace(0.0, 1.0, count).tolist():
                ends = [corner(*a, up) + share * (corner(*b, up) - corner(*a, up)) for up in (False, True)]
                body += _bar(ends[0], ends[1], r, 4)
            for share in np.linspace(0.0, 1.0, int(rng.integers(3, 5)))[1:-1].tolist():
                ends = [corner(*e, False) + share * (corner(*e, True) - corner(*e, False)) for e in (a, b)]
                body += _bar(ends[0], ends[1], r, 4)
        for share in np.linspace(0.0, 1.0, int(rng.integers(4, 7)))[1:-1].tolist():
            ends = [corner(f, -1.0, False) + share * (corner(f, 1.0, False) - corner(f, -1.0, False)) for f in (True, False)]
            body += _bar(ends[0], ends[1], r, 4)
    else:  # one piece of plastic: each wall and the floor is a slab between its corners
        thick = 0.004
        def slab(points: Sequence[Array]) -> Solid:
            return hull_of(*(box(p - thick, p + thick) for p in points))

        ends = [(True, -1.0), (True, 1.0), (False, 1.0), (False, -1.0)]
        for a, b in zip(ends, [*ends[1:], ends[0]], strict=True):
            body += slab([corner(*e, up) for e in (a, b) for up in (False, True)])
        body += slab([corner(*e, False) for e in ends])
        loop = np.array([corner(*e, True) for e in ends])
        body += tube(loop, 0.01, 6, closed=True)
    tubes = rng.uniform(0.01, 0.015)
    base = wheels.caster_height + tubes
    track = rng.uniform(0.75, 0.95) * half
    front, back = -0.42 * length, 0.46 * length
    for s in (-1.0, 1.0):
        y = s * track
        foot = s * track * narrow
        bend = 0.5 * length + 0.02
        path = [(front - 0.03, foot, base), (back, y, base), (bend - 0.04, y, base + 0.08),
                (0.5 * length - 0.3 * lean - 0.02, s * 0.8 * half, low - 0.01)]  # fmt: skip
        body += tube(path, tubes, 8)
        body += _bar((front + 0.05, foot, base), (front + 0.1 + lean, s * 0.6 * half * narrow, low + 0.05), 0.8 * tubes)
    body += _bar((back, -track, base), (back, track, base), tubes) + _bar((front, -track * narrow, base),
                                                                      (front, track * narrow, base), tubes)  # fmt: skip
    if rng.random() < 0.5:
        rack = 0.7 * narrow * track
        for y in np.linspace(-rack, rack, 5).tolist():
            body += _bar((front, y, base), (back, y, base), 0.005, 4)
    grip = high + rng.uniform(0.02, 0.1)
    reach = 0.5 * length + rng.uniform(0.06, 0.14)
    for s in (-1.0, 1.0):
        body += _bar((0.5 * length - 0.02, s * half, high), (reach, s * half, grip), tubes)
    body += cylinder((reach, -half - 0.02, grip), (reach, half + 0.02, grip), 1.3 * tubes, sections=14)
    cart = Assembly()
    cart.add("body", body, density=STEEL)
    swivels = rng.choice([2, 4], p=[0.6, 0.4])
    for number, (x, y) in enumerate([(front, -track * narrow), (front, track * narrow), (back, -track), (back, track)]):
        if number < swivels:
            wheels.add_caster(cart, x, y, base - tubes)
        else:
            wheels.add(cart, (x, y, wheels.radius))
    if rng.random() < 0.5:  # the flap of the child seat, inside of the back wall
        hinge_z = high - 0.03
        x = 0.5 * length - 0.02
        flap = rounded_box((x - 0.004, -0.6 * half, low + 0.55 * (high - low)), (x, 0.6 * half, hinge_z), 0.002, axis=0)
        flap = flap.moved((-0.03 - 0.3 * lean, 0, 0))
        turn = revolute("body", (0, 1, 0), (x - 0.03 - 0.3 * lean, 0, hinge_z), 0.0, rng.uniform(0.5, 1.3))
        cart.add("flap", flap, turn, label="seat", density=900.0)
    return cart


def _platform_trolley(rng: np.random.Generator) -> Assembly:
    """A deck on four wheels with a handle at the back that folds down, or two fixed ones."""
    wheels = Wheels(rng, rng.uniform(0.035, 0.075), rng.uniform(0.02, 0.035))
    length, half = rng.uniform(0.55, 1.2), rng.uniform(0.2, 0.38)
    floor = wheels.caster_height + 0.006
    thick = rng.uniform(0.02, 0.05)
    top = floor + thick
    body = rounded_box((-0.5 * length, -half, floor), (0.5 * length, half, top), rng.uniform(0.01, 0.06), axis=2)
    if rng.random() < 0.5:
        for y in np.linspace(-0.8, 0.8, int(rng.integers(3, 7))).tolist():
            body += box((-0.46 * length, y * half - 0.006, top - 0.001), (0.4 * length, y * half + 0.006, top + 0.002))
    x_front, x_back = -0.5 * length + 2.0 * wheels.radius, 0.5 * length - 2.0 * wheels.radius
    spread = half - 1.6 * wheels.radius - 0.5 * wheels.wide
    swivels = int(rng.choice([2, 4], p=[0.7, 0.3]))
    spots = [(x_back, -spread), (x_back, spread), (x_front, -spread), (x_front, spread)]
    for x, y in spots[swivels:]:
        for s in (-1.0, 1.0):
            y0, y1 = sorted((y + s * (0.5 * wheels.wide + 0.003), y + s * (0.5 * wheels.wide + 0.007)))
            body += hull_of(box((x - 0.8 * wheels.radius, y0, floor - 0.002), (x + 0.8 * wheels.radius, y1, floor + 0.004)),
                            cylinder((x, y0, wheels.radius), (x, y1, wheels.radius), 0.3 * wheels.radius, sections=10))  # fmt: skip
    r = rng.uniform(0.01, 0.016)
    rise = rng.uniform(0.7, 0.95)
    wide = half - 2.5 * r
    x = 0.5 * length - 2.0 * r - 0.01
    folds = rng.random() < 0.75
    foot = top + 2.2 * r
    kind = str(rng.choice(["bow", "ladder", "panel"]))
    lift = foot if folds else top - 0.005
    bend = min(0.06, 0.4 * wide)
    handle = tube([(x, -wide, lift), (x, -wide, top + rise - bend), (x, -wide + bend, top + rise), (x, wide - bend,
                   top + rise), (x, wide, top + rise - bend), (x, wide, lift)], r, 10)  # fmt: skip
    if kind != "bow":
        for share in ((0.3, 0.6) if kind == "ladder" else (0.25, 0.35, 0.45, 0.55, 0.65)):
            handle += _bar((x, -wide, lift + share * rise), (x, wide, lift + share * rise), 0.7 * r)
    cart = Assembly()
    if folds:
        handle += cylinder((x, -wide, foot), (x, wide, foot), r, sections=12)
        for s in (-1.0, 1.0):
            y0, y1 = sorted((s * (wide + r + 0.002), s * (wide + r + 0.006)))
            body += box((x - 1.5 * r, y0, top - 0.004), (x + 1.5 * r, y1, foot + 1.5 * r))
        cart.add("body", body, density=STEEL)
        limit = rng.uniform(1.2, 0.5 * np.pi)
        cart.add("handle", handle, revolute("body", (0, -1, 0), (x, 0, foot), 0.0, limit), density=STEEL)
    else:
        if rng.random() < 0.5:
            handle += handle.moved((-2.0 * x, 0, 0))
        cart.add("body", body + handle, density=STEEL)
    for number, (px, py) in enumerate(spots):
        if number < swivels:
            wheels.add_caster(cart, px, py, floor)
        else:
            wheels.add(cart, (px, py, wheels.radius))
    return cart


def _hand_truck(rng: np.random.Generator) -> Assembly:
    """An upright frame on two wheels, with a toe plate in front and a handle on top."""
    wheels = Wheels(rng, rng.uniform(0.07, 0.14), rng.uniform(0.03, 0.06))
    half, height = rng.uniform(0.15, 0.25), rng.uniform(0.7, 1.25)
    r = rng.uniform(0.01, 0.016)
    x = 0.0
    slides = rng.random() < 0.45
    shape = str(rng.choice(["bow", "bar", "grips"]))
    body = union(tube([(x, s * half, 0.02), (x, s * half, height)], r, 10) for s in (-1.0, 1.0))
    for share in np.linspace(0.08, 0.95 if slides else 0.75, int(rng.integers(3, 6))).tolist():
        z = share * height
        bulge = rng.choice([0.0, 0.03])
        body += tube([(x, -half, z), (x + bulge, -0.4 * half, z), (x + bulge, 0.4 * half, z), (x, half, z)], 0.75 * r, 8)
    if rng.random() < 0.4:
        body += box((x - 0.003, -0.3 * half, 0.08 * height), (x + 0.003, 0.3 * half, 0.75 * height))
    axle_x = x + wheels.radius + r + 0.02
    inner = half - (0.0 if rng.random() < 0.5 else wheels.wide + 0.02)
    for s in (-1.0, 1.0):
        y = s * (inner - r)
        body += tube([(x, y, 0.35 * height), (axle_x, y, wheels.radius + 0.02), (axle_x, y, wheels.radius)], 0.8 * r, 8)
        body += tube([(axle_x, y, wheels.radius), (x, y, 0.06)], 0.8 * r, 8)
    for z in (0.06, 0.35 * height):
        body += _bar((x, -half, z), (x, half, z), 0.8 * r)
    body += cylinder((axle_x, -inner, wheels.radius), (axle_x, inner, wheels.radius), 0.7 * r, sections=10)
    folding = rng.random() < 0.45
    toe_x, toe = x - r - 0.006, rng.uniform(0.12, 0.3)
    wide = half * rng.uniform(0.9, 1.3)
    cart = Assembly()
    plate = rounded_box((toe_x - toe, -wide, 0.0), (toe_x if folding else x + r, wide, 0.006), 0.02, axis=2)
    top = _truck_handle(rng, shape, x, half, height, r, slides)
    if not folding:
        body += plate + box((x - r, -wide, 0.0), (x + r, wide, 0.03))
    if not slides:
        body += top
    cart.add("body", body, density=STEEL)
    if folding:
        plate += cylinder((toe_x, -0.7 * half, 0.006), (toe_x, 0.7 * half, 0.006), 0.0058, sections=12)
        turn = revolute("body", (0, 1, 0), (toe_x, 0, 0.006), 0.0, rng.uniform(1.2, 0.5 * np.pi))
        cart.add("toe_plate", plate, turn, label="plate", density=STEEL)
    for s in (-1.0, 1.0):
        wheels.add(cart, (axle_x, s * (inner + 0.5 * wheels.wide + r), wheels.radius))
    if slides:
        cart.add("handle", top, prismatic("body", UP, 0.0, rng.uniform(0.15, 0.4) * height, (x, 0, height)), density=STEEL)
    return cart


def _truck_handle(
    rng: np.random.Generator, shape: str, x: float, half: float, height: float, r: float, slides: bool
) -> Solid:
    """What the hands hold; one that slides has two legs before the frame."""
    rise = rng.uniform(0.1, 0.3)
    low, y, front = height - 0.005, half, x
    if slides:
        low, y, front = 0.35 * height, 0.72 * half, x - 2.2 * r - 0.75 * r
    top = height + rise
    legs = union(tube([(front, s * y, low), (front, s * y, top - 0.03)], r, 8) for s in (-1.0, 1.0))
    if shape == "bow":
        angles = np.linspace(0.0, np.pi, 9)
        arch = [(front, y * cos(a), top - 0.03 + 0.7 * y * sin(a)) for a in angles.tolist()]
        return legs + tube(arch, r, 8)
    if shape == "bar":
        return legs + cylinder((front, -1.15 * y, top - 0.03), (front, 1.15 * y, top - 0.03), 1.4 * r, sections=12)
    grips = union(tube([(front, s * y, top - 0.035), (front + 0.02, s * y, top), (front + 0.14, s * y, top + 0.02)],
                       1.2 * r, 8) for s in (-1.0, 1.0))  # fmt: skip
    return legs + grips + _bar((front, -y, top - 0.06), (front, y, top - 0.06), 0.8 * r)


def _service_trolley(rng: np.random.Generator) -> Assembly:
    """Shelves between posts, or a cabinet with drawers or doors, on four casters."""
    wheels = Wheels(rng, rng.uniform(0.025, 0.055), rng.uniform(0.016, 0.028))
    depth, half = rng.uniform(0.17, 0.3), rng.uniform(0.2, 0.42)  # half of each
    base = wheels.caster_height + 0.004
    height = rng.uniform(0.45, 0.9)
    top = base + height
    posts = rng.uniform(0.008, 0.016)
    body = Solid()
    closed = rng.random() < 0.5
    cart = Assembly()
    moving: list[tuple[str, Solid, object]] = []
    if closed:
        wall = rng.uniform(0.006, 0.015)
        body += tray((-depth, -half, base), (depth, half, top), wall, axis=0, side=-1)
        rows = int(rng.integers(1, 6))
        edges = np.linspace(base + wall, top - wall, rows + 1)
        face = rng.uniform(0.01, 0.018)
        doors_at = rows - 1 if rows > 1 and rng.random() < 0.35 else -1
        only_doors = rows == 1
        kind = str(rng.choice(["bar", "bow", "flat"]))
        for row in range(rows):
            z0, z1 = float(edges[row]) + 0.002, float(edges[row + 1]) - 0.002
            if row < rows - 1 and (row + 1 != doors_at):
                body += box((-depth, -half + 0.5 * wall, z1 + 0.0005), (depth - 0.5 * wall, half - 0.5 * wall, z1 + 0.0035))
            if only_doors or row == doors_at - 0 == rows - 1:
                _doors(rng, moving, depth, half, wall, z0, z1, face, kind)
                continue
            inner = half - wall - 0.003
            drawer = box((-depth - face, -half + 0.002, z0), (-depth - GAP, half - 0.002, z1))
            tall = max(0.75 * (z1 - z0 - 0.012), 0.01)
            drawer += tray((-depth - 0.006, -inner, z0 + 0.004), (depth - wall - 0.02, inner, z0 + 0.004 + tall), 0.005)
            span = half * rng.uniform(0.25, 0.6)
            z = 0.5 * (z0 + z1)
            drawer += front_handle(kind, (-depth - face, -span, z), (-depth - face, span, z), 0.03, 0.005)
            slide = prismatic("body", (-1, 0, 0), 0.0, 2.0 * depth * rng.uniform(0.4, 0.8), (-depth, 0, z))
            moving.append((f"drawer_{row}", drawer, slide))
        if rng.random() < 0.6:
            body += rounded_box((-depth - 0.01, -half - 0.01, top - 0.002), (depth + 0.01, half + 0.01, top + 0.018), 0.01, axis=2)
    else:
        for sx in (-1.0, 1.0):
            for sy in (-1.0, 1.0):
                x, y = sx * (depth - posts), sy * (half - posts)
                body += cylinder((x, y, base), (x, y, top), posts, sections=10)
        count = int(rng.integers(2, 5))
        for z in np.linspace(base + 0.01, top - 0.06 * rng.integers(0, 2), count).tolist():
            rail = rng.choice([0.0, rng.uniform(0.02, 0.09)])
            if rail > 0:
                body += tray((-depth, -half, z - 0.008), (depth, half, z - 0.008 + rail), 0.004)
            else:
                body += rounded_box((-depth, -half, z - 0.012), (depth, half, z), 0.02, axis=2)
        body += box((-depth, -half, base), (depth, half, base + 0.008))
    if rng.random() < 0.75:  # a handle at the pusher's side
        z = top - rng.uniform(0.0, 0.06)
        out = depth + rng.uniform(0.04, 0.09)
        r = max(0.8 * posts, 0.007)
        y = 0.9 * half
        body += tube([(depth - 0.01, -y, z - 0.03), (out, -y, z), (out, y, z), (depth - 0.01, y, z - 0.03)], r, 10)
    cart.add("body", body, density=500.0)
    for name, solid, joint in moving:
        cart.add(name, solid, joint, density=500.0)  # type: ignore[arg-type]
    reach = 1.7 * wheels.radius
    for number, (x, y) in enumerate((sx * (depth - reach), sy * (half - reach)) for sx, sy in
                                    ((1, -1), (1, 1), (-1, -1), (-1, 1))):  # fmt: skip
        wheels.add_caster(cart, x, y, base)
    return cart


def _doors(
    rng: np.random.Generator, moving: list, depth: float, half: float, wall: float, z0: float, z1: float, face: float,
    kind: str,
) -> None:  # fmt: skip
    """One or two doors before a compartment."""
    two = rng.random() < 0.6
    x = -depth - face
    limit = rng.uniform(1.2, 1.9)
    leaves = [(0.001, half - 0.002, True), (-half + 0.002, -0.001, False)] if two else [(-half + 0.002, half - 0.002, True)]
    for number, (y0, y1, left) in enumerate(leaves):
        leaf = box((x, y0, z0), (-depth - GAP, y1, z1))
        y = y0 + 0.03 if left else y1 - 0.03
        middle, span = 0.5 * (z0 + z1), 0.2 * (z1 - z0)
        leaf += front_handle(kind, (x, y, middle - span), (x, y, middle + span), 0.03, 0.005)
        moving.append((f"door_{number}", leaf, side_hinge(x, y1 if left else y0, limit, left)))


def _wheelbarrow(rng: np.random.Generator) -> Assembly:
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
    rim = [(x0 - rng.uniform(0.0, 0.15), -0.85 * half), (x0 - rng.uniform(0.0, 0.15), 0.85 * half), (x1, half), (x1, -half)]
    rim[1] = (rim[0][0], rim[1][1])
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
    wall = x0 + flare + (rim[0][0] - x0 - flare) * (levels - low) / deep
    chord = np.sqrt(np.maximum(levels * (2.0 * wheels.radius - levels), 0.0))
    axle_x = min(float((wall - chord).min()) - 0.03, x0) - rng.uniform(0.0, 0.1)
    track = 0.5 * wheels.wide + r + GAP + 0.002
    reach, grip = x1 + rng.uniform(0.4, 0.6), low + rng.uniform(0.0, 0.25)
    under = low - thick - 0.8 * r
    for s in (-1.0, 1.0):
        start = (axle_x, s * track, wheels.radius)
        path = [start, (x0 + flare + 0.05, s * (half - flare) * 0.7, under), (x1 - 0.6 * flare, s * (half - flare), under),
                (reach, s * 0.95 * half, grip)]  # fmt: skip
        body += tube(path, r, 10)
        body += tube([path[3], (reach + 0.1, s * 0.95 * half, grip)], 1.25 * r, 10)
        leg = 0.55 * (x0 + x1) + 0.1
        body += tube([(leg - 0.05, s * 0.75 * (half - flare), under), (leg, s * 0.8 * half, r), (leg + 0.08, s * 0.8 * half, r),
                      (x1 - 0.4 * flare, s * 0.85 * half, under)], r, 8)  # fmt: skip
    cart = Assembly()
    spots = [0.0]
    if twin:
        spots = [s * (track + r + GAP + 0.5 * wheels.wide) for s in (-1.0, 1.0)]
        body += cylinder((axle_x, -track, wheels.radius), (axle_x, track, wheels.radius), 0.8 * r, sections=12)
    cart.add("body", body, density=STEEL)
    for y in spots:
        wheels.add(cart, (axle_x, y, wheels.radius))
    return cart


def _wagon(rng: np.random.Generator) -> Assembly:
    """A tray on four wheels; the front axle steers with the drawbar."""
    wheels = Wheels(rng, rng.uniform(0.07, 0.15), rng.uniform(0.03, 0.06))
    length, half = rng.uniform(0.7, 1.1), rng.uniform(0.2, 0.32)
    floor = 2.0 * wheels.radius + 0.03 + 3.0 * GAP
    tall = rng.uniform(0.08, 0.3)
    radius = rng.uniform(0.01, 0.08)
    if rng.random() < 0.5:
        body = rounded_tray((-0.5 * length, -half, floor), (0.5 * length, half, floor + tall), 0.006, radius,
                            ((0.0, rng.uniform(0.0, 0.04)), (1.0, 0.0)))  # fmt: skip
    else:  # stakes and boards
        body = box((-0.5 * length, -half, floor), (0.5 * length, half, floor + 0.02))
        boards = int(rng.integers(1, 4))
        for k in range(boards):
            z0 = floor + 0.02 + (k + 0.3) * tall / boards
            z1 = z0 + 0.6 * tall / boards
            for s in (-1.0, 1.0):
                y0, y1 = sorted((s * half, s * (half - 0.015)))
                body += box((-0.5 * length, y0, z0), (0.5 * length, y1, z1))
                a, b = sorted((s * 0.5 * length, s * (0.5 * length - 0.015)))
                body += box((a, -half, z0), (b, half, z1))
        for sx in (-1.0, 1.0):
            for sy in (-1.0, 1.0):
                x, y = sx * (0.5 * length - 0.025), sy * (half - 0.025)
                body += box((x - 0.012, y - 0.012, floor), (x + 0.012, y + 0.012, floor + 0.02 + tall))
    x_front, x_back = -0.5 * length + 1.3 * wheels.radius, 0.5 * length - 1.2 * wheels.radius
    track = half - 0.5 * wheels.wide
    inner = track - 0.5 * wheels.wide - GAP
    z = wheels.radius
    body += box((x_back - 0.02, -inner + 0.03, z - 0.015), (x_back + 0.02, inner - 0.03, floor + 0.002))
    body += cylinder((x_back, -inner, z), (x_back, inner, z), 0.012, sections=12)
    cart = Assembly()
    cart.add("body", body, density=500.0)
    top = floor - GAP
    axle = cylinder((x_front, 0, top), (x_front, 0, top - 0.015), 0.4 * half, sections=20)
    axle += box((x_front - 0.02, -0.35 * half, z - 0.015), (x_front + 0.02, 0.35 * half, top - 0.005))
    axle += cylinder((x_front, -inner, z), (x_front, inner, z), 0.012, sections=12)
    nose = x_front - max(0.5 * wheels.radius, 0.06)
    axle += box((nose, -0.025, z - 0.012), (x_front, 0.025, z + 0.012))
    limit = rng.uniform(0.3, 0.6)
    # Turned, the wheels stay below the floor; they meet neither the rear wheels nor the drawbar.
    cart.add("axle", axle, revolute("body", UP, (x_front, 0, top), -limit, limit), density=STEEL)
    long = rng.uniform(0.5, 0.85)
    start = rng.uniform(0.5, 1.1)
    pivot = np.array([nose - 0.014, 0.0, z])
    out = np.array([-cos(start), 0.0, sin(start)])
    bar = cylinder(pivot - (0, 0.022, 0), pivot + (0, 0.022, 0), 0.011, sections=12)
    bar += tube([pivot, pivot + long * out], 0.009, 8)
    if rng.random() < 0.6:
        grip = pivot + long * out
        bar += cylinder(grip - (0, 0.07, 0), grip + (0, 0.07, 0), 0.013, sections=12)
    else:
        across = np.array([0.0, 0.06, 0.0])
        tip = pivot + long * out
        bar += tube(np.array([tip, tip + across + 0.06 * out, tip + 0.13 * out, tip - across + 0.06 * out]), 0.008, 6,
                    closed=True)  # fmt: skip
    edge = -0.5 * length - 0.02
    # Up, the bar goes no further than before the tray.
    steepest = float(arctan2(floor + tall - z, max(pivot[0] - edge, 0.0) + 0.03)) if pivot[0] > edge else 1.4
    upper = max(min(steepest, 1.4) - start, 0.0)
    joint = revolute("axle", (0, 1, 0), pivot, -(start - 0.1), 0.7 * upper)
    cart.add("handle", bar, joint, density=STEEL)
    for x, parent in ((x_front, "axle"), (x_back, "body")):
        for s in (-1.0, 1.0):
            wheels.add(cart, (x, s * track, z), parent)
    return cart
