"""Readings of one surface are averaged, those of two are not, and flying pixels go."""

from __future__ import annotations

import numpy as np
import pytest

from artperl.scene.denoise import denoise

SHAPE = (60, 80)
EVERYWHERE = np.ones(SHAPE, dtype=bool)


def slanted() -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """A plane whose depth falls by a tenth across the image: 1 / z is linear in the pixel."""
    return 1.0 / (1.2 + 0.0015 * np.arange(80) + np.zeros(SHAPE))


def test_a_plane_stays_as_it_is_and_its_noise_falls_to_a_seventh() -> None:
    truth, inner = slanted(), np.s_[3:-3, 3:-3]
    assert denoise(truth, EVERYWHERE)[inner] == pytest.approx(truth[inner], rel=1e-9)
    noisy = truth + 0.002 * np.random.default_rng(0).standard_normal(SHAPE)
    left = denoise(noisy, EVERYWHERE)[inner] - truth[inner]
    assert left.std() == pytest.approx(0.002 / 7, rel=0.25)
    assert abs(left.mean()) < 1e-4


def test_two_surfaces_stay_apart_and_what_flies_between_them_goes() -> None:
    depth = np.full(SHAPE, 0.8)
    depth[:, 40:] = 0.84
    depth[:, 40] = 0.82  # as cameras report at an edge
    result = denoise(depth, EVERYWHERE)
    assert (result[:, 40] == 0).all()
    assert result[:, :40] == pytest.approx(0.8)
    assert result[:, 41:] == pytest.approx(0.84)


def test_nothing_outside_the_mask_counts() -> None:
    mask = np.zeros(SHAPE, dtype=bool)
    mask[20:40, 30:50] = True
    depth = np.where(mask, 0.8, 0.803)
    depth[25, 35] = 0.0
    depth[26, 36] = np.nan
    result = denoise(depth, mask)
    assert (result[~mask] == 0).all()
    assert result[25, 35] == result[26, 36] == 0.0
    rest = mask & (depth > 0)
    assert result[rest] == pytest.approx(0.8)
    assert not denoise(depth, ~EVERYWHERE).any()
