"""The objects of a new dataset and the plan that they make: every source is loaded once, and kept compiled.

``<digest>.npz`` is an object, ``<block>.json`` the record of some sources: a stopped run loads what has no record.
"""

from __future__ import annotations

import hashlib
import json
import re
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from typing import Any

from artsim.common.files import parse_json
from artsim.common.json_records import from_json_values
from artsim.common.progress import track
from artsim.common.tables import first_of
from artsim.datasets.description import PLAN, READERS
from artsim.datasets.plan import Plan, PlannedObject
from artsim.datasets.splits import assign_splits, showing_order, unique_keys
from artsim.datasets.worker import PARTS, PARTS_OF_ONE, CompiledSource, RefusedSource, compile_source
from artsim.errors import AssetError, ConfigError, DatasetError
from artsim.loading.sources import Source
from artsim.renderers.ray_scenes import RAY_LIBRARY
from artsim.runs.pool import WorkerLost
from artsim.runs.ray_pool import Team
from artsim.runs.storage import Storage

_BLOCK = 16
"""Sources of one record of several machines: of 100,000 objects there are 6,000, which every machine reads."""
_MAX_RECORD = 10_000_000
_PATIENCE = 10.0
"""Seconds, beside those that its own blocks took, that a machine waits for the others' before it prepares them, too."""
_LOOK = 1.0
"""Seconds between two looks at what others have prepared."""

VERSIONS_OF = ("artsim", "numpy", "scipy", "trimesh", RAY_LIBRARY)
"""Packages that the bytes of a dataset follow from, besides its plan."""
_LISTED = 6
"""Reasons that an error gives; the others are counted."""

Answer = CompiledSource | RefusedSource


@dataclass(frozen=True)
class Share:
    """The share of one machine."""

    number: int = 0
    """From 0 on."""
    count: int = 1
    """Of machines."""

    @staticmethod
    def parse(text: str) -> Share:
        """The share that a text such as ``3/8`` names.

        Raises
        ------
        ConfigError
        """
        found = re.fullmatch(r"([0-9]{1,7})/([0-9]{1,7})", text)
        if found is None or not int(found[1]) < int(found[2]):
            raise ConfigError(f"{text!r} is no share", "share", "write 0/8 to 7/8 for eight machines")
        return Share(int(found[1]), int(found[2]))

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    @property
    def marker(self) -> str:
        """File that says that it is done."""
        return f"{PARTS}/{self.number}-of-{self.count}.json"


@dataclass(frozen=True)
class Preparation:
    """Loads the sources of a dataset."""

    storage: Storage
    asked: Plan
    """Without objects."""
    sources: Sequence[Source]
    share: Share | None
    """None: no other machine has a share."""
    team: Team
    skip_broken: bool
    """Leave out what is of no use, instead of stopping."""
    load_limit: float
    """Seconds that an object may take to load."""
    progress: bool

    @property
    def folder(self) -> str:
        """Where prepared objects lie."""
        return f"{PARTS_OF_ONE if self.share is None else PARTS}/objects"

    def document(self) -> dict[str, Any] | None:
        """Content of ``plan.json``; None when another machine wrote it meanwhile.

        Raises
        ------
        AssetError
            Naming the sources that cannot be used; of several machines, each names the first.
        DatasetError
            When objects were prepared with other options.
        """
        share, total, size = self.share or Share(), len(self.sources), _BLOCK if self.share else 1
        blocks = [range(first, min(first + size, total)) for first in range(0, total, size)]
        start, recorded = time.monotonic(), self._recorded()
        if (
            self.share is None
        ):  # no other machine reads them: what is damaged, refused or of other options is done again
            files = self.storage.sizes(self.folder)
            recorded = {
                number for number in recorded & set(range(len(blocks)))
                if all(isinstance(own, CompiledSource) and f"{own.file_sha256}.npz" in files
                       for own in self._read(number, blocks[number]) or [RefusedSource("")])
            }  # fmt: skip
        self._prepare(blocks, [own for own in range(len(blocks))[share.number :: share.count] if own not in recorded])
        patience = _PATIENCE + time.monotonic() - start
        most, since = -1, time.monotonic()
        while missing := sorted(set(range(len(blocks))) - self._recorded()):
            if PLAN in self.storage.sizes():
                return None
            now = time.monotonic()
            if len(blocks) - len(missing) > most:
                most, since = len(blocks) - len(missing), now
            if now > since + patience:  # whoever had these is late, or gone
                first = len(missing) * share.number // share.count  # others begin elsewhere
                self._prepare(blocks, [*missing[first:], *missing[:first]])
            else:
                time.sleep(_LOOK)
        return self._document(blocks)

    def _document(self, blocks: Sequence[range]) -> dict[str, Any]:
        def known(number: int) -> list[Answer]:
            answers = self._read(number, blocks[number])
            if answers is None:
                raise DatasetError(
                    "its objects were prepared with other options, or a record is damaged",
                    self.storage.place,
                    f"choose another --out, or the options it was begun with, or delete its folder {PARTS}",
                )
            return answers

        with ThreadPoolExecutor(READERS) as pool:
            answers = [answer for block in pool.map(known, range(len(blocks))) for answer in block]
        return plan_document(self.asked, self.sources, answers, self.skip_broken)

    def _recorded(self) -> set[int]:
        """Numbers of the blocks that are recorded."""
        names = self.storage.sizes(self.folder)
        return {int(name[:-5]) for name in names if re.fullmatch(r"[0-9]{6,}\.json", name)}

    def _prepare(self, blocks: Sequence[range], numbers: Sequence[int]) -> None:
        """Load the sources of some blocks, and record each block once all of it is loaded."""
        answers: dict[int, dict[int, Answer]] = {number: {} for number in numbers}
        asked, total = self.asked, sum(len(blocks[number]) for number in numbers)
        tasks = (
            ((number, i), (self.sources[i], self.folder, asked.seed, asked.sample, asked.strict))
            for number in numbers
            for i in blocks[number]
        )
        with track("objects", total=total, unit="object", shown=self.progress and total > 0) as bar:
            for (number, i), answer in self.team.run(compile_source, tasks, self.load_limit):
                if isinstance(answer, WorkerLost):
                    answer = RefusedSource(f"{self.sources[i].name}: {answer.why}")
                if isinstance(answer, RefusedSource) and self.share is not None and not self.skip_broken:
                    why = {"source": self.sources[i].name, "why": answer.why}
                    raise unusable([why], len(self.sources), asked.strict)
                answers[number][i] = answer
                if len(answers[number]) == len(blocks[number]):
                    self._record(number, blocks[number], [answers[number][i] for i in blocks[number]])
                bar.update()

    def _record(self, number: int, block: range, answers: list[Answer]) -> None:
        content = {"recipe": self._recipe(block), "answers": [asdict(answer) for answer in answers]}
        write = self.storage.write_new if self.share else self.storage.write  # of several machines, the first is right
        write(f"{self.folder}/{number:06d}.json", json.dumps(content).encode())

    def _recipe(self, block: range) -> str:
        """Digest of all that the loading of some sources follows from."""
        named = [(source.name, source.sha256) for source in (self.sources[i] for i in block)]
        asked = self.asked
        made_of = [asked.artsim_version, asked.seed, asked.strict, asdict(asked.sample), named]
        return hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()

    def _read(self, number: int, block: range) -> list[Answer] | None:
        """What became of the sources of a block; None where they were prepared with other options."""
        try:
            content = parse_json(self.storage.read(f"{self.folder}/{number:06d}.json", _MAX_RECORD))
            answers = list(map(_answer, content["answers"]))
            return answers if content["recipe"] == self._recipe(block) and len(answers) == len(block) else None
        except (ValueError, KeyError, TypeError):
            return None


def _answer(entry: dict[str, Any]) -> Answer:
    return from_json_values(RefusedSource, entry) if "why" in entry else from_json_values(CompiledSource, entry)


def plan_document(
    asked: Plan, sources: Sequence[Source], answers: Sequence[Answer], skip_broken: bool
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
    reasons = first_of([entry["why"] for entry in left_out], _LISTED, "; ")
    verb = "do not load, or were repaired (--strict)" if strict else "do not load"
    what = f"{len(left_out)} of {total} objects {verb}: {reasons}"
    return AssetError(what, fix="correct them, or leave them out with --skip-broken")
