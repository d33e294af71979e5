"""Grasps lie on opposite sides of a part, open its joint, and are the same again; hands that cannot hold have none."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

import artsim
from artsim.commands.grasps import Grasps as Command
from artsim.export import prepare
from artsim.loading.sources import family_sources
from artsim.physics.grasp_files import write_grasps
from artsim.physics.grasps import FRICTION_ANGLE, Grasps, Gripper, _Trial, find_grasps
from tests.conftest import installed

COUNT = 3


@pytest.fixture(scope="module")
def of_drawer() -> Grasps:
    installed("mujoco")
    return find_grasps(artsim.make("drawer", 3), np.random.default_rng(0), COUNT)


def test_pads_meet_opposite_sides_of_the_part(of_drawer: Grasps) -> None:
    obj = artsim.make("drawer", 3)
    assert of_drawer.part.tolist() == [1] * COUNT
    part = obj.parts[1]
    surface = trimesh.Trimesh(part.vertices * obj.scale, part.faces)
    for T, width in zip(of_drawer.T_part_grasp, of_drawer.width, strict=True):
        np.testing.assert_allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=1e-9)
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
        pads = T[:3, 3] + 0.5 * width * np.outer((-1.0, 1.0), T[:3, 1])
        _, distance, faces = trimesh.proximity.closest_point(surface, pads)
        assert distance.max() < 1e-4
        normals = surface.face_normals[faces]
        assert (np.abs(normals @ T[:3, 1]) >= np.cos(FRICTION_ANGLE) - 1e-6).all()
        assert normals[0] @ normals[1] < 0
        assert 0 < width < Gripper().opening


def test_the_joint_has_opened_by_half_of_its_range_or_as_far_as_a_proof_goes(of_drawer: Grasps) -> None:
    travel = artsim.make("drawer", 3).tree.limits[1, 1]
    assert (0.8 * min(0.5 * travel, 0.12) <= of_drawer.opened).all()
    assert (of_drawer.opened <= travel).all()


def test_no_grasp_is_proved_beside_the_part_or_by_a_weak_hand(of_drawer: Grasps) -> None:
    obj = artsim.make("drawer", 3)
    T = of_drawer.T_part_grasp[0]
    assert _Trial(obj, Gripper()).opens(1, T) is not None
    assert _Trial(obj, replace(Gripper(), force=0.05)).opens(1, T) is None
    beside = T.copy()
    beside[:3, 3] -= 0.15 * T[:3, 2]
    trial = _Trial(obj, Gripper())
    assert trial.is_free(beside)
    assert trial.opens(1, beside) is None
    inside = T.copy()
    inside[:3, 3] = obj.box_center[0]
    assert not trial.is_free(inside)


def test_parts_wider_than_the_hand_have_no_room() -> None:
    installed("mujoco")
    found = find_grasps(artsim.make("drawer", 3), np.random.default_rng(0), 1, replace(Gripper(), opening=0.004))
    assert len(found.part) == 0
    assert found.tried.tolist() == [0, 0]


@pytest.mark.slow
def test_a_real_object_has_grasps(partnet_dir: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed("mujoco")
    installed("coacd")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = next(path for path in sorted((partnet_dir / "Refrigerator").iterdir()) if path.is_dir())
    obj = prepare(artsim.load(folder), progress=False)
    found = find_grasps(obj, np.random.default_rng(0), 1)
    assert set(found.part) <= set(obj.tree.free_joints)
    assert found.tried.sum() >= len(found.part) >= 1


@pytest.mark.slow
def test_a_run_resumes_to_the_same_bytes_on_any_number_of_processes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    installed("mujoco")
    sources = family_sources(["drawer", "laptop"], 1)
    one = write_grasps(sources, tmp_path / "one", 2, workers=1, progress=False)
    assert (one.objects, one.made, one.failed) == (2, 2, ())
    assert 0 < one.grasped <= one.graspable <= one.parts
    (tmp_path / "two").mkdir()
    for name in ("drawer_0.json", "drawer_0.npz"):
        (tmp_path / "two" / name).write_bytes((tmp_path / "one" / name).read_bytes())
    assert write_grasps(sources, tmp_path / "two", 2, workers=2, progress=False).made == 1
    for file in (tmp_path / "one").glob("*.*"):
        assert (tmp_path / "two" / file.name).read_bytes() == file.read_bytes()
    record = json.loads((tmp_path / "two" / "laptop_0.json").read_text())
    arrays = np.load(tmp_path / "two" / "laptop_0.npz")
    listed = [grasp["T_part_grasp"] for grasps in record["parts"].values() for grasp in grasps]
    np.testing.assert_array_equal(listed, arrays["T_part_grasp"])
    Command(category=("drawer",), count=1, per_part=2, out=tmp_path / "two", workers=1).run()
    assert "1 objects were there already" in capsys.readouterr().out
