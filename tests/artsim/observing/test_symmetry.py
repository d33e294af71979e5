"""Symmetries: objects that look the same turned round, and the two truths about one view of them."""

from __future__ import annotations

import numpy as np
import pytest

import artsim
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.solids import box
from artsim.model.camera import Camera
from artsim.model.objects import ArticulatedObject
from artsim.observing.capture import observe
from artsim.observing.symmetry import equivalent_sample, symmetries


def shears(second: float = 0.2) -> ArticulatedObject:
    """Two bars crossed at their middle, one on the other; the second turns about the vertical."""
    assembly = Assembly()
    assembly.add("lower", box((-0.02, -0.2, 0.0), (0.02, 0.1, 0.01)), density=500.0)
    upper = box((-0.02, -second, 0.011), (0.02, 0.1, 0.021))
    assembly.add("upper", upper, revolute("lower", (0, 0, 1), (0, 0, 0.01), 0.0, 1.0), density=500.0)
    return assembly.build("shears", "0")


def chest(front: float = 0.2) -> ArticulatedObject:
    """A block with a tray on its front and one on its back; they slide apart."""
    assembly = Assembly()
    assembly.add("body", box((-0.2, -0.3, 0), (0.2, 0.3, 0.4)), density=500.0)
    for name, side, reach in (("front", -1.0, front), ("back", 1.0, 0.2)):
        ends = sorted((side * 0.21, side * 0.25))
        tray = box((ends[0], -0.2, 0.05), (ends[1], 0.2, 0.25))
        assembly.add(name, tray, prismatic("body", (side, 0, 0), 0.0, reach), density=500.0)
    return assembly.build("chest", "0")


def test_equal_crossed_bars_are_the_same_after_half_a_turn_with_the_bars_exchanged() -> None:
    (found,) = symmetries(shears())
    np.testing.assert_array_equal(found.rotation, np.diag([-1.0, 1.0, -1.0]))
    assert found.parts.tolist() == [1, 0]


def test_unequal_bars_have_no_symmetry() -> None:
    assert symmetries(shears(second=0.15)) == ()


def test_trays_that_slide_out_by_different_lengths_are_no_symmetry() -> None:
    (found,) = symmetries(chest())
    np.testing.assert_array_equal(found.rotation, np.diag([-1.0, -1.0, 1.0]))
    assert found.parts.tolist() == [0, 2, 1]
    assert symmetries(chest(front=0.1)) == ()


@pytest.mark.parametrize("obj", [shears(), chest()], ids=["shears", "chest"])
def test_the_other_truth_is_one_of_the_same_object_in_the_same_place(obj: ArticulatedObject) -> None:
    rng = np.random.default_rng(3)
    q = np.concatenate([[0.0], rng.uniform(obj.tree.limits[1:, 0], obj.tree.limits[1:, 1])])
    camera = Camera.look_at([-0.9, 0.4, 0.7], [0, 0, 0], 160, 120)
    sample = observe(obj, q, camera, num_points=500)
    (symmetry,) = symmetries(obj)
    other = equivalent_sample(sample, symmetry)
    # The new poses are those of the object itself at the new state, from its new root pose.
    poses = other.T_camera_part[0] @ obj.tree.forward_kinematics(other.joint_state)
    np.testing.assert_allclose(other.T_camera_part, poses, atol=1e-9)
    np.testing.assert_allclose(other.box_center, sample.box_center, atol=1e-9)
    np.testing.assert_allclose(other.box_size, sample.box_size, atol=1e-9)
    # Every point lies on the box of the part that it is now said to be of.
    inside = [np.linalg.inv(other.T_camera_part[k]) @ [*p, 1.0] for p, k in zip(sample.points, other.part, strict=True)]
    off = np.abs(np.array(inside)[:, :3] - other.box_center[other.part]) - 0.5 * other.box_size[other.part]
    assert off.max() < 1e-6
    axes = np.einsum("kij,kj->ki", other.T_camera_part[np.maximum(other.joint_parent, 0), :3, :3], other.joint_axis)
    np.testing.assert_allclose(other.joint_axis_camera[1:], axes[1:], atol=1e-9)


def test_laptops_and_robot_arms_have_none() -> None:
    assert [symmetries(artsim.make("robot_arm", seed)) for seed in range(3)] == [()] * 3
    assert symmetries(artsim.make("laptop", 0)) == ()


def test_symmetries_do_not_depend_on_the_size() -> None:
    assert len(symmetries(chest().with_diagonal(3.0))) == 1
