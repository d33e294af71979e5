"""Compiled loops do what torch does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from artperl.core.pose import AxisPrior, Theta, pose_parts
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.arrays import reference_of, state_of, tree_of, view_of
from artperl.fitting.compiled_refinement import refine_each
from artperl.fitting.correspondence import Target
from artperl.fitting.match_loops import match as match_one
from artperl.fitting.match_loops import misfits, pose
from artperl.fitting.refine_options import RefineOptions
from artperl.fitting.shape_prior import ShapePrior
from artperl.fitting.step_loops import damped_step, normal_equations
from tests.artperl.fitting.torch_matches import match
from tests.artperl.fitting.torch_refinement import NormalEquations, deviations, refine_together, robust_mean
from tests.artperl.worlds import small_problem

World = tuple[Shapes, Observed, Theta]


@pytest.fixture(params=["laptop", "drawer", "eyeglasses"])
def world(request: pytest.FixtureRequest) -> World:
    """Three objects in double precision, their shapes and axes free."""
    problem = small_problem(request.param, batch=3)
    shapes, observed, start = (part.to(torch.float64) for part in (problem.shapes, problem.observed, problem.start))
    generator = torch.Generator().manual_seed(0)
    valid = shapes.trees.valid[..., None]

    def noise(like: torch.Tensor) -> torch.Tensor:
        return torch.randn(like.shape, generator=generator, dtype=like.dtype)

    return shapes, observed, replace(
        start, log_scale=start.log_scale + 0.1 * noise(start.log_scale), shift=0.02 * noise(start.shift) * valid,
        stretch=0.1 * noise(start.stretch) * valid,
    )  # fmt: skip


def test_matches_and_steps_are_those_of_torch(world: World) -> None:
    shapes, observed, start = world
    options, P = RefineOptions(), shapes.trees.num_rows
    target = Target.of(observed, shapes.diagonal)
    matches = match(shapes, target, start, options.outline_weight)
    covariance = 0.01 * torch.eye(3 * P, dtype=torch.float64).expand(len(shapes), -1, -1)
    prior = ShapePrior.of(shapes, target.unit, options, AxisPrior(covariance, shapes.trees.turn != 0))
    lean, D = torch.zeros_like(start.shift), prior.active.shape[1]
    for b in range(len(shapes)):
        tree, shape, view, state = tree_of(shapes, b), reference_of(shapes, b), view_of(target, b), state_of(start, b)
        posed, rows = match_one(tree, shape, view, state, options.outline_weight)
        residual = torch.stack([matches.normal_residual[b], matches.tangent_residual[b]], dim=-1)
        np.testing.assert_allclose(posed.translation, matches.posed.translation[b], atol=1e-12)
        np.testing.assert_array_equal(rows.local, matches.local[b])
        np.testing.assert_allclose(rows.residual, residual, atol=1e-6)
        np.testing.assert_allclose(rows.weight, matches.weight[b], atol=1e-12)
        for rigid, count in ((True, 6 + P), (False, D)):
            moving = np.flatnonzero(prior.active[b, :count].numpy())
            equations = normal_equations(
                tree, shape, view, state, posed, rows, deviations(prior, start, lean)[b].numpy(),
                prior.precision[b].numpy(), moving, 0.2, rigid, True,
            )  # fmt: skip
            step, decrease = damped_step(equations, 0.01, count, D)
            known = NormalEquations.of(shapes, target, matches, lean, prior, 0.2, rigid)
            expected = known.step(torch.full_like(target.unit, 0.01), D)
            np.testing.assert_allclose(step, expected[b], atol=1e-5 * float(expected[b].abs().max()))
            assert decrease == pytest.approx(float(known.predicted_decrease(expected)[b]), rel=1e-4)


def test_refinements_end_where_those_of_torch_end(world: World) -> None:
    shapes, observed, start = world
    options = RefineOptions(iterations=8)
    target = Target.of(observed, shapes.diagonal)
    prior = ShapePrior.of(shapes, target.unit, options, None)
    theta, _, energy, first, _ = refine_each(shapes, target, start, prior, options, True)
    expected = refine_together(shapes, target, start, prior, options, True)
    torch.testing.assert_close(first, expected.start_energy, rtol=1e-5, atol=1e-12)
    torch.testing.assert_close(energy, expected.energy, rtol=1e-3, atol=1e-9)
    torch.testing.assert_close(theta.rotation, expected.theta.rotation, atol=1e-4, rtol=0.0)


def test_poses_that_are_kept_have_the_misfit_that_torch_gives_and_others_are_worse(world: World) -> None:
    shapes, observed, start = (part[:1] for part in world)
    own, keep = Observed.of(observed.points, torch.zeros_like(observed.part)), 5
    alone, generator = shapes.part(0), torch.Generator().manual_seed(1)
    turned = start.repeat(30)
    moved = replace(
        Theta.at_rest(alone.trees.map(lambda tensor: tensor.expand(30, *tensor.shape[1:]))),
        rotation=turned.rotation,
        translation=turned.translation + 0.2 * torch.randn(30, 3, generator=generator, dtype=torch.float64),
    )
    target = Target.of(own, shapes.diagonal)
    many = (part.map(lambda tensor: tensor.expand(30, *tensor.shape[1:])) for part in (alone, target))
    expected = robust_mean(match(*many, moved, 0.3), 0.03).numpy()
    order = np.argsort(expected, kind="stable")
    for poses in (order[::-1], order):  # the worst first, and the best first
        R, t = moved.rotation.numpy()[poses], moved.translation.numpy()[poses]
        found = misfits(reference_of(alone, 0), view_of(target, 0), R, t, np.zeros(30), keep, 0.3, 0.03)
        known = np.isfinite(found)
        np.testing.assert_allclose(found[known], expected[poses][known], rtol=1e-4)
        assert np.isin(order[:keep], poses[known]).all()
    assert known.sum() < 30


def test_states_are_posed_as_by_torch(world: World) -> None:
    shapes, _, start = world
    posed, own = pose_parts(shapes.trees, start, shapes.box_center), pose(
        tree_of(shapes, 1), reference_of(shapes, 1).box_center, state_of(start, 1)
    )  # fmt: skip
    np.testing.assert_allclose(own.rotation, posed.rotation[1], atol=1e-12)
    np.testing.assert_allclose(own.translation, posed.translation[1], atol=1e-12)
