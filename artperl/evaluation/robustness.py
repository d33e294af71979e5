"""Rows of the benchmark that show where an estimator stops being right, and whether its confidence says so."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from artperl.evaluation.artimage import OBJECTS, real_objects, row_objects
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.conditions import CONDITIONS, condition_samples
from artperl.evaluation.reliability import confidence_figures, confidence_line
from artperl.evaluation.scoring import Scored, evaluate, object_symmetries
from artsim.errors import ConfigError
from artsim.model.objects import ArticulatedObject
from artsim.runs.kept import read_kept, write_kept

SOURCES = ("procedural", "real", "real_all")
"""procedural: 40 unseen ones; real: the test half of ArtImage's split; real_all: both halves."""

_HEAD = (
    f"{'':13s}{'views':>6s}{'right':>7s}{'sym.':>6s}{'AUROC':>7s}{'ECE':>6s}{'conf.':>7s}{'move %':>8s}{'IoU %':>7s}"
    "  turn, deg"
)


def run_robustness(
    sources: Sequence[str], categories: Sequence[str], conditions: Sequence[str] = tuple(CONDITIONS),
    weights: Path | None = None, partnet: Path | None = None, objects: int = OBJECTS, views: int = 100,
    kept: Path | None = None, progress: bool = False, say: Callable[[str], None] = print,
) -> dict[str, Any]:  # fmt: skip
    """Evaluate under every condition, and print each row as it comes.

    Parameters
    ----------
    sources : sequence of str
        Of :data:`SOURCES`.
    categories : sequence of str
    conditions : sequence of str
    weights : Path, optional
        Folder of estimators; by default those that come with the package, none of which learns from real objects.
    partnet : Path, optional
        Folder of real objects.
    objects : int
        Procedural ones of each category.
    views : int
        Of each row, at least.
    kept : Path, optional
        File of the figures. Rows that it holds for the same options are not measured again.
    progress : bool
    say : callable
        Gets the lines.

    Returns
    -------
    dict
        ``{"options": {...}, "rows": {"source/category/condition": figures}, "confidence": {"source/category":
        figures}}``, the latter of all conditions.

    Raises
    ------
    ConfigError
        When a source or a condition is unknown, or the file holds figures of other options.
    """
    for what, option, told, known in (
        ("condition", "conditions", conditions, tuple(CONDITIONS)), ("source", "rows", sources, SOURCES)
    ):  # fmt: skip
        for name in told:
            if name not in known:
                raise ConfigError(f"there is no {what} {name!r}", option, f"use {', '.join(known)}")
    options = {"weights": None if weights is None else str(weights), "objects": objects, "views": views}
    rows, sure = dict(read_kept(kept, options=options).get("rows", {})), {}
    for source in sources:
        for category in categories:
            tested = _objects(source, category, partnet, objects)
            if not tested:
                say(f"{source}, {category}: no object")
                continue
            say(f"{source}, {category}: {len(tested)} objects\n{_HEAD}")
            for condition in conditions:
                key = f"{source}/{category}/{condition}"
                if key not in rows:
                    estimator = find_estimator(weights, category)
                    samples = condition_samples(condition, tested, views)
                    scored = evaluate(estimator, samples, progress, object_symmetries(tested))
                    rows[key] = row_figures(scored) | {"objects": len(tested)}
                    write_kept(kept, {"options": options, "rows": rows})
                say(row_line(condition, rows[key]))
            asked = [rows[f"{source}/{category}/{condition}"] for condition in conditions]
            confidence, right = (np.concatenate([row[name] for row in asked]) for name in ("confidence", "is_right"))
            sure[f"{source}/{category}"] = confidence_figures(confidence, right)
            say(f"{source}, {category}, all conditions: {confidence_line(sure[f'{source}/{category}'])}")
    return {"options": options, "rows": rows, "confidence": sure}


def _objects(source: str, category: str, partnet: Path | None, objects: int) -> list[ArticulatedObject]:
    if source == "procedural":
        return row_objects("procedural", category, partnet, objects)
    test = real_objects(category, "test", partnet)
    return test if source == "real" else [*test, *real_objects(category, "train", partnet)]


def row_figures(scored: Sequence[Scored]) -> dict[str, Any]:
    """Figures of one row, in JSON's terms; errors are means, up to symmetry where objects have one."""
    judged = [s.up_to_symmetry for s in scored]
    right, confidence = np.array([s.right for s in judged]), np.array([s.confidence for s in scored])
    return {
        "views": len(scored),
        "right": float(np.mean([s.right for s in scored])),
        "right_up_to_symmetry": float(right.mean()),
        "rotation_deg": np.mean([s.rotation for s in judged], axis=0).tolist(),
        "translation_percent_diagonal": float(np.mean([100.0 * s.translation.mean() for s in judged])),
        "iou_exact": float(np.mean([s.errors["iou_exact"].mean() for s in judged])),
        "confidence": confidence.round(4).tolist(),
        "is_right": right.tolist(),
    }


def row_line(name: str, row: dict[str, Any]) -> str:
    """One line of the table; errors are means."""
    sure = confidence_figures(row["confidence"], row["is_right"])
    curve = "-" if sure["confidence_auroc"] is None else f"{sure['confidence_auroc']:.2f}"
    told = f"{curve:>7s}{100 * sure['calibration_error']:5.0f}%"
    turn = " ".join(f"{value:.1f}" for value in row["rotation_deg"])
    return (
        f"{name:13s}{row['views']:6d}{100 * row['right']:6.0f}%{100 * row['right_up_to_symmetry']:5.0f}%{told}"
        f"{100 * np.mean(row['confidence']):6.0f}%{row['translation_percent_diagonal']:8.1f}"
        f"{100 * row['iou_exact']:7.1f}  {turn}"
    )
