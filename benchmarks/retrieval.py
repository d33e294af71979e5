"""How near the retrieved reference is to the observed object: ``python -m benchmarks.retrieval``.

By the boxes that perception says, as estimators search; by a Siamese network with contrastive loss (equations 1 and 2),
trained here on fresh objects; beside the best object of the base, the median and a random one. Measured on unseen
objects: chamfer distance between the parts, and difference of the parts' boxes, both at rest and in diagonals. The last
line is one JSON object.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import tyro
from torch import Tensor

from artperl.core.clouds import Clouds
from artperl.core.shapes import Shapes
from artperl.data.categories import ARTIMAGE, objects_of
from artperl.data.sources import Samples
from artperl.evaluation.artimage import row_samples
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.samples import TEST_SEEDS
from artperl.methods.full import Estimator
from artperl.retrieval.box_embedding import box_embedding
from artperl.retrieval.siamese import Siamese, canonical_clouds, contrastive_loss
from artperl.training.steps import one_cycle, set_rate
from artsim.common.progress import track
from artsim.datasets.plan import SampleOptions

POINTS = 512
OBJECTS = 800
VIEWS = 4
BATCH = 24
RATE = 2e-3


@dataclass(frozen=True)
class Options:
    """Which references are found."""

    weights: Path | None = None
    """Folder of estimators (or of training runs) by category; by default those that come with the package."""
    categories: tuple[str, ...] = tuple(ARTIMAGE)
    steps: int = 4000
    """Batches that the Siamese network learns from."""
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
        network = learn(category, estimator, options.steps)
        result[category] = quality(category, estimator, network, options.objects)
        for name, (chamfer, boxes) in result[category].items():
            print(f"{category:12} {name:12} chamfer {100 * chamfer:5.2f} %, boxes {100 * boxes:5.2f} %", flush=True)
    print(json.dumps({"chamfer_and_boxes_in_diagonals": result, "siamese_steps": options.steps}))


def learn(category: str, estimator: Estimator, steps: int) -> Siamese:
    """A network for which a partial cloud is near to its own object at rest, and far from others."""
    torch.manual_seed(0)
    base = estimator.base.shapes
    network = Siamese(base.trees.num_rows)
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=1e-2)
    samples = Samples([category], SampleOptions(num_points=POINTS), 5, VIEWS, base.trees.num_rows)
    learnt = [samples[i] for i in track(f"{category}, clouds", range(OBJECTS * VIEWS), leave=False)]
    objects = [samples.object(i).with_diagonal(1.0) for i in range(0, OBJECTS * VIEWS, VIEWS)]
    # Others are of the same draw as an object itself: whatever told stored shapes from fresh ones would tell all pairs.
    own = Shapes.from_objects(objects, base.points.shape[2], base.trees.num_rows)
    observed = Clouds.of(torch.from_numpy(np.stack([sample.points for sample in learnt])).float()).points
    part = torch.from_numpy(np.stack([sample.part for sample in learnt]).astype(np.int64))
    generator = torch.Generator().manual_seed(0)
    for step in track(category, range(steps), leave=False):
        chosen = torch.randperm(OBJECTS, generator=generator)[:BATCH]
        view = chosen * VIEWS + torch.randint(VIEWS, (BATCH,), generator=generator)
        vectors = network(*canonical_clouds(own[chosen], generator, POINTS))
        set_rate(optimizer, RATE * one_cycle(step, steps))
        loss = contrastive_loss(network(observed[view], part[view]), vectors)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return network.eval()


@torch.inference_mode()
def quality(category: str, estimator: Estimator, network: Siamese, objects: int) -> dict[str, tuple[float, float]]:
    """Means over unseen objects of chamfer distance and box difference, by how the reference is chosen."""
    base, perception = estimator.base, estimator.perception
    P = base.shapes.trees.num_rows
    tested = objects_of([category], objects, TEST_SEEDS)
    samples = row_samples("procedural", tested, 2 * objects)
    true = Shapes.from_objects([obj.with_diagonal(1.0) for obj in tested], base.shapes.points.shape[2], P)
    generator = torch.Generator().manual_seed(1)
    vectors = network(*canonical_clouds(base.shapes, generator, POINTS))
    chamfer, boxes = differences(true, base.shapes)
    chosen: dict[str, list[int]] = {"boxes": [], "contrastive": []}
    for sample in samples:
        cloud = torch.from_numpy(sample.points[None, : estimator.options.num_points]).float()
        perceived = perception(Clouds.of(cloud).points)
        query = box_embedding(perceived.valid, perceived.box_center, perceived.box_size)
        chosen["boxes"].append(int(base.nearest_objects(query)[0]))
        vector = network(Clouds.of(cloud[:, :POINTS]).points, perceived.part[:, :POINTS])
        chosen["contrastive"].append(int(torch.cdist(vector, vectors).argmin()))
    row = torch.arange(objects).repeat_interleave(2)
    result = {
        name: (float(chamfer[row, torch.tensor(rows)].mean()), float(boxes[row, torch.tensor(rows)].mean()))
        for name, rows in chosen.items()
    }
    best = chamfer.argmin(1)
    each = torch.arange(objects)
    result["best in base"] = float(chamfer[each, best].mean()), float(boxes[each, best].mean())
    result["median"] = float(chamfer.median(1).values.mean()), float(boxes.median(1).values.mean())
    result["random"] = float(chamfer.mean()), float(boxes.mean())
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
