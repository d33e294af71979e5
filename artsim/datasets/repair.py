"""Repairing a dataset: what is damaged or missing is made again, to the same bytes or not at all."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from artsim.datasets.description import read_started
from artsim.datasets.inventory import examine, leftover_problems, remove_leftovers, strangers
from artsim.datasets.plan import Plan
from artsim.datasets.problems import Problem
from artsim.datasets.restore import Restoration
from artsim.errors import DatasetError
from artsim.loading.sources import Source
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerPool
from artsim.runs.storage import FolderStorage


@dataclass(frozen=True)
class RepairResult:
    """What a call of :func:`repair` did."""

    folder: Path
    restored: tuple[str, ...]
    """Files that are as they were again."""
    failed: tuple[Problem, ...]
    """What is still wrong, and why."""


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
    storage, begun = FolderStorage(folder), read_started(folder)
    if begun is None:
        raise DatasetError("no dataset here", folder, "name a folder that artsim generate wrote")
    inventory = examine(folder, begun, workers, progress)
    foreign = strangers(folder, begun)
    if not inventory and begun.complete and not begun.problems and not leftover_problems(folder):
        return RepairResult(folder, (), tuple(foreign))
    if inventory.shards:
        _check_makeable(folder, begun.plan, begun.complete)
    with folder_lock(folder), WorkerPool(workers, storage) as team:
        restored = Restoration(storage, begun, inventory, sources, team, progress)
        try:
            restored.run()
        finally:
            remove_leftovers(folder)
    return RepairResult(folder, tuple(restored.files), (*restored.failed, *foreign))


def _check_makeable(folder: Path, plan: Plan, complete: bool) -> None:
    """Refuse to make samples that could not be those of the dataset."""
    if plan.sample.views.custom is not None:  # repairing a dataset of other people must not run what it names
        raise DatasetError(
            f"its views come from code ({plan.sample.views.custom!r}), which is not run because a dataset names it",
            folder,
            "run the same generate command again: it repairs, too",
        )
    if not complete and plan.artsim_version != version("artsim"):  # no checksum would tell
        made_by = plan.artsim_version
        raise DatasetError(
            f"artsim {made_by} began it, and this is {version('artsim')}", folder, f"use artsim {made_by}"
        )
