"""Scenes as a detector learns from them: an image, and for each cell of 4 x 4 pixels what is true of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.utils.data import Dataset

from artperl.detection.images import CELL, cell_pixels, look_at
from artperl.detection.network import OFFSET
from artsim.observing.annotation import box_corners
from artsim.scenes import SceneDataset, SceneRecord

_ZOOM = (0.75, 1.5)
"""Shares of the focal length that crops and borders change it to: other cameras, other distances."""
_COLOURLESS = 0.4
"""Share of images in colour that lose it: a detector has to do without where there is none."""
_WINDOWS = 2
"""On each image: to make one takes as long as to learn from two windows."""
_WINDOW_CELLS = (48, 80)
"""Rows and columns of cells of a window, a quarter of an image of 640 x 360."""
_GAIN = 0.3
"""By which brightness and each colour change: other lamps, other cameras."""
_USUAL, _OF_USUAL, _WEIGHTS = 200.0, 3.0, (1.0, 8.0)
"""Cells of a usual object; what each of them counts, where one of the background, of which there are twelve times as
many, counts 1; and the bounds of what a cell of a larger or smaller object counts."""


@dataclass(frozen=True)
class Cells:
    """Images, and what is true of their cells."""

    channels: Tensor
    """(B, 8, H, W) float32."""
    category: Tensor
    """(B, h, w) int64. Number of the category, from 1; 0 for none."""
    offset: Tensor
    """(B, 3, h, w) float32. To the middle of the object, as the network tells it."""
    size: Tensor
    """(B, h, w) float32. Logarithm of the object's diagonal over the unit."""
    weight: Tensor
    """(B, h, w) float32. Of the cell: small objects count as much as large ones."""


class SceneCells(Dataset[Cells]):
    """Batches of windows on fresh looks at the views of scenes; batch i is the same whenever it is asked for.

    A window has an object near its middle: most of a whole image is wall and table, which is soon learnt. What the
    network sees in a window is what it sees there in the whole image.

    Parameters
    ----------
    folders : sequence of Path
        That ``artsim scene`` wrote.
    categories : sequence of str
        That are learnt; other objects are background.
    batch_size : int
    seed : int
    width : int
        Columns of an image.
    """

    def __init__(self, folders: Sequence[Path], categories: Sequence[str], batch_size: int, seed: int, width: int):
        self.folders, self.categories = tuple(folders), tuple(categories)
        self.batch_size, self.seed, self.width = batch_size, seed, width
        self._sets: list[SceneDataset] | None = None

    def __getitem__(self, batch: int) -> Cells:
        sets = self._sets = self._sets or [SceneDataset(folder) for folder in self.folders]  # in each process its own
        places = [(which, view) for which, scenes in enumerate(sets) for view in range(len(scenes))]
        windows, images = list[tuple[Any, ...]](), -(-self.batch_size // _WINDOWS)
        for number in range(batch * images, (batch + 1) * images):
            epoch, turn = divmod(number, len(places))
            order = np.random.default_rng([self.seed, 0, epoch]).permutation(len(places))
            which, view = places[order[turn]]
            rng = np.random.default_rng([self.seed, 1, number])
            look = _look(sets[which][view], self.categories, self.width, rng)
            windows += [_window(look, rng) for _ in range(_WINDOWS)]
        fields = zip(*windows[: self.batch_size], strict=True)
        return Cells(*(torch.from_numpy(np.stack(values)) for values in fields))


def _look(record: SceneRecord, categories: Sequence[str], width: int, rng: np.random.Generator) -> tuple[Any, ...]:
    """One image, zoomed, mirrored and lit by chance, and its cells, as the fields of :class:`Cells`."""
    rows, columns = record.depth.shape
    zoom = float(np.exp(rng.uniform(*np.log(_ZOOM))))
    high, wide = (max(round(n / zoom), 8) for n in (rows, columns))
    top, left = (int(rng.integers(min(0, n - m), max(0, n - m) + 1)) for n, m in ((rows, high), (columns, wide)))
    mirrored, colourless = (bool(rng.random() < share) for share in (0.5, _COLOURLESS))
    gain = rng.uniform(1 - _GAIN, 1 + _GAIN, 4)

    def seen(image: NDArray[Any], outside: float) -> NDArray[Any]:
        """The window of an image, at the network's resolution, readings picked."""
        own = _crop(image, (top, left, high, wide), outside)
        own = own[:, ::-1] if mirrored else own
        return own[_pick((high, wide), (round(width * rows / columns), width))]

    depth, ids = seen(record.depth, 0), seen(record.instance_ids, 255)
    rgb = None if record.rgb is None or colourless else _lit(seen(record.rgb, 127), gain)
    K = record.camera.K.copy()
    K[0, 2], K[1, 2] = K[0, 2] - left, K[1, 2] - top
    if mirrored:
        K[0, 2] = wide - K[0, 2]
    K = np.diag([depth.shape[1] / wide, depth.shape[0] / high, 1.0]) @ K
    look = look_at(rgb, depth, K, width)
    cells = np.ix_(*(cell_pixels(n) for n in depth.shape))
    return look.channels, *_truth(record, categories, ids[cells], look.points[cells], look.unit, mirrored)


def _truth(
    record: SceneRecord, categories: Sequence[str], ids: NDArray[np.uint8], points: NDArray[np.float32], unit: float,
    mirrored: bool,
) -> tuple[Any, ...]:  # fmt: skip
    """What is true of cells that show these instances at these points."""
    category, weight = np.zeros(ids.shape, np.int64), np.ones(ids.shape, np.float32)
    offset, size = np.zeros((*ids.shape, 3), np.float32), np.zeros(ids.shape, np.float32)
    for i, (told, sample) in enumerate(zip(record.entry.objects, record.samples, strict=True)):
        own = ids == i
        if told.category not in categories or sample is None or not own.any():
            continue
        corners = np.concatenate([box_corners(sample, k) for k in range(len(sample.box_size))])
        middle = corners.mean(axis=0) * (-1.0 if mirrored else 1.0, 1.0, 1.0)
        category[own] = 1 + categories.index(told.category)
        offset[own] = (middle - points[own]) / (OFFSET * unit)
        size[own] = np.log(np.linalg.norm(np.ptp(corners, axis=0)) / unit)
        weight[own] = np.clip(_OF_USUAL * np.sqrt(_USUAL / own.sum()), *_WEIGHTS)
    return category, np.moveaxis(offset, -1, 0), size, weight


def _window(look: tuple[Any, ...], rng: np.random.Generator) -> tuple[Any, ...]:
    """A part of the fields of :class:`Cells` of one image, about some cell of some object."""
    channels, category = look[:2]
    rows, columns = category.shape
    high, wide = (min(n, most) for n, most in zip((rows, columns), _WINDOW_CELLS, strict=True))
    there = np.flatnonzero(category)
    middle = divmod(int(rng.choice(there)) if len(there) else int(rng.integers(category.size)), columns)
    top, left = (
        int(np.clip(at + rng.integers(-size // 3, size // 3 + 1) - size // 2, 0, whole - size))
        for at, size, whole in zip(middle, (high, wide), (rows, columns), strict=True)
    )
    pixels = channels[:, CELL * top : CELL * (top + high), CELL * left : CELL * (left + wide)]
    return pixels, *(field[..., top : top + high, left : left + wide] for field in look[1:])


def _lit(rgb: NDArray[np.uint8], gain: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.clip(rgb * (gain[:3] * gain[3]), 0, 255).astype(np.uint8)


def _crop(image: NDArray[Any], window: tuple[int, int, int, int], outside: float) -> NDArray[Any]:
    """A window of an image, which may reach over its border."""
    top, left, high, wide = window
    found = np.full((high, wide, *image.shape[2:]), outside, dtype=image.dtype)
    rows, columns = image.shape[:2]
    a, b = slice(max(top, 0), min(top + high, rows)), slice(max(left, 0), min(left + wide, columns))
    found[a.start - top : a.stop - top, b.start - left : b.stop - left] = image[a, b]
    return found


def _pick(shape: tuple[int, int], wanted: tuple[int, int]) -> tuple[NDArray[np.int64], ...]:
    """Index of the pixels at the middles of those of another resolution."""
    return np.ix_(*(((np.arange(n) + 0.5) * whole / n).astype(int) for n, whole in zip(wanted, shape, strict=True)))
