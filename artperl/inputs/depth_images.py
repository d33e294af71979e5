"""Depth images of files, and the points that they show."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artperl.inputs.bounds import read_npy, read_npz
from artperl.inputs.images import read_picture
from artperl.inputs.intrinsics import check_matrix
from artsim.errors import ArtsimError, ConfigError
from artsim.model.camera import Camera

Array = NDArray[np.float64]

DepthKind = Literal["z", "distance"]
"""z: depth along the camera's axis, as nearly all sensors and datasets have it; distance: along each pixel's ray."""

PICTURES = (".png", ".tif", ".tiff", ".pgm", ".pnm", ".pfm")
"""Endings of names of pictures that may hold depth."""
ARRAYS = (".npy", ".npz")
_FIX = "give a PNG or TIFF of whole numbers or floats, or .npy of (H, W) numbers"
_FAR, _NEAR_FAR = 0.9995, 0.9
"""Of a depth buffer, whose far end is 1: its largest number where anything is far; else, the median is above this."""
_BUFFER = (
    "all depth lies within 0 to 1, as in a depth buffer of OpenGL, or in a picture of depth, and not in metres. Fix:"
    " give depth in metres; of a buffer b: near * far / (far - b * (far - near)); ignore this if it is right"
)
_EXR = """python -c "import imageio.v3 as i, numpy as n; n.save('depth.npy', i.imread('depth.exr')[..., 0])\""""


@dataclass(frozen=True)
class DepthImage:
    """Depth as it stands in a file."""

    values: NDArray[Any]
    """(H, W). In the file's unit; 0 or not finite where nothing was measured."""
    whole: bool
    """Whether they are whole numbers, which count millimetres by custom."""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    """What was assumed or left out, and what looks wrong."""


def read_depth(path: Path) -> DepthImage:
    """A depth image of a file: PNG, TIFF, PGM, PFM; ``.npy``; ``.npz`` with an array 'depth', or only one that fits.

    Raises
    ------
    ConfigError
        When it cannot be read, or is a picture in colour.
    """
    ending = path.suffix.lower()
    if ending == ".npy":
        return _of_array(read_npy(path, "depth image", _FIX), path)
    if ending == ".npz":
        choice = read_npz(path, "depth image", _FIX, lambda shape, dtype: len(shape) in (2, 3) and dtype.kind in "fiu")
        name, array = choice.one_of(("depth", "depths", "depth_image", "z"))
        image = _of_array(array, path)
        said = () if name == "depth" else (f"the array '{name}' is the depth image",)
        return DepthImage(image.values, image.whole, said + image.notes, image.warnings)
    if ending == ".exr":
        raise ConfigError("OpenEXR is not read", path, f"convert it where imageio and OpenEXR are installed: {_EXR}")
    if ending in (".jpg", ".jpeg"):
        raise ConfigError("a JPEG is no depth image: it keeps 8 bits, and not those exactly", path, _FIX)
    return _of_picture(path)


def _of_picture(path: Path) -> DepthImage:
    picture = read_picture(path, "depth image")
    if picture.mode == "1" or picture.values.ndim != 2 or picture.mode == "P":
        raise ConfigError(
            f"a picture of mode {picture.mode} is no depth image: colours stand for depth in no known way",
            path, "give the depth itself: 16-bit PNG, TIFF of floats, or .npy",
        )  # fmt: skip
    return _of_array(picture.values, path)


def _of_array(array: NDArray[Any], path: Path) -> DepthImage:
    values = array[..., 0] if array.ndim == 3 and array.shape[2] == 1 else array
    values = values[0] if values.ndim == 3 and values.shape[0] == 1 else values
    if values.ndim != 2 or values.dtype.kind not in "fiu" or values.size == 0:
        raise ConfigError(f"an array of shape {array.shape} and type {array.dtype} is no depth image", path, _FIX)
    if values.dtype.kind == "f":
        metres = values.astype(np.float64)
        return DepthImage(metres, False, (), (_BUFFER,) if _is_buffer(metres) else ())
    notes, warnings = list[str](), list[str]()
    most = np.iinfo(values.dtype).max
    depth = values.astype(np.float64)
    if values.dtype.itemsize == 1:
        warnings.append(
            "the depth image has 8 bits, 256 steps: it may be a picture of depth instead of depth. Fix: give the 16-bit"
            " depth image, or the right --depth-scale"
        )
    else:
        saturated = (values == most) | (values == 65535)
        if saturated.any():
            count, value = int(saturated.sum()), int(values[saturated].max())
            notes.append(f"{count} pixels of {value}, the largest number, are no measurement")
            depth[saturated] = 0.0
    return DepthImage(depth, True, tuple(notes), tuple(warnings))


def _is_buffer(values: Array) -> bool:
    """Whether floats end at 1, or all are just below it: no depth in metres does, and a buffer does nothing else."""
    known = values[np.isfinite(values)]
    if known.size == 0 or known.max() > 1.0 or known.min() < 0.0:
        return False
    return bool(known.max() >= _FAR or (known.min() > 0.0 and np.median(known) > _NEAR_FAR))


def points_of_depth(
    depth: ArrayLike, K: ArrayLike, mask: ArrayLike | None = None, kind: DepthKind = "z"
) -> Array:  # fmt: skip
    """Points of an object in a depth image, to be given to an estimator.

    Parameters
    ----------
    depth : (H, W) float
        Metres; 0, or not finite, where nothing was measured.
    K : (3, 3) float
        Intrinsic matrix in pixels; the centre of the first pixel is at (0.5, 0.5). Where it is at (0, 0), as in OpenCV,
        BOP, Open3D, RealSense and ROS, add 0.5 to ``K[0, 2]`` and ``K[1, 2]``.
    mask : (H, W), optional
        Not zero where the object is; everywhere by default. Of a mask in colour (H, W, 3 or 4), what is not black;
        alpha is no colour.
    kind : DepthKind
        Depth along the camera's axis, or distance along each ray.

    Returns
    -------
    (N, 3) float
        Camera frame (x right, y down, z forward), metres.

    Raises
    ------
    ArtsimError
        When shapes do not fit, or there is no depth within the mask.
    """
    if isinstance(depth, np.ma.MaskedArray):  # what is masked was not measured
        depth = np.ma.filled(depth.astype(np.float64), np.nan)
    depth, K = np.asarray(depth, dtype=np.float64), np.asarray(K, dtype=np.float64)
    if depth.ndim != 2:
        raise ArtsimError(f"an array of shape {depth.shape} is no depth image", "depth", "pass (H, W) metres")
    height, width = depth.shape
    check_matrix(K, "K", (width, height))
    seen = np.isfinite(depth) & (depth > 0)
    if mask is not None:
        chosen: NDArray[Any] = np.asarray(mask)
        if chosen.ndim == 3:
            chosen = np.any(chosen[..., : 1 if chosen.shape[2] < 3 else 3] != 0, axis=-1)
        if chosen.shape != depth.shape:
            raise ArtsimError(
                f"a mask of {_size(chosen.shape)} pixels does not fit a depth image of {_size(depth.shape)}", "mask",
                "give the mask of this image, or resize it to that without interpolation (PIL: mask.resize"
                f"(({width}, {height}), Image.NEAREST))",
            )  # fmt: skip
        seen &= chosen != 0
    pixels = np.flatnonzero(seen)
    if len(pixels) == 0:
        raise ArtsimError("there is no depth within the mask", "depth", "check both, and the unit of depth")
    camera = Camera(K, width, height, np.eye(4))
    along = depth.ravel()[pixels]
    if kind == "distance":
        along = along / np.linalg.norm(camera.directions(pixels), axis=1)
    return camera.unproject(pixels, along)


def _size(shape: tuple[int, ...]) -> str:
    return " x ".join(map(str, reversed(shape)))
