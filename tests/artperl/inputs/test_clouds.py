"""One cloud, written in every format by other tools or by hand, is read as the same points."""

from __future__ import annotations

import io
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from artperl.inputs import InputOptions, read_cloud
from artperl.inputs.bounds import MAX_VALUES
from artperl.inputs.pcd import unpack_lzf
from artsim.errors import ConfigError

CASES = Path(__file__).parents[2] / "cases"
POINTS = (np.random.default_rng(5).integers(-900, 900, (40, 3)) / 256.0 + [0.0, 0.0, 8.0]).astype(np.float64)
"""Exact in single precision and in text."""


def _rows(separator: str, extra: str = "") -> str:
    return "\n".join(separator.join(map(str, p)) + extra for p in POINTS.tolist()) + "\n"


def _pcd(kind: str, data: bytes) -> bytes:
    n = len(POINTS)
    head = (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 8 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH {n}\nHEIGHT 1\n"
    )
    return (head + f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA {kind}\n").encode() + data


def _lzf(raw: bytes) -> bytes:
    """The simplest valid compression: literal runs of at most 32 bytes, and one reference where zeros go on."""
    out, at = b"", 0
    while at < len(raw):
        if at >= 1 and raw[at : at + 20] == raw[at - 1 : at] * 20:
            out += bytes([7 << 5, 20 - 2 - 7, 0])
            at += 20
        else:
            run = raw[at : at + 32] if raw[at : at + 1] != raw[at + 1 : at + 2] else raw[at : at + 1]
            out += bytes([len(run) - 1]) + run
            at += len(run)
    return out


def _files() -> dict[str, bytes]:
    f4, mesh = POINTS.astype("<f4"), trimesh.Trimesh(POINTS, [[0, 1, 2]], process=False)
    records = np.zeros(len(POINTS), dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f8"), ("rgb", "<u4")])
    for n, axis in enumerate("xyz"):
        records[axis] = POINTS[:, n]
    head = "ply\r\nformat {}\r\ncomment by hand\r\nelement camera 2\r\nproperty uchar a\r\nproperty double b\r\n"
    head += f"element vertex {len(POINTS)}\r\nproperty uchar red\r\nproperty double z\r\nproperty float y\r\n"
    head += "property float x\r\nelement face 0\r\nproperty list uchar int i\r\nend_header\r\n"
    big = np.zeros(len(POINTS), dtype=[("red", "u1"), ("z", ">f8"), ("y", ">f4"), ("x", ">f4")])
    for n, axis in enumerate("xyz"):
        big[axis] = POINTS[:, n]
    swapped = "".join(f"7 {z} {y} {x}\n" for x, y, z in POINTS.tolist())
    fields = b"".join(records[name].tobytes() for name in records.dtype.names or ())
    packed = _lzf(fields)
    return {
        "trimesh.ply": trimesh.PointCloud(POINTS).export(file_type="ply"),
        "ascii.ply": (head.format("ascii 1.0") + "1 2\n1 2\n" + swapped).replace("\r\n", "\n").encode(),
        "big.ply": head.format("binary_big_endian 1.0").encode() + bytes(18) + big.tobytes(),
        "mesh.ply": mesh.export(file_type="ply"),
        "mesh.obj": ("# a\r\no a\r\n" + "".join(f" v\t{x} {y} {z}\r\n" for x, y, z in POINTS) + "f 1 2 3").encode(),
        "mesh.off": mesh.export(file_type="off").encode(),
        "ascii.pcd": _pcd("ascii", _rows(" ", " 255").encode()),
        "binary.pcd": _pcd("binary", records.tobytes()),
        "packed.pcd": _pcd("binary_compressed", struct.pack("<II", len(packed), len(fields)) + packed),
        "blank.xyz": _rows(" ").encode(),
        "tabs.txt": ("# a comment\n" + _rows("\t", "\t1\t2\t3")).encode(),
        "names.csv": ("\ufefflabel,X,Y,Z\r\n" + "".join(f'"chair",{x},{y},{z}\r\n' for x, y, z in POINTS)).encode(),
        "cloudcompare.txt": ("//X Y Z R\n" + _rows(" ", " 9")).encode(),
        "units.csv": ('"z [m]";"y [m]";"x [m]"\n' + "".join(f"{z};{y};{x}\n" for x, y, z in POINTS)).encode(),
        "german.csv": ("x;y;z\n" + _rows(";").replace(".", ",")).encode(),
        "paraview.csv": ('"Points:0","Points:1","Points:2","id"\n' + _rows(",", ",1")).encode(),
        "leica.pts": (f"{len(POINTS)}\n" + _rows(" ", " 1 2 3 4")).encode(),
        "three.npy": _npy(POINTS), "single.npy": _npy(f4), "columns.npy": _npy(np.hstack([POINTS, POINTS])),
        "fortran.npy": _npy(np.asfortranarray(POINTS)), "organised.npy": _npy(POINTS.reshape(8, 5, 3)),
        "records.npy": _npy(records), "batch.npy": _npy(POINTS[None]),
    }  # fmt: skip


def _npy(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


@pytest.mark.parametrize("name", sorted(_files()))
@pytest.mark.filterwarnings("error")
def test_every_format_holds_the_same_points(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(_files()[name])
    np.testing.assert_array_equal(read_cloud(tmp_path / name).points, POINTS)


def test_corners_of_an_stl_are_read_once(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.5, 0.25, 1.0))
    for kind in ("stl", "stl_ascii"):
        data = box.export(file_type=kind)
        (tmp_path / "box.stl").write_bytes(data if isinstance(data, bytes) else data.encode())
        np.testing.assert_allclose(read_cloud(tmp_path / "box.stl").points, np.unique(box.vertices, axis=0))


@pytest.mark.parametrize("name", ["points", "xyz", "pcd", "point_cloud", "coord", "whatever"])
def test_the_array_of_an_archive_that_is_the_cloud(name: str, tmp_path: Path) -> None:
    np.savez_compressed(
        tmp_path / "c.npz", **{name: POINTS.astype(np.float16)}, label=np.zeros(40), rgb=np.zeros((4, 4))
    )
    cloud = read_cloud(tmp_path / "c.npz") if name != "whatever" else None
    if cloud is None:  # two arrays of numbers fit, and neither is named as a cloud
        with pytest.raises(ConfigError, match="more than one"):
            read_cloud(tmp_path / "c.npz")
        np.savez(tmp_path / "c.npz", whatever=POINTS.astype(np.float16), label=np.zeros(40))
        cloud = read_cloud(tmp_path / "c.npz")
    np.testing.assert_array_equal(cloud.points, POINTS.astype(np.float16).astype(np.float64))
    assert (name == "points") or any(f"'{name}'" in note for note in cloud.notes)


@pytest.mark.parametrize(
    ("array", "word"),
    [
        (np.zeros((480, 640, 3), np.uint8), "picture"), (np.zeros((3, 5000)), "array.T"), (np.zeros((5, 2)), "(5, 2)"),
        (np.zeros((480, 640)), "--intrinsics"), (np.zeros(9), "no cloud"), (np.zeros((9, 3), complex), "complex"),
        (np.array([["a"] * 3] * 3), "coordinates"), (np.zeros((0, 3)), "empty"), (np.zeros((9, 3), bool), "bool"),
        (np.zeros(9, [("a", "f4"), ("b", "f4")]), "x, y, z"),
    ],
)  # fmt: skip
def test_arrays_that_are_no_cloud_are_refused(array: np.ndarray, word: str, tmp_path: Path) -> None:
    np.save(tmp_path / "c.npy", array)
    with pytest.raises(ConfigError, match=word.replace("(", r"\(").replace(")", r"\)")):
        read_cloud(tmp_path / "c.npy")


def test_nothing_is_unpickled(tmp_path: Path) -> None:
    class Trap:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return Path.touch, (tmp_path / "ran",)  # type: ignore[return-value]

    array = np.array([[Trap(), 1, 2]] * 3, dtype=object)
    np.save(tmp_path / "c.npy", array)
    np.savez(tmp_path / "c.npz", points=array)
    for name in ("c.npy", "c.npz"):
        with pytest.raises(ConfigError):
            read_cloud(tmp_path / name)
    assert not (tmp_path / "ran").exists()


def test_a_cloud_in_millimetres_is_that_in_metres() -> None:
    as_they_are = read_cloud(CASES / "N_mm" / "mm.ply").points
    for unit, metres in (("m", 1.0), ("mm", 0.001), ("cm", 0.01)):
        points = read_cloud(CASES / "N_mm" / "mm.ply", InputOptions(unit=unit)).points  # type: ignore[arg-type]
        np.testing.assert_array_equal(points, as_they_are * metres)


def test_a_camera_that_looks_back_is_turned(tmp_path: Path) -> None:
    np.save(tmp_path / "c.npy", POINTS * [1.0, -1.0, -1.0])
    np.testing.assert_array_equal(read_cloud(tmp_path / "c.npy", InputOptions(camera="opengl")).points, POINTS)


def _npy_header(shape: tuple[int, ...], dtype: str = "<f8") -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"shape": shape, "fortran_order": False, "descr": dtype})
    return buffer.getvalue()


def _bomb(member: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        archive.writestr("points.npy", member)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("c.npy", _npy_header((10**12, 3)) + bytes(99)),
        ("c.npy", _npy_header((MAX_VALUES, 3)) + bytes(99)),
        ("c.npy", _npy_header((-5, -3)) + bytes(99)),
        ("c.npz", _bomb(_npy_header((9 * MAX_VALUES // 3, 3), "|u1") + bytes(9 * MAX_VALUES))),
        ("c.npz", _bomb(_npy_header((10**9, 3)))),
        ("c.npz", b"PK\x05\x06" + bytes(8) + struct.pack("<IIH", 50_000_000, 0, 0)),
        ("c.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\nproperty float x\n"
                  b"property float y\nproperty float z\nend_header\n" + bytes(99)),
        ("c.ply", b"ply\nformat ascii 1.0\nelement vertex 7000000\nproperty float x\nproperty float y\n"
                  b"property float z\nend_header\n1 2 3\n"),
        ("c.ply", b"ply\nformat ascii 1.0\n" + b"comment x\n" * 100_000),
        ("c.pcd", b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 99999999\nHEIGHT 99999999\nDATA binary\n"),
        ("c.pcd", b"FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nPOINTS 7000000\nDATA binary_compressed\n"
                  + struct.pack("<II", 60, 168_000_000) + b"\x00a" + b"\xe0\xff\x00" * 19),
        ("c.off", b"OFF\n999999999 0 0\n1 2 3\n"),
        ("c.xyz", b"\n" * 1_000_000),
        ("c.csv", b"x" * 5_000_000),
    ],
)  # fmt: skip
def test_what_a_file_declares_is_checked_before_it_is_believed(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ConfigError, match=name):
        read_cloud(tmp_path / name)


def test_references_of_lzf_may_reach_into_what_they_write() -> None:
    assert unpack_lzf(b"\x01ab" + bytes([(4 - 2) << 5, 1]), 6) == b"ababab"
    with pytest.raises(ValueError, match="damaged"):
        unpack_lzf(b"\x00a" + bytes([2 << 5, 9]), 5)


def test_folders_and_devices_are_no_clouds(tmp_path: Path) -> None:
    (tmp_path / "c.npy").mkdir()
    (tmp_path / "d.ply").symlink_to("/dev/zero")
    for name in ("c.npy", "d.ply"):
        with pytest.raises(ConfigError, match=r"is a folder|is no regular file"):
            read_cloud(tmp_path / name)
