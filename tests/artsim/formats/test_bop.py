"""Datasets in BOP's layout, checked by BOP's own definitions of poses, masks, depth and models."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.ndimage import binary_dilation
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

import artsim
from artsim import Dataset
from artsim.formats.conversion import convert
from artsim.observing.sample import Sample

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class View:
    """An image of a scene, as BOP describes it."""

    folder: Path
    number: int
    sample: Sample

    def about(self, name: str) -> Any:
        return json.loads((self.folder / f"scene_{name}.json").read_text())[str(self.number)]

    def image(self, kind: str, part: int | None = None) -> np.ndarray:
        name = f"{self.number:06d}" + ("" if part is None else f"_{part:06d}")
        return np.asarray(Image.open(self.folder / kind / f"{name}.png"))


@pytest.fixture(scope="module")
def folder(imaged: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("bop") / "out"
    convert(imaged, "bop", out, group=5, workers=1, progress=False)
    return out


@pytest.fixture(scope="module")
def views(folder: Path, imaged: Dataset) -> list[View]:
    found = []
    for split in ("train", "test"):
        for i, sample in enumerate(artsim.open_dataset(imaged.folder, split)):
            found.append(View(folder / split / f"{i // 5:06d}", i % 5, sample))
    assert len(found) == len(imaged)
    return found


@pytest.fixture(scope="module")
def models(folder: Path) -> dict[int, trimesh.Trimesh]:
    return {int(path.stem[4:]): trimesh.load(path, process=False) for path in (folder / "models").glob("*.ply")}


@pytest.fixture(scope="module")
def exact_folder(exact: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("exact_bop") / "out"
    convert(exact, "bop", out, workers=1, progress=False)
    return out


def pose_of(truth: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    return np.reshape(truth["cam_R_m2c"], (3, 3)), np.array(truth["cam_t_m2c"])


def test_images_and_poses_are_those_of_the_samples(views: list[View]) -> None:
    for view in views:
        sample, camera = view.sample, view.about("camera")
        assert np.array_equal(view.image("rgb"), sample.rgb)
        depth, unit = view.image("depth"), camera["depth_scale"]
        assert np.array_equal(depth > 0, sample.depth > 0)
        assert np.abs(depth * unit - 1000.0 * sample.depth.astype(float)).max() <= 0.5001 * unit
        for k, truth in enumerate(view.about("gt")):
            R, t = pose_of(truth)
            assert np.array_equal(R, sample.T_camera_part[k, :3, :3])
            assert np.array_equal(t, 1000.0 * sample.T_camera_part[k, :3, 3])
            assert np.array_equal(view.image("mask_visib", k) == 255, sample.part_mask == k)
        T_camera_world = np.reshape(camera["cam_R_w2c"], (3, 3))
        world = T_camera_world @ sample.T_world_camera[:3, 3] * 1000.0 + camera["cam_t_w2c"]
        assert np.allclose(world, 0.0, atol=1e-9)


def test_rays_through_whole_pixels_meet_models_at_the_depth_that_is_stored(exact: Dataset, exact_folder: Path) -> None:
    """Masks and depth are drawn anew from the files alone, with pixel centres at whole numbers as in OpenCV."""
    for number, sample in enumerate(exact):
        view = View(exact_folder / "train" / "000000", number, sample)
        camera, truths, stored = view.about("camera"), view.about("gt"), view.image("depth")
        rows, columns = np.indices(stored.shape).reshape(2, -1)
        K_inverse = np.linalg.inv(np.reshape(camera["cam_K"], (3, 3)))
        rays = (K_inverse @ np.stack([columns, rows, np.ones(len(rows))])).T  # z is 1: their length counts z-depth
        depth = np.full((len(truths), len(rows)), np.inf)
        for k, truth in enumerate(truths):
            R, t = pose_of(truth)
            model = trimesh.load(exact_folder / "models" / f"obj_{truth['obj_id']:06d}.ply", process=False)
            origins = np.broadcast_to(-t @ R, rays.shape)
            places, hit, _ = model.ray.intersects_location(origins, rays @ R, multiple_hits=False)
            depth[k, hit] = (places @ R.T + t)[:, 2]
            assert np.count_nonzero((view.image("mask", k) > 0).ravel() != np.isfinite(depth[k])) <= 2
        nearest = np.where(np.isfinite(depth).any(axis=0), depth.argmin(axis=0), 255)
        seen = np.full(stored.shape, 255)
        for k in range(len(truths)):
            seen[view.image("mask_visib", k) > 0] = k
        same = seen.ravel() == nearest
        assert np.count_nonzero(~same) <= 4
        both = same & (nearest != 255)
        error = np.abs(stored.ravel()[both] * camera["depth_scale"] - depth.min(axis=0)[both])
        assert np.quantile(error, 0.99) <= 0.5 * camera["depth_scale"] + 0.01


def test_depth_under_a_mask_lies_on_the_model(views: list[View], models: dict[int, trimesh.Trimesh]) -> None:
    """The sensor has 3 mm of noise, and the rasteriser's depth buffer rounds."""
    for view in views[::3]:
        camera, depth = view.about("camera"), view.image("depth")
        K_inverse = np.linalg.inv(np.reshape(camera["cam_K"], (3, 3)))
        for k, truth in enumerate(view.about("gt")):
            rows, columns = np.nonzero((view.image("mask_visib", k) > 0) & (depth > 0))
            if len(rows) < 20:
                continue
            rays = np.stack([columns, rows, np.ones(len(rows))]).astype(float)
            points = (K_inverse @ rays * depth[rows, columns] * camera["depth_scale"]).T
            R, t = pose_of(truth)
            _, distance, _ = trimesh.proximity.closest_point(models[truth["obj_id"]], (points - t) @ R)
            assert np.median(distance) < 4.0
            assert np.quantile(distance, 0.95) < 12.0


def test_a_model_that_is_projected_covers_its_mask(views: list[View], models: dict[int, trimesh.Trimesh]) -> None:
    for view in views[::3]:
        K = np.reshape(view.about("camera")["cam_K"], (3, 3))
        for k, (truth, info) in enumerate(zip(view.about("gt"), view.about("gt_info"), strict=True)):
            R, t = pose_of(truth)
            surface, _ = trimesh.sample.sample_surface(models[truth["obj_id"]], 20_000, seed=0)
            image = (surface @ R.T + t) @ K.T
            column, row = np.rint(image[:, :2] / image[:, 2:]).astype(int).T
            left, top, width, height = info["bbox_obj"]
            assert left - 1 <= column.min() <= column.max() <= left + width
            assert top - 1 <= row.min() <= row.max() <= top + height
            whole, seen = view.image("mask", k) > 0, view.image("mask_visib", k) > 0
            inside = (row >= 0) & (row < whole.shape[0]) & (column >= 0) & (column < whole.shape[1])
            drawn = np.zeros_like(whole)
            drawn[row[inside], column[inside]] = True
            near = np.ones((3, 3), bool)
            assert not (drawn & ~binary_dilation(whole, near)).any()
            assert not (whole & ~binary_dilation(drawn, near, iterations=2)).any()
            assert not (seen & ~whole).any()
            assert info["px_count_all"] == whole.sum()
            assert info["px_count_visib"] == seen.sum()
            assert info["px_count_valid"] == (whole & (view.sample.depth > 0)).sum()
            assert info["visib_fract"] == pytest.approx(view.sample.visible_fraction[k], abs=0.05)


def test_joints_move_a_part_from_where_its_parent_carries_it(views: list[View]) -> None:
    kinds = set()
    for view in views:
        truths, articulation = view.about("gt"), view.about("articulation")
        assert articulation["index"] == view.sample.index
        by_model = {truth["obj_id"]: pose_of(truth) for truth in truths}
        parts = articulation["parts"]
        for part in parts[1:]:
            parent = parts[part["parent"]]
            if part["obj_id"] is None or parent["obj_id"] is None:
                continue
            kinds.add(part["joint_type"])
            (R, t), (R_parent, t_parent) = by_model[part["obj_id"]], by_model[parent["obj_id"]]
            axis, origin, moved = np.array(part["axis"]), np.array(part["origin"]), part["state"] - part["rest"]
            turn, shift = np.eye(3), axis * moved
            if part["joint_type"] != "prismatic":
                turn = Rotation.from_rotvec(axis * moved).as_matrix()
                shift = origin - turn @ origin + axis * moved * part.get("pitch", 0.0)
            assert np.allclose(R, R_parent @ turn, atol=1e-9)
            assert np.allclose(t, R_parent @ shift + t_parent, atol=1e-6)
            low, high = part["limits"]
            assert low is None or low - 1e-6 <= part["state"] <= high + 1e-6
    assert {"revolute", "prismatic", "screw"} <= kinds


def test_models_have_the_sizes_that_are_said(folder: Path, models: dict[int, trimesh.Trimesh], imaged: Dataset) -> None:
    info = json.loads((folder / "models" / "models_info.json").read_text())
    assert set(map(int, info)) == set(models)
    for number, mesh in models.items():
        about = info[str(number)]
        used = mesh.vertices[np.unique(mesh.faces)]
        assert np.allclose(used.min(axis=0), [about[f"min_{axis}"] for axis in "xyz"], atol=1e-3)
        assert np.allclose(np.ptp(used, axis=0), [about[f"size_{axis}"] for axis in "xyz"], atol=1e-3)
        assert about["diameter"] == pytest.approx(pdist(np.unique(used, axis=0)).max(), abs=1e-3)
    parts = [(o.category, o.object_id, k) for o in imaged.plan.objects for k in range(o.num_parts)]
    for number, about in info.items():
        assert (about["category"], about["object_id"], about["part"]) == parts[int(number) - 1]


def test_targets_are_the_parts_of_the_test_split_that_are_seen(folder: Path, views: list[View]) -> None:
    targets = json.loads((folder / "test_targets_bop19.json").read_text())
    named = {(t["scene_id"], t["im_id"], t["obj_id"]) for t in targets}
    seen = set()
    for view in views:
        if view.folder.parent.name == "test":
            for truth, info in zip(view.about("gt"), view.about("gt_info"), strict=True):
                if info["visib_fract"] >= 0.1:
                    seen.add((int(view.folder.name), view.number, truth["obj_id"]))
    assert named == seen
    assert len(targets) == len(named)
    camera = json.loads((folder / "camera.json").read_text())
    assert (camera["width"], camera["height"]) == (96, 72)
