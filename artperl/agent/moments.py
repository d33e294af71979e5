"""What offsets between two clouds say at once: the small motions that would make up for them.

An agent that sees points and offsets alone must learn moments, products of both, before it can tell in which direction
to turn. They have a closed form, the normal equations of Gauss and Newton, and are handed to it instead.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from artperl.agent.decision_process import View
from artperl.core.pointnet2 import exact

NUM_MOMENTS = 14
_FINEST, _LARGEST = 0.003, 0.3
_RIDGE = 0.02
"""Stiffness against turns that the points hardly tell, over the squared radius."""


@exact
def moments(view: View) -> Tensor:
    """Motions of the reference that would bring it to the observed points, to first order.

    Returns
    -------
    (B, P, 14) float
        For each part: its own turn (3) and move (3), its turn about its joint and move along it, and the turn (3) and
        move (3) of the whole; on a logarithmic scale, so that steps of every size are told apart.
    """
    P = view.valid.shape[1]
    member = functional.one_hot(view.part, P).to(view.observed.dtype).transpose(1, 2)  # (B, P, N)
    every = torch.ones_like(member[:, :1])
    turn, move = _rigid(view, member)
    whole_turn, whole_move = _rigid(view, every)
    axis, anchor = view.joint[..., :3], view.joint[..., 3:]
    lever = torch.linalg.cross(
        axis[:, :, None].expand(-1, -1, view.observed.shape[1], -1), view.observed[:, None] - anchor[:, :, None]
    )
    square = (member * lever.square().sum(-1)).sum(2)
    angle = -(member * (lever * view.offset[:, None]).sum(-1)).sum(2) / (square + _RIDGE * member.sum(2) + 1e-6)
    along = (axis * move).sum(-1)
    steps = [turn, move, torch.stack([angle, along], dim=-1)]
    steps += [whole.expand(-1, P, -1) for whole in (whole_turn, whole_move)]
    values = torch.cat(steps, dim=-1)
    return values.sign() * (1.0 + values.abs() / _FINEST).log() / torch.tensor(1.0 + _LARGEST / _FINEST).log()


def _rigid(view: View, member: Tensor) -> tuple[Tensor, Tensor]:
    """(B, P, 3) turns about the middle of each set of points, and moves of that."""
    count = member.sum(2, keepdim=True)
    share = member / count.clamp(min=1.0)
    middle = share @ view.observed
    wanted = -view.offset  # a reference point is to go from observed + offset to observed
    move = share @ wanted
    torque = share @ torch.linalg.cross(view.observed, wanted) - torch.linalg.cross(middle, move)
    second = torch.einsum("bpn,bni,bnj->bpij", share, view.observed, view.observed)
    second = second - middle[..., :, None] * middle[..., None, :]
    spread = second.diagonal(dim1=-2, dim2=-1).sum(-1)
    eye = torch.eye(3, dtype=second.dtype, device=second.device)
    inertia = spread[..., None, None] * eye - second
    turn = torch.linalg.solve(inertia + (_RIDGE * spread + 1e-6)[..., None, None] * eye, torque[..., None])[..., 0]
    return turn, move
