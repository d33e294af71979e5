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
from artsim.datasets.splits import SPLITS, assign_splits, unique_keys
from artsim.errors import ConfigError
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
        assert {p.split_of(i) for i in p.indices(shard)} == {shard.split}
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


SHARES = [(0.8, 0.1, 0.1), (1.0, 1.0, 1.0), (0.0, 0.5, 0.5), (0.3, 0.0, 0.7), (1.0, 0.0, 0.0)]


@given(
    st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 30).map(str)), min_size=1),
    st.sampled_from(SHARES),
    st.integers(0, 99),
)
def test_splits_are_by_content(objects: list[tuple[str, str]], shares: tuple[float, float, float], seed: int) -> None:
    """Whatever the category: a file found under two names must not be trained on and tested with."""
    splits = assign_splits(objects, shares, seed)
    pairs = {(content, split) for (_, content), split in zip(objects, splits, strict=True)}
    assert len(pairs) == len({content for _, content in objects})
    assert assign_splits(objects[::-1], shares, seed) == splits[::-1]


@given(st.integers(1, 50), st.sampled_from(SHARES), st.integers(0, 99))
def test_splits_have_their_shares_of_each_category(count: int, shares: tuple[float, float, float], seed: int) -> None:
    objects = [(category, f"{category}{i}") for category in "ab" for i in range(count)]
    splits = assign_splits(objects, shares, seed)
    for mine in (splits[:count], splits[count:]):
        for split, share in zip(SPLITS, shares, strict=True):
            assert abs(mine.count(split) - share / sum(shares) * count) <= 1
        assert ("train" in mine) == (shares[0] > 0)


def test_splits_do_not_move_when_other_categories_come() -> None:
    one = [("a", str(i)) for i in range(20)]
    assert assign_splits(one, (1, 1, 1), 3) == assign_splits([*one, ("b", "x")], (1, 1, 1), 3)[:20]


def test_shares_that_make_no_sense_are_refused() -> None:
    for shares in ((0.0, 0.0, 0.0), (-1.0, 1.0, 1.0), (np.nan, 1.0, 1.0), (np.inf, 1.0, 1.0)):
        with pytest.raises(ConfigError, match="are not shares"):
            assign_splits([("a", "b")], shares, 0)


def test_keys_are_unique_and_safe() -> None:
    named = [("box", "../../x"), ("box", "1"), ("box", "1"), ("Box", "1"), ("a b", "1"), ("a_b", "1"), ("c", "1" * 999)]
    keys = unique_keys([(category, name, f"{i:064x}") for i, (category, name) in enumerate(named)])
    assert len({key.lower() for key in keys}) == len(named)
    assert max(map(len, keys)) < 200
    assert not any("/" in key or "." in key for key in keys)


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


def test_a_sample_depends_on_seed_and_index_only() -> None:
    obj, renderer = artsim.load(ASSETS / "scissors"), make_renderer("raycast")
    first = draw_sample(obj, SampleOptions(), 3, 17, renderer)
    for index in range(5):
        draw_sample(obj, SampleOptions(), 3, index, renderer)
    again = draw_sample(obj, SampleOptions(), 3, 17, make_renderer("raycast"))
    assert np.array_equal(first.points, again.points)
    assert not np.array_equal(first.points, draw_sample(obj, SampleOptions(), 4, 17, renderer).points)
    assert not np.array_equal(first.points, draw_sample(obj, SampleOptions(), 3, 18, renderer).points)


def test_views_that_never_see_the_object_end_in_an_error() -> None:
    options = SampleOptions(views=ViewOptions(custom="tests.artsim.datasets.test_plan:away"))
    with pytest.raises(artsim.ArtsimError, match="50 drawn views in a row do not see the object"):
        draw_sample(artsim.load(ASSETS / "scissors"), options, 0, 0, make_renderer("raycast"))


def away(rng: np.random.Generator, obj: artsim.ArticulatedObject, q: np.ndarray) -> artsim.Camera:
    return artsim.Camera.look_at([2, 0, 0], [3, 0, 0], 64, 48)
