"""Fitting problems: their goals are the truth, and they are always the same."""

from __future__ import annotations

import pytest
import torch

from artperl.agent.actions import residual
from artperl.core.pose import pose_parts
from artperl.data.sources import DataOptions
from artperl.evaluation import metrics
from artperl.retrieval.box_embedding import box_embedding
from artperl.training.fitting_problems import Problems, part_truth
from tests.artperl.worlds import small_base


@pytest.mark.parametrize("category", ["laptop", "eyeglasses"])
def test_goals_are_the_true_poses_and_boxes_of_the_sample(category: str) -> None:
    problems = Problems(DataOptions([category]), small_base(category), 4, 64, seed=2)
    problem = problems[1]
    posed = pose_parts(problem.shapes.trees, problem.goal, problem.shapes.box_center)
    for b in range(4):
        sample = problems.samples[4 + b]
        K = len(sample.joint_type)
        _, rotation, center, size, *_ = part_truth(sample, K)
        # The reference's limits may be a little tighter than the object's own. Its hinges lean otherwise: a turn by q
        # about another axis is another one by 2 sin(q / 2) times the angle between them, for a quarter turn 1.4 times.
        lean = metrics.axis_error(problem.shapes.trees.axis[b, 1:K].numpy(), sample.joint_axis[1:])
        assert (metrics.rotation_error(posed.rotation[b, 1:K], rotation[1:]) < 4.0 + 1.4 * lean).all()
        assert metrics.rotation_error(posed.rotation[b, 0], rotation[0]) < 0.1
        assert metrics.translation_error(posed.center[b, 0], center[0], sample.diagonal) < 1e-4
        torch.testing.assert_close((problem.shapes.box_size * posed.scale)[b, :K], size, atol=1e-5, rtol=1e-4)


def test_goals_within_the_limits_of_the_reference_are_exact() -> None:
    problems = Problems(DataOptions(["laptop"]), small_base("laptop"), 4, 64, seed=2)
    sample = problems.samples[0]
    problem = problems[0]
    posed = pose_parts(problem.shapes.trees, problem.goal, problem.shapes.box_center)
    _, rotation, center, *_ = part_truth(sample, 2)
    within = bool(
        (problem.goal.state[0, 1] > problem.shapes.trees.lower[0, 1])
        & (problem.goal.state[0, 1] < problem.shapes.trees.upper[0, 1])
    )
    assert within
    torch.testing.assert_close(posed.center[0], center, atol=1e-4, rtol=1e-4)
    assert metrics.rotation_error(posed.rotation[0], rotation).max() < 0.5


def test_batch_n_is_always_the_same() -> None:
    base = small_base("laptop")
    one, other = (Problems(DataOptions(["laptop"]), base, 3, 64, seed=9) for _ in range(2))
    one[0]
    first, again = one[4], other[4]
    assert torch.equal(first.observed.points, again.observed.points)
    assert torch.equal(first.start.rotation, again.start.rotation)
    assert torch.equal(first.shapes.points, again.shapes.points)
    assert not torch.equal(first.start.rotation, one[5].start.rotation)


def test_starts_are_off_by_as_much_as_is_said() -> None:
    problems = Problems(DataOptions(["laptop"]), small_base("laptop"), 16, 64)
    problem = problems[0]
    points = problem.observed.points
    radius = torch.linalg.vector_norm(points - points.mean(1, keepdim=True), dim=-1).amax(1)
    steps = residual(problem.shapes, problem.goal, problem.start, radius)
    angle = torch.linalg.vector_norm(steps[:, 0, :3], dim=-1)
    assert 0.5 < angle.max() <= 1.0 + 1e-3
    assert 0.15 < steps[:, 0, 3:6].abs().max() <= 0.3 + 1e-3
    assert steps[:, 0, 6:].abs().max() <= 0.15 + 1e-4
    trees = problem.shapes.trees
    assert ((problem.start.state >= trees.lower) & (problem.start.state <= trees.upper))[trees.free].all()


def test_an_objects_own_boxes_find_it() -> None:
    base = small_base("laptop", "drawer", "eyeglasses")
    shapes = base.shapes
    query = box_embedding(shapes.trees.valid, shapes.box_center, shapes.box_size)
    rows, distance = base.nearest_objects(query)
    assert rows[:, 0].tolist() == list(range(len(base)))
    assert distance.max() < 1e-2


def test_an_object_with_as_many_parts_is_nearer_than_one_with_the_same_boxes() -> None:
    base = small_base("laptop", "eyeglasses")
    shapes = base.shapes
    query = box_embedding(shapes.trees.valid, 1.2 * shapes.box_center, 1.2 * shapes.box_size)
    rows, _ = base.nearest_objects(query, 3)
    parts = shapes.trees.valid.sum(1)
    assert (parts[rows] == parts[:, None]).all()
