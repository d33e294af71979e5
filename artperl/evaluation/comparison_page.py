"""A comparison of methods as Markdown."""

from collections.abc import Mapping, Sequence
from typing import Any

from artperl.evaluation.comparison import mean_over_parts
from artperl.evaluation.published import ARTIMAGE_PUBLISHED, ROBOTARM_PUBLISHED, TITLES, Published

Rows = Mapping[str, Mapping[str, dict[str, Any]]]
"""Records of :func:`artperl.evaluation.comparison.row_record` by category and method."""

COLUMNS: tuple[tuple[str, str, float, int, str], ...] = (
    ("rotation_deg", "rotation, deg", 1.0, 2, "rotation"),
    ("translation_partnet", "translation, PartNet units", 1.0, 3, "translation"),
    ("translation_metres", "translation, m", 1.0, 3, "translation"),
    ("translation_percent_diagonal", "translation, % of the diagonal", 1.0, 2, ""),
    ("iou_exact", "exact IoU, %", 100.0, 1, ""),
    ("iou_omad_legacy", "OMAD's IoU, %", 100.0, 1, "iou"),
)
"""Metric, title, factor, decimals, and the name among published figures."""


_OF_ALL = {"rotation_deg", "translation_percent_diagonal", "iou_exact", "iou_omad_legacy"}
_SHOWN = {"artimage": _OF_ALL | {"translation_partnet"}, "robotarm": _OF_ALL | {"translation_metres"}}
"""Metrics that a benchmark has a table of."""


def published_of(benchmark: str, category: str) -> dict[str, Published]:
    """Published figures of a category of a benchmark, by method."""
    return ROBOTARM_PUBLISHED if benchmark == "robotarm" else ARTIMAGE_PUBLISHED.get(category, {})


def markdown(benchmark: str, rows: Rows, notes: Sequence[str]) -> str:
    """The report as text.

    Parameters
    ----------
    benchmark : str
    rows : Rows
    notes : sequence of str
        Of how it was made.
    """
    lines = [f"# {benchmark}, compared", "", *(f"- {note}" for note in notes), ""]
    for category, methods in rows.items():
        lines += [f"## {category}", ""]
        for name, title, _, _, _ in COLUMNS:
            if name in _SHOWN[benchmark] and all(name in record["parts"][0] for record in methods.values()):
                lines += [f"### {title}", "", *_table(benchmark, category, methods, name), ""]
        lines += ["### Views", "", *_views(benchmark, category, methods), ""]
        lines += ["### Confidence", "", *_confidence(methods), ""]
        for where, unit in (("visibility", "share of the part that shows"), ("azimuth", "degrees from the front")):
            lines += [f"### Rotation error by {unit}", "", *_ranges(methods, where), ""]
    lines += ["## All categories", "", *_means(rows), ""]
    return "\n".join(lines)


def _table(benchmark: str, category: str, methods: Mapping[str, dict[str, Any]], name: str) -> list[str]:
    _, _, factor, digits, key = next(column for column in COLUMNS if column[0] == name)
    parts = max(len(record["parts"]) for record in methods.values())
    known = published_of(benchmark, category) if key else {}
    head = ["method", *(f"part {k}" for k in range(parts))]
    lines = [_line(head), _line(["---"] * len(head))]
    for method, record in methods.items():
        cells = [_cell(record["parts"], k, name, factor, digits) for k in range(parts)]
        lines.append(_line([TITLES.get(method, method), *cells]))
    for method, published in known.items():  # in rows of their own: the images differ
        if told := getattr(published, key):
            cells = [f"{factor * told[k]:.{digits}f}" if k < len(told) else "" for k in range(parts)]
            lines.append(_line([f"{TITLES.get(method, method)}, published", *cells]))
    return lines


def _cell(parts: Sequence[dict[str, Any]], k: int, name: str, factor: float, digits: int) -> str:
    """Mean, and its interval."""
    if k >= len(parts):
        return ""
    own = {at: f"{factor * value:.{digits}f}" for at, value in parts[k][name].items()}
    return f"{own['mean']} [{own['low']}, {own['high']}]"


def _views(benchmark: str, category: str, methods: Mapping[str, dict[str, Any]]) -> list[str]:
    known = published_of(benchmark, category)
    head = ["method", "views", "objects", "failures", "right, %", "trained, core-min", "seconds", "seconds, published"]
    lines = [_line(head), _line(["---"] * len(head))]
    for method, record in methods.items():
        told = known[method].seconds if method in known else None
        trained = record["trained_core_minutes"]
        lines.append(_line([
            TITLES.get(method, method), str(record["views"]), str(record["objects"]), str(record["failures"]),
            f"{100 * record['right']:.0f}", "" if trained is None else f"{trained:.1f}", f"{record['seconds']:.2f}",
            "" if told is None else f"{told:.1f}",
        ]))  # fmt: skip
    return lines


def _confidence(methods: Mapping[str, dict[str, Any]]) -> list[str]:
    """How well confidence tells right views from wrong ones, of this category and these objects alone."""
    head = ["method", "AUROC", "expected calibration error, %"]
    lines = [_line(head), _line(["---"] * len(head))]
    for method, record in methods.items():
        curve, error = record["confidence_auroc"], 100 * record["calibration_error"]
        lines.append(_line([TITLES.get(method, method), "-" if curve is None else f"{curve:.2f}", f"{error:.1f}"]))
    return lines


def _ranges(methods: Mapping[str, dict[str, Any]], where: str) -> list[str]:
    first = next(iter(methods.values()))[where]
    head = ["method", *(f"{own['low']:g} to {own['high']:g} ({own['count']})" for own in first)]
    lines = [_line(head), _line(["---"] * len(head))]
    for method, record in methods.items():
        cells = [f"{own['mean']:.1f}" if own["count"] else "" for own in record[where]]
        lines.append(_line([TITLES.get(method, method), *cells]))
    return lines


def _means(rows: Rows) -> list[str]:
    """Means over all parts of all categories that every method has."""
    methods = [m for m in next(iter(rows.values())) if all(m in own for own in rows.values())] if rows else []
    names = [(name, title, factor, digits) for name, title, factor, digits, _ in COLUMNS if name in _OF_ALL]
    lines = [_line(["method", *(title for _, title, _, _ in names)]), _line(["---"] * (len(names) + 1))]
    for method in methods:
        cells = [TITLES.get(method, method)]
        for name, _, factor, digits in names:
            weights = [len(own[method]["parts"]) for own in rows.values()]
            means = [mean_over_parts(own[method], name) for own in rows.values()]
            value = sum(w * m for w, m in zip(weights, means, strict=True)) / sum(weights)
            cells.append(f"{factor * value:.{digits}f}")
        lines.append(_line(cells))
    return lines


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
