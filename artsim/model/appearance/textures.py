"""Procedural textures: pictures of wood, stone, fabric and the like that repeat without a seam."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.model.kinematics import Array

Image = NDArray[np.uint8]
"""(H, W, 3) sRGB, row 0 on top."""

SIZE = 512
"""Pixels along each side of a texture."""


def noise(
    rng: np.random.Generator, size: int = SIZE, slope: float = 1.5, stretch: tuple[float, float] = (1.0, 1.0)
) -> Array:
    """Noise with a power-law spectrum: mean 0, standard deviation 1, the same on opposite borders.

    Parameters
    ----------
    rng : numpy Generator
    size : int
    slope : float
        The amplitude falls with this power of the frequency: 0 is white, 2 is cloudy.
    stretch : 2 float
        Length of its features across and down the picture, relative to each other.

    Returns
    -------
    (size, size) float
    """
    frequency = np.fft.fftfreq(size) * size
    radius = np.hypot(frequency[None, :] * stretch[0], frequency[:, None] * stretch[1])
    radius[0, 0] = np.inf
    spectrum = np.fft.fft2(rng.standard_normal((size, size))) * radius**-slope
    values: Array = np.fft.ifft2(spectrum).real
    return values / values.std()


def wood(rng: np.random.Generator, tone: ArrayLike, rings: int = 9, size: int = SIZE) -> Image:
    """Boards sawn along the grain, which runs across the picture."""
    down = np.arange(size)[:, None] / size
    bend = 0.045 * noise(rng, size, 2.0, (7.0, 1.0)) + 0.008 * noise(rng, size, 1.4, (12.0, 1.0))
    ring = 0.5 + 0.5 * np.sin(2.0 * np.pi * rings * (down + bend))
    fibre = noise(rng, size, 0.7, (40.0, 1.0))
    light = 1.0 - 0.16 * ring**3 + 0.05 * fibre + 0.05 * noise(rng, size, 1.8, (6.0, 1.0))
    return _image(tone, light, warmth=0.35)


def parquet(rng: np.random.Generator, tone: ArrayLike, rows: int = 6, size: int = SIZE) -> Image:
    """Floor boards, each of a piece of wood of its own, in rows that are set off against each other."""
    picture = np.empty((size, size, 3), dtype=np.uint8)
    edges = np.linspace(0, size, rows + 1).astype(int).tolist()
    for top, bottom in pairwise(edges):
        cut = int(rng.integers(size))
        for start, end in ((cut, cut + size // 2), (cut + size // 2, cut + size)):
            shade = np.asarray(tone, dtype=np.float64) * rng.uniform(0.86, 1.08)
            board = wood(rng, shade.clip(0.0, 1.0), 4, size // 2)
            columns = np.arange(start, end) % size
            picture[top:bottom, columns] = board[: bottom - top, : len(columns)]
            picture[top:bottom, columns[:2]] = picture[top:bottom, columns[:2]] // 2
        picture[top : top + 2] = picture[top : top + 2] // 2
    return picture


def stone(rng: np.random.Generator, tone: ArrayLike, size: int = SIZE) -> Image:
    """Polished stone: clouds, veins and grains."""
    veins = np.exp(-np.abs(noise(rng, size, 1.9)) / 0.035)
    light = 1.0 + 0.06 * noise(rng, size, 1.6) + 0.035 * noise(rng, size, 0.3) - rng.uniform(0.0, 0.35) * veins
    return _image(tone, light)


def plaster(rng: np.random.Generator, tone: ArrayLike, size: int = SIZE) -> Image:
    """A painted wall: almost one colour."""
    return _image(tone, 1.0 + 0.008 * noise(rng, size, 1.5) + 0.006 * noise(rng, size, 0.4))


def fabric(rng: np.random.Generator, tone: ArrayLike, threads: int = 64, size: int = SIZE) -> Image:
    """Woven cloth or carpet."""
    phase = 2.0 * np.pi * threads * np.arange(size) / size
    weave = np.where(np.sin(phase / 2)[:, None] * np.sin(phase / 2)[None, :] > 0, np.sin(phase)[:, None], np.sin(phase))
    return _image(tone, 1.0 + 0.08 * weave + 0.06 * noise(rng, size, 0.4) + 0.03 * noise(rng, size, 1.8))


def tiles(rng: np.random.Generator, tone: ArrayLike, count: int = 4, size: int = SIZE) -> Image:
    """Square ceramic tiles with joints between them."""
    side = size // count
    shade = np.kron(rng.uniform(0.95, 1.04, (count, count)), np.ones((side, side)))
    picture = _image(tone, shade[:size, :size] + 0.012 * noise(rng, count * side, 1.4))
    joint = max(2, side // 48)
    offset = np.arange(count * side) % side < joint
    picture[offset] = picture[:, offset] = (0.6 * np.array([205, 202, 196])).astype(np.uint8)
    return picture


def card(rng: np.random.Generator, tone: ArrayLike, size: int = SIZE) -> Image:
    """Cardboard: faint flutes and flecks."""
    return _image(tone, 1.0 + 0.02 * noise(rng, size, 0.4, (30.0, 1.0)) + 0.02 * noise(rng, size, 0.8))


def brushed(rng: np.random.Generator, tone: ArrayLike, size: int = SIZE) -> Image:
    """Metal brushed along the picture."""
    return _image(tone, 1.0 + 0.035 * noise(rng, size, 0.5, (80.0, 1.0)))


def screen(rng: np.random.Generator, tone: ArrayLike, size: int = SIZE) -> Image:
    """A display that shows a few windows before a coloured ground; does not repeat."""
    across, down = np.meshgrid(np.linspace(0, 1, size), np.linspace(0, 1, size))
    ends = np.stack([np.asarray(tone, dtype=np.float64), rng.uniform(0.05, 0.6, 3)])
    blend = (0.5 + 0.5 * np.sin(2.0 * (across * rng.uniform(0.5, 2) + down + 0.15 * noise(rng, size, 2.2))))[..., None]
    picture = 255.0 * (blend * ends[0] + (1.0 - blend) * ends[1])
    for _ in range(int(rng.integers(1, 3))):
        left, top = (rng.uniform(0.05, 0.45, 2) * size).astype(int)
        right, bottom = left + int(rng.uniform(0.3, 0.5) * size), top + int(rng.uniform(0.3, 0.48) * size)
        picture[top:bottom, left:right] = rng.choice([242.0, 38.0])
        ink = 90.0 if picture[top, left, 0] > 128 else 190.0
        picture[top : top + size // 40, left:right] = 130.0
        for line in range(top + size // 18, bottom - size // 40, size // 36):
            picture[line : line + 4, left + 12 : left + int((right - left) * rng.uniform(0.4, 0.92))] = ink
    picture[-size // 26 :] *= 0.45
    return picture.clip(0, 255).astype(np.uint8)


Maker = Callable[[np.random.Generator, ArrayLike], Image]

TEXTURES: dict[str, Maker] = {
    maker.__name__: maker for maker in (wood, parquet, stone, plaster, fabric, tiles, card, brushed, screen)
}
"""Every texture by name: each drawn from a generator and a tone (3,) in sRGB, 0 to 1."""


def _image(tone: ArrayLike, light: Array, warmth: float = 0.0) -> Image:
    """A tone, darker and lighter; dark places turn redder with ``warmth``."""
    channels = np.asarray(tone, dtype=np.float64) * light[..., None]
    channels[..., 2] *= 1.0 - warmth * (1.0 - light).clip(0.0, 1.0)
    return (255.0 * channels.clip(0.0, 1.0)).round().astype(np.uint8)
