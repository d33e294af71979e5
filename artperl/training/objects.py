"""The objects that a run learns from, and the base of references that it makes of them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from artperl.data.categories import objects_of
from artperl.data.sources import DataOptions
from artperl.evaluation.artimage import real_train_objects
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.options import TrainOptions
from artperl.training.split import Split
from artsim.errors import ConfigError
from artsim.loading.sources import find_sources
from artsim.model.objects import ArticulatedObject

BASE_SEEDS = 2_000_000
"""Seed of the first object of a base: neither in streams nor in test sets."""


@dataclass(frozen=True, eq=False)
class TrainingObjects:
    """Objects of a run."""

    procedural: list[ArticulatedObject]
    """References of procedural families; training clouds show others."""
    given: Split
    """Objects of files, or real ones; training clouds show the same as references."""
    base: ShapeBase
    """Of all of them."""
    data: DataOptions
    """What training clouds show."""

    @classmethod
    def of(cls, options: TrainOptions) -> TrainingObjects:
        """The objects that the options name.

        Raises
        ------
        ConfigError
            When a category is unknown, or an object has too many parts.
        DatasetError
            When the dataset has no sample to learn from.
        """
        procedural = objects_of(options.categories, options.base_objects, BASE_SEEDS, options.parts, options.max_parts)
        given = _given_objects(options)
        base = _base_of([*procedural, *given.train], options)
        data = DataOptions(
            options.categories, options.parts, given.train, options.dataset, options.sample, options.stretched,
            options.noisy, options.degraded,
        )  # fmt: skip
        if options.dataset is not None:  # a dataset that does not fit is an error before anything is learnt
            points = options.num_points * (options.denser if options.dense_steps else 1)
            data.source(base.shapes.trees.num_rows, points, options.seed, 1)
        return cls(procedural, given, base, data)

    @property
    def num_rows(self) -> int:
        """Rows for parts."""
        return self.base.shapes.trees.num_rows

    @property
    def mixed(self) -> bool:
        """Whether there are both procedural objects and given ones."""
        return bool(self.procedural and self.given.train)

    def base_without_given(self, options: TrainOptions) -> ShapeBase:
        """The base of the procedural objects alone, where there are any."""
        return _base_of(self.procedural, options) if self.mixed else self.base


def _base_of(objects: list[ArticulatedObject], options: TrainOptions) -> ShapeBase:
    rows = options.max_parts if options.objects else None
    return by_boxes(ShapeBase.of(objects, options.reference_points, rows))


def _given_objects(options: TrainOptions) -> Split:
    if options.real:
        real = real_train_objects(options.categories)
        return Split(real, real, real, {})
    roots = {name: Path(folder) for name, folder in options.package_roots}
    split = Split.of(find_sources(options.objects, roots), options.parts, options.name)
    for obj in {id(obj): obj for obj in (*split.train, *split.val, *split.test)}.values():
        if options.max_parts is not None and len(obj) > options.max_parts:
            raise ConfigError(
                f"{obj.object_id} has {len(obj)} parts, more than {options.max_parts}", obj.source,
                "use another preset, or lock joints",
            )  # fmt: skip
    return split
