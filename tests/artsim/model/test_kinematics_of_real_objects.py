"""Kinematics of every real object against PyBullet's and yourdfpy's own."""

from __future__ import annotations

from pathlib import Path

import pytest

from artsim.loading.sources import find_sources
from benchmarks.kinematics import bullet_robots, compare
from tests.conftest import ASSETS

pytestmark = pytest.mark.slow


def test_every_real_object_moves_as_in_pybullet_and_yourdfpy(partnet_dir: Path) -> None:
    """163 objects at 20 random states; no exceptions."""
    files = [source.path for source in find_sources([partnet_dir])]
    result, failed = compare(files, states=20)
    assert failed == []
    for name, comparison in result.items():
        assert comparison.compared == len(files), (name, comparison.not_loaded)
        assert comparison.max_m < 1e-6, name
        assert comparison.max_rad < 1e-6, name


def test_robots_and_quirk_cases_move_as_in_pybullet_and_yourdfpy() -> None:
    """``limits`` is left out: its zero axis is NaN to yourdfpy and an error to PyBullet."""
    quirks = [path for path in (ASSETS / "quirks").glob("*/*.urdf") if path.stem != "limits"]
    files = [*bullet_robots(), *sorted(quirks)]
    result, failed = compare(files, states=20)
    assert failed == []
    for name, comparison in result.items():
        assert comparison.compared == len(files), (name, comparison.not_loaded)
        assert comparison.max_m < 1e-6, name
        assert comparison.max_rad < 1e-6, name
