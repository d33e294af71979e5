"""The nearest points, compared with SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from artperl.core.kd_tree import KDTree


@given(count=st.integers(1, 400), asked=st.integers(1, 12), plane=st.booleans(), seed=st.integers(0, 99))
def test_they_are_those_that_scipy_finds(count: int, asked: int, plane: bool, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((count, 2 if plane else 3)) * rng.choice([0.0, 1.0, 1e-3], 2 if plane else 3)
    queries = np.concatenate([points, rng.standard_normal((20, points.shape[1]))])
    apart = cKDTree(points).query(queries, range(1, asked + 1))[0]
    squared, index = KDTree.of(points).nearest(queries, asked)
    np.testing.assert_allclose(np.sqrt(squared), apart, atol=1e-12)
    known = index < count
    assert (known.sum(1) == min(asked, count)).all()
    assert all(len(set(row[here])) == here.sum() for row, here in zip(index, known, strict=True))
    own = np.linalg.norm(queries[:, None] - points[np.minimum(index, count - 1)], axis=-1)
    np.testing.assert_allclose(own[known], apart[known], atol=1e-12)


@pytest.mark.parametrize("spread", [1.0, 1e-9, 0.0])
def test_points_that_coincide_or_are_far_off_are_found(spread: float) -> None:
    rng = np.random.default_rng(0)
    points = np.concatenate([spread * rng.standard_normal((500, 3)), [[1e8, 0.0, 0.0]]])
    squared, index = KDTree.of(points).nearest(points[-1:] + 1.0, 1)
    assert index[0, 0] == 500
    assert squared[0, 0] == pytest.approx(3.0)


def test_points_beyond_a_distance_are_none() -> None:
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    squared, index = KDTree.of(points).nearest(np.array([[0.25, 0.0, 0.0]]), 2, within=0.5)
    assert squared.tolist() == [[0.0625, np.inf]]
    assert index.tolist() == [[0, 2]]
