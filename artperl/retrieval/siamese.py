"""The paper's retrieval: one vector for a cloud of parts, near for clouds of the same object (ArtPERL, section 4.2).

Equation 1 as printed sums the features of all points over all parts, so that the parts' labels cancel out. Here
features are averaged within each part and the averages of all parts stand side by side.

Estimators search by the boxes that perception says (:mod:`artperl.retrieval.box_embedding`), which finds nearer objects
and needs no second network: ``python -m benchmarks.retrieval`` compares both.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from artperl.core.pointnet2 import PointNet2


class Siamese(nn.Module):
    """Embeds observed and canonical clouds alike.

    Parameters
    ----------
    num_rows : int
        Rows for parts.
    width : int
        Channels of the finest level.
    outputs : int
        Length of the vector.
    """

    def __init__(self, num_rows: int, width: int = 24, outputs: int = 64):
        super().__init__()
        self.num_rows = num_rows
        self.backbone = PointNet2(width)
        pooled = num_rows * (width + 1) + self.backbone.cloud_channels
        self.head = nn.Sequential(nn.Linear(pooled, 128), nn.ReLU(), nn.Linear(128, outputs))

    def forward(self, points: Tensor, part: Tensor) -> Tensor:
        """(B, outputs) from clouds (B, N, 3), centred and of unit size, and the parts (B, N) of their points."""
        features, cloud = self.backbone(points)
        member = nn.functional.one_hot(part, self.num_rows).to(features.dtype).transpose(1, 2)
        count = member.sum(2, keepdim=True)
        mean = (member @ features) / count.clamp(min=1.0)
        return self.head(torch.cat([mean.flatten(1), (count[..., 0] > 0).to(mean.dtype), cloud], dim=1))


def contrastive_loss(vectors: Tensor, own: Tensor, margin: float = 1.0) -> Tensor:
    """Equation 2: pairs of the same object are drawn together, others pushed apart up to a margin.

    The paper draws pairs at random; here all pairs of a batch count, those of the same object half.

    Parameters
    ----------
    vectors : (B, E) float
        Of observed clouds.
    own : (B, E) float
        Of their objects, all different, at rest.
    margin : float
    """
    distance = torch.linalg.vector_norm(vectors[:, None] - own + 1e-9, dim=-1)
    same = torch.eye(len(own), dtype=torch.bool, device=own.device)
    apart = (margin - distance).clamp(min=0.0)
    return 0.25 * distance[same].square().mean() + 0.25 * apart[~same].square().mean()
