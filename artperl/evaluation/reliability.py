"""Whether estimates with confidence p are right in a share p of cases."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

BINS = 10


def reliability(confidence: NDArray[np.float64], right: NDArray[np.bool_], bins: int = BINS) -> dict[str, Any]:
    """Reliability by bins of equal width (Guo et al., "On calibration of modern neural networks", ICML 2017).

    Parameters
    ----------
    confidence : (n,) float
        0 to 1.
    right : (n,) bool

    Returns
    -------
    dict
        ``count``, ``confidence`` and ``right`` of every bin, means, None where it is empty; and ``expected_error``, the
        mean over all estimates of how far their bins' confidence is from the share that is right.
    """
    number = np.minimum((np.asarray(confidence) * bins).astype(int), bins - 1)
    count = np.bincount(number, minlength=bins)
    said, true = (np.bincount(number, weights=values, minlength=bins) for values in (confidence, right))
    some = count > 0
    return {
        "count": count.tolist(),
        "confidence": [float(x / n) if n else None for x, n in zip(said, count, strict=True)],
        "right": [float(x / n) if n else None for x, n in zip(true, count, strict=True)],
        "expected_error": float(np.abs(said - true)[some].sum() / max(len(number), 1)),
    }


def reliability_lines(figures: dict[str, Any]) -> list[str]:
    """A table for people."""
    bins = len(figures["count"])
    lines = [f"{'confidence':>12s}{'estimates':>11s}{'mean':>7s}{'right':>7s}"]
    for n, (count, said, true) in enumerate(
        zip(figures["count"], figures["confidence"], figures["right"], strict=True)
    ):
        cells = "" if count == 0 else f"{100 * said:6.0f}%{100 * true:6.0f}%"
        lines.append(f"{100 * n // bins:6d}-{100 * (n + 1) // bins:3d} %{count:11d}{cells}")
    return [*lines, f"expected calibration error {100 * figures['expected_error']:.1f} %"]
