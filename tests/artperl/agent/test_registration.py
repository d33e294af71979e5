"""Single parts are registered as objects of their own, wherever the whole was posed."""

from __future__ import annotations

from dataclasses import replace

import torch

from artperl.agent.actions import MOVE, NOTHING, SCALE, TURN, rotation_vector
from artperl.agent.registration import (
    ALIKE,
    CLOSER,
    FARTHER,
    REGISTRATION,
    PartProblems,
    RegistrationPolicy,
    RigidFitting,
    part_goals,
    part_problems,
)
from artperl.core.pose import Theta, pose_parts
from tests.artperl.worlds import small_problem


def problems_of(category: str) -> tuple[PartProblems, Theta]:
    problem = small_problem(category)
    apart = part_problems(problem.shapes, problem.observed, problem.start, torch.Generator().manual_seed(0))
    assert apart is not None
    posed = pose_parts(problem.shapes.trees, problem.goal, problem.shapes.box_center)
    return apart, part_goals(apart, posed.rotation, posed.center)


def test_parts_begin_where_the_reference_has_them() -> None:
    problem = small_problem("eyeglasses")
    apart, _ = problems_of("eyeglasses")
    whole = pose_parts(problem.shapes.trees, problem.start, problem.shapes.box_center)
    points = whole.points(problem.shapes.points, problem.shapes.box_center)[apart.row, apart.part]
    alone = pose_parts(apart.shapes.trees, apart.start, apart.shapes.box_center)
    torch.testing.assert_close(
        alone.points(apart.shapes.points, apart.shapes.box_center)[:, 0], points, atol=1e-5, rtol=1e-4
    )


def test_the_points_of_a_problem_are_those_of_its_part() -> None:
    problem = small_problem("laptop")
    apart, _ = problems_of("laptop")
    for points, row, part in zip(apart.observed.points, apart.row, apart.part, strict=True):
        own = problem.observed.points[row][problem.observed.part[row] == part]
        assert torch.cdist(points, own, compute_mode="donot_use_mm_for_euclid_dist").amin(1).max() < 1e-6


def test_the_expert_takes_each_part_to_its_true_pose_without_scaling_it() -> None:
    apart, goal = problems_of("laptop")
    fitting = RigidFitting(apart.shapes, apart.observed, apart.start, replace(REGISTRATION, steps=40))
    while not fitting.done:
        fitting.step(fitting.expert(goal))
    off = rotation_vector(goal.rotation @ fitting.theta.rotation.mT)
    assert torch.linalg.vector_norm(off, dim=-1).rad2deg().max() < 1.0
    torch.testing.assert_close(fitting.theta.log_scale, apart.start.log_scale)


def test_a_step_earns_what_reagent_gives_for_it() -> None:
    apart, goal = problems_of("laptop")
    fitting = RigidFitting(apart.shapes, apart.observed, apart.start, REGISTRATION)
    before = fitting.distance
    reward = fitting.step(fitting.expert(goal))
    closer = fitting.distance < before - REGISTRATION.tolerance * before
    assert (reward[closer] == CLOSER).all()
    assert set(reward.tolist()) <= {CLOSER, round(ALIKE, 7), torch.tensor(ALIKE).item(), torch.tensor(FARTHER).item()}
    assert bool(closer.any())


def test_the_policy_moves_and_turns_and_says_nothing_of_scale() -> None:
    apart, _ = problems_of("laptop")
    torch.manual_seed(0)
    fitting = RigidFitting(apart.shapes, apart.observed, apart.start, REGISTRATION)
    logits, value = RegistrationPolicy(8)(fitting.view())
    assert logits.shape == (len(apart), 1, 9, 11)
    assert value.shape == (len(apart),)
    assert (logits[..., SCALE, :].argmax(-1) == NOTHING).all()
    assert (logits[..., SCALE, :].std(0) == 0).all()
    assert (logits[..., TURN, :].std(0) > 0).any()
    assert (logits[..., MOVE, :].std(0) > 0).any()
    assert not fitting.mask[..., SCALE].any()
