"""Perception: which part each point belongs to, and where it lies in the rest frame (ArtPERL, section 4.2).

The paper segments; here the same network also says, for each point, where it lies in the object's rest frame (as
A-NCSH does for each part), and, for the whole cloud, how large the object and its parts' boxes are. Both cost one dense
layer, and give the fitting a start within a few degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from artperl.core.batch import Batch
from artperl.core.pointnet2 import PointNet2, exact
from artperl.data.batches import Truth

_SHARP = 0.05
"""Huber loss turns linear at this distance, in diagonals."""
_THIN = 0.1
"""Diagonals that are added to a box's side before an error is taken over it."""
_JOINT_SHARP = 0.2
"""Huber loss of joints turns linear there."""


@dataclass(frozen=True, eq=False)
class Perceived(Batch):
    """What the network says of B clouds of N points, P rows for parts. Rest-frame lengths are in diagonals.

    Attributes
    ----------
    part_logits : (B, N, P) float
    canonical : (B, N, 3) float
        Where each point lies in the rest frame, at rest.
    spread : (B, N) float
        Logarithm of the expected error of ``canonical``.
    valid_logits : (B, P) float
        Whether the object has each part.
    box_center, box_size : (B, P, 3) float
    log_diagonal : (B,) float
        Logarithm of the object's diagonal over the cloud's radius.
    """

    part_logits: Tensor
    canonical: Tensor
    spread: Tensor
    valid_logits: Tensor
    box_center: Tensor
    box_size: Tensor
    log_diagonal: Tensor

    @property
    def valid(self) -> Tensor:
        """(B, P) bool: as many first rows as the object most likely has parts, the root always."""
        last = self.valid_logits.cumsum(1).argmax(1, keepdim=True)
        return torch.arange(self.valid_logits.shape[1], device=last.device) <= last

    @property
    def part_probability(self) -> Tensor:
        """(B, N, P) of each point to belong to each of the parts that the object has."""
        return self._possible_logits.softmax(-1)

    @property
    def part(self) -> Tensor:
        """(B, N) most likely part of each point, among those that the object has."""
        return self._possible_logits.argmax(-1)

    @property
    def _possible_logits(self) -> Tensor:
        """(B, N, P) without hope for parts that the object does not have."""
        return self.part_logits.masked_fill(~self.valid[:, None], -torch.inf)


@dataclass(frozen=True, eq=False)
class Votes(Batch):
    """What each point of B clouds of N says of its own part. Rest-frame lengths are in diagonals.

    Attributes
    ----------
    canonical, spread, log_diagonal
        As in :class:`Perceived`.
    box : (B, N, 6) float
        Centre and size of the part's box.
    joint : (B, N, 9) float
        The part's joint as :attr:`artperl.data.batches.Truth.joint` has it.
    level_logits : (B, N, P) float
        How many joints are between the root and the part.
    """

    canonical: Tensor
    spread: Tensor
    log_diagonal: Tensor
    box: Tensor
    joint: Tensor
    level_logits: Tensor


class Perception(nn.Module):
    """PointNet++ with a dense head for points and one for the cloud.

    Parameters
    ----------
    num_rows : int
        Rows for parts.
    width : int
        Channels of the finest level.
    votes : bool
        Points say which box and joint their own part has, instead of naming it by its number.
    """

    def __init__(self, num_rows: int, width: int = 48, votes: bool = False):
        super().__init__()
        self.num_rows, self.width, self.votes = num_rows, width, votes
        self.backbone = PointNet2(width)
        channels, whole = self.backbone.point_channels, self.backbone.cloud_channels
        of_point, of_cloud = (num_rows + 19, 1) if votes else (num_rows + 4, 7 * num_rows + 1)
        self.point_head = nn.Sequential(nn.Linear(channels, 128), nn.ReLU(), nn.Linear(128, of_point))
        self.context = nn.Linear(whole, channels)
        self.cloud_head = nn.Sequential(nn.Linear(whole, 256), nn.ReLU(), nn.Linear(256, of_cloud))

    @property
    def device(self) -> torch.device:
        """Where the network is."""
        return self.context.weight.device

    def forward(self, points: Tensor) -> Perceived | Votes:
        """(B, N, 3) points as in :class:`artperl.data.batches.Clouds`."""
        return self._read(*(values.float() for values in self.backbone(points)))

    @exact
    def _read(self, features: Tensor, cloud: Tensor) -> Perceived | Votes:
        """Coordinates are read in single precision, whatever the backbone's."""
        point = self.point_head(torch.relu(features + self.context(cloud)[:, None]))
        whole = self.cloud_head(cloud)
        P = self.num_rows
        if self.votes:
            canonical = 0.5 * point[..., P : P + 3]
            own = 0.5 * point[..., P + 4 : P + 10]  # where the box is from the point, which is easier to see
            return Votes(
                canonical=canonical,
                spread=point[..., P + 3] - 3.0,
                log_diagonal=whole[:, -1],
                box=torch.cat([canonical.detach() + own[..., :3], 0.5 * functional.softplus(2.0 * own[..., 3:])], -1),
                joint=point[..., P + 10 :],
                level_logits=point[..., :P],
            )
        boxes = whole[:, P : 7 * P].reshape(-1, P, 6)
        return Perceived(
            part_logits=point[..., :P],
            canonical=0.5 * point[..., P : P + 3],
            spread=point[..., P + 3] - 3.0,
            valid_logits=whole[:, :P],
            box_center=0.5 * boxes[..., :3],
            box_size=0.5 * functional.softplus(boxes[..., 3:]),
            log_diagonal=whole[:, -1],
        )


def perception_losses(perceived: Perceived | Votes, truth: Truth) -> dict[str, Tensor]:
    """Losses by name; their sum is minimised.

    Coordinates are scored by the likelihood of a Laplace distribution of the spread that the network itself expects, so
    that points whose place cannot be told (a lid seen edge-on) do not drown the others.
    """
    distance = (
        functional.huber_loss(perceived.canonical, truth.canonical, reduction="none", delta=_SHARP).sum(-1) / _SHARP
    )
    spread = perceived.spread.clamp(-6.0, 2.0)
    losses = {
        "canonical": 5.0 * distance.mean(),
        "spread": 0.2 * (distance.detach() * (-spread).exp() + spread).mean(),
        "diagonal": 2.0 * (perceived.log_diagonal - truth.diagonal.log()).abs().mean(),
    }
    of_parts = _vote_losses(perceived, truth) if isinstance(perceived, Votes) else _number_losses(perceived, truth)
    return losses | of_parts


def _number_losses(perceived: Perceived, truth: Truth) -> dict[str, Tensor]:
    weight = truth.part_valid.float()
    boxes = torch.cat([perceived.box_center - truth.box_center, perceived.box_size - truth.box_size], dim=-1)
    return {
        "part": functional.cross_entropy(perceived.part_logits.flatten(0, 1), truth.part.flatten()),
        "valid": 0.2 * functional.binary_cross_entropy_with_logits(perceived.valid_logits, weight),
        "boxes": 2.0 * (boxes.abs().sum(-1) * weight).sum() / weight.sum(),
    }


def _vote_losses(votes: Votes, truth: Truth) -> dict[str, Tensor]:
    """A part counts by the root of how many points it has; errors of boxes are taken over their sides."""
    count = functional.one_hot(truth.part, truth.part_valid.shape[1]).sum(1)
    weight = truth.of_points(count).float().rsqrt()
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
    off = (perceived.canonical - truth.canonical).norm(dim=-1).median()
    return {"accuracy": right.float().mean().item(), "coordinates": off.item()}
