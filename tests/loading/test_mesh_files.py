"""Mesh files arrive whole and at their size, or what is lost is said; what cannot be read is refused by name."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from artsim import load
from artsim.errors import ArtsimError, AssetError
from artsim.loading.meshes import UnusableMeshError, triangles
from tests.loading.mesh_writers import (
    AREA,
    CORNERS,
    INDICES,
    POINTS,
    QUADS,
    dae,
    glb,
    gltf,
    obj,
    ply,
    primitive,
    quads,
    stl_bytes,
    stl_text,
)

CASES = Path(__file__).parent.parent / "cases"


def read(data: str | bytes, kind: str) -> tuple[trimesh.Trimesh, tuple[str, ...]]:
    content = data.encode() if isinstance(data, str) else data
    vertices, faces, notes = triangles(content, kind, Path(f"m{kind}"))
    return trimesh.Trimesh(vertices, faces, process=False), notes


def assert_box(data: str | bytes, kind: str, size: Any = (0.1, 0.2, 0.3), note: str = "") -> None:
    """The file is the box, at a size; nothing is said, or what is."""
    mesh, notes = read(data, kind)
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx(np.array(size), rel=1e-5)
    scaled = mesh.copy()
    scaled.apply_scale(np.array((0.1, 0.2, 0.3)) / np.array(size))
    assert scaled.area == pytest.approx(AREA, rel=1e-5)
    assert (note in "\n".join(notes)) if note else notes == ()


# --- the cases that people brought -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("case", "size", "faces", "repair"),
    [
        ("M01", (0.6, 0.2, 0.3), 16, ""),
        ("M04", (0.1, 0.2, 0.3), 8, ""),
        ("M05", (0.3, 0.3, 0.0), 6, ""),
        ("M06", (0.1, 0.2, 0.3), 8, "up_axis 'Y_UP' is not applied"),
        ("M18", (0.1, 0.2, 0.3), 8, ""),
        ("M18b", (0.6, 0.2, 0.3), 16, ""),
        ("V05a", (0.1, 0.2, 0.3), 8, ""),
        ("V05d", (0.1, 0.2, 0.3), 8, ""),
    ],
)
def test_a_case_arrives_whole(case: str, size: tuple[float, ...], faces: int, repair: str) -> None:
    found = load(CASES / case)
    assert found.box_size[1] == pytest.approx(size, abs=1e-6)
    assert len(found.parts[1].faces) == faces
    assert repair in "\n".join(map(str, found.repairs)) if repair else found.repairs == ()
    if case == "M05":  # a fan would fill the notch of the U
        assert found.part_mesh(1).area == pytest.approx(0.07)


def test_a_compressed_mesh_that_is_not_read_is_refused_by_name() -> None:
    with pytest.raises(AssetError, match="KHR_draco_mesh_compression"):
        load(CASES / "M02")


# --- OBJ -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        obj(),
        obj().replace("\n", "\r\n"),
        obj().replace("\n", "\r"),
        "".join(f"\t {line}\n" for line in obj().replace(" ", "\t").splitlines()),
        obj().replace("f 1 4 3 2", "f 1 4 \\\n 3 2"),
        obj().replace("f 1 4 3 2", "f -8 -5 -6 -7"),
        obj().replace("f 1 4 3 2", "vt 0 0\nvn 0 0 1\nf -8/-1/-1 4/1/1 3//1 2/1"),
        "".join("".join("v {} {} {}\n".format(*CORNERS[i]) for i in q) + "f -4 -3 -2 -1\n" for q in QUADS),
        obj().replace("\n", " 1 0 0\n", 8),
        obj().replace("\n", " 1.0\n", 8),
        "mtllib gone.mtl\n" + obj().replace("f ", "g a\nusemtl gone\ns 1\nf "),
        "\ufeff# exported\n" + obj(),
    ],
)
def test_obj_is_read_however_it_is_written(text: str) -> None:
    assert_box(text, ".obj")


def test_obj_says_what_it_leaves_out() -> None:
    assert_box(obj() + "f 1 2 99\nf 0 1 2\n", ".obj", note="2 faces left out")
    assert_box(obj() + "curv 0 1 1 2 3\n", ".obj", note="'curv' left out")
    for text in ("v 0 0 0\nv 1 0 0\nl 1 2\n", "not an OBJ file", ""):
        assert len(read(text, ".obj")[0].faces) == 0


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=14), st.permutations((0, 1, 2)))
def test_concave_polygons_have_the_area_of_their_outline(radii: list[float], axes: list[int]) -> None:
    """A star around its middle, in a plane across any axis, as OBJ, PLY and COLLADA have it: the shoelace formula."""
    angles = np.arange(len(radii)) * (2 * np.pi / len(radii))
    flat = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.full(len(radii), 0.3)], axis=1)
    x, y = flat[:, 0], flat[:, 1]
    area = 0.5 * np.abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    points = flat[:, axes]
    indices = range(len(points))
    rows = ["{:.17g} {:.17g} {:.17g}".format(*p) for p in points]
    as_obj = "".join(f"v {row}\n" for row in rows) + "f " + " ".join(str(i + 1) for i in indices) + "\n"
    as_ply = ply().split("element vertex")[0] + (
        f"element vertex {len(rows)}\nproperty double x\nproperty double y\nproperty double z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n"
    ) + "\n".join([*rows, f"{len(rows)} {' '.join(map(str, indices))}", ""])  # fmt: skip
    polygon = primitive("polygons", f"<p>{' '.join(map(str, indices))}</p>")
    as_dae = dae(faces=polygon, corners=points).replace(" ".join(f"{v:g}" for v in points.ravel()), " ".join(rows))
    for text, kind in ((as_obj, ".obj"), (as_ply, ".ply"), (as_dae, ".dae")):
        mesh, notes = read(text, kind)
        assert mesh.area == pytest.approx(area, rel=1e-6), kind
        assert len(mesh.faces) == len(points) - 2
        assert notes == ()


# --- COLLADA ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["1", "0.01", "0.0254", "1e-3", "1000"])
def test_the_unit_of_a_dae_file_is_applied(unit: str) -> None:
    assert_box(dae(unit), ".dae", np.array((0.1, 0.2, 0.3)) * float(unit))


@pytest.mark.parametrize("unit", ["0", "-1", "nan", "inf", "metre"])
def test_a_unit_that_is_no_length_is_refused(unit: str) -> None:
    with pytest.raises(UnusableMeshError, match="no length"):
        read(dae(unit), ".dae")


def test_what_a_dae_file_leaves_open_is_said() -> None:
    node = '<node><instance_geometry url="#g"/></node>'
    assert_box(dae(up="Y_UP"), ".dae", note="up_axis 'Y_UP' is not applied")
    assert_box(dae(nodes=node + '<node><instance_geometry url="#gone"/></node>'), ".dae", note="'#gone' is missing")
    lines = primitive("lines", "<p>0 6</p>")
    assert_box(dae(faces=quads() + lines), ".dae", note="lines left out")
    skin = '<library_controllers><controller id="c"><skin source="#g"/></controller></library_controllers>'
    assert_box(
        dae(nodes='<node><instance_controller url="#c"/></node>', more=skin), ".dae", note="skin of 'c' left out"
    )
    more = primitive("triangles", "<p>0 1 2 0 1 99</p>", count=9)
    notes = "\n".join(read(dae(faces=quads() + more), ".dae")[1])
    assert "declares 9 faces, but holds 2" in notes
    assert "1 faces left out" in notes


def test_a_texture_that_is_missing_costs_no_geometry() -> None:
    inputs = '<input semantic="TEXCOORD" source="#gone" offset="1"/>'
    indices = " ".join(f"{i} 0" for quad in QUADS for i in quad)
    faces = primitive("polylist", f"<vcount>{'4 ' * 6}</vcount><p>{indices}</p>", count=6, inputs=inputs)
    assert_box(dae(faces=faces), ".dae")


def test_a_polygon_with_a_hole_has_its_hole() -> None:
    square = [
        (x, y, 0) for low, high in ((0, 3), (1, 2)) for x, y in ((low, low), (high, low), (high, high), (low, high))
    ]
    faces = primitive("polygons", "<ph><p>0 1 2 3</p><h>4 5 6 7</h></ph>")
    mesh, notes = read(dae(faces=faces, corners=np.array(square)), ".dae")
    assert mesh.area == pytest.approx(8.0)
    assert notes == ()


def test_nodes_place_and_repeat_their_geometry() -> None:
    geometry = '<instance_geometry url="#g"/>'
    assert_box(dae("0.1", nodes=f"<node><scale>2 2 2</scale><translate>0 0 9</translate>{geometry}</node>"), ".dae",
               (0.02, 0.04, 0.06))  # fmt: skip
    turned = (
        f"<node><rotate>0 0 1 90</rotate><node><matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix>{geometry}</node></node>"
    )
    mesh, _ = read(dae(nodes=turned), ".dae")
    assert mesh.bounds == pytest.approx(np.array([[-0.2, 5, 0], [0, 5.1, 0.3]]), abs=1e-12)
    library = f'<library_nodes><node id="n">{geometry}</node></library_nodes>'
    twice = '<node><instance_node url="#n"/></node><node><translate>1 0 0</translate><instance_node url="#n"/></node>'
    mesh, notes = read(dae(nodes=twice, more=library), ".dae")
    assert mesh.area == pytest.approx(2 * AREA)
    assert mesh.bounds[1, 0] == pytest.approx(1.1)
    assert notes == ()


def test_strips_and_fans_are_triangles() -> None:
    mesh, _ = read(dae(faces=primitive("tristrips", "<p>0 1 3 2</p>")), ".dae")
    assert mesh.area == pytest.approx(0.02)
    mesh, _ = read(dae(faces=primitive("trifans", "<p>0 1 2 3</p>")), ".dae")
    assert mesh.area == pytest.approx(0.02)


# --- glTF ------------------------------------------------------------------------------------------------------------


def test_gltf_is_read_with_its_nodes() -> None:
    assert_box(glb(gltf()), ".glb")
    uri = "data:application/octet-stream;base64," + base64.b64encode(POINTS + INDICES).decode()
    assert_box(json.dumps(gltf(buffers=[{"byteLength": len(POINTS + INDICES), "uri": uri}])), ".gltf")
    nodes = [{"children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "translation": [5, 0, 0]}]
    assert_box(glb(gltf(nodes=nodes)), ".glb", (0.2, 0.4, 0.6))


@pytest.mark.parametrize("name", ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "VENDOR_anything"])
def test_a_required_extension_that_is_not_read_is_refused_by_name(name: str) -> None:
    with pytest.raises(UnusableMeshError, match=name):
        read(glb(gltf(extensionsRequired=[name], extensionsUsed=[name])), ".glb")


def test_extensions_of_materials_cost_no_geometry() -> None:
    names = ["KHR_materials_unlit", "KHR_texture_transform", "KHR_texture_basisu"]
    assert_box(glb(gltf(extensionsRequired=names, images=[{"uri": "gone.png"}], textures=[{"source": 0}])), ".glb")


def test_quantized_vertices_are_read() -> None:
    whole = np.pad((CORNERS * 10_000).round().astype("<i2"), ((0, 0), (0, 1))).tobytes()
    document = gltf(extensionsRequired=["KHR_mesh_quantization"], nodes=[{"mesh": 0, "scale": [1e-4] * 3}])
    document["buffers"] = [{"byteLength": len(whole + INDICES)}]
    document["bufferViews"] = [
        {"buffer": 0, "byteLength": len(whole), "byteStride": 8},
        {"buffer": 0, "byteOffset": len(whole), "byteLength": len(INDICES)},
    ]
    document["accessors"][0]["componentType"] = 5122
    assert_box(glb(document, whole + INDICES), ".glb")


def test_sparse_accessors_and_morph_targets_are_applied() -> None:
    document = gltf()
    document["bufferViews"].append({"buffer": 0, "byteOffset": len(POINTS + INDICES), "byteLength": 8})
    document["buffers"] = [{"byteLength": len(POINTS + INDICES) + 8}]
    sparse = {"count": 8, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 0}}
    document["accessors"][0] = {"componentType": 5126, "count": 8, "type": "VEC3", "sparse": sparse}
    assert_box(glb(document, POINTS + INDICES + bytes(range(8))), ".glb")
    document = gltf()
    document["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}]
    assert_box(glb(document), ".glb")  # weights are 0 where none are stated
    assert_box(glb(gltf(meshes=document["meshes"], nodes=[{"mesh": 0, "weights": [0.5]}])), ".glb", (0.15, 0.3, 0.45))
    document["meshes"][0]["weights"] = [1.0]
    assert_box(glb(document), ".glb", (0.2, 0.4, 0.6))


def test_what_gltf_shows_that_is_no_surface_is_said() -> None:
    document = gltf()
    document["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 0})
    assert_box(glb(document), ".glb", note="points left out")
    assert_box(glb(gltf(nodes=[{"mesh": 0, "skin": 0}, {}], skins=[{"joints": [1]}])), ".glb", note="skin left out")


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"accessors": [gltf()["accessors"][0], {**gltf()["accessors"][1], "count": 3000}]}, "ends after"),
        ({"asset": {"version": "1.0"}}, "is glTF '1.0', not 2"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 7}}]}]}, "where a number from 0 to 1 belongs"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "node"),
        ({"buffers": [{"byteLength": 10**12}]}, "buffer"),
    ],
)
def test_damaged_gltf_is_refused(changes: dict[str, Any], what: str) -> None:
    with pytest.raises((UnusableMeshError, AssetError), match=what):
        read(glb(gltf(**changes)), ".glb")


def test_a_buffer_beside_a_gltf_file_is_read_and_none_outside(tmp_path: Path) -> None:
    robot = (
        '<robot name="r"><link name="a"><visual><geometry><mesh filename="m.gltf"/></geometry></visual></link></robot>'
    )
    folder = tmp_path / "asset"
    folder.mkdir()
    (folder / "r.urdf").write_text(robot)
    (tmp_path / "out.bin").write_bytes(POINTS + INDICES)
    (folder / "in side.bin").write_bytes(POINTS + INDICES)
    for uri, fine in (("in%20side.bin", True), ("../out.bin", False), (str(tmp_path / "out.bin"), False)):
        document = gltf(buffers=[{"byteLength": len(POINTS + INDICES), "uri": uri}])
        (folder / "m.gltf").write_text(json.dumps(document))
        if fine:
            assert load(folder).box_size[0] == pytest.approx((0.1, 0.2, 0.3))
        else:
            with pytest.raises(AssetError, match="outside the asset's folder"):
                load(folder)


# --- PLY and STL -----------------------------------------------------------------------------------------------------


def test_ply_and_stl_are_read_however_they_are_written() -> None:
    for text in (ply(), ply().replace("\n", "\r\n"), ply().replace("element face", "comment x\nelement face")):
        assert_box(text, ".ply")
    header, rows = ply().encode().split(b"end_header\n")[0] + b"end_header\n", np.array(QUADS)
    for order, name in (("<", b"binary_little_endian"), (">", b"binary_big_endian")):
        quads_of = b"".join(b"\4" + row.astype(f"{order}i4").tobytes() for row in rows)
        assert_box(header.replace(b"ascii", name) + CORNERS.astype(f"{order}f4").tobytes() + quads_of, ".ply")
    for solid in (stl_text(), stl_text().upper().replace("\n", "\r\n"), stl_bytes(), stl_bytes(b"solid but binary")):
        assert_box(solid, ".stl")
    mesh, _ = read(stl_text() + stl_text().replace("0.3", "0.6"), ".stl")
    assert mesh.area == pytest.approx(AREA + 0.22 + 0.6 * 0.3)


def test_files_that_are_cut_off_never_pass_for_whole() -> None:
    for data, kind in ((ply(), ".ply"), (stl_bytes(), ".stl"), (glb(gltf()), ".glb"), (dae(), ".dae")):
        with pytest.raises((UnusableMeshError, AssetError)):
            read(data[: len(data) * 2 // 3], kind)
    mesh, notes = read(stl_text()[: len(stl_text()) // 2], ".stl")
    assert len(mesh.faces) < 12
    assert "cut off" in "\n".join(notes)
    mesh, notes = read(stl_bytes()[:80] + b"\x04\0\0\0" + stl_bytes()[84:], ".stl")
    assert "goes on for" in "\n".join(notes)


# --- real files, and damaged ones ------------------------------------------------------------------------------------


def test_real_obj_files_are_what_trimesh_makes_of_them(partnet_dir: Path) -> None:
    """Every hundredth real mesh, of triangles and of polygons: area, bounds and number of triangles."""
    files = sorted(partnet_dir.glob("*/*/textured_objs/*.obj"))[::100]
    assert len(files) > 20
    for file in files:
        mesh, notes = read(file.read_bytes(), ".obj")
        known = trimesh.load_mesh(file, process=False, skip_materials=True)
        assert notes == (), file
        assert len(mesh.faces) == len(known.faces), file
        assert mesh.area == pytest.approx(known.area, rel=1e-6), file
        assert mesh.bounds == pytest.approx(known.bounds, abs=1e-9), file


_SEEDS = [
    (obj().encode(), ".obj"), (dae().encode(), ".dae"), (ply().encode(), ".ply"), (stl_text().encode(), ".stl"),
    (stl_bytes(), ".stl"), (glb(gltf()), ".glb"), (json.dumps(gltf()).encode(), ".gltf"),
]  # fmt: skip


@settings(deadline=None, max_examples=300)
@given(st.sampled_from(_SEEDS), st.lists(st.tuples(st.integers(0, 5000), st.binary(max_size=4)), max_size=4))
def test_damaged_meshes_never_end_in_a_raw_error(seed: tuple[bytes, str], damage: list[tuple[int, bytes]]) -> None:
    data, kind = bytearray(seed[0]), seed[1]
    for place, content in damage:
        place %= len(data) + 1
        data[place : place + len(content)] = content
    try:
        mesh, _ = read(bytes(data), kind)
        assert np.isfinite(mesh.vertices).all()
    except (UnusableMeshError, ArtsimError):
        pass
