"""Which way flat surfaces face tells how an object is turned; round ones tell nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

import artsim
from artperl.core.pose import Theta, clamp_state, pose_parts, theta_from_parts
from artperl.core.rotations import rotation_from_vector
from artperl.core.shapes import Shapes
from artperl.fitting.normal_alignment import align_normals, normals_of
from artsim.model.draws import StateOptions, ViewOptions, sample_state, sample_view
from artsim.observing.sample import Sample


def seen(category: str, seed: int) -> tuple[Shapes, Sample, Theta]:
    """An object of diagonal 1 in a random state, a partial cloud of it, and the true Theta of its own shape."""
    rng = np.random.default_rng(seed)
    obj = artsim.make(category, 300 + seed).with_diagonal(1.0)
    q = sample_state(obj, StateOptions(), rng)
    sample = artsim.observe(obj, q, sample_view(obj, q, ViewOptions(), rng), num_points=8192, rng=rng)
    shapes = Shapes.from_objects([obj], 64, dtype=torch.float64)
    T = sample.T_camera_part
    center = np.einsum("kij,kj->ki", T[:, :3, :3], sample.box_center) + T[:, :3, 3]
    poses = (torch.from_numpy(values)[None] for values in (T[:, :3, :3], center, sample.box_size))
    return shapes, sample, theta_from_parts(shapes.trees, shapes.box_center, shapes.box_size, *poses)


def off(shapes: Shapes, theta: Theta, degrees: float, seed: int) -> Theta:
    """Turned about the camera in any direction, and every hinge turned by as much one way or the other."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    turn = rotation_from_vector(torch.from_numpy(np.radians(degrees) * axis / np.linalg.norm(axis)))
    sign = torch.from_numpy(rng.choice([-1.0, 1.0], theta.state.shape))
    state = theta.state + np.radians(degrees) * sign * shapes.trees.turn * shapes.trees.free
    return replace(
        theta, rotation=turn @ theta.rotation, translation=(turn @ theta.translation[..., None])[..., 0],
        state=clamp_state(shapes.trees, state),
    )  # fmt: skip


def degrees_apart(shapes: Shapes, one: Theta, other: Theta) -> NDArray[np.float64]:
    """(P,) between the rotations of the parts."""
    a, b = (pose_parts(shapes.trees, theta, shapes.box_center).rotation[0].numpy() for theta in (one, other))
    apart = np.linalg.norm(a - b, axis=(1, 2)) / np.sqrt(2.0)
    angle: NDArray[np.float64] = np.degrees(2.0 * np.arcsin(np.clip(apart / 2.0, 0.0, 1.0)))
    return angle


@pytest.mark.slow
@pytest.mark.parametrize("category", ["dishwasher", "drawer", "microwave", "storage_furniture"])
def test_what_has_flat_sides_faces_where_they_do(category: str) -> None:
    """Parts of at least 200 points; fits are off by about half a degree, these by 1.5."""
    before, after = [], []
    for seed in range(8):
        shapes, sample, truth = seen(category, seed)
        wrong = off(shapes, truth, 1.5, seed)
        shown = np.bincount(sample.part, minlength=len(sample.box_size)) >= 200
        right = align_normals(shapes, wrong, sample.points.astype(np.float64), sample.part.astype(np.int64))
        before += degrees_apart(shapes, wrong, truth)[shown].tolist()
        after += degrees_apart(shapes, right, truth)[shown].tolist()
    assert np.median(before) > 1.0
    assert np.median(after) < 0.05
    assert np.mean(np.array(after) < 0.2) > 0.7


def test_plates_that_bulge_are_turned_less_far_off() -> None:
    """Laptops: plates lean or bulge by a degree, lids that are bent are left alone."""
    before, after = [], []
    for seed in range(12):
        shapes, sample, truth = seen("laptop", seed)
        wrong = off(shapes, truth, 1.5, seed)
        right = align_normals(shapes, wrong, sample.points.astype(np.float64), sample.part.astype(np.int64))
        before.append(degrees_apart(shapes, wrong, truth))
        after.append(degrees_apart(shapes, right, truth))
    assert np.median(after) < 0.3 * np.median(before)


def test_the_middle_of_the_points_stays_where_it_is() -> None:
    shapes, sample, truth = seen("drawer", 1)
    wrong, points = off(shapes, truth, 1.0, 1), sample.points.astype(np.float64)
    right = align_normals(shapes, wrong, points, sample.part.astype(np.int64))
    assert not torch.equal(right.rotation, wrong.rotation)
    middle = torch.from_numpy(points.mean(axis=0))
    places = [(middle - theta.translation[0]) @ theta.rotation[0] for theta in (wrong, right)]
    assert torch.allclose(*places, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_where_the_camera_stands_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes, sample, truth = seen("dishwasher", seed)
    points, part, wrong = sample.points.astype(np.float64), sample.part.astype(np.int64), off(shapes, truth, 0.7, seed)
    R, t = rotation_from_vector(torch.from_numpy(rng.normal(size=3))), torch.from_numpy(rng.normal(size=3))

    def elsewhere(theta: Theta) -> Theta:
        moved = (R @ theta.translation[..., None])[..., 0] + t
        return replace(theta, rotation=R @ theta.rotation, translation=moved)

    here = elsewhere(align_normals(shapes, wrong, points, part))
    there = align_normals(shapes, elsewhere(wrong), points @ R.numpy().T + t.numpy(), part)
    assert torch.allclose(here.rotation, there.rotation, atol=1e-6)
    assert torch.allclose(here.translation, there.translation, atol=1e-6)
    assert torch.allclose(here.state, there.state, atol=1e-6)


def test_what_is_round_or_rough_stays_as_it_is() -> None:
    shapes, sample, truth = seen("laptop", 0)
    rng, part = np.random.default_rng(0), sample.part.astype(np.int64)
    ball = rng.normal(size=(8192, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    rough = sample.points + rng.normal(size=sample.points.shape) * 0.02
    for points in (ball, rough, ball * 0.0):
        same = align_normals(shapes, truth, points.astype(np.float64), part)
        assert torch.equal(same.rotation, truth.rotation)
        assert torch.equal(same.translation, truth.translation)
        assert torch.equal(same.state, truth.state)


def test_states_stay_within_their_limits_and_few_points_do_no_harm() -> None:
    shapes, sample, truth = seen("laptop", 2)
    points, part = sample.points.astype(np.float64), sample.part.astype(np.int64)
    shut = replace(shapes, trees=replace(shapes.trees, upper=truth.state - 0.02))
    turned = align_normals(shut, replace(truth, state=clamp_state(shut.trees, truth.state)), points, part)
    assert (turned.state <= shut.trees.upper + 1e-12)[0, 1].all()
    for count in (0, 1, 5, 50):
        for label in (part[:count], 0 * part[:count], 0 * part[:count] + 1):  # of one part alone
            some = align_normals(shapes, truth, points[:count], label)
            assert torch.isfinite(some.rotation).all()
            assert torch.isfinite(some.state).all()
    unlabelled = align_normals(shapes, off(shapes, truth, 1.0, 0), points, np.full(len(part), -1))
    assert torch.equal(unlabelled.rotation, off(shapes, truth, 1.0, 0).rotation)


def test_normals_are_those_of_the_surface() -> None:
    """A plane and a sphere of radius 1, by 8,192 points each."""
    rng = np.random.default_rng(0)
    plane = np.column_stack([rng.uniform(-1, 1, (8192, 2)), np.zeros(8192)])
    index, normal = normals_of(plane)
    assert len(index) > 900
    assert np.allclose(np.abs(normal[:, 2]), 1.0)
    ball = rng.normal(size=(8192, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    index, normal = normals_of(ball)
    assert np.median(np.abs((normal * ball[index]).sum(axis=1))) > 0.999
