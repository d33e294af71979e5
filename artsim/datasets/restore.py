"""Making what a dataset lacks: objects from their sources, shards from the objects, descriptions from each other."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from artsim.common.files import write_error
from artsim.common.progress import track
from artsim.datasets.description import DESCRIPTION, PLAN, StartedDataset, document_bytes, write_if_other
from artsim.datasets.inventory import Inventory
from artsim.datasets.merge import complete
from artsim.datasets.origins import Origins
from artsim.datasets.plan import PlannedObject, Shard, ShardRecord
from artsim.datasets.problems import Problem
from artsim.datasets.worker import PARTS_OF_ONE, CompiledSource, RefusedSource, compile_source, make_shard
from artsim.loading.sources import Source
from artsim.runs.pool import WorkerLost, results
from artsim.runs.ray_pool import Team
from artsim.runs.storage import FolderStorage, Storage

_OTHER_MAKER = "another processor, or another version of artsim or of a library, made it"


@dataclass
class Restoration:
    """Makes all that is missing or damaged of a dataset, and completes it once no other machine has to.

    A file whose checksum is known is put in place only with that very content.
    """

    storage: Storage
    """Where one machine makes it, a folder that this process has locked."""
    begun: StartedDataset
    """What the dataset has to be."""
    inventory: Inventory
    """What of it is there, and what this machine has to make."""
    sources: Sequence[Source]
    """Where its objects may come from."""
    team: Team
    progress: bool
    """Show progress bars."""
    parts: str = PARTS_OF_ONE
    """Folder of what is done of a dataset that is not complete."""
    completes: bool = True
    """Whether nothing is left to do for other machines."""
    files: list[str] = field(default_factory=list)
    """Files of the dataset that were made or made again."""
    samples: int = 0
    """In the shards among them."""
    failed: list[Problem] = field(default_factory=list)
    """What could not be made."""

    def run(self) -> None:
        """Make what can be made."""
        if not self.begun.complete and DESCRIPTION in self.storage.sizes():  # damaged, or that of a smaller dataset
            self.storage.copy(DESCRIPTION, f"{self.parts}/{DESCRIPTION}")
            self.storage.remove([DESCRIPTION])
        if write_if_other(self.storage, PLAN, document_bytes(self.begun.document)):
            self.files.append(PLAN)
        records = {**self.inventory.kept, **self._make_shards(self._make_objects())}
        if self.completes and not self.begun.complete and not self.failed:
            complete(self.storage, self.begun, records, self.parts, check=False, progress=self.progress)
            self.files.append(DESCRIPTION)

    def _make_objects(self) -> set[PlannedObject]:
        """Load damaged and missing objects again; those that could not be."""
        if not self.inventory.objects:
            return set()
        attempts: list[tuple[PlannedObject, Source]] = []
        why: dict[PlannedObject, str] = {}
        origins = Origins(self.storage, self.sources)
        for planned, reason in self.inventory.objects.items():
            why[planned] = _in_the_way(self.storage, planned.file) or ""
            if not why[planned]:
                sources = origins.of(planned)
                attempts += [(planned, source) for source in sources]
                why[planned] = "" if sources else f"{reason}, and its source {planned.source!r} is gone or has changed"
        folder = f"{self.parts}/objects"
        tasks = ((planned, (source, folder, self.begun.plan.seed, None)) for planned, source in attempts)
        done: set[PlannedObject] = set()
        with track("objects", total=len(attempts), unit="object", shown=self.progress and bool(attempts)) as bar:
            for planned, answer in self.team.run(compile_source, tasks):
                why[planned] = _plan_difference(planned, answer) or ""
                if not why[planned]:
                    self.storage.copy(f"{folder}/{planned.file_sha256}.npz", planned.file)
                    done.add(planned)
                bar.update()
        self.files += [planned.file for planned in self.inventory.objects if planned in done]
        lost = [planned for planned in self.inventory.objects if planned not in done]
        fix = "say where its source is: artsim repair --objects PATH"
        self.failed += [Problem(planned.file, f"cannot be restored: {why[planned]}", fix) for planned in lost]
        return set(lost)

    def _make_shards(self, lost: set[PlannedObject]) -> dict[str, ShardRecord]:
        """Make damaged and missing shards."""
        plan, missing = self.begun.plan, list[Shard]()
        wanted = {record.name: record.sha256 for record in self.begun.records} if self.begun.complete else {}
        for shard, reason in self.inventory.shards.items():
            problem = _in_the_way(self.storage, shard.name)
            shown = {plan.object_of(index) for index in plan.indices(shard)} & lost if lost else set()
            if problem is None and shown:
                problem = f"{reason}, and it shows objects that are lost, such as {min(o.key for o in shown)}"
            if problem is None:
                missing.append(shard)
            else:
                self.failed.append(Problem(shard.name, f"cannot be restored: {problem}"))
        made: dict[str, ShardRecord] = {}
        left = sum(map(len, missing))
        done = 0 if self.begun.complete else sum(map(len, self.inventory.kept.values()))
        tasks = ((shard.name, (shard, wanted.get(shard.name), self.parts)) for shard in missing)
        with track(
            "samples", total=left + done, initial=done, unit="sample", shown=self.progress and bool(missing)
        ) as bar:
            for name, answer in results(self.team.run(make_shard, tasks, progress=bar.update), self.storage.place):
                if isinstance(answer, ShardRecord):
                    made[name] = answer
                elif answer is not None:
                    what = f"cannot be restored: regenerated, it has another checksum ({_OTHER_MAKER})"
                    self.failed.append(Problem(name, what, "generate the dataset again, into another folder"))
        self.files += [shard.name for shard in missing if shard.name in made]
        self.samples = sum(map(len, made.values()))
        return made


def _plan_difference(planned: PlannedObject, answer: CompiledSource | RefusedSource | WorkerLost) -> str | None:
    """Why what was loaded is not the object that was planned."""
    if isinstance(answer, RefusedSource | WorkerLost):
        return answer.why
    if answer.file_sha256 == planned.file_sha256:
        return None
    if answer.sha256 == planned.sha256:
        return f"its source gives another file ({_OTHER_MAKER})"
    return f"its source {planned.source!r} gives another object (it has changed, or {_OTHER_MAKER})"


def _in_the_way(storage: Storage, name: str) -> str | None:
    """Remove an empty folder, a pipe or a device from the place of a file; what is not ours to delete."""
    if not isinstance(storage, FolderStorage):
        return None
    path = storage.folder / name
    try:
        if path.is_dir() and not path.is_symlink():
            if any(path.iterdir()):
                return "a folder that holds files is in its place: move it away"
            path.rmdir()
        elif path.exists() and not path.is_file():
            path.unlink()
    except OSError as error:
        raise write_error(error, path) from error
    return None
