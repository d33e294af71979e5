"""Stages that SporeAgent learns in: segmentation and retrieval as ArtPERL's, then the agent that registers parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import nn

from artperl.agent.ppo import algorithm_1
from artperl.agent.registration import REGISTRATION, RigidFitting, part_goals, part_problems
from artperl.agent.start import mean_start
from artperl.core.pose import Theta
from artperl.core.shapes import Observed
from artperl.data.fitting_problems import part_truth
from artperl.data.sources import Source
from artperl.methods.sporeagent import SporeAgent, SporeAgentSizes, sporeagent_networks
from artperl.retrieval.siamese import POINTS, by_siamese
from artperl.training.context import Context
from artperl.training.options import TrainOptions
from artperl.training.paper_stages import (
    CHOICES,
    SAVE_ROLLOUTS,
    VIEWS,
    KeepStage,
    RetrievalStage,
    agent_alone,
    view_source,
)
from artperl.training.steps import one_cycle, set_rate
from artperl.training.supervised import SupervisedStage, count_step, segmentation_loss
from artsim.common.progress import track
from artsim.errors import ConfigError

_ALONE_EVERY, _ALONE = 10, 24
"""Rollouts between tests of the agent without an expert, and views of such a test, always the same ones."""


def sporeagent_run_networks(options: TrainOptions, num_rows: int) -> dict[str, nn.Module]:
    """New networks of the method, by name."""
    return sporeagent_networks(SporeAgentSizes(num_rows, segmentation=options.width, policy=max(1, options.width // 2)))


def sporeagent_estimator(context: Context) -> SporeAgent:
    """The method as the networks of a run stand."""
    own: dict[str, Any] = context.state.networks
    base = by_siamese(context.objects.base, own["siamese"].eval())
    return SporeAgent(own["segmentation"], own["siamese"], own["policy"], base)


@dataclass(frozen=True)
class RegistrationStage:
    """Imitation of an expert, then imitation and PPO, on the parts of retrieved references with predicted labels."""

    name: str = "agent"

    def run(self, context: Context) -> None:
        """Make the rollouts that are left."""
        options, total = context.options, context.options.agent_rollouts
        policy, optimizer = context.state.networks["policy"], context.state.optimizers["policy"]
        first = context.state.done[self.name]
        if first >= total:
            return
        method = sporeagent_estimator(context)
        samples, unseen = (view_source(context, POINTS, options.seed + seed, VIEWS) for seed in (2, 3))

        def episodes(n: int) -> tuple[RigidFitting, Theta]:
            set_rate(optimizer, options.agent_rate * one_cycle(n, total))
            return registration_episodes(method, samples, options.episodes, options.seed, n)

        learner: Any = policy
        rounds = algorithm_1(learner, optimizer, episodes, options.phase, options.ppo, options.seed, first, total)
        bar = track(self.name, total=total, initial=first, smoothing=0.1, shown=context.progress)
        policy.train()
        for n, figures in enumerate(rounds, first):
            context.report(self.name, figures, n)
            if n % _ALONE_EVERY == 0 or n + 1 == total:
                alone = agent_alone(learner, *registration_episodes(method, unseen, _ALONE, options.seed, 0))
                context.report("agent_alone", alone, n)
                bar.set_postfix_str(f"alone: {alone['rotation_deg']:.1f} deg, chamfer {alone['chamfer_end']:.3f}")
            bar.update()
            count_step(context, self.name, n + 1, SAVE_ROLLOUTS)
        bar.close()
        policy.eval()


def sporeagent_stages(options: TrainOptions) -> list[Any]:
    """The stages, in their order."""
    segmentation = SupervisedStage("segmentation", "segmentation", segmentation_loss)
    return [segmentation, RetrievalStage(), RegistrationStage(), KeepStage()]


def registration_episodes(
    method: SporeAgent, samples: Source, count: int, seed: int, n: int
) -> tuple[RigidFitting, Theta]:
    """Episodes of one rollout, and their goals: the parts of fresh views, as the method segments and retrieves.

    Parameters
    ----------
    method : SporeAgent
    samples : Source
    count : int
        Views; each has an episode for every part that shows.
    seed, n : int
        Rollout ``n`` is a function of both.

    Raises
    ------
    ConfigError
        When no part shows in any view.
    """
    generator = torch.Generator().manual_seed((seed << 32) + n)
    views = [samples[i] for i in range(n * count, (n + 1) * count)]
    points = torch.from_numpy(np.stack([view.points for view in views])).float().to(method.device)
    part = method.segment(points)
    nearest = method.retrieve(points, part, min(CHOICES, len(method.base)))
    drawn = torch.randint(nearest.shape[1], (count, 1), generator=generator).to(method.device)
    reference = method.base.shapes[nearest.gather(1, drawn)[:, 0]]
    start = mean_start(reference, points, method.options.start)
    problems = part_problems(reference, Observed.of(points, part), start, generator)
    if problems is None:
        raise ConfigError("no part shows in a whole rollout", "num_points", "use more points")
    truth = [part_truth(view, reference.trees.num_rows) for view in views]
    rotation, center = (torch.stack([own[i] for own in truth]).to(method.device) for i in (1, 2))
    fitting = RigidFitting(problems.shapes, problems.observed, problems.start, REGISTRATION)
    return fitting, part_goals(problems, rotation, center)
