"""What of a dataset is there as it should be, and what else is there."""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from artsim.datasets.description import DESCRIPTION, StartedDataset, finished_shards
from artsim.datasets.plan import PlannedObject, Shard, ShardRecord
from artsim.datasets.problems import Problem, repair_command
from artsim.datasets.worker import PARTS_OF_ONE
from artsim.runs.checksums import check_files
from artsim.runs.storage import FolderStorage, Storage
from artsim.runs.tasks import JOURNAL

_MOVE = "move it out of the folder, or delete it"
UNFINISHED = "is not finished"


@dataclass(frozen=True)
class Inventory:
    """What is there, and what is not."""

    objects: dict[PlannedObject, str]
    """Planned objects whose files are not as they were written -> why."""
    shards: dict[Shard, str]
    """Planned shards that are missing or not as they were written -> why."""
    kept: dict[str, ShardRecord]
    """Name -> record of every shard that is sound."""

    def __bool__(self) -> bool:
        return bool(self.objects or self.shards)

    def problems(self, folder: Path) -> list[Problem]:
        """All of it, in words."""
        why = {planned.file: why for planned, why in self.objects.items()}
        why |= {shard.name: why for shard, why in self.shards.items()}
        return [Problem(name, what, repair_command(folder)) for name, what in why.items()]


def examine(folder: Path, begun: StartedDataset, workers: int = 2, progress: bool = True) -> Inventory:
    """Compare the checksums of all files of a folder with those that are known.

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
    known = _known(FolderStorage(folder), begun, shards, PARTS_OF_ONE)
    digests = {
        **{planned.file: [planned.file_sha256][: len(planned.file_sha256)] for planned in begun.plan.objects},
        **{shard.name: [record.sha256 for record in known[shard]] for shard in shards if known[shard]},
    }
    found = check_files(folder, digests, workers, progress)
    objects = {p: problem for p in begun.plan.objects if (problem := found[p.file][0]) is not None}
    unknown = "is another one than the plan makes" if begun.complete else UNFINISHED
    states = {shard: found.get(shard.name, (unknown, "")) for shard in shards}
    kept = {
        shard.name: next(record for record in known[shard] if record.sha256 == digest)
        for shard, (problem, digest) in states.items() if problem is None
    }  # fmt: skip
    return Inventory(objects, {shard: why for shard, (why, _) in states.items() if why is not None}, kept)


def examine_sizes(storage: Storage, begun: StartedDataset, shards: Iterable[Shard], parts: str) -> Inventory:
    """Compare the sizes of some shards with those that are known; what many machines share is too much to be read."""
    shards, files = list(shards), storage.sizes()
    known = _known(storage, begun, shards, parts)
    kept = {s.name: known[s][-1] for s in shards if known[s] and files.get(s.name) == known[s][-1].bytes}
    return Inventory({}, {shard: UNFINISHED for shard in shards if shard.name not in kept}, kept)


def _known(
    storage: Storage, begun: StartedDataset, shards: Iterable[Shard], parts: str
) -> dict[Shard, list[ShardRecord]]:
    """Records of shards that are said to be finished, and are those of the plan."""
    claims: dict[tuple[Shard, str], list[ShardRecord]] = defaultdict(list)
    for record in begun.records if begun.complete else finished_shards(storage, shards, parts):
        claims[record.shard, record.recipe].append(record)
    return {shard: claims[shard, begun.plan.recipe(shard)] for shard in shards}


def strangers(folder: Path, begun: StartedDataset) -> list[Problem]:
    """Shards and objects that are no part of the dataset."""
    known = {planned.file for planned in begun.plan.objects} | {shard.name for shard in begun.plan.shards()}
    known |= {path.relative_to(folder).as_posix() for path in leftovers(folder)}
    paths = [*folder.glob("*.tar"), *folder.glob("objects/*.npz")]
    found = {path.relative_to(folder).as_posix() for path in paths} - known
    return [Problem(name, "is no part of this dataset", _MOVE) for name in sorted(found)]


def leftovers(folder: Path) -> list[Path]:
    """Files that killed runs did not finish, and what they noted of a dataset that is complete now."""
    found = [*folder.glob(".*.part"), *folder.glob("objects/.*.part"), *folder.glob(f"{PARTS_OF_ONE}/*/.*.part")]
    if (folder / DESCRIPTION).exists():
        # Versions before December 2026 wrote the two last ones.
        for pattern in (f"{PARTS_OF_ONE}/*", f"{PARTS_OF_ONE}/*/*", "objects/.prepared/*", JOURNAL):
            found += folder.glob(pattern)
    return [path for path in dict.fromkeys(found) if path.is_symlink() or not path.is_dir()]


def leftover_problems(folder: Path) -> list[Problem]:
    """Files of killed runs."""
    fix, names = repair_command(folder), (path.relative_to(folder).as_posix() for path in leftovers(folder))
    return [Problem(name, "is left over from a killed run", fix) for name in names]


def remove_leftovers(folder: Path) -> None:
    """Remove files that killed runs did not finish."""
    FolderStorage(folder).remove(path.relative_to(folder).as_posix() for path in leftovers(folder))
