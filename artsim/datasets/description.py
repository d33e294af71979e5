"""The two descriptions of a dataset: ``plan.json``, which begins it, and ``dataset.json``, which makes it complete.

Both are untrusted. Each carries a digest of its own content, so that damage is told from intent; ``dataset.json`` holds
all that ``plan.json`` holds, so that the one is restored from the other.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from artsim.common.files import MAX_JSON_BYTES, parse_json, read_json, write_atomic
from artsim.common.json_records import as_type
from artsim.common.names import printable
from artsim.datasets.plan import FORMAT, Plan, ShardRecord
from artsim.datasets.problems import Problem, repair_command
from artsim.errors import ConfigError, DatasetError
from artsim.runs.journal import JOURNAL, Journal
from artsim.runs.storage import FolderStorage, Place, Storage, storage_of

PLAN, DESCRIPTION = "plan.json", "dataset.json"

CONVENTIONS = (
    "Metres, radians. Camera frame OpenCV (x right, y down, z forward); depth is z-depth, 0 = no return; pixel centres "
    "at +0.5. T_camera_part maps the rest frame, as carried by each part, to the camera. Rest frame: Z up, front "
    "towards -X, origin at the centre of the object's box in its rest state."
)

_PLAN_KEYS = (
    "format", "artsim_version", "seed", "num_samples", "shard_size", "fractions", "strict", "sample", "versions",
    "objects", "left_out", "repeated",
)  # fmt: skip
_MORE_KEYS = ("conventions", "splits", "shards")
_SEAL = "sha256"


def plan_part(document: Mapping[str, Any]) -> dict[str, Any]:
    """What ``plan.json`` holds of a description."""
    return {name: document[name] for name in _PLAN_KEYS if name in document}


def document_bytes(document: Mapping[str, Any]) -> bytes:
    """The file of a description, its own digest included.

    Raises
    ------
    ConfigError
        When it would be too large to be read again.
    """
    content = {name: document[name] for name in (*_PLAN_KEYS, *_MORE_KEYS) if name in document}
    data = json.dumps({**content, _SEAL: _seal(content)}, indent=1).encode()
    if len(data) > MAX_JSON_BYTES:
        raise ConfigError(
            f"a description of {len(data) / 1e6:.0f} MB is over the limit of {MAX_JSON_BYTES / 1e6:.0f} MB",
            fix="make several datasets of fewer objects, or shards of more samples",
        )
    return data


def _seal(content: Mapping[str, Any]) -> str:
    """Digest of a description, whatever the order of its names and the blanks between them."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def full_description(begun: Mapping[str, Any], plan: Plan, records: Sequence[ShardRecord]) -> dict[str, Any]:
    """Content of ``dataset.json``."""
    return {
        **begun,
        "conventions": CONVENTIONS,
        "splits": {split: {"objects": len(plan.objects_of[split]), "samples": n} for split, n in plan.sizes.items()},
        "shards": [asdict(record) for record in records],
    }


def write_if_other(path: Path, data: bytes) -> bool:
    """Write a file unless it holds just that; whether it was written."""
    if path.is_file() and not path.is_symlink() and path.stat().st_size == len(data) and path.read_bytes() == data:
        return False
    write_atomic(path, data)
    return True


def read_plan(place: Place) -> Plan:
    """The plan that a generation run wrote into its folder."""
    storage = storage_of(place)
    return _plan(_document(storage, PLAN), storage, PLAN)


def read_plan_document(storage: Storage) -> dict[str, Any] | None:
    """Content of ``plan.json``; None where there is none.

    Raises
    ------
    DatasetError
        When it is damaged.
    """
    if PLAN not in storage.sizes():
        return None
    document = _document(storage, PLAN)
    _plan(document, storage, PLAN)
    return document


def read_description(place: Place) -> tuple[Plan, list[ShardRecord], dict[str, Any]]:
    """Content of ``dataset.json``: the plan, the shards, and all of it.

    Parameters
    ----------
    place : path, str or Storage
        Folder or URL.

    Raises
    ------
    DatasetError
        When it is missing, damaged or of another format.
    """
    storage = storage_of(place)
    files = storage.sizes()
    if DESCRIPTION not in files:
        begun = PLAN in files
        raise DatasetError(
            "the dataset is not complete" if begun else f"no dataset here (no {DESCRIPTION})",
            storage.place,
            f"run the same generate command again, or {repair_command(storage.place)}: it resumes"
            if begun
            else "name a folder that generate.py wrote",
        )
    document = _document(storage, DESCRIPTION)
    plan = _plan(document, storage, DESCRIPTION)
    try:
        shards = as_type(list, document["shards"], "shards")
        if len(shards) != plan.num_shards:  # compared before the plan's own are listed: a forged plan has any number
            raise ValueError(f"it lists {len(shards)} shards instead of {plan.num_shards}")
        records = [ShardRecord.from_dict(shard) for shard in shards]
        if [record.shard for record in records] != plan.shards():
            raise ValueError("its shards are not those of its plan")
    except (ValueError, KeyError) as error:
        raise _damage_error(storage, DESCRIPTION, error) from error
    return plan, records, document


def _document(storage: Storage, name: str) -> dict[str, Any]:
    """A description whose own digest is right."""
    data = storage.read(name, MAX_JSON_BYTES)
    try:
        document = as_type(dict, parse_json(data), "it")
        if document["format"] != FORMAT:
            raise DatasetError(
                f"format {document['format']!r:.20} is not {FORMAT}",
                f"{storage.place}/{name}",
                "read it with the artsim that wrote it",
            )
        unknown = document.keys() - {*_PLAN_KEYS, *_MORE_KEYS, _SEAL}
        if unknown:
            raise ValueError(f"it has no key {printable(min(unknown), 40)}")
        if document.pop(_SEAL) != _seal(document):
            raise ValueError("it is not as it was written: its own sha256 is another")
    except (ValueError, KeyError) as error:
        raise _damage_error(storage, name, error) from error
    return document


def _plan(document: Mapping[str, Any], storage: Storage, name: str) -> Plan:
    try:
        plan = Plan.from_dict(document)
        for entries in (document["left_out"], document["repeated"]):
            for entry in as_type(list, entries, "sources"):
                for name in ("source", "source_sha256"):
                    as_type(str, as_type(dict, entry, "source")[name], name)
    except (ValueError, KeyError, ConfigError) as error:
        raise _damage_error(storage, name, error) from error
    return plan


def _damage_error(storage: Storage, name: str, error: Exception) -> DatasetError:
    reason = f"{error.args[0]!r:.60} is missing" if isinstance(error, KeyError) else str(error)
    return DatasetError(f"{name} is damaged ({reason})", storage.place, repair_command(storage.place))


@dataclass(frozen=True)
class StartedDataset:
    """What the descriptions in a folder say.

    Attributes
    ----------
    document : dict
        What ``plan.json`` has to hold.
    plan : Plan
    records : tuple of ShardRecord
        Shards that are said to be finished. Of another plan, perhaps: their recipes tell.
    complete : bool
        Whether ``dataset.json`` is sound: then it says what every shard has to be.
    problems : tuple of Problem
        Of the descriptions themselves.
    """

    document: dict[str, Any]
    plan: Plan
    records: tuple[ShardRecord, ...]
    complete: bool
    problems: tuple[Problem, ...]


def read_started(folder: Path) -> StartedDataset | None:
    """What is known of the dataset in a folder; None when nothing is.

    Raises
    ------
    DatasetError
        When every description that there is is damaged.
    """
    fix, problems = repair_command(folder), []
    described = begun = None
    for name in (DESCRIPTION, PLAN):
        if not (folder / name).exists() and not (folder / name).is_symlink():
            continue
        try:
            if name == DESCRIPTION:
                described = read_description(folder)
            else:
                begun = plan_part(_document(FolderStorage(folder), PLAN))
                _plan(begun, FolderStorage(folder), PLAN)
        except DatasetError as error:
            problems.append((name, error))
            if name == PLAN:
                begun = None
    if described is not None:
        plan, records, document = described
        wanted, found = (
            plan_part(document),
            [Problem(name, error.what.removeprefix(f"{name} "), fix) for name, error in problems],
        )
        if begun is None and not found:
            found.append(Problem(PLAN, "is missing", fix))
        elif begun is not None and begun != wanted:
            found.append(Problem(PLAN, f"is not the plan of {DESCRIPTION}", fix))
        return StartedDataset(wanted, plan, tuple(records), True, tuple(found))
    if begun is not None:
        records = _shards_of_journal(folder)
        found = [Problem(name, error.what.removeprefix(f"{name} "), fix) for name, error in problems]
        return StartedDataset(begun, _plan(begun, FolderStorage(folder), PLAN), tuple(records), False, tuple(found))
    if problems:
        raise problems[0][1]
    return None


def _shards_of_journal(folder: Path) -> list[ShardRecord]:
    """Shards that a damaged ``dataset.json`` and the journal of a stopped run speak of."""
    entries: list[Any] = []
    with contextlib.suppress(DatasetError, KeyError, TypeError, IndexError):  # there may be none, or nothing left of it
        shards = read_json(folder / DESCRIPTION, DESCRIPTION, DatasetError)["shards"]
        entries += shards if isinstance(shards, list) else []
    with contextlib.suppress(DatasetError):
        entries += Journal(folder / JOURNAL).lines()
    records = []
    for entry in entries:
        with contextlib.suppress(ValueError, KeyError):
            records.append(ShardRecord.from_dict(entry))
    return records
