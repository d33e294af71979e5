"""Teach a hand to open drawers that it has never seen, from the points of a depth camera.

The hand first imitates an oracle that knows the state, in episodes that the two share. PPO (Stable-Baselines3) then
improves it by rewards alone. The oracle, and policies that do not look, are tried beside it.

    pip install -c constraints.txt -e '.[envs,train,view]' stable-baselines3
    python examples/opening/main.py out/opening
    python examples/opening/main.py out/opening --help     # other tasks and objects
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import torch
import tyro
from gymnasium import spaces
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import DictReplayBuffer
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor

from artperl.training.stable_baselines import StableBaselinesEnvs
from artsim import ViewOptions
from artsim.common.progress import track
from artsim.envs.opening import OpeningVectorEnv

UNSEEN = 100_000
"""First seed of the objects that policies are tried on."""
DISCOUNT = 0.9
"""Of later rewards: an action shows its effect within half a second."""
BATCH, GRADIENTS = 512, 20
"""Steps of a gradient, and gradients of a round of cloning: each step is learnt from four times."""
KEPT = 40
"""Rounds whose steps are learnt from: 150 MB."""
PARTS = 6
"""How often it is tried while it learns in each way."""

Seen = dict[str, NDArray[np.float32]]
Policy = Callable[[OpeningVectorEnv, Seen], NDArray[np.float32]]


@dataclass(frozen=True)
class Options:
    """What to teach."""

    out: Annotated[Path, tyro.conf.Positional] = Path("out/opening")
    """Folder of the policies, the curve and the animation."""
    task: Literal["pull", "grasp"] = "pull"
    """pull: hands hold a handle when an episode begins; grasp: open hands stand before it."""
    categories: tuple[str, ...] = ("drawer",)
    """Procedural categories: artsim generate-objects --help names them."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """One policy for each."""
    objects: int = 400
    """To learn from, and as many others to be tried on, of each category."""
    hands: int = 64
    """Episodes at once."""
    episode_length: int = 40
    """Control steps."""
    rounds: int = 60
    """Of episodes, with each way of learning."""
    trials: int = 200
    """Episodes with unseen objects: 200 have a standard error of 3 % at most."""


class PointNet(BaseFeaturesExtractor):
    """Features of the cloud, beside what the hand knows."""

    def __init__(self, space: spaces.Dict, width: int = 128):
        self.told = [name for name in space if name != "points"]
        super().__init__(space, width + sum(spaces.flatdim(space[name]) for name in self.told))
        self.points = torch.nn.Sequential(torch.nn.Linear(3, 64), torch.nn.ReLU(), torch.nn.Linear(64, width))

    def forward(self, seen: dict[str, torch.Tensor]) -> torch.Tensor:
        """(B, F) of B observations, in units of 0.25 m."""
        cloud = torch.relu(self.points(4.0 * seen["points"]).max(dim=1).values)
        return torch.cat([cloud, *(4.0 * seen[name] for name in self.told)], dim=1)


def make_envs(options: Options, count: int, first_seed: int, **more: Any) -> OpeningVectorEnv:
    """Hands before objects whose seeds count from the first one."""
    return OpeningVectorEnv(
        count, task=options.task, categories=options.categories, pool=options.objects, first_seed=first_seed,
        episode_length=options.episode_length, **more,
    )  # fmt: skip


def success(policy: Policy, envs: OpeningVectorEnv) -> float:
    """Share of the episodes that a policy ends at the goal; they are the same for all."""
    seen, _ = envs.reset(seed=0)
    for _ in range(envs.options.episode_length):
        seen, *_, info = envs.step(policy(envs, seen))
    return float(np.mean(info["success"]))


def best_constant(envs: OpeningVectorEnv) -> Policy:
    """Of velocities towards the camera, with closed fingers, the best on the objects to learn from."""

    def constant(fast: float, aside: float) -> Policy:
        action = np.float32([-fast, fast * aside, 0.0, 1.0])[: envs.single_action_space.shape[0]]
        return lambda envs, seen: np.tile(action, (envs.num_envs, 1))

    policies = [constant(fast, aside) for fast in (0.15, 0.3, 0.45, 0.6) for aside in (-0.5, 0.0, 0.5)]
    return max(policies, key=lambda policy: success(policy, envs))


def learnt(model: PPO) -> Policy:
    """Without the noise that it learns by."""
    return lambda envs, seen: model.predict(seen, deterministic=True)[0]


def clone(model: PPO, envs: OpeningVectorEnv, kept: DictReplayBuffer, rate: float) -> None:
    """A round of episodes: learn what the oracle does, and what return to expect.

    The oracle moves every other hand, the policy the rest: it learns what to do after its own mistakes too.
    """
    seen, steps = envs.reset()[0], []
    for _ in range(envs.options.episode_length):
        wanted = envs.oracle()
        action = model.predict(seen)[0]
        action[::2] = wanted[::2]
        before = seen
        seen, reward, *_ = envs.step(action)
        steps.append((before, wanted, reward))
    value = np.zeros(envs.num_envs)
    for before, wanted, reward in reversed(steps):
        value = reward + DISCOUNT * value
        kept.add(before, before, wanted, value, np.zeros(envs.num_envs), [{}] * envs.num_envs)
    optimizer = model.policy.optimizer
    for group in optimizer.param_groups:
        group["lr"] = rate
    for _ in range(GRADIENTS):
        some = kept.sample(BATCH)
        values, log_prob, _ = model.policy.evaluate_actions(some.observations, some.actions)
        loss = torch.nn.functional.mse_loss(values, some.rewards) - log_prob.mean()
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(model.policy.parameters(), model.max_grad_norm)
        optimizer.step()


def teach(options: Options, envs: OpeningVectorEnv, unseen: OpeningVectorEnv, seed: int) -> tuple[PPO, dict[str, Any]]:
    """A policy, and its successes with unseen objects over control steps."""
    hands = StableBaselinesEnvs(envs)
    of_round = options.hands * options.episode_length
    shape = {"features_extractor_class": PointNet, "net_arch": [128, 128], "log_std_init": -1.6}
    model = PPO(
        "MultiInputPolicy", hands, n_steps=options.episode_length, batch_size=min(BATCH, of_round), n_epochs=4,
        gamma=DISCOUNT, gae_lambda=0.9, learning_rate=1e-4, target_kl=0.02, policy_kwargs=shape, seed=seed,
        device="cpu",
    )  # fmt: skip
    model.policy.log_std.requires_grad_(False)  # else cloning makes it larger than hands that must not slip can bear
    envs.reset(seed=seed)
    kept = DictReplayBuffer(KEPT * of_round, hands.observation_space, hands.action_space, "cpu", options.hands)
    curve, seconds = [(0, success(learnt(model), unseen))], 0.0
    rounds = track(f"seed {seed}", range(1, 2 * options.rounds + 1), unit="round")
    for n in rounds:
        way = "PPO" if n > options.rounds else "cloning"
        start = time.perf_counter()
        if way == "cloning":
            clone(model, envs, kept, 1e-3 * (1.0 - n / options.rounds) + 5e-5)
        else:
            model.learn(of_round, reset_num_timesteps=n == options.rounds + 1)
        seconds += time.perf_counter() - start
        if n % max(1, options.rounds // PARTS) == 0:
            curve.append((n * of_round, success(learnt(model), unseen)))
            rounds.set_postfix_str(f"{way}, success {curve[-1][1]:.0%}")
    cloned = dict(curve)[options.rounds * of_round]
    row = {"seed": seed, "cloned": cloned, "success": curve[-1][1], "seconds": round(seconds), "curve": curve}
    return model, row | {"steps per second": round(curve[-1][0] / seconds)}


def draw(rows: list[dict[str, Any]], known: dict[str, float], options: Options, file: Path) -> None:
    """Successes over control steps, of each seed, and of policies that do not learn."""
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axes = figure.add_subplot(xlabel="control steps", ylabel="success with unseen objects", ylim=(0, 1.05))
    for row in rows:
        axes.plot(*np.transpose(row["curve"]), marker=".", label=f"seed {row['seed']}")
    for name, level in known.items():
        axes.axhline(level, color="0.6", linestyle=":", linewidth=1)
        axes.text(rows[0]["curve"][-1][0], level, name, va="bottom", ha="right", color="0.4", fontsize=8)
    begins = options.rounds * options.hands * options.episode_length
    axes.axvline(begins, color="0.8", linewidth=1)
    axes.text(begins, 0.5, " PPO", color="0.4", fontsize=8)
    axes.legend(loc="center right", frameon=False)
    figure.savefig(file, dpi=100)


def film(policy: Policy, options: Options, file: Path) -> None:
    """Four episodes with unseen objects, side by side."""
    views = ViewOptions(azimuth=(-60.0, 60.0), elevation=(15.0, 45.0), width=200, height=150)
    envs = make_envs(options, 4, UNSEEN, views=views, render_mode="rgb_array")
    seen, _ = envs.reset(seed=1)
    pictures = []
    for _ in range(options.episode_length):
        pictures.append(Image.fromarray(np.hstack(envs.render() or ())))
        seen, *_ = envs.step(policy(envs, seen))
    last = [50] * (len(pictures) - 1) + [1500]
    pictures[0].save(file, save_all=True, append_images=pictures[1:], duration=last, loop=0, quality=60)


def main(options: Options) -> None:
    """Teach, try, and show."""
    torch.set_num_threads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    envs, unseen = make_envs(options, options.hands, 0), make_envs(options, options.trials, UNSEEN)
    policies: dict[str, Policy] = {
        "best constant": best_constant(envs),
        "random": lambda envs, seen: envs.action_space.sample(),
        "oracle": lambda envs, seen: envs.oracle(),
    }
    unseen.action_space.seed(0)
    known = {name: success(policy, unseen) for name, policy in policies.items()}
    rows = []
    for seed in options.seeds:
        model, row = teach(options, envs, unseen, seed)
        model.save(options.out / f"policy_{seed}.zip")
        rows.append(row)
    draw(rows, known, options, options.out / "opening_policy.png")
    film(learnt(model), options, options.out / "opening_policy.webp")
    print(f"wrote {options.out}", file=sys.stderr)
    unseen.reset(seed=0)
    objects = len({id(handle.obj) for handle in unseen.handles})
    print(f"Success in {options.trials} episodes with {objects} unseen objects.\n")
    print("| policy | success | control steps | steps/s |\n|---|---|---|---|")
    for name, level in known.items():
        print(f"| {name} | {100 * level:.1f} % | | |")
    for row in rows:
        steps = row["curve"][-1][0]
        print(f"| seed {row['seed']}, cloned | {100 * row['cloned']:.1f} % | {steps // 2:,} | |")
        print(
            f"| seed {row['seed']}, then PPO | {100 * row['success']:.1f} % | {steps:,} | {row['steps per second']} |"
        )
    print(json.dumps({"objects": objects, **known, "seeds": rows}))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
