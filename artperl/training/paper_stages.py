"""Stages that the paper's method learns in: segmentation, retrieval (equation 2), the agent (Algorithm 1).

Each goes on where it stopped: its batches, rates and actions are functions of the number of the step alone.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import islice
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor, nn

from artperl.agent.decision_process import Fitting
from artperl.agent.ppo import algorithm_1
from artperl.core.batch import concatenate
from artperl.core.clouds import Clouds
from artperl.core.pose import Theta, clamp_state, theta_from_parts
from artperl.core.shapes import Observed, Shapes
from artperl.data.batches import row_batches
from artperl.data.sources import Source
from artperl.methods.artperl import ArtPERL
from artperl.methods.retrieved import AgentMethod, Sizes
from artperl.retrieval.box_embedding import box_embedding
from artperl.retrieval.siamese import POINTS, by_siamese, canonical_clouds, contrastive_loss, margins
from artperl.training.context import Context
from artperl.training.fitting_problems import part_truth
from artperl.training.options import TrainOptions
from artperl.training.steps import one_cycle, set_rate
from artperl.training.supervised import SupervisedStage, Taken, descend, segmentation_loss, take_steps, told
from artperl.training.validation import Calibration, Validation
from artsim.common.progress import track
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

Rows = dict[str, Tensor]

_VIEWS = 4
"""Views in a row of one object: an object takes longer to make than a view of it."""
_SEGMENTED = 32
"""Clouds that are segmented at once."""
_SAVE_ROLLOUTS = 2
"""Rollouts after which a run is saved, against a stop that nobody asked for."""
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
    """Algorithm 1 on retrieved references and predicted labels: first cloning alone, then cloning and PPO."""

    estimator: Callable[[Context], Any]
    """The method of a context."""
    episodes: Callable[[Any, Rows, int, slice, torch.Generator], tuple[Any, Theta]]
    """Episodes and goals of a rollout, by the method, views, their number, the rows of this process, and chance."""
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
        views = agent_views(context, options.episodes, first, options.seed + 2)

        def episodes(n: int) -> tuple[Any, Theta]:
            set_rate(optimizer, options.rate_of_agent(n))
            generator = torch.Generator().manual_seed((options.seed << 32) + n)
            return self.episodes(method, next(views), options.episodes, ranks.rows(options.episodes), generator)

        rounds = algorithm_1(
            policy, optimizer, episodes, options.phase, options.ppo, options.seed, first, total, ranks,
            options.mixed_precision,
        )  # fmt: skip
        for figures in rounds:
            yield figures, told({name: figures[name] for name in ("cloning", "reward") if name in figures})


def paper_stages(options: TrainOptions) -> list[Any]:
    """The stages, in their order."""
    segmentation = SupervisedStage("segmentation", "segmentation", segmentation_loss)
    agent = AgentStage(paper_estimator, fitting_episodes)
    return [segmentation, RetrievalStage(), agent, Validation(), Calibration()]


def fitting_episodes(
    method: ArtPERL, views: Rows, count: int, own: slice, generator: torch.Generator
) -> tuple[Fitting, Theta]:
    """Episodes of one rollout, and their goals: views as the method segments, retrieves and starts.

    The goal is the state of the retrieved reference that is nearest to the true 9D poses. Each episode begins with one
    of the method's starts.

    Parameters
    ----------
    method : ArtPERL
        Its segmentation and retrieval are taken as they are.
    views : Rows
        As of :func:`agent_views`.
    count : int
        Episodes.
    own : slice
        Of several processes, the episodes of this one, and how many there are in all.
    generator : torch.Generator
        Draws references and starts, for all of them.
    """
    reference, observed = draw_references(method, views, count, own, generator)
    trees = reference.trees
    truth = (views[name][own].to(method.device) for name in ("rotation", "center", "size"))
    goal = theta_from_parts(trees, reference.box_center, reference.box_size, *truth)
    goal = replace(goal, state=clamp_state(trees, goal.state))
    starts = method.starts(reference, observed.points)
    which = torch.randint(len(starts), (count,), generator=generator)[own].to(method.device)
    start = starts[0]
    for number, other in enumerate(starts[1:], 1):
        start = other.where(which == number, start)
    return Fitting(reference, observed, start, method.options.fitting), goal


def draw_references(
    method: AgentMethod, views: Rows, count: int, own: slice, generator: torch.Generator
) -> tuple[Shapes, Observed]:
    """For each of B views a reference among the nearest, by chance, and the cloud as the method segments it.

    They are the views ``own`` of ``count`` in all, for which chance is drawn.
    """
    points = views["points"][own].to(method.device)
    part = method.segment(points)
    nearest = method.retrieve(points, part, min(_CHOICES, len(method.base)))
    drawn = torch.randint(nearest.shape[1], (count, 1), generator=generator)[own].to(method.device)
    return method.base.shapes[nearest.gather(1, drawn)[:, 0]], Observed.of(points, part)


def agent_views(context: Context, count: int, first: int, seed: int) -> Iterator[Rows]:
    """Batches of so many views from number ``first`` on, some of which come in several: points, and true 9D poses."""
    return row_batches(
        context.objects.data, context.objects.num_rows, POINTS, count, first, seed, context.workers,
        partial(_true_poses, context.objects.num_rows), (context.ranks.rank, context.ranks.count),
        context.ranks.in_turn, _VIEWS,
    )  # fmt: skip


def _true_poses(num_rows: int, source: Source, number: int, sample: Sample) -> dict[str, np.ndarray]:
    """More rows for :func:`artperl.data.batches.row_batches`."""
    _, rotation, center, size, _, _ = part_truth(sample, num_rows)
    return {"rotation": rotation.numpy(), "center": center.numpy(), "size": size.numpy()}


def view_source(context: Context, num_points: int, seed: int, views: int) -> Source:
    """Fresh views of the objects of a run, so many of each in a row."""
    return context.objects.data.source(context.objects.num_rows, num_points, seed, views)


def _stacked(clouds: Sequence[np.ndarray]) -> Tensor:
    return torch.from_numpy(np.stack(clouds)).float()
