"""Points of one surface get one label; steps and creases keep labels apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artperl.evaluation.artimage import real_objects
from artperl.perception.label_smoothing import Walks
from artsim.model.kinematics import Array
from tests.artperl.worlds import made, view


def smooth_labels(points: Array, values: Array, diagonal: float) -> Array:
    """(N, P) what is said of points (N, 3) of an object with such a diagonal, smoothed."""
    return Walks.of(points, diagonal).mean_of_ends(values)


def guessed(part: Array, parts: int, wrong: float, seed: int) -> Array:
    """Probabilities that are for another part at a share of the points, drawn at random."""
    rng = np.random.default_rng(seed)
    other = rng.random(len(part)) < wrong
    label = np.where(other, rng.integers(parts, size=len(part)), part)
    return 0.1 / parts + 0.9 * np.eye(parts)[label]


def plane(count: int, height: float, seed: int) -> Array:
    xy = np.random.default_rng(seed).uniform(-0.35, 0.35, (count, 2))
    return np.column_stack([xy, np.full(count, height)])


def test_a_wrong_border_moves_towards_a_step() -> None:
    """Left half and right half, one 3 % of the diagonal above the other."""
    points = plane(3000, 0.0, 0)
    points[points[:, 0] > 0.1, 2] = 0.03
    part = (points[:, 0] > 0.1).astype(int)
    guess = 0.5 + 0.4 * np.clip((points[:, 0] - 0.16) / 0.1, -1, 1)  # the border at .16
    label = smooth_labels(points, np.stack([1 - guess, guess], 1), 1.0).argmax(1)
    before = ((guess > 0.5) != part).mean()
    assert (label != part).mean() < 0.8 * before


def test_without_a_step_a_border_stays_where_it_was() -> None:
    points = plane(3000, 0.0, 1)
    guess = (points[:, 0] > 0.16).astype(float)
    label = smooth_labels(points, np.stack([1 - guess, guess], 1), 1.0).argmax(1)
    assert (label != guess).mean() < 0.02


@given(category=st.sampled_from(["laptop", "dishwasher", "drawer", "scissors"]), seed=st.integers(0, 5))
def test_labels_drawn_at_random_give_way_to_those_around(category: str, seed: int) -> None:
    sample = made(category, seed)
    guess = guessed(sample.part, len(sample.joint_type), 0.3, seed)
    label = smooth_labels(sample.points.astype(float), guess, sample.diagonal).argmax(1)
    assert (label != sample.part).mean() < 0.2 * (guess.argmax(1) != sample.part).mean()


@pytest.mark.slow
def test_so_they_do_on_real_objects(partnet_dir: Path) -> None:
    for obj in real_objects("laptop", "train", partnet_dir)[:2]:
        sample = view(obj, 0)
        guess = guessed(sample.part, 2, 0.3, 0)
        label = smooth_labels(sample.points.astype(float), guess, sample.diagonal).argmax(1)
        assert (label != sample.part).mean() < 0.2 * (guess.argmax(1) != sample.part).mean()


@pytest.mark.slow
@given(scale=st.floats(0.01, 100.0), seed=st.integers(0, 5))
def test_they_are_probabilities_whatever_the_pose_size_and_order(scale: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    sample = made("laptop", seed)
    points, guess = sample.points.astype(float), guessed(sample.part, 2, 0.3, seed)
    out = smooth_labels(points, guess, sample.diagonal)
    assert (out >= 0).all()
    np.testing.assert_allclose(out.sum(1), 1.0, atol=1e-9)
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    order = rng.permutation(len(points))
    moved = scale * points[order] @ turn.T + rng.standard_normal(3)
    again = smooth_labels(moved, guess[order], scale * sample.diagonal)
    assert (again.argmax(1) == out[order].argmax(1)).mean() > 0.999  # neighbours at equal distance may change places
    same = np.tile([0.3, 0.7], (len(points), 1))
    np.testing.assert_allclose(smooth_labels(points, same, sample.diagonal), same, atol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_a_few_points_are_enough(count: int) -> None:
    points = np.random.default_rng(0).standard_normal((count, 3))
    out = smooth_labels(points, np.full((count, 2), 0.5), 1.0)
    np.testing.assert_allclose(out, 0.5)


def test_the_mean_over_ends_is_that_of_a_hundred_steps() -> None:
    """Steps one after the other, by a dense matrix."""
    points, values = plane(300, 0.0, 3), np.random.default_rng(0).random((300, 11))
    walks = Walks.of(points, 1.0)
    step = walks.step.toarray()
    np.testing.assert_allclose(step.sum(1, keepdims=True) + walks.stay, 1.0)
    ends = values
    for _ in range(100):
        ends = walks.stay * values + step @ ends
    np.testing.assert_allclose(walks.mean_of_ends(values), ends, atol=1e-4)
