"""Speed of estimating, fitting and learning: ``python -m benchmarks.speed``.

Milliseconds of an estimate of unseen procedural objects, median over instances, warm, in whole and by stage. Steps a
second of the fitting environment: a batch of objects takes random actions, rewards included. Clouds a second that
perception learns from, and states that the agent does. The last line is one JSON object.
"""

import json
import os
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import tyro
from torch import nn

from artperl.agent.actions import NUM_AXES, NUM_BINS
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.agent.policy import Policy
from artperl.agent.ppo import JOINT, PPOOptions, rollout, update
from artperl.core.mixed_precision import autocast
from artperl.data.batches import batches
from artperl.data.categories import ARTIMAGE, objects_of
from artperl.data.sources import DataOptions
from artperl.evaluation.artimage import row_objects, row_samples
from artperl.evaluation.benchmark import find_estimator
from artperl.perception.network import Perception
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.fitting_problems import Problem, Problems
from artperl.training.objects import BASE_SEEDS
from artperl.training.perception_losses import perception_losses

_WARM_UP = 5


@dataclass(frozen=True)
class Options:
    """How fast artperl estimates, fits and learns."""

    weights: Path | None = None
    """Folder of estimators (or of training runs) by category; by default those that come with the package."""
    categories: tuple[str, ...] = tuple(ARTIMAGE)
    """Of the estimates; fitting and learning take the first one."""
    instances: int = 20
    """Estimates of each category, at least."""
    points: int = 512
    """Of the environment's observed cloud, and of the whole reference."""
    environments: int = 64
    """Objects that are fitted as one batch."""
    seconds: float = 8.0
    """Of each measurement of fitting and learning."""
    threads: int = 1
    """Processor threads of torch. Batches are worked on in pieces that fit a core's cache: more threads pay little, and
    less than nothing where something else needs the cores."""


def main(options: Options) -> None:
    """Measure and print."""
    torch.set_num_threads(options.threads)
    torch.manual_seed(0)
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, of which an estimate takes one")
    stages = {category: estimate_ms(category, options) for category in options.categories}
    category = options.categories[0]
    base = by_boxes(ShapeBase.of(objects_of([category], 16, BASE_SEEDS), options.points))
    problems = Problems(DataOptions([category]), base, options.environments, options.points)
    rates = {
        "env_steps_per_s": environment_steps(problems[0], options),
        "training_samples_per_s": clouds_learnt(category, base.shapes.trees.num_rows, options),
        "agent_states_per_s": states_learnt(problems, options),
    }
    for name, rate in rates.items():
        print(f"{category}: {rate:.0f} {name.replace('_', ' ').replace(' per s', '/s')}")
    print(json.dumps({"stages_ms": stages, **{name: round(rate, 1) for name, rate in rates.items()}}))


def estimate_ms(category: str, options: Options) -> dict[str, float]:
    """Print and return the median of a category's estimates, in all and by stage."""
    estimator = find_estimator(options.weights, category)
    tested = row_objects("procedural", category, objects=min(20, options.instances))
    samples = row_samples("procedural", tested, options.instances)
    for sample in samples[:_WARM_UP]:
        estimator(sample.points)
    times = [estimator(sample.points).milliseconds for sample in samples]
    found = {"all": float(np.median([sum(one.values()) for one in times]))}
    for stage in dict.fromkeys(stage for one in times for stage in one):
        found[stage] = float(np.median([one.get(stage, 0.0) for one in times]))
    found = {stage: round(value, 1) for stage, value in found.items()}
    print(f"{category:12} {len(times)} instances, ms: {', '.join(f'{k} {v}' for k, v in found.items())}", flush=True)
    return found


def per_second(work: Callable[[], int], seconds: float) -> float:
    """Rate of things done by calls of a function that says how many it did; the first call warms up."""
    work()
    done, begun = 0, time.perf_counter()
    while (spent := time.perf_counter() - begun) < seconds or not done:
        done += work()
    return done / spent


def environment_steps(problem: Problem, options: Options) -> float:
    """Steps a second of all environments together, under random actions."""
    rows = problem.shapes.trees.num_rows
    per_part = options.points // int(problem.shapes.trees.valid.sum(1).max())
    setting = FittingOptions(steps=1 << 30, observed_points=options.points, reference_points=per_part)
    fitting = Fitting(problem.shapes, problem.observed, problem.start, setting)
    generator = torch.Generator().manual_seed(0)
    actions = torch.randint(NUM_BINS, (16, options.environments, rows, NUM_AXES), generator=generator)

    def step() -> int:
        fitting.step(actions[fitting.steps_taken % len(actions)])
        return options.environments

    return per_second(step, options.seconds)


def clouds_learnt(category: str, rows: int, options: Options, batch_size: int = 32) -> float:
    """Clouds of 1,024 points a second that perception learns from; another process makes them."""
    network = Perception(rows)
    optimizer = torch.optim.AdamW(network.parameters())
    data = batches(DataOptions([category]), rows, batch_size=batch_size)

    def learn() -> int:
        clouds, truth = next(data)
        with autocast(torch.device("cpu")):
            perceived = network(clouds.points)
        loss = torch.stack(list(perception_losses(perceived, truth).values())).sum()
        optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        return batch_size

    return per_second(learn, options.seconds)


def states_learnt(problems: Problems, options: Options) -> float:
    """States a second that the agent learns from by Algorithm 1, as in training."""
    agent, ppo, generator = Policy(), PPOOptions(), torch.Generator().manual_seed(0)
    optimizer = torch.optim.AdamW(agent.parameters())

    def learn() -> int:
        problem = problems[1]
        fitting = Fitting(problem.shapes, problem.observed, problem.start)
        buffer, _ = rollout(agent, fitting, problem.goal, ppo, generator)
        update(agent, optimizer, buffer, JOINT, ppo, generator)
        return options.environments * fitting.steps_taken

    return per_second(learn, options.seconds)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
