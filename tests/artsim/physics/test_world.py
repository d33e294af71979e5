"""Simulated objects obey mechanics, their own limits, and what other simulators find."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.common.extras import import_pybullet
from artsim.errors import ArtsimError
from artsim.export import export
from artsim.export.mjcf import mjcf_text
from artsim.export.options import ExportOptions
from artsim.export.text import obj_text
from artsim.families import FAMILIES, make
from artsim.families.physical import feel_of, lever_arm
from artsim.loading.sources import find_sources
from artsim.model.inertia import combine_inertias
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import UNKNOWN_DYNAMICS, ArticulatedObject
from artsim.model.part_inertia import part_inertia
from artsim.model.robot import as_robot
from artsim.physics import world
from artsim.physics.bullet_body import BulletBody
from artsim.physics.options import PhysicsOptions
from artsim.physics.world import ENGINES, Simulation
from tests.conftest import DEMO, installed

FREE = PhysicsOptions(damping=0.0, friction=0.0)


@pytest.fixture(autouse=True, params=sorted(ENGINES))
def engine(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """What ``auto`` stands for."""
    name: str = request.param
    monkeypatch.setattr(world, "engine_of", lambda options: name if options.engine == "auto" else options.engine)
    return name


def unlimited(obj: ArticulatedObject) -> ArticulatedObject:
    """The object with stops far away, and without latches, springs and the strength that opens them."""
    bodies = [part.body and replace(part.body, joint=UNKNOWN_DYNAMICS) for part in obj.parts]
    parts = tuple(replace(part, body=body) for part, body in zip(obj.parts, bodies, strict=True))
    joints = [
        replace(j, lower=-1e3, upper=1e3) if j.type in ("revolute", "prismatic") else j for j in obj.native_tree.joints
    ]
    return replace(obj, parts=parts, native_tree=KinematicTree(joints))


def energy(obj: ArticulatedObject, q: Array, velocity: Array) -> float:
    """Kinetic and potential energy from the tree's own kinematics."""
    h, total = 1e-6, 0.0
    now, before, after = (obj.tree.forward_kinematics(q + step * velocity) for step in (0.0, -h, h))
    for k in range(1, len(obj)):
        body = part_inertia(obj, k)
        center = [T[k, :3, :3] @ body.center + T[k, :3, 3] for T in (before, now, after)]
        speed = (center[2] - center[0]) / (2 * h)
        spin = (after[k, :3, :3] - before[k, :3, :3]) / (2 * h) @ now[k, :3, :3].T
        turn = now[k, :3, :3].T @ np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        total += 0.5 * body.mass * speed @ speed + 0.5 * turn @ body.tensor @ turn + 9.81 * body.mass * center[1][2]
    return total


def test_a_pushed_drawer_accelerates_by_force_over_mass(one_drawer: ArticulatedObject) -> None:
    k = int(one_drawer.tree.free_joints[0])
    simulation = Simulation(one_drawer, replace(FREE, substeps=4))
    force = 0.5
    for _ in range(30):
        simulation.step([force])
    seconds = 30 * simulation.options.control_step
    expected = force / combine_inertias(part_inertia(one_drawer, j) for j in range(k, len(one_drawer))).mass
    assert simulation.velocity[k] / seconds == pytest.approx(expected, rel=0.001)
    assert simulation.state[k] == pytest.approx(0.5 * expected * seconds**2, rel=0.02)


def test_a_released_door_comes_to_rest_and_only_loses_energy() -> None:
    obj = make("door", 1)
    simulation = Simulation(obj)
    simulation.reset(obj.tree.limits.mean(axis=1), np.array([0.0, 1.0, *[0.0] * (len(obj) - 2)]))
    left = [energy(obj, simulation.state, simulation.velocity)]
    for _ in range(100):
        simulation.step(np.zeros(len(obj.tree.free_joints)))
        left.append(energy(obj, simulation.state, simulation.velocity))
    assert np.diff(left).max() < 1e-6
    assert np.abs(simulation.velocity).max() < 1e-5
    still = simulation.state
    simulation.step(np.zeros(len(obj.tree.free_joints)))
    np.testing.assert_allclose(simulation.state, still, atol=1e-6)


@pytest.mark.parametrize("category", ["lamp", "globe", "laptop", "valve", "storage_furniture"])
def test_energy_is_kept_without_damping_and_friction(category: str) -> None:
    obj = unlimited(make(category, 1))
    simulation = Simulation(obj, replace(FREE, time_step=1 / 4000, substeps=200))
    simulation.reset(velocity=np.linspace(0.5, 1.0, len(obj)))
    start = energy(obj, simulation.state, simulation.velocity)
    scale = abs(start - energy(obj, simulation.state, 0.0 * simulation.velocity))
    for _ in range(6):
        simulation.step(np.zeros(len(obj.tree.free_joints)))
        now = energy(obj, simulation.state, simulation.velocity)
        moving = now - energy(obj, simulation.state, 0.0 * simulation.velocity)
        scale = max(scale, moving)
        assert abs(now - start) < 0.02 * scale


@pytest.mark.slow
@pytest.mark.parametrize("category", sorted(FAMILIES))
def test_joints_never_leave_their_limits_and_followers_follow(category: str) -> None:
    obj = make(category, 0)
    simulation, rng = Simulation(obj), np.random.default_rng(0)
    low, high = obj.tree.limits.T
    for turn in range(12):
        direction = rng.choice([-1.0, 1.0], len(obj.tree.free_joints))
        if turn % 2:
            simulation.step(direction * simulation.effort_limit)
        else:
            simulation.step(direction * simulation.velocity_limit, "velocity")
        q = simulation.state
        assert np.all(q >= low - 1e-3)
        assert np.all(q <= high + 1e-3)
        np.testing.assert_allclose(q, obj.tree.complete_state(q), atol=1e-9)
        speed, rates = simulation.velocity, obj.tree.complete_state(simulation.velocity)
        linear = [k for k, j in enumerate(obj.tree.joints) if j.mimic is None or j.mimic.offset == 0.0]
        np.testing.assert_allclose(speed[linear], rates[linear], atol=1e-6)


def test_friction_holds_a_drawer_until_the_push_exceeds_it(one_drawer: ArticulatedObject) -> None:
    k = int(one_drawer.tree.free_joints[0])
    simulation = Simulation(one_drawer)
    friction = as_robot(one_drawer).joints[0].friction
    for push, moves in ((0.9, False), (1.1, True)):
        simulation.reset()
        for _ in range(5):
            simulation.step([push * friction])
        assert (simulation.state[k] > 1e-6) == moves


def test_what_opens_a_joint_is_within_the_range_of_its_row() -> None:
    for category, state in (("refrigerator", 0.0), ("refrigerator", 0.5), ("keyboard", 1.0), ("laptop", 0.5)):
        obj = make(category, 0)
        k = int(obj.tree.free_joints[0])
        feel = feel_of(category, obj.parts[k].label, obj.tree.types[k])
        assert feel is not None
        low, high = feel["running"] if state == 0.5 else feel.get("hold", feel.get("spring"))
        simulation = Simulation(obj, replace(FREE, friction=1.0, gravity=0.0, substeps=1))
        arm = lever_arm(obj, k) if feel["at"] == "handle" else 1.0
        for force, moves in ((0.98 * low, False), (1.02 * high, True)):
            q = np.zeros(len(obj))
            q[k] = (1.0 - 1e-3) * state * obj.tree.limits[k, 1]
            simulation.reset(q)
            simulation.step(np.where(obj.tree.free_joints == k, force * arm, 0.0))
            assert (simulation.state[k] > q[k] + 1e-10) == moves, (category, state, force)


def test_a_light_knob_is_not_driven_past_its_velocity_limit() -> None:
    simulation = Simulation(make("camera", 3), PhysicsOptions(substeps=1))
    for _ in range(5):
        simulation.step(simulation.effort_limit)
        driven = simulation.velocity[simulation.obj.tree.free_joints]
        assert np.all(driven <= simulation.velocity_limit + 1e-9)


@pytest.mark.parametrize("category", ["keyboard", "remote", "phone"])
def test_sprung_keys_come_back_and_stay_calm_in_mujoco(category: str) -> None:
    import mujoco

    robot = as_robot(make(category, 0))
    files = {f"{mesh.name}.obj": obj_text(mesh).encode() for mesh in robot.meshes}
    model = mujoco.MjSpec.from_string(mjcf_text(robot, ExportOptions()), assets=files).compile()
    data = mujoco.MjData(model)
    sprung = [joint for joint in robot.joints if joint.spring]
    place = [model.joint(joint.name).qposadr[0] for joint in sprung]
    data.qpos[place] = [0.5 * joint.upper for joint in sprung]
    mujoco.mj_step(model, data, 1000)
    assert not any(warning.number for warning in data.warning)
    assert np.abs(data.qvel).max() < 1e-3
    assert np.all(data.qpos[place] < [0.2 * joint.upper for joint in sprung])


def test_a_motor_holds_the_speed_it_is_told() -> None:
    obj = make("storage_furniture", 0)
    simulation = Simulation(obj)
    target = 0.1 * np.ones(len(obj.tree.free_joints))
    for _ in range(8):
        simulation.step(target, "velocity")
    np.testing.assert_allclose(simulation.velocity[obj.tree.free_joints], target, rtol=0.02)


MOVED = ["drawer", "door", "laptop", "valve", "globe", "window", "coffee_machine"]
"""Sliding, upright and level hinges, a screw, joints upon joints."""


@pytest.mark.parametrize("category", MOVED)
def test_damped_joints_move_as_in_mujoco(category: str) -> None:
    import mujoco

    obj, q, push = released(category)
    robot = as_robot(obj)
    files = {f"{mesh.name}.obj": obj_text(mesh).encode() for mesh in robot.meshes}
    model = mujoco.MjSpec.from_string(mjcf_text(robot, ExportOptions()), assets=files).compile()
    model.opt.timestep = 1 / 4000
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    model.dof_frictionloss[:] = 0.0
    data = mujoco.MjData(model)
    for name, value in robot.states(q).items():
        data.qpos[model.joint(name).qposadr[0]] = value
    place = [model.joint(joint.name).qposadr[0] for joint in obj.tree.joints[1:]]
    for force, k in zip(push, obj.tree.free_joints, strict=True):
        data.qfrc_applied[place[k - 1]] = force
    seen = []
    for _ in range(8):
        mujoco.mj_step(model, data, 200)
        seen.append(data.qpos[place])
    assert_same_motion(obj, q, push, np.array(seen))


@pytest.mark.parametrize("category", ["drawer", "door", "laptop", "globe", "window", "coffee_machine"])
def test_damped_joints_move_as_in_sapien(category: str, tmp_path: Path) -> None:
    sapien = installed("sapien")

    obj, q, push = released(category)
    export(obj, tmp_path, ("urdf",))
    system = sapien.physx.PhysxCpuSystem()
    scene = sapien.Scene([system])
    system.timestep = 1 / 2000
    loader = scene.create_urdf_loader()
    loader.fix_root_link = True
    (builder,), _, _ = loader.parse(str(tmp_path / "mobility.urdf"))
    for link in builder.link_builders:
        link.visual_records.clear()
        link.collision_records.clear()
    builder.set_initial_pose(sapien.Pose())
    robot = builder.build()
    exported = as_robot(obj)
    values, damping = exported.states(q), {joint.name: joint.damping for joint in exported.joints}
    joints = robot.active_joints
    for joint in joints:
        joint.set_drive_properties(0.0, damping[joint.name])
        joint.set_friction(0.0)
    for link in robot.links:
        link.linear_damping = link.angular_damping = 0.0
    robot.set_qpos([values[joint.name] for joint in joints])
    names = [joint.name for joint in joints]
    forces = np.zeros(len(joints))
    for force, k in zip(push, obj.tree.free_joints, strict=True):
        forces[names.index(obj.tree.joints[k].name)] = force
    seen = []
    for _ in range(8):
        for _ in range(100):
            robot.set_qf(forces)
            system.step()
        seen.append(robot.qpos[[names.index(joint.name) for joint in obj.tree.joints[1:]]])
    assert_same_motion(obj, q, push, np.array(seen))


def released(category: str) -> tuple[ArticulatedObject, Array, Array]:
    """An object without stops, half open, and a push on each joint."""
    obj = make(category, 0)
    limits = np.where(np.isfinite(obj.tree.limits), obj.tree.limits, 0.0)
    obj, q = unlimited(obj), obj.tree.complete_state(limits.mean(axis=1))
    return obj, q, 0.05 * Simulation(obj).effort_limit


def assert_same_motion(obj: ArticulatedObject, q: Array, push: Array, theirs: Array) -> None:
    """Within 2 % of the way that each joint goes."""
    simulation = Simulation(obj, PhysicsOptions(friction=0.0))
    simulation.velocity_limit = np.full_like(push, np.inf)  # the others push at any speed
    simulation.reset(q)
    for seen in theirs:
        simulation.step(push)
        way = np.abs(theirs - q[1:]).max(axis=0)
        assert np.all(np.abs(simulation.state[1:] - seen) <= 0.02 * way + 1e-6)


def test_the_same_efforts_make_the_same_motion_again_and_after_a_reset() -> None:
    obj = make("robot_arm", 0)
    first, second = Simulation(obj), Simulation(obj)
    runs = []
    for simulation in (first, second, first):
        simulation.reset()
        for turn in range(8):
            simulation.step(np.cos(turn + np.arange(len(simulation.effort_limit))) * simulation.effort_limit)
        runs.append(np.concatenate([simulation.state, simulation.velocity]))
    assert np.array_equal(runs[0], runs[1])
    assert np.array_equal(runs[0], runs[2])


@pytest.mark.slow
def test_engines_agree_on_every_family() -> None:
    for category in sorted(FAMILIES):
        obj = make(category, 3)
        sides = [Simulation(obj, PhysicsOptions(engine=name)) for name in ("pybullet", "mujoco")]
        share = np.cos(np.arange(len(obj.tree.free_joints)))
        for simulation in sides:
            simulation.reset(obj.tree.limits.clip(-1, 1).mean(axis=1))
            for turn in range(3):
                simulation.step(share * simulation.effort_limit * 0.5**turn)
        way = np.maximum(np.abs(sides[0].state - obj.tree.rest), 1e-3)
        assert np.all(np.abs(sides[0].state - sides[1].state) <= 0.01 * way), category


def test_a_ball_comes_to_rest_on_a_closed_laptop() -> None:
    installed("pybullet")
    bullet = import_pybullet()
    obj = make("laptop", 0)
    simulation = Simulation(obj, PhysicsOptions(engine="pybullet"))
    assert isinstance(simulation.body, BulletBody)
    client = {"physicsClientId": simulation.body.client}
    shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=0.02, **client)
    start = [0.0, 0.0, obj.bounds[1, 2] + 0.03]
    ball = bullet.createMultiBody(0.05 / simulation.body.mass_unit, shape, basePosition=start, **client)
    bullet.changeDynamics(ball, -1, rollingFriction=0.01, spinningFriction=0.01, **client)
    for _ in range(30):
        simulation.step([0.0])
    height = bullet.getBasePositionAndOrientation(ball, **client)[0][2]
    assert obj.bounds[1, 2] + 0.015 < height < obj.bounds[1, 2] + 0.0225


@pytest.mark.parametrize("path", DEMO, ids=lambda path: path.name)
def test_loaded_objects_move_too(path: Path) -> None:
    obj = artsim.load(path)
    simulation = Simulation(obj)
    np.testing.assert_allclose(simulation.state, obj.tree.rest, atol=1e-9)
    free = obj.tree.free_joints
    upwards = np.where(obj.tree.limits[free, 1] > obj.tree.rest[free], 1.0, -1.0)
    for _ in range(5):
        simulation.step(upwards * simulation.effort_limit)
    assert np.all((simulation.state - obj.tree.rest)[free] * upwards > 0)
    assert np.all(simulation.state <= obj.tree.limits[:, 1] + 1e-3)
    assert np.all(simulation.state >= obj.tree.limits[:, 0] - 1e-3)


@pytest.mark.slow
def test_real_objects_stay_within_their_limits(partnet_dir: Path) -> None:
    for source in find_sources([partnet_dir])[::12]:
        obj = source.load()
        simulation = Simulation(obj)
        for push in (1.0, 1.0, -1.0, -1.0, 1.0):
            simulation.step(push * simulation.effort_limit)
            assert np.all(simulation.state >= obj.tree.limits[:, 0] - 1e-3)
            assert np.all(simulation.state <= obj.tree.limits[:, 1] + 1e-3)


@pytest.mark.parametrize("action", [[], [0.0, 0.0], [np.nan], 1.0])
def test_a_wrong_action_is_refused(action: object, one_drawer: ArticulatedObject) -> None:
    with pytest.raises(ArtsimError, match=r"1 finite numbers.*drawer"):
        Simulation(one_drawer).step(action)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize(
    "options", [{"time_step": 0.0}, {"time_step": 1.0}, {"substeps": 0}, {"damping": -1.0}, {"gravity": np.nan}]
)
def test_options_that_make_no_sense_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(ArtsimError):
        PhysicsOptions(**options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_where_pybullet_is_missing_mujoco_moves_objects() -> None:
    program = """
import sys; sys.modules["pybullet"] = None
import artsim, numpy as np, gymnasium, artsim.envs
env = gymnasium.make("artsim/Articulated-v0", categories=("drawer",))
env.reset(seed=0)
for _ in range(3): env.step(np.ones(16, np.float32))
assert env.unwrapped.simulation.engine == "mujoco"
assert env.unwrapped.simulation.state.max() > 0
"""
    subprocess.run([sys.executable, "-c", program], check=True)
