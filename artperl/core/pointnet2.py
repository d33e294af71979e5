"""PointNet++ for unordered clouds (Qi et al., 2017), arranged to be fast on a CPU.

Who is whose neighbour is worked out once for each cloud and shared by every layer and head. The first layer of each
edge MLP is decomposed: ``W (f_j, x_j - x_i) = (W_f f_j + W_x x_j) - W_x x_i``, so that its matrix products run once for
each point, and only sums and a maximum once for each edge.

Clouds come in random order (as artsim's do), so the first points of a cloud are a random sample of it: they serve as
the centres of the coarser levels. Levels and neighbourhoods are shares of a cloud, so that they reach as far in a dense
cloud as in a sparse one: weights that learnt from 1,024 points read 2,048 at once, and see finer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from itertools import pairwise
from typing import TypeVar

import torch
from torch import Tensor, nn
from typing_extensions import ParamSpec

from artperl.core.edge_kernels import Strongest, StrongestByGathering
from artperl.core.neighbours import nearest_points

P = ParamSpec("P")
R = TypeVar("R")

_COARSER = 4
"""Each level has so many times fewer points than the one before."""
_NEIGHBOURHOOD = 64
"""A neighbourhood holds this part of a cloud's points, 16 of 1,024 ..."""
_FEWEST = 8
"""... but no fewer than these."""


def exact(function: Callable[P, R]) -> Callable[P, R]:
    """A function whose matrix products keep single precision when those around it do not."""

    @wraps(function)
    def inner(*args: P.args, **kwargs: P.kwargs) -> R:
        with torch.autocast("cpu", enabled=False), torch.autocast("cuda", enabled=False):
            return function(*args, **kwargs)

    return inner


@dataclass(frozen=True)
class Neighbourhoods:
    """Neighbours in B clouds at every level. Level 0 is the cloud itself; level l has ``sizes[l]`` of its points."""

    points: list[Tensor]
    """list of (B, N_l, 3) float."""
    down: list[Tensor]
    """list of (B, N_l+1, k) int64. For each centre of level l + 1, its nearest points of level l."""
    up: list[tuple[Tensor, Tensor]]
    """list of pairs (B, N_l, 3) float and (B, N_l, 3) int64. For each point of level l, its three nearest centres of
    level l + 1, and weights that fall with distance."""

    @staticmethod
    @torch.no_grad()
    @exact
    def of(points: Tensor, sizes: Sequence[int], neighbours: Sequence[int]) -> Neighbourhoods:
        """Neighbourhoods of (B, N, 3) clouds in random order, with ``sizes`` points at the coarser levels.

        Each of these has so many neighbours.
        """
        levels, down, up = [points], [], []
        for size, count in zip(sizes, neighbours, strict=True):
            fine = levels[-1]
            coarse = fine[:, :size]
            down.append(nearest_points(coarse, fine, min(count, fine.shape[1]))[1])
            squared, index = nearest_points(fine, coarse, min(3, coarse.shape[1]))
            weight = 1.0 / (squared + 1e-8)
            up.append((weight / weight.sum(2, keepdim=True), index))
            levels.append(coarse)
        return Neighbourhoods(levels, down, up)


def strongest(features: Tensor, index: Tensor) -> Tensor:
    """(B, M, C) maxima of the rows of features (B, N, C) that indices (B, M, k) name."""
    every, flat = _flat(features, index)
    kernel = StrongestByGathering if features.is_cuda else Strongest
    best: Tensor = kernel.apply(every, flat)  # type: ignore[no-untyped-call]
    return best.reshape(*index.shape[:2], -1)


def interpolate(features: Tensor, weight: Tensor, index: Tensor) -> Tensor:
    """(B, N, C) sums, with weights (B, N, k), of the rows of features (B, M, C) that indices (B, N, k) name."""
    if features.is_cuda:  # a product with a dense matrix is faster backwards
        return weight.new_zeros(*weight.shape[:2], features.shape[1]).scatter_(2, index, weight) @ features
    every, flat = _flat(features, index)
    total = (every[flat] * weight.flatten(0, 1)[..., None]).sum(1)
    return total.to(features.dtype).reshape(*index.shape[:2], -1)


def _flat(features: Tensor, index: Tensor) -> tuple[Tensor, Tensor]:
    """Rows of all clouds one after the other, and indices of these."""
    B, N, C = features.shape
    flat = index + torch.arange(B, device=index.device)[:, None, None] * N
    return features.reshape(B * N, C), flat.flatten(0, 1)


class SetAbstraction(nn.Module):
    """Features of coarse centres from the edges to their neighbours: decomposed edge layer, maximum, dense layer."""

    def __init__(self, inputs: int, outputs: int):
        super().__init__()
        self.features = nn.Linear(inputs, outputs)
        self.positions = nn.Linear(3, outputs, bias=False)
        self.dense = nn.Sequential(nn.LayerNorm(outputs), nn.Linear(outputs, outputs), nn.ReLU())

    def forward(self, features: Tensor, fine: Tensor, coarse: Tensor, index: Tensor, radius: float) -> Tensor:
        """(B, M, outputs); positions are taken over ``radius``, the typical reach of a neighbourhood."""
        point_term = self.features(features) + self.positions(fine / radius)
        return self.dense(torch.relu(strongest(point_term, index) - self.positions(coarse / radius)))


class FeaturePropagation(nn.Module):
    """Features of fine points from coarse ones (inverse-distance weights) and from their own."""

    def __init__(self, coarse: int, fine: int, outputs: int):
        super().__init__()
        self.coarse = nn.Linear(coarse, outputs)
        self.fine = nn.Linear(fine, outputs, bias=False)
        self.dense = nn.Sequential(nn.LayerNorm(outputs), nn.ReLU(), nn.Linear(outputs, outputs), nn.ReLU())

    def forward(self, coarse: Tensor, fine: Tensor, weight: Tensor, index: Tensor) -> Tensor:
        """(B, N, outputs) from coarse (B, M, C) and fine (B, N, C') features, and each point's (B, N, k) centres."""
        return self.dense(interpolate(self.coarse(coarse), weight, index) + self.fine(fine))


class PointNet2(nn.Module):
    """Encoder and decoder: a feature for each point, and one for the whole cloud.

    Parameters
    ----------
    width : int
        Channels of the finest level; they double from level to level.
    levels : int
        Coarser levels, each with a quarter of the points of the one before.
    """

    def __init__(self, width: int = 48, levels: int = 3):
        super().__init__()
        channels = [width * 2**level for level in range(levels + 1)]
        self.stem = nn.Sequential(nn.Linear(3, width), nn.ReLU())
        self.down = nn.ModuleList(SetAbstraction(a, b) for a, b in pairwise(channels))
        self.whole = nn.Sequential(nn.Linear(channels[-1], channels[-1]), nn.ReLU())
        above = [2 * channels[-1], *channels[-2:0:-1]]
        self.up = nn.ModuleList(
            FeaturePropagation(coarse, fine, fine) for coarse, fine in zip(above, channels[-2::-1], strict=True)
        )
        self.point_channels, self.cloud_channels = width, channels[-1]

    def forward(self, points: Tensor, standard: int = 0) -> tuple[Tensor, Tensor]:
        """Features of clouds.

        A cloud with fewer points than the standard gives the features of one that repeats its points until there are so
        many: the coarser levels keep as many points as they can, and neighbourhoods reach as far.

        Parameters
        ----------
        points : (B, N, 3) float
            Centred, of unit radius, in random order.
        standard : int
            Points that clouds have as a rule.

        Returns
        -------
        (B, N, point_channels) and (B, cloud_channels)
        """
        count = points.shape[1]
        full = max(count, standard)
        neighbours = max(_FEWEST, full // _NEIGHBOURHOOD)
        nominal = [max(1, full // _COARSER**level) for level in range(len(self.down) + 1)]
        sizes = [min(count, size) for size in nominal]
        own = [max(1, round(neighbours * size / most)) for size, most in zip(sizes[:-1], nominal[:-1], strict=True)]
        near = Neighbourhoods.of(points, sizes[1:], own)
        features = [self.stem(points)]
        for level, layer in enumerate(self.down):
            radius = (neighbours / nominal[level]) ** 0.5
            features.append(layer(features[-1], near.points[level], near.points[level + 1], near.down[level], radius))
        cloud = self.whole(features[-1]).amax(1)
        decoded = torch.cat([features[-1], cloud[:, None].expand(-1, features[-1].shape[1], -1)], dim=-1)
        for step, layer in enumerate(self.up):
            level = len(self.up) - 1 - step
            decoded = layer(decoded, features[level], *near.up[level])
        return decoded, cloud
