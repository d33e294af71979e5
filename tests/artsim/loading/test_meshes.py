"""The awkward mesh files of tests/cases, as their expected.txt says; and what the loader makes of files in general."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from artsim import load
from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits, MeshReader
from artsim.loading.urdf_document import Box, Capsule, Cylinder, Geometry, MeshFile, Sphere
from tests.artsim.loading.mesh_builders import SQUARE, area, dae, urdf
from tests.conftest import CASES

TWO_WEDGES = [0.6, 0.2, 0.3]
WEDGE = [0.1, 0.2, 0.3]


@pytest.mark.parametrize(
    ("case", "count", "size", "surface"),
    [
        ("M01", 16, TWO_WEDGES, 0.292111),
        ("M04", 8, WEDGE, 0.146056),
        ("M05", 6, [0.3, 0.3, 0], 0.07),
        ("M06", 8, WEDGE, 0.146056),
        ("M18", 8, WEDGE, 0.146056),
        ("M18b", 16, TWO_WEDGES, 0.292111),
        ("V05a", 8, WEDGE, 0.146056),
        ("V05d", 8, WEDGE, 0.146056),
    ],
)
def test_a_case_arrives_whole(case: str, count: int, size: list[float], surface: float) -> None:
    obj = load(CASES / case)
    part = obj.parts[1]
    assert len(part.faces) == count
    assert np.ptp(part.bounds, axis=0) == pytest.approx(size, abs=1e-7)
    assert area(part.vertices, part.faces) == pytest.approx(surface, rel=1e-5)
    said = [str(repair) for repair in obj.repairs if "mesh" in repair.where]
    assert [("up_axis" in text) for text in said] == ([True] if case == "M06" else [])


def test_a_required_extension_is_refused_by_name() -> None:
    with pytest.raises(AssetError, match="KHR_draco_mesh_compression"):
        load(CASES / "M02")


@pytest.mark.parametrize("name", ["dae_instance_bomb", "ply_no_vertices", "spheres"])
def test_a_bomb_is_refused(name: str) -> None:
    with pytest.raises(AssetError, match=r"pieces|more than its bytes can hold|more than 5000000 triangles"):
        load(CASES / "hostile" / name)


def test_the_units_of_a_file_come_before_the_scale_of_the_urdf(tmp_path: Path) -> None:
    (tmp_path / "m.dae").write_text(dae(asset='<unit meter="0.01"/>'))
    (tmp_path / "r.urdf").write_text(urdf("m.dae", scale=' scale="10 20 -30"'))
    part = load(tmp_path).parts[1]
    assert np.ptp(part.bounds, axis=0) == pytest.approx([0.01, 0.04, 0.09])


def test_one_file_that_is_named_often_is_read_once_and_said_once(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(SQUARE + "f 1 2 3 4\nl 1 2\n")
    (tmp_path / "r.urdf").write_text(urdf("m.obj", count=50))
    obj = load(tmp_path)
    assert len(obj.parts[1].faces) == 100
    assert [str(r) for r in obj.repairs if "line" in r.what] == ["mesh 'm.obj': 1 lines left out"]
    reader = MeshReader(tmp_path, {}, LoadLimits())
    for _ in range(3):
        reader.shape(MeshFile("m.obj"))
    assert len(reader.contents) == 3  # the digest has each reference
    assert reader.contents[0] is reader.contents[2]


def test_faces_are_counted_before_they_are_made(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text(SQUARE + "f 1 2 3 4\n")
    (tmp_path / "r.urdf").write_text(urdf("m.obj", count=50))
    assert load(tmp_path, limits=LoadLimits(max_faces=112)).num_faces == 112
    with pytest.raises(AssetError, match="more than 111 triangles"):
        load(tmp_path, limits=LoadLimits(max_faces=111))
    with pytest.raises(AssetError, match="51 shapes are over the limit of 50"):
        load(tmp_path, limits=LoadLimits(max_shapes=50))
    with pytest.raises(AssetError, match="over the limit of 0 MB in all"):
        load(tmp_path, limits=LoadLimits(max_total_mesh_bytes=1000))


@pytest.mark.parametrize(
    "geometry",
    [
        Box(np.array([1.0, 2.0, 3.0])),
        Cylinder(0.5, 2.0),
        Capsule(0.5, 2.0),
        Sphere(0.5),
    ],
    ids=str,
)
def test_the_triangles_that_are_counted_are_those_of_a_primitive(geometry: Geometry, tmp_path: Path) -> None:
    reader = MeshReader(tmp_path, {}, LoadLimits())
    _, faces = reader.shape(geometry)
    assert len(faces) == reader.num_faces > 0


def test_kinds_that_are_not_read_are_listed(tmp_path: Path) -> None:
    (tmp_path / "m.fbx").write_bytes(b"x")
    (tmp_path / "r.urdf").write_text(urdf("m.fbx"))
    with pytest.raises(AssetError, match=re.escape("(.obj, .stl, .dae, .glb, .gltf, .ply, .msh)")):
        load(tmp_path)
