"""Where the error of the method artperl comes from: ``python -m benchmarks.stages --weights FOLDER``.

Mean and median rotation error of each part in degrees after each stage: the starts, the agent, the early refinement,
and the last one, which is the method's result. A refinement from the true pose of the reference stands beside them, its
joint states those nearest to the true poses. Lines:

- ``method``: the reference and the labels are the method's own;
- ``best reference``: the reference of the base with the nearest true boxes;
- ``true labels``: points have their true parts, for retrieval, too;
- ``own shape, true labels``: the reference is the observed object itself.

Objects are the unseen ones of ``artperl artimage``. Each category begins with the mean rank of the
retrieved object by true boxes, 1 for the best, and the share of points labelled right. The last line is one JSON
object.
"""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
import tyro
from torch import Tensor

from artperl.core.pose import Theta, clamp_state, pose_parts, theta_from_parts
from artperl.core.shapes import Observed, Shapes
from artperl.data.categories import ARTIMAGE
from artperl.evaluation.artimage import has_half, row_objects, row_samples
from artperl.evaluation.benchmark import category_folder
from artperl.evaluation.metrics import Array, rotation_error
from artperl.fitting.hypotheses import part_weights
from artperl.fitting.levenberg_marquardt import refine
from artperl.methods.artperl import ArtPERL
from artperl.methods.estimator_files import load_estimator
from artperl.perception.preprocess import Cloud
from artperl.retrieval.box_embedding import box_embedding, by_boxes
from artperl.training.fitting_problems import part_truth
from artsim.common.progress import track
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

LINES = ("method", "best reference", "true labels", "own shape, true labels")
STAGES = ("best start", "mean start", "agent", "early refinement", "refinement", "from the truth")
"""Of three starts, the nearest and the mean; what follows is of the start that the method keeps."""


@dataclass(frozen=True)
class Options:
    """What is measured."""

    weights: Path | None = None
    """Folder of estimators (or of training runs) by category; by default those that come with the package."""
    categories: tuple[str, ...] = tuple(ARTIMAGE)
    rows: tuple[Literal["procedural", "real"], ...] = ("procedural", "real")
    """Real objects are those in the folder that ARTSIM_PARTNET_DIR names; without one they are left out."""
    objects: int = 40
    """Procedural ones of each category."""
    views: int = 80
    """Of each category, at least."""


def main(options: Options) -> None:
    """Measure and print."""
    torch.set_num_threads(1)
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    result: dict[str, dict[str, Any]] = {}
    for row in options.rows:
        for category in options.categories:
            if row == "real" and not (folder and has_half(category, "test")):
                continue
            method = load_estimator(category_folder(options.weights, category, "artperl"), method="artperl")
            tested = row_objects(row, category, Path(folder or "."), options.objects)
            found = measure(method, tested, row_samples(row, tested, options.views))
            result.setdefault(row, {})[category] = found
            print(f"{row} {category}: rank {found['rank']:.1f}, {100 * found['labels']:.1f} % of points labelled right")
            for line in LINES:
                for stage, parts in found[line].items():
                    cells = "".join(f"{part['mean']:8.1f}{part['median']:6.1f}" for part in parts)
                    print(f"{line:24} {stage:16}{cells}", flush=True)
    print(json.dumps(result))


def measure(method: ArtPERL, tested: Sequence[ArticulatedObject], samples: Sequence[Sample]) -> dict[str, Any]:
    """Figures of one category: errors by line, stage and part, rank and share of labels.

    Parameters
    ----------
    method : ArtPERL
    tested : sequence of ArticulatedObject
    samples : sequence of Sample
        Views of them, of each as many.
    """
    base, every = by_boxes(method.base), method.base.shapes
    rows, views = every.trees.num_rows, len(samples) // len(tested)
    own = Shapes.from_objects([obj.with_diagonal(1.0) for obj in tested], every.points.shape[2], rows)
    found: dict[str, list[Array]] = {line: [] for line in LINES}
    ranks, labels = [], []
    for n, sample in enumerate(track(samples[0].category, samples, unit="view", leave=False)):
        valid, rotation, center, size, box_center, box_size = (values[None] for values in part_truth(sample, rows))
        order = base.nearest_objects(box_embedding(valid, box_center, box_size), len(base))[0][0]
        cloud = Cloud.of(sample.points, method.options.num_points)
        points, true = cloud.tensor(method.device), sample.part[cloud.some(method.options.num_points)].astype(np.int64)
        part, true_part = method.segment(points), torch.from_numpy(true)[None]
        row, by_true = (int(method.retrieve(points, labels)[0, 0]) for labels in (part, true_part))
        ranks.append(1 + order.tolist().index(row))
        labels.append(float((part == true_part).float().mean()))
        references = every[[row]], every[order[:1]], every[[by_true]], own[[n // views]]
        for line, reference, seen in zip(LINES, references, (part, part, true_part, true_part), strict=True):
            observed = Observed.of(points, seen, part_weights(seen))
            found[line].append(stage_errors(method, reference, observed, rotation, center, size))
    return {
        "rank": float(np.mean(ranks)),
        "labels": float(np.mean(labels)),
        **{line: _of_parts(np.stack(errors)) for line, errors in found.items()},
    }


def stage_errors(
    method: ArtPERL, reference: Shapes, observed: Observed, rotation: Tensor, center: Tensor, size: Tensor
) -> Array:
    """(6, K) rotation errors of the parts after each of :data:`STAGES`, degrees.

    Parameters
    ----------
    method : ArtPERL
    reference : Shapes
        Of one row.
    observed : Observed
    rotation, center, size : (1, P, 3, 3), (1, P, 3), (1, P, 3) float
        True 9D poses.
    """
    trees, paths = reference.trees, method.fit(reference, observed)
    early = method.early(reference, observed, paths[-1])
    kept = [int(early.energy.argmin())]
    goal = theta_from_parts(trees, reference.box_center, reference.box_size, rotation, center, size)
    goal = replace(goal, state=clamp_state(trees, goal.state))
    last, ideal = (refine(reference, observed, start, method.options.refine) for start in (early.theta[kept], goal))

    def off(theta: Theta) -> Array:
        posed = pose_parts(trees.repeat(len(theta)), theta, reference.box_center.expand(len(theta), -1, -1)).rotation
        return rotation_error(posed, rotation)[:, trees.valid[0].numpy()]

    starts = off(paths[0])
    ends = [off(theta)[0] for theta in (paths[-1][kept], early.theta[kept], last.theta, ideal.theta)]
    return np.stack([starts[starts.mean(1).argmin()], starts.mean(0), *ends])


def _of_parts(errors: Array) -> dict[str, list[dict[str, float]]]:
    """Mean and median of each part by stage, of errors (V, 6, K)."""
    middles = errors.mean(0), np.median(errors, 0)
    return {
        stage: [{"mean": float(mean), "median": float(median)} for mean, median in zip(*own, strict=True)]
        for stage, *own in zip(STAGES, *middles, strict=True)
    }


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
