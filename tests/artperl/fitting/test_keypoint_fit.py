"""Keypoints are explained by the pose, the states and the shape that made them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from artperl.core.pose import Theta
from artperl.core.rotations import rotation_from_vector
from artperl.data.categories import objects_of
from artperl.evaluation.metrics import rotation_error
from artperl.fitting.keypoint_fit import fit_keypoints, posed_keypoints, shaped, snap_keypoints
from artperl.methods.omad import omad_networks, state_range
from artperl.methods.protocol import NetworkSizes
from artperl.perception.omad_networks import (
    BASIS,
    KeypointPrior,
    quaternion_error,
    quaternion_of_rotation,
    rotation_of_quaternion,
)
from artperl.retrieval.shape_base import ShapeBase


def prior_of(category: str) -> tuple[KeypointPrior, ShapeBase]:
    base = ShapeBase.of(objects_of([category], 4, 500), 48)
    torch.manual_seed(0)
    prior = omad_networks(NetworkSizes(base.shapes.trees.num_rows, 16), base)["keypoint_prior"]
    with torch.no_grad():
        prior.mean.add_(base.shapes.box_center.mean(0)[:, None])
    return prior, base


@pytest.mark.slow
@pytest.mark.parametrize("category", ["laptop", "drawer"])
def test_pose_states_and_shape_are_found_again_from_their_keypoints(category: str) -> None:
    prior, base = prior_of(category)
    trees, generator = base.shapes.trees[[0]], torch.Generator().manual_seed(1)
    low, span = state_range(trees)
    beta = torch.randn(1, BASIS, generator=generator)
    theta = replace(
        Theta.at_rest(trees), rotation=torch.from_numpy(Rotation.random(random_state=4).as_matrix()).float()[None],
        translation=torch.tensor([[0.1, -0.2, 0.9]]), log_scale=torch.full((1, 3), -0.3),
        state=torch.where(trees.free, low + 0.4 * span, trees.rest),
    )  # fmt: skip
    with torch.no_grad():
        target = posed_keypoints(prior, shaped(prior, trees, theta, beta))
    start = replace(
        theta, rotation=rotation_from_vector(torch.tensor([[0.2, -0.1, 0.15]])) @ theta.rotation,
        translation=theta.translation + 0.03, state=torch.where(trees.free, low + 0.5 * span, trees.rest),
    )  # fmt: skip
    fit = fit_keypoints(prior, trees, start, beta + 0.1, target, torch.ones(target.shape[:3]))
    assert rotation_error(fit.theta.rotation.numpy(), theta.rotation.numpy()).max() < 1.0
    assert (posed_keypoints(prior, fit) - target).abs().max() < 0.02
    moved = (fit.theta.state - start.state).abs()[trees.free]
    assert (((fit.theta.state - theta.state).abs()[trees.free] < 0.5 * moved) | (moved < 0.02)).all()
    assert (fit.theta.state >= low - 1e-6).all()


def test_keypoints_that_no_point_is_near_do_not_count() -> None:
    points = torch.tensor([[[0.0, 0.0, 1.0], [0.5, 0.0, 1.0]]])
    part = torch.tensor([[0, 1]])
    keypoints = torch.tensor([[[[0.05, 0.0, 1.0], [0.48, 0.0, 1.0]], [[0.45, 0.0, 1.0], [0.0, 0.0, 1.0]]]])
    snapped, weight = snap_keypoints(keypoints, points, part, torch.tensor([1.0]))
    assert weight.tolist() == [[[1.0, 0.0], [1.0, 0.0]]]  # a point of the other part is none of its own
    torch.testing.assert_close(snapped[0, 0, 0], points[0, 0])
    torch.testing.assert_close(snapped[0, 1, 0], points[0, 1])


def test_a_part_that_is_its_own_mirror_has_mirrored_keypoints() -> None:
    prior, _ = prior_of("laptop")
    assert prior.mirrored.tolist() == [1.0, 1.0]
    keypoints = prior.keypoints(torch.randn(2, BASIS))
    half = keypoints.shape[2] // 2
    torch.testing.assert_close(keypoints[:, :, half:], keypoints[:, :, :half] * torch.tensor([1.0, -1.0, 1.0]))
    glasses, _ = prior_of("eyeglasses")
    assert glasses.mirrored.tolist() == [1.0, 0.0, 0.0]  # each temple is the mirror image of the other


def test_quaternions_are_those_of_scipy_and_both_signs_are_one_rotation() -> None:
    every = Rotation.random(200, random_state=0)
    half_turns = Rotation.from_rotvec(np.pi * np.eye(3))
    matrices = torch.from_numpy(np.concatenate([every.as_matrix(), half_turns.as_matrix(), np.eye(3)[None]]))
    quaternion = quaternion_of_rotation(matrices)
    torch.testing.assert_close(rotation_of_quaternion(quaternion), matrices, atol=1e-9, rtol=0.0)
    theirs = torch.from_numpy(every.as_quat()[:, [3, 0, 1, 2]])
    assert quaternion_error(quaternion[:200], theirs).max() < 1e-9
    assert quaternion_error(quaternion, -quaternion).max() < 1e-9
