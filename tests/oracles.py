"""Kinematics of a file by other programs, and how far the parts of its loaded object are from theirs."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from artsim.common.extras import import_pybullet, silence_output
from artsim.common.names import unused_name
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform
from artsim.physics.simulators import poses_in_file
from tests.usd_oracle import ParsedStage

Poses = Callable[[dict[str, float]], Mapping[str, Array]]
"""(4, 4) frame in the world of each body by its name, for the values of joints by their names."""


class NoOracleError(Exception):
    """The other program refuses the file, or the file is of no articulated object, and why."""


def poses_of(file: Path) -> Poses:
    """The kinematics of a file by yourdfpy, by MuJoCo or by usd-core.

    Raises
    ------
    NoOracleError
    """
    if file.suffix.lower() == ".urdf":
        try:
            return poses_in_file(file)
        except Exception as error:  # it may refuse a file in any way it likes
            raise NoOracleError(f"yourdfpy does not read it: {error}") from error
    return mujoco_poses(file) if file.suffix.lower() == ".xml" else usd_poses(file)


def random_states(obj: ArticulatedObject, count: int) -> list[Array]:
    """The rest state, and states drawn within limits, or within 2 radians or metres of 0 where there is none."""
    low, high = np.clip(obj.tree.limits, -2.0, 2.0).T
    drawn = np.random.default_rng(0).uniform(np.minimum(low, high), np.maximum(low, high), (count, len(obj)))
    return [obj.tree.rest, *map(obj.tree.complete_state, drawn)]


def deviation(obj: ArticulatedObject, poses: Poses, states: Iterable[Array]) -> tuple[int, float]:
    """How many parts have a body of the oracle, and how far they move from it.

    Parameters
    ----------
    obj : ArticulatedObject
    poses : callable
        See :data:`Poses`.
    states : iterable of (K,) array
        The motion of each part from the first state to every other one is compared.

    Returns
    -------
    parts : int
    deviation : float
        Largest difference of an entry of a body's (4, 4) pose, radians and metres.
    """
    first, *others = states
    T_base_rest = obj.T_base_rest

    def posed(q: Array) -> Array:
        return T_base_rest @ obj.native_tree.forward_kinematics(q) @ invert_transform(T_base_rest)

    own, theirs = posed(first), dict(poses(obj.source_state(first)))
    shared = [(k, part.name) for k, part in enumerate(obj.parts) if part.name in theirs]
    largest = 0.0
    for q in others:
        moved, found = posed(q), poses(obj.source_state(q))
        for k, name in shared:
            expected = moved[k] @ invert_transform(own[k]) @ theirs[name]
            largest = max(largest, float(np.abs(expected - found[name]).max()))
    return len(shared), largest


@cache
def _client() -> int:
    """One physics server for all files: each takes tens of megabytes."""
    bullet = import_pybullet()
    return int(bullet.connect(bullet.DIRECT))


def pybullet_poses(file: Path) -> Poses:
    """PyBullet's forward kinematics of a URDF file without meshes and inertias, which do not enter it.

    PyBullet multiplies the travel of a slide by the length of its axis, which is a direction: axes are made unit
    vectors. Valid until the next call.
    """
    bullet = import_pybullet()
    root = etree.parse(str(file)).getroot()
    for link in root.findall("link"):
        for child in list(link):
            link.remove(child)
    for joint in root.iterfind("joint[@type='prismatic']"):
        axis = joint.find("axis")
        if axis is not None:
            direction = np.array(axis.get("xyz", "1 0 0").split(), dtype=np.float64)
            axis.set("xyz", " ".join(map(repr, (direction / np.linalg.norm(direction)).tolist())))
    client = _client()
    bullet.resetSimulation(physicsClientId=client)
    with tempfile.NamedTemporaryFile(suffix=".urdf") as bare, silence_output():
        bare.write(etree.tostring(root))
        bare.flush()
        body = bullet.loadURDF(bare.name, useFixedBase=True, physicsClientId=client)
    infos = [bullet.getJointInfo(body, j, physicsClientId=client) for j in range(bullet.getNumJoints(body, client))]
    numbers = {info[1].decode(): info[0] for info in infos}
    links = {info[12].decode(): info[0] for info in infos}
    base = bullet.getBodyInfo(body, physicsClientId=client)[0].decode()

    def poses(state: dict[str, float]) -> dict[str, Array]:
        for name, number in numbers.items():
            bullet.resetJointState(body, number, state.get(name, 0.0), physicsClientId=client)
        found = {base: np.eye(4)}
        for name, link in links.items():
            at = bullet.getLinkState(body, link, computeForwardKinematics=True, physicsClientId=client)
            found[name] = np.eye(4)
            found[name][:3, :3] = np.reshape(bullet.getMatrixFromQuaternion(at[5]), (3, 3))
            found[name][:3, 3] = at[4]
        return found

    return poses


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

    def poses(values: dict[str, float]) -> dict[str, Array]:
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
            found[name] = np.eye(4)
            found[name][:3, :3], found[name][:3, 3] = data.xmat[b].reshape(3, 3), data.xpos[b]
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
    """Forward kinematics by usd-core's own parser of UsdPhysics."""
    from pxr import Usd, UsdPhysics

    try:
        stage = Usd.Stage.Open(str(file))
    except Exception as error:
        raise NoOracleError(f"usd-core does not open it: {' '.join(str(error).split())}") from error
    prims = stage.Traverse(Usd.TraverseInstanceProxies())
    if not any(prim.IsA(UsdPhysics.Joint) and not prim.IsA(UsdPhysics.FixedJoint) for prim in prims):
        raise NoOracleError("it holds no joint that moves")
    parsed = ParsedStage(file)

    def poses(values: dict[str, float]) -> dict[str, Array]:
        used = {"world"}
        return {unused_name(path.rpartition("/")[2], used): T for path, T in parsed.posed(values).items()}

    return poses
