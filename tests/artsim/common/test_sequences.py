"""One name where a list is due is a list of one, never its letters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.common.sequences import listed
from artsim.datasets.family_stream import FamilyStream
from artsim.errors import ArtsimError, ConfigError
from artsim.model.draws import ViewOptions
from artsim.scenes.random_scene import SceneOptions
from tests.conftest import ASSETS


def test_a_string_is_one_name() -> None:
    assert listed("laptop") == ["laptop"]
    assert listed(Path("/a")) == [Path("/a")]
    assert listed(("a", "b")) == ["a", "b"]
    assert [s.category for s in artsim.family_sources("laptop", 2)] == ["laptop", "laptop"]
    assert FamilyStream("laptop").categories == ["laptop"]
    assert SceneOptions(categories="laptop").categories == ("laptop",)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="no category lptop"):
        artsim.family_sources("lptop", 1)


def test_a_path_is_one_path(tmp_path: Path) -> None:
    folder = ASSETS / "laptop"
    assert [s.name for s in artsim.find_sources(str(folder))] == [s.name for s in artsim.find_sources([folder])]
    for missing in (tmp_path / "missing", str(tmp_path / "missing")):
        with pytest.raises(ArtsimError, match="missing: no such file or folder"):
            artsim.find_sources(missing)


def test_a_link_that_leads_to_itself_is_one_clear_error(tmp_path: Path) -> None:
    (tmp_path / "loop.urdf").symlink_to("loop.urdf")
    for path in (tmp_path, tmp_path / "loop.urdf"):
        with pytest.raises(ArtsimError, match=r"loop\.urdf"):
            artsim.find_sources(path)


def test_one_image_is_kept() -> None:
    obj = artsim.make("laptop", seed=0)
    camera = artsim.sample_view(obj, obj.tree.rest, ViewOptions(width=32, height=24), np.random.default_rng(0))
    sample = artsim.observe(obj, obj.tree.rest, camera, num_points=16, images="depth")  # type: ignore[arg-type]
    assert sample.depth is not None
