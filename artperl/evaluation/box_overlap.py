"""Intersection of oriented boxes in 3D, exactly, and the sampled definitions of published code."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull, QhullError

Array = NDArray[np.float64]

_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
_EDGES = np.array([(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit])
_MARGIN = 1e-12
"""Share of the boxes' size by which a point on a face may lie outside by rounding."""


def intersection_volume(
    rotation_a: ArrayLike,
    center_a: ArrayLike,
    size_a: ArrayLike,
    rotation_b: ArrayLike,
    center_b: ArrayLike,
    size_b: ArrayLike,
) -> Array:
    """Volume that pairs of oriented boxes share.

    It is that of the convex hull of all corners of the intersection: those of each box in the other one, and the points
    where edges of one pass through faces of the other.

    Parameters
    ----------
    rotation_a, rotation_b : (..., 3, 3) float
        Box frame -> common frame.
    center_a, center_b : (..., 3) float
    size_a, size_b : (..., 3) float
        Side lengths, not negative.

    Returns
    -------
    (...) float
    """
    shape = np.broadcast_shapes(*(np.shape(x)[:-1] for x in (center_a, size_a, center_b, size_b)))
    Ra, Rb = (
        np.broadcast_to(np.asarray(R, np.float64), (*shape, 3, 3)).reshape(-1, 3, 3) for R in (rotation_a, rotation_b)
    )
    ca, cb, sa, sb = (
        np.broadcast_to(np.asarray(x, np.float64), (*shape, 3)).reshape(-1, 3)
        for x in (center_a, center_b, size_a, size_b)
    )
    near = np.linalg.norm(ca - cb, axis=1) < 0.5 * (np.linalg.norm(sa, axis=1) + np.linalg.norm(sb, axis=1))
    volume = np.zeros(len(ca))
    for n in np.flatnonzero(near):
        volume[n] = _shared_volume(Ra[n].T @ Rb[n], Ra[n].T @ (cb[n] - ca[n]), sa[n], sb[n])
    return volume.reshape(shape)


def _shared_volume(R: Array, c: Array, sa: Array, sb: Array) -> float:
    """Volume that a box shares with another one, given in its frame."""
    inside = (
        _corners_inside(np.eye(3), np.zeros(3), sa, R, c, sb),
        _corners_inside(R, c, sb, np.eye(3), np.zeros(3), sa),
    )
    try:
        volume = ConvexHull(np.concatenate(inside)).volume
    except (QhullError, ValueError):  # they lie in a plane, or there are none
        return 0.0
    return float(min(volume, sa.prod(), sb.prod()))


def _corners_inside(R: Array, c: Array, s: Array, other_R: Array, other_c: Array, other_s: Array) -> Array:
    """(n, 3) corners of a box, and points of its edges on faces of another box, that lie in this."""
    corners = (0.5 * _SIGNS * s @ R.T + c - other_c) @ other_R
    start, along = corners[_EDGES[:, 0]], np.diff(corners[_EDGES], axis=1)[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):  # an edge may run along a face
        share = ((0.5 * np.stack([-other_s, other_s]) - start[:, None]) / along[:, None]).reshape(len(start), 6, 1)
        places = (start[:, None] + share * along[:, None])[((share >= 0.0) & (share <= 1.0))[..., 0]]
    points = np.concatenate([corners, places])
    margin = _MARGIN * float(np.linalg.norm(s) + np.linalg.norm(other_s))
    return points[(np.abs(points) <= 0.5 * other_s + margin).all(axis=1)] @ other_R.T + other_c


def iou_exact(
    rotation_a: ArrayLike,
    center_a: ArrayLike,
    size_a: ArrayLike,
    rotation_b: ArrayLike,
    center_b: ArrayLike,
    size_b: ArrayLike,
) -> Array:
    """Exact intersection over union of pairs of oriented boxes; parameters as of :func:`intersection_volume`.

    Returns
    -------
    (...) float
        0 where both boxes are flat.
    """
    shared = intersection_volume(rotation_a, center_a, size_a, rotation_b, center_b, size_b)
    union = np.asarray(size_a, np.float64).prod(axis=-1) + np.asarray(size_b, np.float64).prod(axis=-1) - shared
    ratio: Array = np.where(union > 0, shared / np.where(union > 0, union, 1.0), 0.0)
    return ratio


def iou_rest_exact(center_a: ArrayLike, size_a: ArrayLike, center_b: ArrayLike, size_b: ArrayLike) -> Array:
    """Exact intersection over union of boxes (..., 3) in the rest frame, along its axes: no pose enters."""
    ca, sa, cb, sb = (np.asarray(x, np.float64) for x in (center_a, size_a, center_b, size_b))
    low, high = np.maximum(ca - 0.5 * sa, cb - 0.5 * sb), np.minimum(ca + 0.5 * sa, cb + 0.5 * sb)
    shared = np.maximum(high - low, 0.0).prod(axis=-1)
    union = sa.prod(axis=-1) + sb.prod(axis=-1) - shared
    ratio: Array = np.where(union > 0, shared / np.where(union > 0, union, 1.0), 0.0)
    return ratio


def iou_omad_legacy(
    center_a: ArrayLike, size_a: ArrayLike, center_b: ArrayLike, size_b: ArrayLike, resolution: int = 50
) -> Array:
    """Intersection over union as OMAD's evaluation defines it: only to compare with figures published so.

    Boxes are compared in the rest frame, so that pose does not enter, by counting points of a regular grid that spans
    both. Of the eight corners that the published code writes down for a box, the last one takes its x from the least
    z; the edge along y that is measured to it is skewed, and a point p is inside when ``0 < e . p < e . e`` holds for
    the three edges e. The value depends on where the frame's origin is, and on which way its axes point: ArtImage's
    frames have y up.

    Parameters
    ----------
    center_a, size_a, center_b, size_b : (..., 3) float
        Boxes aligned with the rest frame.
    resolution : int
        Grid points along each axis.

    Returns
    -------
    (...) float
        1 when no grid point lies in either box.
    """
    boxes = np.stack(np.broadcast_arrays(center_a, size_a, center_b, size_b), axis=-2).astype(np.float64)
    flat = boxes.reshape(-1, 2, 2, 3)
    ratio = np.array(
        [_grid_iou(center, size, resolution) for center, size in zip(flat[:, :, 0], flat[:, :, 1], strict=True)]
    )
    return ratio.reshape(boxes.shape[:-2])


def _grid_iou(center: Array, size: Array, resolution: int) -> float:
    low, high = center - 0.5 * size, center + 0.5 * size
    skewed = np.stack([low[:, 2], low[:, 1], low[:, 2]], axis=1)
    first, last = np.vstack([low, skewed]).min(axis=0), np.vstack([high, skewed]).max(axis=0)
    steps = [np.linspace(first[i], last[i], resolution) for i in range(3)]
    grid = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = []
    for box in range(2):
        corner = np.array([low[box, 0], high[box, 1], low[box, 2]])
        edges = np.stack([[size[box, 0], 0.0, 0.0], skewed[box] - corner, [0.0, 0.0, size[box, 2]]])
        along = (grid - corner) @ edges.T
        inside.append(((along > 0) & (along < (edges * edges).sum(axis=1))).all(axis=1))
    union = int((inside[0] | inside[1]).sum())
    return 1.0 if union == 0 else int((inside[0] & inside[1]).sum()) / union
