"""Losses of perception against the truth, and figures for people."""

import torch
from torch import Tensor, nn
from torch.nn import functional

from artperl.core.clouds import Clouds
from artperl.data.truth import Truth
from artperl.perception.network import Perceived, Votes

_SHARP = 0.05
"""Huber loss turns linear at this distance, in diagonals."""


_THIN = 0.1
"""Diagonals that are added to a box's side before an error is taken over it."""


_JOINT_SHARP = 0.2
"""Huber loss of joints turns linear there."""


def perception_loss(
    network: nn.Module, clouds: Clouds, truth: Truth, whole: Truth
) -> tuple[Tensor, dict[str, float]]:  # fmt: skip
    """Sum of :func:`perception_losses`, and figures for people: a :data:`artperl.training.supervised.Loss`."""
    perceived, share = network(clouds.points), len(truth) / len(whole)
    with torch.autocast(truth.part.device.type, enabled=False):
        losses = {name: loss / share for name, loss in perception_losses(perceived, truth, whole).items()}
        figures = {name: loss.item() for name, loss in losses.items()} | perception_figures(perceived, truth)
        return torch.stack(list(losses.values())).sum(), figures


def perception_losses(perceived: Perceived | Votes, truth: Truth, whole: Truth | None = None) -> dict[str, Tensor]:
    """Losses by name; their sum is minimised.

    Coordinates are scored by the likelihood of a Laplace distribution of the spread that the network itself expects, so
    that points whose place cannot be told (a lid seen edge-on) do not drown the others. Points that are not of the
    object have no place and no part: only that they are not counts.

    Parameters
    ----------
    perceived : Perceived or Votes
    truth : Truth
    whole : Truth, optional
        Of the batch that these clouds are some of: then the losses are their part of the batch's, and those of all
        parts add up to it.
    """
    losses = _losses(perceived, truth)
    if whole is None:
        return losses
    share = {
        "rows": len(truth) / len(whole),
        "own": float(truth.own.sum() / whole.own.sum()),
        "parts": float(truth.part_valid.sum() / whole.part_valid.sum()),
    }
    means = _MEANS | ({"boxes": "rows"} if isinstance(perceived, Votes) else {})
    return {name: loss * share[means.get(name, "rows")] for name, loss in losses.items()}


_MEANS = {"canonical": "own", "spread": "own", "part": "own", "boxes": "parts"}
"""What losses are means over, those that are not over clouds."""


def _losses(perceived: Perceived | Votes, truth: Truth) -> dict[str, Tensor]:
    distance = (
        functional.huber_loss(perceived.canonical, truth.canonical, reduction="none", delta=_SHARP).sum(-1) / _SHARP
    )
    spread, own = perceived.spread.clamp(-6.0, 2.0), truth.own.float() / truth.own.sum()
    losses = {
        "canonical": 5.0 * (distance * own).sum(),
        "spread": 0.2 * ((distance.detach() * (-spread).exp() + spread) * own).sum(),
        "own": functional.binary_cross_entropy_with_logits(perceived.own_logits, truth.own.float()),
        "diagonal": 2.0 * (perceived.log_diagonal - truth.diagonal.log()).abs().mean(),
    }
    of_parts = _vote_losses(perceived, truth) if isinstance(perceived, Votes) else _number_losses(perceived, truth)
    return losses | of_parts


def _number_losses(perceived: Perceived, truth: Truth) -> dict[str, Tensor]:
    weight = truth.part_valid.float()
    boxes = torch.cat([perceived.box_center - truth.box_center, perceived.box_size - truth.box_size], dim=-1)
    return {
        "part": functional.cross_entropy(perceived.part_logits[truth.own], truth.part[truth.own]),
        "valid": 0.2 * functional.binary_cross_entropy_with_logits(perceived.valid_logits, weight),
        "boxes": 2.0 * (boxes.abs().sum(-1) * weight).sum() / weight.sum(),
    }


def _vote_losses(votes: Votes, truth: Truth) -> dict[str, Tensor]:
    """A part counts by the root of how many points it has; errors of boxes are taken over their sides."""
    own = truth.own[..., None]
    count = (functional.one_hot(truth.part, truth.part_valid.shape[1]) * own).sum(1).clamp(min=1)
    weight = truth.of_points(count).float().rsqrt() * truth.own
    weight = weight / weight.sum(1, keepdim=True) / len(weight)
    size = truth.of_points(truth.box_size)
    box = torch.cat([truth.of_points(truth.box_center), size], dim=-1)
    off = (votes.box - box) / (size + _THIN).repeat(1, 1, 2)
    apart = functional.huber_loss(off, torch.zeros_like(off), reduction="none", delta=_SHARP).sum(-1) / _SHARP
    joint = functional.huber_loss(votes.joint, truth.of_points(truth.joint), reduction="none", delta=_JOINT_SHARP)
    level = functional.cross_entropy(
        votes.level_logits.flatten(0, 1), truth.of_points(truth.level).flatten(), reduction="none"
    )
    return {
        "boxes": (apart * weight).sum(),
        "joints": 0.5 * (joint.sum(-1) * weight).sum() / _JOINT_SHARP,
        "level": 0.5 * (level.view_as(weight) * weight).sum(),
    }


def perception_figures(perceived: Perceived | Votes, truth: Truth) -> dict[str, float]:
    """How well it does, for people: share of points with the right part (level, of votes), and error of coordinates."""
    if isinstance(perceived, Votes):
        right = perceived.level_logits.argmax(-1) == truth.of_points(truth.level)
    else:
        right = perceived.part == truth.part
    off = (perceived.canonical - truth.canonical).norm(dim=-1)[truth.own].median()
    own = (perceived.own_logits > 0.0) == truth.own
    return {
        "accuracy": right[truth.own].float().mean().item(), "coordinates": off.item(), "own": own.float().mean().item(),
    }  # fmt: skip
