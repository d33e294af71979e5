"""Stretching commutes with joints: a stretched object moves as the stretched picture of the object does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import artsim
from artsim.model.stretching import SPREAD, coupled_axes, draw_axis_map, stretchable_axes
from artsim.model.transforms import transform_points
from artsim.variation.geometry import resized, stretched
from tests.conftest import valve

CATEGORIES = ("drawer", "laptop", "dishwasher", "eyeglasses", "scissors", "window", "suitcase", "valve", "robot_arm")


@given(edges=st.lists(st.floats(-1, 1), min_size=2, max_size=12), draw=st.integers(0, 99))
def test_a_map_keeps_the_ends_and_the_order(edges: list[float], draw: int) -> None:
    along = draw_axis_map(np.array(edges), 0.01, False, np.random.default_rng(draw))
    values = np.linspace(-2, 2, 401)
    assert (np.diff(along(values)) > 0).all()
    ends = np.array([min(edges), max(edges), -5.0, 5.0])
    np.testing.assert_allclose(along(ends)[2:] - ends[2:], 0.0, atol=0.011)
    assert SPREAD > 0


@pytest.mark.slow
@given(category=st.sampled_from(CATEGORIES), seed=st.integers(0, 5), draw=st.integers(0, 99))
def test_factors_of_coupled_axes_commute_with_every_joint(category: str, seed: int, draw: int) -> None:
    obj = artsim.make(category, seed)
    check_factors(obj, draw)


def test_factors_commute_with_screws_and_slanted_slides() -> None:
    for draw in range(5):
        check_factors(valve(), draw)


def check_factors(obj: artsim.ArticulatedObject, draw: int) -> None:
    rng = np.random.default_rng(draw)
    factors = np.ones(3)
    groups = coupled_axes(obj.tree.axes, obj.tree.types)
    assert sorted(axis for group in groups for axis in group) == [0, 1, 2]
    for group in groups:
        factors[group] = rng.uniform(0.5, 2.0)
    large = resized(obj, factors)
    low, high = np.clip(obj.tree.limits, -3.0, 3.0).T
    share = rng.uniform(size=len(low))
    its_low, its_high = np.clip(large.tree.limits, -3.0, 3.0).T
    bounded = np.isfinite(obj.tree.limits).all(axis=1) & (np.abs(obj.tree.limits) < 3).all(axis=1)
    q = obj.tree.complete_state(np.where(bounded, low + share * (high - low), share))
    its_q = large.tree.complete_state(np.where(bounded, its_low + share * (its_high - its_low), share))
    poses, its_poses = obj.tree.forward_kinematics(q), large.tree.forward_kinematics(its_q)
    for k, part in enumerate(obj.parts):
        expected = transform_points(poses[k], part.vertices) * factors
        np.testing.assert_allclose(transform_points(its_poses[k], large.parts[k].vertices), expected, atol=1e-9)


@pytest.mark.slow
@given(category=st.sampled_from(CATEGORIES), seed=st.integers(0, 5), draw=st.integers(0, 99))
def test_maps_between_edges_commute_with_joints_that_leave_the_axis_alone(category: str, seed: int, draw: int) -> None:
    obj, rng = artsim.make(category, seed), np.random.default_rng(draw)
    for axis in stretchable_axes(obj.tree.axes, obj.tree.types):
        along = draw_axis_map(np.concatenate([p.bounds[:, axis] for p in obj.parts]), 0.01, False, rng)
        new = stretched(obj, axis, along)
        low, high = np.clip(obj.tree.limits, -3.0, 3.0).T
        q = obj.tree.complete_state(rng.uniform(low, high))
        before, after = obj.tree.forward_kinematics(q), new.tree.forward_kinematics(q)
        for k, part in enumerate(obj.parts):
            expected = transform_points(before[k], part.vertices)
            expected[:, axis] = along(expected[:, axis])
            moved = transform_points(after[k], new.parts[k].vertices)[: len(part.vertices)]
            np.testing.assert_allclose(moved, expected, atol=5e-3 * obj.diagonal)
