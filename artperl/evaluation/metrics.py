"""Errors of estimated 9D part poses and joints. Every function is batched over leading dimensions.

Rotations are those of ``T_camera_part``, centres those of the posed part boxes in the camera frame, sizes those of the
part boxes. A failed estimate is not left out: see :data:`FAILED`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import rankdata

from artperl.evaluation.box_overlap import iou, iou_aligned, iou_omad_legacy

Array = NDArray[np.float64]

FAILED = {"rotation_deg": 180.0, "translation": 1.0, "iou": 0.0}
"""What an estimate that does not exist counts as: half a turn, one diagonal, no overlap. Frames are never skipped."""

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

__all__ = [
    "FAILED",
    "PARTNET_DIAGONAL",
    "axis_error",
    "iou_exact",
    "iou_omad_legacy",
    "iou_rest_exact",
    "line_distance",
    "rotation_error",
    "state_error",
    "translation_error",
    "translation_error_omad",
]


def rotation_error(
    estimate: ArrayLike,
    truth: ArrayLike,
    symmetries: ArrayLike | None = None,
    symmetry_axis: ArrayLike | None = None,
) -> Array:
    """Angle between rotations, degrees.

    Parameters
    ----------
    estimate, truth : (..., 3, 3) float
    symmetries : (S, 3, 3) float, optional
        Rotations of the part onto itself, in its rest frame, the identity among them: the least error counts.
    symmetry_axis : (3,) float, optional
        Instead: the part is a body of revolution about this direction of its rest frame, whose own error counts.

    Returns
    -------
    (...) float
        0 to 180; exact near both ends, where the arc cosine of the trace is not.
    """
    estimate, truth = np.asarray(estimate, np.float64), np.asarray(truth, np.float64)
    if symmetry_axis is not None:
        axis = np.asarray(symmetry_axis, np.float64)
        return axis_error(estimate @ axis, truth @ axis, signed=True)
    if symmetries is not None:
        images = truth[..., None, :, :] @ np.asarray(symmetries, np.float64)
        least: Array = rotation_error(estimate[..., None, :, :], images).min(axis=-1)
        return least
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


def translation_error_omad(T_estimate: ArrayLike, T_truth: ArrayLike, diagonal: ArrayLike) -> Array:
    """Distance between the images of the rest frame's origin, the centre of the whole object at rest, under a part.

    Part of a child's rotation error leaks into it by the distance of the object's centre from the part.

    Parameters
    ----------
    T_estimate, T_truth : (..., 4, 4) float
        ``T_camera_part``.
    diagonal : (...) float
    """
    return translation_error(np.asarray(T_estimate)[..., :3, 3], np.asarray(T_truth)[..., :3, 3], diagonal)


def iou_exact(
    rotation: ArrayLike,
    center: ArrayLike,
    size: ArrayLike,
    true_rotation: ArrayLike,
    true_center: ArrayLike,
    true_size: ArrayLike,
) -> Array:
    """Exact IoU of posed part boxes: rotations (..., 3, 3), centres and sizes (..., 3)."""
    return iou(rotation, center, size, true_rotation, true_center, true_size)


def iou_rest_exact(center: ArrayLike, size: ArrayLike, true_center: ArrayLike, true_size: ArrayLike) -> Array:
    """Exact IoU of part boxes (..., 3) in the rest frame: shape and place in the object, but no pose."""
    return iou_aligned(center, size, true_center, true_size)


def axis_error(estimate: ArrayLike, truth: ArrayLike, signed: bool = False) -> Array:
    """Angle between directions (..., 3), degrees; opposite directions are one axis unless ``signed``."""
    a, b = np.asarray(estimate, np.float64), np.asarray(truth, np.float64)
    sine, cosine = np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1)
    angle: Array = np.rad2deg(np.arctan2(sine, cosine if signed else np.abs(cosine)))
    return angle


def line_distance(origin: ArrayLike, axis: ArrayLike, true_origin: ArrayLike, true_axis: ArrayLike) -> Array:
    """Shortest distance between two lines, metres; stable when they are parallel.

    Parameters
    ----------
    origin, true_origin : (..., 3) float
        A point on each line.
    axis, true_axis : (..., 3) float
        Unit directions.

    Notes
    -----
    For lines at an angle the distance is ``|d . n| / |n|`` with ``n = a x b``. Both are differences of nearly equal
    numbers when the lines are nearly parallel; below a milliradian the lines count as parallel.
    """
    a, b = np.asarray(axis, np.float64), np.asarray(true_axis, np.float64)
    between = np.asarray(true_origin, np.float64) - np.asarray(origin, np.float64)
    normal = np.cross(a, b)
    sine = np.linalg.norm(normal, axis=-1)
    parallel = sine < 1e-3
    skew = np.abs((between * normal).sum(axis=-1)) / np.where(parallel, 1.0, sine)
    across = np.linalg.norm(np.cross(between, b), axis=-1)
    distance: Array = np.where(parallel, across, skew)
    return distance


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
