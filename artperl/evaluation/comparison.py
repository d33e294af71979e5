"""What a comparison of methods says of one method on the views of one category: means, intervals, and where it errs."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.evaluation.reliability import confidence_figures
from artperl.evaluation.scoring import Scored
from artsim.observing.sample import Sample

Array = NDArray[np.float64]

COMPARED = ("rotation_deg", "translation_percent_diagonal", "translation_partnet", "iou_exact", "iou_omad_legacy")
"""Metrics of a comparison."""
VISIBLE = (0.0, 0.1, 0.3, 0.6, 1.0)
"""Edges of the shares of a part that show, by which errors are told apart."""
AZIMUTH = (0.0, 30.0, 60.0, 90.0, 180.0)
"""Edges of the angles, degrees, between the view and the object's front."""
_DRAWS = 1000
"""Draws of a bootstrap: bounds differ by some percent of the interval from draw to draw."""


def row_record(
    scored: Sequence[Scored], samples: Sequence[Sample], core_minutes: float | None = None
) -> dict[str, Any]:  # fmt: skip
    """Figures of one method on one category, in JSON's terms.

    Parameters
    ----------
    scored : sequence of Scored
    samples : sequence of Sample
    core_minutes : float, optional
        Processor minutes that the method has learnt for; by default nobody knows.

    Returns
    -------
    dict
        ``parts``: for each part and metric, ``mean``, ``low``, ``high`` and ``median``; ``seconds``: the median of a
        view; ``visibility`` and ``azimuth``: the mean rotation error of parts by how much of them shows, and by the
        view; ``views``, ``objects``, ``failures``, ``right``, ``trained_core_minutes``,
        ``confidence_auroc`` and ``calibration_error``.
    """
    objects = np.unique([sample.object_sha256 for sample in samples], return_inverse=True)[1]
    shown = np.array([sample.visible_fraction for sample in samples])
    side = np.array([view_azimuth(sample) for sample in samples])
    rotation = np.stack([s.rotation for s in scored])
    errors = {name: np.stack([s.errors[name] for s in scored]) for name in COMPARED}
    diagonal = np.array([sample.diagonal for sample in samples])
    errors["translation_metres"] = errors["translation_percent_diagonal"] * diagonal[:, None] / 100.0
    known = {name: values for name, values in errors.items() if not np.isnan(values).any()}
    parts = [{name: figure(values[:, k], objects) for name, values in known.items()} for k in range(rotation.shape[1])]
    return {
        "parts": parts,
        "seconds": float(np.median([s.milliseconds for s in scored])) / 1e3,
        "visibility": binned(shown.ravel(), rotation.ravel(), VISIBLE),
        "azimuth": binned(np.repeat(side, rotation.shape[1]), rotation.ravel(), AZIMUTH),
        "views": len(scored),
        "objects": int(objects.max()) + 1,
        "failures": sum(s.failed for s in scored),
        "right": float(np.mean([s.right for s in scored])),
        "trained_core_minutes": core_minutes,
        **confidence_figures([s.confidence for s in scored], [s.right for s in scored]),
    }


def figure(values: Array, objects: NDArray[np.int64]) -> dict[str, float]:
    """Mean, bounds of its 95 % interval, and median of values of views (V,) of numbered objects (V,).

    The bootstrap draws objects, not views: views of one object are much alike. Of one object it draws views.
    """
    rng = np.random.default_rng(0)
    groups = objects if objects.max() else np.arange(len(values))
    total, count = (np.bincount(groups, weights=own) for own in (values, np.ones(len(values))))
    drawn = rng.integers(len(total), size=(_DRAWS, len(total)))
    means = total[drawn].sum(axis=1) / count[drawn].sum(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    return {"mean": float(values.mean()), "low": float(low), "high": float(high), "median": float(np.median(values))}


def binned(at: Array, values: Array, edges: Sequence[float]) -> list[dict[str, float]]:
    """Mean and number of values between neighbouring edges; the last edge is in the last range."""
    ranges = []
    for n, (low, high) in enumerate(pairwise(edges)):
        own = values[(at >= low) & ((at < high) | (n + 2 == len(edges)))]
        ranges.append({"low": low, "high": high, "count": len(own), "mean": float(own.mean()) if len(own) else 0.0})
    return ranges


def view_azimuth(sample: Sample) -> float:
    """Degrees between the view and the front (-x) of the object, about its vertical; 0 to 180."""
    T = sample.T_camera_part[0]
    x, y, _ = -T[:3, :3].T @ T[:3, 3]  # the camera in the rest frame
    return float(abs(np.rad2deg(np.arctan2(y, -x))))


def mean_over_parts(record: dict[str, Any], name: str) -> float:
    """Mean of a metric over the parts of a row."""
    return float(np.mean([part[name]["mean"] for part in record["parts"]]))
