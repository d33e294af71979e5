"""Refinement pulls references onto clouds, obeys the joints, and never makes anything worse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import artsim
from artperl.core.pose import AxisPrior, Theta
from artperl.core.shapes import Observed, Shapes
from artperl.evaluation import metrics
from artperl.fitting.levenberg_marquardt import refine
from artperl.fitting.refine_options import RefineOptions
from artsim.errors import ConfigError
from tests.artperl.fitting.problems import errors, observe, perturbed, true_theta, views
from tests.artperl.fitting.torch_jacobian import lean_axes

KNOWN_SHAPE = RefineOptions(sigma_scale=1e-3, sigma_aspect=1e-3, sigma_stretch=1e-3, sigma_shift=1e-3)


def test_a_laptop_that_is_off_by_20_degrees_and_a_tenth_comes_back(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    result = refine(shapes, observed, perturbed(shapes, truth, 20.0, 0.1), KNOWN_SHAPE)
    rotation, translation = errors(shapes, result.theta, truth)
    assert np.median(rotation) < 0.5
    assert rotation.max() < 5.0
    assert np.median(translation) < 0.02


def test_drawers_come_back(drawers: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = drawers
    result = refine(shapes, observed, perturbed(shapes, truth, 10.0, 0.05), KNOWN_SHAPE)
    rotation, translation = errors(shapes, result.theta, truth)
    assert np.median(rotation) < 1.0
    assert np.median(translation) < 0.02


def test_another_laptop_takes_on_the_shape_of_the_one_seen() -> None:
    _, samples = views("laptop", 12, first_seed=50)
    others = Shapes.from_objects([artsim.make("laptop", 200 + i).with_diagonal(1.0) for i in range(12)])
    observed, truth = observe(samples), true_theta(others, samples)
    start = perturbed(others, truth, 15.0, 0.08)
    fixed, adapted = refine(others, observed, start, KNOWN_SHAPE), refine(others, observed, start)
    rotation, translation = errors(others, adapted.theta, truth)
    assert np.median(rotation) < 2.0
    assert np.median(translation) < 0.04
    assert np.median(translation) < np.median(errors(others, fixed.theta, truth)[1])


def test_energy_never_rises_from_any_start(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    for seed, degrees, length in ((0, 0.0, 0.0), (1, 5.0, 0.02), (2, 60.0, 0.3), (3, 170.0, 0.5)):
        start = perturbed(shapes, truth, degrees, length, seed)
        result = refine(shapes, observed, start)
        assert (result.energy <= result.start_energy).all()


@pytest.mark.parametrize("seed", range(3))
def test_states_never_leave_their_limits(drawers: tuple[Shapes, Observed, Theta], seed: int) -> None:
    shapes, observed, truth = drawers
    narrow = replace(shapes.trees, upper=0.3 * shapes.trees.upper)  # so that most true states lie outside
    shapes = replace(shapes, trees=narrow)
    start = perturbed(shapes, truth, 20.0, 0.2, seed)
    result = refine(shapes, observed, start)
    assert (result.theta.state >= narrow.lower).all()
    assert (result.theta.state <= narrow.upper).all()


def test_outliers_lose_their_say(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    points = observed.points.clone()
    wild = torch.rand(points.shape[1], generator=torch.Generator().manual_seed(1)) < 0.1
    points[:, wild] += 0.5 * torch.randn(len(points), int(wild.sum()), 3, generator=torch.Generator().manual_seed(2))
    result = refine(shapes, replace(observed, points=points), perturbed(shapes, truth, 10.0, 0.05), KNOWN_SHAPE)
    assert np.median(errors(shapes, result.theta, truth)[0]) < 1.0


def test_points_without_weight_change_nothing(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    start = perturbed(shapes, truth, 10.0, 0.05)
    weight = torch.ones_like(observed.weight)
    weight[:, ::4] = 0.0
    moved = observed.points.clone()
    moved[:, ::4] += 7.0
    ignored = [refine(shapes, Observed(p, observed.part, weight), start) for p in (observed.points, moved)]
    torch.testing.assert_close(ignored[0].theta.rotation, ignored[1].theta.rotation, atol=1e-4, rtol=0.0)


def test_a_batch_gives_what_its_objects_give_alone(drawers: tuple[Shapes, Observed, Theta]) -> None:
    objects, _ = views("drawer", 6)
    shapes, observed, truth = drawers
    start = perturbed(shapes, truth, 10.0, 0.05)
    together = refine(shapes, observed, start, RefineOptions(iterations=6))
    for b, obj in enumerate(objects[:3]):
        K = len(obj)
        alone = Shapes.from_objects([obj])
        own = Theta(start.rotation[b : b + 1], start.translation[b : b + 1], start.log_scale[b : b + 1],
                    start.state[b : b + 1, :K], start.shift[b : b + 1, :K], start.stretch[b : b + 1, :K])  # fmt: skip
        single = refine(alone, observed[b : b + 1], own, RefineOptions(iterations=6))
        torch.testing.assert_close(single.theta.rotation[0], together.theta.rotation[b], atol=2e-3, rtol=0.0)
        torch.testing.assert_close(single.theta.state[0], together.theta.state[b, :K], atol=2e-3, rtol=0.0)


@pytest.mark.slow
def test_hinges_lean_as_the_points_say_and_as_far_as_they_may() -> None:
    """References whose hinges lean by six degrees the other way; both hinges of a pair lean together."""
    objects, samples = views("eyeglasses", 32, first_seed=30)
    shapes, observed = Shapes.from_objects(objects, dtype=torch.float32), observe(samples)
    folded = torch.tensor([min(abs(s.joint_state[1:])) > 0.5 for s in samples])
    lean = torch.zeros_like(shapes.points[:, :, 0])
    lean[:, 1:, 0] = np.deg2rad(6.0)
    others, truth = lean_axes(shapes, lean), true_theta(shapes, samples)
    start = perturbed(others, truth, 3.0, 0.01)
    P = shapes.trees.num_rows
    one = torch.zeros(3 * P)
    one[3::3] = 0.1
    prior = AxisPrior(torch.outer(one, one).expand(len(shapes), -1, -1), shapes.trees.depth > 0)
    fixed = refine(others, observed, start, KNOWN_SHAPE)
    free = refine(others, observed, start, KNOWN_SHAPE, axis_prior=prior)
    assert torch.equal(fixed.axis, others.trees.axis)
    assert (free.energy <= free.start_energy).all()
    off = [metrics.axis_error(axis[folded, 1:].numpy(), shapes.trees.axis[folded, 1:].numpy()) for axis in
           (others.trees.axis, free.axis)]  # fmt: skip
    assert folded.sum() >= 8
    assert np.median(off[0]) == pytest.approx(6.0, abs=0.01)
    assert np.median(off[1]) < 2.5
    shared = torch.linalg.cross(others.trees.axis, free.axis)[:, 1:, 0]
    torch.testing.assert_close(shared[:, 0], shared[:, 1], atol=0.02, rtol=0.1)  # up to what any axis may lean


def test_options_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ConfigError):
        RefineOptions(iterations=-1)
    with pytest.raises(ConfigError):
        RefineOptions(robust_end=0.5)
    with pytest.raises(ConfigError):
        RefineOptions(sigma_stretch=0.0)


def test_a_rigid_reference_keeps_its_shape(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    start = perturbed(shapes, truth, 10.0, 0.05)
    theta = refine(shapes, observed, start, rigid=True).theta
    for name in ("log_scale", "stretch", "shift"):
        assert torch.equal(getattr(theta, name), getattr(start, name))
    assert not torch.equal(theta.rotation, start.rotation)
