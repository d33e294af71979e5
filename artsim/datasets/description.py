"""The two descriptions of a dataset: ``plan.json``, which begins it, and ``dataset.json``, which makes it complete.

Both are untrusted. Each carries a digest of its own content, so that damage is told from intent; ``dataset.json`` holds
all that ``plan.json`` holds, so that the one is restored from the other.
"""

import contextlib
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from typing import Any

from artsim.common.files import MAX_JSON_BYTES, parse_json
from artsim.common.json_records import as_type
from artsim.common.names import printable
from artsim.datasets.plan import FORMAT, Plan, Shard, ShardRecord
from artsim.datasets.problems import Problem, repair_command
from artsim.errors import ConfigError, DatasetError
from artsim.runs.storage import Place, Storage, storage_of

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
_MAX_RECORD = 10_000_000
READERS = 32
"""Requests at once: one to object storage takes some ten milliseconds, of which the machine waits nearly all."""


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


def write_if_other(storage: Storage, name: str, data: bytes) -> bool:
    """Write a file unless it holds just that; whether it was written."""
    if storage.sizes().get(name) == len(data) and storage.read(name, len(data)) == data:
        return False
    storage.write(name, data)
    return True


def read_plan(place: Place) -> Plan:
    """The plan that a generation run wrote into its folder."""
    storage = storage_of(place)
    return _plan(_document(storage, PLAN), storage, PLAN)


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
            else "name a folder that artsim generate wrote",
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
    """What the descriptions of a dataset say."""

    document: dict[str, Any]
    """What ``plan.json`` has to hold."""
    plan: Plan
    records: tuple[ShardRecord, ...] = ()
    """Those of ``dataset.json``, if it is sound."""
    complete: bool = False
    """Whether ``dataset.json`` is sound: then it says what every shard has to be."""
    problems: tuple[Problem, ...] = ()
    """Of the descriptions themselves."""


def read_started(place: Place) -> StartedDataset | None:
    """What is known of the dataset at a place; None when nothing is.

    Raises
    ------
    DatasetError
        When every description that there is is damaged.
    """
    storage = storage_of(place)
    fix, files, errors = repair_command(storage.place), storage.sizes(), dict[str, DatasetError]()
    described = begun = None
    try:
        described = read_description(storage) if DESCRIPTION in files else None
    except DatasetError as error:
        errors[DESCRIPTION] = error
    try:
        begun = plan_part(_document(storage, PLAN)) if PLAN in files else None
        plan = None if begun is None else _plan(begun, storage, PLAN)
    except DatasetError as error:
        errors[PLAN], begun = error, None
    problems = [Problem(name, error.what.removeprefix(f"{name} "), fix) for name, error in errors.items()]
    if described is not None:
        plan, records, document = described
        wanted = plan_part(document)
        if not problems and begun != wanted:
            what = "is missing" if begun is None else f"is not the plan of {DESCRIPTION}"
            problems.append(Problem(PLAN, what, fix))
        return StartedDataset(wanted, plan, tuple(records), True, tuple(problems))
    if begun is not None and plan is not None:
        return StartedDataset(begun, plan, problems=tuple(problems))
    if errors:
        raise next(iter(errors.values()))
    return None


def finished_shards(storage: Storage, shards: Iterable[Shard], parts: str) -> Iterator[ShardRecord]:
    """Shards of a dataset that is not complete which are said to be finished, the latest word last.

    Records say so, and a description that is damaged or that of a smaller dataset. Their recipes tell whether they are
    those of the plan.
    """
    entries, recorded = list[Any](), storage.sizes(f"{parts}/shards")
    for name in (DESCRIPTION, f"{parts}/{DESCRIPTION}"):
        with contextlib.suppress(DatasetError, ValueError, KeyError, TypeError, IndexError):  # or nothing is left of it
            listed = parse_json(storage.read(name, MAX_JSON_BYTES))["shards"]
            entries += listed if isinstance(listed, list) else []

    def read(shard: Shard) -> Any:
        with contextlib.suppress(ValueError):
            return parse_json(storage.read(f"{parts}/shards/{shard.name}.json", _MAX_RECORD))

    with ThreadPoolExecutor(READERS) as pool:
        entries += pool.map(read, [shard for shard in shards if f"{shard.name}.json" in recorded])
    for entry in entries:
        with contextlib.suppress(ValueError, KeyError):
            yield ShardRecord.from_dict(entry)
