"""Nearest neighbours against all distances."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from artperl.neighbours import query


@pytest.mark.parametrize("threads", [1, 2])
def test_the_nearest_are_nearest_by_any_number_of_threads(threads: int) -> None:
    rng = np.random.default_rng(0)
    cloud, points = rng.normal(size=(300, 3)), rng.normal(size=(200, 3))
    apart = np.linalg.norm(points[:, None] - cloud[None], axis=-1)
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        second, third = query(cKDTree(cloud), points, [2, 3])[0].T
        index = query(cKDTree(cloud), points)[1]
        near = query(cKDTree(cloud), points, within=0.2)[0]
    finally:
        torch.set_num_threads(before)
    np.testing.assert_allclose(np.stack([second, third]), np.sort(apart)[:, 1:3].T)
    np.testing.assert_array_equal(index, apart.argmin(1))
    np.testing.assert_array_equal(np.isfinite(near), apart.min(1) < 0.2)
