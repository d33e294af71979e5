"""Steps of the fitting environment."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from . import Work

ENVIRONMENTS, POINTS, STEPS = 64, 512, 24


def steps(folder: Path) -> Callable[[], Work]:
    """Random actions in a batch of laptops, rewards included."""
    import torch

    from artperl.agent.actions import NUM_AXES, NUM_BINS
    from artperl.agent.decision_process import Fitting, FittingOptions
    from artperl.data.categories import objects_of
    from artperl.data.fitting_problems import Problems
    from artperl.data.sources import DataOptions
    from artperl.retrieval.box_embedding import by_boxes
    from artperl.retrieval.shape_base import ShapeBase
    from artperl.training.objects import BASE_SEEDS

    torch.set_num_threads(1)
    base = by_boxes(ShapeBase.of(objects_of(["laptop"], 16, BASE_SEEDS), POINTS))
    problem = Problems(DataOptions(["laptop"]), base, ENVIRONMENTS, POINTS)[0]
    trees = problem.shapes.trees
    setting = FittingOptions(
        steps=1 << 30, observed_points=POINTS, reference_points=POINTS // int(trees.valid.sum(1).max())
    )
    generator = torch.Generator().manual_seed(0)
    actions = torch.randint(NUM_BINS, (STEPS, ENVIRONMENTS, trees.num_rows, NUM_AXES), generator=generator)

    def work() -> Work:
        fitting = Fitting(problem.shapes, problem.observed, problem.start, setting)
        reward = torch.stack([fitting.step(action) for action in actions])
        return Work(STEPS * ENVIRONMENTS, facts={"mean_reward": float(reward.mean())})

    return work


def learnt_from(folder: Path) -> Callable[[], Work]:
    """Learning by PPO of Stable-Baselines3, from many environments at once where there are such."""
    import gymnasium
    import torch
    from stable_baselines3 import PPO

    from artperl.training.gym_env import ENV_ID

    torch.set_num_threads(1)
    envs: Any
    try:
        from artperl.training.stable_baselines import StableBaselinesEnvs

        many, envs = ENVIRONMENTS, StableBaselinesEnvs(gymnasium.make_vec(ENV_ID, ENVIRONMENTS))
    except ImportError:  # the older revision
        many, envs = 1, gymnasium.make(ENV_ID)
    model = PPO("MultiInputPolicy", envs, n_steps=1536 // many, batch_size=64, n_epochs=4, device="cpu", seed=0)

    def work() -> Work:
        before = model.num_timesteps
        model.learn(1536, reset_num_timesteps=False)
        return Work(model.num_timesteps - before)

    return work
