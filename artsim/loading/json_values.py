"""Values out of annotations in JSON, checked: what is wrong is an error that names the element."""

from pathlib import Path

import numpy as np

from artsim.errors import AssetError
from artsim.model.joints import LARGEST
from artsim.model.kinematics import Array

_MAX_NAME = 200
"""Characters of a name."""


def text(value: object, key: str, where: str | Path) -> str:
    """A name that is not empty; raises AssetError."""
    if not isinstance(value, str) or not value.strip():
        raise AssetError(f"its {key!r} is no text", where, f'write "{key}": "..."')
    return value[:_MAX_NAME]


def whole(value: object, key: str, where: str | Path) -> int:
    """A whole number; raises AssetError."""
    if not isinstance(value, int) or isinstance(value, bool):
        raise AssetError(f"its {key!r} is no whole number", where, f'write "{key}": 0')
    return value


def number(value: object, key: str, where: str | Path) -> float:
    """A finite number that something can be computed with; raises AssetError."""
    if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) <= LARGEST:
        raise AssetError(f"its {key!r} is no number up to {LARGEST:g}", where, f'write "{key}": 0.0')
    return float(value)


def triple(value: object, key: str, where: str | Path) -> Array:
    """(3,) finite numbers; raises AssetError."""
    if not isinstance(value, list) or len(value) != 3:
        raise AssetError(f"its {key!r} is no list of 3 numbers", where, f'write "{key}": [0, 0, 0]')
    return np.array([number(entry, key, where) for entry in value])
