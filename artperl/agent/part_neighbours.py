"""The nearest points of the same part, from an observed cloud to a posed reference and back."""

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from artsim.common.compiled import compiled

Single = NDArray[np.float32]
Index = NDArray[np.int64]


class PartNeighbours(NamedTuple):
    """Nearest points of the same part; where a part has none, index 0 and an infinite distance.

    Attributes
    ----------
    there_index : (B, N) int64
        Of each observed point: number of the nearest of the M points of its part.
    there_distance : (B, N) float
    back_index : (B, P, M) int64
        Of each point of the reference: number of the nearest observed point of its part.
    back_distance : (B, P, M) float
    """

    there_index: Tensor
    there_distance: Tensor
    back_index: Tensor
    back_distance: Tensor


def nearest_of_part(points: Tensor, part: Tensor, reference: Tensor, shown: Tensor) -> PartNeighbours:
    """For points (B, N, 3) of parts (B, N) and a reference (B, P, M, 3) of which points (B, P, M) are shown.

    Points that are not shown are nearest to nothing, but the nearest observed point of each is told.
    """
    if points.device.type != "cpu":
        return _by_torch(points, part, reference, shown)
    arrays = points.float().numpy(), part.numpy(), reference.float().numpy(), shown.numpy()
    found = [_nearest(*one) for one in zip(*arrays, strict=True)]
    there_index, there, back_index, back = (torch.from_numpy(np.stack(own)) for own in zip(*found, strict=True))
    return PartNeighbours(there_index, there.to(points.dtype), back_index, back.to(points.dtype))


def _by_torch(points: Tensor, part: Tensor, reference: Tensor, shown: Tensor) -> PartNeighbours:
    B, P, M, _ = reference.shape
    same = part[:, :, None] == torch.arange(P, device=part.device).repeat_interleave(M)
    apart = torch.cdist(points, reference.flatten(1, 2), compute_mode="donot_use_mm_for_euclid_dist")
    there, to = apart.masked_fill(~(same & shown.flatten(1)[:, None]), torch.inf).min(2)
    back, of = apart.masked_fill(~same, torch.inf).min(1)
    to = torch.where(torch.isfinite(there), to % M, 0)
    of = torch.where(torch.isfinite(back), of, 0)
    return PartNeighbours(to, there, of.reshape(B, P, M), back.reshape(B, P, M))


@compiled
def _nearest(
    points: Single, part: Index, reference: Single, shown: NDArray[np.bool_]
) -> tuple[Index, Single, Index, Single]:
    """Of one object. Points of a part stand side by side, so that distances from one are found in wide registers."""
    N, (P, M, _) = len(points), reference.shape
    there_index, there = np.zeros(N, dtype=np.int64), np.full(N, np.inf, dtype=np.float32)
    back_index, back = np.zeros((P, M), dtype=np.int64), np.full((P, M), np.inf, dtype=np.float32)
    own, cloud = np.empty((3, M), dtype=np.float32), np.empty((3, N), dtype=np.float32)
    member, facing = np.empty(N, dtype=np.int64), np.empty((3, M), dtype=np.float32)
    number = np.empty(M, dtype=np.int64)
    apart = np.empty(max(N, M), dtype=np.float32)
    for k in range(P):
        count = 0
        for n in range(N):
            if part[n] == k:
                member[count] = n
                for i in range(3):
                    cloud[i, count] = points[n, i]
                count += 1
        if count == 0:
            continue
        some = 0
        for m in range(M):
            if shown[k, m]:
                number[some] = m
                for i in range(3):
                    facing[i, some] = reference[k, m, i]
                some += 1
            for i in range(3):
                own[i, m] = reference[k, m, i]
        for j in range(count if some else 0):
            n = member[j]
            nearest, square = _least(facing, some, cloud[0, j], cloud[1, j], cloud[2, j], apart)
            there_index[n], there[n] = number[nearest], np.sqrt(square)
        for m in range(M):
            nearest, square = _least(cloud, count, own[0, m], own[1, m], own[2, m], apart)
            back_index[k, m], back[k, m] = member[nearest], np.sqrt(square)
    return there_index, there, back_index, back


@compiled
def _least(
    others: Single, count: int, x: np.float32, y: np.float32, z: np.float32, apart: Single
) -> tuple[int, np.float32]:
    """Which of some points (3, :count) is nearest, and its squared distance.

    Bits of numbers that are not negative, taken for whole numbers, are in their order. Least whole numbers are found in
    wide registers.
    """
    bits = apart.view(np.int32)
    for m in range(count):
        dx, dy, dz = others[0, m] - x, others[1, m] - y, others[2, m] - z
        apart[m] = dx * dx + dy * dy + dz * dz
    least = np.int32(2**31 - 1)
    for m in range(count):
        least = min(least, bits[m])
    nearest = 0
    while bits[nearest] != least:
        nearest += 1
    return nearest, apart[nearest]
