"""Runs of ``artsim generate-objects``: many procedural objects as files, on local processes, resumably.

Each object has a folder of its own, ``<category>/<seed>``, which is made under another name and renamed once it is
whole. ``index.csv``, written last, lists all objects of the run.
"""

from __future__ import annotations

import csv
import io
import os
import shutil
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from artsim.common.files import read_json, write_atomic, write_error
from artsim.common.outputs import replace_folder
from artsim.common.progress import track
from artsim.errors import AssetError, ConfigError
from artsim.export import DEFAULTS, FORMATS, check_formats, export
from artsim.export.options import ExportOptions
from artsim.families import FAMILIES, make_constrained
from artsim.families.constraints import NO_CONSTRAINTS, Constraints
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerLost, WorkerPool

INDEX = "index.csv"
_MAX_META = 1_000_000
_COLUMNS = ("folder", "category", "object_id", "parts", "joints", "free_joints", "mass_kg", "size_m", "sha256")


@dataclass(frozen=True)
class ObjectsResult:
    """What a call of :func:`generate_objects` did."""

    folder: Path
    objects: int
    made: int
    seconds: float


def generate_objects(
    categories: Sequence[str],
    out: str | Path,
    count: int = 1000,
    seed: int = 0,
    formats: Sequence[str] = ("urdf",),
    workers: int = 2,
    progress: bool = True,
    constraints: Constraints = NO_CONSTRAINTS,
    options: ExportOptions = DEFAULTS,
) -> ObjectsResult:
    """Write procedural objects as files, or go on with a run that was stopped.

    Parameters
    ----------
    categories : sequence of str
        Keys of ``artsim.families.FAMILIES``.
    out : path
        Folder; made if missing.
    count : int
        Objects of each category.
    seed : int
        Of the first object: the others follow it, so that object n is ``artsim.make(category, seed + n)``.
    formats : sequence of str
        Keys of ``artsim.export.FORMATS``.
    workers : int
        Processes. The result does not depend on it.
    progress : bool
        Show a progress bar.
    constraints : Constraints
        Of :func:`artsim.make`; they hold of every object.
    options : ExportOptions
        How objects stand and are driven.

    Raises
    ------
    AssetError
        When an object cannot be made.
    ConfigError
        When an option makes no sense, or the folder cannot be written to.
    DatasetError
        When another run is writing there.
    KeyboardInterrupt
        On Ctrl-C, after the workers have stopped; the same call resumes.
    """
    start = time.perf_counter()
    _check_options(categories, count, seed, workers)
    check_formats(formats)
    folder = Path(out)
    wanted = [(category, number) for category in dict.fromkeys(categories) for number in range(seed, seed + count)]
    with folder_lock(folder):
        _remove_leftovers(folder)
        found = {key: meta for key in wanted if (meta := _whole(folder, key, formats, constraints, options))}
        missing = [key for key in wanted if key not in found]
        with (
            track("objects", total=len(wanted), initial=len(found), unit="object", shown=progress) as bar,
            WorkerPool(workers) as team,
        ):
            tasks = ((key, (folder, *key, tuple(formats), constraints, options)) for key in missing)
            for key, answer in team.run(write_object, tasks):
                if isinstance(answer, WorkerLost):
                    raise AssetError(answer.why, f"{key[0]} {key[1]}", "use fewer --workers; the same command resumes")
                found[key] = answer
                bar.update()
        write_atomic(folder / INDEX, _index_text([(key, found[key]) for key in wanted]).encode())
    return ObjectsResult(folder, len(wanted), len(missing), time.perf_counter() - start)


def _check_options(categories: Sequence[str], count: int, seed: int, workers: int) -> None:
    unknown = [category for category in categories if category not in FAMILIES]
    if unknown or not categories:
        known = ", ".join(sorted(FAMILIES))
        raise ConfigError(f"there is no category {', '.join(map(repr, unknown))}", "category", f"use some of {known}")
    for name, value in (("count", count), ("workers", workers)):
        if value < 1:
            raise ConfigError(f"{value} is not a count", name, "use 1 or more")
    if seed < 0:
        raise ConfigError(f"{seed} is not a seed", "seed", "use 0 or more")


def _folder(out: Path, category: str, seed: int) -> Path:
    return out / category / str(seed)


def _remove_leftovers(out: Path) -> None:
    """Remove folders that killed runs did not finish."""
    for leftover in out.glob("*/.*.part"):
        shutil.rmtree(leftover, ignore_errors=True)


def _whole(
    out: Path, key: tuple[str, int], formats: Sequence[str], constraints: Constraints, options: ExportOptions
) -> dict[str, Any] | None:
    """Content of an object's ``meta.json`` if this version of artsim wrote it so in these formats.

    A folder is whole if it is there at all.
    """
    folder = _folder(out, *key)
    try:
        meta: dict[str, Any] = read_json(folder / "meta.json", "meta.json", max_bytes=_MAX_META)
        own = meta["artsim"]
        same = own["version"] == version("artsim") and set(own["formats"]) == set(formats)
        same = same and meta.get("constraints", "") == str(constraints)
        same = same and asdict(options).items() <= own.items()
        _row(key, meta)  # what index.csv takes from it
    except (AssetError, ValueError, KeyError, TypeError):
        return None
    return meta if same and all((folder / FORMATS[name]).is_file() for name in formats) else None


def write_object(
    out: Path, category: str, seed: int, formats: tuple[str, ...], constraints: Constraints, options: ExportOptions
) -> dict[str, Any]:
    """Make an object and write its folder; returns the content of its ``meta.json``."""
    folder = _folder(out, category, seed)
    part = folder.with_name(f".{seed}.{os.getpid()}.part")
    try:
        obj = make_constrained(category, seed, constraints)
    except ConfigError:
        raise
    except Exception as error:  # whatever a family stumbles on, the seed is what one needs to know
        raise AssetError(f"cannot be made ({type(error).__name__}: {error})", f"{category} {seed}") from error
    try:
        meta = export(obj, part, formats, {"constraints": str(constraints)} if constraints else {}, options)
        replace_folder(part, folder)  # of another version, or in other formats
    except OSError as error:
        raise write_error(error, folder) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return meta


def _index_text(objects: Sequence[tuple[tuple[str, int], dict[str, Any]]]) -> str:
    """One row for each object."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for key, meta in objects:
        writer.writerow(_row(key, meta))
    return file.getvalue()


def _row(key: tuple[str, int], meta: dict[str, Any]) -> list[Any]:
    """What stands in the index of one object; KeyError, ValueError or TypeError where its ``meta.json`` is damaged."""
    category, seed = key
    own = meta["artsim"]
    return [
        f"{category}/{seed}",
        meta["model_cat"],
        meta["anno_id"],
        " ".join(own["parts"]),
        " ".join(own["joints"]),
        own["free_joints"],
        f"{own['mass_kg']:.6g}",
        " ".join(f"{side:.6g}" for side in own["size_m"]),
        own["sha256"],
    ]
