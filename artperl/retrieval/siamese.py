"""The paper's retrieval: one vector for a cloud of parts, near for clouds of the same object (ArtPERL, section 4.2).

Equation 1 as printed sums the features of all points over all parts, so that the parts' labels cancel out. Here
features are pooled within each part, stand side by side, and two layers read them.
"""

import torch
from torch import Tensor, nn

from artperl.core.clouds import Clouds
from artperl.core.shapes import Shapes
from artperl.retrieval.shape_base import ShapeBase

POINTS = 1024
"""Points of a cloud that are embedded (section 4.2)."""


class Siamese(nn.Module):
    """Embeds observed and canonical clouds alike.

    Parameters
    ----------
    num_rows : int
        K, rows for parts.
    width : int
        Channels of the features of points, and of the vectors.
    """

    def __init__(self, num_rows: int, width: int = 64):
        super().__init__()
        self.num_rows, self.width = num_rows, width
        self.points = nn.Sequential(
            nn.Linear(9 + num_rows, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU(), nn.Linear(width, width)
        )
        self.whole = nn.Sequential(nn.Linear(2 * width * num_rows, width), nn.ReLU(), nn.Linear(width, width))

    def forward(self, points: Tensor, part: Tensor) -> Tensor:
        """(B, width), equation 1, from clouds (B, N, 3), centred and of unit size, and their parts (B, N).

        A point is known by its place in the cloud and in its part, and by what does not depend on the view: its
        distances from the planes through its part's principal axes, and from all parts' means. Parts that no point has
        count as 0.
        """
        member = nn.functional.one_hot(part, self.num_rows).to(points.dtype)
        share = (member / member.sum(1, keepdim=True).clamp(min=1.0)).mT
        mean = share @ points
        local = points - member @ mean
        spread = share @ (local[..., :, None] * local[..., None, :]).flatten(2)
        axes = torch.linalg.eigh(spread.unflatten(2, (3, 3)))[1]
        own_axes = (member @ axes.flatten(2)).unflatten(2, (3, 3))
        principal = (local[..., None, :] @ own_axes)[..., 0, :].abs()
        features = self.points(torch.cat([points, local, principal, torch.cdist(points, mean)], dim=-1))
        index, none = part[..., None].expand_as(features), features.new_zeros(*mean.shape[:2], self.width)
        most = none.scatter_reduce(1, index, features, "amax", include_self=False)
        return self.whole(torch.cat([share @ features, most], dim=-1).flatten(1))


def contrastive_loss(vectors: Tensor, own: Tensor, margin: Tensor) -> Tensor:
    """Equation 2: pairs of the same object are drawn together, others are brought as far apart as the margin.

    The paper draws pairs at random, its margin is 1, and pairs beyond it are left alone. Here all pairs of a batch
    count, those of the same object half. The margin of a pair is how much its objects differ, so that near vectors
    are those of like objects.

    Parameters
    ----------
    vectors : (B, E) float
        Of observed clouds.
    own : (B, E) float
        Of their objects at rest.
    margin : (B, B) float
        Of each cloud and object.
    """
    distance = torch.linalg.vector_norm(vectors[:, None] - own + 1e-9, dim=-1)
    same = torch.eye(len(own), dtype=torch.bool, device=own.device)
    apart = margin - distance
    return 0.25 * distance[same].square().mean() + 0.25 * apart[~same].square().mean()


def margins(boxes: Tensor) -> Tensor:
    """(B, B) how much objects differ, by their embeddings (B, E) of boxes: 1 for the mean of all pairs."""
    apart = torch.cdist(boxes, boxes)
    return apart / (apart.sum() / max(1, len(apart) * (len(apart) - 1))).clamp(min=1e-9)


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
