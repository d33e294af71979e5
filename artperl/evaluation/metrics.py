"""Errors of estimated 9D part poses and joints; :data:`METRICS` is the list of what an evaluation reports.

The first functions compare arrays and are batched over leading dimensions. Rotations are those of ``T_camera_part``,
centres those of the posed part boxes in the camera frame, sizes those of the part boxes.

A new metric is one function of an estimate and a sample, and one line of :data:`METRICS`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import rankdata

from artperl.core.estimate import Estimate, points_at_rest
from artperl.evaluation.box_overlap import iou_exact, iou_omad_legacy, iou_rest_exact
from artsim.observing.sample import Sample

Array = NDArray[np.float64]

PARTNET_DIAGONAL = {
    "laptop": 2.0,
    "eyeglasses": 1.7,
    "dishwasher": 2.1,
    "scissors": 2.0,
    "drawer": 2.05,
}
"""Diagonal of an object of each category in PartNet-Mobility's units, in which published translations are given.

Its objects are scaled to about 2 in the state in which they were modelled. Boxes at rest can be smaller (closed laptops
measure 1.3 to 1.7), so that errors given as a share of the diagonal at rest come out too large here, never too small.
"""


def rotation_error(estimate: ArrayLike, truth: ArrayLike) -> Array:
    """Angle between rotations (..., 3, 3), degrees.

    Returns
    -------
    (...) float
        0 to 180; exact near both ends, where the arc cosine of the trace is not.
    """
    estimate, truth = np.asarray(estimate, np.float64), np.asarray(truth, np.float64)
    relative = np.swapaxes(estimate, -1, -2) @ truth
    twist = relative - np.swapaxes(relative, -1, -2)
    sine = 0.5 * np.linalg.norm(np.stack([twist[..., 2, 1], twist[..., 0, 2], twist[..., 1, 0]], axis=-1), axis=-1)
    cosine = 0.5 * (np.trace(relative, axis1=-2, axis2=-1) - 1.0)
    angle: Array = np.rad2deg(np.arctan2(sine, cosine))
    return angle


def translation_error(estimate: ArrayLike, truth: ArrayLike, diagonal: ArrayLike) -> Array:
    """Distance between posed box centres (..., 3) as a share of the object's diagonal (...).

    Times 100 it is per cent of the diagonal; times :data:`PARTNET_DIAGONAL` it is in PartNet units.
    """
    distance = np.linalg.norm(np.asarray(estimate, np.float64) - np.asarray(truth, np.float64), axis=-1)
    share: Array = distance / np.asarray(diagonal, np.float64)
    return share


def direction_error(estimate: ArrayLike, truth: ArrayLike) -> Array:
    """Angle between directions (..., 3), degrees, 0 to 180."""
    estimate, truth = np.asarray(estimate, np.float64), np.asarray(truth, np.float64)
    angle: Array = np.rad2deg(
        np.arctan2(np.linalg.norm(np.cross(estimate, truth), axis=-1), (estimate * truth).sum(-1))
    )
    return angle


def axis_error(estimate: ArrayLike, truth: ArrayLike) -> Array:
    """Angle between directions (..., 3), degrees, 0 to 90: opposite directions are one axis."""
    angle = direction_error(estimate, truth)
    return np.minimum(angle, 180.0 - angle)


def state_error(estimate: ArrayLike, truth: ArrayLike, joint_type: Sequence[str]) -> Array:
    """Error of joint states: degrees for joints that turn, metres for those that slide.

    Parameters
    ----------
    estimate, truth : (..., K) float
        Radians or metres.
    joint_type : sequence of str, length K
        Angles of continuous joints are compared up to whole turns.

    Returns
    -------
    (..., K) float
        0 for the root.
    """
    error = np.abs(np.asarray(estimate, np.float64) - np.asarray(truth, np.float64))
    kinds = np.asarray(joint_type)
    wrapped = np.abs((error + np.pi) % (2 * np.pi) - np.pi)
    error = np.where(kinds == "continuous", wrapped, error)
    error = np.where(np.isin(kinds, ("revolute", "continuous", "screw")), np.rad2deg(error), error)
    result: Array = np.where(kinds == "free", 0.0, error)
    return result


def auroc(score: ArrayLike, positive: ArrayLike) -> float | None:
    """Chance that a positive has a higher score than a negative, ties counted half: the area under the ROC curve.

    Parameters
    ----------
    score : (N,) float
    positive : (N,) bool

    Returns
    -------
    float or None
        None where all are of one kind.
    """
    rank, own = rankdata(np.asarray(score)), np.asarray(positive, bool)
    pairs = int(own.sum()) * int((~own).sum())
    return float(rank[own].sum() - own.sum() * (own.sum() + 1) / 2) / pairs if pairs else None


def true_poses(sample: Sample) -> tuple[Array, Array]:
    """Rotation (K, 3, 3) and posed box centre (K, 3) of every part."""
    rotation, translation = sample.T_camera_part[:, :3, :3], sample.T_camera_part[:, :3, 3]
    return rotation, np.einsum("kij,kj->ki", rotation, sample.box_center) + translation


def rest_centers(translation: Array, size: Array, T_camera_part: Array) -> Array:
    """(K, 3) box centres in the estimated rest frame, whose origin is the middle of all boxes, as the true one's is.

    Parameters
    ----------
    translation, size : (K, 3) float
        Posed box centres in the camera frame, and sizes of the boxes, metres.
    T_camera_part : (K, 4, 4) float
    """
    center = points_at_rest(translation, T_camera_part)
    low, high = center - 0.5 * size, center + 0.5 * size
    middle: Array = 0.5 * (low.min(axis=0) + high.max(axis=0))
    return center - middle


@dataclass(frozen=True)
class Metric:
    """How far an estimate is from the truth, for every part."""

    errors: Callable[[Estimate, Sample], Array]
    """Gives (K,) values for an estimate of the K parts of a sample; NaN where the metric does not apply."""
    failed: float | Callable[[Sample], Array]
    """Value of every part when there is no estimate; or a callable that gives (K,) of them for a sample."""
    title: str = ""
    """Column of the table; empty: figures go to JSON only."""
    factor: float = 1.0
    """From the values to the unit of the table."""
    digits: int = 2
    """Decimals in the table."""
    less_is_better: bool = True

    def failed_values(self, sample: Sample) -> Array:
        """(K,) values of an estimate that does not exist."""
        return self.failed(sample) if callable(self.failed) else np.full(len(sample.joint_type), self.failed)


def _rotation(estimate: Estimate, sample: Sample) -> Array:
    return rotation_error(estimate.rotation, true_poses(sample)[0])


def _translation(estimate: Estimate, sample: Sample) -> Array:
    return translation_error(estimate.translation, true_poses(sample)[1], sample.diagonal)


def _percent(estimate: Estimate, sample: Sample) -> Array:
    return 100.0 * _translation(estimate, sample)


def _partnet_diagonal(sample: Sample) -> Array:
    return np.full(len(sample.joint_type), PARTNET_DIAGONAL.get(sample.category, np.nan))


def _partnet_units(estimate: Estimate, sample: Sample) -> Array:
    return _partnet_diagonal(sample) * _translation(estimate, sample)


def _iou_exact(estimate: Estimate, sample: Sample) -> Array:
    boxes = estimate.rotation, estimate.translation, estimate.size
    return iou_exact(*boxes, *true_poses(sample), sample.box_size)


def _iou_rest_exact(estimate: Estimate, sample: Sample) -> Array:
    center = rest_centers(estimate.translation, estimate.size, estimate.T_camera_part)
    return iou_rest_exact(center, estimate.size, sample.box_center, sample.box_size)


def _iou_omad_legacy(estimate: Estimate, sample: Sample) -> Array:
    center = rest_centers(estimate.translation, estimate.size, estimate.T_camera_part)
    return iou_omad_legacy(center, estimate.size, sample.box_center, sample.box_size)


def _joint_state(estimate: Estimate, sample: Sample) -> Array:
    return state_error(estimate.state, sample.joint_state, sample.joint_type)


def _joint_range(sample: Sample) -> Array:
    """(K,) whole range of each joint, degrees or metres; half a turn where it has no end."""
    low, high = sample.joint_limits.T
    span = np.where(np.isfinite(high - low), high - low, np.pi)
    return state_error(np.zeros(len(span)), span, sample.joint_type)


def _joint_axis(estimate: Estimate, sample: Sample) -> Array:
    off = axis_error(estimate.joint_axis, sample.joint_axis_camera)
    return np.where(np.array(sample.joint_type) == "free", 0.0, off)


def _right_angle(sample: Sample) -> Array:
    return np.where(np.array(sample.joint_type) == "free", 0.0, 90.0)


METRICS: dict[str, Metric] = {
    "rotation_deg": Metric(_rotation, 180.0, "rotation deg"),
    "translation_percent_diagonal": Metric(_percent, 100.0, "translation %"),
    "translation_partnet": Metric(_partnet_units, _partnet_diagonal, "PartNet units", digits=4),
    "iou_exact": Metric(_iou_exact, 0.0, "IoU exact %", 100.0, 1, less_is_better=False),
    "iou_rest_exact": Metric(_iou_rest_exact, 0.0, "IoU rest %", 100.0, 1, less_is_better=False),
    "iou_omad_legacy": Metric(_iou_omad_legacy, 0.0, less_is_better=False),
    "joint_state": Metric(_joint_state, _joint_range),
    "joint_axis_deg": Metric(_joint_axis, _right_angle),
}
"""Metrics by their keys in the JSON of ``artperl evaluate --json``.

A failed estimate counts with the worst values: half a turn, one diagonal, no overlap, the whole range of a joint. Views
are never left out.
"""
