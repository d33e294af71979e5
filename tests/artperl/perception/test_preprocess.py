"""Which points of a cloud show the object."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from artperl.core.clouds import draw
from artperl.perception.preprocess import Cloud, clean
from artsim.errors import ArtsimError


def test_outliers_are_left_out_and_the_object_is_not() -> None:
    rng = np.random.default_rng(0)
    cloud = rng.uniform(size=(3000, 3)) * [1.0, 1.0, 0.01]
    kept = clean(np.concatenate([cloud, rng.uniform(5.0, 50.0, size=(30, 3))]))
    assert (kept < 3000).all()
    assert len(kept) > 2990


@pytest.mark.parametrize("away", [3.0, 1e3, 1e6])
@pytest.mark.parametrize(("together", "kept"), [(1, False), (3, False), (4, True), (9, True)])
def test_points_belong_to_the_object_from_four_together_however_far_away(
    away: float, together: int, kept: bool
) -> None:
    rng = np.random.default_rng(0)
    blob = rng.random((3000, 3))
    few = np.full((together, 3), away) + rng.random((together, 3)) * 0.01
    found = clean(np.concatenate([few, blob]))
    assert np.isin(np.arange(together), found).all() == np.isin(np.arange(together), found).any() == kept
    assert len(found) >= 2990


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf, -np.inf, 3.4028235e38, 1e300])
@pytest.mark.filterwarnings("error")
def test_what_sensors_write_for_no_measurement_is_no_point_of_the_object(value: float) -> None:
    blob = np.random.default_rng(0).random((3000, 3)) + 1.0
    found = clean(np.concatenate([np.full((500, 3), value), blob]))
    assert found.min() >= 500
    assert len(found) >= 2990
    axis = np.concatenate([blob, [[0.0, 0.0, 1.0]] * 20])  # the camera's own axis is not its origin
    assert len(clean(axis)) >= 3010


@pytest.mark.parametrize("points", [[["a"] * 3] * 9, [[1j] * 3] * 9, [[1.0, 2.0], [1.0]], np.ones((9, 2)), 3.0])
def test_what_is_no_cloud_is_refused(points: object) -> None:
    with pytest.raises(ArtsimError, match="no cloud"):
        clean(points)  # type: ignore[arg-type]


def test_a_thin_leg_of_a_few_points_is_no_outlier() -> None:
    plate = np.random.default_rng(0).uniform(size=(2000, 3)) * [1.0, 1.0, 0.0]
    leg = np.array([0.5, 0.5, -0.06]) * [[1.0, 1.0, n] for n in range(1, 7)]
    assert len(clean(np.concatenate([plate, leg]))) == 2006


def test_draws_take_every_point_before_any_twice() -> None:
    rng = np.random.default_rng(0)
    assert sorted(draw(10, 10, rng)) == list(range(10))
    assert np.bincount(draw(10, 25, rng)).tolist().count(3) == 5
    assert len(set(draw(100, 30, rng))) == 30


def test_every_point_has_what_is_said_of_the_nearest_seen_one_and_outliers_have_their_own() -> None:
    plate = np.random.default_rng(0).uniform(size=(3000, 3)) * [1.0, 1.0, 0.0]
    far = np.array([[50.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    cloud = Cloud.of(np.concatenate([plate, far]), 200)
    assert cloud.seen.shape == cloud.tensor(torch.device("cpu"))[0].shape == (200, 3)
    side = (cloud.seen[:, 0] > 0.5).astype(np.int64)
    every = cloud.for_every_point(side, -1)
    nearest = np.linalg.norm(plate[:, None] - cloud.seen[None], axis=-1).argmin(1)
    assert every.tolist() == [*side[nearest].tolist(), -1, -1]
    assert set(cloud.some(100).tolist()) < set(cloud.good.tolist())
    assert len(cloud.some(10_000)) == 3000
