"""The decision process: rewards are what the chamfer distance says, and the expert earns them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Literal

import pytest
import torch

from artperl.agent.decision_process import FAR, Fitting, FittingOptions, nearest
from artperl.data.fitting_problems import Problem
from tests.artperl.worlds import small_problem

OPTIONS = FittingOptions(observed_points=128, reference_points=48)


@pytest.fixture(params=[("laptop",), ("laptop", "eyeglasses")], ids=str)
def problem(request: pytest.FixtureRequest) -> Problem:
    return small_problem(*request.param)


def brute_force(fitting: Fitting, b: int, both: bool) -> float:
    """Chamfer distance of one environment, in radii."""
    points = fitting.posed.points(fitting.shapes.points, fitting.shapes.box_center)[b]
    reference = points[fitting.shapes.has_surface[b]].reshape(-1, 3)
    apart = torch.cdist(fitting.observed.points[b], reference, compute_mode="donot_use_mm_for_euclid_dist")
    apart = apart / fitting.radius[b]
    there = apart.amin(1).mean()
    return float(0.5 * (there + apart.amin(0).clamp(max=2.0).mean()) if both else there)


@pytest.mark.parametrize("distance", ["observed", "both"])
def test_the_distance_is_the_chamfer_distance(problem: Problem, distance: Literal["observed", "both"]) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, replace(OPTIONS, distance=distance))
    brute = torch.tensor([brute_force(fitting, b, distance == "both") for b in range(len(problem))])
    torch.testing.assert_close(fitting.distance, brute, atol=1e-4, rtol=1e-3)


def test_the_reward_says_whether_the_chamfer_distance_fell(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    generator = torch.Generator().manual_seed(0)
    for _ in range(5):
        before = torch.tensor([brute_force(fitting, b, False) for b in range(len(problem))])
        action = torch.randint(0, 11, (*problem.shapes.trees.valid.shape, 9), generator=generator)
        reward = fitting.step(action)
        after = torch.tensor([brute_force(fitting, b, False) for b in range(len(problem))])
        clear = (after - before).abs() > 1e-3
        assert (reward[clear] == torch.where(after < before, 0.5, -0.5)[clear]).all()


def test_doing_nothing_costs_a_tenth(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    reward = fitting.step(torch.full((*problem.shapes.trees.valid.shape, 9), 5))
    torch.testing.assert_close(reward, torch.full_like(reward, -0.05))


def test_the_expert_brings_the_clouds_together(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    first = fitting.distance
    while not fitting.done:
        fitting.step(fitting.expert(problem.goal))
    assert (fitting.distance < first).float().mean() > 0.8
    assert fitting.distance.mean() < 0.5 * first.mean()
    assert fitting.steps_taken == OPTIONS.steps


def test_offsets_lead_to_the_nearest_point_of_the_same_part(problem: Problem) -> None:
    fitting = Fitting(problem.shapes, problem.observed, problem.start, OPTIONS)
    view = fitting.view()
    for b, k in [(0, 0), (1, 1)]:
        own, back = view.part[b] == k, view.back[b, k]
        apart = torch.cdist(view.observed[b, own], view.reference[b, k])
        length = torch.linalg.vector_norm(view.offset[b, own], dim=-1)
        torch.testing.assert_close(length, apart.amin(1), atol=1e-4, rtol=1e-3)
        if own.any():
            torch.testing.assert_close(torch.linalg.vector_norm(back, dim=-1), apart.amin(0), atol=1e-4, rtol=1e-3)
    unseen = ~torch.nn.functional.one_hot(view.part, view.valid.shape[1]).bool().any(1)
    assert (view.back[unseen] == 0).all()


def test_what_the_agent_sees_does_not_depend_on_place_or_size(problem: Problem) -> None:
    """The same problem moved, with the camera, and twice as large."""
    move = torch.tensor([0.3, -0.2, 0.5])
    observed = replace(problem.observed, points=problem.observed.points + move)
    start = replace(problem.start, translation=problem.start.translation + move)
    here, there = (
        Fitting(problem.shapes, cloud, theta, OPTIONS).view()
        for cloud, theta in ((problem.observed, problem.start), (observed, start))
    )
    for name in ("observed", "offset", "joint", "state"):
        torch.testing.assert_close(getattr(here, name), getattr(there, name), atol=1e-3, rtol=1e-3)


@pytest.mark.parametrize("room", [600, 1500, 1 << 15])
def test_nearest_agrees_with_all_pairs_whatever_the_room(room: int) -> None:
    generator = torch.Generator().manual_seed(0)
    asked, offered = (torch.randn(7, n, 4, generator=generator) for n in (20, 30))
    index, least = nearest(asked, offered, 3, torch.empty(room))
    least_of_all, where = (asked @ offered.transpose(1, 2)).unflatten(2, (3, 10)).min(-1)
    assert (index == where).all()
    torch.testing.assert_close(least, least_of_all)


def test_parts_without_a_surface_are_near_nothing(problem: Problem) -> None:
    spacing = problem.shapes.spacing.clone()
    spacing[:, 1] = torch.inf
    fitting = Fitting(replace(problem.shapes, spacing=spacing), problem.observed, problem.start, OPTIONS)
    assert (fitting.reference[:, 1] == FAR).all()
    view = fitting.view()
    assert (view.reference[:, 1] == 0).all()
    assert torch.isfinite(view.offset).all()


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
    fitting = Fitting(problem.shapes, problem.observed, problem.start, replace(OPTIONS, order="root first", steps=2))
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
    fitting = Fitting(problem.shapes, problem.observed, problem.start, replace(OPTIONS, order="root first"))
    before = fitting.view()
    action = torch.full((*problem.shapes.trees.valid.shape, 9), 5)
    action[:, 0, 3] = 9  # the root moves by 0.09 radii along the camera's x axis
    fitting.step(action)
    moved = (fitting.view().reference - before.reference)[before.shown][:, 0]
    torch.testing.assert_close(moved, torch.full_like(moved, 0.09), atol=1e-5, rtol=1e-4)
    assert not fitting.mask[:, 0].any()


def test_only_what_faces_the_camera_counts(problem: Problem) -> None:
    """Points whose surface leans away from the camera change neither the distance nor what the agent sees."""
    options = replace(OPTIONS, facing=True, distance="both")
    fitting = Fitting(problem.shapes, problem.observed, problem.start, options)
    posed = fitting.posed
    points = posed.points(fitting.shapes.points, fitting.shapes.box_center)
    away = (points * posed.normals(fitting.shapes.normals)).sum(-1) >= 0
    assert 0.2 < away.float().mean() < 0.8
    hidden = problem.shapes.points.clone()
    few = OPTIONS.reference_points
    hidden[:, :, :few] = torch.where(away[..., None], points.new_tensor(0.0), hidden[:, :, :few])
    # A point that leans away may be anywhere, as long as it does so from there, too.
    other = Fitting(replace(problem.shapes, points=hidden), problem.observed, problem.start, options)
    stay = (other.shown == fitting.shown).all((1, 2))
    assert stay.any()
    torch.testing.assert_close(other.distance[stay], fitting.distance[stay])
    assert (fitting.view().reference[~fitting.shown] == 0).all()
