"""Datasets that grow, and splits that depend on what an object is named by."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import artsim
from artsim.datasets import generate as generating
from artsim.datasets.generate import GenerateResult
from artsim.datasets.layout import at_place
from artsim.datasets.new_plan import planned_objects
from artsim.datasets.plan import Plan
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.splits import SPLITS, showing_order
from artsim.datasets.verify import verify
from artsim.datasets.worker import CompiledSource
from artsim.errors import DatasetError
from artsim.loading.sources import family_sources
from tests.artsim.datasets.test_plan import plan
from tests.artsim.datasets.troublesome import digests

pytestmark = pytest.mark.usefixtures("quick_workers")

SOURCES = family_sources(["laptop", "drawer"], 4)


def make(out: Path, num_samples: int) -> GenerateResult:
    options = SampleOptions(num_points=32)
    return artsim.generate(
        SOURCES, out, num_samples, sample=options, shard_size=8, splits=(2, 1, 1), workers=1, progress=False
    )


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("large") / "out", 120).folder


def test_an_extended_dataset_has_the_bytes_of_a_large_one(large: Path, tmp_path: Path) -> None:
    out = make(tmp_path / "out", 50).folder
    before = {path.name: path.stat().st_mtime_ns for path in out.glob("*.tar")}
    grown = make(out, 120)
    assert digests(out) == digests(large)
    assert grown.grown_from == 50
    kept = [name for name, time in before.items() if (out / name).stat().st_mtime_ns == time]
    assert len(kept) == 5  # all but the last of each split, which were not full
    assert grown.made == 120 - 8 * len(kept)
    assert verify(out, progress=False) == []
    with pytest.raises(DatasetError, match=r"different: num_samples\)\. Fix: a dataset grows, but does not shrink"):
        make(out, 50)


@pytest.mark.parametrize("where", ["restore", "examine", "_extended"])
def test_an_extension_that_is_killed_goes_on(
    where: str, large: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = make(tmp_path / "out", 50).folder
    original = getattr(generating, where)

    def killed(*arguments: object, **more: object) -> None:
        if where == "_extended":
            original(*arguments, **more)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(generating, where, killed)
        with pytest.raises(KeyboardInterrupt):
            make(out, 120)
    assert make(out, 120).made < 120
    assert digests(out) == digests(large)


@given(st.integers(1, 60), st.integers(1, 2000), st.integers(0, 2000), st.integers(1, 64))
def test_what_a_sample_is_does_not_depend_on_how_many_there_are(objects: int, few: int, more: int, size: int) -> None:
    small, big = plan(objects, few, size), plan(objects, few + more, size)
    assert [small.object_of(i) for i in range(few)] == [big.object_of(i) for i in range(few)]
    grown = {shard.name: shard for shard in big.shards()}
    for shard in small.shards():
        same = shard == grown[shard.name] and small.indices(shard) == big.indices(grown[shard.name])
        assert (small.recipe(shard) == big.recipe(grown[shard.name])) == same


@given(st.integers(1, 60), st.integers(0, 100), st.integers(0, 59))
def test_a_split_that_grows_keeps_what_lies_in_finished_laps(objects: int, rounds: int, more: int) -> None:
    """Laps end after 8, 16, 32, 48, ... rounds, so that at least half of what is there is kept from 8 rounds on."""
    finished = max(end for end in [0, 8, *range(16, 116, 16)] if end <= rounds)
    kept = [at_place(place, objects, rounds) for place in range(finished * objects)]
    assert kept == [at_place(place, objects, rounds + more) for place in range(finished * objects)]
    assert kept == [at_place(place, objects) for place in range(finished * objects)]
    assert 2 * finished >= rounds or rounds < 8
    assert sorted(at_place(p, objects, rounds) for p in range(rounds * objects)) == [
        (r, n) for r in range(rounds) for n in range(objects)
    ]


@given(st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from(SPLITS)), min_size=1, max_size=200))
def test_the_first_objects_shown_are_of_every_category_and_split_by_its_share(objects: list[tuple[str, str]]) -> None:
    order = showing_order(objects)
    assert sorted(order) == list(range(len(objects)))
    for stratum in set(objects):
        share = objects.count(stratum) / len(objects)
        for count in (len(objects) // 3, len(objects) // 2):
            shown = sum(objects[n] == stratum for n in order[:count])
            assert abs(shown - share * count) <= 5  # one for each of the nine strata, at worst half of them


def test_splits_and_keys_do_not_depend_on_geometry() -> None:
    """Another processor may round a vertex otherwise: then geometry and digests differ, but no object changes sides."""
    asked = Plan(0, 10, 8, (0.5, 0.25, 0.25), SampleOptions(), ())
    sources = family_sources(["laptop"], 40)

    def compiled(processor: str) -> list[CompiledSource]:
        return [
            CompiledSource("", s.sha256, s.category, "same", f"{processor}{s.seed}", 2, False, (), f"{processor}")
            for s in sources
        ]

    one, two = (list(planned_objects(sources, compiled(name), asked)) for name in ("one", "two"))
    assert [o.sha256 for o in one] != [o.sha256 for o in two]
    assert [(o.key, o.split) for o in one] == [(o.key, o.split) for o in two]
    assert {o.split for o in one} == set(SPLITS)


def test_objects_of_one_content_share_a_split_whatever_they_are_called() -> None:
    asked = Plan(0, 10, 8, (0.4, 0.3, 0.3), SampleOptions(), ())
    source = CompiledSource("", "5" * 64, "laptop", "1", "6" * 64, 2, False, (), "")
    compiled = [replace(source, identity=f"{n // 2:064x}", object_id=str(n)) for n in range(40)]
    planned = list(planned_objects(family_sources(["laptop"], 40), compiled, asked))
    assert all(one.split == two.split for one, two in zip(planned[::2], planned[1::2], strict=True))
