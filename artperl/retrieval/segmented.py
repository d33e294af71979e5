"""From a cloud to a reference: the parts of its points, then the nearest object (ArtPERL, section 4.2)."""

import torch
from torch import Tensor

from artperl.core.clouds import Clouds
from artperl.perception.segmentation import Segmentation
from artperl.retrieval.shape_base import ShapeBase
from artperl.retrieval.siamese import POINTS, Siamese


class SegmentedRetrieval:
    """What methods share that fit a retrieved reference.

    Parameters
    ----------
    segmentation : Segmentation
    siamese : Siamese
    base : ShapeBase
        References with their embeddings by ``siamese``.
    """

    def __init__(self, segmentation: Segmentation, siamese: Siamese, base: ShapeBase):
        self.segmentation, self.siamese = segmentation.eval(), siamese.eval()
        self.device = next(siamese.parameters()).device
        self.base = base.to(self.device)

    @property
    def categories(self) -> tuple[str, ...]:
        """Categories of the references."""
        return tuple(dict.fromkeys(self.base.categories))

    def segment(self, points: Tensor) -> Tensor:
        """(B, N) parts of points (B, N, 3), camera frame, metres."""
        return self.parts(points)[0]

    @torch.no_grad()
    def parts(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """(B, N) parts of points (B, N, 3), camera frame, metres, and their probabilities."""
        certainty, part = self.segmentation(Clouds.of(points).points).softmax(-1).max(-1)
        return part, certainty

    @torch.no_grad()
    def retrieve(self, points: Tensor, part: Tensor, count: int = 1) -> Tensor:
        """(B, count) rows of the references nearest to segmented clouds, by equation 1."""
        few, labels = points[:, :POINTS], part[:, :POINTS]
        return self.base.nearest_objects(self.siamese(Clouds.of(few).points, labels), count)[0]


def check_embeddings(base: ShapeBase, siamese: Siamese) -> None:
    """Refuse a base whose embeddings are not those of such a network.

    Raises
    ------
    ValueError
    """
    if base.embeddings is None or base.embeddings.shape[1] != siamese.width:
        raise ValueError("the embeddings of its base are not of its objects")
