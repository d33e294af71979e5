"""How good an estimator is: the errors of every part of every test sample.

A failed estimate counts with the worst values of :data:`artperl.evaluation.metrics.METRICS`; none is left out.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from artperl.core.confidence import PartSymptoms, Symptoms
from artperl.core.estimate import Estimate
from artperl.evaluation.metrics import METRICS, direction_error, rotation_error, translation_error, true_poses
from artsim.common.progress import track
from artsim.errors import ArtsimError
from artsim.model.objects import ArticulatedObject
from artsim.observing.interference import FOREIGN
from artsim.observing.roundness import round_axes
from artsim.observing.sample import Sample
from artsim.observing.symmetry import Symmetry, equivalent_sample, symmetries

Array = NDArray[np.float64]
Estimating = Callable[[NDArray[Any]], Estimate]
"""Any method: from the points (N, 3) of a cloud, camera frame, metres, to an estimate."""

_RIGHT = (10.0, 0.05)
"""An estimate is right when every part is within that many degrees and diagonals: what confidence speaks of."""
_FAR_OFF = 10.0
"""Most that one error counts for in :func:`headline`, degrees or per cent of the diagonal."""


@dataclass(frozen=True, eq=False)
class Scored:
    """Errors of one estimate against one sample of K parts."""

    category: str
    errors: dict[str, Array]
    """dict of (K,) float. Values of :data:`artperl.evaluation.metrics.METRICS`, by the same keys."""
    parts_found: float
    """Share of parts with an estimated one of their own near their true pose, or one that looks the same, whatever its
    number; of as many as there are, or as were estimated if those are more."""
    segmentation: float
    """Share of points with the right part."""
    failed: bool
    symptoms: Symptoms
    confidence: float
    milliseconds: float
    part_confidence: Array
    """(E,) float. Of the estimated parts."""
    part_right: NDArray[np.bool_]
    """(E,) bool. Whether each estimated part has a true part of its own near it."""
    part_symptoms: PartSymptoms
    part_names: tuple[str, ...] = ()
    """Of the sample."""
    symmetric_errors: dict[str, Array] | None = None
    """dict of (K,) float, or None. Errors against the nearest of the truths that look the same; None where the object
    has no symmetry."""

    @property
    def up_to_symmetry(self) -> Scored:
        """The same estimate, judged by the nearest of the truths that look the same."""
        return self if self.symmetric_errors is None else replace(self, errors=self.symmetric_errors)

    @property
    def rotation(self) -> Array:
        """(K,) degrees."""
        return self.errors["rotation_deg"]

    @property
    def translation(self) -> Array:
        """(K,) of box centres, over the diagonal."""
        return self.errors["translation_percent_diagonal"] / 100.0

    @property
    def right(self) -> bool:
        """Whether every part is near its true pose."""
        return bool((self.rotation <= _RIGHT[0]).all() and (self.translation <= _RIGHT[1]).all())


class LooksSame(NamedTuple):
    """Turns of an object and of its parts that nobody sees."""

    whole: Sequence[Symmetry] = ()
    """Of the object as a whole, with parts exchanged."""
    round: Sequence[Array] = ()
    """Of each part, axes (A, 3) that it is round about; none for objects of which that is not known."""


AS_IT_IS = LooksSame()
"""Of an object that looks the same in no other way, or of which that is not known."""
Symmetries = Mapping[str, LooksSame]
"""SHA-256 of an object -> the ways in which it looks the same."""


def evaluate(
    estimator: Estimating, samples: Iterable[Sample], progress: bool = False, symmetric: Symmetries | None = None
) -> list[Scored]:
    """Score an estimator on samples, one at a time; where symmetries are given, up to these as well."""
    views = track("evaluating", samples, unit="view", leave=False, shown=progress)
    known = symmetric or {}
    return [score(estimator, sample, known.get(sample.object_sha256, AS_IT_IS)) for sample in views]


def object_symmetries(objects: Iterable[ArticulatedObject]) -> dict[str, LooksSame]:
    """In what ways each object looks the same, by the objects' SHA-256."""
    return {obj.sha256: LooksSame(symmetries(obj), round_axes(obj)) for obj in objects}


def evaluate_foreign(estimator: Estimating, samples: Iterable[Sample]) -> list[Scored]:
    """Scores of estimates for objects that are not of the estimator's categories: whatever it says is wrong."""
    estimates = ((sample, estimator(sample.points)) for sample in samples)
    return [
        _mismatch(sample, estimate, sum(estimate.milliseconds.values()), AS_IT_IS) for sample, estimate in estimates
    ]


def score(estimator: Estimating, sample: Sample, symmetric: LooksSame = AS_IT_IS) -> Scored:
    """Errors of the estimate of one sample, whose object looks the same in these ways."""
    begun = time.perf_counter()
    try:
        estimate = estimator(sample.points)
    except ArtsimError:
        return _failure(sample, 1e3 * (time.perf_counter() - begun))
    milliseconds = 1e3 * (time.perf_counter() - begun)
    if len(estimate.state) != len(sample.joint_type):
        return _mismatch(sample, estimate, milliseconds, symmetric)
    return compare(estimate, sample, milliseconds, symmetric)


def compare(estimate: Estimate, sample: Sample, milliseconds: float, symmetric: LooksSame = AS_IT_IS) -> Scored:
    """Errors of an estimate that has as many parts as the sample.

    Of the truths that look the same, the nearest is that of the least mean error in rotation.
    """
    errors, part_right = _errors(estimate, sample), match_parts(estimate, sample, symmetric)
    others = [_errors(estimate, equivalent_sample(sample, symmetry)) for symmetry in symmetric.whole]
    nearest = min([errors, *others], key=lambda found: float(found["rotation_deg"].mean())) if others else None
    return Scored(
        category=sample.category,
        part_names=sample.part_names,
        errors=errors,
        symmetric_errors=nearest,
        parts_found=found_share(part_right, sample),
        segmentation=float((estimate.part == np.where(sample.part == FOREIGN, -1, sample.part.astype(int))).mean()),
        failed=False,
        symptoms=estimate.symptoms,
        confidence=estimate.confidence,
        milliseconds=milliseconds,
        part_confidence=estimate.part_confidence,
        part_right=part_right,
        part_symptoms=estimate.part_symptoms,
    )


def _errors(estimate: Estimate, sample: Sample) -> dict[str, Array]:
    return {name: metric.errors(estimate, sample) for name, metric in METRICS.items()}


def found_share(part_right: NDArray[np.bool_], sample: Sample) -> float:
    """:attr:`Scored.parts_found` of estimated parts of which it is known whether they are right."""
    return float(part_right.sum() / max(len(part_right), len(sample.box_size)))


def match_parts(estimate: Estimate, sample: Sample, symmetric: LooksSame = AS_IT_IS) -> NDArray[np.bool_]:
    """See :attr:`Scored.part_right`: of the truths that look the same, by the one that most parts are near to."""
    found = [_matched(estimate, sample, symmetric.round)]
    for symmetry in symmetric.whole:
        axes = [symmetric.round[k] @ symmetry.rotation for k in symmetry.parts] if symmetric.round else ()
        found.append(_matched(estimate, equivalent_sample(sample, symmetry), axes))
    return max(found, key=np.count_nonzero)


def _matched(estimate: Estimate, sample: Sample, round_about: Sequence[Array]) -> NDArray[np.bool_]:
    """Whether each estimated part is near a true one of its own; how far a round one is turned does not count."""
    rotation, center = true_poses(sample)
    off = rotation_error(estimate.rotation[:, None], rotation[None])
    for k, axes in enumerate(round_about):
        if len(axes):
            off[:, k] = direction_error(estimate.rotation @ axes[0], rotation[k] @ axes[0]) if len(axes) == 1 else 0.0
    away = translation_error(estimate.translation[:, None], center[None], sample.diagonal)
    near = (off <= _RIGHT[0]) & (away <= _RIGHT[1])
    estimated, true = linear_sum_assignment(near, maximize=True)
    right = np.zeros(len(near), dtype=bool)
    right[estimated] = near[estimated, true]
    return right


def headline(scored: Sequence[Scored]) -> float:
    """One number to keep the best by: mean over categories of rotation in degrees and translation in % of the diagonal,
    means and medians over views of their parts' means.

    Each error counts for ten at most: how many fail matters, but whether one that fails is off by 15 or by 150 degrees
    says more about the draw than about the estimator. Where there is a part too many or too few, those that are not
    found count for ten.
    """
    terms = []
    for category in dict.fromkeys(s.category for s in scored):
        own = [s for s in scored if s.category == category]
        for errors in ([s.errors[name] for s in own] for name in ("rotation_deg", "translation_percent_diagonal")):
            clipped = [
                _FAR_OFF * (1.0 - s.parts_found) if s.failed else np.minimum(error, _FAR_OFF).mean()
                for s, error in zip(own, errors, strict=True)
            ]
            terms += [np.median(clipped), np.mean(clipped)]
    return float(np.mean(terms))


def mean_iou(scored: Sequence[Scored]) -> float:
    """Mean exact intersection over union of all boxes, as posed and at rest."""
    return float(np.mean(np.concatenate([s.errors[name] for s in scored for name in ("iou_exact", "iou_rest_exact")])))


def _mismatch(sample: Sample, estimate: Estimate, milliseconds: float, symmetric: LooksSame) -> Scored:
    """An estimate with other parts than the object has: it fails, but says how well it fits."""
    part_right = match_parts(estimate, sample, symmetric)
    return replace(
        _failure(sample, milliseconds),
        parts_found=found_share(part_right, sample),
        symptoms=estimate.symptoms,
        confidence=estimate.confidence,
        part_confidence=estimate.part_confidence,
        part_right=part_right,
        part_symptoms=estimate.part_symptoms,
    )


def _failure(sample: Sample, milliseconds: float) -> Scored:
    return Scored(
        category=sample.category,
        part_names=sample.part_names,
        errors={name: metric.failed_values(sample) for name, metric in METRICS.items()},
        parts_found=0.0,
        segmentation=0.0,
        failed=True,
        symptoms=Symptoms(),
        confidence=0.0,
        milliseconds=milliseconds,
        part_confidence=np.zeros(0),
        part_right=np.zeros(0, dtype=bool),
        part_symptoms=PartSymptoms(),
    )
