"""ReArtMix's layout is read as it was written, and the benchmark scores what is found."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from artperl.evaluation.average_precision import ap_table
from artperl.evaluation.realistic_detections import Flaws, realistic_detections
from artperl.evaluation.reartmix import SceneImages, open_images, run_reartmix
from artperl.evaluation.reartmix_files import NAMES, ReArtMixFolder
from artperl.inputs.detections import read_detections
from artperl.scene.estimator import SceneEstimator
from artsim.errors import ArtsimError, DatasetError
from artsim.model.transforms import transform_points
from artsim.scenes import SceneCameraOptions, SceneDataset, SceneOptions, SceneRun, generate_scenes, open_scenes
from tests.artsim.datasets.conftest import quick_workers  # noqa: F401

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_workers")]

RUN = SceneRun(
    SceneOptions(("scissors", "stapler"), diagonal=(0.25, 0.38), distractors=0),
    SceneCameraOptions(width=640, height=360, fov=(43.0, 43.0)), renderer="raycast", num_points=64,
)  # fmt: skip
TO_ANNOTATION = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> SceneDataset:
    folder = tmp_path_factory.mktemp("mix") / "scenes"
    generate_scenes(RUN, folder, 1, seed=7, workers=1, progress=False)
    return open_scenes(folder)


def export(scenes: SceneDataset, folder: Path, size: float = 1.3) -> Path:
    """Write scenes in ReArtMix's layout: models ``size`` times too small, which its matrices make up for."""
    metas: list[Any] = [[]]
    names = {"scissor" if name == "scissors" else name: name for name in scenes.categories}
    number = {names.get(name, name): i for i, name in NAMES.items()}
    for record in scenes:
        instances = []
        for i, sample in enumerate(record.samples):
            assert sample is not None
            low, high = sample.box_center - sample.box_size / 2, sample.box_center + sample.box_size / 2
            corners = [[low.min(axis=0), high.max(axis=0)], *zip(low, high, strict=True)]
            turned = [[(TO_ANNOTATION[:3, :3] @ c / size).tolist() for c in pair] for pair in corners]
            metas.append({"id": len(metas), "corner_pts": turned, "norm_factors": [1.0] * len(turned)})
            links = []
            for k, T in enumerate(sample.T_camera_part):
                M = T @ TO_ANNOTATION.T
                M[:3, :3] *= size
                mask = (record.instance_ids == i) & (record.part_ids == k)
                rows, columns = mask.any(axis=1).nonzero()[0], mask.any(axis=0).nonzero()[0]
                polygon = []
                if len(rows):
                    left, right = float(columns[0]), float(columns[-1] + 1)
                    top, bottom = float(rows[0]), float(rows[-1] + 1)
                    polygon = [[left, top, right, top, right, bottom, left, bottom]]
                links.append({"link_category_id": k, "transformation": M.tolist(), "segmentation": polygon})
            left, top, right, bottom = record.entry.objects[i].box
            instances.append({"category_id": number[sample.category], "urdf_id": len(metas) - 1, "links": links,
                              "bbox": [left, top, right, bottom]})  # fmt: skip
        name = f"scene_{record.entry.scene}/{record.entry.view:04d}"
        document = {"width": record.camera.width, "height": record.camera.height, "color_path": f"{name}.jpg",
                    "depth_path": f"{name}.png", "instances": instances}  # fmt: skip
        for path in (folder / "annotations" / f"{name}.json", folder / "depth" / f"{name}.png"):
            path.parent.mkdir(parents=True, exist_ok=True)
        (folder / "annotations" / f"{name}.json").write_text(json.dumps(document))
        depth = np.rint(1000 * record.depth).astype(np.uint16)
        Image.fromarray(depth).save(folder / "depth" / f"{name}.png")
        K = record.camera.K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]]  # Open3D has the first pixel's centre at 0
        camera = {
            "width": record.camera.width,
            "height": record.camera.height,
            "intrinsic_matrix": K.T.ravel().tolist(),
        }
        (folder / "camera_intrinsic" / name.split("/")[0]).mkdir(parents=True, exist_ok=True)
        (folder / "camera_intrinsic" / name.split("/")[0] / "camera_intrinsic.json").write_text(json.dumps(camera))
    (folder / "urdf_metas.json").write_text(json.dumps({"urdf_metas": metas}))
    return folder


def test_what_was_written_is_read(scenes: SceneDataset, tmp_path: Path) -> None:
    images = open_images(export(scenes, tmp_path))
    assert isinstance(images, ReArtMixFolder)
    ours = [image for _, image in SceneImages(scenes.folder)]
    for (key, read), made in zip(images, ours, strict=True):
        assert key == "scene_7/0000"
        assert pytest.approx(made.K) == read.K
        assert read.depth == pytest.approx(made.depth, abs=0.00051)
        for one, two in zip(read.objects, made.objects, strict=True):
            assert one.category == two.category
            assert one.rotation == pytest.approx(two.rotation, abs=1e-9)
            assert one.center == pytest.approx(two.center, abs=1e-9)
            assert one.size == pytest.approx(two.size, abs=1e-9)
    true = [obj for _, image in images for obj in image.objects]
    table = ap_table(true, true)
    assert all(own[rule] == 1.0 for own in table.values() for rule in ("5_degrees", "5_cm", "iou_50"))
    assert len(images.own_detections(0).all) == len(true)


def test_colour_is_read_where_it_comes_along(scenes: SceneDataset, tmp_path: Path) -> None:
    images = ReArtMixFolder(export(scenes, tmp_path))
    assert [image.rgb for _, image in images] == [None]
    file = tmp_path / "color" / "scene_7" / "0000.jpg"
    file.parent.mkdir(parents=True)
    Image.new("RGB", (640, 360), (200, 60, 20)).save(file)
    ((_, image),) = images
    assert image.rgb is not None
    assert np.abs(image.rgb.astype(int) - [200, 60, 20]).max() < 4  # JPEG
    Image.new("L", (640, 360)).save(file)
    with pytest.raises(DatasetError, match="no image in colour of 640 x 360"):
        list(images)
    file.unlink()
    with pytest.raises(ArtsimError, match=r"0000\.jpg"):
        list(images)


def test_boxes_hold_the_points_that_are_seen(scenes: SceneDataset) -> None:
    for image, record in zip((i for _, i in SceneImages(scenes.folder)), scenes, strict=True):
        for obj, sample in zip(image.objects, record.samples, strict=True):
            assert sample is not None
            for k in range(len(obj.center)):
                own = sample.points[sample.part == k]
                inside = np.abs((own - obj.center[k]) @ obj.rotation[k]) <= obj.size[k] / 2 + 1e-4
                assert inside.all()


def test_the_benchmark_finds_scissors_and_says_what_has_no_estimator(scenes: SceneDataset, tmp_path: Path) -> None:
    images, lines = SceneImages(scenes.folder), list[str]()
    perfect = realistic_detections(scenes, Flaws(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    (tmp_path / "detections.json").write_text(json.dumps(perfect))
    detections = read_detections(tmp_path / "detections.json", images.sizes, images.names())
    estimator = SceneEstimator()
    del estimator.estimators["stapler"]
    figures = run_reartmix(images, detections, estimator, False, lines.append)
    assert figures["categories"]["stapler"]["iou_50"] == 0.0
    assert figures["categories"]["scissors"]["5_cm"] > 0.0
    assert figures["mean"]["5_cm"] == pytest.approx(figures["mean_with_estimator"]["5_cm"] / 2)
    assert any("no estimator for stapler" in line for line in lines)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda d: d.pop("width"), "width"),
        (lambda d: d.update(depth_path="../../secret.png"), "outside of its folder"),
        (lambda d: d["instances"][0].update(category_id=9), "category_id"),
        (lambda d: d["instances"][0].update(urdf_id=77), "no boxes"),
        (lambda d: d["instances"][0]["links"][0].update(transformation=[[1, 2], [3, 4]]), "4 x 4"),
        (lambda d: d["instances"][0]["links"][0]["transformation"][0].__setitem__(0, 5.0), "no rotation|inside out"),
    ],
)
def test_damage_is_named(scenes: SceneDataset, tmp_path: Path, change: Any, told: str) -> None:
    folder = export(scenes, tmp_path)
    path = folder / "annotations" / "scene_7" / "0000.json"
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    with pytest.raises(DatasetError, match=told):
        list(ReArtMixFolder(folder))


def test_a_folder_that_is_neither_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="artsim scene"):
        open_images(tmp_path)


def test_the_annotation_frame_has_the_axes_y_z_x() -> None:
    point = np.array([[1.0, 2.0, 3.0]])
    assert transform_points(TO_ANNOTATION, point).tolist() == [[2.0, 3.0, 1.0]]
    assert Rotation.from_matrix(TO_ANNOTATION[:3, :3]).magnitude() > 0
