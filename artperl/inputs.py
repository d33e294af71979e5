"""Clouds from files: point clouds, and depth images with a mask and intrinsics."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.camera import Camera
from artsim.errors import ArtsimError, ConfigError

Array = NDArray[np.float64]

IMAGES = (".png", ".tif", ".tiff", ".pgm")
_FIX = "give (N, 3) points as .npy, .npz with 'points', or .ply, or a depth image with --intrinsics"


def points_of_depth(depth: ArrayLike, K: ArrayLike, mask: ArrayLike | None = None) -> Array:
    """Points of an object in a depth image, to be given to an estimator.

    Parameters
    ----------
    depth : (H, W) float
        z-depth in metres; 0, or not finite, where nothing was measured.
    K : (3, 3) float
        Intrinsic matrix in pixels; the centre of the first pixel is at (0.5, 0.5).
    mask : (H, W), optional
        Not zero where the object is; everywhere by default.

    Returns
    -------
    (N, 3) float
        Camera frame (x right, y down, z forward), metres.

    Raises
    ------
    ArtsimError
        When shapes do not fit, or there is no depth within the mask.
    """
    depth, K = np.asarray(depth, dtype=np.float64), np.asarray(K, dtype=np.float64)
    if depth.ndim != 2:
        raise ArtsimError(f"an array of shape {depth.shape} is no depth image", "depth", "pass (H, W) metres")
    if K.shape != (3, 3) or not np.isfinite(K).all() or K[0, 0] <= 0 or K[1, 1] <= 0:
        raise ArtsimError("this is no intrinsic matrix", "K", "pass (3, 3) with positive focal lengths, in pixels")
    seen = np.isfinite(depth) & (depth > 0)
    if mask is not None:
        chosen: NDArray[Any] = np.asarray(mask)
        if chosen.ndim == 3:  # an image in colour
            chosen = np.any(chosen != 0, axis=-1)
        if chosen.shape != depth.shape:
            raise ArtsimError(f"a mask of shape {chosen.shape} does not fit a depth image of {depth.shape}", "mask")
        seen &= chosen != 0
    pixels = np.flatnonzero(seen)
    if len(pixels) == 0:
        raise ArtsimError("there is no depth within the mask", "depth", "check both, and the unit of depth")
    camera = Camera(K, depth.shape[1], depth.shape[0], np.eye(4))
    return camera.unproject(pixels, depth.ravel()[pixels])


def read_points(
    path: Path, mask: Path | None = None, intrinsics: Path | None = None, depth_scale: float = 0.001
) -> Array:
    """Points of a file.

    Parameters
    ----------
    path : Path
        ``.npy`` (N, 3), ``.npz`` with an array ``points``, ``.ply`` or another mesh file; or a depth image: ``.png`` of
        whole numbers, ``.npy`` (H, W) metres.
    mask : Path, optional
        Image or ``.npy``, of the object in a depth image.
    intrinsics : Path, optional
        JSON, see :func:`read_intrinsics`; makes ``path`` a depth image.
    depth_scale : float
        Metres of one unit of an image of whole numbers.

    Raises
    ------
    ConfigError
        When a file cannot be read, or is none of these.
    """
    if intrinsics is None:
        if mask is not None or path.suffix.lower() in IMAGES:
            raise ConfigError("a depth image needs intrinsics", path, "add --intrinsics camera.json")
        return _read_cloud(path)
    image = _read_array(path)
    metres = image * depth_scale if np.issubdtype(image.dtype, np.integer) else image
    return points_of_depth(metres, read_intrinsics(intrinsics), None if mask is None else _read_array(mask))


def read_intrinsics(path: Path) -> Array:
    """(3, 3) intrinsic matrix of a JSON file.

    It holds ``fx, fy, cx, cy``, or a matrix as ``K``, ``cam_K`` (BOP) or ``intrinsic_matrix`` (Open3D, column by
    column), nested or as nine numbers.

    Raises
    ------
    ConfigError
        When it holds none of them.
    """
    try:
        data = json.loads(path.read_text())
        if "fx" in data:
            fx, fy, cx, cy = (float(data[name]) for name in ("fx", "fy", "cx", "cy"))
            return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        name = next(name for name in ("K", "cam_K", "intrinsic_matrix") if name in data)
        K = np.asarray(data[name], dtype=np.float64).reshape(3, 3)
        return K.T if abs(K[2, 0]) > 1.0 else K  # Open3D writes columns
    except (OSError, ValueError, KeyError, TypeError, StopIteration) as error:
        raise ConfigError("no intrinsics can be read", path, "write {fx, fy, cx, cy}, or K of nine numbers") from error


def _read_cloud(path: Path) -> Array:
    try:
        if path.suffix == ".npy":
            return np.asarray(np.load(path, allow_pickle=False))
        if path.suffix == ".npz":
            with np.load(path, allow_pickle=False) as arrays:
                return np.asarray(arrays["points"])
        import trimesh

        return np.asarray(trimesh.load(path).vertices)
    except Exception as error:  # NumPy and trimesh fail in many ways on bytes that are not theirs
        raise ConfigError(f"no cloud can be read ({error})", path, _FIX) from error


def _read_array(path: Path) -> NDArray[Any]:
    try:
        if path.suffix == ".npy":
            return np.asarray(np.load(path, allow_pickle=False))
        from PIL import Image

        with Image.open(path) as image:
            return np.asarray(image)
    except Exception as error:  # so do NumPy and Pillow
        raise ConfigError(f"no image can be read ({error})", path, _FIX) from error
