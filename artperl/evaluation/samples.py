"""Frozen test and validation samples: always the same ones for the same arguments."""

from collections.abc import Iterable, Sequence

import numpy as np

from artperl.data.categories import Parts, objects_of
from artperl.data.degrading import degrade
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.families import FAMILIES
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.renderers import make_renderer

TEST_SEEDS = 1_000_000
"""Seed of the first procedural object of a test set; streams and bases have others."""
VALIDATION_SEEDS = 1_500_000
"""Seed of the first object by which the best estimator is chosen and its confidence calibrated."""
NUM_POINTS = 8192
"""Points of a test cloud: of the 4,000 to 100,000 pixels that show an object in a depth image of 640 x 480."""


def frozen_samples(
    categories: Sequence[str],
    objects: int = 40,
    views_per_object: int = 4,
    options: SampleOptions | None = None,
    first_seed: int = TEST_SEEDS,
    parts: Parts = "artimage",
    max_parts: int | None = None,
) -> list[Sample]:
    """Samples of unseen procedural objects of each category."""
    return [
        sample
        for category in dict.fromkeys(categories)
        for sample in samples_of(
            objects_of([category], objects, first_seed, parts, max_parts), views_per_object, options, first_seed
        )
    ]


def samples_of(
    objects: Iterable[ArticulatedObject],
    views_per_object: int = 4,
    options: SampleOptions | None = None,
    seed: int = TEST_SEEDS,
) -> list[Sample]:
    """The same number of views of every object; they depend on the seed and on the object's place in the list."""
    options = options or SampleOptions(num_points=NUM_POINTS)
    renderer = make_renderer(options.renderer)
    return [
        draw_sample(obj, options, seed, index, renderer)
        for n, obj in enumerate(objects)
        for index in range(n * views_per_object, (n + 1) * views_per_object)
    ]


def degraded_samples(samples: Sequence[Sample]) -> list[Sample]:
    """Every other sample, cut, dirty or sparse; see :func:`artperl.data.degrading.degrade`."""
    return [
        degrade(sample, len(sample.points), np.random.default_rng([VALIDATION_SEEDS, number]))
        for number, sample in enumerate(samples[::2])
    ]


def foreign_samples(categories: Sequence[str], others: int) -> list[Sample]:
    """Two objects each of so many other categories than these: confidence is to be low for them."""
    names = [name for name in FAMILIES if name not in categories]
    return frozen_samples(names[:others], 2, 1, None, VALIDATION_SEEDS, "any")
