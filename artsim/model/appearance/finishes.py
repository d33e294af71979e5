"""Which materials an object without colours of its own is made of: drawn for each, plausible for its category."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from artsim.model.appearance import Coat, Colour, Material
from artsim.model.appearance.textures import TEXTURES
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Mesh, Part

Finish = Callable[[np.random.Generator, Colour], Material]
"""Makes a material of a tone."""

_ON_SURFACE = 1e-7  # metres
_DETAIL = 0.12  # of the largest piece's volume: smaller pieces are handles, keys, feet, knobs


def texture_finish(texture: str, tile: float, roughness: float, metallic: float = 0.0, specular: float = 0.5) -> Finish:
    """A finish with a procedural texture."""

    def finish(rng: np.random.Generator, tone: Colour) -> Material:
        return Material(tone, roughness, metallic, specular, TEXTURES[texture](rng, tone), tile)

    return finish


def plain_finish(roughness: float, metallic: float = 0.0, specular: float = 0.5, transmission: float = 0.0) -> Finish:
    """A finish of one colour."""

    def finish(rng: np.random.Generator, tone: Colour) -> Material:
        return Material(tone, roughness * rng.uniform(0.85, 1.15), metallic, specular, transmission=transmission)

    return finish


FINISHES: dict[str, Finish] = {
    "wood": texture_finish("wood", 0.45, 0.5),
    "parquet": texture_finish("parquet", 1.1, 0.4),
    "stone": texture_finish("stone", 0.8, 0.3),
    "tiles": texture_finish("tiles", 1.2, 0.25),
    "plaster": texture_finish("plaster", 1.5, 0.9, specular=0.2),
    "fabric": texture_finish("fabric", 0.25, 0.95, specular=0.1),
    "card": texture_finish("card", 0.3, 0.9, specular=0.2),
    "steel": texture_finish("brushed", 0.2, 0.38, metallic=0.75),
    "plastic": plain_finish(0.45),
    "gloss": plain_finish(0.2, specular=0.7),
    "shell": plain_finish(0.4),
    "smoke": plain_finish(0.12, specular=0.8, transmission=0.8),
    "rubber": plain_finish(0.85, specular=0.2),
    "enamel": plain_finish(0.28, specular=0.6),
    "chrome": plain_finish(0.22, metallic=0.85),
}
"""Every finish by name."""

_SUBSTANCES = {
    "parquet": "wood", "tiles": "ceramic", "fabric": "textile", "card": "cardboard", "smoke": "glass",
    "steel": "metal", "enamel": "metal", "chrome": "metal", "gloss": "plastic", "shell": "plastic",
}  # fmt: skip
"""What finishes cover that are not called so themselves."""

_TONES: dict[str, tuple[Colour, ...]] = {
    "wood": ((0.66, 0.47, 0.29), (0.50, 0.32, 0.19), (0.76, 0.60, 0.42), (0.36, 0.23, 0.15), (0.83, 0.70, 0.53)),
    "parquet": ((0.66, 0.48, 0.31), (0.56, 0.40, 0.26), (0.74, 0.60, 0.44)),
    "stone": ((0.74, 0.72, 0.69), (0.52, 0.52, 0.53), (0.85, 0.83, 0.80), (0.30, 0.30, 0.32)),
    "tiles": ((0.86, 0.85, 0.82), (0.62, 0.63, 0.64), (0.74, 0.68, 0.60)),
    "plaster": ((0.88, 0.86, 0.82), (0.78, 0.82, 0.84), (0.86, 0.81, 0.72), (0.74, 0.78, 0.73), (0.80, 0.78, 0.80)),
    "fabric": ((0.40, 0.43, 0.48), (0.55, 0.48, 0.42), (0.33, 0.38, 0.36), (0.62, 0.60, 0.57)),
    "card": ((0.72, 0.56, 0.39), (0.66, 0.50, 0.34), (0.80, 0.74, 0.66)),
    "steel": ((0.74, 0.74, 0.76), (0.62, 0.63, 0.65), (0.70, 0.68, 0.65)),
    "chrome": ((0.80, 0.80, 0.82), (0.84, 0.82, 0.78)),
    "rubber": ((0.08, 0.08, 0.09), (0.14, 0.14, 0.15)),
    "shell": ((0.13, 0.13, 0.14), (0.32, 0.33, 0.35), (0.86, 0.86, 0.85), (0.66, 0.67, 0.69), (0.16, 0.20, 0.28)),
    "smoke": ((0.06, 0.06, 0.07), (0.14, 0.10, 0.07), (0.10, 0.13, 0.16)),
    "enamel": ((0.92, 0.92, 0.90), (0.86, 0.84, 0.78), (0.20, 0.21, 0.23), (0.55, 0.17, 0.15), (0.25, 0.36, 0.42)),
}
_VIVID: tuple[Colour, ...] = (
    (0.11, 0.11, 0.12), (0.24, 0.25, 0.27), (0.90, 0.90, 0.88), (0.60, 0.61, 0.63), (0.15, 0.28, 0.48),
    (0.62, 0.15, 0.13), (0.16, 0.40, 0.34), (0.80, 0.52, 0.14), (0.36, 0.24, 0.42), (0.20, 0.45, 0.62),
)  # fmt: skip

_Choice = tuple[str, ...]
_OF_CATEGORY: Mapping[str, tuple[_Choice, _Choice]] = {
    "bottle": (("gloss", "plastic", "smoke"), ("plastic", "chrome")),
    "box": (("card", "card", "wood", "plastic"), ("steel", "chrome")),
    "bucket": (("plastic", "steel", "enamel"), ("steel", "plastic")),
    "camera": (("shell", "plastic", "steel"), ("rubber", "chrome")),
    "cart": (("steel", "enamel", "plastic"), ("steel", "plastic")),
    "carton": (("card",), ("card",)),
    "clock": (("wood", "plastic", "enamel", "chrome"), ("gloss", "chrome")),
    "chair": (("fabric", "plastic", "wood"), ("rubber", "chrome")),
    "coffee_machine": (("shell", "gloss", "steel"), ("plastic", "chrome")),
    "cutter": (("plastic",), ("steel",)),
    "dishwasher": (("enamel", "steel"), ("chrome",)),
    "dispenser": (("plastic", "gloss", "steel"), ("chrome", "plastic")),
    "display": (("shell", "gloss"), ("shell", "plastic")),
    "door": (("wood", "enamel"), ("chrome", "steel")),
    "drawer": (("wood",), ("chrome", "steel", "wood")),
    "eyeglasses": (("smoke",), ("gloss", "steel")),
    "fan": (("plastic", "enamel"), ("steel",)),
    "faucet": (("chrome", "steel"), ("chrome",)),
    "folding_chair": (("steel", "wood", "plastic"), ("chrome", "rubber")),
    "folding_knife": (("wood", "plastic", "steel"), ("steel",)),
    "globe": (("wood", "chrome"), ("chrome",)),
    "kettle": (("steel", "enamel", "gloss"), ("rubber", "plastic")),
    "keyboard": (("shell", "plastic"), ("plastic", "shell")),
    "kitchen_pot": (("steel", "enamel"), ("rubber", "plastic")),
    "knife": (("plastic", "wood"), ("steel",)),
    "lamp": (("enamel", "shell", "steel"), ("chrome", "rubber")),
    "laptop": (("steel", "shell"), ("plastic",)),
    "lighter": (("gloss", "steel", "plastic"), ("chrome", "steel")),
    "microwave": (("shell", "steel"), ("shell",)),
    "mouse": (("shell", "gloss", "plastic"), ("rubber", "plastic")),
    "oven": (("enamel", "steel"), ("chrome",)),
    "phone": (("gloss", "shell", "plastic"), ("smoke", "gloss")),
    "pen": (("plastic", "gloss", "steel"), ("chrome", "rubber")),
    "pliers": (("steel",), ("rubber",)),
    "printer": (("shell", "plastic"), ("shell", "gloss")),
    "refrigerator": (("enamel", "steel"), ("chrome",)),
    "remote": (("shell", "plastic", "gloss"), ("gloss", "rubber")),
    "robot_arm": (("enamel", "plastic"), ("rubber",)),
    "safe": (("enamel", "steel"), ("chrome",)),
    "scissors": (("steel",), ("plastic", "gloss")),
    "stapler": (("plastic", "gloss"), ("steel",)),
    "storage_furniture": (("wood", "wood", "enamel"), ("chrome", "steel", "wood")),
    "suitcase": (("plastic", "fabric"), ("rubber", "chrome")),
    "table": (("wood", "wood", "enamel"), ("chrome", "steel", "wood")),
    "toaster": (("steel", "enamel"), ("shell",)),
    "toilet": (("enamel", "gloss"), ("chrome", "plastic")),
    "trash_can": (("plastic", "steel"), ("rubber",)),
    "usb": (("plastic", "gloss", "steel"), ("steel", "chrome")),
    "valve": (("steel", "enamel"), ("steel",)),
    "washing_machine": (("enamel",), ("chrome",)),
    "window": (("enamel", "wood"), ("chrome",)),
}
"""Finishes that the bodies, and those that the details, of a category are drawn from."""
_PART_FINISHES: Mapping[str, str] = {
    "blade": "steel", "button": "rubber", "carafe": "gloss", "handwheel": "enamel", "magazine": "steel",
    "caster": "rubber", "globe": "enamel", "wheel": "rubber", "knob": "chrome", "dial": "chrome", "handle": "",
    "temple": "", "temple_left": "", "temple_right": "", "hand": "", "lens": "shell", "pendulum": "chrome", "pump": "",
    "connector": "steel", "key": "", "keys": "",
}  # fmt: skip
"""Finishes of parts by their label; "" stands for that of the details."""


def draw_coats(obj: ArticulatedObject, rng: np.random.Generator) -> tuple[Coat, ...]:
    """A coat for each part of an object.

    The parts share a body finish; small pieces and parts such as handles and knobs have one of their own. The same
    generator state gives the same coats.

    Parameters
    ----------
    obj : ArticulatedObject
    rng : numpy Generator
    """
    bodies, details = _OF_CATEGORY.get(obj.category, (("plastic", "enamel", "wood", "steel"), ("chrome", "plastic")))
    body, detail = draw_material(rng.choice(bodies), rng), draw_material(rng.choice(details), rng)
    named = {finish: draw_material(finish, rng) for finish in sorted(set(_PART_FINISHES.values()) - {""})}
    if obj.category == "laptop":
        detail = Material((0.09, 0.09, 0.1), 0.5)
    coats = []
    for part in obj.parts:
        finish = _PART_FINISHES.get(part.label)
        if finish is not None and part.label != obj.parts[0].label:
            coats.append(Coat((named[finish] if finish else detail,), np.zeros(len(part.faces), np.int64)))
        else:
            coats.append(Coat((body, detail), _detail_faces(part).astype(np.int64)))
    if obj.category == "laptop" and len(coats) == 2:
        coats[1] = _with_screen(obj.parts[1], coats[1], rng)
    return tuple(coats)


def draw_material(finish: str, rng: np.random.Generator) -> Material:
    """A material of a finish, in a tone drawn from those that it comes in."""
    tones = _TONES.get(finish, _VIVID)
    tone = np.asarray(tones[int(rng.integers(len(tones)))]) * rng.uniform(0.92, 1.08) + rng.uniform(-0.02, 0.02, 3)
    red, green, blue = tone.clip(0.02, 0.97).tolist()
    return replace(FINISHES[finish](rng, (red, green, blue)), substance=_SUBSTANCES.get(finish, finish))


def _detail_faces(part: Part) -> NDArray[np.bool_]:
    """(F,) faces that belong to small pieces of the part's body."""
    if part.body is None or len(part.body.pieces) < 2:
        return np.zeros(len(part.faces), dtype=bool)
    volumes = np.array([_volume(*piece) for piece in part.body.pieces])
    small = volumes < _DETAIL * volumes.max()
    return small[piece_of_face(part.vertices, part.faces, part.body.pieces)]


def piece_of_face(vertices: Array, faces: NDArray[np.int32], pieces: Sequence[Mesh]) -> NDArray[np.int64]:
    """(F,) convex piece on whose surface each face of the pieces' union lies: of several, the smallest."""
    middles = vertices[faces].mean(axis=1)
    found = np.zeros(len(faces), dtype=np.int64)
    free = np.ones(len(faces), dtype=bool)
    for number in np.argsort([_volume(*piece) for piece in pieces], kind="stable"):
        corners, own = pieces[number]
        near = (middles >= corners.min(axis=0) - 1e-6) & (middles <= corners.max(axis=0) + 1e-6)
        candidates = np.flatnonzero(near.all(axis=1) & free)
        outwards, offset = _planes(corners, own)
        beyond = (middles[candidates] @ outwards.T - offset).max(axis=1)
        on = candidates[np.abs(beyond) < _ON_SURFACE]
        found[on], free[on] = number, False
    return found


def _volume(vertices: Array, faces: NDArray[np.int32]) -> float:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.einsum("fi,fi->", a, np.cross(b, c))) / 6.0


def _planes(vertices: Array, faces: NDArray[np.int32]) -> tuple[Array, Array]:
    """Outward unit normals (P, 3) and offsets (P,) of a convex piece's faces."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    solid = length > 1e-9 * length.max()
    normal = normal[solid] / length[solid, None]
    return normal, (normal * a[solid]).sum(axis=1)


def _with_screen(lid: Part, coat: Coat, rng: np.random.Generator) -> Coat:
    """A laptop's lid with a lit display on the side that lies on the base."""
    red, green, blue = rng.uniform(0.05, 0.75, 3).tolist()
    display = Material((red, green, blue), 0.15, specular=0.6, texture=TEXTURES["screen"](rng, (red, green, blue)),
                       emission=0.55)  # fmt: skip
    corners = lid.vertices[lid.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    downwards = normal[:, 2] < -0.99 * np.linalg.norm(normal, axis=1)
    shown, bezel = downwards & (coat.material_of_face == 0), downwards & (coat.material_of_face == 1)
    if bezel.any():  # what lies outside of it is the shell's rim
        first, last = corners[bezel][..., :2].min(axis=(0, 1)), corners[bezel][..., :2].max(axis=(0, 1))
        middle = corners.mean(axis=1)[:, :2]
        shown &= ((middle > first) & (middle < last)).all(axis=1)
    if not shown.any():
        return coat
    low, high = corners[shown].min(axis=(0, 1)), corners[shown].max(axis=(0, 1))
    uv = np.full((len(lid.faces), 3, 2), np.nan)
    # Opened, the lid's front edge (-X) is on top; who sits before it has +Y on the left.
    uv[shown, :, 0] = (high[1] - corners[shown, :, 1]) / max(high[1] - low[1], 1e-9)
    uv[shown, :, 1] = (high[0] - corners[shown, :, 0]) / max(high[0] - low[0], 1e-9)
    return Coat((*coat.materials, display), np.where(shown, 2, coat.material_of_face), uv)


def repaint_coats(coats: Sequence[Coat], rng: np.random.Generator) -> tuple[Coat, ...]:
    """The same coats, each of their materials replaced by one of a random finish."""
    names = sorted(FINISHES)
    new: dict[Material, Material] = {}
    for material in (material for coat in coats for material in coat.materials):
        if material not in new:
            new[material] = draw_material(str(rng.choice(names)), rng)
    return tuple(replace(coat, materials=tuple(new[material] for material in coat.materials)) for coat in coats)
