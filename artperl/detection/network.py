"""The detector's network: for each cell of 4 x 4 pixels its category, the middle of its object, and the object's size.

A ResNet (He et al. 2016) below a UPerNet (Xiao et al. 2018), both of Hugging Face's transformers, small and from random
weights. Middles in space tell objects of one category apart, as votes do in VoteNet (Qi et al. 2019).
"""

from dataclasses import dataclass

from artsim.common.extras import require_extra

with require_extra("the detector"):
    from torch import Tensor, nn
    from transformers import ResNetConfig, UperNetConfig, UperNetForSemanticSegmentation

from artperl.detection.images import CHANNELS

VOTES = 4
"""Numbers of a cell besides its categories': offset to the middle (3), logarithm of the size."""
OFFSET = 0.1
"""Of the median depth: unit of offsets, about what they are."""

_POOLED = [2, 3, 6]
"""Grids that the pyramid pools the coarsest level to. UPerNet has 1, too: batch normalisation of one value an image
learns something else than it is tested with."""


@dataclass(frozen=True)
class DetectorSize:
    """What the shape of the network follows from."""

    categories: tuple[str, ...]
    width: int = 32
    """Channels of the finest level of the ResNet; each coarser level has twice as many."""
    blocks: int = 2
    """Residual blocks of each of the four levels."""


class DetectorNetwork(nn.Module):
    """See the head of this module.

    Parameters
    ----------
    size : DetectorSize
    """

    def __init__(self, size: DetectorSize):
        super().__init__()
        self.size = size
        levels = [size.width * 2**i for i in range(4)]
        backbone = ResNetConfig(
            num_channels=CHANNELS, embedding_size=size.width, hidden_sizes=levels, depths=[size.blocks] * 4,
            layer_type="basic", out_features=[f"stage{i}" for i in range(1, 5)],
        )  # fmt: skip
        config = UperNetConfig(
            backbone_config=backbone, hidden_size=2 * size.width, use_auxiliary_head=False,
            pool_scales=_POOLED, num_labels=len(size.categories) + 1 + VOTES,
        )  # fmt: skip
        self.net = UperNetForSemanticSegmentation(config)

    def forward(self, channels: Tensor) -> tuple[Tensor, Tensor]:
        """Cells of some images.

        Parameters
        ----------
        channels : (B, 8, H, W) float

        Returns
        -------
        tuple
            ``(logits, votes)``: (B, 1 + C, H / 4, W / 4), background first; (B, 4, H / 4, W / 4), offset in
            :data:`OFFSET` times the unit, and logarithm of the diagonal in the unit.
        """
        out = self.net.decode_head(self.net.backbone(channels).feature_maps).float()
        return out[:, :-VOTES], out[:, -VOTES:]
