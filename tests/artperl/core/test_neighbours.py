"""Neighbours in clouds."""

from __future__ import annotations

import numpy as np
import torch

from artperl.core.neighbours import nearest_points_by_products, nearest_points_by_trees, planes


def test_trees_and_products_find_the_same_neighbours() -> None:
    generator = torch.Generator().manual_seed(1)
    points, queries = (torch.randn(3, n, 3, generator=generator) for n in (50, 20))
    by_trees, by_products = (
        sorted(zip(near[2, 7].tolist(), index[2, 7].tolist(), strict=True))
        for near, index in (nearest_points_by_trees(queries, points, 6), nearest_points_by_products(queries, points, 6))
    )
    assert [i for _, i in by_trees] == [i for _, i in by_products]
    np.testing.assert_allclose([d for d, _ in by_trees], [d for d, _ in by_products], atol=1e-5)
    torch.testing.assert_close(nearest_points_by_trees(points, points, 1)[1][..., 0], torch.arange(50).expand(3, 50))


def test_planes_are_those_of_the_least_eigenvector() -> None:
    rng = np.random.default_rng(0)
    points = rng.standard_normal((300, 3)) * [1.0, 0.3, 0.02]
    near = rng.integers(300, size=(400, 7))
    near[0] = 5  # all are one point
    spread, normal = planes(points, near)
    offset = points[near] - points[near].mean(1, keepdims=True)
    value, vector = np.linalg.eigh(np.einsum("nki,nkj->nij", offset, offset))
    np.testing.assert_allclose(spread, value, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0)
    np.testing.assert_allclose(np.abs((normal * vector[:, :, 0]).sum(1))[1:], 1.0, atol=1e-9)
