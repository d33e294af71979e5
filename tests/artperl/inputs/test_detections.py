"""Detections of files: masks as COCO's own tools read them, and every fault is named with its mend."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pycocotools import mask as coco_mask

from artperl.inputs.coco_masks import decode_segmentation
from artperl.inputs.detections import image_ids, read_detections
from artsim.errors import ConfigError
from artsim.formats.coco import run_lengths

SIZES: dict[int | str, tuple[int, int]] = {0: (40, 30), 1: (40, 30)}


def blob(seed: int) -> np.ndarray[Any, Any]:
    rng = np.random.default_rng(seed)
    mask = np.zeros((30, 40), dtype=bool)
    for _ in range(4):
        top, left = rng.integers(0, 25), rng.integers(0, 35)
        mask[top : top + rng.integers(1, 20), left : left + rng.integers(1, 20)] ^= True
    return mask


def entry(**changes: object) -> dict[str, object]:
    mask = np.zeros((30, 40), dtype=bool)
    mask[5:12, 8:20] = True
    own = {"image_id": 0, "category": "laptop", "score": 0.5,
           "segmentation": {"size": [30, 40], "counts": run_lengths(mask)}, "bbox": [8, 5, 12, 7]}  # fmt: skip
    return own | changes


def write(path: Path, document: object) -> Path:
    path.write_text(json.dumps(document))
    return path


@pytest.mark.parametrize("seed", range(6))
def test_run_lengths_are_read_as_pycocotools_writes_them(seed: int) -> None:
    mask = blob(seed) if seed else np.ones((30, 40), dtype=bool)
    told = coco_mask.encode(np.asfortranarray(mask.astype(np.uint8)))
    assert np.array_equal(decode_segmentation({"size": [30, 40], "counts": told["counts"].decode()}, 40, 30), mask)
    flat = mask.ravel(order="F").astype(int)
    ends = np.flatnonzero(np.diff(flat)) + 1
    runs = np.diff([0, *ends, flat.size]).tolist()
    assert np.array_equal(decode_segmentation({"size": [30, 40], "counts": [0] * flat[0] + runs}, 40, 30), mask)


def test_polygons_cover_what_pycocotools_says_but_for_their_border() -> None:
    polygon = [3.0, 4.0, 33.5, 6.0, 30.0, 25.0, 12.0, 22.5]
    ours = decode_segmentation([polygon], 40, 30)
    theirs = coco_mask.decode(coco_mask.merge(coco_mask.frPyObjects([polygon], 30, 40))) > 0
    assert (ours & theirs).sum() / (ours | theirs).sum() > 0.9
    square = decode_segmentation([[10, 10, 20, 10, 20, 20, 10, 20]], 40, 30)
    assert square[11:19, 11:19].all()
    assert not square[:9].any()


def test_a_list_and_a_document_with_categories_say_the_same(tmp_path: Path) -> None:
    numbered = entry(category_id=3)
    del numbered["category"]
    document = {"annotations": [numbered], "categories": [{"id": 3, "name": "scissor"}],
                "images": [{"id": 0, "file_name": "a.png"}]}  # fmt: skip
    path = write(tmp_path / "d.json", document)
    (found,) = read_detections(path, SIZES).all
    assert (found.category, found.score, found.box) == ("scissors", 0.5, (8.0, 5.0, 12.0, 7.0))
    assert found.mask.sum() == 7 * 12
    assert image_ids(path) == {"0": "a.png"}
    assert read_detections(write(tmp_path / "l.json", [numbered]), SIZES, {3: "scissors"}).all[0].category == "scissors"


def test_a_box_alone_is_all_of_the_box_and_that_is_said(tmp_path: Path) -> None:
    result = read_detections(write(tmp_path / "d.json", [entry(segmentation=None)]), SIZES)
    assert result.all[0].mask[5:12, 8:20].all()
    assert result.all[0].mask.sum() == 84
    assert "no mask" in result.notes[0]


FAULTS: list[tuple[dict[str, object], str]] = [
    ({"image_id": 7}, "no image 7 (there are 0, 1)"),
    ({"category": None, "category_id": 9}, 'category_id 9 is unknown.*add "category"'),
    ({"score": 1.5}, "its score is 1.5"),
    ({"score": "high"}, "its score"),
    ({"bbox": [30, 5, 20, 7]}, "reaches outside the image of 40 x 30"),
    ({"bbox": [8, 5, 20, 12], "segmentation": None, "image_id": 5}, "no image 5"),
    ({"bbox": [8, 5, 0, 7]}, "has no area"),
    ({"bbox": [25, 12, 38, 28]}, "left, top, right, bottom"),
    ({"bbox": None, "segmentation": None}, "neither a segmentation nor a bbox"),
    ({"segmentation": {"size": [40, 30], "counts": "0"}}, "image of 30 x 40, not 40 x 30"),
    ({"segmentation": {"size": [30, 40], "counts": [5, 5]}}, "cover 10 pixels of 1200"),
    ({"segmentation": {"size": [30, 40], "counts": [1200]}}, "mask is empty"),
    ({"segmentation": {"size": [30, 40], "counts": "~~~"}}, "damaged"),
    ({"segmentation": {"size": [30, 40], "counts": "0" * 500_000}}, "over the limit"),
    ({"segmentation": [[1, 2, 3]]}, "pairs x, y"),
    ({"segmentation": [[1, 2, 300, 4, 5, 6]]}, "outside the image"),
    ({"segmentation": "mask.png"}, "neither run lengths nor polygons"),
]


@pytest.mark.parametrize(("change", "told"), FAULTS)
def test_every_fault_is_named_and_skipped_only_when_asked(tmp_path: Path, change: dict[str, object], told: str) -> None:
    path = write(tmp_path / "d.json", [entry(), entry(**change)])
    with pytest.raises(ConfigError, match="detection 1") as caught:
        read_detections(path, SIZES)
    pattern = told.replace("(", r"\(").replace(")", r"\)") if ".*" not in told else told
    assert re.search(pattern, str(caught.value)), caught.value
    assert "--skip-bad" in str(caught.value)
    result = read_detections(path, SIZES, skip_bad=True)
    assert len(result.all) == len(result.skipped) == 1
    assert re.search(pattern, result.skipped[0])


@pytest.mark.parametrize("document", [3, {"annotations": 3}, {}, "text"])
def test_what_is_no_list_is_refused(tmp_path: Path, document: object) -> None:
    with pytest.raises(ConfigError, match="no list of detections"):
        read_detections(write(tmp_path / "d.json", document), SIZES)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"nothing\.json"):
        read_detections(tmp_path / "nothing.json", SIZES)


def test_detections_of_other_images_are_no_fault_when_one_is_asked_for(tmp_path: Path) -> None:
    path = write(tmp_path / "d.json", [entry(), entry(image_id=1), entry(image_id=99)])
    assert len(read_detections(path, {1: (40, 30)}, only_image="1").all) == 1
