"""Behaviour cloning and PPO, together (ArtPERL, Algorithm 1).

The algorithm is one loop: fit a batch of objects for an episode with the current policy; ask the expert, at every state
visited, what it would have done (equation 4); add generalised advantages of the rewards (equation 3); and update the
agent on the whole buffer by both losses (equation 5).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.distributions import Categorical

from artperl.agent.actions import MOVE, SCALE, TURN, action_mask
from artperl.agent.decision_process import Fitting, View
from artperl.agent.policy import Agent
from artperl.core.batch import concatenate
from artperl.core.pose import KINDS, Theta

_PRISMATIC = KINDS.index("prismatic")


@dataclass(frozen=True)
class PPOOptions:
    """Algorithm 1."""

    behaviour_cloning: bool = True
    """Learn from the expert (equation 4)."""
    reinforcement: bool = True
    """Learn from rewards (equation 5)."""
    lambda_rotation: float = 0.3
    lambda_translation: float = 0.6
    lambda_scale: float = 0.1
    """Weights of the expert's rotation, translation and scale actions (equation 4). Joint states count as what they
    are: turns as rotation, slides and anchors as translation."""
    lambda_value: float = 0.3
    lambda_entropy: float = 0.001
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip: float = 0.2
    epochs: int = 1
    """Passes over the buffer."""
    minibatch: int = 64
    """States of an update: few, since the states of an episode are much alike, and updates are what learning needs."""
    max_gradient: float = 0.5
    sharpness: float = 3.0
    """While it learns from rewards, the policy that acts has that many times the logits of the one that is cloned.
    Cloning leaves each axis as unsure as the expert's next step is; one axis of many would then take a long step astray
    at every turn, to states of which the agent knows less and less. Cloning alone wants such states: the expert says
    what to do there."""
    guided: float = 0.3
    """Share of the steps that the expert takes while the agent learns by cloning alone: left to itself, an agent that
    knows nothing yet strays so far that what it learns there is of no use."""


@dataclass(frozen=True, eq=False)
class Rollout:
    """Replay buffer of one batch of episodes. T steps of B environments, flat: S = T * B rows."""

    view: View
    mask: Tensor
    action: Tensor
    expert: Tensor
    log_prob: Tensor
    advantage: Tensor
    result: Tensor
    figures: dict[str, float]


@torch.no_grad()
def collect(agent: Agent, fitting: Fitting, goal: Theta, options: PPOOptions, generator: torch.Generator) -> Rollout:
    """Run an episode of every environment with the stochastic policy, noting what the expert would have done."""
    views, actions, experts, log_probs, values, rewards = [], [], [], [], [], []
    mask = action_mask(fitting.shapes.trees)
    first = fitting.distance
    while not fitting.done:
        view = fitting.view()
        logits, value = agent(view)
        flat = acting(logits, options).softmax(-1).flatten(0, 2)
        action = torch.multinomial(flat, 1, generator=generator).view(mask.shape)
        expert = fitting.expert(goal)
        if not options.reinforcement:
            guided = torch.rand(len(action), generator=generator, device=action.device) < options.guided
            action = torch.where(guided[:, None, None], expert, action)
        views.append(view)
        actions.append(action)
        experts.append(expert)
        log_probs.append(log_probability(acting(logits, options), action, mask))
        values.append(value)
        rewards.append(fitting.step(action))
    values.append(agent(fitting.view())[1])
    advantage = advantages(torch.stack(rewards), torch.stack(values), options)
    figures = {
        "reward": torch.stack(rewards).mean().item(),
        "chamfer_start": first.mean().item(),
        "chamfer_end": fitting.distance.mean().item(),
    }
    return Rollout(
        concatenate(views), mask.repeat(len(views), 1, 1), torch.cat(actions), torch.cat(experts),
        torch.cat(log_probs), advantage.flatten(), (advantage + torch.stack(values[:-1])).flatten(), figures,
    )  # fmt: skip


def advantages(rewards: Tensor, values: Tensor, options: PPOOptions) -> Tensor:
    """(T, B) generalised advantage estimates from rewards (T, B) and values (T + 1, B) (Schulman et al. 2016)."""
    result, running = torch.zeros_like(rewards), torch.zeros_like(rewards[0])
    for t in range(len(rewards) - 1, -1, -1):
        delta = rewards[t] + options.gamma * values[t + 1] - values[t]
        running = delta + options.gamma * options.gae_lambda * running
        result[t] = running
    return result


def acting(logits: Tensor, options: PPOOptions) -> Tensor:
    """Logits of the policy that acts, from the agent's."""
    return options.sharpness * logits if options.reinforcement else logits


def log_probability(logits: Tensor, action: Tensor, mask: Tensor) -> Tensor:
    """(B,) logarithm of the probability of an action: the axes are independent given the state."""
    chosen = logits.log_softmax(-1).gather(-1, action[..., None])[..., 0]
    return (chosen * mask).sum((1, 2))


def update(
    agent: Agent,
    optimizer: torch.optim.Optimizer,
    rollout: Rollout,
    options: PPOOptions,
    generator: torch.Generator,
    on_update: Callable[[dict[str, float]], None] = lambda figures: None,
) -> None:
    """Several passes of minibatch updates over a rollout."""
    total = len(rollout.log_prob)
    advantage = (rollout.advantage - rollout.advantage.mean()) / (rollout.advantage.std() + 1e-8)
    for _ in range(options.epochs):
        for rows in torch.randperm(total, generator=generator, device=generator.device).split(options.minibatch):
            logits, value = agent(rollout.view[rows])
            mask = rollout.mask[rows]
            losses = ppo_losses(acting(logits, options), value, rollout, advantage, rows, options)
            cloning = cloning_loss(logits, rollout.expert[rows], mask, rollout.view.kind[rows], options)
            loss = value.new_zeros(())
            if options.reinforcement:
                loss = loss + losses["policy"] + options.lambda_value * losses["value"]
                loss = loss - options.lambda_entropy * losses["entropy"]
            if options.behaviour_cloning:
                loss = loss + cloning
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(agent.parameters(), options.max_gradient)
            optimizer.step()
            right = ((logits.argmax(-1) == rollout.expert[rows]) & mask).sum() / mask.sum()
            on_update({k: v.item() for k, v in {**losses, "cloning": cloning, "accuracy": right}.items()})


def ppo_losses(
    logits: Tensor, value: Tensor, rollout: Rollout, advantage: Tensor, rows: Tensor, options: PPOOptions
) -> dict[str, Tensor]:
    """Clipped surrogate, squared value error, entropy, and the approximate divergence from the rollout's policy."""
    mask = rollout.mask[rows]
    log_ratio = log_probability(logits, rollout.action[rows], mask) - rollout.log_prob[rows]
    ratio, gain = log_ratio.exp(), advantage[rows]
    clipped = ratio.clamp(1.0 - options.clip, 1.0 + options.clip)
    return {
        "policy": -torch.minimum(ratio * gain, clipped * gain).mean(),
        "value": torch.nn.functional.mse_loss(value, rollout.result[rows]),
        "entropy": (Categorical(logits=logits).entropy() * mask).sum((1, 2)).mean(),
        "divergence": ((ratio - 1.0) - log_ratio).mean(),
    }


def cloning_loss(logits: Tensor, expert: Tensor, mask: Tensor, kind: Tensor, options: PPOOptions) -> Tensor:
    """Weighted cross-entropy towards the expert's actions (equation 4), mean over the axes that there are."""
    wrong = torch.nn.functional.cross_entropy(logits.flatten(0, 2), expert.flatten(), reduction="none").view(mask.shape)
    weight = torch.full_like(wrong, options.lambda_rotation)
    weight[..., MOVE] = options.lambda_translation
    weight[:, 0, SCALE] = options.lambda_scale
    slides = kind == _PRISMATIC
    weight[..., TURN.start] = torch.where(slides, options.lambda_translation, weight[..., TURN.start])
    weight = weight * mask
    return (wrong * weight).sum() / weight.sum()
