"""Refinement under kinematic constraints (ArtPERL, section 4.4) by Levenberg-Marquardt on Theta.

Results obey the joints by construction, since Theta has no other. The energy is the mean robust squared distance of
:mod:`artperl.fitting.correspondence`, and the cost of :class:`artperl.fitting.shape_prior.ShapePrior`. The robust
kernel is that of Geman and McClure 1987, ``w^2 e^2 / (w^2 + e^2)``: it falls when the width w shrinks, so that
narrowing it on the way never raises the energy either.
"""

from dataclasses import dataclass, replace

from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.pose import AxisPrior, Theta, clamp_state
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.compiled_refinement import refine_each
from artperl.fitting.correspondence import Target
from artperl.fitting.refine_options import RefineOptions
from artperl.fitting.shape_prior import ShapePrior


@dataclass(frozen=True, eq=False)
class Refined(Batch):
    """Outcome of a refinement of B objects."""

    theta: Theta
    axis: Tensor
    """(B, P, 3) float. The reference's axes as they lean now: those of ``shapes.trees`` unless they were free to."""
    energy: Tensor
    start_energy: Tensor
    """(B,) float. Of the result and of the start; the first is never larger."""
    iterations: Tensor
    """(B,) int64. That changed something."""


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
    return Refined(*refine_each(shapes, target, start, prior, options, rigid))
