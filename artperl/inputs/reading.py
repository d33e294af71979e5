"""From a user's file to a cloud in the camera frame, in metres."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.clouds import READERS, read_cloud_file
from artperl.inputs.depth_images import ARRAYS, PICTURES, DepthImage, DepthKind, points_of_depth, read_depth
from artperl.inputs.intrinsics import Intrinsics, PixelCenter, check_camera, read_camera
from artperl.inputs.intrinsics_formats import Hints
from artperl.inputs.masks import MASK_FILES, MaskKind, cut_warnings, read_mask
from artsim.errors import ConfigError
from artsim.model.camera import Camera

Array = NDArray[np.float64]

Unit = Literal["m", "mm", "cm"]
METRES: dict[str, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_WHOLE = 0.5
"""Share of an image with depth from which it shows more than an object that was cut out."""
_OPENGL = np.array([1.0, -1.0, -1.0])
"""From a camera that looks along -z, y up, to one that looks along z, y down."""


@dataclass(frozen=True)
class InputOptions:
    """How a file is to be understood.

    Attributes
    ----------
    unit : Unit or None
        Of the coordinates of a cloud, or of depth; by default metres, and millimetres for depth in whole numbers.
    camera : "opencv" or "opengl"
        Axes of the cloud: x right, y down, z forward; or x right, y up, z back.
    intrinsics : Path or None
        Makes the file a depth image.
    mask : Path or None
        Of the object in the depth image; or a folder of masks with the names of the depth images.
    mask_id, mask_kind
        See :func:`artperl.inputs.masks.read_mask`.
    depth_scale : float or None
        Units of one step of the depth image: metres, or what ``unit`` says.
    depth_kind : DepthKind
    pixel_center, image_id
        See :func:`artperl.inputs.intrinsics.read_camera`.
    """

    unit: Unit | None = None
    camera: Literal["opencv", "opengl"] = "opencv"
    intrinsics: Path | None = None
    mask: Path | None = None
    mask_id: str | None = None
    mask_kind: MaskKind = "auto"
    depth_scale: float | None = None
    depth_kind: DepthKind = "z"
    pixel_center: PixelCenter | None = None
    image_id: str | None = None

    def absolute(self) -> InputOptions:
        """The same for a process that runs in another folder."""
        intrinsics, mask = (None if path is None else path.absolute() for path in (self.intrinsics, self.mask))
        return replace(self, intrinsics=intrinsics, mask=mask)


@dataclass(frozen=True, eq=False)
class Cloud:
    """A cloud of a file.

    Attributes
    ----------
    points : (N, 3) float
        Camera frame (x right, y down, z forward), metres.
    notes, warnings : tuple of str
        What was assumed or left out, and what looks wrong, with its fix.
    """

    points: Array
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def read_cloud(path: Path, options: InputOptions | None = None) -> Cloud:
    """The cloud of a file: of a point cloud, or of a depth image where there are intrinsics.

    Raises
    ------
    ConfigError
        When a file cannot be read, or options do not fit it.
    ArtsimError
        When there is no depth within the mask.
    """
    options = options or InputOptions()
    if options.depth_scale is not None and not (np.isfinite(options.depth_scale) and options.depth_scale > 0):
        raise ConfigError(
            f"{options.depth_scale} is no scale", "depth_scale", "use --depth-scale 0.001 for millimetres"
        )
    return _of_points(path, options) if options.intrinsics is None else _of_depth(path, options.intrinsics, options)


def read_points(
    path: Path, mask: Path | None = None, intrinsics: Path | None = None, depth_scale: float | None = None
) -> Array:
    """(N, 3) points of a file; see :func:`read_cloud`, which also says what it assumed."""
    return read_cloud(path, InputOptions(mask=mask, intrinsics=intrinsics, depth_scale=depth_scale)).points


def is_readable(path: Path, options: InputOptions) -> bool:
    """Whether a file's name is that of a cloud, or of a depth image where there are intrinsics."""
    ending = path.suffix.lower()
    return ending in READERS if options.intrinsics is None else ending in PICTURES + ARRAYS


def _of_points(path: Path, options: InputOptions) -> Cloud:
    if path.suffix.lower() in PICTURES:
        raise ConfigError("a depth image needs intrinsics", path, "add --intrinsics camera.json")
    of_depth = {"mask": options.mask, "mask-id": options.mask_id, "depth-scale": options.depth_scale}
    given = next((name for name, value in of_depth.items() if value is not None), None)
    if given is not None:
        raise ConfigError(
            f"--{given} is for depth images, and they need intrinsics", path,
            "add --intrinsics camera.json; for a cloud in millimetres use --unit mm",
        )  # fmt: skip
    points, notes = read_cloud_file(path)
    return Cloud(_axes(points * METRES[options.unit or "m"], options), notes)


@dataclass(frozen=True, eq=False)
class MetricDepth:
    """A depth image in metres, and its camera."""

    values: Array
    """(H, W) float. 0, or not finite, where nothing was measured."""
    K: Array
    """(3, 3) float. Pixels; the centre of the first pixel is at (0.5, 0.5)."""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    """As of :class:`Cloud`."""


def read_depth_image(path: Path, options: InputOptions) -> MetricDepth:
    """The depth image of a file, along the camera's axis; ``options.intrinsics`` has to be given.

    Raises
    ------
    ConfigError
        When a file cannot be read, or options do not fit it.
    """
    assert options.intrinsics is not None
    image, camera = _image_and_camera(path, options.intrinsics, options)
    height, width = image.values.shape
    metres, said = _metres_of(image.whole, camera.depth_scale, options)
    depth = image.values * metres
    if options.depth_kind == "distance":
        pixels = np.arange(depth.size)
        rays = Camera(camera.K, width, height, np.eye(4)).directions(pixels)
        depth = depth / np.linalg.norm(rays, axis=1).reshape(depth.shape)
    notes, warnings = (*image.notes, *camera.notes, said), (*image.warnings, *camera.warnings)
    return MetricDepth(depth, camera.K, notes, warnings)


def _image_and_camera(path: Path, intrinsics: Path, options: InputOptions) -> tuple[DepthImage, Intrinsics]:
    """A depth image as it stands in its file, and the camera, which fits it."""
    image = read_depth(path)
    height, width = image.values.shape
    hints = Hints(options.image_id, path.stem, (width, height))
    return image, check_camera(read_camera(intrinsics, hints, options.pixel_center), (width, height), intrinsics)


def _of_depth(path: Path, intrinsics: Path, options: InputOptions) -> Cloud:
    image, camera = _image_and_camera(path, intrinsics, options)
    height, width = image.values.shape
    notes, warnings = [*image.notes, *camera.notes], [*image.warnings, *camera.warnings]
    shown = None
    if options.mask is not None:
        file = _mask_file(options.mask, path)
        mask = read_mask(file, options.mask_id, options.mask_kind)
        if mask.shown.shape != (height, width):
            rows, columns = mask.shown.shape
            raise ConfigError(
                f"a mask of {columns} x {rows} pixels does not fit a depth image of {width} x {height}", file,
                f"give the mask of this image, or resize it: python -c \"from PIL import Image;"
                f" Image.open('{file.name}').resize(({width}, {height}), 0).save('mask.png')\"",
            )  # fmt: skip
        if not mask.shown.any():
            raise ConfigError("the mask shows no object: all of it is black", file, "give the mask of this image")
        shown, notes, warnings = mask.shown, [*notes, *mask.notes], [*warnings, *mask.warnings]
    metres, said = _metres_of(image.whole, camera.depth_scale, options)
    depth = image.values * metres
    if options.camera == "opengl" and not (depth > 0).any():  # z points back there
        depth = -depth
    elif not (depth > 0).any() and (depth < 0).any():
        raise ConfigError("all depth is negative, as along the z axis of OpenGL", path, "add --camera opengl")
    if shown is None and float((depth > 0).mean()) > _WHOLE:
        warnings.append(
            "without a mask, the whole image is taken for one object. Fix: add --mask mask.png, or name the image in"
            " colour first, so that objects are found: artperl estimate image.png depth.png --intrinsics camera.json"
        )
    if shown is not None:
        warnings.extend(cut_warnings(shown))
    points = points_of_depth(depth, camera.K, shown, options.depth_kind)
    return Cloud(points, (*notes, said), tuple(warnings))


def _metres_of(whole: bool, stated: float | None, options: InputOptions) -> tuple[float, str]:
    """Metres of one unit of a depth image, and why."""
    if options.depth_scale is not None:
        unit = options.unit or "m"
        return options.depth_scale * METRES[unit], f"one unit of depth is {options.depth_scale:g} {unit}, as asked for"
    if options.unit is not None:
        return METRES[options.unit], f"depth is in {options.unit}, as asked for"
    if whole and stated is not None:
        return stated, f"one unit of depth is {1000 * stated:g} mm, as the intrinsics state"
    if whole:
        return 0.001, "depth in whole numbers is taken for mm"
    unused = "" if stated is None else f"; the {1000 * stated:g} mm of the intrinsics are for whole numbers"
    return 1.0, f"depth in floats is taken for m{unused}"


def _mask_file(mask: Path, depth: Path) -> Path:
    """The mask of a depth image: the file itself; in a folder that of the same name, or (BOP) a name that begins so."""
    if not mask.is_dir():
        return mask
    files = sorted(file for file in mask.iterdir() if file.suffix.lower() in MASK_FILES)
    found = [file for file in files if file.stem == depth.stem]
    found = found or [file for file in files if file.stem.startswith(f"{depth.stem}_")]
    if len(found) != 1:
        several = ", ".join(file.name for file in found[:5])
        raise ConfigError(
            f"{len(found) or 'no'} masks are of {depth.name}" + (f": {several}" if found else ""), mask,
            f"name the mask of each depth image as the image: {depth.stem}.png",
        )  # fmt: skip
    return found[0]


def _axes(points: Array, options: InputOptions) -> Array:
    return points * _OPENGL if options.camera == "opengl" else points
