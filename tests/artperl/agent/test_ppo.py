"""Algorithm 1's losses are those of the literature, and learning works."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from artperl.agent.actions import BINS, MOVE, NOTHING, NUM_AXES, NUM_BINS, SCALE, STEPS, action_mask, nearest_bin
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.agent.policy import Policy, logits_about
from artperl.agent.ppo import (
    CLONING,
    JOINT,
    OWN_STATES,
    REINFORCEMENT,
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
    return rollout(agent, fitting, problem.goal, PPOOptions(), torch.Generator().manual_seed(seed))[0]


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
    rows = alike.nonzero()[:, 0]
    assert len(rows) > 2
    logits, value = an_agent(1)(buffer.view[rows])
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
    losses = ppo_losses(*agent(buffer.view), buffer, buffer.advantage, torch.arange(len(buffer)), options)
    assert losses["divergence"].item() == pytest.approx(0.0, abs=1e-5)
    assert losses["policy"].item() == pytest.approx(-buffer.advantage.mean().item(), abs=1e-5)


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
    expert = torch.full((1, 3, NUM_AXES), float(STEPS[0]))
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


def one_axis(logits: torch.Tensor, step: torch.Tensor) -> torch.Tensor:
    """Loss of cloning steps (S,) by logits (S, 11), the sum."""
    kind, mask = torch.zeros(len(step), 1, dtype=torch.int64), torch.ones(len(step), 1, 1, dtype=torch.bool)
    rows = [cloning_loss(logits[i : i + 1, None, None], step[i : i + 1, None, None], mask[i : i + 1], kind[i : i + 1],
                         PPOOptions()) for i in range(len(step))]  # fmt: skip
    return torch.stack(rows).sum()


def test_cloning_draws_the_mean_of_the_policy_to_the_experts_step() -> None:
    """Its slope is 0 where the mean step of the policy is the expert's, and leads there from either side."""
    mean = torch.linspace(-2.5, 2.5, 41, dtype=torch.float64)
    expected = (logits_about(mean).softmax(-1) * BINS.double()).sum(-1)
    for off in (-0.2, 0.0, 0.2):
        own = mean.clone().requires_grad_()
        one_axis(logits_about(own), 0.03 * (expected + off).sinh()).backward()
        assert own.grad is not None
        if off:
            assert (own.grad * off < 0).all()
        else:
            torch.testing.assert_close(own.grad, torch.zeros_like(mean), atol=1e-6, rtol=0)


def test_cloning_the_step_of_a_bin_is_the_cross_entropy() -> None:
    logits = torch.randn(NUM_BINS, NUM_BINS, generator=torch.Generator().manual_seed(0))
    wanted = torch.nn.functional.cross_entropy(logits, torch.arange(NUM_BINS), reduction="sum")
    torch.testing.assert_close(one_axis(logits, STEPS), wanted, atol=1e-4, rtol=1e-5)


def test_the_likeliest_bin_is_the_one_nearest_to_the_mean() -> None:
    mean = torch.linspace(-4.0, 4.0, 1001)
    nearest = (mean[:, None] - BINS).abs().argmin(-1)
    assert torch.equal(logits_about(mean).argmax(-1), nearest)
    assert nearest.unique().tolist() == list(range(NUM_BINS))
    assert torch.equal(nearest_bin(0.03 * mean.sinh()), nearest)


@pytest.mark.parametrize("phase", [CLONING, OWN_STATES, JOINT], ids=["cloning", "own states", "joint"])
def test_the_agent_learns_what_the_expert_does(phase: Phase) -> None:
    options = PPOOptions(epochs=30, minibatch=18)
    agent = an_agent()
    buffer = a_buffer(agent, phase)
    optimizer, first = torch.optim.Adam(agent.parameters(), 3e-3), value_error(agent, buffer)
    seen = update(agent, optimizer, buffer, phase, options, torch.Generator().manual_seed(0))
    assert seen[-1]["cloning"] < 0.8 * seen[0]["cloning"]
    assert seen[-1]["accuracy"] > seen[0]["accuracy"] + 0.1
    if not phase.scattered:
        assert value_error(agent, buffer) < 0.6 * first


def value_error(agent: Policy, buffer: Buffer) -> float:
    """Mean square over a buffer."""
    with torch.no_grad():
        return float((agent(buffer.view)[1] - buffer.result).square().mean())


def test_values_are_learnt_beside_the_policy() -> None:
    """The error of the value changes nothing that actions come from; by it alone the value is learnt."""
    agent = an_agent()
    buffer = a_buffer(agent, OWN_STATES)
    _, value = agent(buffer.view)
    torch.nn.functional.mse_loss(value, buffer.result).backward()
    learnt = {name for name, parameter in agent.named_parameters() if parameter.grad is not None}
    assert learnt == {name for name, _ in agent.named_parameters() if name.startswith("value.")}


@pytest.mark.parametrize("phase", [CLONING, JOINT])
def test_the_agent_sees_whose_turn_it_is_whatever_it_learns_by(phase: Phase) -> None:
    buffer = a_buffer(an_agent(), phase, kinds=("laptop", "eyeglasses"))
    assert torch.equal(buffer.mask.any(-1), buffer.view.turn & buffer.view.valid)
    assert len(buffer.view.left.unique()) > 2


def test_scattered_states_are_all_along_the_way_of_every_start() -> None:
    """The expert of every object takes long steps in some, short ones in others, in either direction."""
    problem = small_problem("laptop")
    fitting = Fitting(problem.shapes, problem.observed, problem.start, FittingOptions(steps=60, reference_points=8))
    moves = fitting.missing(problem.goal)[:, 0, MOVE.start]
    assert moves.min() < -0.09 < 0.09 < moves.max()
    buffer = scatter(fitting, problem.goal, torch.Generator().manual_seed(0))
    assert len(buffer.expert) == 60 * 2 * len(problem)
    steps = (nearest_bin(buffer.expert[:, 0, MOVE.start]) - NOTHING).unflatten(0, (-1, len(problem)))
    assert (steps.amax(0) >= 3).all()
    assert (steps.amin(0) <= -3).all()
    assert (steps.abs() <= 2).any(0).all()


def test_rewarded_actions_become_likelier() -> None:
    options, agent = PPOOptions(), an_agent()
    buffer = a_buffer(agent, JOINT)
    rows = torch.arange(len(buffer.advantage))
    advantage = 2.0 * (rows % 2).float() - 1.0
    optimizer = torch.optim.Adam(agent.parameters(), 1e-3)
    for _ in range(10):
        loss = ppo_losses(*agent(buffer.view), buffer, advantage, rows, options)["policy"]
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    logits, _ = agent(buffer.view)
    gain = log_probability(logits, buffer.action, buffer.mask) - buffer.log_prob
    assert gain[1::2].mean() > gain[0::2].mean()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_rewards_alone_teach_a_new_agent(seed: int) -> None:
    """PPO on six objects: steps bring the clouds closer, drawn by other numbers, and the likeliest ones, too."""
    problem, agent, options = small_problem("laptop"), an_agent(seed), PPOOptions(epochs=2, minibatch=32)

    def episodes(n: int) -> tuple[Fitting, Theta]:
        every = problem.repeat(8)
        return Fitting(every.shapes, every.observed, every.start, FITTING), every.goal

    def rewards() -> torch.Tensor:
        """Means of five rollouts."""
        chance = torch.Generator().manual_seed(1000 + seed)
        seen = [rollout(agent, *episodes(0), PPOOptions(), chance)[1]["reward"] for _ in range(5)]
        return torch.tensor(seen)

    def reward_of_likeliest() -> float:
        fitting = episodes(0)[0]
        with torch.no_grad():
            return float(np.mean([fitting.step(agent(fitting.view())[0].argmax(-1)).mean() for _ in range(6)]))

    before, first = rewards(), reward_of_likeliest()
    optimizer = torch.optim.Adam(agent.parameters(), 3e-3)
    for _ in algorithm_1(agent, optimizer, episodes, lambda n: REINFORCEMENT, options, seed, 0, 8):
        pass
    after, last = rewards(), reward_of_likeliest()
    error = float((before.var() / 5 + after.var() / 5).sqrt())
    assert after.mean() - before.mean() > max(0.2, 5.0 * error)
    assert last > first + 0.2


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
    of_points = ("observed", "part", "gap", "gap_normal")
    shuffled = replace(view, **{name: getattr(view, name)[:, order] for name in of_points})
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
        phases = (CLONING, OWN_STATES, JOINT, REINFORCEMENT)
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
