"""Stretching an object leaves a sample true: boxes hold their parts, joints move them as before."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

import artsim
from artperl.data.batches import batches
from artperl.data.sources import DataOptions
from artperl.data.stretching import stretch, stretchable
from artperl.evaluation.artimage import real_objects
from artsim.model.kinematics import Array, KinematicTree
from artsim.observing.sample import Sample
from tests.artperl.worlds import made, view

CATEGORIES = ("drawer", "storage_furniture", "laptop", "dishwasher", "eyeglasses", "scissors", "robot_arm", "window")


def rest_of(sample: Sample) -> Array:
    size = np.linalg.norm(sample.box_size, axis=1)
    rest: Array = (sample.npcs.astype(float) - 0.5) * size[sample.part, None] + sample.box_center[sample.part]
    return rest


def check(before: Sample, after: Sample) -> None:
    """What is true of any view of any object."""
    rest, T, k = rest_of(after), after.T_camera_part, after.part
    posed = np.einsum("nij,nj->ni", T[k, :3, :3], rest) + T[k, :3, 3]
    np.testing.assert_allclose(posed, after.points, atol=1e-5 * after.diagonal)
    assert (np.abs(rest - after.box_center[k]) <= 0.5 * after.box_size[k] + 2e-3 * after.diagonal).all()
    for sign, end in ((-0.5, np.min), (0.5, np.max)):  # as long as it was
        ends = [end(s.box_center + sign * s.box_size, axis=0) for s in (before, after)]
        np.testing.assert_allclose(*ends, atol=1e-9)


@pytest.mark.slow
@given(category=st.sampled_from(CATEGORIES), seed=st.integers(0, 3), draw=st.integers(0, 99))
def test_points_boxes_and_poses_still_agree(category: str, seed: int, draw: int) -> None:
    before = made(category, seed)
    after = stretch(before, 1000, np.random.default_rng(draw))
    assert after.points.shape == (1000, 3)
    check(before, after)


@pytest.mark.slow
@given(category=st.sampled_from(CATEGORIES), seed=st.integers(0, 3), draw=st.integers(0, 99))
def test_joints_do_not_mind_how_far_along_such_an_axis_they_are(category: str, seed: int, draw: int) -> None:
    tree, rng = artsim.make(category, seed).tree, np.random.default_rng(draw)
    shift = np.zeros((len(tree), 3))
    axes = stretchable(made(category, seed))
    shift[:, axes] = rng.standard_normal((len(tree), len(axes)))
    moved = KinematicTree([
        joint if joint.parent < 0 else replace(joint, origin=tuple(np.add(joint.origin, shift[k]).tolist()))
        for k, joint in enumerate(tree.joints)
    ])  # fmt: skip
    low, high = np.clip(tree.limits, -3.0, 3.0).T
    q = rng.uniform(low, high)
    np.testing.assert_allclose(moved.forward_kinematics(q), tree.forward_kinematics(q), atol=4e-3)


@pytest.mark.parametrize(
    ("category", "axes"),
    [("drawer", [1, 2]), ("laptop", [1]), ("scissors", [2]), ("eyeglasses", []), ("robot_arm", [])],
)
def test_axes_are_those_that_hinges_lie_along_and_slides_across(category: str, axes: list[int]) -> None:
    assert stretchable(made(category, 0)) == axes


def test_equal_drawers_become_unequal_but_furniture_stays_the_same_from_either_end() -> None:
    before = next(s for s in (made("drawer", seed) for seed in range(400)) if _equal_row(s) and len(s.box_size) > 3)
    after = [stretch(before, 500, np.random.default_rng(draw)) for draw in range(20)]
    ratios = [float(s.box_size[1:, 1].max() / s.box_size[1:, 1].min()) for s in after]
    assert 1.2 < np.median(ratios) < 3.0
    for s in after:
        widths = s.box_size[1:, 1][np.argsort(s.box_center[1:, 1])]
        np.testing.assert_allclose(widths, widths[::-1], rtol=0.02)


def _equal_row(sample: Sample) -> bool:
    width, place = sample.box_size[1:, 1], sample.box_center[1:, 1]
    return len(width) > 1 and np.ptp(width) < 1e-3 * width[0] and np.diff(np.sort(place)).min() > 0.9 * width[0]


def test_a_real_object_is_stretched_as_well(partnet_dir: Path) -> None:
    for obj in real_objects("dishwasher", "train", partnet_dir)[:2]:
        before = view(obj, 0)
        after = stretch(before, 1000, np.random.default_rng(0))
        assert stretchable(before)
        check(before, after)


def test_points_do_not_tell_how_their_place_was_stretched() -> None:
    """As many points as the image has room for: a cloud with one drawn half as dense would give the row away."""
    before = next(s for s in (made("drawer", seed) for seed in range(40)) if _equal_row(s))
    before = view(artsim.make("drawer", before.seed), before.seed, 12000)
    after = stretch(before, 4000, np.random.default_rng(4))
    root = [s.part == 0 for s in (before, after)]
    densities = [_density(s.points[mine]) for s, mine in zip((before, after), root, strict=True)]
    assert densities[1] < 1.25 * densities[0]


def _density(points: Array) -> float:
    """How unevenly points cover the image: deviation over mean of the density about them."""
    image = points[:, :2] / points[:, 2:]
    reach = cKDTree(image).query(image, 17)[0][:, -1]
    density = 1.0 / reach**2
    density = density[density > np.quantile(density, 0.25)]  # without rims
    return float(density.std() / density.mean())


@pytest.mark.slow
def test_batches_with_stretched_clouds_are_always_the_same() -> None:
    alone = batches(DataOptions(["drawer"], stretched=0.5), 4, 64, 8, workers=0)
    first, second = next(alone), next(alone)
    beside = batches(DataOptions(["drawer"], stretched=0.5), 4, 64, 8, workers=2)
    assert next(beside)[0].points.equal(first[0].points)
    later = next(batches(DataOptions(["drawer"], stretched=0.5), 4, 64, 8, first_batch=1, workers=0))
    assert later[1].box_size.equal(second[1].box_size)
    as_made = next(batches(DataOptions(["drawer"]), 4, 64, 8, workers=0))
    assert not as_made[1].box_size.equal(first[1].box_size)
