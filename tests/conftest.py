"""Objects that tests share: real ones where they are to be had, and small ones of our own."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import settings

from artsim.errors import RenderError
from artsim.kinematics import Joint, KinematicTree
from artsim.objects import ArticulatedObject, Part
from artsim.renderers import Renderer, make_renderer

ASSETS = Path(__file__).resolve().parent.parent / "urdf_assets"
DEMO = [ASSETS / name for name in ("laptop", "cabinet", "eyeglasses", "dishwasher", "scissors")]


@pytest.fixture(scope="session")
def partnet_dir() -> Path:
    """Folder of real PartNet-Mobility objects; their absence is loud, and in CI a failure."""
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    if not folder:
        message = "ARTSIM_PARTNET_DIR is not set: real PartNet-Mobility objects are not tested"
        if os.environ.get("CI"):
            pytest.fail(message)
        pytest.skip(message)
    return Path(folder)


def backend(name: str) -> Renderer:
    """A renderer that a machine may lack; its absence is loud, and in CI a failure."""
    try:
        return make_renderer(name)
    except RenderError as error:
        if os.environ.get("CI"):
            pytest.fail(str(error))
        pytest.skip(str(error))


def solid(name: str, mesh: trimesh.Trimesh) -> Part:
    """A part from a trimesh."""
    return Part(name, name, np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32))


def rigid(mesh: trimesh.Trimesh) -> ArticulatedObject:
    """An object of one part."""
    tree = KinematicTree([Joint("root", "free", -1)])
    return ArticulatedObject("solid", "solid", (solid("solid", mesh),), tree, sha256="0" * 64)


settings.register_profile("plain", max_examples=50, deadline=None)
settings.load_profile("plain")

BOX_LAPTOP = """<robot name="box_laptop">
  <link name="base"><visual><geometry><box size="0.3 0.4 0.02"/></geometry></visual></link>
  <link name="lid"><visual><origin xyz="-0.15 0 0.006"/><geometry><box size="0.3 0.4 0.01"/></geometry></visual></link>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="lid"/><origin xyz="0.15 0 0.01"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="2.2"/>
  </joint>
</robot>
"""


@pytest.fixture
def box_laptop(tmp_path: Path) -> Path:
    """URDF file of two plates on a hinge."""
    path = tmp_path / "box_laptop.urdf"
    path.write_text(BOX_LAPTOP)
    return path
