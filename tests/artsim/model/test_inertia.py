"""Masses and inertias are those of the bodies that parts are made of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from artsim.errors import AssetError
from artsim.families import FAMILIES, make
from artsim.families.physical import physical_ranges
from artsim.loading.urdf import load
from artsim.making.assembly import Assembly, prismatic
from artsim.making.solids import Solid, box
from artsim.model.inertia import combine_inertias
from artsim.model.objects import ArticulatedObject
from artsim.model.part_inertia import part_inertia
from artsim.model.robot import as_robot
from tests.conftest import ASSETS, valve


def test_a_box_weighs_its_volume_and_turns_as_the_formula_says() -> None:
    obj = valve()
    inertia = part_inertia(obj, 0)
    a, b, c = 0.2, 0.2, 0.2
    mass = a * b * c * 1000.0
    assert inertia.mass == pytest.approx(mass)
    np.testing.assert_allclose(inertia.center, obj.box_center[0], atol=1e-12)
    exact = np.diag([b * b + c * c, a * a + c * c, a * a + b * b]) * mass / 12
    np.testing.assert_allclose(inertia.tensor, exact, atol=1e-12)


def test_mass_grows_with_the_third_power_of_size_and_inertia_with_the_fifth() -> None:
    small, large = part_inertia(valve(), 3), part_inertia(valve().scaled(2.0), 3)
    assert large.mass == pytest.approx(8 * small.mass)
    np.testing.assert_allclose(large.tensor, 32 * small.tensor, atol=1e-15)


def test_overlapping_pieces_weigh_what_their_union_does() -> None:
    assembly = Assembly()
    assembly.add("block", box((0, 0, 0), (1, 1, 1)) + box((0.5, 0, 0), (1.5, 1, 1)), density=2.0)
    assert part_inertia(assembly.build("block", "0"), 0).mass == pytest.approx(3.0)


def test_halves_joined_are_the_whole() -> None:
    def solid(*parts: Solid) -> ArticulatedObject:
        assembly = Assembly()
        for i, part in enumerate(parts):
            assembly.add(f"half_{i}", part, prismatic("half_0", (1, 0, 0), 0, 1) if i else None)
        return assembly.build("solid", "0")

    whole = part_inertia(solid(box((0, 0, 0), (2, 1, 1))), 0)
    halves = solid(box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (2, 1, 1)))
    joined = combine_inertias(part_inertia(halves, k) for k in range(2))
    assert joined.mass == pytest.approx(whole.mass)
    np.testing.assert_allclose(joined.tensor, whole.tensor, rtol=1e-12, atol=1e-12)
    # A rod about its end: m l^2 / 3, and the same of its cross-section.
    end = joined.about(joined.center - [1.0, 0, 0], np.array([0.0, 0, 1]))
    assert end == pytest.approx(whole.mass * (4 / 3 + 1 / 12))


def test_what_nothing_is_known_of_has_no_mass() -> None:
    with pytest.raises(AssetError, match="has no body"):
        part_inertia(load(ASSETS / "laptop"), 0)
    obj = valve()
    flat = replace(obj.parts[0], faces=obj.parts[0].faces[:2])
    with pytest.raises(AssetError, match="encloses no solid"):
        part_inertia(replace(obj, parts=(flat, *obj.parts[1:])), 0)


@pytest.mark.parametrize("category", FAMILIES)
def test_inertias_of_every_family_are_those_of_possible_bodies(category: str) -> None:
    obj = make(category, 7)
    for k in range(len(obj)):
        moments = np.linalg.eigvalsh(part_inertia(obj, k).tensor)
        assert moments[0] > 0
        assert moments[2] <= moments[:2].sum() * (1 + 1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("category", sorted(physical_ranges()["mass"]))
def test_objects_weigh_what_real_ones_do(category: str) -> None:
    row = physical_ranges()["mass"][category]
    for seed in range(2):
        mass = sum(link.inertia.mass for link in as_robot(make(category, seed)).links)
        assert row["low"] <= mass <= row["high"]
