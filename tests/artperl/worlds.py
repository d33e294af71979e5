"""Small worlds that several tests share."""

from __future__ import annotations

from functools import cache

import numpy as np
import torch

import artsim
from artperl.data.sources import DataOptions
from artperl.data.truth import Truth, to_batch, training_rows
from artperl.perception.network import Perceived, Perception, Votes
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.fitting_problems import Problem, Problems
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.renderers import shared_renderer


@cache
def small_base(*categories: str, objects: int = 6) -> ShapeBase:
    """A base of some procedural objects of each category."""
    return by_boxes(ShapeBase.of([artsim.make(c, 500 + i) for c in categories for i in range(objects)], 96))


@cache
def small_problem(*categories: str, batch: int = 6) -> Problem:
    """A few fitting problems."""
    return Problems(DataOptions(categories), small_base(*categories), batch, 128, seed=3)[0]


def view(obj: ArticulatedObject, seed: int, num_points: int = 2048) -> Sample:
    """An object from somewhere in front, in some state."""
    options = SampleOptions(num_points=num_points)
    return draw_sample(obj, options, seed, 0, shared_renderer(options.renderer))


@cache
def made(category: str, seed: int) -> Sample:
    """A view of a procedural object."""
    return view(artsim.make(category, seed), seed)


def true_votes(truth: Truth) -> Votes:
    """What a network would say that knows everything."""
    level = torch.nn.functional.one_hot(truth.of_points(truth.level), truth.part_valid.shape[1])
    return Votes(
        canonical=truth.canonical, spread=torch.zeros(truth.part.shape), own_logits=12.0 * truth.own - 6.0,
        log_diagonal=truth.diagonal.log(),
        box=truth.of_points(torch.cat([truth.box_center, truth.box_size], dim=-1)),
        joint=truth.of_points(truth.joint),
        mirrored_joint=truth.of_points(truth.joint),
        level_logits=20.0 * level.float(),
    )  # fmt: skip


class Oracle(Perception):
    """Knows every point of one sample, by the nearest of its true points."""

    def __init__(self, sample: Sample, rows: int):
        super().__init__(rows, width=16)
        self.sample = sample

    def forward(self, points: torch.Tensor, standard: int = 0) -> Perceived:
        rows = training_rows(self.sample, 2048, self.num_rows)
        clouds, truth = to_batch({k: torch.from_numpy(np.asarray(v)[None]) for k, v in rows.items()})
        nearest = torch.cdist(points, clouds.points).argmin(-1)[0]
        return Perceived(
            20.0 * torch.nn.functional.one_hot(truth.part[:, nearest], self.num_rows).float(),
            truth.canonical[:, nearest],
            torch.full((1, points.shape[1]), -3.0),
            12.0 * truth.own[:, nearest].float() - 6.0,
            2.0 * truth.part_valid.float() - 1.0,
            truth.box_center,
            truth.box_size,
            truth.diagonal.log(),
        )
