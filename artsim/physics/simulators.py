"""One URDF file in three simulators: PyBullet, MuJoCo and SAPIEN must load it and agree with artsim's kinematics.

Each simulator is imported when first used (``pip install -e '.[pybullet,sim,sapien]'``) and told to change nothing
about the file:

- PyBullet: ``useFixedBase=True`` and ``URDF_USE_INERTIA_FROM_FILE``.
- MuJoCo: ``fusestatic=False``, or links that no joint moves become part of their parents, the root of the world; and
  ``strippath=False``, or meshes of one name in two folders are taken for one. Files that artsim wrote ask for it
  themselves.
- SAPIEN: ``fix_root_link=True``. Its physics needs no graphics; visual shapes are left out here.

Simulators that keep joints which follow others together (``mimic``) do so by forces: a state that is set from outside
must name every joint, and here it does.
"""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

from artsim.common.extras import import_mujoco, import_pybullet, require_extra, silence_output
from artsim.errors import ArtsimError
from artsim.loading.object_files import find_urdf
from artsim.loading.urdf import load
from artsim.model.draws import StateOptions, sample_state
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import compose_transform, invert_transform, transform_points

AGREEMENT = 1e-6
"""Metres by which places of parts may differ; for objects larger than 1 m, share of their diagonal."""

LinkPoses = Callable[[dict[str, float]], dict[str, Array]]
"""Joint values by name -> (4, 4) pose of each link by name."""


@dataclass(frozen=True)
class LoadedFile:
    """A file in a simulator: number of links, of joints that move, its kinematics, and what must live as long."""

    links: int
    joints: int
    poses: LinkPoses
    owner: Any = None


@dataclass(frozen=True)
class Agreement:
    """How a simulator read a file.

    Attributes
    ----------
    simulator : str
    links, joints : int
        Links, and joints that move, in the simulator; -1 when it did not load the file.
    metres : float
        Largest distance between the places where it and artsim put a corner of a part's box.
    problem : str
        Why it is not equal; empty when it is.
    """

    simulator: str
    links: int
    joints: int
    metres: float
    problem: str


def in_pybullet(file: Path) -> LoadedFile:
    """Load a URDF file in PyBullet; its poses are valid until the next file is loaded."""
    bullet = import_pybullet()
    client = _bullet_client()
    bullet.resetSimulation(physicsClientId=client)
    flags = bullet.URDF_USE_INERTIA_FROM_FILE
    body = bullet.loadURDF(str(file), useFixedBase=True, flags=flags, physicsClientId=client)
    infos = [bullet.getJointInfo(body, j, physicsClientId=client) for j in range(bullet.getNumJoints(body, client))]
    base = bullet.getBodyInfo(body, physicsClientId=client)[0].decode()
    moving = {info[1].decode(): info[0] for info in infos if info[2] != bullet.JOINT_FIXED}
    names = [(info[12].decode(), info[0]) for info in infos]

    def poses(values: dict[str, float]) -> dict[str, Array]:
        for name, joint in moving.items():
            bullet.resetJointState(body, joint, values[name], physicsClientId=client)
        found = {base: np.eye(4)}
        for name, link in names:
            state = bullet.getLinkState(body, link, computeForwardKinematics=True, physicsClientId=client)
            found[name] = compose_transform(state[4], np.reshape(bullet.getMatrixFromQuaternion(state[5]), (3, 3)))
        return found

    return LoadedFile(len(infos) + 1, len(moving), poses)


@cache
def _bullet_client() -> int:
    """One physics server for all files: each takes tens of megabytes."""
    bullet = import_pybullet()
    return int(bullet.connect(bullet.DIRECT))


def in_mujoco(file: Path) -> LoadedFile:
    """Load a URDF or MJCF file in MuJoCo."""
    mujoco = import_mujoco("mujoco")

    spec = mujoco.MjSpec.from_file(str(file))
    spec.compiler.fusestatic = False
    spec.strippath = False
    model = spec.compile()
    data = mujoco.MjData(model)
    joints = [model.joint(j) for j in range(model.njnt)]
    bodies = [model.body(b) for b in range(1, model.nbody)]

    def poses(values: dict[str, float]) -> dict[str, Array]:
        for joint in joints:
            data.qpos[joint.qposadr[0]] = values[joint.name]
        mujoco.mj_kinematics(model, data)
        return {b.name: compose_transform(data.xpos[b.id], data.xmat[b.id].reshape(3, 3)) for b in bodies}

    return LoadedFile(model.nbody - 1, model.njnt, poses)


def in_sapien(file: Path) -> LoadedFile:
    """Load a URDF file in SAPIEN, whose own kinematics works in single precision."""
    sapien = _sapien()
    scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    loader = scene.create_urdf_loader()
    loader.fix_root_link = True
    builders, _, _ = loader.parse(str(file))
    for link in builders[0].link_builders:
        link.visual_records.clear()
    builders[0].set_initial_pose(sapien.Pose())
    robot = builders[0].build()
    joints = [joint.name for joint in robot.active_joints]

    def poses(values: dict[str, float]) -> dict[str, Array]:
        robot.set_qpos(np.array([values[name] for name in joints], dtype=np.float32))
        return {link.name: link.entity_pose.to_transformation_matrix().astype(np.float64) for link in robot.links}

    return LoadedFile(len(robot.links), len(joints), poses, scene)


@cache
def _sapien() -> Any:
    with warnings.catch_warnings():  # about graphics, which are not used
        warnings.simplefilter("ignore")
        with require_extra("sapien"):
            import sapien
    return sapien


SIMULATORS: dict[str, Callable[[Path], LoadedFile]] = {
    "pybullet": in_pybullet,
    "mujoco": in_mujoco,
    "sapien": in_sapien,
}
"""Name of each simulator -> its loader."""


def compare_simulators(
    path: str | Path, states: int = 20, seed: int = 0, simulators: Sequence[str] = tuple(SIMULATORS)
) -> list[Agreement]:
    """Load a URDF file in simulators, and compare counts and kinematics.

    Parameters
    ----------
    path : str or Path
        URDF file or its folder.
    states : int
        Random states within limits, besides the rest state.
    seed : int
    simulators : sequence of str
        Keys of ``SIMULATORS``.

    Returns
    -------
    list of Agreement
        One for each simulator.

    Raises
    ------
    ArtsimError
        When artsim itself does not load the file, or a simulator is not installed.
    """
    file = find_urdf(Path(path))
    obj = load(file)
    rng = np.random.default_rng(seed)
    drawn = [obj.tree.rest, *(sample_state(obj, StateOptions(), rng) for _ in range(states))]
    root = etree.parse(str(file)).getroot()
    links = len(root.findall("link"))
    joints = sum(joint.get("type") != "fixed" for joint in root.findall("joint"))
    at_rest = poses_in_file(file)(obj.source_state(obj.tree.rest))
    return [_compare(name, file, obj, drawn, at_rest, links, joints) for name in simulators]


def _compare(
    name: str,
    file: Path,
    obj: ArticulatedObject,
    states: Sequence[Array],
    at_rest: dict[str, Array],
    links: int,
    joints: int,
) -> Agreement:
    try:
        with silence_output():
            loaded = SIMULATORS[name](file)
    except ArtsimError:
        raise
    except Exception as error:  # a simulator may refuse a file in any way it likes
        return Agreement(name, -1, -1, np.inf, f"does not load it: {error}")
    metres = _difference(obj, states, at_rest, loaded.poses)
    problem = ""
    if (loaded.links, loaded.joints) != (links, joints):
        problem = f"has {loaded.links} links and {loaded.joints} joints instead of {links} and {joints}"
    elif not metres <= AGREEMENT * max(1.0, obj.diagonal):
        problem = f"puts parts {metres:.2g} m from where artsim does"
    return Agreement(name, loaded.links, loaded.joints, metres, problem)


def poses_in_file(file: Path) -> LinkPoses:
    """Where the file itself puts its links, by yourdfpy: in double precision, which simulators do not all keep."""
    with require_extra("where a file puts its links"):
        import yourdfpy

    robot = yourdfpy.URDF.load(str(file), load_meshes=False, build_scene_graph=True)
    for joint in robot.robot.joints:
        if joint.type == "prismatic":  # yourdfpy multiplies travel by the length of the axis, which is but a direction
            joint.axis = joint.axis / np.linalg.norm(joint.axis)
    names = [link.name for link in robot.robot.links]

    def poses(values: dict[str, float]) -> dict[str, Array]:
        robot.update_cfg({name: values.get(name, 0.0) for name in robot.actuated_joint_names})
        return {name: robot.get_transform(name, robot.base_link) for name in names}

    return poses


def _difference(obj: ArticulatedObject, states: Sequence[Array], at_rest: dict[str, Array], poses: LinkPoses) -> float:
    """Largest distance between a simulator's and artsim's place of a corner of a part's box.

    ``at_rest`` tells where links are in the object's rest state.
    """
    # Values that single precision holds, so that every simulator is given the same state.
    states = [np.float32(q).astype(np.float64) for q in states]
    low, high = obj.part_bounds[:, :1], obj.part_bounds[:, 1:]
    corners = transform_points(obj.T_base_rest, np.where(_CORNERS, high, low))
    metres = 0.0
    for q in states:
        posed = poses(_single(obj.source_state(q)))
        ours = obj.T_base_rest @ obj.native_tree.forward_kinematics(q) @ invert_transform(obj.T_base_rest)
        for k, part in enumerate(obj.parts):
            theirs = posed[part.name] @ np.linalg.inv(at_rest[part.name])
            apart = transform_points(theirs, corners[k]) - transform_points(ours[k], corners[k])
            metres = max(metres, float(np.linalg.norm(apart, axis=1).max()))
    return metres


_CORNERS = np.array(list(product((False, True), repeat=3)))


def _single(values: dict[str, float]) -> dict[str, float]:
    return {name: float(np.float32(value)) for name, value in values.items()}
