"""Repairing a dataset: what is damaged or missing is made again, to the same bytes or not at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from artsim.datasets.description import read_started
from artsim.datasets.inventory import examine, leftover_problems, strangers
from artsim.datasets.origins import Origins
from artsim.datasets.problems import Problem
from artsim.datasets.restore import Restoration, remove_leftovers
from artsim.errors import DatasetError
from artsim.loading.sources import Source
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerPool
from artsim.runs.storage import FolderStorage


@dataclass(frozen=True)
class RepairResult:
    """What a call of :func:`repair` did.

    Attributes
    ----------
    folder : Path
    restored : tuple of str
        Files that are as they were again.
    failed : tuple of Problem
        What is still wrong, and why.
    """

    folder: Path
    restored: tuple[str, ...]
    failed: tuple[Problem, ...]


def repair(folder: str | Path, sources: Sequence[Source] = (), workers: int = 2, progress: bool = True) -> RepairResult:
    """Restore exactly what is damaged or missing of a dataset; complete one that was stopped.

    Shards are drawn again from their objects. Objects are made again by category and seed, or loaded again from where
    they were (or from ``sources``), if their files are still the same. The descriptions restore each other. A file
    whose checksum is known is only put in place with that content. What is no part of the dataset is not touched.

    Parameters
    ----------
    folder : path
    sources : sequence of Source
        Where objects may be found that are not where they were.
    workers : int
        Processes. The result does not depend on it.
    progress : bool
        Show progress bars.

    Returns
    -------
    RepairResult

    Raises
    ------
    DatasetError
        When there is no dataset, or nothing is left that says what it was.
    ConfigError
        When the folder cannot be written to.
    KeyboardInterrupt
        On Ctrl-C, after the workers have stopped; the same call resumes.
    """
    folder = Path(folder)
    begun = read_started(folder)
    if begun is None:
        raise DatasetError("no dataset here", folder, "name a folder that generate.py wrote")
    inventory = examine(folder, begun, workers, progress)
    foreign = strangers(folder, begun)
    if not inventory and begun.complete and not begun.problems and not leftover_problems(folder, begun):
        return RepairResult(folder, (), tuple(foreign))
    if inventory.shards:
        _check_makeable(folder, begun.plan.artsim_version, begun.plan.sample.views.custom, begun.complete)
    with folder_lock(folder):
        try:
            with WorkerPool(workers, FolderStorage(folder)) as team:
                restored = Restoration(folder, begun, inventory, Origins(folder, sources), team, progress)
                restored.run()
        finally:
            remove_leftovers(folder)
    return RepairResult(folder, tuple(restored.files), (*restored.failed, *foreign))


def _check_makeable(folder: Path, made_by: str, custom_views: str | None, complete: bool) -> None:
    """Refuse to make samples that could not be those of the dataset."""
    if custom_views is not None:  # repairing a dataset of other people must not run what it names
        raise DatasetError(
            f"its views come from code ({custom_views!r}), which is not run because a dataset names it",
            folder,
            "run the same generate command again: it repairs, too",
        )
    if not complete and made_by != version("artsim"):  # no checksum would tell
        raise DatasetError(
            f"artsim {made_by} began it, and this is {version('artsim')}", folder, f"use artsim {made_by}"
        )
