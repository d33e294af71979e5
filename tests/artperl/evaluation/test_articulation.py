"""Parts and joints compared whatever they are called: closed forms, and the joints of real trees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artperl.evaluation.articulation import Articulation, joint_errors, part_distances
from artperl.evaluation.samples import samples_of
from artsim.families import make
from artsim.model.transforms import transform_points

Array = NDArray[np.float64]

TICKS = (np.arange(40) + 0.5) / 20
GRID = np.stack(np.meshgrid(TICKS, TICKS, TICKS, indexing="ij"), -1).reshape(-1, 3) / [1.0, 4.0, 4.0]
"""Points that fill 2 x 0.5 x 0.5 metres, the longest side along x."""
SIDES = np.ptp(GRID, axis=0)
WIDER = 2 * 0.005 * SIDES[0]
"""By which boxes are longer along x than their points."""
HALF = 0.5 * float(np.linalg.norm(SIDES)) / SIDES[0]
"""A part without a partner counts for this chamfer distance."""


def cut(*at: float) -> Articulation:
    """The grid in slabs along x: a root, doors that turn about the vertical where each begins."""
    part = np.searchsorted(at, GRID[:, 0])
    number = len(at) + 1
    origin = np.array([[x, 0.0, 0.0] for x in (0.0, *at)])
    return Articulation(
        part, ("free", *["revolute"] * len(at)), np.array([-1, *[0] * len(at)]), np.tile([0.0, 0.0, 1.0], (number, 1)),
        origin, np.array([0.0, *[np.pi / 2] * len(at)]),
    )  # fmt: skip


def renumbered(one: Articulation, order: NDArray[np.int64]) -> Articulation:
    """The same parts, part ``order[k]`` in place k."""
    place = np.argsort(order)
    parent = np.where(one.joint_parent[order] < 0, -1, place[one.joint_parent[order]])
    return Articulation(
        place[one.part], tuple(one.joint_type[k] for k in order), parent, one.joint_axis[order],
        one.joint_origin[order], one.travel[order],
    )  # fmt: skip


def test_the_truth_itself_has_no_error() -> None:
    truth = cut(0.5, 1.25)
    found = joint_errors(truth, truth, GRID)
    assert found.type_right.all()
    assert (found.iou == 1.0).all()
    assert found.axis[1:] == pytest.approx([0.0, 0.0])
    assert found.origin[1:] == pytest.approx([0.0, 0.0])
    assert part_distances(truth, truth, GRID, np.eye(3)) == pytest.approx((1.0, 1.0, 0.0, 0.0))


def test_shares_of_a_cut_in_another_place_are_those_of_its_slabs() -> None:
    """Truth 0..1 | 1..2, estimate 0..0.5 | 0.5..2: one half, and two thirds. Nested boxes leave nothing empty."""
    found = joint_errors(cut(0.5), cut(1.0), GRID)
    assert found.iou == pytest.approx([1 / 2, 2 / 3])
    assert found.origin[1] == pytest.approx(0.5 / np.linalg.norm(SIDES))
    assert part_distances(cut(0.5), cut(1.0), GRID, np.eye(3)).giou == pytest.approx(
        ((0.45 + WIDER) / (0.95 + WIDER) + (0.95 + WIDER) / (1.45 + WIDER)) / 2
    )


def test_slabs_apart_have_a_negative_overlap() -> None:
    """One part each, 0..0.5 and 1.5..2: nothing in common, and about half of the box about both is empty."""
    first, last = ((GRID[:, 0] < 0.5).astype(int) - 1, (GRID[:, 0] > 1.5).astype(int) - 1)
    root = replace(cut(), part=first)
    assert part_distances(root, replace(root, part=last), GRID, np.eye(3)).giou == pytest.approx(
        2 * (0.45 + WIDER) / (1.95 + WIDER) - 1
    )
    assert joint_errors(root, replace(root, part=last), GRID).partner.tolist() == [-1]


@pytest.mark.parametrize("order", [(2, 0, 1), (1, 2, 0)])
def test_numbers_of_parts_do_not_count(order: tuple[int, ...]) -> None:
    truth, estimate = cut(0.5, 1.25), cut(0.6, 1.5)
    there = renumbered(estimate, np.array(order))
    plain, found = joint_errors(estimate, truth, GRID), joint_errors(there, truth, GRID)
    assert [order[m] for m in found.partner] == plain.partner.tolist()
    for name in ("iou", "type_right", "axis", "origin"):
        assert getattr(found, name) == pytest.approx(getattr(plain, name))
    rotation = Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix()
    assert part_distances(there, truth, GRID, rotation) == pytest.approx(
        part_distances(estimate, truth, GRID, rotation)
    )


def test_a_part_without_a_partner_counts_as_the_worst() -> None:
    """Of three true parts the last is missing: estimated parts have 1, true ones (1 + 1 - 1) / 3."""
    truth = cut(0.5, 1.25)
    estimate = replace(cut(0.5), part=np.where(truth.part == 2, -1, truth.part))
    found = joint_errors(estimate, truth, GRID)
    assert found.partner.tolist() == [0, 1, -1]
    assert (found.iou[2], found.type_right[2], found.axis[2], found.origin[2]) == (0.0, False, 90.0, 0.5)
    giou, _, chamfer, _ = part_distances(estimate, truth, GRID, np.eye(3))
    assert giou == pytest.approx((1 + 1 / 3) / 2)
    assert chamfer == pytest.approx(HALF / 3 / 2)
    assert part_distances(None, truth, GRID, np.eye(3)) == pytest.approx((-1.0, -1.0, HALF, HALF))
    assert (joint_errors(None, truth, GRID).partner == -1).all()


def test_a_door_that_leans_and_one_that_slides_are_told() -> None:
    truth = cut(1.0)
    axis = Rotation.from_rotvec([np.deg2rad(7.0), 0.0, 0.0]).apply(truth.joint_axis)
    leaning = replace(truth, joint_axis=-axis, joint_origin=truth.joint_origin + [0.1, 0.0, 0.0])
    found = joint_errors(leaning, truth, GRID)  # the lines leave in the plane across x, at 0.1 from each other
    assert found.axis[1] == pytest.approx(7.0)
    assert found.origin[1] == pytest.approx(0.1 / np.linalg.norm(SIDES))
    sliding = joint_errors(replace(truth, joint_type=("free", "prismatic")), truth, GRID)
    assert sliding.type_right.tolist() == [True, False]
    assert sliding.axis[1] == pytest.approx(0.0)


@pytest.mark.parametrize("category", ["robot_arm", "storage_furniture", "eyeglasses"])
def test_parts_open_as_the_tree_moves_them(category: str) -> None:
    """Forward kinematics of the open state, from the rest frame, are the oracle; an arm's links carry one another."""
    obj = make(category, 3)
    (sample,) = samples_of([obj], 1)
    low, high = np.clip(sample.joint_limits - sample.joint_rest[:, None], -np.pi, np.pi).T
    q = sample.joint_rest + np.where(np.abs(low) > np.abs(high), low, high)
    q[0] = 0.0
    T_object_part = obj.tree.forward_kinematics(q)
    expected = np.empty(sample.points.shape)
    for k in range(len(q)):
        own = sample.part == k
        expected[own] = transform_points(sample.T_camera_part[0] @ T_object_part[k], sample.rest_points[own])
    truth = Articulation.of(sample)
    assert np.abs(truth.travel[1:]).max() > 0.1
    assert np.abs(truth.opened(sample.points) - expected).max() < 1e-4  # points are in single precision
