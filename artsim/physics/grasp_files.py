"""Grasps of many objects as files, on several processes, resumably: ``artsim grasps``.

Each object has ``NAME.json`` and ``NAME.npz``, of its category and id. The arrays are ``T_part_grasp`` (G, 4, 4),
``part`` (G,), ``width`` (G,) and ``opened`` (G,), as in :class:`artsim.physics.grasps.Grasps`; the JSON file has the
same by part.
"""

import io
import json
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from artsim.common.files import read_json, write_atomic
from artsim.common.names import safe_name
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError
from artsim.export.loaded import prepare
from artsim.loading.sources import FamilySource, Source
from artsim.physics.grasps import Gripper, find_grasps, grasp_record
from artsim.runs.each import each
from artsim.runs.lock import folder_lock

_MAX_BYTES = 64_000_000


@dataclass(frozen=True)
class GraspFiles:
    """What a run did."""

    objects: int
    made: int
    """All, and those that were not there yet."""
    parts: int
    graspable: int
    grasped: int
    """Movable parts; those with room for a hand; those of which a grasp was proved."""
    grasps: int
    failed: tuple[str, ...]
    """Objects that could not be made, and why."""


def write_grasps(
    sources: Sequence[Source], out: Path, count: int = 16, seed: int = 0, workers: int = 2, progress: bool = True
) -> GraspFiles:
    """Find and write grasps of objects, or resume a run that was stopped.

    Parameters
    ----------
    sources : sequence of Source
    out : path
        Folder; made if missing.
    count : int
        Of each part, at most.
    seed : int
    workers : int
        Processes. The result does not depend on it.
    progress : bool

    Raises
    ------
    ConfigError
        When an option makes no sense, MuJoCo is not installed, or the folder cannot be written to.
    """
    if not sources:
        raise ConfigError("there are no objects", fix="name files, or a category")
    if not 1 <= count <= 1000:
        raise ConfigError(f"{count} grasps of a part are not 1 to 1000", "per-part", "use 16")
    records, failed, made = list[dict[str, Any]](), list[str](), 0
    with folder_lock(out):
        tasks = [(source, out, count, seed) for source in sources]
        results = each(_worker, tasks, workers)
        for record, error, new in track("grasps", results, total=len(tasks), unit="object", shown=progress):
            made += new
            failed += [error] if error else []
            records += [record] if record else []
    tried = [number for record in records for number in record["tried"].values()]
    kept = [len(grasps) for record in records for grasps in record["parts"].values()]
    return GraspFiles(
        len(sources), made, len(tried), sum(number > 0 for number in tried), sum(number > 0 for number in kept),
        sum(kept), tuple(failed),
    )  # fmt: skip


def _worker() -> Callable[[tuple[Source, Path, int, int]], tuple[dict[str, Any] | None, str, bool]]:
    return _write


def _write(task: tuple[Source, Path, int, int]) -> tuple[dict[str, Any] | None, str, bool]:
    """The record of one object, or why there is none, and whether it is new."""
    source, out, count, seed = task
    try:
        obj = source.load()
        name = safe_name(f"{obj.category}_{obj.object_id}")
        asked = {"artsim_version": version("artsim"), "count": count, "seed": seed, "sha256": obj.sha256}
        path = out / f"{name}.json"
        if path.is_file():
            found = read_json(path, "a file of grasps", ConfigError, _MAX_BYTES)
            if isinstance(found, dict) and all(found.get(key) == value for key, value in asked.items()):
                return found, "", False
        if not isinstance(source, FamilySource):
            obj = prepare(obj, progress=False)
        gripper = Gripper()
        grasps = find_grasps(obj, np.random.default_rng([seed, zlib.crc32(name.encode())]), count, gripper)
    except ConfigError:  # concerns the run, not this object
        raise
    except ArtsimError as error:
        return None, str(error), True
    record = {**asked, **grasp_record(obj, grasps, gripper)}
    arrays = io.BytesIO()
    np.savez(
        arrays, T_part_grasp=grasps.T_part_grasp, part=grasps.part, width=grasps.width, opened=grasps.opened
    )  # fmt: skip
    write_atomic(out / f"{name}.npz", arrays.getvalue())
    write_atomic(path, (json.dumps(record, indent=1) + "\n").encode())
    return record, "", True
