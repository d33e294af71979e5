"""A folder and a URL are the same kind of storage; one that fails now and then loses nothing."""

from __future__ import annotations

import copy
import uuid
from pathlib import Path
from typing import Any

import pytest

from artsim.errors import ConfigError, DatasetError
from artsim.runs import storage as module
from artsim.runs.storage import FolderStorage, Storage, UrlStorage, is_url, storage_of
from tests.artsim.object_storage import object_storage
from tests.conftest import installed


@pytest.fixture
def failing() -> dict[str, int]:
    """Registers ``failing://``: memory whose every tenth write fails; how many writes there were, and must fail."""
    fsspec = installed("fsspec")
    from fsspec.implementations.memory import MemoryFileSystem

    counts = {"writes": 0, "failed": 0, "always": 0}

    class Failing(MemoryFileSystem):  # type: ignore[misc]
        protocol = "failing"

        def pipe_file(self, path: str, value: bytes, mode: str = "overwrite", **more: Any) -> None:
            counts["writes"] += 1
            if counts["always"] or counts["writes"] % 10 == 0:
                counts["failed"] += 1
                raise OSError("the storage is in trouble")
            super().pipe_file(path, value, mode=mode, **more)

    fsspec.register_implementation("failing", Failing, clobber=True)
    return counts


@pytest.fixture(params=["folder", "memory", "failing"])
def store(request: pytest.FixtureRequest, tmp_path: Path, failing: dict[str, int]) -> Storage:
    name = uuid.uuid4().hex
    return storage_of(
        {"folder": tmp_path / "data", "memory": f"memory://{name}", "failing": f"failing://{name}"}[request.param]
    )


def test_files_are_written_read_listed_copied_and_removed(store: Storage) -> None:
    assert store.sizes() == store.sizes("below") == {}
    for i in range(25):
        store.write(f"below/{i}.bin", bytes([i]) * (i + 1))
    assert store.sizes("below") == {f"{i}.bin": i + 1 for i in range(25)}
    assert store.sizes() == {}
    assert store.read("below/7.bin", 8) == b"\x07" * 8
    with pytest.raises(DatasetError, match="over the limit"):
        store.read("below/7.bin", 7)
    with pytest.raises(DatasetError):
        store.read("below/none", 10)
    file, size = store.open("below/9.bin")
    assert size == 10
    file.seek(8)
    assert file.read(5) == b"\x09\x09"
    store.write_new("below/7.bin", b"other")
    store.write_new("new", b"first")
    assert store.read("below/7.bin", 8) == b"\x07" * 8
    store.copy("new", "below/copied")
    assert store.read("below/copied", 5) == b"first"
    store.remove(["new", *(f"below/{i}.bin" for i in range(25)), "below/copied"])
    assert store.sizes() == store.sizes("below") == {}
    assert copy.deepcopy(store).place == store.place  # as a process gets it, without its open connection


def test_a_storage_that_always_fails_is_named_after_eight_attempts(
    failing: dict[str, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_FIRST_PAUSE", 0.001)
    failing["always"] = 1
    with pytest.raises(
        ConfigError, match=r"failing://x/a: cannot be written \(OSError: the storage is in trouble\)\. Fix"
    ):
        UrlStorage("failing://x").write("a", b"1")
    assert failing["writes"] == 8


def test_places_are_told_apart(tmp_path: Path) -> None:
    assert is_url("s3://bucket/a")
    assert not is_url(str(tmp_path))
    assert isinstance(storage_of(f"file://{tmp_path}"), FolderStorage)
    with pytest.raises(ConfigError, match="this wants a folder, not a URL"):
        storage_of(Path("s3://bucket/a"))
    with pytest.raises(ConfigError, match="fsspec cannot open it"):
        storage_of("nonsense://a")


@pytest.mark.parametrize("url", ["s3://", "s3:///", "s3:///first", "gs://", "simplecache::s3://", "memory://"])
def test_a_url_without_a_bucket_is_refused_at_once(url: str) -> None:
    with pytest.raises(ConfigError, match="it names no bucket"):
        storage_of(url)


def test_a_bucket_that_is_not_there_is_named_before_objects_are_prepared(monkeypatch: pytest.MonkeyPatch) -> None:
    with object_storage(monkeypatch) as (url, _):
        bucket = url.removeprefix("s3://").partition("/")[0]
        assert storage_of(url).sizes() == {}
        with pytest.raises(ConfigError, match=f"there is no bucket {bucket}-not"):
            storage_of(url.replace(bucket, f"{bucket}-not")).sizes()
