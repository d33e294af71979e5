"""Intrinsics for programs that count pixel centres from whole numbers."""

from __future__ import annotations

import numpy as np

from artsim.model.kinematics import Array


def integer_centre_K(K: Array) -> Array:
    """(3, 3) intrinsics under which pixel (u, v) has its centre at (u, v), as in OpenCV.

    In artsim the centre lies at (u + 0.5, v + 0.5), so that the principal point moves by half a pixel.
    """
    shift = np.array([[1.0, 0.0, -0.5], [0.0, 1.0, -0.5], [0.0, 0.0, 1.0]])
    moved: Array = shift @ K
    return moved
