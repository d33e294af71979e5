"""The search for the pose that explains a cloud: hypotheses, one score, one fit.

The hypotheses of a round are refined on few points. The one with the best score is fitted to all points; a chain of
joints is fitted again until it gets no better. The second round turns the best fit, and its fit replaces the best one
only with a better score.
"""

from dataclasses import replace
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
    Fit,
    Hypotheses,
    chain_states,
    half_turn,
    hinged_root,
    other_sides,
    perceived_pose,
)
from artperl.fitting.levenberg_marquardt import refine
from artperl.perception.network import Perceived

Values = TypeVar("Values", float, Tensor)

_NEVER = 100.0
"""Added to the score of an object that would be seen from where the camera is not. It is far above any residual. It is
low enough for single precision to tell residuals apart where all hypotheses have it."""
_CAMERA_ARC = np.deg2rad(15.0)
"""Arc that a camera may be away from where it is known to be: an estimate need not have it to the degree."""
_BELOW = np.deg2rad(10.0)
"""Below the horizon, from where no standing object is seen."""


def score(residual: Values, outside: Values) -> Values:
    """What is to be low, of every hypothesis and of every fit.

    Parameters
    ----------
    residual, outside
        Numbers, or one of each for every hypothesis: see :class:`Fit`.
    """
    return residual + _NEVER * outside


_AGAIN, _GAIN = 4, 0.01
"""Times that a chain's fit may be fitted again, and the share of the residual that has to be gained each time: what
hangs from a chain moves with each of its joints, so one fit leaves it half way."""

ROUNDS = (perceived_pose, hinged_root, chain_states), (half_turn, other_sides)
"""Generators whose hypotheses compete: those of perception, then those of the best fit of these."""


def find_fit(context: Context, clock: Clock) -> Fit:
    """The best fit to a cloud, its points labelled anew."""
    best: Fit | None = None
    for generators in ROUNDS:
        some = []
        for generate in generators:
            with clock(generate.__name__.replace("_", " ")):
                hypotheses = generate(context, best)
            some += [] if hypotheses is None else [hypotheses]
        if some:
            fit = refine_best(Hypotheses.join(some), context, clock)
            fit = _fit_again(fit, context, clock) if context.has_chain else fit
            best = fit if best is None else min(best, fit, key=_score)
    assert best is not None  # perception always proposes some
    with clock("labels"):
        observed = Observed.of(context.cloud, context.perceived.part)
        part = labels_by_surface(best.shapes, observed, best.theta, context.perceived.part_logits)
    return replace(best, observed=replace(observed, part=part))


def _score(fit: Fit) -> float:
    return score(fit.residual, fit.outside)


def _fit_again(fit: Fit, context: Context, clock: Clock) -> Fit:
    """A fit that is fitted anew from where it ends, its points labelled anew, as long as that makes it better."""
    for _ in range(_AGAIN):
        after = refine_best(Hypotheses(fit.shapes, fit.theta, [fit.row]), context, clock)
        before, fit = fit, min(fit, replace(after, start=fit.start), key=_score)
        if fit.residual > (1.0 - _GAIN) * before.residual:
            break
    return fit


def refine_best(hypotheses: Hypotheses, context: Context, clock: Clock) -> Fit:
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
        start = hypotheses.theta[best : best + 1]
    with clock("labels"):
        part = labels_by_surface(shapes, observed, theta, perceived.part_logits)
        observed = replace(observed, part=part)
    with clock("last"):
        refined = refine(shapes, observed, theta, options.refine, axis_prior=context.references.axis_priors[row])
        shapes = replace(shapes, trees=replace(shapes.trees, axis=refined.axis))
    end = refined.theta
    return Fit(
        shapes, observed, start, end, row, float(_residual(refined.energy)[0]),
        disagreement(shapes, observed, end, perceived), bool(outside(end, options.seen_from)[0]),
    )  # fmt: skip


def _residual(energy: Tensor) -> Tensor:
    return energy.clamp(min=0).sqrt()


def disagreement(shapes: Shapes, observed: Observed, theta: Theta, perceived: Perceived) -> float:
    """See :attr:`Fit.disagreement`."""
    return float(apart(shapes, observed, theta, perceived).median())


def apart(shapes: Shapes, observed: Observed, theta: Theta, perceived: Perceived) -> Tensor:
    """(N,) distance between where perception and the fit place each point in the rest frame, over the diagonal."""
    off = rest_places(shapes, observed, theta)[0] - perceived.canonical[0, : observed.part.shape[1]]
    return torch.linalg.vector_norm(off, dim=-1)


def rest_places(shapes: Shapes, observed: Observed, theta: Theta) -> Tensor:
    """(B, N, 3) where fits place the points in the rest frame, over the diagonal."""
    posed, rows = pose_parts(shapes.trees, theta, shapes.box_center), observed.part[..., None]
    rotation = posed.rotation.gather(1, rows[..., None].expand(-1, -1, 3, 3))
    moved = observed.points - posed.translation.gather(1, rows.expand(-1, -1, 3))
    unit = shapes.diagonal * theta.log_scale.mean(-1).exp()
    return rotate(rotation.mT, moved) / unit[:, None, None]


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
