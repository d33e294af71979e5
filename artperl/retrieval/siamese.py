"""The paper's retrieval: one vector for a cloud of parts, near for clouds of the same object (ArtPERL, section 4.2).

Equation 1 as printed sums the features of all points over all parts, so that the parts' labels cancel out. Here
features are averaged within each part, and the averages of all parts stand side by side.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from artperl.core.clouds import Clouds
from artperl.core.pointnet2 import PointNet2
from artperl.core.shapes import Shapes
from artperl.retrieval.shape_base import ShapeBase

POINTS = 1024
"""Points of a cloud that are embedded (section 4.2)."""
_CENTRES = 4
"""Of so many points, one is a centre of PointNet++'s first coarser level."""


class Siamese(nn.Module):
    """Embeds observed and canonical clouds alike.

    Parameters
    ----------
    num_rows : int
        K, rows for parts.
    width : int
        Channels of the features of points.
    """

    def __init__(self, num_rows: int, width: int = 24):
        super().__init__()
        self.num_rows, self.width = num_rows, width
        self.backbone = PointNet2(width)

    def forward(self, points: Tensor, part: Tensor) -> Tensor:
        """(B, K * width), equation 1, from clouds (B, N, 3), centred and of unit size, and their parts (B, N).

        Parts that no point has count as 0.
        """
        order = spread_order(points, points.shape[1] // _CENTRES)
        points, part = points.gather(1, order[..., None].expand_as(points)), part.gather(1, order)
        features = self.backbone(points)[0]
        member = nn.functional.one_hot(part, self.num_rows).to(features.dtype).transpose(1, 2)
        return ((member @ features) / member.sum(2, keepdim=True).clamp(min=1.0)).flatten(1)


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


def canonical_clouds(shapes: Shapes, generator: torch.Generator, count: int = POINTS) -> tuple[Tensor, Tensor]:
    """Clouds (B, count, 3) of whole objects at rest, centred and of unit size, and the parts (B, count) of the points.

    Parts have points by their area.
    """
    M = shapes.points.shape[2]
    area = torch.where(shapes.has_surface, shapes.spacing, 0.0).square()
    index = torch.multinomial(area.repeat_interleave(M, dim=1), count, replacement=True, generator=generator)
    points = shapes.points.flatten(1, 2).gather(1, index[..., None].expand(-1, -1, 3))
    return Clouds.of(points).points, index // M


@torch.no_grad()
def by_siamese(base: ShapeBase, siamese: Siamese) -> ShapeBase:
    """The base, to be searched by the vectors of its objects."""
    points, part = canonical_clouds(base.shapes, torch.Generator().manual_seed(0))
    return base.with_embeddings(siamese(points, part))


@torch.no_grad()
def spread_order(points: Tensor, count: int) -> Tensor:
    """(B, N) int64 order of points (B, N, 3) whose first ``count`` are the farthest from each other.

    It begins with the point farthest from the mean, so that it does not depend on the order that points come in.
    """
    B, N, _ = points.shape
    rows, order = torch.arange(B, device=points.device), torch.empty(B, N, dtype=torch.int64, device=points.device)
    left = torch.ones(B, N, dtype=torch.bool, device=points.device)
    distance = (points - points.mean(1, keepdim=True)).square().sum(-1)
    apart = torch.full_like(distance, torch.inf)
    for i in range(count):
        order[:, i] = chosen = (distance if i == 0 else apart).masked_fill(~left, -1.0).argmax(1)
        left[rows, chosen] = False
        apart = torch.minimum(apart, (points - points[rows, chosen][:, None]).square().sum(-1))
    order[:, count:] = left.nonzero()[:, 1].reshape(B, N - count)
    return order
