"""Polygons become triangles: convex ones by a fan, others by ear clipping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artsim.loading.mesh_files.surface import NO_POINT, Array, Draft, Indices

_EAR_CLIPPING = 3e9
"""Bound on the work of ear clipping, which takes up to 3e-10 s for each pair of corners of a polygon."""

_WORK_OF_A_CALL = 2e4
"""What calling the library costs, in the same unit."""


@dataclass
class Triangulation:
    """Triangles of many polygons.

    Attributes
    ----------
    corners : (F, 3) int
        Positions in the list of all polygons' corners, polygon after polygon.
    too_few, unusable, crossing, too_many : int
        Polygons with fewer than three corners; with corners that are no finite point; that cross themselves; that would
        take too long.
    """

    corners: Indices
    too_few: int = 0
    unusable: int = 0
    crossing: int = 0
    too_many: int = 0

    def tell(self, draft: Draft) -> None:
        """Say what is missing."""
        draft.left_out(self.too_few, "faces", "fewer than three corners")
        draft.left_out(self.unusable, "faces", NO_POINT)
        draft.left_out(self.too_many, "concave faces", "dividing them takes too long")
        if self.crossing:
            draft.note(f"{self.crossing} faces cross themselves: divided as well as they can be")


def triangulate(points: Array, corners: Indices, counts: Indices) -> Triangulation:
    """Divide polygons into triangles, in their order.

    Parameters
    ----------
    points : (V, 3) float
    corners : (C,) int
        Which point each corner is, polygon after polygon. Numbers out of range are allowed.
    counts : (P,) int
        Corners of each polygon; their sum is C.
    """
    starts = np.cumsum(counts) - counts
    usable = counts >= 3
    few = int((~usable).sum())
    good = (corners >= 0) & (corners < len(points))
    good[good] = np.isfinite(points[corners[good]]).all(axis=1)  # not of all points: many lists may share them
    if not good.all():
        bad_before = np.concatenate([[0], np.cumsum(~good)])
        usable &= bad_before[starts + counts] == bad_before[starts]
    if not usable.all():
        starts, counts = starts[usable], counts[usable]
    made = Triangulation(np.zeros((0, 3), np.int64), few, len(usable) - few - len(starts))
    if (counts == 3).all():
        made.corners = starts[:, None] + np.arange(3)
        return made
    work = [_EAR_CLIPPING]
    found, owners = [], []
    for n in np.unique(counts).tolist():
        own = np.flatnonzero(counts == n)
        first = starts[own]
        if n == 3:
            triangles, owner = first[:, None] + np.arange(3), own
        elif n == 4:
            triangles, owner = _quads(points, corners, first), np.repeat(own, 2)
        else:
            triangles, owner = _fans(points, corners, first, n, own, made, work)
        found.append(triangles)
        owners.append(owner)
    order = np.argsort(np.concatenate(owners), kind="stable")
    made.corners = np.concatenate(found)[order]
    return made


def _quads(points: Array, corners: Indices, first: Indices) -> Indices:
    """Two triangles of each quadrilateral, along the diagonal that lies inside it."""
    a, b, c, d = (points[corners[first + i]] for i in range(4))
    folded = (_cross(b - a, c - a) * _cross(c - a, d - a)).sum(axis=1) < 0.0
    split = np.where(folded[:, None], [0, 1, 3, 1, 2, 3], [0, 1, 2, 0, 2, 3])
    return (first[:, None] + split).reshape(-1, 3)


def _fans(
    points: Array, corners: Indices, first: Indices, n: int, own: Indices, made: Triangulation, work: list[float]
) -> tuple[Indices, Indices]:
    """Triangles of polygons of n corners, and which polygon each belongs to."""
    fan = np.stack([np.zeros(n - 2, np.int64), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    normals = np.zeros((len(first), 3))
    whole = np.zeros(len(first), dtype=bool)
    step = max(1, 1_000_000 // n)  # bounds the memory
    for at in range(0, len(first), step):
        block = slice(at, at + step)
        polygon = points[corners[first[block, None] + np.arange(n)]]
        spokes = polygon[:, 1:] - polygon[:, :1]
        areas = _cross(spokes[:, :-1], spokes[:, 1:])
        normals[block] = areas.sum(axis=1)
        turned = (areas * normals[block, None]).sum(axis=2)
        # Corners in a line may lie the wrong way by rounding.
        whole[block] = (turned >= -1e-12 * (normals[block] ** 2).sum(axis=1, keepdims=True)).all(axis=1)
    triangles = [(first[whole, None, None] + fan).reshape(-1, 3)]
    owners = [np.repeat(own[whole], n - 2)]
    for k in np.flatnonzero(~whole):
        work[0] -= n * n + _WORK_OF_A_CALL
        if work[0] < 0.0:
            made.too_many += 1
            continue
        polygon = points[corners[first[k] + np.arange(n)]]
        ears, crossing = clip_ears([polygon], normals[k])
        made.crossing += crossing
        triangles.append(first[k] + ears)
        owners.append(np.full(len(ears), own[k]))
    return np.concatenate(triangles), np.concatenate(owners)


def clip_ears(outlines: list[Array], normal: Array | None = None) -> tuple[Indices, bool]:
    """Triangles of one polygon with holes, which may be concave.

    Parameters
    ----------
    outlines : list of (n, 3) float
        The boundary, then the holes.
    normal : (3,) float, optional
        Of the boundary.

    Returns
    -------
    (F, 3) int
        Numbers of points, counted through all outlines.
    crossing : bool
        Whether the triangles do not fill exactly the area within: outlines that cross.
    """
    import manifold3d

    if normal is None:
        spokes = outlines[0] - outlines[0][0]
        normal = _cross(spokes[:-1], spokes[1:]).sum(axis=0)
    # Leaving out the coordinate along which the polygon is thinnest keeps it whole and costs no precision.
    drop = int(np.argmax(np.abs(normal)))
    kept = [(1, 2), (2, 0), (0, 1)][drop]
    flat = [outline[:, kept if normal[drop] > 0 else kept[::-1]] for outline in outlines]
    low = flat[0].min(axis=0)
    size = float((flat[0].max(axis=0) - low).max()) or 1.0
    flat = [(outline - low) / size for outline in flat]
    order, start = [], 0
    for k, outline in enumerate(flat):
        numbers = np.arange(start, start + len(outline))
        if (_area(outline) < 0.0) != (k > 0):  # holes turn the other way
            numbers, flat[k] = numbers[::-1], outline[::-1]
        order.append(numbers)
        start += len(outline)
    found = np.asarray(manifold3d.triangulate([np.ascontiguousarray(outline) for outline in flat]), np.int64)
    triangles = np.concatenate(order)[found.reshape(-1, 3)]
    place = np.concatenate([f[np.argsort(o)] for f, o in zip(flat, order, strict=True)])
    a, b, c = (place[triangles[:, i]] for i in range(3))
    covered = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]).sum()
    enclosed = sum(_area(outline) for outline in flat)
    return triangles, bool(abs(covered - enclosed) > 1e-6 * max(abs(enclosed), 1e-6))


def strips(indices: Indices) -> Indices:
    """(F, 3) triangles of strips, wound as the first of each; -1 stands between one strip and the next."""
    if len(indices) < 3:
        return np.zeros((0, 3), np.int64)
    place = np.arange(len(indices))
    within = place - np.maximum.accumulate(np.where(indices == -1, place + 1, 0))
    triangles = np.stack([indices[:-2], indices[1:-1], indices[2:]], axis=1)
    odd = within[:-2] % 2 == 1
    triangles[odd] = triangles[odd][:, [1, 0, 2]]
    return triangles[(triangles != -1).all(axis=1)]


def fans(indices: Indices) -> Indices:
    """(F, 3) triangles of a fan about the first of its vertices."""
    if len(indices) < 3:
        return np.zeros((0, 3), np.int64)
    return np.stack([np.full(len(indices) - 2, indices[0]), indices[1:-1], indices[2:]], axis=1)


def _area(outline: NDArray[np.float64]) -> float:
    x, y = outline.T
    return float(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def _cross(a: Array, b: Array) -> Array:
    """Cross products, some times as fast as NumPy's."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
