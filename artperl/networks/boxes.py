"""Boxes of the parts, from what a fitted cloud says of them: beyond the paper, whose boxes are the reference's."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from artperl.evidence import LEVELS, QUANTILES, Evidence

_THIN = 0.002
"""Half-size below which faces are no longer measured in half-sizes of their part, in diagonals."""
_FAR = 3.0
"""Half-sizes beyond which places are all alike."""
_STEP = 0.2
"""Half-sizes that an output of 1 moves a face by."""


class Boxes(nn.Module):
    """Moves the six faces of each part's box.

    Parameters
    ----------
    num_rows : int
        Rows for parts.
    width : int
        Channels for points; parts have twice as many.
    """

    def __init__(self, num_rows: int, width: int = 18):
        super().__init__()
        self.num_rows, self.width = num_rows, width
        features = 2 * width
        self.point = nn.Sequential(
            nn.Linear(11, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU(), nn.Linear(width, width)
        )
        self.face = nn.Sequential(nn.Linear(3 * len(LEVELS) + 6, 32), nn.ReLU(), nn.Linear(32, 8), nn.ReLU())
        described = 2 * width + 6 * 8 + 3 * len(QUANTILES) + 22 + num_rows
        self.part = nn.Sequential(nn.Linear(described, features), nn.ReLU(), nn.Linear(features, features), nn.ReLU())
        moves = nn.Linear(features, 6)
        nn.init.zeros_(moves.weight)
        nn.init.zeros_(moves.bias)
        self.faces = nn.Sequential(nn.Linear(4 * features, features), nn.ReLU(), moves)

    def forward(self, evidence: Evidence) -> tuple[Tensor, Tensor]:
        """Centres and sizes (B, P, 3) of the boxes, in the rest frame, in diagonals."""
        center, size = evidence.center, evidence.size
        part = self.part(self._described(evidence))
        valid = evidence.valid[..., None]
        mean = (part * valid).sum(1, keepdim=True) / valid.sum(1, keepdim=True)
        most = part.masked_fill(~valid, 0.0).amax(1, keepdim=True)
        others = [values.expand_as(part) for values in (mean, most, part[:, :1])]
        half = 0.5 * size
        move = _STEP * self.faces(torch.cat([part, *others], dim=-1)) * (half + _THIN).repeat(1, 1, 2)
        low, high = center - half + move[..., :3], center + half + move[..., 3:]
        return 0.5 * (low + high), (high - low).clamp(min=0.0)

    def _described(self, evidence: Evidence) -> Tensor:
        """(B, P, C) features of each part."""
        center, size = evidence.center, evidence.size
        P = size.shape[1]
        unit = 0.5 * size + _THIN
        offset = evidence.points[:, None] - center[:, :, None]
        local = (offset / unit[:, :, None]).clamp(-_FAR, _FAR)
        own = evidence.part[:, None] == torch.arange(P, device=size.device)[:, None]
        of_root = (evidence.part == 0)[:, None].expand_as(own)
        flags = torch.stack([own, of_root], dim=-1).to(size.dtype)
        ray = evidence.ray[:, None].expand_as(offset)
        seen = self.point(torch.cat([local, offset, flags, ray], dim=-1))
        # No part is without points of its own here: a floor stands for none.
        pooled = [seen.masked_fill(~mask[..., None], -_FAR).amax(2) for mask in (own, ~own)]
        face = torch.eye(6, device=size.device).expand(*size.shape[:2], -1, -1)
        faces = self.face(torch.cat([evidence.probes.flatten(3), face], dim=-1))
        quantiles = ((evidence.quantiles - center[:, :, None]) / unit[:, :, None]).clamp(-_FAR, _FAR)
        expected = evidence.perceived_center - center
        log_size = (size + _THIN).log()
        described = [
            *pooled,
            faces.flatten(2),
            quantiles.flatten(2),
            log_size,
            center - center[:, :1],
            log_size[:, :1].expand_as(size),
            (expected / unit).clamp(-_FAR, _FAR),
            5.0 * expected,
            (evidence.perceived_size + _THIN).log() - log_size,
            evidence.count[..., None].sqrt(),
            evidence.eye,
            torch.eye(self.num_rows, device=size.device).expand(len(size), -1, -1),
        ]
        return torch.cat(described, dim=-1)


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
