"""What the network sees does not depend on the unit of length, and what stands on a table stands out."""

from __future__ import annotations

import numpy as np
import pytest

from artperl.detection.images import cell_pixels, look_at

K = np.array([[300.0, 0.0, 162.0], [0.0, 310.0, 118.0], [0.0, 0.0, 1.0]])


def table_with_block(noise: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Depth of a table that leans away from the camera, with a block on it, and where the block is."""
    v, u = np.mgrid[:240, :320] + 0.5
    y = (v - K[1, 2]) / K[1, 1]
    depth = 0.5 / (0.6 + 0.5 * y)  # of the plane 0.6 z + 0.5 y = 0.5
    block = (abs(u - 200) < 30) & (abs(v - 100) < 20)
    depth = np.where(block, 0.92 * depth, depth)
    return depth * (1.0 + noise * np.random.default_rng(0).standard_normal(depth.shape)), block


@pytest.mark.parametrize("noise", [0.0, 0.003])
def test_a_table_is_level_and_what_stands_on_it_is_above(noise: float) -> None:
    depth, block = table_with_block(noise)
    above = look_at(None, depth, K, 320).channels[4]
    assert np.abs(np.median(above[~block])) < 0.01
    assert np.median(above[block]) > 0.5


def test_a_table_wins_over_a_larger_wall_behind_it() -> None:
    depth, _ = table_with_block()
    depth[:150] = 3.0
    above = look_at(None, depth, K, 320).channels[4]
    assert np.abs(above[160:]).max() < 1e-3


def test_a_scene_ten_times_as_large_looks_the_same() -> None:
    depth, _ = table_with_block(0.002)
    depth[20:40, 30:60] = 0.0
    near, far = look_at(None, depth, K), look_at(None, 10.0 * depth, K)
    np.testing.assert_allclose(far.channels, near.channels, atol=1e-4)
    assert far.unit == pytest.approx(10.0 * near.unit)


@pytest.mark.parametrize("width", [320, 160, 128, 1000])
def test_points_are_seen_where_they_are_at_any_resolution(width: int) -> None:
    depth, _ = table_with_block()
    look = look_at(None, depth, K, width)
    seen = np.einsum("ij,hwj->hwi", K, look.points)
    u, v = seen[..., 0] / seen[..., 2], seen[..., 1] / seen[..., 2]
    assert np.allclose(u % 1.0, 0.5, atol=1e-3)
    assert np.allclose(v % 1.0, 0.5, atol=1e-3)
    np.testing.assert_allclose(depth[v.astype(int), u.astype(int)], look.points[..., 2], rtol=1e-6)
    assert look.channels.shape[2] == min(width, 320)


def test_what_was_not_measured_is_said_and_takes_the_depth_beside_it() -> None:
    depth = np.full((40, 60), 0.7)
    depth[10:20, 10:20] = np.nan
    depth[30:, 50:] = 0.0
    look = look_at(np.full((40, 60, 3), 255, np.uint8), depth, K)
    np.testing.assert_array_equal(look.channels[5] > 0, np.isfinite(depth) & (depth > 0))
    assert np.allclose(look.points[..., 2], 0.7)
    assert (look.channels[:3] == 1.0).all()


def test_every_cell_has_a_pixel() -> None:
    assert cell_pixels(8).tolist() == [2, 6]
    assert cell_pixels(9).tolist() == [2, 6, 8]
