"""Runs rows of the benchmark with the estimators of a folder, and sets the figures beside published ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from artperl.estimator import WEIGHTS, load_estimator
from artperl.evaluation.artimage import OBJECTS, VIEWS, Row, has_train_half, row_objects, row_samples
from artperl.evaluation.samples import NUM_POINTS
from artperl.evaluation.scoring import evaluate, object_symmetries
from artperl.evaluation.tables import against_published, summary, table
from artperl.methods.full import Estimator


def find_estimator(folder: Path | None, category: str, **changes: Any) -> Estimator:
    """The estimator of a category in a folder of them (or of training runs); the one that comes with the package."""
    folder = folder or WEIGHTS
    run = folder / category / "best"
    return load_estimator(run if run.is_dir() else folder / category, **changes)


def run_benchmark(
    rows: Sequence[Row],
    categories: Sequence[str],
    weights: Path | None = None,
    real_weights: Path | None = None,
    partnet: Path | None = None,
    objects: int = OBJECTS,
    views: int = VIEWS,
    num_points: int = NUM_POINTS,
    progress: bool = False,
    say: Callable[[str], None] = print,
    seen_from: tuple[float, float] | None = None,
) -> dict[str, Any]:
    """Evaluate, and print each row as it comes.

    Parameters
    ----------
    rows, categories : sequence of str
    weights : Path, optional
        Folder of estimators; by default those that come with the package.
    real_weights : Path, optional
        Folder of estimators that have learnt from real objects, for the row ``real_trained``.
    partnet : Path, optional
        Folder of real objects.
    objects, views, num_points : int
        As in :func:`artperl.evaluation.artimage.row_objects` and :func:`artperl.evaluation.artimage.row_samples`.
    progress : bool
    say : callable
        Gets the lines.
    seen_from : (float, float), optional
        See :class:`artperl.fitting.options.EstimatorOptions`.

    Returns
    -------
    dict
        ``{row: {category: figures}}``, figures as :func:`artperl.evaluation.tables.summary` gives them, with the
        number of ``objects``. Categories of which there is no real object, or none to learn from, are left out of such
        rows.
    """
    result: dict[str, Any] = {}
    for row in rows:
        say(f"{row}: regenerated ArtImage")
        result[row] = {}
        for category in categories:
            if row == "real_trained" and not has_train_half(category):
                say(f"{category}: no real object to learn from")
                continue
            tested = row_objects(row, category, partnet, objects)
            if not tested:
                say(f"{category}: no object")
                continue
            folder = real_weights if row == "real_trained" else weights
            estimator = find_estimator(folder, category, seen_from=seen_from)
            samples = row_samples(row, tested, views, num_points)
            figures = summary(evaluate(estimator, samples, progress, object_symmetries(tested)))
            figures[category]["objects"] = len(tested)
            result[row] |= figures
            say(f"{table(figures)}\n{against_published(category, figures[category])}")
    return result
