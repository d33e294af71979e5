"""Bodies of loaded objects: hulls, and plates where a surface lies in a plane."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from artsim.export import FORMATS, export
from artsim.loading.urdf import load
from artsim.model.convex_bodies import add_bodies, add_surface_bodies, convex_hull, is_convex, is_flat
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from tests.conftest import installed

Bodies = Callable[[ArticulatedObject], ArticulatedObject]


def square(turn: Array) -> Array:
    """Corners of a square with sides of 1 m, turned, somewhere."""
    return np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]) @ turn.T + (3.0, -2.0, 1.0)


@pytest.mark.parametrize("seed", range(5))
def test_a_plane_becomes_a_plate_however_it_is_turned(seed: int) -> None:
    points = square(Rotation.random(rng=np.random.default_rng(seed)).as_matrix())
    hull = trimesh.Trimesh(*convex_hull(points, 0.01))
    assert is_flat(points)
    assert hull.is_volume
    assert hull.volume == pytest.approx(0.01)
    np.testing.assert_allclose(hull.center_mass, points.mean(axis=0), atol=1e-9)


def test_a_line_becomes_a_rod_and_a_point_a_cube() -> None:
    rod = trimesh.Trimesh(*convex_hull(np.array([[0, 0, 0], [1, 2, 2.0]]), 0.01))
    assert rod.volume == pytest.approx(3.0 * 0.01**2)
    assert trimesh.Trimesh(*convex_hull(np.array([[5.0, 0, 0]]), 0.01)).volume == pytest.approx(0.01**3)


def test_what_is_solid_keeps_its_hull() -> None:
    thin = trimesh.creation.box((1.0, 1.0, 0.02))
    vertices, faces = convex_hull(np.asarray(thin.vertices), 0.01)
    assert is_convex(vertices, faces)
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(0.02)


@pytest.mark.parametrize("bodies", [add_bodies, add_surface_bodies])
def test_a_loaded_part_that_is_flat_is_taken_by_mujoco(bodies: Bodies, tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    corners = square(Rotation.from_euler("xyz", (0.5, 0.6, 0.7)).as_matrix())
    trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False).export(tmp_path / "sheet.obj")
    (tmp_path / "door.urdf").write_text(
        '<robot name="d"><link name="a"><visual><geometry><box size="1 1 1"/></geometry></visual></link>'
        '<link name="b"><visual><geometry><mesh filename="sheet.obj"/></geometry></visual></link>'
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
        '<limit lower="0" upper="1"/></joint></robot>'
    )
    export(bodies(load(tmp_path / "door.urdf")), tmp_path / "out", ["mjcf"])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / FORMATS["mjcf"]))
    assert model.njnt == 1
