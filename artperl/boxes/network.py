"""Boxes of the parts, from what a fitted cloud says of them: beyond the paper, whose boxes are the reference's.

And where they lie at rest: how far a drawer's front stands before that of its reference is not how far it is open.
"""

import torch
from torch import Tensor, nn

from artperl.boxes.evidence import NUM_CANDIDATES, PERCEIVED, Evidence

_THIN = 0.004
"""Half-size below which places are no longer measured in half-sizes of their part, in diagonals."""
_FAR = 3.0
"""Half-sizes, or tenths of the diagonal, beyond which places are all alike."""
_SMOOTH = 1e-4
"""Roughness, in diagonals, below which clouds are all alike."""
_STEP = 0.1
"""Half-sizes that an output of 1 moves a face by, after candidates were weighed, or how far a part has slid."""
_TRUST = 2.0
"""Logarithm of how much more likely than others the reference is at first."""


class Boxes(nn.Module):
    """Weighs, for each face of each part's box, the candidates for where it is, and moves their mean a little.

    How far a part has slid is corrected by a share of how far its leading face lies beyond where perception has it at
    rest, and a little more.

    Every face goes through the same layers, twice: alone; and with its part, its opposite face, the same face of other
    parts, and of the root.

    Parameters
    ----------
    num_rows : int
        Rows for parts.
    width : int
        Channels.
    """

    def __init__(self, num_rows: int, width: int = 80):
        super().__init__()
        self.num_rows, self.width = num_rows, width
        described = 2 * NUM_CANDIDATES + 9 + 6 + num_rows
        self.alone = nn.Sequential(nn.Linear(described, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU())
        self.among = nn.Sequential(nn.Linear(6 * width, width), nn.ReLU(), nn.Linear(width, NUM_CANDIDATES + 3))
        self.trust = nn.Parameter(_TRUST * (torch.arange(NUM_CANDIDATES) == 0))

    def forward(self, evidence: Evidence) -> tuple[Tensor, Tensor, Tensor]:
        """Centres and sizes (B, P, 3) of the boxes in the rest frame, and how much farther parts (B, P) have slid.

        In diagonals. Boxes are where the part is seen, brought to rest by the poses that were given; at rest they lie
        as much farther back along the axis.
        """
        valid = evidence.valid[..., None, None]
        face = self.alone(self._features(evidence)) * valid
        same = [face.sum(1, keepdim=True) / valid.sum(1, keepdim=True), face.amax(1, keepdim=True), face[:, :1]]
        others = [face.roll(3, dims=2), face.mean(2, keepdim=True), *same]
        score = self.among(torch.cat([face, *(values.expand_as(face) for values in others)], dim=-1))
        weight = (score[..., :NUM_CANDIDATES] + self.trust).softmax(-1)
        step, share, more = score[..., NUM_CANDIDATES:].unbind(-1)
        half = 0.5 * evidence.size
        unit = _STEP * (half + _THIN).repeat(1, 1, 2)
        out = (weight * evidence.candidates).sum(-1) + step * unit
        low, high = evidence.center - half - out[..., :3], evidence.center + half + out[..., 3:]
        beyond = share * (out - evidence.candidates[..., PERCEIVED]) + more * unit
        leads = torch.cat([-evidence.axis, evidence.axis], dim=-1).clamp(min=0.0)
        return 0.5 * (low + high), (high - low).clamp(min=0.0), (leads * beyond).sum(-1)

    def _features(self, evidence: Evidence) -> Tensor:
        """(B, P, 6, C) features of each face."""
        size, candidates = evidence.size, evidence.candidates
        unit = (0.5 * size + _THIN).repeat(1, 1, 2)[..., None]
        log_size = (size + _THIN).log()
        along = [
            log_size, log_size.roll(-1, dims=-1), log_size.roll(-2, dims=-1), log_size[:, :1].expand_as(size),
            (evidence.perceived_size + _THIN).log() - log_size, evidence.center - evidence.center[:, :1],
            evidence.share.sqrt()[..., None].expand_as(size),
            (evidence.roughness + _SMOOTH).log()[:, None, None].expand_as(size),
        ]  # fmt: skip
        known = [
            (10.0 * candidates).clamp(-_FAR, _FAR),
            (candidates / unit).clamp(-_FAR, _FAR),
            torch.stack([values.repeat(1, 1, 2) for values in along] + [evidence.facing], dim=-1),
            torch.eye(6, device=size.device).expand(*size.shape[:2], -1, -1),
            torch.eye(self.num_rows, device=size.device)[:, None].expand(len(size), -1, 6, -1),
        ]
        return torch.cat(known, dim=-1)


def box_losses(center: Tensor, size: Tensor, true_center: Tensor, true_size: Tensor, valid: Tensor) -> Tensor:
    """(B, P) 1 less the intersection over union of boxes along the same axes, and a little of how far faces are off.

    Parameters
    ----------
    center, size, true_center, true_size : (B, P, 3) float
        In diagonals.
    valid : (B, P) bool
        The loss of other parts is 0.
    """
    low, high = center - 0.5 * size, center + 0.5 * size
    true_low, true_high = true_center - 0.5 * true_size, true_center + 0.5 * true_size
    shared = (torch.minimum(high, true_high) - torch.maximum(low, true_low)).clamp(min=0.0).prod(-1)
    union = size.prod(-1) + true_size.prod(-1) - shared
    unit = 0.5 * true_size + _THIN
    off = torch.cat([(low - true_low) / unit, (high - true_high) / unit], dim=-1).abs().clamp(max=_FAR).mean(-1)
    return torch.where(valid, 1.0 - shared / union.clamp(min=1e-12) + 0.2 * off, 0.0)
