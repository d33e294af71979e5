"""Samples by number: of fresh procedural objects, of a dataset, or of given objects.

Of an object that looks the same turned round, the truth that faces the camera is told: see :mod:`artperl.data.facing`.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np

from artperl.core.part_order import reorder_sample, visible_order
from artperl.data.categories import Parts, has_parts, order_parts
from artperl.data.facing import Facing
from artsim.datasets.dataset import open_dataset
from artsim.datasets.family_stream import FamilyStream
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.datasets.sample_options import SensorName
from artsim.errors import AssetError, ConfigError, DatasetError
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.renderers import shared_renderer

_ATTEMPTS = 200


class Samples:
    """Samples of fresh procedural objects by number.

    Another object of the same category takes the place of one that has other parts than are asked for, more than
    ``num_rows`` of them, or that cannot be made: a long run outlives the rare fault of a family, which artsim's audit
    reports.

    Parameters
    ----------
    categories : sequence of str
    options : SampleOptions
    seed : int
    views_per_object : int
    num_rows : int
    parts : Parts
    given : sequence of ArticulatedObject
        Every other object is one of these, if there are any.
    """

    def __init__(
        self,
        categories: Sequence[str],
        options: SampleOptions,
        seed: int,
        views_per_object: int,
        num_rows: int,
        parts: Parts = "artimage",
        given: Sequence[ArticulatedObject] = (),
    ):
        self.stream, self.options = FamilyStream(categories, options, seed, views_per_object), options
        self.num_rows, self.parts, self.given = num_rows, parts, given
        self._facing = Facing()
        self._keep()

    def __getitem__(self, i: int) -> Sample:
        n, view = divmod(i, self.stream.views_per_object)
        index = i if self._is_given(n) else self._right(n) * self.stream.views_per_object + view
        obj, renderer = self.object(i), shared_renderer(self.options.renderer)
        return self._facing(draw_sample(obj, self.options, self.stream.seed, index, renderer), lambda: obj)

    def object(self, i: int) -> ArticulatedObject:
        """The object that sample ``i`` shows."""
        return self._object(i // self.stream.views_per_object)

    def seen_by(self, sensor: SensorName) -> Samples:
        """The same objects, states and views as a depth sensor sees them; each object is made once for both."""
        return _with_noise(self, sensor)

    def _is_given(self, n: int) -> bool:
        return bool(self.given) and n % 2 == 1

    def _find_object(self, n: int) -> ArticulatedObject:
        if self._is_given(n):
            return self.given[int(np.random.default_rng([self.stream.seed, n]).integers(len(self.given)))]
        return order_parts(self.stream.object(self._right(n)), self.parts)

    def _find_right(self, n: int) -> int:
        """Number of the object that stands for object ``n``."""
        category = self.stream.categories[n % len(self.stream.categories)]
        elsewhere = len(self.stream.categories) << 32  # of the same category, and no run gets there
        for attempt in range(_ATTEMPTS):
            number = n + attempt * elsewhere
            try:
                planned = self.stream.assembly(number)
                types = planned.joint_types
                if len(types) <= self.num_rows and has_parts(category, types, planned.joint_axes, self.parts):
                    self.stream.object(number)
                    return number
            except AssetError:
                continue
        raise ConfigError(
            f"{_ATTEMPTS} objects in a row have more than {self.num_rows} parts, or other ones, or cannot be made",
            ", ".join(self.stream.categories),
            "allow more parts, or correct the family",
        )

    def _keep(self) -> None:
        """Begin to remember what was looked up."""
        self._right = lru_cache(maxsize=64)(self._find_right)
        self._object = lru_cache(maxsize=8)(self._find_object)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name not in ("_right", "_object")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._keep()


class Recorded:
    """Samples of a dataset by number: the train split of what ``artsim generate`` wrote, in another order on each pass.

    Parameters
    ----------
    folder : str or Path
    categories : sequence of str
        Of the objects to learn from.
    seed : int
        Of the order.
    num_rows : int
        The most parts that an object may have.
    num_points : int
        The least points that a cloud must have.
    parts : Parts

    Raises
    ------
    DatasetError
        When no sample of the dataset is of these categories and has these parts, or clouds have too few points.
    """

    def __init__(
        self, folder: str | Path, categories: Sequence[str], seed: int, num_rows: int, num_points: int,
        parts: Parts = "artimage",
    ):  # fmt: skip
        self.dataset, self.seed, self.num_rows = open_dataset(folder, "train"), seed, num_rows
        self.categories, self.parts = tuple(categories), parts
        self._usable: list[int] = []
        self._facing = Facing()
        wanted: dict[str, bool] = {}
        for place in range(len(self.dataset)):
            key = self.dataset.object_key(place)
            if key not in wanted:
                wanted[key] = self._is_right(self.dataset[place])
            if wanted[key]:
                self._usable.append(place)
        if not self._usable:
            raise DatasetError(
                f"its train split has no {' or '.join(categories)} with the right parts", folder,
                "generate one with these categories, or use --parts any",
            )  # fmt: skip
        if len(self.dataset[self._usable[0]].points) < num_points:
            raise DatasetError(
                f"its clouds have fewer than {num_points} points", folder,
                "generate larger ones; without dense steps fewer are enough",
            )  # fmt: skip
        self._turn, self._order = -1, np.empty(0, dtype=np.int64)

    def __getitem__(self, i: int) -> Sample:
        turn, place = divmod(i, len(self._usable))
        if turn != self._turn:
            self._turn, self._order = turn, np.random.default_rng([self.seed, turn]).permutation(self._usable)
        sample = self.dataset[int(self._order[place])]
        if self.parts == "any":
            sample = reorder_sample(sample, visible_order(sample.joint_parent, sample.box_center, sample.box_size))
        return self._facing(sample, lambda: self._object_of(sample))

    def object(self, i: int) -> ArticulatedObject:
        """The object that sample ``i`` shows."""
        return self._object_of(self[i])

    def seen_by(self, sensor: SensorName) -> NoReturn:
        """Not possible: clouds of a dataset are as they were seen."""
        raise ConfigError("clouds of a dataset get no other noise", "noisy", "generate a dataset with noise")

    def _object_of(self, sample: Sample) -> ArticulatedObject:
        return order_parts(self.dataset.object_of(sample), self.parts)

    def _is_right(self, sample: Sample) -> bool:
        few_enough = len(sample.joint_type) <= self.num_rows
        return sample.category in self.categories and few_enough and has_parts(
            sample.category, sample.joint_type, sample.joint_axis, self.parts
        )  # fmt: skip


class Given:
    """Samples of a few objects by number: fresh states and views of the same ones for ever.

    Parameters
    ----------
    objects : sequence of ArticulatedObject
    options : SampleOptions
    seed : int
    views_per_object : int
        Samples in a row of the same object.
    num_rows : int
        The most parts that an object has.
    """

    def __init__(
        self, objects: Sequence[ArticulatedObject], options: SampleOptions, seed: int, views_per_object: int,
        num_rows: int,
    ):  # fmt: skip
        self.objects, self.options, self.seed = objects, options, seed
        self.views_per_object, self.num_rows = views_per_object, num_rows
        self._facing = Facing()

    def __getitem__(self, i: int) -> Sample:
        obj = self.object(i)
        sample = draw_sample(obj, self.options, self.seed, i, shared_renderer(self.options.renderer))
        return self._facing(sample, lambda: obj)

    def object(self, i: int) -> ArticulatedObject:
        """The object that sample ``i`` shows."""
        number = i // self.views_per_object
        return self.objects[int(np.random.default_rng([self.seed, number]).integers(len(self.objects)))]

    def seen_by(self, sensor: SensorName) -> Given:
        """The same objects, states and views as a depth sensor sees them."""
        return _with_noise(self, sensor)


S = TypeVar("S", Samples, Given)


def _with_noise(source: S, sensor: SensorName) -> S:
    """A copy that shares what was looked up."""
    other = copy(source)
    other.options = replace(source.options, noise=sensor)
    return other


Source = Samples | Recorded | Given


@dataclass(frozen=True, eq=False)
class DataOptions:
    """What there is to learn from, and how it is seen."""

    categories: Sequence[str] = ()
    """Procedural categories; empty to learn from the given objects alone."""
    parts: Parts = "artimage"
    given: Sequence[ArticulatedObject] = ()
    """Every other object is one of these, if there are any."""
    dataset: str | Path | None = None
    """Folder of a dataset to learn from instead."""
    sample: SampleOptions = field(default_factory=SampleOptions)
    """View preset, noise and the like."""
    stretched: float = 0.0
    """Share of the training clouds whose objects are stretched; see :func:`artperl.data.stretching.stretch`."""
    noisy: float = 0.0
    """Share of the other training clouds that are as a depth sensor sees them, one of
    :data:`artperl.data.batches.SENSORS`."""
    degraded: float = 0.0
    """Share of all training clouds that are cut, dirty or sparse; see :func:`artperl.data.degrading.degrade`."""

    def source(self, num_rows: int, num_points: int, seed: int, views_per_object: int) -> Source:
        """Samples by number.

        Parameters
        ----------
        num_rows : int
            The most parts that an object may have.
        num_points : int
            Points of a cloud; of a dataset, the least number.
        seed : int
        views_per_object : int
            Samples in a row of the same object.

        Raises
        ------
        DatasetError
            When no sample of the dataset fits.
        """
        if self.dataset is not None:
            return Recorded(self.dataset, self.categories, seed, num_rows, num_points, self.parts)
        sample = replace(self.sample, num_points=num_points)
        if not self.categories:
            return Given(self.given, sample, seed, views_per_object, num_rows)
        return Samples(self.categories, sample, seed, views_per_object, num_rows, self.parts, self.given)
