"""Clouds as detectors and cluttered scenes leave them."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
import torch

from artperl.data.batches import batches
from artperl.data.degrading import MOST_FOREIGN, degrade
from artperl.data.sources import DataOptions
from artperl.evaluation.samples import frozen_samples
from artsim.observing.interference import FOREIGN


@pytest.mark.slow
def test_degraded_clouds_have_as_many_points_and_some_are_cut_dirty_and_sparse() -> None:
    (sample,) = frozen_samples(["laptop"], 1, 1)
    made = [degrade(sample, 2048, np.random.default_rng(n)) for n in range(200)]
    assert {len(one.points) for one in made} == {2048}
    other = np.array([(one.part == FOREIGN).mean() for one in made])
    assert 0.35 < (other > 0.0).mean() < 0.65
    assert other.max() < MOST_FOREIGN + 0.03
    different = np.array([len(np.unique(one.points, axis=0)) for one in made])
    assert 0.05 < (different < 1500).mean() < 0.6
    assert different.min() >= 400


def test_batches_say_which_points_are_of_the_object() -> None:
    """Points of other things are far from every surface of the object, and have no part and no place."""
    options = DataOptions(["laptop"], degraded=1.0)
    clouds, truth = next(batches(options, 2, 512, 16, workers=0))
    own = truth.own
    assert 0.0 < (~own).float().mean() < 0.15
    assert not truth.canonical[~own].any()
    assert not truth.part[~own].any()
    again = list(islice(batches(options, 2, 512, 16, workers=2), 2))
    assert again[0][0].points.equal(clouds.points)
    assert next(batches(options, 2, 512, 16, first_batch=1, workers=0))[0].points.equal(again[1][0].points)
    clean = next(batches(DataOptions(["laptop"]), 2, 512, 16, workers=0))[1]
    assert clean.own.all()
    assert torch.allclose(clean.box_size, truth.box_size)
