"""Proportions far from the middle, which few objects of a family have: a flat draw would make most objects odd."""

import numpy as np

from artsim.common.elementary import arccos, arcsin, cos, sin
from artsim.making.draws import Draws
from artsim.making.outlines import Vector


def unusual_sides(draws: Draws, low: Vector, high: Vector, least: Vector) -> tuple[float, float, float]:
    """Depth, width and height of a box, metres, one of which is near the end of its range.

    ``low`` and ``high`` are the smallest and largest share of each side in the diagonal. The box is up to a third
    larger than the metres ask for that each side needs at least.
    """
    sides = ["depth", "width", "height"]
    axis = sides.index(draws.pick("unusual_side", sides))
    b, c = (k for k in range(3) if k != axis)
    near, small = draws.number("near_end", (0.0, 0.2)), draws.chance("unusually_small", 0.5)
    value = low[axis] * (1.0 + near) if small else high[axis] - near * (1.0 - high[axis])
    rest = float(np.sqrt(1.0 - value * value))
    # Angle of the other two sides in their plane.
    first = max(arccos(min(high[b] / rest, 1.0)), arcsin(min(low[c] / rest, 1.0)))
    last = min(arccos(min(low[b] / rest, 1.0)), arcsin(min(high[c] / rest, 1.0)))
    angle = draws.angle("other_sides", (first, last)) if first < last else 0.5 * (first + last)
    shares = np.empty(3)
    shares[[axis, b, c]] = value, rest * cos(angle), rest * sin(angle)
    depth, width, height = shares * (np.asarray(least) / shares).max() * draws.number("unusual_scale", (1.0, 1.3))
    return float(depth), float(width), float(height)
