"""What is not seen of a part says where it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import artsim
from artperl.core.pose import Theta, theta_from_parts
from artperl.core.shapes import Shapes
from artperl.fitting.occluded_parts import pose_occluded_parts
from artsim.model.draws import ViewOptions, sample_view
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

FRONT = ViewOptions(azimuth=(-10.0, 10.0), elevation=(-2.0, 2.0))
"""Frames hide temples from there."""


def seen(category: str, seed: int, degrees: float, views: ViewOptions) -> tuple[Shapes, Sample, Theta]:
    """An object whose hinges are open by so much, a cloud of it, and the true Theta of its own shape."""
    rng = np.random.default_rng(seed)
    obj = artsim.make(category, 300 + seed).with_diagonal(1.0)
    q = np.minimum(np.radians(degrees), obj.tree.limits[:, 1])
    sample = artsim.observe(obj, q, sample_view(obj, q, views, rng), num_points=8192, rng=rng)
    return Shapes.from_objects([obj], 192), sample, true_theta(obj, sample)


def true_theta(obj: ArticulatedObject, sample: Sample) -> Theta:
    """Of the object's own shape."""
    shapes, T = Shapes.from_objects([obj], 1), sample.T_camera_part
    center = np.einsum("kij,kj->ki", T[:, :3, :3], sample.box_center) + T[:, :3, 3]
    poses = (torch.from_numpy(values)[None].float() for values in (T[:, :3, :3], center, sample.box_size))
    return theta_from_parts(shapes.trees, shapes.box_center, shapes.box_size, *poses)


def found(shapes: Shapes, theta: Theta, sample: Sample) -> Theta:
    return pose_occluded_parts(shapes, theta, sample.points.astype(np.float64), sample.part.astype(np.int64))


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [40.0, 60.0, 80.0])
def test_temples_of_a_few_points_are_folded_as_far_as_they_are(degrees: float) -> None:
    """Fits leave them open, where they would show."""
    after = []
    for seed in range(8):
        shapes, sample, truth = seen("eyeglasses", seed, degrees, FRONT)
        few = torch.from_numpy(np.bincount(sample.part, minlength=3) <= 0.025 * 8192)
        state = found(shapes, replace(truth, state=truth.state * 0.0), sample).state
        after += (state - truth.state).abs()[0, few].tolist()
        assert not state[0, ~few].any()  # others tell their states themselves
    assert len(after) >= 8
    assert np.degrees(np.median(after)) < 1.0
    assert np.degrees(np.max(after)) < 3.5


def test_a_temple_without_a_point_is_where_a_camera_would_not_see_it() -> None:
    """The renderer says so: open, as the fit has it, it would show."""
    rng, obj = np.random.default_rng(136), artsim.make("eyeglasses", 436).with_diagonal(1.0)
    q = np.radians([0.0, 65.0, 65.0])
    camera = sample_view(obj, q, ViewOptions(azimuth=(35.0, 75.0), elevation=(5.0, 25.0)), rng)

    def pixels(state: float) -> int:
        sample = artsim.observe(
            obj, np.array([0.0, state, q[2]]), camera, num_points=8192, rng=np.random.default_rng(0)
        )
        return int((sample.part == 1).sum())

    sample = artsim.observe(obj, q, camera, num_points=8192, rng=np.random.default_rng(0))
    shapes, truth = Shapes.from_objects([obj], 192), true_theta(obj, sample)
    assert pixels(q[1]) == 0
    assert pixels(0.0) > 100
    state = float(found(shapes, replace(truth, state=truth.state * 0.0), sample).state[0, 1])
    assert pixels(state) < 0.1 * pixels(0.0)
    assert abs(np.degrees(state) - 65.0) < 20.0


@pytest.mark.parametrize("degrees", [40.0, 80.0])
def test_what_fits_stays(degrees: float) -> None:
    for seed in range(4):
        shapes, sample, truth = seen("eyeglasses", seed, degrees, FRONT)
        state = found(shapes, truth, sample).state
        # The edge of the shadow is known to about the spacing of the shape's points.
        torch.testing.assert_close(state, truth.state, rtol=0.0, atol=np.radians(3.0))


@pytest.mark.parametrize("category", ["laptop", "dishwasher", "drawer", "robot_arm"])
def test_what_shows_or_slides_or_carries_what_shows_stays_where_fits_have_it(category: str) -> None:
    for seed in range(3):
        shapes, sample, truth = seen(category, seed, 50.0, ViewOptions())
        wrong = replace(truth, state=truth.state * 0.5)
        count = np.bincount(sample.part, minlength=shapes.trees.num_rows)
        shows = shapes.trees.carries[0].numpy() @ count > 0.025 * 8192
        stays = torch.from_numpy(shows) | (shapes.trees.turn[0] == 0)
        state = found(shapes, wrong, sample).state
        assert torch.equal(state[0, stays], wrong.state[0, stays])
        assert (shapes.trees.lower <= state + 1e-6)[shapes.trees.free].all()
        assert (state - 1e-6 <= shapes.trees.upper)[shapes.trees.free].all()


def test_what_moves_with_a_hinge_that_shows_stays_too() -> None:
    """The second temple follows the first one: its points tell the state of both."""
    shapes, sample, truth = seen("eyeglasses", 1, 60.0, FRONT)
    trees = shapes.trees
    source, multiplier = torch.tensor([[0, 1, 1]]), torch.tensor([[0.0, 1.0, 1.0]])
    free = torch.tensor([[False, True, False]])
    coupled = replace(shapes, trees=replace(trees, source=source, multiplier=multiplier, free=free))
    part = sample.part.astype(np.int64)
    part[part == 1] = -1
    part[np.flatnonzero(part == 0)[:300]] = 2  # it shows plenty
    opened = replace(truth, state=truth.state * 0.0)
    points = sample.points.astype(np.float64)
    assert pose_occluded_parts(shapes, opened, points, part).state[0, 1] > 0.0
    assert torch.equal(pose_occluded_parts(coupled, opened, points, part).state, opened.state)


def test_points_that_come_twice_change_next_to_nothing() -> None:
    shapes, sample, truth = seen("eyeglasses", 3, 60.0, FRONT)
    points, part = sample.points.astype(np.float64), sample.part.astype(np.int64)
    opened = replace(truth, state=truth.state * 0.0)
    once, twice = (
        pose_occluded_parts(shapes, opened, *(np.repeat(x, n, axis=0) for x in (points, part))) for n in (1, 2)
    )
    assert (once.state - truth.state).abs().max() < np.radians(3.5)
    assert (twice.state - once.state).abs().max() < np.radians(3.5)
    same = pose_occluded_parts(shapes, opened, points[:1].repeat(50, axis=0), np.zeros(50, dtype=np.int64))
    assert torch.equal(same.state, opened.state)


def test_few_points_do_no_harm() -> None:
    shapes, sample, truth = seen("eyeglasses", 0, 60.0, FRONT)
    for count in (2, 5, 50):
        points, part = sample.points[:count].astype(np.float64), sample.part[:count].astype(np.int64)
        for label in (part, 0 * part, 0 * part - 1):
            assert torch.isfinite(pose_occluded_parts(shapes, truth, points, label).state).all()
