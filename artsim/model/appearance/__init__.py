"""How things look: materials, the coats of parts made of them, and light.

What looks like what is plain data, drawn from an explicit generator; renderers read it. Colours are sRGB, 0 to 1.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artsim.model.appearance.textures import Image
from artsim.model.kinematics import Array
from artsim.model.objects import Part

Colour = tuple[float, float, float]

_CREASE = np.deg2rad(35.0)  # faces that meet at a smaller angle look like one smooth surface


@dataclass(frozen=True, eq=False)
class Material:
    """What a surface is made of."""

    colour: Colour
    roughness: float = 0.6
    metallic: float = 0.0
    specular: float = 0.5
    """0 to 1, as in the metallic-roughness model."""
    texture: Image | None = None
    """(H, W, 3) uint8 or None. Takes the place of the colour."""
    tile: float = 0.5
    """Metres that the texture covers where a coat says nothing of how it lies."""
    emission: float = 0.0
    """Share of the colour that it sends out by itself."""
    transmission: float = 0.0
    """Share of the light that passes through. Depth sensors see less of such a surface; renderers draw it opaque."""
    substance: str = ""
    """What it is made of, such as wood or metal; empty where that is not known."""


@dataclass(frozen=True, eq=False)
class Coat:
    """How the triangles of a part look."""

    materials: tuple[Material, ...]
    material_of_face: NDArray[np.int64]
    """(F,) int."""
    uv: Array | None = None
    """(F, 3, 2) float or None. Where each corner lies on the texture, upwards from its lower left corner, the whole
    texture being 1 wide and 1 high; NaN, or None for all, where the texture is wrapped around the part by
    ``Material.tile``."""


@dataclass(frozen=True)
class Sun:
    """Distant light."""

    direction: Colour
    """In which it shines, world frame."""
    colour: Colour
    """Light on a surface that faces it: 1 shows the surface's own colour."""
    radius: float = 0.0
    """Angle in radians between the middle and the rim of the source: softens its shadows."""


@dataclass(frozen=True)
class Lights:
    """All light in a scene."""

    sun: Sun
    sky: Colour
    """Light from all sides above, which things keep from one another."""
    ambient: Colour
    """Light that is everywhere."""
    background: Colour = (0.8, 0.8, 0.8)
    """Colour where nothing stands."""


def plain_coat(part: Part, material: Material) -> Coat:
    """One material all over."""
    return Coat((material,), np.zeros(len(part.faces), dtype=np.int64))


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles of one material that share no corner, as rasterisers take them."""

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    """(3 F, 3) float32. Native units, rest frame."""
    uv: NDArray[np.float32]
    """(3 F, 2) float32. From the texture's lower left corner."""
    material: Material

    @property
    def faces(self) -> NDArray[np.uint32]:
        """(F, 3) triangles."""
        return np.arange(len(self.vertices), dtype=np.uint32).reshape(-1, 3)


def patches(part: Part, coat: Coat, scale: float = 1.0, closed: bool = False) -> Iterator[Patch]:
    """A part's surface, one patch for each material; what is not a closed solid is seen from both sides.

    Parameters
    ----------
    part : Part
    coat : Coat
    scale : float
        Of the object: textures keep their size in metres.
    closed : bool
        The surface is known to be closed: one side will do.
    """
    faces = part.faces if closed else part.two_sided_faces()
    twice = len(faces) // max(len(part.faces), 1)
    corners = part.vertices[faces].astype(np.float64)
    normals = corner_normals(part.vertices, faces)
    across = normals.reshape(-1, 3, 3).mean(axis=1)
    material_of_face = np.tile(coat.material_of_face, twice)
    for number, material in enumerate(coat.materials):
        own = material_of_face == number
        if not own.any():
            continue
        uv = _texture_places(corners[own] * scale, across[own], material.tile)
        if coat.uv is not None:
            # The second copy of a face has its corners in the opposite order.
            laid = np.concatenate([coat.uv, coat.uv[:, ::-1]][:twice])[own]
            uv = np.where(np.isnan(laid), uv, laid)
        yield Patch(
            corners[own].reshape(-1, 3).astype(np.float32),
            normals.reshape(-1, 3, 3)[own].reshape(-1, 3),
            uv.reshape(-1, 2).astype(np.float32),
            material,
        )


def corner_normals(vertices: Array, faces: NDArray[np.int32]) -> NDArray[np.float32]:
    """(3 F, 3) unit normal at each corner of each face: the mean over the faces that meet it smoothly there."""
    from scipy import sparse

    corners = vertices[faces].astype(np.float64)
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(area, axis=1)
    unit = np.where(size[:, None] > 0, area / np.where(size > 0, size, 1.0)[:, None], (0.0, 0.0, 1.0))
    _, place = np.unique(np.round(corners.reshape(-1, 3), 9), axis=0, return_inverse=True)
    count = len(place)
    at = sparse.csr_array((np.ones(count), (np.arange(count), place.ravel())))
    one, other = (at @ at.T).nonzero()  # corners at one place, of all faces
    smooth = (unit[one // 3] * unit[other // 3]).sum(axis=1) > np.cos(_CREASE)
    one, other = one[smooth], other[smooth]
    weight = np.maximum(size, 1e-12 * max(float(size.max(initial=0.0)), 1e-300))[other // 3]
    total = sparse.csr_array((weight, (one, other)), shape=(count, count)) @ np.repeat(unit, 3, axis=0)
    normals: NDArray[np.float32] = (total / np.linalg.norm(total, axis=1, keepdims=True)).astype(np.float32)
    return normals


def _texture_places(corners: Array, normals: Array, tile: float) -> Array:
    """(F, 3, 2) places on a texture laid onto each face from the side that it faces most; grain along the longer.

    Parameters
    ----------
    corners : (F, 3, 3) float
        Metres.
    normals : (F, 3) float
    tile : float
        Metres that the texture covers.
    """
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    longest_first = np.argsort(-(high - low), kind="stable")
    across = np.abs(normals).argmax(axis=1)
    axes = np.array([[axis for axis in longest_first if axis != facing] for facing in range(3)])[across]
    uv: Array = np.take_along_axis(corners - 0.5 * (low + high), axes[:, None, :].repeat(3, axis=1), axis=2) / tile
    return uv


def subpixel(index: int) -> Array:
    """(2,) offset in pixels of the index-th of several pictures that make one with smooth edges; the first is 0."""
    values = []
    for base in (2, 3):  # Halton's sequence
        rest, fraction, value = index, 1.0, 0.0
        while rest:
            rest, digit = divmod(rest, base)
            fraction /= base
            value += fraction * digit
        values.append(value - 0.5 if index else 0.0)
    return np.array(values)
