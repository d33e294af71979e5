"""The fitting agent: one policy for every tree (ArtPERL, section 4.3).

A policy describes each part by its observed points and by the reference's, with the gaps between them, as the root
stands and as the part itself does. The head of a part reads this, what is known of its joint, the same of its parent,
whose own error its joint is not to make up for, and the whole object. Weights are shared by all parts, with one head
for each type of joint, so that the number of parts is not built in.
"""

import torch
from torch import Tensor, nn
from torch.nn import functional

from artperl.agent.actions import BINS, NUM_AXES
from artperl.agent.decision_process import View
from artperl.core.trees import KINDS

_HEADS = {"free": 0, "revolute": 1, "continuous": 1, "prismatic": 2, "screw": 1, "fixed": 3}
"""Head of each kind of joint."""
_OF_POINT = 16 + 15 + 4
"""Numbers that tell a point: as the root stands, as its part stands, and along its joint."""
_OF_JOINT = 16 + 3 + 3 + 2 + 1 + 1 + 1 + 3
"""Numbers that tell a joint: kind, axis, anchor, place in its range and the range; the part's share of the points, its
turn, the steps that are left, and where the object is seen from."""
_FAR = 4.0
"""Radii beyond which places and gaps count as that far."""
_WIDTH_OF_CHOICE = 0.35
"""Standard deviation of an action about the agent's mean, on the scale that errors are counted on."""


class Policy(nn.Module):
    """Policy and value.

    On each axis the policy chooses a bin by a normal distribution of fixed width over the bins, about the mean that the
    network says. Its most likely action is the bin nearest to the mean.

    Parameters
    ----------
    width : int
        Channels of the first layer of the encoders.
    """

    head_of: Tensor

    def __init__(self, width: int = 48):
        super().__init__()
        self.width = width
        features = 2 * width
        self.observed, self.reference = (
            nn.Sequential(nn.Linear(_OF_POINT, width), nn.ReLU(), nn.Linear(width, features), nn.ReLU())
            for _ in range(2)
        )
        self.kind = nn.Embedding(len(KINDS), 16)
        self.part = nn.Sequential(nn.Linear(4 * features + _OF_JOINT, 256), nn.ReLU(), nn.Linear(256, 128), nn.ReLU())
        self.local = nn.Sequential(nn.Linear(512, 256), nn.ReLU(), nn.Linear(256, 128), nn.ReLU())
        self.heads = nn.Linear(128, (max(_HEADS.values()) + 1) * NUM_AXES)
        self.value = nn.Sequential(nn.Linear(257, 128), nn.ReLU(), nn.Linear(128, 1))
        self.register_buffer("head_of", torch.tensor([_HEADS[kind] for kind in KINDS]), persistent=False)

    def forward(self, view: View) -> tuple[Tensor, Tensor]:
        """Logits (B, P, 9, 11) of the bins, and value (B,)."""
        B, P = view.valid.shape
        observed, share = _pool_parts(self.observed(_of_observed(view)), view.part, P)
        known = torch.cat(
            [self.kind(view.kind), view.axis, view.anchor.clamp(-_FAR, _FAR), view.state, share,
             view.turn[..., None].float(), view.left[:, None].expand(-1, P, -1), view.sight[:, None].expand(-1, P, -1)],
            -1,
        )  # fmt: skip
        part = self.part(torch.cat([observed, self._pool_reference(view), known], -1))
        valid = view.valid[..., None]
        mean = (part * valid).sum(1) / valid.sum(1)
        whole = torch.cat([mean, (part * valid).amax(1)], -1)  # features are not negative
        above = part.gather(1, view.parent[..., None].expand(-1, -1, part.shape[-1]))
        local = self.local(torch.cat([part, above, whole[:, None].expand(-1, P, -1)], dim=-1))
        heads = self.heads(local).reshape(B, P, -1, NUM_AXES)
        chosen = self.head_of[view.kind][..., None, None].expand(-1, -1, 1, NUM_AXES)
        means = heads.gather(2, chosen)[:, :, 0].float()
        # The value reads what the policy has found, and does not change it.
        value = self.value(torch.cat([whole.detach(), view.left], -1))[:, 0].float()
        return logits_about(means), value

    def _pool_reference(self, view: View) -> Tensor:
        """(B, P, 4 W) mean and maximum of each part of the reference."""
        shown = view.shown[..., None]
        # Features are not negative, so that 0 stands for points that do not count.
        features = self.reference(_of_reference(view)) * shown
        return torch.cat([features.sum(2) / shown.sum(2).clamp(min=1), features.amax(2)], -1)


def logits_about(mean: Tensor) -> Tensor:
    """(..., 11) logits of the bins by a normal distribution about means (...)."""
    return -0.5 * ((BINS.to(mean) - mean[..., None]) / _WIDTH_OF_CHOICE).square()


def _of_observed(view: View) -> Tensor:
    """(B, N, F) what is told of the observed points."""
    P, part = view.valid.shape[1], view.part
    rows = torch.arange(len(part), device=part.device)[:, None] * P + part
    frame, axis, anchor = (values.flatten(0, 1)[rows] for values in (view.frame, view.axis, view.anchor))
    return _features(view.observed, view.gap, view.gap_normal, frame, axis, anchor)


def _of_reference(view: View) -> Tensor:
    """(B, P, M, F) what is told of the reference's points."""
    M = view.reference.shape[2]
    frame, axis, anchor = (
        values[:, :, None].expand(-1, -1, M, *values.shape[2:]) for values in (view.frame, view.axis, view.anchor)
    )
    return _features(view.reference, view.reference_gap, view.normal, frame, axis, anchor)


def _features(point: Tensor, gap: Tensor, normal: Tensor, frame: Tensor, axis: Tensor, anchor: Tensor) -> Tensor:
    """Places, gaps and normals, and the moments of the last two, in the root's axes and in the part's, (..., F)."""
    point, gap = point.clamp(-_FAR, _FAR), gap.clamp(-_FAR, _FAR)
    arm = (point - anchor).clamp(-_FAR, _FAR)
    across = (gap * normal).sum(-1, keepdim=True)
    turning, facing = torch.linalg.cross(arm, gap), torch.linalg.cross(arm, normal)
    own = torch.stack([arm, gap, normal, turning, facing], dim=-2) @ frame  # rows times a rotation turn back
    along = torch.stack([turning, gap, facing, arm], dim=-2) @ axis[..., None]
    from_root = torch.linalg.cross(point, gap), torch.linalg.cross(point, normal)
    return torch.cat([point, gap, normal, *from_root, across, own.flatten(-2), along[..., 0]], dim=-1)


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
