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
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from artsim.common.files import parse_json
from artsim.common.progress import track
from artsim.datasets.description import (
    DESCRIPTION,
    PLAN,
    document_bytes,
    plan_part,
    read_description,
    read_plan_document,
)
from artsim.datasets.plan import Plan, Shard, ShardRecord
from artsim.datasets.preparing import READERS, Preparation, Share
from artsim.datasets.same_plan import check_same_plan
from artsim.datasets.worker import (
    RECORDS,
    make_shard,
)
from artsim.errors import DatasetError
from artsim.runs.pool import results
from artsim.runs.storage import Storage

_MAX_RECORD = 10_000_000


@dataclass(frozen=True)
class ShareRun:
    """A run of one machine, by how it prepares objects."""

    objects: Preparation

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
        files, share = self._storage.sizes(), self.objects.share or Share()
        if DESCRIPTION in files:
            return self._repair(files)
        document = read_plan_document(self._storage)
        if document is None:
            self._refuse_strangers(files)
            document = self._plan()
        self._check(document)
        plan = Plan.from_dict(document)
        own = plan.shards()[share.number :: share.count]
        records = read_records(self._storage, plan, own, files)
        missing = {shard: (shard, None, True) for shard in own if shard.name not in records}
        made = self._make(missing, sum(map(len, own)))
        self._storage.write(share.marker, json.dumps({"shards": len(own)}).encode())
        return plan, document, made

    @property
    def _storage(self) -> Storage:
        return self.objects.storage

    def _check(self, document: Mapping[str, Any]) -> None:
        """Refuse another plan."""
        check_same_plan(self._storage.place, document, self.objects.asked, self.objects.sources, grows=False)

    def _repair(self, files: dict[str, int]) -> tuple[Plan, dict[str, Any], int]:
        """Make shards of a complete dataset again that are not there as they were."""
        plan, records, document = read_description(self._storage)
        self._check(document)
        lost = [record for record in records if files.get(record.name) != record.bytes]
        return plan, document, self._make({r.shard: (r.shard, r.sha256) for r in lost}, sum(map(len, lost)))

    def _refuse_strangers(self, files: dict[str, int]) -> None:
        found = sorted(name for name in files if not name.startswith("."))
        if found:
            raise DatasetError(
                f"the folder already holds {found[0]!r}", self._storage.place, "choose an empty or new folder"
            )

    def _plan(self) -> dict[str, Any]:
        """Write the plan that all prepared objects make, or read the one that another machine has written."""
        document = self.objects.by_several()
        if document is not None:
            self._storage.write_new(PLAN, document_bytes(document))
        there = read_plan_document(self._storage)
        assert there is not None
        if document is not None and plan_part(there) != plan_part(document):
            raise DatasetError(
                "another machine makes another plan of the same objects",
                self._storage.place,
                "use one kind of processor, and one version of artsim and its libraries, for all shares",
            )
        return there

    def _make(self, shards: Mapping[Shard, tuple[Any, ...]], total: int) -> int:
        """Make shards; their samples."""
        left, place = sum(map(len, shards)), self._storage.place
        tasks = ((shard.name, arguments) for shard, arguments in shards.items())
        with track("samples", total=total, initial=total - left, unit="sample", shown=self.objects.progress) as bar:
            for name, answer in results(self.objects.team.run(make_shard, tasks, progress=bar.update), place):
                if isinstance(answer, str):
                    raise DatasetError(
                        "made again, it has another checksum: another processor or library made it",
                        f"{place}/{name}",
                        "generate the dataset again, elsewhere",
                    )
        return left


def read_records(
    storage: Storage, plan: Plan, shards: Sequence[Shard], files: Mapping[str, int]
) -> dict[str, ShardRecord]:
    """Records of finished shards by name, damaged ones and those of another plan or size left out.

    Parameters
    ----------
    storage : Storage
    plan : Plan
    shards : sequence of Shard
    files : mapping
        Sizes of files by name.
    """
    recorded = storage.sizes(RECORDS)

    def read(shard: Shard) -> ShardRecord | None:
        try:
            record = ShardRecord.from_dict(parse_json(storage.read(f"{RECORDS}/{shard.name}.json", _MAX_RECORD)))
        except (ValueError, KeyError):
            return None
        same = record.shard == shard and record.recipe == plan.recipe(shard)
        return record if same and files.get(shard.name) == record.bytes else None

    told = [shard for shard in shards if f"{shard.name}.json" in recorded]
    with ThreadPoolExecutor(READERS) as pool:
        return {record.name: record for record in pool.map(read, told) if record is not None}
