"""MJCF: MuJoCo's own parser and compiler say where bodies, joints and shapes are; here they become links and joints.

========================================  =============================================================================
The document                              is read as
========================================  =============================================================================
a body without a joint                    held by its parent
hinge with a range, without one           revolute, continuous
slide with a range, without one           prismatic; without: 1 m either way
several joints of one body                a chain of links without mass; the body is its last
a free joint                              the object's own pose
an equality of two joints, linear         mimic
an equality of one joint                  held where it says
geoms that nothing collides with          shown; where they have no group of their own, everything in groups 0 to 2 is
geoms that collide                        collision geometry; meshes as their convex hull, as MuJoCo takes them
ball joints, loops of connect and weld    an error
========================================  =============================================================================
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from artsim.common.extras import import_mujoco
from artsim.common.products import apply
from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits, MeshReader, UnusableMeshError
from artsim.loading.mjcf_xml import safe_mjcf
from artsim.loading.primitives import ellipsoid
from artsim.loading.urdf_document import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    InlineMesh,
    MeshFile,
    MimicRelation,
    Shape,
    Sphere,
    UrdfRobot,
)
from artsim.loading.xml_values import Element
from artsim.loading.zero_pose import WORLD, WorldJoint, WorldLink, as_document, unused_name
from artsim.model.convex_bodies import convex_hull, is_convex
from artsim.model.inertia import Inertia
from artsim.model.kinematics import Array
from artsim.model.objects import JointDynamics, Mesh, Repair

_SHOWN_GROUPS = 3
"""MuJoCo's viewers show groups 0 to 2 unless they are told otherwise."""
_THIN = 1e-4
"""Metres of thickness that a flat mesh has where it collides."""


def read_mjcf(
    data: bytes, file: Path, reader: MeshReader, limits: LoadLimits
) -> tuple[UrdfRobot, list[Repair], list[bytes]]:
    """Links and joints of an MJCF document.

    Parameters
    ----------
    data : bytes
        Content of the file.
    file : Path
        Its path, for messages and as the root of names.
    reader : MeshReader
        Reads its meshes.
    limits : LoadLimits

    Returns
    -------
    robot : UrdfRobot
        With collision geometry and inertia.
    repairs : list of Repair
    contents : list of bytes
        Included files.

    Raises
    ------
    AssetError
        Naming what cannot be read.
    ConfigError
        When MuJoCo is not installed.
    """
    mujoco = import_mujoco("MJCF files")

    repairs: list[Repair] = []
    document = safe_mjcf(data, file, limits, repairs)
    meshes = {name: _read_mesh(filename, reader, file) for name, filename in document.meshes.items()}
    spec, model = _compile(mujoco, document.text, meshes, file, repairs)
    _set_total_mass(model, document.total_mass, file)
    state = mujoco.MjData(model)
    for j in range(model.njnt):
        if model.jnt_type[j] in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
            state.qpos[model.jnt_qposadr[j]] = 0.0
    mujoco.mj_kinematics(model, state)
    model_reader = _ModelReader(mujoco, model, state, _placed_meshes(spec, meshes), file, repairs)
    return as_document(model_reader.links(), file, repairs), repairs, document.contents


def _read_mesh(filename: str, reader: MeshReader, file: Path) -> Mesh:
    """A mesh file's vertices and triangles, as they stand in the file."""
    try:
        return reader.shape(Geometry(mesh=MeshFile(filename)))
    except UnusableMeshError as problem:
        fix = getattr(problem.__cause__, "fix", "restore the file, or save it as .obj or .stl")
        raise AssetError(str(problem), file, fix) from problem


def _compile(mujoco: Any, text: str, meshes: Mapping[str, Mesh], file: Path, repairs: list[Repair]) -> tuple[Any, Any]:
    """The model as MuJoCo has it; meshes are handed over, so that it reads no file, and writes none."""
    own = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: repairs.append(Repair("MuJoCo", str(text))))  # else a file in this folder
    try:
        spec = mujoco.MjSpec.from_string(text)
        for mesh in spec.meshes:
            if mesh.name in meshes:
                vertices, faces = meshes[mesh.name]
                mesh.uservert = vertices.astype(np.float32).ravel()
                mesh.userface = faces.astype(np.int32).ravel()
        return spec, spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise AssetError(f"MuJoCo refuses it ({reason})", file, "mend what it names") from error
    finally:
        mujoco.set_mju_user_warning(own)


def _set_total_mass(model: Any, total: str | None, file: Path) -> None:
    """Scale masses and moments, so that all bodies together weigh what the document says."""
    if total is None:
        return
    element = Element("<compiler>", file, [])
    mass = float(element.parsed(total, f"settotalmass={total[:60]!r}", (1,))[0])
    if 0.0 < mass < np.inf and model.body_mass.sum() > 0:  # MuJoCo takes others for none
        factor = mass / float(model.body_mass.sum())
        model.body_mass[:] *= factor
        model.body_inertia[:] *= factor


def _placed_meshes(spec: Any, meshes: Mapping[str, Mesh]) -> dict[str, Mesh]:
    """The meshes of files in full precision, moved, turned and scaled as their assets say."""
    placed = {}
    for mesh in spec.meshes:
        if mesh.name not in meshes:
            continue
        vertices, faces = meshes[mesh.name]
        turn = _rotation(np.asarray(mesh.refquat, dtype=np.float64))
        scale = np.asarray(mesh.scale, dtype=np.float64)
        vertices = apply(turn.T, vertices - np.asarray(mesh.refpos, dtype=np.float64)) * scale
        placed[mesh.name] = vertices, faces[:, ::-1] if np.prod(np.sign(scale)) < 0 else faces
    return placed


class _ModelReader:
    """Writes a compiled model, posed at the zero of its joints, as links and joints in the world."""

    def __init__(
        self, mujoco: Any, model: Any, state: Any, meshes: Mapping[str, Mesh], file: Path, repairs: list[Repair]
    ):
        self._types = _numbers(mujoco.mjtGeom)
        self._joint_types = _numbers(mujoco.mjtJoint)
        self._equality_types = _numbers(mujoco.mjtEq)
        self._model, self._state, self._meshes = model, state, meshes
        self._file, self._repairs = file, repairs
        used: set[str] = set()
        self._bodies = [unused_name(model.body(b).name or f"body{b}", used) for b in range(model.nbody)]
        self._used = used
        self._joints: list[str] = []
        names: set[str] = set()
        for j in range(model.njnt):
            name = model.joint(j).name or f"{self._bodies[model.jnt_bodyid[j]]}_joint"
            self._joints.append(unused_name(name, names))
        self._joint_names = names

    def links(self) -> list[WorldLink]:
        """The world, then every body after its parent, each after the links of its further joints."""
        model = self._model
        mimics, held = self._equalities()
        shapes, collision = self._geoms()
        links = [WorldLink(WORLD, shapes=shapes[0], collision=collision[0])]
        index = [0]
        for b in range(1, model.nbody):
            parent = index[model.body_parentid[b]]
            start = int(model.body_jntadr[b])
            joints = range(start, start + int(model.body_jntnum[b]))
            for j in joints[:-1]:
                helper = unused_name(f"{self._bodies[b]}_{self._joints[j]}", self._used)
                links.append(WorldLink(helper, parent, self._joint(j, mimics, held)))
                parent = len(links) - 1
            joint = self._joint(joints[-1], mimics, held) if joints else self._fixed(b)
            index.append(len(links))
            links.append(WorldLink(self._bodies[b], parent, joint, shapes[b], collision[b], self._inertia(b)))
        return links

    def _fixed(self, b: int) -> WorldJoint:
        name = unused_name(f"{self._bodies[b]}_fixed", self._joint_names)
        return WorldJoint(name, "fixed", self._state.xpos[b].copy(), np.array([1.0, 0.0, 0.0]))

    def _joint(self, j: int, mimics: Mapping[int, MimicRelation], held: Mapping[int, float]) -> WorldJoint:
        model, name, kind = self._model, self._joints[j], self._model.jnt_type[j]
        anchor = self._state.xanchor[j].copy()
        if kind == self._joint_types.mjJNT_FREE:
            return WorldJoint(name, "floating", self._state.xpos[model.jnt_bodyid[j]].copy(), np.array([1.0, 0.0, 0.0]))
        if kind == self._joint_types.mjJNT_BALL:
            raise AssetError(
                "a ball joint is not supported", f"{self._file}: joint {name!r}", "write three hinges in its place"
            )
        slides = kind == self._joint_types.mjJNT_SLIDE
        lower, upper = -np.inf, np.inf
        if j in held:
            lower = upper = held[j]
        elif model.jnt_limited[j]:
            lower, upper = model.jnt_range[j].tolist()
        kind = "prismatic" if slides else "revolute" if np.isfinite(lower) else "continuous"
        dof = int(model.jnt_dofadr[j])
        dynamics = JointDynamics(
            effort=float(np.abs(model.jnt_actfrcrange[j]).max()) if model.jnt_actfrclimited[j] else None,
            damping=float(np.ravel(model.dof_damping[dof])[0]),
            friction=float(model.dof_frictionloss[dof]),
        )
        return WorldJoint(name, kind, anchor, self._state.xaxis[j].copy(), lower, upper, mimics.get(j), dynamics)

    def _equalities(self) -> tuple[dict[int, MimicRelation], dict[int, float]]:
        """What joints follow, and where others are held; values count from 0, where MuJoCo's count from ``ref``."""
        model, types = self._model, self._equality_types
        mimics: dict[int, MimicRelation] = {}
        held: dict[int, float] = {}
        for e in range(model.neq):
            if not model.eq_active0[e]:
                continue
            if model.eq_type[e] != types.mjEQ_JOINT:
                raise AssetError(
                    "a connect or weld constraint closes a chain, and closed chains are not trees",
                    f"{self._file}: <equality>",
                    'remove it, or write active="false" if it can be done without',
                )
            joint, source = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
            shift, rate, *bent = model.eq_data[e, :5].tolist()
            own = float(model.qpos0[model.jnt_qposadr[joint]])
            if source < 0:
                held[joint] = own + shift
                continue
            if any(bent):
                self._repairs.append(
                    Repair(f"joint {self._joints[joint]!r}", "follows another along a curve: read as its tangent at 0")
                )
            offset = own + shift - rate * float(model.qpos0[model.jnt_qposadr[source]])
            mimics[joint] = MimicRelation(self._joints[source], rate, offset)
        return mimics, held

    def _inertia(self, b: int) -> Inertia | None:
        mass = float(self._model.body_mass[b])
        if mass <= 0:
            return None
        turn = self._state.ximat[b].reshape(3, 3)
        return Inertia(mass, self._state.xipos[b].copy(), turn @ np.diag(self._model.body_inertia[b]) @ turn.T)

    def _geoms(self) -> tuple[dict[int, list[Shape]], dict[int, list[Shape]]]:
        """Shapes that each body shows, and that collide."""
        model = self._model
        found: dict[int, list[tuple[int, Shape]]] = defaultdict(list)
        skipped = set()
        for g in range(model.ngeom):
            geometry = self._geometry(g)
            if geometry is None:
                names = {number: name for name, number in vars(self._types).items()}
                skipped.add(names[int(model.geom_type[g])].removeprefix("mjGEOM_").lower())
                continue
            found[int(model.geom_bodyid[g])].append((g, Shape(geometry, self._geom_pose(g))))
        for kind in sorted(skipped):
            self._repairs.append(Repair("geoms", f"of type {kind} left out: they are no surface of an object"))
        every = [g for geoms in found.values() for g, _ in geoms]
        solid = {int(model.geom_group[g]) for g in every if self._collides(g)}
        seen_only = {int(model.geom_group[g]) for g in every if not self._collides(g)}
        marked = min(seen_only, default=_SHOWN_GROUPS) < _SHOWN_GROUPS and not seen_only & solid
        shapes: dict[int, list[Shape]] = defaultdict(list)
        collision: dict[int, list[Shape]] = defaultdict(list)
        for b, geoms in found.items():
            seen = [(g, shape) for g, shape in geoms if model.geom_group[g] < _SHOWN_GROUPS]
            if marked:  # shapes to be seen have groups of their own: those that collide are seen where there are none
                seen = [(g, shape) for g, shape in seen if not self._collides(g)] or seen
            shapes[b] = [shape for _, shape in seen]
            collision[b] = [_convex(shape) for g, shape in geoms if self._collides(g)]
        if every and not any(shapes.values()):
            self._repairs.append(Repair("file", "shows no geom of the groups 0 to 2: all geoms are shown"))
            shapes = defaultdict(list, {b: [shape for _, shape in geoms] for b, geoms in found.items()})
        return shapes, collision

    def _collides(self, g: int) -> bool:
        return bool(self._model.geom_contype[g] or self._model.geom_conaffinity[g])

    def _geom_pose(self, g: int) -> Array:
        """(4, 4) frame of a shape, as its document or mesh file has it, in the world."""
        T = _pose(self._state.geom_xpos[g], self._state.geom_xmat[g].reshape(3, 3))
        if self._model.geom_type[g] == self._types.mjGEOM_MESH:
            # MuJoCo moves meshes into the frame of their own inertia.
            mesh = int(self._model.geom_dataid[g])
            T_file_mesh = _pose(self._model.mesh_pos[mesh], _rotation(self._model.mesh_quat[mesh]))
            T = T @ np.linalg.inv(T_file_mesh)
        return T

    def _geometry(self, g: int) -> Geometry | None:
        """A shape; None for what is no surface of an object."""
        types, kind = self._types, self._model.geom_type[g]
        size = self._model.geom_size[g].copy()
        if kind == types.mjGEOM_MESH:
            return Geometry(inline=self._mesh(int(self._model.geom_dataid[g])))
        if kind == types.mjGEOM_BOX:
            return Geometry(box=Box(2.0 * size))
        if kind == types.mjGEOM_SPHERE:
            return Geometry(sphere=Sphere(float(size[0])))
        if kind == types.mjGEOM_CAPSULE:
            return Geometry(capsule=Capsule(float(size[0]), 2.0 * float(size[1])))
        if kind == types.mjGEOM_CYLINDER:
            return Geometry(cylinder=Cylinder(float(size[0]), 2.0 * float(size[1])))
        if kind == types.mjGEOM_ELLIPSOID:
            return Geometry(inline=InlineMesh("ellipsoid", *ellipsoid(size)))
        return None

    def _mesh(self, mesh: int) -> InlineMesh:
        model, name = self._model, str(self._model.mesh(mesh).name)
        if name in self._meshes:
            return InlineMesh(name, *self._meshes[name])
        # Written in the document itself: MuJoCo has it alone, in single precision.
        start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        first, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        turn = _rotation(model.mesh_quat[mesh])
        vertices = model.mesh_vert[start : start + count].astype(np.float64)
        vertices = apply(turn, vertices) + model.mesh_pos[mesh]
        return InlineMesh(name, vertices, model.mesh_face[first : first + faces].astype(np.int32))


def _convex(shape: Shape) -> Shape:
    """A shape as MuJoCo lets it collide: a mesh as its convex hull."""
    mesh = shape.geometry.inline
    if mesh is None or is_convex(mesh.vertices, mesh.faces):
        return shape
    hull = convex_hull(mesh.vertices, _THIN)
    return replace(shape, geometry=Geometry(inline=InlineMesh(mesh.name, *hull)))


def _numbers(enumeration: Any) -> SimpleNamespace:
    """Members of one of MuJoCo's enumerations as the whole numbers that its arrays hold."""
    return SimpleNamespace(**{name: int(value) for name, value in enumeration.__members__.items()})


def _pose(position: Array, rotation: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation, position
    return T


def _rotation(quaternion: Sequence[float] | Array) -> Array:
    """(3, 3) rotation of a quaternion w, x, y, z of any length."""
    from scipy.spatial.transform import Rotation

    w, x, y, z = np.asarray(quaternion, dtype=np.float64).tolist()
    matrix: Array = Rotation.from_quat([x, y, z, w]).as_matrix()
    return matrix
