"""The end of a dataset: its objects have their names, and ``dataset.json`` is written."""

import re
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from artsim.common.progress import track
from artsim.datasets.description import (
    DESCRIPTION,
    PLAN,
    READERS,
    StartedDataset,
    document_bytes,
    full_description,
    read_description,
    read_started,
)
from artsim.datasets.inventory import examine_sizes, remove_leftovers
from artsim.datasets.plan import Plan, ShardRecord
from artsim.datasets.worker import PARTS, PARTS_OF_ONE
from artsim.errors import DatasetError
from artsim.runs.checksums import check_files
from artsim.runs.storage import FolderStorage, Place, Storage, storage_of

_AGAIN = "delete it, and run its share again"


@dataclass(frozen=True)
class MergeResult:
    """What a call of :func:`merge` found: the place, its samples and shards, and whether it was complete before."""

    place: str
    num_samples: int
    num_shards: int
    already: bool


def merge(place: Place, check: bool = False, progress: bool = True) -> MergeResult:
    """Complete a dataset whose shares are done.

    Parameters
    ----------
    place : path, str or Storage
        Folder or URL.
    check : bool
        Read every file again, and compare its checksum; without, its size alone is compared.
    progress : bool
        Show progress bars.

    Raises
    ------
    DatasetError
        When shards are missing, with the shares that have not finished, or a file is not as it was written.
    """
    storage = storage_of(place)
    if DESCRIPTION in storage.sizes():
        plan = read_description(storage)[0]
        _clean(storage)
        return MergeResult(storage.place, plan.num_samples, plan.num_shards, True)
    begun = read_started(storage)
    if begun is None:
        raise DatasetError("no dataset was begun here", storage.place, f"name a folder or URL with {PLAN} in it")
    plan, shards = begun.plan, begun.plan.shards()
    records = examine_sizes(storage, begun, shards, PARTS).kept
    lacking = [shard.name for shard in shards if shard.name not in records]
    if lacking:
        raise DatasetError(
            f"{len(lacking)} of {len(shards)} shards are not there, such as {lacking[0]}",
            storage.place,
            _unfinished_shares(storage),
        )
    if check:
        _compare(storage, [(record.name, record.sha256) for record in records.values()], progress)
    complete(storage, begun, records, PARTS, check, progress)
    return MergeResult(storage.place, plan.num_samples, len(records), False)


def _unfinished_shares(storage: Storage) -> str:
    """What to run again."""
    done = [re.fullmatch(r"(\d+)-of-(\d+)\.json", name) for name in storage.sizes(PARTS)]
    counts = {int(found[2]) for found in done if found}
    if len(counts) != 1:
        return "run every share again: what is there is not made again"
    count = counts.pop()
    left = sorted(set(range(count)) - {int(found[1]) for found in done if found}) or range(count)
    named = ", ".join(f"--share {number}/{count}" for number in left[:6])
    return f"run again: {named}" + (f" and {len(left) - 6} more" if len(left) > 6 else "")


def complete(
    storage: Storage, begun: StartedDataset, records: Mapping[str, ShardRecord], parts: str, check: bool, progress: bool
) -> None:
    """Write ``dataset.json``, and remove what is of no use beside it."""
    place_objects(storage, begun.plan, parts, check, progress)
    shards = [records[shard.name] for shard in begun.plan.shards()]
    storage.write(DESCRIPTION, document_bytes(full_description(begun.document, begun.plan, shards)))
    _clean(storage)


def place_objects(storage: Storage, plan: Plan, parts: str, check: bool = False, progress: bool = False) -> None:
    """Let every object that was prepared be there under its name, too."""
    prepared, there = storage.sizes(f"{parts}/objects"), storage.sizes("objects")
    for planned in plan.objects:
        if f"{planned.file_sha256}.npz" not in prepared and f"{planned.key}.npz" not in there:
            raise DatasetError("is missing", f"{storage.place}/{planned.file}", "run every share again")
    found = [
        (planned, f"{parts}/objects/{planned.file_sha256}.npz", prepared[f"{planned.file_sha256}.npz"])
        for planned in plan.objects if f"{planned.file_sha256}.npz" in prepared
    ]  # fmt: skip
    if check:
        _compare(storage, [(name, planned.file_sha256) for planned, name, _ in found], progress)
    left = [(name, planned.file) for planned, name, size in found if there.get(f"{planned.key}.npz") != size]
    with (
        ThreadPoolExecutor(READERS) as pool,
        track("objects", total=len(left), unit="object", shown=progress and bool(left)) as bar,
    ):
        for _ in pool.map(lambda names: storage.copy(*names), left):
            bar.update()


def _compare(storage: Storage, digests: Sequence[tuple[str, str]], progress: bool) -> None:
    """Read files, and compare their checksums."""
    found = check_files(storage, {name: [sha256] for name, sha256 in digests}, 4, progress)
    for name, (problem, _) in found.items():
        if problem is not None:
            raise DatasetError(problem, f"{storage.place}/{name}", _AGAIN)


def _clean(storage: Storage) -> None:
    """Remove what a complete dataset does not need."""
    for parts in (PARTS, PARTS_OF_ONE):
        for folder in (f"{parts}/objects", f"{parts}/shards", parts):
            storage.remove([f"{folder}/{name}" for name in storage.sizes(folder)])
    if isinstance(storage, FolderStorage):
        remove_leftovers(storage.folder)
