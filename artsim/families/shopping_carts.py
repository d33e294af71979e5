"""Shopping carts, one kind of cart: a basket of bars or of one piece on a frame, with casters and a child seat."""

from collections.abc import Sequence

import numpy as np

from artsim.families.wheels import STEEL, Wheels, bar
from artsim.making.assembly import Assembly, Rng, pick, revolute
from artsim.making.solids import Solid, box, hull_of, rod, tube, union
from artsim.model.kinematics import Array


def shopping_cart(rng: Rng) -> Assembly:
    """A basket that narrows to the front, over a frame on four wheels."""
    length, half = rng.uniform(0.55, 0.95), rng.uniform(0.2, 0.32)
    narrow, track = rng.uniform(0.7, 0.98), rng.uniform(0.75, 0.95) * half
    # Two casters beside each other have room to swivel.
    wheels = Wheels(rng, min(rng.uniform(0.045, 0.07), 0.5 * narrow * track), rng.uniform(0.024, 0.036))
    low, high = rng.uniform(0.35, 0.55), rng.uniform(0.75, 0.95)
    lean = rng.uniform(0.02, 0.14)

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
    if rng.random() < 0.6:  # bars
        for up in (False, True):
            body += tube(np.array([corner(e, up) for e in ends]), 1.6 * r if up else 1.2 * r, 6, closed=True)
        walls = [(ends[0], ends[3]), (ends[1], ends[2]), (ends[0], ends[1]), (ends[3], ends[2])]
        for a, b in walls:
            count = int(rng.integers(4, 7))
            for share in np.linspace(0.0, 1.0, count).tolist():
                rods = [corner(a, up) + share * (corner(b, up) - corner(a, up)) for up in (False, True)]
                body += bar(rods[0], rods[1], r, 4)
            for share in np.linspace(0.0, 1.0, int(rng.integers(3, 5)))[1:-1].tolist():
                rods = [corner(e, False) + share * (corner(e, True) - corner(e, False)) for e in (a, b)]
                body += bar(rods[0], rods[1], r, 4)
        for share in np.linspace(0.0, 1.0, int(rng.integers(4, 7)))[1:-1].tolist():
            sides = [(corner((front, -1.0), False), corner((front, 1.0), False)) for front in (True, False)]
            rods = [left + share * (right - left) for left, right in sides]
            body += bar(rods[0], rods[1], r, 4)
    else:  # one piece of plastic: each wall and the floor is a slab between its corners
        thick = 0.004

        def slab(points: Sequence[Array]) -> Solid:
            return hull_of(*(box(p - thick, p + thick) for p in points))

        for a, b in zip(ends, [*ends[1:], ends[0]], strict=True):
            body += slab([corner(e, up) for e in (a, b) for up in (False, True)])
        body += slab([corner(e, False) for e in ends])
        body += tube(np.array([corner(e, True) for e in ends]), 0.01, 6, closed=True)
    tubes = rng.uniform(0.01, 0.015)
    base = wheels.caster_height + tubes
    front, back = -0.42 * length, 0.46 * length
    for s in (-1.0, 1.0):
        y = s * track
        foot = s * track * narrow
        bend = 0.5 * length + 0.02
        path = [(front - 0.03, foot, base), (back, y, base), (bend - 0.04, y, base + 0.08),
                (0.5 * length - 0.3 * lean - 0.02, s * 0.8 * half, low - 0.01)]  # fmt: skip
        body += tube(path, tubes, 8)
        body += bar((front + 0.05, foot, base), (front + 0.1 + lean, s * 0.6 * half * narrow, low + 0.05), 0.8 * tubes)
    body += bar((back, -track, base), (back, track, base), tubes) + bar((front, -track * narrow, base),
                                                                      (front, track * narrow, base), tubes)  # fmt: skip
    if rng.random() < 0.5:
        rack = 0.7 * narrow * track
        body += union(bar((front, y, base), (back, y, base), 0.005, 4) for y in np.linspace(-rack, rack, 5).tolist())
    grip = high + rng.uniform(0.02, 0.1)
    reach = 0.5 * length + rng.uniform(0.06, 0.14)
    body += union(bar((0.5 * length - 0.02, s * half, high), (reach, s * half, grip), tubes) for s in (-1.0, 1.0))
    body += rod(reach, (-half - 0.02, half + 0.02), grip, 1.3 * tubes, sections=14)
    spots = [(front, -track * narrow), (front, track * narrow), (back, -track), (back, track)]
    swivels = pick(rng, {2: 0.6, 4: 0.4})
    body += union(wheels.bracket(x, y, base - 0.5 * tubes) for x, y in spots[swivels:])
    seat = rng.random() < 0.5
    seat_x, hinge_z = 0.5 * length - 0.05 - 0.3 * lean, high - 0.03
    if seat:
        body += bar((seat_x, -0.97 * half, hinge_z + 0.008), (seat_x, 0.97 * half, hinge_z + 0.008), 0.005)
    cart = Assembly("body", body, STEEL)
    for number, (x, y) in enumerate(spots):
        if number < swivels:
            wheels.add_caster(cart, x, y, base - tubes)
        else:
            wheels.add(cart, (x, y, wheels.radius))
    if seat:  # the flap of the child seat, inside of the back wall
        low_z = low + 0.55 * (high - low)
        flap = box((seat_x - 0.004, seat_x), 0.6 * half, (low_z, hinge_z), fillet=0.002, axis=0)
        turn = revolute("body", (0, 1, 0), (seat_x, 0, hinge_z), 0.0, rng.uniform(0.5, 1.3))
        cart.add("flap", flap, turn, label="seat", density=900.0)
    return cart
