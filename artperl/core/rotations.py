"""Rotations in torch: matrices from axes, angles and vectors, and back."""

import torch
from torch import Tensor

_CROSS = torch.tensor([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]])
"""Cross matrices of the unit vectors, row by row."""


def rotation_about(axis: Tensor, angle: Tensor) -> Tensor:
    """Rodrigues' formula.

    Parameters
    ----------
    axis : (..., 3) float
        Unit vectors.
    angle : (...) float
        Radians.

    Returns
    -------
    (..., 3, 3) float
    """
    cross, sine, cosine = cross_matrix(axis), angle.sin()[..., None, None], angle.cos()[..., None, None]
    eye = torch.eye(3, dtype=axis.dtype, device=axis.device)
    return eye + sine * cross + (1.0 - cosine) * (cross @ cross)


def rotation_from_vector(vector: Tensor) -> Tensor:
    """(..., 3, 3) rotations by ``|vector|`` radians about ``vector (..., 3)``; differentiable at zero."""
    square = (vector * vector).sum(-1)
    small = square < 1e-8
    angle = torch.where(small, torch.ones_like(square), square).sqrt()
    first = torch.where(small, 1.0 - square / 6.0, angle.sin() / angle)[..., None, None]
    second = torch.where(small, 0.5 - square / 24.0, (1.0 - angle.cos()) / angle**2)[..., None, None]
    cross = cross_matrix(vector)
    return torch.eye(3, dtype=vector.dtype, device=vector.device) + first * cross + second * (cross @ cross)


def cross_matrix(vectors: Tensor) -> Tensor:
    """(..., 3, 3) skew-symmetric matrices: ``cross_matrix(a) @ b == cross(a, b)``."""
    return (vectors @ _CROSS.to(vectors)).unflatten(-1, (3, 3))


def rotate(matrix: Tensor, vectors: Tensor) -> Tensor:
    """(..., 3) ``matrix (..., 3, 3) @ vectors (..., 3)``."""
    return (matrix @ vectors[..., None])[..., 0]


def nearest_angle(rotation: Tensor, axis: Tensor) -> Tensor:
    """(...) angle of the rotation about ``axis`` that is nearest to ``rotation (..., 3, 3)``, in -pi..pi."""
    twist = (cross_matrix(axis) * (rotation - rotation.transpose(-1, -2))).sum((-1, -2)) / 2
    about = (axis * rotate(rotation, axis)).sum(-1)
    trace = rotation.diagonal(dim1=-2, dim2=-1).sum(-1)
    return torch.atan2(twist, trace - about)
