"""What looks wrong with a cloud: its unit, its axes, and what of it was measured.

A fit has no scale of its own: a laptop of 180 m fits as well as one of 0.3 m. So the cloud is checked before.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from artperl.core.clouds import is_measured
from artperl.core.usual_sizes import size_warning
from artperl.perception.preprocess import Cloud

Array = NDArray[np.float64]

_LARGEST, _SMALLEST = 5.0, 0.005
"""Metres. Garage doors and earrings are beyond what the estimators know, and files in millimetres are, too."""
_LIKELY = (0.05, 3.0)
"""Metres that most articulated objects measure, for a guess at the unit."""
_UNIT = "hardly is in metres"
_OUTERMOST = 1.0
"""Percent of the points on each side that are left out of an extent."""
_MANY = 0.1
"""Share of points without a measurement that is worth a word."""
_BEHIND = 0.01
"""Share of points behind the camera from which it is no noise."""
_FEW = 128
"""Points below which estimates are guesses; estimators look at 1,024 and more."""


def cloud_warnings(cloud: Cloud) -> tuple[str, ...]:
    """One line for each thing that looks wrong, with its fix for the command line and for Python."""
    shown = cloud.points[cloud.good]
    return (*_unit(shown), *_axes(shown), *_missing(cloud.points, cloud.masked), *_few(shown))


def with_size(warnings: tuple[str, ...], size: Array, categories: Sequence[str]) -> tuple[str, ...]:
    """Warnings, with one of an object's size if its boxes (K, 3) are not of its category and nothing is said yet."""
    if any(_UNIT in text for text in warnings):
        return warnings
    said = size_warning(float(np.linalg.norm(size, axis=1).max()), categories)
    return warnings if said is None else (*warnings, said)


def _unit(shown: Array) -> list[str]:
    low, high = np.percentile(shown, [_OUTERMOST, 100.0 - _OUTERMOST], axis=0)
    extent = float((high - low).max())
    if extent > _LARGEST:
        units = [(name, factor) for name, factor in (("mm", 0.001), ("cm", 0.01)) if _LIKELY[0] <= extent * factor]
        likely = [(name, factor) for name, factor in units if extent * factor <= _LIKELY[1]] or units[:1]
        fixes = " or ".join(
            f"--unit {name} ({extent * factor:.2g} m; in Python: points * {factor:g})" for name, factor in likely
        )
        return [
            f"the object is {extent:.3g} m across, so that the cloud {_UNIT}. Fix: add"
            f" {fixes or '--unit mm'}; or crop the cloud to the object"
        ]
    if extent < _SMALLEST:
        return [
            f"the object is {1000 * extent:.2g} mm across, so that the cloud {_UNIT}. Fix: leave out --unit"
            " and --depth-scale, or correct them; in Python: points * 1000 if they were divided by 1000 twice"
        ]
    return []


def _axes(shown: Array) -> list[str]:
    behind = float((shown[:, 2] <= 0).mean())
    if behind == 1.0:
        return [
            "every z is negative: the camera seems to look along -z, as in OpenGL and Blender. Fix: add --camera opengl"
            " (in Python: points * [1, -1, -1]); or leave it out if it is there"
        ]
    if behind > _BEHIND:
        return [
            f"{100 * behind:.0f} % of the points lie behind the camera (z <= 0). Fix: give the cloud in the camera's"
            " frame (x right, y down, z forward), not in the world's or the object's"
        ]
    return []


def _missing(points: Array, masked: int) -> list[str]:
    origin = float((points == 0).all(axis=1).mean())
    lost = float((~is_measured(points)).mean()) - origin - masked / len(points)
    warnings = [f"{masked} rows of the masked array are left out. Fix: none is needed"] if masked else []
    if origin > _MANY:
        warnings.append(
            f"{100 * origin:.0f} % of the points are at exactly 0 0 0, where sensors put what they did not measure:"
            " they are left out. Fix: none is needed; in Python: points[points.any(axis=1)]"
        )
    if lost > _MANY:
        warnings.append(
            f"{100 * lost:.0f} % of the points are not finite: they are left out. Fix: none is needed if the sensor saw"
            " no more; in Python: points[np.isfinite(points).all(axis=1)]"
        )
    return warnings


def _few(shown: Array) -> list[str]:
    if len(shown) >= _FEW:
        return []
    return [f"only {len(shown)} points show the object. Fix: give all points that the sensor saw, 1,000 or more"]
