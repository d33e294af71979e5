"""Clouds as detectors and cluttered scenes leave them: cut, with foreign points, or of few points."""

from dataclasses import replace

import numpy as np

from artperl.core.clouds import draw
from artsim.observing.interference import interfere
from artsim.observing.sample import Sample

MOST_HIDDEN = 0.8
"""Of the object's points: of a laptop of which less than a fifth shows, nobody can tell how it lies."""
MOST_FOREIGN = 0.15
"""Of a cloud's points: half as many again as the worst masks of detectors have."""
_FEWEST = 512
"""Points that a sparse cloud has at least."""
_CUT, _SPOT, _DIRTY, _SPARSE = 0.7, 0.3, 0.5, 0.2
"""Shares of degraded clouds that are cut; of these, by a spot; that have foreign points; that are of few points."""


def degrade(sample: Sample, num_points: int, rng: np.random.Generator) -> Sample:
    """The sample as something in front, the image's border, or a bad mask leaves it, with so many points.

    Where fewer are left, some come twice, as they do when an estimator is given fewer points than it looks at.

    Parameters
    ----------
    sample : Sample
        With more points than are wanted, so that those of a cut cloud are as dense as a camera sees them.
    num_points : int
    rng : numpy.random.Generator
    """
    hidden = rng.uniform(0.0, MOST_HIDDEN) if rng.random() < _CUT else 0.0
    spot = bool(rng.random() < _SPOT)
    # A spot leaves the outline: more than that of the object is seldom behind one thing.
    hidden *= 0.6 if spot else 1.0
    outlier_share = rng.uniform(0.0, MOST_FOREIGN) if rng.random() < _DIRTY else 0.0
    changed = interfere(sample, rng, hidden, outlier_share, spot)
    available = len(changed.points)
    if rng.random() < _SPARSE:
        available = min(available, int(rng.integers(_FEWEST, max(num_points, _FEWEST) + 1)))
    kept = rng.permutation(len(changed.points))[:available][draw(available, num_points, rng)]
    return replace(changed, points=changed.points[kept], part=changed.part[kept], npcs=changed.npcs[kept])
