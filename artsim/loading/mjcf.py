"""MJCF: MuJoCo's own parser and compiler say where bodies, joints and shapes are; here they become links and joints.

========================================  =============================================================================
The document                              is read as
========================================  =============================================================================
a body without a joint                    held by its parent
hinge with a range, without one           revolute, continuous
slide with a range, without one           prismatic; without: 1 m either way
several joints of one body                a chain of links without mass; the body is its last
a free joint                              the object's own pose; of several objects, see ``scene_objects``
equalities                                mimic, or held; see ``mjcf_equalities``
geoms that nothing collides with          shown; where they have no group of their own, everything in groups 0 to 2 is
geoms of alpha 0                          not shown
geoms that collide                        collision geometry; meshes as their convex hull, as MuJoCo takes them
ball joints                               three hinges about x, y and z
========================================  =============================================================================
"""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from artsim.common.extras import import_mujoco
from artsim.common.names import unused_name
from artsim.common.products import apply
from artsim.errors import AssetError
from artsim.loading.meshes import MeshReader, UnusableMeshError
from artsim.loading.mjcf_equalities import EqualityReader
from artsim.loading.mjcf_shapes import ShapeReader, Shapes, numbers, rotation
from artsim.loading.mjcf_xml import SafeMjcf, safe_mjcf
from artsim.loading.scene_objects import WORLD, WorldJoint, WorldLink
from artsim.loading.urdf_document import MeshFile, UrdfRobot
from artsim.loading.xml_values import Element
from artsim.loading.zero_pose import as_document
from artsim.model.inertia import Inertia
from artsim.model.objects import JointDynamics, Mesh, Repair


def read_mjcf(
    data: bytes, file: Path, reader: MeshReader, body: str | None = None
) -> tuple[UrdfRobot, list[Repair], list[bytes]]:
    """Links and joints of an MJCF document, as :func:`artsim.loading.documents.read_document` gives them."""
    mujoco = import_mujoco("MJCF files")

    repairs: list[Repair] = []
    document = safe_mjcf(data, file, reader.paths, reader.limits, repairs)
    meshes = {name: _read_mesh(filename, reader, file) for name, filename in document.meshes.items()}
    spec, model = _compile(mujoco, document, meshes, file, repairs)
    _set_total_mass(model, document.total_mass, file)
    state = mujoco.MjData(model)
    for j in range(model.njnt):
        if model.jnt_type[j] in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
            state.qpos[model.jnt_qposadr[j]] = 0.0
    mujoco.mj_kinematics(model, state)
    placed = _placed_meshes(spec, meshes)
    shapes = ShapeReader(mujoco, model, state, placed, document.unread, file, reader.limits, repairs).shapes()
    links = _ModelReader(mujoco, model, state, shapes, file, repairs).links()
    return as_document(links, file, repairs, body), repairs, document.contents


def _read_mesh(filename: str, reader: MeshReader, file: Path) -> Mesh:
    """A mesh file's vertices and triangles, as they stand in the file."""
    try:
        return reader.shape(MeshFile(filename))
    except UnusableMeshError as problem:
        fix = getattr(problem.__cause__, "fix", "restore the file, or save it as .obj or .stl")
        raise AssetError(str(problem), file, fix) from problem


def _compile(
    mujoco: Any, document: SafeMjcf, meshes: Mapping[str, Mesh], file: Path, repairs: list[Repair]
) -> tuple[Any, Any]:
    """The model as MuJoCo has it; meshes are handed over, so that it reads no file, and writes none."""
    own = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: repairs.append(Repair("MuJoCo", str(text))))  # else a file in this folder
    try:
        spec = mujoco.MjSpec.from_string(document.text)
        for mesh in spec.meshes:
            if mesh.name in meshes:
                vertices, faces = meshes[mesh.name]
                mesh.uservert = vertices.astype(np.float32).ravel()
                mesh.userface = faces.astype(np.int32).ravel()
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            model = spec.compile()
        repairs += [Repair("MuJoCo", text) for text in dict.fromkeys(str(warning.message) for warning in said)]
        return spec, model
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        if document.left_out:  # then it is not the file that MuJoCo refuses
            without = ", ".join(document.left_out)
            raise AssetError(
                f"{without} is not read, and the rest is no model ({reason})", file, f"remove or replace {without}"
            ) from error
        raise AssetError(f"MuJoCo refuses it ({reason})", file, "correct what it names") from error
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
        turn = rotation(np.asarray(mesh.refquat, dtype=np.float64))
        scale = np.asarray(mesh.scale, dtype=np.float64)
        vertices = apply(turn.T, vertices - np.asarray(mesh.refpos, dtype=np.float64)) * scale
        placed[mesh.name] = vertices, faces[:, ::-1] if np.prod(np.sign(scale)) < 0 else faces
    return placed


class _ModelReader:
    """Writes a compiled model, posed at the zero of its joints, as links and joints in the world."""

    def __init__(
        self, mujoco: Any, model: Any, state: Any, shapes: tuple[Shapes, Shapes], file: Path, repairs: list[Repair]
    ):
        self._joint_types = numbers(mujoco.mjtJoint)
        self._model, self._state, self._shapes = model, state, shapes
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
        self._equalities = EqualityReader(mujoco, model, self._joints, self._bodies, repairs)

    def links(self) -> list[WorldLink]:
        """The world, then every body after its parent, each after the links of its further joints."""
        model = self._model
        shown, solid = ({b: list(found) for b, found in shapes.items()} for shapes in self._shapes)
        links = [WorldLink(WORLD, shapes=shown.get(0, []), collision=solid.get(0, []))]
        index = [0]
        for b in range(1, model.nbody):
            parent = index[model.body_parentid[b]]
            start = int(model.body_jntadr[b])
            joints = [joint for j in range(start, start + int(model.body_jntnum[b])) for joint in self._joints_of(j)]
            *further, joint = joints or [self._fixed(b)]
            for other in further:
                helper = unused_name(f"{self._bodies[b]}_{other.name}", self._used)
                links.append(WorldLink(helper, parent, other))
                parent = len(links) - 1
            index.append(len(links))
            shapes, collision = shown.get(b, []), solid.get(b, [])
            links.append(WorldLink(self._bodies[b], parent, joint, shapes, collision, self._inertia(b)))
        return links

    def _fixed(self, b: int) -> WorldJoint:
        name = unused_name(f"{self._bodies[b]}_fixed", self._joint_names)
        return WorldJoint(name, "fixed", self._state.xpos[b].copy(), np.array([1.0, 0.0, 0.0]))

    def _joints_of(self, j: int) -> list[WorldJoint]:
        """A joint; a ball joint as three hinges about the axes of its body, x first."""
        if self._model.jnt_type[j] != self._joint_types.mjJNT_BALL:
            return [self._joint(j)]
        model, name = self._model, self._joints[j]
        largest = float(model.jnt_range[j, 1]) if model.jnt_limited[j] else np.inf
        said = "a ball joint: read as three hinges about the x, y and z of its body"
        if np.isfinite(largest):
            said += f", each up to {np.degrees(largest):.4g} deg either way, which the whole turn may not exceed there"
        self._repairs.append(Repair(f"joint {name!r}", said))
        axes = self._state.xmat[model.jnt_bodyid[j]].reshape(3, 3).T
        kind, dynamics = "continuous" if largest == np.inf else "revolute", self._dynamics(j)
        return [
            WorldJoint(unused_name(f"{name}_{letter}", self._joint_names), kind, self._state.xanchor[j].copy(),
                       axis.copy(), -largest, largest, None, dynamics)
            for letter, axis in zip("xyz", axes, strict=True)
        ]  # fmt: skip

    def _joint(self, j: int) -> WorldJoint:
        model, name, kind = self._model, self._joints[j], self._model.jnt_type[j]
        anchor = self._state.xanchor[j].copy()
        if kind == self._joint_types.mjJNT_FREE:
            return WorldJoint(name, "floating", self._state.xpos[model.jnt_bodyid[j]].copy(), np.array([1.0, 0.0, 0.0]))
        slides = kind == self._joint_types.mjJNT_SLIDE
        lower, upper = -np.inf, np.inf
        if j in self._equalities.held:
            lower = upper = self._equalities.held[j]
        elif model.jnt_limited[j]:
            lower, upper = model.jnt_range[j].tolist()
        kind = "prismatic" if slides else "revolute" if np.isfinite(lower) else "continuous"
        mimic = self._equalities.mimics.get(j)
        return WorldJoint(name, kind, anchor, self._state.xaxis[j].copy(), lower, upper, mimic, self._dynamics(j))

    def _dynamics(self, j: int) -> JointDynamics:
        model, dof = self._model, int(self._model.jnt_dofadr[j])
        q, spring = int(model.jnt_qposadr[j]), float(np.ravel(model.jnt_stiffness[j])[0])
        return JointDynamics(
            effort=float(np.abs(model.jnt_actfrcrange[j]).max()) if model.jnt_actfrclimited[j] else None,
            damping=float(np.ravel(model.dof_damping[dof])[0]),
            friction=float(model.dof_frictionloss[dof]),
            spring=spring if spring and model.qpos_spring[q] == model.qpos0[q] else None,
        )

    def _inertia(self, b: int) -> Inertia | None:
        mass = float(self._model.body_mass[b])
        if mass <= 0:
            return None
        turn = self._state.ximat[b].reshape(3, 3)
        return Inertia(mass, self._state.xipos[b].copy(), turn @ np.diag(self._model.body_inertia[b]) @ turn.T)
