"""Datasets at a URL: what a local run writes into a folder, byte for byte, though every tenth write fails."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artsim
from artsim.datasets.merge import merge
from artsim.datasets.preparing import Share
from artsim.datasets.sample_options import SampleOptions
from artsim.errors import ConfigError, DatasetError
from artsim.loading.sources import Source, family_sources
from artsim.runs.storage import UrlStorage
from tests.artsim.datasets.troublesome import digests
from tests.artsim.object_storage import Faulty, object_storage
from tests.conftest import in_another_process

pytestmark = pytest.mark.slow

OPTIONS = SampleOptions(num_points=64)
SOURCES: list[Source] = list(family_sources(["laptop", "drawer"], 3))


@pytest.fixture
def bucket(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[str, Faulty]]:
    with object_storage(monkeypatch) as made:
        yield made


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset that one process wrote into a folder."""
    folder = tmp_path_factory.mktemp("local") / "first"
    make(folder)
    return folder


def make(out: Any, samples: int = 120, **more: Any) -> artsim.datasets.generate.GenerateResult:
    options = {"sample": OPTIONS, "shard_size": 10, "progress": False, "splits": (2, 1, 0), "workers": 1, **more}
    return artsim.generate(SOURCES, out, samples, **options)


def contents(url: str) -> dict[str, str]:
    """Digest of every file at a URL."""
    storage = UrlStorage(url)
    names = [
        f"{below}{name}" for below in ("", "objects/", "parts/", "parts/objects/") for name in storage.sizes(below)
    ]
    return {name: hashlib.sha256(storage.read(name, 1 << 30)).hexdigest() for name in names}


def test_a_url_holds_what_a_folder_does(bucket: tuple[str, Faulty], local: Path) -> None:
    url, server = bucket
    assert make(url).made == 120
    assert contents(url) == digests(local)
    assert server.failed > 2
    here, there = artsim.open_dataset(local, "train"), artsim.open_dataset(url, "train")
    assert str(there).partition(":")[2].splitlines()[1:] == str(here).partition(":")[2].splitlines()[1:]
    for i in (0, 33, -1):
        np.testing.assert_array_equal(here[i].points, there[i].points)
    assert there.object_of(there[0]).sha256 == there[0].object_sha256
    assert sorted(sample.index for sample in there.shuffled()) == sorted(sample.index for sample in here)
    assert [s.index for s in there.shuffled(1)] == [s.index for s in here.shuffled(1)]
    np.testing.assert_array_equal(in_another_process(there, 7).points, here[7].points)
    assert make(url).made == 0
    UrlStorage(url).remove(["train-000001.tar"])
    assert make(url).made == 10
    assert contents(url) == digests(local)
    with pytest.raises(DatasetError, match=r"different: num_samples.*several machines does not grow"):
        make(url, 200)


def test_parts_make_what_one_process_does(bucket: tuple[str, Faulty], local: Path) -> None:
    url, _ = bucket
    assert make(url, share=Share(1, 2)).made == 60
    with pytest.raises(DatasetError, match=r"6 of 12 shards are not there, such as .*Fix: run again: --share 0/2$"):
        merge(url, progress=False)
    with pytest.raises(DatasetError, match="the dataset is not complete"):
        artsim.open_dataset(url)
    assert make(url, share=Share(0, 2)).made == 60
    assert make(url, share=Share(0, 2)).made == 0
    damaged = UrlStorage(url).read("train-000000.tar", 1 << 30)
    UrlStorage(url).write("train-000000.tar", damaged[::-1])
    with pytest.raises(DatasetError, match=r"train-000000\.tar: has another checksum than when it was written"):
        merge(url, check=True, progress=False)
    UrlStorage(url).write("train-000000.tar", damaged)
    assert not merge(url, check=True, progress=False).already
    assert contents(url) == digests(local)
    assert merge(url, progress=False).already


def test_a_storage_that_cannot_be_written_to_is_named(bucket: tuple[str, Faulty]) -> None:
    with pytest.raises(ConfigError, match=r"s3://nowhere/first: there is no bucket nowhere\. Fix: make it"):
        make("s3://nowhere/first")
    with pytest.raises(ConfigError, match="fsspec cannot open it"):
        make("nonsense://first")
