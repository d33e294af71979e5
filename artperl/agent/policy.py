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
from artperl.agent.moments import NUM_MOMENTS, moments
from artperl.core.pose import KINDS

_HEADS = {"free": 0, "revolute": 1, "continuous": 1, "prismatic": 2, "screw": 1, "fixed": 3}
"""Head of each kind of joint."""
_OF_JOINT = 6 + 2 + 1
"""Numbers that tell a joint: axis and anchor, place in its range and the range; and the part's share of the points."""

_DIFFERENCE = 4.0
"""A turn of ten degrees changes features by about a quarter of their size."""


class Policy(nn.Module):
    """Policy and value, from a description of each part.

    Parameters
    ----------
    width : int
        Channels of the first layer of the encoders.
    described : int
        Numbers by which :meth:`describe` tells a part.
    """

    head_of: Tensor

    def __init__(self, width: int, described: int):
        super().__init__()
        self.width = width
        self.kind = nn.Embedding(len(KINDS), 16)
        self.part = nn.Sequential(nn.Linear(described + 16 + _OF_JOINT, 256), nn.ReLU(), nn.Linear(256, 128), nn.ReLU())
        self.whole = nn.Sequential(nn.Linear(128, 128), nn.ReLU())
        self.local = nn.Sequential(nn.Linear(384, 128), nn.ReLU())
        self.heads = nn.Linear(128, (max(_HEADS.values()) + 1) * NUM_AXES * NUM_BINS)
        self.value = nn.Sequential(nn.Linear(128, 64), nn.ReLU(), nn.Linear(64, 1))
        self.register_buffer("head_of", torch.tensor([_HEADS[kind] for kind in KINDS]), persistent=False)

    def describe(self, view: View) -> tuple[list[Tensor], Tensor, list[Tensor]]:
        """What comes before, of, and after a part's joint (B, P, ...) in its description; the share of its points."""
        raise NotImplementedError

    def forward(self, view: View) -> tuple[Tensor, Tensor]:
        """Logits (B, P, 9, 11) of the bins, and value (B,)."""
        B, P = view.valid.shape
        seen, share, more = self.describe(view)
        joint = [self.kind(view.kind), view.joint.clamp(-4, 4), view.state, share]
        part = self.part(torch.cat([*seen, *joint, *more], -1))
        valid = view.valid[..., None]
        whole = self.whole(part.masked_fill(~valid, -torch.inf).amax(1))
        above = part.gather(1, view.parent[..., None].expand(-1, -1, part.shape[-1]))
        local = self.local(torch.cat([part, above, whole[:, None].expand(-1, P, -1)], dim=-1))
        logits = self.heads(local).reshape(B, P, -1, NUM_AXES, NUM_BINS)
        head = self.head_of[view.kind][..., None, None, None].expand(-1, -1, 1, NUM_AXES, NUM_BINS)
        return logits.gather(2, head)[:, :, 0].float(), self.value(whole)[:, 0].float()


class StatePolicy(Policy):
    """The paper's policy: the state is the observed cloud's features beside the reference's, by one encoder.

    What is to be done stands in the difference of both, which is small beside either: it is told apart, and enlarged.

    Parameters
    ----------
    width : int
    """

    def __init__(self, width: int = 64):
        features = 2 * width
        super().__init__(width, 6 * features)
        self.encoder = nn.Sequential(_encoder(3, width, features), nn.Linear(features, features), nn.ReLU())

    def describe(self, view: View) -> tuple[list[Tensor], Tensor, list[Tensor]]:
        seen = self.encoder(view.observed)
        mean, top, share = _pool_parts(seen, view.part, view.valid.shape[1])
        have, shown = self.encoder(view.reference), view.shown[..., None]
        count = shown.sum(2).clamp(min=1)
        # Features are not negative, so that 0 stands for points that do not count.
        have = have * shown
        observed, reference = torch.cat([mean, top], -1), torch.cat([have.sum(2) / count, have.amax(2)], -1)
        return [observed, reference, _DIFFERENCE * (observed - reference)], share, []


class Agent(Policy):
    """A policy whose points know the nearest ones of the other cloud, and what their offsets say at once.

    Parameters
    ----------
    width : int
    """

    def __init__(self, width: int = 64):
        features = 2 * width
        super().__init__(width, 4 * features + NUM_MOMENTS)
        self.observed = _encoder(6, width, features)
        self.reference = _encoder(6, width, features)

    def describe(self, view: View) -> tuple[list[Tensor], Tensor, list[Tensor]]:
        seen = self.observed(torch.cat([view.observed, view.offset], dim=-1))
        have = self.reference(torch.cat([view.reference, view.back], dim=-1))
        mean, top, share = _pool_parts(seen, view.part, view.valid.shape[1])
        return [mean, top, have.mean(2), have.amax(2)], share, [moments(view)]


def _encoder(inputs: int, width: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(nn.Linear(inputs, width), nn.ReLU(), nn.Linear(width, outputs), nn.ReLU())


def _pool_parts(features: Tensor, part: Tensor, rows: int) -> tuple[Tensor, Tensor, Tensor]:
    """Mean, maximum (B, P, C) of each part's points, and its share of all points (B, P, 1).

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
    return mean, top.reshape(B, rows, C), count / N
