"""Figures of an evaluation: their summary in JSON's terms, their table, and the published means beside them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.evaluation.metrics import METRICS
from artperl.evaluation.part_detection import part_figures, part_line
from artperl.evaluation.published import ARTIMAGE_PUBLISHED
from artperl.evaluation.reliability import confidence_figures, confidence_line
from artperl.evaluation.scoring import Scored
from artsim.common.names import numbered, printable

Array = NDArray[np.float64]

_NAME, _MEDIAN, _MEAN = 14, 9, 7
"""Widths of the table's columns."""


def summary(scored: Sequence[Scored]) -> dict[str, Any]:
    """Figures by category and part, in JSON's terms: the format of ``artperl evaluate --json``.

    Returns
    -------
    dict
        ``{category: {"parts": [{metric: {"median": x, "mean": x}}], "failures": n, "instances": n,
        "ms_per_instance": median, ...}}``, without the metrics that do not apply; ``"part_names"``, "part 3" where
        those of objects differ; and ``"up_to_symmetry"`` for categories with objects that look the same turned round.
    """
    return {category: _category_summary(scored, category) for category in dict.fromkeys(s.category for s in scored)}


def _category_summary(scored: Sequence[Scored], category: str) -> dict[str, Any]:
    own = [s for s in scored if s.category == category]
    names = [{s.part_names[k] for s in own if k < len(s.part_names)} for k in range(max(len(s.rotation) for s in own))]
    right, confidence = np.array([s.right for s in own]), np.array([s.confidence for s in own])
    return {
        "parts": [_part_summary(own, k) for k in range(len(names))],
        "part_names": [min(alike) if len(alike) == 1 else f"part {k}" for k, alike in enumerate(names)],
        "instances": len(own),
        "failures": sum(s.failed for s in own),
        "right": float(right.mean()),
        "parts_found": float(np.mean([s.parts_found for s in own])),
        "segmentation": float(np.mean([s.segmentation for s in own])),
        "confidence_of_right": _median(confidence[right]),
        "confidence_of_wrong": _median(confidence[~right]),
        **confidence_figures(confidence, right),
        "ms_per_instance": float(np.median([s.milliseconds for s in own])),
        "detection": part_figures(own),
        **_symmetric_summary(own),
    }


def _symmetric_summary(own: Sequence[Scored]) -> dict[str, Any]:
    """Figures up to symmetry, of all views: those of objects without a symmetry count as they are."""
    share = float(np.mean([s.symmetric_errors is not None for s in own]))
    if share == 0.0:
        return {}
    judged = [s.up_to_symmetry for s in own]
    parts = [_part_summary(judged, k) for k in range(max(len(s.rotation) for s in own))]
    right = float(np.mean([s.right for s in judged]))
    return {"up_to_symmetry": {"views_of_symmetric_objects": share, "right": right, "parts": parts}}


def _part_summary(scored: Sequence[Scored], k: int) -> dict[str, dict[str, float]]:
    columns = {name: [s.errors[name][k] for s in scored if len(s.rotation) > k] for name in METRICS}
    return {
        name: {"median": float(np.median(values)), "mean": float(np.mean(values))}
        for name, values in columns.items()
        if not np.isnan(values).any()
    }


def _median(values: Array) -> float | None:
    return float(np.median(values)) if len(values) else None


def table(figures: dict[str, Any]) -> str:
    """The paper's table: one line for each category and part, one pair of columns for each metric with a title.

    Parameters
    ----------
    figures : dict
        As :func:`summary` gives them.
    """
    columns = {name: metric for name, metric in METRICS.items() if metric.title}
    labels = {
        category: [f"{category} {name}" for name in numbered(own["part_names"])] for category, own in figures.items()
    }
    width = max([_NAME, *(len(label) + 1 for own in labels.values() for label in own)])
    lines = [
        " " * width + "".join(f"{metric.title:>{_MEDIAN + _MEAN}s}" for metric in columns.values()),
        " " * width + f"{'median':>{_MEDIAN}s}{'mean':>{_MEAN}s}" * len(columns),
    ]
    for category, figure in figures.items():
        for k, part in enumerate(figure["parts"]):
            lines.append(f"{printable(labels[category][k]):{width}s}" + "".join(_cell(part, name) for name in columns))
        lines.append(
            f"{'':{width}s}{figure['instances']} instances, {figure['failures']} failures, "
            f"{100 * figure['right']:.0f} % right, {100 * figure['parts_found']:.0f} % of parts found, "
            f"{100 * figure['segmentation']:.1f} % of points right, "
            f"{figure['ms_per_instance']:.0f} ms"
        )
        if "up_to_symmetry" in figure:
            lines.append(" " * width + _symmetric_line(figure["up_to_symmetry"]))
        lines.append(" " * width + _confidence_line(figure))
        if figure["detection"]["precision"] is not None:
            lines.append(" " * width + part_line(figure["detection"]))
    return "\n".join(lines)


def _confidence_line(figure: dict[str, Any]) -> str:
    medians = {"right": figure["confidence_of_right"], "wrong": figure["confidence_of_wrong"]}
    told = ", ".join(f"of {kind} ones {100 * value:.0f} %" for kind, value in medians.items() if value is not None)
    return f"confidence {told} in the median, {confidence_line(figure)}"


def _symmetric_line(figure: dict[str, Any]) -> str:
    rotation = " ".join(f"{part['rotation_deg']['mean']:.2f}" for part in figure["parts"])
    return (
        f"up to symmetry (in {100 * figure['views_of_symmetric_objects']:.0f} % of views): "
        f"{100 * figure['right']:.0f} % right, mean rotation deg {rotation}"
    )


def _cell(part: dict[str, dict[str, float]], name: str) -> str:
    """Median and mean of one metric; blank where it does not apply."""
    if name not in part:
        return " " * (_MEDIAN + _MEAN)
    metric, figure = METRICS[name], part[name]
    median, mean = (f"{metric.factor * figure[middle]:.{metric.digits}f}" for middle in ("median", "mean"))
    return f"{median:>{_MEDIAN}s}{mean:>{_MEAN}s}"


def against_published(category: str, figures: dict[str, Any]) -> str:
    """Where means are better than those published for other images of the category, and where not."""
    published = ARTIMAGE_PUBLISHED[category]["artperl"]
    texts = []
    for name, title, other in (
        ("rotation_deg", "rotation", published.rotation), ("translation_partnet", "translation", published.translation),
        ("iou_omad_legacy", "OMAD's IoU", published.iou),
    ):  # fmt: skip
        own = [part[name]["mean"] for part in figures["parts"]]
        sign = 1.0 if METRICS[name].less_is_better else -1.0
        worse = [k for k, (a, b) in enumerate(zip(own, other, strict=True)) if sign * a >= sign * b]
        texts.append(f"{title} {'better' if not worse else f'not better for part {worse}'}")
    return (
        f"{'':14s}against ArtPERL's published means: {', '.join(texts)}\n"
        f"{'':14s}OMAD's IoU depends on the frame: here z is up, in ArtImage y. With y up, temples and drawers have "
        "less: docs/artperl_results.md"
    )
