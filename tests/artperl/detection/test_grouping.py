"""Votes that agree are one object; those of two objects are two, however alike they are."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from artperl.detection.grouping import assign, find_middles


@settings(max_examples=15, deadline=None)
@given(count=st.integers(1, 6), seed=st.integers(0, 1000), size=st.floats(0.05, 2.0))
def test_objects_that_do_not_overlap_are_found_one_by_one(count: int, seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    places = size * (1.0 * np.arange(count)[:, None] * (1.0, 0.0, 0.0) + (0.0, 0.0, 3.0))
    owner = rng.permutation(np.repeat(np.arange(count), rng.integers(40, 400, count)))
    votes = places[owner] + 0.03 * size * rng.standard_normal((len(owner), 3))
    sizes = np.full(len(owner), size, np.float32)
    middles = find_middles(votes.astype(np.float32), sizes, np.ones_like(sizes))
    assert len(middles) == count
    found = assign(votes, sizes, middles)
    nearest = np.array([np.linalg.norm(places - m, axis=1).argmin() for m in middles])
    assert sorted(nearest) == list(range(count))
    assert (nearest[found] == owner)[found >= 0].all()
    assert (found >= 0).mean() > 0.99


def test_stray_votes_are_no_object_and_belong_to_none() -> None:
    rng = np.random.default_rng(0)
    stray = rng.uniform(-5, 5, (200, 3)).astype(np.float32)
    sizes, ones = np.full(200, 0.3, np.float32), np.ones(200, np.float32)
    assert len(find_middles(stray, sizes, ones)) == 0
    assert len(find_middles(stray[:3], sizes[:3], ones[:3])) == 0
    assert (assign(stray, sizes, np.zeros((0, 3))) == -1).all()
    assert (assign(stray, sizes, np.full((1, 3), 9.0)) == -1).all()


def test_a_small_thing_before_a_large_one_is_a_thing_of_its_own() -> None:
    rng = np.random.default_rng(2)
    owner = np.repeat([0, 1], [2000, 60])
    sizes = np.where(owner == 0, 1.0, 0.2).astype(np.float32)
    votes = (owner[:, None] * (0.25, 0.0, 0.0) + 0.01 * rng.standard_normal((2060, 3))).astype(np.float32)
    middles = find_middles(votes, sizes, np.ones(2060, np.float32))
    assert len(middles) == 2
    assert (assign(votes, sizes, middles) == owner).all()


def test_the_object_with_most_votes_comes_first_and_time_is_bounded() -> None:
    rng = np.random.default_rng(1)
    owner = np.repeat([0, 1], [50_000, 20_000])
    votes = (owner[:, None] * (1.0, 0.0, 0.0) + 0.02 * rng.standard_normal((70_000, 3))).astype(np.float32)
    first, second = find_middles(votes, np.full(70_000, 0.5, np.float32), np.ones(70_000, np.float32))
    assert np.linalg.norm(first) < 0.02
    assert np.linalg.norm(second - (1.0, 0.0, 0.0)) < 0.02
