"""Handles, knobs, panes: where they are on objects, in samples, in files and in simulators."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from lxml import etree

import artsim
from artsim.datasets.shards import sample_from_members, sample_members
from artsim.errors import AssetError, DatasetError
from artsim.export import export
from artsim.model.details import DETAILS, GRIPS, label_of_visual
from artsim.model.draws import StateOptions, ViewOptions, sample_state, sample_view
from artsim.model.object_file import object_bytes, parse_object
from artsim.model.objects import ArticulatedObject
from artsim.observing.capture import observe
from artsim.observing.sample import Sample

FURNITURE = [("storage_furniture", 1), ("microwave", 1), ("oven", 1), ("drawer", 1)]


def seen(obj: ArticulatedObject, seed: int = 0, details: bool = True) -> Sample:
    rng = np.random.default_rng(seed)
    q = sample_state(obj, StateOptions(), rng)
    return observe(obj, q, sample_view(obj, q, ViewOptions(), rng), rng=rng, details=details)


@pytest.mark.parametrize(("category", "seed"), FURNITURE)
def test_a_detail_fills_the_box_of_its_frame_and_stands_out_to_the_front(category: str, seed: int) -> None:
    obj = artsim.make(category, seed)
    assert obj.details
    assert len({detail.name for detail in obj.details}) == len(obj.details)
    for k, part in enumerate(obj.parts):
        own = [detail for detail in obj.details if detail.part == k]
        for number, detail in enumerate(own):
            assert detail.label in DETAILS
            R = detail.T_rest_detail[:3, :3]
            np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
            assert np.linalg.det(R) > 0
            faces = part.faces[part.detail_of_face == number]
            points = (part.vertices[faces].reshape(-1, 3) - detail.T_rest_detail[:3, 3]) @ R
            assert np.abs(points).max(axis=0) == pytest.approx(0.5 * detail.size, abs=0.01)  # its foot is in the part
            assert detail.size[2] >= detail.size[1] - 1e-9
            if detail.label in GRIPS and k > 0:
                np.testing.assert_allclose(R[:, 0], [-1, 0, 0], atol=1e-9)
                assert detail.T_rest_detail[0, 3] < part.bounds[:, 0].mean()


def test_points_are_on_the_detail_that_they_are_said_to_be_on() -> None:
    obj = artsim.make("storage_furniture", 1)
    sample = seen(obj)
    assert sample.detail is not None
    assert set(np.unique(sample.detail)) > {255}
    for number, detail in enumerate(sample.details):
        part = obj.parts[detail.part]
        first = [d.part for d in obj.details].index(detail.part)
        faces = part.faces[part.detail_of_face == number - first]
        surface = trimesh.Trimesh(part.vertices, faces, process=False)
        own = sample.part == detail.part
        _, distance, _ = trimesh.proximity.closest_point_naive(surface, sample.rest_points[own])
        np.testing.assert_array_equal(sample.detail[own] == number, distance < 1e-5)
    assert seen(obj, details=False).detail is None


@pytest.mark.parametrize("seed", range(3))
def test_frames_in_samples_move_with_their_parts_as_sites_do_in_mujoco(seed: int, tmp_path: Path) -> None:
    import mujoco

    obj = artsim.make("storage_furniture", seed)
    export(obj, tmp_path, ("urdf", "mjcf", "usd"))
    sample = seen(obj, seed)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "mobility.xml"))
    data = mujoco.MjData(model)
    for name, value in obj.source_state(sample.joint_state).items():
        data.joint(name).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    T_rest_camera = np.linalg.inv(sample.T_camera_part[0])
    for detail, T in zip(sample.details, T_rest_camera @ sample.T_camera_detail, strict=True):
        site = data.site(detail.name)
        np.testing.assert_allclose(site.xpos, T[:3, 3], atol=1e-9)
        np.testing.assert_allclose(site.xmat.reshape(3, 3), T[:3, :3], atol=1e-9)
        np.testing.assert_allclose(2.0 * model.site(detail.name).size, detail.size, atol=1e-12)
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(tmp_path / "mobility.usda"))
    root = stage.GetDefaultPrim().GetPath()
    for detail in obj.details:
        path = root.AppendChild(obj.parts[detail.part].name).AppendChild(detail.name)
        place = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(stage.GetPrimAtPath(path))).T
        np.testing.assert_allclose(place, detail.T_rest_detail, atol=1e-9)


def test_details_come_back_from_files(tmp_path: Path) -> None:
    obj = artsim.make("storage_furniture", 1)
    export(obj, tmp_path)
    for back in (artsim.load(tmp_path), parse_object(object_bytes(obj), "file")):
        assert [(d.name, d.part) for d in back.details] == [(d.name, d.part) for d in obj.details]
        for one, two, part, other in zip(back.details, obj.details, back.parts[1:], obj.parts[1:], strict=False):
            np.testing.assert_allclose(one.T_rest_detail, two.T_rest_detail, atol=1e-8)
            np.testing.assert_allclose(one.size, two.size, atol=1e-8)
            np.testing.assert_array_equal(part.detail_of_face, other.detail_of_face)
    sample = seen(obj)
    again = sample_from_members(sample_members(sample), "here")
    np.testing.assert_array_equal(again.T_camera_detail, sample.T_camera_detail)
    np.testing.assert_array_equal(again.detail, sample.detail)


@pytest.mark.parametrize("damage", [b'"part": 99', b'"part": -1', b'"part": "x"'])
def test_damaged_details_are_refused(damage: bytes) -> None:
    obj = artsim.make("storage_furniture", 1)
    members = sample_members(seen(obj))
    members["json"] = members["json"].replace(b'"part":1', damage, 1)
    with pytest.raises(DatasetError, match="detail"):
        sample_from_members(members, "here")
    broken = replace(obj.parts[1], details=(replace(obj.parts[1].details[0], size=np.full(3, np.nan)),))
    with pytest.raises(AssetError, match="number"):
        parse_object(object_bytes(replace(obj, parts=(obj.parts[0], broken, *obj.parts[2:]))), "file")


@pytest.mark.parametrize(
    ("name", "label"),
    [("handle-12", "handle"), ("door_handle", "handle"), ("control_button-3", "button"), ("screen-1", "display"),
     ("handle_2", "handle"), ("base_body-7", None), ("handlebar", None), ("shaft-1", None)],
)  # fmt: skip
def test_names_of_visuals_say_what_they_show(name: str, label: str | None) -> None:
    assert label_of_visual(name) == label


@pytest.mark.parametrize("number", ["45463", "46166", "48381"])
def test_real_handles_are_the_visuals_that_are_named_so(number: str, partnet_dir: Path) -> None:
    folder = partnet_dir / "StorageFurniture" / number
    obj = artsim.load(folder)
    visuals = [v for v in etree.parse(folder / "mobility.urdf").iter("visual") if "handle" in v.get("name", "")]
    files = {mesh.get("filename") for visual in visuals for mesh in visual.iter("mesh")}
    area = sum(trimesh.load(folder / file, force="mesh", process=False).area for file in files)
    own = [part.faces[part.detail_of_face >= 0] for part in obj.parts]
    found = sum(
        trimesh.Trimesh(part.vertices, faces, process=False).area
        for part, faces in zip(obj.parts, own, strict=True)
        if len(faces)
    )
    assert found == pytest.approx(area, rel=1e-6)
    assert all(detail.T_rest_detail[0, 0] < -0.9 for detail in obj.details)  # they stand out to the front
