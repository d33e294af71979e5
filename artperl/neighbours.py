"""Nearest neighbours on the processor, by as many threads as torch has."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]


def query(
    tree: cKDTree, points: NDArray[Any], ranks: int | Sequence[int] = 1, within: float = np.inf
) -> tuple[Array, NDArray[np.int64]]:
    """(M,) or (M, k) distances and indices of the points of a tree that are nearest to points (M, D).

    Parameters
    ----------
    ranks : int or sequence of int
        How many, or which ones, 1 for the nearest; (M,) for 1, as in SciPy.
    within : float
        Neighbours that are farther away are infinitely far.
    """
    found: tuple[Array, NDArray[np.int64]] = tree.query(
        points, ranks, distance_upper_bound=within, workers=torch.get_num_threads()
    )
    return found
