"""Shopping carts, one kind of cart: a basket of bars or of one piece on a frame, with casters and a child seat."""

import numpy as np

from artsim.families.wheels import STEEL, Wheels, bar, slab
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, Array
from artsim.making.solids import Solid, box, rod, tube, union


def shopping_cart(draws: Draws) -> Assembly:
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
