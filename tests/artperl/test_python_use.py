"""Estimators in programs that order points, mask them, or set torch up in their own way."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import torch

from artperl.inputs import points_of_depth
from artperl.methods.estimator_files import load_estimator
from artsim.errors import ConfigError
from tests.artperl import golden

CLOUDS = [one.points.astype(np.float64) for one in golden.stored() if one.estimator == "laptop"]


@pytest.mark.parametrize("points", CLOUDS, ids=range(len(CLOUDS)))
def test_an_estimate_is_of_the_set_of_points(points: np.ndarray) -> None:
    """At most 2 mm apart; and each point keeps its part."""
    estimator, rng = load_estimator("laptop"), np.random.default_rng(4)
    known = estimator(points)
    for order in (rng.permutation(len(points)), np.arange(len(points))[::-1]):
        again = estimator(points[order])
        np.testing.assert_allclose(again.translation, known.translation, rtol=0, atol=0.002)
        np.testing.assert_allclose(again.size, known.size, rtol=0, atol=0.002)
        assert (again.part == known.part[order]).mean() > 0.99


def test_the_method_of_the_paper_takes_a_set_of_points_too() -> None:
    estimator, points = load_estimator("laptop", method="artperl"), CLOUDS[0]
    known, again = estimator(points), estimator(points[np.random.default_rng(0).permutation(len(points))])
    np.testing.assert_allclose(again.translation, known.translation, rtol=0, atol=0.002)


def test_masked_rows_are_left_out_and_said() -> None:
    estimator, points = load_estimator("laptop"), CLOUDS[0].copy()
    out = np.zeros(len(points), dtype=bool)
    out[:: len(points) // 40] = True
    kept = estimator(points[~out])
    points[out] = 5.0  # what is masked may be anything
    found = estimator(np.ma.array(points, mask=np.repeat(out[:, None], 3, axis=1)))
    np.testing.assert_array_equal(found.translation, kept.translation)
    np.testing.assert_array_equal(found.part[~out], kept.part)
    assert (found.part[out] == -1).all()
    assert f"{out.sum()} rows of the masked array are left out" in found.warnings[0]
    assert estimator(np.ma.array(CLOUDS[0])).warnings == ()


def test_masked_depth_was_not_measured() -> None:
    depth = np.ma.array(np.ones((24, 32)), mask=np.broadcast_to(np.arange(32) % 2 == 0, (24, 32)))
    K = np.array([[30.0, 0.0, 16.0], [0.0, 30.0, 12.0], [0.0, 0.0, 1.0]])
    assert len(points_of_depth(depth, K)) == 24 * 16


@pytest.fixture
def double() -> Iterator[None]:
    torch.set_default_dtype(torch.float64)
    yield
    torch.set_default_dtype(torch.float32)


@pytest.mark.parametrize("method", ["full", "artperl"])
def test_double_precision_elsewhere_changes_nothing(method: str, request: pytest.FixtureRequest) -> None:
    known = load_estimator("laptop", method=method)(CLOUDS[0])
    request.getfixturevalue("double")
    found = load_estimator("laptop", method=method)(CLOUDS[0])
    assert torch.get_default_dtype() == torch.float64
    np.testing.assert_array_equal(found.translation, known.translation)
    assert found.confidence == known.confidence


@pytest.mark.parametrize("method", ["full", "artperl"])
@pytest.mark.parametrize("device", ["cuda", "cuda:9", "mps", "bananas"])
def test_a_device_that_is_not_there_is_one_clear_error(device: str, method: str) -> None:
    if device == "cuda" and torch.cuda.is_available():
        pytest.skip("it is there")
    with pytest.raises(ConfigError, match=r"torch finds no GPU here|torch cannot work on"):
        load_estimator("laptop", method, device)
