"""The plan of a dataset: which object, split and random stream each sample index has.

A sample depends on (dataset seed, sample index) and on nothing else: not on the number of workers, the size of
a shard, the order of work or a restart.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from artsim.errors import ConfigError, RenderError
from artsim.objects import ArticulatedObject
from artsim.renderers import Renderer
from artsim.sample import Sample, observe
from artsim.sampling import Scale, StateOptions, ViewOptions, sample_scale, sample_state, sample_view

SPLITS = ("train", "val", "test")
FORMAT = 1

_OBJECTS_AT_ONCE = 16
_VIEWS_IN_A_ROW = 16
_VIEW_ATTEMPTS = 50


@dataclass(frozen=True)
class SampleOptions:
    """What one sample looks like."""

    num_points: int = 2048
    """Points of each cloud."""
    scale: Scale = "native"
    """Size of the object: native (as in its file), unit (diagonal of 1 m), or a range of diagonals in metres."""
    states: StateOptions = field(default_factory=StateOptions)
    views: ViewOptions = field(default_factory=ViewOptions)
    renderer: Literal["raycast", "pybullet", "pybullet-egl", "sapien", "warp"] = "raycast"
    """raycast needs nothing installed; the others need the extra 'pybullet', 'sapien' or 'warp'."""
    images: tuple[Literal["depth", "part_mask", "rgb"], ...] = ()
    """Images to keep beside the cloud; rgb needs sapien or pybullet."""
    noise: Literal["none", "kinect_v1", "d435", "azure", "gaussian3mm"] = "none"
    """Depth sensor whose noise the cloud and the depth image carry; the ground truth never does."""

    def __post_init__(self) -> None:
        if not 1 <= self.num_points <= 1_000_000:
            raise ConfigError(f"clouds of {self.num_points} points are not made", "num_points", "use 1 to 1000000")
        if not isinstance(self.scale, str) and not 0.0 < self.scale[0] <= self.scale[1]:
            raise ConfigError(f"{self.scale} is not a range of diagonals", "scale", "write LOW HIGH in metres")
        if "rgb" in self.images and self.renderer in ("raycast", "warp"):
            raise ConfigError(f"{self.renderer} makes no rgb", "images", "add --renderer sapien or pybullet")

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> SampleOptions:
        """Inverse of ``dataclasses.asdict`` after a trip through JSON."""

        def pair(values: Any) -> Any:
            return None if values is None else (float(values[0]), float(values[1]))

        states, views, scale = data["states"], data["views"], data["scale"]
        ranges = {name: (float(low), float(high)) for name, (low, high) in states["joint_range"].items()}
        return SampleOptions(
            num_points=data["num_points"],
            scale=scale if scale in ("native", "unit") else (float(scale[0]), float(scale[1])),
            states=StateOptions(states["mode"], pair(states["fraction_open"]), ranges),
            views=ViewOptions(**{k: pair(v) if isinstance(v, list) else v for k, v in views.items()}),
            renderer=data["renderer"],
            images=tuple(data["images"]),
            noise=data.get("noise", "none"),  # older plans do not say
        )


def draw_sample(obj: ArticulatedObject, options: SampleOptions, seed: int, index: int, renderer: Renderer) -> Sample:
    """The sample that (seed, index) stands for, of this object.

    Raises
    ------
    RenderError
        When 50 drawn views in a row do not see the object.
    """
    rng = np.random.default_rng([seed, index])
    sized = sample_scale(obj, options.scale, rng)
    for _ in range(_VIEW_ATTEMPTS):
        q = sample_state(sized, options.states, rng)
        camera = sample_view(sized, q, options.views, rng)
        try:
            return observe(
                sized,
                q,
                camera,
                num_points=options.num_points,
                renderer=renderer,
                images=options.images,
                noise=options.noise,
                rng=rng,
                seed=seed,
                index=index,
            )
        except RenderError:
            continue  # out of sight: draw another view
    raise RenderError(
        f"{_VIEW_ATTEMPTS} drawn views in a row do not see the object",
        f"{obj.object_id}, sample {index}",
        "mend the view options",
    )


@dataclass(frozen=True)
class PlannedObject:
    """One object of a dataset.

    Attributes
    ----------
    key : str
        Unique name in the dataset; its file is ``objects/<key>.npz``.
    category, object_id, sha256 : str
        As in :class:`ArticulatedObject`.
    num_parts : int
    source : str
        Where it came from, relative to the folder given.
    source_sha256 : str
        Digest of the source's main file, to tell a changed source at a restart.
    split : str
        One of ``SPLITS``.
    """

    key: str
    category: str
    object_id: str
    sha256: str
    num_parts: int
    source: str
    source_sha256: str
    split: str


@dataclass(frozen=True)
class Plan:
    """A deterministic list of samples.

    Attributes
    ----------
    seed, num_samples, shard_size : int
    fractions : tuple of 3 float
        Share of the objects of each category in train, val and test.
    sample : SampleOptions
    objects : tuple of PlannedObject
    """

    seed: int
    num_samples: int
    shard_size: int
    fractions: tuple[float, float, float]
    sample: SampleOptions
    objects: tuple[PlannedObject, ...]

    @cached_property
    def objects_of(self) -> dict[str, list[PlannedObject]]:
        """Objects of each split, in the plan's order."""
        return {split: [o for o in self.objects if o.split == split] for split in SPLITS}

    @cached_property
    def ranges(self) -> dict[str, tuple[int, int]]:
        """First and end index of each split's samples: shares by the number of objects, together ``num_samples``."""
        ends = np.cumsum([len(self.objects_of[split]) for split in SPLITS])
        ends = np.round(self.num_samples * ends / max(1, len(self.objects))).astype(int)
        starts = [0, *ends[:-1]]
        return {split: (int(s), int(e)) for split, s, e in zip(SPLITS, starts, ends, strict=True)}

    def split_of(self, index: int) -> str:
        """Split that a sample belongs to."""
        for split, (start, end) in self.ranges.items():
            if start <= index < end:
                return split
        raise IndexError(f"sample {index} of {self.num_samples}")

    def object_of(self, index: int) -> PlannedObject:
        """Object that a sample shows: each object of a split gets the same number of samples, give or take one."""
        split = self.split_of(index)
        start, end = self.ranges[split]
        objects = self.objects_of[split]
        return objects[_whose_turn(index - start, len(objects), (end - start) // len(objects))]

    def object_in_split(self, split: str, turn: int) -> PlannedObject:
        """Object at a turn of a split's endless rotation."""
        objects = self.objects_of[split]
        return objects[_whose_turn(turn, len(objects))]

    def shards(self) -> list[Shard]:
        """Every shard, in order."""
        return [
            Shard(f"{split}-{number:06d}.tar", split, first, min(first + self.shard_size, end))
            for split, (start, end) in self.ranges.items()
            for number, first in enumerate(range(start, end, self.shard_size))
        ]

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready description, inverse of :meth:`from_dict`."""
        return {
            "format": FORMAT,
            "seed": self.seed,
            "num_samples": self.num_samples,
            "shard_size": self.shard_size,
            "fractions": list(self.fractions),
            "sample": asdict(self.sample),
            "objects": [asdict(o) for o in self.objects],
        }

    @staticmethod
    def from_dict(data: Mapping[str, Any]) -> Plan:
        """Rebuild a plan from :meth:`to_dict`."""
        train, val, test = data["fractions"]
        return Plan(
            seed=data["seed"],
            num_samples=data["num_samples"],
            shard_size=data["shard_size"],
            fractions=(train, val, test),
            sample=SampleOptions.from_dict(data["sample"]),
            objects=tuple(PlannedObject(**o) for o in data["objects"]),
        )


def _whose_turn(turn: int, objects: int, rounds: int | None = None) -> int:
    """Number of the object at a turn.

    A few objects take turns until each has had several, then the next few: every shard mixes objects, and a worker
    needs only those in memory. After the last of ``rounds`` turns each, every object gets one more, in order.
    """
    lap, left = divmod(turn, objects * _VIEWS_IN_A_ROW)
    in_a_row = _VIEWS_IN_A_ROW if rounds is None else min(_VIEWS_IN_A_ROW, rounds - lap * _VIEWS_IN_A_ROW)
    if left >= objects * in_a_row:
        return left - objects * in_a_row
    first = left // (_OBJECTS_AT_ONCE * in_a_row) * _OBJECTS_AT_ONCE
    return first + (left - first * in_a_row) % min(_OBJECTS_AT_ONCE, objects - first)


def read_plan(folder: Path) -> Plan:
    """The plan that a generation run wrote into its folder."""
    return Plan.from_dict(json.loads((folder / "plan.json").read_text()))


@dataclass(frozen=True)
class Shard:
    """Samples ``first`` to ``end`` (exclusive) in one tar file."""

    name: str
    split: str
    first: int
    end: int


@dataclass(frozen=True)
class ShardRecord:
    """A finished shard: its samples are ``first`` to ``end`` (exclusive)."""

    name: str
    split: str
    first: int
    end: int
    bytes: int
    sha256: str


def assign_splits(objects: Sequence[tuple[str, str]], fractions: tuple[float, float, float], seed: int) -> list[str]:
    """Split of each object: by object, never by view, stratified by category.

    Objects with equal content always share a split, whatever they and their categories are called. Each category has
    at least one object in train, unless its share is 0.

    Parameters
    ----------
    objects : sequence of (category, sha256)
    fractions : 3 float
        Shares of train, val and test; their sum is taken as 1.
    seed : int

    Returns
    -------
    list of str
    """
    check_shares(fractions)
    category_of: dict[str, str] = {}
    for category, sha256 in objects:
        category_of[sha256] = min(category, category_of.get(sha256, category))
    contents: dict[str, list[str]] = defaultdict(list)
    for sha256, category in category_of.items():
        contents[category].append(sha256)
    shares = np.cumsum(fractions) / sum(fractions)
    split_of: dict[str, str] = {}
    for digests in contents.values():
        order = sorted(digests, key=lambda d: hashlib.sha256(f"{seed}:{d}".encode()).hexdigest())
        ends = np.floor(shares * len(order) + 0.5)
        if fractions[0] > 0:
            ends = np.maximum(ends, 1)  # a category of one object can at least be trained on
        for place, digest in enumerate(order):
            split_of[digest] = SPLITS[int(np.searchsorted(ends, place, side="right"))]
    return [split_of[sha256] for _, sha256 in objects]


def check_shares(fractions: tuple[float, float, float]) -> None:
    """Refuse shares of train, val and test that make no sense.

    Raises
    ------
    ConfigError
    """
    if not np.isfinite(fractions).all() or min(fractions) < 0 or sum(fractions) <= 0:
        raise ConfigError(f"{tuple(fractions)} are not shares", "splits", "write three numbers such as 0.8 0.1 0.1")


def unique_keys(objects: Sequence[tuple[str, str, str]]) -> list[str]:
    """A file-safe unique key for each (category, object_id, sha256), also where file names ignore case."""
    names = [re.sub(r"[^A-Za-z0-9_-]+", "_", f"{category}-{object_id}")[:100] for category, object_id, _ in objects]
    count = Counter(name.lower() for name in names)
    return [
        f"{name}-{hashlib.sha256(repr(obj).encode()).hexdigest()[:12]}" if count[name.lower()] > 1 else name
        for name, obj in zip(names, objects, strict=True)
    ]
