"""A moving object is followed by its last pose, and found again where it is lost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch

import artsim
from artperl.core.pose import Theta, pose_parts
from artperl.core.rotations import rotation_from_vector
from artperl.evaluation.metrics import rotation_error, translation_error, true_poses
from artperl.methods.estimator_files import load_estimator
from artperl.methods.full import Estimator
from artperl.methods.tracking import INTERVAL, moved_on
from artsim.errors import ArtsimError
from artsim.model.camera import Camera
from artsim.observing.sample import Sample
from tests.artperl.worlds import small_problem


def moving_laptop(frames: int, seed: int = 1_000_000) -> Iterator[Sample]:
    """A laptop whose lid opens by a degree a frame while the camera goes round it by a degree and a half."""
    obj = artsim.make("laptop", seed)
    for n in range(frames):
        azimuth, up = np.deg2rad(1.5 * n - 10.0), np.deg2rad(35.0)
        eye = 2.2 * obj.diagonal * np.array(
            [-np.cos(azimuth) * np.cos(up), -np.sin(azimuth) * np.cos(up), np.sin(up)]
        )  # fmt: skip
        q = np.array([0.0, np.deg2rad(70.0 + n)])
        yield artsim.observe(obj, q, Camera.look_at(eye, np.zeros(3)), num_points=2048, rng=np.random.default_rng(n))


@pytest.fixture(scope="module")
def estimator() -> Estimator:
    return load_estimator("laptop")


@pytest.mark.slow
def test_each_frame_has_its_pose_and_few_are_searched_for(estimator: Estimator) -> None:
    samples = list(moving_laptop(INTERVAL + 3))
    estimates = list(estimator.track(sample.points for sample in samples))
    assert len(estimates) == len(samples)
    for sample, estimate in zip(samples, estimates, strict=True):
        rotation, center = true_poses(sample)
        assert rotation_error(estimate.rotation, rotation).max() < 3.0
        assert translation_error(estimate.translation, center, sample.diagonal).max() < 0.04
        assert abs(np.rad2deg(estimate.state[1] - sample.joint_state[1])) < 3.0
        assert (estimate.part == sample.part).mean() > 0.9
        np.testing.assert_allclose(estimate.T_camera_part[:, :3, :3], estimate.rotation)
    searched = ["tracking" not in estimate.milliseconds for estimate in estimates]
    assert searched[0]
    assert sum(searched) <= 2
    first = estimates[0]
    for estimate in estimates[1:INTERVAL]:
        np.testing.assert_array_equal(estimate.size, first.size)  # an object keeps its shape


@pytest.mark.slow
def test_an_object_that_jumps_is_searched_for(estimator: Estimator) -> None:
    one, other = next(moving_laptop(2)), next(moving_laptop(1, 1_000_003))
    jumped = other.points + np.array([0.3, 0.0, 0.4], dtype=np.float32)
    first, second = estimator.track([one.points, jumped])
    assert "tracking" not in second.milliseconds
    np.testing.assert_allclose(second.translation, estimator(jumped).translation, atol=1e-6)
    assert not np.array_equal(first.size, second.size)


def test_a_cloud_without_an_object_is_an_error(estimator: Estimator) -> None:
    with pytest.raises(ArtsimError, match="show an object"):
        list(estimator.track([np.zeros((10, 3))]))


def test_what_moves_evenly_is_where_it_is_expected() -> None:
    problem = small_problem("laptop")
    shapes, start = problem.shapes[:1], problem.goal[:1]
    middle = 0.5 * (shapes.trees.lower + shapes.trees.upper)
    start = replace(start, state=torch.where(shapes.trees.free, middle, start.state))
    turn = rotation_from_vector(torch.tensor([[0.02, -0.05, 0.01]]))
    opened = torch.where(shapes.trees.free, 0.02, 0.0)
    states: list[Theta] = [start]
    for _ in range(2):
        last = states[-1]
        states.append(replace(
            last, rotation=turn @ last.rotation, translation=last.translation + 0.01, state=last.state - opened,
        ))  # fmt: skip
    expected = moved_on(shapes, states[:2])
    there, here = (pose_parts(shapes.trees, theta, shapes.box_center) for theta in (states[2], expected))
    torch.testing.assert_close(here.center, there.center, atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(here.rotation, there.rotation, atol=1e-5, rtol=1e-4)


def test_a_joint_is_not_expected_beyond_its_limits() -> None:
    problem = small_problem("laptop")
    shapes, start = problem.shapes[:1], problem.goal[:1]
    near = replace(start, state=torch.where(shapes.trees.free, shapes.trees.upper - 0.1, start.state))
    nearer = replace(start, state=torch.where(shapes.trees.free, shapes.trees.upper - 0.02, start.state))
    expected = moved_on(shapes, [near, nearer])
    torch.testing.assert_close(expected.state[shapes.trees.free], shapes.trees.upper[shapes.trees.free])
