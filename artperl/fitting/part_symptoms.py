"""What a fit says about each part."""

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.confidence import PartSymptoms
from artperl.core.pose import Theta
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.search import apart
from artperl.perception.network import Perceived

_ABSENT = 0.5
"""Disagreement and expected_error of a part without points, in diagonals: more than any part with points has."""


def part_symptoms(
    shapes: Shapes, observed: Observed, theta: Theta, perceived: Perceived, visibility: NDArray[np.float64]
) -> PartSymptoms:
    """Symptoms of the K parts of one fit, whose visibility (K,) is known."""
    part = observed.part[0]
    chance = perceived.part_probability[0, : len(part)]
    return symptoms_by_part(
        part, apart(shapes, observed, theta, perceived), perceived.spread[0, : len(part)].exp(),
        chance.gather(1, part[:, None].clamp(max=chance.shape[1] - 1))[:, 0], visibility,
    )  # fmt: skip


def symptoms_by_part(
    part: Tensor, apart: Tensor, expected: Tensor, certainty: Tensor, visibility: NDArray[np.float64]
) -> PartSymptoms:
    """Symptoms of K parts by those of N points, on any device.

    Parameters
    ----------
    part : (N,) int64
    apart, expected : (N,) float
        Of which a part's disagreement and expected error are the medians.
    certainty : (N,) float
        Probability of the label.
    visibility : (K,) float
    """
    label = part.cpu().numpy()
    off, expected_error, own = (values.double().cpu().numpy() for values in (apart, expected, certainty))
    rows = np.zeros((len(visibility), 4))
    rows[:, :2] = _ABSENT
    for k in range(len(rows)):
        mine = label == k
        if mine.any():
            rows[k] = np.median(off[mine]), np.median(expected_error[mine]), own[mine].mean(), np.sqrt(mine.mean())
    return PartSymptoms(rows[:, 0], rows[:, 1], rows[:, 2], visibility, rows[:, 3])
