"""Average precision of detections by their masks, as COCO has it, by pycocotools."""

import contextlib
import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from artperl.detection.detector import Detector
from artperl.evaluation.realistic_detections import LEAST_VISIBLE
from artsim.common.extras import require_extra
from artsim.common.progress import track
from artsim.formats.coco import mask_record
from artsim.scenes import SceneDataset, SceneRecord

_THRESHOLDS = {"AP": None, "AP50": 0.5, "AP75": 0.75}
"""Names of COCO's figures and their IoU; None: the mean over 0.5 to 0.95."""


def detect(scenes: SceneDataset, detector: Detector, progress: bool = True) -> list[dict[str, Any]]:
    """COCO's list of results of a detector for all views of some scenes.

    Entries are as those of :func:`artperl.evaluation.realistic_detections.realistic_detections`. Categories that the
    scenes do not have are left out.
    """
    numbers = {name: i for i, name in enumerate(scenes.categories, start=1)}
    found = []
    for image, record in enumerate(track("detect", scenes, total=len(scenes), unit="image", shown=progress)):
        for own in detector(record.rgb, record.depth, record.camera.K, image):
            if own.category in numbers:
                told = {"image_id": image, "file_name": record.entry.key, "category_id": numbers[own.category]}
                place = {"segmentation": own.segmentation, "bbox": list(own.box)}
                found.append({**told, "category": own.category, "score": round(own.score, 4), **place})
    return found


def mask_precision(scenes: SceneDataset, found: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Average precision of each category, and of all as ``mean``: ``AP``, ``AP50``, ``AP75``, and ``objects``.

    Parameters
    ----------
    scenes : SceneDataset
    found : sequence of mapping
        COCO's results, with the categories' places in the alphabet as ids.
    """
    with require_extra("COCO's average precision"):
        from pycocotools.coco import COCO
        from pycocotools.cocoeval import COCOeval

    truth, numbers = COCO(), {name: i for i, name in enumerate(scenes.categories, start=1)}
    truth.dataset = {
        "images": [{"id": i, **_size(record)} for i, record in enumerate(scenes)],
        "annotations": list(_truth(scenes, numbers)),
        "categories": [{"id": i, "name": name} for name, i in numbers.items()],
    }  # fmt: skip
    with contextlib.redirect_stdout(io.StringIO()):  # it prints what it does
        truth.createIndex()
        tested = COCOeval(truth, truth.loadRes([dict(own) for own in found]) if found else COCO(), "segm")
        tested.params.useCats = 1
        if found:
            tested.evaluate()
            tested.accumulate()
    table: dict[str, dict[str, float]] = {}
    for k, name in enumerate(numbers):
        own = [a for a in truth.dataset["annotations"] if a["category_id"] == numbers[name] and not a["ignore"]]
        table[name] = {title: _of(tested, k, iou) if found else 0.0 for title, iou in _THRESHOLDS.items()}
        table[name]["objects"] = len(own)
    titles = [*_THRESHOLDS, "objects"]
    mean = {title: float(np.mean([own[title] for own in table.values()])) for title in titles}
    return {**table, "mean": {**mean, "objects": sum(own["objects"] for own in table.values())}}


def _of(tested: Any, category: int, iou: float | None) -> float:
    """Mean precision over recall of one category, all areas, up to 100 detections."""
    precision = tested.eval["precision"][:, :, category, 0, -1]
    if iou is not None:
        precision = precision[np.isclose(tested.params.iouThrs, iou)]
    return float(max(precision.mean(), 0.0))  # -1 where there is no object


def _size(record: SceneRecord) -> dict[str, int]:
    return {"width": record.camera.width, "height": record.camera.height}


def _truth(scenes: SceneDataset, numbers: Mapping[str, int]) -> Iterator[dict[str, Any]]:
    identity = 0
    for image, record in enumerate(scenes):
        for i, told in enumerate(record.entry.objects):
            mask = record.instance_ids == i
            if not mask.any():
                continue
            identity += 1
            ignored = int(told.visible_fraction < LEAST_VISIBLE)  # a crowd to COCO: neither won nor lost
            own = {"id": identity, "image_id": image, "category_id": numbers[told.category]}
            yield {**own, **mask_record(mask), "iscrowd": ignored, "ignore": ignored}


def precision_lines(precision: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    """The table of what :func:`mask_precision` gives, for people."""
    yield f"{'masks, %':<14}" + "".join(f"{title:>8}" for title in _THRESHOLDS) + f"{'objects':>9}"
    for name, own in precision.items():
        yield f"{name:<14}" + "".join(f"{100 * own[title]:>8.1f}" for title in _THRESHOLDS) + f"{own['objects']:>9.0f}"
