"""STL files of both encodings."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import trimesh

from artsim.loading.meshes import UnusableMeshError
from tests.artsim.loading.mesh_builders import area, read

CUBE = trimesh.creation.box((1, 2, 3))


BINARY = CUBE.export(file_type="stl")


ASCII = CUBE.export(file_type="stl_ascii")


@pytest.mark.parametrize(
    "content",
    [
        BINARY,
        b"solid with a name" + BINARY[17:],
        b"solid facet normal vertex" + BINARY[25:],
        ASCII,
        ASCII.upper(),
        ASCII.replace("\n", "\r\n"),
        ASCII.replace("\n", "\r"),
        ASCII.replace("\n", "\n\t \t"),
        " ".join(ASCII.split()),
        ASCII.replace("solid", "solid vertex facet").replace("endsolid vertex facet", "endsolid vertex facet"),
        ASCII + "\n\n",
    ],
)
def test_a_cube_is_a_cube_however_it_is_written(content: bytes | str) -> None:
    vertices, faces, said = read(content, ".stl")
    assert said == ""
    assert len(faces) == 12
    assert area(vertices, faces) == pytest.approx(22.0)


def test_several_solids_are_one_surface() -> None:
    vertices, faces, said = read(ASCII + "\n" + ASCII, ".stl")
    assert len(faces) == 24
    assert said == ""
    assert area(vertices, faces) == pytest.approx(44.0)


@pytest.mark.parametrize(
    ("content", "count", "said"),
    [
        (BINARY + b"more", 12, "has 4 bytes after its 12 triangles"),
        (BINARY[:80] + struct.pack("<I", 0) + BINARY[84:], 12, "does not say how many triangles it holds: all 12"),
        (BINARY[:80] + struct.pack("<I", 2**32 - 1) + BINARY[84:], 12, "all 12 are taken"),
        (BINARY[:80] + struct.pack("<I", 5) + BINARY[84:], 5, "has 350 bytes after its 5 triangles"),
        (ASCII[: ASCII.rfind("endloop")], 11, "3 vertices left out: their loop does not end"),
        (ASCII.replace("endsolid", ""), 12, "ends without 'endsolid'"),
        (ASCII.replace("vertex", "vortex", 1), 11, "1 faces left out: fewer than three corners"),
    ],
)
def test_what_stl_loses_is_said(content: bytes | str, count: int, said: str) -> None:
    _, faces, notes = read(content, ".stl")
    assert said in notes
    assert len(faces) == count


@pytest.mark.parametrize("content", [BINARY[:-1], BINARY[:300], b"", b"solid"])
def test_stl_that_is_cut_off_is_refused(content: bytes) -> None:
    with pytest.raises(UnusableMeshError, match=r"ends after|shorter than the header"):
        read(content, ".stl")


def test_loops_of_four_vertices_are_divided() -> None:
    rows = "".join(f"vertex {x} {y} 0\n" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
    text = f"solid\nfacet normal 0 0 1\nouter loop\n{rows}endloop\nendfacet\nendsolid"
    vertices, faces, _ = read(text, ".stl")
    assert area(vertices, faces) == pytest.approx(1.0)
    assert np.array_equal(np.unique(faces), np.arange(len(vertices)))
