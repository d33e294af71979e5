"""Following a moving object from frame to frame: a few steps from the last pose instead of a new search.

The first cloud is estimated as any other one. From then on the fitted reference keeps its shape, and its pose and
joint states are refined from two starts: where they were, and where they would be if they moved on as before. Points
are labelled by the nearest part. Where the fit gets much worse than it was, and at intervals, the cloud is estimated
anew: flat parts slide and turn a little from frame to frame, and nothing else brings them back.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from artperl.core.batch import concatenate
from artperl.core.clock import Clock
from artperl.core.estimate import Estimate, visibility
from artperl.core.labels import labels_by_surface
from artperl.core.pose import Posed, Theta, clamp_state, joint_axes, joint_states, pose_parts
from artperl.core.shapes import Observed, Shapes
from artperl.core.threads import steady_torch
from artperl.fitting.hypotheses import Fit
from artperl.fitting.levenberg_marquardt import refine
from artperl.fitting.refine_options import RefineOptions
from artperl.perception.preprocess import Cloud
from artsim.model.kinematics import Array
from artsim.model.transforms import invert_transform

POINTS = 1024
"""Points of a frame that are looked at, and labelled."""
_EARLY = RefineOptions(iterations=4, robust_start=0.08, robust_end=0.04)
"""From both starts, on few points: an object moves by some percent of its size between frames."""
_EARLY_POINTS = 256
_LAST = RefineOptions(iterations=5, robust_start=0.03, robust_end=0.03)
"""From the better one, once points are labelled anew."""
INTERVAL = 20
"""Frames after which a cloud is estimated anew; it takes as long as four others."""
_AS_GOOD = 1.2
"""A new estimate is taken when its residual is at most so many times that of what was followed: from a bad view, a
search may end elsewhere."""
_WORSE, _SLACK = 1.8, 0.003
"""A fit is lost when its residual is so many times that of the estimate which it began with, and diagonals more."""


@dataclass(frozen=True, eq=False)
class _Anchor:
    """What an estimate of one frame says of all that follow it."""

    estimate: Estimate
    shapes: Shapes
    """The fitted reference, whose shape stays."""
    T_fit_estimate: Array
    """(K, 4, 4) float. From the estimate's rest frame, as carried by each part, to the fit's: boxes may have moved
    slides."""
    state: Array
    """(K,) float. What the estimate's states have over those of the fit."""
    rest: Array
    """(K, 3) float. Box centres in the estimate's rest frame."""
    residual: float
    """Of the fit, by what is refined here."""


def track(with_fit: Callable[[ArrayLike], tuple[Estimate, Fit]], clouds: Iterable[ArrayLike]) -> Iterator[Estimate]:
    """Estimates of the clouds of one moving object, in their order.

    Parameters
    ----------
    with_fit : callable
        Estimates one cloud from the beginning; the fit comes with the estimate.
    clouds : iterable of (N, 3) float
        Camera frame, metres, of the object alone; one after the other, as a camera sees them.

    Yields
    ------
    Estimate
        One for each cloud. Its ``milliseconds`` tell how it was made: ``tracking``, or the stages of a new estimate.

    Raises
    ------
    ArtsimError
        When there is no object to be seen in a cloud.
    """
    anchor: _Anchor | None = None
    past: list[Theta] = []
    since = 0
    for points in clouds:
        followed = None if anchor is None else _follow(anchor, past, points)
        since += 1
        if followed is None or since >= INTERVAL:
            estimate, fit = with_fit(points)
            new, since = _anchor(estimate, fit, points), 0
            if followed is None or new.residual <= _AS_GOOD * followed[0].residual:
                # A new fit has another shape: how the object moves is only known from two frames of one fit.
                anchor, past = new, [fit.theta]
                yield estimate
                continue
        past = [*past[-1:], followed[1]]
        yield followed[0]


def _anchor(estimate: Estimate, fit: Fit, points: ArrayLike) -> _Anchor:
    """What the next frames begin with."""
    K, posed = len(estimate.state), pose_parts(fit.shapes.trees, fit.theta, fit.shapes.box_center)
    T = _transforms(posed, K)
    carried = estimate.T_camera_part
    rest = np.einsum("kji,kj->ki", carried[:, :3, :3], estimate.translation - carried[:, :3, 3])
    state = estimate.state - _double(joint_states(fit.shapes.trees, fit.theta))[:K]
    with steady_torch(), torch.inference_mode():
        observed = _labelled(fit.shapes, fit.theta, _tensor(Cloud.of(points, POINTS)))
        refined = refine(fit.shapes, observed, fit.theta, replace(_LAST, iterations=0), rigid=True)
    residual = float(refined.energy[0].clamp(min=0.0).sqrt())
    return _Anchor(estimate, fit.shapes, invert_transform(T) @ carried, state, rest, residual)


def _follow(anchor: _Anchor, past: list[Theta], points: ArrayLike) -> tuple[Estimate, Theta] | None:
    """The estimate of the next cloud, and the fit; None where the object is lost."""
    clock = Clock()
    with clock("tracking"), steady_torch(), torch.inference_mode():
        cloud = Cloud.of(points, POINTS)
        seen, shapes = _tensor(cloud), anchor.shapes
        starts = [past[-1], moved_on(shapes, past)] if len(past) > 1 else [past[-1]]
        theta: Theta = concatenate(starts)
        few = concatenate([_labelled(shapes, start, seen[:, :_EARLY_POINTS]) for start in starts])
        early = refine(shapes.repeat(len(starts)), few, theta, _EARLY, rigid=True)
        best = int(early.energy.argmin())
        theta = early.theta[best : best + 1]
        observed = _labelled(shapes, theta, seen)
        refined = refine(shapes, observed, theta, _LAST, rigid=True)
        residual = float(refined.energy[0].clamp(min=0.0).sqrt())
        if residual > _WORSE * anchor.residual + _SLACK:
            return None
        estimate = _estimate(anchor, refined.theta, observed, cloud, residual)
    return replace(estimate, milliseconds=clock.milliseconds), refined.theta


def moved_on(shapes: Shapes, past: list[Theta]) -> Theta:
    """Where an object would be if its parts moved once more as between its last two states."""
    before, now = past[-2:]
    turn = now.rotation @ before.rotation.mT
    state = clamp_state(shapes.trees, 2.0 * now.state - before.state)
    # The middle of the object moves on; its rest frame's origin is turned about it.
    return replace(
        now, rotation=turn @ now.rotation, translation=2.0 * now.translation - before.translation,
        state=torch.where(shapes.trees.free, state, now.state),
    )  # fmt: skip


def _estimate(anchor: _Anchor, theta: Theta, observed: Observed, cloud: Cloud, residual: float) -> Estimate:
    """The anchor's estimate with its parts where a fit has them now."""
    shapes, known = anchor.shapes, anchor.estimate
    K, posed = len(known.state), pose_parts(shapes.trees, theta, shapes.box_center)
    T = _transforms(posed, K) @ anchor.T_fit_estimate
    axis, origin = (_double(values)[:K] for values in joint_axes(shapes.trees, posed))
    part: NDArray[np.int64] = cloud.for_every_point(observed.part[0].numpy(), -1)
    return replace(
        known, rotation=T[:, :3, :3], translation=np.einsum("kij,kj->ki", T[:, :3, :3], anchor.rest) + T[:, :3, 3],
        T_camera_part=T, state=_double(joint_states(shapes.trees, theta))[:K] + anchor.state, joint_axis=axis,
        joint_origin=origin, part=part, visibility=visibility(shapes, observed, posed)[:K], trajectory=T[None],
        residual=residual, warnings=(),
    )  # fmt: skip


def _labelled(shapes: Shapes, theta: Theta, points: Tensor) -> Observed:
    """A cloud (1, N, 3) whose points are of the parts that are nearest."""
    observed = Observed.of(points, torch.zeros(points.shape[:2], dtype=torch.int64))
    alike = torch.zeros(1, points.shape[1], shapes.trees.num_rows)
    return replace(observed, part=labels_by_surface(shapes, observed, theta, alike))


def _tensor(cloud: Cloud) -> Tensor:
    return cloud.tensor(torch.device("cpu"))


def _transforms(posed: Posed, K: int) -> Array:
    T = np.tile(np.eye(4), (K, 1, 1))
    T[:, :3, :3], T[:, :3, 3] = _double(posed.rotation)[:K], _double(posed.translation)[:K]
    return T


def _double(values: Tensor) -> Array:
    """The first row, in double precision."""
    return values[0].double().numpy()
