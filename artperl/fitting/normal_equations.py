"""Normal equations of the reweighted least squares: what a Levenberg-Marquardt step solves."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

from artperl.core.batch import Batch
from artperl.core.pose import Theta
from artperl.core.shapes import Shapes
from artperl.core.trees import Trees
from artperl.fitting.correspondence import TANGENT_WEIGHT, Matches, Target
from artperl.fitting.jacobian import Columns, part_rates, residual_rates
from artperl.fitting.shape_prior import ShapePrior


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
        gradient = gradient + (precision @ prior.deviations(matches.theta, lean)[:, :D, None])[..., 0]
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
