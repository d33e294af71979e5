"""Steps of a depth sensor's noise, and the noise-free scene that they read.

A step sees the scene around each pixel through a :data:`Look`, so that it works on whole depth images and on a few
rays alike; what chance decides at a pixel depends on a key and the pixel alone, so that both give the same readings.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.elementary import arccos, cos, log, tan
from artsim.common.products import norm
from artsim.model.camera import Camera
from artsim.model.kinematics import Array

Look = Callable[[NDArray[np.int64], NDArray[np.int64]], tuple[NDArray[np.float32], NDArray[np.uint8]]]
"""What stands at some pixels, by row and column: depth (N,), 0 where nothing does, and part ids (N,)."""

Index = slice | NDArray[np.int64]

_SAME_SURFACE = 0.02  # share of the depth by which neighbours on one surface differ at most
_MAX_INCIDENCE = np.deg2rad(85.0)  # the formulae diverge at grazing incidence; no device was measured beyond


class PixelView:
    """Some pixels of a noise-free scene, and what chance decides at each of them.

    Parameters
    ----------
    look : Look
        The noise-free scene; is asked for pixels in any order.
    camera : Camera
    row, column : (N,) int
    depth : (N,) float
        Noise-free z-depth there, 0 where nothing stands.
    key : int
        Of all chance: the same key gives the same noise at the same pixel.
    """

    def __init__(
        self,
        look: Look,
        camera: Camera,
        row: NDArray[np.int64],
        column: NDArray[np.int64],
        depth: ArrayLike,
        key: int,
    ):
        self.camera, self.row, self.column = camera, row, column
        self.depth: Array = np.asarray(depth, dtype=np.float64)
        self._look, self._key = look, key

    def depth_at(self, row: NDArray[np.int64], column: NDArray[np.int64]) -> Array:
        """Noise-free depth at other pixels, in any order; NaN outside the image."""
        inside = (row >= 0) & (row < self.camera.height) & (column >= 0) & (column < self.camera.width)
        depth = np.full(row.shape, np.nan)
        depth[inside] = self._look(row[inside], column[inside])[0]
        return depth

    @cached_property
    def patch(self) -> Array:
        """(3, 3, N) noise-free depth of the pixels around: infinite where nothing stands, NaN outside the image."""
        offset = np.arange(-1, 2)
        row = np.broadcast_to(self.row + offset[:, None, None], (3, 3, len(self.row)))
        column = np.broadcast_to(self.column + offset[None, :, None], row.shape)
        depth = self.depth_at(row, column)
        return np.where(depth == 0, np.inf, depth)

    @cached_property
    def incidence(self) -> Array:
        """(N,) angle in radians between the ray and the surface's normal; 0 where nothing stands."""
        # On a plane 1/z is an affine function of the image position, whose coefficients are the plane's normal.
        # Beside an edge the two sides differ: the flatter one belongs to the surface seen.
        inverse = np.where(self.depth > 0, 1.0 / np.where(self.depth > 0, self.depth, 1.0), 0.0)
        around = 1.0 / self.patch
        slope_x = _flatter(around[1, 2] - inverse, inverse - around[1, 0]) * self.camera.K[0, 0]
        slope_y = _flatter(around[2, 1] - inverse, inverse - around[0, 1]) * self.camera.K[1, 1]
        ray = self.camera.directions(self.row * self.camera.width + self.column)
        constant = inverse - slope_x * ray[:, 0] - slope_y * ray[:, 1]
        normal = np.stack([slope_x, slope_y, constant], axis=-1)
        length = norm(normal) * norm(ray)
        cosine = np.where(length > 0, inverse / np.where(length > 0, length, 1.0), 1.0)
        return arccos(np.clip(cosine, 0.0, 1.0))

    @cached_property
    def _pixel(self) -> NDArray[np.uint64]:
        return (self.row * self.camera.width + self.column).astype(np.uint64)

    def uniform(self, stream: int, at: Index = slice(None)) -> Array:
        """(N,) numbers in [0, 1), independent between pixels and streams; only for the pixels ``at``, if given."""
        bits = _scramble(self._pixel[at] + np.uint64(_start(self._key, stream)))
        return (bits >> np.uint64(11)) * 2.0**-53

    def normal(self, stream: int, at: Index = slice(None)) -> Array:
        """(N,) numbers from N(0, 1), independent between pixels and streams; only for the pixels ``at``, if given."""
        # Box and Muller's transform; streams of its two uniform numbers are kept apart from those of `uniform`.
        radius = np.sqrt(-2.0 * log(1.0 - self.uniform(1000 + 2 * stream, at)))  # 1 - u is exact
        return radius * cos(2.0 * np.pi * self.uniform(1001 + 2 * stream, at))


def _flatter(one: Array, other: Array) -> Array:
    return np.where((np.abs(one) < np.abs(other)) | np.isnan(other), one, other)


@lru_cache
def _start(key: int, stream: int) -> int:
    """What is added to the pixels' numbers for a key and a stream."""
    first = _scramble(np.array([stream], dtype=np.uint64))
    return int(_scramble(first + np.array([key], dtype=np.uint64))[0])


def _scramble(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """A bijection of 64-bit numbers whose output looks random (finaliser of SplitMix64, Steele et al. 2014)."""
    with np.errstate(over="ignore"):  # wraps around on purpose
        x = x + np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


class Step(Protocol):
    """One thing that a sensor does to a depth image."""

    def read(self, view: PixelView, depth: Array, focal: float, stream: int) -> Array:
        """Depth reported after this step.

        Parameters
        ----------
        view : PixelView
        depth : (N,) float
            Reported so far; 0 = no return.
        focal : float
            Focal length of the device, pixels.
        stream : int
            The first of ten streams of chance that are this step's own.
        """
        ...

    def sigma(self, depth: Array, incidence: Array, focal: float) -> Array:
        """Standard deviation in metres that this step adds on a flat surface, by its closed form."""
        ...


@dataclass(frozen=True)
class LateralJitter:
    """Each pixel reports the depth of a place beside it. Comes first: it replaces what was read so far.

    On a surface the depth there is interpolated (1/z linearly, which is exact on planes); at edges it is that of the
    nearest pixel.
    """

    sigma_px: float
    """Standard deviation along each image axis, pixels of the device, at normal incidence."""
    grazing_px: float = 0.0
    """Added times th / (pi / 2 - th) at incidence th (Nguyen, Izadi and Lovell 2012)."""

    def read(self, view: PixelView, depth: Array, focal: float, stream: int) -> Array:
        sigma = self._sigma_px(view.incidence) if self.grazing_px else np.full(len(depth), self.sigma_px)
        sigma = sigma * (view.camera.K[0, 0] / focal)  # in the camera's own pixels
        row = view.row + sigma * view.normal(stream)
        column = view.column + sigma * view.normal(stream + 1)
        low_row, low_column = np.floor(row).astype(np.int64), np.floor(column).astype(np.int64)
        corners = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])[..., None]
        around = view.depth_at(
            np.clip(low_row + corners[:, 0], 0, view.camera.height - 1),
            np.clip(low_column + corners[:, 1], 0, view.camera.width - 1),
        )
        low, high = around.min(axis=0), around.max(axis=0)
        one_surface = (low > 0) & (high - low < _SAME_SURFACE * high)
        down, right = row - low_row, column - low_column
        weights = np.stack([(1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right])
        smooth = 1.0 / (weights / np.where(around > 0, around, 1.0)).sum(axis=0)
        nearest = np.take_along_axis(around, weights.argmax(axis=0)[None], axis=0)[0]
        return np.where(one_surface, smooth, nearest)

    def _sigma_px(self, incidence: Array) -> Array:
        incidence = np.minimum(incidence, _MAX_INCIDENCE)
        return self.sigma_px + self.grazing_px * incidence / (np.pi / 2 - incidence)

    def sigma(self, depth: Array, incidence: Array, focal: float) -> Array:
        """Of a plane tilted about an image axis, near the middle of the image."""
        return self._sigma_px(incidence) * depth * tan(incidence) / focal


@dataclass(frozen=True)
class DisparityQuantisation:
    """Depth is measured as a disparity, in steps of a fraction of a pixel."""

    step_px: float
    """Pixels of the device."""
    baseline: float
    """Metres."""

    def read(self, view: PixelView, depth: Array, focal: float, stream: int) -> Array:
        unit = focal * self.baseline / self.step_px  # disparity in steps, times depth
        steps = np.rint(unit / np.where(depth > 0, depth, np.inf))
        return np.where(steps > 0, unit / np.maximum(steps, 1.0), 0.0)

    def sigma(self, depth: Array, incidence: Array, focal: float) -> Array:
        """Of a surface that crosses several steps: that of a uniform error, one step wide."""
        return np.square(depth) * self.step_px / (focal * self.baseline * np.sqrt(12.0))


@dataclass(frozen=True)
class AxialNoise:
    """Normal noise on the depth, its standard deviation a polynomial of the depth z."""

    constant: float = 0.0
    linear: float = 0.0
    quadratic: float = 0.0
    """``constant + linear (z - start) + quadratic (z - start)^2`` metres."""
    start: float = 0.0
    """Metres; nearer surfaces are taken to lie there if ``linear`` is set."""
    grazing: float = 0.0
    """``grazing / sqrt(z) * th^2 / (pi / 2 - th)^2`` is added at incidence th above 60 degrees."""
    measured_with: DisparityQuantisation | None = None
    """An earlier step whose error is part of the standard deviation given: only the rest is added."""

    def read(self, view: PixelView, depth: Array, focal: float, stream: int) -> Array:
        incidence = view.incidence if self.grazing else np.zeros(len(depth))
        seen = np.flatnonzero(depth > 0)
        noisy = depth[seen] + self.sigma(depth[seen], incidence[seen], focal) * view.normal(stream, seen)
        reading = np.zeros_like(depth)
        reading[seen] = np.maximum(noisy, 0.0)
        return reading

    def sigma(self, depth: Array, incidence: Array, focal: float) -> Array:
        """The formula, less the share of ``measured_with``."""
        beyond = depth - self.start
        sigma = self.constant + self.linear * np.maximum(beyond, 0.0) + self.quadratic * np.square(beyond)
        if self.grazing:
            angle = np.minimum(incidence, _MAX_INCIDENCE)
            extra = self.grazing / np.sqrt(np.maximum(depth, 1e-3)) * np.square(angle / (np.pi / 2 - angle))
            sigma = sigma + np.where(angle > np.pi / 3, extra, 0.0)
        if self.measured_with is not None:
            known = self.measured_with.sigma(depth, incidence, focal)
            sigma = np.sqrt(np.maximum(np.square(sigma) - np.square(known), 0.0))
        return sigma


@dataclass(frozen=True)
class _AtEdges:
    """What happens to pixels beside a jump in depth."""

    jump: float
    """Range of the depths in the 3x3 pixels around, metres, from which it happens."""
    chance: float
    """Probability that it does."""

    def happens(self, view: PixelView, stream: int) -> tuple[NDArray[np.bool_], Array, Array]:
        """Where it does, and the nearest and farthest depth around each pixel."""
        near, far = _range(view.patch)
        return (far - near > self.jump) & (view.uniform(stream) < self.chance), near, far

    def sigma(self, depth: Array, incidence: Array, focal: float) -> Array:
        """0: flat surfaces have no edges."""
        return np.zeros_like(depth)


@dataclass(frozen=True)
class EdgeDropout(_AtEdges):
    """Pixels lose their return beside a jump in depth; an empty background counts as one."""

    def read(self, view: PixelView, depth: Array, focal: float, stream: int) -> Array:
        lost, _, _ = self.happens(view, stream)
        return np.where(lost, 0.0, depth)


@dataclass(frozen=True)
class FlyingPixels(_AtEdges):
    """Pixels beside a jump in depth mix the light of both sides: the reading, if any, lies anywhere between them."""

    reach: float
    """Metres behind the nearer side that a reading lies at most."""

    def read(self, view: PixelView, depth: Array, focal: float, stream: int) -> Array:
        flies, near, far = self.happens(view, stream)
        flies = flies & (depth > 0)
        near = np.where(flies, near, 0.0)
        mixed = near + view.uniform(stream + 1) * np.minimum(np.where(flies, far, 0.0) - near, self.reach)
        return np.where(flies, mixed, depth)


def _range(patch: Array) -> tuple[Array, Array]:
    """Nearest and farthest depth of each patch; both 0 where nothing stands."""
    near, far = np.fmin.reduce(patch, axis=(0, 1)), np.fmax.reduce(patch, axis=(0, 1))
    nothing = np.isinf(near)
    return np.where(nothing, 0.0, near), np.where(nothing, 0.0, far)
