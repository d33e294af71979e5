"""The environment is what gymnasium expects, and what the batched process does."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env

from artperl.agent.actions import NOTHING
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.training.gym_env import ENV_ID, PoseFittingEnv, PoseFittingVectorEnv, nothing
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


def test_many_environments_are_those_of_one_process_and_start_again_together() -> None:
    envs = gym.make_vec(ENV_ID, 3, references=2, options=OPTIONS)
    assert isinstance(envs.unwrapped, PoseFittingVectorEnv)
    observed, _ = envs.reset(seed=5)
    assert envs.observation_space.contains(observed)
    problem = envs.unwrapped._problem
    assert problem is not None
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    first = fitting.view()
    for step in range(STEPS):
        action = fitting.expert(problem.goal)
        observed, reward, ended, truncated, info = envs.step(action.flatten(1).numpy())
        np.testing.assert_array_equal(reward, fitting.step(action).numpy())
        assert not ended.any()
        assert truncated.tolist() == [step == STEPS - 1] * 3
    assert envs.observation_space.contains(observed)
    assert envs.observation_space.contains(info["final_obs"])
    np.testing.assert_array_equal(info["final_info"]["chamfer"], fitting.distance.numpy())
    assert (info["final_obs"]["left"] == 0).all()
    assert (observed["left"] == 1).all()
    assert not torch.equal(envs.unwrapped._problem.observed.points, problem.observed.points)  # other objects
    again, _ = envs.reset(seed=5)
    for name, values in vars(first).items():
        np.testing.assert_array_equal(again[name], values.numpy(), err_msg=name)


def test_environments_in_a_batch_do_not_touch_each_other() -> None:
    envs = PoseFittingVectorEnv(3, references=2, options=OPTIONS)
    some = np.full((3, len(envs.single_action_space.nvec)), NOTHING)
    other = some.copy()
    other[1] = NOTHING + 3
    seen = []
    for actions in (some, other):
        envs.reset(seed=1)
        seen.append(envs.step(actions)[0]["reference"])
    np.testing.assert_array_equal(seen[0][[0, 2]], seen[1][[0, 2]])
    assert not np.array_equal(seen[0][1], seen[1][1])


@pytest.mark.slow
def test_ppo_of_stable_baselines_learns_from_many_at_once() -> None:
    baselines = installed("stable_baselines3")
    from artperl.training.stable_baselines import StableBaselinesEnvs

    envs = StableBaselinesEnvs(gym.make_vec(ENV_ID, 4, references=2, options=OPTIONS))
    model = baselines.PPO("MultiInputPolicy", envs, n_steps=2 * STEPS, batch_size=16, n_epochs=1, device="cpu", seed=0)
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(4 * 2 * STEPS)
    assert model.num_timesteps == 4 * 2 * STEPS
    assert any(not torch.equal(a, b) for a, b in zip(before, model.policy.parameters(), strict=True))
