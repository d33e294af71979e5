"""The plan of a new dataset, out of what loading its sources gave; what cannot be used is named."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any

from artsim.datasets.plan import Plan, PlannedObject
from artsim.datasets.splits import assign_splits, showing_order, unique_keys
from artsim.datasets.worker import CompiledSource, RefusedSource
from artsim.errors import AssetError
from artsim.loading.sources import Source
from artsim.renderers.ray_scenes import RAY_LIBRARY

VERSIONS_OF = ("artsim", "numpy", "scipy", "trimesh", RAY_LIBRARY)
"""Packages that the bytes of a dataset follow from, besides its plan."""
_LISTED = 6
"""Reasons that an error gives; the others are counted."""


def plan_document(
    asked: Plan, sources: Sequence[Source], answers: Sequence[CompiledSource | RefusedSource], skip_broken: bool
) -> dict[str, Any]:
    """What loaded sources make of a plan: a function of its arguments alone, so that every machine finds the same.

    Parameters
    ----------
    asked : Plan
        Without objects.
    sources : sequence of Source
    answers : sequence
        What became of each source.
    skip_broken : bool

    Returns
    -------
    dict
        Content of ``plan.json``.

    Raises
    ------
    AssetError
        Naming the sources that cannot be used.
    """
    used: dict[tuple[str, str, str], tuple[Source, CompiledSource]] = {}
    repeated: list[dict[str, str]] = []
    left_out: list[dict[str, str]] = []
    for source, answer in zip(sources, answers, strict=True):
        entry = {"source": source.name, "source_sha256": source.sha256}
        if isinstance(answer, RefusedSource):
            left_out.append({**entry, "why": answer.why})
        elif used.setdefault((answer.category, answer.object_id, answer.identity), (source, answer))[0] is not source:
            repeated.append(entry)  # the same object named twice counts once
    if (left_out and not skip_broken) or not used:
        raise unusable(left_out, len(sources), asked.strict)
    objects = list(planned_objects([source for source, _ in used.values()], [made for _, made in used.values()], asked))
    order = showing_order([(planned.category, planned.split) for planned in objects])
    plan = replace(asked, objects=tuple(objects[n] for n in order)).to_dict()
    versions = {name: version(name) for name in VERSIONS_OF}
    return {**plan, "versions": versions, "left_out": left_out, "repeated": repeated}


def planned_objects(
    sources: Sequence[Source], compiled: Sequence[CompiledSource], asked: Plan
) -> Iterator[PlannedObject]:
    """The objects, each with its key and split."""
    keys = unique_keys([(c.category, c.object_id, c.identity) for c in compiled])
    splits = assign_splits([(c.category, c.identity) for c in compiled], asked.fractions, asked.seed)
    for key, split, source, c in zip(keys, splits, sources, compiled, strict=True):
        known = {name: value for name, value in vars(c).items() if name != "identity"}
        yield PlannedObject(key=key, split=split, source=source.name, source_sha256=source.sha256, **known)


def unusable(left_out: Sequence[dict[str, str]], total: int, strict: bool) -> AssetError:
    """The error that names what cannot be used."""
    reasons = [entry["why"] for entry in left_out[:_LISTED]]
    if len(left_out) > _LISTED:
        reasons.append(f"and {len(left_out) - _LISTED} more")
    verb = "do not load, or were repaired (--strict)" if strict else "do not load"
    what = f"{len(left_out)} of {total} objects {verb}: {'; '.join(reasons)}"
    return AssetError(what, fix="correct them, or leave them out with --skip-broken")
