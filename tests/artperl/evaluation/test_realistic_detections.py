"""Detections made from the truth: perfect without flaws, flawed as asked for, the same for the same seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from artperl.evaluation.realistic_detections import Flaws, imperfect, realistic_detections
from artperl.inputs.coco_masks import decode_segmentation
from artsim.errors import ConfigError
from artsim.scenes import SceneCameraOptions, SceneDataset, SceneOptions, SceneRun, generate_scenes, open_scenes
from tests.artsim.datasets.conftest import quick_workers  # noqa: F401

NONE = Flaws(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
RUN = SceneRun(
    SceneOptions(("stapler", "laptop"), distractors=1), SceneCameraOptions(width=320, height=180),
    renderer="raycast", num_points=64,
)  # fmt: skip


@pytest.fixture
def scenes(tmp_path: Path, quick_workers: None) -> SceneDataset:  # noqa: F811
    generate_scenes(RUN, tmp_path / "scenes", 2, workers=1, progress=False)
    return open_scenes(tmp_path / "scenes")


def disc(radius: float) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    y, x = np.ogrid[:200, :200]
    return np.asarray((x - 100) ** 2 + (y - 100) ** 2 < radius**2)


def overlap(flaws: Flaws, seeds: int = 20) -> float:
    truth = disc(50)
    masks = [imperfect(truth, flaws, np.random.default_rng(seed)) for seed in range(seeds)]
    return float(np.mean([(mask & truth).sum() / (mask | truth).sum() for mask in masks]))


def test_a_border_that_is_off_by_so_much_costs_the_ring_that_it_sweeps() -> None:
    assert overlap(NONE) == 1.0
    # The mean of a normal error of s pixels is 0.8 s: on a circle of radius r a share of 1.6 s / r of the disc.
    for border in (1.5, 3.0, 4.5):
        off = border * np.sqrt(1.25)
        assert 1.0 - overlap(Flaws(border, 0.0, 0.0)) == pytest.approx(1.6 * off / 50, rel=0.4)


def test_cuts_and_leaks_change_as_much_as_they_say() -> None:
    assert 0.7 <= overlap(Flaws(0.0, 1.0, 0.0)) <= 0.9
    assert 0.9 <= overlap(Flaws(0.0, 0.0, 1.0)) < 1.0


@pytest.mark.slow
def test_without_flaws_every_visible_object_is_found_as_it_is(scenes: SceneDataset) -> None:
    found = realistic_detections(scenes, NONE)
    assert len(found) == sum(obj.visible_fraction >= 0.1 for entry in scenes.entries for obj in entry.objects)
    for own in found:
        record = scenes[own["image_id"]]
        mask = decode_segmentation(own["segmentation"], 320, 180)
        (i,) = [i for i in range(2) if np.array_equal(mask, record.instance_ids == i)]
        assert own["category"] == record.entry.objects[i].category
        assert own["category_id"] == 1 + scenes.categories.index(own["category"])
        assert own["score"] > 0.6


@pytest.mark.slow
def test_the_seed_decides_and_each_flaw_shows(scenes: SceneDataset) -> None:
    assert realistic_detections(scenes, None, 1) == realistic_detections(scenes, None, 1)
    assert realistic_detections(scenes, None, 1) != realistic_detections(scenes, None, 2)
    assert realistic_detections(scenes, Flaws(missed=1.0, false=0.0)) == []
    twice = realistic_detections(scenes, Flaws(missed=0.0, twice=1.0, false=0.0))
    once = realistic_detections(scenes, Flaws(missed=0.0, twice=0.0, false=0.0))
    assert len(twice) == 2 * len(once)
    confused = realistic_detections(scenes, Flaws(missed=0.0, confused=1.0, false=0.0, twice=0.0))
    assert sorted(d["category"] for d in confused) == sorted(d["category"] for d in once)  # each becomes the other
    assert len(realistic_detections(scenes, Flaws(missed=1.0, false=20.0))) > 10


def test_flaws_out_of_range_are_refused() -> None:
    for wrong in ({"missed": 1.5}, {"border": -1.0}, {"false": 1000.0}):
        with pytest.raises(ConfigError, match=next(iter(wrong))):
            Flaws(**wrong)
