"""Refinement under kinematic constraints (ArtPERL, section 4.4) by Levenberg-Marquardt on Theta.

Results obey the joints by construction, since Theta has no other. The energy is the mean robust squared distance of
:mod:`artperl.fitting.correspondence`, and the cost of :class:`artperl.fitting.shape_prior.ShapePrior`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.pose import AxisPrior, Theta, clamp_state
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.compiled_refinement import refine_each
from artperl.fitting.correspondence import Matches, Target, match
from artperl.fitting.damping import DAMPING, DAMPING_FALL, DAMPING_RISE, LEAST_DAMPING, MOST_DAMPING, RIGID_ITERATIONS
from artperl.fitting.jacobian import lean_axes, retract
from artperl.fitting.normal_equations import NormalEquations
from artperl.fitting.refine_options import RefineOptions
from artperl.fitting.shape_prior import ShapePrior


@dataclass(frozen=True, eq=False)
class Refined(Batch):
    """Outcome of a refinement of B objects.

    Attributes
    ----------
    theta : Theta
    axis : (B, P, 3) float
        The reference's axes as they lean now: those of ``shapes.trees`` unless they were free to.
    energy, start_energy : (B,) float
        Of the result and of the start; the first is never larger.
    iterations : (B,) int64
        That changed something.
    """

    theta: Theta
    axis: Tensor
    energy: Tensor
    start_energy: Tensor
    iterations: Tensor


def refine(
    shapes: Shapes,
    observed: Observed,
    start: Theta,
    options: RefineOptions | None = None,
    axis_prior: AxisPrior | None = None,
    rigid: bool = False,
) -> Refined:
    """Fit references to observed clouds.

    Every iteration matches the points anew, and a step is taken only if the robust energy, matched anew, falls; for an
    object whose step fails, damping grows. Joint states stay within their limits.

    Parameters
    ----------
    shapes : Shapes
    observed : Observed
    start : Theta
        For several starts of one object, repeat the rows of shapes and clouds.
    options : RefineOptions, optional
    axis_prior : AxisPrior, optional
        Lets axes lean away from the reference's; without it they stay.
    rigid : bool
        Leave the reference's shape and axes as they are, and take every iteration.

    Returns
    -------
    Refined
    """
    options = options or RefineOptions()
    unit = shapes.diagonal * start.log_scale.mean(-1).exp()
    prior = ShapePrior.of(shapes, unit, options, axis_prior)
    start = replace(start, state=clamp_state(shapes.trees, start.state))
    target = Target.of(observed, unit)
    if unit.device.type == "cpu":
        return Refined(*refine_each(shapes, target, start, prior, options, rigid))
    return _refine_together(shapes, target, start, prior, options, rigid)


def _refine_together(
    shapes: Shapes, target: Target, start: Theta, prior: ShapePrior, options: RefineOptions, rigid: bool
) -> Refined:
    """All objects at once, by torch."""
    unit = target.unit
    current, lean = match(shapes, target, start, options.outline_weight), torch.zeros_like(start.shift)
    current_cost = prior.cost(start, lean)
    start_energy = robust_mean(current, options.robust_end) + current_cost
    damping = torch.full_like(unit, DAMPING)
    steps = torch.zeros_like(unit, dtype=torch.int64)
    converged = torch.zeros_like(unit, dtype=torch.bool)
    width, equations, posed_shapes = options.robust_start, None, shapes
    for i in range(options.iterations):
        keeps_shape = rigid or i < RIGID_ITERATIONS
        if equations is None:
            equations = NormalEquations.of(posed_shapes, target, current, lean, prior, width, keeps_shape)
        step = equations.step(damping, prior.active.shape[1])
        theta, new_lean = retract(shapes.trees, current.theta, lean, step, target.middle)
        new_shapes = lean_axes(shapes, new_lean)
        candidate, cost = match(new_shapes, target, theta, options.outline_weight), prior.cost(theta, new_lean)
        before, after = robust_mean(current, width) + current_cost, robust_mean(candidate, width) + cost
        better = after < before
        current_cost, lean = torch.where(better, cost, current_cost), torch.where(better[:, None, None], new_lean, lean)
        if bool(better.all()):
            current, posed_shapes = candidate, new_shapes
        else:
            current, posed_shapes = candidate.where(better, current), lean_axes(shapes, lean)
        steps += better
        if width == options.robust_end and not keeps_shape:
            decrease = torch.where(better, before - after, equations.predicted_decrease(step))
            converged |= decrease < options.tolerance * before
        factor = torch.where(better, DAMPING_FALL, DAMPING_RISE)
        damping = (factor * damping).clamp(LEAST_DAMPING, MOST_DAMPING)
        last_width, width = width, max(options.robust_end, options.narrowing * width)
        if bool(better.any()) or width != last_width or i + 1 == RIGID_ITERATIONS:
            equations = None  # they are of another state, of other weights or of fewer parameters
        if bool(converged.all()):
            break
    end_energy = robust_mean(current, options.robust_end) + current_cost
    # Steps that lowered the energy of a wider kernel need not have lowered that of the last one.
    improved = end_energy < start_energy
    lean = torch.where(improved[:, None, None], lean, 0.0)
    energy = torch.where(improved, end_energy, start_energy)
    axis = lean_axes(shapes, lean).trees.axis
    return Refined(current.theta.where(improved, start), axis, energy, start_energy, steps)


def robust_mean(matches: Matches, width: float) -> Tensor:
    """(B,) mean robust squared distance, in squared diagonals.

    The kernel is that of Geman and McClure 1987, ``w^2 e^2 / (w^2 + e^2)``: it falls when the width w shrinks, so that
    narrowing it on the way never raises the energy either.
    """
    square = matches.square
    return (matches.weight * (width**2 * square / (width**2 + square))).sum(1)
