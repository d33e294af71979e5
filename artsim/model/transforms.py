"""Matrices of rigid transforms, and what they do to points."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.elementary import cos, sin
from artsim.common.products import apply, matmul, unit

Array = NDArray[np.float64]


def cross_matrix(vectors: ArrayLike) -> Array:
    """Skew-symmetric matrices: ``cross_matrix(a) @ b == cross(a, b)``.

    Parameters
    ----------
    vectors : (..., 3) float

    Returns
    -------
    (..., 3, 3) float
    """
    v = np.asarray(vectors, dtype=np.float64)
    matrix = np.zeros((*v.shape, 3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return matrix


def rotation_about(axis: ArrayLike, angle: float) -> Array:
    """(3, 3) rotation by ``angle`` radians about an axis of any length (Rodrigues' formula)."""
    cross = cross_matrix(unit(axis))
    rotation: Array = np.eye(3) + sin(angle) * cross + (1.0 - cos(angle)) * matmul(cross, cross)
    return rotation


def compose_transform(position: ArrayLike, rotation: ArrayLike | None = None) -> Array:
    """(4, 4) transform that turns by a rotation (3, 3), if there is one, and then moves by (3,)."""
    T = np.eye(4)
    T[:3, :3] = np.eye(3) if rotation is None else rotation
    T[:3, 3] = position
    return T


def rotation_of_quaternion(quaternion: ArrayLike) -> Array:
    """(3, 3) rotation of a unit quaternion x, y, z, w."""
    *vector, w = np.asarray(quaternion, dtype=np.float64)
    cross = cross_matrix(vector)
    return np.eye(3) + 2.0 * (w * cross + matmul(cross, cross))


def transform_points(T_to_from: ArrayLike, points: ArrayLike) -> Array:
    """Map points by one transform, or by one transform per point.

    Parameters
    ----------
    T_to_from : (..., 4, 4) float
    points : (..., N, 3) float

    Returns
    -------
    (..., N, 3) float
    """
    T = np.asarray(T_to_from, dtype=np.float64)
    return apply(T[..., None, :3, :3], np.asarray(points)) + T[..., None, :3, 3]


def invert_transform(T_to_from: ArrayLike) -> Array:
    """Inverse of rigid transforms.

    Parameters
    ----------
    T_to_from : (..., 4, 4) float

    Returns
    -------
    (..., 4, 4) float
        ``T_from_to``
    """
    T = np.asarray(T_to_from, dtype=np.float64)
    inverse = np.zeros_like(T)
    rotation = np.swapaxes(T[..., :3, :3], -1, -2)
    inverse[..., :3, :3] = rotation
    inverse[..., :3, 3] = -apply(rotation, T[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse
