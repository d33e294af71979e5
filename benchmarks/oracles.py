"""What MuJoCo and usd-core themselves say of a file, and how far the parts of its loaded object move from that."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from artsim.loading.zero_pose import unused_name
from artsim.model.kinematics import Array, invert_transform
from artsim.model.objects import ArticulatedObject

_FREE = 2.0
"""Radians or metres from 0 within which a joint without an end is posed."""
Poses = Callable[[Mapping[str, float]], Mapping[str, Array]]
"""(4, 4) frame in the world of each body by its name, for the values of joints by their names."""


class NoOracleError(Exception):
    """The format's own library refuses the file, or the file is of no articulated object, and why."""


def poses_of(file: Path) -> Poses:
    """The kinematics that the format's own library has of a file.

    Raises
    ------
    NoOracleError
    """
    return mujoco_poses(file) if file.suffix.lower() == ".xml" else usd_poses(file)


def deviation(obj: ArticulatedObject, poses: Poses, states: int, rng: np.random.Generator) -> tuple[int, float]:
    """How many parts have a body of the oracle, and how far they move from it.

    Parameters
    ----------
    obj : ArticulatedObject
    poses : callable
        See :data:`Poses`.
    states : int
        Random states within the limits, each against the one before.
    rng : Generator

    Returns
    -------
    parts : int
    deviation : float
        Largest difference of an entry of the (4, 4) motions, radians and metres.
    """
    T_base_rest = obj.T_base_rest
    low, high = np.clip(obj.tree.limits, -_FREE, _FREE).T
    largest, parts, before = 0.0, 0, None
    for q in rng.uniform(np.minimum(low, high), np.maximum(low, high), (states + 1, len(obj))):
        q = obj.tree.complete_state(q)
        found = poses(obj.source_state(q))
        own = T_base_rest @ obj.tree.forward_kinematics(q) @ invert_transform(T_base_rest)
        if before is not None:
            shared = [k for k, part in enumerate(obj.parts) if part.name in found]
            for k in shared:
                name = obj.parts[k].name
                moved = found[name] @ invert_transform(before[0][name])
                largest = max(largest, float(np.abs(own[k] @ invert_transform(before[1][k]) - moved).max()))
            parts = len(shared)
        before = found, own
    return parts, largest


def mujoco_poses(file: Path) -> Poses:
    """Forward kinematics of MuJoCo, which compiles the file itself; free bodies stay where the file has them."""
    import mujoco

    mujoco.set_mju_user_warning(lambda text: None)  # else it writes a file into this folder
    try:
        model = mujoco.MjModel.from_xml_path(str(file))
    except (ValueError, mujoco.FatalError) as error:
        raise NoOracleError(f"MuJoCo does not compile it: {' '.join(str(error).split())}") from error
    data = mujoco.MjData(model)
    bodies, joints = _names_of_mujoco(model)
    kinds = mujoco.mjtJoint
    address = {name: (int(model.jnt_type[j]), int(model.jnt_qposadr[j])) for j, name in enumerate(joints)}

    def poses(values: Mapping[str, float]) -> dict[str, Array]:
        data.qpos[:] = model.qpos0
        for name, (kind, at) in address.items():
            if kind in (int(kinds.mjJNT_SLIDE), int(kinds.mjJNT_HINGE)):
                data.qpos[at] = values.get(name, 0.0)
            elif kind == int(kinds.mjJNT_BALL):
                turn = Rotation.from_euler("XYZ", [values.get(f"{name}_{letter}", 0.0) for letter in "xyz"])
                data.qpos[at : at + 4] = np.roll(turn.as_quat(), 1)  # the real part first
        mujoco.mj_forward(model, data)
        found = {}
        for b, name in enumerate(bodies):
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = data.xmat[b].reshape(3, 3), data.xpos[b]
            found[name] = T
        return found

    return poses


def _names_of_mujoco(model: Any) -> tuple[list[str], list[str]]:
    """Bodies and joints of a model as the loader calls them, which names those that have no name."""
    used: set[str] = set()
    bodies = [unused_name(model.body(b).name or f"body{b}", used) for b in range(model.nbody)]
    names: set[str] = set()
    joints = [model.joint(j).name or f"{bodies[model.jnt_bodyid[j]]}_joint" for j in range(model.njnt)]
    return bodies, [unused_name(name, names) for name in joints]


def usd_poses(file: Path) -> Poses:
    """Forward kinematics by the frames that joints of a stage have in their two bodies, as usd-core reads them."""
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    try:
        stage = Usd.Stage.Open(str(file))
    except Exception as error:
        raise NoOracleError(f"usd-core does not open it: {' '.join(str(error).split())}") from error
    prims = list(stage.Traverse(Usd.TraverseInstanceProxies()))
    if not any(prim.IsA(UsdPhysics.Joint) and not prim.IsA(UsdPhysics.FixedJoint) for prim in prims):
        raise NoOracleError("it holds no joint that moves")
    unit, cache = UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.XformCache()
    turn = Gf.Matrix4d(1.0)
    if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y:
        turn = Gf.Matrix4d(Gf.Rotation(Gf.Vec3d(1, 0, 0), 90.0), Gf.Vec3d(0))

    def pose(prim: Any) -> Any:
        """A body's frame in the world of metres and Z up: of its transform, what is neither scale nor shear."""
        matrix = cache.GetLocalToWorldTransform(prim).RemoveScaleShear() * turn
        return matrix.SetTranslateOnly(matrix.ExtractTranslation() * unit)

    bodies = [prim for prim in prims if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    names: set[str] = {"world"}
    name_of = {prim.GetPath(): unused_name(prim.GetName(), names) for prim in bodies}
    stands = {"world": turn} | {name_of[prim.GetPath()]: pose(prim) for prim in bodies}
    used: set[str] = set()
    joints = [_joint_of(prim, stage, name_of, pose, unit, turn, used) for prim in _joints(prims)]
    carried = {ends[1] for _, ends, _ in joints}
    return _stage_poses(joints, dict(sorted(stands.items(), key=lambda item: item[0] in carried)))


def _joints(prims: list[Any]) -> list[Any]:
    from pxr import UsdPhysics

    return [
        p for p in prims if p.IsA(UsdPhysics.Joint) and UsdPhysics.Joint(p).GetJointEnabledAttr().Get() is not False
    ]


def _joint_of(
    prim: Any,
    stage: Any,
    name_of: Mapping[Any, str],
    pose: Callable[[Any], Any],
    unit: float,
    turn: Any,
    used: set[str],
) -> Any:
    """Names and axes of what a joint leaves free, its bodies and its frames."""
    from pxr import Gf, UsdPhysics

    joint = UsdPhysics.Joint(prim)
    ends, frames = [], []
    for relation, place, turned in (
        (joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
        (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()),
    ):
        target = next((stage.GetPrimAtPath(path) for path in relation.GetTargets()), None)
        body = target
        while body and body.GetPath() not in name_of:
            body = body.GetParent()
        scale = Gf.Vec3d(1.0) if not target else Gf.Transform(_local_to_world(target)).GetScale()
        at = Gf.CompMult(Gf.Vec3d(place.Get() or (0, 0, 0)), scale) * unit
        frame = Gf.Matrix4d(Gf.Rotation(Gf.Quatd(turned.Get() or Gf.Quatf(1))), at)
        if target and target != body:
            frame = frame * pose(target) * (pose(body) if body else turn).GetInverse()
        ends.append(name_of[body.GetPath()] if body else "world")
        frames.append(frame)
    steps = _axes(prim)
    own = [f"{prim.GetName()}_{axis}" if len(steps) > 1 else prim.GetName() for axis in steps]
    names = [unused_name(name, used) for name in own]
    return list(zip(names, steps, strict=True)), tuple(ends), frames


def _axes(prim: Any) -> list[str]:
    """What a joint leaves free, by the names of UsdPhysics's limits, from its first body on."""
    from pxr import UsdPhysics

    kind = str(prim.GetTypeName()).removeprefix("Physics").removesuffix("Joint")
    if kind == "Fixed":
        return []
    if kind in ("Revolute", "Prismatic", "Spherical"):
        axis = str(prim.GetAttribute("physics:axis").Get())
        swings = [f"rot{'XYZ'[('XYZ'.index(axis) + step) % 3]}" for step in (2, 1)] if kind == "Spherical" else []
        return [*swings, ("trans" if kind == "Prismatic" else "rot") + axis]
    free = []
    for name in (f"{word}{letter}" for word in ("trans", "rot") for letter in "XYZ"):
        limit = UsdPhysics.LimitAPI.Get(prim, name)
        if not prim.HasAPI(UsdPhysics.LimitAPI, name) or limit.GetLowAttr().Get() < limit.GetHighAttr().Get():
            free.append(name)
    return free


def _local_to_world(prim: Any) -> Any:
    from pxr import Usd, UsdGeom

    return UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())


def _stage_poses(joints: list[Any], stands: Mapping[str, Any]) -> Poses:
    pairs: dict[tuple[str, ...], list[Any]] = {}
    for steps, ends, frames in joints:
        pairs.setdefault(ends, []).append((steps, frames))

    def poses(values: Mapping[str, float]) -> dict[str, Array]:
        found = {"world": stands["world"]}
        for root in stands:  # the world, what nothing carries, and what hangs in a circle
            found.setdefault(root, stands[root])
            waiting = [root]
            while waiting:
                body = waiting.pop()
                for ends, pair in pairs.items():
                    if body not in ends or not all(end in stands for end in ends):
                        continue
                    side = ends.index(body)
                    child = ends[1 - side]
                    if child in found or child == body:
                        continue
                    second_in_first = _second_in_first(pair, values)
                    found[child] = (second_in_first if side == 0 else second_in_first.GetInverse()) * found[body]
                    waiting.append(child)
        return {name: np.array(matrix).T for name, matrix in found.items()}

    return poses


def _second_in_first(pair: list[Any], values: Mapping[str, float]) -> Any:
    """Pose of the second body in the first, for joints between them one after another; Gf's vectors are rows."""
    from pxr import Gf

    _, frames = pair[0]
    found = frames[1].GetInverse() * frames[0]
    for steps, (frame, _) in reversed(pair):
        motion = Gf.Matrix4d(1.0)
        for name, axis in reversed(steps):
            value, direction, step = (
                values.get(name, 0.0),
                Gf.Vec3d(*np.eye(3)["XYZ".index(axis[-1])]),
                Gf.Matrix4d(1.0),
            )
            if axis.startswith("rot"):
                step.SetRotate(Gf.Rotation(direction, float(np.degrees(value))))
            else:
                step.SetTranslate(direction * value)
            motion = motion * step
        found = found * frame.GetInverse() * motion * frame
    return found
