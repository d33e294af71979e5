"""On-line training data: fresh procedural objects for ever, nothing on disk."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from artsim.common.sequences import listed
from artsim.datasets.sample_options import DrawnStream, SampleOptions
from artsim.errors import ConfigError
from artsim.families import assembly_of
from artsim.loading.sources import family_sources
from artsim.making.assembly import Assembly
from artsim.model.objects import ArticulatedObject
from artsim.observing.padding import PaddedStream

__all__ = ["FamilyStream"]

STREAM_SEEDS = (1 << 31, 1 << 32)
"""Seeds of a stream's objects: none that a person would choose for a test set."""


class FamilyStream(DrawnStream):
    """Endless source of samples of objects that have never been seen before.

    Object ``n`` is drawn from (seed, n) and is of category ``n`` modulo the number of categories.

    Parameters
    ----------
    categories : sequence of str
        One that is named twice comes twice as often.
    options : SampleOptions, optional
    seed, views_per_object, start, step : int
        See :class:`artsim.datasets.sample_options.DrawnStream`.

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
        family_sources(categories, 1)  # raises where there is none
        self.categories = categories
        super().__init__(options or SampleOptions(), seed, views_per_object, start, step)

    def padded(self, max_parts: int, float32: bool = True) -> PaddedStream:
        """The stream as dictionaries of arrays of one shape, which default collation stacks.

        Parameters
        ----------
        max_parts : int
            Rows of per-part arrays. An object with more parts is an error.
        float32 : bool
            Poses, boxes, joints and cameras in single precision.
        """
        return PaddedStream(self, max_parts, float32)

    def object(self, n: int) -> ArticulatedObject:
        """Object number ``n``."""
        return _loaded(*self._named(n))

    def assembly(self, n: int) -> Assembly:
        """Parts and joints of object number ``n``, in less than half of the time that the object takes.

        Raises
        ------
        AssetError
            When a solid is empty.
        """
        return assembly_of(*self._named(n))

    def _named(self, n: int) -> tuple[str, int]:
        seed = int(np.random.default_rng([self.seed, n]).integers(*STREAM_SEEDS))
        return self.categories[n % len(self.categories)], seed


@lru_cache(maxsize=16)
def _loaded(category: str, seed: int) -> ArticulatedObject:
    """The last objects used, of all streams of a process."""
    return family_sources([category], 1, seed)[0].load()
