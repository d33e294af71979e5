"""Algorithm 1's losses are those of the literature, and learning works."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch

from artperl.agent.actions import MOVE, NOTHING, NUM_AXES, NUM_BINS, SCALE, action_mask
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.agent.policy import Policy
from artperl.agent.ppo import (
    CLONING,
    JOINT,
    Buffer,
    Phase,
    PPOOptions,
    advantages,
    algorithm_1,
    cloning_loss,
    drawn,
    log_probability,
    ppo_losses,
    rollout,
    scatter,
    update,
)
from artperl.core.pose import Theta
from artperl.core.trees import KINDS
from tests.artperl.worlds import small_problem
from tests.conftest import installed

FITTING = FittingOptions(steps=3, observed_points=96, reference_points=32)


def a_buffer(agent: Policy, phase: Phase, seed: int = 0, kinds: tuple[str, ...] = ("laptop",)) -> Buffer:
    problem = small_problem(*kinds)
    fitting = Fitting(problem.shapes, problem.observed, problem.start, FITTING)
    if phase.scattered:
        return scatter(fitting, problem.goal, torch.Generator().manual_seed(seed))
    return rollout(agent, fitting, problem.goal, phase, PPOOptions(), torch.Generator().manual_seed(seed))[0]


def an_agent(seed: int = 0, width: int = 16) -> Policy:
    torch.manual_seed(seed)
    return Policy(width)


def test_advantages_are_discounted_sums_of_errors() -> None:
    options = PPOOptions()
    rng = np.random.default_rng(0)
    rewards, values = rng.normal(size=(6, 4)), rng.normal(size=(7, 4))
    delta = rewards + options.gamma * values[1:] - values[:-1]
    direct = np.zeros_like(rewards)
    for t in range(6):
        for later in range(t, 6):
            direct[t] += (options.gamma * options.gae_lambda) ** (later - t) * delta[later]
    found = advantages(torch.from_numpy(rewards), torch.from_numpy(values), options)
    np.testing.assert_allclose(found.numpy(), direct, atol=1e-12)


def test_losses_are_those_of_stable_baselines() -> None:
    """The formulas of Stable-Baselines3's PPO.train, on its own distribution over MultiDiscrete actions."""
    distributions = installed("stable_baselines3.common.distributions")
    options = PPOOptions()
    buffer = a_buffer(an_agent(), JOINT)
    has = buffer.mask[0]
    alike = (buffer.mask == has).all((1, 2))  # so that the oracle's action space has no masked axes
    rows = (alike & (buffer.own > 0)).nonzero()[:, 0]
    assert len(rows) > 2
    logits, value = an_agent(1)(buffer.view[rows])
    logits = JOINT.sharpness * logits
    every = buffer.advantage - buffer.advantage.mean()
    ours, advantage = ppo_losses(logits, value, buffer, every, rows, options), every[rows]
    theirs = distributions.MultiCategoricalDistribution([NUM_BINS] * int(has.sum()))
    theirs = theirs.proba_distribution(logits[:, has].flatten(1))
    log_prob, before = theirs.log_prob(buffer.action[rows][:, has]), buffer.log_prob[rows]
    ratio = torch.exp(log_prob - before)
    clipped = advantage * torch.clamp(ratio, 1 - options.clip, 1 + options.clip)
    wanted = {
        "policy": -torch.min(advantage * ratio, clipped).mean(),
        "value": torch.nn.functional.mse_loss(buffer.result[rows], value),
        "entropy": theirs.entropy().mean(),
        "divergence": torch.mean((torch.exp(log_prob - before) - 1) - (log_prob - before)),
    }
    for name, value_wanted in wanted.items():
        torch.testing.assert_close(ours[name], value_wanted, atol=1e-5, rtol=1e-5)


def test_a_policy_has_not_yet_diverged_from_itself() -> None:
    agent, options = an_agent(), PPOOptions()
    buffer = a_buffer(agent, JOINT)
    rows = torch.arange(len(buffer.log_prob))
    logits, value = agent(buffer.view)
    losses = ppo_losses(JOINT.sharpness * logits, value, buffer, buffer.advantage, rows, options)
    assert losses["divergence"].item() == pytest.approx(0.0, abs=1e-5)
    assert 0.2 < buffer.own.mean() < 0.8
    assert losses["policy"].item() == pytest.approx(-(buffer.own * buffer.advantage).mean().item(), abs=1e-5)


def test_actions_are_drawn_as_likely_as_the_policy_says() -> None:
    logits = torch.randn(1, 1, NUM_AXES, NUM_BINS)
    mask = torch.ones(1, 1, NUM_AXES, dtype=torch.bool)
    action = torch.randint(0, NUM_BINS, (1, 1, NUM_AXES))
    chance = logits.softmax(-1)[0, 0].gather(-1, action[0, 0][:, None]).prod()
    assert log_probability(logits, action, mask).exp().item() == pytest.approx(chance.item(), rel=1e-4)
    mask[..., 3:] = False
    part = logits.softmax(-1)[0, 0, :3].gather(-1, action[0, 0, :3, None]).prod()
    assert log_probability(logits, action, mask).exp().item() == pytest.approx(part.item(), rel=1e-4)


def test_cloning_weighs_rotation_translation_and_scale() -> None:
    """Equation 4 on an even policy: every axis costs log 11, whatever its weight; and by hand on one axis each."""
    options = PPOOptions()
    mask = torch.zeros(1, 3, NUM_AXES, dtype=torch.bool)
    mask[0, 0], mask[0, 1, 0], mask[0, 2, 0] = True, True, True
    kind = torch.tensor([[KINDS.index("free"), KINDS.index("revolute"), KINDS.index("prismatic")]])
    expert = torch.zeros(1, 3, NUM_AXES, dtype=torch.int64)
    even = torch.zeros(1, 3, NUM_AXES, NUM_BINS)
    assert cloning_loss(even, expert, mask, kind, options).item() == pytest.approx(np.log(NUM_BINS), rel=1e-5)
    total = 3 * 0.3 + 3 * 0.6 + 3 * 0.1 + 0.3 + 0.6
    cases: list[tuple[Any, float]] = [
        ((0, 0, 0), 0.3), ((0, 0, MOVE.start), 0.6), ((0, 0, SCALE.start), 0.1), ((0, 1, 0), 0.3), ((0, 2, 0), 0.6)
    ]  # fmt: skip
    for where, weight in cases:
        sure = even.clone()
        sure[where][0] = 50.0
        gained = np.log(NUM_BINS) * (1 - weight / total)
        assert cloning_loss(sure, expert, mask, kind, options).item() == pytest.approx(gained, rel=1e-4)


@pytest.mark.parametrize("phase", [CLONING, JOINT], ids=["cloning", "joint"])
def test_the_agent_learns_what_the_expert_does(phase: Phase) -> None:
    options = PPOOptions(epochs=25, minibatch=18)
    agent = an_agent()
    buffer = a_buffer(agent, phase)
    optimizer = torch.optim.Adam(agent.parameters(), 3e-3)
    seen = update(agent, optimizer, buffer, phase, options, torch.Generator().manual_seed(0))
    assert seen[-1]["cloning"] < 0.8 * seen[0]["cloning"]
    assert seen[-1]["accuracy"] > seen[0]["accuracy"] + 0.1


def test_scattered_states_are_all_along_the_way_of_every_start() -> None:
    """The expert of every object takes long steps in some, none in others, and in either direction."""
    problem = small_problem("laptop")
    fitting = Fitting(problem.shapes, problem.observed, problem.start, FittingOptions(steps=60, reference_points=8))
    moves = fitting.missing(problem.goal)[:, 0, MOVE.start]
    assert moves.min() < -0.09 < 0.09 < moves.max()
    buffer = scatter(fitting, problem.goal, torch.Generator().manual_seed(0))
    assert len(buffer.expert) == 60 * 2 * len(problem)
    steps = (buffer.expert[:, 0, MOVE.start] - NOTHING).unflatten(0, (-1, len(problem)))
    assert (steps.amax(0) >= 3).all()
    assert (steps.amin(0) <= -3).all()
    assert (steps == 0).any(0).all()


def test_rewarded_actions_become_likelier() -> None:
    options, agent = PPOOptions(), an_agent()
    buffer = a_buffer(agent, JOINT)
    rows = torch.arange(len(buffer.advantage))
    advantage = 2.0 * (rows % 2).float() - 1.0
    optimizer = torch.optim.Adam(agent.parameters(), 1e-3)
    for _ in range(10):
        logits, value = agent(buffer.view)
        loss = ppo_losses(JOINT.sharpness * logits, value, buffer, advantage, rows, options)["policy"]
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    logits, _ = agent(buffer.view)
    gain = log_probability(JOINT.sharpness * logits, buffer.action, buffer.mask) - buffer.log_prob
    assert gain[1::2].mean() > gain[0::2].mean()


def test_numbers_stand_for_actions_in_proportion() -> None:
    probability = torch.tensor([0.1, 0.0, 0.6, 0.3])
    chance = (torch.arange(1000) + 0.5) / 1000
    counts = torch.bincount(drawn(probability.expand(1000, 4), chance), minlength=4)
    assert counts.tolist() == [100, 0, 600, 300]
    assert drawn(probability, torch.tensor(1.0)) == 3


def test_the_policy_knows_parts_by_their_joints_not_by_their_rows() -> None:
    """Points in another order, and parts beyond the last, change nothing."""
    problem = small_problem("laptop", "eyeglasses")
    agent = an_agent()
    view = Fitting(problem.shapes, problem.observed, problem.start, FITTING).view()
    logits, value = agent(view)
    order = torch.randperm(view.observed.shape[1], generator=torch.Generator().manual_seed(0))
    shuffled = type(view)(**{
        **vars(view), "observed": view.observed[:, order], "part": view.part[:, order]
    })  # fmt: skip
    again, value_again = agent(shuffled)
    mask = action_mask(problem.shapes.trees)
    torch.testing.assert_close(logits[mask], again[mask], atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(value, value_again, atol=1e-5, rtol=1e-4)
    rows = torch.tensor([2, 0, 1])
    torch.testing.assert_close(agent(view[rows])[0], logits[rows], atol=1e-5, rtol=1e-4)


def test_algorithm_1_goes_on_as_if_it_had_not_been_stopped() -> None:
    problem = small_problem("laptop")

    def episodes(n: int) -> tuple[Fitting, Theta]:
        return Fitting(problem.shapes, problem.observed, problem.start, FITTING), problem.goal

    def run(policy: Policy, optimizer: torch.optim.Optimizer, first: int, last: int) -> list[dict[str, float]]:
        phases = (CLONING, CLONING, JOINT, JOINT)
        return list(algorithm_1(policy, optimizer, episodes, phases.__getitem__, PPOOptions(), 3, first, last))

    ends = []
    for parts in ([(0, 4)], [(0, 1), (1, 3), (3, 4)]):
        torch.manual_seed(0)
        policy = Policy(8)
        optimizer = torch.optim.Adam(policy.parameters(), 1e-3)
        figures = [figure for first, last in parts for figure in run(policy, optimizer, first, last)]
        assert len(figures) == 4
        ends.append(torch.cat([tensor.flatten() for tensor in policy.state_dict().values()]))
    assert torch.equal(*ends)
