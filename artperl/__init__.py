"""artperl: 9D pose of every part of an articulated object from a partial point cloud (ArtPERL)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from artperl.estimator import Estimator

__all__ = ["load_estimator"]


def load_estimator(name: str | Path) -> Estimator:
    """An estimator by its folder, or one that comes with the package by its name, such as "laptop".

    Raises
    ------
    DatasetError
        When there is none, or its files are damaged.
    """
    from artperl.checkpoint import load_estimator as load  # torch takes seconds to import

    return load(name)
