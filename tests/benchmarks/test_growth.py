"""The exponent of growth is that of the power by which time grows."""

from __future__ import annotations

import pytest

from artsim.errors import ConfigError
from benchmarks.growth import Options, exponent


@pytest.mark.parametrize("power", [0.0, 1.0, 2.0])
def test_the_exponent_of_a_power_is_the_power(power: float) -> None:
    sizes = [10.0, 20.0, 40.0, 80.0]
    assert exponent(sizes, [3e-3 * size**power for size in sizes]) == pytest.approx(power, abs=1e-9)


def test_what_is_the_same_at_small_sizes_does_not_hide_a_quadratic_cost() -> None:
    sizes = [10.0, 100.0, 1000.0, 10_000.0]
    assert exponent(sizes, [1.0 + 1e-4 * size**2 for size in sizes]) > 1.5


def test_an_unknown_growth_is_refused() -> None:
    with pytest.raises(ConfigError, match="no growth is called 'colours'"):
        Options(only=("colours",))
