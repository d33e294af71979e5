"""Stages that A-NCSH learns in: coordinates of points, then votes for joints (Li et al. 2020, section 4.4)."""

from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from artperl.core.clouds import Clouds
from artperl.data.truth import Truth
from artperl.fitting.joint_votes import REACH
from artperl.methods.ancsh import ANCSH, ancsh_networks
from artperl.methods.protocol import NetworkSizes
from artperl.training.context import Context
from artperl.training.options import TrainOptions
from artperl.training.supervised import SupervisedStage
from artperl.training.validation import Validation

NPCS, MIOU, NAOCS, PLACE, AXIS, ASSOCIATION = 10.0, 1.0, 1.0, 5.0, 0.2, 1.0
"""Weights of the losses, the paper's; PLACE is of the heat and of the offset."""


def ancsh_run_networks(options: TrainOptions, num_rows: int) -> dict[str, nn.Module]:
    """New networks of the method, by name."""
    return ancsh_networks(NetworkSizes(num_rows, options.width))


def ancsh_estimator(context: Context) -> ANCSH:
    """The method as the networks of a run stand."""
    own: dict[str, Any] = context.state.networks
    return ANCSH(own["coordinates"], own["joints"], context.objects.base)


def ancsh_stages(options: TrainOptions) -> list[Any]:
    """The stages, in their order."""
    return [
        SupervisedStage("coordinates", "coordinates", coordinate_loss),
        SupervisedStage("joints", "joints", joint_loss, validated=True),
        Validation(),
    ]


def coordinate_loss(network: nn.Module, clouds: Clouds, truth: Truth, whole: Truth) -> tuple[Tensor, dict[str, float]]:
    """Distances of the predicted places from the true ones, and the overlap of parts."""
    said = network(clouds.points)
    naocs = truth.canonical + 0.5
    frame = torch.linalg.vector_norm(truth.of_points(truth.box_size), dim=-1, keepdim=True).clamp(min=1e-6)
    npcs = (truth.canonical - truth.of_points(truth.box_center)) / frame + 0.5
    rows = truth.part[..., None, None].expand(-1, -1, 1, 3)
    own = said.npcs.gather(2, rows)[:, :, 0]
    part_error = torch.linalg.vector_norm(own - npcs, dim=-1).mean()
    whole_error = torch.linalg.vector_norm(said.scale * own + said.shift - naocs, dim=-1).mean()
    loss = NPCS * part_error + NAOCS * whole_error + MIOU * miou_loss(said.part_logits, truth.part)
    right = float((said.part_logits.argmax(-1) == truth.part).float().mean())
    return loss, {"accuracy": right, "npcs": part_error.item(), "naocs": whole_error.item()}


def miou_loss(logits: Tensor, part: Tensor) -> Tensor:
    """One less the mean overlap of predicted and true parts, probabilities counted as shares of points."""
    probability = logits.softmax(-1)
    member = functional.one_hot(part, logits.shape[-1]).to(probability.dtype)
    shared = (probability * member).sum(1)
    either = (probability + member - probability * member).sum(1)
    present = member.sum(1) > 0
    overlap = torch.where(present, shared / either.clamp(min=1e-6), 0.0)
    return 1.0 - (overlap.sum(1) / present.sum(1)).mean()


def joint_loss(network: nn.Module, clouds: Clouds, truth: Truth, whole: Truth) -> tuple[Tensor, dict[str, float]]:
    """Errors of the votes of those points that are to vote, and of which joint they vote for."""
    said = network(clouds.points)
    joint, axis, offset, heat = joint_targets(truth)
    votes = joint > 0
    count = votes.sum().clamp(min=1)
    turns = votes & (heat > 0)
    association = functional.cross_entropy(said.joint_logits.flatten(0, 1), joint.flatten())
    axis_error = (torch.linalg.vector_norm(said.axis - axis, dim=-1) * votes).sum() / count
    place = (torch.linalg.vector_norm(said.offset - offset, dim=-1) * turns).sum() / turns.sum().clamp(min=1)
    heat_error = (said.heat.sigmoid() - heat).abs().mean()
    loss = ASSOCIATION * association + AXIS * axis_error + PLACE * (heat_error + place)
    return loss, {"association": association.item(), "axis": axis_error.item(), "heat": heat_error.item()}


def joint_targets(truth: Truth) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """What points are to say of joints.

    A point of either part of a hinge votes for it when it is within reach, for the nearest of several; the points of
    the moving part vote for the direction of a slide.

    Returns
    -------
    joint : (B, N) int64
        0 for points that do not vote.
    axis, offset : (B, N, 3) float
    heat : (B, N) float
        0 for slides, and out of reach.
    """
    P = truth.part_valid.shape[1]
    slide, turn, away = truth.joint.split(3, dim=-1)
    axis = slide + turn
    hinges = turn.abs().sum(-1) > 0
    pivot = truth.box_center + away
    apart = pivot[:, None] - truth.canonical[:, :, None]  # (B, N, P, 3)
    apart = apart - (apart * turn[:, None]).sum(-1, keepdim=True) * turn[:, None]
    distance = torch.linalg.vector_norm(apart, dim=-1)
    near = hinges[:, None] & (distance < REACH) & _adjacent(truth, P)
    nearest = distance.masked_fill(~near, torch.inf).argmin(-1)
    of_hinge = near.any(-1)
    slides = truth.of_points(slide.abs().sum(-1) > 0)
    joint = torch.where(of_hinge, nearest, torch.where(slides, truth.part, 0))
    rows = joint[..., None, None]
    offset = functional.normalize(apart.gather(2, rows.expand(-1, -1, 1, 3))[:, :, 0], dim=-1)
    heat = torch.where(of_hinge, 1.0 - distance.gather(2, joint[..., None])[..., 0] / REACH, 0.0)
    chosen = torch.stack([own[row] for own, row in zip(axis, joint, strict=True)])
    return joint, chosen, torch.where(of_hinge[..., None], offset, 0.0), heat


def _adjacent(truth: Truth, P: int) -> Tensor:
    """(B, N, P) whether each point is of one of the two parts of each part's joint."""
    member = functional.one_hot(truth.part, P).bool()
    above = functional.one_hot(truth.parent, P).bool()  # (B, P, P)
    parent = torch.einsum("bnj,bkj->bnk", member.float(), above.float()) > 0
    joint = truth.level > 0
    return (member | parent) & joint[:, None]
