"""Hostile mesh files: each is read, or refused, within 2 s of processor time and 500 MB."""

from __future__ import annotations

import struct
from typing import Any

import pytest

from tests.artsim.loading.mesh_builders import (
    NOTCHED,
    POINTS,
    WEDGE_DAE,
    dae,
    dae_geometry,
    dae_triangles,
    gltf,
    two_parts,
    urdf,
)
from tests.hostile_child import read_each, too_much

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
SHOW = '<instance_geometry url="#g"/>'
PLY = "ply\nformat {}\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
LISTS = "element face {}\nproperty list {} {} vertex_indices\nend_header\n"


def visuals(shape: str, count: int) -> str:
    return two_parts(f"<visual><geometry>{shape}</geometry></visual>" * count)


def chain(count: int, copies: int = 1) -> str:
    """Nodes of which each shows the one before, several times."""
    nodes = [f'<node id="n{k}">' + f'<instance_node url="#n{k - 1}"/>' * copies + "</node>" for k in range(1, count)]
    return f'<library_nodes><node id="n0">{SHOW}</node>{"".join(nodes)}</library_nodes>'


def top(number: int) -> str:
    return f'<node><instance_node url="#n{number}"/></node>'


def zeros(count: int, **members: Any) -> dict[str, Any]:
    return {"componentType": 5126, "count": count, "type": "VEC3", **members}


def ring(count: int) -> str:
    """One polygon of many corners, which crosses itself everywhere."""
    points = "".join(f"v {k} {k * 7919 % 1000} 0\n" for k in range(count))
    return points + "f " + " ".join(map(str, range(1, count + 1))) + "\n"


def huge_ply(header: str, body: bytes) -> bytes:
    return header.encode() + body


HOLES = "<ph><p>0 1 2 3</p><h>4 5 6 7</h></ph>"
INPUT = '<input semantic="VERTEX" source="#v-g"/>'
HOLED = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [1, 1, 0], [1, 2, 0], [2, 2, 0], [2, 1, 0]]
SPARSE = {"count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}}

SHAPES: dict[str, tuple[str, str | bytes, str | None, str | None]] = {
    # name: (ending, content, the URDF where it is not the usual one, what the error says; None: it is read)
    "100,000 references": ("obj", TRIANGLE + "f 1 2 3\n", urdf("m.obj", 100_000), "100001 shapes"),
    "4,000 references": ("obj", TRIANGLE + "f 1 2 3\n" * 1000, urdf("m.obj", 4_000), None),
    "references over the limit": ("obj", TRIANGLE + "f 1 2 3\n" * 2000, urdf("m.obj", 4_000), "5000000 triangles"),
    "10,000 spheres": ("obj", "", visuals('<sphere radius="1"/>', 10_000), "10001 shapes"),
    "2,000 spheres": ("obj", "", visuals('<sphere radius="1"/>', 2_000), "5000000 triangles"),
    "900 spheres": ("obj", "", visuals('<sphere radius="1"/>', 900), None),
    "4,900 cylinders": ("obj", "", visuals('<cylinder radius="1" length="1"/>', 4_900), None),
    "materials": ("obj", TRIANGLE + "".join(f"usemtl m{k}\n" for k in range(300_000)) + "f 1 2 3\n", None, None),
    "materials of one face": ("obj", TRIANGLE + "".join(f"usemtl m{k}\nf 1 2 3\n" for k in range(99_999)), None, None),
    "groups": ("obj", TRIANGLE + "g a\no b\ns 1\n" * 200_000 + "f 1 2 3\n", None, None),
    "unknown words": ("obj", TRIANGLE + "".join(f"w{k}\n" for k in range(300_000)) + "f 1 2 3\n", None, None),
    "faces": ("obj", TRIANGLE + "f 1 2 3\n" * 5_100_000, None, "5000000 triangles"),
    "one polygon": ("obj", ring(200_000), None, "has no faces"),
    "large polygons": ("obj", ring(5_000) + ring(5_000).splitlines()[-1].join(["", "\n"]) * 100, None, None),
    "concave polygons": ("obj", NOTCHED + "f 3 4 5 1 2\n" * 150_000, None, None),
    "letters": ("obj", "v a b c\n" * 300_000, None, "words where numbers belong"),
    "blank rows": ("obj", " \n" * 10_000_000, None, ""),
    "DAE, exponential nodes": ("dae", dae(scene=top(99), libraries=chain(100, 10)), None, "pieces"),
    "DAE, exponential nodes of nothing": (
        "dae", dae(scene=top(99) + f"<node>{SHOW}</node>", libraries=chain(100, 10).replace(SHOW, "")), None, None),
    "DAE, a long chain of nodes": ("dae", dae(scene=top(49_999), libraries=chain(50_000)), None, "nested over"),
    "DAE, deep nodes": ("dae", dae(scene="<node>" * 9_000 + SHOW + "</node>" * 9_000), None, ""),
    "DAE, a circle of nodes": (
        "dae", dae(scene=top(1), libraries=chain(2).replace(SHOW, '<instance_node url="#n1"/>')), None, "contains"),
    "DAE, instances": ("dae", dae(scene=f"<node>{SHOW * 100_000}</node>"), None, "pieces"),
    "DAE, 9,000 instances": ("dae", dae(scene=f"<node>{SHOW * 9_000}</node>"), None, None),
    "DAE, primitives": (
        "dae", dae(dae_geometry("g", HOLED, dae_triangles("g", [[0, 1, 2]]) * 20_000)), None, "pieces"),
    "DAE, primitives that share many points": (
        "dae", dae(dae_geometry("g", HOLED * 20_000, dae_triangles("g", [[0, 1, 2]]) * 3_000)), None, None),
    "DAE, holes": (
        "dae", dae(dae_geometry("g", HOLED, f'<polygons>{INPUT}{HOLES * 20_000}</polygons>')), None, None),
    "DAE, tags": ("dae", "<COLLADA>" + "<a/>" * 5_000_000 + "</COLLADA>", None, "XML tags"),
    "DAE, declared counts": ("dae", dae(WEDGE_DAE.replace('count="6"', 'count="999999999999"')), None, ""),
    "DAE, declared offset": ("dae", dae(WEDGE_DAE.replace('offset="0"', 'offset="99999999999"')), None, ""),
    "glTF, declared count": ("gltf", gltf(POINTS, POINTS, accessors=[zeros(10**12)] * 2), None, ""),
    "glTF, sparse zeros": ("gltf", gltf(POINTS, POINTS, accessors=[zeros(4_900_000, sparse=SPARSE)] * 2,
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}]), None, "positions without data"),
    "glTF, nodes": ("gltf", gltf(POINTS, nodes=[{"mesh": 0}] * 50_000, scenes=[{"nodes": list(range(50_000))}],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}]), None, "pieces"),
    "glTF, exponential nodes": (
        "gltf", gltf(POINTS, nodes=[*({"children": [k + 1] * 10} for k in range(99)), {"mesh": 0}]), None, "parents"),
    "glTF, primitives": (
        "gltf", gltf(POINTS, meshes=[{"primitives": [{"attributes": {"POSITION": 0}}] * 100_000}]), None, "pieces"),
    "glTF, copies on the GPU": (
        "gltf", gltf(POINTS, accessors=[zeros(6, bufferView=0), zeros(10**7)], nodes=[{"mesh": 0, "extensions":
        {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}}],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}]), None, "5000000"),
    "glTF, brackets": ("gltf", "[" * 1_000_000, None, "nested too deeply"),
    "PLY, declared vertices": (
        "ply", PLY.format("ascii 1.0").replace("3", "9" * 15) + LISTS.format(1, "uchar", "int"), None, "can hold"),
    "PLY, declared list": ("ply", huge_ply(PLY.format("binary_little_endian 1.0") + LISTS.format(1, "uint", "int"),
        bytes(36) + struct.pack("<I", 2**32 - 1) + bytes(99)), None, "ends after the file"),
    "PLY, lists of nothing": ("ply", huge_ply(PLY.format("binary_little_endian 1.0") + LISTS.format(2_000_000, "uchar",
        "int"), bytes(36 + 2_000_000)), None, "has no faces"),
    "PLY, uneven lists": ("ply", huge_ply(PLY.format("binary_little_endian 1.0") + LISTS.format(1_000_000, "uchar",
        "uchar"), struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + bytes([3, 0, 1, 2, 0]) * 500_000), None, None),
    "STL, declared count": ("stl", bytes(80) + struct.pack("<I", 2**32 - 2) + bytes(500), None, "ends after 10"),
}  # fmt: skip


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """What came of each, each read in a process of its own."""
    root = tmp_path_factory.mktemp("hostile")
    wanted = []
    for number, (ending, content, robot, _) in enumerate(SHAPES.values()):
        folder = root / str(number)
        folder.mkdir()
        (folder / f"m.{ending}").write_bytes(content.encode() if isinstance(content, str) else content)
        (folder / "mobility.urdf").write_text(robot or urdf(f"m.{ending}"))
        wanted.append(("load", folder))
    return dict(zip(SHAPES, read_each(wanted, root), strict=True))


@pytest.mark.slow
def test_each_is_read_or_refused_in_one_line(outcomes: dict[str, dict[str, Any]]) -> None:
    wrong = {}
    for name, one in outcomes.items():
        text = SHAPES[name][3]
        if "raw" in one or (text is None) != ("said" in one) or (text or "") not in one.get("error", ""):
            wrong[name] = one
    assert not wrong


@pytest.mark.slow
def test_each_takes_little_time_and_memory(outcomes: dict[str, dict[str, Any]]) -> None:
    assert not too_much(outcomes)
