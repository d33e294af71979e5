"""The refinement in torch, all objects of a batch at once: the reference of the compiled loops."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

from artperl.core.batch import Batch
from artperl.core.pose import Theta
from artperl.core.shapes import Shapes
from artperl.core.trees import Trees
from artperl.fitting.columns import Columns
from artperl.fitting.correspondence import TANGENT_WEIGHT, Target
from artperl.fitting.levenberg_marquardt import Refined
from artperl.fitting.refine_options import (
    DAMPING,
    DAMPING_FALL,
    DAMPING_RISE,
    LEAST_DAMPING,
    MOST_DAMPING,
    RIGID_ITERATIONS,
    RefineOptions,
)
from artperl.fitting.shape_prior import ShapePrior
from tests.artperl.fitting.torch_jacobian import lean_axes, part_rates, residual_rates, retract
from tests.artperl.fitting.torch_matches import Matches, match


@dataclass(frozen=True, eq=False)
class NormalEquations(Batch):
    """``(J^T W J + precision) step = -gradient`` of B objects at one state, D parameters: see :class:`Columns`.

    Attributes
    ----------
    curvature : (B, D, D) float64
        The left side (Gauss-Newton).
    gradient : (B, D) float64
        Half that of the energy.
    free : (B, D) float64
        1 for parameters that move, 0 for others.
    """

    curvature: Tensor
    gradient: Tensor
    free: Tensor

    @staticmethod
    def of(
        shapes: Shapes, target: Target, matches: Matches, lean: Tensor, prior: ShapePrior, width: float, rigid: bool
    ) -> NormalEquations:
        """At the state that was matched, with a robust kernel of that width; ``rigid`` leaves out the shape."""
        weight = matches.weight * (width**2 / (width**2 + matches.square)) ** 2
        tangent = TANGENT_WEIGHT * (matches.tangent_residual > 0)[..., None] * matches.tangent
        directions = torch.stack([matches.normal, tangent], dim=2)
        residual = torch.stack([matches.normal_residual, TANGENT_WEIGHT * matches.tangent_residual], dim=2).flatten(1)
        leans = prior.active.shape[1] > Columns(shapes.trees.num_rows).shift.stop
        rows = residual_rates(shapes, target.middle, matches, directions, rigid).flatten(1, 2)
        parts = part_rates(shapes, target.middle, matches.theta, matches.posed, rigid, leans)
        parts = parts / target.unit[:, None, None, None]
        D = parts.shape[-1]
        active, precision = prior.active[:, :D], prior.precision[:, :D, :D]
        # Sums over each part's points, few numbers, are taken before parameters come in, which are many.
        own = functional.one_hot(matches.part, parts.shape[1]).transpose(1, 2) * weight[:, None]
        weighted = (own.repeat_interleave(2, dim=2)[..., None] * rows[:, None]).transpose(2, 3)
        parts = (parts * active[:, None, None]).flatten(1, 2)
        square = (weighted @ rows[:, None] @ parts.unflatten(1, weighted.shape[1:3])).flatten(1, 2)
        curvature = (parts.transpose(1, 2) @ square + precision).double()
        gradient = (parts.transpose(1, 2) @ (weighted @ residual[:, None, :, None]).flatten(1, 2))[..., 0]
        gradient = gradient + (precision @ deviations(prior, matches.theta, lean)[:, :D, None])[..., 0]
        gradient = gradient.double()
        free = (active & ~_at_limit(shapes.trees, matches.theta, gradient)).double()
        return NormalEquations(curvature * free[:, None] * free[:, :, None], gradient, free)

    def step(self, damping: Tensor, count: int) -> Tensor:
        """(B, count) damped step of all parameters, after Marquardt 1963; those that were left out stay."""
        diagonal = self.curvature.diagonal(dim1=1, dim2=2)
        floor = 1e-6 * diagonal.mean(-1, keepdim=True) + 1e-30
        curvature = self.curvature + torch.diag_embed(damping[:, None] * diagonal + floor + (1.0 - self.free))
        step = torch.linalg.solve(curvature, -(self.gradient * self.free)[..., None])[..., 0].to(damping.dtype)
        return functional.pad(step, (0, count - step.shape[1]))

    def predicted_decrease(self, step: Tensor) -> Tensor:
        """(B,) by how much the energy would fall after a step (B, count) if every point kept its match."""
        own = step[:, : self.gradient.shape[1]].to(self.gradient)
        change = own * (2.0 * self.gradient + (self.curvature @ own[..., None])[..., 0])
        return -change.sum(-1).to(step.dtype)


def _at_limit(trees: Trees, theta: Theta, gradient: Tensor) -> Tensor:
    """(B, D) states at a limit beyond which the energy falls: they stay there."""
    held, state = torch.zeros_like(gradient, dtype=torch.bool), Columns(trees.num_rows).state
    held[:, state] = ((theta.state <= trees.lower) & (gradient[:, state] > 0)) | (
        (theta.state >= trees.upper) & (gradient[:, state] < 0)
    )
    return held


def cost_of(prior: ShapePrior, theta: Theta, lean: Tensor) -> Tensor:
    """(B,) of a state and of its axes' lean (B, P, 3)."""
    own = deviations(prior, theta, lean)
    return (own * (prior.precision @ own[..., None])[..., 0]).sum(-1)


def deviations(prior: ShapePrior, theta: Theta, lean: Tensor) -> Tensor:
    """(B, D) from the reference's shape; pose and states count as 0."""
    pose = torch.zeros_like(prior.active[:, : 6 + theta.state.shape[1]], dtype=theta.state.dtype)
    shape = [theta.log_scale, theta.stretch.flatten(1), theta.shift.flatten(1), lean.flatten(1)]
    return torch.cat([pose, *shape], dim=1)[:, : prior.active.shape[1]]


def refine_together(
    shapes: Shapes, target: Target, start: Theta, prior: ShapePrior, options: RefineOptions, rigid: bool
) -> Refined:
    """All objects at once, by torch."""
    unit = target.unit
    current, lean = match(shapes, target, start, options.outline_weight), torch.zeros_like(start.shift)
    current_cost = cost_of(prior, start, lean)
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
        candidate, cost = match(new_shapes, target, theta, options.outline_weight), cost_of(prior, theta, new_lean)
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
