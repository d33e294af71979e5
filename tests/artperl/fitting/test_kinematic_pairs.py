"""Joint votes name the joint, and rotations under joints are better than those of parts alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artperl.evaluation.metrics import axis_error, rotation_error
from artperl.fitting.joint_votes import REACH, vote_axis, vote_pivot
from artperl.fitting.kinematic_pairs import couple_rotations

AXIS = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
PARENTS = np.array([-1, 0, 1])


def chain(kinds: Sequence[str], rng: np.random.Generator) -> np.ndarray:
    """Rotations of three parts, each of which hangs from the one before."""
    turned = [Rotation.random(random_state=rng).as_matrix()]
    for k in (1, 2):
        angle = 0.0 if kinds[k] == "prismatic" else rng.uniform(0.3, 2.0)
        turned.append(turned[-1] @ Rotation.from_rotvec(angle * AXIS[k]).as_matrix())
    return np.stack(turned)


@pytest.mark.parametrize("kinds", [("free", "revolute", "revolute"), ("free", "prismatic", "revolute")], ids=str)
def test_joints_mend_the_rotations_of_parts_with_bad_points(kinds: tuple[str, ...]) -> None:
    rng = np.random.default_rng(0)
    alone, coupled = [], []
    for _ in range(6):
        truth = chain(kinds, rng)
        source = [rng.random((60, 3)) for _ in kinds]
        noise = (0.001, 0.25, 0.25)  # of parts 1 and 2, points tell little
        target = []
        for own, R, error in zip(source, truth, noise, strict=True):
            target.append(0.4 * own @ R.T + rng.normal(0.0, 0.4 * error, own.shape))
        start = truth @ Rotation.from_rotvec(rng.normal(0.0, 0.3, (3, 3))).as_matrix()
        scale = np.full(3, 0.4)
        for weight, errors in ((0.0, alone), (3.0, coupled)):
            found = couple_rotations(source, target, scale, start, kinds, PARENTS, AXIS, weight)
            errors.append(rotation_error(found, truth)[1:].mean())
    assert np.mean(coupled) < 0.8 * np.mean(alone)


def test_a_heavy_slide_turns_both_of_its_parts_alike_and_a_hinge_keeps_its_axis() -> None:
    rng = np.random.default_rng(1)
    source = [rng.random((30, 3)) for _ in range(3)]
    target = [points @ Rotation.random(random_state=rng).as_matrix().T for points in source]
    kinds, eye = ("free", "prismatic", "revolute"), np.tile(np.eye(3), (3, 1, 1))
    found = couple_rotations(source, target, np.ones(3), eye, kinds, PARENTS, AXIS, weight=1e4)
    assert rotation_error(found[0], found[1]) < 1e-2
    np.testing.assert_allclose(found[1] @ AXIS[2], found[2] @ AXIS[2], atol=1e-3)
    assert rotation_error(found[1], found[2]) > 1.0


def test_a_part_without_points_obeys_its_joint() -> None:
    rng = np.random.default_rng(2)
    points, empty = rng.random((20, 3)), np.zeros((0, 3))
    truth = Rotation.random(random_state=rng).as_matrix()
    found = couple_rotations(
        [points, empty], [points @ truth.T, empty], np.ones(2), np.stack([truth, np.eye(3)]), ("free", "prismatic"),
        np.array([-1, 0]), AXIS[:2],
    )  # fmt: skip
    np.testing.assert_allclose(found, np.stack([truth, truth]), atol=1e-5)


def test_votes_around_a_hinge_find_it_in_spite_of_a_few_wrong_ones() -> None:
    rng = np.random.default_rng(3)
    axis, pivot = np.array([0.0, 0.6, 0.8]), np.array([0.4, 0.5, 0.6])
    points = pivot + rng.uniform(-1, 1, (300, 1)) * axis + rng.normal(0.0, 0.05, (300, 3))
    away = pivot - points
    away -= (away @ axis)[:, None] * axis
    distance = np.linalg.norm(away, axis=1)
    heat, offset = 1.0 - distance / REACH, away / distance[:, None]
    offset[:40] = rng.normal(size=(40, 3))
    found = vote_pivot(points, offset, heat) - pivot
    assert np.linalg.norm(found - (found @ axis) * axis) < 0.005
    assert axis_error(vote_axis(axis + rng.normal(0.0, 0.2, (300, 3))), axis) < 3.0
