"""On-line training data: fresh procedural objects for ever, nothing on disk."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np

from artsim.common.sequences import listed
from artsim.common.sharding import Shared
from artsim.datasets.padding import PaddedStream
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.errors import ConfigError
from artsim.families import assembly_of
from artsim.loading.sources import family_sources
from artsim.making.assembly import Assembly
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.renderers import Renderer, make_renderer

__all__ = ["FamilyStream"]

STREAM_SEEDS = (1 << 31, 1 << 32)
"""Seeds of a stream's objects: none that a person would choose for a test set."""


class FamilyStream(Shared):
    """Endless source of samples of objects that have never been seen before.

    Object ``n`` is drawn from (seed, n) and is of category ``n`` modulo the number of categories; sample ``i`` shows
    object ``i // views_per_object`` and is always the same. Iterating yields all samples of the objects ``start``,
    ``start + step``, ... Workers of a torch ``DataLoader``, and processes of its process group, share the objects out
    by themselves; other processes need a ``start`` of their own and a common ``step``.

    Parameters
    ----------
    categories : sequence of str
        One that is named twice comes twice as often.
    options : SampleOptions, optional
    seed : int
    views_per_object : int
    start, step : int

    Raises
    ------
    ConfigError
        When a category is unknown, or a number makes no sense.
    """

    def __init__(
        self,
        categories: Sequence[str] | str,
        options: SampleOptions | None = None,
        seed: int = 0,
        views_per_object: int = 4,
        start: int = 0,
        step: int = 1,
    ):
        categories = listed(categories)
        if not categories:
            raise ConfigError("a stream needs categories", fix="name at least one")
        if min(seed, start) < 0 or min(views_per_object, step) < 1:
            raise ConfigError(
                f"a stream has no seed {seed}, {views_per_object} views per object, start {start}, step {step}",
                fix="count from 0 upwards; views and step from 1",
            )
        family_sources(categories, 1)  # raises where there is none
        self.categories = categories
        self.options, self.seed = options or SampleOptions(), seed
        self.views_per_object, self.start, self.step = views_per_object, start, step
        self._renderer: Renderer | None = None

    def padded(self, max_parts: int, float32: bool = False) -> PaddedStream:
        """The stream as dictionaries of arrays of one shape, which default collation stacks.

        Parameters
        ----------
        max_parts : int
            Rows of per-part arrays. An object with more parts is an error.
        float32 : bool
            Poses, boxes and joints in single precision, too.
        """
        return PaddedStream(self, max_parts, float32)

    def __getitem__(self, i: int) -> Sample:
        if i < 0:
            raise IndexError(f"sample {i} of an endless stream")
        if self._renderer is None:
            self._renderer = make_renderer(self.options.renderer)
        return draw_sample(self.object(i // self.views_per_object), self.options, self.seed, i, self._renderer)

    def object(self, n: int) -> ArticulatedObject:
        """Object number ``n``, which samples ``n * views_per_object`` and on show."""
        return _loaded(*self._named(n))

    def assembly(self, n: int) -> Assembly:
        """Parts and joints of object number ``n``, in less than half of the time that the object takes.

        Raises
        ------
        AssetError
            When a solid is empty.
        """
        return assembly_of(*self._named(n))

    def __iter__(self) -> Iterator[Sample]:
        share, shares = self._share()
        n = self.start + share * self.step
        while True:
            for view in range(self.views_per_object):
                yield self[n * self.views_per_object + view]
            n += shares * self.step

    def _named(self, n: int) -> tuple[str, int]:
        seed = int(np.random.default_rng([self.seed, n]).integers(*STREAM_SEEDS))
        return self.categories[n % len(self.categories)], seed


@lru_cache(maxsize=16)
def _loaded(category: str, seed: int) -> ArticulatedObject:
    """The last objects used, of all streams of a process."""
    return family_sources([category], 1, seed)[0].load()
