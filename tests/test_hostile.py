"""Files nobody vouches for: each is read, or refused in one line, within 2 s of processor time and 500 MB."""

from __future__ import annotations

import io
import json
import os
import shutil
import struct
import sys
import zipfile
import zlib
from pathlib import Path
from typing import Any

import pytest

import artsim
from artsim.commands.verbs import main
from artsim.errors import ArtsimError, AssetError
from tests.hostile_child import read_each, too_much

CASES = Path(__file__).parent / "cases" / "hostile"
ESTIMATOR = Path(__file__).parents[1] / "artperl" / "weights" / "laptop"
ONE_BOX = '<robot name="r"><link name="a"><visual><geometry><box size="1 1 1"/></geometry></visual></link></robot>'


def folder_with(path: Path, **files: str | bytes) -> Path:
    """A folder with these files, ``__`` for the dot in their names, and a URDF file of one box unless there is one."""
    path.mkdir(parents=True, exist_ok=True)
    for name, content in ({"mobility__urdf": ONE_BOX} | files).items():
        data = content.encode() if isinstance(content, str) else content
        (path / name.replace("__", ".")).write_bytes(data)
    return path


def zipped(members: dict[str, bytes], compression: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def npy(descr: str, shape: str, content: bytes = b"") -> bytes:
    """An array whose header says what it likes."""
    header = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}".ljust(117).encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + content


def png(width: int, height: int) -> bytes:
    """An image that is said to be large."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
    )


def changed_estimator(path: Path, **files: bytes) -> Path:
    shutil.copytree(ESTIMATOR, path)
    for name, content in files.items():
        (path / name.replace("__", ".")).write_bytes(content)
    return path


def settings(**changes: Any) -> bytes:
    return json.dumps(json.loads((ESTIMATOR / "estimator.json").read_bytes()) | changes).encode()


def huge_header() -> bytes:
    """A safetensors file of which a tensor takes an exabyte."""
    text = json.dumps({"a": {"dtype": "F32", "shape": [1 << 40, 1 << 20], "data_offsets": [0, 1 << 62]}}).encode()
    return struct.pack("<Q", len(text)) + text


def fifo(path: Path) -> None:
    os.mkfifo(path)


def made(root: Path) -> dict[str, tuple[str, Path, str | None]]:
    """Shapes of hostile files by name: what reads it, where it is, and what is said (None: it is read)."""
    zeros = npy("'|u1'", "(150000000,)", bytes(150_000_000))
    many = zipped({f"{i}.npy": b"" for i in range(20_000)}, zipfile.ZIP_STORED)
    lists = b"[" * 200_000
    files = {
        "zeros.npz": zipped({"header.npy": zeros}),
        "members.npz": many,
        "shape.npz": zipped({"header.npy": npy("'<f8'", "(1000000000000,)")}),
        "overflow.npz": zipped({"header.npy": npy("'<f8'", "(99999999999, 99999999999, 99999999999)")}),
        "text.npz": zipped({"header.npy": npy("'<U999999999'", "(1,)")}),
        "objects.npz": zipped({"header.npy": npy("'|O'", "(1,)", b"cos\nsystem\n(S'true'\ntR.")}),
        "empty.npz": b"",
        "large.png": png(60_000, 60_000),
        "wide.png": png(2**31 - 1, 1),
        "short.png": png(100, 100),
    }
    for name, content in files.items():
        (root / name).write_bytes(content)
    shutil.copy(root / "zeros.npz", root / "base.npz")
    with (root / "sparse.npz").open("wb") as file:
        file.truncate(1 << 40)
    sparse = folder_with(root / "sparse")
    with (sparse / "mobility.urdf").open("wb") as file:
        file.truncate(1 << 40)
    pipe, pipe_beside = folder_with(root / "pipe"), folder_with(root / "pipe_beside")
    (pipe / "mobility.urdf").unlink()
    os.mkfifo(pipe / "mobility.urdf")
    os.mkfifo(pipe_beside / "meta.json")
    zero, out, secret = folder_with(root / "zero"), folder_with(root / "out"), root / "secret.json"
    (zero / "semantics.txt").symlink_to("/dev/zero")
    secret.write_text('{"model_cat": "secret"}')
    (out / "meta.json").symlink_to("../secret.json")
    mesh = ONE_BOX.replace('<box size="1 1 1"/>', '<mesh filename="m.obj"/>')
    directory = folder_with(root / "directory", mobility__urdf=mesh)
    (directory / "m.obj").mkdir()
    forged = {"num_rows": 10**9, "width": 10**9, "votes": False}
    tall = json.loads((ESTIMATOR / "estimator.json").read_bytes())["options"] | {"num_points": 10**12}
    return {
        "npz of zeros": ("load", root / "zeros.npz", "expands to more than the limit"),
        "npz of zeros as a base": ("base", root / "base.npz", "expands to more than the limit"),
        "npz with many members": ("load", root / "members.npz", "over 10000 members"),
        "npz with a forged shape": ("load", root / "shape.npz", "takes 8000000000000 bytes, but there are 0"),
        "npz with a shape that overflows": ("load", root / "overflow.npz", "but there are 0"),
        "npz with a forged type": ("load", root / "text.npz", "header of an array is damaged"),
        "npz with objects": ("load", root / "objects.npz", "Python objects, which are never read"),
        "npz without a byte": ("load", root / "empty.npz", "cannot be read"),
        "npz of a terabyte of nothing": ("load", root / "sparse.npz", "over the limit"),
        "urdf of a terabyte of nothing": ("load", sparse, "over the limit"),
        "urdf that is a pipe": ("load", pipe / "mobility.urdf", ""),
        "meta.json that is a pipe": ("load", pipe_beside, None),
        "semantics.txt without end": ("load", zero, None),
        "meta.json that is a link outward": ("load", out, None),
        "mesh that is a folder": ("load", directory, "m.obj"),
        "meta.json nested deeply": ("load", folder_with(root / "deep", meta__json=lists), None),
        "meta.json of many values": ("load", folder_with(root / "many", meta__json=b"[" + b"[]," * 2_600_000), None),
        "meta.json of 50 MB": ("load", folder_with(root / "long", meta__json=b'"' + bytes(50_000_000)), None),
        "dataset.json of many values": (
            "dataset",
            folder_with(root / "dataset", dataset__json=b"[" + b"{}," * 10_000_000 + b"{}]"),
            "values",
        ),
        "dataset.json nested deeply": ("dataset", folder_with(root / "deep_set", dataset__json=lists), "deep"),
        "image of billions of pixels": ("image", root / "large.png", "exceeds limit"),
        "image of one long row": ("image", root / "wide.png", ""),
        "image cut short": ("image", root / "short.png", "cannot be read"),
        "estimator of forged sizes": (
            "estimator",
            changed_estimator(root / "forged", estimator__json=settings(perception=forged)),
            "num_rows is 1000000000",
        ),
        "estimator of sizes that its weights do not have": (
            "estimator",
            changed_estimator(root / "broad", estimator__json=settings(perception={"num_rows": 2, "width": 2048})),
            "perception.backbone.whole.0.weight is not of shape (16384, 16384)",
        ),
        "estimator with forged options": (
            "estimator", changed_estimator(root / "tall", estimator__json=settings(options=tall)), "num_points"
        ),
        "weights with a forged header": (
            "estimator", changed_estimator(root / "header", weights__safetensors=huge_header()),
            "the file of weights is damaged",
        ),
        "weights with an endless header": (
            "estimator",
            changed_estimator(root / "endless", weights__safetensors=b"\xff" * 8 + b"{"),
            "its header cannot be so large",
        ),
    }  # fmt: skip


def mjcf(folder: Path, world: str = "", before: str = "", **files: str | bytes) -> Path:
    """A folder with an MJCF file of a box with a lid, and what is between the lines."""
    lid = '<body name="b"><joint axis="1 0 0" range="0 90"/><geom type="box" size="1 1 1"/></body>'
    body = f'<body name="a"><geom type="box" size="1 1 1"/>{lid}{world}</body>'
    folder_with(folder, mobility__xml=f"<mujoco>{before}<worldbody>{body}</worldbody></mujoco>", **files)
    (folder / "mobility.urdf").unlink()
    return folder


def ball_of(faces_by_4: int) -> bytes:
    """An STL file of a bumpy ball."""
    import numpy as np
    import trimesh

    mesh = trimesh.creation.icosphere(faces_by_4)
    mesh.vertices *= 1.0 + 0.05 * np.random.default_rng(0).random((len(mesh.vertices), 1))
    return bytes(mesh.export(file_type="stl"))


def made_mjcf(root: Path) -> dict[str, tuple[str, Path, str | None]]:
    """Hostile MJCF files, as :func:`made`."""
    sections = "<mujoco>" + "<worldbody/>" * 2000 + "</mujoco>"
    wide = {f"{i}__xml": sections for i in range(100)}
    includes = "".join(f'<include file="{i}.xml"/>' for i in range(100))
    chain = {f"{i}__xml": f'<mujoco><include file="{i + 1}.xml"/></mujoco>' for i in range(150)}
    meshes = '<asset><mesh name="m" file="m.stl"/></asset>'
    many = "".join(f'<geom type="mesh" mesh="m" pos="0 0 {i / 100}"/>' for i in range(300))
    assets = "".join(f'<mesh name="m{i}" file="m.stl" scale="1 1 {1 + i / 100}"/>' for i in range(300))
    ball = ball_of(5)
    cone = '<asset><mesh name="m" builtin="cone" params="1e9 1"/></asset>'
    copies = "<replicate count='99'>" * 9 + "<geom size='1'/>" + "</replicate>" * 9
    found: dict[str, tuple[Path, str | None]] = {
        "100 wide includes": (mjcf(root / "wide", "", includes, **wide), None),
        "a long chain of includes": (mjcf(root / "chain", "", '<include file="0.xml"/>', **chain), "over 100 files"),
        "one mesh many times": (mjcf(root / "hulls", many, meshes, m__stl=ball), "copies of its meshes"),
        "one file as many meshes": (
            mjcf(root / "assets", "", f"<asset>{assets}</asset>", m__stl=ball), "more than 5000000 triangles"
        ),
        "copies of copies": (mjcf(root / "copies", copies), "more than"),
        "many joints": (mjcf(root / "joints", '<body><joint type="slide"/></body>' * 2000), "more than"),
        "many materials": (
            mjcf(root / "materials", "", f"<asset>{'<material/>' * 300_000}</asset>"), "more than 5000 <material>"
        ),
        "a mesh of many sides": (mjcf(root / "sides", "", cone), "over 100 sides"),
    }  # fmt: skip
    cases: dict[str, tuple[str, Path, str | None]] = {f"mjcf of {name}": ("load", *one) for name, one in found.items()}
    numbers = {
        "place": '<geom size="1" pos="0 0 {}"/>', "size": '<geom size="{}"/>', "mass": '<geom size="1" mass="{}"/>',
        "collision": '<geom size="1" group="3" pos="0 0 {}"/>', "body": '<body pos="{} 0 0"><geom size="1"/></body>',
        "axis": '<body><joint axis="{} 0 0"/><geom size="1"/></body>',
        "range": '<body><joint axis="1 0 0" limited="true" range="0 {}"/><geom size="1"/></body>',
        "anchor": '<body><joint pos="{} 0 0"/><geom size="1"/></body>',
        "turn": '<body quat="{} 0 0 0"><joint/><geom size="1"/></body>',
        "mesh": '<geom type="mesh" mesh="n"/>',
    }  # fmt: skip
    for name, text in numbers.items():
        for value in ("nan", "1e308", "inf"):
            before = f'<asset><mesh name="n" file="m.stl" scale="{value} 1 1"/></asset>' if name == "mesh" else ""
            folder = mjcf(root / f"{name}_{value}", text.format(value), before, m__stl=ball_of(1))
            cases[f"mjcf with {value} as {name}"] = ("load", folder, "?")
    return cases


def shared(root: Path) -> dict[str, tuple[str, Path, str | None]]:
    """The cases of other people's making; each as its README says."""
    cases: dict[str, tuple[str, Path, str | None]] = {
        name: ("load", CASES / name, text)
        for name, text in {
            "dae_instance_bomb": "",
            "fixed_axis": None,
            "meta_surrogate": None,
            "ply_no_vertices": "",
            "robot_material": None,
            "spheres": "",
        }.items()
    }
    bombs = CASES.parent / "second" / "hostile" / "A03_usd_ancestral_reference_bomb"
    for bomb in sorted(bombs.glob("*/mobility.usda")):
        cases[f"usd {bomb.parent.name}"] = ("load", bomb, "more than files of its size")
    cases["view_traversal"] = ("view", CASES / "view_traversal", None)
    (intrinsics,) = CASES.glob("fuzz_inputs_*")
    cases["intrinsics"] = ("intrinsics", intrinsics, "")
    (base,) = CASES.glob("fuzz_base_*")
    cases["base"] = ("base", base, "Bad CRC-32")
    (compiled,) = CASES.glob("fuzz_npzobj_*")
    cases["object"] = ("load", compiled, "64 bits")
    (forged,) = CASES.glob("fuzz_settings_*")
    references = {"references": json.loads(forged.read_bytes())["options"]["references"]}
    cases["settings"] = (
        "estimator", changed_estimator(root / "e", estimator__json=settings(options=references)), "references"
    )  # fmt: skip
    (description,) = CASES.glob("fuzz_dsjson_*")
    cases["description"] = ("dataset", folder_with(root / "d", dataset__json=description.read_bytes()), "")
    (mesh,) = CASES.glob("fuzz_mesh_*")
    robot = ONE_BOX.replace('<box size="1 1 1"/>', '<mesh filename="m.obj"/>')
    cases["mesh"] = ("load", folder_with(root / "m", mobility__urdf=robot, m__obj=mesh.read_bytes()), "")
    (urdf,) = CASES.glob("fuzz_urdf_*")
    cases["urdf"] = ("load", folder_with(root / "u", mobility__urdf=urdf.read_bytes()), "")
    return cases


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """What came of every case, each read in a process of its own in an empty folder."""
    root, empty = tmp_path_factory.mktemp("hostile"), tmp_path_factory.mktemp("here") / "a" / "b"
    empty.mkdir(parents=True)
    cases = made(root) | made_mjcf(root) | shared(root)
    found = read_each([(kind, path) for kind, path, _ in cases.values()], empty)
    written = sorted(str(path.relative_to(empty.parents[1])) for path in empty.parents[1].rglob("*") if path.is_file())
    return {name: one | {"text": cases[name][2], "written": written} for name, one in zip(cases, found, strict=True)}


@pytest.mark.slow
def test_each_is_read_or_refused_in_one_line(outcomes: dict[str, dict[str, Any]]) -> None:
    wrong = {}
    for name, one in outcomes.items():
        if "raw" in one:
            wrong[name] = one["raw"]
        elif one["text"] == "?":  # read or refused: what MuJoCo makes of such numbers is its own affair
            continue
        elif one["text"] is None and "said" not in one:
            wrong[name] = one["error"]
        elif one["text"] is not None and one["text"] not in one.get("error", "was read"):
            wrong[name] = one.get("error", f"was read: {one.get('said')}")
        elif "\n" in one.get("error", "") or len(one.get("error", "")) > 1500:
            wrong[name] = one["error"]
    assert not wrong


@pytest.mark.slow
def test_each_takes_little_time_and_memory(outcomes: dict[str, dict[str, Any]]) -> None:
    assert not too_much(outcomes)


@pytest.mark.slow
def test_a_picture_is_written_here_and_nowhere_else(outcomes: dict[str, dict[str, Any]]) -> None:
    (picture,) = next(iter(outcomes.values()))["written"]
    assert picture.startswith("a/b/")
    assert "Pwned" in picture
    assert picture.count("/") == 2


@pytest.mark.slow
def test_links_outward_are_not_followed_and_said(outcomes: dict[str, dict[str, Any]]) -> None:
    said = outcomes["meta.json that is a link outward"]["said"]
    assert "secret" not in said
    assert "meta.json: ignored: meta.json is a link that leads out of the folder" in said
    assert "no regular file" in outcomes["meta.json that is a pipe"]["said"]
    assert "semantics.txt is a link that leads out" in outcomes["semantics.txt without end"]["said"]


def test_a_folder_behind_a_link_is_read(tmp_path: Path) -> None:
    folder_with(tmp_path / "there", meta__json='{"model_cat": "Laptop", "anno_id": "x1"}')
    (tmp_path / "here").symlink_to("there")
    assert artsim.load(tmp_path / "here").object_id == "x1"
    assert artsim.load(tmp_path / "here").category == "laptop"


def test_what_is_printed_holds_no_escapes(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: Any) -> None:
    evil = "\x1b]0;owned\x07\u202egnp.\u009b31m" + "long " * 5000
    meta = json.dumps({"model_cat": evil, "anno_id": evil})
    robot = ONE_BOX.replace('"a"', '"&#x9b;2J&#x202e;a&#10;b"')
    folder = folder_with(tmp_path / "o", meta__json=meta, mobility__urdf=robot)
    monkeypatch.setattr(sys, "argv", ["artsim", "inspect", str(folder)])
    main()
    text = capsys.readouterr().out
    assert all(c == "\n" or c.isprintable() for c in text)
    assert len(text) < 5000
    assert "\\x1b]0;owned" in text


def test_an_error_is_one_printable_line_of_bounded_length(tmp_path: Path) -> None:
    for name in ("\x1b[2J", "\u202e", "\udc80", "a\nb", "x" * 200):
        with pytest.raises(ArtsimError) as caught:
            artsim.load(tmp_path / name)
        text = str(caught.value)
        assert text.isprintable()
        text.encode()
    assert len(str(AssetError("x" * 100_000, "y" * 100_000, "z" * 100_000))) < 5000


def test_a_recording_names_its_motions_and_no_other_files(tmp_path: Path) -> None:
    from artsim.physics.episode_file import open_motions

    for name in ("../../secret", "/etc/passwd", 7, None, "", "a" * 300):
        motion = {"name": name, "joint_state": [[0.0]], "joint_velocity": [[0.0]]}
        content = {"format": 1, "control_step": 0.1, "motions": [motion]}
        (tmp_path / "motions.json").write_text(json.dumps(content))
        with pytest.raises(ArtsimError, match="names a motion"):
            open_motions(tmp_path)


def test_a_urdf_file_that_leads_out_of_its_folder_is_refused(tmp_path: Path) -> None:
    folder_with(tmp_path / "elsewhere")
    (tmp_path / "asset").mkdir()
    (tmp_path / "asset" / "mobility.urdf").symlink_to(tmp_path / "elsewhere" / "mobility.urdf")
    for path in (tmp_path / "asset", tmp_path / "asset" / "mobility.urdf"):
        with pytest.raises(
            AssetError, match=f"leads out of its folder. Fix: pass the file itself: {tmp_path}/elsewhere"
        ):
            artsim.load(path)
    within = folder_with(tmp_path / "within")
    (within / "mobility.urdf").rename(within / "robot.urdf")
    (within / "mobility.urdf").symlink_to("robot.urdf")
    assert len(artsim.load(within / "mobility.urdf")) == 1


@pytest.mark.parametrize("size", ["1e300 1 1", "1e7 1 1", "1e-200 1e-200 1e-200"])
def test_a_size_that_nothing_can_be_computed_with_is_refused(size: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"over 1e\+06|no extent"):
        artsim.load(folder_with(tmp_path / "o", mobility__urdf=ONE_BOX.replace("1 1 1", size)))
