"""The two networks of OMAD (Xue et al. 2021): a prior of keypoints and joints, and what a cloud says of both."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from artperl.core.batch import Batch
from artperl.core.pointnet2 import PointNet2, exact

KEYPOINTS, BASIS = 24, 10
"""Keypoints of each part, and shapes that they are a sum of: the paper's."""
_HIDDEN = 128


class KeypointPrior(nn.Module):
    """PriorNet: the shape of an object of the category as ten numbers.

    Keypoints of a part are a sum of learnt shapes, weighted by these numbers. Parts that are their own mirror image
    have half of them; the others are their mirror images. A small network tells the joints.

    Parameters
    ----------
    mirrored : (K,) bool
        Parts that are the same from the left and from the right (-y and +y).
    joint : (K, 6) float, optional
        Mean axis and place of the joints, in diagonals, from which the network tells deviations.
    """

    mirrored: Tensor
    joint: Tensor

    def __init__(self, mirrored: Tensor, joint: Tensor | None = None):
        super().__init__()
        K = len(mirrored)
        self.register_buffer("mirrored", mirrored.to(torch.float32))
        self.register_buffer("joint", torch.zeros(K, 6) if joint is None else joint.to(torch.float32))
        self.mean = nn.Parameter(0.1 * torch.randn(K, KEYPOINTS, 3))
        self.basis = nn.Parameter(0.02 * torch.randn(BASIS, K, KEYPOINTS, 3))
        self.points = nn.Sequential(nn.Linear(3 + K, 64), nn.ReLU(), nn.Linear(64, _HIDDEN), nn.ReLU())
        self.shape = nn.Sequential(nn.Linear(_HIDDEN, _HIDDEN), nn.ReLU(), nn.Linear(_HIDDEN, BASIS))
        self.joints = nn.Sequential(nn.Linear(BASIS, 64), nn.ReLU(), nn.Linear(64, 6 * K))

    def encode(self, surface: Tensor) -> Tensor:
        """(B, 10) numbers of objects, from points of their parts' surfaces (B, K, M, 3), in diagonals."""
        B, K, M, _ = surface.shape
        own = torch.eye(K, device=surface.device).expand(B, M, K, K).transpose(1, 2)
        features = self.points(torch.cat([surface, own], dim=-1)).flatten(1, 2).amax(1)
        beta: Tensor = self.shape(features)
        return beta

    def keypoints(self, beta: Tensor) -> Tensor:
        """(B, K, 24, 3) in the rest frame, in diagonals."""
        every = self.mean + torch.einsum("bi,ikmc->bkmc", beta, self.basis)
        half = every[:, :, : KEYPOINTS // 2]
        image = torch.cat([half, half * half.new_tensor([1.0, -1.0, 1.0])], dim=2)
        return torch.where(self.mirrored[:, None, None] > 0, image, every)

    def joint_rows(self, beta: Tensor) -> tuple[Tensor, Tensor]:
        """(B, K, 3) unit axes and (B, K, 3) places of the joints, in the rest frame, in diagonals."""
        own = self.joint + 0.1 * self.joints(beta).unflatten(-1, (len(self.mirrored), 6))
        return functional.normalize(own[..., :3], dim=-1, eps=1e-6), own[..., 3:]


@dataclass(frozen=True, eq=False)
class Cues(Batch):
    """What is said of B clouds of N points, K parts. Lengths as in :class:`artperl.core.clouds.Clouds`."""

    part_logits: Tensor
    """(B, N, K) float."""
    keypoints: Tensor
    """(B, K, 24, 3) float. As posed."""
    quaternion: Tensor
    """(B, 4) float. Of the root, w first, of length 1."""
    translation: Tensor
    """(B, 3) float. Of the root's rest frame."""
    log_diagonal: Tensor
    """(B,) float."""
    state: Tensor
    """(B, K) float. Each joint's place between its limits, 0 to 1."""
    beta: Tensor
    """(B, 10) float."""


class CueNetwork(nn.Module):
    """OMADNet: keypoints by votes that points are trusted with, pose, states and shape by the whole cloud.

    Parameters
    ----------
    num_rows : int
        K.
    width : int
        Channels of the finest level.
    """

    def __init__(self, num_rows: int, width: int = 48):
        super().__init__()
        self.num_rows, self.width = num_rows, width
        self.backbone = PointNet2(width)
        channels = self.backbone.cloud_channels
        self.context = nn.Linear(channels, width)
        self.head = nn.Sequential(
            nn.Linear(width, _HIDDEN), nn.ReLU(), nn.Linear(_HIDDEN, num_rows * (1 + 4 * KEYPOINTS))
        )  # fmt: skip
        self.whole = nn.Sequential(nn.Linear(channels, 256), nn.ReLU(), nn.Linear(256, 8 + num_rows + BASIS))

    def forward(self, points: Tensor) -> Cues:
        """(B, N, 3) points, centred and of unit size, in random order."""
        return self._read(points.float(), *(values.float() for values in self.backbone(points)))

    @exact
    def _read(self, points: Tensor, features: Tensor, cloud: Tensor) -> Cues:
        K, said = self.num_rows, self.head(torch.relu(features + self.context(cloud)[:, None]))
        trust, offset = said[..., K : K * (1 + KEYPOINTS)].softmax(1), said[..., K * (1 + KEYPOINTS) :]
        offset = offset.unflatten(-1, (K * KEYPOINTS, 3))
        voted = torch.einsum("bnq,bnqc->bqc", trust, points[:, :, None] + 0.5 * offset)
        whole = self.whole(cloud)
        turn = whole[:, :4] + whole.new_tensor([1.0, 0.0, 0.0, 0.0])
        return Cues(
            part_logits=said[..., :K], keypoints=voted.unflatten(1, (K, KEYPOINTS)),
            quaternion=functional.normalize(turn, dim=-1, eps=1e-6), translation=0.5 * whole[:, 4:7],
            log_diagonal=0.2 * whole[:, 7], state=whole[:, 8 : 8 + K].sigmoid(), beta=whole[:, 8 + K :],
        )  # fmt: skip


def rotation_of_quaternion(quaternion: Tensor) -> Tensor:
    """(B, 3, 3) rotations of unit quaternions (B, 4), w first."""
    w, x, y, z = quaternion.unbind(-1)
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return torch.stack(rows, dim=-1).unflatten(-1, (3, 3))


def quaternion_of_rotation(rotation: Tensor) -> Tensor:
    """(B, 4) unit quaternions, w first, of rotations (B, 3, 3); of either sign."""
    trace = rotation.diagonal(dim1=-2, dim2=-1).sum(-1)
    skew = rotation - rotation.mT
    twist = torch.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], dim=-1)
    eye = torch.eye(3, dtype=rotation.dtype, device=rotation.device)
    square = rotation + rotation.mT + (1.0 - trace)[:, None, None] * eye
    # 4 q q^T, row by row; the column of the largest diagonal entry is never near zero.
    first = torch.cat([(1.0 + trace)[:, None], twist], dim=1)[:, None]
    K = torch.cat([first, torch.cat([twist[..., None], square], dim=2)], dim=1)
    column = K.diagonal(dim1=-2, dim2=-1).argmax(-1)
    return functional.normalize(K[torch.arange(len(K), device=K.device), column], dim=-1)


def quaternion_error(quaternion: Tensor, truth: Tensor) -> Tensor:
    """(B,) distance of unit quaternions (B, 4), of which both signs are the same rotation."""
    return torch.minimum(
        torch.linalg.vector_norm(quaternion - truth, dim=-1), torch.linalg.vector_norm(quaternion + truth, dim=-1)
    )
