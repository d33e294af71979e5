"""What a camera sees of one object."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artsim.common.tables import brief

BACKGROUND = 255
"""Part id of pixels that show no part."""


@dataclass(frozen=True, eq=False)
class Frame:
    """What a camera sees of one object.

    Attributes
    ----------
    depth : (H, W) float32
        z-depth in metres, 0 = no return.
    part_ids : (H, W) uint8
        Index of the part seen at each pixel; ``BACKGROUND`` where none is.
    amodal_pixels : (K,) int64 or None
        Pixels that each part would cover if nothing hid it, where the renderer knows.
    rgb : (H, W, 3) uint8 or None
        Colour, where the renderer makes it.
    """

    depth: NDArray[np.float32]
    part_ids: NDArray[np.uint8]
    amodal_pixels: NDArray[np.int64] | None = None
    rgb: NDArray[np.uint8] | None = None

    __repr__ = brief
