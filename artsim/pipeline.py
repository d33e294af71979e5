"""plan -> workers -> shards: generate a dataset on local processes, resumably.

A folder under construction holds ``plan.json``, ``objects/*.npz`` (every object, so that the dataset stands on
its own), whole shards, and ``progress.jsonl``, one line for each of them. ``dataset.json`` is written last: its
presence means that the dataset is complete.
"""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from artsim.errors import ArtsimError, AssetError, DatasetError
from artsim.files import write_atomic
from artsim.plan import FORMAT, Plan, PlannedObject, SampleOptions, ShardRecord, assign_splits, unique_keys
from artsim.sources import Source
from artsim.worker import CompiledSource, compile_source, make_shard, start_worker

CONVENTIONS = (
    "Metres, radians. Camera frame OpenCV (x right, y down, z forward); depth is z-depth, 0 = no return; pixel centres "
    "at +0.5. T_camera_part maps the rest frame, as carried by each part, to the camera. Rest frame: Z up, front "
    "towards -X, origin at the centre of the object's box in its rest state."
)


@dataclass(frozen=True)
class GenerateResult:
    """What a call of :func:`generate` did."""

    folder: Path
    num_samples: int
    made: int
    seconds: float
    left_out: tuple[str, ...]
    """Sources left out because they could not be loaded, with the reason."""


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
) -> GenerateResult:
    """Generate a dataset, or go on with one that was stopped.

    Parameters
    ----------
    sources : sequence of Source
        The objects; see :func:`artsim.sources.find_sources`.
    out : path
        Folder of the dataset; made if missing.
    num_samples, seed : int
    sample : SampleOptions, optional
    workers : int
        Processes. The result does not depend on it.
    shard_size : int
        Samples of a tar file.
    splits : 3 float
        Shares of each category's objects in train, val and test.
    skip_broken : bool
        Leave out sources that do not load instead of stopping.
    progress : bool
        Show progress bars.

    Returns
    -------
    GenerateResult

    Raises
    ------
    AssetError
        When sources cannot be loaded.
    DatasetError
        When the folder holds a dataset of another plan, or is in use.
    KeyboardInterrupt
        On Ctrl-C, after the workers have stopped; the same call resumes.
    """
    start = time.perf_counter()
    folder = Path(out)
    options = {
        "seed": seed,
        "num_samples": num_samples,
        "shard_size": shard_size,
        "fractions": list(splits),
        "sample": json.loads(json.dumps(asdict(sample or SampleOptions()))),
    }
    _check_counts(num_samples, shard_size, workers, sources)
    with _locked(folder):
        _remove_leftovers(folder)
        left_out: list[str] = []
        plan = _resumed_plan(folder, options, sources)
        with _Team(folder, workers) as team:
            if plan is None:
                plan, left_out = _new_plan(folder, options, sources, team, skip_broken, progress)
            finished = _finished_shards(folder, plan)
            before = sum(record.end - record.first for record in finished.values())
            finished |= _make_missing(folder, plan, finished, team, progress)
        _write_dataset_file(folder, plan, finished)
    made = plan.num_samples - before
    return GenerateResult(folder, plan.num_samples, made, time.perf_counter() - start, tuple(left_out))


class _Team:
    """The worker processes of a run: started when first given work, stopped at the end however it comes."""

    def __init__(self, folder: Path, workers: int):
        context = multiprocessing.get_context("spawn")
        self.folder = folder
        self.made, self.stop = context.Value("q", 0), context.Event()
        self.pool = ProcessPoolExecutor(workers, context, start_worker, (folder, self.made, self.stop))

    def __enter__(self) -> _Team:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        self.stop.set()
        self.pool.shutdown(wait=True, cancel_futures=True)
        if isinstance(error, BrokenProcessPool):
            raise DatasetError(
                "a worker process died (out of memory?)", self.folder, "use fewer --workers; the same command resumes"
            ) from error


def _check_counts(num_samples: int, shard_size: int, workers: int, sources: Sequence[Source]) -> None:
    for name, value in (("num_samples", num_samples), ("shard_size", shard_size), ("workers", workers)):
        if value < 1:
            raise ArtsimError(f"{value} is not a count", name, "use 1 or more")
    if not sources:
        raise AssetError("no objects to show", mend="name URDF files or folders that hold some")


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Keep a second run out of the folder; the lock goes with the process, however it ends."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / ".lock").open("w")
    except OSError as error:
        raise DatasetError(f"cannot write ({error.strerror})", folder, "choose another --out folder") from error
    with lock:
        if sys.platform != "win32":
            import fcntl

            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise DatasetError("another run is writing here", folder, "wait for it or stop it") from error
        yield


def _remove_leftovers(folder: Path) -> None:
    for leftover in [*folder.glob(".*.part"), *(folder / "objects").glob(".*.part")]:
        leftover.unlink(missing_ok=True)


def _resumed_plan(folder: Path, options: Mapping[str, Any], sources: Sequence[Source]) -> Plan | None:
    """The folder's plan if there is one and it is the one asked for.

    Raises
    ------
    DatasetError
        When the folder belongs to another plan, or to something else.
    """
    path = folder / "plan.json"
    if not path.exists():
        strangers = [p.name for p in folder.iterdir() if not p.name.startswith(".") and p.name != "objects"]
        if strangers:
            raise DatasetError(f"the folder already holds {strangers[0]!r}", folder, "choose an empty or new folder")
        return None
    try:
        stored = json.loads(path.read_text())
        plan = Plan.from_dict(stored)
    except (ValueError, KeyError, TypeError) as error:
        raise DatasetError(f"plan.json is damaged ({error})", folder, "delete the folder and start again") from error
    differing = [name for name, value in options.items() if stored.get(name) != value]
    wanted = sorted((s.name, s.sha256) for s in sources)
    have = sorted({(o.source, o.source_sha256) for o in plan.objects} | {tuple(s) for s in stored["left_out"]})
    if wanted != have:
        differing.append("objects")
    if stored.get("format") != FORMAT:
        differing.append("format")
    if differing:
        raise DatasetError(
            f"the folder holds a dataset of another plan (different: {', '.join(differing)})",
            folder,
            "choose another --out folder, or the options it was begun with (see its plan.json)",
        )
    return plan


def _new_plan(
    folder: Path,
    options: Mapping[str, Any],
    sources: Sequence[Source],
    team: _Team,
    skip_broken: bool,
    progress: bool,
) -> tuple[Plan, list[str]]:
    """Load every source, keep it compiled in the folder, and write the plan."""
    loaded: list[tuple[Source, CompiledSource]] = []
    broken: list[tuple[Source, str]] = []
    staging = folder / "objects"
    staging.mkdir(exist_ok=True)
    futures = [team.pool.submit(compile_source, source) for source in sources]
    with tqdm(total=len(sources), desc="objects", unit="object", disable=not progress) as bar:
        for source, future in zip(sources, futures, strict=True):
            try:
                loaded.append((source, future.result()))
            except ArtsimError as error:
                broken.append((source, str(error)))
            bar.update()
    if (broken and not skip_broken) or not loaded:
        raise AssetError(
            f"{len(broken)} of {len(sources)} objects do not load:\n  " + "\n  ".join(text for _, text in broken[:20]),
            mend="mend them, or leave them out with --skip-broken",
        )
    unique: dict[tuple[str, str, str], tuple[Source, CompiledSource]] = {}
    for source, compiled in loaded:  # the same object named twice counts once
        unique.setdefault((compiled.category, compiled.object_id, compiled.sha256), (source, compiled))
    keys = unique_keys(list(unique))
    split_names = assign_splits(
        [(c.category, c.sha256) for _, c in unique.values()], options["fractions"], options["seed"]
    )
    objects = []
    for key, split, (source, compiled) in zip(keys, split_names, unique.values(), strict=True):
        (staging / compiled.staged).replace(staging / f"{key}.npz")
        objects.append(
            PlannedObject(
                key=key,
                category=compiled.category,
                object_id=compiled.object_id,
                sha256=compiled.sha256,
                num_parts=compiled.num_parts,
                source=source.name,
                source_sha256=source.sha256,
                split=split,
            )
        )
    for stray in staging.glob("_staged_*.npz"):
        stray.unlink()
    planned = {(o.source, o.source_sha256) for o in objects}
    left_out = sorted({(s.name, s.sha256) for s in sources} - planned)
    plan = Plan.from_dict({**options, "objects": [asdict(o) for o in objects]})
    write_atomic(folder / "plan.json", json.dumps({**plan.to_dict(), "left_out": left_out}, indent=1).encode())
    return plan, [text for _, text in broken]


def _finished_shards(folder: Path, plan: Plan) -> dict[str, ShardRecord]:
    """Shards that earlier runs finished and that are still there at their full size."""
    path = folder / "progress.jsonl"
    wanted = {shard.name: shard for shard in plan.shards()}
    finished = {}
    lines = path.read_text().splitlines() if path.exists() else []
    complete = folder / "dataset.json"
    if complete.exists():
        lines += [json.dumps(record) for record in json.loads(complete.read_text())["shards"]]
    for line in lines:
        try:
            record = ShardRecord(**json.loads(line))
        except (ValueError, TypeError):
            continue  # the last line of a killed run may be cut short; its shard is made again
        shard, file = wanted.get(record.name), folder / record.name
        if shard is not None and file.exists() and file.stat().st_size == record.bytes:
            finished[record.name] = record
    return finished


def _make_missing(
    folder: Path, plan: Plan, finished: Mapping[str, ShardRecord], team: _Team, progress: bool
) -> dict[str, ShardRecord]:
    """Make the shards that are not finished, writing down each as it is."""
    missing = [shard for shard in plan.shards() if shard.name not in finished]
    before = plan.num_samples - sum(shard.end - shard.first for shard in missing)
    if missing:
        (folder / "dataset.json").unlink(missing_ok=True)
    made: dict[str, ShardRecord] = {}
    with (
        (folder / "progress.jsonl").open("a") as journal,
        tqdm(total=plan.num_samples, initial=before, desc="samples", unit="sample", disable=not progress) as bar,
    ):
        for record in finished.values():  # those of a complete dataset that lost a shard are only in its description
            journal.write("\n" + json.dumps(asdict(record)))
        pending: set[Future[ShardRecord | None]] = {team.pool.submit(make_shard, shard) for shard in missing}
        while pending:
            done, pending = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
            for record in filter(None, (future.result() for future in done)):
                made[record.name] = record
                journal.write("\n" + json.dumps(asdict(record)))
                journal.flush()
            bar.update(before + team.made.value - bar.n)
    return made


def _write_dataset_file(folder: Path, plan: Plan, finished: Mapping[str, ShardRecord]) -> None:
    description = {
        **plan.to_dict(),
        "conventions": CONVENTIONS,
        "splits": {split: {"first": first, "end": end} for split, (first, end) in plan.ranges.items()},
        "shards": [asdict(finished[shard.name]) for shard in plan.shards()],
    }
    write_atomic(folder / "dataset.json", json.dumps(description, indent=1).encode())
    (folder / "progress.jsonl").unlink(missing_ok=True)
