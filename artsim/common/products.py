"""Products of small vectors and matrices that give the same bits on every processor.

BLAS adds in an order, and fuses multiplications with additions, as it finds best on the processor that it runs on. Here
every product is a sum of elementwise products in a fixed order, each step rounded as IEEE 754 says. See
:mod:`artsim.common.elementary`.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def dot(a: ArrayLike, b: ArrayLike) -> Any:
    """Inner products over the last axis, which is short.

    Parameters
    ----------
    a, b : (..., N) float

    Returns
    -------
    (...) float
        A float where both are single vectors.
    """
    if np.ndim(a) == np.ndim(b) == 1:
        total = 0.0
        for x, y in zip(_numbers(a), _numbers(b), strict=True):
            total += x * y
        return total
    products = np.asarray(a) * np.asarray(b)
    total = products[..., 0] + 0.0
    for i in range(1, products.shape[-1]):
        total += products[..., i]
    return total


def _numbers(vector: Any) -> list[float]:
    return vector.tolist() if isinstance(vector, np.ndarray) else [float(x) for x in vector]


def norm(vectors: ArrayLike) -> Any:
    """Lengths of (..., N) vectors over the last axis; a float for a single one."""
    squared = dot(vectors, vectors)
    return math.sqrt(squared) if isinstance(squared, float) else np.sqrt(squared)


def unit(vectors: ArrayLike) -> Array:
    """(..., N) vectors over their lengths."""
    vectors = np.asarray(vectors, dtype=np.float64)
    lengths = norm(vectors)
    return vectors / (lengths if vectors.ndim == 1 else lengths[..., None])


def cross(a: ArrayLike, b: ArrayLike) -> Array:
    """Cross product of two (3,) vectors: that of NumPy takes ten times as long for single ones."""
    (ax, ay, az), (bx, by, bz) = _numbers(a), _numbers(b)
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def matmul(a: ArrayLike, b: ArrayLike) -> Array:
    """Matrix products, as ``a @ b`` of arrays of at least two axes.

    Parameters
    ----------
    a : (..., M, N) float
    b : (..., N, P) float
        N is short.

    Returns
    -------
    (..., M, P) float
    """
    a, b = np.asarray(a), np.asarray(b)
    total: Array = a[..., :, 0, None] * b[..., None, 0, :]
    for i in range(1, a.shape[-1]):
        total += a[..., :, i, None] * b[..., None, i, :]
    return total


def apply(matrices: ArrayLike, vectors: ArrayLike) -> Array:
    """Matrices times vectors.

    Parameters
    ----------
    matrices : (..., M, N) float
        N is short.
    vectors : (..., N) float

    Returns
    -------
    (..., M) float
    """
    matrices, vectors = np.asarray(matrices), np.asarray(vectors)
    total: Array = matrices[..., 0] * vectors[..., 0, None]
    for i in range(1, matrices.shape[-1]):
        total += matrices[..., i] * vectors[..., i, None]
    return total
