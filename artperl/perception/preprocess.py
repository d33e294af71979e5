"""The points of a cloud that show the object: measured ones, and none on their own."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from artperl.core.clouds import draw, is_measured
from artperl.core.neighbours import tree_of
from artsim.errors import ArtsimError

Array = NDArray[np.float64]

_NEIGHBOURS = 8
"""Of a point, that tell how far away neighbours usually are."""
_FEW_NEIGHBOURS = 3
_OUTLIER = 6.0
"""A point with fewer neighbours than that within so many times the usual distance is an outlier: thin legs are not."""
_CELLS = 65536
"""Cells to either side of the middle, in each direction, within which points are looked for in cells."""
_LEVEL = 2e-5
"""Slope by which rows of an image differ more, and rounding differs less."""
_CLEANED = 4096
"""Points that are looked at for outliers."""
_FEWEST = 8
"""Points below which there is nothing to fit."""
_SMALLEST = 1e-6
"""Extent below which single precision, in which networks work, hardly tells points from each other."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """One cloud as it is given, and the points that a network sees of it.

    Attributes
    ----------
    points : (N, 3) float
        Camera frame, metres.
    good : (G,) int64
        Those that show the object, in an order that is the same however the points were ordered.
    seen : (M, 3) float32
        Of these, the points that a network sees.
    masked : int
        Rows that a masked array leaves out.
    """

    points: Array
    good: NDArray[np.int64]
    seen: NDArray[np.float32]
    masked: int = 0

    @staticmethod
    def of(points: ArrayLike, count: int) -> Cloud:
        """A cloud without outliers, of which a network sees so many points, or all if there are fewer.

        Raises
        ------
        ArtsimError
            When it is no cloud, or hardly a point is left.
        """
        every = as_cloud(points)
        good = clean(every)
        masked = int(np.ma.getmaskarray(points).any(axis=1).sum()) if isinstance(points, np.ma.MaskedArray) else 0
        return Cloud(every, good, _some(every, good, count), masked)

    def without(self, foreign: NDArray[np.bool_], count: int) -> Cloud:
        """The cloud without seen points (M,) that show something else, and those given points that are nearest to them.

        A network sees so many points of what is left.
        """
        good = self.good[~foreign[self._nearest]]
        return Cloud(self.points, good, _some(self.points, good, count))

    def keep(self, own: NDArray[np.bool_]) -> Cloud:
        """The cloud of those seen points (M,) that are chosen, and of the given points that are nearest to them."""
        kept = own[self._nearest]
        cloud = Cloud(self.points, self.good[kept], self.seen[own])
        cloud.__dict__["_nearest"] = (np.cumsum(own) - 1)[self._nearest[kept]]  # what was found stays found
        return cloud

    def tensor(self, device: torch.device) -> Tensor:
        """(1, M, 3) points that a network sees."""
        return torch.from_numpy(self.seen)[None].to(device)

    def some(self, count: int) -> NDArray[np.int64]:
        """(<= count,) indices of points that show the object."""
        return self.good[draw(len(self.good), min(count, len(self.good)), np.random.default_rng(0))]

    @cached_property
    def _nearest(self) -> NDArray[np.int64]:
        """(G,) of the seen points, the nearest to each that shows the object."""
        nearest: NDArray[np.int64] = tree_of(self.seen).query(self.points[self.good])[1]
        return nearest

    def for_every_point(self, values: NDArray[Any], outlier: Any) -> NDArray[Any]:
        """(N, ...) of values (M, ...) of the seen points, that of the nearest; outliers have one of their own."""
        every = np.full((len(self.points), *values.shape[1:]), outlier, dtype=values.dtype)
        every[self.good] = values[self._nearest]
        return every


def _some(points: Array, good: NDArray[np.int64], count: int) -> NDArray[np.float32]:
    """(<= count, 3) of the good points, each once, in random order."""
    chosen = good[draw(len(good), min(count, len(good)), np.random.default_rng(0))]
    return points[chosen].astype(np.float32)


def as_cloud(points: ArrayLike) -> Array:
    """(N, 3) points in double precision; rows of a masked array of which anything is masked are not finite.

    Raises
    ------
    ArtsimError
        When they are no numbers, or of another shape.
    """
    try:
        cloud = np.asarray(points).astype(np.float64, casting="same_kind", copy=False)  # not of complex, or of text
    except (TypeError, ValueError) as error:
        raise ArtsimError(f"this is no cloud ({error})", "points", "pass (N, 3) points in metres") from error
    if cloud.ndim != 2 or cloud.shape[1] != 3:
        raise ArtsimError(f"an array of shape {cloud.shape} is no cloud", "points", "pass (N, 3) points in metres")
    if isinstance(points, np.ma.MaskedArray):
        cloud = np.where(np.ma.getmaskarray(points).any(axis=1, keepdims=True), np.nan, cloud)
    return cloud


def clean(points: Array) -> NDArray[np.int64]:
    """Indices of the points that show the object: measured, and not on their own.

    They are ordered as a camera sees them, row by row, since some of them are drawn by their places in this order: an
    estimate is of the set of points, however they are ordered.

    Raises
    ------
    ArtsimError
        When the array is no cloud, or hardly a point is left.
    """
    points = as_cloud(points)
    good = np.flatnonzero(is_measured(points))
    good = good[_as_seen(points[good])]
    if len(good) > _NEIGHBOURS:
        known = good[draw(len(good), min(_CLEANED, len(good)), np.random.default_rng(0))]
        tree = tree_of(points[known])
        usual = np.median(tree.query(points[known[:1024]], _NEIGHBOURS + 1)[0][:, -1])
        within = max(_OUTLIER * usual, 1e-9)
        alone = ~_is_crowded(points[good], points[known], within)
        apart = tree.query(points[good[alone]], _FEW_NEIGHBOURS + 1, distance_upper_bound=within)[0][:, -1]
        alone[alone] = ~np.isfinite(apart)
        good = good[~alone]
    if len(good) < _FEWEST or np.ptp(points[good], axis=0).max() < _SMALLEST:
        raise ArtsimError(
            f"{len(good)} of {len(points)} points show an object", "points", "pass a cloud of the object, in metres"
        )
    return good


def _as_seen(points: Array) -> NDArray[np.int64]:
    """(N,) order of points by the row, then the column, in which a camera sees them; the nearest first."""
    x, y, z = points.T
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # of points at z = 0
        row, column = np.rint(y / z / _LEVEL), x / z
        down, across = np.diff(row), np.diff(column)
    if ((down > 0) | ((down == 0) & (across > 0))).all():  # as of an image
        return np.arange(len(points))
    return np.lexsort((z, column, row))


def _is_crowded(points: Array, known: Array, within: float) -> NDArray[np.bool_]:
    """(N,) whether points share a cell, that long from corner to corner, with enough known ones: as most points do."""
    cells = [np.floor((values - np.median(known, axis=0)) * (np.sqrt(3.0) / within)) for values in (points, known)]
    number, own = (
        ((cell.clip(-_CELLS, _CELLS) + _CELLS) @ (2.0 * _CELLS + 1.0) ** np.arange(3)).astype(np.int64)
        for cell in cells
    )
    taken, count = np.unique(own, return_counts=True)
    return np.isin(number, taken[count > _FEW_NEIGHBOURS]) & (np.abs(cells[0]) < _CELLS).all(axis=1)
