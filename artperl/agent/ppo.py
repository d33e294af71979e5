"""Composited reinforcement learning and behaviour cloning: Algorithm 1 of ArtPERL.

:func:`algorithm_1` is the loop; :func:`scatter` or :func:`rollout` fills the replay buffer, :func:`update` learns from
it. A :class:`Phase` says what the agent learns by, and how it acts meanwhile.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from math import inf

import torch
from torch import Tensor
from torch.distributions import Categorical

from artperl.agent.actions import BINS, MOVE, SCALE, TURN, compressed, nearest_bin
from artperl.agent.decision_process import Fitting, View
from artperl.agent.policy import Policy
from artperl.core.batch import Batch, concatenate
from artperl.core.distributed import ALONE, Ranks
from artperl.core.mixed_precision import autocast
from artperl.core.pose import Theta
from artperl.core.trees import KINDS
from artsim.errors import ConfigError

_PRISMATIC = KINDS.index("prismatic")


@dataclass(frozen=True)
class PPOOptions:
    """Constants of equations 4 and 5."""

    lambda_rotation: float = 0.3
    lambda_translation: float = 0.6
    lambda_scale: float = 0.1
    """Weights of the expert's rotation, translation and scale actions (equation 4). Joint states count as what they
    are: turns as rotation, slides and anchors as translation."""
    lambda_policy: float = 0.1
    """Weight of the clipped surrogate. Its gradient is a sum over the axes of an action, equation 4 a mean of them: as
    loud as that, its noise drowns the expert."""
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

    def __post_init__(self) -> None:
        for field in fields(self):
            value, least = getattr(self, field.name), 1 if field.name in ("epochs", "minibatch") else 0
            if not least <= value < inf:
                raise ConfigError(f"{value} is not possible", f"ppo.{field.name}", f"use {least} or more")


@dataclass(frozen=True)
class Phase:
    """What the agent learns by."""

    cloning: bool
    """Learn from the expert (equation 4)."""
    reinforcement: bool
    """Learn from rewards (equation 5)."""
    scattered: bool = False
    """States are drawn at random between start and goal, not reached by actions: there are no rewards to learn from."""


CLONING = Phase(cloning=True, reinforcement=False, scattered=True)
"""Behaviour cloning on random states as in section 4.3. States of a trajectory are much alike, and most are near its
end: by as many states that are drawn apart, a quarter less error is left."""
OWN_STATES = Phase(cloning=True, reinforcement=False)
"""Behaviour cloning on states that the agent comes to by itself; the value is learnt beside it."""
JOINT = Phase(cloning=True, reinforcement=True)
"""Both losses, on the agent's own actions."""
REINFORCEMENT = Phase(cloning=False, reinforcement=True)
"""PPO alone."""


@dataclass(frozen=True, eq=False)
class Buffer(Batch):
    """Replay buffer of one batch of episodes. T steps of B environments, flat: S = T * B rows, step by step.

    ``expert`` (S, P, 9) is the steps that would lead to the goal at once. Scattered states have no actions: their
    ``action``, ``log_prob``, ``advantage`` and ``result`` mean nothing.
    """

    view: View
    mask: Tensor
    action: Tensor
    expert: Tensor
    log_prob: Tensor
    advantage: Tensor
    result: Tensor


def algorithm_1(
    policy: Policy,
    optimizer: torch.optim.Optimizer,
    episodes: Callable[[int], tuple[Fitting, Theta]],
    phases: Callable[[int], Phase],
    options: PPOOptions,
    seed: int,
    first: int,
    last: int,
    ranks: Ranks = ALONE,
    mixed_precision: bool = False,
) -> Iterator[dict[str, float]]:
    """Algorithm 1, one round after the other; it goes on when the next figures are asked for.

    Parameters
    ----------
    policy : Policy
    optimizer : torch.optim.Optimizer
    episodes : function
        Of the number of a round: environments at their start, and the goal that the expert steers to; of several
        processes, this one's share of them.
    phases : function
        Of the number of a round.
    options : PPOOptions
    seed : int
        Of the actions; they depend on the number of the round beside it.
    first, last : int
        Rounds to run, the last left out.
    ranks : Ranks
        The processes that learn together: each rolls out its share of the episodes, and learns from its share of the
        rows of an update.
    mixed_precision : bool
        Phases of cloning alone multiply in bfloat16, where the processor can. Ratios of equation 5 need more bits.

    Yields
    ------
    dict
        Means: the loss of cloning and the share of actions that are the expert's; of rollouts the reward, and chamfer
        distances at the start and at the end of the episodes; where rewards teach, the losses of equation 5.
    """
    device = next(policy.parameters()).device
    for n in range(first, last):
        generator = torch.Generator(device).manual_seed((seed << 32) + n)
        phase = phases(n)
        fitting, goal = episodes(n)
        if phase.scattered:
            own, figures = scatter(fitting, goal, generator, ranks), dict[str, float]()
        else:
            own, figures = rollout(policy, fitting, goal, options, generator, ranks)
        buffer, told = together(own, figures, len(goal), ranks)
        losses = update(policy, optimizer, buffer, phase, options, generator, ranks, mixed_precision)
        yield {name: sum(one[name] for one in losses) / len(losses) for name in losses[0]} | told


@torch.no_grad()
def rollout(
    policy: Policy, fitting: Fitting, goal: Theta, options: PPOOptions, generator: torch.Generator,
    ranks: Ranks = ALONE,
) -> tuple[Buffer, dict[str, float]]:  # fmt: skip
    """Run an episode of every environment with the policy, noting what the expert would have done.

    Of several processes, each has its share of the environments; chance is drawn for all of them by all.

    Returns
    -------
    Buffer, dict
        And means: the reward, and chamfer distances at the start and at the end.
    """
    total, own = _share(len(goal), ranks)
    views, masks, actions, experts, log_probs, values, rewards = [], [], [], [], [], [], []
    first = fitting.distance
    while not fitting.done:
        view, mask = fitting.view(), fitting.mask
        logits, value = policy(view)
        chance = torch.rand((total, *mask.shape[1:]), generator=generator, device=logits.device)[own]
        action = drawn(logits.softmax(-1), chance)
        views.append(view)
        masks.append(mask)
        actions.append(action)
        experts.append(fitting.missing(goal))
        log_probs.append(log_probability(logits, action, mask))
        values.append(value)
        rewards.append(fitting.step(action))
    values.append(torch.zeros_like(values[0]))  # an episode ends with its last step, and the agent knows which that is
    advantage = advantages(torch.stack(rewards), torch.stack(values), options)
    figures = {
        "reward": torch.stack(rewards).mean().item(),
        "chamfer_start": first.mean().item(),
        "chamfer_end": fitting.distance.mean().item(),
    }
    return Buffer(
        concatenate(views), torch.cat(masks), torch.cat(actions), torch.cat(experts), torch.cat(log_probs),
        advantage.flatten(), (advantage + torch.stack(values[:-1])).flatten(),
    ), figures  # fmt: skip


@torch.no_grad()
def scatter(fitting: Fitting, goal: Theta, generator: torch.Generator, ranks: Ranks = ALONE) -> Buffer:
    """As many states as an episode has, anywhere on the way to the goal, and what the expert would do.

    Each state is off as the start of one of the episodes is, by shares of it that are as often large as small: one for
    the turn, the move and the scale of the root, and those of each joint. If they had one in common, what is easily
    seen would tell the others. There are no actions and no rewards: only equation 4 learns from them.
    """
    total, own = _share(len(goal), ranks)
    device = fitting.distance.device
    starts = torch.cat(ranks.every(fitting.missing(goal).cpu())).to(device)
    views, masks, experts = [], [], []
    while not fitting.done:
        other = torch.randint(total, (total,), generator=generator, device=device)
        share = torch.rand((*starts.shape[:2], 3), generator=generator, device=device)
        left = share.repeat_interleave(3, dim=2) * starts[other]
        fitting.place(goal, left[own])
        masks.append(fitting.mask)
        views.append(fitting.view())
        experts.append(fitting.missing(goal))
    none = torch.zeros(sum(map(len, masks)), device=device)
    expert = torch.cat(experts)
    return Buffer(concatenate(views), torch.cat(masks), nearest_bin(expert), expert, none, none, none)


def _share(episodes: int, ranks: Ranks) -> tuple[int, slice]:
    """Episodes of all processes, and which of them are this one's."""
    counts = ranks.every(episodes)
    before = sum(counts[: ranks.rank])
    return sum(counts), slice(before, before + episodes)


def drawn(probability: Tensor, chance: Tensor) -> Tensor:
    """Of probabilities (..., A), the index that numbers (...) from 0 to 1 stand for: the first whose sum is beyond."""
    reached = probability.cumsum(-1) <= chance[..., None] * probability.sum(-1, keepdim=True)
    return reached.sum(-1).clamp(max=probability.shape[-1] - 1)


def together(own: Buffer, figures: dict[str, float], episodes: int, ranks: Ranks) -> tuple[Buffer, dict[str, float]]:
    """The buffer of all processes with its rows as one process has them, and the means of their figures.

    Parameters
    ----------
    own : Buffer
    figures : dict
        Means over this process' episodes, so many of them.
    episodes : int
    ranks : Ranks
    """
    if ranks.count == 1:
        return own, figures
    device = own.action.device
    buffers, counts, means = zip(*ranks.every((own.to("cpu"), episodes, figures)), strict=True)
    total, before, place = sum(counts), 0, []
    for buffer, count in zip(buffers, counts, strict=True):
        row = torch.arange(len(buffer))
        place.append(row // count * total + before + row % count)  # its step and its episode among those of all
        before += count
    every: Buffer = concatenate(list(buffers))[torch.cat(place).argsort()]
    told = {
        name: sum(count * mean[name] for count, mean in zip(counts, means, strict=True)) / total for name in figures
    }
    return every.to(device), told


def update(
    policy: Policy,
    optimizer: torch.optim.Optimizer,
    buffer: Buffer,
    phase: Phase,
    options: PPOOptions,
    generator: torch.Generator,
    ranks: Ranks = ALONE,
    mixed_precision: bool = False,
) -> list[dict[str, float]]:
    """Several passes of minibatch updates over a buffer; figures of each update.

    Of several processes, each has the same buffer and learns from its share of each minibatch: losses are parts of
    means over all of it.
    """
    figures, total = [], len(buffer.log_prob)
    advantage = (buffer.advantage - buffer.advantage.mean()) / (buffer.advantage.std() + 1e-8)
    for _ in range(options.epochs):
        for batch in torch.randperm(total, generator=generator, device=generator.device).split(options.minibatch):
            own = batch[ranks.rows(len(batch))]
            share = len(own) / len(batch)
            rows = own if share else batch[:1]  # of fewer rows than processes some have none: theirs count for nothing
            with autocast(buffer.mask.device, mixed_precision and not phase.reinforcement):
                logits, value = policy(buffer.view[rows])
            mask = buffer.mask[rows]
            weight = cloning_weight(buffer.mask[batch], buffer.view.kind[batch], options).sum()
            cloning = bool(share) * cloning_loss(
                logits, buffer.expert[rows], mask, buffer.view.kind[rows], options, weight
            )
            loss, losses = phase.cloning * cloning, dict[str, Tensor]()
            if not phase.scattered:
                losses = ppo_losses(logits, value, buffer, advantage, rows, options)
                losses = {name: share * own_loss for name, own_loss in losses.items()}
                loss = loss + options.lambda_value * losses["value"]
            if phase.reinforcement:
                loss = loss + options.lambda_policy * losses["policy"] - options.lambda_entropy * losses["entropy"]
            optimizer.zero_grad()
            loss.backward()
            ranks.add_gradients(policy)
            torch.nn.utils.clip_grad_norm_(policy.parameters(), options.max_gradient)
            optimizer.step()
            right = share * ((logits.argmax(-1) == nearest_bin(buffer.expert[rows])) & mask).sum() / mask.sum()
            told = {**losses, "cloning": cloning, "accuracy": right}
            figures.append(dict(zip(told, ranks.add([value.item() for value in told.values()]), strict=True)))
    return figures


def advantages(rewards: Tensor, values: Tensor, options: PPOOptions) -> Tensor:
    """(T, B) generalised advantage estimates from rewards (T, B) and values (T + 1, B) (Schulman et al. 2016)."""
    result, running = torch.zeros_like(rewards), torch.zeros_like(rewards[0])
    for t in range(len(rewards) - 1, -1, -1):
        delta = rewards[t] + options.gamma * values[t + 1] - values[t]
        running = delta + options.gamma * options.gae_lambda * running
        result[t] = running
    return result


def log_probability(logits: Tensor, action: Tensor, mask: Tensor) -> Tensor:
    """(B,) logarithm of the probability of an action: the axes are independent given the state."""
    chosen = logits.log_softmax(-1).gather(-1, action[..., None])[..., 0]
    return (chosen * mask).sum((1, 2))


def ppo_losses(
    logits: Tensor, value: Tensor, buffer: Buffer, advantage: Tensor, rows: Tensor, options: PPOOptions
) -> dict[str, Tensor]:
    """Clipped surrogate, squared value error, entropy, and the approximate divergence from the buffer's policy."""
    mask = buffer.mask[rows]
    log_ratio = log_probability(logits, buffer.action[rows], mask) - buffer.log_prob[rows]
    ratio, gain = log_ratio.exp(), advantage[rows]
    clipped = ratio.clamp(1.0 - options.clip, 1.0 + options.clip)
    return {
        "policy": -torch.minimum(ratio * gain, clipped * gain).mean(),
        "value": torch.nn.functional.mse_loss(value, buffer.result[rows]),
        "entropy": (Categorical(logits=logits).entropy() * mask).sum((1, 2)).mean(),
        "divergence": ((ratio - 1.0) - log_ratio).mean(),
    }


def cloning_loss(
    logits: Tensor, expert: Tensor, mask: Tensor, kind: Tensor, options: PPOOptions, total: Tensor | None = None
) -> Tensor:
    """Weighted cross-entropy towards the expert's actions (equation 4), mean over the axes that there are.

    An expert's step between two bins (S, P, 9) counts for both, for the nearer one more: the mean of the policy is
    drawn to the step itself. ``total``: the sum of the weights of which this is a part of the mean; by default that of
    these rows.
    """
    place, bins = compressed(expert), BINS.to(expert)
    below = (torch.bucketize(place, bins) - 1).clamp(0, len(bins) - 2)
    upper = ((place - bins[below]) / (bins[below + 1] - bins[below])).clamp(0.0, 1.0)
    gathered = logits.log_softmax(-1).gather(-1, torch.stack([below, below + 1], dim=-1))
    wrong = -(gathered[..., 0] * (1.0 - upper) + gathered[..., 1] * upper)
    weight = cloning_weight(mask, kind, options)
    return (wrong * weight).sum() / (weight.sum() if total is None else total)


def cloning_weight(mask: Tensor, kind: Tensor, options: PPOOptions) -> Tensor:
    """Weights of the axes of actions in equation 4, 0 of those that there are not."""
    weight = torch.full(mask.shape, options.lambda_rotation, device=mask.device)
    weight[..., MOVE] = options.lambda_translation
    weight[:, 0, SCALE] = options.lambda_scale
    slides = kind == _PRISMATIC
    weight[..., TURN.start] = torch.where(slides, options.lambda_translation, weight[..., TURN.start])
    return weight * mask
