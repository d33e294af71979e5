"""Estimates of many clouds are those of each alone, and bad clouds are named."""

from __future__ import annotations

import numpy as np
import pytest

from artperl.core.estimate import Estimate
from artperl.methods.full import Estimator
from artsim.errors import ArtsimError
from artsim.observing.sample import Sample


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_each_is_what_it_is_alone_and_a_bad_cloud_is_an_error_in_its_place(
    estimator: Estimator, sample: Sample, workers: int
) -> None:
    clouds = [sample.points, np.zeros((5, 3)), sample.points[::2], np.zeros((4, 2))]
    found = list(estimator.many(iter(clouds), workers))
    for points, one in zip(clouds, found, strict=True):
        if points.shape[1] == 3 and len(points) > 5:
            assert isinstance(one, Estimate)
            np.testing.assert_array_equal(one.T_camera_part, estimator(points).T_camera_part)
            np.testing.assert_array_equal(one.part, estimator(points).part)
        else:
            assert isinstance(one, ArtsimError)
            assert "points" in str(one)
            assert "Fix" in str(one)
