"""Datasets in words, on one screen: what one holds, and what was repaired on the way to it."""

import re
import shlex
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from artsim.common.names import printable
from artsim.common.tables import first_of
from artsim.datasets.plan import FORMAT, Plan, PlannedObject, ShardRecord
from artsim.datasets.splits import SPLITS

_CATEGORIES_SHOWN = 12
_KINDS_SHOWN = 12
_NAMES_SHOWN = 8


_SAMPLE_BYTES, _POINT_BYTES = 7000, 25
"""Of a sample in a shard: its records, and each point."""
_PIXEL_BYTES = {"depth": 4.0, "part_mask": 0.03, "rgb": 1.0}
"""Of each image: depth is not compressed, the others are PNG."""


def expected_line(plan: Plan) -> str:
    """How many samples of how many objects a dataset is to have in each split, and what disk they take."""
    options, views = plan.sample, plan.sample.views
    pixels = views.width * views.height * sum(_PIXEL_BYTES[image] for image in options.images)
    size = plan.num_samples * (_SAMPLE_BYTES + _POINT_BYTES * options.num_points + pixels)
    splits = ", ".join(f"{name} {plan.sizes[name]} of {len(plan.objects_of[name])}" for name in SPLITS)
    return f"{plan.num_samples} samples of {len(plan.objects)} objects ({splits}): about {size / 1e6:.2g} MB of disk"


def summary(
    place: str, plan: Plan, shards: Sequence[ShardRecord], description: Mapping[str, Any], split: str | None
) -> str:
    """Samples of each split, categories, options, versions and repairs of a dataset.

    Parameters
    ----------
    place : str
        Folder or URL.
    plan : Plan
    shards : sequence of ShardRecord
    description : mapping
        Content of ``dataset.json``.
    split : str or None
        The split that was opened.
    """
    options, views, states = plan.sample, plan.sample.views, plan.sample.states
    counts = Counter(planned.category for planned in plan.objects).most_common()
    categories = first_of([f"{category} {count}" for category, count in counts], _CATEGORIES_SHOWN)
    size = sum(record.bytes for record in shards) / 1e6
    chosen = "" if split is None else f", split {split}"
    lines = [
        f"{place}{chosen}: {sum(map(len, shards))} samples in {len(shards)} shards, {size:.4g} MB",
        "samples     " + ", ".join(f"{name} {plan.sizes[name]}" for name in SPLITS),
        "objects     " + ", ".join(f"{name} {len(plan.objects_of[name])}" for name in SPLITS),
        f"categories  {categories}",
        f"sample      {options.num_points} points, {options.renderer}, noise {options.noise}, "
        f"images {' '.join(options.images) or 'none'}, scale {_value(options.scale)}",
        f"views       {views.custom or views.preset}, {views.width}x{views.height}, field of view {views.fov:g} deg",
        f"states      {states.mode if states.fraction_open is None else f'open by {_value(states.fraction_open)}'}"
        + "".join(f", {name} {_value(bounds)}" for name, bounds in list(states.joint_range.items())[:4]),
        f"made by     artsim {plan.artsim_version}, seed {plan.seed}, format {FORMAT}",
    ]
    versions = description.get("versions")
    if isinstance(versions, dict):
        lines[-1] += "".join(f", {name} {value}" for name, value in versions.items() if name != "artsim")
    lines += object_lines(place, plan.objects, 3)
    left_out = len(description["left_out"])
    if left_out:
        lines.append(f"{left_out} sources were left out (see left_out in {place}/dataset.json)")
    return "\n".join(printable(line, 240) for line in lines)


def _value(value: Any) -> str:
    return value if isinstance(value, str) else " to ".join(f"{v:g}" for v in value)


def object_lines(place: str, objects: Sequence[PlannedObject], kinds: int = _KINDS_SHOWN) -> list[str]:
    """What there is to know about the objects: those that cannot move, and those that were repaired.

    Parameters
    ----------
    place : str
        Of the dataset.
    objects : sequence of PlannedObject
    kinds : int
        How many kinds of repairs are listed at most.
    """
    rigid = [planned.source for planned in objects if planned.rigid]
    verb = "object has" if len(rigid) == 1 else "objects have"
    lines = [f"{len(rigid)} {verb} no moving joint: {first_of(rigid, _NAMES_SHOWN)}"] if rigid else []
    return [*lines, *_repair_lines(place, objects, kinds)]


def _repair_lines(place: str, objects: Sequence[PlannedObject], shown: int) -> Iterator[str]:
    repaired = [planned for planned in objects if planned.repairs]
    if not repaired:
        return
    yield f"{len(repaired)} of {len(objects)} objects repaired while loading, most often:"
    found: dict[str, list[tuple[PlannedObject, str]]] = defaultdict(list)
    for planned in repaired:
        for kind, text in {_kind(where, what): f"{where}: {what}" for where, what in planned.repairs}.items():
            found[kind].append((planned, text))
    ranked = sorted(found.values(), key=len, reverse=True)
    for alike in ranked[:shown]:
        planned, text = alike[0]
        yield f"  {len(alike)} x  {printable(text, 200)}  ({printable(planned.source, 60)})"
    if len(ranked) > shown:
        yield f"  and {len(ranked) - shown} more kinds"
    yield f"details: artsim inspect {shlex.quote(f'{place}/{ranked[0][0][0].file}')}"


def _kind(where: str, what: str) -> str:
    """A repair without the names and numbers that differ from object to object."""
    text = re.sub(r"'[^']*'|\"[^\"]*\"", "'..'", f"{where}: {what}")
    return re.sub(r"-?\d+(\.\d+)?(e[+-]?\d+)?", "#", text)
