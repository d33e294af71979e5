"""The search for the pose that explains a cloud: hypotheses, one score, one fit, one gate.

The hypotheses of a round are refined on few points. The one with the best score is fitted to all points. A later round
runs only where the gate asks for it, and its fit replaces the best one only with a better score.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import torch
from torch import Tensor

from artperl.core.clock import Clock
from artperl.core.labels import labels_by_surface
from artperl.core.pose import Theta, pose_parts
from artperl.core.rotations import rotate
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.hypotheses import (
    Context,
    Generator,
    Hypotheses,
    chain_states,
    half_turn,
    hinged_root,
    perceived_pose,
    views_around,
)
from artperl.fitting.levenberg_marquardt import refine
from artperl.fitting.options import EstimatorOptions
from artperl.perception.network import Perceived

Values = TypeVar("Values", float, Tensor)

_DISAGREEMENT = 0.3
"""Weight of the disagreement with perception against the residual: a flat part fits a wrong pose just as well, but
perception does not agree with that."""
_CLEARLY = 0.8
"""Share of the best score below which a hypothesis that perception did not propose wins: most others that fit are
wrong."""
_NEVER = 100.0
"""Added to the score of an object that would be seen from where the camera is not. It is far above any residual. It is
low enough for single precision to tell residuals apart where all hypotheses have it."""
_CAMERA_ARC = np.deg2rad(15.0)
"""Arc that a camera may be away from where it is known to be: an estimate need not have it to the degree."""
_BELOW = np.deg2rad(10.0)
"""Below the horizon, from where no standing object is seen."""


@dataclass(frozen=True, eq=False)
class Fit:
    """The best fit to one cloud: records of one row.

    Attributes
    ----------
    shapes : Shapes
    observed : Observed
        The cloud, labelled by perception and by how near the fitted parts are.
    theta : Theta
    path : list of Theta
        The start, the agent's steps, and the end.
    row : int
        Of the base.
    residual : float
        Root of the mean robust squared distance from the reference, in diagonals, weighed by part.
    disagreement : float
        Median distance between where perception and the fit place the points in the rest frame, over the diagonal.
    outside : bool
        Whether the object would be seen from elsewhere than the camera is known to be.
    """

    shapes: Shapes
    observed: Observed
    theta: Theta
    path: list[Theta]
    row: int
    residual: float
    disagreement: float
    outside: bool

    def to(self, device: torch.device | str) -> Fit:
        """The fit on another device."""
        return replace(
            self, shapes=self.shapes.to(device), observed=self.observed.to(device), theta=self.theta.to(device),
            path=[theta.to(device) for theta in self.path],
        )  # fmt: skip

    def with_end(self, theta: Theta) -> Fit:
        """The fit with another end."""
        return replace(self, theta=theta, path=[*self.path[:-1], theta])


def score(residual: Values, outside: Values, disagreement: float = 0.0) -> Values:
    """What is to be low, of every hypothesis and of every fit.

    Parameters
    ----------
    residual, outside
        Numbers, or one of each for every hypothesis: see :class:`Fit`.
    disagreement : float
        With perception, as far as it counts: see :class:`Round`.
    """
    return residual + disagreement + _NEVER * outside


@dataclass(frozen=True)
class Round:
    """Generators whose hypotheses compete.

    Attributes
    ----------
    generators : tuple of Generator
    wanted : callable
        Whether the round runs, given the best fit so far.
    share : float
        Of the best score, below which the round's fit replaces the best one.
    disagreement_weight : float
        Of the disagreement with perception against the residual. Where perception proposes every hypothesis, it has
        its say already: a weight there makes scissors and eyeglasses worse.
    """

    generators: tuple[Generator, ...]
    wanted: Callable[[Fit | None, EstimatorOptions], bool]
    share: float = 1.0
    disagreement_weight: float = 0.0

    def score(self, fit: Fit) -> float:
        """The score by which fits of this round compete with the best one."""
        return score(fit.residual, fit.outside, self.disagreement_weight * fit.disagreement)


def fits_badly(best: Fit | None, options: EstimatorOptions) -> bool:
    """The gate: there is no fit, its residual is large, or the camera is elsewhere."""
    return best is None or best.residual > options.retry_residual or best.outside


ROUNDS = (
    Round((perceived_pose, hinged_root, chain_states), lambda best, options: options.perceived_start),
    Round((half_turn,), lambda best, options: best is not None),
    Round((views_around,), fits_badly, _CLEARLY, _DISAGREEMENT),
)


def find_fit(context: Context, clock: Clock) -> Fit:
    """The best fit to a cloud, its points labelled anew."""
    best: Fit | None = None
    for stage in ROUNDS:
        if not stage.wanted(best, context.options):
            continue
        some = []
        for generate in stage.generators:
            with clock(generate.__name__.replace("_", " ")):
                hypotheses = generate(context, best)
            some += [] if hypotheses is None else [hypotheses]
        if some:
            fit = settle(Hypotheses.join(some), context, clock)
            if best is None or stage.score(fit) < stage.share * stage.score(best):
                best = fit
    assert best is not None  # the gate runs the last round where there is none
    with clock("labels"):
        observed = Observed.of(context.cloud, context.perceived.part)
        part = labels_by_surface(best.shapes, observed, best.theta, context.perceived.part_logits)
    return replace(best, observed=replace(observed, part=part))


def settle(hypotheses: Hypotheses, context: Context, clock: Clock) -> Fit:
    """The hypothesis with the best score after a few iterations on few points, fitted to all points.

    Points are labelled anew before the last fit. There axes lean as the points say.
    """
    options, perceived, observed = context.options, context.perceived, context.observed
    with clock("refine"):
        few = observed.map(lambda tensor: tensor[:, : options.early_points]).repeat(len(hypotheses.row))
        count = min(options.early_iterations, options.refine.iterations)
        early = refine(
            hypotheses.shapes, few, hypotheses.theta, replace(options.refine, iterations=count), rigid=True
        )  # fmt: skip
        best = int(score(_residual(early.energy), outside(early.theta, options.seen_from)).argmin())
        shapes, theta, row = hypotheses.shapes[best : best + 1], early.theta[best : best + 1], hypotheses.row[best]
    with clock("labels"):
        part = labels_by_surface(shapes, observed, theta, perceived.part_logits)
        observed = replace(observed, part=part)
    with clock("last"):
        refined = refine(shapes, observed, theta, options.refine, axis_prior=context.references.axis_priors[row])
        shapes = replace(shapes, trees=replace(shapes.trees, axis=refined.axis))
    end = refined.theta
    return Fit(
        shapes, observed, end, [*hypotheses.path[best], end], row, float(_residual(refined.energy)[0]),
        disagreement(shapes, observed, end, perceived), bool(outside(end, options.seen_from)[0]),
    )  # fmt: skip


def _residual(energy: Tensor) -> Tensor:
    return energy.clamp(min=0).sqrt()


def disagreement(shapes: Shapes, observed: Observed, theta: Theta, perceived: Perceived) -> float:
    """See :attr:`Fit.disagreement`."""
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    part = observed.part[0]
    fitted = ((observed.points[0] - posed.translation[0, part])[:, None] @ posed.rotation[0, part])[:, 0]
    unit = shapes.diagonal[0] * theta.log_scale[0].mean().exp()
    apart = torch.linalg.vector_norm(fitted / unit - perceived.canonical[0, : len(part)], dim=-1)
    return float(apart.median())


def outside(theta: Theta, seen_from: tuple[float, float] | None) -> Tensor:
    """(B,) whether objects would be seen from below or outside a range, see :attr:`EstimatorOptions.seen_from`."""
    if seen_from is None:
        return torch.zeros(len(theta), dtype=torch.bool, device=theta.state.device)
    low, high = np.deg2rad(seen_from)
    x, y, z = rotate(theta.rotation.mT, theta.translation).unbind(-1)  # from the camera to the object, in its frame
    flat = torch.hypot(x, y)
    off = torch.remainder(torch.atan2(y, x) - 0.5 * (low + high) + np.pi, 2.0 * np.pi) - np.pi
    beside: Tensor = (off.abs() - 0.5 * (high - low)).clamp(min=0.0) * flat > _CAMERA_ARC * torch.hypot(flat, z)
    return beside | (torch.atan2(z, flat) > _BELOW + _CAMERA_ARC)
