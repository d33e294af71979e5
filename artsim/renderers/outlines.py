"""Outlines of parts in the image: bounds that are never too small, from a few corners around each part."""

import itertools
from functools import cache

import numpy as np
from numpy.typing import NDArray

from artsim.common.elementary import cos, tan
from artsim.common.products import dot, matmul, unit
from artsim.model.camera import Camera
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.renderers.ray_kernels import spans


def bounding_corners(points: Array) -> Array:
    """Corners of the bounding polytope with 26 faces: normal to the axes, and to a cube's edges and corners.

    Parameters
    ----------
    points : (N, 3) float

    Returns
    -------
    (C, 3) float
        Their convex hull contains the points.
    """
    reach = matmul(points, _NORMALS.T)
    low, high = reach.min(axis=0), reach.max(axis=0)
    slack = 1e-5 * float((high - low).max()) + 1e-12  # gives flat parts a thickness
    away = np.concatenate([high, -low]) + slack
    planes, weights = _meetings()
    corners = sum(weights[k] * away[planes[k]] for k in range(3)).T
    near = 1e-3 * slack  # corners where more than three faces meet are found more than once, a little apart
    off_middle = abs(matmul(_NORMALS, corners.T) - 0.5 * (low + high)[:, None])
    corners = corners[(off_middle <= (0.5 * (high - low) + slack + near)[:, None]).all(axis=0)]
    corners = corners[np.unique(np.round(corners / near), axis=0, return_index=True)[1]]
    around = matmul(corners, _NORMALS.T)
    if len(corners) and (around.min(axis=0) <= low).all() and (around.max(axis=0) >= high).all():
        return corners
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    return np.array([(box[a, 0], box[b, 1], box[c, 2]) for a in (0, 1) for b in (0, 1) for c in (0, 1)])


_NORMALS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)])
_NORMALS = unit(_NORMALS)


@cache
def _meetings() -> tuple[NDArray[np.int64], Array]:
    """All three faces that meet in a point: (3, M) which, and (3, 3, M) the point by how far away each of them is."""
    normals = np.concatenate([_NORMALS, -_NORMALS])
    planes = np.array(list(itertools.combinations(range(len(normals)), 3)))
    a, b, c = (normals[planes[:, k]] for k in range(3))
    volume = dot(a, np.cross(b, c))
    meet = abs(volume) > 1e-3
    # Cramer's rule, in vectors
    weights = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])[:, meet] / volume[meet, None]
    return planes[meet].T, np.ascontiguousarray(np.swapaxes(weights, 1, 2))


_TILTS = np.deg2rad(np.arange(-72.0, 73.0, 18.0))  # of the lines that bound an outline to its left and right
_TANGENTS = tan(_TILTS)
_SLOPES = np.stack([_TANGENTS, -_TANGENTS]).astype(np.float32)  # for the left side, and for the negated right side
_MARGIN = 0.05  # pixels: covers single precision
_LINES = (_TANGENTS, _SLOPES, _MARGIN / cos(_TILTS), _MARGIN)


def outline_spans(
    obj: ArticulatedObject, corners: Array, camera: Camera, T_camera_part: Array
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Row spans of the parts' outlines, and their rows; see :class:`artsim.renderers.raycast.PosedObject`.

    A convex body in front of the camera has a convex image: it lies between its highest and lowest corners, and
    between the lines of any slope that touch it.

    Parameters
    ----------
    obj : ArticulatedObject
    corners : (K, 3, C) float
        Of a convex body around each part, native units.
    camera : Camera
    T_camera_part : (K, 4, 4) float
    """
    T, K = np.ascontiguousarray(T_camera_part), np.array(camera.K, dtype=np.float64, order="C")
    outlines: tuple[NDArray[np.float32], NDArray[np.int64]] = spans(
        T, corners, float(obj.scale), obj.has_surface, K, camera.height, *_LINES
    )
    return outlines
