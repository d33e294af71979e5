"""The paper's segmentation: PointNet++, and a three-layer MLP that names the part of each point (section 4.2)."""

from torch import Tensor, nn

from artperl.core.pointnet2 import PointNet2


class Segmentation(nn.Module):
    """Part labels of clouds.

    Parameters
    ----------
    num_rows : int
        K, the most parts that an object has.
    width : int
        Channels of the finest level.
    """

    def __init__(self, num_rows: int, width: int = 48):
        super().__init__()
        self.num_rows, self.width = num_rows, width
        self.backbone = PointNet2(width)
        self.mlp = nn.Sequential(
            nn.Linear(width, 128), nn.ReLU(), nn.Linear(128, 64), nn.ReLU(), nn.Linear(64, num_rows)
        )

    def forward(self, points: Tensor) -> Tensor:
        """(B, N, K) logits of the parts of points (B, N, 3), centred and of unit size, in random order."""
        logits: Tensor = self.mlp(self.backbone(points)[0])
        return logits
