"""How good an estimator is: errors of every part of every test sample, and the table of their medians and means.

Metrics as ``artperl.evaluation.metrics`` defines them. A failed estimate counts with the worst values; none is left
out.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment, minimize

from artperl.core.estimate import Calibration, Estimate, brought_to_rest
from artperl.data.categories import Parts, objects_of
from artperl.evaluation import metrics
from artperl.methods.protocol import Method
from artsim.common.progress import track
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.errors import ArtsimError
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.renderers import make_renderer

Array = NDArray[np.float64]

TEST_SEEDS = 1_000_000
"""Seed of the first procedural object of a test set; streams and bases have others."""
VALIDATION_SEEDS = 1_500_000
"""Seed of the first object by which the best estimator is chosen and its confidence calibrated."""
NUM_POINTS = 8192
"""Points of a test cloud: of the 4,000 to 100,000 pixels that show an object in a depth image of 640 x 480."""
_RIGHT = (10.0, 0.05)
"""An estimate is right when every part is within that many degrees and diagonals: what confidence speaks of."""

_FAR_OFF = 10.0
_FITS_WELL = 0.75


@dataclass(frozen=True, eq=False)
class Scored:
    """Errors of one estimate against one sample of K parts.

    Attributes
    ----------
    category : str
    rotation : (K,) float
        Degrees.
    translation : (K,) float
        Of box centres, over the diagonal.
    iou_exact, iou_rest_exact, iou_omad_legacy : (K,) float
    state : (K,) float
        Degrees or metres; 0 for the root.
    axis : (K,) float
        Degrees, direction of each joint's axis; 0 for the root.
    found : float
        Share of parts with an estimated one of their own near their true pose, whatever its number; of as many as there
        are, or as were estimated if those are more.
    segmentation : float
        Share of points with the right part.
    failed : bool
    residual, disagreement, confidence : float
    visibility : float
        Of the part that shows least.
    milliseconds : float
    """

    category: str
    rotation: Array
    translation: Array
    iou_exact: Array
    iou_rest_exact: Array
    iou_omad_legacy: Array
    state: Array
    axis: Array
    found: float
    segmentation: float
    failed: bool
    residual: float
    disagreement: float
    confidence: float
    visibility: float
    milliseconds: float

    @property
    def right(self) -> bool:
        """Whether every part is near its true pose."""
        return bool((self.rotation <= _RIGHT[0]).all() and (self.translation <= _RIGHT[1]).all())


def frozen_samples(
    categories: Sequence[str],
    objects: int = 40,
    views_per_object: int = 4,
    options: SampleOptions | None = None,
    first_seed: int = TEST_SEEDS,
    parts: Parts = "artimage",
    max_parts: int | None = None,
) -> list[Sample]:
    """Samples of unseen procedural objects: always the same ones for the same arguments."""
    return [
        sample
        for category in dict.fromkeys(categories)
        for sample in samples_of(
            objects_of([category], objects, first_seed, parts, max_parts), views_per_object, options, first_seed
        )
    ]


def samples_of(
    objects: Iterable[ArticulatedObject],
    views_per_object: int = 4,
    options: SampleOptions | None = None,
    seed: int = TEST_SEEDS,
) -> list[Sample]:
    """The same number of views of every object; they depend on the seed and on the object's place in the list."""
    options = options or SampleOptions(num_points=NUM_POINTS)
    renderer = make_renderer(options.renderer)
    return [
        draw_sample(obj, options, seed, index, renderer)
        for n, obj in enumerate(objects)
        for index in range(n * views_per_object, (n + 1) * views_per_object)
    ]


def evaluate(estimator: Method, samples: Iterable[Sample], progress: bool = False) -> list[Scored]:
    """Score an estimator on samples, one at a time."""
    views = track("evaluating", samples, unit="view", leave=False, shown=progress)
    return [score(estimator, sample) for sample in views]


def mistake(estimator: Method, samples: Iterable[Sample]) -> list[Scored]:
    """Scores of estimates for objects that are not of the estimator's categories: whatever it says is wrong."""
    estimates = ((sample, estimator(sample.points)) for sample in samples)
    return [_wrong(sample, estimate, sum(estimate.milliseconds.values())) for sample, estimate in estimates]


def score(estimator: Method, sample: Sample) -> Scored:
    """Errors of the estimate of one sample."""
    begun = time.perf_counter()
    try:
        estimate = estimator(sample.points)
    except ArtsimError:
        return _failed(sample, 1e3 * (time.perf_counter() - begun))
    milliseconds = 1e3 * (time.perf_counter() - begun)
    if len(estimate.state) != len(sample.joint_type):
        return _wrong(sample, estimate, milliseconds)
    return compare(estimate, sample, milliseconds)


def compare(estimate: Estimate, sample: Sample, milliseconds: float) -> Scored:
    """Errors of an estimate that has as many parts as the sample."""
    rotation, center = true_poses(sample)
    children = np.array(sample.joint_type) != "free"
    rest_center = rest_centers(estimate.translation, estimate.size, estimate.T_camera_part)
    return Scored(
        category=sample.category,
        rotation=metrics.rotation_error(estimate.rotation, rotation),
        translation=metrics.translation_error(estimate.translation, center, sample.diagonal),
        iou_exact=metrics.iou_exact(
            estimate.rotation, estimate.translation, estimate.size, rotation, center, sample.box_size
        ),
        iou_rest_exact=metrics.iou_rest_exact(rest_center, estimate.size, sample.box_center, sample.box_size),
        iou_omad_legacy=metrics.iou_omad_legacy(rest_center, estimate.size, sample.box_center, sample.box_size),
        state=metrics.state_error(estimate.state, sample.joint_state, sample.joint_type),
        axis=np.where(children, metrics.axis_error(estimate.joint_axis, sample.joint_axis_camera), 0.0),
        found=found(estimate, sample),
        segmentation=float((estimate.part == sample.part).mean()),
        failed=False,
        residual=estimate.residual,
        disagreement=estimate.disagreement,
        confidence=estimate.confidence,
        visibility=float(estimate.visibility.min()),
        milliseconds=milliseconds,
    )


def found(estimate: Estimate, sample: Sample) -> float:
    """See :attr:`Scored.found`."""
    rotation, center = true_poses(sample)
    off = metrics.rotation_error(estimate.rotation[:, None], rotation[None])
    away = metrics.translation_error(estimate.translation[:, None], center[None], sample.diagonal)
    near = (off <= _RIGHT[0]) & (away <= _RIGHT[1])
    return float(near[linear_sum_assignment(near, maximize=True)].sum() / max(near.shape))


def true_poses(sample: Sample) -> tuple[Array, Array]:
    """Rotation (K, 3, 3) and posed box centre (K, 3) of every part."""
    rotation, translation = sample.T_camera_part[:, :3, :3], sample.T_camera_part[:, :3, 3]
    return rotation, np.einsum("kij,kj->ki", rotation, sample.box_center) + translation


def summary(scored: Sequence[Scored]) -> dict[str, Any]:
    """Figures by category and part, in JSON's terms: the format of ``artperl evaluate --json``.

    Returns
    -------
    dict
        ``{category: {"parts": [{metric: {"median": x, "mean": x}}], "failures": n, "instances": n,
        "ms_per_instance": median, ...}}``
    """
    return {category: _category_summary(scored, category) for category in dict.fromkeys(s.category for s in scored)}


def _category_summary(scored: Sequence[Scored], category: str) -> dict[str, Any]:
    own = [s for s in scored if s.category == category]
    partnet = metrics.PARTNET_DIAGONAL.get(category)
    columns: dict[str, Callable[[Scored], Array]] = {
        "rotation_deg": lambda s: s.rotation,
        "translation_percent_diagonal": lambda s: 100.0 * s.translation,
        "iou_exact": lambda s: s.iou_exact,
        "iou_rest_exact": lambda s: s.iou_rest_exact,
        "iou_omad_legacy": lambda s: s.iou_omad_legacy,
        "joint_state": lambda s: s.state,
        "joint_axis_deg": lambda s: s.axis,
    }
    if partnet:
        columns["translation_partnet"] = lambda s: partnet * s.translation
    parts = [
        {name: _middle([column(s)[k] for s in own if len(s.rotation) > k]) for name, column in columns.items()}
        for k in range(max(len(s.rotation) for s in own))
    ]
    right, confidence = np.array([s.right for s in own]), np.array([s.confidence for s in own])
    return {
        "parts": parts,
        "instances": len(own),
        "failures": sum(s.failed for s in own),
        "right": float(right.mean()),
        "parts_found": float(np.mean([s.found for s in own])),
        "segmentation": float(np.mean([s.segmentation for s in own])),
        "confidence_of_right": _median(confidence[right]),
        "confidence_of_wrong": _median(confidence[~right]),
        "confidence_auroc": metrics.auroc(confidence, right),
        "ms_per_instance": float(np.median([s.milliseconds for s in own])),
    }


def table(figures: dict[str, Any]) -> str:
    """The paper's table: one line for each category and part."""
    head = (
        f"{'':14s}{'rotation deg':>16s}{'translation %':>16s}{'PartNet units':>16s}{'IoU exact %':>14s}{'rest %':>14s}"
    )
    lines = [head, f"{'':14s}" + f"{'median':>9s}{'mean':>7s}" * 3 + f"{'median':>7s}{'mean':>7s}" * 2]
    for category, figure in figures.items():
        for k, part in enumerate(figure["parts"]):
            units = part.get("translation_partnet")
            lines.append(
                f"{f'{category} {k}':14s}"
                + _pair(part["rotation_deg"], "9.2f", "7.2f")
                + _pair(part["translation_percent_diagonal"], "9.2f", "7.2f")
                + (_pair(units, "9.4f", "7.4f") if units else 16 * " ")
                + _pair(part["iou_exact"], "7.1f", "7.1f", 100.0)
                + _pair(part["iou_rest_exact"], "7.1f", "7.1f", 100.0)
            )
        lines.append(
            f"{'':14s}{figure['instances']} instances, {figure['failures']} failures, "
            f"{100 * figure['right']:.0f} % right, {100 * figure['parts_found']:.0f} % of parts found, "
            f"{100 * figure['segmentation']:.1f} % of points right, "
            f"{figure['ms_per_instance']:.0f} ms"
        )
        if figure["confidence_auroc"] is not None:
            lines.append(
                f"{'':14s}confidence of right ones {100 * figure['confidence_of_right']:.0f} %, of wrong ones "
                f"{100 * figure['confidence_of_wrong']:.0f} % in the median, AUROC {figure['confidence_auroc']:.2f}"
            )
    return "\n".join(lines)


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
        for errors in ([s.rotation for s in own], [100.0 * s.translation for s in own]):
            clipped = [
                _FAR_OFF * (1.0 - s.found) if s.failed else np.minimum(error, _FAR_OFF).mean()
                for s, error in zip(own, errors, strict=True)
            ]
            terms += [np.median(clipped), np.mean(clipped)]
    return float(np.mean(terms))


def mean_iou(scored: Sequence[Scored]) -> float:
    """Mean exact intersection over union of all boxes, as posed and at rest."""
    return float(np.mean(np.concatenate([np.stack([s.iou_exact, s.iou_rest_exact]) for s in scored], axis=1)))


def retry_residual(scored: Sequence[Scored]) -> float:
    """Residual above which an estimate is looked for again: that of the quarter that fits worst."""
    residuals = [s.residual for s in scored if np.isfinite(s.residual)]
    return float(np.quantile(residuals, _FITS_WELL)) if residuals else 0.0


def calibrate(scored: Sequence[Scored], foreign: Sequence[Scored] = ()) -> Calibration:
    """Confidence such that, of estimates with confidence p, a share p is right: regularised logistic regression.

    Clouds of other things count as much, all together, as those of the category. Estimates with a part too many or too
    few are wrong ones.

    Weights of the residual and of the disagreement are kept from rising above 0, and that of the visibility from
    falling below, so that nothing that fits badly or hardly shows is ever trusted more for it, however far it lies from
    what was seen here.
    """
    own, others = ([s for s in some if np.isfinite(s.residual)] for some in (scored, foreign))
    known = own + others
    default = Calibration()
    if not known:
        return default
    prior = np.array([default.bias, default.residual, default.disagreement, default.visibility])
    features = np.array([[1.0, s.residual, s.disagreement, s.visibility] for s in known])
    right = np.array([s.right for s in known], dtype=np.float64)
    count = np.array([1.0] * len(own) + [len(own) / len(others) for _ in others])
    loose = np.array([0.1, 0.01, 0.03, 0.1]) ** 2  # precision of the prior

    def cost(scaled: Array) -> tuple[float, Array]:
        weights = scaled * np.abs(prior)
        score = features @ weights
        chance = 1.0 / (1.0 + np.exp(-score.clip(-60.0, 60.0)))
        off = weights - prior
        value = count @ (np.logaddexp(0.0, score) - right * score) + 0.5 * loose @ off**2
        slope = features.T @ (count * (chance - right)) + loose * off
        return float(value), slope * np.abs(prior)

    bounds = [(None, None), (None, -0.1), (None, -0.1), (0.0, None)]
    weights = minimize(cost, np.sign(prior), jac=True, bounds=bounds).x * np.abs(prior)
    return Calibration(*(float(w) for w in weights))


def rest_centers(translation: Array, size: Array, T_camera_part: Array) -> Array:
    """(K, 3) posed box centres brought to the estimated rest frame, about the middle of all boxes, as true ones are."""
    center = brought_to_rest(translation, T_camera_part)
    low, high = center - 0.5 * size, center + 0.5 * size
    middle: Array = 0.5 * (low.min(axis=0) + high.max(axis=0))
    return center - middle


def _wrong(sample: Sample, estimate: Estimate, milliseconds: float) -> Scored:
    """What fails, but says how well it fits: an estimate with other parts than the object has."""
    return replace(
        _failed(sample, milliseconds), found=found(estimate, sample), residual=estimate.residual,
        disagreement=estimate.disagreement, confidence=estimate.confidence,
        visibility=float(estimate.visibility.min()),
    )  # fmt: skip


def _failed(sample: Sample, milliseconds: float) -> Scored:
    K = len(sample.joint_type)
    rotation, far, none = (np.full(K, metrics.FAILED[name]) for name in ("rotation_deg", "translation", "iou"))
    children = np.array(sample.joint_type) != "free"
    low, high = sample.joint_limits.T
    state = metrics.state_error(np.zeros(K), np.where(np.isfinite(high - low), high - low, np.pi), sample.joint_type)
    return Scored(
        sample.category, rotation, far, none, none, none, np.where(children, state, 0.0),
        np.where(children, 90.0, 0.0), 0.0, 0.0, True, np.inf, np.inf, 0.0, 0.0, milliseconds,
    )  # fmt: skip


def _median(values: Array) -> float | None:
    return float(np.median(values)) if len(values) else None


def _middle(values: Sequence[float]) -> dict[str, float]:
    return {"median": float(np.median(values)), "mean": float(np.mean(values))}


def _pair(figure: dict[str, float], median: str, mean: str, factor: float = 1.0) -> str:
    return f"{factor * figure['median']:{median}}{factor * figure['mean']:{mean}}"
