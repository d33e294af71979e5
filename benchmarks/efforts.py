"""Do exported joints stop at their limits and keep their speed? ``python -m benchmarks.efforts``.

Exports objects of every category with motors, and drives every free joint for some seconds with its full declared
effort, as far as its velocity limit allows, once each way: in MuJoCo by the file's motors, in PyBullet and SAPIEN by
velocity drives as strong as the effort limit, and in artsim's own physics. Printed are the largest overshoot of a limit
over the joint's range, the largest speed over its limit, and how far from artsim's own the states at the end are. The
last line is one JSON object.
"""

from __future__ import annotations

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
from artsim.common.extras import silence_output
from artsim.common.progress import say, track
from artsim.export import FORMATS, export
from artsim.export.options import ExportOptions
from artsim.export.robot import LinkJoint, as_robot
from artsim.families import FAMILIES
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.physics import PhysicsOptions, Simulation
from artsim.renderers.bullet import import_pybullet

_DRIVE = 1e6  # damping of SAPIEN's drives: their force limit is what acts


@dataclass(frozen=True)
class Options:
    """Full effort in three simulators."""

    objects: int = 60
    """Objects over all categories."""
    seconds: float = 5.0
    """Of each drive."""
    first_seed: int = 0


@dataclass(frozen=True)
class Run:
    """States over time (S, J) and speeds (S, J) of the joints that are driven."""

    states: Array
    speeds: Array


def in_mujoco(folder: Path, joints: list[LinkJoint], way: float, seconds: float) -> Run:
    """By the motors of the MJCF file, each at full control."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(folder / FORMATS["mjcf"]))
    data = mujoco.MjData(model)
    data.ctrl[:] = way
    places = [model.joint(joint.name).qposadr[0] for joint in joints]
    states, speeds = [], []
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
        states.append(data.qpos[places].copy())
        speeds.append(data.qvel[[model.joint(joint.name).dofadr[0] for joint in joints]].copy())
    return Run(np.array(states), np.array(speeds))


def in_pybullet(folder: Path, joints: list[LinkJoint], way: float, seconds: float) -> Run:
    """By velocity motors at the speed limit, as strong as the effort limit."""
    bullet = import_pybullet()
    with silence_output():
        client = bullet.connect(bullet.DIRECT)
    world = {"physicsClientId": client}
    flags = bullet.URDF_USE_INERTIA_FROM_FILE
    with silence_output():
        body = bullet.loadURDF(str(folder / FORMATS["urdf"]), useFixedBase=True, flags=flags, **world)
    bullet.setGravity(0, 0, -9.81, **world)
    bullet.setTimeStep(1 / 480, **world)
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
    for _ in range(round(480 * seconds)):
        bullet.stepSimulation(**world)
        seen.append([state[:2] for state in bullet.getJointStates(body, chosen, **world)])
    with silence_output():
        bullet.disconnect(client)
    found = np.array(seen)
    return Run(found[..., 0], found[..., 1])


def in_sapien(folder: Path, joints: list[LinkJoint], way: float, seconds: float) -> Run:
    """By velocity drives at the speed limit, as strong as the effort limit; PhysX is told the velocity limits."""
    import sapien

    scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    scene.set_timestep(1 / 480)
    loader = scene.create_urdf_loader()
    loader.fix_root_link = True
    builders, _, _ = loader.parse(str(folder / FORMATS["urdf"]))
    for link in builders[0].link_builders:
        link.visual_records.clear()
    builders[0].set_initial_pose(sapien.Pose())
    robot = builders[0].build()
    order = {joint.name: i for i, joint in enumerate(robot.active_joints)}
    for joint in joints:
        own = robot.active_joints[order[joint.name]]
        own.set_drive_properties(0.0, _DRIVE, force_limit=joint.effort)
        own.set_drive_velocity_target(way * joint.velocity)
        own.set_max_velocity(joint.velocity)
    chosen = [order[joint.name] for joint in joints]
    states, speeds = [], []
    for _ in range(round(480 * seconds)):
        scene.step()
        states.append(robot.get_qpos()[chosen].copy())
        speeds.append(robot.get_qvel()[chosen].copy())
    return Run(np.array(states, dtype=np.float64), np.array(speeds, dtype=np.float64))


def in_artsim(obj: ArticulatedObject, way: float, seconds: float, engine: str) -> Array:
    """(J,) states at the end in artsim's own physics."""
    simulation = Simulation(obj, PhysicsOptions(engine=engine))  # type: ignore[arg-type]
    for _ in range(round(seconds / simulation.options.control_step)):
        simulation.step(way * simulation.velocity_limit, "velocity")
    return simulation.state[obj.tree.free_joints]


Simulator = Callable[[Path, list[LinkJoint], float, float], Run]
SIMULATORS: dict[str, Simulator] = {"mujoco": in_mujoco, "pybullet": in_pybullet, "sapien": in_sapien}


def main(options: Options) -> None:
    """Print a table and the JSON line."""
    found: dict[str, list[dict[str, float]]] = defaultdict(list)
    categories = sorted(FAMILIES)
    for i in track("driving", range(options.objects), unit="object", leave=False):
        category, seed = categories[i % len(categories)], options.first_seed + i // len(categories)
        obj = make(category, seed)
        robot = as_robot(obj)
        names = {obj.tree.joints[k].name for k in obj.tree.free_joints}
        joints = [joint for joint in robot.joints if joint.name in names]
        ends = np.array([(joint.lower, joint.upper) for joint in joints]).reshape(-1, 2)
        # URDF has no limits for the turning joint of a screw: its slide, which follows, has them.
        limited = np.isfinite(ends).all(axis=1) & np.array([joint.type != "continuous" for joint in joints])
        if not limited.any():
            continue
        limits = np.array([joint.velocity for joint in joints])
        with tempfile.TemporaryDirectory() as place:
            export(obj, Path(place), ["urdf", "mjcf"], options=ExportOptions(actuators="motor"))
            for way in (1.0, -1.0):
                own = in_artsim(obj, way, options.seconds, "mujoco")
                for name, simulator in SIMULATORS.items():
                    run = simulator(Path(place), joints, way, options.seconds)
                    span = np.ptp(ends[limited], axis=1)
                    values = run.states[:, limited]
                    over = np.maximum(values - ends[limited, 1], ends[limited, 0] - values).max(axis=0) / span
                    speed = float((np.abs(run.speeds).max(axis=0) / limits).max())
                    apart = float((np.abs(values[-1] - own[limited]) / span).max())
                    found[name].append({"overshoot": float(over.max()), "speed": speed, "apart": apart})
                    if over.max() > 0.02 or speed > 1.02 or apart > 0.01:
                        say(
                            f"{category}:{seed} {way:+.0f} in {name}: {100 * over.max():.1f} % over a limit, "
                            f"{100 * speed:.0f} % of the speed limit, {100 * apart:.1f} % from where artsim has it"
                        )
    result: dict[str, Any] = {}
    print(f"{options.objects} objects, {options.seconds:g} s of full effort, each way; of the joints with limits:")
    for name, rows in found.items():
        worst = {key: max(row[key] for row in rows) for key in rows[0]}
        good = {
            "overshoot": np.mean([row["overshoot"] <= 0.02 for row in rows]),
            "speed": np.mean([row["speed"] <= 1.02 for row in rows]),
            "apart": np.mean([row["apart"] <= 0.01 for row in rows]),
        }
        print(
            f"  {name:10s} overshoot {100 * worst['overshoot']:.2f} % at most, 2 % in {100 * good['overshoot']:.1f} %;"
            f"  speed {100 * worst['speed']:5.0f} % of the limit at most, within it in {100 * good['speed']:5.1f} %;"
            f"  at rest where artsim has it, within 1 %, in {100 * good['apart']:5.1f} %"
        )
        result[name] = {"worst": worst, "within": {key: float(value) for key, value in good.items()}}
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
