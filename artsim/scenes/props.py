"""What stands in scenes besides articulated objects: tables, floors, walls, and everyday things of no interest."""

from collections.abc import Callable, Sequence

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.common.products import matmul
from artsim.making.outlines import Vector
from artsim.making.solids import Solid, box, cylinder, ellipsoid, tube, vessel
from artsim.model.appearance import Coat, Material, plain_coat
from artsim.model.appearance.finishes import draw_material, piece_of_face
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.renderers.scene import Thing, rigid_object

_THICKNESS = 0.06  # of floors and walls
_ROOM_HEIGHT = 2.6
_FURTHER = 3.0  # that a room goes on where it has no wall
_FLOOR_FINISHES = ("parquet", "parquet", "tiles", "stone", "fabric")
_TABLE_FINISHES = ("wood", "wood", "wood", "stone", "enamel")
TABLE_HEIGHT = 0.74
"""Metres from the floor to the top of a table."""


def place_solid(
    name: str, solid: Solid, materials: Material | Sequence[Material], T_world: Array | None = None
) -> Thing:
    """A rigid thing that stands where its solid was built, or at a pose from there.

    Parameters
    ----------
    name : str
    solid : Solid
    materials : Material, or one for each piece of the solid
    T_world : (4, 4) float, optional
    """
    obj, center, coats = _rigid(name, solid, materials)
    T = np.eye(4)
    T[:3, 3] = center
    return Thing(obj, np.zeros(1), T if T_world is None else matmul(T_world, T), coats)


def _rigid(
    name: str, solid: Solid, materials: Material | Sequence[Material]
) -> tuple[ArticulatedObject, Array, tuple[Coat, ...]]:
    """Object in its rest frame, where its origin was before, and its coat."""
    vertices, faces = solid.union()
    center = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    obj = rigid_object(name, (vertices - center, faces))
    if isinstance(materials, Material):
        return obj, center, (plain_coat(obj.parts[0], materials),)
    number = piece_of_face(vertices, faces, solid.piece_meshes())
    return obj, center, (Coat(tuple(materials), number),)


def table(size: Vector, rng: np.random.Generator) -> list[Thing]:
    """A table whose top ends at height 0, centred on the origin.

    Parameters
    ----------
    size : 2 float
        In x and y, metres.
    rng : numpy Generator
        Draws its looks.
    """
    x, y = 0.5 * size[0], 0.5 * size[1]
    thick, leg, inset = 0.03, 0.05, 0.04
    material = draw_material(str(rng.choice(_TABLE_FINISHES)), rng)
    legs = material if rng.random() < 0.5 else draw_material("steel", rng)
    top = box((-x, -y, -thick), (x, y, 0.0), fillet=0.02, axis=2)
    things = [place_solid("table", top, material)]
    for sx in (-1, 1):
        for sy in (-1, 1):
            foot = np.array([sx * (x - inset - leg / 2), sy * (y - inset - leg / 2)])
            solid = box((*(foot - leg / 2), -TABLE_HEIGHT), (*(foot + leg / 2), -thick - 1e-4))
            things.append(place_solid("table", solid, legs))
    return things


def room(low: Vector, high: Vector, floor: float, rng: np.random.Generator) -> list[Thing]:
    """A floor, a wall at the back (+X) and one at a side (+Y or -Y); on the other side the room goes on.

    Parameters
    ----------
    low, high : 2 float
        Corners of the place that is kept free, in world x and y, metres.
    floor : float
        Its height.
    rng : numpy Generator
        Draws looks, and the side of the second wall.
    """
    ground = draw_material(str(rng.choice(_FLOOR_FINISHES)), rng)
    wall = draw_material("plaster", rng)
    skirting = Material((0.9, 0.9, 0.88), 0.5)
    (x0, x1), (y0, y1), top = (low[0], high[0]), (low[1], high[1]), floor + _ROOM_HEIGHT
    if rng.random() < 0.5:
        y0 -= _FURTHER
        side = (y1, y1 + _THICKNESS)
    else:
        y1 += _FURTHER
        side = (y0 - _THICKNESS, y0)
    return [
        place_solid("floor", box((x0, y0, floor - _THICKNESS), (x1, y1, floor)), ground),
        place_solid("wall", box((x1, y0, floor), (x1 + _THICKNESS, y1, top)), wall),
        place_solid("wall", box((x0, side[0], floor), (x1, side[1], top)), wall),
        place_solid("skirting", box((x1 - 0.012, y0, floor), (x1, y1, floor + 0.07)), skirting),
    ]


# --- distractors: what each is called, and how it is drawn -----------------------------------------------------------


def _book(rng: np.random.Generator) -> tuple[Solid, list[Material]]:
    depth, width, height = rng.uniform(0.18, 0.25), rng.uniform(0.12, 0.17), rng.uniform(0.015, 0.04)
    cover = 0.002
    paper = box((cover, 0.003, cover), (depth - 0.003, width - 0.003, height - cover))
    boards = (
        box((0, 0, 0), (depth, width, cover))
        + box((0, 0, height - cover), (depth, width, height))
        + box((0, 0, 0), (cover, width, height))
    )
    binding = draw_material(str(rng.choice(["plastic", "fabric"])), rng)
    return boards + paper, [binding] * 3 + [Material((0.93, 0.91, 0.85), 0.95, specular=0.1)]


def _can(rng: np.random.Generator) -> tuple[Solid, list[Material]]:
    radius, height = rng.uniform(0.03, 0.042), rng.uniform(0.09, 0.13)
    rim = cylinder((0, 0, height - 0.004), (0, 0, height), 0.92 * radius, sections=48)
    foot = cylinder((0, 0, 0), (0, 0, 0.004), 0.92 * radius, sections=48)
    body = cylinder((0, 0, 0.004), (0, 0, height - 0.004), radius, sections=48)
    metal = draw_material("steel", rng)
    return body + rim + foot, [draw_material("gloss", rng), metal, metal]


def _mug(rng: np.random.Generator) -> tuple[Solid, list[Material]]:
    radius, height = rng.uniform(0.036, 0.045), rng.uniform(0.08, 0.1)
    body = vessel([(0.95 * radius, 0.0), (radius, 0.3 * height), (radius, height)], 0.004, sections=48)
    path = [(0, radius - 0.002 + 0.028 * sin(a), height * (0.52 - 0.3 * cos(a))) for a in np.linspace(0.1, 3.04, 13)]
    cup = body + tube(path, 0.0045, sections=12)
    return cup, [draw_material("enamel", rng)] * len(cup.pieces)


def _bottle(rng: np.random.Generator) -> tuple[Solid, list[Material]]:
    radius, height = rng.uniform(0.03, 0.038), rng.uniform(0.19, 0.26)
    shoulder, neck = 0.62 * height, 0.38 * radius
    body = cylinder((0, 0, 0), (0, 0, shoulder), radius, sections=48)
    throat = cylinder((0, 0, shoulder), (0, 0, 0.82 * height), radius, neck, sections=48)
    stem = cylinder((0, 0, 0.82 * height), (0, 0, 0.93 * height), neck, sections=48)
    cap = cylinder((0, 0, 0.92 * height), (0, 0, height), 1.15 * neck, sections=32)
    skin = draw_material("smoke", rng)  # dark glass
    return body + throat + stem + cap, [skin, skin, skin, draw_material("plastic", rng)]


def _fruit(rng: np.random.Generator) -> tuple[Solid, list[Material]]:
    radius = rng.uniform(0.03, 0.042)
    tones = ((0.80, 0.45, 0.10), (0.72, 0.12, 0.10), (0.50, 0.62, 0.16), (0.88, 0.75, 0.20))
    skin = Material(tones[int(rng.integers(len(tones)))], 0.4)
    body = ellipsoid((0, 0, 0), (radius, radius, rng.uniform(0.86, 0.98) * radius), 48)
    stalk = cylinder((0, 0, 0.7 * radius), (0.002, 0, 1.05 * radius), 0.0015, sections=8)
    return body + stalk, [skin, Material((0.28, 0.2, 0.12), 0.9)]


def _bowl(rng: np.random.Generator) -> tuple[Solid, list[Material]]:
    radius, height = rng.uniform(0.06, 0.085), rng.uniform(0.045, 0.065)
    profile = [(0.5 * radius, 0.0), (0.8 * radius, 0.35 * height), (radius, height)]
    body = vessel(profile, 0.005, sections=48)
    return body, [draw_material("enamel", rng)] * len(body.pieces)


def _block(rng: np.random.Generator) -> tuple[Solid, list[Material]]:
    side = rng.uniform(0.03, 0.055)
    body = box((0, 0, 0), (side, side, side), fillet=0.15 * side)
    return body, [draw_material(str(rng.choice(["wood", "plastic"])), rng)]


DISTRACTORS: dict[str, Callable[[np.random.Generator], tuple[Solid, list[Material]]]] = {
    "book": _book, "can": _can, "mug": _mug, "bottle": _bottle, "fruit": _fruit, "bowl": _bowl, "block": _block,
}  # fmt: skip
"""Everyday things by name: each drawn as a solid and a material for each of its pieces."""


def distractor(rng: np.random.Generator) -> tuple[ArticulatedObject, tuple[Coat, ...]]:
    """A rigid everyday thing of a random kind, and its coat."""
    name = str(rng.choice(sorted(DISTRACTORS)))
    obj, _, coats = _rigid(name, *DISTRACTORS[name](rng))
    return obj, coats
