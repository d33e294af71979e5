"""Intersection of oriented boxes in 3D, exactly, and the sampled definitions of published code."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

_CORNER_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
# Corners of each face in order around it, counter-clockwise seen from outside: -x, +x, -y, +y, -z, +z.
_FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
_COINCIDENT = 1e-14
"""Faces nearer than this share of the boxes' size lie in one plane: only one of them bounds the intersection."""


def intersection_volume(
    rotation_a: ArrayLike,
    center_a: ArrayLike,
    size_a: ArrayLike,
    rotation_b: ArrayLike,
    center_b: ArrayLike,
    size_b: ArrayLike,
) -> Array:
    """Volume that pairs of oriented boxes share.

    Each face of either box is clipped by the six half-spaces of the other (Sutherland-Hodgman). What is left bounds
    the intersection, and the divergence theorem turns it into a volume.

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
    if near.any():
        volume[near] = _overlap(*(x[near] for x in (Ra, ca, sa, Rb, cb, sb)))
    return volume.reshape(shape)


def _overlap(Ra: Array, ca: Array, sa: Array, Rb: Array, cb: Array, sb: Array) -> Array:
    """(M,) shared volume of M pairs of boxes, in the frame of box a (so that the origin lies inside it)."""
    R = np.swapaxes(Ra, 1, 2) @ Rb
    c = (np.swapaxes(Ra, 1, 2) @ (cb - ca)[..., None])[..., 0]
    margin = _COINCIDENT * (np.linalg.norm(sa, axis=1) + np.linalg.norm(sb, axis=1))
    eye, origin = np.broadcast_to(np.eye(3), R.shape), np.zeros_like(c)
    volume = _flux(eye, origin, sa, R, c, sb, margin, True) + _flux(R, c, sb, eye, origin, sa, margin, False)
    return np.clip(volume, 0.0, np.minimum(sa.prod(axis=1), sb.prod(axis=1)))


def _faces(R: Array, c: Array, s: Array) -> Array:
    """(M, 6, 4, 3) corners of the faces."""
    corners = (0.5 * _CORNER_SIGNS * s[:, None]) @ np.swapaxes(R, 1, 2) + c[:, None]
    return corners[:, _FACES]


def _flux(
    R: Array, c: Array, s: Array, other_R: Array, other_c: Array, other_s: Array, margin: Array, keep_shared: bool
) -> Array:
    """(M,) a third of the flux of the position through those parts of boxes' faces that lie inside other boxes.

    Where faces of both lie in one plane, they count as inside only if they look the same way and ``keep_shared``: a
    face that both boxes have bounds the intersection once, and boxes that touch from outside share nothing.
    """
    M = len(R)
    polygons, count = _faces(R, c, s).reshape(M * 6, 4, 3), np.full(M * 6, 4)
    outward = np.stack([-R, R], axis=-1).transpose(0, 2, 3, 1).reshape(M, 6, 3)
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = sign * other_R[:, :, axis]
            offset = (normal * other_c).sum(axis=1) + 0.5 * other_s[:, axis]
            alike = keep_shared & ((outward @ normal[:, :, None])[..., 0] > 0.0)
            allowed = np.where(alike, margin[:, None], -margin[:, None]).reshape(-1)
            polygons, count = _clip(polygons, count, np.repeat(normal, 6, axis=0), np.repeat(offset, 6), allowed)
    # Fans from the first corner: padded corners repeat the last one and add nothing.
    first, second, third = polygons[:, :1], polygons[:, 1:-1], polygons[:, 2:]
    triple = (np.cross(second - first, third - first) * first).sum(axis=(1, 2))
    return np.where(count >= 3, triple, 0.0).reshape(M, 6).sum(axis=1) / 6.0


def _clip(polygons: Array, count: Array, normal: Array, offset: Array, margin: Array) -> tuple[Array, Array]:
    """Convex polygons (Q, V, 3), the first ``count`` corners of each, cut by half-spaces ``normal @ p <= offset``.

    Returns
    -------
    polygons : (Q, V + 1, 3)
        The last corner is repeated as padding.
    count : (Q,)
    """
    Q, V, _ = polygons.shape
    corner = np.arange(V)
    present = corner < count[:, None]
    following = np.where(corner + 1 < count[:, None], corner + 1, 0)
    height = (polygons @ normal[:, :, None])[..., 0] - offset[:, None] - margin[:, None]
    inside = height <= 0.0
    next_height = np.take_along_axis(height, following, axis=1)
    crosses = present & (inside != (next_height <= 0.0))
    gap = np.where(crosses, height - next_height, 1.0)
    share = np.where(crosses, height / gap, 0.0)[..., None]
    cut = polygons + share * (np.take_along_axis(polygons, following[..., None], axis=1) - polygons)
    # Each corner gives itself, if inside, and then the cut of its edge, if there is one.
    slots = np.stack([polygons, cut], axis=2).reshape(Q, 2 * V, 3)
    used = np.stack([present & inside, crosses], axis=2).reshape(Q, 2 * V)
    order = np.argsort(~used, axis=1, kind="stable")[:, : V + 1]
    count = np.minimum(used.sum(axis=1), V + 1)
    order = np.take_along_axis(order, np.minimum(np.arange(V + 1), np.maximum(count - 1, 0)[:, None]), axis=1)
    return np.take_along_axis(slots, order[..., None], axis=1), count


def iou(
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


def iou_aligned(center_a: ArrayLike, size_a: ArrayLike, center_b: ArrayLike, size_b: ArrayLike) -> Array:
    """Exact intersection over union of boxes (..., 3) that are aligned with the axes of one frame."""
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
