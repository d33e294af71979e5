"""Frozen datasets: the same bytes from a manifest, whoever makes them; and what differs is named."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path

import pytest

import artsim
from artsim.datasets import frozen
from artsim.datasets.frozen import Manifest, freeze, frozen_name, make_frozen, read_manifest
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError, DatasetError
from artsim.model.object_file import object_bytes
from tests.conftest import ROOT

pytestmark = pytest.mark.usefixtures("quick_workers")
SMALL = Manifest(
    "Small", "Two laptops, and a globe to test with.", "Apache-2.0", "", 3, 2, SampleOptions(num_points=32),
    {"train": {"laptop": {"5": "", "9": ""}}, "test": {"globe": {"1": ""}}}, {},
)  # fmt: skip


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Manifest:
    out = tmp_path_factory.mktemp("frozen")
    make_frozen(SMALL, out, workers=1, progress=False)
    return freeze(SMALL, out)


@pytest.mark.slow
def test_a_manifest_makes_the_same_again_by_other_workers_split_by_split(small: Manifest, tmp_path: Path) -> None:
    path = tmp_path / "small.json"
    path.write_text(json.dumps(asdict(small)))
    read = read_manifest(path)
    assert read == small
    assert make_frozen(read, tmp_path / "out", ["test"], workers=2, progress=False).made == 2
    again = make_frozen(read, tmp_path / "out", workers=2, progress=False)
    assert (again.total, again.made) == (6, 4)  # the other split was there
    assert freeze(read, tmp_path / "out") == small
    dataset = artsim.open_dataset(tmp_path / "out/train", "train")
    assert {sample.object_id for sample in dataset} == {"5", "9"}


@pytest.mark.slow
def test_what_differs_from_the_manifest_is_named(small: Manifest, tmp_path: Path) -> None:
    objects = {**small.objects, "test": {"globe": {"1": "0" * 12}}}
    with pytest.raises(DatasetError, match="1 files differ from Small: globe:1"):
        make_frozen(replace(small, objects=objects), tmp_path, ["test"], workers=1, progress=False)
    shards = dict.fromkeys(small.shards, "0" * 64)
    with pytest.raises(DatasetError, match=r"test/test-000000\.tar"):
        make_frozen(replace(small, shards=shards), tmp_path, ["test"], workers=1, progress=False)
    with pytest.raises(ConfigError, match="has no split 'val'"):
        make_frozen(small, tmp_path, ["val"])


@pytest.mark.slow
def test_a_dataset_is_known_for_a_frozen_one_of_the_package(
    small: Manifest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make_frozen(small, tmp_path, ["test"], workers=1, progress=False)
    dataset = artsim.open_dataset(tmp_path / "test")
    assert frozen_name(dataset) == ""
    (tmp_path / "small.json").write_text(json.dumps(asdict(small)))
    monkeypatch.setattr(frozen, "__file__", str(tmp_path / "frozen.py"))
    assert frozen_name(dataset) == "Small, test"


@pytest.mark.parametrize(
    ("field", "value"),
    [("objects", {}), ("objects", {"all": {}}), ("objects", {"test": {"globe": {"-1": "0" * 12}}}), ("views", 0),
     ("objects", {"test": {"nothing": {"1": "0" * 12}}}), ("seed", "one"), ("shards", {"test": "short"})],
)  # fmt: skip
def test_damaged_manifests_are_refused(small: Manifest, field: str, value: object, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps({**asdict(small), field: value}))
    with pytest.raises(ConfigError, match="not a manifest"):
        read_manifest(tmp_path / "a.json")
    with pytest.raises(ConfigError, match="no frozen dataset"):
        read_manifest(tmp_path / "b.json")


def test_artsim_10k_has_10200_objects_of_all_categories_and_their_digests_hold() -> None:
    manifest = read_manifest("artsim-10k")
    assert (ROOT / "artsim/datasets/artsim-10k.json").stat().st_size < 1_000_000
    sources = {split: manifest.sources(split) for split in manifest.objects}
    every = [source for own in sources.values() for source in own]
    assert len({source.name for source in every}) == len(every) == 10_200
    assert set(Counter(source.category for source in every).values()) == {200}
    assert all(set(Counter(s.category for s in own).values()) == {n} for own, n in zip(
        sources.values(), (160, 20, 20), strict=True))  # fmt: skip
    for source in every[::1500]:
        split = next(name for name, own in sources.items() if source in own)
        digest = hashlib.sha256(object_bytes(source.load())).hexdigest()[:12]
        assert manifest.objects[split][source.category][str(source.seed)] == digest
    assert len(manifest.shards) == 40
