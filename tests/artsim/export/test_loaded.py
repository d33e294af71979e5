"""Loaded objects are exported with what collides as asked, and come back as they were."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artsim
from artsim.commands.export import Export
from artsim.errors import ArtsimError, AssetError
from artsim.export import FORMATS, export, prepare
from artsim.export.options import ExportOptions
from artsim.model.convex_bodies import is_convex
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import as_robot
from tests.conftest import ASSETS, installed


def surfaces(obj: ArticulatedObject) -> ArticulatedObject:
    """The object as a file that tells of surfaces only would give it."""
    return replace(obj, parts=tuple(replace(part, body=None) for part in obj.parts))


@pytest.mark.parametrize("collision", ["hull", "surface"])
def test_a_loaded_object_comes_back_from_every_format(collision: Any, tmp_path: Path) -> None:
    obj = artsim.load(ASSETS / "cabinet")
    with pytest.raises(AssetError, match="prepare"):
        export(obj, tmp_path / "raw", ["urdf"])
    export(prepare(obj, collision), tmp_path / "out", list(FORMATS))
    for name in FORMATS.values():
        file = tmp_path / "out" / name
        again = artsim.load(next(file.rglob("*.usdc")) if file.is_dir() else file)
        assert again.tree.types == obj.tree.types
        np.testing.assert_allclose(again.tree.axes, obj.tree.axes, atol=1e-6)
        np.testing.assert_allclose(again.tree.limits, obj.tree.limits - obj.tree.rest[:, None], atol=1e-6)
        np.testing.assert_allclose(again.box_size, obj.box_size, atol=1e-6)
        if collision == "hull" and name != FORMATS["urdf"]:
            pieces = [part.body.pieces for part in again.parts if part.body is not None]
            assert all(len(own) == 1 and is_convex(*own[0]) for own in pieces)


@pytest.mark.slow
def test_pieces_leave_a_drawer_open_in_mujoco(
    one_drawer: ArticulatedObject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mujoco = installed("mujoco")
    installed("coacd")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    obj = replace(one_drawer, parts=(one_drawer.parts[0], surfaces(one_drawer).parts[1]))
    meta = export(prepare(obj, progress=False), tmp_path / "out", ["mjcf"])
    assert meta["artsim"]["joints"] == ["prismatic"]
    spec = mujoco.MjSpec.from_file(str(tmp_path / "out" / FORMATS["mjcf"]))
    opened, half = float(obj.tree.limits[1, 1]), 0.06 * float(obj.box_size[1].min())
    middle = obj.box_center[1] + opened * obj.tree.axes[1]
    body = spec.worldbody.add_body(name="thing", pos=middle)
    body.add_freejoint()
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[half] * 3, mass=0.05)
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(1000):
        data.joint(obj.tree.joints[1].name).qpos[0] = opened
        mujoco.mj_step(model, data)
    inside = data.body("thing").xpos - middle
    assert np.all(np.abs(inside) < 0.5 * obj.box_size[1])
    assert inside[2] < half  # it lies on the floor of the drawer, and not on a hull


def test_the_program_writes_a_folder_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Export(
        ASSETS / "laptop", tmp_path / "out", formats=("mjcf",), collision="hull", options=ExportOptions(materials=True)
    ).run()
    assert (tmp_path / "out" / "meshes" / "materials.mtl").is_file()
    assert "2 parts, 2 shapes that collide" in capsys.readouterr().out
    assert artsim.load(tmp_path / "out").category == "laptop"
    with pytest.raises(ArtsimError, match="exists already"):
        Export(ASSETS / "laptop", tmp_path / "out").run()
    with pytest.raises(ArtsimError, match="there is no 'mesh'"):
        prepare(artsim.load(ASSETS / "laptop"), "mesh")  # type: ignore[arg-type]


@pytest.mark.parametrize("category", ["mouse", "refrigerator"])
def test_springs_damping_and_latches_come_back(category: str, tmp_path: Path) -> None:
    """MJCF has no latches."""
    obj = artsim.make(category, 0)
    export(obj, tmp_path, ["usdz", "mjcf"])
    for name in ("usdz", "mjcf"):
        joints = zip(as_robot(artsim.load(tmp_path / FORMATS[name])).joints, as_robot(obj).joints, strict=True)
        for again, joint in joints:
            values = ["spring", "damping", "friction", "effort"] + ["hold", "hold_over"] * (name == "usdz")
            found, wanted = ([getattr(one, value) for value in values] for one in (again, joint))
            np.testing.assert_allclose(found, wanted, rtol=1e-6)
