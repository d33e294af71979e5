"""What a camera file says beside the matrix: the image's size, the unit of depth, distortion; by one table of names.

Names are compared without case, blanks, dots and underscores, so ``distCoeffs`` is ``dist_coeffs``. What the camera's
own mapping says goes before what those around it say.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any

from artsim.common.names import printable
from artsim.errors import ConfigError

Size = tuple[int, int]

_SIZES = (
    ("width", "height"), ("w", "h"), ("imagewidth", "imageheight"), ("imgwidth", "imgheight"),
    ("depthwidth", "depthheight"), ("cols", "rows"),
)  # fmt: skip
_RESOLUTIONS = ("resolution", "imagesize", "imgsize", "imageresolution", "depthresolution", "size", "imagedim")

_METRES, _PER_METRE, _EITHER, _PERHAPS = "metres", "units in a metre", "either", "perhaps"
_SCALES = {
    _METRES: (  # instant-ngp; nerfstudio; RealSense
        "integerdepthscale", "scaletometers", "scaletometer", "depthscaletometers", "depthtometers", "depthunit",
        "depthunits", "depthunitscale", "depthunitscalefactor", "metersperunit", "metresperunit", "depthunitinmeters",
        "depthunitmeters", "depthscalemeters", "depthscaleinmeters",
    ),
    _PER_METRE: (  # NICE-SLAM, SplaTAM; ORB-SLAM; GraspNet, YCB-Video; ScanNet
        "pngdepthscale", "depthmapfactor", "factordepth", "depthshift", "mdepthshift", "unitspermeter", "depthdivisor",
    ),
    _EITHER: ("depthscale", "depthfactor", "depthscalefactor", "depthscalingfactor", "depthscaling"),
    _PERHAPS: ("scale", "factor"),  # Replica's camera.scale; TUM
}  # fmt: skip
_SCALE_KIND = {name: kind for kind, names in _SCALES.items() for name in names}
_WORDS = {
    "m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0, "cm": 0.01, "mm": 0.001, "millimeter": 0.001,
    "millimeters": 0.001, "millimetre": 0.001, "millimetres": 0.001, "um": 1e-6,
}  # fmt: skip
"""Units by their names, in metres."""
_UNIT = (1e-6, 0.02)
"""Metres that one step of a depth image can be. The same in units of a metre is 50 or more: no number is both."""
_BOP = (0.005, 20.0)
"""The same in BOP's millimetres."""
_OTHERS = ("aabbscale", "thingsscale")
"""Of a NeRF's scene, of objects in a scene of artsim: none says anything of a depth image. Nor does a NeRF's scale."""

_DISTORTION = re.compile(
    r"(lens|depth|camera)?(d|dist|distortion|coeffs|kc|(dist|distortion)(coeff?s?|coefficients?|params?|parameters|"
    r"vector)|(radial|tangential)(distortion|params|coeff?s?|coefficients)?|k[1-6]|p[12]|s[1-4])"
)
_MODEL = ("distortionmodel", "cameramodel", "model", "cameratype", "type", "lens", "lensmodel", "isfisheye", "fisheye")
_FISHEYE = re.compile(r"fish|equidist|kannala|omni|panoram|equirect|spheric|double.?sphere|\beucm\b|\bmei\b", re.I)
_TELLING = re.compile(r"scale|unit|factor|dist|k1(?!\d)")
"""Names that may change where points are: nothing of the kind is left out without a word."""

_DEEPEST, _MOST = 4, 2000
"""Levels below the camera's mappings, and values, that are looked at."""
_LISTED = 6


@dataclass(frozen=True)
class Beside:
    """What is stated beside a matrix; as the fields of :class:`artperl.inputs.intrinsics_formats.Stated`.

    ``foreign``: whether artsim never writes so.
    """

    size: Size | None = None
    depth_scale: float | None = None
    distortion: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    foreign: bool = False


def plain(name: str) -> str:
    """A name as tables have it: lower case, letters and digits alone."""
    return re.sub(r"[^a-z0-9]", "", name.lower())


def beside(
    around: Sequence[Mapping[str, Any]], others: Sequence[Any], form: str, image: Size | None, path: Path
) -> Beside:
    """What mappings say beside a camera's matrix.

    Parameters
    ----------
    around : sequence of mapping
        The camera's own, then those around it.
    others : sequence
        Cameras in them that are not taken.
    form : str
        What the format is called.
    image : (int, int) or None
        Width and height of the depth image.
    path : Path
        For messages.

    Raises
    ------
    ConfigError
        When a unit of depth cannot be one.
    """
    scales, distortion, foreign = dict[str, float](), list[float](), False
    warnings, ignored, harmless = list[str](), dict[str, str](), dict[str, None]()
    others_scales = (*_OTHERS, *(("scale",) if "NeRF" in form else ()))
    seen = {id(one) for one in (*around, *others)}
    for names, value in _leaves(around, seen):
        last, shown = plain(names[-1]), printable(".".join(names))
        kinds = [plain("".join(names[-2:])), last]  # depth: {scale: ...} is depth_scale
        known = next((kind for kind in kinds if kind in _SCALE_KIND), None)
        numbers = _numbers(value)
        if any(kind in others_scales for kind in kinds):
            harmless[shown] = None
            continue
        if known is not None:
            scale = _scale(known, value, form, shown, path)
            if scale is not None:
                scales[f"{shown} {str(value)[:40]}"] = scale
                foreign |= _SCALE_KIND[known] in (_PER_METRE, _PERHAPS)
                continue
        if numbers and (_DISTORTION.fullmatch(last) or any(_DISTORTION.fullmatch(plain(name)) for name in names[:-1])):
            distortion += numbers
        elif last in _MODEL and (value is True or (isinstance(value, str) and _FISHEYE.search(value))):
            warnings.append(
                f"{path.name} states a lens that is no pinhole ({shown}: {printable(str(value)[:40])}), which is not"
                " undone. Fix: give the undistorted (rectified) depth image and its intrinsics"
            )
        elif _TELLING.search(last) and last not in _MODEL and value is not None:
            ignored.setdefault(shown, printable(str(value)[:40]))
    scale = next(iter(scales.values()), None)
    if scale is not None and any(abs(other / scale - 1.0) > 1e-6 for other in scales.values()):
        warnings.append(f"{path.name} states several units of depth: the first of {', '.join(scales)} is taken")
    if ignored:
        listed = [f"{name}: {value}" for name, value in ignored.items()]
        warnings.append(
            f"ignored in {path.name}: {', '.join(listed[:_LISTED])}{', ...' if len(listed) > _LISTED else ''}. Fix: if"
            " it is the unit of depth, add --depth-scale METRES of one unit"
        )
    notes = (f"not of the depth image: {', '.join(list(harmless)[:_LISTED])}",) if harmless else ()
    return Beside(
        stated_size(around, image), scale, tuple(distortion), notes, tuple(warnings), foreign or bool(distortion)
    )


def stated_size(around: Sequence[Mapping[str, Any]], image: Size | None) -> Size | None:
    """Width and height that the first mapping with any states; of several, one that is not the image's."""
    for data in around:
        found = list(_sizes({plain(name): value for name, value in data.items()}, image))
        if found:
            return next((size for size in found if size != image), found[0])
    return None


def _sizes(data: Mapping[str, Any], image: Size | None) -> Iterator[Size]:
    pairs = [(data[across], data[down]) for across, down in _SIZES if across in data and down in data]
    for name in _RESOLUTIONS:
        value = data.get(name)
        if isinstance(value, Mapping):
            yield from _sizes({plain(key): v for key, v in value.items()}, image)
        elif isinstance(value, str) and (words := re.fullmatch(r"\s*(\d{1,6})\s*[xX*, ]\s*(\d{1,6})\s*", value)):
            pairs.append((int(words[1]), int(words[2])))
        elif len(numbers := _numbers(value)) in (2, 3):
            # (height, width) is an array's shape.
            pairs.append((numbers[1], numbers[0]) if (numbers[1], numbers[0]) == image else (numbers[0], numbers[1]))
    for width, height in pairs:
        values = _numbers([width, height])
        if len(values) == 2 and min(values) > 0:  # a CameraInfo that nobody filled in has 0
            yield round(values[0]), round(values[1])


def _leaves(around: Sequence[Mapping[str, Any]], seen: set[int]) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Names and values in and below mappings, but for mappings that are seen elsewhere."""

    def below(data: Mapping[str, Any], names: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
        for name, value in data.items():
            here = (*names, str(name)[:60])
            inner = [v for v in (value[:64] if isinstance(value, list) else [value]) if isinstance(v, Mapping)]
            if not inner or "data" in inner[0]:  # OpenCV's matrices are mappings
                yield here, value
            elif len(here) <= _DEEPEST:
                for one in inner:
                    if id(one) not in seen:
                        yield from below(one, here)

    return islice(chain.from_iterable(below(data, ()) for data in around), _MOST)


def _numbers(value: Any) -> list[float]:
    """Finite numbers of a number, of a list, nested or not, or of an OpenCV matrix; none of anything else."""
    if isinstance(value, Mapping):
        value = value.get("data")
    rows = value if isinstance(value, list) else [value]
    flat = [v for row in rows[:64] for v in (row[:64] if isinstance(row, list) else [row])]
    if not all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in flat):
        return []
    return [float(v) for v in flat if math.isfinite(v)]


def _scale(name: str, value: Any, form: str, shown: str, path: Path) -> float | None:
    """Metres of one unit of depth; None where it may be something else."""
    if isinstance(value, str):
        return _WORDS.get(value.strip().lower()) if _SCALE_KIND[name] != _PERHAPS else None
    numbers = _numbers(value)
    if len(numbers) != 1:
        return None
    (number,), kind = numbers, _SCALE_KIND[name]
    if form == "BOP" and name == "depthscale":
        if _BOP[0] <= number <= _BOP[1]:
            return 0.001 * number
        meant = "BOP's, which is millimetres of one unit"
    else:
        if kind != _PER_METRE and _UNIT[0] <= number <= _UNIT[1]:
            return number
        if kind != _METRES and 1.0 / _UNIT[1] <= number <= 1.0 / _UNIT[0]:
            return 1.0 / number
        if kind == _PERHAPS:
            return None
        meant = {_METRES: "metres of one unit", _EITHER: "metres of one unit, or units in a metre"}.get(kind, kind)
    raise ConfigError(
        f"{shown} {number:g} cannot be {meant}", path,
        "add --depth-scale METRES, of one unit of the depth image, such as 0.001; and leave it out of the file, or"
        " write it so",
    )  # fmt: skip
