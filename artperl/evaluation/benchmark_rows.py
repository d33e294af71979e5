"""Runs rows of a benchmark with the estimators of a folder, and sets the figures beside published ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from artperl.estimator import WEIGHTS, load_estimator
from artperl.evaluation.artimage import OBJECTS, VIEWS, Row, has_train_half, row_samples
from artperl.evaluation.scoring import NUM_POINTS, evaluate, summary, table
from artperl.methods.full import Estimator

PUBLISHED: dict[str, dict[str, tuple[float, ...]]] = {
    "laptop": {"rotation_deg": (4.9, 4.7), "translation_partnet": (0.053, 0.066), "iou": (0.646, 0.504)},
    "eyeglasses": {
        "rotation_deg": (4.1, 6.2, 6.0), "translation_partnet": (0.047, 0.095, 0.091), "iou": (0.586, 0.465, 0.517),
    },
    "dishwasher": {"rotation_deg": (3.9, 4.3), "translation_partnet": (0.055, 0.079), "iou": (0.893, 0.676)},
    "scissors": {"rotation_deg": (2.2, 2.6), "translation_partnet": (0.031, 0.042), "iou": (0.409, 0.463)},
    "drawer": {
        "rotation_deg": (3.5, 3.5, 3.5, 3.5), "translation_partnet": (0.061, 0.112, 0.121, 0.104),
        "iou": (0.848, 0.786, 0.790, 0.812),
    },
}  # fmt: skip
"""Means of ArtPERL on the original ArtImage, by part (its table 1)."""


def find_estimator(folder: Path | None, category: str, **changes: Any) -> Estimator:
    """The estimator of a category in a folder of them (or of training runs); the one that comes with the package."""
    folder = folder or WEIGHTS
    run = folder / category / "best"
    return load_estimator(run if run.is_dir() else folder / category, **changes)


def run_rows(
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
        As in :func:`artperl.evaluation.artimage.row_samples`.
    progress : bool
    say : callable
        Gets the lines.
    seen_from : (float, float), optional
        See :class:`artperl.fitting.options.EstimatorOptions`.

    Returns
    -------
    dict
        ``{row: {category: figures}}``, figures as :func:`artperl.evaluation.scoring.summary` gives them, with the
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
            samples = row_samples(row, category, partnet, objects, views, num_points)
            if not samples:
                say(f"{category}: no object")
                continue
            folder = real_weights if row == "real_trained" else weights
            estimator = find_estimator(folder, category, seen_from=seen_from)
            figures = summary(evaluate(estimator, samples, progress))
            figures[category]["objects"] = len({sample.object_id for sample in samples})
            result[row] |= figures
            say(f"{table(figures)}\n{against_published(category, figures[category])}")
    return result


def against_published(category: str, figures: dict[str, Any]) -> str:
    """Where means are better than those published for other images of the category, and where not."""
    published = PUBLISHED[category]
    names = {"rotation_deg": "rotation", "translation_partnet": "translation", "iou_omad_legacy": "IoU as OMAD's"}
    texts = []
    for name, title in names.items():
        own = [part[name]["mean"] for part in figures["parts"]]
        other = published["iou" if name == "iou_omad_legacy" else name]
        sign = -1.0 if name == "iou_omad_legacy" else 1.0
        worse = [k for k, (a, b) in enumerate(zip(own, other, strict=True)) if sign * a >= sign * b]
        texts.append(f"{title} {'better' if not worse else f'not better for part {worse}'}")
    return f"{'':14s}against ArtPERL's published means: {', '.join(texts)}"
