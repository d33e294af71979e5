"""Making what a dataset lacks: objects from their sources, shards from the objects, descriptions from each other."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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
from artsim.datasets.inventory import STAGED, Inventory, leftovers
from artsim.datasets.origins import Origins
from artsim.datasets.plan import PlannedObject, Shard, ShardRecord
from artsim.datasets.problems import Problem
from artsim.datasets.worker import CompiledSource, RefusedSource, compile_source, make_shard
from artsim.loading.sources import Source
from artsim.runs.journal import JOURNAL, Journal
from artsim.runs.pool import Team, WorkerLost, results

_OTHER_MAKER = "another processor, or another version of artsim or of a library, made it"


@dataclass
class RestoreResult:
    """What was made, and what could not be.

    Attributes
    ----------
    files : list of str
        Files of the dataset that were made or made again.
    samples : int
        In the shards among them.
    failed : list of Problem
    """

    files: list[str] = field(default_factory=list)
    samples: int = 0
    failed: list[Problem] = field(default_factory=list)


def restore(
    folder: Path, begun: StartedDataset, inventory: Inventory, origins: Origins, team: Team, progress: bool
) -> RestoreResult:
    """Make all that is missing or damaged, and complete the dataset if nothing is left to do.

    A file whose checksum is known is put in place only with that very content.

    Parameters
    ----------
    folder : Path
        Locked by this process.
    begun : StartedDataset
        What the dataset has to be.
    inventory : Inventory
        What it is.
    origins : Origins
        Where its objects come from.
    team : WorkerPool
    progress : bool
        Show progress bars.
    """
    restored = RestoreResult()
    remove_leftovers(folder)
    if write_if_other(folder / PLAN, document_bytes(begun.document)):
        restored.files.append(PLAN)
    lost = _make_objects(folder, begun, inventory, origins, team, progress, restored)
    records = {**inventory.kept, **_make_shards(folder, begun, inventory, lost, team, progress, restored)}
    if not restored.failed:
        if _complete(folder, begun, records):
            restored.files.append(DESCRIPTION)
        remove_leftovers(folder)
    return restored


def remove_leftovers(folder: Path) -> None:
    """Remove files that killed runs did not finish."""
    for leftover in leftovers(folder):
        leftover.unlink(missing_ok=True)


def _make_objects(
    folder: Path,
    begun: StartedDataset,
    inventory: Inventory,
    origins: Origins,
    team: Team,
    progress: bool,
    restored: RestoreResult,
) -> set[PlannedObject]:
    """Load damaged and missing objects again; those that could not be."""
    attempts: dict[str, tuple[PlannedObject, Source, int]] = {}
    why: dict[PlannedObject, str] = {}
    for planned, reason in inventory.objects.items():
        in_the_way = _in_the_way(folder / planned.file)
        sources = origins.of(planned)
        if in_the_way is not None or not sources:
            why[planned] = in_the_way or f"{reason}, and its source {planned.source!r} is gone or has changed"
            continue
        for source in sources:
            attempts[f"{STAGED}{len(attempts)}.npz"] = planned, source, len(attempts)
    done: set[PlannedObject] = set()
    tasks = ((staged, (source, staged, begun.plan.seed, None)) for staged, (_, source, _) in attempts.items())
    with track("objects", total=len(attempts), unit="object", shown=progress and bool(attempts)) as bar:
        for staged, answer in team.run(compile_source, tasks):
            planned = attempts[staged][0]
            problem = _plan_difference(planned, answer)
            if problem is None:
                _put(folder / "objects" / staged, folder / planned.file)
                done.add(planned)
            else:
                why[planned] = problem
            bar.update()
    restored.files += [planned.file for planned in inventory.objects if planned in done]
    for planned in inventory.objects:
        if planned not in done:
            fix = "say where its source is: artsim repair --objects PATH"
            restored.failed.append(Problem(planned.file, f"cannot be restored: {why[planned]}", fix))
    remove_leftovers(folder)
    return {planned for planned in inventory.objects if planned not in done}


def _plan_difference(planned: PlannedObject, answer: CompiledSource | RefusedSource | WorkerLost) -> str | None:
    """Why what was loaded is not the object that was planned."""
    if isinstance(answer, RefusedSource | WorkerLost):
        return answer.why
    if answer.file_sha256 == planned.file_sha256:
        return None
    if answer.sha256 == planned.sha256:
        return f"its source gives another file ({_OTHER_MAKER})"
    return f"its source {planned.source!r} gives another object (it has changed, or {_OTHER_MAKER})"


def _put(staged: Path, path: Path) -> None:
    try:
        _clear(path)
        staged.replace(path)
    except OSError as error:
        raise write_error(error, path) from error


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


def _make_shards(
    folder: Path,
    begun: StartedDataset,
    inventory: Inventory,
    lost: set[PlannedObject],
    team: Team,
    progress: bool,
    restored: RestoreResult,
) -> dict[str, ShardRecord]:
    """Make damaged and missing shards, writing down each as it is done."""
    journal = Journal(folder / JOURNAL)
    wanted = {record.name: record.sha256 for record in begun.records} if begun.complete else {}
    missing: list[Shard] = []
    for shard, reason in inventory.shards.items():
        problem = _in_the_way(folder / shard.name)
        if problem is None and lost:
            shown = {begun.plan.object_of(index) for index in begun.plan.indices(shard)}
            if shown & lost:
                problem = f"{reason}, and it shows objects that are lost, such as {min(o.key for o in shown & lost)}"
        if problem is None:
            missing.append(shard)
        else:
            restored.failed.append(Problem(shard.name, f"cannot be restored: {problem}"))
    if not begun.complete:  # else the description itself is the journal
        journal.start(map(asdict, inventory.kept.values()))
        (folder / DESCRIPTION).unlink(missing_ok=True)
    for shard in missing:
        _clear(folder / shard.name)
    if not missing:
        return {}
    made: dict[str, ShardRecord] = {}
    total = begun.plan.num_samples if not begun.complete else sum(map(len, missing))
    done = total - sum(map(len, missing))
    tasks = ((shard.name, (shard, wanted.get(shard.name))) for shard in missing)
    with track("samples", total=total, initial=done, unit="sample", shown=progress) as bar:
        for name, answer in results(team.run(make_shard, tasks, progress=bar.update), folder):
            if isinstance(answer, ShardRecord):
                made[name] = answer
                if not begun.complete:
                    journal.add(asdict(answer))
            elif answer is not None:
                what = f"cannot be restored: made again, it has another checksum ({_OTHER_MAKER})"
                restored.failed.append(Problem(name, what, "generate the dataset again, into another folder"))
    restored.files += [shard.name for shard in missing if shard.name in made]
    restored.samples = sum(map(len, made.values()))
    return made


def _complete(folder: Path, begun: StartedDataset, records: Mapping[str, ShardRecord]) -> bool:
    """Write ``dataset.json`` unless it is inventory, and remove the journal; whether it was written."""
    shards: Iterable[Shard] = begun.plan.shards()
    description = full_description(begun.document, begun.plan, [records[shard.name] for shard in shards])
    written = write_if_other(folder / DESCRIPTION, document_bytes(description))
    Journal(folder / JOURNAL).remove()
    return written
