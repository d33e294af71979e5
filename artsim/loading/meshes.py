"""Triangles of the shapes that a URDF names: primitives, and mesh files.

Mesh files are untrusted: they must lie inside the asset's folder or a declared package root, and are bounded in size
before they are read. Each is read once, however often the URDF names it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from artsim.common.files import read_bounded
from artsim.errors import AssetError
from artsim.loading.mesh_files import FORMATS, Bounds, Neighbour, Surface, UnusableMeshError, read_mesh
from artsim.loading.mesh_files.gltf import Key, Owner, read_gltf_parts
from artsim.loading.packages import AssetPaths, MissingFileError
from artsim.loading.primitives import box, capsule, cylinder, sphere
from artsim.loading.urdf_document import Box, Capsule, Cylinder, Geometry, InlineMesh, MeshFile, Sphere
from artsim.model.kinematics import Array
from artsim.model.objects import Mesh, Repair
from artsim.model.transforms import transform_points

__all__ = [
    "LoadLimits",
    "MeshReader",
    "UnusableMeshError",
    "check_copies",
    "check_range",
    "check_shapes",
    "merge_shapes",
]

_PRIMITIVES: dict[type, Callable[[Any], Mesh]] = {
    Box: lambda shape: box(shape.size),
    Cylinder: lambda shape: cylinder(shape.radius, shape.length),
    Capsule: lambda shape: capsule(shape.radius, shape.length),
    Sphere: lambda shape: sphere(shape.radius),
}
_LARGEST = 1e6
"""Metres, or units of a file in millimetres: squares and products of much larger coordinates overflow."""


@dataclass(frozen=True)
class LoadLimits:
    """What a loader accepts from a file nobody vouches for."""

    max_urdf_bytes: int = 16_000_000
    max_mesh_bytes: int = 100_000_000
    max_total_mesh_bytes: int = 300_000_000
    """Of all mesh files, each counted as often as the URDF names it."""
    max_faces: int = 5_000_000
    """Triangles over the whole object."""
    max_copied_faces: int = 500_000
    """Triangles of an MJCF file's meshes that are used again: a small file of many takes as long as a large one."""
    max_links: int = 1_000
    max_shapes: int = 5_000
    """Primitives and mesh references in a URDF file."""


def check_shapes(data: bytes, where: Path, limits: LoadLimits) -> None:
    """Refuse a URDF file with too many shapes before it is parsed; raises AssetError."""
    count = data.count(b"<geometry")
    if count > limits.max_shapes:
        raise AssetError(
            f"{count} shapes are over the limit of {limits.max_shapes}",
            where,
            "raise it with artsim.load(..., limits=LoadLimits(max_shapes=...)) if you trust the file",
        )


def check_range(vertices: Array, where: str) -> None:
    """Refuse coordinates that nothing can be computed with; raises AssetError."""
    if not (np.abs(vertices) <= _LARGEST).all():
        raise AssetError(
            f"a coordinate is not finite, or over {_LARGEST:g}", where, "write sizes, origins and meshes in metres"
        )


def check_copies(faces: int, where: Path, limits: LoadLimits) -> None:
    """Refuse more triangles of meshes that are used again than are allowed; raises AssetError."""
    if faces > limits.max_copied_faces:
        raise AssetError(
            f"copies of its meshes have more than {limits.max_copied_faces} triangles",
            where,
            "decimate the meshes that are used many times, or raise LoadLimits.max_copied_faces if you trust the file",
        )


@dataclass
class MeshReader:
    """Reads the meshes of one URDF file."""

    folder: Path
    """The URDF file's folder: the root of relative paths."""
    package_roots: Mapping[str, Path]
    """Folder of each declared ``package://`` name."""
    limits: LoadLimits
    contents: list[bytes] = field(default_factory=list)
    """Bytes of every mesh file read, in order: they are part of the object's digest."""
    notes: list[Repair] = field(default_factory=list)
    """What was left out, assumed or mended in mesh files."""
    num_faces: int = 0
    _num_bytes: int = 0
    _paths: dict[str, Path] = field(default_factory=dict)
    _read: dict[Path, tuple[Surface, list[bytes]]] = field(default_factory=dict)

    def shape(self, geometry: Geometry) -> tuple[Array, NDArray[np.int32]]:
        """Vertices (V, 3) and triangles (F, 3) of a URDF geometry in its own frame.

        Raises
        ------
        UnusableMeshError
            When a mesh is missing, empty or broken.
        AssetError
            When a mesh lies outside the allowed folders or is over a limit.
        """
        if isinstance(geometry, MeshFile):
            return self._file(geometry)
        if isinstance(geometry, InlineMesh):
            vertices, faces = geometry.vertices, geometry.faces
        else:
            vertices, faces = _PRIMITIVES[type(geometry)](geometry)
        self._count(len(faces))
        return vertices, faces

    def _count(self, faces: int) -> None:
        self.num_faces += faces
        if self.num_faces > self.limits.max_faces:
            raise AssetError(
                f"the object has more than {self.limits.max_faces} triangles",
                self.folder,
                "decimate its meshes or raise LoadLimits.max_faces",
            )

    @cached_property
    def paths(self) -> AssetPaths:
        """Where the files are that the URDF names."""
        return AssetPaths(self.folder, self.package_roots)

    def resolve(self, filename: str) -> Path:
        """Path of a mesh by its name, confined to the asset's folders; see :mod:`artsim.loading.packages`.

        Raises
        ------
        UnusableMeshError
            When no such file exists; caused by a :class:`~artsim.loading.packages.MissingFileError`.
        AssetError
            When the file would lie outside the allowed folders.
        """
        try:
            return self.paths.resolve(filename)
        except MissingFileError as error:
            raise UnusableMeshError(str(error)) from error

    def _file(self, reference: MeshFile) -> tuple[Array, NDArray[np.int32]]:
        if reference.filename not in self._paths:
            self._paths[reference.filename] = self.resolve(reference.filename)
        path = self._paths[reference.filename]
        surface, contents = self._read.get(path) or self._parse(path, reference.filename)
        self._take(contents, path)
        if len(surface.faces) == 0:
            raise UnusableMeshError(f"mesh {reference.filename!r} has no faces")
        self._count(len(surface.faces))
        vertices, faces = surface.vertices, surface.faces
        if reference.scale is not None:
            vertices = vertices * np.asarray(reference.scale, dtype=np.float64)
            if np.prod(np.sign(np.broadcast_to(reference.scale, 3))) < 0:
                faces = faces[:, ::-1]
        return vertices, faces

    def _parse(self, path: Path, name: str) -> tuple[Surface, list[bytes]]:
        """The surface of a file that was not read before, and the bytes it was made of."""
        kind = path.suffix.lower()
        if kind not in FORMATS:
            raise UnusableMeshError(f"mesh {name!r} is of a kind that is not read ({', '.join(FORMATS)})")
        contents, neighbour = self._open(path)
        try:
            surface = read_mesh(contents[0], kind, Bounds(path, self.limits.max_faces), neighbour)
        except UnusableMeshError as problem:
            self._take(contents, path)
            raise UnusableMeshError(f"mesh {name!r} {problem}") from problem
        self.notes += [Repair(f"mesh {name!r}", text) for text in surface.notes]
        self._read[path] = surface, contents
        return self._read[path]

    def _open(self, path: Path) -> tuple[list[bytes], Neighbour]:
        """The content of a file, and what gives that of files beside it, which is added."""
        contents = [read_bounded(path, self.limits.max_mesh_bytes, "mesh")]
        self._check_bytes(len(contents[0]), path)

        def neighbour(beside: str) -> bytes:
            contents.append(self._beside(path, beside))
            return contents[-1]

        return contents, neighbour

    def scene(self, filename: str, owner: Owner[Key]) -> tuple[dict[Key, Surface], list[str]]:
        """Surfaces of the parts of a glTF file, and names of nodes that belong to none.

        Parameters
        ----------
        filename : str
        owner : callable
            See :func:`artsim.loading.mesh_files.gltf.read_gltf_parts`.

        Raises
        ------
        AssetError
            When it cannot be read, lies outside the allowed folders, or is over a limit.
        """
        path = self.resolve(filename)
        contents, neighbour = self._open(path)
        try:
            with np.errstate(all="ignore"):  # as for every mesh: numbers out of range are found at the end
                bounds = Bounds(path, self.limits.max_faces)
                surfaces, strays, notes = read_gltf_parts(contents[0], bounds, neighbour, owner)
        except UnusableMeshError as problem:
            raise AssetError(f"mesh {filename!r} {problem}", path, "export it again as glTF 2.0") from problem
        self._take(contents, path)
        self.notes += [Repair(f"mesh {filename!r}", text) for text in notes]
        return surfaces, strays

    def _beside(self, path: Path, name: str) -> bytes:
        """The content of a file that a mesh file names, confined like the mesh file itself."""
        home = path.resolve().parent
        roots = [home, *(root.resolve() for root in (self.paths.root, self.folder, *self.package_roots.values()))]
        try:
            file = (home / unquote(name)).resolve()
            inside = any(file.is_relative_to(root) for root in roots) and file.is_file()
        except (OSError, ValueError, RuntimeError):  # a name that no file can have
            inside = False
        if not inside:
            raise UnusableMeshError(f"names file {ascii(name)[:60]}, which is missing or outside the asset's folder")
        self._check_bytes(file.stat().st_size, file)
        return read_bounded(file, self.limits.max_mesh_bytes, "mesh buffer")

    def _check_bytes(self, count: int, path: Path) -> None:
        if self._num_bytes + count > self.limits.max_total_mesh_bytes:
            raise AssetError(
                f"the meshes are over the limit of {self.limits.max_total_mesh_bytes / 1e6:.0f} MB in all",
                path,
                "raise LoadLimits.max_total_mesh_bytes if you trust the file",
            )

    def _take(self, contents: list[bytes], path: Path) -> None:
        """Add what a mesh is made of to the object's digest."""
        for content in contents:
            self._check_bytes(len(content), path)
            self._num_bytes += len(content)
        self.contents += contents


def merge_shapes(shapes: list[tuple[Array, NDArray[np.int32], Array]]) -> tuple[Array, NDArray[np.int32]]:
    """One mesh out of several, each with its (4, 4) transform into the common frame."""
    if not shapes:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int32)
    offsets = np.cumsum([0, *(len(v) for v, _, _ in shapes[:-1])])
    vertices = np.concatenate([transform_points(T, v) for v, _, T in shapes])
    faces = np.concatenate([f + offset for (_, f, _), offset in zip(shapes, offsets, strict=True)])
    return vertices, faces.astype(np.int32)
