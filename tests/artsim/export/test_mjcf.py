"""MJCF files have the links, masses and kinematics of the object."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from artsim.errors import ConfigError
from artsim.export import FORMATS, export
from artsim.export.options import Base, ExportOptions
from artsim.families import make
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.part_inertia import part_inertia
from artsim.model.robot import as_robot
from artsim.model.transforms import transform_points
from tests.conftest import installed, valve

rng = np.random.default_rng(0)


def states(obj: ArticulatedObject, count: int = 5) -> Array:
    """Random states within limits; half a turn where there are none."""
    limits = np.where(np.isfinite(obj.tree.limits), obj.tree.limits, [-np.pi, np.pi])
    return obj.tree.complete_state(rng.uniform(limits[:, 0], limits[:, 1], (count, len(obj))))


def test_mjcf_has_the_links_masses_and_kinematics_of_the_object(tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    obj = valve()
    export(obj, tmp_path, ["mjcf"])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / FORMATS["mjcf"]))
    robot = as_robot(obj)
    assert model.nbody - 1 == len(robot.links) == len(obj) + 1
    assert model.njnt == len(robot.joints) == len(obj)
    assert model.body_mass.sum() == pytest.approx(sum(part_inertia(obj, k).mass for k in range(len(obj))))
    data = mujoco.MjData(model)
    for q in states(obj):
        for name, value in robot.states(q).items():
            data.joint(name).qpos[0] = value
        mujoco.mj_kinematics(model, data)
        T = obj.tree.forward_kinematics(q)
        for link in robot.links:
            if link.part >= 0:
                place = transform_points(T[link.part], link.origin[None])[0]
                np.testing.assert_allclose(data.body(link.name).xpos, place, atol=1e-9)
                np.testing.assert_allclose(data.body(link.name).xmat.reshape(3, 3), T[link.part, :3, :3], atol=1e-9)


def test_a_screw_advances_in_mujoco_as_it_is_turned(tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    obj = valve()
    export(obj, tmp_path, ["mjcf"])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / FORMATS["mjcf"]))
    model.opt.gravity = 0
    data = mujoco.MjData(model)
    while data.joint("cap_joint").qpos[0] < 5.0 and data.time < 2.0:
        data.joint("cap_joint").qfrc_applied[0] = 0.05
        mujoco.mj_step(model, data)
    turned = data.joint("cap_joint").qpos[0]
    assert turned >= 5.0
    assert data.joint("cap_slide").qpos[0] == pytest.approx(0.002 * turned, rel=1e-3)
    assert data.joint("knob_1_joint").qpos[0] == pytest.approx(0.005 * turned, rel=1e-3)


@pytest.mark.parametrize("category", ["faucet", "laptop", "drawer", "bucket", "door", "scissors", "trash_can"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_motors_at_full_control_keep_velocity_limits_and_stops(category: str, sign: float, tmp_path: Path) -> None:
    """For five seconds, which is long enough to get from any stop to the other."""
    mujoco = installed("mujoco")
    obj = make(category, 1)
    export(obj, tmp_path, ["mjcf"], options=ExportOptions(actuators="motor"))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / FORMATS["mjcf"]))
    data, joints = mujoco.MjData(model), as_robot(obj).joints
    assert model.nu == sum(joint.mimic is None for joint in joints)
    while data.time < 5.0:
        data.ctrl[:] = sign
        mujoco.mj_step(model, data)
        for joint in joints:
            state, speed = data.joint(joint.name).qpos[0], data.joint(joint.name).qvel[0]
            assert abs(speed) < 1.05 * joint.velocity
            if np.isfinite(joint.lower):
                beyond = max(state - joint.upper, joint.lower - state)
                assert beyond < 0.02 * (joint.upper - joint.lower)


def test_buttons_that_travel_less_than_a_millimetre_stop_where_they_end(tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    obj = make("phone", 0)
    export(obj, tmp_path, ["mjcf"], options=ExportOptions(actuators="motor"))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / FORMATS["mjcf"]))
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    limits, span = model.jnt_range, np.ptp(model.jnt_range, axis=1)
    assert span.min() < 5e-4
    for _ in range(200):
        mujoco.mj_step(model, data)
        assert np.all(data.qpos < limits[:, 1] + 0.02 * span)
    assert np.all(data.qpos > limits[:, 1] - 0.02 * span)


def test_position_actuators_go_where_they_are_told(tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    obj = make("drawer", 2)
    export(obj, tmp_path, ["mjcf"], options=ExportOptions(actuators="position"))
    model = mujoco.MjModel.from_xml_path(str(tmp_path / FORMATS["mjcf"]))
    data = mujoco.MjData(model)
    goal = 0.5 * model.actuator_ctrlrange[:, 1]
    data.ctrl[:] = goal
    while data.time < 3.0:
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(data.actuator_length, goal, atol=0.01)


def test_a_free_base_falls_and_a_fixed_one_does_not(tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    bases: tuple[tuple[Base, float], ...] = (("fixed", 0.0), ("free", 0.5 * 9.81))
    for base, fallen in bases:
        export(valve(), tmp_path / base, ["mjcf"], options=ExportOptions(base=base))
        model = mujoco.MjModel.from_xml_path(str(tmp_path / base / FORMATS["mjcf"]))
        data = mujoco.MjData(model)
        while data.time < 1.0:
            mujoco.mj_step(model, data)
        assert data.body(1).xpos[2] == pytest.approx(-fallen, abs=0.05)


def test_unknown_ways_to_stand_and_drive_are_named() -> None:
    with pytest.raises(ConfigError, match="free"):
        ExportOptions(base="floating")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="position"):
        ExportOptions(actuators="velocity")  # type: ignore[arg-type]
