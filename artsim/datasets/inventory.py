"""What of a dataset is on disk as it should be. Nothing here writes."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

from artsim.datasets.description import DESCRIPTION, PLAN, StartedDataset
from artsim.datasets.plan import PlannedObject, Shard, ShardRecord
from artsim.datasets.problems import Problem, repair_command
from artsim.datasets.worker import PREPARED_BY_ONE
from artsim.runs.checksums import check_files
from artsim.runs.journal import JOURNAL

_MOVE = "move it out of the folder, or delete it"


@dataclass(frozen=True)
class Inventory:
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


def examine(folder: Path, begun: StartedDataset, workers: int = 2, progress: bool = True) -> Inventory:
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

    digests: dict[str, list[str]] = {
        planned.file: [planned.file_sha256] if planned.file_sha256 else [] for planned in begun.plan.objects
    }
    known: dict[Shard, list[ShardRecord]] = {}
    for shard in shards:
        known[shard] = [record for record in claims[shard.name, begun.plan.recipe(shard)] if record.shard == shard]
        if known[shard]:
            digests[shard.name] = [record.sha256 for record in known[shard]]
    found = check_files(folder, digests, workers, progress)
    objects = {p: problem for p in begun.plan.objects if (problem := found[p.file][0]) is not None}
    unknown = "is another one than the plan makes" if begun.complete else "is not finished"
    broken: dict[Shard, str] = {}
    kept: dict[str, ShardRecord] = {}
    for shard in shards:
        problem, digest = found.get(shard.name, (unknown, ""))
        if problem is not None:
            broken[shard] = problem
        else:
            kept[shard.name] = next(record for record in known[shard] if record.sha256 == digest)
    return Inventory(objects, broken, kept)


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
        # Versions before December 2026 wrote the two last ones.
        for pattern in (f"{PREPARED_BY_ONE}/*", "objects/_staged_*.npz", "objects/.prepared.jsonl"):
            found += folder.glob(pattern)
    return [path for path in found if path.is_symlink() or not path.is_dir()]


def leftover_problems(folder: Path, begun: StartedDataset) -> list[Problem]:
    """Files of killed runs that a complete dataset does not need."""
    found = leftovers(folder) + ([folder / JOURNAL] if begun.complete and (folder / JOURNAL).exists() else [])
    fix = repair_command(folder)
    return [Problem(path.relative_to(folder).as_posix(), "is left over from a killed run", fix) for path in found]
