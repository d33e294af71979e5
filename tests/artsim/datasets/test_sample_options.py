"""A sample depends on its seed and index alone."""

from __future__ import annotations

import numpy as np

import artsim
from artsim.datasets.sample_options import SampleOptions, draw_sample
from artsim.renderers import make_renderer
from tests.conftest import ASSETS


def test_a_sample_depends_on_seed_and_index_only() -> None:
    obj, renderer = artsim.load(ASSETS / "scissors"), make_renderer("raycast")
    first = draw_sample(obj, SampleOptions(), 3, 17, renderer)
    for index in range(5):
        draw_sample(obj, SampleOptions(), 3, index, renderer)
    again = draw_sample(obj, SampleOptions(), 3, 17, make_renderer("raycast"))
    assert np.array_equal(first.points, again.points)
    assert not np.array_equal(first.points, draw_sample(obj, SampleOptions(), 4, 17, renderer).points)
    assert not np.array_equal(first.points, draw_sample(obj, SampleOptions(), 3, 18, renderer).points)
