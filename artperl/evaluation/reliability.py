"""Whether confidence tells right estimates from wrong ones, and is right in as many cases as it says."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.evaluation.metrics import auroc

_BINS = 10


def confidence_figures(
    confidence: Sequence[float] | NDArray[Any], right: Sequence[bool] | NDArray[Any]
) -> dict[str, Any]:
    """Figures of the confidence of estimates that are all of one row and one category.

    Parameters
    ----------
    confidence : (n,) float
        0 to 1.
    right : (n,) bool

    Returns
    -------
    dict
        ``confidence_auroc``, None where all are right, or all wrong; ``calibration_error``.
    """
    said, true = np.asarray(confidence, float), np.asarray(right, bool)
    return {"confidence_auroc": auroc(said, true), "calibration_error": calibration_error(said, true)}


def calibration_error(confidence: NDArray[np.float64], right: NDArray[np.bool_]) -> float:
    """Mean over estimates of how far the confidence of their bins is from the share that is right.

    It is the expected calibration error, of bins of equal width (Guo et al., "On calibration of modern neural
    networks", ICML 2017).
    """
    number = np.minimum((confidence * _BINS).astype(int), _BINS - 1)
    said, true = (np.bincount(number, weights=values, minlength=_BINS) for values in (confidence, right))
    return float(np.abs(said - true).sum() / len(number))


def confidence_line(figures: dict[str, Any]) -> str:
    """The figures for people."""
    curve, error = figures["confidence_auroc"], 100 * figures["calibration_error"]
    return f"AUROC {'-' if curve is None else f'{curve:.2f}'}, expected calibration error {error:.0f} %"
