"""What must hold of every kinematic tree."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from artsim.errors import KinematicsError
from artsim.model.joints import Joint, Mimic
from artsim.model.kinematics import KinematicTree
from artsim.model.transforms import cross_matrix, invert_transform, transform_points


@st.composite
def trees(draw: st.DrawFn, max_parts: int = 9) -> KinematicTree:
    """Trees of any shape, all joint types, some joints following others."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    joints = [Joint("root", "free", -1)]
    for k in range(1, draw(st.integers(1, max_parts))):
        kind = draw(st.sampled_from(["revolute", "continuous", "prismatic", "screw"]))
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        bounded = kind != "continuous"
        mimic = None
        if k > 1 and draw(st.integers(0, 4)) == 0:
            mimic = Mimic(int(rng.integers(1, k)), float(rng.normal()), float(rng.normal()))
        joints.append(
            Joint(
                name=f"joint_{k}",
                type=kind,
                parent=int(rng.integers(0, k)),
                axis=tuple(axis.tolist()),
                origin=tuple(rng.normal(size=3).tolist()),
                lower=-1.0 if bounded else -np.inf,
                upper=2.0 if bounded else np.inf,
                rest=float(rng.uniform(-1, 2)),
                pitch=float(rng.normal()) if kind == "screw" else 0.0,
                mimic=mimic,
            )
        )
    rest = KinematicTree(joints).complete_state([j.rest for j in joints])
    return KinematicTree([Joint(**{**vars(j), "rest": float(r)}) for j, r in zip(joints, rest, strict=True)])


def states(tree: KinematicTree, count: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 2, size=(count, len(tree)))


@given(trees())
def test_every_part_stands_at_identity_in_the_rest_state(tree: KinematicTree) -> None:
    assert np.abs(tree.forward_kinematics(tree.rest) - np.eye(4)).max() < 1e-12


@given(trees())
def test_poses_are_products_of_matrix_exponentials_up_the_chain(tree: KinematicTree) -> None:
    q = tree.complete_state(states(tree, 1)[0])
    for k, pose in enumerate(tree.forward_kinematics(q)):
        expected, part = np.eye(4), k
        while part > 0:
            joint = tree.joints[part]
            turn = joint.type != "prismatic"
            slide = {"prismatic": 1.0, "screw": joint.pitch}.get(joint.type, 0.0)
            twist = np.zeros((4, 4))
            twist[:3, :3] = cross_matrix(joint.axis) * turn
            twist[:3, 3] = slide * np.array(joint.axis) - twist[:3, :3] @ joint.origin
            expected = expm(twist * (q[part] - joint.rest)) @ expected
            part = joint.parent
        assert np.abs(pose - expected).max() < 1e-9


@given(trees())
def test_a_batch_equals_its_members(tree: KinematicTree) -> None:
    q = states(tree, 6).reshape(2, 3, -1)
    batch = tree.forward_kinematics(q)
    assert batch.shape == (2, 3, len(tree), 4, 4)
    for i, j in np.ndindex(2, 3):
        assert np.array_equal(batch[i, j], tree.forward_kinematics(q[i, j]))


@given(trees())
def test_rotations_are_rotations(tree: KinematicTree) -> None:
    rotation = tree.forward_kinematics(states(tree, 4))[..., :3, :3]
    assert np.abs(rotation @ np.swapaxes(rotation, -1, -2) - np.eye(3)).max() < 1e-12
    assert np.abs(np.linalg.det(rotation) - 1).max() < 1e-12


@given(trees(), st.floats(0.01, 100))
def test_an_object_twice_as_large_moves_twice_as_far(tree: KinematicTree, scale: float) -> None:
    q = tree.complete_state(states(tree, 1)[0])
    large = tree.scaled(scale)
    lengths = np.array([scale if t == "prismatic" else 1.0 for t in tree.types])
    pose, large_pose = tree.forward_kinematics(q), large.forward_kinematics(q * lengths)
    assert np.abs(large_pose[:, :3, :3] - pose[:, :3, :3]).max() < 1e-9
    assert np.allclose(large_pose[:, :3, 3], scale * pose[:, :3, 3], rtol=1e-9, atol=1e-9 * scale)


@given(trees())
def test_a_tree_survives_json(tree: KinematicTree) -> None:
    assert KinematicTree.from_dict(json.loads(json.dumps(tree.to_dict()))) == tree


@given(trees())
def test_points_on_a_turning_axis_stay_where_the_parent_carries_them(tree: KinematicTree) -> None:
    poses = tree.forward_kinematics(states(tree, 1)[0])
    axis, origin = tree.posed_joints(poses)
    for k, joint in enumerate(tree.joints):
        if joint.type in ("revolute", "continuous"):
            on_axis = np.array([joint.origin, np.array(joint.origin) + joint.axis])
            carried = transform_points(poses[k], on_axis)
            assert np.abs(carried - [origin[k], origin[k] + axis[k]]).max() < 1e-9


@given(trees())
def test_following_joints_go_where_their_source_takes_them(tree: KinematicTree) -> None:
    q = tree.complete_state(states(tree, 1)[0])
    for k, joint in enumerate(tree.joints):
        if joint.mimic is not None:
            assert q[k] == pytest.approx(joint.mimic.multiplier * q[joint.mimic.source] + joint.mimic.offset)
    assert np.array_equal(tree.complete_state(q), q)


@given(trees())
def test_inverse_transforms_undo(tree: KinematicTree) -> None:
    poses = tree.forward_kinematics(states(tree, 1)[0])
    assert np.abs(invert_transform(poses) @ poses - np.eye(4)).max() < 1e-9


_HINGE: dict[str, Any] = {"name": "hinge", "type": "revolute", "parent": 0, "lower": 0.0, "upper": 1.0}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"type": "ball"}, "unknown joint type"),
        ({"parent": 1}, "parent must come before"),
        ({"parent": -1}, "first joint is the root"),
        ({"type": "free"}, "first joint is the root"),
        ({"axis": (0.0, 0.0, 2.0)}, "not a unit vector"),
        ({"axis": (0.0, 0.0, 0.0)}, "not a unit vector"),
        ({"origin": (np.nan, 0.0, 0.0)}, "must be finite"),
        ({"lower": 2.0}, "not an interval"),
        ({"mimic": Mimic(7)}, "does not exist"),
        ({"mimic": Mimic(1)}, "form a loop"),
    ],
)
def test_an_inconsistent_joint_is_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(KinematicsError, match=message) as error:
        KinematicTree([Joint("root", "free", -1), Joint(**{**_HINGE, **change})])
    assert "hinge" in str(error.value)


def test_states_that_do_not_fit_are_refused() -> None:
    tree = KinematicTree([Joint("root", "free", -1), Joint(**_HINGE)])
    for q in ([0.0], [0.0, 0.0, 0.0], 0.0, [0.0, np.nan], [0.0, np.inf]):
        with pytest.raises(KinematicsError):
            tree.forward_kinematics(q)
    with pytest.raises(KinematicsError, match="at least one part"):
        KinematicTree([])
