"""plan -> workers -> shards: generate a dataset on local processes, resumably.

A folder under construction holds ``plan.json``, ``objects/*.npz`` (every object, so that the dataset stands on
its own), whole shards, and ``progress.jsonl``, one line for each of them. ``dataset.json`` is written last: its
presence means that the dataset is complete.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from artsim.datasets.plan import (
    Plan,
    PlannedObject,
    SampleOptions,
    ShardRecord,
    assign_splits,
    check_shares,
    unique_keys,
)
from artsim.datasets.team import Team, locked
from artsim.datasets.worker import CompiledSource, compile_source, make_shard
from artsim.errors import ArtsimError, AssetError, ConfigError, DatasetError, KinematicsError
from artsim.files import write_atomic, write_error
from artsim.loading.sources import Source
from artsim.progress import track

CONVENTIONS = (
    "Metres, radians. Camera frame OpenCV (x right, y down, z forward); depth is z-depth, 0 = no return; pixel centres "
    "at +0.5. T_camera_part maps the rest frame, as carried by each part, to the camera. Rest frame: Z up, front "
    "towards -X, origin at the centre of the object's box in its rest state."
)
_VERSIONS_OF = ("artsim", "numpy", "scipy", "trimesh", "embreex")


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
        The objects; see :func:`artsim.loading.sources.find_sources` and :func:`artsim.loading.sources.family_sources`.
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
    ConfigError
        When an option makes no sense, or the folder cannot be written to.
    DatasetError
        When the folder holds a dataset of another plan, or is in use.
    KeyboardInterrupt
        On Ctrl-C, after the workers have stopped; the same call resumes.
    """
    start = time.perf_counter()
    folder = Path(out)
    asked = Plan(seed, num_samples, shard_size, splits, sample or SampleOptions(), ())
    options = {**json.loads(json.dumps(asked.to_dict())), "artsim_version": version("artsim")}
    del options["objects"]
    _check_options(num_samples, seed, shard_size, workers, splits, sources)
    with locked(folder):
        _remove_leftovers(folder)
        begun = _begun_plan(folder, options, sources)
        with Team(folder, workers) as team:
            if begun is None:
                begun = _new_plan(folder, options, sources, team, skip_broken, progress)
            plan = Plan.from_dict(begun)
            finished = _finished_shards(folder, plan)
            before = sum(record.end - record.first for record in finished.values())
            finished |= _make_missing(folder, plan, finished, team, progress)
        _complete(folder, plan, begun, finished)
    left_out = tuple(entry["why"] for entry in begun["left_out"])
    return GenerateResult(folder, plan.num_samples, plan.num_samples - before, time.perf_counter() - start, left_out)


def _check_options(
    num_samples: int,
    seed: int,
    shard_size: int,
    workers: int,
    splits: tuple[float, float, float],
    sources: Sequence[Source],
) -> None:
    for name, value in (("num_samples", num_samples), ("shard_size", shard_size), ("workers", workers)):
        if value < 1:
            raise ConfigError(f"{value} is not a count", name, "use 1 or more")
    if seed < 0:
        raise ConfigError(f"{seed} is not a seed", "seed", "use 0 or more")
    check_shares(splits)
    if not sources:
        raise AssetError("no objects to show", fix="name categories to make, or URDF files or folders that hold some")


def _remove_leftovers(folder: Path) -> None:
    """Remove files that killed runs did not finish."""
    for leftover in [*folder.glob(".*.part"), *folder.glob("objects/.*.part")]:
        leftover.unlink(missing_ok=True)


def _begun_plan(folder: Path, options: Mapping[str, Any], sources: Sequence[Source]) -> dict[str, Any] | None:
    """Content of the folder's ``plan.json`` if there is one and it is the one asked for.

    Raises
    ------
    DatasetError
        When the folder belongs to another plan, or to something else.
    """
    path = folder / "plan.json"
    if not path.exists():
        ours = {folder / "objects", *folder.glob(".*"), *folder.glob("objects/.*"), *folder.glob("objects/*.npz")}
        strangers = sorted({*folder.iterdir(), *folder.glob("objects/*")} - ours)
        if strangers:
            name = strangers[0].relative_to(folder).as_posix()
            raise DatasetError(f"the folder already holds {name!r}", folder, "choose an empty or new folder")
        return None
    try:
        stored: dict[str, Any] = json.loads(path.read_text())
        differing = _differing(options, stored)
        have = {
            (o["source"], o["source_sha256"]) for o in [*stored["objects"], *stored["left_out"], *stored["repeated"]]
        }
        if have != {(s.name, s.sha256) for s in sources}:
            differing.append("objects")
        if not differing:
            Plan.from_dict(stored)
    except (ValueError, KeyError, TypeError, AttributeError, ArtsimError) as error:
        raise DatasetError(f"plan.json is damaged ({error})", folder, "delete the folder and start again") from error
    if differing:
        raise DatasetError(
            f"the folder holds a dataset of another plan (different: {', '.join(differing)})",
            folder,
            "choose another --out folder, or the options it was begun with (see its plan.json)",
        )
    return stored


def _differing(wanted: Mapping[str, Any], stored: Mapping[str, Any], prefix: str = "") -> list[str]:
    """Names of the entries of ``wanted`` that are stored otherwise, such as 'sample.views.fov'."""
    names: list[str] = []
    for name, value in wanted.items():
        there = stored.get(name)
        if isinstance(value, dict) and isinstance(there, dict) and value.keys() == there.keys():
            names += _differing(value, there, f"{prefix}{name}.")
        elif value != there:
            names.append(prefix + name)
    return names


def _new_plan(
    folder: Path,
    options: Mapping[str, Any],
    sources: Sequence[Source],
    team: Team,
    skip_broken: bool,
    progress: bool,
) -> dict[str, Any]:
    """Load every source, keep it compiled in the folder, and write the plan."""
    staging = folder / "objects"
    try:
        staging.mkdir(exist_ok=True)
    except OSError as error:
        raise write_error(error, staging) from error
    loaded: dict[tuple[str, str, str], tuple[Source, CompiledSource]] = {}
    repeated: list[dict[str, str]] = []
    left_out: list[dict[str, str]] = []
    futures = [team.submit(compile_source, source, f"_staged_{i}.npz") for i, source in enumerate(sources)]
    with track("objects", total=len(sources), unit="object", shown=progress) as bar:
        for source, future in zip(sources, futures, strict=True):
            entry = {"source": source.name, "source_sha256": source.sha256}
            try:
                compiled = future.result()
                content = compiled.category, compiled.object_id, compiled.sha256
                if loaded.setdefault(content, (source, compiled))[0] is not source:
                    repeated.append(entry)  # the same object named twice counts once
            except (AssetError, KinematicsError) as error:
                left_out.append({**entry, "why": str(error)})
            bar.update()
    if (left_out and not skip_broken) or not loaded:
        raise AssetError(
            f"{len(left_out)} of {len(sources)} objects do not load:\n  "
            + "\n  ".join(entry["why"] for entry in left_out[:20]),
            fix="mend them, or leave them out with --skip-broken",
        )
    keys = unique_keys(list(loaded))
    splits = assign_splits(
        [(category, sha256) for category, _, sha256 in loaded], options["fractions"], options["seed"]
    )
    objects = []
    for key, split, (source, compiled) in zip(keys, splits, loaded.values(), strict=True):
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
    plan = {
        **options,
        "versions": {name: version(name) for name in _VERSIONS_OF},
        "objects": [asdict(o) for o in objects],
        "left_out": left_out,
        "repeated": repeated,
    }
    write_atomic(folder / "plan.json", json.dumps(plan, indent=1).encode())
    return plan


def _finished_shards(folder: Path, plan: Plan) -> dict[str, ShardRecord]:
    """Shards that earlier runs finished and that are still there at their full size."""
    lines: list[str] = []
    with contextlib.suppress(FileNotFoundError):
        lines += (folder / "progress.jsonl").read_text(errors="replace").splitlines()
    with contextlib.suppress(FileNotFoundError, ValueError, KeyError, TypeError):
        lines += [json.dumps(record) for record in json.loads((folder / "dataset.json").read_text())["shards"]]
    wanted = {shard.name for shard in plan.shards()}
    finished = {}
    for line in lines:
        try:
            record = ShardRecord(**json.loads(line))
        except (ValueError, TypeError):
            continue  # the last line of a killed run may be cut short; its shard is made again
        file = folder / record.name
        if record.name in wanted and file.exists() and file.stat().st_size == record.bytes:
            finished[record.name] = record
    return finished


def _make_missing(
    folder: Path, plan: Plan, finished: Mapping[str, ShardRecord], team: Team, progress: bool
) -> dict[str, ShardRecord]:
    """Make the shards that are not finished, writing down each as it is."""
    missing = [shard for shard in plan.shards() if shard.name not in finished]
    if not missing:
        return {}
    journal = folder / "progress.jsonl"
    write_atomic(journal, b"".join(map(_line, finished.values())))
    (folder / "dataset.json").unlink(missing_ok=True)
    before = plan.num_samples - sum(shard.end - shard.first for shard in missing)
    made: dict[str, ShardRecord] = {}
    waiting = iter(missing)
    pending: set[Future[ShardRecord | None]] = set()
    with track("samples", total=plan.num_samples, initial=before, unit="sample", shown=progress) as bar:
        while len(made) < len(missing):
            pending |= {team.submit(make_shard, s) for s in itertools.islice(waiting, 2 * team.workers - len(pending))}
            done, pending = wait(pending, timeout=0.2, return_when=FIRST_COMPLETED)
            records = [record for future in done if (record := future.result())]
            made |= {record.name: record for record in records}
            _append(journal, b"".join(map(_line, records)))
            bar.update(before + team.made.value - bar.n)
    return made


def _line(record: ShardRecord) -> bytes:
    return json.dumps(asdict(record)).encode() + b"\n"


def _append(path: Path, data: bytes) -> None:
    try:
        with path.open("ab") as file:
            file.write(data)
    except OSError as error:
        raise write_error(error, path) from error


def _complete(folder: Path, plan: Plan, begun: Mapping[str, Any], finished: Mapping[str, ShardRecord]) -> None:
    """Write ``dataset.json``, and remove what killed runs and their last workers left."""
    description = {
        **begun,
        "conventions": CONVENTIONS,
        "splits": {split: {"first": first, "end": end} for split, (first, end) in plan.ranges.items()},
        "shards": [asdict(finished[shard.name]) for shard in plan.shards()],
    }
    path, content = folder / "dataset.json", json.dumps(description, indent=1).encode()
    if not path.exists() or path.read_bytes() != content:
        write_atomic(path, content)
    planned = {f"{o.key}.npz" for o in plan.objects}
    for stray in folder.glob("objects/*.npz"):
        if stray.name not in planned:
            stray.unlink()
    (folder / "progress.jsonl").unlink(missing_ok=True)
    _remove_leftovers(folder)
