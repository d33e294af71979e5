"""Exported objects in PyBullet, MuJoCo and SAPIEN: nothing is lost, and every part goes where artsim says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from artsim.export import export
from artsim.families import FAMILIES, make
from artsim.model.kinematics import KinematicTree
from artsim.physics.simulators import AGREEMENT, SIMULATORS, compare_simulators
from tests.conftest import ASSETS, installed, valve


@pytest.fixture(scope="module", params=SIMULATORS)
def simulator(request: pytest.FixtureRequest) -> str:
    """Each simulator that is installed."""
    name = str(request.param)
    installed(name)
    return name


@pytest.mark.slow
@pytest.mark.parametrize("category", FAMILIES)
def test_every_family_is_the_same_everywhere(category: str, simulator: str, tmp_path: Path) -> None:
    obj = make(category, 3)
    export(obj, tmp_path)
    (found,) = compare_simulators(tmp_path, states=5, simulators=[simulator])
    assert found.problem == ""
    screws = obj.tree.types.count("screw")
    assert (found.links, found.joints) == (len(obj) + screws, len(obj) - 1 + screws)
    assert found.metres <= AGREEMENT * max(1.0, obj.diagonal)


def test_screws_and_mimics_are_the_same_everywhere(simulator: str, tmp_path: Path) -> None:
    export(valve(), tmp_path)
    (found,) = compare_simulators(tmp_path, simulators=[simulator])
    assert found.problem == ""
    assert (found.links, found.joints) == (6, 5)


def test_demo_objects_in_partnets_manner_move_the_same_everywhere(simulator: str) -> None:
    """Their base links are empty and fixed to the first part; the simulators count them, and so does the file."""
    for name in ("cabinet", "eyeglasses", "scissors"):
        (found,) = compare_simulators(ASSETS / name, states=5, simulators=[simulator])
        assert found.problem == "", name


def test_a_joint_that_differs_is_found(simulator: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """artsim is told that the axis is a tenth of a millimetre from where the simulator reads it."""
    export(make("laptop", 0), tmp_path)
    obj = make("laptop", 0)
    x, y, z = obj.native_tree.joints[1].origin
    moved = replace(obj.native_tree.joints[1], origin=(x + 1e-4, y, z))
    obj = replace(obj, native_tree=KinematicTree([obj.native_tree.joints[0], moved]))
    monkeypatch.setattr("artsim.physics.simulators.load", lambda file: obj)
    (found,) = compare_simulators(tmp_path, states=2, simulators=[simulator])
    assert found.metres > 1e-5
    assert "from where artsim does" in found.problem


def test_a_file_that_does_not_load_is_a_finding(
    tmp_path: Path, simulator: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    obj = make("laptop", 0)
    export(obj, tmp_path)
    file = tmp_path / "mobility.urdf"
    file.write_text(file.read_text().replace('<child link="lid"/>', '<child link="nobody"/>'))
    monkeypatch.setattr("artsim.physics.simulators.load", lambda file: obj)
    monkeypatch.setattr("artsim.physics.simulators.poses_in_file", lambda file: lambda values: {})
    (found,) = compare_simulators(tmp_path, simulators=[simulator])
    assert found.problem.startswith("does not load it")
    assert np.isinf(found.metres)


def test_mujoco_fuses_the_root_unless_told_not_to(tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    obj = make("laptop", 0)
    export(obj, tmp_path)
    file = tmp_path / "mobility.urdf"
    assert mujoco.MjModel.from_xml_path(str(file)).nbody - 1 == len(obj)
    file.write_text(file.read_text().replace('fusestatic="false"', 'fusestatic="true"'))
    assert mujoco.MjModel.from_xml_path(str(file)).nbody - 1 == len(obj) - 1


@pytest.mark.slow
@pytest.mark.parametrize("category", FAMILIES)
def test_every_family_stands_apart_at_rest_and_moves_calmly(category: str, tmp_path: Path) -> None:
    """A second under gravity in MuJoCo: no part touches another at first, nothing blows up, limits hold."""
    mujoco = installed("mujoco")
    export(make(category, 1), tmp_path, ["mjcf"])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "mobility.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    while data.time < 1.0:
        mujoco.mj_step(model, data)
    assert sum(int(warning.number) for warning in data.warning) == 0
    assert np.abs(data.qvel).max() < 50.0
    for j in np.flatnonzero(model.jnt_limited):
        low, high = model.jnt_range[j]
        assert low - 0.05 < data.qpos[model.jnt_qposadr[j]] < high + 0.05
