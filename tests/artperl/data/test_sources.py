"""Sources: samples by number, of a dataset or of fresh objects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from artperl.core.part_order import visible_order
from artperl.data.batches import batches
from artperl.data.categories import ARTIMAGE, objects_of
from artperl.data.sources import DataOptions, Recorded, Samples
from artsim import generate
from artsim.datasets.dataset import open_dataset
from artsim.datasets.plan import SampleOptions
from artsim.errors import DatasetError
from artsim.loading.sources import family_sources


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset of laptops and eyeglasses."""
    sources = family_sources(["laptop", "eyeglasses"], 3)
    options = SampleOptions(num_points=96)
    return generate(sources, tmp_path_factory.mktemp("recorded"), num_samples=24, sample=options).folder


@pytest.mark.slow
def test_a_dataset_is_learnt_from_sample_by_sample(recorded: Path) -> None:
    samples = Recorded(recorded, ["laptop"], 3, 2, 96)
    train = [sample for sample in open_dataset(recorded, "train") if sample.category == "laptop"]
    first, second = ([samples[i].index for i in range(n, n + len(train))] for n in (0, len(train)))
    assert sorted(first) == sorted(second) == [sample.index for sample in train]
    assert first != second
    assert len(samples.object(0)) == 2
    rows, _ = next(batches(DataOptions(["laptop"], dataset=recorded), 2, 96, 4, workers=0, seed=3))
    assert rows.points.shape == (4, 96, 3)
    with pytest.raises(DatasetError, match="no scissors"):
        Recorded(recorded, ["scissors"], 0, 2, 96)
    with pytest.raises(DatasetError, match="fewer than 1024"):
        Recorded(recorded, ["laptop"], 0, 2, 1024)


@pytest.mark.slow
def test_an_estimator_for_any_parts_reads_a_dataset_in_the_order_that_it_knows(tmp_path: Path) -> None:
    sources = family_sources(["storage_furniture"], 3)
    folder = generate(sources, tmp_path / "data", num_samples=12, sample=SampleOptions(num_points=64)).folder
    samples = Recorded(folder, ["storage_furniture"], 0, 10, 64, "any")
    for i in range(4):
        sample, obj = samples[i], samples.object(i)
        np.testing.assert_allclose(sample.box_center, obj.box_center, atol=1e-6)
        order = visible_order(sample.joint_parent, sample.box_center, sample.box_size)
        assert order == list(range(len(obj)))


def test_objects_with_too_many_parts_give_way_to_others() -> None:
    samples = Samples(["drawer"], SampleOptions(num_points=16), 0, 1, 3, "any")
    sizes = [len(samples[i].joint_type) for i in range(6)]
    assert max(sizes) <= 3
    assert samples[2].object_id == samples[2].object_id


def test_a_sensor_sees_the_same_objects_which_are_made_once() -> None:
    clean = Samples(["eyeglasses"], SampleOptions(num_points=64), 0, 2, 3)
    noisy = clean.seen_by("d435")
    alone = Samples(["eyeglasses"], SampleOptions(num_points=64, noise="d435"), 0, 2, 3)
    for i in range(4):
        assert noisy.object(i) is clean.object(i)
        np.testing.assert_array_equal(noisy[i].points, alone[i].points)
        np.testing.assert_array_equal(noisy[i].T_camera_part, clean[i].T_camera_part)
        assert not np.array_equal(noisy[i].points, clean[i].points)


@pytest.mark.slow
@pytest.mark.parametrize("category", sorted(ARTIMAGE))
def test_objects_have_the_parts_of_artimage(category: str) -> None:
    samples = Samples([category], SampleOptions(num_points=16), 0, 2, 4)
    assert {samples[i].joint_type[1:] for i in range(8)} == {ARTIMAGE[category]}
    assert {obj.tree.types[1:] for obj in objects_of([category], 4, 1_000_000)} == {ARTIMAGE[category]}
