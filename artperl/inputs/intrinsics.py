"""Cameras of files: the intrinsic matrix, what belongs to it, and whether it fits an image.

Where the centre of the first pixel is differs: at (0.5, 0.5) here and in NeRF's ``transforms.json``; at (0, 0) in
OpenCV, BOP, Open3D, RealSense and ROS. Half a pixel is 0.7 mm at 0.8 m. Matrices are always returned as used here.
"""

import json
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import guard, read_file, read_npy, read_npz
from artperl.inputs.intrinsics_formats import Hints, Stated, stated_camera
from artsim.common.extras import require_extra
from artsim.common.files import parse_json
from artsim.errors import ArtsimError, ConfigError

Array = NDArray[np.float64]

PixelCenter = Literal["0", "0.5"]
"""Coordinates of the centre of the first pixel."""

FIX = 'write {"fx": ..., "fy": ..., "cx": ..., "cy": ...} in pixels, or "K" of nine numbers'
_MAX_BYTES = 8_000_000
"""Of a JSON file: scene_camera.json of a thousand images has 0.3 MB, transforms.json 2 MB."""
_MAX_YAML_BYTES = 50_000
"""PyYAML takes a second for so many brackets, and a ROS CameraInfo has a thousand bytes."""
_SMALL = 32
"""Values of an array that may say something beside a matrix, and arrays that are looked at."""
_NORMALISED = 10.0
"""Focal lengths below, in pixels, are of a matrix that is divided by the image's size."""
_TINY = 20
"""An image of so few pixels may have such a focal length."""
_NARROWEST = 1000.0
"""Focal length in image widths above which no camera sees anything: 0.06 degrees."""
_OFF = 0.25
"""Distance of the principal point from the middle, over the image's size, that is worth a word."""


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """The camera of a depth image."""

    K: Array
    """(3, 3) float. Pixels; the centre of the first pixel is at (0.5, 0.5)."""
    size: tuple[int, int] | None = None
    """(int, int) or None. Width and height of the image that it is for, where the file says so."""
    depth_scale: float | None = None
    """Metres of one unit of a depth image of whole numbers, where the file says so."""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    """What was assumed, and what is not undone."""


def read_camera(path: Path, hints: Hints | None = None, pixel_center: PixelCenter | None = None) -> Intrinsics:
    """The camera of a file, in any format that :mod:`artperl.inputs.intrinsics_formats` knows.

    Parameters
    ----------
    path : Path
        JSON, YAML, or a matrix as text, .npy or .npz.
    hints : Hints, optional
        What is known of the image, for files of several cameras.
    pixel_center : PixelCenter, optional
        Where the file has the centre of the first pixel; by default as its format has it.

    Raises
    ------
    ConfigError
        When there is no camera in it, or none that can be.
    """
    stated: Stated = guard(lambda: stated_camera(_content(path), hints or Hints(), path), path, "intrinsics", FIX)
    center = stated.center if pixel_center is None else float(pixel_center)
    K = _upright(stated.K, path)
    check_matrix(K, path, None)
    K[:2, 2] += 0.5 - center
    whose = "" if pixel_center is None else ", as asked for"
    note = f"intrinsics of {stated.format}: the first pixel's centre is at ({center:g}, {center:g}){whose}"
    distorted = [value for value in stated.distortion if value != 0.0]
    warnings: tuple[str, ...] = ()
    if distorted:
        warnings = (
            f"{path.name} states lens distortion ({', '.join(f'{v:.3g}' for v in stated.distortion[:5])}), which is not"
            " undone. Fix: give the undistorted (rectified) depth image and its intrinsics",
        )
    return Intrinsics(K, stated.size, stated.depth_scale, (note, *stated.notes), (*warnings, *stated.warnings))


def read_intrinsics(path: Path, pixel_center: PixelCenter | None = None) -> Array:
    """(3, 3) intrinsic matrix of a file, as this project has it; see :func:`read_camera`."""
    return read_camera(path, None, pixel_center).K


def check_camera(camera: Intrinsics, size: tuple[int, int], path: Path) -> Intrinsics:
    """The camera, if it may be that of an image of a size (width, height).

    Raises
    ------
    ConfigError
        When it is stated to be of another size, is divided by the size, or looks elsewhere.
    """
    width, height = size
    if camera.size is not None and camera.size != size:
        raise ConfigError(
            f"it is of an image of {camera.size[0]} x {camera.size[1]} pixels, and the depth image has"
            f" {width} x {height}", path, "give the intrinsics of this image" + _rescale_hint(camera, size),
        )  # fmt: skip
    check_matrix(camera.K, path, size)
    if camera.size is not None:
        return camera
    center = camera.K[:2, 2] / size
    if (center > 0.9).all() or (center < 0.1).all() or (center > 1.5).any() or (center < -0.5).any():
        raise ConfigError(
            f"its principal point {_pair(camera.K[:2, 2])} is not within the depth image of {width} x {height} pixels",
            path, "give the intrinsics of this image, not of a larger or smaller one; if the image is cropped, add"
            f' "width": {width}, "height": {height} to the file',
        )  # fmt: skip
    if (np.abs(center - 0.5) > _OFF).any():
        warning = (
            f"the principal point {_pair(camera.K[:2, 2])} is far from the middle of the depth image of {width} x"
            f" {height} pixels. Fix: give the intrinsics of this very image, unless it is cropped"
        )
        return replace(camera, warnings=(*camera.warnings, warning))
    return camera


def check_matrix(K: Array, where: Path | str, size: tuple[int, int] | None) -> None:
    """Refuse what is no intrinsic matrix of an image of a size (width, height).

    Raises
    ------
    ArtsimError
        When it is none, or is divided by the size of its image.
    """
    error = ConfigError if isinstance(where, Path) else ArtsimError
    if K.shape != (3, 3) or not np.isfinite(K).all() or K[0, 0] <= 0 or K[1, 1] <= 0:
        raise error("this is no intrinsic matrix", where, "give (3, 3) with positive focal lengths, in pixels")
    if K[1, 0] or K[2, 0] or K[2, 1] or K[2, 2] != 1.0:
        raise error("this is no intrinsic matrix", where, "its lower rows must be 0 fy cy and 0 0 1")
    if size is None:
        return
    width, height = size
    if max(K[0, 0], K[1, 1]) < _NORMALISED and max(width, height) > _TINY:
        pixels = {"fx": K[0, 0] * width, "fy": K[1, 1] * height, "cx": K[0, 2] * width, "cy": K[1, 2] * height}
        raise error(
            f"focal lengths of {K[0, 0]:.4g} and {K[1, 1]:.4g} are no pixels: the matrix seems to be divided by"
            " the size of its image", where, f"multiply its rows by width and height: {_json(pixels)}",
        )  # fmt: skip
    if max(K[0, 0] / width, K[1, 1] / height) > _NARROWEST or min(K[0, 0], K[1, 1]) < 1e-2:
        raise error(f"no camera has focal lengths of {K[0, 0]:.4g} and {K[1, 1]:.4g} pixels", where, FIX)


def _upright(K: Array, path: Path) -> Array:
    """The matrix row by row, with 1 in its corner."""
    if K[2, 2] != 0 and K[2, 2] != 1 and np.isfinite(K).all():
        K = K / K[2, 2]
    # Open3D, Eigen and ARKit write columns; (0, 0, 1) is a matrix's last row, and never its last column: cx is not 0.
    return K.T.copy() if (K[:, 2] == (0, 0, 1)).all() and K[2, :2].any() else K.copy()


def _content(path: Path) -> Any:
    ending = path.suffix.lower()
    if ending in (".yaml", ".yml"):
        return _yaml(read_file(path, "intrinsics", _MAX_YAML_BYTES), path)
    if ending == ".npy":
        return read_npy(path, "intrinsics", FIX)
    if ending == ".npz":
        return _arrays(path)
    data = read_file(path, "intrinsics", _MAX_BYTES)
    if ending == ".txt" and not data.lstrip().startswith(b"{"):
        text = re.sub(r"#.*", "", data[:10_000].decode("latin-1"))
        return [float(word) for word in re.split(r"[\s,;\[\]]+", text.strip(" \t\r\n,;[]"))]
    return parse_json(data.removeprefix(b"\xef\xbb\xbf"))


def _arrays(path: Path) -> dict[str, Any]:
    """The matrix of an archive as OpenCV has it, beside its other small arrays; or these alone."""
    small = read_npz(path, "intrinsics", FIX, lambda shape, dtype: math.prod(shape) <= _SMALL and dtype.kind in "fiuU")
    values = {name: small.one_of((name.lower(),))[1].tolist() for name in list(small.fitting)[:_SMALL]}
    if all(name in values for name in ("fx", "fy", "cx", "cy")):
        return values
    choice = read_npz(path, "intrinsics", FIX, lambda s, t: s in ((3, 3), (4, 4), (3, 4)) and t.kind in "fiu")
    name, matrix = choice.one_of(
        ("k", "cam_k", "intrinsics", "intrinsic", "intrinsic_matrix", "camera_matrix", "cameramatrix", "mtx")
    )
    return {n: value for n, value in values.items() if n != name} | {"camera_matrix": matrix.tolist()}


def _yaml(data: bytes, path: Path) -> Any:
    with require_extra("intrinsics in YAML"):
        import yaml

    class Plain(yaml.SafeLoader):  # type: ignore[misc]
        """No references: a few lines of them can stand for gigabytes."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.events.AliasEvent):
                raise ConfigError("references (*name) are not read", path, "write the values in their places")
            return super().compose_node(parent, index)

    def mapping(loader: Any, node: Any) -> Any:
        return loader.construct_mapping(node, deep=True)

    Plain.add_constructor("tag:yaml.org,2002:opencv-matrix", mapping)
    text = re.sub(r"\A%YAML:1\.0[^\n]*\n", "", data.decode("utf-8"))  # OpenCV's first line is no YAML
    return next(iter(yaml.load_all(text, Loader=Plain)), None)  # rostopic echo writes one document a message


def _rescale_hint(camera: Intrinsics, size: tuple[int, int]) -> str:
    """The intrinsics of an image of the same view in another size, to be pasted; none where sides differ in ratio."""
    assert camera.size is not None
    if not min(camera.size) > 0:
        return ""
    across, down = size[0] / camera.size[0], size[1] / camera.size[1]
    if abs(across / down - 1.0) > 0.01:
        return ""
    K = camera.K
    pixels = {"fx": K[0, 0] * across, "fy": K[1, 1] * down, "cx": K[0, 2] * across, "cy": K[1, 2] * down}
    return f"; if it is the same view in another size, they are {_json(pixels)}"


def _json(pixels: dict[str, Any]) -> str:
    return json.dumps({name: round(float(value), 4) for name, value in pixels.items()})


def _pair(values: Array) -> str:
    return f"({values[0]:.4g}, {values[1]:.4g})"
