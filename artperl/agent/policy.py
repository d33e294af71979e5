"""The fitting agent: one policy for every tree (ArtPERL, section 4.3).

A policy describes each part by its observed points and by the reference's. The head of a part reads this, what is known
of its joint, the same of its parent, whose own error its joint is not to make up for, and the whole object. Weights are
shared by all parts, with one head for each type of joint, so that the number of parts is not built in.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from artperl.agent.actions import NUM_AXES, NUM_BINS
from artperl.agent.decision_process import View
from artperl.core.trees import KINDS

_HEADS = {"free": 0, "revolute": 1, "continuous": 1, "prismatic": 2, "screw": 1, "fixed": 3}
"""Head of each kind of joint."""
_OF_JOINT = 6 + 2 + 1
"""Numbers that tell a joint: axis and anchor, place in its range and the range; and the part's share of the points."""

_DIFFERENCE = 4.0
"""A turn of ten degrees changes features by about a quarter of their size."""


class Policy(nn.Module):
    """Policy and value: the state is the observed cloud's features beside the reference's, by one encoder.

    What is to be done stands in the difference of both, which is small beside either: it is told apart, and enlarged.

    Parameters
    ----------
    width : int
        Channels of the first layer of the encoder.
    """

    head_of: Tensor

    def __init__(self, width: int = 64):
        super().__init__()
        self.width = width
        features = 2 * width
        described = 6 * features + 16 + _OF_JOINT
        self.kind = nn.Embedding(len(KINDS), 16)
        self.part = nn.Sequential(nn.Linear(described, 256), nn.ReLU(), nn.Linear(256, 128), nn.ReLU())
        self.whole = nn.Sequential(nn.Linear(128, 128), nn.ReLU())
        self.local = nn.Sequential(nn.Linear(384, 128), nn.ReLU())
        self.heads = nn.Linear(128, (max(_HEADS.values()) + 1) * NUM_AXES * NUM_BINS)
        self.value = nn.Sequential(nn.Linear(128, 64), nn.ReLU(), nn.Linear(64, 1))
        self.encoder = nn.Sequential(
            nn.Linear(3, width), nn.ReLU(), nn.Linear(width, features), nn.ReLU(), nn.Linear(features, features),
            nn.ReLU(),
        )  # fmt: skip
        self.register_buffer("head_of", torch.tensor([_HEADS[kind] for kind in KINDS]), persistent=False)

    def forward(self, view: View) -> tuple[Tensor, Tensor]:
        """Logits (B, P, 9, 11) of the bins, and value (B,)."""
        B, P = view.valid.shape
        observed, share = _pool_parts(self.encoder(view.observed), view.part, P)
        reference = self._pool_reference(view)
        part = self.part(
            torch.cat(
                [observed, reference, _DIFFERENCE * (observed - reference), self.kind(view.kind),
                 view.joint.clamp(-4, 4), view.state, share], -1
            )
        )  # fmt: skip
        valid = view.valid[..., None]
        whole = self.whole(part.masked_fill(~valid, -torch.inf).amax(1))
        above = part.gather(1, view.parent[..., None].expand(-1, -1, part.shape[-1]))
        local = self.local(torch.cat([part, above, whole[:, None].expand(-1, P, -1)], dim=-1))
        logits = self.heads(local).reshape(B, P, -1, NUM_AXES, NUM_BINS)
        head = self.head_of[view.kind][..., None, None, None].expand(-1, -1, 1, NUM_AXES, NUM_BINS)
        return logits.gather(2, head)[:, :, 0].float(), self.value(whole)[:, 0].float()

    def _pool_reference(self, view: View) -> Tensor:
        """(B, P, 2 C) mean and maximum of each part of the reference."""
        shown = view.shown[..., None]
        # Features are not negative, so that 0 stands for points that do not count.
        features = self.encoder(view.reference) * shown
        return torch.cat([features.sum(2) / shown.sum(2).clamp(min=1), features.amax(2)], -1)


def _pool_parts(features: Tensor, part: Tensor, rows: int) -> tuple[Tensor, Tensor]:
    """(B, P, 2 C) mean and maximum of each part's points, and its share of all points (B, P, 1).

    Products and bags, since scattering is several times slower, above all backwards.
    """
    B, N, C = features.shape
    member = functional.one_hot(part, rows).to(features.dtype).transpose(1, 2)
    count = member.sum(2, keepdim=True)
    mean = (member @ features) / count.clamp(min=1.0)
    first = torch.arange(B, device=part.device)[:, None]
    order = (part.argsort(dim=1) + first * N).flatten()
    ends = count[..., 0].long().flatten().cumsum(0)
    begins = ends - count[..., 0].long().flatten()
    top = functional.embedding_bag(order, features.reshape(B * N, C), begins, mode="max")
    return torch.cat([mean, top.reshape(B, rows, C)], -1), count / N
