"""Procedural textures repeat without a seam, in the tone and size that was asked for."""

from __future__ import annotations

import numpy as np
import pytest

from artsim.model.appearance.textures import TEXTURES, noise


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(TEXTURES))
def test_textures_are_pictures_of_about_their_tone_and_the_same_for_the_same_chance(name: str) -> None:
    tone = np.array([0.6, 0.5, 0.4])
    first, again, other = (TEXTURES[name](np.random.default_rng(seed), tone) for seed in (1, 1, 2))
    assert first.dtype == np.uint8
    assert first.shape == (512, 512, 3)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    if name != "screen":
        assert np.abs(first.mean(axis=(0, 1)) / 255.0 - tone).max() < 0.12


@pytest.mark.parametrize("name", sorted(set(TEXTURES) - {"screen"}))
def test_textures_repeat_without_a_seam(name: str) -> None:
    picture = TEXTURES[name](np.random.default_rng(0), (0.6, 0.5, 0.4)).astype(float)
    for axis in (0, 1):
        steps = np.abs(picture - np.roll(picture, 1, axis)).mean(axis=(1 - axis, 2))
        assert steps[0] <= 1.5 * np.sort(steps)[-8:].mean()


def test_noise_has_no_mean_unit_deviation_and_the_stretch_that_was_asked_for() -> None:
    values = noise(np.random.default_rng(0), 256, 1.0, (20.0, 1.0))
    assert values.mean() == pytest.approx(0.0, abs=1e-9)
    assert values.std() == pytest.approx(1.0)
    across, down = (np.abs(np.diff(values, axis=axis)).mean() for axis in (1, 0))
    assert down > 3 * across
