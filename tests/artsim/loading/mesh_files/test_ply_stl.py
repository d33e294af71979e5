"""PLY and STL files of every encoding."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import trimesh

from artsim.loading.meshes import UnusableMeshError
from tests.artsim.loading.mesh_builders import area, read

CUBE = trimesh.creation.box((1, 2, 3))
POINTS = [(0, 0, 0), (4, 0, 0), (4, 4, 0), (2, 1, 0), (0, 4, 0)]
"""A notched square of area 10."""

FACES = [(0, 1, 2, 3, 4), (0, 1, 2)]
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def ply(encoding: str, count: str, code: str, faces: list[tuple[int, ...]]) -> bytes:
    """With properties that are not wanted before, between and after those that are."""
    order = ORDERS[encoding]
    header = (
        f"ply\nformat {encoding} 1.0\ncomment c\nobj_info o\nelement vertex 5\nproperty float x\nproperty double q\n"
        "property float y\nproperty float z\nelement material 1\nproperty uchar red\n"
        f"element face {len(faces)}\nproperty uchar flag\nproperty list {count} uint vertex_indices\n"
        f"property list {count} float texcoord\nproperty short s\nend_header\n"
    ).encode()
    body: list[bytes] = []

    def put(codes: str, *values: float) -> None:
        body.append(struct.pack(order + codes, *values) if order else " ".join(map(str, values)).encode() + b" ")

    for x, y, z in POINTS:
        put("fdff", x, 7, y, z)
    put("B", 3)
    for face in faces:
        put(f"B{code}{len(face)}I{code}{2 * len(face)}fh", 9, len(face), *face, 2 * len(face), *[1] * 2 * len(face), -3)
    return header + b"".join(body)


@pytest.mark.parametrize("encoding", ORDERS)
@pytest.mark.parametrize(
    ("count", "code"), [("uchar", "B"), ("char", "b"), ("ushort", "H"), ("int", "i"), ("uint32", "I")]
)
@pytest.mark.parametrize("faces", [FACES, FACES[:1]], ids=["ragged", "uniform"])
def test_ply_of_every_encoding(encoding: str, count: str, code: str, faces: list[tuple[int, ...]]) -> None:
    vertices, triangles, said = read(ply(encoding, count, code, faces), ".ply")
    assert area(vertices, triangles) == pytest.approx(10 + 8 * (len(faces) - 1))
    assert said == ""


def test_ply_strips_end_at_minus_one() -> None:
    text = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 1 1 0\n"
        "8 0 1 2 3 -1 0 1 2\n"
    )
    vertices, triangles, said = read(text, ".ply")
    assert triangles.tolist() == [[0, 1, 2], [2, 1, 3], [0, 1, 2]]
    assert area(vertices, triangles) == pytest.approx(1.5)
    assert said == ""


HEADER = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
FACE = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (HEADER + FACE + "0 0 0 1 0 0 0 1 0\n", "ends"),
        (HEADER + FACE + "0 0 0 1 0 0 0 1 0\n3 0 1\n", "ends"),
        (HEADER + FACE + "0 0 0 1 0 0 0 1 0\n9999999 0 1 2\n", "ends"),
        (HEADER.replace("3", "10000000000000") + FACE, "more than its bytes can hold"),
        (HEADER.replace("float x", "quux x") + FACE, "is not understood"),
        (HEADER.replace("ascii", "binary_middle_endian") + FACE, "is not understood"),
        (HEADER.replace("float z", "float w") + FACE + "0 0 0 1 0 0 0 1 0\n3 0 1 2\n", "no vertices with x, y and z"),
        (HEADER + FACE.replace("vertex_indices", "corners") + "0 0 0 1 0 0 0 1 0\n3 0 1 2\n", "no list named"),
        ("plywood", "no PLY header"),
    ],
)
def test_ply_that_cannot_be_read_is_refused(text: str, problem: str) -> None:
    with pytest.raises(UnusableMeshError, match=problem):
        read(text, ".ply")


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("0 0 0 1 0 0 0 1 0\n3 0 1 2 7 7\n", "goes on for 2 numbers after what its header declares"),
        ("0 0 0 1 0 0 0 1 0\n3 0 1 7\n", "1 faces left out: not finite, or of vertices that are missing"),
        ("0 0 0 1 0 0 0 1 0\n2 0 1\n", "1 faces left out: fewer than three corners"),
        ("0 0 0 1 0 0 0 1 here\n3 0 1 2\n", "1 faces left out: not finite, or of vertices that are missing"),
    ],
)
def test_what_ply_loses_is_said(body: str, said: str) -> None:
    assert said in read(HEADER + FACE + body, ".ply")[2]


# --- STL -------------------------------------------------------------------------------------------------------------

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
        (BINARY + b"more", 12, "goes on for 4 bytes after its 12 triangles"),
        (BINARY[:80] + struct.pack("<I", 0) + BINARY[84:], 12, "does not say how many triangles it holds: all 12"),
        (BINARY[:80] + struct.pack("<I", 2**32 - 1) + BINARY[84:], 12, "all 12 are taken"),
        (BINARY[:80] + struct.pack("<I", 5) + BINARY[84:], 5, "goes on for 350 bytes after its 5 triangles"),
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
