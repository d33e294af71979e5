"""How near the retrieved reference is to the observed object: ``python -m benchmarks.retrieval``.

By the boxes that perception says, as estimators search; by the Siamese network (equations 1 and 2) that a run of the
method artperl learns here, before its agent; beside the best object of the base and a random one. Measured
on unseen objects: chamfer distance between the parts, and difference of the parts' boxes, both at rest and in
diagonals; the mean rank of the retrieved reference by the true boxes, 1 for the best; how often the best one is among
the four nearest. The last line is one JSON object.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import torch
import tyro
from torch import Tensor

from artperl.core.clouds import Clouds
from artperl.core.shapes import Shapes
from artperl.data.categories import ARTIMAGE, objects_of
from artperl.evaluation.artimage import row_samples
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.samples import TEST_SEEDS
from artperl.methods.artperl import ArtPERL
from artperl.methods.full import Estimator
from artperl.retrieval.box_embedding import box_embedding, by_boxes
from artperl.training.options import PAPER_PRESETS
from artperl.training.paper_stages import paper_estimator, paper_stages
from artperl.training.run import Training

_NEAREST = 4


@dataclass(frozen=True)
class Options:
    """Which references are found."""

    weights: Path | None = None
    """Folder of estimators (or of training runs) by category; by default those that come with the package."""
    categories: tuple[str, ...] = tuple(ARTIMAGE)
    steps: int = PAPER_PRESETS["quick"].retrieval_steps
    """Batches that the Siamese network learns from."""
    segmentation_steps: int = PAPER_PRESETS["quick"].perception_steps
    """Batches that the segmentation learns from before."""
    objects: int = 40
    """Unseen objects of each category, two views of each."""
    threads: int = 2
    """Processor threads."""


def main(options: Options) -> None:
    """Measure and print."""
    torch.set_num_threads(options.threads)
    result = {}
    for category in options.categories:
        estimator = find_estimator(options.weights, category)
        result[category] = quality(category, estimator, learn(category, options), options.objects)
        for name, (chamfer, boxes, rank, found) in result[category].items():
            print(
                f"{category:12} {name:12} chamfer {100 * chamfer:5.2f} %, boxes {100 * boxes:5.2f} %, "
                f"rank {rank:4.1f}, best of {_NEAREST} {100 * found:3.0f} %",
                flush=True,
            )
    print(json.dumps({"chamfer_boxes_rank_found": result, "siamese_steps": options.steps}))


def learn(category: str, options: Options) -> ArtPERL:
    """The method after its stages of segmentation and retrieval, its agent untrained."""
    run = replace(
        PAPER_PRESETS["quick"], categories=(category,), perception_steps=options.segmentation_steps,
        retrieval_steps=options.steps,
    )  # fmt: skip
    with TemporaryDirectory() as folder:
        context = Training(run, Path(folder), workers=0).context
        for stage in paper_stages(run)[:2]:
            stage.run(context)
        return paper_estimator(context)


@torch.inference_mode()
def quality(category: str, estimator: Estimator, method: ArtPERL, objects: int) -> dict[str, tuple[float, ...]]:
    """Means over unseen objects of chamfer distance, box difference, rank and hits, by how the reference is chosen."""
    base, perception = by_boxes(method.base), estimator.perception
    tested = objects_of([category], objects, TEST_SEEDS)
    samples = row_samples("procedural", tested, 2 * objects)
    shapes = base.shapes
    units = [obj.with_diagonal(1.0) for obj in tested]
    true = Shapes.from_objects(units, shapes.points.shape[2], shapes.trees.num_rows)
    chamfer, boxes = differences(true, shapes)
    boxed = box_embedding(true.trees.valid, true.box_center, true.box_size)
    order = base.nearest_objects(boxed, len(base))[0]
    rank = order.argsort(1) + 1.0
    found: dict[str, list[Tensor]] = {"boxes": [], "contrastive": []}
    for sample in samples:
        cloud = torch.from_numpy(sample.points[None, : estimator.options.num_points]).float()
        perceived = perception(Clouds.of(cloud).points)
        query = box_embedding(perceived.valid, perceived.box_center, perceived.box_size)
        found["boxes"].append(base.nearest_objects(query, _NEAREST)[0])
        found["contrastive"].append(method.retrieve(cloud, method.segment(cloud), _NEAREST))

    def means(row: Tensor, rows: Tensor) -> tuple[float, ...]:
        hit = (rows == order[row, :1]).any(1).float().mean()
        return *(float(values[row, rows[:, 0]].mean()) for values in (chamfer, boxes, rank)), float(hit)

    row, each = torch.arange(objects).repeat_interleave(2), torch.arange(objects)
    result = {name: means(row, torch.cat(rows)) for name, rows in found.items()}
    result["best in base"] = means(each, order[:, :_NEAREST])
    result["random"] = *(float(values.mean()) for values in (chamfer, boxes, rank)), _NEAREST / len(base)
    return result


def differences(true: Shapes, base: Shapes) -> tuple[Tensor, Tensor]:
    """(T, B) chamfer distances, two-sided, means over parts, and (T, B) mean differences of the boxes' faces."""
    valid = true.trees.valid[:, None] & base.trees.valid[None]
    faces = [torch.cat([s.box_center - 0.5 * s.box_size, s.box_center + 0.5 * s.box_size], -1) for s in (true, base)]
    apart = (faces[0][:, None] - faces[1][None]).abs().mean(-1)
    chamfer = torch.zeros(len(true), len(base))
    for t in range(len(true)):
        distance = torch.cdist(true.points[t][None].expand(len(base), -1, -1, -1), base.points)
        both = 0.5 * (distance.amin(-1).mean(-1) + distance.amin(-2).mean(-1))
        chamfer[t] = (both * valid[t]).sum(-1) / valid[t].sum(-1)
    return chamfer, (apart * valid).sum(-1) / valid.sum(-1)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
