"""The decision process: rewards are what the chamfer distance says, and the expert earns them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest
import torch

from artperl.agent.actions import NOTHING
from artperl.agent.decision_process import FAR, Fitting, FittingOptions, nearest_distance, nearest_distances
from artperl.data.fitting_problems import Problem
from tests.artperl.worlds import small_problem

OPTIONS = FittingOptions()


@pytest.fixture(params=[("laptop",), ("laptop", "eyeglasses")], ids=str)
def problem(request: pytest.FixtureRequest) -> Problem:
    return small_problem(*request.param)


def brute_force(fitting: Fitting, b: int) -> float:
    """Chamfer distance of one environment, in radii, both ways, of what faces the camera."""
    points = fitting.posed.points(fitting.shapes.points, fitting.shapes.box_center)[b]
    normals = fitting.posed.normals(fitting.shapes.normals)[b]
    own = fitting.shapes.has_surface[b][:, None] & ((points * normals).sum(-1) < 0.0)
    reference = points[own]
    apart = torch.cdist(fitting.observed.points[b], reference, compute_mode="donot_use_mm_for_euclid_dist")
    apart = apart / fitting.radius[b]
    return float(0.5 * (apart.amin(1).mean() + apart.amin(0).clamp(max=2.0).mean()))


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


def test_what_the_agent_sees_does_not_depend_on_place_or_size(problem: Problem) -> None:
    """The same problem farther to the side; and twice as large, twice as far away."""
    here = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS).view()
    away = torch.tensor([0.3, -0.2, 0.5])
    observed = replace(problem.observed, points=problem.observed.points + away)
    start = replace(problem.start, translation=problem.start.translation + away)
    moved = Fitting(problem.shapes, observed, start, OPTIONS).view()
    observed = replace(problem.observed, points=2.0 * problem.observed.points)
    log_scale = problem.start.log_scale + torch.tensor(2.0).log()
    start = replace(problem.start, translation=2.0 * problem.start.translation, log_scale=log_scale)
    larger = Fitting(problem.shapes, observed, start, OPTIONS).view()
    for name in ("observed", "joint", "state"):
        for there in (moved, larger):
            torch.testing.assert_close(getattr(here, name), getattr(there, name), atol=1e-3, rtol=1e-3)
    assert torch.equal(here.shown, larger.shown)  # from elsewhere a camera sees another side
    torch.testing.assert_close(here.reference, larger.reference, atol=1e-3, rtol=1e-3)


def test_the_nearest_distance_is_that_of_all_pairs() -> None:
    generator = torch.Generator().manual_seed(0)
    asked, offered = (torch.randn(7, n, 3, generator=generator) for n in (20, 30))
    torch.testing.assert_close(nearest_distance(asked, offered), torch.cdist(asked, offered).amin(-1))
    there, back = nearest_distances(asked, offered)
    torch.testing.assert_close(there, torch.cdist(asked, offered).amin(-1))
    torch.testing.assert_close(back, torch.cdist(offered, asked).amin(-1))


def test_parts_without_a_surface_are_near_nothing(problem: Problem) -> None:
    spacing = problem.shapes.spacing.clone()
    spacing[:, 1] = torch.inf
    fitting = Fitting(replace(problem.shapes, spacing=spacing), problem.observed, problem.start, OPTIONS)
    assert (fitting.reference[:, 1] == FAR).all()
    view = fitting.view()
    assert (view.reference[:, 1] == 0).all()
    assert torch.isfinite(fitting.distance).all()


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
    action[:, 0, 3] = 9  # the root moves by 0.09 radii along the camera's x axis
    fitting.step(action)
    after = fitting.view()
    moved = (after.reference - before.reference)[before.shown & after.shown][:, 0]
    assert len(moved) > 100
    torch.testing.assert_close(moved, torch.full_like(moved, 0.09), atol=1e-5, rtol=1e-4)
    assert not fitting.mask[:, 0].any()


def test_only_what_faces_the_camera_counts(problem: Problem) -> None:
    """Points whose surface leans away from the camera change neither the distance nor what the agent sees."""
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    posed = fitting.posed
    points = posed.points(fitting.shapes.points, fitting.shapes.box_center)
    away = (points * posed.normals(fitting.shapes.normals)).sum(-1) >= 0
    assert 0.2 < away.float().mean() < 0.8
    hidden = problem.shapes.points.clone()
    few = OPTIONS.reference_points
    hidden[:, :, :few] = torch.where(away[..., None], points.new_tensor(0.0), hidden[:, :, :few])
    # A point that leans away may be anywhere, as long as it does so from there, too.
    other = Fitting(replace(problem.shapes, points=hidden), problem.observed, problem.start, OPTIONS)
    stay = (other.shown == fitting.shown).all((1, 2))
    assert stay.any()
    torch.testing.assert_close(other.distance[stay], fitting.distance[stay])
    assert (fitting.view().reference[~fitting.shown] == 0).all()
