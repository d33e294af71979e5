"""PLY files of every encoding."""

from __future__ import annotations

import struct

import pytest

from artsim.loading.meshes import UnusableMeshError
from tests.artsim.loading.mesh_builders import area, read

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
        ("0 0 0 1 0 0 0 1 0\n3 0 1 2 7 7\n", "has 2 numbers more than its header declares"),
        ("0 0 0 1 0 0 0 1 0\n3 0 1 7\n", "1 faces left out: not finite, or of vertices that are missing"),
        ("0 0 0 1 0 0 0 1 0\n2 0 1\n", "1 faces left out: fewer than three corners"),
        ("0 0 0 1 0 0 0 1 here\n3 0 1 2\n", "1 faces left out: not finite, or of vertices that are missing"),
    ],
)
def test_what_ply_loses_is_said(body: str, said: str) -> None:
    assert said in read(HEADER + FACE + body, ".ply")[2]
