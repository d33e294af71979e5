"""What must hold of Theta, the joint-centric state, and of the poses that it gives."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

import artsim
from artperl.core.pose import (
    Posed,
    Theta,
    clamp_state,
    complete_state,
    joint_axes,
    joint_states,
    pose_parts,
    theta_from_parts,
)
from artperl.core.rotations import rotation_from_vector
from artperl.core.trees import Trees
from artsim.model.draws import StateOptions, sample_state
from artsim.model.joints import Joint, Mimic
from artsim.model.kinematics import KinematicTree


def random_tree(rng: np.random.Generator, num_parts: int, mimic: bool = True) -> KinematicTree:
    """A tree of any shape and depth with every kind of joint."""
    joints = [Joint("root", "free", -1)]
    for k in range(1, num_parts):
        kind = str(rng.choice(["revolute", "continuous", "prismatic", "screw"]))
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        bounded = kind != "continuous"
        follows = mimic and k > 1 and rng.random() < 0.3
        joints.append(
            Joint(
                f"joint_{k}",
                kind,
                int(rng.integers(max(0, k - 3), k)),
                tuple(axis.tolist()),
                tuple(rng.normal(size=3).tolist()),
                -1.0 if bounded else -np.inf,
                2.0 if bounded else np.inf,
                float(rng.uniform(-1, 2)),
                float(rng.uniform(0.1, 0.5)) if kind == "screw" else 0.0,
                Mimic(int(rng.integers(1, k)), float(rng.normal()), float(rng.normal())) if follows else None,
            )
        )
    return KinematicTree(joints)


def random_batch(
    seed: int, sizes: tuple[int, ...] = (1, 2, 5, 9, 4), mimic: bool = True, shape: bool = True
) -> tuple[list[KinematicTree], Trees, Theta, torch.Tensor, torch.Tensor]:
    """Trees of different sizes in one batch, a random state of each, and boxes."""
    rng = np.random.default_rng(seed)
    trees = [random_tree(rng, n, mimic) for n in sizes]
    batch = Trees.stack(trees)
    B, P = batch.valid.shape
    amount = 0.3 if shape else 0.0
    theta = Theta(
        torch.from_numpy(Rotation.random(B, random_state=seed).as_matrix()),
        torch.from_numpy(rng.normal(size=(B, 3))),
        torch.from_numpy(amount * rng.normal(size=(B, 3))),
        clamp_state(batch, torch.from_numpy(rng.uniform(-1.0, 2.0, size=(B, P)))),
        torch.from_numpy(amount * rng.normal(size=(B, P, 3))),
        torch.from_numpy(amount * rng.normal(size=(B, P, 3))),
    )
    center = torch.from_numpy(rng.normal(size=(B, P, 3)))
    return trees, batch, theta, center, torch.from_numpy(rng.uniform(0.1, 1.0, size=(B, P, 3)))


@pytest.mark.parametrize("seed", range(20))
def test_theta_poses_parts_as_forward_kinematics_does(seed: int) -> None:
    trees, batch, theta, center, _ = random_batch(seed, shape=False)
    posed = pose_parts(batch, theta, center)
    for b, tree in enumerate(trees):
        T_camera_root = np.eye(4)
        T_camera_root[:3, :3], T_camera_root[:3, 3] = theta.rotation[b], theta.translation[b]
        T_camera_part = T_camera_root @ tree.forward_kinematics(theta.state[b, : len(tree)].numpy())
        np.testing.assert_allclose(posed.rotation[b, : len(tree)], T_camera_part[:, :3, :3], atol=1e-6)
        np.testing.assert_allclose(posed.translation[b, : len(tree)], T_camera_part[:, :3, 3], atol=1e-6)
        axis, origin = tree.posed_joints(T_camera_part)
        found_axis, found_origin = joint_axes(batch, posed)
        np.testing.assert_allclose(found_axis[b, : len(tree)], axis, atol=1e-6)
        np.testing.assert_allclose(found_origin[b, : len(tree)], origin, atol=1e-6)


def test_real_categories_agree_with_forward_kinematics_to_a_micrometre() -> None:
    rng = np.random.default_rng(0)
    objects = [artsim.make(category, seed) for category in ("laptop", "drawer") for seed in range(4)]
    batch = Trees.stack([obj.tree for obj in objects])
    states = torch.zeros(batch.valid.shape, dtype=torch.float64)
    for b, obj in enumerate(objects):
        states[b, : len(obj)] = torch.from_numpy(sample_state(obj, StateOptions(), rng))
    theta = Theta(**{**vars(Theta.at_rest(batch)), "state": states})
    posed = pose_parts(batch, theta, torch.zeros_like(theta.shift))
    for b, obj in enumerate(objects):
        T = obj.tree.forward_kinematics(states[b, : len(obj)].numpy())
        np.testing.assert_allclose(posed.translation[b, : len(obj)], T[:, :3, 3], atol=1e-6)


def test_both_parts_of_a_joint_carry_its_axis_to_the_same_direction() -> None:
    """Equation 7: its energy is 0 of all poses that come from Theta, for any state of any joint."""
    _, trees, theta, _, center = random_batch(5)
    rotation = pose_parts(trees, theta, center).rotation
    parent = rotation.gather(1, trees.parent[..., None, None].expand_as(rotation))
    apart = ((parent - rotation) @ trees.axis[..., None])[..., 0][trees.valid & (trees.depth > 0)]
    assert len(apart) == 1 + 4 + 8 + 3
    torch.testing.assert_close(apart, torch.zeros_like(apart), atol=1e-12, rtol=0)


def test_padding_never_moves_and_does_not_change_an_object() -> None:
    trees, batch, theta, center, _ = random_batch(3)
    posed = pose_parts(batch, theta, center)
    for b, tree in enumerate(trees):
        K = len(tree)
        alone = Theta(*(getattr(theta, name)[b : b + 1] for name in ("rotation", "translation", "log_scale")),
                      theta.state[b : b + 1, :K], theta.shift[b : b + 1, :K], theta.stretch[b : b + 1, :K])  # fmt: skip
        single = pose_parts(Trees.stack([tree]), alone, center[b : b + 1, :K])
        torch.testing.assert_close(posed.rotation[b, :K], single.rotation[0])
        torch.testing.assert_close(posed.center[b, :K], single.center[0])
        torch.testing.assert_close(posed.rotation[b, K:], theta.rotation[b].expand(len(posed.rotation[b, K:]), 3, 3))


def test_a_tree_of_fixed_joints_is_rigid() -> None:
    tree = KinematicTree([Joint("root", "free", -1), Joint("stuck", "revolute", 0, origin=(1.0, 0.0, 0.0))])
    assert clamp_state(Trees.stack([tree]), torch.tensor([[0.0, 0.7]], dtype=torch.float64)).eq(0.0).all()


def test_followers_do_what_their_source_says() -> None:
    trees, batch, theta, _, _ = random_batch(5, (6, 9, 8))
    state = complete_state(batch, theta.state)
    for b, tree in enumerate(trees):
        expected = tree.complete_state(theta.state[b, : len(tree)].numpy())
        np.testing.assert_allclose(state[b, 1 : len(tree)], expected[1:], atol=1e-12)
        assert set(batch.free[b].nonzero().ravel().tolist()) == set(tree.free_joints.tolist())


@pytest.mark.parametrize("seed", range(10))
def test_theta_comes_back_from_the_poses_that_it_gives(seed: int) -> None:
    _, batch, theta, center, size = random_batch(seed, mimic=False)
    posed = pose_parts(batch, theta, center)
    back = theta_from_parts(batch, center, size, posed.rotation, posed.center, size * posed.scale)
    again = pose_parts(batch, back, center)
    torch.testing.assert_close(again.rotation[batch.valid], posed.rotation[batch.valid])
    torch.testing.assert_close(again.center[batch.valid], posed.center[batch.valid])
    torch.testing.assert_close(again.scale[batch.valid], posed.scale[batch.valid])
    # A shift along a sliding joint is the same as more of its state, and a scale of all parts the same as one of the
    # whole; without shifts and stretches every state comes back.
    zero = torch.zeros_like(theta.shift)
    theta = Theta(theta.rotation, theta.translation, theta.log_scale, theta.state, zero, zero)
    posed = pose_parts(batch, theta, center)
    back = theta_from_parts(batch, center, size, posed.rotation, posed.center, size * posed.scale)
    step = torch.where(batch.kind == 2, 2 * torch.pi, 1e9)  # continuous joints: up to whole turns
    difference = torch.remainder(back.state - theta.state + step / 2, step) - step / 2
    assert difference[batch.free].abs().max() < 1e-9


def test_impossible_poses_go_to_the_nearest_state() -> None:
    tree = KinematicTree([Joint("root", "free", -1), Joint("lid", "revolute", 0, (0, 1, 0), (0, 0, 0), 0.0, 2.0)])
    batch = Trees.stack([tree])
    theta = Theta(**{**vars(Theta.at_rest(batch)), "state": torch.tensor([[0.0, 0.8]], dtype=torch.float64)})
    center = torch.tensor([[[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]], dtype=torch.float64)
    posed = pose_parts(batch, theta, center)
    wrong = posed.rotation.clone()
    wrong[:, 1] = wrong[:, 1] @ rotation_from_vector(torch.tensor([0.1, 0.0, 0.0], dtype=torch.float64))
    back = theta_from_parts(batch, center, torch.ones_like(center), wrong, posed.center, torch.ones_like(center))
    found = pose_parts(batch, back, center)

    def turned_by(state: float) -> float:
        other = Theta(**{**vars(back), "state": torch.tensor([[0.0, state]], dtype=torch.float64)})
        relative = pose_parts(batch, other, center).rotation[0, 1].T @ wrong[0, 1]
        return float(torch.arccos((relative.trace() - 1) / 2))

    best = min(np.linspace(0.5, 1.1, 6001), key=turned_by)
    assert abs(float(back.state[0, 1]) - best) < 2e-4
    torch.testing.assert_close(found.center, posed.center)


def test_scale_carries_a_drawer_and_its_travel_along() -> None:
    obj = artsim.make("drawer", 1)
    q = sample_state(obj, StateOptions(mode="limits"), np.random.default_rng(4))
    larger = obj.scaled(1.7)
    batch = Trees.stack([obj.tree])
    theta = Theta.at_rest(batch)
    theta = Theta(**{**vars(theta), "state": torch.from_numpy(q)[None], "log_scale": theta.log_scale + np.log(1.7)})
    posed = pose_parts(batch, theta, torch.from_numpy(obj.box_center)[None])
    slides = np.array([t == "prismatic" for t in obj.tree.types])
    T = larger.tree.forward_kinematics(np.where(slides, 1.7 * q, q))
    expected = (T[:, :3, :3] @ larger.box_center[..., None])[..., 0] + T[:, :3, 3]
    np.testing.assert_allclose(posed.center[0], expected, atol=1e-9)
    np.testing.assert_allclose(joint_states(batch, theta)[0, 1:], (1.7 * q)[1:], atol=1e-12)


def test_posed_points_lie_in_the_posed_boxes() -> None:
    _, batch, theta, center, size = random_batch(8)
    points = center[:, :, None] + (torch.rand(*center.shape[:2], 50, 3, dtype=torch.float64) - 0.5) * size[:, :, None]
    posed = pose_parts(batch, theta, center)
    local = (posed.points(points, center) - posed.center[:, :, None]) @ posed.rotation
    assert (local.abs() <= 0.5 * (size * posed.scale)[:, :, None] + 1e-9).all()


def test_gradients_are_those_of_finite_differences() -> None:
    _, batch, theta, center, _ = random_batch(2, (4, 6))

    def centers(rotation: torch.Tensor, *others: torch.Tensor) -> torch.Tensor:
        moved = Theta(theta.rotation @ rotation_from_vector(rotation), *others)
        posed: Posed = pose_parts(batch, moved, center)
        return torch.cat([posed.center.ravel(), posed.rotation.ravel(), posed.scale.ravel()])

    start = [torch.zeros(2, 3), theta.translation, theta.log_scale, theta.state, theta.shift, theta.stretch]
    assert torch.autograd.gradcheck(centers, [value.double().requires_grad_() for value in start])


def test_rows_can_be_chosen_repeated_and_merged() -> None:
    _, _, theta, _, _ = random_batch(1)
    assert len(theta[1:3]) == 2
    assert theta.repeat(3).state[:3].eq(theta.state[0]).all()
    first = torch.tensor([True, False, False, False, False])
    mixed = theta.where(first, theta[[1, 1, 1, 1, 1]])
    assert mixed.state[0].eq(theta.state[0]).all()
    assert mixed.rotation[2].eq(theta.rotation[1]).all()
