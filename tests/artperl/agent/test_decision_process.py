"""The decision process: rewards are what the chamfer distance says, and the expert earns them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest
import torch

from artperl.agent.actions import NOTHING
from artperl.agent.decision_process import Fitting, FittingOptions, View
from artperl.core.rotations import rotation_from_vector
from artperl.training.fitting_problems import Problem
from tests.artperl.worlds import small_problem

OPTIONS = FittingOptions()


@pytest.fixture(params=[("laptop",), ("laptop", "eyeglasses")], ids=str)
def problem(request: pytest.FixtureRequest) -> Problem:
    return small_problem(*request.param)


def brute_force(fitting: Fitting, b: int) -> float:
    """Chamfer distance of one environment, in radii, both ways, of what faces the camera, to points of the same part.

    Nothing counts for more than 2 radii, and what has no such point counts for that.
    """
    points = fitting.posed.points(fitting.shapes.points, fitting.shapes.box_center)[b]
    normals = fitting.posed.normals(fitting.shapes.normals)[b]
    facing = fitting.shapes.has_surface[b][:, None] & ((points * normals).sum(-1) < 0.0)
    part = torch.arange(len(points))[:, None].expand_as(facing)[facing]
    apart = torch.cdist(fitting.observed.points[b], points[facing], compute_mode="donot_use_mm_for_euclid_dist")
    apart = (apart / fitting.radius[b]).clamp(max=2.0)
    apart = torch.where(fitting.observed.part[b][:, None] == part, apart, 2.0)
    return float(0.5 * (apart.amin(1).mean() + apart.amin(0).mean()))


def test_the_distance_is_the_chamfer_distance(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    brute = torch.tensor([brute_force(fitting, b) for b in range(len(problem))])
    torch.testing.assert_close(fitting.distance, brute, atol=1e-4, rtol=1e-3)


def test_the_reward_says_whether_the_chamfer_distance_fell(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    generator = torch.Generator().manual_seed(0)
    for _ in range(5):
        before = torch.tensor([brute_force(fitting, b) for b in range(len(problem))])
        action = torch.randint(0, 11, (*problem.shapes.trees.valid.shape, 9), generator=generator)
        reward = fitting.step(action)
        after = torch.tensor([brute_force(fitting, b) for b in range(len(problem))])
        clear = (after - before).abs() > 1e-3
        assert (reward[clear] == torch.where(after < before, 0.5, -0.5)[clear]).all()


def test_doing_nothing_costs_a_tenth(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    reward = fitting.step(torch.full((*problem.shapes.trees.valid.shape, 9), 5))
    torch.testing.assert_close(reward, torch.full_like(reward, -0.05))


def test_an_episode_is_placed_as_far_from_its_goal_as_is_asked(problem: Problem) -> None:
    """Half of what the start misses, of which the expert's residual is the oracle; nothing is nothing to do."""
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    whole = fitting.missing(problem.goal)
    assert whole.abs().amax() > 0.3
    for share in (1.0, 0.5, 0.0):
        fitting.place(problem.goal, share * whole)
        torch.testing.assert_close(fitting.missing(problem.goal), share * whole, atol=1e-4, rtol=1e-3)
    assert (fitting.expert(problem.goal) == NOTHING).all()
    assert torch.equal(fitting.theta.stretch, problem.start.stretch)


def test_the_expert_brings_the_clouds_together(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    first = fitting.distance
    while not fitting.done:
        fitting.step(fitting.expert(problem.goal))
    assert (fitting.distance < first).float().mean() > 0.8
    assert fitting.distance.mean() < 0.5 * first.mean()
    assert fitting.steps_taken == 2 * OPTIONS.steps  # of two levels


def test_parts_that_one_cloud_does_not_show_count_as_two_radii(problem: Problem) -> None:
    """All points are of the root: of every other part, only the reference shows points."""
    observed = replace(problem.observed, part=torch.zeros_like(problem.observed.part))
    fitting = Fitting(problem.shapes, observed, problem.start, OPTIONS)
    assert fitting.shown[:, 1:].any()
    brute = torch.tensor([brute_force(fitting, b) for b in range(len(problem))])
    torch.testing.assert_close(fitting.distance, brute, atol=1e-4, rtol=1e-3)
    assert (fitting.view().reference_gap[:, 1:] == 0).all()


def turned(problem: Problem, turn: torch.Tensor, scale: float, away: torch.Tensor) -> View:
    """What the agent sees once a scene is turned about the camera, scaled about it and moved."""
    start = problem.start
    observed = replace(problem.observed, points=scale * problem.observed.points @ turn.T + away)
    start = replace(
        start, rotation=turn @ start.rotation, translation=scale * start.translation @ turn.T + away,
        log_scale=start.log_scale + torch.tensor(scale).log(),
    )  # fmt: skip
    return Fitting(problem.shapes, observed, start, OPTIONS).view()


def test_what_the_agent_sees_does_not_depend_on_place_turn_or_size(problem: Problem) -> None:
    """Of a scene that turns about the camera or grows from it nothing does; of one that moves aside, what is shown."""
    here = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS).view()
    turn, still = rotation_from_vector(torch.tensor([0.8, -0.5, 1.2])), torch.zeros(3)
    for there in (turned(problem, turn, 1.0, still), turned(problem, torch.eye(3), 2.0, still)):
        same = (here.shown == there.shown).flatten(1).all(1)
        assert same.float().mean() >= 0.8  # rounding turns a point away here or there
        for name, values in vars(here).items():
            torch.testing.assert_close(
                getattr(there, name)[same], values[same], atol=2e-3, rtol=1e-3, msg=lambda text, n=name: f"{n}: {text}"
            )
    moved = turned(problem, torch.eye(3), 1.0, torch.tensor([0.3, -0.2, 0.5]))
    for name in ("observed", "frame", "axis", "anchor", "state"):
        torch.testing.assert_close(getattr(moved, name), getattr(here, name), atol=1e-3, rtol=1e-3)
    assert not torch.equal(moved.shown, here.shown)
    assert not torch.allclose(moved.sight, here.sight, atol=0.01)


def test_gaps_lead_from_points_to_the_nearest_of_their_part(problem: Problem) -> None:
    view = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS).view()
    # The agent sees few of the reference's points: the nearest of all is at least as near as the nearest of these.
    for b in range(len(problem)):
        for k in range(view.valid.shape[1]):
            own, shown = view.observed[b, view.part[b] == k], view.shown[b, k]
            gap, facing = view.gap[b, view.part[b] == k], view.reference[b, k, shown]
            if len(own) and len(facing):
                apart = torch.cdist(own, facing)
                assert (gap.norm(dim=-1) <= apart.amin(1) + 1e-4).all()
                back = facing + view.reference_gap[b, k, shown]
                torch.testing.assert_close(back, own[apart.argmin(0)], atol=1e-4, rtol=0)
            elif len(own) == 0:
                assert (view.reference_gap[b, k] == 0).all()
    assert (view.gap_normal.norm(dim=-1)[view.gap.norm(dim=-1) > 0] - 1.0).abs().max() < 1e-4


def test_the_agent_sees_whose_turn_it_is_and_how_many_steps_are_left(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, FittingOptions(steps=3))
    still, depth = torch.full((*problem.shapes.trees.valid.shape, 9), NOTHING), problem.shapes.trees.depth
    for step in range(6):
        view = fitting.view()
        assert torch.equal(view.turn, depth == step % 2)
        torch.testing.assert_close(view.left, torch.full_like(view.left, 1.0 - step / 6))
        fitting.step(still)


def test_parts_without_a_surface_are_near_nothing(problem: Problem) -> None:
    spacing = problem.shapes.spacing.clone()
    spacing[:, 1] = torch.inf
    fitting = Fitting(replace(problem.shapes, spacing=spacing), problem.observed, problem.start, OPTIONS)
    view = fitting.view()
    assert (view.reference[:, 1] == 0).all()
    assert (view.gap[view.part == 1] == 0).all()
    brute = torch.tensor([brute_force(fitting, b) for b in range(len(problem))])
    torch.testing.assert_close(fitting.distance, brute, atol=1e-4, rtol=1e-3)


def test_episodes_do_not_depend_on_their_neighbours(problem: Problem) -> None:
    together = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    alone = Fitting(problem.shapes[2:3], problem.observed[2:3], problem.start[2:3], OPTIONS)
    for _ in range(3):
        action = together.expert(problem.goal)
        alone.step(action[2:3])
        together.step(action)
    torch.testing.assert_close(together.distance[2:3], alone.distance, atol=1e-5, rtol=1e-4)
    for one, other in pairwise((together.theta.state[2], alone.theta.state[0])):
        torch.testing.assert_close(one, other, atol=1e-5, rtol=1e-4)


def test_a_child_acts_after_its_parent_and_never_with_it(problem: Problem) -> None:
    """Root first: whatever the action says, a step moves the parts of one level, and both levels come in turn."""
    fitting = Fitting(problem.shapes, problem.observed, problem.start, FittingOptions(steps=2))
    trees, anything = problem.shapes.trees, torch.full((*problem.shapes.trees.valid.shape, 9), 8)
    for step in range(4):
        before = fitting.theta
        fitting.step(anything)
        after = fitting.theta
        root = torch.linalg.matrix_norm(after.rotation - before.rotation) > 1e-4
        assert (root == (step % 2 == 0)).all()
        assert ((after.state != before.state).any(1) <= (step % 2 == 1)).all()
        assert ((after.shift != before.shift).any((1, 2)) == (step % 2 == 1)).all()
        grown = (after.log_scale != before.log_scale).any(1)
        assert (grown == (step % 2 == 0)).all()
    assert fitting.done
    assert (trees.depth.amax(1) == 1).all()


def test_what_a_child_sees_follows_the_action_of_its_parent(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    before = fitting.view()
    action = torch.full((*problem.shapes.trees.valid.shape, 9), 5)
    action[:, 0, 3] = 9  # the root moves by 0.09 radii along its own x axis, and what it sees moves back
    fitting.step(action)
    moved = fitting.view().observed - before.observed
    along = moved.new_tensor([-0.09, 0.0, 0.0])
    torch.testing.assert_close(moved, along.expand_as(moved), atol=1e-5, rtol=1e-4)
    assert not fitting.mask[:, 0].any()


def test_only_what_faces_the_camera_counts(problem: Problem) -> None:
    """Points whose surface leans away from the camera change neither the distance nor what the agent sees."""
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    posed = fitting.posed
    points = posed.points(fitting.shapes.points, fitting.shapes.box_center)
    away = (points * posed.normals(fitting.shapes.normals)).sum(-1) >= 0
    assert 0.2 < away.float().mean() < 0.8
    # A point that leans away still does so farther along its normal.
    few, hidden = fitting.shapes.points.shape[2], problem.shapes.points.clone()
    hidden[:, :, :few] += torch.where(away[..., None], 0.5 * fitting.shapes.normals, 0.0)
    other = Fitting(replace(problem.shapes, points=hidden), problem.observed, problem.start, OPTIONS)
    assert torch.equal(other.shown, fitting.shown)
    assert torch.equal(other.distance, fitting.distance)
    for name, values in vars(fitting.view()).items():
        assert torch.equal(getattr(other.view(), name), values), name
    view = fitting.view()
    assert (view.reference[~view.shown] == 0).all()
