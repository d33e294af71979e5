"""An index of a tar file says where Python's own tarfile finds each member."""

from __future__ import annotations

import io
import tarfile
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.datasets.dataset import Dataset
from artsim.datasets.shards import write_tar
from artsim.datasets.tar_index import TarIndex, read_index
from artsim.errors import DatasetError


def index_of(path: Path) -> TarIndex:
    with path.open("rb") as file:
        return read_index(file, path.stat().st_size)


def by_tarfile(path: Path) -> dict[str, bytes]:
    """Content by name; of two members with one name, that of the later."""
    with tarfile.open(path) as tar:
        return {info.name: tar.extractfile(info).read() for info in tar}  # type: ignore[union-attr]


def by_index(path: Path) -> dict[str, bytes]:
    index, data = index_of(path), path.read_bytes()
    return {
        f"{key}.{suffix}": data[offset : offset + size]
        for key in index.in_file_order()
        for suffix, offset, size in index.members(key)
    }


def add(tar: tarfile.TarFile, name: str, content: bytes) -> None:
    info = tarfile.TarInfo(name)
    info.size = len(content)
    tar.addfile(info, io.BytesIO(content))


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def test_members_are_those_that_tarfile_finds(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    entries = [
        (f"{i:09d}", {"json": rng.bytes(int(rng.integers(0, 3000))), "points.npy": rng.bytes(512)}) for i in range(50)
    ]
    write_tar(tmp_path / "a.tar", entries)
    assert by_index(tmp_path / "a.tar") == by_tarfile(tmp_path / "a.tar")
    assert index_of(tmp_path / "a.tar").in_file_order() == [key for key, _ in entries]
    assert index_of(tmp_path / "a.tar").members("000000050") == []


@pytest.mark.parametrize("kind", [tarfile.PAX_FORMAT, tarfile.GNU_FORMAT, tarfile.USTAR_FORMAT])
def test_shards_that_other_programs_packed_are_read_too(tmp_path: Path, kind: int) -> None:
    """Long names, names of other scripts, keys in no order, members of a sample apart, and one that comes twice."""
    long_key = "d" * 60 + "/" + "k" * 60 if kind == tarfile.USTAR_FORMAT else "k" * 150
    with tarfile.open(tmp_path / "a.tar", "w", format=kind) as tar:
        for name in ("b.json", "ä.json", f"{long_key}.json", "a.json", "b.points.npy", "a.json"):
            add(tar, name, f"{name} {tar.offset}".encode())
    assert by_index(tmp_path / "a.tar") == by_tarfile(tmp_path / "a.tar")
    assert index_of(tmp_path / "a.tar").in_file_order() == ["b", "ä", long_key, "a"]


def test_an_empty_shard_holds_nothing(tmp_path: Path) -> None:
    write_tar(tmp_path / "a.tar", [])
    assert len(index_of(tmp_path / "a.tar")) == 0
    assert index_of(tmp_path / "a.tar").members("a") == []


def test_a_flipped_bit_of_a_header_is_noticed(tmp_path: Path) -> None:
    write_tar(tmp_path / "a.tar", [("000000000", {"json": b"{}"})])
    data = bytearray((tmp_path / "a.tar").read_bytes())
    data[3] ^= 1
    (tmp_path / "a.tar").write_bytes(data)
    with pytest.raises(tarfile.TarError):
        index_of(tmp_path / "a.tar")


def test_links_and_members_beyond_the_end_are_refused(tmp_path: Path) -> None:
    with tarfile.open(tmp_path / "link.tar", "w") as tar:
        link = tarfile.TarInfo("a.json")
        link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
        tar.addfile(link)
    with pytest.raises(ValueError, match=r"unexpected member a\.json"):
        index_of(tmp_path / "link.tar")
    write_tar(tmp_path / "cut.tar", [("a", {"json": bytes(5000)})])
    (tmp_path / "cut.tar").write_bytes((tmp_path / "cut.tar").read_bytes()[:2048])
    with pytest.raises(ValueError, match=r"unexpected member a\.json"):
        index_of(tmp_path / "cut.tar")


@pytest.mark.slow
def test_shuffled_reads_index_each_shard_once_and_keep_few_files_open(tmp_path: Path) -> None:
    """Once read, a shard is opened again but not indexed: even headers that are no longer there do not matter."""
    artsim.generate(
        artsim.family_sources(["laptop"], 1), tmp_path, num_samples=160, shard_size=2, workers=1, progress=False,
        sample=artsim.SampleOptions(num_points=8),
    )  # fmt: skip
    dataset = Dataset(tmp_path)
    assert len(dataset.shards) > 70
    before = open_files()
    in_order = [dataset[i].index for i in range(len(dataset))]
    assert open_files() - before <= 64
    for shard in tmp_path.glob("*.tar"):
        data = bytearray(shard.read_bytes())
        data[:512] = bytes(512)
        shard.write_bytes(data)
    shuffled = np.random.default_rng(0).permutation(len(dataset)).tolist()
    assert [dataset[i].index for i in shuffled] == [in_order[i] for i in shuffled]
    with pytest.raises(DatasetError):
        Dataset(tmp_path)[0]
