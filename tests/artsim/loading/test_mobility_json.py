"""Objects of PartNet-Mobility's joint files are those that were written into them, and those of its URDF files."""

from __future__ import annotations

import json
import shutil
from collections import defaultdict
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

import artsim
from artsim.commands.inspect import Inspect
from artsim.errors import ArtsimError, AssetError
from artsim.loading.painted import painted_coats
from artsim.loading.sources import find_sources
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

CLOSE = 1e-6
"""Metres and radians."""
MADE = ("drawer", "globe", "bottle", "storage_furniture")
"""Slides, hinges and continuous joints, a screw, several joints."""

# Rows: the axes of a rest frame (Z up, front to -X) in PartNet's frame of meshes (Y up, front to +Z).
T_MESH_REST = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])


def annotation(obj: ArticulatedObject) -> list[dict[str, Any]]:
    """The joints as PartNet-Mobility writes them, with one part for each body: its number and ten."""
    kinds = {"free": "free", "revolute": "hinge", "continuous": "hinge", "prismatic": "slider", "screw": "slider"}
    rows = []
    for k, (part, joint) in enumerate(zip(obj.parts, obj.tree.joints, strict=True)):
        row = {"id": k, "parent": joint.parent, "joint": kinds[joint.type], "name": part.label}
        data: dict[str, Any] = {}
        if k:
            axis = {"origin": (T_MESH_REST @ joint.origin).tolist(), "direction": (T_MESH_REST @ joint.axis).tolist()}
            turns = joint.type in ("revolute", "continuous")
            ends = [joint.lower, joint.upper] if joint.type != "continuous" else [0.0, 0.0]
            if joint.type == "screw":
                ends = [end * joint.pitch for end in ends]
            limit = dict(zip("ab", np.rad2deg(ends).tolist() if turns else ends, strict=True))
            data = {"axis": axis, "limit": {**limit, "noLimit": joint.type == "continuous"}}
            if joint.type == "screw":
                angle = float(np.rad2deg(joint.upper - joint.lower))
                data["limit"] |= {"rotates": True, "noRotationLimit": False, "rotationLimit": angle}
        rows.append({**row, "parts": [{"id": 10 + k, "name": part.label}], "jointData": data})
    return rows


def mesh_of(vertices: Array, faces: Any) -> trimesh.Trimesh:
    return trimesh.Trimesh(vertices, faces, process=False)


def write_version_2(obj: ArticulatedObject, folder: Path) -> Path:
    """``mobility_v2.json``, ``result.json`` and a Wavefront file for each part, as PartNet-Mobility lays them out."""
    (folder / "textured_objs").mkdir(parents=True)
    leaves = []
    for k, part in enumerate(obj.parts):
        mesh_of(part.vertices @ T_MESH_REST.T, part.faces).export(
            folder / "textured_objs" / f"original-{k}.obj", digits=12
        )
        leaves.append({"id": 10 + k, "name": part.label, "objs": [f"original-{k}"]})
    tree = [{"id": 0, "name": obj.category, "children": leaves}]
    (folder / "result.json").write_text(json.dumps(tree))
    (folder / "mobility_v2.json").write_text(json.dumps(annotation(obj)))
    (folder / "meta.json").write_text(json.dumps({"model_cat": "Thing", "anno_id": "5"}))
    return folder / "mobility_v2.json"


def write_version_3(rows: list[dict[str, Any]], parts: dict[int, list[trimesh.Trimesh]], folder: Path) -> Path:
    """``mobility_v3.json`` and ``model.glb``, whose nodes begin with the numbers of their parts."""
    folder.mkdir(parents=True)
    scene = trimesh.Scene()
    for number, meshes in parts.items():
        for i, mesh in enumerate(meshes):
            scene.add_geometry(mesh, node_name=f"{number}_{i}", geom_name=f"{number}_{i}")
    (folder / "model.glb").write_bytes(scene.export(file_type="glb"))
    names = {part["id"]: part["name"] for row in rows for part in row["parts"]}
    partnet = [{"id": number, "parent": -1, "children": [], "name": name} for number, name in names.items()]
    (folder / "mobility_v3.json").write_text(json.dumps({"partnet": partnet, "mobility": rows}))
    return folder / "mobility_v3.json"


def assert_same(loaded: ArticulatedObject, obj: ArticulatedObject, exact_faces: bool = True) -> None:
    """Joints and surfaces agree."""
    assert loaded.tree.types == obj.tree.types
    np.testing.assert_array_equal(loaded.tree.parents, obj.tree.parents)
    for own, other in zip(loaded.tree.joints, obj.tree.joints, strict=True):
        np.testing.assert_allclose(own.axis, other.axis, atol=CLOSE)
        np.testing.assert_allclose(own.origin, other.origin, atol=CLOSE)
        np.testing.assert_allclose(own.pitch, other.pitch, atol=CLOSE)
        np.testing.assert_allclose([own.lower, own.upper], [other.lower, other.upper], atol=CLOSE)
    for part, other_part in zip(loaded.parts, obj.parts, strict=True):
        own_corners, corners = part.vertices[part.faces], other_part.vertices[other_part.faces]
        if exact_faces:
            np.testing.assert_allclose(own_corners, corners, atol=CLOSE)
        else:  # in another order
            assert len(own_corners) == len(corners)
            np.testing.assert_allclose(own_corners.mean(axis=(0, 1)), corners.mean(axis=(0, 1)), atol=CLOSE)


@pytest.mark.parametrize("category", MADE)
def test_version_2_comes_back_with_its_joints_and_meshes(category: str, tmp_path: Path) -> None:
    obj = artsim.make(category, 0)
    file = write_version_2(obj, tmp_path / "5")
    loaded = artsim.load(file)
    assert (loaded.category, loaded.object_id) == ("thing", "5")
    assert [part.label for part in loaded.parts] == [part.label for part in obj.parts]
    assert [str(repair) for repair in loaded.repairs if not repair.note] == []
    assert_same(loaded, obj)
    assert artsim.load(tmp_path / "5").sha256 == loaded.sha256  # its folder names the same file
    assert [source.path for source in find_sources([tmp_path])] == [file]


@pytest.mark.parametrize("category", MADE)
def test_version_3_comes_back_out_of_one_glb(category: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    obj = artsim.make(category, 0)
    meshes = {10 + k: [mesh_of(p.vertices @ T_MESH_REST.T, p.faces)] for k, p in enumerate(obj.parts)}
    write_version_3(annotation(obj), meshes, tmp_path / "5")
    loaded = artsim.load(tmp_path / "5" / "model.glb")
    assert Path(loaded.source).name == "mobility_v3.json"
    assert_same(loaded, obj)
    assert artsim.load(tmp_path / "5").sha256 == loaded.sha256
    Inspect(tmp_path / "5", gates=True).run()
    assert "collision free: passed" in capsys.readouterr().out


def test_nodes_are_of_the_part_that_their_name_or_what_carries_them_says(tmp_path: Path) -> None:
    obj = artsim.make("storage_furniture", 3)
    rows = annotation(obj)
    meshes = [mesh_of(part.vertices @ T_MESH_REST.T, part.faces) for part in obj.parts]
    for row in rows:
        row["parts"][0]["name"] = f"name{row['id']}"
    names = ["body-10", "name1", "link_2", "13", "handle-14.001", *(f"{10 + k}_x" for k in range(5, len(rows)))]
    scene = trimesh.Scene()
    for k, mesh in enumerate(meshes):
        scene.graph.update(frame_to=names[k], matrix=trimesh.transformations.translation_matrix((k, 0, 0)))
        back = trimesh.transformations.translation_matrix((-k, 0, 0))
        scene.add_geometry(mesh, node_name=f"mesh{k}", geom_name=f"mesh{k}", parent_node_name=names[k], transform=back)
    scene.add_geometry(trimesh.creation.box((1, 1, 1)), node_name="lamp", geom_name="lamp")
    (tmp_path / "any name.glb").write_bytes(scene.export(file_type="glb"))
    (tmp_path / "mobility_v2.json").write_text(json.dumps(rows))
    loaded = artsim.load(tmp_path)
    assert_same(loaded, obj)
    assert any("lamp" in str(repair) for repair in loaded.repairs)


@pytest.mark.parametrize("name", ["{}.obj", "part-{}.obj", "{}-part.obj"])
def test_parts_may_have_files_of_their_own(name: str, tmp_path: Path) -> None:
    obj = artsim.make("drawer", 0)
    (tmp_path / "meshes").mkdir()
    for k, part in enumerate(obj.parts):
        file = tmp_path / "meshes" / name.format(10 + k)
        mesh_of(part.vertices @ T_MESH_REST.T, part.faces).export(file, digits=12)
    (tmp_path / "mobility_v2.json").write_text(json.dumps(annotation(obj)))
    assert_same(artsim.load(tmp_path), obj)


# --- real objects: the URDF file beside the annotation is the oracle, where nobody has edited it ---


def moving_joints(folder: Path) -> dict[str, tuple[Any, ...]]:
    """Of the URDF file: of each moving link its parent, its axis, where that is, and its limits."""
    found = {}
    for joint in ElementTree.parse(folder / "mobility.urdf").getroot().iter("joint"):
        if joint.get("type") == "fixed":
            continue
        values = {}
        for tag, keys in (("origin", ("xyz",)), ("axis", ("xyz",)), ("limit", ("lower", "upper"))):
            element = joint.find(tag)
            values[tag] = [] if element is None else [float(x) for key in keys for x in element.get(key, "0").split()]
        link, parent = (joint.find(tag).get("link", "") for tag in ("child", "parent"))  # type: ignore[union-attr]
        found[link] = (parent, np.array(values["origin"]), np.array(values["axis"]), np.array(values["limit"]))
    return found


def is_unedited(folder: Path) -> bool:
    """Whether the URDF file still has the joints of the annotation, and all of its meshes by their parts' numbers."""
    rows = {row["id"]: row for row in json.loads((folder / "mobility_v2.json").read_text())}
    joints = moving_joints(folder)
    moving = [row for row in rows.values() if row["joint"] in ("hinge", "slider")]
    if any(row["joint"] == "junk" for row in rows.values()) or {f"link_{r['id']}" for r in moving} != set(joints):
        return False
    place = {number: np.zeros(3) for number in rows}
    place |= {row["id"]: np.array(row["jointData"]["axis"]["origin"], float) for row in moving}
    for row in moving:
        parent, origin, axis, limits = joints[f"link_{row['id']}"]
        direction, limit = np.array(row["jointData"]["axis"]["direction"], float), row["jointData"]["limit"]
        ends = np.array([limit["a"], limit["b"]]) * (np.pi / 180 if row["joint"] == "hinge" else 1.0)
        flipped = -1.0 if ends[0] > ends[1] else 1.0
        same = parent == f"link_{row['parent']}" and np.allclose(axis, flipped * direction, atol=1e-6)
        same &= bool(np.allclose(origin, place[row["id"]] - place[row["parent"]], atol=1e-9))
        if len(limits):
            apart = (limits - np.sort(flipped * ends)) / (2 * np.pi)
            same &= bool(np.ptp(apart) < 1e-6 and abs(apart[0] - round(apart[0])) < 1e-6)
        if not same:
            return False
    fixed = [j for j in ElementTree.parse(folder / "mobility.urdf").getroot().iter("joint") if j.get("type") == "fixed"]
    parts = {part["id"] for row in rows.values() for part in row["parts"]}
    return len(fixed) == 1 and parts == set(meshes_by_part(folder))


def meshes_by_part(folder: Path) -> dict[int, list[str]]:
    """Names of the meshes of each part, out of the names of the URDF file's visuals: ``handle-7``."""
    found = defaultdict(list)
    for visual in ElementTree.parse(folder / "mobility.urdf").getroot().iter("visual"):
        number = visual.get("name", "").rpartition("-")[2]
        mesh = visual.find("geometry/mesh")
        if number.isdigit() and mesh is not None:
            found[int(number)].append(mesh.get("filename", ""))
    return found


@pytest.mark.slow
def test_annotations_of_real_objects_are_their_urdf_files(partnet_dir: Path, tmp_path: Path) -> None:
    folders = [source.path.parent for source in find_sources([partnet_dir])]
    unedited = [folder for folder in folders if (folder / "mobility_v2.json").exists() and is_unedited(folder)]
    assert len(unedited) > 80
    for folder in unedited[::9]:
        urdf = artsim.load(folder, category="unknown")
        # As given: the names of the URDF file's visuals say which mesh is whose.
        beside = artsim.load(folder / "mobility_v2.json", category="unknown")
        assert_same(beside, urdf)
        # As PartNet-Mobility is downloaded, where result.json says it; and as one GLB.
        copy, rows = tmp_path / folder.name, json.loads((folder / "mobility_v2.json").read_text())
        shutil.copytree(folder / "textured_objs", copy / "textured_objs")
        shutil.copy(folder / "mobility_v2.json", copy)
        meshes = meshes_by_part(folder)
        leaves = [{"id": n, "name": str(n), "objs": [Path(f).stem for f in files]} for n, files in meshes.items()]
        (copy / "result.json").write_text(json.dumps([{"id": -5, "name": "root", "children": leaves}]))
        assert_same(artsim.load(copy, category="unknown"), urdf)
        pieces: dict[int, list[trimesh.Trimesh]] = {}
        for number, files in meshes.items():
            loaded = [trimesh.load_mesh(folder / file, process=False, skip_materials=True) for file in files]
            pieces[number] = [mesh_of(mesh.vertices, mesh.faces) for mesh in loaded]
        write_version_3(rows, pieces, tmp_path / f"{folder.name}_glb")
        assert_same(artsim.load(tmp_path / f"{folder.name}_glb", category="unknown"), urdf, exact_faces=False)


def test_an_edited_urdf_file_is_not_needed_to_get_all_joints(partnet_dir: Path) -> None:
    folder = partnet_dir / "Safe" / "102380"
    assert artsim.load(folder).tree.types == ("free", "revolute")  # its knob was fixed
    whole = artsim.load(folder / "mobility_v2.json")
    assert whole.tree.types == ("free", "revolute", "continuous")
    assert painted_coats(whole) is not None  # with its own colours


# --- what is wrong says so ---


def annotated(tmp_path: Path, **changes: Any) -> Path:
    """A drawer whose slide is described otherwise."""
    file = write_version_2(artsim.make("drawer", 0), tmp_path / "5")
    rows = json.loads(file.read_text())
    rows[1] |= changes
    file.write_text(json.dumps(rows))
    return file


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"joint": "ball"}, "of no kind that is read"),
        ({"parent": 77}, "parent 77 does not exist"),
        ({"parent": 1}, "cycle"),
        ({"parent": -1}, "slider without a parent"),
        ({"id": 0}, "bodies have the id 0"),
        ({"id": "x"}, "no whole number"),
        ({"jointData": {}}, "without an axis"),
        ({"jointData": {"axis": {"origin": [0, 0], "direction": [0, 0, 1]}}}, "no list of 3 numbers"),
        ({"jointData": {"axis": {"origin": [0, 0, 1e300], "direction": [0, 0, 1]}}}, "no number up to"),
        ({"parts": [{"id": 99, "name": "lost"}]}, "part 99 (lost) has no mesh in result.json"),
        ({"parts": 3}, "no list of objects"),
    ],
)
def test_a_wrong_annotation_is_refused_by_name(changes: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError) as error:
        artsim.load(annotated(tmp_path, **changes))
    assert said in str(error.value)
    assert "Fix: " in str(error.value)


def limits(a: float, b: float, **more: bool) -> dict[str, Any]:
    axis = {"origin": [None, 0, 0], "direction": [0, 0, 2]}
    return {"axis": axis, "limit": {"a": a, "b": b, "noLimit": False, **more}}


def test_limits_are_turned_round_and_moved_by_whole_turns(tmp_path: Path) -> None:
    obj = artsim.load(annotated(tmp_path, joint="hinge", jointData=limits(440.0, 235.0)))
    np.testing.assert_allclose(np.rad2deg(obj.tree.limits[1]), (-80.0, 125.0))
    np.testing.assert_allclose(obj.tree.axes[1], (1.0, 0.0, 0.0), atol=1e-12)  # +Z of the mesh is the front, -X
    assert any("origin has no number in places" in str(repair) for repair in obj.repairs)


def test_a_slide_without_an_end_and_a_hinge_without_a_direction_are_told(tmp_path: Path) -> None:
    slide = artsim.load(annotated(tmp_path / "a", jointData=limits(0.0, 0.0, noLimit=True)))
    np.testing.assert_array_equal(slide.tree.limits[1], (-1.0, 1.0))
    axis = {"axis": {"origin": [0, 0, 0], "direction": [0, 0, 0]}}
    rigid = artsim.load(annotated(tmp_path / "b", joint="hinge", jointData=axis))
    assert len(rigid) == len(slide) - 1
    assert any("no direction" in str(repair) for repair in rigid.repairs)


def test_files_that_are_no_annotation_are_refused(tmp_path: Path) -> None:
    for content, said in (
        ("{", "not JSON"),
        ("[]", "without joints in a known format"),
        ('{"a": 1}', "without joints in a known format"),
    ):
        (tmp_path / "mobility_v2.json").write_text(content)
        with pytest.raises(AssetError, match=said):
            artsim.load(tmp_path)
    (tmp_path / "alone").mkdir()
    (tmp_path / "alone" / "m.glb").write_bytes(trimesh.creation.box((1, 1, 1)).export(file_type="glb"))
    with pytest.raises(AssetError, match="has shapes, but no joints"):
        artsim.load(tmp_path / "alone" / "m.glb")
    (tmp_path / "alone" / "mobility_v2.json").write_text(json.dumps(annotation(artsim.make("drawer", 0))))
    with pytest.raises(AssetError, match=r"no node of m\.glb belongs to a part"):
        artsim.load(tmp_path / "alone" / "m.glb")
    (tmp_path / "alone" / "m.glb").unlink()
    with pytest.raises(AssetError, match="no file says which meshes"):
        artsim.load(tmp_path / "alone")


def test_no_mesh_outside_the_folder_is_read(tmp_path: Path) -> None:
    file = write_version_2(artsim.make("drawer", 0), tmp_path / "5")
    shutil.copy(tmp_path / "5" / "textured_objs" / "original-1.obj", tmp_path / "secret.obj")
    tree = json.loads((tmp_path / "5" / "result.json").read_text())
    tree[0]["children"][1]["objs"] = ["../../secret"]
    (tmp_path / "5" / "result.json").write_text(json.dumps(tree))
    with pytest.raises(ArtsimError, match="outside"):
        artsim.load(file)
