"""One dataset by several machines that have nothing in common but its storage: a shared folder, or a URL.

Machine ``i`` of ``n`` prepares every n-th block of objects and makes every n-th shard. No machine leads: the plan is a
function of the prepared objects, so that each finds the same one. Nothing is locked, appended or renamed, for object
storage can do none of it. Until the dataset is merged, its folder ``parts`` holds::

    objects/<block>.json     what became of some sources
    objects/<sha256>.npz     their objects, before the plan names them
    shards/<shard>.json      the record of each finished shard
    <i>-of-<n>.json          that a machine has done its share
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from artsim.common.files import parse_json
from artsim.common.json_records import from_json_values
from artsim.common.progress import track
from artsim.datasets.description import (
    DESCRIPTION,
    PLAN,
    document_bytes,
    plan_part,
    read_description,
    read_plan_document,
)
from artsim.datasets.new_plan import plan_document, preparation, unusable
from artsim.datasets.plan import Plan, Shard, ShardRecord
from artsim.datasets.same_plan import check_same_plan
from artsim.datasets.worker import (
    PARTS,
    PREPARED,
    RECORDS,
    CompiledSource,
    RefusedSource,
    compile_source,
    make_shard,
)
from artsim.errors import ConfigError, DatasetError
from artsim.loading.sources import Source
from artsim.runs.pool import Team, WorkerLost, results
from artsim.runs.storage import Storage

_BLOCK = 16
"""Sources of one record: of 100,000 objects there are 6,000, which every machine reads."""
_READERS = 32
"""Requests at once: one to object storage takes some ten milliseconds, of which the machine waits nearly all."""
_MAX_RECORD = 10_000_000
_PATIENCE = 10.0
"""Seconds, beside those that its own blocks took, that a machine waits for the others' before it prepares them, too."""
_LOOK = 1.0
"""Seconds between two looks at what others have prepared."""

_Answer = CompiledSource | RefusedSource


@dataclass(frozen=True)
class Share:
    """The share of one machine.

    Attributes
    ----------
    number : int
        From 0 on.
    count : int
        Of machines.
    """

    number: int = 0
    count: int = 1

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
class ShareRun:
    """A run of one machine; ``asked`` is the plan without objects."""

    storage: Storage
    asked: Plan
    sources: Sequence[Source]
    share: Share
    team: Team
    skip_broken: bool
    load_limit: float
    progress: bool

    def run(self) -> tuple[Plan, dict[str, Any], int]:
        """Do what is left of the share.

        Returns
        -------
        plan : Plan
        document : dict
            Content of ``plan.json``.
        made : int
            Samples made now.

        Raises
        ------
        AssetError, ConfigError, DatasetError
            As :func:`artsim.datasets.generate.generate`.
        """
        files = self.storage.sizes()
        if DESCRIPTION in files:
            return self._repair(files)
        document = read_plan_document(self.storage)
        if document is None:
            self._refuse_strangers(files)
            document = self._plan()
        check_same_plan(self.storage.place, document, self.asked, self.sources, grows=False)
        plan = Plan.from_dict(document)
        own = plan.shards()[self.share.number :: self.share.count]
        missing = self._unfinished(plan, own, files)
        made = self._make({shard: (shard, None, True) for shard in missing}, sum(map(len, own)))
        self.storage.write(self.share.marker, json.dumps({"shards": len(own)}).encode())
        return plan, document, made

    def _repair(self, files: dict[str, int]) -> tuple[Plan, dict[str, Any], int]:
        """Make shards of a complete dataset again that are not there as they were."""
        plan, records, document = read_description(self.storage)
        check_same_plan(self.storage.place, document, self.asked, self.sources, grows=False)
        lost = [record for record in records if files.get(record.name) != record.bytes]
        return plan, document, self._make({r.shard: (r.shard, r.sha256) for r in lost}, sum(map(len, lost)))

    def _refuse_strangers(self, files: dict[str, int]) -> None:
        found = sorted(name for name in files if not name.startswith("."))
        if found:
            raise DatasetError(
                f"the folder already holds {found[0]!r}", self.storage.place, "choose an empty or new folder"
            )

    @cached_property
    def _blocks(self) -> list[range]:
        total = len(self.sources)
        return [range(first, min(first + _BLOCK, total)) for first in range(0, total, _BLOCK)]

    def _plan(self) -> dict[str, Any]:
        """Write the plan that all prepared objects make, or read the one that another machine has written."""
        if not self._prepare():
            document = read_plan_document(self.storage)
            assert document is not None
            return document
        with ThreadPoolExecutor(_READERS) as pool:
            answers = [answer for block in pool.map(self._answers, range(len(self._blocks))) for answer in block]
        document, _ = plan_document(self.asked, self.sources, answers, self.skip_broken)
        self.storage.write_new(PLAN, document_bytes(document))
        there = read_plan_document(self.storage)
        assert there is not None
        if plan_part(there) != plan_part(document):
            raise DatasetError(
                "another machine makes another plan of the same objects",
                self.storage.place,
                "use one kind of processor, and one version of artsim and its libraries, for all shares",
            )
        return there

    def _prepare(self) -> bool:
        """Have every object prepared; False when another machine wrote the plan meanwhile."""
        start, own = time.monotonic(), range(len(self._blocks))[self.share.number :: self.share.count]
        self._prepare_blocks([number for number in own if number not in self._prepared()])
        patience = _PATIENCE + time.monotonic() - start
        most, since = -1, time.monotonic()
        while True:
            missing = sorted(set(range(len(self._blocks))) - self._prepared())
            if not missing:
                return True
            if PLAN in self.storage.sizes():
                return False
            now = time.monotonic()
            if len(self._blocks) - len(missing) > most:
                most, since = len(self._blocks) - len(missing), now
            if now > since + patience:  # whoever had these is late, or gone
                first = len(missing) * self.share.number // self.share.count  # others begin elsewhere
                self._prepare_blocks([*missing[first:], *missing[:first]])
            else:
                time.sleep(_LOOK)

    def _prepared(self) -> set[int]:
        """Numbers of the blocks that are recorded."""
        names = self.storage.sizes(PREPARED)
        return {int(name[:6]) for name in names if re.fullmatch(r"[0-9]{6}\.json", name)}

    def _prepare_blocks(self, numbers: Sequence[int]) -> None:
        """Load the sources of some blocks, and record each block once all of it is loaded."""
        answers: dict[int, dict[int, _Answer]] = {number: {} for number in numbers}
        tasks = (
            ((number, i), (self.sources[i], None, self.asked.seed, self.asked.sample, self.asked.strict))
            for number in numbers
            for i in self._blocks[number]
        )
        total = sum(len(self._blocks[number]) for number in numbers)
        with track("objects", total=total, unit="object", shown=self.progress and total > 0) as bar:
            for (number, i), answer in self.team.run(compile_source, tasks, self.load_limit):
                if isinstance(answer, WorkerLost):
                    answer = RefusedSource(f"{self.sources[i].name}: {answer.why}")
                if isinstance(answer, RefusedSource) and not self.skip_broken:
                    why = {"source": self.sources[i].name, "why": answer.why}
                    raise unusable([why], len(self.sources), self.asked.strict)
                answers[number][i] = answer
                if len(answers[number]) == len(self._blocks[number]):
                    self._record(number, [answers[number][i] for i in self._blocks[number]])
                bar.update()

    def _record(self, number: int, answers: Sequence[_Answer]) -> None:
        entries = [asdict(answer) for answer in answers]
        content = {"recipe": self._recipe(number), "answers": entries}
        self.storage.write_new(f"{PREPARED}/{number:06d}.json", json.dumps(content).encode())

    def _recipe(self, number: int) -> str:
        return preparation(self.asked, [self.sources[i] for i in self._blocks[number]])

    def _answers(self, number: int) -> list[_Answer]:
        """What became of the sources of a block.

        Raises
        ------
        DatasetError
            When they were prepared with other options, or the record is damaged.
        """
        name = f"{PREPARED}/{number:06d}.json"
        try:
            content = parse_json(self.storage.read(name, _MAX_RECORD))
            same = content["recipe"] == self._recipe(number)
            found: list[_Answer] = [
                from_json_values(RefusedSource, entry) if "why" in entry else from_json_values(CompiledSource, entry)
                for entry in content["answers"]
            ]
        except (ValueError, KeyError, TypeError) as error:
            raise DatasetError(f"{name} is damaged ({error})", self.storage.place, "delete it") from error
        if not same or len(found) != len(self._blocks[number]):
            raise DatasetError(
                "its objects were prepared with other options",
                self.storage.place,
                f"choose another --out, or the options it was begun with, or delete its folder {PARTS}",
            )
        return found

    def _unfinished(self, plan: Plan, shards: Sequence[Shard], files: dict[str, int]) -> list[Shard]:
        """Shards without a record, or of another size than it says."""
        recorded = self.storage.sizes(RECORDS)
        told = [shard for shard in shards if f"{shard.name}.json" in recorded]
        records = read_records(self.storage, plan, told)
        return [shard for shard in shards if (r := records.get(shard.name)) is None or files.get(shard.name) != r.bytes]

    def _make(self, shards: Mapping[Shard, tuple[Any, ...]], total: int) -> int:
        """Make shards; their samples."""
        left, place = sum(map(len, shards)), self.storage.place
        tasks = ((shard.name, arguments) for shard, arguments in shards.items())
        with track("samples", total=total, initial=total - left, unit="sample", shown=self.progress) as bar:
            for name, answer in results(self.team.run(make_shard, tasks, progress=bar.update), place):
                if isinstance(answer, str):
                    raise DatasetError(
                        "made again, it has another checksum: another processor or library made it",
                        f"{place}/{name}",
                        "generate the dataset again, elsewhere",
                    )
        return left


def read_records(storage: Storage, plan: Plan, shards: Sequence[Shard]) -> dict[str, ShardRecord]:
    """Records of finished shards by name; those of another plan, and damaged ones, are left out."""

    def read(shard: Shard) -> ShardRecord | None:
        try:
            record = ShardRecord.from_dict(parse_json(storage.read(f"{RECORDS}/{shard.name}.json", _MAX_RECORD)))
        except (ValueError, KeyError):
            return None
        return record if record.shard == shard and record.recipe == plan.recipe(shard) else None

    with ThreadPoolExecutor(_READERS) as pool:
        return {record.name: record for record in pool.map(read, shards) if record is not None}
