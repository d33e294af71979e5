"""Datasets as their readers see them."""

from __future__ import annotations

import contextlib
import itertools
import shutil
import subprocess
import sys
import warnings
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import torch
import webdataset

import artsim
from artsim import StateOptions, observe, sample_state
from artsim.datasets.object_cache import ObjectCache
from artsim.datasets.plan import SampleOptions
from artsim.datasets.shards import sample_from_members, sample_members
from artsim.errors import ConfigError, DatasetError
from artsim.loading.sources import find_sources
from artsim.model.joints import JOINT_TYPES
from artsim.observing.padding import pad_sample
from artsim.observing.sample import Sample
from tests.conftest import ASSETS, DEMO, in_another_process


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """150 samples of the demo objects and a globe that turns freely."""
    out = tmp_path_factory.mktemp("data") / "out"
    paths = [*DEMO, ASSETS / "quirks" / "primitives", ASSETS / "quirks" / "mimic_pair"]
    options = SampleOptions(num_points=256)
    artsim.generate(find_sources(paths), out, 150, sample=options, shard_size=40, splits=(2, 0, 1), progress=False)
    return out


def assert_equal(one: Sample, two: Sample) -> None:
    for field in fields(Sample):
        a, b = getattr(one, field.name), getattr(two, field.name)
        if isinstance(a, np.ndarray):
            assert a.dtype == b.dtype, field.name
            assert np.array_equal(a, b), field.name
        else:
            assert a == b, field.name


def test_a_sample_survives_its_members() -> None:
    turns_freely = ASSETS / "quirks" / "primitives"
    assert np.isinf(artsim.load(turns_freely).tree.limits[1:]).any()
    for path, images in ((turns_freely, ()), (ASSETS / "cabinet", ("depth", "part_mask", "rgb"))):
        obj = artsim.load(path)
        q = sample_state(obj, StateOptions(), np.random.default_rng(0))
        camera = artsim.Camera.look_at([-2, 0.3, 1], [0, 0, 0], 160, 120)
        renderer = "pybullet" if images else "raycast"
        sample = observe(obj, q, camera, num_points=99, images=images, renderer=renderer, seed=3, index=7)
        assert_equal(sample, sample_from_members(sample_members(sample), "here"))


@pytest.mark.slow
def test_length_indexing_and_splits(folder: Path) -> None:
    everything = artsim.open_dataset(folder)
    assert len(everything) == 150
    assert sorted(s.index for s in everything) == list(range(150))
    assert everything[-1].index == everything[149].index
    for wrong in (150, -151):
        with pytest.raises(IndexError):
            everything[wrong]
    parts = {split: artsim.open_dataset(folder, split) for split in ("train", "val", "test")}
    assert sum(map(len, parts.values())) == 150
    shown = {split: {s.object_sha256 for s in part} for split, part in parts.items()}
    for one, two in itertools.combinations(shown.values(), 2):
        assert not one & two
    with pytest.raises(ConfigError, match="no split 'holdout'"):
        artsim.open_dataset(folder, "holdout")


@pytest.mark.slow
def test_samples_know_their_object_without_the_source_files(folder: Path) -> None:
    dataset = artsim.open_dataset(folder)
    for i in (0, 40, 149):
        obj = dataset.object_of(dataset[i])
        assert obj.sha256 == dataset[i].object_sha256
        assert obj.diagonal == pytest.approx(dataset[i].diagonal)


def test_a_torch_loader_stacks_padded_samples(folder: Path) -> None:
    padded = artsim.open_dataset(folder).padded()
    loader = torch.utils.data.DataLoader(padded, batch_size=50, num_workers=2, shuffle=True)  # type: ignore[arg-type]
    batches = list(loader)
    assert sorted(torch.cat([b["index"] for b in batches]).tolist()) == list(range(150))
    for batch in batches:
        parts = batch["part_valid"].sum(1)
        assert batch["points"].shape == (50, 256, 3)
        assert batch["T_camera_part"].shape == (50, padded.max_parts, 4, 4)
        assert (batch["part"].max(1).values < parts).all()
        assert {JOINT_TYPES[int(t)] for t in batch["joint_type"][:, 0]} == {"free"}


def test_too_few_rows_are_refused(folder: Path) -> None:
    with pytest.raises(ConfigError, match="parts do not fit 1 rows"):
        pad_sample(artsim.open_dataset(folder)[0], 1)


def test_a_dataset_serves_other_processes(folder: Path) -> None:
    dataset = artsim.open_dataset(folder, "train")
    _ = dataset[0]
    assert_equal(in_another_process(dataset, 3), dataset[3])


def test_webdataset_reads_the_shards(folder: Path) -> None:
    shards = sorted(map(str, folder.glob("*.tar")))
    read = list(webdataset.WebDataset(shards, shardshuffle=False).decode())
    ours = {f"{s.index:09d}": s for s in artsim.open_dataset(folder)}
    assert sorted(r["__key__"] for r in read) == sorted(ours)
    for record in read[:20]:
        sample = ours[record["__key__"]]
        assert np.array_equal(record["points.npy"], sample.points)
        assert record["json"]["category"] == sample.category


def test_the_stream_is_endless_repeatable_and_new(folder: Path) -> None:
    dataset = artsim.open_dataset(folder)
    first = list(itertools.islice(dataset.stream(), 30))
    again = list(itertools.islice(dataset.stream(), 30))
    for one, two in zip(first, again, strict=True):
        assert_equal(one, two)
    assert_equal(dataset.stream()[10_000], dataset.stream()[10_000])
    stored = {s.points.tobytes() for s in dataset}
    assert not stored & {s.points.tobytes() for s in first}
    train = {o.sha256 for o in dataset.plan.objects_of["train"]}
    assert {s.object_sha256 for s in first} == train
    other = next(iter(dataset.stream(seed=99)))
    assert not np.array_equal(other.points, first[0].points)
    with pytest.raises(ConfigError, match="has no objects"):
        dataset.stream("val")


@pytest.mark.slow
def test_training_processes_share_a_stream(folder: Path) -> None:
    dataset = artsim.open_dataset(folder)
    stream = dataset.stream("test", start=1, step=3)
    assert [s.index for s in itertools.islice(stream, 4)] == [1, 4, 7, 10]
    assert {s.object_sha256 for s in itertools.islice(stream, 40)} == {
        o.sha256 for o in dataset.plan.objects_of["test"]
    }
    assert_equal(in_another_process(stream, 4), stream[4])
    with pytest.raises(IndexError):
        stream[-1]
    with pytest.raises(ConfigError, match="step 0"):
        dataset.stream(step=0)


def test_neighbouring_seeds_do_not_bring_back_a_stream(folder: Path) -> None:
    """A training stream must not show what a dataset of the next seed, made for testing, holds."""
    dataset = artsim.open_dataset(folder)
    drawn = {s.points.tobytes() for s in itertools.islice(dataset.stream(), 20)}
    neighbours = {s.points.tobytes() for seed in range(4) for s in itertools.islice(dataset.stream(seed=seed), 20)}
    assert len(drawn | neighbours) == 100


def test_the_object_cache_forgets_what_was_not_used_lately(folder: Path) -> None:
    files = [o.file for o in artsim.open_dataset(folder).plan.objects]
    cache = ObjectCache(folder, max_bytes=1)
    first = cache[files[0]]
    assert cache[files[0]] is first
    _ = cache[files[1]]
    assert cache[files[0]] is not first
    assert len(cache._objects) == 1


def test_any_damage_to_a_sample_is_a_clear_error(folder: Path) -> None:
    members = sample_members(artsim.open_dataset(folder)[0])
    rng = np.random.default_rng(0)
    for name in members:
        with pytest.raises(DatasetError, match="damaged sample"):
            sample_from_members({k: v for k, v in members.items() if k != name}, "here")
        for _ in range(100):
            damaged = bytearray(members[name])
            damaged[rng.integers(min(len(damaged), 200))] = rng.integers(256)
            with contextlib.suppress(DatasetError), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                sample_from_members({**members, name: bytes(damaged)}, "here")


def test_a_shard_cut_anywhere_is_a_clear_error(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder, tmp_path / "out")
    path = tmp_path / "out" / "train-000000.tar"
    whole = path.read_bytes()
    for size in (0, 100, 512, 700, 10_000, len(whole) // 2, len(whole) - 11_000):
        path.write_bytes(whole[:size])
        with pytest.raises(DatasetError, match=r"train-000000\.tar"):
            artsim.open_dataset(tmp_path / "out")[39]


def test_what_is_not_a_dataset_is_refused(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no dataset here"):
        artsim.open_dataset(tmp_path)
    (tmp_path / "plan.json").write_text("{}")
    with pytest.raises(DatasetError, match="not complete"):
        artsim.open_dataset(tmp_path)
    for content, message in (
        ("{", "damaged"),
        ('{"format": 99}', "format 99 is not"),
        ("[]", "damaged"),
        ('{"format": 2}', "damaged"),
    ):
        (tmp_path / "dataset.json").write_text(content)
        with pytest.raises(DatasetError, match=message):
            artsim.open_dataset(tmp_path)


def test_importing_artsim_is_light() -> None:
    heavy = ("torch", "sapien", "pybullet", "ray", "matplotlib", "rerun", "trimesh.viewer")
    code = f"import sys, artsim; print([m for m in {heavy} if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "[]"
