"""Stages that the paper's method learns in: segmentation, retrieval (equation 2), the agent (Algorithm 1).

Each goes on where it stopped: its batches, rates and actions are functions of the number of the step alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from typing import Any

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
from artperl.estimator import save_estimator
from artperl.methods.artperl import ArtPERL
from artperl.methods.retrieved import AgentMethod, Sizes
from artperl.retrieval.box_embedding import box_embedding
from artperl.retrieval.siamese import POINTS, by_siamese, canonical_clouds, contrastive_loss, margins
from artperl.training.context import Context
from artperl.training.options import TrainOptions
from artperl.training.steps import one_cycle, set_rate
from artperl.training.supervised import SupervisedStage, Taken, descend, segmentation_loss, take_steps
from artsim.common.progress import track
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

_VIEWS = 4
"""Views in a row of one object: an object takes longer to make than a view of it."""
_SEGMENTED = 32
"""Clouds that are segmented at once."""
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

    def run(self, context: Context) -> None:
        """Take the steps that are left."""
        take_steps(context, self.name, "siamese", context.options.retrieval_steps, self._learn)

    def _learn(self, context: Context, first: int) -> Iterator[Taken]:
        options, ranks, device = context.options, context.ranks, context.device
        network, optimizer = context.state.networks["siamese"], context.state.optimizers["siamese"]
        shapes, points = self._pool(context)
        boxes = box_embedding(shapes.trees.valid, shapes.box_center, shapes.box_size)
        segmentation: Any = context.state.networks["segmentation"]
        with torch.no_grad():
            part = torch.cat([segmentation(Clouds.of(few).points).argmax(-1) for few in points.split(_SEGMENTED)])
        for step in range(first, options.retrieval_steps):
            set_rate(optimizer, options.retrieval_rate * one_cycle(step, options.retrieval_steps))
            generator = torch.Generator().manual_seed((options.seed << 32) + step)
            obj, seen = (
                torch.randperm(size, generator=generator)[:count]
                for size, count in (
                    (options.retrieval_objects, options.retrieval_batch), (points.shape[1], options.retrieval_points)
                )
            )  # fmt: skip
            row = (obj * _VIEWS + torch.randint(_VIEWS, obj.shape, generator=generator)).to(device)
            vectors = network(Clouds.of(points[row][:, seen]).points, part[row][:, seen])
            own = network(*canonical_clouds(shapes[row], generator, len(seen)))
            # Every pair counts, so that each process learns from all: gradients are summed for all to stay the same.
            loss = contrastive_loss(vectors, own, margins(boxes[row]))
            descend(optimizer, network, loss / ranks.count, ranks)
            yield {"loss": loss.item()}, f"loss {loss.item():.4f}"

    def _pool(self, context: Context) -> tuple[Shapes, Tensor]:
        """Views that batches are drawn from, (V, N, 3), and their objects: they take longer to make than to learn."""
        options, base, ranks = context.options, context.objects.base.shapes, context.ranks
        samples = view_source(context, options.num_points, options.seed + 1, _VIEWS)
        views = _VIEWS * options.retrieval_objects

        @lru_cache(maxsize=1)
        def shape(obj: ArticulatedObject) -> Shapes:
            return Shapes.from_objects([obj.with_diagonal(1.0)], base.points.shape[2], base.trees.num_rows)

        made = (
            (shape(samples.object(i)), samples[i].points[: options.num_points])
            for i in range(ranks.rank, views, ranks.count)
        )
        every = islice(ranks.in_turn(made), views)
        bar = track("views", every, total=views, leave=False, shown=context.progress)
        shapes, clouds = zip(*bar, strict=True)
        return concatenate(shapes).to(context.device), _stacked(clouds).to(context.device)


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

    def run(self, context: Context) -> None:
        """Make the rollouts that are left."""
        take_steps(context, self.name, "policy", context.options.agent_rollouts, self._learn, _SAVE_ROLLOUTS)

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


@dataclass(frozen=True)
class KeepStage:
    """The estimator is kept as the last stage leaves it: no validation chooses one."""

    name: str = "keep"

    def run(self, context: Context) -> None:
        """Write the estimator."""
        context.save()
        if context.ranks.first:
            save_estimator(context.estimator(), context.folder.best, context.about({}))


def paper_stages(options: TrainOptions) -> list[Any]:
    """The stages, in their order."""
    segmentation = SupervisedStage("segmentation", "segmentation", segmentation_loss)
    return [segmentation, RetrievalStage(), AgentStage(paper_estimator, fitting_episodes, _ALONE), KeepStage()]


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


def _stacked(clouds: Sequence[np.ndarray]) -> Tensor:
    return torch.from_numpy(np.stack(clouds)).float()
