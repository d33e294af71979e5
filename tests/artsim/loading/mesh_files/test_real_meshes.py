"""Real mesh files of other people: the same surfaces as trimesh and pycollada read, where those read them right."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import trimesh

from tests.artsim.loading.mesh_builders import area, triangles, volume
from tests.conftest import installed


def compare(path: Path, unit: float = 1.0) -> None:
    """Area, volume, bounds and a first moment of both readings."""
    data, kind = path.read_bytes(), path.suffix.lower()
    vertices, faces, _ = triangles(data, kind, path)
    scene = trimesh.load_scene(io.BytesIO(data), file_type=kind[1:], process=False, skip_materials=True)
    other = scene.to_mesh()
    theirs, named = np.asarray(other.vertices) * unit, np.asarray(other.faces)
    size = np.ptp(theirs[named].reshape(-1, 3), axis=0).max()
    assert len(faces) == len(named)
    assert area(vertices, faces) == pytest.approx(area(theirs, named), rel=1e-6)
    assert volume(vertices, faces) == pytest.approx(volume(theirs, named), abs=1e-6 * size * area(theirs, named))
    corners, corners_of_theirs = vertices[faces].reshape(-1, 3), theirs[named].reshape(-1, 3)
    assert np.abs(corners.min(axis=0) - corners_of_theirs.min(axis=0)).max() < 1e-6 * size
    assert np.abs(corners.max(axis=0) - corners_of_theirs.max(axis=0)).max() < 1e-6 * size
    assert np.abs(corners.mean(axis=0) - corners_of_theirs.mean(axis=0)).max() < 1e-6 * size


PYBULLET = {
    "duck.obj": 1.0, "duck.dae": 0.01, "racecar/meshes/cone.dae": 0.0254, "racecar/meshes/parking_1.dae": 1.0,
    "racecar/meshes/hokuyo.dae": 1.0, "racecar/meshes/chassis.dae": 1.0, "kuka_iiwa/meshes/link_0.stl": 1.0,
    "kuka_iiwa/meshes/link_3.obj": 1.0, "bunny.obj": 1.0, "cube.obj": 1.0,
}  # fmt: skip


@pytest.mark.parametrize(("name", "unit"), PYBULLET.items())
def test_files_of_pybullet(name: str, unit: float) -> None:
    compare(Path(installed("pybullet_data").getDataPath()) / name, unit)


@pytest.mark.parametrize("category", ["Laptop", "Faucet", "StorageFurniture", "Window", "Box", "Switch"])
def test_files_of_partnet_mobility(category: str, partnet_dir: Path) -> None:
    files = sorted((partnet_dir / category).glob("*/textured_objs/*.obj"))
    for path in files[:: max(1, len(files) // 12)]:
        compare(path)


def test_concave_faces_of_a_real_refrigerator_do_not_overlap(partnet_dir: Path) -> None:
    """A fan, as trimesh divides them, covers 0.0036 more than there is."""
    path = partnet_dir / "Refrigerator" / "12252" / "textured_objs" / "new-1-left.obj"
    vertices, faces, _ = triangles(path.read_bytes(), ".obj", path)
    assert area(vertices, faces) == pytest.approx(6.3811019, abs=1e-6)
    fan = trimesh.load_scene(path, process=False, skip_materials=True).to_mesh()
    assert fan.area - area(vertices, faces) == pytest.approx(0.00361, abs=1e-5)
