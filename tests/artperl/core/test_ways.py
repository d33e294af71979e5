"""Ways in which parts open are those of their joints, and are told with their probabilities."""

from __future__ import annotations

import numpy as np
import pytest

import artsim
from artperl.core.clouds import joint_rows
from artperl.core.ways import WAYS, likely_ways, unsure, way_chances, way_distances, ways_of


def way(kind: str, axis: tuple[float, ...], origin: tuple[float, ...], center: tuple[float, ...]) -> str:
    rows = joint_rows(["free", kind], *(np.array([[0.0] * 3, own]) for own in (axis, origin, center)), diagonal=2.0)
    found = ways_of(rows)
    assert found[0] == -1  # the root does not open
    return WAYS[found[1]]


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_way_is_where_the_axis_is_whatever_its_sense(sense: float) -> None:
    up, across = (0.0, 0.0, sense), (0.0, sense, 0.0)
    assert way("prismatic", (-sense, 0.0, 0.0), (0.3, 0.2, 0.1), (0.0, 0.0, 0.0)) == "slides"
    assert way("revolute", up, (0.0, 0.5, -7.0), (0.0, 0.0, 1.0)) == "hinged at +Y"  # along the axis nothing counts
    assert way("revolute", up, (0.1, -0.5, 0.0), (0.0, 0.0, 1.0)) == "hinged at -Y"
    assert way("revolute", across, (0.0, 0.0, 0.5), (0.0, 4.0, 1.0)) == "hinged at -Z"
    assert way("continuous", (sense, 0.0, 0.0), (-1.0, 0.02, 0.0), (0.0, 0.0, 0.0)) == "turns about its middle"


@pytest.mark.parametrize("category", ["storage_furniture", "oven", "laptop", "refrigerator", "drawer"])
def test_votes_for_a_joint_are_nearest_to_its_way(category: str) -> None:
    for seed in range(5):
        obj = artsim.make(category, seed)
        tree = obj.tree
        rows = joint_rows(tree.types, tree.axes, tree.origins, obj.box_center, obj.diagonal)
        for k, true in enumerate(ways_of(rows)):
            if true >= 0:
                distances = way_distances(np.stack([rows[k]] * 3), obj.box_size[k] / obj.diagonal)
                assert distances[true] == distances.min(), (obj.name, k)


def test_votes_between_two_ways_leave_both_open() -> None:
    size = np.array([0.02, 0.4, 0.5])
    left, right = (np.array([0, 0, 0, 0, 0, 1.0, 0, side, 0]) for side in (0.2, -0.2))
    one = way_distances(np.stack([left] * 4), size)
    both = way_distances(np.stack([left, left, right, right]), size)
    told = [WAYS[n] for n in np.argsort(-way_chances(np.stack([both, both], axis=-1)))[:2]]
    assert sorted(told) == ["hinged at +Y", "hinged at -Y"]
    sure, unsure_one = (way_chances(np.stack([own, own], axis=-1)) for own in (one, both))
    assert sure.max() > unsure_one.max()
    assert sure.sum() == pytest.approx(1.0)


def test_the_likeliest_come_first_and_doubt_has_a_line() -> None:
    chances = np.zeros((4, len(WAYS)))
    chances[1, [0, 2, 5]] = 0.30, 0.66, 0.04
    chances[2, 0] = 1.0
    told = likely_ways(chances, ("free", "revolute", "prismatic", "fixed"))
    assert [list(own) for own in told] == [[], ["hinged at -Y", "slides"], ["slides"], []]
    assert unsure(told, ("body", "door", "drawer", "leg")) == ["door: hinged at -Y (66 %) or slides (30 %)"]
    assert likely_ways(np.zeros((0, 0)), ("free", "revolute")) == ({}, {})
