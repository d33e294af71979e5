"""Scenes on disk: complete, resumable, the same whoever makes them, and true in every format."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from pycocotools import mask as coco_mask

from artsim.errors import ConfigError, DatasetError
from artsim.runs.tasks import JOURNAL
from artsim.scenes import SceneCameraOptions, SceneDataset, SceneOptions, SceneRun, generate_scenes, open_scenes
from artsim.scenes.convert import convert_scenes
from artsim.scenes.dataset import DESCRIPTION
from tests.artsim.datasets.conftest import quick_workers  # noqa: F401
from tests.artsim.formats.conftest import contents

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_workers")]

OTHERS: dict[str, Any] = {"views": 2, "renderer": "raycast", "num_points": 64, "noise": "d435", "misses": True}
RUN = SceneRun(
    SceneOptions(("stapler", "drawer"), count=(1, 2), diagonal=(0.18, 0.38), crowded=True, distractors=1),
    SceneCameraOptions(width=160, height=90),
    **OTHERS,
)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("scenes") / "three"
    generate_scenes(RUN, folder, 3, workers=1, progress=False)
    return folder


def test_the_bytes_do_not_depend_on_the_number_of_workers_nor_on_growth(made: Path, tmp_path: Path) -> None:
    one = generate_scenes(RUN, tmp_path / "grown", 1, workers=1, progress=False)
    more = generate_scenes(RUN, tmp_path / "grown", 3, workers=2, progress=False)
    assert (one.made, more.made) == (1, 2)
    assert contents(tmp_path / "grown") == contents(made)
    assert generate_scenes(RUN, made, 3, workers=1, progress=False).made == 0


def test_shards_hold_what_folders_hold(made: Path, tmp_path: Path) -> None:
    generate_scenes(RUN, tmp_path / "tar", 3, shard_size=2, workers=1, progress=False)
    assert sorted(path.name for path in (tmp_path / "tar").glob("*.tar")) == ["scenes-000000.tar", "scenes-000001.tar"]
    folders, shards = open_scenes(made), open_scenes(tmp_path / "tar")
    assert len(folders) == len(shards) == 6
    for one, two in zip(folders, shards, strict=True):
        assert one.entry.objects == two.entry.objects
        assert np.array_equal(one.depth, two.depth)
        assert np.array_equal(one.instance_ids, two.instance_ids)
        assert one.rgb is None
        for mine, theirs in zip(one.samples, two.samples, strict=True):
            assert (mine is None) == (theirs is None)
            assert mine is None or theirs is None or np.array_equal(mine.points, theirs.points)


def test_records_are_those_of_the_views(made: Path) -> None:
    seen = RUN.observe(1)
    for number, view in enumerate(seen):
        record = next(r for r in open_scenes(made) if (r.entry.scene, r.entry.view) == (1, number))
        assert np.array_equal(record.depth, view.depth)
        assert np.array_equal(record.part_ids, view.frame.part_ids)
        assert np.allclose(record.camera.K, view.camera.K, rtol=1e-12)
        for thing, sample, told in zip(view.scene.instances, record.samples, record.entry.objects, strict=True):
            assert 0.18 <= thing.obj.diagonal <= 0.38
            assert told.parts == len(thing.obj)
            assert sample is None or sample.noise == "d435+misses"


def test_damage_is_mended_and_a_stopped_run_goes_on(made: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    generate_scenes(RUN, out, 3, workers=1, progress=False)
    document = json.loads((out / DESCRIPTION).read_text())
    (out / "000001_0" / "depth.npy").write_bytes(b"?")
    assert generate_scenes(RUN, out, 3, workers=1, progress=False).made == 1
    assert contents(out) == contents(made)
    # As a killed run leaves it: one scene is noted, the second one's line is cut short.
    recipe = {name: value for name, value in document.items() if name not in ("pieces", "files")}
    name, files, value = document["pieces"][0]
    entry = [name, {file: document["files"][file] for file in files}, value]
    (out / JOURNAL).write_text(f'{json.dumps(recipe)}\n{json.dumps(entry)}\n["000001-0')
    (out / DESCRIPTION).unlink()
    with pytest.raises(DatasetError, match="the same command again"):
        SceneDataset(out)
    assert generate_scenes(RUN, out, 3, workers=1, progress=False).made == 2
    assert contents(out) == contents(made)


def test_other_options_are_refused_by_name(made: Path, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="different: seed"):
        generate_scenes(RUN, made, 3, seed=1, workers=1, progress=False)
    closer = SceneRun(RUN.scene, SceneCameraOptions(width=160, height=90, fill=(0.9, 0.95)), **OTHERS)
    with pytest.raises(DatasetError, match=r"different: camera\.fill\)"):
        generate_scenes(closer, made, 3, workers=1, progress=False)
    with pytest.raises(DatasetError, match="different: scenes"):
        generate_scenes(RUN, made, 2, workers=1, progress=False)
    with pytest.raises(ConfigError, match="scenes"):
        generate_scenes(RUN, tmp_path, 0, progress=False)
    with pytest.raises(ConfigError, match="count"):
        SceneOptions(count=(3, 2))
    with pytest.raises(ConfigError, match="diagonal"):
        SceneOptions(diagonal=(-0.1, 0.2))
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(DatasetError, match=r"notes\.txt"):
        generate_scenes(RUN, tmp_path, 1, workers=1, progress=False)


@pytest.mark.parametrize("change", [{"format": 9}, {"pieces": 3}, {"pieces": [["a", [], [{"key": "../../x"}]]]}])
def test_a_forged_description_is_refused(made: Path, tmp_path: Path, change: dict[str, object]) -> None:
    document = json.loads((made / DESCRIPTION).read_text())
    (tmp_path / DESCRIPTION).write_text(json.dumps(document | change))
    with pytest.raises(DatasetError, match="damaged"):
        SceneDataset(tmp_path)


def test_coco_masks_are_those_of_the_instances(made: Path, tmp_path: Path) -> None:
    out = convert_scenes(RUN, made, "coco", 1, tmp_path / "coco", progress=False)
    document = json.loads((out / "annotations" / "instances.json").read_text())
    scenes, names = open_scenes(made), {c["id"]: c["name"] for c in document["categories"]}
    assert len(document["images"]) == len(scenes)
    assert len(document["annotations"]) == sum(o.visible_fraction > 0 for e in scenes.entries for o in e.objects)
    for own in document["annotations"]:
        record = scenes[own["image_id"]]
        assert names[own["category_id"]] == record.entry.objects[own["instance"]].category
        assert np.array_equal(coco_mask.decode(own["segmentation"]) > 0, record.instance_ids == own["instance"])
        left, top, width, height = own["bbox"]
        assert (left, top, left + width, top + height) == record.entry.objects[own["instance"]].box
    image = document["images"][3]
    depth = np.asarray(Image.open(out / "depth" / image["file_name"]))
    assert depth == pytest.approx(1000.0 * scenes[3].depth, abs=0.51)


def test_bop_models_lie_where_the_depth_is(made: Path, tmp_path: Path) -> None:
    out = convert_scenes(RUN, made, "bop", 1, tmp_path / "bop", progress=False)
    scenes = open_scenes(made)
    models = json.loads((out / "models" / "models_info.json").read_text())
    first = {e.scene: e for e in scenes.entries}
    assert len(models) == sum(obj.parts for e in first.values() for obj in e.objects)
    folder = out / "test" / "000001"
    truths = json.loads((folder / "scene_gt.json").read_text())["0"]
    infos = json.loads((folder / "scene_gt_info.json").read_text())["0"]
    camera = json.loads((folder / "scene_camera.json").read_text())["0"]
    K = np.reshape(camera["cam_K"], (3, 3))
    assert len(truths) == len(infos) > 1
    for truth, info in zip(truths, infos, strict=True):
        told = models[str(truth["obj_id"])]
        low = np.array([told[f"min_{axis}"] for axis in "xyz"])
        size = np.array([told[f"size_{axis}"] for axis in "xyz"])
        corners = low + size * np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
        posed = corners @ np.reshape(truth["cam_R_m2c"], (3, 3)).T + truth["cam_t_m2c"]
        image = posed @ K.T
        image = image[:, :2] / image[:, 2:]
        left, top, width, height = info["bbox_obj"]
        assert image[:, 0].min() - 1 <= left
        assert left + width <= image[:, 0].max() + 1
        assert image[:, 1].min() - 1 <= top
        assert top + height <= image[:, 1].max() + 1
