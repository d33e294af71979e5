"""Ranges: ratios of an object, the range that real ones require, and who lies outside of it."""

from __future__ import annotations

import numpy as np
import pytest

import artsim
from artsim.checks.ranges import left_out, ratios, reach, required_range
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.solids import box


def test_ratios_of_a_cabinet_are_those_of_its_measures() -> None:
    assembly = Assembly()
    assembly.add("body", box((0, 0, 0), (0.4, 0.6, 0.3)), density=500.0)
    door = box((-0.03, 0, 0), (-0.01, 0.6, 0.3))
    assembly.add("door", door, revolute("body", (0, 0, 1), (-0.02, 0.06, 0.15), 0.0, 1.5), density=500.0)
    tray = box((0.41, 0.1, 0.1), (0.43, 0.5, 0.2))
    assembly.add("tray", tray, prismatic("body", (1, 0, 0), 0.0, 0.2), density=500.0)
    obj = assembly.build("cabinet", "0")
    found = ratios(obj)
    diagonal = np.sqrt(0.46**2 + 0.6**2 + 0.3**2)
    assert found["extent y"] == pytest.approx([0.6 / diagonal])
    assert found["size x of the root"] == pytest.approx([0.4 / diagonal])
    assert found["opens turning about z"] == pytest.approx([1.5])
    assert found["place x turning about z"] == pytest.approx([0.01 / 0.46])
    assert found["place y turning about z"] == pytest.approx([0.1])
    assert found["slides sliding along x"] == pytest.approx([0.2 / diagonal])
    assert "place x sliding along x" not in found


def test_ratios_do_not_depend_on_the_size() -> None:
    obj = artsim.make("drawer", 3)
    small, large = ratios(obj), ratios(obj.with_diagonal(7.0))
    assert small.keys() == large.keys()
    for name, values in small.items():
        assert large[name] == pytest.approx(values, abs=1e-9), name


def test_required_ranges_go_half_their_width_beyond_both_ends() -> None:
    assert required_range("size x of the root", [0.2, 0.4], 10) == pytest.approx((0.1, 0.5))
    assert required_range("opens turning about z", [0.0, 3.0], 10) == pytest.approx((0.0, np.pi))
    assert required_range("extent x", [0.4], 1) == pytest.approx((0.3, 0.5))  # a single object: a quarter


def test_a_family_reaches_itself_and_not_beyond() -> None:
    real = {str(seed): ratios(artsim.make("laptop", seed)) for seed in range(6)}
    found = reach(real, real.values())
    assert all(r.holds_real for r in found)
    assert not all(r.reaches for r in found)


def test_only_the_odd_one_out_lies_outside() -> None:
    real = {name: {"extent x": [value]} for name, value in {"a": 0.2, "b": 0.24, "c": 0.22, "odd": 0.5}.items()}
    assert {name: bool(found) for name, found in left_out(real).items()} == {
        "a": False,
        "b": False,
        "c": False,
        "odd": True,
    }
