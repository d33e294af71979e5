"""Stages that SporeAgent learns in: segmentation and retrieval as ArtPERL's, then the agent that registers parts."""

from typing import Any

import torch
from torch import nn

from artperl.agent.registration import REGISTRATION, RigidFitting, part_goals, part_problems
from artperl.agent.start import mean_start
from artperl.core.pose import Theta
from artperl.methods.retrieved import Sizes
from artperl.methods.sporeagent import SporeAgent
from artperl.retrieval.siamese import by_siamese
from artperl.training.context import Context
from artperl.training.options import TrainOptions
from artperl.training.paper_stages import AgentStage, RetrievalStage, Rows, draw_references
from artperl.training.supervised import SupervisedStage, segmentation_loss
from artperl.training.validation import Validation
from artsim.errors import ConfigError


def sporeagent_run_networks(options: TrainOptions, num_rows: int) -> dict[str, nn.Module]:
    """New networks of the method, by name."""
    return SporeAgent.new_networks(Sizes(num_rows, segmentation=options.width, policy=max(1, options.width // 2)))


def sporeagent_estimator(context: Context) -> SporeAgent:
    """The method as the networks of a run stand."""
    own: dict[str, Any] = context.state.networks
    base = by_siamese(context.objects.base, own["siamese"].eval())
    return SporeAgent(own["segmentation"], own["siamese"], own["policy"], base)


def sporeagent_stages(options: TrainOptions) -> list[Any]:
    """The stages, in their order."""
    segmentation = SupervisedStage("segmentation", "segmentation", segmentation_loss)
    agent = AgentStage(sporeagent_estimator, registration_episodes)
    return [segmentation, RetrievalStage(), agent, Validation()]


def registration_episodes(
    method: SporeAgent, views: Rows, count: int, own: slice, generator: torch.Generator
) -> tuple[RigidFitting, Theta]:
    """Episodes of one rollout, and their goals: the parts of views, as the method segments and retrieves.

    Parameters
    ----------
    method : SporeAgent
    views : Rows
        Each has an episode for every part that shows.
    count : int
    own : slice
    generator : torch.Generator
        As of :func:`artperl.training.paper_stages.fitting_episodes`.

    Raises
    ------
    ConfigError
        When no part shows in any view.
    """
    reference, observed = draw_references(method, views, count, own, generator)
    start = mean_start(reference, observed.points, method.options.start)
    problems = part_problems(reference, observed, start, generator)
    if problems is None:
        raise ConfigError("no part shows in a whole rollout", "num_points", "use more points")
    rotation, center = (views[name][own].to(method.device) for name in ("rotation", "center"))
    fitting = RigidFitting(problems.shapes, problems.observed, problems.start, REGISTRATION)
    return fitting, part_goals(problems, rotation, center)
