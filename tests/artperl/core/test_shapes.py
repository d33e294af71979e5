"""Reference shapes."""

from __future__ import annotations

import numpy as np

import artsim
from artperl.core.shapes import spread_points


def test_points_of_a_shape_are_spread_evenly() -> None:
    obj = artsim.make("laptop", 0)
    points, normals, spacing = spread_points(obj.parts[0].vertices, obj.parts[0].faces, 200, np.random.default_rng(0))
    apart = np.linalg.norm(points[:, None] - points, axis=-1) + 9.0 * np.eye(200)
    assert apart.min() > 0.4 * spacing
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    first = apart[:50, :50].min()  # a shorter list is spread as evenly
    assert first > 0.4 * 2 * spacing
