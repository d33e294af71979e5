"""The objects that demo and benchmarks show: our own, and the Franka Panda that comes with PyBullet."""

from __future__ import annotations

import importlib.util
from pathlib import Path

ASSETS = Path(__file__).resolve().parent.parent / "urdf_assets"


def demo_paths() -> list[Path]:
    """URDF files of the demo objects."""
    paths = [ASSETS / name for name in ("laptop", "cabinet", "eyeglasses", "dishwasher", "scissors")]
    data = importlib.util.find_spec("pybullet_data")
    if data is not None and data.submodule_search_locations:
        paths.append(Path(data.submodule_search_locations[0]) / "franka_panda" / "panda.urdf")
    return paths
