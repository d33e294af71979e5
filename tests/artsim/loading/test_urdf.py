"""What the loader makes of good files and of quirky ones, and how it refuses bad ones."""

from __future__ import annotations

import os
import shutil
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

import artsim
from artsim.errors import ArtsimError, AssetError
from artsim.loading.meshes import LoadLimits
from artsim.loading.urdf import load
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import transform_points
from tests.conftest import ASSETS, BOX_LAPTOP

QUIRKS = ASSETS / "quirks"


def repairs_of(obj: ArticulatedObject) -> str:
    return "\n".join(map(str, obj.repairs))


# --- quirks that are mended ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "types", "repairs"),
    [
        ("screw_helper", ["free", "screw"], ["helper of a screw"]),
        ("screw_mimic", ["free", "screw"], ["-0.002 m/rad"]),
        ("mimic_pair", ["free", "revolute", "revolute"], []),
        (
            "chain",
            ["free", "revolute", "revolute", "prismatic", "revolute", "continuous", "revolute"],
            ["joint 'j1': axis of length 2 normalised", "joint 'j6': rest state 11.5 deg instead of 0"],
        ),
        ("primitives", ["free", "continuous"], []),
        (
            "limits",
            ["free", "revolute", "continuous", "prismatic", "revolute", "prismatic"],
            [
                "'j_swapped': limits 1 and -0.5 swapped",
                "'j_zero_axis': has a zero axis",
                "'j_no_limit': is revolute without a limit",
                "'j_no_range': is prismatic without a limit",
                "'j_negative_zero': limit -0 read as 0",
                "'j_late': rest state",
            ],
        ),
        ("meshes", ["free", "revolute"], ["'meshes/gone.obj' is missing", "'meshes/empty.obj' has no faces"]),
        ("package", ["free", "revolute"], []),
        ("merged", ["free", "prismatic"], ["merged into their parent: left, right", "'camera_frame': left out"]),
    ],
)
def test_quirks_are_mended_and_recorded(name: str, types: list[str], repairs: list[str]) -> None:
    obj = load(QUIRKS / name)
    assert list(obj.tree.types) == types
    for repair in repairs:
        assert repair in repairs_of(obj)


def test_a_screw_climbs_its_pitch_while_it_turns() -> None:
    obj = load(QUIRKS / "screw_helper")
    pose = obj.tree.forward_kinematics([0.0, 2 * np.pi])[1]
    assert np.allclose(pose[:3, :3], np.eye(3))
    assert np.allclose(pose[:3, 3], [0, 0, 0.02])  # one turn for the whole slide
    assert obj.source_state([0.0, np.pi]) == pytest.approx({"cap_turn": np.pi, "cap_slide": 0.01})


def test_primitives_have_their_sizes() -> None:
    obj = load(QUIRKS / "primitives")
    assert obj.part_mesh(1).volume == pytest.approx(4 / 3 * np.pi * 0.1**3, rel=0.01)
    assert obj.part_mesh(0).volume == pytest.approx(0.4 * 0.3 * 0.2 + np.pi * 0.05**2 * 0.3, rel=0.01)


def test_a_mirrored_mesh_faces_outwards() -> None:
    assert load(QUIRKS / "meshes").part_mesh(1).volume > 0


@pytest.mark.parametrize("kind", ["obj", "stl", "ply", "glb", "dae"])
def test_every_mesh_format_gives_the_same_surface(kind: str, tmp_path: Path) -> None:
    mesh = trimesh.creation.cylinder(0.1, 0.4)
    exported = mesh.export(file_type=kind)
    (tmp_path / f"part.{kind}").write_bytes(exported if isinstance(exported, bytes) else exported.encode())
    write_urdf(tmp_path, f'<mesh filename="part.{kind}"/>')
    loaded = load(tmp_path).part_mesh(0)
    assert loaded.volume == pytest.approx(mesh.volume, rel=1e-5)
    assert np.allclose(np.ptp(loaded.vertices, axis=0), np.ptp(mesh.vertices, axis=0), atol=1e-6)


def test_the_rest_frame_has_its_origin_in_the_middle(box_laptop: Path) -> None:
    obj = load(box_laptop)
    assert np.allclose(obj.bounds.mean(axis=0), 0)
    assert np.allclose(obj.bounds[1] - obj.bounds[0], [0.3, 0.4, 0.031])
    assert obj.diagonal == pytest.approx(np.linalg.norm([0.3, 0.4, 0.031]))


def test_a_part_moves_as_its_joint_says(box_laptop: Path) -> None:
    obj = load(box_laptop)
    upright = obj.tree.forward_kinematics([0.0, np.pi / 2])[1]
    lid = transform_points(upright, obj.parts[1].vertices)
    assert np.allclose(np.ptp(lid, axis=0), [0.01, 0.4, 0.3])
    assert lid[:, 2].max() > 0.29  # opens upwards


def test_the_digest_follows_the_content(tmp_path: Path) -> None:
    shutil.copytree(ASSETS / "scissors", tmp_path / "scissors")
    before = load(tmp_path / "scissors").sha256
    assert before == load(ASSETS / "scissors").sha256
    mesh = tmp_path / "scissors" / "textured_objs" / "0.obj"
    mesh.write_text(mesh.read_text().replace("v 0", "v 0.001", 1) + "\n")
    assert load(tmp_path / "scissors").sha256 != before


# --- bad input -----------------------------------------------------------------------------------------------------


def write_urdf(folder: Path, geometry: str = '<box size="1 1 1"/>', joints: str = "", links: str = "") -> Path:
    path = folder / "object.urdf"
    visual = f"<visual><geometry>{geometry}</geometry></visual>"
    path.write_text(f'<robot name="object"><link name="a">{visual}</link>{links}{joints}</robot>')
    return path


def with_text(old: str, new: str) -> Callable[[Path], Path]:
    """A folder with the box laptop, one thing in it replaced."""

    def make(folder: Path) -> Path:
        assert old in BOX_LAPTOP
        path = folder / "object.urdf"
        path.write_text(BOX_LAPTOP.replace(old, new, 1))
        return path

    return make


def with_bytes(content: bytes) -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        path = folder / "object.urdf"
        path.write_bytes(content)
        return path

    return make


def with_mesh(name: str, content: bytes | None) -> Callable[[Path], Path]:
    """An object whose only mesh has this content, or is not there."""

    def make(folder: Path) -> Path:
        if content is not None:
            (folder / name).write_bytes(content)
        return write_urdf(folder, f'<mesh filename="{name}"/>')

    return make


def with_joints(joints: str) -> Callable[[Path], Path]:
    box = '<visual><geometry><box size="1 1 1"/></geometry></visual>'
    links = "".join(f'<link name="{name}">{box}</link>' for name in "bcd")
    return lambda folder: write_urdf(folder, joints=joints, links=links)


def joint(name: str, parent: str, child: str, more: str = "", kind: str = "continuous") -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>'


def mimic(source: str) -> str:
    return f'<mimic joint="{source}"/>'


def boxes(count: int) -> str:
    """Links of a box each."""
    box = "<visual><geometry><box size='1 1 1'/></geometry></visual>"
    return "".join(f'<link name="l{i}">{box}</link>' for i in range(count))


def mesh(name: str) -> Callable[[Path], Path]:
    """An object with one mesh of this name."""
    return lambda folder: write_urdf(folder, f'<mesh filename="{name}"/>')


def huge_stl(folder: Path) -> Path:
    with (folder / "huge.stl").open("wb") as file:
        file.write(b"\0" * 80 + struct.pack("<I", 10_000_000))
        file.truncate(84 + 50 * 10_000_000)  # sparse: takes no disk
    return write_urdf(folder, '<mesh filename="huge.stl"/>')


def outside_by_link(folder: Path) -> Path:
    inside = folder / "inside"
    inside.mkdir()
    (folder / "secret.obj").write_bytes(CUBE)
    (inside / "mesh.obj").symlink_to(folder / "secret.obj")
    return write_urdf(inside, '<mesh filename="mesh.obj"/>')


def of_several(folder: Path) -> Path:
    (folder / "drawer" / "7").mkdir(parents=True)
    (folder / "drawer" / "7" / "mobility.xml").write_text("<mujoco/>")
    return folder


def two_files(folder: Path) -> Path:
    for name in ("one", "two"):
        (folder / f"{name}.urdf").write_text(BOX_LAPTOP)
    return folder


CUBE = trimesh.creation.box((1, 1, 1)).export(file_type="obj").encode()
NAN_CUBE = CUBE.replace(b"v 0.5", b"v nan").replace(b"v -0.5", b"v nan")
BOMB = b'<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a "aaaaaaaaaa">' + b"".join(
    b'<!ENTITY %c "%s">' % (98 + i, b"&%c;" % (97 + i) * 10) for i in range(9)
) + b']><robot name="&j;"><link name="a"/></robot>'  # fmt: skip
XXE = b'<?xml version="1.0"?><!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"/>'
XXE_UTF16 = XXE.decode().replace("?>", ' encoding="UTF-16"?>', 1).encode("utf-16")
OUTSIDE = "lies outside the asset's folder"
UNUSABLE = "none of the 1 meshes of link 'a' can be used"
HINGE = joint("j", "a", "b")

BAD: dict[str, tuple[Callable[[Path], Path], str]] = {
    "no such path": (lambda folder: folder / "nowhere", "no such file or folder"),
    "folder without a URDF": (lambda folder: folder, "holds no URDF file"),
    "folder of several objects": (of_several, r"holds no URDF file.*such as .*drawer/7"),
    "folder with two": (two_files, "holds 2 URDF files"),
    "empty file": (with_bytes(b""), "the file is empty"),
    "not XML": (with_bytes(b"hello"), "not well-formed XML"),
    "binary": (with_bytes(bytes(range(256))), "not well-formed XML"),
    "cut short": (with_bytes(BOX_LAPTOP[:200].encode()), "not well-formed XML"),
    "not a robot": (with_bytes(b"<sdf/>"), "top element is <sdf>"),
    "no links": (with_bytes(b'<robot name="r"/>'), "has no <link>"),
    "no geometry": (with_bytes(b'<robot name="r"><link name="a"/></robot>'), "no link has any geometry"),
    "entity bomb": (with_bytes(BOMB), "document type|not well-formed"),
    "external entity": (with_bytes(XXE), "document type|external entity"),
    "entity in UTF-16": (with_bytes(XXE_UTF16), "document type|external entity"),
    "document type": (with_bytes(b"<!DOCTYPE robot>" + BOX_LAPTOP.encode()), "declares a document type"),
    "nested too deeply": (with_bytes(b"<robot>" * 5000), "not well-formed XML"),
    "nameless link": (with_text('<link name="lid">', "<link>"), "a <link> has no name"),
    "two links of one name": (with_text('<link name="lid">', '<link name="base">'), "2 links are called 'base'"),
    "unknown joint type": (with_text('type="revolute"', 'type="ball"'), "joint 'hinge': joint type 'ball'"),
    "joint without a type": (with_text(' type="revolute"', ""), "joint type None"),
    "joint to a missing link": (with_text('child link="lid"', 'child link="lod"'), "child link 'lod' does not exist"),
    "joint without a parent": (with_text('<parent link="base"/>', ""), "parent link None does not exist"),
    "origin of text": (with_text('xyz="0.15 0 0.01"', 'xyz="a b c"'), "joint 'hinge': xyz='a b c'"),
    "origin of two numbers": (with_text('xyz="0.15 0 0.01"', 'xyz="0.15 0"'), "is not 3 numbers"),
    "origin not finite": (with_text('xyz="0.15 0 0.01"', 'xyz="nan 0 0"'), "is not finite"),
    "limit not a number": (with_text('upper="2.2"', 'upper="nan"'), "is not finite"),
    "limit of text": (with_text('upper="2.2"', 'upper="wide"'), "upper='wide'"),
    "axis of two numbers": (with_text('axis xyz="0 1 0"', 'axis xyz="0 1"'), "is not 3 numbers"),
    "box of text": (with_text('size="0.3 0.4 0.02"', 'size="big"'), "link 'base': size='big'"),
    "scale not finite": (lambda f: write_urdf(f, '<mesh filename="m.obj" scale="nan 1 1"/>'), "is not finite"),
    "two roots": (with_joints(HINGE), "have no parent: a, c, d"),
    "cycle": (with_joints(joint("j", "a", "b") + joint("k", "b", "a")), "have no parent|form a cycle|cycle"),
    "all in a cycle": (with_joints("".join(joint(p + c, p, c) for p, c in ("ab", "bc", "cd", "da"))), "form a cycle"),
    "detached cycle": (with_joints(HINGE + joint("cd", "c", "d") + joint("dc", "d", "c")), "c, d form a cycle"),
    "two parents": (with_joints(HINGE + joint("k", "c", "b")), "link 'b' is carried by two joints"),
    "floating in the middle": (
        with_joints(HINGE + joint("k", "b", "c", kind="floating") + joint("l", "c", "d")),
        "a floating joint inside the object",
    ),
    "mimics nothing": (
        with_joints(joint("j", "a", "b", mimic("x")) + joint("k", "b", "c") + joint("l", "c", "d")),
        "mimics joint 'x', which does not exist",
    ),
    "mimic loop": (
        with_joints(joint("j", "a", "b", mimic("k")) + joint("k", "b", "c", mimic("j")) + joint("l", "c", "d")),
        "mimic relations form a loop",
    ),
    "missing mesh": (with_mesh("gone.obj", None), f"{UNUSABLE}: mesh 'gone.obj' is missing"),
    "mesh without faces": (with_mesh("m.obj", b"v 0 0 0\n"), UNUSABLE),
    "mesh of nonsense": (with_mesh("m.stl", b"hello"), UNUSABLE),
    "GLB of nonsense": (with_mesh("m.glb", b"glTF" + bytes(50)), UNUSABLE),
    "PLY of nonsense": (with_mesh("m.ply", b"ply\nformat ascii 1.0\nelement vertex 99\nend_header\n"), UNUSABLE),
    "truncated STL": (with_mesh("m.stl", bytes(80) + struct.pack("<I", 100) + bytes(70)), UNUSABLE),
    "entity bomb in a mesh": (with_mesh("m.dae", BOMB), "document type|not well-formed|none of the 1 meshes"),
    "every vertex not a number": (with_mesh("m.obj", NAN_CUBE), UNUSABLE),
    "unknown mesh format": (with_mesh("m.blend", b"x"), "of a kind that is not read"),
    "mesh of ten million faces": (huge_stl, "mesh of 500 MB is over the limit of 100 MB"),
    "mesh outside by dots": (mesh("../../etc/passwd.obj"), OUTSIDE),
    "mesh outside by absolute path": (mesh("/etc/passwd"), OUTSIDE),
    "mesh outside by URI": (mesh("file:///etc/passwd"), OUTSIDE),
    "mesh outside by package": (mesh("package://p/../../../etc/passwd"), OUTSIDE),
    "mesh outside by symbolic link": (outside_by_link, OUTSIDE),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gives_an_error_that_says_what_and_where(case: str, tmp_path: Path) -> None:
    make, message = BAD[case]
    path = make(tmp_path)
    with pytest.raises(AssetError if case != "mimic loop" else ArtsimError, match=message) as error:
        load(path)
    if case != "mimic loop":
        assert str(tmp_path) in str(error.value)
        assert "Fix:" in str(error.value)


def test_limits_hold(tmp_path: Path, box_laptop: Path) -> None:
    with pytest.raises(AssetError, match="2 links are over the limit of 1"):
        load(box_laptop, limits=LoadLimits(max_links=1))
    with pytest.raises(AssetError, match=r"URDF file of 0\.000423 MB is over the limit of 0\.0001 MB"):
        load(box_laptop, limits=LoadLimits(max_urdf_bytes=100))
    with pytest.raises(AssetError, match="more than 5 triangles"):
        load(QUIRKS / "meshes", limits=LoadLimits(max_faces=5))
    path = write_urdf(tmp_path, links=boxes(300), joints="".join(joint(f"j{i}", "a", f"l{i}") for i in range(300)))
    with pytest.raises(AssetError, match="301 parts; part ids fit 254"):
        load(path)


def test_broken_triangles_are_left_out_and_counted(tmp_path: Path) -> None:
    cube = trimesh.creation.box((1, 1, 1))
    cube.vertices[0] = np.nan
    (tmp_path / "m.stl").write_bytes(cube.export(file_type="stl"))
    obj = load(write_urdf(tmp_path, '<mesh filename="m.stl"/>'))
    broken = int((cube.faces == 0).any(axis=1).sum())
    assert f"{broken} triangles left out: not finite" in repairs_of(obj)
    assert len(obj.parts[0].faces) == 12 - broken
    assert np.isfinite(obj.bounds).all()


def test_a_chain_of_two_hundred_links_is_no_problem(tmp_path: Path) -> None:
    joints = joint("j0", "a", "l0") + "".join(joint(f"j{i}", f"l{i - 1}", f"l{i}") for i in range(1, 200))
    assert load(write_urdf(tmp_path, links=boxes(200), joints=joints)).tree.depths.max() == 200


def test_broken_side_files_are_reported_not_fatal(tmp_path: Path) -> None:
    shutil.copytree(ASSETS / "scissors", tmp_path / "scissors")
    for name, content in (("meta.json", "{"), ("mobility_v2.json", "[" * 100_000), ("semantics.txt", "\xff link\n")):
        (tmp_path / "scissors" / name).write_text(content)
    obj = load(tmp_path / "scissors")
    assert "meta.json: ignored: not JSON" in repairs_of(obj)
    assert "mobility_v2.json: ignored: not JSON" in repairs_of(obj)


def test_package_roots_can_be_declared(tmp_path: Path) -> None:
    meshes, robot = tmp_path / "elsewhere", tmp_path / "robot"
    meshes.mkdir()
    robot.mkdir()
    (meshes / "cube.obj").write_bytes(CUBE)
    path = write_urdf(robot, '<mesh filename="package://things/cube.obj"/>')
    with pytest.raises(AssetError, match="is missing"):
        load(path)
    assert len(load(path, package_roots={"things": meshes})) == 1


def test_a_mesh_never_makes_another_file_be_opened(tmp_path: Path) -> None:
    """An OBJ with materials and a fifo for a material library would hang if it were opened."""
    os.mkfifo(tmp_path / "trap.mtl")
    (tmp_path / "m.obj").write_bytes(b"mtllib trap.mtl\nusemtl a\n" + CUBE)
    assert len(load(write_urdf(tmp_path, '<mesh filename="m.obj"/>'))) == 1


@pytest.mark.parametrize("target", ["object.urdf", "cube.obj"])
def test_random_damage_gives_a_clear_error_or_an_object(target: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    (tmp_path / "cube.obj").write_bytes(CUBE)
    write_urdf(tmp_path, '<mesh filename="cube.obj"/>', joint("j", "a", "b", '<axis xyz="0 0 1"/>'), "<link name='b'/>")
    original = (tmp_path / target).read_bytes()
    for _ in range(150):
        damaged = bytearray(original)
        for place in rng.integers(0, len(damaged), size=rng.integers(1, 4)):
            damaged[place] = rng.integers(0, 256)
        (tmp_path / target).write_bytes(bytes(damaged))
        try:
            obj = artsim.load(tmp_path / "object.urdf")
        except ArtsimError:
            continue
        assert np.isfinite(obj.bounds).all()
