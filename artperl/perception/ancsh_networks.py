"""The two networks of A-NCSH (Li et al. 2020): coordinates of points, and votes for joints."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from artperl.core.batch import Batch
from artperl.core.pointnet2 import PointNet2, exact

_HIDDEN = 128


@dataclass(frozen=True, eq=False)
class Coordinates(Batch):
    """What is said of B clouds of N points, K parts."""

    part_logits: Tensor
    """(B, N, K) float."""
    npcs: Tensor
    """(B, N, K, 3) float. Place of each point in each part's box: 0.5 at its centre, lengths in diagonals of the
    box."""
    scale: Tensor
    """(B, N, 1) float."""
    shift: Tensor
    """(B, N, 3) float. ``naocs = scale * npcs + shift`` of the point's own part: the place in the object's rest frame,
    0.5 at its centre, lengths in the object's diagonals."""


@dataclass(frozen=True, eq=False)
class JointPoints(Batch):
    """What each point of B clouds of N says of the joint near it."""

    joint_logits: Tensor
    """(B, N, K) float. Which joint: k is that of part k, 0 none."""
    axis: Tensor
    offset: Tensor
    """(B, N, 3) float. Direction of the joint, and from the point to the nearest place of the joint."""
    heat: Tensor
    """(B, N) float. Logit of 1 less the distance from the joint over :data:`artperl.fitting.joint_votes.REACH`."""


class _PointNetwork(nn.Module):
    """PointNet++ with a head for points that knows the whole cloud.

    Parameters
    ----------
    num_rows : int
        K.
    outputs : int
    width : int
        Channels of the finest level.
    """

    def __init__(self, num_rows: int, outputs: int, width: int):
        super().__init__()
        self.num_rows, self.width = num_rows, width
        self.backbone = PointNet2(width)
        self.context = nn.Linear(self.backbone.cloud_channels, width)
        self.head = nn.Sequential(nn.Linear(width, _HIDDEN), nn.ReLU(), nn.Linear(_HIDDEN, outputs))

    def _said(self, points: Tensor) -> Tensor:
        """(B, N, outputs) in single precision, whatever the backbone's."""
        return self._read(*(values.float() for values in self.backbone(points)))

    @exact
    def _read(self, features: Tensor, cloud: Tensor) -> Tensor:
        said: Tensor = self.head(torch.relu(features + self.context(cloud)[:, None]))
        return said


class CoordinateNetwork(_PointNetwork):
    """Parts and normalised coordinates of points, for K = ``num_rows`` parts."""

    def __init__(self, num_rows: int, width: int = 48):
        super().__init__(num_rows, 4 * num_rows + 4, width)

    def forward(self, points: Tensor) -> Coordinates:
        """(B, N, 3) points, centred and of unit size, in random order."""
        said, K = self._said(points), self.num_rows
        return Coordinates(
            part_logits=said[..., :K], npcs=said[..., K : 4 * K].unflatten(-1, (K, 3)).sigmoid(),
            scale=said[..., 4 * K : 4 * K + 1].sigmoid(), shift=said[..., 4 * K + 1 :].tanh(),
        )  # fmt: skip


class JointNetwork(_PointNetwork):
    """Votes for joints, for K = ``num_rows`` parts."""

    def __init__(self, num_rows: int, width: int = 48):
        super().__init__(num_rows, num_rows + 7, width)

    def forward(self, points: Tensor) -> JointPoints:
        """(B, N, 3) points, centred and of unit size, in random order."""
        said, K = self._said(points), self.num_rows
        return JointPoints(
            joint_logits=said[..., :K], axis=said[..., K : K + 3].tanh(), offset=said[..., K + 3 : K + 6].tanh(),
            heat=said[..., K + 6],
        )  # fmt: skip
