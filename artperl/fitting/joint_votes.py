"""Joints from the votes of the points near them (A-NCSH, Li et al. 2020, section 4.2)."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REACH = 0.2
"""Diagonals of the object within which points vote for where a joint is."""


def vote_axis(axis: Array) -> Array:
    """(3,) unit direction of a joint, the mean of votes (N, 3)."""
    mean = axis.mean(axis=0)
    direction: Array = mean / max(float(np.linalg.norm(mean)), 1e-12)
    return direction


def vote_pivot(points: Array, offset: Array, heat: Array) -> Array:
    """(3,) a place on a joint, the median of where points say that it is.

    Parameters
    ----------
    points : (N, 3) float
        Where the points lie in the rest frame, in diagonals (NAOCS).
    offset : (N, 3) float
        Unit directions from the points to the nearest places of the joint.
    heat : (N,) float
        1 on the joint, 0 at the distance :data:`REACH`.
    """
    length = np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-12)
    places = points + (1.0 - heat[:, None]) * REACH * offset / length
    pivot: Array = np.median(places, axis=0)
    return pivot
