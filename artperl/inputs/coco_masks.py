"""Masks as COCO writes them: run lengths, compressed or not, and polygons."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

Mask = NDArray[np.bool_]

_MAX_CORNERS = 100_000
"""Of the polygons of a mask."""
_MAX_LETTERS = 400_000
"""Of compressed run lengths, which Python reads a million of in a second: twenty times those of a ragged mask."""
_OUTSIDE = 2.0
"""Pixels that a corner may lie outside the image: detectors round."""


def decode_segmentation(segmentation: object, width: int, height: int) -> Mask:
    """(H, W) mask of one entry ``segmentation``.

    Parameters
    ----------
    segmentation : object
        ``{"size": [H, W], "counts": text or list}``, or a list of polygons ``[x, y, x, y, ...]`` in pixels, 0 being the
        left and upper border of the image.
    width, height : int
        Of the image.

    Raises
    ------
    ValueError
        When it is neither, or is not of this image.
    """
    if isinstance(segmentation, Mapping):
        size = segmentation.get("size")
        if size != [height, width]:
            raise ValueError(f"its mask is of an image of {_size(size)}, not {width} x {height}")
        counts = segmentation.get("counts")
        runs = _uncompress(counts) if isinstance(counts, str) else counts
        return _of_runs(runs, width, height)
    if isinstance(segmentation, Sequence) and not isinstance(segmentation, str):
        return _of_polygons(segmentation, width, height)
    raise ValueError("its segmentation is neither run lengths nor polygons")


def _size(size: object) -> str:
    return f"{size[1]} x {size[0]}" if isinstance(size, list) and len(size) == 2 else f"{size!r:.40}"


def _uncompress(text: str) -> list[int]:
    """Run lengths of COCO's letters; inverse of :func:`artsim.formats.coco.run_lengths`."""
    if len(text) > _MAX_LETTERS:
        raise ValueError(f"its run lengths have {len(text):,} letters, over the limit of {_MAX_LETTERS:,}")
    runs: list[int] = []
    value = shift = 0
    for letter in text.encode("ascii", "replace"):
        code = letter - 48
        if not 0 <= code < 64 or shift > 60:
            raise ValueError("its run lengths are damaged")
        value |= (code & 31) << shift
        shift += 5
        if not code & 32:
            if code & 16:  # the highest bit written is the sign
                value -= 1 << shift
            runs.append(value + runs[-2] if len(runs) > 2 else value)
            value = shift = 0
    if shift:
        raise ValueError("its run lengths are cut short")
    return runs


def _of_runs(runs: object, width: int, height: int) -> Mask:
    if not isinstance(runs, list) or not all(type(run) is int and run >= 0 for run in runs):
        raise ValueError("its run lengths are no list of whole numbers from 0")
    if sum(runs) != width * height:
        raise ValueError(f"its run lengths cover {sum(runs)} pixels of {width * height}")
    inside = np.arange(len(runs)) % 2 == 1
    return np.repeat(inside, np.array(runs, dtype=np.int64)).reshape(width, height).T


def _of_polygons(polygons: Sequence[Any], width: int, height: int) -> Mask:
    if not polygons or sum(len(p) if isinstance(p, list) else 1 for p in polygons) > 2 * _MAX_CORNERS:
        raise ValueError("its segmentation has no polygon, or too many corners")
    canvas = Image.new("1", (width, height))
    draw = ImageDraw.Draw(canvas)
    for polygon in polygons:
        if not isinstance(polygon, list) or len(polygon) < 6 or len(polygon) % 2:
            raise ValueError("a polygon is no list of three or more pairs x, y")
        if not all(type(value) in (int, float) and np.isfinite(value) for value in polygon):
            raise ValueError("a polygon holds something else than numbers")
        corners = np.array(polygon, dtype=np.float64).reshape(-1, 2)
        if (corners < -_OUTSIDE).any() or (corners > np.add((width, height), _OUTSIDE)).any():
            raise ValueError(f"a polygon reaches outside the image of {width} x {height}")
        # Pillow counts from the middle of the first pixel, COCO from its corner.
        draw.polygon([(float(x), float(y)) for x, y in corners - 0.5], fill=1)
    return np.asarray(canvas, dtype=bool)
