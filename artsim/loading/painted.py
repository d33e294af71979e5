"""The colours and pictures that an object's own files give its surface: Wavefront materials and their textures.

Files are untrusted: a material file or picture must lie inside the asset's folder, and is bounded in size.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image as Pictures

from artsim.common.files import read_bounded
from artsim.errors import AssetError
from artsim.loading.bodies import merge_fixed_links
from artsim.loading.documents import read_document
from artsim.loading.mesh_files import Bounds
from artsim.loading.mesh_files.obj import read_painted
from artsim.loading.meshes import LoadLimits, MeshReader, UnusableMeshError
from artsim.loading.object_files import read_urdf
from artsim.loading.partnet import read_side_files
from artsim.loading.urdf_document import MeshFile
from artsim.model.appearance import Coat, Colour, Material
from artsim.model.appearance.textures import Image
from artsim.model.objects import ArticulatedObject

_MAX_PICTURE_BYTES = 50_000_000
_MAX_PICTURE_PIXELS = 64_000_000
_MAX_SIDE = 1024
_GREY: Colour = (0.7, 0.7, 0.7)


def painted_coats(obj: ArticulatedObject) -> tuple[Coat, ...] | None:
    """The coats that the files of a loaded object describe.

    Parameters
    ----------
    obj : ArticulatedObject
        As :func:`artsim.load` gives it.

    Returns
    -------
    tuple of Coat or None
        None where its source is no URDF or joint file that is still there, none of its meshes has materials, or its
        surface is not made up of the files' triangles one by one.
    """
    file = Path(obj.source)
    if file.suffix not in (".urdf", ".json") or not file.is_file():
        return None
    try:
        meshes = _meshes_of_links(file)
    except (AssetError, UnusableMeshError):
        return None
    coats = []
    pictures: dict[Path, Image | None] = {}
    for part in obj.parts:
        links = next((links for links in meshes if part.name in links), None)
        try:
            painted = [_read(mesh, pictures) for mesh in meshes[links]] if links is not None else []
        except (AssetError, UnusableMeshError):
            return None
        if sum(len(mesh.material_of_face) for mesh in painted) != len(part.faces):
            return None
        coats.append(_combine_coats(painted))
    return tuple(coats) if any(len(coat.materials) for coat in coats) and any(map(_tells, coats)) else None


def _tells(coat: Coat) -> bool:
    return any(material.texture is not None or material.colour != _GREY for material in coat.materials)


def _meshes_of_links(file: Path) -> dict[tuple[str, ...], list[Path]]:
    """Mesh files of each rigid body, keyed by its links, in the order in which :func:`artsim.load` joins them."""
    limits = LoadLimits()
    side = read_side_files(file)
    reader = MeshReader(file.parent, {}, limits)
    robot, repairs, _ = read_document(read_urdf(file, limits.max_urdf_bytes), file, reader, side.helpers)
    links = {link.name: link for link in robot.links}
    found: dict[tuple[str, ...], list[Path]] = {}
    for body in merge_fixed_links(robot, file, repairs):
        paths = []
        for name in body.links:
            for shape in links[name].shapes:
                if not isinstance(shape.geometry, MeshFile):
                    raise UnusableMeshError("primitives have no material file")
                paths.append(reader.resolve(shape.geometry.filename))
        found[tuple(body.links)] = paths
    return found


def _read(path: Path, pictures: dict[Path, Image | None]) -> Coat:
    """Coat of one Wavefront file, its materials grey where it says nothing of them."""
    from trimesh.exchange.obj import parse_mtl

    if path.suffix.lower() != ".obj":
        raise UnusableMeshError(f"{path.name} has no materials that are read")
    limits, inside = LoadLimits(), _Inside(path.parent)
    painted = read_painted(read_bounded(path, limits.max_mesh_bytes, "mesh"), Bounds(path, limits.max_faces))
    described: dict[str, Any] = {}
    for name in painted.libraries:
        try:
            described |= parse_mtl(inside.get(name), inside)
        except (OSError, ValueError, TypeError, LookupError):  # a material that cannot be read is grey
            continue
    used, number = np.unique(painted.material_of_face, return_inverse=True)
    looks = tuple(_material(described.get(painted.materials[k], {}), path.parent, pictures) for k in used)
    plain = np.array([look.texture is None for look in looks], dtype=bool)[number]
    return _combine_coats([Coat(looks, number, np.where(plain[:, None, None], np.nan, painted.uv))])


class _Inside:
    """Gives the bytes of files that an asset names: none but those in its folder or in the folder above it."""

    def __init__(self, folder: Path):
        self._folder = folder

    def get(self, name: str) -> bytes:
        path = (self._folder / name.replace("\\", "/")).resolve()
        if not path.is_relative_to(self._folder.parent.resolve()):
            raise FileNotFoundError(name)
        try:
            return read_bounded(path, _MAX_PICTURE_BYTES, "picture")
        except AssetError as error:
            raise FileNotFoundError(name) from error

    __getitem__ = get


def _material(described: Mapping[str, Any], folder: Path, pictures: dict[Path, Image | None]) -> Material:
    """One material of a Wavefront material file; each picture is read once."""
    picture, texture = described.get("image"), None
    if picture is not None:
        place = (folder / picture.info["file_path"]).resolve()
        if place not in pictures:
            pictures[place] = _texture(picture)
        texture = pictures[place]
    return Material(_colour(described.get("diffuse")), roughness=0.5, specular=0.4, texture=texture)


def _colour(diffuse: ArrayLike | None) -> Colour:
    value = np.zeros(0) if diffuse is None else np.asarray(diffuse, np.float64).ravel()
    if len(value) < 3 or not np.isfinite(value).all():
        return _GREY
    red, green, blue = value[:3].clip(0.0, 1.0).tolist()
    return red, green, blue


def _texture(picture: Any) -> Image | None:
    if picture.width * picture.height > _MAX_PICTURE_PIXELS:
        return None
    try:
        picture = picture.convert("RGB")
        picture.thumbnail((_MAX_SIDE, _MAX_SIDE))
        return np.asarray(picture)
    except (OSError, ValueError, Pictures.DecompressionBombError):
        return None


def _combine_coats(coats: Sequence[Coat]) -> Coat:
    """One coat of several meshes that follow each other; materials that look the same become one."""
    materials: dict[tuple[Colour, int], Material] = {}
    numbers: list[NDArray[np.int64]] = [np.zeros(0, np.int64)]
    for coat in coats:
        keys = [(material.colour, id(material.texture)) for material in coat.materials]
        for key, material in zip(keys, coat.materials, strict=True):
            materials.setdefault(key, material)
        place = {key: number for number, key in enumerate(materials)}
        numbers.append(np.array([place[key] for key in keys], dtype=np.int64)[coat.material_of_face])
    laid = [np.full((len(coat.material_of_face), 3, 2), np.nan) if coat.uv is None else coat.uv for coat in coats]
    return Coat(tuple(materials.values()), np.concatenate(numbers), np.concatenate([np.zeros((0, 3, 2)), *laid]))
