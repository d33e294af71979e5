"""Datasets that grow, and splits that depend on what an object is named by."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import given
from hypothesis import strategies as st

import artsim
from artsim.datasets import generate as generating
from artsim.datasets import restore
from artsim.datasets.generate import GenerateResult
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.verify import verify
from artsim.errors import DatasetError
from artsim.loading.sources import family_sources
from tests.artsim.datasets.test_plan import plan
from tests.artsim.datasets.troublesome import digests

pytestmark = pytest.mark.slow

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


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "where"), [(generating, "Restoration"), (generating, "examine"), (restore, "write_if_other")]
)
def test_an_extension_that_is_killed_goes_on(
    module: ModuleType, where: str, large: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = make(tmp_path / "out", 50).folder

    def killed(*arguments: object, **more: object) -> None:
        assert (out / "dataset.json").exists() == (module is generating)
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(module, where, killed)
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
