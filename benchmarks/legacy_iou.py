"""What the overlap of boxes by OMAD's definition is worth: ``python -m benchmarks.legacy_iou``.

Published figures for ArtImage come from a routine that compares boxes in the rest frame, and takes one coordinate of
one corner from another axis (:func:`artperl.evaluation.box_overlap.iou_omad_legacy`). So its value depends on how the
frame lies and on where in it a part is; of thin parts, on little else. ArtImage's frames have y up: blades of scissors
point along x, and other objects have x to the side. Whether z points to the front or to the back is not published.
Printed for each part: mean exact overlap at rest, which no frame changes, and the routine's, in the frame of our tables
and in others. The last line is one JSON object.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from artperl.data.categories import ARTIMAGE
from artperl.evaluation.artimage import Row, row_objects, row_samples
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.box_overlap import iou_omad_legacy
from artperl.evaluation.metrics import iou_rest_exact, rest_centers
from artperl.evaluation.tables import PUBLISHED
from artperl.methods.full import Estimator
from artsim.common.progress import track
from artsim.observing.sample import Sample

FRAMES = {
    "as in our tables: x back, z up": np.eye(3),
    "y up, x to the right, z to the front": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]),
    "y up, x to the left, z to the back": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y up, x to the back, z to the right": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}
"""Rotations of the rest frame into the frame that boxes are compared in."""


@dataclass(frozen=True)
class Options:
    """Which boxes are compared."""

    weights: Path | None = None
    """Folder of estimators (or of training runs) by category; by default those that come with the package."""
    categories: tuple[str, ...] = tuple(ARTIMAGE)
    row: Row = "procedural"
    """Of the benchmark; those of real objects need ARTSIM_PARTNET_DIR."""
    views: int = 120
    """Of each category, at least."""


def main(options: Options) -> None:
    """Measure and print."""
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    result = {}
    for category in options.categories:
        tested = row_objects(options.row, category, Path(folder) if folder else None)
        if not tested:
            print(f"{category}: no object")
            continue
        samples = row_samples(options.row, tested, options.views)
        result[category] = overlaps(find_estimator(options.weights, category), samples)
        published = PUBLISHED[category]["iou_omad_legacy"]
        print(f"{category}: {len(samples)} views, mean overlap of each part, %")
        for name, values in [*result[category].items(), ("published, of other objects", published)]:
            print(f"  {name:40s}" + "".join(f"{100 * value:7.1f}" for value in values), flush=True)
    print(json.dumps(result))


def overlaps(estimator: Estimator, samples: list[Sample]) -> dict[str, list[float]]:
    """Mean of each part by definition; estimates with other parts count as 0."""
    boxes: dict[str, list[np.ndarray]] = {name: [] for name in ("exact at rest", *FRAMES)}
    for sample in track("estimating", samples, unit="view", leave=False):
        estimate = estimator(sample.points)
        if len(estimate.size) != len(sample.box_size):
            for values in boxes.values():
                values.append(np.zeros(len(sample.box_size)))
            continue
        center = rest_centers(estimate.translation, estimate.size, estimate.T_camera_part)
        pairs = (center, estimate.size), (sample.box_center, sample.box_size)
        boxes["exact at rest"].append(iou_rest_exact(*pairs[0], *pairs[1]))
        for name, R in FRAMES.items():
            own, true = ((c @ R.T, s @ np.abs(R).T) for c, s in pairs)
            boxes[name].append(iou_omad_legacy(*own, *true))
    return {name: np.mean(values, axis=0).round(4).tolist() for name, values in boxes.items()}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
