"""Runs rows of the benchmark with the estimators of a folder, and sets the figures beside published ones."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from artperl.data.categories import ARTIMAGE
from artperl.evaluation.artimage import OBJECTS, VIEWS, Row, has_half, row_objects, row_samples
from artperl.evaluation.artimage_files import ArtImageFiles
from artperl.evaluation.samples import NUM_POINTS
from artperl.evaluation.scoring import evaluate, object_symmetries
from artperl.evaluation.tables import against_published, summary, table
from artperl.methods.estimator_files import load_estimator
from artperl.methods.estimator_folders import folder_of
from artperl.methods.full import Estimator
from artsim.common.progress import track
from artsim.errors import DatasetError


def find_estimator(folder: Path | None, category: str, **changes: Any) -> Estimator:
    """The estimator of a category in a folder of them (or of training runs); the one that comes with the package."""
    return load_estimator(category_folder(folder, category), **changes)


def category_folder(folder: Path | None, category: str, method: str = "full") -> Path:
    """Where the estimator of a category is, in a folder of them or of training runs; by default the package's.

    A run's folder has the name of the category, or that which ``artperl train`` gives it, with method and preset.
    """
    if folder is None:
        return folder_of(category, method)
    named = category if method == "full" else f"{category}-{method}"
    runs = (folder / name / "best" for name in (category, f"{named}-long", f"{named}-full", f"{named}-quick"))
    return next((run for run in runs if run.is_dir()), folder / category)


def run_original(
    root: Path, categories: Sequence[str], weights: Path | None = None, method: str = "full", views: int | None = None,
    num_points: int = NUM_POINTS, progress: bool = False, say: Callable[[str], None] = print,
) -> dict[str, Any]:  # fmt: skip
    """Evaluate a method on the test split of the original ArtImage, and print each category as it comes.

    Parameters
    ----------
    root : Path
        Folder in the layout of :mod:`artperl.evaluation.artimage_files`.
    categories : sequence of str
        Those of which there is no folder are left out, which is said.
    weights : Path, optional
        Folder of estimators by category; by default those that come with the package, of the method full.
    method : str
    views : int, optional
        The most of each category, evenly spread over the split; by default all.
    num_points : int
    progress : bool
    say : callable
        Gets the lines.

    Returns
    -------
    dict
        ``{"original": {category: figures}}`` as of :func:`run_benchmark`.

    Raises
    ------
    DatasetError
        When a file is missing or damaged, or there is no frame of any category.
    """
    result: dict[str, Any] = {}
    for category in categories:
        if not (root / category).is_dir():
            say(f"{category}: left out, since there is no folder {root / category}")
            continue
        files = ArtImageFiles(root, category, "test", num_points)
        samples = list(files.samples(views))
        estimator = load_estimator(category_folder(weights, category, method), method=method)
        figures = summary(evaluate(estimator, track(category, samples, unit="view", shown=progress)))
        figures[category]["objects"] = len({sample.object_id for sample in samples})
        result |= figures
        say(f"{table(figures)}\n{against_published(category, figures[category])}")
    if not result:
        raise DatasetError(
            "there is no category of ArtImage", root, f"name the folder that holds {', '.join(ARTIMAGE)}"
        )
    return {"original": result}


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
            if row == "real_trained" and not has_half(category, "train"):
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
