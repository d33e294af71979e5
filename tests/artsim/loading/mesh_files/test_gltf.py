"""glTF files: every kind of accessor, and extensions by their names."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artsim import load
from artsim.errors import AssetError
from artsim.loading.meshes import UnusableMeshError
from tests.artsim.loading.mesh_builders import CORNERS, POINTS, area, gltf, read, urdf, volume

WHOLE = 0.1460555


def changed(*arrays: np.ndarray, **paths: Any) -> str:
    """A document with members changed in place, such as ``accessors__0__count=9``."""
    document = gltf(*(arrays or (POINTS, CORNERS)), as_value=True)
    for path, value in paths.items():
        *parents, last = [int(k) if k.isdecimal() else k for k in path.split("__")]
        here = document
        for key in parents:
            here = here[key]
        here[last] = value
    return json.dumps(document)


def glb(document: str, chunk: bytes | None = None) -> bytes:
    text = document.encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text
    if chunk is not None:
        body += struct.pack("<I4s", len(chunk), b"BIN\0") + chunk
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


@pytest.mark.parametrize("kind", ["u1", "<u2", "<u4"])
def test_indices_of_every_type(kind: str) -> None:
    vertices, faces, said = read(gltf(POINTS, CORNERS.astype(kind)), ".gltf")
    assert area(vertices, faces) == pytest.approx(WHOLE, rel=1e-5)
    assert said == ""


def test_a_binary_file_holds_the_same() -> None:
    document = json.loads(gltf(POINTS, CORNERS))
    content = POINTS.tobytes() + CORNERS.tobytes()
    document["buffers"] = [{"byteLength": len(content)}]
    vertices, faces, _ = read(glb(json.dumps(document), content), ".glb")
    assert area(vertices, faces) == pytest.approx(WHOLE, rel=1e-5)


def test_interleaved_positions() -> None:
    rows = np.zeros((6, 5), "<f4")
    rows[:, 1:4] = POINTS
    document = json.loads(gltf(rows.view("u1"), CORNERS))
    document["bufferViews"][0]["byteStride"] = 20
    document["accessors"][0].update(componentType=5126, count=6, type="VEC3", byteOffset=4)
    vertices, faces, _ = read(json.dumps(document), ".gltf")
    assert area(vertices, faces) == pytest.approx(WHOLE, rel=1e-5)


def test_quantized_positions() -> None:
    quantized = np.round(POINTS / 0.3 * 32767).astype("<i2")
    document = json.loads(gltf(np.column_stack([quantized, quantized[:, :1]]).view("u1"), CORNERS))
    document["bufferViews"][0]["byteStride"] = 8
    document["accessors"][0].update(componentType=5122, count=6, type="VEC3", normalized=True)
    document["nodes"][0]["scale"] = [0.3, 0.3, 0.3]
    document["extensionsRequired"] = ["KHR_mesh_quantization"]
    vertices, faces, said = read(json.dumps(document), ".gltf")
    assert area(vertices, faces) == pytest.approx(WHOLE, rel=1e-3)
    assert said == ""


def test_sparse_positions_replace_what_is_there() -> None:
    document = json.loads(gltf(POINTS, CORNERS, np.array([4, 5], "u1"), np.array([[0, 0, 0.6], [0.1, 0, 0.6]], "<f4")))
    document["accessors"][0]["sparse"] = {
        "count": 2, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 3},
    }  # fmt: skip
    vertices, _, _ = read(json.dumps(document), ".gltf")
    assert vertices.max(axis=0) == pytest.approx([0.1, 0.2, 0.6])


@pytest.mark.parametrize("where", ["meshes", "nodes"])
def test_morph_targets_are_applied_by_their_default_weights(where: str) -> None:
    document = json.loads(gltf(POINTS, CORNERS, POINTS))
    document["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 2}]
    assert read(json.dumps(document), ".gltf")[0].max() == pytest.approx(0.3)
    document[where][0]["weights"] = [0.5]
    assert read(json.dumps(document), ".gltf")[0].max() == pytest.approx(0.45)


@pytest.mark.parametrize(("mode", "corners"), [(5, [0, 1, 3, 2]), (6, [0, 1, 2, 3]), (4, [0, 1, 2, 0, 2, 3])])
def test_strips_and_fans(mode: int, corners: list[int]) -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4")
    text = changed(square, np.array(corners, "u1"), meshes__0__primitives__0__mode=mode)
    vertices, faces, _ = read(text, ".gltf")
    assert area(vertices, faces) == pytest.approx(1.0)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_transforms_of_nodes() -> None:
    half = np.sqrt(0.5)
    nodes = [
        {"children": [1], "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 0, 0, 1]},
        {"mesh": 0, "translation": [0, 0, 5], "rotation": [0, 0, half, half], "scale": [1, 1, -1]},
    ]
    vertices, faces, _ = read(changed(nodes=nodes), ".gltf")
    assert vertices.min(axis=0) == pytest.approx([0.6, 0, 9.4], abs=1e-6)
    assert vertices.max(axis=0) == pytest.approx([1, 0.2, 10], abs=1e-6)
    assert volume(vertices, faces) == pytest.approx(8 * 0.003, rel=1e-5)  # mirrored, and still facing outwards


def test_instances_on_the_gpu_are_shown() -> None:
    document = json.loads(gltf(POINTS, CORNERS, np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], "<f4")))
    document["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 2}}}
    vertices, faces, said = read(json.dumps(document), ".gltf")
    assert len(faces) == 24
    assert vertices.max(axis=0) == pytest.approx([2.1, 0.2, 0.3])
    assert said == ""


@pytest.mark.parametrize(
    "name", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_node_visibility", "ACME_geometry"]
)
def test_required_extensions_that_are_not_read_are_refused_by_name(name: str) -> None:
    with pytest.raises(UnusableMeshError, match=f"needs the glTF extension '{name}'"):
        read(changed(extensionsRequired=[name]), ".gltf")
    assert len(read(changed(extensionsUsed=[name]), ".gltf")[1]) == 8


@pytest.mark.parametrize("name", ["KHR_materials_unlit", "KHR_texture_transform", "EXT_texture_webp"])
def test_extensions_of_looks_are_harmless(name: str) -> None:
    assert read(changed(extensionsRequired=[name]), ".gltf")[2] == ""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (changed(meshes__0__primitives=[{"attributes": {"POSITION": 0}, "indices": 1},
                                        {"attributes": {"POSITION": 0}, "mode": 1}]), "mesh '0': lines left out"),
        (changed(meshes__0__primitives=[{"attributes": {"POSITION": 0}, "indices": 1},
                                        {"attributes": {"POSITION": 0}, "mode": 0}]), "mesh '0': points left out"),
        (changed(nodes__0__skin=0, skins=[{}]), "skin left out"),
        (changed(accessors__0__min=[0, 0, 0], accessors__0__max=[1, 2, 3]), "not where its file says"),
        (changed(scenes=[{"nodes": [0]}, {"nodes": []}], scene=0), ""),
        (changed(meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]},
                         {"name": "m", "primitives": []}]),
         "mesh 'm' is not in the scene: left out"),
        (changed(POINTS, np.append(CORNERS, [0, 1]).astype("<u2")), "2 corners after the last triangle left out"),
        (changed(POINTS, np.append(CORNERS, [0, 1, 99]).astype("<u2")),
         "1 triangles left out: not finite, or of vertices that are missing"),
    ],
)  # fmt: skip
def test_what_is_lost_is_said_and_the_rest_arrives(text: str, said: str) -> None:
    vertices, faces, notes = read(text, ".gltf")
    assert said in notes
    assert area(vertices, faces) == pytest.approx(WHOLE, rel=1e-5)


def test_scenes_are_chosen() -> None:
    nodes = [{"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}]
    scenes = [{"nodes": [0]}, {"nodes": [1]}]
    assert read(changed(nodes=nodes, scenes=scenes, scene=1), ".gltf")[0].max() == pytest.approx(5.1)
    document = json.loads(changed(nodes=nodes, scenes=scenes))
    del document["scene"]
    assert "2 scenes" in read(json.dumps(document), ".gltf")[2]
    del document["scenes"]
    assert len(read(json.dumps(document), ".gltf")[1]) == 16


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (changed(accessors__0__count=99), "ends after its buffer view"),
        (changed(accessors__0__byteOffset=4), "ends after its buffer view"),
        (changed(bufferViews__0__byteLength=10**6), "ends after its buffer"),
        (changed(buffers__0__byteLength=10**6), "declares 1000000 bytes, but holds"),
        (changed(accessors__0__componentType=5126.5), "not of a kind that belongs here"),
        (changed(accessors__0__type="VEC2"), "not of a kind that belongs here"),
        (changed(accessors__0={"componentType": 5126, "count": 6, "type": "VEC3"}), "positions without data"),
        (changed(nodes=[{"children": [1, 1]}, {"mesh": 0}]), "two parents"),
        (changed(nodes=[{"mesh": 0, "children": [0]}]), "two parents"),
        (changed(nodes__0__rotation=[0, 0, 0, 0]), "a rotation that is none"),
        (changed(nodes__0__scale=[1, 2]), "are not 3 finite numbers"),
        (changed(asset={"version": "1.0"}), "is glTF '1.0', not 2"),
        (changed(buffers__0__uri="a.bin"), "names another file"),
        ("[]", "no glTF"),
        ("{", "JSON cannot be read"),
        (glb(changed())[:-9], "ends after"),
        (b"glTF" + struct.pack("<II", 1, 20) + bytes(8), "is glTF 1, not 2"),
    ],
)
def test_what_cannot_be_read_is_refused(text: str, problem: str) -> None:
    with pytest.raises(UnusableMeshError, match=problem):
        read(text, ".gltf")


def with_buffer(folder: Path, uri: str) -> Path:
    """An object whose glTF file has its buffer in another file."""
    folder.mkdir(parents=True, exist_ok=True)
    content = POINTS.tobytes() + CORNERS.tobytes()
    document = json.loads(gltf(POINTS, CORNERS))
    document["buffers"] = [{"byteLength": len(content), "uri": uri}]
    (folder / "m.gltf").write_text(json.dumps(document))
    (folder / "mobility.urdf").write_text(urdf("m.gltf"))
    return folder


def test_a_buffer_beside_the_file_is_read_and_part_of_the_digest(tmp_path: Path) -> None:
    folder = with_buffer(tmp_path / "a", "my%20data.bin")
    (folder / "my data.bin").write_bytes(POINTS.tobytes() + CORNERS.tobytes())
    first = load(folder)
    assert len(first.parts[1].faces) == 8
    (folder / "my data.bin").write_bytes((2 * POINTS).tobytes() + CORNERS.tobytes())
    assert load(folder).sha256 != first.sha256


@pytest.mark.parametrize("uri", ["../secret.bin", "/etc/passwd", "file:///etc/passwd", "link.bin", "gone.bin", "a\0b"])
def test_no_buffer_outside_the_asset_is_read(uri: str, tmp_path: Path) -> None:
    (tmp_path / "secret.bin").write_bytes(POINTS.tobytes() + CORNERS.tobytes())
    folder = with_buffer(tmp_path / "a", uri)
    (folder / "link.bin").symlink_to(tmp_path / "secret.bin")
    with pytest.raises(AssetError, match="missing or outside the asset's folder"):
        load(folder)
