"""Images as the bytes of PNG files, boxes of masks, and intrinsics for programs that count pixel centres from 0."""

import numpy as np
from numpy.typing import NDArray

from artsim.datasets.shards import png_bytes as png_bytes
from artsim.model.kinematics import Array

_LARGEST = 65535
_FINEST = 1e-6
"""Metres: what single precision resolves at some metres."""


def mask_png(mask: NDArray[np.bool_]) -> bytes:
    """(H, W) mask as PNG: 255 inside, 0 outside."""
    return png_bytes(mask.astype(np.uint8) * np.uint8(255))


def depth_png(depth: NDArray[np.float32]) -> tuple[bytes, float]:
    """A depth image as PNG of 16 bits, as finely as it fits.

    Parameters
    ----------
    depth : (H, W) float32
        Metres, 0 = no return.

    Returns
    -------
    data : bytes
        0 = no return, here too.
    unit : float
        Metres that 1 stands for: a power of ten. No depth is off by more than half of it.
    """
    farthest = float(depth.max(initial=0.0))
    steps = np.maximum(np.ceil(np.log10(max(farthest, _FINEST) / _LARGEST / _FINEST)), 0)
    unit = float(f"1e{int(steps) - 6}")
    if np.rint(farthest / unit) > _LARGEST:  # the logarithm was rounded
        unit *= 10.0
    values = np.rint(depth.astype(np.float64) / unit)
    values[depth > 0] = np.maximum(values[depth > 0], 1)  # what is seen stays seen
    return png_bytes(values.astype(np.uint16)), unit


def grey_depth(depth: NDArray[np.float32]) -> NDArray[np.uint8]:
    """(H, W) depth as grey: near is bright, no return is black."""
    seen = depth > 0
    grey = np.zeros(depth.shape, np.uint8)
    if seen.any():
        near, far = float(depth[seen].min()), float(depth[seen].max())
        share = (far - depth[seen]) / max(far - near, 1e-9)
        grey[seen] = np.rint(55.0 + 200.0 * share).astype(np.uint8)
    return grey


def mask_box(mask: NDArray[np.bool_]) -> tuple[int, int, int, int] | None:
    """First column and row, end column and row of a mask; None where it is empty."""
    rows, columns = mask.any(axis=1).nonzero()[0], mask.any(axis=0).nonzero()[0]
    return (int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1) if len(rows) else None


def integer_centre_K(K: Array) -> Array:
    """(3, 3) intrinsics under which pixel (u, v) has its centre at (u, v), as in OpenCV.

    In artsim the centre lies at (u + 0.5, v + 0.5), so that the principal point moves by half a pixel.
    """
    moved: Array = np.array([[1.0, 0.0, -0.5], [0.0, 1.0, -0.5], [0.0, 0.0, 1.0]]) @ K
    return moved
