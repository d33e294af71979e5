"""Speed of fitting and of learning: ``python -m benchmarks.fitting``.

Environment steps a second: a batch of objects takes random actions, rewards included. Training samples a second: clouds
that perception learns from, and states that the agent does, each with the share of time that goes into data, network
and reward. The last line is one JSON object.
"""

from __future__ import annotations

import json
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import torch
import tyro
from torch import nn

from artperl.agent.actions import NUM_AXES, NUM_BINS
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.agent.policy import Policy
from artperl.agent.ppo import JOINT, PPOOptions, rollout, update
from artperl.core.mixed_precision import autocast
from artperl.data.batches import batches
from artperl.data.categories import objects_of
from artperl.data.fitting_problems import Problem, Problems
from artperl.data.sources import DataOptions
from artperl.perception.network import Perception
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.objects import BASE_SEEDS
from artperl.training.perception_losses import perception_losses


@dataclass(frozen=True)
class Options:
    """How fast artperl fits and learns."""

    category: str = "laptop"
    points: int = 512
    """Of the observed cloud, and of the whole reference."""
    environments: int = 64
    """Objects that are fitted as one batch."""
    seconds: float = 8.0
    """Of each measurement."""
    threads: int = 1
    """Processor threads of torch. Batches are worked on in pieces that fit a core's cache: more threads pay little, and
    less than nothing where something else needs the cores."""


class Shares:
    """Seconds by what they were spent on."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        begun = time.perf_counter()
        yield
        self.seconds[name] += time.perf_counter() - begun

    def rounded(self) -> dict[str, float]:
        """Shares of the whole."""
        whole = sum(self.seconds.values())
        return {name: round(value / whole, 3) for name, value in self.seconds.items()}


def main(options: Options) -> None:
    """Measure and print."""
    torch.set_num_threads(options.threads)
    base = by_boxes(ShapeBase.of(objects_of([options.category], 16, BASE_SEEDS), options.points))
    problems = Problems(DataOptions([options.category]), base, options.environments, options.points)
    steps = env_steps(problems[0], options)
    print(f"environment: {steps:.0f} steps/s, {options.points} observed x {options.points} reference points")
    perception, perception_shares = learning_to_perceive(base.shapes.trees.num_rows, options)
    print(f"perception learns from {perception:.0f} clouds/s, {perception_shares.rounded()}")
    agent, agent_shares = learning_to_fit(problems, options)
    print(f"agent learns from {agent:.0f} states/s, {agent_shares.rounded()}")
    result = {
        "env_steps_per_s": round(steps, 1),
        "training_samples_per_s": round(perception, 1),
        "agent_states_per_s": round(agent, 1),
        "share_of_time": {"perception": perception_shares.rounded(), "agent": agent_shares.rounded()},
        "points": options.points,
        "environments": options.environments,
        "threads": options.threads,
    }
    print(json.dumps(result))


def env_steps(problem: Problem, options: Options) -> float:
    """Steps a second of all environments together, under random actions."""
    rows = problem.shapes.trees.num_rows
    per_part = options.points // int(problem.shapes.trees.valid.sum(1).max())
    setting = FittingOptions(steps=1 << 30, observed_points=options.points, reference_points=per_part)
    fitting = Fitting(problem.shapes, problem.observed, problem.start, setting)
    generator = torch.Generator().manual_seed(0)
    actions = torch.randint(NUM_BINS, (16, options.environments, rows, NUM_AXES), generator=generator)
    done, begun = -2, time.perf_counter()
    while done < 4 or time.perf_counter() - begun < options.seconds:
        if done == 0:  # the first steps warm up
            begun = time.perf_counter()
        fitting.step(actions[done % len(actions)])
        done += 1
    return done * options.environments / (time.perf_counter() - begun)


def learning_to_perceive(rows: int, options: Options, batch_size: int = 32) -> tuple[float, Shares]:
    """Clouds of 1,024 points a second that perception learns from; another process makes them."""
    torch.manual_seed(0)
    network, shares = Perception(rows), Shares()
    optimizer = torch.optim.AdamW(network.parameters())
    data = batches(DataOptions([options.category]), rows, batch_size=batch_size)
    next(data)
    done, begun = 0, time.perf_counter()
    while time.perf_counter() - begun < options.seconds:
        with shares("data"):
            clouds, truth = next(data)
        with shares("network"):
            with autocast(torch.device("cpu")):
                perceived = network(clouds.points)
            loss = torch.stack(list(perception_losses(perceived, truth).values())).sum()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 1.0)
            optimizer.step()
        done += batch_size
    return done / (time.perf_counter() - begun), shares


class _Timed(Fitting):
    """Notes the time that steps and their rewards take."""

    shares: Shares

    def step(self, action: torch.Tensor) -> torch.Tensor:
        """As its base class."""
        with self.shares("reward"):
            return super().step(action)


def learning_to_fit(problems: Problems, options: Options) -> tuple[float, Shares]:
    """States a second that the agent learns from by Algorithm 1, as in training."""
    torch.manual_seed(0)
    agent, shares, ppo = Policy(), Shares(), PPOOptions()
    optimizer = torch.optim.AdamW(agent.parameters())
    generator = torch.Generator().manual_seed(0)
    done, begun = 0, time.perf_counter()
    while time.perf_counter() - begun < options.seconds:
        with shares("data"):
            problem = problems[done + 1]
        fitting = _Timed(problem.shapes, problem.observed, problem.start)
        fitting.shares = shares
        reward = shares.seconds["reward"]
        with shares("network"):
            buffer, _ = rollout(agent, fitting, problem.goal, ppo, generator)
            update(agent, optimizer, buffer, JOINT, ppo, generator)
        shares.seconds["network"] -= shares.seconds["reward"] - reward
        done += 1
    states = done * options.environments * fitting.steps_taken
    return states / (time.perf_counter() - begun), shares


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
