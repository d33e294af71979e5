"""Triangles of the shapes that a URDF names: primitives, and OBJ, STL, DAE, GLB or PLY files.

Mesh files are untrusted: they must lie inside the asset's folder or a declared package root, are bounded in
size before they are parsed, and never make another file be opened.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artsim.errors import AssetError
from artsim.files import read_bounded
from artsim.kinematics import Array, transform_points
from artsim.loading.packages import AssetPaths, MissingFileError
from artsim.loading.primitives import capsule, cylinder, sphere
from artsim.loading.robot import Geometry, MeshFile
from artsim.loading.urdf_xml import safe_xml

FORMATS = (".obj", ".stl", ".dae", ".glb", ".ply")


@dataclass(frozen=True)
class LoadLimits:
    """What a loader accepts from a file nobody vouches for."""

    max_urdf_bytes: int = 16_000_000
    max_mesh_bytes: int = 100_000_000
    max_faces: int = 5_000_000
    """Triangles over the whole object."""
    max_links: int = 1_000


class UnusableMeshError(Exception):
    """One mesh cannot be used, and why; the loader leaves it out and says so."""


@dataclass
class MeshReader:
    """Reads the meshes of one URDF file.

    Attributes
    ----------
    folder : Path
        The URDF file's folder: the root of relative paths.
    package_roots : mapping of str to Path
        Folder of each declared ``package://`` name.
    limits : LoadLimits
    contents : list of bytes
        Bytes of every mesh file read, in order: they are part of the object's digest.
    """

    folder: Path
    package_roots: Mapping[str, Path]
    limits: LoadLimits
    contents: list[bytes] = field(default_factory=list)
    num_faces: int = 0

    def shape(self, geometry: Geometry) -> tuple[Array, NDArray[np.int32]]:
        """Vertices (V, 3) and triangles (F, 3) of a URDF geometry in its own frame.

        Raises
        ------
        UnusableMeshError
            When a mesh is missing, empty or broken.
        AssetError
            When a mesh lies outside the allowed folders or is over a limit.
        """
        import trimesh

        if geometry.box is not None:
            mesh = trimesh.creation.box(extents=geometry.box.size)
        elif geometry.cylinder is not None:
            return cylinder(geometry.cylinder.radius, geometry.cylinder.length)
        elif geometry.capsule is not None:
            return capsule(geometry.capsule.radius, geometry.capsule.length)
        elif geometry.sphere is not None:
            return sphere(geometry.sphere.radius)
        else:
            assert geometry.mesh is not None
            return self._file(geometry.mesh)
        return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32)

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
        path = self.resolve(reference.filename)
        kind = path.suffix.lower()
        if kind not in FORMATS:
            raise UnusableMeshError(f"mesh {reference.filename!r} is of a kind that is not read ({', '.join(FORMATS)})")
        data = read_bounded(path, self.limits.max_mesh_bytes, "mesh")
        self.contents.append(data)
        vertices, faces, dropped = triangles(data, kind, path)
        if len(faces) == 0:
            raise UnusableMeshError(f"mesh {reference.filename!r} has no faces")
        self.num_faces += len(faces)
        if self.num_faces > self.limits.max_faces:
            raise AssetError(
                f"the object has more than {self.limits.max_faces} triangles",
                path,
                "decimate its meshes or raise LoadLimits.max_faces",
            )
        if reference.scale is not None:
            vertices = vertices * np.asarray(reference.scale, dtype=np.float64)
            if np.prod(np.sign(np.broadcast_to(reference.scale, 3))) < 0:
                faces = faces[:, ::-1]
        if dropped:
            self.dropped_faces[reference.filename] = dropped
        return vertices, faces

    dropped_faces: dict[str, int] = field(default_factory=dict)


def triangles(data: bytes, kind: str, where: Path) -> tuple[Array, NDArray[np.int32], int]:
    """Vertices, triangles and the number of unusable triangles (not finite, or out of range) left out.

    Raises
    ------
    UnusableMeshError
        When the content cannot be parsed.
    """
    import trimesh

    if kind == ".dae":
        safe_xml(data, where)
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    try:
        loaded = trimesh.load_scene(io.BytesIO(data), file_type=kind[1:], process=False, skip_materials=True)
        mesh = loaded.to_mesh() if len(loaded.geometry) else None
    except AssetError:
        raise
    except Exception as error:  # parsers raise whatever they stumble on; the file is at fault either way
        raise UnusableMeshError(f"mesh {where.name!r} cannot be parsed ({type(error).__name__}: {error})") from error
    if mesh is None or not hasattr(mesh, "faces"):
        return np.zeros((0, 3)), np.zeros((0, 3), np.int32), 0
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    faces = np.asarray(mesh.faces, dtype=np.int64)
    usable = np.all((faces >= 0) & (faces < len(vertices)), axis=1)
    finite = np.all(np.isfinite(vertices), axis=1)
    usable &= finite[faces.clip(0, max(0, len(vertices) - 1))].all(axis=1)
    return *in_order_of_use(vertices, faces[usable]), int((~usable).sum())


def in_order_of_use(vertices: Array, faces: NDArray[np.int64]) -> tuple[Array, NDArray[np.int32]]:
    """The same triangles, their vertices in the order in which the faces name them, without those that none names.

    trimesh numbers vertices by an unstable sort, whose order of equals depends on the processor.
    """
    named = faces.ravel()
    first = np.full(len(vertices), len(named))
    np.minimum.at(first, named, np.arange(len(named)))
    order = np.argsort(first, kind="stable")[: np.count_nonzero(first < len(named))]
    number = np.empty(len(vertices), dtype=np.int32)
    number[order] = np.arange(len(order), dtype=np.int32)
    return vertices[order], number[faces]


def merged(shapes: list[tuple[Array, NDArray[np.int32], Array]]) -> tuple[Array, NDArray[np.int32]]:
    """One mesh out of several, each with its (4, 4) transform into the common frame."""
    if not shapes:
        return np.zeros((0, 3)), np.zeros((0, 3), np.int32)
    offsets = np.cumsum([0, *(len(v) for v, _, _ in shapes[:-1])])
    vertices = np.concatenate([transform_points(T, v) for v, _, T in shapes])
    faces = np.concatenate([f + offset for (_, f, _), offset in zip(shapes, offsets, strict=True)])
    return vertices, faces.astype(np.int32)
