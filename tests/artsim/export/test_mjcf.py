"""MJCF files have the links, masses and kinematics of the object."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from artsim.export import FORMATS, export
from artsim.export.robot import as_robot
from artsim.model.inertia import part_inertia
from artsim.model.kinematics import Array, transform_points
from artsim.model.objects import ArticulatedObject
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
