"""The pinhole camera, and the two ways between depth images and points.

Camera frame: OpenCV (x right, y down, z forward). Depth is z-depth in metres; 0 means no return.
The centre of pixel (column u, row v) lies at image position (u + 0.5, v + 0.5): rays start there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.elementary import tan
from artsim.common.products import apply, dot, norm
from artsim.errors import ConfigError
from artsim.model.kinematics import Array
from artsim.model.transforms import invert_transform


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera at a place.

    Attributes
    ----------
    K : (3, 3) float
        Intrinsic matrix in pixels.
    width, height : int
        Image size in pixels.
    T_world_camera : (4, 4) float
        Pose of the camera (OpenCV axes) in the world.
    """

    K: Array
    width: int
    height: int
    T_world_camera: Array

    def __repr__(self) -> str:
        fx, fy, cx, cy = self.K[0, 0], self.K[1, 1], self.K[0, 2], self.K[1, 2]
        x, y, z = self.T_world_camera[:3, 3]
        return (
            f"<Camera {self.width} x {self.height}, focal lengths {fx:.1f} {fy:.1f}, centre {cx:.1f} {cy:.1f}, "
            f"at {x:.3g} {y:.3g} {z:.3g}>"
        )

    @cached_property
    def T_camera_world(self) -> Array:
        """(4, 4) inverse of ``T_world_camera``."""
        return invert_transform(self.T_world_camera)

    @staticmethod
    def look_at(
        eye: ArrayLike,
        target: ArrayLike,
        width: int = 640,
        height: int = 480,
        fov_y: float = np.deg2rad(45.0),
        up: ArrayLike = (0.0, 0.0, 1.0),
    ) -> Camera:
        """A camera at ``eye`` whose optical axis passes through ``target``.

        Parameters
        ----------
        eye, target : (3,) float
            World positions, metres.
        width, height : int
            Image size in pixels.
        fov_y : float
            Vertical field of view in radians; the pixels are square.
        up : (3,) float
            World direction that points up in the image.
        """
        if not (width > 0 and height > 0 and 0.0 < fov_y < np.pi):
            raise ConfigError(f"no camera has {width}x{height} pixels and a field of view of {fov_y} rad")
        f = 0.5 * height / tan(0.5 * fov_y)
        K = np.array([[f, 0.0, 0.5 * width], [0.0, f, 0.5 * height], [0.0, 0.0, 1.0]])
        return Camera(K, width, height, look_at_transform(eye, target, up))

    def directions(self, pixels: ArrayLike) -> Array:
        """Directions of the rays through pixel centres, scaled so that z = 1.

        With this scale the ray parameter *is* the z-depth.

        Parameters
        ----------
        pixels : (N,) int
            Flat indices ``row * width + column``.

        Returns
        -------
        (N, 3) float
            Camera frame.
        """
        row, column = np.divmod(np.asarray(pixels), self.width)
        y = (row + 0.5 - self.K[1, 2]) / self.K[1, 1]
        x = (column + 0.5 - self.K[0, 2] - self.K[0, 1] * y) / self.K[0, 0]
        return np.stack([x, y, np.ones_like(x)], axis=-1)

    def unproject(self, pixels: ArrayLike, depth: ArrayLike) -> Array:
        """Points seen at pixels.

        Parameters
        ----------
        pixels : (N,) int
            Flat indices ``row * width + column``.
        depth : (N,) float
            z-depth in metres.

        Returns
        -------
        (N, 3) float
            Camera frame, metres.
        """
        return self.directions(pixels) * np.asarray(depth, dtype=np.float64)[:, None]

    def project(self, points: ArrayLike) -> Array:
        """Image positions of points; inverse of :meth:`unproject` up to the pixel's half-width.

        Parameters
        ----------
        points : (..., 3) float
            Camera frame, metres, z > 0.

        Returns
        -------
        (..., 2) float
            Column and row; pixel (u, v) covers [u, u + 1) x [v, v + 1).
        """
        image = apply(self.K, np.asarray(points, dtype=np.float64))
        return image[..., :2] / image[..., 2:]


def look_at_transform(eye: ArrayLike, target: ArrayLike, up: ArrayLike = (0.0, 0.0, 1.0)) -> Array:
    """(4, 4) ``T_world_camera`` of a camera at ``eye`` that looks at ``target``, ``up`` being up in the image."""
    eye, target, up = (np.asarray(v, dtype=np.float64) for v in (eye, target, up))
    forward = target - eye
    length = norm(forward)
    if not length > 0:
        raise ConfigError("a camera cannot look at its own position")
    z = (forward / length).tolist()
    x = _cross(z, up.tolist())
    if dot(x, x) < 1e-18:  # looking along `up`: any horizontal direction serves
        x = _cross(z, np.eye(3)[np.argmin(np.abs(z))].tolist())
    length = norm(x)
    x = [v / length for v in x]
    T = np.eye(4)
    T[:3, :3] = np.array([x, _cross(z, x), z]).T
    T[:3, 3] = eye
    return T


def _cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    """Cross product of two vectors; as numbers, five times as fast as NumPy."""
    (x, y, z), (u, v, w) = a, b
    return [y * w - z * v, z * u - x * w, x * v - y * u]


def points_from_depth(depth: NDArray[np.float32], camera: Camera) -> tuple[Array, NDArray[np.int64]]:
    """All points of a depth image.

    Parameters
    ----------
    depth : (H, W) float
        z-depth in metres, 0 = no return.
    camera : Camera

    Returns
    -------
    points : (N, 3) float
        Camera frame.
    pixels : (N,) int
        Flat index of each point's pixel.
    """
    pixels = np.flatnonzero(depth > 0)
    return camera.unproject(pixels, depth.ravel()[pixels]), pixels
