"""Geoms of a compiled MJCF model: what each body shows, and what of it collides.

A geom is seen where MuJoCo's viewers draw it: its group is 0, 1 or 2, and its colour or material lets something be
seen of it. Where shapes to be seen have groups of their own, a body that has some shows nothing else.
"""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from artsim.common.products import apply
from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits, check_copies, check_range
from artsim.loading.primitives import ellipsoid
from artsim.loading.urdf_document import Box, Capsule, Cylinder, Geometry, InlineMesh, Shape, Sphere
from artsim.model.convex_bodies import convex_hull, is_convex
from artsim.model.kinematics import Array
from artsim.model.objects import Mesh, Repair
from artsim.model.transforms import compose_transform, rotation_of_quaternion

_SHOWN_GROUPS = 3
"""MuJoCo's viewers show groups 0 to 2 unless they are told otherwise."""
_CLEAR = 0.5 / 255.0
"""Opacity that no picture of 8 bits shows."""
_NO_COLOUR = (0.5, 0.5, 0.5, 1.0)
"""Colour of a geom whose document gives it none: that of its material counts."""
_NO_TURN = 1e-15
"""Length of a quaternion up to which MuJoCo takes it for no rotation."""
_THIN = 1e-4
"""Metres of thickness that a flat mesh has where it collides."""

Shapes = Mapping[int, Sequence[Shape]]
"""Of each body, by its number."""


class ShapeReader:
    """Reads the geoms of a compiled model, posed at the zero of its joints.

    Parameters
    ----------
    mujoco : module
    model, state : MjModel, MjData
    meshes : mapping of str to Mesh
        Meshes of files, by the names of their assets, in full precision.
    unread : collection of str
        Names of meshes that only a plugin makes.
    """

    def __init__(
        self, mujoco: Any, model: Any, state: Any, meshes: Mapping[str, Mesh], unread: set[str], file: Path,
        limits: LoadLimits, repairs: list[Repair],
    ):  # fmt: skip
        self._types = numbers(mujoco.mjtGeom)
        self._model, self._state, self._files, self._unread = model, state, meshes, unread
        self._file, self._limits, self._repairs = file, limits, repairs
        self._meshes: dict[int, InlineMesh] = {}
        self._hulls: dict[int, InlineMesh] = {}

    def shapes(self) -> tuple[Shapes, Shapes]:
        """Shapes that each body shows, and that collide.

        Raises
        ------
        AssetError
            When nothing of them can be seen or touched, or they are too large.
        """
        self._check_size()
        found: dict[int, list[int]] = defaultdict(list)
        skipped: dict[str, None] = {}
        for g in range(self._model.ngeom):
            reason = self._unreadable(g)
            if reason is None:
                found[int(self._model.geom_bodyid[g])].append(g)
            else:
                skipped[reason] = None
        for reason in sorted(skipped):
            self._repairs.append(Repair("geoms", reason))
        if not found:
            why = f": those {'; those '.join(sorted(skipped))}" if skipped else ""
            raise AssetError(f"it has no geom that is a surface{why}", self._file, "give a body a geom to be seen")
        shown = self._shown(found)
        shapes = {b: [Shape(self._geometry(g), self._pose(g)) for g in geoms] for b, geoms in shown.items()}
        collision = {
            b: [Shape(self._convex(g), self._pose(g)) for g in geoms if self._collides(g)] for b, geoms in found.items()
        }
        return shapes, collision

    def _shown(self, found: Mapping[int, Sequence[int]]) -> dict[int, list[int]]:
        """Geoms of each body that are to be seen."""
        group = self._model.geom_group
        clear = {g for geoms in found.values() for g in geoms if self._is_clear(g)}
        drawn = {b: [g for g in geoms if g not in clear] for b, geoms in found.items()}
        every = [g for geoms in drawn.values() for g in geoms]
        seen = {b: [g for g in geoms if group[g] < _SHOWN_GROUPS] for b, geoms in drawn.items()}
        if clear:
            names = ", ".join(sorted({self._name(g) for g in clear})[:5])
            self._repairs.append(Repair("geoms", f"{len(clear)} left out: their alpha is 0 ({names})", note=True))
        if any(seen.values()):
            solid = {int(group[g]) for g in every if self._collides(g)}
            seen_only = {int(group[g]) for g in every if not self._collides(g)}
            if min(seen_only, default=_SHOWN_GROUPS) < _SHOWN_GROUPS and not seen_only & solid:
                # Shapes to be seen have groups of their own: those that collide are seen where there are none.
                seen = {b: [g for g in geoms if not self._collides(g)] or geoms for b, geoms in seen.items()}
            return seen
        if every:
            self._repairs.append(Repair("file", "shows no geom of the groups 0 to 2: all geoms are shown"))
            return drawn
        touched = {b: [g for g in geoms if self._collides(g)] for b, geoms in found.items()}
        if any(touched.values()):
            self._repairs.append(Repair("file", "all its geoms have alpha 0: those that collide are shown"))
        elif clear:
            raise AssetError(
                "none of its geoms can be seen or touched: all have alpha 0 and collide with nothing",
                self._file,
                "give those that are surfaces an alpha above 0",
            )
        return touched

    def _name(self, g: int) -> str:
        return str(self._model.geom(g).name) or f"geom {g}"

    def _is_clear(self, g: int) -> bool:
        """Whether a geom's colour, or that of its material, lets nothing be seen of it."""
        colour, material = self._model.geom_rgba[g], int(self._model.geom_matid[g])
        if material >= 0 and np.allclose(colour, _NO_COLOUR, atol=1e-6):
            colour = self._model.mat_rgba[material]
        return bool(colour[3] < _CLEAR)

    def _collides(self, g: int) -> bool:
        return bool(self._model.geom_contype[g] or self._model.geom_conaffinity[g])

    def _unreadable(self, g: int) -> str | None:
        """Why a geom is no surface that is read; None where it is."""
        types, kind = self._types, int(self._model.geom_type[g])
        mesh = int(self._model.geom_dataid[g])
        if mesh >= 0 and kind != types.mjGEOM_HFIELD and str(self._model.mesh(mesh).name) in self._unread:
            return "of meshes that a plugin makes left out: what they look like and weigh is not known"
        if kind in (
            types.mjGEOM_MESH, types.mjGEOM_BOX, types.mjGEOM_SPHERE, types.mjGEOM_CAPSULE, types.mjGEOM_CYLINDER,
            types.mjGEOM_ELLIPSOID,
        ):  # fmt: skip
            return None
        name = next(name for name, number in vars(types).items() if number == kind)
        return f"of type {name.removeprefix('mjGEOM_').lower()} left out: they are no surface of an object"

    def _check_size(self) -> None:
        """Refuse what is too large before anything is made of it."""
        model = self._model
        is_mesh = model.geom_type == self._types.mjGEOM_MESH
        used = model.geom_dataid[is_mesh]
        faces = int(model.mesh_facenum[used].astype(np.int64).sum())
        check_copies(faces - int(model.mesh_facenum[np.unique(used)].sum()), self._file, self._limits)
        if faces > self._limits.max_faces:
            raise AssetError(
                f"the object has more than {self._limits.max_faces} triangles",
                self._file,
                "decimate its meshes or raise LoadLimits.max_faces",
            )

    def _pose(self, g: int) -> Array:
        """(4, 4) frame of a shape, as its document or mesh file has it, in the world."""
        T = compose_transform(self._state.geom_xpos[g], self._state.geom_xmat[g].reshape(3, 3))
        if self._model.geom_type[g] == self._types.mjGEOM_MESH:
            # MuJoCo moves meshes into the frame of their own inertia.
            mesh = int(self._model.geom_dataid[g])
            T_file_mesh = compose_transform(self._model.mesh_pos[mesh], rotation(self._model.mesh_quat[mesh]))
            T = T @ np.linalg.inv(T_file_mesh)
        return T

    def _geometry(self, g: int) -> Geometry:
        types, kind = self._types, self._model.geom_type[g]
        size = self._model.geom_size[g].copy()
        if kind == types.mjGEOM_MESH:
            return self._mesh(int(self._model.geom_dataid[g]))
        if kind == types.mjGEOM_BOX:
            return Box(2.0 * size)
        if kind == types.mjGEOM_SPHERE:
            return Sphere(float(size[0]))
        if kind == types.mjGEOM_CAPSULE:
            return Capsule(float(size[0]), 2.0 * float(size[1]))
        if kind == types.mjGEOM_CYLINDER:
            return Cylinder(float(size[0]), 2.0 * float(size[1]))
        return InlineMesh("ellipsoid", *ellipsoid(size))

    def _mesh(self, mesh: int) -> InlineMesh:
        if mesh not in self._meshes:
            name = str(self._model.mesh(mesh).name)
            vertices, faces = self._files.get(name) or self._compiled(mesh)
            check_range(vertices, f"{self._file}: mesh {name!r}")
            self._meshes[mesh] = InlineMesh(name, vertices, faces)
        return self._meshes[mesh]

    def _compiled(self, mesh: int) -> Mesh:
        """A mesh that stands in the document itself: MuJoCo has it alone, in single precision."""
        model = self._model
        start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        first, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        turn = rotation(model.mesh_quat[mesh])
        vertices = model.mesh_vert[start : start + count].astype(np.float64)
        vertices = apply(turn, vertices) + model.mesh_pos[mesh]
        return vertices, model.mesh_face[first : first + faces].astype(np.int32)

    def _convex(self, g: int) -> Geometry:
        """A geom as MuJoCo lets it collide: a mesh as its convex hull, which is made once."""
        mesh = self._geometry(g)
        if not isinstance(mesh, InlineMesh) or self._model.geom_type[g] != self._types.mjGEOM_MESH:
            return mesh
        number = int(self._model.geom_dataid[g])
        if number not in self._hulls:
            convex = is_convex(mesh.vertices, mesh.faces)
            self._hulls[number] = mesh if convex else InlineMesh(mesh.name, *convex_hull(mesh.vertices, _THIN))
        return self._hulls[number]


def numbers(enumeration: Any) -> SimpleNamespace:
    """Members of one of MuJoCo's enumerations as the whole numbers that its arrays hold."""
    return SimpleNamespace(**{name: int(value) for name, value in enumeration.__members__.items()})


def rotation(quaternion: Sequence[float] | Array) -> Array:
    """(3, 3) rotation of a quaternion w, x, y, z of any length; none where it is 0, as MuJoCo has it."""
    w, *vector = np.asarray(quaternion, dtype=np.float64).tolist()
    length = math.hypot(w, *vector)
    return rotation_of_quaternion(np.array([*vector, w]) / length) if length > _NO_TURN else np.eye(3)
