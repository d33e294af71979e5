"""plan -> workers -> shards: generate a dataset by one machine or by several, resumably.

A folder under construction holds ``plan.json``, ``objects/*.npz`` (every object, so that the dataset stands on
its own), and whole shards. Its folder ``.parts`` holds what is done: see below, with ``parts`` in its place.
``dataset.json`` is written last: its presence means that the dataset is complete.

Several machines have nothing in common but the storage of the dataset: a shared folder, or a URL. Machine ``i`` of
``n`` prepares every n-th block of objects and makes every n-th shard. No machine leads: the plan is a function of the
prepared objects, so that each finds the same one. Nothing is locked, appended or renamed, for object storage can do
none of it. Until the dataset is merged, its folder ``parts`` holds::

    objects/<block>.json     what became of some sources
    objects/<sha256>.npz     their objects, before the plan names them
    shards/<shard>.json      the record of each finished shard
    <i>-of-<n>.json          that a machine has done its share
"""

import json
import logging
import re
import time
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

from artsim.datasets.description import DESCRIPTION, PLAN, StartedDataset, document_bytes, read_started
from artsim.datasets.inventory import (
    UNFINISHED,
    examine,
    examine_sizes,
    leftover_problems,
    remove_leftovers,
)
from artsim.datasets.merge import place_objects
from artsim.datasets.origins import write_origins
from artsim.datasets.plan import MAX_SAMPLES, MAX_SHARDS, Plan, PlannedObject
from artsim.datasets.preparing import VERSIONS_OF, Preparation, Share
from artsim.datasets.restore import Restoration
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.splits import check_shares
from artsim.datasets.summary import expected_line
from artsim.datasets.worker import PARTS, PARTS_OF_ONE
from artsim.errors import AssetError, ConfigError, DatasetError
from artsim.loading.sources import Source
from artsim.model.draws import view_sampler
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerPool
from artsim.runs.ray_pool import RayPool
from artsim.runs.recipe import check_counts, check_seed, differences
from artsim.runs.storage import FolderStorage, Storage, is_url, storage_of

log = logging.getLogger(__name__)

LOAD_LIMIT = 300.0
"""Seconds that an object may take to load: a hundred times what the largest real ones take."""


@dataclass(frozen=True)
class GenerateResult:
    """What a call of :func:`generate` did."""

    folder: Path | str
    """A str is the URL, or the place of a share."""
    num_samples: int
    """Of the whole dataset."""
    made: int
    """Samples made by this call."""
    seconds: float
    left_out: tuple[str, ...]
    """Sources left out because they are of no use, with the reason."""
    objects: tuple[PlannedObject, ...] = ()
    """Of the dataset."""
    restored: tuple[str, ...] = ()
    """Files that were there before, and had to be made again."""
    grown_from: int | None = None
    """Samples that the dataset had before it was extended."""


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
    start, alone = time.perf_counter(), share is None and not is_url(out)
    storage, folder, machine = storage_of(out), Path(out), share or Share()
    asked = Plan(seed, num_samples, shard_size, splits, sample or SampleOptions(), (), strict, version("artsim"))
    _check_options(asked, workers, load_limit, sources)
    if alone and DESCRIPTION in storage.sizes():  # else it is not complete, and perhaps another run is at it
        begun = _start(storage, asked, sources, alone)
        if begun is not None and _is_sound(folder, begun, num_samples, workers, progress):
            return _result(folder, begun, 0, start)
    shared = folder if alone else storage  # the files of a path reach the nodes of a cluster through this machine
    with (
        folder_lock(folder) if alone else nullcontext(),
        WorkerPool(workers, storage) if ray is None else RayPool(ray, shared, VERSIONS_OF) as team,
    ):
        try:
            begun, grown_from = _start(storage, asked, sources, alone), None
            if begun is None:
                begun = _begin(
                    Preparation(storage, asked, sources, None if alone else machine, team, skip_broken, load_limit,
                                progress)
                )  # fmt: skip
            elif num_samples > begun.plan.num_samples:
                grown_from, plan = begun.plan.num_samples, replace(begun.plan, num_samples=num_samples)
                begun = StartedDataset({**begun.document, "num_samples": num_samples}, plan)
            if isinstance(storage, FolderStorage):
                write_origins(storage, sources)
            if alone:
                inventory = examine(folder, begun, workers, progress)
            else:
                shards = begun.plan.shards()
                own = shards if begun.complete else shards[machine.number :: machine.count]
                inventory = examine_sizes(storage, begun, own, PARTS)
            if progress and inventory.shards:
                log.info(expected_line(begun.plan))
            parts = PARTS_OF_ONE if alone else PARTS
            restored = Restoration(storage, begun, inventory, sources, team, progress, parts, share is None)
            restored.run()
        finally:
            if alone:
                remove_leftovers(folder)
    if restored.failed:
        raise DatasetError(
            f"{len(restored.failed)} files of the dataset: " + "; ".join(map(str, restored.failed[:5])), storage.place
        )
    if share is not None and not begun.complete:
        storage.write(share.marker, json.dumps({"shards": len(own)}).encode())
    new = {shard.name for shard, why in inventory.shards.items() if why == UNFINISHED} | {PLAN, DESCRIPTION}
    new -= {problem.where for problem in begun.problems}
    files = () if grown_from is not None else tuple(name for name in restored.files if name not in new)
    result = _result(folder if alone else storage.place, begun, restored.samples, start)
    return replace(result, restored=files, grown_from=grown_from)


def _is_sound(folder: Path, begun: StartedDataset, num_samples: int, workers: int, progress: bool) -> bool:
    """Whether the dataset asked for is there, complete and undamaged: then nothing is written, not even a lock."""
    if not begun.complete or begun.problems or num_samples != begun.plan.num_samples:
        return False
    return not leftover_problems(folder) and not examine(folder, begun, workers, progress)


def _result(folder: Path | str, begun: StartedDataset, made: int, start: float) -> GenerateResult:
    left_out = tuple(str(entry["why"]) for entry in begun.document["left_out"])
    seconds = time.perf_counter() - start
    return GenerateResult(folder, begun.plan.num_samples, made, seconds, left_out, begun.plan.objects)


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


def _start(storage: Storage, asked: Plan, sources: Sequence[Source], alone: bool) -> StartedDataset | None:
    """What is there of the dataset, which is the one asked for, or a smaller one; None when there is none.

    Raises
    ------
    DatasetError
        When another dataset is there, naming the options that differ, or something else.
    """
    if alone and (Path(storage.place) / PARTS).exists():
        what = "several machines are making it in shares"
        raise DatasetError(what, storage.place, "artsim merge completes it, then go on")
    begun = read_started(storage)
    if begun is None:
        _refuse_strangers(storage)
        return None
    document, wanted = begun.document, asked.to_dict()
    del wanted["objects"]
    if alone and asked.num_samples > document["num_samples"]:
        del wanted["num_samples"]
    differing = [name for name, _, _ in differences(document, wanted)]
    have = {(o["source"], o["source_sha256"]) for name in ("objects", "left_out", "repeated") for o in document[name]}
    if have != {(s.name, s.sha256) for s in sources}:
        differing.append("objects")
    if differing:
        fix = "choose another --out folder, or the options it was begun with (see its plan.json)"
        if differing == ["num_samples"]:
            does = "grows, but does not shrink" if alone else "made by several machines does not grow"
            fix = f"a dataset {does}: choose another --out folder, or {document['num_samples']}"
        what = f"the folder holds a dataset of another plan (different: {', '.join(differing)})"
        raise DatasetError(what, storage.place, fix)
    return begun


def _refuse_strangers(storage: Storage) -> None:
    """Refuse a place without a dataset that holds something else."""
    found = list(storage.sizes())
    if isinstance(storage, FolderStorage):
        paths = [*storage.folder.glob("*"), *storage.folder.glob("objects/*")]
        found = [path.relative_to(storage.folder).as_posix() for path in paths]
    ours = re.compile(rf"(.*/)?\..*|objects|{PARTS}|objects/.*\.npz")
    found = sorted(name for name in found if not ours.fullmatch(name))
    if found:
        raise DatasetError(f"the folder already holds {found[0]!r}", storage.place, "choose an empty or new folder")


def _begin(objects: Preparation) -> StartedDataset:
    """Write the plan that all prepared objects make, or read the one that another machine has written."""
    storage, alone, document = objects.storage, objects.share is None, objects.document()
    if document is not None:
        if alone:
            place_objects(storage, Plan.from_dict(document), PARTS_OF_ONE)
        storage.write_new(PLAN, document_bytes(document))
    begun = _start(storage, objects.asked, objects.sources, alone)
    assert begun is not None
    if document not in (None, begun.document):
        raise DatasetError(
            "another machine makes another plan of the same objects",
            storage.place,
            "use one kind of processor, and one version of artsim and its libraries, for all shares",
        )
    return begun
