"""Do simulators agree on exported objects? ``python -m benchmarks.simulators``.

Exports objects of every category with motors, and loads each into PyBullet, MuJoCo and SAPIEN. Compared with artsim are
numbers of links and joints, and the places of all parts at random states. With ``--seconds``, every free joint of some
objects is driven for so long with its full effort, as far as its velocity limit allows, once each way: in MuJoCo by the
file's motors, in PyBullet and SAPIEN by velocity drives as strong as the effort limit, and in artsim's own physics.
Printed are the largest overshoot of a limit over the joint's range, the largest speed over its limit, and how far from
artsim's own the states at the end are. The last line is one JSON object.
"""

import json
import tempfile
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from artsim import make
from artsim.common.extras import import_pybullet, silence_output
from artsim.common.progress import say, track
from artsim.export import FORMATS, export
from artsim.export.options import ExportOptions
from artsim.families import FAMILIES
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import LinkJoint, as_robot
from artsim.physics import PhysicsOptions, Simulation
from artsim.physics.simulators import AGREEMENT, Agreement, compare_simulators

_DRIVE = 1e6
"""Damping of SAPIEN's drives: their force limit is what acts."""
_RATE = 480
"""Steps a second of PyBullet and SAPIEN."""
_ALLOWED = {"overshoot": 0.02, "speed": 1.02, "apart": 0.01}
"""Of the range, of the speed limit, of the range."""


@dataclass(frozen=True)
class Options:
    """Load exported objects into three simulators, and drive them."""

    objects: int = 200
    """Objects over all categories."""
    states: int = 20
    """Random states of each."""
    seconds: float = 0.0
    """Of each drive; 0 drives nothing."""
    driven: int = 60
    """How many of the objects are driven."""
    first_seed: int = 0


Run = tuple[Array, Array]
"""States (S, J) and speeds (S, J) over time of the joints that are driven."""


def in_mujoco(folder: Path, joints: list[LinkJoint], way: float, seconds: float) -> Run:
    """By the motors of the MJCF file, each at full control."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(folder / FORMATS["mjcf"]))
    data = mujoco.MjData(model)
    data.ctrl[:] = way
    places = [model.joint(joint.name).qposadr[0] for joint in joints]
    degrees = [model.joint(joint.name).dofadr[0] for joint in joints]
    seen = []
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        seen.append((data.qpos[places], data.qvel[degrees]))
    states, speeds = zip(*seen, strict=True)
    return np.array(states), np.array(speeds)


def in_pybullet(folder: Path, joints: list[LinkJoint], way: float, seconds: float) -> Run:
    """By velocity motors at the speed limit, as strong as the effort limit."""
    bullet = import_pybullet()
    with silence_output():
        world = {"physicsClientId": bullet.connect(bullet.DIRECT)}
        flags = bullet.URDF_USE_INERTIA_FROM_FILE
        body = bullet.loadURDF(str(folder / FORMATS["urdf"]), useFixedBase=True, flags=flags, **world)
    bullet.setGravity(0, 0, -9.81, **world)
    bullet.setTimeStep(1 / _RATE, **world)
    count = bullet.getNumJoints(body, **world)
    numbers = {bullet.getJointInfo(body, j, **world)[1].decode(): j for j in range(count)}
    chosen = [numbers[joint.name] for joint in joints]
    bullet.setJointMotorControlArray(
        body, list(range(count)), bullet.VELOCITY_CONTROL, forces=[0.0] * count, targetVelocities=[0.0] * count, **world
    )
    bullet.setJointMotorControlArray(
        body, chosen, bullet.VELOCITY_CONTROL, forces=[joint.effort for joint in joints],
        targetVelocities=[way * joint.velocity for joint in joints], **world,
    )  # fmt: skip
    seen = []
    for _ in range(round(_RATE * seconds)):
        bullet.stepSimulation(**world)
        seen.append([state[:2] for state in bullet.getJointStates(body, chosen, **world)])
    with silence_output():
        bullet.disconnect(**world)
    found = np.array(seen)
    return found[..., 0], found[..., 1]


def in_sapien(folder: Path, joints: list[LinkJoint], way: float, seconds: float) -> Run:
    """By velocity drives at the speed limit, as strong as the effort limit; PhysX is told the velocity limits."""
    import sapien

    scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    scene.set_timestep(1 / _RATE)
    loader = scene.create_urdf_loader()
    loader.fix_root_link = True
    builders, _, _ = loader.parse(str(folder / FORMATS["urdf"]))
    for link in builders[0].link_builders:
        link.visual_records.clear()
    builders[0].set_initial_pose(sapien.Pose())
    robot = builders[0].build()
    order = {joint.name: i for i, joint in enumerate(robot.active_joints)}
    chosen = [order[joint.name] for joint in joints]
    for joint, number in zip(joints, chosen, strict=True):
        own = robot.active_joints[number]
        own.set_drive_properties(0.0, _DRIVE, force_limit=joint.effort)
        own.set_drive_velocity_target(way * joint.velocity)
        own.set_max_velocity(joint.velocity)
    seen = []
    for _ in range(round(_RATE * seconds)):
        scene.step()
        seen.append((robot.get_qpos()[chosen], robot.get_qvel()[chosen]))
    states, speeds = zip(*seen, strict=True)
    return np.array(states, dtype=np.float64), np.array(speeds, dtype=np.float64)


SIMULATORS: dict[str, Callable[[Path, list[LinkJoint], float, float], Run]] = {
    "mujoco": in_mujoco,
    "pybullet": in_pybullet,
    "sapien": in_sapien,
}


def drive(obj: ArticulatedObject, folder: Path, seconds: float) -> dict[str, list[dict[str, float]]]:
    """Of each simulator, for each way, what :data:`_ALLOWED` has limits for; empty where no joint has two ends."""
    free = {obj.tree.joints[k].name for k in obj.tree.free_joints}
    joints = [joint for joint in as_robot(obj).joints if joint.name in free]
    ends = np.array([(joint.lower, joint.upper) for joint in joints]).reshape(-1, 2)
    # URDF has no limits for the turning joint of a screw: its slide, which follows, has them.
    limited = np.isfinite(ends).all(axis=1) & np.array([joint.type != "continuous" for joint in joints])
    found: dict[str, list[dict[str, float]]] = defaultdict(list)
    if not limited.any():
        return found
    (low, high), span = ends[limited].T, np.ptp(ends[limited], axis=1)
    for way in (1.0, -1.0):
        simulation = Simulation(obj, PhysicsOptions(engine="mujoco"))
        for _ in range(round(seconds / simulation.options.control_step)):
            simulation.step(way * simulation.velocity_limit, "velocity")
        own = simulation.state[obj.tree.free_joints][limited]
        for name, simulator in SIMULATORS.items():
            states, speeds = simulator(folder, joints, way, seconds)
            states = states[:, limited]
            fastest = np.abs(speeds).max(axis=0) / [joint.velocity for joint in joints]
            found[name].append({
                "overshoot": float((np.maximum(states - high, low - states).max(axis=0) / span).max()),
                "speed": float(fastest.max()),
                "apart": float((np.abs(states[-1] - own) / span).max()),
            })  # fmt: skip
    return found


def main(options: Options) -> None:
    """Print what differs, a table, and the JSON line."""
    agreements: dict[str, list[Agreement]] = defaultdict(list)
    drives: dict[str, list[dict[str, float]]] = defaultdict(list)
    categories = sorted(FAMILIES)
    for i in track("simulating", range(options.objects), unit="object", leave=False):
        category, seed = categories[i % len(categories)], options.first_seed + i // len(categories)
        obj = make(category, seed)
        with tempfile.TemporaryDirectory() as folder:
            export(obj, Path(folder), ["urdf", "mjcf"], options=ExportOptions(actuators="motor"))
            for agreement in compare_simulators(folder, options.states):
                agreements[agreement.simulator].append(agreement)
                if agreement.problem:
                    say(f"{category}:{seed} in {agreement.simulator}: {agreement.problem}")
            if options.seconds and i < options.driven:
                for name, rows in drive(obj, Path(folder), options.seconds).items():
                    drives[name] += rows
                    if any(row[key] > most for row in rows for key, most in _ALLOWED.items()):
                        say(f"{category}:{seed} in {name}: {rows}")
    print(f"parts agree within {AGREEMENT:g} m (of the diagonal, for objects larger than 1 m)")
    result: dict[str, dict[str, Any]] = {}
    for name, own in agreements.items():
        result[name] = {
            "loaded": sum(a.links >= 0 for a in own) / len(own),
            "equal": sum(not a.problem for a in own) / len(own),
            "metres": max(a.metres for a in own),
        }
        if drives[name]:
            result[name]["worst"] = {key: max(row[key] for row in drives[name]) for key in _ALLOWED}
            result[name]["within"] = {
                key: float(np.mean([row[key] <= most for row in drives[name]])) for key, most in _ALLOWED.items()
            }
        print(f"{name:10s}{result[name]}")
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
