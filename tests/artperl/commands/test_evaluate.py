"""The verb ``artperl evaluate``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from artperl import cli
from artsim.errors import ConfigError


@pytest.mark.parametrize("own", [{"states": "rest"}, {"preset": "sphere"}, {"noise": "d435"}])
def test_a_benchmark_has_states_views_and_noise_of_its_own(own: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match="of its own"):
        cli.Evaluate(benchmark="artimage", **own).run()


@pytest.mark.parametrize(
    "own", [{"benchmark": "artimage"}, {"files": (Path("a.urdf"),)}, {"noise": "d435"}, {"seen_from": (-75.0, 75.0)}]
)
def test_the_ablation_has_objects_views_and_noise_of_its_own(own: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match="of its own") as caught:
        cli.Evaluate(ablation=True, **own).run()
    assert next(iter(own)) in str(caught.value)
