"""Stages that the paper's method learns in: segmentation, retrieval (equation 2), the agent (Algorithm 1).

Each goes on where it stopped: its batches, rates and actions are functions of the number of the step alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from artperl.agent.actions import expected_action, rotation_vector
from artperl.agent.decision_process import Fitting
from artperl.agent.policy import Policy
from artperl.agent.ppo import algorithm_1
from artperl.agent.start import mean_start
from artperl.core.clouds import Clouds
from artperl.core.pose import Theta, clamp_state, theta_from_parts
from artperl.core.shapes import Observed, Shapes
from artperl.data.fitting_problems import part_truth
from artperl.data.sources import Source
from artperl.estimator import save_estimator
from artperl.methods.artperl import ArtPERL, Sizes, networks_of
from artperl.retrieval.segmented import SegmentedRetrieval
from artperl.retrieval.siamese import POINTS, by_siamese, canonical_clouds, contrastive_loss
from artperl.training.context import Context
from artperl.training.options import TrainOptions
from artperl.training.steps import one_cycle, set_rate
from artperl.training.supervised import SAVE_STEPS, SupervisedStage, count_step, descend, segmentation_loss
from artsim.common.progress import track

VIEWS = 4
"""Views in a row of one object: an object takes longer to make than a view of it."""
SAVE_ROLLOUTS = 10
"""Rollouts after which a run is saved, against a stop that nobody asked for."""
_ALONE_EVERY, _ALONE = 10, 48
"""Rollouts between tests of the agent without an expert, and episodes of such a test, always the same ones."""
CHOICES = 4
"""Nearest references among which the agent's is drawn: at test time, too, it is seldom the best one."""


def paper_networks(options: TrainOptions, num_rows: int) -> dict[str, nn.Module]:
    """New networks of the method, by name."""
    return networks_of(Sizes(num_rows, segmentation=options.width))


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
        options, total = context.options, context.options.retrieval_steps
        network, optimizer = context.state.networks["siamese"], context.state.optimizers["siamese"]
        first = context.state.done[self.name]
        if first >= total:
            return
        segmentation: Any = context.state.networks["segmentation"]
        siamese: Any = network
        method, base = SegmentedRetrieval(segmentation, siamese, context.objects.base), context.objects.base.shapes
        samples = view_source(context, POINTS, options.seed + 1, 1)
        bar = track(self.name, total=total, initial=first, smoothing=0.02, shown=context.progress)
        network.train()
        for step in range(first, total):
            set_rate(optimizer, options.perception_rate * one_cycle(step, total))
            numbers = range(step * options.batch_size, (step + 1) * options.batch_size)
            objects = [samples.object(i).with_diagonal(1.0) for i in numbers]
            own = Shapes.from_objects(objects, base.points.shape[2], base.trees.num_rows).to(context.device)
            points = _stacked([samples[i].points for i in numbers]).to(context.device)
            generator = torch.Generator().manual_seed((options.seed << 32) + step)
            vectors = network(Clouds.of(points).points, method.segment(points))
            loss = contrastive_loss(vectors, network(*canonical_clouds(own, generator)))
            descend(optimizer, network, loss)
            context.report(self.name, {"loss": loss.item()}, step)
            bar.set_postfix_str(f"loss {loss.item():.4f}")
            bar.update()
            count_step(context, self.name, step + 1, SAVE_STEPS)
        bar.close()
        network.eval()


@dataclass(frozen=True)
class AgentStage:
    """Algorithm 1 on retrieved references and predicted labels: first cloning alone, then cloning and PPO."""

    name: str = "agent"

    def run(self, context: Context) -> None:
        """Make the rollouts that are left."""
        options, total = context.options, context.options.agent_rollouts
        policy, optimizer = context.state.networks["policy"], context.state.optimizers["policy"]
        first = context.state.done[self.name]
        if first >= total:
            return
        method = paper_estimator(context)
        samples, unseen = (view_source(context, POINTS, options.seed + seed, VIEWS) for seed in (2, 3))

        def episodes(n: int) -> tuple[Fitting, Theta]:
            set_rate(optimizer, options.agent_rate * one_cycle(n, total))
            return fitting_episodes(method, samples, options.episodes, options.seed, n)

        rounds = algorithm_1(method.policy, optimizer, episodes, options.phase, options.ppo, options.seed, first, total)
        bar = track(self.name, total=total, initial=first, smoothing=0.1, shown=context.progress)
        policy.train()
        for n, figures in enumerate(rounds, first):
            context.report(self.name, figures, n)
            if n % _ALONE_EVERY == 0 or n + 1 == total:
                alone = agent_alone(method.policy, *fitting_episodes(method, unseen, _ALONE, options.seed, 0))
                context.report("agent_alone", alone, n)
                bar.set_postfix_str(f"alone: reward {alone['reward']:.3f}, chamfer {alone['chamfer_end']:.3f}")
            bar.update()
            count_step(context, self.name, n + 1, SAVE_ROLLOUTS)
        bar.close()
        policy.eval()


@dataclass(frozen=True)
class KeepStage:
    """The estimator is kept as the last stage leaves it: no validation chooses one."""

    name: str = "keep"

    def run(self, context: Context) -> None:
        """Write the estimator."""
        context.save()
        save_estimator(context.estimator(), context.folder.best, context.about({}))


def paper_stages(options: TrainOptions) -> list[Any]:
    """The stages, in their order."""
    segmentation = SupervisedStage("segmentation", "segmentation", segmentation_loss)
    return [segmentation, RetrievalStage(), AgentStage(), KeepStage()]


def fitting_episodes(method: ArtPERL, samples: Source, count: int, seed: int, n: int) -> tuple[Fitting, Theta]:
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
    """
    generator = torch.Generator().manual_seed((seed << 32) + n)
    views = [samples[i] for i in range(n * count, (n + 1) * count)]
    points = _stacked([view.points for view in views]).to(method.device)
    part = method.segment(points)
    nearest = method.retrieve(points, part, min(CHOICES, len(method.base)))
    drawn = torch.randint(nearest.shape[1], (count, 1), generator=generator).to(method.device)
    reference = method.base.shapes[nearest.gather(1, drawn)[:, 0]]
    trees = reference.trees
    truth = [part_truth(view, trees.num_rows) for view in views]
    _, rotation, center, size, _, _ = (torch.stack(values).to(method.device) for values in zip(*truth, strict=True))
    goal = theta_from_parts(trees, reference.box_center, reference.box_size, rotation, center, size)
    goal = Theta(**{**vars(goal), "state": clamp_state(trees, goal.state)})
    start = mean_start(reference, points, method.options.start)
    fitting = Fitting(reference, Observed.of(points, part), start, method.options.fitting)
    return fitting, goal


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
