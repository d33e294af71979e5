"""Equations 6 and 7 are what section 4.4 says, once its misprints are settled, and their minimum is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import artsim
from artperl.core.pose import Theta, clamp_state, pose_parts
from artperl.core.rotations import rotation_from_vector
from artperl.core.shapes import Observed, Shapes
from artperl.core.trees import Trees
from artperl.data.fitting_problems import Problem
from artperl.fitting.paper_energy import joint_energy, part_energy, refine_by_gradient, total_energy
from tests.artperl.worlds import small_problem


def exact(problem: Problem) -> Problem:
    """A problem in double precision."""
    return problem.to(torch.float64)


def near(problem: Problem, degrees: float, length: float) -> Theta:
    """The goal, turned and moved a little; the state of every joint is left."""
    generator = torch.Generator().manual_seed(1)
    axis = torch.nn.functional.normalize(torch.randn(len(problem), 3, generator=generator), dim=-1)
    turn = rotation_from_vector(axis * np.deg2rad(degrees)).to(problem.goal.rotation)
    shift = torch.nn.functional.normalize(torch.randn(len(problem), 3, generator=generator), dim=-1)
    goal = problem.goal
    move = length * problem.shapes.diagonal[:, None] * shift.to(goal.translation)
    return replace(goal, rotation=turn @ goal.rotation, translation=goal.translation + move)


def test_joint_energy_holds_for_theta_and_counts_for_free_parts() -> None:
    trees = Trees.stack([artsim.make(category, 0).tree for category in ("laptop", "drawer")])
    theta = replace(Theta.at_rest(trees), state=clamp_state(trees, trees.rest + 0.7))
    rotation = pose_parts(trees, theta, torch.zeros_like(theta.shift)).rotation
    torch.testing.assert_close(joint_energy(trees, rotation), torch.zeros(2).double())
    tilted = rotation.clone()
    tilted[:, 1] = rotation_from_vector(torch.tensor([0.0, 0.0, 0.2], dtype=torch.float64)) @ tilted[:, 1]
    # A laptop's hinge, level, is carried by 2 sin(0.1) away from itself; so is a drawer's rail.
    torch.testing.assert_close(joint_energy(trees, tilted), torch.full((2,), 2 * np.sin(0.1)).double())


def test_part_energy_is_the_chamfer_distance_of_what_faces_the_camera() -> None:
    shapes = Shapes.from_objects([artsim.make("laptop", 3)], 64, dtype=torch.float64)
    theta = replace(Theta.at_rest(shapes.trees), translation=torch.tensor([[0.1, 0.0, 2.0]], dtype=torch.float64))
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    points = shapes.points.flatten(1, 2) + torch.tensor([0.0, 0.0, 2.0], dtype=torch.float64)
    part = torch.arange(2).repeat_interleave(64)[None]
    expected = 0.0
    for k in range(2):
        surface = posed.points(shapes.points, shapes.box_center)[0, k].numpy()
        normals = posed.normals(shapes.normals)[0, k].numpy()
        a, b = surface[(surface * normals).sum(1) < 0], points[0, part[0] == k].numpy()
        square = ((a[:, None] - b) ** 2).sum(-1)
        expected += square.min(0).mean() + square.min(1).mean()
    found = part_energy(shapes, Observed.of(points, part), posed, shapes.diagonal)
    assert float(found) == pytest.approx(expected / float(shapes.diagonal) ** 2, rel=1e-6)


@pytest.mark.parametrize("category", ["laptop", "drawer"])
def test_the_gradient_is_that_of_finite_differences(category: str) -> None:
    problem = exact(small_problem(category, batch=2))
    start = near(problem, 5.0, 0.02)
    unit = problem.shapes.diagonal
    change = torch.zeros(2, 6 + start.state.shape[1], dtype=torch.float64, requires_grad=True)

    def energy(values: torch.Tensor) -> torch.Tensor:
        theta = replace(
            start, rotation=rotation_from_vector(values[:, :3]) @ start.rotation,
            translation=start.translation + values[:, 3:6], state=start.state + values[:, 6:],
        )  # fmt: skip
        return total_energy(problem.shapes, problem.observed, theta, unit)

    energy(change).sum().backward()
    assert change.grad is not None
    step = 1e-7
    for column in range(change.shape[1]):
        away = torch.zeros_like(change)
        away[:, column] = step
        with torch.no_grad():
            slope = (energy(away) - energy(-away)) / (2.0 * step)
        torch.testing.assert_close(change.grad[:, column], slope, atol=1e-5, rtol=1e-3)


def test_the_minimum_is_nearer_than_a_start_beside_it() -> None:
    problem = small_problem("laptop")
    start = near(problem, 8.0, 0.05)
    found = refine_by_gradient(problem.shapes, problem.observed, start, iterations=60)
    assert (found.energy <= found.start_energy).all()
    truth = total_energy(problem.shapes, problem.observed, problem.goal, problem.shapes.diagonal)
    assert found.energy.median() < 0.7 * found.start_energy.median()
    assert found.energy.median() < 1.5 * truth.median()  # what is left is the difference of the two objects
    assert torch.equal(found.theta.log_scale, start.log_scale)  # the scale is fixed (section 4.4)


def test_states_never_leave_their_limits() -> None:
    problem = small_problem("drawer")
    trees = replace(problem.shapes.trees, upper=0.3 * problem.shapes.trees.upper)
    shapes = replace(problem.shapes, trees=trees)
    state = refine_by_gradient(shapes, problem.observed, near(problem, 10.0, 0.1), iterations=10).theta.state
    assert (state >= trees.lower).all()
    assert (state <= trees.upper).all()
