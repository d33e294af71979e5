"""The environment is what gymnasium expects, and what the batched process does."""

from __future__ import annotations

import gymnasium as gym
import pytest
import torch
from gymnasium.utils.env_checker import check_env

from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.training.gym_env import ENV_ID, PoseFittingEnv, nothing
from tests.conftest import installed

OPTIONS = FittingOptions(steps=4, observed_points=64, reference_points=32)
STEPS = 2 * OPTIONS.steps  # a laptop has two levels


@pytest.fixture(scope="module")
def env() -> PoseFittingEnv:
    return PoseFittingEnv("laptop", references=3, options=OPTIONS)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_gymnasium_finds_no_fault(env: PoseFittingEnv) -> None:
    check_env(env, skip_render_check=True)
    made = gym.make(ENV_ID, references=2, options=OPTIONS)
    assert made.observation_space.contains(made.reset(seed=1)[0])


def test_an_episode_is_that_of_the_batched_process(env: PoseFittingEnv) -> None:
    env.reset(seed=3)
    problem = env._problem
    assert problem is not None
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    for step in range(STEPS):
        action = fitting.expert(problem.goal)
        _, reward, ended, truncated, info = env.step(action.flatten().numpy())
        assert reward == fitting.step(action).item()
        assert info["chamfer"] == fitting.distance.item()
        assert (ended, truncated) == (False, step == STEPS - 1)


def test_following_the_expert_of_info_pays(env: PoseFittingEnv) -> None:
    returns = {"expert": 0.0, "nothing": 0.0}
    for kind in returns:
        for seed in range(5):
            _, info = env.reset(seed=seed)
            for _ in range(STEPS):
                _, reward, _, _, info = env.step(info["expert"] if kind == "expert" else nothing(env))
                returns[kind] += reward
    assert returns["nothing"] == pytest.approx(-0.05 * STEPS * 5)
    assert returns["expert"] > 5.0


def test_a_step_needs_a_reset() -> None:
    fresh = PoseFittingEnv("laptop", references=1, options=OPTIONS)
    with pytest.raises(gym.error.ResetNeeded):
        fresh.step(nothing(fresh))


@pytest.mark.slow
def test_ppo_of_stable_baselines_runs_on_it_unchanged(env: PoseFittingEnv) -> None:
    baselines = installed("stable_baselines3")
    model = baselines.PPO("MultiInputPolicy", env, n_steps=16, batch_size=8, n_epochs=1, device="cpu")
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(16)
    after = list(model.policy.parameters())
    assert any(not torch.equal(a, b) for a, b in zip(before, after, strict=True))
    assert all(bool(torch.isfinite(p).all()) for p in after)
