"""plan -> workers -> shards: generate a dataset on local processes, resumably.

A folder under construction holds ``plan.json``, ``objects/*.npz`` (every object, so that the dataset stands on
its own), whole shards, and ``progress.jsonl``, one line for each of them. ``dataset.json`` is written last: its
presence means that the dataset is complete.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path

from artsim.datasets.description import DESCRIPTION, StartedDataset, read_started
from artsim.datasets.inventory import Inventory, examine, leftover_problems
from artsim.datasets.merge import merge, place_objects
from artsim.datasets.origins import Origins, write_origins
from artsim.datasets.plan import MAX_SAMPLES, MAX_SHARDS, Plan, PlannedObject
from artsim.datasets.preparing import Preparation, Share
from artsim.datasets.restore import Restoration, remove_leftovers
from artsim.datasets.same_plan import check_same_plan
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.shares import ShareRun
from artsim.datasets.splits import check_shares
from artsim.datasets.versions import VERSIONS_OF
from artsim.datasets.worker import PARTS, PREPARED_BY_ONE
from artsim.errors import AssetError, ConfigError, DatasetError
from artsim.loading.sources import Source
from artsim.model.draws import view_sampler
from artsim.runs.journal import JOURNAL, Journal
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerPool
from artsim.runs.ray_pool import RayPool
from artsim.runs.recipe import check_counts, check_seed
from artsim.runs.storage import FolderStorage, Place, is_url, storage_of

LOAD_LIMIT = 300.0
"""Seconds that an object may take to load: a hundred times what the largest real ones take."""


@dataclass(frozen=True)
class GenerateResult:
    """What a call of :func:`generate` did.

    Attributes
    ----------
    folder : Path or str
        A str is the URL, or the place of a share.
    num_samples : int
        Of the whole dataset.
    made : int
        Samples made by this call.
    seconds : float
    left_out : tuple of str
        Sources left out because they are of no use, with the reason.
    objects : tuple of PlannedObject
        Of the dataset.
    restored : tuple of str
        Files that were there before, and had to be made again.
    grown_from : int or None
        Samples that the dataset had before it was extended.
    """

    folder: Path | str
    num_samples: int
    made: int
    seconds: float
    left_out: tuple[str, ...]
    objects: tuple[PlannedObject, ...] = ()
    restored: tuple[str, ...] = ()
    grown_from: int | None = None


def generate(
    sources: Sequence[Source],
    out: str | Path,
    num_samples: int = 1000,
    seed: int = 0,
    sample: SampleOptions | None = None,
    workers: int = 2,
    shard_size: int = 256,
    splits: tuple[float, float, float] = (0.8, 0.1, 0.1),
    skip_broken: bool = False,
    progress: bool = True,
    strict: bool = False,
    load_limit: float = LOAD_LIMIT,
    ray: str | None = None,
    share: Share | None = None,
) -> GenerateResult:
    """Generate a dataset, or resume one that was stopped, extend it, or repair it.

    On the folder of a dataset, the same options and sources make what is missing or damaged, and a larger
    ``num_samples`` extends it: the result has the same bytes as if it had been generated at once. A complete dataset is
    checked and left alone.

    Parameters
    ----------
    sources : sequence of Source
        The objects; see :func:`artsim.loading.sources.find_sources` and :func:`artsim.loading.sources.family_sources`.
    out : path or str
        Folder of the dataset, made if missing; or URL for fsspec, such as ``s3://bucket/first``. At a URL, files are
        told by their size alone, and a dataset does not grow.
    num_samples, seed : int
    sample : SampleOptions, optional
    workers : int
        Processes. The result does not depend on it.
    shard_size : int
        Samples of a tar file.
    splits : 3 float
        Shares of each category's objects in train, val and test.
    skip_broken : bool
        Leave out sources that are of no use instead of stopping: that do not load, that no view sees, that end or stall
        the process that loads them.
    progress : bool
        Show progress bars.
    strict : bool
        Refuse objects that were repaired while loading.
    load_limit : float
        Seconds that an object may take to load.
    ray : str, optional
        Use a Ray cluster instead of processes of this machine: "auto", "local", or HOST:PORT of its head. The result
        does not depend on it.
    share : Share, optional
        Do the share of one of several machines that share the folder or URL; :func:`artsim.datasets.merge.merge`
        completes the dataset.

    Returns
    -------
    GenerateResult

    Raises
    ------
    AssetError
        When sources cannot be used.
    ConfigError
        When an option makes no sense, or the folder cannot be written to.
    DatasetError
        When the folder holds a dataset of another plan, is in use, or cannot be restored to what it was.
    KeyboardInterrupt
        On Ctrl-C, after the workers have stopped; the same call resumes.
    """
    start = time.perf_counter()
    folder = Path(out)
    asked = Plan(seed, num_samples, shard_size, splits, sample or SampleOptions(), (), strict, version("artsim"))
    _check_options(asked, workers, load_limit, sources)
    if is_url(out) or share is not None:
        storage = storage_of(out)
        with _team(storage, workers, ray) as team:
            objects = Preparation(storage, asked, sources, share or Share(), team, skip_broken, load_limit, progress)
            plan, document, made = ShareRun(objects).run()
        if isinstance(storage, FolderStorage):
            write_origins(storage.folder, sources)
        if share is None:
            merge(storage, progress=progress)
        return _result(storage.place, StartedDataset(document, plan, (), share is None, ()), made, start)
    if (folder / DESCRIPTION).exists():  # else it is not complete, and perhaps another run is at it
        begun = _start(folder, asked, sources)
        if begun is not None and _is_sound(folder, begun, num_samples, workers, progress):
            return _result(folder, begun, 0, start)
    with folder_lock(folder):
        remove_leftovers(folder)
        try:
            begun = _start(folder, asked, sources)
            grown_from = None
            with _team(folder, workers, ray) as team:
                if begun is None:
                    storage = FolderStorage(folder)
                    objects = Preparation(storage, asked, sources, None, team, skip_broken, load_limit, progress)
                    document = objects.by_one()
                    begun = StartedDataset(document, Plan.from_dict(document), (), False, ())
                    place_objects(storage, begun.plan, PREPARED_BY_ONE)
                elif num_samples > begun.plan.num_samples:
                    grown_from = begun.plan.num_samples
                    begun = _extend(folder, begun, num_samples)
                write_origins(folder, sources)
                inventory = examine(folder, begun, workers, progress)
                damaged = _damaged_files(folder, begun, inventory) if grown_from is None else set()
                restored = Restoration(folder, begun, inventory, Origins(folder, sources), team, progress)
                restored.run()
        finally:
            remove_leftovers(folder)
    if restored.failed:
        raise DatasetError(
            f"{len(restored.failed)} files of the dataset: " + "; ".join(map(str, restored.failed[:5])), folder
        )
    files = tuple(name for name in restored.files if name in damaged)
    return replace(_result(folder, begun, restored.samples, start), restored=files, grown_from=grown_from)


def _team(place: Place, workers: int, ray: str | None) -> WorkerPool | RayPool:
    """What does the tasks of a run."""
    return WorkerPool(workers, storage_of(place)) if ray is None else RayPool(ray, place, VERSIONS_OF)


def _is_sound(folder: Path, begun: StartedDataset, num_samples: int, workers: int, progress: bool) -> bool:
    """Whether the dataset asked for is there, complete and undamaged: then nothing is written, not even a lock."""
    if not begun.complete or begun.problems or num_samples != begun.plan.num_samples:
        return False
    return not leftover_problems(folder, begun) and not examine(folder, begun, workers, progress)


def _result(folder: Path | str, begun: StartedDataset, made: int, start: float) -> GenerateResult:
    left_out = tuple(str(entry["why"]) for entry in begun.document["left_out"])
    seconds = time.perf_counter() - start
    return GenerateResult(folder, begun.plan.num_samples, made, seconds, left_out, begun.plan.objects)


def _damaged_files(folder: Path, begun: StartedDataset, inventory: Inventory) -> set[str]:
    """Files that were there before, or were said to be, and have to be made again."""
    finished = {record.name for record in begun.records}
    shards = {shard.name for shard in inventory.shards if shard.name in finished}
    descriptions = {problem.where for problem in begun.problems}
    return shards | {planned.file for planned in inventory.objects} | descriptions


def _check_options(asked: Plan, workers: int, load_limit: float, sources: Sequence[Source]) -> None:
    check_counts(num_samples=asked.num_samples, shard_size=asked.shard_size, workers=workers)
    check_seed(asked.seed)
    if not load_limit > 0:
        raise ConfigError(f"{load_limit} is no time", "load_limit", "use some seconds, such as 300")
    check_shares(asked.fractions)
    if asked.num_samples > MAX_SAMPLES or asked.num_samples / asked.shard_size > MAX_SHARDS - 3:
        raise ConfigError(
            f"{asked.num_samples} samples in shards of {asked.shard_size} are too many",
            "num_samples, shard_size",
            f"make at most {MAX_SAMPLES} samples in at most {MAX_SHARDS} shards",
        )
    if not sources:
        raise AssetError("no objects to show", fix="name categories to make, or URDF files or folders that hold some")
    if asked.sample.views.custom is not None:
        view_sampler(asked.sample.views.custom)


def _start(folder: Path, asked: Plan, sources: Sequence[Source]) -> StartedDataset | None:
    """What the folder says of its dataset, which is the one asked for, or a smaller one; None when there is none.

    Raises
    ------
    DatasetError
        When the folder belongs to another plan, or to something else.
    """
    if not folder.exists():
        return None
    if not folder.is_dir():
        raise ConfigError("cannot write (it is a file)", folder, "choose another folder")
    if (folder / PARTS).exists():
        raise DatasetError("several machines are making it in shares", folder, "artsim merge completes it, then go on")
    begun = read_started(folder)
    if begun is None:
        _refuse_strangers(folder)
        return None
    check_same_plan(str(folder), begun.document, asked, sources)
    return begun


def _refuse_strangers(folder: Path) -> None:
    """Refuse a folder without a dataset that holds something else."""
    ours = {folder / "objects", *folder.glob(".*"), *folder.glob("objects/.*"), *folder.glob("objects/*.npz")}
    found = sorted({*folder.iterdir(), *folder.glob("objects/*")} - ours)
    if found:
        name = found[0].relative_to(folder).as_posix()
        raise DatasetError(f"the folder already holds {name!r}", folder, "choose an empty or new folder")


def _extend(folder: Path, begun: StartedDataset, num_samples: int) -> StartedDataset:
    """The plan with more samples. What is finished of the smaller one is noted, before nothing else says so."""
    document = {**begun.document, "num_samples": num_samples}
    plan = replace(begun.plan, num_samples=num_samples)
    Journal(folder / JOURNAL).start(map(asdict, begun.records))
    (folder / DESCRIPTION).unlink(missing_ok=True)
    return StartedDataset(document, plan, begun.records, False, ())
