"""What files of other tools say about a camera, format by format.

One table holds the formats, those first whose files nothing else looks like. A file that no one else's name is on is
ours.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.intrinsics_beside import Size, beside, plain, stated_size
from artsim.errors import ConfigError

Array = NDArray[np.float64]

_OURS, _THEIRS = 0.5, 0.0
_NESTED = (
    "camera", "cam", "depth", "depthcamera", "depthintrinsics", "intrinsics", "intrinsic", "color", "colour", "rgb",
    "camerainfo", "calibration", "cameras", "cameraparams",
)  # fmt: skip
"""Names under which files keep a camera, that of the depth image first, as :func:`plain` has them."""
_DEEPEST = 4
_MOST_CAMERAS = 100
"""Mappings with names of their own that are looked through at each level."""
_NERF = "a NeRF transforms.json"
_BARE = "a bare matrix, as OpenCV has it"


@dataclass(frozen=True)
class Hints:
    """What is known of the image whose camera is looked for."""

    image_id: str | None = None
    """Which image of a file with many."""
    name: str = ""
    """Of the depth image's file, without its ending."""
    size: tuple[int, int] | None = None
    """(int, int) or None. Its width and height."""


@dataclass(frozen=True, eq=False)
class Stated:
    """A camera as a file states it."""

    K: Array
    """(3, 3) float."""
    format: str
    """What the format is called."""
    center: float
    """Both coordinates of the centre of the first pixel."""
    size: tuple[int, int] | None = None
    """(int, int) or None."""
    depth_scale: float | None = None
    """Metres."""
    distortion: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Found:
    """A matrix, the mappings around it, its own first, and cameras in them that are not taken."""

    stated: Stated
    around: tuple[Mapping[str, Any], ...]
    others: tuple[Any, ...] = ()


def stated_camera(content: Any, hints: Hints, path: Path) -> Stated:
    """The camera that a file's content states.

    Parameters
    ----------
    content : object
        Of JSON or YAML; or a matrix; or arrays by their names.
    hints : Hints
    path : Path
        For messages.

    Raises
    ------
    ConfigError, ValueError, TypeError, KeyError, OverflowError
        When it states none.
    """
    if isinstance(content, np.ndarray) or (isinstance(content, list) and content and not isinstance(content[0], dict)):
        return Stated(_matrix(content), _BARE, _THEIRS)
    found = _find(_opened(content), hints, path, _DEEPEST)
    if found is None:
        raise ValueError("nothing in it is known")
    stated = found.stated
    said = beside(found.around, found.others, stated.format, hints.size, path)
    if stated.center == _OURS and stated.format != _NERF and said.foreign:
        stated = replace(stated, format="OpenCV's kind, which artsim does not write", center=_THEIRS)
    K, size, notes = _windowed(stated, said.size, found.around[0] if found.around else {}, hints)
    return replace(
        stated, K=K, size=size, depth_scale=said.depth_scale, distortion=said.distortion or stated.distortion,
        notes=(*stated.notes, *notes, *said.notes), warnings=said.warnings,
    )  # fmt: skip


def _opened(content: Any) -> Any:
    """``{"Camera.fx": 1}``, as ORB-SLAM has it, is ``{"Camera": {"fx": 1}}``."""
    if not isinstance(content, Mapping):
        return content
    opened: dict[str, Any] = {}
    for name, value in content.items():
        first, _, last = str(name).partition(".")
        if last and isinstance(inner := opened.setdefault(first, {}), dict) and inner is not content.get(first):
            inner[last] = value
        else:
            opened[str(name)] = value
    return opened


def _find(content: Any, hints: Hints, path: Path, deeper: int) -> _Found | None:
    if not isinstance(content, Mapping):
        return None
    data = {str(name): value for name, value in content.items()}
    scene = _bop_scene(data, hints, path) or _azure(data, hints)
    if scene is not None:
        return scene
    stated = _stated(data, hints)
    if stated is not None:
        return _Found(stated, (content,))
    if not deeper:
        return None
    known = sorted((n for n in data if plain(n) in _NESTED), key=lambda name: _NESTED.index(plain(name)))
    cameras = [(n, found) for n in known if (found := _inner(data[n], hints, path, deeper - 1)) is not None]
    if not cameras:  # under a name of the user's own, where it is the only one
        inside = [n for n, value in data.items() if isinstance(value, Mapping) and n not in known][:_MOST_CAMERAS]
        cameras = [(n, found) for n in inside if (found := _inner(data[n], hints, path, deeper - 1)) is not None]
        if len(cameras) > 1:
            raise ValueError(f"it has several cameras: {', '.join(n[:40] for n, _ in cameras[:8])}")
    if not cameras:
        return None
    sizes = [stated_size(found.around, hints.size) for _, found in cameras]
    fitting = [i for i, size in enumerate(sizes) if hints.size is None or size in (None, hints.size)]
    name, found = cameras[fitting[0] if fitting else 0]
    notes = (f"'{name}' is taken of {', '.join(n for n, _ in cameras)}",) if len(cameras) > 1 else ()
    others = [one.around[-1] for _, one in cameras if one is not found and one.around]
    stated = replace(found.stated, notes=notes + found.stated.notes)
    return _Found(stated, (*found.around, content), (*found.others, *others))


def _inner(value: Any, hints: Hints, path: Path, deeper: int) -> _Found | None:
    if isinstance(value, list):
        if len(value) == 1:
            return _inner(value[0], hints, path, deeper)
        if _is_matrix(value):
            return _Found(Stated(_matrix(value), _BARE, _THEIRS), ())
    return _find(value, hints, path, deeper)


def _windowed(
    stated: Stated, size: Size | None, own: Mapping[str, Any], hints: Hints
) -> tuple[Array, Size | None, tuple[str, ...]]:
    """The matrix and size of the image that a ROS camera sends: its roi, in pixels of the whole, then binned."""
    roi = own.get("roi") if isinstance(own.get("roi"), Mapping) else {}
    assert isinstance(roi, Mapping)
    left, top, width, height = (int(_number(roi.get(n, 0))) for n in ("x_offset", "y_offset", "width", "height"))
    across, down = (max(1, int(_number(own.get(name, 0)))) for name in ("binning_x", "binning_y"))
    whole = size is not None and (width or size[0], height or size[1], across, down) == (*size, 1, 1)
    if size is None or whole or not (width or height or across > 1 or down > 1):
        return stated.K, size, ()
    sent = (width or size[0]) // across, (height or size[1]) // down
    if hints.size == size:
        return (
            stated.K,
            size,
            (f"the image is of the whole sensor: roi and binning, {sent[0]} x {sent[1]}, do not hold",),
        )
    K, shift = stated.K.copy(), 0.5 - stated.center
    K[:2, 2] += shift - np.array([left, top])  # from the corner of the first pixel
    K[:2] /= [[across], [down]]
    K[:2, 2] -= shift
    note = (
        f"roi and binning: the image is {sent[0]} x {sent[1]} of {size[0]} x {size[1]} pixels, from ({left}, {top}) on"
    )
    return K, sent, (note,)


def _bop_scene(data: Mapping[str, Any], hints: Hints, path: Path) -> _Found | None:
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
                f"it has cameras of {len(numbers)} images, and the depth image's name '{hints.name[:80]}' names none",
                path, f"add --image-id N, one of {choices}",
            )  # fmt: skip
        number = named[0] if named else next(iter(numbers))
    found = _stated(data[numbers[number]], hints, only="BOP")
    return None if found is None else _Found(
        replace(found, notes=(f"the camera of image {number}",)), (data[numbers[number]],)
    )  # fmt: skip


def _azure(data: Mapping[str, Any], hints: Hints) -> _Found | None:
    """The calibration that an Azure Kinect keeps: of its whole sensors, over whose sides numbers are divided.

    Images show parts of the sensors, binned, which the size of the image tells.
    """
    inner = data.get("CalibrationInformation")
    if not isinstance(inner, Mapping) or not isinstance(inner.get("Cameras"), list) or hints.size is None:
        return None
    width, height = hints.size
    depth = hints.size in _AZURE_DEPTH
    location = "CALIBRATION_CameraLocation" + ("D0" if depth else "PV0")
    camera = next((c for c in inner["Cameras"][:8] if isinstance(c, Mapping) and c.get("Location") == location), None)
    if camera is None:
        return None
    # Colour is cut at the top and the bottom, from 4:3.
    sides, left, top = _AZURE_DEPTH.get(hints.size, ((width, 0.75 * width), 0.0, 0.5 * (0.75 * width - height)))
    cx, cy, fx, fy, *distortion = map(_number, camera["Intrinsics"]["ModelParameters"][:14])
    K = _of_four(fx * sides[0], fy * sides[1], cx * sides[0] - left, cy * sides[1] - top)
    which = f"the {'depth' if depth else 'colour'} camera, by the size of the image"
    name = "an Azure Kinect's calibration"
    return _Found(Stated(K, name, _OURS, hints.size, None, tuple(distortion), (which,)), ())


_AZURE_DEPTH = {
    (640, 576): ((1024.0, 1024.0), 192.0, 180.0), (320, 288): ((512.0, 512.0), 96.0, 90.0),
    (1024, 1024): ((1024.0, 1024.0), 0.0, 0.0), (512, 512): ((512.0, 512.0), 0.0, 0.0),
}  # fmt: skip
"""Of each size of a depth image: sides of the sensor, binned, and the left upper corner of the image on it, pixels."""


def _stated(data: Mapping[str, Any], hints: Hints, only: str = "") -> Stated | None:
    """The camera by the first format that finds its names, or by one alone."""
    for name, center, camera, beside_it in _FORMATS:
        K = None
        if only not in ("", name) or (beside_it and not any(word in data for word in beside_it)):
            continue
        if callable(camera):
            K = camera(data, hints)
        elif isinstance(camera, tuple):
            K = _of_four(*(_number(data[word]) for word in camera)) if all(word in data for word in camera) else None
        elif camera in data:
            K = _matrix(data[camera])
        if K is not None:
            return Stated(K, name, center)
    return None


def _nerf(data: Mapping[str, Any], hints: Hints) -> Array | None:
    size = stated_size([data], hints.size) or hints.size
    if "fl_x" in data:
        fx = _number(data["fl_x"])
        fy = _number(data.get("fl_y", fx))
    elif "camera_angle_x" in data and size:
        fx = 0.5 * size[0] / math.tan(0.5 * _number(data["camera_angle_x"]))
        fy = 0.5 * size[1] / math.tan(0.5 * _number(data["camera_angle_y"])) if "camera_angle_y" in data else fx
    else:
        return None
    middle = (0.5 * size[0], 0.5 * size[1]) if size else (data["cx"], data["cy"])
    return _of_four(fx, fy, *(_number(data.get(n, value)) for n, value in zip(("cx", "cy"), middle, strict=True)))


def _kalibr(data: Mapping[str, Any], hints: Hints) -> Array | None:
    four = _flat(data.get("intrinsics"))
    return _of_four(*map(_number, four)) if len(four) == 4 else None


def _projection(data: Mapping[str, Any], hints: Hints) -> Array | None:
    name = next((n for n in ("P", "p", "projection_matrix") if _is_matrix(data.get(n))), None)
    return None if name is None else _matrix(data[name])


_FOUR = ("fx", "fy", "cx", "cy")
_FORMATS: tuple[
    tuple[str, float, str | tuple[str, ...] | Callable[[Mapping[str, Any], Hints], Array | None], tuple[str, ...]], ...
] = (
    ("BOP", _THEIRS, "cam_K", ()),
    ("BOP", _THEIRS, _FOUR, ("depth_scale",)),  # camera.json
    ("RealSense", _THEIRS, ("fx", "fy", "ppx", "ppy"), ()),
    ("Open3D", _THEIRS, "intrinsic_matrix", ()),  # column by column
    ("Kalibr", _THEIRS, _kalibr, ()),
    (_NERF, _OURS, _nerf, ()),  # also of instant-ngp and nerfstudio
    *(("OpenCV and ROS", _THEIRS, name, ())
      for name in ("camera_matrix", "cameraMatrix", "Camera_Matrix", "cam_matrix", "mtx")),
    ("a ROS CameraInfo", _THEIRS, "K",
     ("distortion_model", "header", "D", "d", "R", "P", "p", "binning_x", "roi")),
    ("a ROS CameraInfo", _THEIRS, "k", ()),
    ("a ROS CameraInfo", _THEIRS, _projection, ()),
    ("artsim (fx, fy, cx, cy)", _OURS, _FOUR, ()),  # and what is not of any other tool
    ("artsim (K)", _OURS, "K", ()),
)  # fmt: skip
"""What each is called, where it has the centre of the first pixel, the name of its matrix, or of fx, fy, cx and cy, and
names of which one stands beside."""


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TypeError(f"{str(value)[:40]!r} is no number")
    return float(value)


def _flat(values: Any) -> list[Any]:
    if not isinstance(values, Sequence) or isinstance(values, (str, bytes)):
        return []
    return [v for row in values[:64] for v in (row[:64] if isinstance(row, list) else [row])]


def _is_matrix(values: Any) -> bool:
    flat = _flat(values.get("data") if isinstance(values, Mapping) else values)
    return len(flat) in (9, 12, 16) and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in flat)


def _matrix(values: Any) -> Array:
    """(3, 3) of nine numbers, nested or not, or of the left of a (3, 4) or (4, 4) matrix."""
    if isinstance(values, Mapping):
        values = values.get("data")
    flat = values.ravel()[:17].tolist() if isinstance(values, np.ndarray) else _flat(values)
    numbers = [_number(value) for value in flat if value is not None]
    columns = {9: 3, 12: 4, 16: 4}.get(len(numbers))
    if columns is None:
        raise ValueError(f"{len(numbers)} numbers are no intrinsic matrix")
    return np.array(numbers).reshape(-1, columns)[:3, :3]


def _of_four(fx: float, fy: float, cx: float, cy: float) -> Array:
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
