"""Normals of a cloud: planes through the neighbours of its points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def planes(near: Array) -> tuple[Array, Array]:
    """Summed squares (N, 3) by which neighbours (N, k, 3) spread, least first, and normals (N, 3) of either sign."""
    offset = near - near.mean(axis=1, keepdims=True)
    spread, direction = np.linalg.eigh(np.einsum("nki,nkj->nij", offset, offset))
    return spread, direction[:, :, 0]
