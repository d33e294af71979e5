"""Do simulators agree on exported objects? ``python -m benchmarks.simulators``.

Exports objects of every category with motors, and loads each into PyBullet and SAPIEN (URDF), MuJoCo and MuJoCo Warp
(MJCF), and Newton (USD), these two on the CPU. Compared with artsim are numbers of links and joints, and the places
of all parts at random states. With ``--seconds``, every free joint of some objects is driven for so long with its full
effort, as far as its velocity limit allows, once each way: in MuJoCo and MuJoCo Warp by the file's motors, in Newton,
whose MuJoCo solver moves it, by drives equal to these, in PyBullet and SAPIEN by velocity drives as strong as the
effort limit, and in artsim's own physics.
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
from scipy.spatial.transform import Rotation

from artsim import make
from artsim.common.extras import import_pybullet, silence_output
from artsim.common.progress import say, track
from artsim.export import FORMATS, export
from artsim.export.mjcf import BELOW
from artsim.export.options import ExportOptions
from artsim.families import FAMILIES
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import STRENGTH, LinkJoint, as_robot
from artsim.model.transforms import compose_transform
from artsim.physics import PhysicsOptions, Simulation, simulators
from artsim.physics.simulators import AGREEMENT, Agreement, LoadedFile, compare_simulators

_DRIVE = 1e6
"""Damping of SAPIEN's drives: their force limit is what acts."""
_RATE = 480
"""Steps a second of PyBullet, SAPIEN and Newton."""
_ALLOWED = {"overshoot": 0.02, "speed": 1.02, "apart": 0.01}
"""Of the range, of the speed limit, of the range."""


@dataclass(frozen=True)
class Options:
    """Load exported objects into five simulators, and drive them."""

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


def driven_in_mujoco(folder: Path, joints: list[LinkJoint], way: float) -> tuple[Any, Any, list[int], list[int]]:
    """A model of MuJoCo, its data with each motor at full control, and where joints have their states and speeds."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(folder / FORMATS["mjcf"]))
    data = mujoco.MjData(model)
    data.ctrl[:] = way
    places = [model.joint(joint.name).qposadr[0] for joint in joints]
    degrees = [model.joint(joint.name).dofadr[0] for joint in joints]
    return model, data, places, degrees


def in_mujoco(folder: Path, joints: list[LinkJoint], way: float, seconds: float) -> Run:
    """By the motors of the MJCF file, each at full control."""
    import mujoco

    model, data, places, degrees = driven_in_mujoco(folder, joints, way)
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


def newton_model(folder: Path) -> Any:
    """Newton's builder with the USD file, and the first degree of freedom of each joint by name."""
    import newton
    import warp

    warp.config.quiet = True
    builder = newton.ModelBuilder()
    newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
    with silence_output():
        builder.add_usd(str(folder / FORMATS["usd"]))
    starts = zip(builder.joint_label, builder.joint_qd_start, strict=True)
    return builder, {label.rsplit("/", 1)[-1]: start for label, start in starts}


def in_newton(folder: Path, joints: list[LinkJoint], way: float, seconds: float) -> Run:
    """By velocity drives that are the motors of the MJCF file: their force falls from the effort limit with speed."""
    import newton

    builder, places = newton_model(folder)
    chosen = [places[joint.name] for joint in joints]
    for joint, place in zip(joints, chosen, strict=True):
        builder.joint_target_mode[place] = newton.JointTargetMode.POSITION_VELOCITY  # the position is a spring's
        lost = builder.joint_target_kd[place] = (1.0 + 1.0 / STRENGTH) * joint.effort / joint.velocity
        builder.joint_target_qd[place] = way * BELOW * joint.effort / lost
    with silence_output():
        model = builder.finalize(device="cpu")
        solver = newton.solvers.SolverMuJoCo(model, use_mujoco_cpu=True, disable_contacts=True)
    state, after, control = model.state(), model.state(), model.control()
    seen = []
    for _ in range(round(_RATE * seconds)):
        solver.step(state, after, control, None, 1 / _RATE)
        state, after = after, state
        seen.append((state.joint_q.numpy()[chosen], state.joint_qd.numpy()[chosen]))
    states, speeds = zip(*seen, strict=True)
    return np.array(states, dtype=np.float64), np.array(speeds, dtype=np.float64)


def newton_file(file: Path) -> LoadedFile:
    """The USD file beside a URDF file, in Newton."""
    import newton

    builder, places = newton_model(file.parent)
    moving = {name: place for name, place in places.items() if not name.startswith("fixed_base")}
    model = builder.finalize(device="cpu")
    state, bodies = model.state(), [label.rsplit("/", 1)[-1] for label in builder.body_label]

    def poses(values: dict[str, float]) -> dict[str, Array]:
        q = np.zeros(model.joint_coord_count, np.float32)
        q[list(moving.values())] = [values[name] for name in moving]
        state.joint_q.assign(q)
        newton.eval_fk(model, state.joint_q, state.joint_qd, state)
        found = state.body_q.numpy().astype(np.float64)
        return {
            name: compose_transform(pose[:3], Rotation.from_quat(pose[3:]).as_matrix())
            for name, pose in zip(bodies, found, strict=True)
        }

    return LoadedFile(len(bodies), len(moving), poses)


def in_mujoco_warp(folder: Path, joints: list[LinkJoint], way: float, seconds: float) -> Run:
    """By the motors of the MJCF file, each at full control."""
    import mujoco_warp
    import warp

    warp.config.quiet = True
    model, data, places, degrees = driven_in_mujoco(folder, joints, way)
    seen = []
    with warp.ScopedDevice("cpu"), silence_output():
        there, moving = mujoco_warp.put_model(model), mujoco_warp.put_data(model, data)
        for _ in range(round(seconds / model.opt.timestep)):
            mujoco_warp.step(there, moving)
            seen.append((moving.qpos.numpy()[0, places], moving.qvel.numpy()[0, degrees]))
    states, speeds = zip(*seen, strict=True)
    return np.array(states, dtype=np.float64), np.array(speeds, dtype=np.float64)


def mujoco_warp_file(file: Path) -> LoadedFile:
    """The MJCF file beside a URDF file, in MuJoCo Warp."""
    import mujoco
    import mujoco_warp
    import warp

    model = mujoco.MjModel.from_xml_path(str(file.parent / FORMATS["mjcf"]))
    data = mujoco.MjData(model)
    joints = [model.joint(j) for j in range(model.njnt)]
    bodies = [model.body(b) for b in range(1, model.nbody)]
    with warp.ScopedDevice("cpu"):
        there = mujoco_warp.put_model(model)

    def poses(values: dict[str, float]) -> dict[str, Array]:
        for joint in joints:
            data.qpos[joint.qposadr[0]] = values[joint.name]
        with warp.ScopedDevice("cpu"):
            moved = mujoco_warp.put_data(model, data)
            mujoco_warp.kinematics(there, moved)
        places, turns = moved.xpos.numpy()[0].astype(np.float64), moved.xmat.numpy()[0].astype(np.float64)
        return {body.name: compose_transform(places[body.id], turns[body.id].reshape(3, 3)) for body in bodies}

    return LoadedFile(model.nbody - 1, model.njnt, poses)


simulators.SIMULATORS.update({"mujoco_warp": mujoco_warp_file, "newton": newton_file})
SIMULATORS: dict[str, Callable[[Path, list[LinkJoint], float, float], Run]] = {
    "mujoco": in_mujoco,
    "pybullet": in_pybullet,
    "sapien": in_sapien,
    "mujoco_warp": in_mujoco_warp,
    "newton": in_newton,
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
            export(obj, Path(folder), ["urdf", "mjcf", "usd"], options=ExportOptions(actuators="motor"))
            for agreement in compare_simulators(folder, options.states, simulators=tuple(SIMULATORS)):
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
        print(f"{name:12s}{result[name]}")
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
