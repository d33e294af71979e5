"""What tests of formats share: one small dataset with every image."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim import Dataset, ViewOptions
from artsim.datasets.plan import SampleOptions
from artsim.loading.sources import family_sources, find_sources
from tests.artsim.datasets.conftest import quick_workers  # noqa: F401
from tests.conftest import ASSETS, installed


@pytest.fixture(scope="session")
def imaged(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """24 samples in colour: laptops, furniture, a bottle, and an object whose joint turns without end."""
    installed("pybullet")
    families = [*family_sources(("laptop", "drawer"), 2), *family_sources(("bottle",), 1, 1)]  # its cap is a screw
    sources = [*families, *find_sources([ASSETS / "quirks" / "primitives"])]
    options = SampleOptions(
        num_points=64,
        views=ViewOptions(width=96, height=72),
        renderer="pybullet",
        images=("depth", "part_mask", "rgb"),
        noise="gaussian3mm",
    )
    out = tmp_path_factory.mktemp("imaged") / "out"
    artsim.generate(sources, out, 24, sample=options, shard_size=8, splits=(3, 0, 2), workers=1, progress=False)
    dataset = artsim.open_dataset(out)
    assert any(np.isinf(sample.joint_limits).any() for sample in dataset)
    assert {shard.split for shard in dataset.shards} == {"train", "test"}
    return dataset


@pytest.fixture(scope="session")
def exact(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """6 samples of which rays know depth and masks, without noise and without colour."""
    options = SampleOptions(num_points=64, views=ViewOptions(width=96, height=72), images=("depth", "part_mask"))
    out, sources = tmp_path_factory.mktemp("exact") / "out", family_sources(("laptop", "drawer"), 1)
    artsim.generate(sources, out, 6, sample=options, splits=(1, 0, 0), workers=1, progress=False)
    return artsim.open_dataset(out)


def contents(folder: Path) -> dict[str, bytes]:
    """Every file of a folder by its path, but for the lock."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}
