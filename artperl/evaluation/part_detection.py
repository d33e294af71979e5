"""Parts as detections: which estimated parts are there, which true ones are found, and how far confidence tells."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.evaluation.scoring import Scored

Array = NDArray[np.float64]

SURE = 0.5
"""Confidence from which a part counts as found in the figures of precision and recall."""
PRECISION = 0.9
"""Precision at which recall is measured, too."""


def part_figures(scored: Sequence[Scored]) -> dict[str, Any]:
    """Precision and recall of parts, in JSON's terms.

    An estimated part is right when it is matched to a true part of its own within 10 degrees and 5 % of the diagonal.

    Returns
    -------
    dict
        ``precision`` and ``recall`` of parts with confidence :data:`SURE` or more (precision None without any),
        ``recall_at_precision_90`` at the best threshold, ``average_precision``, and the numbers of ``true``,
        ``estimated`` and ``right`` parts.
    """
    confidence = np.concatenate([s.part_confidence for s in scored]) if scored else np.zeros(0)
    right = np.concatenate([s.part_right for s in scored]) if scored else np.zeros(0, dtype=bool)
    true = sum(len(s.rotation) for s in scored)
    sure = confidence >= SURE
    precision, recall = precision_recall(confidence, right, true)
    enough = recall[precision >= PRECISION]
    return {
        "true": true,
        "estimated": len(right),
        "right": int(right.sum()),
        "precision": float(right[sure].mean()) if sure.any() else None,
        "recall": float(right[sure].sum() / max(true, 1)),
        "recall_at_precision_90": float(enough.max()) if len(enough) else 0.0,
        "average_precision": float(np.sum(np.diff(recall, prepend=0.0) * precision)),
    }


def precision_recall(confidence: Array, right: NDArray[np.bool_], true: int) -> tuple[Array, Array]:
    """Precision and recall at every threshold that tells parts apart, from the highest down.

    Parameters
    ----------
    confidence : (n,) float
        Of estimated parts.
    right : (n,) bool
    true : int
        Number of true parts.

    Returns
    -------
    precision, recall : (m,) float
        Parts of equal confidence come together.
    """
    order = np.argsort(-confidence, kind="stable")
    found = np.cumsum(right[order]).astype(np.float64)
    last = np.append(np.diff(confidence[order]) != 0.0, True)[: len(order)]
    return (found / np.arange(1, len(order) + 1))[last], (found / max(true, 1))[last]


def part_line(figures: dict[str, Any]) -> str:
    """One line for people."""
    precision = "-" if figures["precision"] is None else f"{100 * figures['precision']:.0f} %"
    return (
        f"parts with confidence {100 * SURE:.0f} % or more: precision {precision}, recall "
        f"{100 * figures['recall']:.0f} %; recall at precision {100 * PRECISION:.0f} %: "
        f"{100 * figures['recall_at_precision_90']:.0f} %"
    )
