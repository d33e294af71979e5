"""The verb ``artperl evaluate``."""

from __future__ import annotations

import pytest

from artperl import cli
from artsim.errors import ConfigError


@pytest.mark.parametrize("own", [{"states": "rest"}, {"preset": "sphere"}, {"noise": "d435"}])
def test_a_benchmark_has_states_views_and_noise_of_its_own(own: dict[str, str]) -> None:
    with pytest.raises(ConfigError, match="of its own"):
        cli.Evaluate(benchmark="artimage", **own).run()
