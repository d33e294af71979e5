"""What a fit says about each part."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from artperl.core.confidence import PartSymptoms
from artperl.core.pose import Theta
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.search import apart
from artperl.perception.network import Perceived

_ABSENT = 0.5
"""Disagreement and doubt of a part without points, in diagonals: more than any part with points has."""


def part_symptoms(
    shapes: Shapes, observed: Observed, theta: Theta, perceived: Perceived, visibility: NDArray[np.float64]
) -> PartSymptoms:
    """Symptoms of the K parts of one fit, whose visibility (K,) is known."""
    part, K = observed.part[0], len(visibility)
    off = apart(shapes, observed, theta, perceived).double().cpu().numpy()
    expected = perceived.spread[0, : len(part)].exp().double().cpu().numpy()
    chance = perceived.part_probability[0, : len(part)]
    own = chance.gather(1, part[:, None].clamp(max=chance.shape[1] - 1))[:, 0].double().cpu().numpy()
    label = part.cpu().numpy()
    rows = np.zeros((K, 4))
    rows[:, :2] = _ABSENT
    for k in range(K):
        mine = label == k
        if mine.any():
            rows[k] = np.median(off[mine]), np.median(expected[mine]), own[mine].mean(), np.sqrt(mine.mean())
    return PartSymptoms(rows[:, 0], rows[:, 1], rows[:, 2], visibility, rows[:, 3])
