"""The points of a cloud that show the object: finite ones, and none on their own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from artsim.errors import ArtsimError

Array = NDArray[np.float64]

_NEIGHBOURS = 8
"""Of a point, that tell how far away neighbours usually are."""
_FEW_NEIGHBOURS = 3
_OUTLIER = 6.0
"""A point with fewer neighbours than that within so many times the usual distance is an outlier: thin legs are not."""
_CELLS = 65536
"""Cells to either side of the middle, in each direction, within which points are looked for in cells."""
_CLEANED = 4096
"""Points that are looked at for outliers."""
_FEWEST = 8
"""Points below which there is nothing to fit."""


def clean(points: Array) -> NDArray[np.int64]:
    """Indices of the points that show the object: finite, and not on their own.

    Raises
    ------
    ArtsimError
        When the array is no cloud, or hardly a point is left.
    """
    if points.ndim != 2 or points.shape[1] != 3:
        raise ArtsimError(f"an array of shape {points.shape} is no cloud", "points", "pass (N, 3) points in metres")
    good = np.flatnonzero(np.isfinite(points).all(axis=1))
    if len(good) > _NEIGHBOURS:
        known = good[draw(len(good), min(_CLEANED, len(good)), np.random.default_rng(0))]
        tree = cKDTree(points[known])
        usual = np.median(tree.query(points[known[:1024]], [_NEIGHBOURS + 1])[0])
        within = max(_OUTLIER * usual, 1e-9)
        alone = ~_crowded(points[good], points[known], within)
        apart = tree.query(points[good[alone]], [_FEW_NEIGHBOURS + 1], distance_upper_bound=within)[0][:, 0]
        alone[alone] = ~np.isfinite(apart)
        good = good[~alone]
    if len(good) < _FEWEST or not np.ptp(points[good], axis=0).any():
        raise ArtsimError(
            f"{len(good)} of {len(points)} points show an object", "points", "pass a cloud of the object, in metres"
        )
    return good


def _crowded(points: Array, known: Array, within: float) -> NDArray[np.bool_]:
    """(N,) whether points share a cell, that long from corner to corner, with enough known ones: as most points do."""
    cells = [np.floor((values - np.median(known, axis=0)) * (np.sqrt(3.0) / within)) for values in (points, known)]
    number, own = (
        ((cell.clip(-_CELLS, _CELLS) + _CELLS) @ (2.0 * _CELLS + 1.0) ** np.arange(3)).astype(np.int64)
        for cell in cells
    )
    taken, count = np.unique(own, return_counts=True)
    return np.isin(number, taken[count > _FEW_NEIGHBOURS]) & (np.abs(cells[0]) < _CELLS).all(axis=1)


def draw(available: int, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """``count`` of ``available`` indices in random order, every one before any comes twice."""
    rounds = [rng.permutation(available) for _ in range(-(-count // available))]
    return np.concatenate(rounds)[:count]
