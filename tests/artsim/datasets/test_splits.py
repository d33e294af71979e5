"""Splits depend on what an object is, and on nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artsim.datasets.plan import Plan
from artsim.datasets.preparing import planned_objects
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.splits import SPLITS, assign_splits, unique_keys
from artsim.datasets.worker import CompiledSource
from artsim.errors import ConfigError
from artsim.loading.sources import family_sources

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


@pytest.mark.slow
def test_splits_and_keys_do_not_depend_on_geometry() -> None:
    """Another processor may round a vertex otherwise: then geometry and digests differ, but no object changes sides."""
    asked = Plan(0, 10, 8, (0.5, 0.25, 0.25), SampleOptions(), ())
    sources = family_sources(["laptop"], 40)

    def compiled(processor: str) -> list[CompiledSource]:
        return [
            CompiledSource(s.sha256, s.category, "same", f"{processor}{s.seed}", 2, False, (), f"{processor}")
            for s in sources
        ]

    one, two = (list(planned_objects(sources, compiled(name), asked)) for name in ("one", "two"))
    assert [o.sha256 for o in one] != [o.sha256 for o in two]
    assert [(o.key, o.split) for o in one] == [(o.key, o.split) for o in two]
    assert {o.split for o in one} == set(SPLITS)


@pytest.mark.slow
def test_objects_of_one_content_share_a_split_whatever_they_are_called() -> None:
    asked = Plan(0, 10, 8, (0.4, 0.3, 0.3), SampleOptions(), ())
    source = CompiledSource("5" * 64, "laptop", "1", "6" * 64, 2, False, (), "")
    compiled = [replace(source, identity=f"{n // 2:064x}", object_id=str(n)) for n in range(40)]
    planned = list(planned_objects(family_sources(["laptop"], 40), compiled, asked))
    assert all(one.split == two.split for one, two in zip(planned[::2], planned[1::2], strict=True))
