"""What PPO brings the agent beside cloning: ``python -m benchmarks.agents``.

An agent learns by cloning on states that are drawn at random; by cloning on these and on its own states in turn; and by
the same with PPO beside cloning on its own states. All take as many rollouts on the same problems, and begin with the
same random weights, several times with others. A problem is a fresh object with its true labels, one of the four
references most like it, and a start that is off. Each agent is then tested alone, without refinement, on unseen
objects: on clean clouds, with the noise of a Kinect v1, with 40 % of the points hidden, and from starts that are twice
as far off. Every run is written down when it is done: the same command goes on. Prints mean and standard error over the
runs of the parts' mean rotation error, in degrees, and how much less it is with PPO than by either way of cloning, over
pairs of runs; the last line is one JSON object.
"""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import tyro
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.agent.policy import Policy
from artperl.agent.ppo import CLONING, JOINT, OWN_STATES, Phase, PPOOptions, algorithm_1
from artperl.core.batch import concatenate
from artperl.core.pose import Theta, pose_parts
from artperl.data.categories import objects_of
from artperl.data.sources import DataOptions
from artperl.evaluation.samples import TEST_SEEDS
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.fitting_problems import Problem, Problems
from artperl.training.options import TrainOptions
from artperl.training.steps import set_rate
from artsim.common.files import read_bounded
from artsim.common.progress import say, track
from artsim.datasets.plan import SampleOptions
from artsim.observing.interference import interfere
from artsim.observing.sample import Sample

_MAX_RECORD = 10_000_000
_WAYS = ("drawn states", "own states too", "PPO on these")


@dataclass(frozen=True)
class Options:
    """How the agents learn and are tested."""

    categories: tuple[str, ...] = ("laptop", "eyeglasses", "dishwasher", "scissors", "drawer")
    seeds: int = 3
    """Runs of each way in each category."""
    rollouts: int = 60
    episodes: int = 64
    """Of a rollout."""
    problems: int = 640
    """That there are to learn from; each comes several times, in other states."""
    width: int = 32
    """Of the policy: less than trainings have, so that a run takes a minute."""
    seen_points: int = 128
    """Points of the cloud that the agent sees: half of what it sees in trainings."""
    tests: int = 128
    """Problems of each test."""
    out: Path = Path("out/agents.jsonl")
    """File of the runs that are done. Other options need another file."""
    picture: Path | None = None
    """Draw here the reward of the rollouts with PPO, mean and range over runs."""

    @property
    def fitting(self) -> FittingOptions:
        """The decision process."""
        return FittingOptions(seen_points=self.seen_points)


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
            base = by_boxes(ShapeBase.of(objects_of([category], 48, 0, data.parts), 192))
            tests = {name: problem(data, base, options.tests)[0] for name, problem in TESTS.items()}
            left = [(way, seed) for seed in range(options.seeds) for way in _WAYS if (category, way, seed) not in rows]
            made = Problems(data, base, options.episodes, seed=1)
            batches = track(f"{category}, problems", range(options.problems // options.episodes if left else 0))
            problems: Any = concatenate([made[n] for n in batches]) if left else None
            for way, seed in left:
                policy, rewards = learnt(problems, way, seed, options, f"{category}, {way}, {seed}")
                found = {"category": category, "way": way, "seed": seed, **told(policy, tests, options)}
                rows[category, way, seed] = found | {"rewards": rewards}
                file.write(json.dumps({"options": _asked(options), **rows[category, way, seed]}) + "\n")
                file.flush()
            _print(category, rows, options, {name: error(test.start, test) for name, test in tests.items()})
    if options.picture is not None:
        draw(rows, options)
    print(json.dumps(list(rows.values())))


def learnt(problems: Problem, way: str, seed: int, options: Options, name: str) -> tuple[Policy, list[float]]:
    """An agent after all its rollouts, and the mean reward of a step in those of its own actions."""
    torch.manual_seed(seed)
    policy = Policy(options.width).train()
    asked = TrainOptions(method="artperl", agent_rollouts=options.rollouts, cloning_share=1.0)
    optimizer = torch.optim.Adam(policy.parameters())

    def episodes(n: int) -> tuple[Fitting, Theta]:
        set_rate(optimizer, asked.rate_of_agent(n))
        generator = torch.Generator().manual_seed((seed << 32) + n)
        problem = problems[torch.randperm(len(problems), generator=generator)[: options.episodes]]
        return Fitting(problem.shapes, problem.observed, problem.start, options.fitting), problem.goal

    def phase(n: int) -> Phase:
        own = JOINT if way == "PPO on these" else OWN_STATES
        return own if n % 2 and way != "drawn states" else CLONING

    rounds = algorithm_1(policy, optimizer, episodes, phase, PPOOptions(), seed, 0, options.rollouts)
    figures = list(track(name, rounds, total=options.rollouts, leave=False))
    return policy.eval(), [round(own["reward"], 4) for own in figures if "reward" in own]


@torch.no_grad()
def told(policy: Policy, tests: dict[str, Any], options: Options) -> dict[str, float]:
    """Mean rotation error in degrees of an agent on each test."""
    found = {}
    for name, test in tests.items():
        fitting = Fitting(test.shapes, test.observed, test.start, options.fitting)
        while not fitting.done:
            fitting.step(policy(fitting.view())[0].argmax(-1))
        found[name] = error(fitting.theta, test)
    return found


def error(theta: Theta, test: Any) -> float:
    """Mean over problems of their parts' mean rotation from the goal, degrees."""
    trees, center = test.shapes.trees, test.shapes.box_center
    there, wanted = (pose_parts(trees, one, center).rotation for one in (theta, test.goal))
    cosine = ((there * wanted).sum((-1, -2)) - 1.0) / 2.0
    angle = torch.rad2deg(torch.arccos(cosine.clamp(-1.0, 1.0))) * trees.valid
    return float((angle.sum(1) / trees.valid.sum(1)).mean())


def draw(rows: dict[tuple[str, str, int], dict[str, Any]], options: Options) -> None:
    """Write the picture of the rewards."""
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(xlabel="steps of the agent", ylabel="mean reward of a step")
    for category in options.categories:
        rewards = np.array([rows[category, _WAYS[2], seed]["rewards"] for seed in range(options.seeds)])
        steps = np.arange(rewards.shape[1]) * options.episodes * options.fitting.steps
        (line,) = axes.plot(steps, rewards.mean(0), label=category)
        axes.fill_between(steps, rewards.min(0), rewards.max(0), color=line.get_color(), alpha=0.2, linewidth=0)
    axes.legend(frameon=False)
    assert options.picture is not None
    figure.savefig(options.picture, dpi=120)


def _asked(options: Options) -> dict[str, Any]:
    own = asdict(options)
    for name in ("out", "categories", "seeds", "picture"):
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
    print(f"{category:<12} {'start':<18}" + "".join(f"{name:>8} {start[name]:5.1f}         " for name in TESTS))
    every = np.array([[[rows[category, way, seed][name] for seed in range(options.seeds)] for name in TESTS]
                      for way in _WAYS])  # fmt: skip
    drawn, same, ppo = every
    for name, own in zip((*_WAYS, "drawn - PPO", "own - PPO"), (*every, drawn - ppo, same - ppo), strict=True):
        error = own.std(1, ddof=1) / options.seeds**0.5
        cells = [
            f"{test:>8} {mean:5.1f} +- {off:4.2f} " for test, mean, off in zip(TESTS, own.mean(1), error, strict=True)
        ]
        print(f"{category:<12} {name:<18}" + "".join(cells), flush=True)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
