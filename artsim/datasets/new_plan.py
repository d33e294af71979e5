"""The plan of a new dataset: every source is loaded once, and what cannot be used is named."""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from artsim.common.files import file_sha256, write_error
from artsim.common.json_records import from_json_values
from artsim.common.progress import track
from artsim.datasets.inventory import PREPARED_JOURNAL, STAGED
from artsim.datasets.plan import Plan, PlannedObject
from artsim.datasets.splits import assign_splits, showing_order, unique_keys
from artsim.datasets.versions import VERSIONS_OF
from artsim.datasets.worker import CompiledSource, RefusedSource, compile_source
from artsim.errors import AssetError
from artsim.loading.sources import Source
from artsim.runs.journal import Journal
from artsim.runs.pool import Team, WorkerLost

_LISTED = 6
"""Reasons that an error gives; the others are counted."""


def new_plan(
    folder: Path,
    asked: Plan,
    sources: Sequence[Source],
    team: Team,
    skip_broken: bool,
    load_limit: float,
    progress: bool,
) -> dict[str, Any]:
    """Load every source, keep it compiled in the folder, and describe the dataset that they make.

    What is loaded stays in the folder when the run is stopped: the next one loads what is left.

    Parameters
    ----------
    folder : Path
    asked : Plan
        Without objects.
    sources : sequence of Source
    team : WorkerPool
    skip_broken : bool
        Leave out what is of no use, instead of stopping.
    load_limit : float
        Seconds that an object may take to load.
    progress : bool

    Returns
    -------
    dict
        Content of ``plan.json``.

    Raises
    ------
    AssetError
        Naming the sources that cannot be used.
    """
    staging = folder / "objects"
    try:
        staging.mkdir(exist_ok=True)
    except OSError as error:
        raise write_error(error, staging) from error
    recipes = {f"{STAGED}{i}.npz": preparation(asked, [source]) for i, source in enumerate(sources)}
    names = list(recipes)
    journal = Journal(folder / PREPARED_JOURNAL)
    known = _prepared(folder, journal, recipes)
    journal.start(_entry(recipes, answer) for answer in known.values())
    answers: dict[int, CompiledSource | RefusedSource] = {i: known[n] for i, n in enumerate(names) if n in known}
    tasks = (
        (i, (source, names[i], asked.seed, asked.sample, asked.strict))
        for i, source in enumerate(sources) if i not in answers
    )  # fmt: skip
    with track("objects", total=len(sources), initial=len(answers), unit="object", shown=progress) as bar:
        for i, answer in team.run(compile_source, tasks, load_limit):
            answers[i] = RefusedSource(f"{sources[i].name}: {answer.why}") if isinstance(answer, WorkerLost) else answer
            if isinstance(answer, CompiledSource):
                journal.add(_entry(recipes, answer))
            bar.update()
    document, files = plan_document(asked, sources, [answers[i] for i in range(len(sources))], skip_broken)
    for staged, file in files:
        (staging / staged).replace(folder / file)
    return document


def preparation(asked: Plan, sources: Sequence[Source]) -> str:
    """Digest of all that the loading of some sources follows from."""
    named = [(source.name, source.sha256) for source in sources]
    made_of = [asked.artsim_version, asked.seed, asked.strict, asdict(asked.sample), named]
    return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()


def _entry(recipes: Mapping[str, str], answer: CompiledSource) -> dict[str, Any]:
    """What the journal says of an object that is loaded."""
    return {"recipe": recipes[answer.staged], "answer": asdict(answer)}


def _prepared(folder: Path, journal: Journal, recipes: Mapping[str, str]) -> dict[str, CompiledSource]:
    """Objects that a stopped run has loaded, by their files; damaged lines and files count for nothing."""
    found: dict[str, CompiledSource] = {}
    for entry in journal.lines():
        with contextlib.suppress(ValueError, KeyError, TypeError, OSError):
            answer = from_json_values(CompiledSource, entry["answer"])
            file = folder / "objects" / answer.staged
            if recipes.get(answer.staged) == entry["recipe"] and file_sha256(file) == answer.file_sha256:
                found[answer.staged] = answer
    return found


def plan_document(
    asked: Plan, sources: Sequence[Source], answers: Sequence[CompiledSource | RefusedSource], skip_broken: bool
) -> tuple[dict[str, Any], list[tuple[str, str]]]:
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
    document : dict
        Content of ``plan.json``.
    files : list of (str, str)
        Provisional name of each object's file, and the one that it has to have.

    Raises
    ------
    AssetError
        Naming the sources that cannot be used.
    """
    used, repeated, left_out = _sort_out(sources, answers)
    if (left_out and not skip_broken) or not used:
        raise unusable(left_out, len(sources), asked.strict)
    objects = list(planned_objects([source for source, _ in used], [compiled for _, compiled in used], asked))
    files = [(compiled.staged, planned.file) for planned, (_, compiled) in zip(objects, used, strict=True)]
    order = showing_order([(planned.category, planned.split) for planned in objects])
    plan = replace(asked, objects=tuple(objects[n] for n in order)).to_dict()
    document = {
        **plan,
        "versions": {name: version(name) for name in VERSIONS_OF},
        "left_out": left_out,
        "repeated": repeated,
    }
    return document, files


def _sort_out(
    sources: Sequence[Source], answers: Sequence[CompiledSource | RefusedSource]
) -> tuple[list[tuple[Source, CompiledSource]], list[dict[str, str]], list[dict[str, str]]]:
    """Sources that are used, those that name an object again, and those that are of no use."""
    used: dict[tuple[str, str, str], tuple[Source, CompiledSource]] = {}
    repeated: list[dict[str, str]] = []
    left_out: list[dict[str, str]] = []
    for source, answer in zip(sources, answers, strict=True):
        entry = {"source": source.name, "source_sha256": source.sha256}
        if isinstance(answer, RefusedSource):
            left_out.append({**entry, "why": answer.why})
        elif used.setdefault((answer.category, answer.object_id, answer.identity), (source, answer))[0] is not source:
            repeated.append(entry)  # the same object named twice counts once
    return list(used.values()), repeated, left_out


def planned_objects(
    sources: Sequence[Source], compiled: Sequence[CompiledSource], asked: Plan
) -> Iterator[PlannedObject]:
    """The objects, each with its key and split."""
    keys = unique_keys([(c.category, c.object_id, c.identity) for c in compiled])
    splits = assign_splits([(c.category, c.identity) for c in compiled], asked.fractions, asked.seed)
    for key, split, source, c in zip(keys, splits, sources, compiled, strict=True):
        yield PlannedObject(
            key=key,
            category=c.category,
            object_id=c.object_id,
            sha256=c.sha256,
            num_parts=c.num_parts,
            source=source.name,
            source_sha256=source.sha256,
            split=split,
            file_sha256=c.file_sha256,
            rigid=c.rigid,
            repairs=c.repairs,
        )


def unusable(left_out: Sequence[dict[str, str]], total: int, strict: bool) -> AssetError:
    """The error that names what cannot be used."""
    reasons = [entry["why"] for entry in left_out[:_LISTED]]
    if len(left_out) > _LISTED:
        reasons.append(f"and {len(left_out) - _LISTED} more")
    verb = "do not load, or were repaired (--strict)" if strict else "do not load"
    what = f"{len(left_out)} of {total} objects {verb}: {'; '.join(reasons)}"
    return AssetError(what, fix="mend them, or leave them out with --skip-broken")
