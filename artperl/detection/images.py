"""What the detector's network looks at: an image with depth as channels that do not depend on the unit of length.

Depth is divided by its median, so that a doll's house looks as a house does. The plane that most of the image lies on,
a table mostly, is taken out of the inverse depth: what stands on it stays.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image
from scipy.ndimage import distance_transform_edt

from artsim.model.camera import Camera

Array = NDArray[np.float32]

CHANNELS = 8
"""Colour (3), inverse depth, inverse depth over the plane, whether depth was measured, x and y of the ray."""
WIDTH = 640
"""Columns that the network learns from: half of those of a common depth camera, four times those of its answer."""
LOOK_WIDTH = 960
"""Columns in which it looks for objects: they are larger than those that it has learnt from, and thin ones show. With
as many columns as in training, it finds a tenth less (docs/experiments.md)."""
CELL = 4
"""Pixels of the network's image along a cell of its answer."""
_TRIES = 64
"""Planes through three pixels that are tried: of a plane that half of the image lies on, one in eight is one."""
_SAMPLE = 2048
"""Pixels that vote for a plane."""
_ON_PLANE = 0.012
"""Share of its depth by which a pixel of the plane may be off: two to three times a D435's noise."""
_ABOVE = 10.0
"""Times that what stands out of the plane is enlarged: a box 6 cm high, seen from 0.6 m, comes to about 1."""


@dataclass(frozen=True, eq=False)
class Look:
    """An image as the network sees it."""

    channels: Array
    """(8, H, W) float32."""
    points: Array
    """(H, W, 3) float32. Camera frame, metres; where nothing was measured, as far away as the nearest pixel that
    was."""
    unit: float
    """Median depth in metres: lengths that the network tells are in this unit."""


def look_at(rgb: NDArray[np.uint8] | None, depth: ArrayLike, K: ArrayLike, width: int = LOOK_WIDTH) -> Look:
    """An image, made smaller, as the network sees it.

    Parameters
    ----------
    rgb : (H, W, 3) uint8 or None
        Of the depth image's size. Without colour its channels are 0.
    depth : (H, W) float
        Metres along the camera's axis; 0, or not finite, where nothing was measured. Some pixel must have a depth.
    K : (3, 3) float
        Intrinsic matrix in pixels; the centre of the first pixel is at (0.5, 0.5).
    width : int
        Columns that it is made smaller to; a smaller image stays as it is.
    """
    depth, K = np.asarray(depth, dtype=np.float32), np.asarray(K, dtype=np.float64)
    rows, columns = depth.shape
    share = min(width / columns, 1.0)
    shape = max(round(rows * share), 1), max(round(columns * share), 1)
    # Readings are picked, not averaged: a mean over an edge is a point where nothing is.
    pick = [np.minimum(((np.arange(n) + 0.5) * whole / n).astype(int), whole - 1)
            for n, whole in zip(shape, (rows, columns), strict=True)]  # fmt: skip
    small = depth[np.ix_(*pick)]
    measured = np.isfinite(small) & (small > 0)
    filled = fill(small, measured)
    unit = float(np.median(filled))
    pixels = pick[0][:, None] * columns + pick[1]
    rays = Camera(K, columns, rows, np.eye(4)).directions(pixels.ravel()).reshape(*shape, 3).astype(np.float32)
    inverse = unit / filled - 1.0
    channels = np.zeros((CHANNELS, *shape), dtype=np.float32)
    if rgb is not None:
        image = np.asarray(Image.fromarray(np.asarray(rgb)[..., :3]).resize(shape[::-1], Image.Resampling.BOX))
        channels[:3] = np.moveaxis(image.astype(np.float32) / 127.5 - 1.0, -1, 0)
    channels[3] = np.clip(inverse, -1.0, 3.0)
    channels[4] = np.clip(_ABOVE * (inverse - plane_of(inverse, measured)), -3.0, 3.0)
    channels[5] = measured
    channels[6:] = np.moveaxis(rays[..., :2], -1, 0)
    return Look(channels, rays * filled[..., None], unit)


def cell_pixels(size: int) -> NDArray[np.int64]:
    """(ceil(size / 4),) the pixel at the middle of each cell along a side of so many pixels."""
    return np.minimum(np.arange(-(-size // CELL)) * CELL + CELL // 2, size - 1)


def fill(depth: Array, measured: NDArray[np.bool_]) -> Array:
    """Depth (H, W) with that of the nearest measured pixel where nothing was measured."""
    if measured.all() or not measured.any():
        return depth if measured.any() else np.ones_like(depth)
    near = distance_transform_edt(~measured, return_distances=False, return_indices=True)
    return np.asarray(depth[tuple(near)])


def plane_of(inverse: Array, measured: NDArray[np.bool_]) -> Array:
    """(H, W) of the plane that most pixels lie on: inverse depth of a plane is linear over an image.

    RANSAC (Fischler and Bolles 1981) over a fixed choice of pixels, then least squares over those that agree. Pixels
    count by the square of their inverse depth, so that a table wins over the larger wall behind it.

    Parameters
    ----------
    inverse : (H, W) float
        Median depth over depth, less 1.
    measured : (H, W) bool
    """
    rows, columns = inverse.shape
    v, u = np.mgrid[-1.0 : 1.0 : rows * 1j, -1.0 : 1.0 : columns * 1j]
    basis = np.stack([np.ones_like(u), u, v], axis=-1)
    rng = np.random.default_rng(0)
    seen = np.flatnonzero(measured)
    if len(seen) < 3:
        return np.zeros_like(inverse)
    seen = rng.choice(seen, _SAMPLE)
    A, b = basis.reshape(-1, 3)[seen], inverse.ravel()[seen].astype(np.float64)
    near = 1.0 + b
    trios = rng.integers(len(seen), size=(_TRIES, 3))
    corners = A[trios]
    sound = np.abs(np.linalg.det(corners)) > 1e-3  # three pixels of one line tell no plane
    if not sound.any():
        return np.zeros_like(inverse)
    planes = np.linalg.solve(corners[sound], b[trios[sound]][..., None])[..., 0]
    agree = np.abs(planes @ A.T - b) < _ON_PLANE * near
    best = agree[(agree * near**2).sum(axis=1).argmax()]
    plane = np.linalg.lstsq(A[best], b[best], rcond=None)[0]
    return np.asarray(basis @ plane, dtype=np.float32)
