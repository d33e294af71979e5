"""Perception: which part each point belongs to, and where it lies in the rest frame (ArtPERL, section 4.2).

The paper segments; here the same network also says, for each point, where it lies in the object's rest frame (as
A-NCSH does for each part), and, for the whole cloud, how large the object and its parts' boxes are. Both cost one dense
layer, and give the fitting a start within a few degrees.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from artperl.core.batch import Batch
from artperl.core.pointnet2 import PointNet2, exact


@dataclass(frozen=True, eq=False)
class Perceived(Batch):
    """What the network says of B clouds of N points, P rows for parts. Rest-frame lengths are in diagonals."""

    part_logits: Tensor
    """(B, N, P) float."""
    canonical: Tensor
    """(B, N, 3) float. Where each point lies in the rest frame, at rest."""
    spread: Tensor
    """(B, N) float. Logarithm of the expected error of ``canonical``."""
    own_logits: Tensor
    """(B, N) float. Whether each point is of the object, rather than of the table or a neighbour."""
    valid_logits: Tensor
    """(B, P) float. Whether the object has each part."""
    box_center: Tensor
    box_size: Tensor
    """(B, P, 3) float."""
    log_diagonal: Tensor
    """(B,) float. Logarithm of the object's diagonal over the cloud's scale."""

    @property
    def valid(self) -> Tensor:
        """(B, P) bool: as many first rows as the object most likely has parts, the root always."""
        last = self.valid_logits.cumsum(1).argmax(1, keepdim=True)
        return torch.arange(self.valid_logits.shape[1], device=last.device) <= last

    def of_points(self, chosen: Tensor | slice) -> Perceived:
        """Of those points alone that are chosen: (N,) bool, or a slice."""
        return _of_points(self, chosen, ("part_logits", "canonical", "spread", "own_logits"))

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
    """What each point of B clouds of N says of its own part. Rest-frame lengths are in diagonals."""

    canonical: Tensor
    spread: Tensor
    own_logits: Tensor
    log_diagonal: Tensor
    """As in :class:`Perceived`."""
    box: Tensor
    """(B, N, 6) float. Centre and size of the part's box."""
    joint: Tensor
    """(B, N, 9) float. The part's joint as :attr:`artperl.data.truth.Truth.joint` has it."""
    mirrored_joint: Tensor
    """(B, N, 9) float. The same by the cloud's mirror image, where that was looked at, too."""
    level_logits: Tensor
    """(B, N, P) float. How many joints are between the root and the part."""

    def of_points(self, chosen: Tensor) -> Votes:
        """Of those points alone that are chosen (N,) bool."""
        return _of_points(self, chosen, _OF_POINTS)


_OF_POINTS = ("canonical", "spread", "own_logits", "box", "joint", "mirrored_joint", "level_logits")

Seen = TypeVar("Seen", Perceived, Votes)


def _of_points(seen: Seen, chosen: Tensor | slice, names: tuple[str, ...]) -> Seen:
    return replace(seen, **{name: getattr(seen, name)[:, chosen] for name in names})


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
        of_point, of_cloud = (num_rows + 20, 1) if votes else (num_rows + 5, 7 * num_rows + 1)
        self.point_head = nn.Sequential(nn.Linear(channels, 128), nn.ReLU(), nn.Linear(128, of_point))
        self.context = nn.Linear(whole, channels)
        self.cloud_head = nn.Sequential(nn.Linear(whole, 256), nn.ReLU(), nn.Linear(256, of_cloud))

    @property
    def device(self) -> torch.device:
        """Where the network is."""
        return self.context.weight.device

    def forward(self, points: Tensor, standard: int = 0) -> Perceived | Votes:
        """(B, N, 3) points as in :class:`artperl.core.clouds.Clouds`, which have so many as a rule.

        See :meth:`artperl.core.pointnet2.PointNet2.forward`.
        """
        return self._read(*(values.float() for values in self.backbone(points, standard)))

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
                own_logits=point[..., -1],
                log_diagonal=whole[:, -1],
                box=torch.cat([canonical.detach() + own[..., :3], 0.5 * functional.softplus(2.0 * own[..., 3:])], -1),
                joint=point[..., P + 10 : P + 19],
                mirrored_joint=point[..., P + 10 : P + 19],
                level_logits=point[..., :P],
            )
        boxes = whole[:, P : 7 * P].reshape(-1, P, 6)
        return Perceived(
            part_logits=point[..., :P],
            canonical=0.5 * point[..., P : P + 3],
            spread=point[..., P + 3] - 3.0,
            own_logits=point[..., -1],
            valid_logits=whole[:, :P],
            box_center=0.5 * boxes[..., :3],
            box_size=0.5 * functional.softplus(boxes[..., 3:]),
            log_diagonal=whole[:, -1],
        )
