"""Runs of ``artsim generate-objects``: many procedural objects as files, on local processes, resumably.

Each object has a folder of its own, ``<category>/<seed>``, which is made under another name and renamed once it is
whole. ``index.csv``, written last, lists all objects of the run.
"""

import csv
import io
import time
from collections.abc import Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from artsim.common.files import write_atomic
from artsim.common.progress import track
from artsim.errors import AssetError, ConfigError
from artsim.export import DEFAULTS, check_formats, export
from artsim.export.folders import new_folder, remove_unfinished, whole_meta
from artsim.export.options import ExportOptions
from artsim.families.constraints import NO_CONSTRAINTS, Constraints
from artsim.loading.sources import FamilySource, family_sources
from artsim.runs.lock import folder_lock
from artsim.runs.pool import WorkerPool, results
from artsim.runs.recipe import check_counts, check_seed
from artsim.runs.tasks import RunResult

INDEX = "index.csv"
_COLUMNS = ("folder", "category", "object_id", "parts", "joints", "free_joints", "mass_kg", "size_m", "sha256")


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
) -> RunResult:
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
    wanted = family_sources(categories, count, seed, constraints)
    if not wanted:
        raise ConfigError("there is no category to make", "category", "name one, such as drawer")
    check_counts(workers=workers)
    check_seed(seed)
    check_formats(formats)
    folder = Path(out)
    with folder_lock(folder):
        remove_unfinished(folder)
        found = {source: meta for source in wanted if (meta := _whole(folder, source, formats, options))}
        missing = [source for source in wanted if source not in found]
        with (
            track("objects", total=len(wanted), initial=len(found), unit="object", shown=progress) as bar,
            WorkerPool(workers) as team,
        ):
            tasks = ((source, (folder, source, tuple(formats), options)) for source in missing)
            for source, meta in results(team.run(write_object, tasks), folder):
                found[source] = meta
                bar.update()
        file = io.StringIO()
        rows = [_COLUMNS, *(_row(source, found[source]) for source in wanted)]
        csv.writer(file, lineterminator="\n").writerows(rows)
        write_atomic(folder / INDEX, file.getvalue().encode())
    return RunResult(folder, len(wanted), len(missing), time.perf_counter() - start)


def _whole(out: Path, source: FamilySource, formats: Sequence[str], options: ExportOptions) -> dict[str, Any] | None:
    """Content of an object's ``meta.json`` if this version of artsim wrote it so in these formats."""

    def is_same(meta: dict[str, Any]) -> bool:
        _row(source, meta)  # what index.csv takes from it
        same = meta["artsim"]["version"] == version("artsim")
        return (
            same
            and meta.get("constraints", "") == str(source.constraints)
            and asdict(options).items() <= meta["artsim"].items()
        )

    return whole_meta(out / source.category / str(source.seed), formats, is_same)


def write_object(out: Path, source: FamilySource, formats: tuple[str, ...], options: ExportOptions) -> dict[str, Any]:
    """Make an object and write its folder; returns the content of its ``meta.json``."""
    try:
        obj = source.load()
    except ConfigError:
        raise
    except Exception as error:  # whatever a family stumbles on, the seed is what one needs to know
        where = f"{source.category} {source.seed}"
        raise AssetError(f"cannot be made ({type(error).__name__}: {error})", where) from error
    notes = {"constraints": str(source.constraints)} if source.constraints else {}
    with new_folder(out / source.category / str(source.seed)) as folder:
        return export(obj, folder, formats, notes, options)


def _row(source: FamilySource, meta: dict[str, Any]) -> list[Any]:
    """What stands in the index of one object; KeyError, ValueError or TypeError where its ``meta.json`` is damaged."""
    own = meta["artsim"]
    size = " ".join(f"{side:.6g}" for side in own["size_m"])
    return [
        f"{source.category}/{source.seed}", meta["model_cat"], meta["anno_id"], " ".join(own["parts"]),
        " ".join(own["joints"]), own["free_joints"], f"{own['mass_kg']:.6g}", size, own["sha256"],
    ]  # fmt: skip
