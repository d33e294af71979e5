"""Elementary functions are right to the last places, for a number as for an array of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artsim.common import elementary

RNG = np.random.default_rng(0)
ANGLES = np.concatenate(
    [RNG.uniform(-7, 7, 1500), RNG.uniform(-1e5, 1e5, 300), np.arange(-24, 25) * np.pi / 12, [1e-9]]
)
POSITIVE = np.concatenate(
    [10 ** RNG.uniform(-300, 300, 300), RNG.uniform(0.5, 2, 900), 1 + RNG.uniform(-1e-7, 1e-7, 99)]
)
SHARES = np.concatenate([RNG.uniform(-1, 1, 900), 1 - 10 ** RNG.uniform(-16, -1, 300), [-1.0, 0.0, 1.0]])
FUNCTIONS = {
    "sin": (ANGLES, 0.8),
    "cos": (ANGLES, 0.8),
    "tan": (ANGLES, 2.0),
    "arctan": (ANGLES, 1.5),
    "arcsin": (SHARES, 2.0),
    "arccos": (SHARES, 2.0),
    "log": (POSITIVE, 1.0),
    "exp": (RNG.uniform(-700, 700, 900), 1.0),
}


def units_off(found: float, true: mpmath.mpf) -> float:
    return float(abs(found - true) / math.ulp(float(true)))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_elementary_functions_are_right_to_the_last_places(name: str) -> None:
    points, tolerance = FUNCTIONS[name]
    with mpmath.workprec(120):
        true = [getattr(mpmath, name.replace("arc", "a"))(mpmath.mpf(x)) for x in points.tolist()]
        found = getattr(elementary, name)(points).tolist()
        worst = max(units_off(f, t) for f, t in zip(found, true, strict=True))
    assert worst <= tolerance


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_number_an_array_and_a_part_of_it_give_the_same_bits(name: str) -> None:
    function: Callable[[Any], Any] = getattr(elementary, name)
    points = np.concatenate([FUNCTIONS[name][0], [0.0, -0.0, 1.0, np.inf, -np.inf, np.nan, 1e300]])
    if name in ("arcsin", "arccos"):
        points = points[np.abs(points) <= 1]
    many = function(np.tile(points, 20))
    few = np.concatenate([function(points[i : i + 7]) for i in range(0, len(points), 7)])
    ones = np.array([function(float(x)) for x in points])
    for other in (few, many[: len(points)], many[-len(points) :]):
        assert np.array_equal(other, ones, equal_nan=True)


def test_angles_of_every_direction_are_those_of_numpy() -> None:
    ends = [0.0, -0.0, 1.0, -1.0, 1e-300, 1e300, np.inf, -np.inf]
    y, x = (side.ravel() for side in np.meshgrid([*ends, *RNG.normal(size=9)], [*ends, *RNG.normal(size=9)]))
    found, true = elementary.arctan2(y, x), np.arctan2(y, x)
    np.testing.assert_allclose(found, true, rtol=1e-15, atol=0)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(true))
    np.testing.assert_array_equal(found, [elementary.arctan2(float(a), float(b)) for a, b in zip(y, x, strict=True)])


def test_a_cosine_is_1_at_rest_and_never_above() -> None:
    assert elementary.cos(0.0) == elementary.sin(0.5 * np.pi) == -elementary.cos(np.pi) == 1.0
    nearly_one = elementary.cos(10.0 ** RNG.uniform(-20, -1, 100_000))
    assert nearly_one.max() == 1.0


@given(st.just(0.0) | st.floats(1e-3, 1e3), st.floats(0.1, 5))
def test_powers_are_those_of_python(base: float, exponent: float) -> None:
    assert elementary.power(base, exponent) == pytest.approx(base**exponent, rel=2e-14)
    assert elementary.power(np.array([base]), exponent).tolist() == [elementary.power(base, exponent)]
