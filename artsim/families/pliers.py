"""Pliers: two levers that cross at a lap joint, closed at rest, lying flat with the jaws at -X.

Varied: size, the jaws (combination, long nose, flat, cutting, round hole of a gripper), how the handles bow, their
grips (bare, dipped, thick with a guard), the rivet, and how far they open.
"""

import numpy as np

from artsim.common.elementary import power, sin
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.outlines import Array, normals, strips
from artsim.making.solids import Solid, box, cylinder, deferred, hull_of, loft, prism, rod, union

GAP = 0.0006


def build(draws: Draws) -> Assembly:
    """Pliers, closed at rest. One lever turns about the vertical rivet."""
    length = draws.length("length", (0.09, 0.38))
    kind = draws.pick("jaws", ["combination", "nose", "flat", "cutting", "hollow"])
    usual = {"nose": 0.36, "cutting": 0.13, "flat": 0.26}.get(kind, 0.22)
    jaw = length * usual * draws.number("jaw_length", (0.75, 1.3))
    thick = length * draws.number("height", (0.035, 0.11))
    disc = length * draws.number("joint_radius", (0.05, 0.075))
    jaws = _jaw(draws.within("jaw"), kind, jaw, disc)
    path, radii = _grip(draws.within("handle"), length - jaw, disc, length)
    near = jaws[0][:, 1].min()  # the jaw's outer edge next to the joint
    covered = draws.chance("grips", 0.85)
    guard = covered and draws.chance("guards", 0.4)
    rivet = disc * draws.number("rivet_radius", (0.3, 0.5))
    teeth = draws.chance("teeth", 0.7) and kind in ("combination", "flat")

    pliers = Assembly()
    for k, name in enumerate(("lever_1", "lever_2")):
        # The first lever has its handle at +Y and its jaw at -Y; the second lies across it.
        side = 1.0 if k == 0 else -1.0
        low = 0.0 if k == 0 else 0.5 * (thick + GAP)
        high = low + 0.5 * (thick - GAP)
        solid = union(prism(piece * (1, side), 0.0, thick) for piece in jaws) + rod(0, 0, (low, high), disc)
        start = jaws[0][0, 0]
        anchor = np.array([(x, side * y) for x in (start, start - 0.0015) for y in (0.4 * near, 0.95 * near)])
        solid += hull_of(rod(0, 0, (low, high), 0.75 * disc), prism(anchor, low, high))
        neck = path[0] * (1, side)
        root = rod(neck[0], neck[1], (low, high), radii[0])
        solid += hull_of(rod(0, 0, (low, high), 0.75 * disc), root)
        solid += _handle(path * (1, side), radii, thick, covered, guard, side).called("handle", (1, 0, 0))
        if teeth:  # ribs across the front of the jaw, in front of its hollow
            for x in np.linspace(-0.6 * jaw, -0.95 * jaw, 6):
                solid += box((x - 0.0006, x + 0.0006), (-side * 0.3 * GAP, -side * 0.003), (0.1 * thick, 0.9 * thick))
        face, outward = (0.0, -1) if k == 0 else (thick, 1)
        solid += rod(0, 0, (face - 0.001 * outward, face + 0.001 * outward), rivet, 0.85 * rivet)
        angle = draws.turn("lever_angle", (25, 60)) if k else 0.0
        joint = revolute("lever_1", (0, 0, -1), (0, 0, thick / 2), 0.0, angle) if k else None
        pliers.add(name, solid, joint, label="lever", density=6000.0)
    return pliers


def _jaw(draws: Draws, kind: str, length: float, disc: float) -> list[Array]:
    """Convex outlines of the jaw at -Y, clear of the joint's disc, from the joint to the tip."""
    share = np.linspace(0.0, 1.0, 11)
    start, tip = {
        "nose": (1.0, draws.number("nose_tip", (0.16, 0.3))),
        "flat": (1.05, draws.number("flat_tip", (0.45, 0.7))),
        "cutting": (1.25, draws.number("cutting_tip", (0.2, 0.4))),
    }.get(kind, (1.1, draws.number("tip", (0.5, 0.75))))
    belly = draws.number("belly", (1.8, 2.6) if kind == "cutting" else (0.6, 1.6))
    outer = disc * (start + (tip - start) * power(share, belly))
    outer[-1] *= 0.8
    inner = np.full(11, 0.5 * GAP)
    if kind in ("combination", "hollow"):  # a round hollow that holds pipes
        first, last = (0.08, 0.42) if kind == "combination" else (0.12, 0.8)
        inside = np.clip((share - first) / (last - first), 0, 1)
        inner += disc * draws.number("hollow", (0.25, 0.45)) * sin(np.pi * inside)
    x = -(disc + GAP) - share * (length - disc)
    return strips(np.column_stack([x, -inner]), np.column_stack([x, -np.maximum(outer, inner + 0.002)]))


def _grip(draws: Draws, reach: float, disc: float, length: float) -> tuple[Array, Array]:
    """(N, 2) middle line of the handle at +Y and (N,) its half width."""
    half = length * draws.number("width", (0.014, 0.034))
    share = np.linspace(0.0, 1.0, 12)
    first = half + disc * draws.number("start", (0.25, 0.5))
    widest, last = length * draws.number("bow", (0.08, 0.22)), length * draws.number("end", (0.05, 0.2))
    middle = draws.number("bow_place", (0.45, 0.65))
    y = np.where(
        share < middle,
        first + (widest - first) * sin(0.5 * np.pi * share / middle),
        widest + (last - widest) * np.square((share - middle) / (1 - middle)),
    )
    start = np.sqrt(max(np.square(disc + half + 2 * GAP) - np.square(first), 0.0)) + half
    radii = half * (1 - draws.number("taper", (0.0, 0.3)) * share)
    return np.column_stack([start + share * (reach - start), y]), radii


@deferred
def _handle(path: Array, radii: Array, thick: float, covered: bool, guard: bool, side: float) -> Solid:
    """Metal bar, and a thicker grip over most of it."""
    middle = 0.5 * thick
    solid = _bar(path, 0.8 * radii, np.full(len(path), middle), middle)
    if covered:
        swell = np.interp(np.linspace(0, 1, len(path)), [0, 0.25, 0.5, 0.9, 1], [1.25, 1.1, 1.3, 1.2, 0.9])
        grip = radii * swell
        solid += _bar(path[2:], grip[2:], middle + 0.35 * radii[2:] * swell[2:], middle)
        if guard:
            (x, y), radius = path[3], radii[3]
            solid += cylinder((x, y, middle), (x, y + side * (2.2 * radius), middle), 1.2 * radius, 0.6 * radius, 12)
    return solid


def _bar(path: Array, half_width: Array, half_height: Array, middle: float) -> Solid:
    """Bar of octagonal section along a level path."""
    corners = np.array([(1, 0.5), (0.6, 1), (-0.6, 1), (-1, 0.5), (-1, -0.5), (-0.6, -1), (0.6, -1), (1, -0.5)])
    flat = path[:, None] + corners[:, :1] * half_width[:, None, None] * normals(path)[:, None]
    return loft(list(np.dstack([flat, middle + corners[:, 1] * half_height[:, None]])))
