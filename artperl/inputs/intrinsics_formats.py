"""What files of other tools say about a camera, format by format.

Each function reads one format and returns None for any other. They are asked in order, those first whose files nothing
else looks like. A file that no one else's name is on is ours.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.errors import ConfigError

Array = NDArray[np.float64]

_OURS, _THEIRS = 0.5, 0.0
_NESTED = (
    "camera", "cam", "depth", "depth_camera", "depth_intrinsics", "intrinsics", "intrinsic", "color", "colour", "rgb",
    "camera_info", "calibration", "cameras",
)  # fmt: skip
"""Names under which files keep a camera, that of the depth image first."""
_DEEPEST = 4


@dataclass(frozen=True)
class Hints:
    """What is known of the image whose camera is looked for.

    Attributes
    ----------
    image_id : str or None
        Which image of a file with many.
    name : str
        Of the depth image's file, without its ending.
    size : (int, int) or None
        Its width and height.
    """

    image_id: str | None = None
    name: str = ""
    size: tuple[int, int] | None = None


@dataclass(frozen=True, eq=False)
class Stated:
    """A camera as a file states it.

    Attributes
    ----------
    K : (3, 3) float
    format : str
        What the format is called.
    center : float
        Both coordinates of the centre of the first pixel.
    size : (int, int) or None
    depth_scale : float or None
        Metres.
    distortion : tuple of float
    notes : tuple of str
    """

    K: Array
    format: str
    center: float
    size: tuple[int, int] | None = None
    depth_scale: float | None = None
    distortion: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()


def stated_camera(content: Any, hints: Hints, path: Path) -> Stated:
    """The camera that a file's content states.

    Parameters
    ----------
    content : object
        Of JSON or YAML; or a matrix.
    hints : Hints
    path : Path
        For messages.

    Raises
    ------
    ConfigError, ValueError, TypeError, KeyError, OverflowError
        When it states none.
    """
    if isinstance(content, np.ndarray) or (isinstance(content, list) and content and not isinstance(content[0], dict)):
        return Stated(_matrix(content), "a bare matrix, as OpenCV has it", _THEIRS)
    found = _find(content, hints, path, _DEEPEST)
    if found is None:
        raise ValueError("nothing in it is known")
    return found


def _find(content: Any, hints: Hints, path: Path, deeper: int) -> Stated | None:
    if not isinstance(content, Mapping):
        return None
    data = {str(name): value for name, value in content.items()}
    for read in _FORMATS:
        found = read(data, hints, path)
        if found is not None:
            return found
    if not deeper:
        return None
    inner = [(name, _inner(data[name], hints, path, deeper - 1)) for name in _NESTED if name in data]
    cameras = [(name, camera) for name, camera in inner if camera is not None]
    fitting = [pair for pair in cameras if hints.size is None or pair[1].size in (None, hints.size)]
    if not cameras:
        return None
    name, camera = (fitting or cameras)[0]
    scale = camera.depth_scale if camera.depth_scale is not None else _metres(data, path)
    notes = (f"'{name}' is taken of {', '.join(n for n, _ in cameras)}",) if len(cameras) > 1 else ()
    return Stated(camera.K, camera.format, camera.center, camera.size, scale, camera.distortion, notes + camera.notes)


def _inner(value: Any, hints: Hints, path: Path, deeper: int) -> Stated | None:
    if isinstance(value, list):
        if len(value) == 1:
            return _inner(value[0], hints, path, deeper)
        if _is_matrix(value):
            return Stated(_matrix(value), "a bare matrix, as OpenCV has it", _THEIRS)
    return _find(value, hints, path, deeper)


def _bop_scene(data: Mapping[str, Any], hints: Hints, path: Path) -> Stated | None:
    """BOP's scene_camera.json: a camera for each image, by its number."""
    numbers = {int(name): name for name in data if name.isdigit() and len(name) < 12}
    if not numbers or len(numbers) != len(data) or not all(isinstance(v, Mapping) for v in data.values()):
        return None
    choices = f"{min(numbers)} to {max(numbers)}"
    if hints.image_id is not None:
        if not hints.image_id.isdigit() or int(hints.image_id) not in numbers:
            raise ConfigError(
                f"it has no camera of image {hints.image_id[:40]}", path, f"use --image-id with one of {choices}"
            )
        number = int(hints.image_id)
    else:
        digits = [int(word) for word in re.findall(r"\d{1,11}", hints.name)]
        named = [n for n in digits if n in numbers]
        if len(numbers) > 1 and not (named and len(digits) == 1):
            raise ConfigError(
                f"it has cameras of {len(numbers)} images, and the depth image's name '{hints.name[:80]}' tells none",
                path, f"add --image-id N, one of {choices}",
            )  # fmt: skip
        number = named[0] if named else next(iter(numbers))
    found = _bop(data[numbers[number]], hints, path)
    return None if found is None else Stated(
        found.K, "BOP", found.center, found.size, found.depth_scale, (), (f"the camera of image {number}",)
    )  # fmt: skip


def _bop(data: Mapping[str, Any], hints: Hints, path: Path) -> Stated | None:
    """BOP: cam_K, or fx, fy, cx, cy with depth_scale in millimetres, as in camera.json."""
    if "cam_K" in data:
        return Stated(_matrix(data["cam_K"]), "BOP", _THEIRS, _size(data), _millimetres(data, path))
    if "depth_scale" in data and _has(data, "fx", "fy", "cx", "cy"):
        return Stated(_pinhole(data, "cx", "cy"), "BOP", _THEIRS, _size(data), _millimetres(data, path))
    return None


def _ros(data: Mapping[str, Any], hints: Hints, path: Path) -> Stated | None:
    """ROS: sensor_msgs/CameraInfo of ROS 1 and 2, and files of camera_calibration; OpenCV's own files are alike."""
    name = next((n for n in ("camera_matrix", "cameraMatrix", "Camera_Matrix", "cam_matrix", "mtx") if n in data), None)
    coefficients = next(
        (data[n] for n in ("distortion_coefficients", "Distortion_Coefficients", "dist_coeffs", "distCoeffs", "dist",
                           "distortion", "D", "d") if n in data), None,
    )  # fmt: skip
    if name is not None:
        return Stated(_matrix(data[name]), "OpenCV and ROS", _THEIRS, _size(data), None, _numbers(coefficients))
    of_ros = any(n in data for n in ("distortion_model", "header", "D", "d", "R", "P", "p", "binning_x", "roi"))
    name = next((n for n in ("K", "k") if n in data and (of_ros or n == "k")), None)
    if name is not None:
        return Stated(_matrix(data[name]), "a ROS CameraInfo", _THEIRS, _size(data), None, _numbers(coefficients))
    name = next((n for n in ("P", "p", "projection_matrix") if n in data), None)
    if name is not None and _is_matrix(data[name]):
        return Stated(_matrix(data[name]), "a ROS CameraInfo", _THEIRS, _size(data), None, _numbers(coefficients))
    return None


def _open3d(data: Mapping[str, Any], hints: Hints, path: Path) -> Stated | None:
    """Open3D: PinholeCameraIntrinsic, whose matrix stands column by column."""
    if "intrinsic_matrix" not in data:
        return None
    return Stated(_matrix(data["intrinsic_matrix"]), "Open3D", _THEIRS, _size(data))


def _realsense(data: Mapping[str, Any], hints: Hints, path: Path) -> Stated | None:
    """RealSense: rs2_intrinsics."""
    if not _has(data, "fx", "fy", "ppx", "ppy"):
        return None
    coefficients = _numbers(data.get("coeffs", data.get("distortion_coeffs")))
    K = _pinhole(data, "ppx", "ppy")
    return Stated(K, "RealSense", _THEIRS, _size(data), _metres(data, path), coefficients)


def _nerf(data: Mapping[str, Any], hints: Hints, path: Path) -> Stated | None:
    """transforms.json of NeRF, instant-ngp and nerfstudio."""
    size, name = _size(data), "a NeRF transforms.json"
    coefficients = tuple(_number(data[n]) for n in ("k1", "k2", "k3", "k4", "p1", "p2") if n in data)
    if "fl_x" in data:
        fx = _number(data["fl_x"])
        fy = _number(data.get("fl_y", fx))
        size = size or hints.size
    elif "camera_angle_x" in data and (size or hints.size):
        size = size or hints.size
        assert size is not None
        fx = 0.5 * size[0] / math.tan(0.5 * _number(data["camera_angle_x"]))
        fy = 0.5 * size[1] / math.tan(0.5 * _number(data["camera_angle_y"])) if "camera_angle_y" in data else fx
    else:
        return None
    middle = (0.5 * size[0], 0.5 * size[1]) if size else (data["cx"], data["cy"])
    cx, cy = (_number(data.get(n, value)) for n, value in zip(("cx", "cy"), middle, strict=True))
    return Stated(_of_four(fx, fy, cx, cy), name, _OURS, _size(data), None, coefficients)


def _ours(data: Mapping[str, Any], hints: Hints, path: Path) -> Stated | None:
    """artsim's own samples and scenes, and what is not of any other tool: fx, fy, cx, cy, or K."""
    if _has(data, "fx", "fy", "cx", "cy"):
        return Stated(_pinhole(data, "cx", "cy"), "artsim (fx, fy, cx, cy)", _OURS, _size(data))
    if "K" in data:
        return Stated(_matrix(data["K"]), "artsim (K)", _OURS, _size(data))
    return None


_FORMATS: tuple[Callable[[Mapping[str, Any], Hints, Path], Stated | None], ...] = (
    _bop_scene, _bop, _realsense, _open3d, _nerf, _ros, _ours,
)  # fmt: skip


def _has(data: Mapping[str, Any], *names: str) -> bool:
    return all(name in data for name in names)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"{str(value)[:40]!r} is no number")
    return float(value)


def _numbers(values: Any) -> tuple[float, ...]:
    """Numbers of a list, nested or not, or of an OpenCV matrix; none for anything else."""
    if isinstance(values, Mapping):
        values = values.get("data")
    flat = _flat(values)
    return tuple(_number(value) for value in flat if value is not None)


def _flat(values: Any) -> list[Any]:
    if not isinstance(values, Sequence) or isinstance(values, (str, bytes)):
        return []
    return [v for row in values[:64] for v in (row[:64] if isinstance(row, list) else [row])]


def _is_matrix(values: Any) -> bool:
    flat = _flat(values.get("data") if isinstance(values, Mapping) else values)
    return len(flat) in (9, 12, 16) and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in flat)


def _matrix(values: Any) -> Array:
    """(3, 3) of nine numbers, nested or not, or of the left of a (3, 4) or (4, 4) matrix."""
    numbers = [float(v) for v in values.ravel()[:17]] if isinstance(values, np.ndarray) else list(_numbers(values))
    columns = {9: 3, 12: 4, 16: 4}.get(len(numbers))
    if columns is None:
        raise ValueError(f"{len(numbers)} numbers are no intrinsic matrix")
    return np.array(numbers).reshape(-1, columns)[:3, :3]


def _pinhole(data: Mapping[str, Any], cx: str, cy: str) -> Array:
    return _of_four(*(_number(data[name]) for name in ("fx", "fy", cx, cy)))


def _of_four(fx: float, fy: float, cx: float, cy: float) -> Array:
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _size(data: Mapping[str, Any]) -> tuple[int, int] | None:
    for across, down in (("width", "height"), ("w", "h"), ("image_width", "image_height"), ("W", "H")):
        if _has(data, across, down):
            width, height = _number(data[across]), _number(data[down])
            if not (width > 0 and height > 0 and math.isfinite(width) and math.isfinite(height)):
                continue  # a CameraInfo that nobody filled in has 0
            return round(width), round(height)
    return None


def _millimetres(data: Mapping[str, Any], path: Path) -> float | None:
    """BOP's depth_scale, in metres."""
    if "depth_scale" not in data:
        return None
    scale = _number(data["depth_scale"])
    if not 0.005 <= scale <= 20.0:  # a number that is metres, or units in a metre
        raise ConfigError(
            f"depth_scale {scale:g} cannot be BOP's, which is millimetres of one unit", path,
            "add --depth-scale METRES, of one unit of the depth image, such as 0.001; and leave depth_scale out of the"
            " file, or write it in millimetres",
        )  # fmt: skip
    return 0.001 * scale


def _metres(data: Mapping[str, Any], path: Path) -> float | None:
    """RealSense's depth_units or depth_scale."""
    value = data.get("depth_units", data.get("depth_scale"))
    if value is None:
        return None
    scale = _number(value)
    if not 1e-6 <= scale <= 0.02:
        raise ConfigError(
            f"depth_scale {scale:g} cannot be RealSense's, which is metres of one unit", path,
            "add --depth-scale METRES, such as 0.001, and leave it out of the file, or write it in metres",
        )  # fmt: skip
    return scale
