"""Whether a dataset that was begun is the one that is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from artsim.datasets.plan import Plan
from artsim.errors import DatasetError
from artsim.loading.sources import Source
from artsim.runs.recipe import differences


def check_same_plan(
    place: str, document: Mapping[str, Any], asked: Plan, sources: Sequence[Source], grows: bool = True
) -> None:
    """Refuse to resume a dataset of another plan.

    Parameters
    ----------
    place : str
        Where it lies, for messages.
    document : mapping
        Content of its ``plan.json``.
    asked : Plan
        Without objects.
    sources : sequence of Source
    grows : bool
        Whether more samples may be asked for than it has.

    Raises
    ------
    DatasetError
        Naming the options that differ.
    """
    wanted = asked.to_dict()
    del wanted["objects"]
    if grows and asked.num_samples > document["num_samples"]:
        del wanted["num_samples"]
    differing = [name for name, _, _ in differences(document, wanted)]
    have = {(o["source"], o["source_sha256"]) for name in ("objects", "left_out", "repeated") for o in document[name]}
    if have != {(s.name, s.sha256) for s in sources}:
        differing.append("objects")
    if differing:
        fix = "choose another --out folder, or the options it was begun with (see its plan.json)"
        if differing == ["num_samples"]:
            does = "grows, but does not shrink" if grows else "made by several machines does not grow"
            fix = f"a dataset {does}: choose another --out folder, or {document['num_samples']}"
        raise DatasetError(
            f"the folder holds a dataset of another plan (different: {', '.join(differing)})", place, fix
        )
