"""What is worked out from an estimate and the points: boxes, how far parts have slid."""

from __future__ import annotations

import numpy as np
import pytest

from artperl.core.estimate import Estimate, points_at_rest, slide_parts, widen
from artperl.evaluation.metrics import true_poses
from artperl.evaluation.samples import frozen_samples


def test_points_widen_boxes_and_never_narrow_them() -> None:
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    inside = rng.uniform([-0.5, -0.5, 0.0], [0.5, 1.5, 0.2], (20_000, 3))  # on one side, and farther along y
    points = np.concatenate([inside @ turn.T + [1.0, 2.0, 3.0], rng.normal(size=(20, 3))])
    part = np.repeat([0, 1], [20_000, 20])
    rotation, center = np.stack([turn, np.eye(3)]), np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])
    size = np.ones((2, 3))
    moved, grown = widen(rotation, center, size, points, part)
    np.testing.assert_allclose(grown[0], [1.0, 1.992, 1.0], atol=0.003)  # of 2, 0.4 % are left out at the far end
    np.testing.assert_allclose((moved[0] - center[0]) @ turn, [0.0, 0.496, 0.0], atol=0.003)
    np.testing.assert_array_equal(moved[1], center[1])  # twenty points say nothing
    np.testing.assert_array_equal(grown[1], size[1])
    feet = np.array([[0.1, 0.1, -0.9]]) + 1e-3 * rng.normal(size=(120, 3))  # 0.6 % of the points
    _, taller = widen(
        rotation, center, size, np.concatenate([points, feet @ turn.T + [1.0, 2.0, 3.0]]), np.append(part, [0] * 120)
    )
    np.testing.assert_allclose(taller[0], [1.0, 1.992, 1.4], atol=0.01)


@pytest.mark.parametrize("seed", range(4))
def test_what_has_slid_farther_is_where_it_was_and_was_elsewhere_at_rest(seed: int) -> None:
    """Random trees: at rest, what a drawer carries lies as much farther back."""
    (sample,) = frozen_samples(["random_tree"], 1, 1, first_seed=seed)
    K, rng = len(sample.box_size), np.random.default_rng(seed)
    estimate = Estimate(
        rotation=sample.T_camera_part[:, :3, :3], translation=true_poses(sample)[1], size=sample.box_size,
        T_camera_part=sample.T_camera_part, state=sample.joint_state, joint_type=sample.joint_type,
        joint_parent=sample.joint_parent, joint_axis=sample.joint_axis_camera,
        joint_origin=sample.joint_origin_camera, part=sample.part.astype(np.int64), reference="", residual=0.0,
        disagreement=0.0, visibility=np.ones(K), confidence=1.0, trajectory=sample.T_camera_part[None], milliseconds={},
    )  # fmt: skip
    farther = np.where(np.array(sample.joint_type) == "prismatic", rng.normal(0.0, 0.1, K), 0.0)
    moved = slide_parts(estimate, farther)
    assert np.array_equal(moved.translation, estimate.translation)
    assert np.allclose(moved.state, sample.joint_state + farther)
    assert np.array_equal(moved.trajectory[-1], moved.T_camera_part)
    back = [points_at_rest(each.translation, each.T_camera_part) for each in (estimate, moved)]
    for k in range(K):
        carriers, above = [k], int(sample.joint_parent[k])
        while above >= 0:
            carriers, above = [*carriers, above], int(sample.joint_parent[above])
        expected = -sum(farther[j] * sample.joint_axis[j] for j in carriers)
        assert np.allclose(back[1][k] - back[0][k], expected, atol=1e-9)
