"""Maxima over the neighbours of points, compiled, with their derivatives: faster than torch's ``embedding_bag``."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.autograd.function import once_differentiable

from artsim.common.compiled import compiled


class Strongest(torch.autograd.Function):
    """(M, C) maxima of the rows of features (N, C) that indices (M, k) name; the first of equal ones has a gradient."""

    @staticmethod
    def forward(ctx: Any, features: Tensor, index: Tensor) -> Tensor:
        highest, winner = maximum(features.detach().float().contiguous().numpy(), index.numpy())
        ctx.winner, ctx.rows = winner, len(features)
        return torch.from_numpy(highest).to(features.dtype)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        back = maximum_backward(gradient.float().contiguous().numpy(), ctx.winner, ctx.rows)
        return torch.from_numpy(back).to(gradient.dtype), None


class StrongestByGathering(torch.autograd.Function):
    """What :class:`Strongest` says, on any device, with room for a row of each neighbour: for a GPU.

    torch's ``embedding_bag`` has no derivative of a maximum in bfloat16 there.
    """

    @staticmethod
    def forward(ctx: Any, features: Tensor, index: Tensor) -> Tensor:
        highest, place = features[index].max(1)
        ctx.winner, ctx.rows = index.gather(1, place), len(features)
        return highest

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        back = gradient.new_zeros(ctx.rows, gradient.shape[1], dtype=torch.float32)
        return back.scatter_add_(0, ctx.winner, gradient.float()).to(gradient.dtype), None


@compiled
def maximum(features: NDArray[np.float32], index: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """(M, C) highest of the rows of features (N, C) that indices (M, k) name, and in which row each was found first."""
    count, channels = len(index), features.shape[1]
    highest = np.empty((count, channels), np.float32)
    winner = np.empty((count, channels), np.int32)
    for query in range(count):
        first = index[query, 0]
        for channel in range(channels):
            highest[query, channel] = features[first, channel]
            winner[query, channel] = first
        for row in index[query, 1:]:
            for channel in range(channels):
                if features[row, channel] > highest[query, channel]:
                    highest[query, channel] = features[row, channel]
                    winner[query, channel] = row
    return highest, winner


@compiled
def maximum_backward(gradient: NDArray[np.float32], winner: NDArray[np.int32], rows: int) -> NDArray[np.float32]:
    """(rows, C) gradient of the features of :func:`maximum` from the gradient (M, C) of its result."""
    back = np.zeros((rows, gradient.shape[1]), np.float32)
    for query in range(len(gradient)):
        for channel in range(gradient.shape[1]):
            back[winner[query, channel], channel] += gradient[query, channel]
    return back
