"""Kinematics of every real object against PyBullet's and yourdfpy's own."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artsim import load, make
from artsim.loading.sources import find_sources
from artsim.physics.simulators import poses_in_file
from tests.conftest import ASSETS, installed
from tests.oracles import Poses, deviation, pybullet_poses, random_states


@pytest.fixture(params=[pybullet_poses, poses_in_file], ids=["pybullet", "yourdfpy"])
def oracle(request: pytest.FixtureRequest) -> Any:
    return request.param


def assert_moves_as(oracle: Any, files: list[Path]) -> None:
    for file in files:
        obj = load(file)
        poses: Poses = oracle(file)
        parts, largest = deviation(obj, poses, random_states(obj, 20))
        assert parts == len(obj), file
        assert largest < 1e-6, file


@pytest.mark.slow
def test_every_real_object_moves_as_in_pybullet_and_yourdfpy(partnet_dir: Path, oracle: Any) -> None:
    """163 objects at 20 random states; no exceptions."""
    assert_moves_as(oracle, [source.path for source in find_sources([partnet_dir])])


@pytest.mark.slow
def test_robots_and_quirk_cases_move_as_in_pybullet_and_yourdfpy(oracle: Any) -> None:
    """``limits`` is left out: its zero axis is NaN to yourdfpy and an error to PyBullet."""
    data = Path(installed("pybullet_data").getDataPath())
    names = ["franka_panda/panda", "kuka_iiwa/model", "xarm/xarm6_robot", "r2d2", "a1/a1", "laikago/laikago"]
    quirks = [path for path in (ASSETS / "quirks").glob("*/*.urdf") if path.stem != "limits"]
    assert_moves_as(oracle, [*(data / f"{name}.urdf" for name in names), *sorted(quirks)])


def test_a_deviation_is_seen() -> None:
    """The oracle moves by other joints: by the loader's own, it would not be one."""
    obj = make("drawer", 0)

    def still(values: Mapping[str, float]) -> dict[str, Any]:
        return {part.name: np.eye(4) for part in obj.parts}

    parts, largest = deviation(obj, still, random_states(obj, 3))
    assert parts == len(obj)
    assert largest > 0.01
