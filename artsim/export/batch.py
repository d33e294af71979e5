"""Runs of ``artsim generate-objects``: many procedural objects as files, on local processes, resumably.

Each object has a folder of its own, ``<category>/<seed>``, which is made under another name and renamed once it is
whole. ``index.csv``, written last, lists all objects of the run.
"""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from artsim.common.files import write_atomic
from artsim.common.progress import track
from artsim.errors import AssetError, ConfigError
from artsim.export import DEFAULTS, check_formats, export
from artsim.export.folders import new_folder, remove_unfinished, whole_meta
from artsim.export.options import ExportOptions
from artsim.families import FAMILIES, make_constrained
from artsim.families.constraints import NO_CONSTRAINTS, Constraints
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerPool, results
from artsim.runs.recipe import check_counts, check_seed

INDEX = "index.csv"
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
    """Write procedural objects as files, or resume a run that was stopped.

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
        remove_unfinished(folder)
        found = {key: meta for key in wanted if (meta := _whole(folder, key, formats, constraints, options))}
        missing = [key for key in wanted if key not in found]
        with (
            track("objects", total=len(wanted), initial=len(found), unit="object", shown=progress) as bar,
            WorkerPool(workers) as team,
        ):
            tasks = ((key, (folder, *key, tuple(formats), constraints, options)) for key in missing)
            for key, meta in results(team.run(write_object, tasks), folder):
                found[key] = meta
                bar.update()
        write_atomic(folder / INDEX, _index_text([(key, found[key]) for key in wanted]).encode())
    return ObjectsResult(folder, len(wanted), len(missing), time.perf_counter() - start)


def _check_options(categories: Sequence[str], count: int, seed: int, workers: int) -> None:
    unknown = [category for category in categories if category not in FAMILIES]
    if unknown or not categories:
        known = ", ".join(sorted(FAMILIES))
        raise ConfigError(f"there is no category {', '.join(map(repr, unknown))}", "category", f"use some of {known}")
    check_counts(count=count, workers=workers)
    check_seed(seed)


def _whole(
    out: Path, key: tuple[str, int], formats: Sequence[str], constraints: Constraints, options: ExportOptions
) -> dict[str, Any] | None:
    """Content of an object's ``meta.json`` if this version of artsim wrote it so in these formats."""

    def is_same(meta: dict[str, Any]) -> bool:
        _row(key, meta)  # what index.csv takes from it
        same = meta["artsim"]["version"] == version("artsim") and meta.get("constraints", "") == str(constraints)
        return same and asdict(options).items() <= meta["artsim"].items()

    return whole_meta(out / key[0] / str(key[1]), formats, is_same)


def write_object(
    out: Path, category: str, seed: int, formats: tuple[str, ...], constraints: Constraints, options: ExportOptions
) -> dict[str, Any]:
    """Make an object and write its folder; returns the content of its ``meta.json``."""
    try:
        obj = make_constrained(category, seed, constraints)
    except ConfigError:
        raise
    except Exception as error:  # whatever a family stumbles on, the seed is what one needs to know
        raise AssetError(f"cannot be made ({type(error).__name__}: {error})", f"{category} {seed}") from error
    notes = {"constraints": str(constraints)} if constraints else {}
    with new_folder(out / category / str(seed)) as folder:
        return export(obj, folder, formats, notes, options)


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
