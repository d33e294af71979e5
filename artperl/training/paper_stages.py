"""Stages that the paper's method learns in: segmentation, retrieval (equation 2), the agent (Algorithm 1).

Each goes on where it stopped: its batches, rates and actions are functions of the number of the step alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor, nn

from artperl.agent.actions import expected_action, rotation_vector
from artperl.agent.decision_process import Fitting
from artperl.agent.policy import Policy
from artperl.agent.ppo import algorithm_1
from artperl.agent.start import mean_start
from artperl.core.batch import concatenate
from artperl.core.clouds import Clouds
from artperl.core.pose import Theta, clamp_state, theta_from_parts
from artperl.core.ranks import ALONE, Ranks
from artperl.core.shapes import Observed, Shapes
from artperl.data.fitting_problems import part_truth
from artperl.data.sources import Source
from artperl.methods.artperl import ArtPERL
from artperl.methods.retrieved import AgentMethod, Sizes
from artperl.retrieval.segmented import SegmentedRetrieval
from artperl.retrieval.siamese import POINTS, by_siamese, canonical_clouds, contrastive_loss
from artperl.training.context import Context
from artperl.training.options import TrainOptions
from artperl.training.steps import one_cycle, set_rate
from artperl.training.supervised import SupervisedStage, Taken, descend, segmentation_loss, take_steps
from artperl.training.validation import Validation
from artsim.observing.sample import Sample

_VIEWS = 4
"""Views in a row of one object: an object takes longer to make than a view of it."""
_SAVE_ROLLOUTS = 2
"""Rollouts after which a run is saved, against a stop that nobody asked for."""
_ALONE_EVERY = 2
"""Rollouts between tests of the agent without an expert."""
_ALONE = 48
"""Views of such a test."""
_CHOICES = 4
"""Nearest references among which the agent's is drawn: at test time, too, it is seldom the best one."""


def paper_networks(options: TrainOptions, num_rows: int) -> dict[str, nn.Module]:
    """New networks of the method, by name."""
    return ArtPERL.new_networks(Sizes(num_rows, segmentation=options.width))


def paper_estimator(context: Context) -> ArtPERL:
    """The method as the networks of a run stand."""
    own: dict[str, Any] = context.state.networks
    base = by_siamese(context.objects.base, own["siamese"].eval())
    return ArtPERL(own["segmentation"], own["siamese"], own["policy"], base)


@dataclass(frozen=True)
class RetrievalStage:
    """Equation 2: a cloud, with the parts that the segmentation tells, is to be near its own object at rest."""

    name: str = "retrieval"
    lengths: ClassVar[dict[str, str]] = {"retrieval": "retrieval_steps"}

    def run(self, context: Context) -> None:
        """Take the steps that are left."""
        take_steps(context, self.name, "siamese", context.options.retrieval_steps, self._learn)

    def _learn(self, context: Context, first: int) -> Iterator[Taken]:
        options, base = context.options, context.objects.base.shapes
        segmentation: Any = context.state.networks["segmentation"]
        network: Any = context.state.networks["siamese"]
        method = SegmentedRetrieval(segmentation, network, context.objects.base)
        network.train()  # the method has it evaluate
        samples, ranks = view_source(context, POINTS, options.seed + 1, 1), context.ranks
        for step in range(first, options.retrieval_steps):
            set_rate(
                context.state.optimizers["siamese"], options.perception_rate * one_cycle(step, options.retrieval_steps)
            )
            numbers = range(step * options.batch_size, (step + 1) * options.batch_size)
            mine = numbers[ranks.rows(len(numbers))]
            objects = [samples.object(i).with_diagonal(1.0) for i in mine]
            made = ranks.every((
                Shapes.from_objects(objects, base.points.shape[2], base.trees.num_rows) if objects else None,
                [samples[i].points for i in mine],
            ))  # fmt: skip
            own = concatenate([shapes for shapes, _ in made if shapes is not None]).to(context.device)
            points = _stacked([cloud for _, clouds in made for cloud in clouds]).to(context.device)
            generator = torch.Generator().manual_seed((options.seed << 32) + step)
            vectors = network(Clouds.of(points).points, method.segment(points))
            loss = contrastive_loss(vectors, network(*canonical_clouds(own, generator)))
            # Every pair counts, so that each process learns from all: gradients are summed for all to stay the same.
            descend(context.state.optimizers["siamese"], network, loss / ranks.count, ranks)
            yield {"loss": loss.item()}, f"loss {loss.item():.4f}"


@dataclass(frozen=True)
class AgentStage:
    """Algorithm 1 on retrieved references and predicted labels: first cloning alone, then cloning and PPO.

    Attributes
    ----------
    estimator : callable
        The method of a context.
    episodes : callable
        Episodes and goals of a rollout, by the method, views, their number, a seed and the number of the rollout; of
        several processes, the share of this one.
    alone : int
        Views of a test of the agent without an expert, always the same ones.
    """

    estimator: Callable[[Context], Any]
    episodes: Callable[[Any, Source, int, int, int, Ranks], tuple[Any, Theta]]
    alone: int
    name: str = "agent"
    lengths: ClassVar[dict[str, str]] = {"agent": "agent_rollouts"}

    def run(self, context: Context) -> None:
        """Make the rollouts that are left."""
        take_steps(
            context, self.name, "policy", context.options.agent_rollouts, self._learn, _SAVE_ROLLOUTS, validated=True
        )

    def _learn(self, context: Context, first: int) -> Iterator[Taken]:
        options, total, method = context.options, context.options.agent_rollouts, self.estimator(context)
        policy, optimizer, ranks = method.policy.train(), context.state.optimizers["policy"], context.ranks
        samples, unseen = (view_source(context, POINTS, options.seed + seed, _VIEWS) for seed in (2, 3))

        def episodes(n: int) -> tuple[Any, Theta]:
            set_rate(optimizer, options.agent_rate * one_cycle(n, total))
            return self.episodes(method, samples, options.episodes, options.seed, n, ranks)

        rounds = algorithm_1(
            policy, optimizer, episodes, options.phase, options.ppo, options.seed, first, total, ranks,
            options.mixed_precision,
        )  # fmt: skip
        for n, figures in enumerate(rounds, first):
            line = None
            if ranks.first and (n % _ALONE_EVERY == 0 or n + 1 == total):
                alone = agent_alone(policy, *self.episodes(method, unseen, self.alone, options.seed, 0, ALONE))
                context.report("agent_alone", alone, n)
                line = f"alone: reward {alone['reward']:.3f}, {alone['rotation_deg']:.1f} deg"
            yield figures, line


def paper_stages(options: TrainOptions) -> list[Any]:
    """The stages, in their order."""
    segmentation = SupervisedStage("segmentation", "segmentation", segmentation_loss)
    return [segmentation, RetrievalStage(), AgentStage(paper_estimator, fitting_episodes, _ALONE), Validation()]


def fitting_episodes(
    method: ArtPERL, samples: Source, count: int, seed: int, n: int, ranks: Ranks = ALONE
) -> tuple[Fitting, Theta]:
    """Episodes of one rollout, and their goals: fresh views, as the method segments, retrieves and starts.

    The goal is the state of the retrieved reference that is nearest to the true 9D poses.

    Parameters
    ----------
    method : ArtPERL
        Its segmentation and retrieval are taken as they are.
    samples : Source
    count : int
        Episodes.
    seed, n : int
        Rollout ``n`` is a function of both.
    ranks : Ranks
        Of several processes, each has its share of the episodes.
    """
    generator, own = torch.Generator().manual_seed((seed << 32) + n), ranks.rows(count)
    views = [samples[i] for i in range(n * count, (n + 1) * count)[own]]
    reference, observed = draw_references(method, views, generator, own, count)
    trees = reference.trees
    truth = [part_truth(view, trees.num_rows) for view in views]
    _, rotation, center, size, _, _ = (torch.stack(values).to(method.device) for values in zip(*truth, strict=True))
    goal = theta_from_parts(trees, reference.box_center, reference.box_size, rotation, center, size)
    goal = Theta(**{**vars(goal), "state": clamp_state(trees, goal.state)})
    start = mean_start(reference, observed.points, method.options.start)
    return Fitting(reference, observed, start, method.options.fitting), goal


def draw_references(
    method: AgentMethod, views: Sequence[Sample], generator: torch.Generator, own: slice, count: int
) -> tuple[Shapes, Observed]:
    """For each of B views a reference among the nearest, by chance, and the cloud as the method segments it.

    They are the views ``own`` of ``count`` in all, for which chance is drawn.
    """
    points = _stacked([view.points for view in views]).to(method.device)
    part = method.segment(points)
    nearest = method.retrieve(points, part, min(_CHOICES, len(method.base)))
    drawn = torch.randint(nearest.shape[1], (count, 1), generator=generator)[own].to(method.device)
    return method.base.shapes[nearest.gather(1, drawn)[:, 0]], Observed.of(points, part)


@torch.no_grad()
def agent_alone(policy: Policy, fitting: Fitting, goal: Theta) -> dict[str, float]:
    """Mean reward of a step, chamfer distances, and the root's rotation from the goal, when nobody guides the agent."""
    start, rewards = fitting.distance, []
    while not fitting.done:
        rewards.append(fitting.step(expected_action(policy(fitting.view())[0])))
    off = rotation_vector(goal.rotation @ fitting.theta.rotation.mT)
    return {
        "reward": torch.stack(rewards).mean().item(),
        "chamfer_start": start.mean().item(),
        "chamfer_end": fitting.distance.mean().item(),
        "rotation_deg": torch.linalg.vector_norm(off, dim=-1).rad2deg().median().item(),
    }


def view_source(context: Context, num_points: int, seed: int, views: int) -> Source:
    """Fresh views of the objects of a run, so many of each in a row."""
    return context.objects.data.source(context.objects.num_rows, num_points, seed, views)


def _stacked(clouds: list[np.ndarray]) -> Tensor:
    return torch.from_numpy(np.stack(clouds)).float()
