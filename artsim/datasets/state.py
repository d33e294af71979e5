"""What of a dataset is on disk as it should be. Nothing here writes."""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from artsim.common.files import file_sha256
from artsim.common.progress import track
from artsim.datasets.description import DESCRIPTION, JOURNAL, PLAN, StartedDataset
from artsim.datasets.plan import PlannedObject, Shard, ShardRecord
from artsim.datasets.problems import Problem, repair_command

STAGED = "_staged_"
PREPARED_JOURNAL = "objects/.prepared.jsonl"
"""A line for each object that is loaded, until there is a plan."""
"""What the names of objects begin with that are not yet part of a plan."""

_MOVE = "move it out of the folder, or delete it"


@dataclass(frozen=True)
class State:
    """What is there, and what is not.

    Attributes
    ----------
    objects : dict
        Planned objects whose files are not as they were written -> why.
    shards : dict
        Planned shards that are missing or not as they were written -> why.
    kept : dict
        Name -> record of every shard that is sound.
    """

    objects: dict[PlannedObject, str]
    shards: dict[Shard, str]
    kept: dict[str, ShardRecord]

    def __bool__(self) -> bool:
        return bool(self.objects or self.shards)

    def problems(self, folder: Path) -> list[Problem]:
        """All of it, in words."""
        fix = repair_command(folder)
        return [
            *(Problem(planned.file, why, fix) for planned, why in self.objects.items()),
            *(Problem(shard.name, why, fix) for shard, why in self.shards.items()),
        ]


def examine(folder: Path, begun: StartedDataset, workers: int = 2, progress: bool = True) -> State:
    """Compare the checksums of all files with those in the descriptions.

    Parameters
    ----------
    folder : Path
    begun : StartedDataset
    workers : int
        Threads that read.
    progress : bool
        Show a progress bar.
    """
    shards = begun.plan.shards()
    claims: dict[tuple[str, str], list[ShardRecord]] = defaultdict(list)
    for record in begun.records:
        claims[record.name, record.recipe].append(record)

    def object_problem(planned: PlannedObject) -> str | None:
        return _file_problem(folder / planned.file, [planned.file_sha256] if planned.file_sha256 else [])[0]

    def shard_state(shard: Shard) -> tuple[str | None, ShardRecord | None]:
        records = [record for record in claims[shard.name, begun.plan.recipe(shard)] if record.shard == shard]
        if not records:
            return "is another one than the plan makes" if begun.complete else "is not finished", None
        problem, digest = _file_problem(folder / shard.name, [record.sha256 for record in records])
        return problem, next((record for record in records if record.sha256 == digest), None)

    objects: dict[PlannedObject, str] = {}
    broken: dict[Shard, str] = {}
    kept: dict[str, ShardRecord] = {}
    with (
        _readers(workers) as pool,
        track("check", total=len(shards) + len(begun.plan.objects), unit="file", shown=progress, leave=False) as bar,
    ):
        for planned, problem in zip(begun.plan.objects, pool.map(object_problem, begun.plan.objects), strict=True):
            if problem is not None:
                objects[planned] = problem
            bar.update()
        for shard, (problem, found) in zip(shards, pool.map(shard_state, shards), strict=True):
            if found is None:
                broken[shard] = problem or "is not finished"
            else:
                kept[shard.name] = found
            bar.update()
    return State(objects, broken, kept)


@contextlib.contextmanager
def _readers(workers: int) -> Iterator[ThreadPoolExecutor]:
    """Threads that a Ctrl-C stops after the files that they are at, not after all."""
    pool = ThreadPoolExecutor(workers)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _file_problem(path: Path, digests: Sequence[str]) -> tuple[str | None, str]:
    """What is wrong with a file that has to have one of some digests (any, when there are none), and its digest."""
    if path.is_symlink():
        return "is a link to somewhere else", ""
    if path.is_dir():
        return "is a folder", ""
    if not path.exists():
        return "is missing", ""
    if not path.is_file():
        return "is no regular file", ""
    try:
        digest = file_sha256(path)
    except OSError as error:
        return f"cannot be read ({error.strerror})", ""
    if digests and digest not in digests:
        return "has another checksum than when it was written", digest
    return None, digest


def strangers(folder: Path, begun: StartedDataset) -> list[Problem]:
    """Shards and objects that are no part of the dataset."""
    shards = {shard.name for shard in begun.plan.shards()}
    objects = {planned.file for planned in begun.plan.objects}
    found = [
        *(path.name for path in folder.glob("*.tar") if path.name not in shards),
        *(f"objects/{path.name}" for path in folder.glob("objects/*.npz") if f"objects/{path.name}" not in objects),
    ]
    leftover = {path.relative_to(folder).as_posix() for path in leftovers(folder)}
    return [Problem(name, "is no part of this dataset", _MOVE) for name in sorted(found) if name not in leftover]


def leftovers(folder: Path) -> list[Path]:
    """Files that killed runs did not finish; what they have prepared is none as long as there is no plan."""
    found = [*folder.glob(".*.part"), *folder.glob("objects/.*.part")]
    if (folder / PLAN).exists() or (folder / DESCRIPTION).exists():
        found += [*folder.glob(f"objects/{STAGED}*.npz"), *folder.glob(PREPARED_JOURNAL)]
    return [path for path in found if path.is_symlink() or not path.is_dir()]


def leftover_problems(folder: Path, begun: StartedDataset) -> list[Problem]:
    """Files of killed runs that a complete dataset does not need."""
    found = leftovers(folder) + ([folder / JOURNAL] if begun.complete and (folder / JOURNAL).exists() else [])
    fix = repair_command(folder)
    return [Problem(path.relative_to(folder).as_posix(), "is left over from a killed run", fix) for path in found]
