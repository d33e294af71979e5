"""Making what a dataset lacks: objects from their sources, shards from the objects, descriptions from each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path

from artsim.common.files import write_error
from artsim.common.progress import track
from artsim.datasets.description import (
    DESCRIPTION,
    PLAN,
    StartedDataset,
    document_bytes,
    full_description,
    write_if_other,
)
from artsim.datasets.inventory import Inventory, leftovers
from artsim.datasets.origins import Origins
from artsim.datasets.plan import PlannedObject, Shard, ShardRecord
from artsim.datasets.problems import Problem
from artsim.datasets.worker import PREPARED_BY_ONE, CompiledSource, RefusedSource, compile_source, make_shard
from artsim.loading.sources import Source
from artsim.runs.journal import JOURNAL, Journal
from artsim.runs.pool import Team, WorkerLost, results
from artsim.runs.storage import FolderStorage

_OTHER_MAKER = "another processor, or another version of artsim or of a library, made it"


@dataclass
class Restoration:
    """Makes all that is missing or damaged of a dataset, and completes it if nothing is left to do.

    A file whose checksum is known is put in place only with that very content.

    Attributes
    ----------
    folder : Path
        Locked by this process.
    begun : StartedDataset
        What the dataset has to be.
    inventory : Inventory
        What it is.
    origins : Origins
        Where its objects come from.
    team : WorkerPool or RayPool
    progress : bool
        Show progress bars.
    files : list of str
        Files of the dataset that were made or made again.
    samples : int
        In the shards among them.
    failed : list of Problem
        What could not be made.
    """

    folder: Path
    begun: StartedDataset
    inventory: Inventory
    origins: Origins
    team: Team
    progress: bool
    files: list[str] = field(default_factory=list)
    samples: int = 0
    failed: list[Problem] = field(default_factory=list)

    def run(self) -> None:
        """Make what can be made."""
        remove_leftovers(self.folder)
        if write_if_other(self.folder / PLAN, document_bytes(self.begun.document)):
            self.files.append(PLAN)
        records = {**self.inventory.kept, **self._make_shards(self._make_objects())}
        if not self.failed:
            self._complete(records)
            remove_leftovers(self.folder)

    def _make_objects(self) -> set[PlannedObject]:
        """Load damaged and missing objects again; those that could not be."""
        attempts: list[tuple[PlannedObject, Source]] = []
        why: dict[PlannedObject, str] = {}
        for planned, reason in self.inventory.objects.items():
            in_the_way = _in_the_way(self.folder / planned.file)
            sources = self.origins.of(planned)
            if in_the_way is not None or not sources:
                why[planned] = in_the_way or f"{reason}, and its source {planned.source!r} is gone or has changed"
                continue
            attempts += [(planned, source) for source in sources]
        done: set[PlannedObject] = set()
        tasks = ((planned, (source, PREPARED_BY_ONE, self.begun.plan.seed, None)) for planned, source in attempts)
        with track("objects", total=len(attempts), unit="object", shown=self.progress and bool(attempts)) as bar:
            for planned, answer in self.team.run(compile_source, tasks):
                problem = _plan_difference(planned, answer)
                if problem is None:
                    _put(self.folder, planned)
                    done.add(planned)
                else:
                    why[planned] = problem
                bar.update()
        self.files += [planned.file for planned in self.inventory.objects if planned in done]
        for planned in self.inventory.objects:
            if planned not in done:
                fix = "say where its source is: artsim repair --objects PATH"
                self.failed.append(Problem(planned.file, f"cannot be restored: {why[planned]}", fix))
        remove_leftovers(self.folder)
        return {planned for planned in self.inventory.objects if planned not in done}

    def _make_shards(self, lost: set[PlannedObject]) -> dict[str, ShardRecord]:
        """Make damaged and missing shards, writing down each as it is done."""
        journal = Journal(self.folder / JOURNAL)
        wanted = {record.name: record.sha256 for record in self.begun.records} if self.begun.complete else {}
        missing: list[Shard] = []
        for shard, reason in self.inventory.shards.items():
            problem = _in_the_way(self.folder / shard.name)
            if problem is None and lost:
                shown = {self.begun.plan.object_of(index) for index in self.begun.plan.indices(shard)}
                if shown & lost:
                    problem = (
                        f"{reason}, and it shows objects that are lost, such as {min(o.key for o in shown & lost)}"
                    )
            if problem is None:
                missing.append(shard)
            else:
                self.failed.append(Problem(shard.name, f"cannot be restored: {problem}"))
        if not self.begun.complete:  # else the description itself is the journal
            journal.start(map(asdict, self.inventory.kept.values()))
            (self.folder / DESCRIPTION).unlink(missing_ok=True)
        for shard in missing:
            _clear(self.folder / shard.name)
        if not missing:
            return {}
        made: dict[str, ShardRecord] = {}
        total = self.begun.plan.num_samples if not self.begun.complete else sum(map(len, missing))
        done = total - sum(map(len, missing))
        tasks = ((shard.name, (shard, wanted.get(shard.name))) for shard in missing)
        with track("samples", total=total, initial=done, unit="sample", shown=self.progress) as bar:
            for name, answer in results(self.team.run(make_shard, tasks, progress=bar.update), self.folder):
                if isinstance(answer, ShardRecord):
                    made[name] = answer
                    if not self.begun.complete:
                        journal.add(asdict(answer))
                elif answer is not None:
                    what = f"cannot be restored: regenerated, it has another checksum ({_OTHER_MAKER})"
                    self.failed.append(Problem(name, what, "generate the dataset again, into another folder"))
        self.files += [shard.name for shard in missing if shard.name in made]
        self.samples = sum(map(len, made.values()))
        return made

    def _complete(self, records: Mapping[str, ShardRecord]) -> None:
        """Write ``dataset.json`` unless it is there, and remove the journal."""
        plan = self.begun.plan
        description = full_description(self.begun.document, plan, [records[shard.name] for shard in plan.shards()])
        if write_if_other(self.folder / DESCRIPTION, document_bytes(description)):
            self.files.append(DESCRIPTION)
        Journal(self.folder / JOURNAL).remove()


def remove_leftovers(folder: Path) -> None:
    """Remove files that killed runs did not finish."""
    FolderStorage(folder).remove(path.relative_to(folder).as_posix() for path in leftovers(folder))


def _plan_difference(planned: PlannedObject, answer: CompiledSource | RefusedSource | WorkerLost) -> str | None:
    """Why what was loaded is not the object that was planned."""
    if isinstance(answer, RefusedSource | WorkerLost):
        return answer.why
    if answer.file_sha256 == planned.file_sha256:
        return None
    if answer.sha256 == planned.sha256:
        return f"its source gives another file ({_OTHER_MAKER})"
    return f"its source {planned.source!r} gives another object (it has changed, or {_OTHER_MAKER})"


def _put(folder: Path, planned: PlannedObject) -> None:
    """Let a prepared object be in its place."""
    try:
        _clear(folder / planned.file)
    except OSError as error:
        raise write_error(error, folder / planned.file) from error
    FolderStorage(folder).copy(f"{PREPARED_BY_ONE}/{planned.file_sha256}.npz", planned.file)


def _in_the_way(path: Path) -> str | None:
    """A folder that holds something, where a file has to be: it is not ours to delete."""
    if path.is_dir() and not path.is_symlink() and any(path.iterdir()):
        return "a folder that holds files is in its place: move it away"
    return None


def _clear(path: Path) -> None:
    """Remove an empty folder, a pipe or a device from the place of a file."""
    if path.is_dir() and not path.is_symlink():
        path.rmdir()
    elif path.exists() and not path.is_file():
        path.unlink()
