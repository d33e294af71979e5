"""Small worlds that several tests share."""

from __future__ import annotations

from functools import cache

import torch

import artsim
from artperl.data import Truth
from artperl.embedding import by_boxes
from artperl.networks.perception import Votes
from artperl.problems import Problem, Problems
from artperl.retrieval import ShapeBase
from artsim.objects import ArticulatedObject
from artsim.plan import SampleOptions, draw_sample
from artsim.renderers import shared_renderer
from artsim.sample import Sample


@cache
def small_base(*categories: str, objects: int = 6) -> ShapeBase:
    """A base of some procedural objects of each category."""
    return by_boxes(ShapeBase.of([artsim.make(c, 500 + i) for c in categories for i in range(objects)], 96))


@cache
def small_problem(*categories: str, batch: int = 6) -> Problem:
    """A few fitting problems."""
    return Problems(categories, small_base(*categories), batch, 128, seed=3)[0]


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
        canonical=truth.canonical, spread=torch.zeros(truth.part.shape), log_diagonal=truth.diagonal.log(),
        box=truth.of_points(torch.cat([truth.box_center, truth.box_size], dim=-1)),
        joint=truth.of_points(truth.joint),
        level_logits=20.0 * level.float(),
    )  # fmt: skip
