"""The end of a dataset that several machines made: objects get their names, and ``dataset.json`` is written."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from artsim.common.progress import track
from artsim.datasets.description import (
    DESCRIPTION,
    PLAN,
    document_bytes,
    full_description,
    read_description,
    read_plan_document,
)
from artsim.datasets.plan import Plan, ShardRecord
from artsim.datasets.preparing import READERS
from artsim.datasets.restore import remove_leftovers
from artsim.datasets.shares import read_records
from artsim.datasets.worker import PARTS, PREPARED, RECORDS
from artsim.errors import DatasetError
from artsim.runs.storage import FolderStorage, Place, Storage, storage_of

_BLOCK_BYTES = 1 << 22
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
    files = storage.sizes()
    if DESCRIPTION in files:
        plan, records, _ = read_description(storage)
        _clean(storage)
        return MergeResult(storage.place, plan.num_samples, len(records), True)
    document = read_plan_document(storage)
    if document is None:
        raise DatasetError("no dataset was begun here", storage.place, f"name a folder or URL with {PLAN} in it")
    plan = Plan.from_dict(document)
    records = _records(storage, plan, files)
    if check:
        _compare(storage, [(r.name, r.sha256) for r in records], progress)
    place_objects(storage, plan, PREPARED, check, progress)
    storage.write(DESCRIPTION, document_bytes(full_description(document, plan, records)))
    _clean(storage)
    return MergeResult(storage.place, plan.num_samples, len(records), False)


def _records(storage: Storage, plan: Plan, files: dict[str, int]) -> list[ShardRecord]:
    """The records of all shards."""
    shards = plan.shards()
    records = read_records(storage, plan, shards, files)
    lacking = [shard.name for shard in shards if shard.name not in records]
    if lacking:
        raise DatasetError(
            f"{len(lacking)} of {len(shards)} shards are not there, such as {lacking[0]}",
            storage.place,
            _unfinished_shares(storage),
        )
    return [records[shard.name] for shard in shards]


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


def place_objects(
    storage: Storage, plan: Plan, folder: str = PREPARED, check: bool = False, progress: bool = False
) -> None:
    """Let every object of a folder of prepared ones be there under its name, too."""
    prepared, there = storage.sizes(folder), storage.sizes("objects")
    for planned in plan.objects:
        if f"{planned.file_sha256}.npz" not in prepared and f"{planned.key}.npz" not in there:
            raise DatasetError("is missing", f"{storage.place}/{planned.file}", "run every share again")
    if check:
        names = [(f"{folder}/{p.file_sha256}.npz", p.file_sha256) for p in plan.objects]
        _compare(storage, [pair for pair in names if pair[0].rpartition("/")[2] in prepared], progress)
    left = [
        (f"{folder}/{p.file_sha256}.npz", p.file) for p in plan.objects
        if (size := prepared.get(f"{p.file_sha256}.npz")) is not None and there.get(f"{p.key}.npz") != size
    ]  # fmt: skip
    with (
        ThreadPoolExecutor(READERS) as pool,
        track("objects", total=len(left), unit="object", shown=progress) as bar,
    ):
        for _ in pool.map(lambda names: storage.copy(*names), left):
            bar.update()


def _compare(storage: Storage, digests: Sequence[tuple[str, str]], progress: bool) -> None:
    """Read files, and compare their checksums."""

    def digest(name: str) -> str:
        total, (file, _) = hashlib.sha256(), storage.open(name)
        with file:
            while block := file.read(_BLOCK_BYTES):
                total.update(block)
        return total.hexdigest()

    with (
        ThreadPoolExecutor(4) as pool,
        track("check", total=len(digests), unit="file", shown=progress) as bar,
    ):
        for (name, wanted), found in zip(digests, pool.map(lambda pair: digest(pair[0]), digests), strict=True):
            if found != wanted:
                raise DatasetError("has another checksum than its record", f"{storage.place}/{name}", _AGAIN)
            bar.update()


def _clean(storage: Storage) -> None:
    """Remove what a complete dataset does not need."""
    for folder in (PREPARED, RECORDS, PARTS):
        names = [f"{folder}/{name}" for name in storage.sizes(folder)]
        if names:
            storage.remove(names)
    if isinstance(storage, FolderStorage):
        remove_leftovers(storage.folder)
