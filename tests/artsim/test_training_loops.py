"""Streams and datasets in the loaders of torch: each sample once, whatever processes share the work."""

from __future__ import annotations

import itertools
import json
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import distributed, multiprocessing
from torch.utils.data import DataLoader, IterableDataset

import artsim
from artsim.datasets.family_stream import FamilyStream
from artsim.datasets.generate import generate
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError
from artsim.loading.sources import family_sources

SMALL = SampleOptions(num_points=32)


def indices(loader: DataLoader[object], batches: int) -> list[int]:
    return [int(i) for batch in itertools.islice(loader, batches) for i in batch["index"]]


@pytest.mark.slow
@pytest.mark.parametrize("context", ["fork", "spawn", "forkserver"])
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_workers_of_a_loader_share_a_stream_out(context: str) -> None:
    stream = FamilyStream(["laptop", "drawer"], SMALL, views_per_object=2).padded(max_parts=8)
    loader = DataLoader(stream, batch_size=4, num_workers=2, multiprocessing_context=context)
    assert sorted(indices(loader, 6)) == list(range(24))
    batch = next(iter(loader))
    assert batch["points"].shape == (4, 32, 3)
    assert batch["T_camera_part"].dtype == batch["joint_limits"].dtype == torch.float32
    np.testing.assert_array_equal(batch["points"][0], stream[int(batch["index"][0])]["points"])


def test_without_workers_a_loader_goes_through_a_stream_in_its_order() -> None:
    stream = FamilyStream(["laptop"], SMALL, views_per_object=3, start=1, step=2)
    assert isinstance(stream, IterableDataset)
    loader = DataLoader(stream, batch_size=2, collate_fn=lambda samples: {"index": [s.index for s in samples]})
    assert indices(loader, 3) == [3, 4, 5, 9, 10, 11]


def test_streams_say_what_to_do_where_a_length_is_asked_for() -> None:
    with pytest.raises(TypeError, match="import torch before"):
        len(FamilyStream(["laptop"]))
    with pytest.raises(ConfigError, match="max_parts"):
        FamilyStream(["robot_arm"], SMALL).padded(max_parts=1)[0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("dataset") / "made"
    generate(family_sources(["laptop"], 4), out, 12, sample=SMALL, workers=1, progress=False)
    return out


@pytest.mark.slow
def test_datasets_and_their_streams_can_be_written_to(folder: Path) -> None:
    """Loaders warn of arrays that cannot be written to: there are none."""
    dataset = artsim.open_dataset(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for source in (dataset.padded(), dataset.stream().padded()):
            batch = next(iter(DataLoader(source, batch_size=3)))
            assert batch["T_camera_part"].dtype == torch.float32
            assert batch["part"].dtype == torch.int64
            assert batch["category"] == ["laptop"] * 3
            assert batch["part_names"] == [("base",) * 3, ("lid",) * 3]
            assert all(array.flags.writeable for array in source[0].values() if isinstance(array, np.ndarray))
    assert dataset.padded(float32=False)[0]["T_camera_part"].dtype == np.float64


@pytest.mark.slow
@pytest.mark.parametrize("workers", [0, 1])
def test_a_loader_of_samples_as_they_are_says_what_to_do(folder: Path, workers: int) -> None:
    dataset = artsim.open_dataset(folder)
    for source in (dataset, dataset.stream(), dataset.shuffled()):
        with pytest.raises(ConfigError, match=r"dataset\.padded\(\)"):
            next(iter(DataLoader(source, batch_size=2, num_workers=workers)))
        batch = next(iter(DataLoader(source, batch_size=2, num_workers=workers, collate_fn=list)))
        assert [len(sample.points) for sample in batch] == [32, 32]


def _epochs(rank: int, ranks: int, folder: str, results: str) -> None:
    if ranks > 1:
        distributed.init_process_group("gloo", init_method=f"file://{results}/group", rank=rank, world_size=ranks)
    stream = artsim.open_dataset(folder).shuffled(seed=3)
    context = ("fork", "spawn")[rank]
    loader = DataLoader(stream.padded(), batch_size=5, num_workers=2, multiprocessing_context=context)
    seen = []
    for epoch in range(2):
        stream.set_epoch(epoch)
        seen.append(indices(loader, 1000))
        assert len(seen[-1]) == len(stream)
    Path(results, f"{rank}.json").write_text(json.dumps(seen))
    if ranks > 1:
        distributed.destroy_process_group()


@pytest.mark.slow
def test_two_nodes_of_two_workers_see_each_sample_once_in_an_epoch(tmp_path: Path) -> None:
    out = tmp_path / "made"
    generate(family_sources(["laptop"], 3), out, 83, sample=SMALL, workers=1, shard_size=7, progress=False)
    multiprocessing.spawn(_epochs, (2, str(out), str(tmp_path)), nprocs=2)
    nodes = [json.loads((tmp_path / f"{rank}.json").read_text()) for rank in range(2)]
    epochs = [[*one, *two] for one, two in zip(*nodes, strict=True)]
    assert all(sorted(seen) == list(range(83)) for seen in epochs)
    assert epochs[0] != epochs[1]
    assert {len(seen) for node in nodes for seen in node} == {41, 42}
    assert np.corrcoef(epochs[0], range(83))[0, 1] < 0.5  # shuffled


def _rank(rank: int, file: str, results: str) -> None:
    distributed.init_process_group("gloo", init_method=f"file://{file}", rank=rank, world_size=2)
    stream = FamilyStream(["laptop"], SMALL, views_per_object=1).padded(max_parts=2)
    loader = DataLoader(stream, batch_size=2, num_workers=2, multiprocessing_context="fork")
    Path(results, f"{rank}.json").write_text(json.dumps(indices(loader, 4)))
    distributed.destroy_process_group()


@pytest.mark.slow
def test_processes_of_a_group_and_their_workers_share_a_stream_out(tmp_path: Path) -> None:
    multiprocessing.spawn(_rank, (str(tmp_path / "group"), str(tmp_path)), nprocs=2)
    seen: Iterator[int] = itertools.chain.from_iterable(
        json.loads((tmp_path / f"{rank}.json").read_text()) for rank in range(2)
    )
    assert sorted(seen) == list(range(16))
