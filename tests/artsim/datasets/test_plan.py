"""Plans: which object, split and random stream each sample has."""

from __future__ import annotations

import json
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import artsim
from artsim.datasets.plan import Plan, PlannedObject
from artsim.datasets.sample_options import SampleOptions, draw_sample
from artsim.datasets.splits import SPLITS, assign_splits
from artsim.model.draws import StateOptions, ViewOptions
from artsim.renderers import make_renderer
from tests.conftest import ASSETS


def plan(objects: int, samples: int, shard_size: int = 7, seed: int = 0) -> Plan:
    pairs = [(f"c{i % 3}", f"{i:064x}") for i in range(objects)]
    splits = assign_splits(pairs, (0.6, 0.2, 0.2), seed)
    planned = [
        PlannedObject(f"o{i}", category, str(i), sha256, 2, f"s{i}", "0", split)
        for i, ((category, sha256), split) in enumerate(zip(pairs, splits, strict=True))
    ]
    return Plan(seed, samples, shard_size, (0.6, 0.2, 0.2), SampleOptions(), tuple(planned))


@given(st.integers(1, 60), st.integers(1, 700), st.integers(1, 64))
def test_shards_hold_every_index_once_and_one_split_each(objects: int, samples: int, size: int) -> None:
    p = plan(objects, samples, size)
    indices = [i for shard in p.shards() for i in p.indices(shard)]
    assert sorted(indices) == list(range(samples))
    assert len(p.shards()) == p.num_shards
    for shard in p.shards():
        assert 0 < len(shard) <= size
        assert {p.object_of(i).split for i in p.indices(shard)} == {shard.split}
        assert {p.object_of(i).split for i in p.indices(shard)} == {shard.split}


@given(st.integers(1, 60), st.integers(1, 3000))
def test_objects_of_a_split_get_the_same_number_of_samples(objects: int, samples: int) -> None:
    p = plan(objects, samples)
    shown = Counter(p.object_of(index).key for index in range(samples))
    for split in SPLITS:
        counts = [shown[o.key] for o in p.objects_of[split]]
        if counts:
            assert max(counts) - min(counts) <= 1


@given(st.integers(1, 60), st.integers(0, 20), st.integers(0, 10_000))
def test_a_stream_shows_few_objects_at_a_time_and_all_of_them_in_the_end(objects: int, laps: int, at: int) -> None:
    p = plan(objects, 10)
    for split in SPLITS:
        count = len(p.objects_of[split])
        if count:
            shown = Counter(p.object_in_split(split, turn).key for turn in range(16 * count * laps))
            assert set(shown.values()) <= {16 * laps}
            assert len(shown) == (count if laps else 0)
            assert len({p.object_in_split(split, at + i).key for i in range(16)}) <= 32


def test_indices_beyond_the_plan_are_refused() -> None:
    for index in (-1, 50):
        with pytest.raises(IndexError):
            plan(9, 50).object_of(index)


@given(st.integers(1, 60), st.integers(1, 64), st.integers(1, 64))
def test_what_a_sample_shows_does_not_depend_on_the_shard_size(objects: int, one: int, other: int) -> None:
    a, b = plan(objects, 300, one), plan(objects, 300, other)
    assert [a.object_of(i) for i in range(300)] == [b.object_of(i) for i in range(300)]


def test_a_plan_survives_json() -> None:
    options = SampleOptions(
        num_points=100,
        scale=(0.5, 1.0),
        states=StateOptions(fraction_open=(0.1, 0.9), joint_range={"lid": (0.0, 1.0)}),
        views=ViewOptions(preset="sphere", azimuth=(-10.0, 10.0)),
        images=("depth",),
    )
    p = plan(9, 50)
    p = Plan(p.seed, p.num_samples, p.shard_size, p.fractions, options, p.objects)
    assert Plan.from_dict(json.loads(json.dumps(p.to_dict()))) == p


def test_views_that_never_see_the_object_end_in_an_error() -> None:
    options = SampleOptions(views=ViewOptions(custom="tests.artsim.datasets.test_plan:away"))
    with pytest.raises(artsim.ArtsimError, match="50 drawn views in a row do not see the object"):
        draw_sample(artsim.load(ASSETS / "scissors"), options, 0, 0, make_renderer("raycast"))


def away(rng: np.random.Generator, obj: artsim.ArticulatedObject, q: np.ndarray) -> artsim.Camera:
    return artsim.Camera.look_at([2, 0, 0], [3, 0, 0], 64, 48)
