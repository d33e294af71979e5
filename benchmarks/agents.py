"""What cloning and PPO bring the agent: ``python -m benchmarks.agents``.

An agent learns by cloning alone, by PPO alone, and by Algorithm 1 (cloning, then both), each from the same number of
rollouts on the same problems, several times from other random weights. A problem is a fresh object with its true
labels, one of the four references most like it, and a start that is off. Each agent is then tested alone, without
refinement, on unseen objects: on clean clouds, with the noise of a Kinect v1, with 40 % of the points hidden, and
from starts that are twice as far off. ``robot_arm`` has the longest chains. Every run is written down when it is
done: the same command goes on. Prints mean and standard deviation over the runs of the parts' mean rotation error, in
degrees; the last line is one JSON object.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import tyro

from artperl.agent.actions import expected_action
from artperl.agent.decision_process import Fitting
from artperl.agent.policy import Policy
from artperl.agent.ppo import CLONING, JOINT, Phase, PPOOptions, algorithm_1
from artperl.core.pose import Theta, pose_parts
from artperl.data.categories import objects_of
from artperl.data.fitting_problems import Problems
from artperl.data.sources import DataOptions
from artperl.evaluation.samples import TEST_SEEDS
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.steps import one_cycle
from artsim.common.files import read_bounded
from artsim.common.progress import say, track
from artsim.datasets.plan import SampleOptions
from artsim.observing.interference import interfere
from artsim.observing.sample import Sample

_MAX_RECORD = 10_000_000
_WAYS = ("cloning", "PPO", "cloning, then both")
_REWARDS = Phase(reinforcement=True, guided=0.0, sharpness=1.0, cloning=False)
"""PPO without an expert."""


@dataclass(frozen=True)
class Options:
    """How the agents learn and are tested."""

    categories: tuple[str, ...] = ("laptop", "eyeglasses", "dishwasher", "scissors", "drawer", "robot_arm")
    seeds: int = 3
    """Runs of each way in each category."""
    rollouts: int = 12
    episodes: int = 192
    """Of a rollout."""
    width: int = 32
    """Of the policy: half of what trainings have, so that a run takes a minute."""
    rate: float = 3e-3
    cloning_share: float = 0.7
    """Of the rollouts of Algorithm 1, those by cloning alone."""
    tests: int = 96
    """Problems of each test."""
    out: Path = Path("out/agents.jsonl")
    """File of the runs that are done. Other options need another file."""


class Hidden(Problems):
    """Problems with 40 % of the points hidden on one side."""

    def sample(self, i: int) -> Sample:
        """What is left of what a problem shows."""
        return interfere(super().sample(i), np.random.default_rng([self.seed, i]), hidden=0.4)


TESTS: dict[str, Callable[[DataOptions, ShapeBase, int], Problems]] = {
    "clean": lambda data, base, count: Problems(data, base, count, seed=TEST_SEEDS),
    "noise": lambda data, base, count: Problems(
        DataOptions(data.categories, data.parts, sample=SampleOptions(noise="kinect_v1")), base, count, seed=TEST_SEEDS
    ),
    "hidden": lambda data, base, count: Hidden(data, base, count, seed=TEST_SEEDS),
    "far": lambda data, base, count: Problems(data, base, count, seed=TEST_SEEDS, far=2.0),
}
"""Batches of test problems: objects of seeds that no run learns from."""


def main(options: Options) -> None:
    """Learn, test, and print."""
    torch.set_num_threads(1)
    rows = _read(options)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with options.out.open("a") as file:
        for category in options.categories:
            data = DataOptions((category,), "any" if category == "robot_arm" else "artimage")
            objects = objects_of([category], 48, 0, data.parts)
            base = by_boxes(ShapeBase.of(objects, 64))
            tests = {name: problem(data, base, options.tests)[0] for name, problem in TESTS.items()}
            for way in _WAYS:
                for seed in range(options.seeds):
                    if (category, way, seed) in rows:
                        continue
                    policy = learnt(data, base, way, seed, options)
                    found = {"category": category, "way": way, "seed": seed, **told(policy, tests)}
                    rows[category, way, seed] = found
                    file.write(json.dumps({"options": _asked(options), **found}) + "\n")
                    file.flush()
            _print(category, rows, options, {name: error(test.start, test) for name, test in tests.items()})
    print(json.dumps(list(rows.values())))


def learnt(data: DataOptions, base: ShapeBase, way: str, seed: int, options: Options) -> Policy:
    """An agent after all its rollouts."""
    torch.manual_seed(seed)
    policy = Policy(options.width).train()
    optimizer = torch.optim.Adam(policy.parameters(), options.rate)
    problems = Problems(data, base, options.episodes, seed=1 + seed)

    def episodes(n: int) -> tuple[Fitting, Theta]:
        for group in optimizer.param_groups:
            group["lr"] = options.rate * one_cycle(n, options.rollouts)
        problem = problems[n]
        return Fitting(problem.shapes, problem.observed, problem.start), problem.goal

    def phase(n: int) -> Phase:
        if way == "cloning, then both":
            return CLONING if n < options.cloning_share * options.rollouts else JOINT
        return CLONING if way == "cloning" else _REWARDS

    rounds = algorithm_1(
        policy, optimizer, episodes, phase, PPOOptions(epochs=2), seed, 0, options.rollouts
    )  # fmt: skip
    for _ in track(f"{data.categories[0]}, {way}, {seed}", rounds, total=options.rollouts, leave=False):
        pass
    return policy.eval()


@torch.no_grad()
def told(policy: Policy, tests: dict[str, Any]) -> dict[str, float]:
    """Mean rotation error in degrees of an agent on each test."""
    found = {}
    for name, test in tests.items():
        fitting = Fitting(test.shapes, test.observed, test.start)
        while not fitting.done:
            fitting.step(expected_action(policy(fitting.view())[0]))
        found[name] = error(fitting.theta, test)
    return found


def error(theta: Theta, test: Any) -> float:
    """Mean over problems of their parts' mean rotation from the goal, degrees."""
    trees, center = test.shapes.trees, test.shapes.box_center
    there, wanted = (pose_parts(trees, one, center).rotation for one in (theta, test.goal))
    cosine = ((there * wanted).sum((-1, -2)) - 1.0) / 2.0
    angle = torch.rad2deg(torch.arccos(cosine.clamp(-1.0, 1.0))) * trees.valid
    return float((angle.sum(1) / trees.valid.sum(1)).mean())


def _asked(options: Options) -> dict[str, Any]:
    own = asdict(options)
    for name in ("out", "categories", "seeds"):
        own.pop(name)
    return own


def _read(options: Options) -> dict[tuple[str, str, int], dict[str, Any]]:
    """Runs that are done; a line that the last one was stopped in is done again."""
    rows: dict[tuple[str, str, int], dict[str, Any]] = {}
    if options.out.is_file():
        for line in read_bounded(options.out, _MAX_RECORD, "record").decode().splitlines():
            try:
                row = json.loads(line)
            except ValueError:
                continue
            if row.pop("options") == _asked(options):
                rows[row["category"], row["way"], row["seed"]] = row
            else:
                say(f"{options.out}: a run of other options is left out")
    return rows


def _print(
    category: str, rows: dict[tuple[str, str, int], dict[str, Any]], options: Options, start: dict[str, float]
) -> None:
    print(f"{category:<12} {'start':<20}" + "".join(f"{name} {start[name]:5.1f}            " for name in TESTS))
    for way in _WAYS:
        own = [rows[category, way, seed] for seed in range(options.seeds)]
        cells = [
            f"{name} {np.mean([row[name] for row in own]):5.1f} +- {np.std([row[name] for row in own]):4.1f}    "
            for name in TESTS
        ]
        print(f"{category:<12} {way:<20}" + "".join(cells), flush=True)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
