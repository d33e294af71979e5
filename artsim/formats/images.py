"""Images as the bytes of PNG files."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

_LARGEST = 65535
_FINEST = 1e-6
"""Metres: what single precision resolves at some metres."""


def png_bytes(image: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """(H, W) or (H, W, 3) image as PNG."""
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "PNG")
    return buffer.getvalue()


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
