"""The plan of a dataset: which object, split and random stream each sample index has.

Sample ``i`` shows object ``i % len(objects)``, drawn from (dataset seed, ``i``). Nothing else decides on it: not the
number of samples, of workers, the size of a shard, the order of work or a restart. So a dataset can grow.
"""

from __future__ import annotations

import bisect
import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Annotated, Any

from artsim.common.json_records import SHA256, from_json_values
from artsim.datasets.layout import at_place
from artsim.datasets.sample_options import SampleOptions as SampleOptions
from artsim.datasets.sample_options import draw_sample as draw_sample
from artsim.datasets.splits import SPLITS, check_shares
from artsim.model.objects import MAX_PARTS

FORMAT = 2

MAX_SAMPLES = 1_000_000_000
"""Sample keys have nine digits."""

MAX_SHARDS = 1_000_000
"""More files do not fit a folder, nor their list a description."""

_MAX_OBJECTS = 1_000_000

_KEY, _SPLIT = re.compile(r"[A-Za-z0-9_-]{1,128}"), re.compile("|".join(SPLITS))
_DIGEST = re.compile(f"(?:{SHA256.pattern})?")


@dataclass(frozen=True)
class PlannedObject:
    """One object of a dataset."""

    key: Annotated[str, _KEY]
    """Unique name in the dataset; its file is ``objects/<key>.npz``."""
    category: str
    object_id: str
    sha256: str
    """As in :class:`ArticulatedObject`."""
    num_parts: Annotated[int, range(1, MAX_PARTS + 1)]
    source: str
    """Where it came from, relative to the folder given."""
    source_sha256: str
    """Digest of the source's main file, to tell a changed source at a restart."""
    split: Annotated[str, _SPLIT]
    """One of ``SPLITS``."""
    file_sha256: Annotated[str, _DIGEST] = ""
    """Digest of its file."""
    rigid: bool = False
    """Whether no joint can move."""
    repairs: tuple[tuple[str, str], ...] = ()
    """What was mended, assumed or left out while loading."""

    @property
    def file(self) -> str:
        """Name of its file in the dataset's folder."""
        return f"objects/{self.key}.npz"


@dataclass(frozen=True)
class Plan:
    """A deterministic list of samples."""

    seed: Annotated[int, range(2**63)]
    num_samples: Annotated[int, range(1, MAX_SAMPLES + 1)]
    shard_size: Annotated[int, range(1, MAX_SAMPLES + 1)]
    fractions: tuple[float, float, float]
    """Share of the objects of each category in train, val and test."""
    sample: SampleOptions
    objects: Annotated[tuple[PlannedObject, ...], range(1, _MAX_OBJECTS + 1)]
    """In the order in which they are shown: sample ``i`` shows number ``i % len(objects)``."""
    strict: bool = False
    """Whether objects that were repaired while loading are refused."""
    artsim_version: str = ""
    """That makes the samples."""

    @cached_property
    def objects_of(self) -> dict[str, list[PlannedObject]]:
        """Objects of each split, in the plan's order."""
        return {split: [self.objects[n] for n in numbers] for split, numbers in self._numbers.items()}

    @cached_property
    def _numbers(self) -> dict[str, list[int]]:
        """Numbers of the objects of each split."""
        numbers: dict[str, list[int]] = {split: [] for split in SPLITS}
        for n, planned in enumerate(self.objects):
            numbers[planned.split].append(n)
        return numbers

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Samples of each split, together ``num_samples``."""
        rounds, left = divmod(self.num_samples, max(1, len(self.objects)))
        return {split: rounds * len(own) + bisect.bisect_left(own, left) for split, own in self._numbers.items()}

    @property
    def max_parts(self) -> int:
        """Most parts of any object."""
        return max(planned.num_parts for planned in self.objects)

    def object_of(self, index: int) -> PlannedObject:
        """Object that a sample shows: each gets the same number of samples, give or take one."""
        if not 0 <= index < self.num_samples:
            raise IndexError(f"sample {index} of {self.num_samples}")
        return self.objects[index % len(self.objects)]

    def index_at(self, split: str, place: int) -> int:
        """Index of the sample that lies at a place of a split; see :mod:`artsim.datasets.layout`."""
        own, total = self._numbers[split], len(self.objects)
        turn, number = at_place(place, len(own), self.num_samples // total)
        return turn * total + own[number]

    def indices(self, shard: Shard) -> list[int]:
        """Indices of the samples of a shard, in its order."""
        return [self.index_at(shard.split, place) for place in range(shard.first, shard.end)]

    def object_in_split(self, split: str, turn: int) -> PlannedObject:
        """Object at a turn of a split's endless rotation."""
        own = self._numbers[split]
        return self.objects[own[at_place(turn, len(own))[1]]]

    @property
    def num_shards(self) -> int:
        """How many shards there are."""
        return sum(-(-size // self.shard_size) for size in self.sizes.values())

    def shards(self) -> list[Shard]:
        """Every shard, in order."""
        return [
            Shard(f"{split}-{number:06d}.tar", split, first, min(first + self.shard_size, size))
            for split, size in self.sizes.items()
            for number, first in enumerate(range(0, size, self.shard_size))
        ]

    def recipe(self, shard: Shard) -> str:
        """Digest of all that the bytes of a shard follow from: shards of one recipe are equal."""
        text = f"{self._ingredients} {shard.split} {self.indices(shard)}"
        return hashlib.sha256(text.encode()).hexdigest()

    @cached_property
    def _ingredients(self) -> str:
        """Digest of what all shards follow from."""
        made_of = [FORMAT, self.artsim_version, self.seed, asdict(self.sample)]
        objects = [[planned.key, planned.file_sha256] for planned in self.objects]
        return hashlib.sha256(json.dumps([made_of, objects], sort_keys=True).encode()).hexdigest()

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready description, inverse of :meth:`from_dict`."""
        plain: dict[str, Any] = json.loads(json.dumps({"format": FORMAT, **asdict(self)}))
        return plain

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Plan:
        """Rebuild a plan from :meth:`to_dict`, or from a document that holds more than that.

        Raises
        ------
        ValueError, KeyError, ConfigError
            When a value is missing, of another type, or makes no sense.
        """
        plan = from_json_values(cls, data, others=True)
        check_shares(plan.fractions)
        if not plan.objects:
            raise ValueError("it has no objects")
        if len({planned.key.lower() for planned in plan.objects}) < len(plan.objects):
            raise ValueError("two objects have the same key")
        if plan.num_shards > MAX_SHARDS:
            raise ValueError(f"it has {plan.num_shards} shards, over {MAX_SHARDS}")
        return plan


@dataclass(frozen=True)
class Shard:
    """The samples at places ``first`` to ``end`` (exclusive) of a split, in one tar file."""

    name: str
    split: Annotated[str, _SPLIT]
    first: Annotated[int, range(MAX_SAMPLES + 1)]
    end: Annotated[int, range(MAX_SAMPLES + 1)]

    def __len__(self) -> int:
        return self.end - self.first


@dataclass(frozen=True)
class ShardRecord(Shard):
    """A finished shard."""

    bytes: Annotated[int, range(2**63)]
    sha256: Annotated[str, SHA256]
    recipe: Annotated[str, _DIGEST] = ""
    """See :meth:`Plan.recipe`."""

    @property
    def shard(self) -> Shard:
        """What was to be made."""
        return Shard(self.name, self.split, self.first, self.end)

    @staticmethod
    def from_dict(data: object) -> ShardRecord:
        """Inverse of ``dataclasses.asdict`` after a trip through JSON; ValueError where it is none."""
        record = from_json_values(ShardRecord, data)
        if record.first >= record.end:
            raise ValueError(f"a shard goes from {record.first} to {record.end}")
        if not re.fullmatch(rf"{record.split}-[0-9]{{6,9}}\.tar", record.name):
            raise ValueError(f"name is {record.name!r:.80}")
        return record
