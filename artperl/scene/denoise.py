"""Depth within a mask, without most of its noise: what a full image knows more of an object than a sparse cloud."""

import numpy as np
from numpy.typing import NDArray

_REACH = 3
"""Pixels to each side: a mean of 49 readings has a seventh of their noise, and a part is wider than seven pixels."""
_SAME = 0.012
"""Of the depth: readings that differ less may lie on one surface. Noise of stereo cameras at 1 m is a third of it."""
_ALONE = 0.3
"""Of a window's pixels in the mask: a reading with fewer near its depth is a flying pixel between two surfaces."""


def denoise(depth: NDArray[np.float64], mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Depth of an object, each reading replaced by the mean of those around it on the same surface (a sigma filter).

    Parameters
    ----------
    depth : (H, W) float
        Metres; 0, or not finite, where nothing was measured.
    mask : (H, W) bool
        Of the object: nothing outside it counts.

    Returns
    -------
    (H, W) float
        0 outside the mask, and for readings that few others agree with.

    Notes
    -----
    The sigma filter is of Lee, "Digital image smoothing and the sigma filter", 1983. On a plane the mean of 1 / z is
    exact, so that slanted surfaces keep their slope.
    """
    seen = mask & np.isfinite(depth) & (depth > 0)
    result = np.zeros(depth.shape)
    if not seen.any():
        return result
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    window = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    inside = np.pad(seen[window], _REACH)
    inverse = np.pad(np.where(seen[window], 1.0 / np.where(seen[window], depth[window], 1.0), 0.0), _REACH)
    own = inverse[_REACH:-_REACH, _REACH:-_REACH]
    total, near, around = np.zeros_like(own), np.zeros_like(own), np.zeros_like(own)
    height, width = own.shape
    for down in range(2 * _REACH + 1):
        for right in range(2 * _REACH + 1):
            there = np.s_[down : down + height, right : right + width]
            same = inside[there] & (np.abs(inverse[there] - own) < _SAME * own)
            total += np.where(same, inverse[there], 0.0)
            near += same
            around += inside[there]
    kept = seen[window] & (near > _ALONE * around)
    result[window] = np.where(kept, near / np.where(kept, total, 1.0), 0.0)
    return result
