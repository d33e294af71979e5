"""Grasps of movable parts by a parallel gripper: antipodal pairs of places, kept where the gripper opens the joint.

A grasp's frame stands between the pads of the fingers: Z is where the hand points as it comes (the hand lies on its -Z
side), Y is the line along which the fingers close. ``T_part_grasp`` has it in the part's frame, whose axes and origin
are those of the object's rest frame at rest.

Candidates are pairs of points of the part's surface that face each other within the cone of friction (Nguyen 1988),
with the hand turned about the line between them. The hand comes along its Z axis and must touch nothing; in MuJoCo it
then closes, follows the way that the part takes as its joint opens, and must have taken the part with it.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.extras import import_mujoco
from artsim.export.mjcf import mjcf_text
from artsim.export.options import ExportOptions
from artsim.export.text import obj_text
from artsim.model.details import GRIPS, detail_of_faces
from artsim.model.draws import farther_ends
from artsim.model.joints import ROTATING
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import as_robot
from artsim.model.transforms import compose_transform

FRICTION_ANGLE = np.deg2rad(20.0)
"""Half the opening of the cone of friction in which pads hold: steel or rubber on wood and plastic holds more."""
_SAMPLES = 600
_ANGLES = 8
"""Directions from which the hand comes to one pair."""
_LOOKED = 2400
"""Candidates of a part for which the hand's way is looked at, at most: between keys it has room nowhere."""
_GRIPS_FIRST = 0.25
"""Factor on the turn of candidates on handles and knobs, which half of the points are on."""
_TRIED = 40
"""Candidates of a part that are tried in physics, at most."""
_THINNEST = 1e-3
_APPROACH = (0.0, 0.015, 0.03, 0.05, 0.08)
"""Metres before the grasp at which the hand must be free; most fail at the first."""
_ROTATION, _SLIDE = 0.5, 0.12
"""How far a joint is opened in the proof, radians and metres, or by half of its range where that is less."""
_CLOSING, _MOVING = 0.3, 1.5
"""Seconds."""
_FOLLOWED = 0.8
"""Share of the way that the joint must have gone at least."""
_SLIPPED = (0.02, np.deg2rad(30.0))
"""How far the part may move in the hand, metres and radians: what is flung is not held."""


@dataclass(frozen=True)
class Gripper:
    """A hand with two parallel fingers, metres and newtons. The defaults are those of the Franka Hand."""

    opening: float = 0.08
    """Between the pads, at most."""
    finger_width: float = 0.02
    finger_depth: float = 0.012
    """Along the line of closing."""
    finger_length: float = 0.05
    palm: tuple[float, float, float] = (0.06, 0.2, 0.07)
    """Sides along X, Y and Z."""
    force: float = 70.0
    """Of each finger."""
    mass: float = 0.73


@dataclass(frozen=True, eq=False)
class Grasps:
    """Kept grasps of an object."""

    part: NDArray[np.int64]
    """(G,) int64."""
    T_part_grasp: Array
    """(G, 4, 4) float. Metres, at the object's scale."""
    width: Array
    """(G,) float. Between the pads as they hold, metres."""
    opened: Array
    """(G,) float. How far the joint was opened in the proof, radians or metres."""
    tried: NDArray[np.int64]
    """(K,) int64. Candidates of each part that were tried in physics; 0 where no hand has room."""


def find_grasps(
    obj: ArticulatedObject, rng: np.random.Generator, count: int = 16, gripper: Gripper | None = None
) -> Grasps:
    """Grasps of every movable part that a gripper proves.

    Parameters
    ----------
    obj : ArticulatedObject
        With bodies and at rest at q = 0; see :func:`artsim.export.prepare`.
    rng : numpy Generator
        The same state gives the same grasps with the same version of MuJoCo.
    count : int
        Of each part, at most.
    gripper : Gripper, optional

    Raises
    ------
    AssetError
        When the object lacks what physics needs.
    ConfigError
        When MuJoCo is not installed.
    """
    gripper = gripper or Gripper()
    trial = _Trial(obj, gripper)
    rows: list[tuple[int, Array, float, float]] = []
    tried = np.zeros(len(obj), dtype=np.int64)
    for k in obj.tree.free_joints:
        kept = 0
        for T, width in _candidates(obj, k, gripper, rng)[:_LOOKED]:
            if kept == count or tried[k] == _TRIED:
                break
            if not trial.is_free(T):
                continue
            tried[k] += 1
            opened = trial.opens(k, T)
            if opened is not None:
                rows.append((k, T, width, opened))
                kept += 1
    return Grasps(
        np.array([row[0] for row in rows], dtype=np.int64),
        np.array([row[1] for row in rows], dtype=np.float64).reshape(-1, 4, 4),
        np.array([row[2] for row in rows], dtype=np.float64),
        np.array([row[3] for row in rows], dtype=np.float64),
        tried,
    )


def _candidates(
    obj: ArticulatedObject, k: int, gripper: Gripper, rng: np.random.Generator
) -> list[tuple[Array, float]]:
    """Grasp frames and widths of a part in a mixed order, at rest: those on handles and knobs mostly come first."""
    import trimesh

    part = obj.parts[k]
    mesh = trimesh.Trimesh(part.vertices * obj.scale, part.faces, process=False)
    if not len(mesh.faces) or not mesh.area > 0:
        return []
    grips = np.array([*(detail.label in GRIPS for detail in part.details), False])  # the last: faces of no detail
    on_grip = grips[detail_of_faces(part.vertices, part.faces, part.details)]
    chances = mesh.area_faces.copy()
    if 0.0 < (share := chances[on_grip].sum()) < mesh.area:
        chances[on_grip] *= (mesh.area - share) / share
    chances /= chances.sum()
    face = rng.choice(len(mesh.faces), _SAMPLES, p=chances)
    weights = rng.dirichlet(np.ones(3), _SAMPLES)
    points = np.einsum("nc,ncd->nd", weights, mesh.triangles[face])
    inwards = -mesh.face_normals[face]
    hits, ray, struck = mesh.ray.intersects_location(points + 1e-5 * inwards, inwards, multiple_hits=False)
    width = np.linalg.norm(hits - points[ray], axis=1)
    faces_back = np.einsum("nd,nd->n", mesh.face_normals[struck], inwards[ray]) > np.cos(FRICTION_ANGLE)
    good = np.flatnonzero(faces_back & (width > _THINNEST) & (width < gripper.opening - 2e-3))
    found = []
    for row in good:
        across = inwards[ray[row]]
        middle = 0.5 * (hits[row] + points[ray[row]])
        side = np.cross(across, np.eye(3)[np.argmin(np.abs(across))])
        side /= np.linalg.norm(side)
        for angle in 2.0 * np.pi * (np.arange(_ANGLES) + rng.random()) / _ANGLES:
            towards = np.cos(angle) * side + np.sin(angle) * np.cross(across, side)
            rotation = np.column_stack([np.cross(across, towards), across, towards])
            found.append((compose_transform(middle, rotation), float(width[row])))
    turn = rng.random(len(found)) * np.repeat(np.where(on_grip[face[ray[good]]], _GRIPS_FIRST, 1.0), _ANGLES)
    return [found[row] for row in np.argsort(turn)]


class _Trial:
    """An object and a hand in MuJoCo."""

    def __init__(self, obj: ArticulatedObject, gripper: Gripper):
        self.mujoco = mujoco = import_mujoco("grasps")
        self.obj, self.gripper = obj, gripper
        robot = as_robot(obj)
        files = {f"{mesh.name}.obj": obj_text(mesh).encode() for mesh in robot.meshes}
        spec = mujoco.MjSpec.from_string(mjcf_text(robot, ExportOptions()), assets=files)
        spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 20.0  # what is held hardly creeps
        _add_hand(mujoco, spec, gripper)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        owners = self.model.body_rootid
        hand = self.model.body("hand").id
        self.of_hand = owners[self.model.geom_bodyid] == owners[hand]
        self.fingers = [self.model.geom(f"finger{side}").id for side in (0, 1)]
        self.hand = self.model.joint("hand").qposadr[0]
        self.slides = [self.model.joint(f"finger{side}").qposadr[0] for side in (0, 1)]
        self.target = self.model.body("target").mocapid[0]
        self.latched = [(self.model.joint(joint.name), joint) for joint in robot.joints if joint.hold]
        self.joint = {k: self.model.joint(obj.tree.joints[k].name).qposadr[0] for k in obj.tree.free_joints}

    def _place(self, T: Array) -> None:
        quaternion = np.zeros(4)
        self.mujoco.mju_mat2Quat(quaternion, T[:3, :3].ravel())
        self.data.mocap_pos[self.target], self.data.mocap_quat[self.target] = T[:3, 3], quaternion

    def _reset(self, T: Array) -> None:
        self.mujoco.mj_resetData(self.model, self.data)
        self._place(T)
        self.data.qpos[self.hand : self.hand + 3] = self.data.mocap_pos[self.target]
        self.data.qpos[self.hand + 3 : self.hand + 7] = self.data.mocap_quat[self.target]
        self.mujoco.mj_forward(self.model, self.data)

    def _touched(self) -> NDArray[np.int64]:
        """Geoms of the hand that touch the object."""
        pairs = np.array([contact.geom for contact in self.data.contact], dtype=np.int64).reshape(-1, 2)
        mixed = pairs[self.of_hand[pairs].sum(axis=1) == 1]
        return mixed[self.of_hand[mixed]]

    def is_free(self, T: Array) -> bool:
        """Whether the open hand touches nothing on its way."""
        for back in _APPROACH:
            start = T.copy()
            start[:3, 3] -= back * T[:3, 2]
            self._reset(start)
            if len(self._touched()):
                return False
        return True

    def _step(self) -> None:
        """One time step with closing fingers; latches hold the joints, which MuJoCo knows nothing like."""
        self.data.ctrl[:] = self.gripper.force
        for named, joint in self.latched:
            self.data.qfrc_applied[named.dofadr[0]] = joint.held(float(self.data.qpos[named.qposadr[0]]))
        self.mujoco.mj_step(self.model, self.data)

    def opens(self, k: int, T: Array) -> float | None:
        """How far the hand opens the joint of part k from rest; None where it does not take the part along."""
        tree, model, data = self.obj.tree, self.model, self.data
        far = farther_ends(self.obj)[k] - tree.rest[k]
        most = _ROTATION if tree.types[k] in ROTATING else _SLIDE
        goal = np.sign(far) * min(0.5 * abs(far), most)
        self._reset(T)
        for _ in range(round(_CLOSING / model.opt.timestep)):
            self._step()
        steps = round(_MOVING / model.opt.timestep)
        for step in range(steps):
            self._place(self._moved(k, T, goal * (step + 1) / steps))
            self._step()
        moved = float(data.qpos[self.joint[k]] - tree.rest[k])
        if not (np.isfinite(moved) and moved / goal >= _FOLLOWED):
            return None
        held = set(self._touched().tolist()) >= set(self.fingers)
        return moved if held and self._is_kept(k, T, moved) else None

    def _moved(self, k: int, T: Array, by: float) -> Array:
        """The grasp T of part k once its joint has gone so far from rest."""
        tree = self.obj.tree
        q = tree.rest.copy()
        q[k] += by
        moved: Array = tree.forward_kinematics(tree.complete_state(q))[k] @ T
        return moved

    def _is_kept(self, k: int, T: Array, moved: float) -> bool:
        """Whether the part is in the hand as it was taken, but for what a hand may slip."""
        hand, wanted = self.data.body("hand"), self._moved(k, T, moved)
        turned = hand.xmat.reshape(3, 3).T @ wanted[:3, :3]
        angle = np.arccos(np.clip(0.5 * (np.trace(turned) - 1.0), -1.0, 1.0))
        return bool(np.linalg.norm(hand.xpos - wanted[:3, 3]) <= _SLIPPED[0] and angle <= _SLIPPED[1])


def _add_hand(mujoco: Any, spec: Any, gripper: Gripper) -> None:
    """A free hand that a spring holds at a target, its fingers open; the pads stand at its origin."""
    target = spec.worldbody.add_body(name="target", mocap=True)
    hand = spec.worldbody.add_body(name="hand", gravcomp=1.0)
    hand.add_freejoint(name="hand")
    x, y, z = gripper.palm
    box = mujoco.mjtGeom.mjGEOM_BOX
    behind = -gripper.finger_length - 0.5 * z + 0.5 * gripper.finger_width
    hand.add_geom(name="palm", type=box, size=[0.5 * x, 0.5 * y, 0.5 * z], pos=[0, 0, behind], mass=0.8 * gripper.mass)
    tip = 0.5 * gripper.finger_width  # pads are as long as they are wide
    for side, sign in enumerate((-1.0, 1.0)):
        finger = hand.add_body(name=f"finger{side}", gravcomp=1.0)
        finger.add_joint(
            name=f"finger{side}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0, -sign, 0], armature=0.05,
            range=[0, 0.5 * gripper.opening], limited=mujoco.mjtLimited.mjLIMITED_TRUE, damping=[20.0, 0.0, 0.0],
        )  # fmt: skip
        finger.add_geom(
            name=f"finger{side}", type=box, mass=0.1 * gripper.mass, friction=[1.0, 0.02, 0.001], condim=4,
            size=[0.5 * gripper.finger_width, 0.5 * gripper.finger_depth, 0.5 * gripper.finger_length],
            pos=[0, 0.5 * sign * (gripper.opening + gripper.finger_depth), tip - 0.5 * gripper.finger_length],
        )  # fmt: skip
        motor = spec.add_actuator(name=f"finger{side}", target=f"finger{side}")
        motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
    spec.add_exclude(bodyname1="finger0", bodyname2="finger1")
    for side in (0, 1):
        spec.add_exclude(bodyname1="hand", bodyname2=f"finger{side}")
    spec.add_equality(
        name="arm", type=mujoco.mjtEq.mjEQ_WELD, objtype=mujoco.mjtObj.mjOBJ_BODY, name1=target.name, name2=hand.name,
        data=[0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0], solref=[0.02, 1.0],
    )  # fmt: skip


def grasp_record(obj: ArticulatedObject, grasps: Grasps, gripper: Gripper) -> dict[str, Any]:
    """The grasps of an object in JSON's terms: by part, with the hand that proved them."""
    by_part: dict[str, Sequence[dict[str, Any]]] = {}
    for k in obj.tree.free_joints:
        rows = np.flatnonzero(grasps.part == k)
        by_part[obj.parts[k].name] = [
            {"T_part_grasp": grasps.T_part_grasp[row].tolist(), "width": float(grasps.width[row]),
             "opened": float(grasps.opened[row])} for row in rows
        ]  # fmt: skip
    return {
        "category": obj.category, "object_id": obj.object_id, "gripper": asdict(gripper),
        "tried": {obj.parts[k].name: int(grasps.tried[k]) for k in obj.tree.free_joints}, "parts": by_part,
    }  # fmt: skip
