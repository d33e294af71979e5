"""Polygons become triangles: convex ones by a fan, others by ear clipping."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artsim.loading.mesh_files.surface import NO_POINT, Array, Draft, Indices

_EAR_CLIPPING = 1e9
"""Bound on the work of ear clipping, which takes up to 3e-10 s for each pair of corners of a polygon."""

_WORK_OF_A_CALL = 2e4
"""What calling the library costs, in the same unit."""


@dataclass
class Triangulation:
    """Triangles of many polygons."""

    corners: Indices
    """(F, 3) int. Positions in the list of all polygons' corners, polygon after polygon."""
    too_few: int = 0
    unusable: int = 0
    crossing: int = 0
    too_many: int = 0
    """Polygons with fewer than three corners; with corners that are no finite point; that cross themselves; that would
    take too long."""

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
    finite = np.isfinite(points[corners[good]])  # not of all points: many lists may share them
    if not finite.all():
        good[good] = finite.all(axis=1)
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
    folded = np.flatnonzero(~whole)
    allowed = min(len(folded), max(0, int(work[0] / (n * n + _WORK_OF_A_CALL))))
    work[0] -= allowed * (n * n + _WORK_OF_A_CALL)
    made.too_many += len(folded) - allowed
    folded = folded[:allowed]
    triangles = [(first[whole, None, None] + fan).reshape(-1, 3)]
    owners = [np.repeat(own[whole], n - 2)]
    for k, flat in zip(
        folded, _flatten(points[corners[first[folded, None] + np.arange(n)]], normals[folded]), strict=True
    ):
        ears, crossing = clip_ears([flat])
        made.crossing += crossing
        triangles.append(first[k] + ears)
        owners.append(np.full(len(ears), own[k]))
    return np.concatenate(triangles), np.concatenate(owners)


def _flatten(polygons: Array, normals: Array) -> Array:
    """(P, N, 2) polygons of (P, N, 3), seen from where their normals point: they turn to the left.

    Leaving out the coordinate along which a polygon is thinnest keeps it whole and costs no precision.
    """
    drop = np.argmax(np.abs(normals), axis=1)
    kept = np.array([[1, 2], [2, 0], [0, 1]])[drop]
    backwards = normals[np.arange(len(normals)), drop] < 0.0
    kept[backwards] = kept[backwards, ::-1]
    flat = np.take_along_axis(polygons, kept[:, None, :], axis=2)
    flat = flat - flat.min(axis=1, keepdims=True)
    size = flat.max(axis=(1, 2), keepdims=True)
    return flat / np.where(size > 0.0, size, 1.0)


def divide_with_holes(outlines: list[Array]) -> tuple[Indices, bool]:
    """Triangles of a polygon with holes: (n, 3) points of its boundary, then of each hole.

    Returns
    -------
    (F, 3) int
        Numbers of points, counted through all outlines.
    crossing : bool
        Whether outlines cross.
    """
    spokes = outlines[0] - outlines[0][0]
    normal = _cross(spokes[:-1], spokes[1:]).sum(axis=0)
    (flat,) = _flatten(np.concatenate(outlines)[None], normal[None])
    ends = np.cumsum([len(outline) for outline in outlines])
    places = np.split(flat, ends[:-1])
    order = np.split(np.arange(len(flat)), ends[:-1])
    for k in range(1, len(places)):
        if _area(places[k]) > 0.0:  # holes turn to the right
            places[k], order[k] = places[k][::-1], order[k][::-1]
    found, crossing = clip_ears(places)
    return np.concatenate(order)[found], crossing


def clip_ears(outlines: list[NDArray[np.float64]]) -> tuple[Indices, bool]:
    """Triangles of a flat polygon.

    Parameters
    ----------
    outlines : list of (n, 2) float
        The boundary, which turns to the left, then holes, which turn to the right; at most about 1 in size.

    Returns
    -------
    (F, 3) int
        Numbers of points, counted through all outlines.
    crossing : bool
        Whether the triangles do not fill exactly the area within: outlines that cross.
    """
    import manifold3d

    triangles = np.asarray(manifold3d.triangulate([np.ascontiguousarray(outline) for outline in outlines]), np.int64)
    triangles = triangles.reshape(-1, 3)
    places = outlines[0] if len(outlines) == 1 else np.concatenate(outlines)
    x, y = places[triangles].transpose(2, 1, 0)
    covered = 0.5 * np.abs((x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])).sum()
    enclosed = sum(map(_area, outlines))
    return triangles, bool(abs(covered - enclosed) > 1e-6 * max(abs(enclosed), 1e-6))


def strips(indices: Indices) -> Indices:
    """(F, 3) triangles of strips, wound as the first of each; -1 stands between one strip and the next."""
    if len(indices) < 3:
        return np.zeros((0, 3), np.int64)
    there = indices != -1
    first = np.flatnonzero(there[:-2] & there[1:-1] & there[2:])
    begun = np.maximum.accumulate(np.where(there, -1, np.arange(len(indices))))[first]
    odd = (first - begun) % 2 == 0
    second = np.where(odd, first, first + 1)
    return np.stack([indices[np.where(odd, first + 1, first)], indices[second], indices[first + 2]], axis=1)


def fans(indices: Indices) -> Indices:
    """(F, 3) triangles of a fan about the first of its vertices."""
    if len(indices) < 3:
        return np.zeros((0, 3), np.int64)
    return np.stack([np.full(len(indices) - 2, indices[0]), indices[1:-1], indices[2:]], axis=1)


def _area(outline: NDArray[np.float64]) -> float:
    """Area within an outline that turns to the left; negative when it turns to the right."""
    x, y = outline[:, 0], outline[:, 1]
    return 0.5 * float((x[:-1] * y[1:] - y[:-1] * x[1:]).sum() + x[-1] * y[0] - y[-1] * x[0])


def _cross(a: Array, b: Array) -> Array:
    """Cross products, some times as fast as NumPy's."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
