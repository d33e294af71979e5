"""Actions move references as they say, and the expert knows the way."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from scipy.spatial.transform import Rotation

import artsim
from artperl.agent.actions import (
    MAGNITUDES,
    MOVE,
    NOTHING,
    NUM_AXES,
    SCALE,
    STATE,
    STEPS,
    TURN,
    action_mask,
    apply,
    compressed,
    expert,
    move,
    nearest_bin,
    residual,
    rotation_vector,
)
from artperl.core.pose import Theta, pose_parts
from artperl.core.rotations import rotation_from_vector
from artperl.core.shapes import Shapes

CATEGORIES = ("laptop", "drawer", "eyeglasses", "robot_arm")


@pytest.fixture(scope="module")
def shapes() -> Shapes:
    objects = [artsim.make(category, seed) for category in CATEGORIES for seed in (1, 2)]
    return Shapes.from_objects(objects, points_per_part=16, dtype=torch.float64)


@pytest.fixture(scope="module")
def radius(shapes: Shapes) -> torch.Tensor:
    return 0.5 * shapes.diagonal


def some_theta(shapes: Shapes, seed: int) -> Theta:
    """Any pose, size and state in the limits, the anchors where they are."""
    generator = torch.Generator().manual_seed(seed)
    B, P = shapes.trees.valid.shape
    trees = shapes.trees
    theta = Theta.at_rest(trees)
    turn = torch.randn(B, 3, generator=generator, dtype=torch.float64)
    share = torch.rand(B, P, generator=generator, dtype=torch.float64)
    low = torch.where(torch.isfinite(trees.lower), trees.lower, -3.0)
    high = torch.where(torch.isfinite(trees.upper), trees.upper, 3.0)
    return replace(
        theta,
        rotation=rotation_from_vector(turn),
        translation=torch.randn(B, 3, generator=generator, dtype=torch.float64),
        log_scale=0.2 * torch.randn(B, 3, generator=generator, dtype=torch.float64),
        state=torch.where(trees.free, low + share * (high - low), trees.rest),
    )


def test_the_residual_leads_to_the_goal_at_once(shapes: Shapes, radius: torch.Tensor) -> None:
    here, goal = some_theta(shapes, 0), some_theta(shapes, 1)
    there = move(shapes, here, residual(shapes, here, goal, radius), radius)
    posed, wanted = (pose_parts(shapes.trees, theta, shapes.box_center) for theta in (there, goal))
    valid = shapes.trees.valid
    torch.testing.assert_close(posed.rotation[valid], wanted.rotation[valid], atol=1e-9, rtol=0)
    torch.testing.assert_close(posed.center[valid], wanted.center[valid], atol=1e-9, rtol=0)
    torch.testing.assert_close(posed.scale[valid], wanted.scale[valid], atol=1e-9, rtol=0)


def test_a_move_of_any_size_is_what_the_residual_to_its_end_says(shapes: Shapes, radius: torch.Tensor) -> None:
    generator = torch.Generator().manual_seed(11)
    here = some_theta(shapes, 10)
    step = 0.3 * torch.randn(*shapes.trees.valid.shape, NUM_AXES, generator=generator, dtype=torch.float64)
    limited = torch.isfinite(shapes.trees.lower) & torch.isfinite(shapes.trees.upper)
    step[..., STATE] = torch.where(limited & (shapes.trees.depth > 0), 0.0, step[..., STATE])  # or limits may stop it
    found = residual(shapes, here, move(shapes, here, step, radius), radius)
    torch.testing.assert_close(found, step * action_mask(shapes.trees), atol=1e-9, rtol=0)


def test_the_root_turns_and_grows_about_the_centre_of_its_box(shapes: Shapes, radius: torch.Tensor) -> None:
    theta = some_theta(shapes, 2)
    step = torch.zeros(*shapes.trees.valid.shape, NUM_AXES, dtype=torch.float64)
    step[:, 0, TURN], step[:, 0, SCALE] = 0.3, 0.1
    moved = move(shapes, theta, step, radius)
    before, after = (pose_parts(shapes.trees, t, shapes.box_center).center[:, 0] for t in (theta, moved))
    torch.testing.assert_close(before, after)


def test_a_drawer_slides_by_the_length_that_the_action_says(shapes: Shapes, radius: torch.Tensor) -> None:
    theta = replace(some_theta(shapes, 3), state=shapes.trees.lower.clamp(min=-3.0))
    slides = (shapes.trees.slide != 0) & (shapes.trees.turn == 0) & shapes.trees.free
    action = torch.full((*slides.shape, NUM_AXES), NOTHING)
    action[..., STATE] = torch.where(slides, NOTHING + 3, NOTHING)
    action[:, 0] = NOTHING
    moved = apply(shapes, theta, action, radius)
    before, after = (pose_parts(shapes.trees, t, shapes.box_center).center for t in (theta, moved))
    first = slides & (shapes.trees.depth == 1)
    gone = torch.linalg.vector_norm(after - before, dim=-1)
    wanted = (MAGNITUDES[2] * radius)[:, None].expand_as(gone)
    torch.testing.assert_close(gone[first], wanted[first])


def test_nothing_moves_along_axes_that_a_part_does_not_have(shapes: Shapes, radius: torch.Tensor) -> None:
    theta = some_theta(shapes, 4)
    mask = action_mask(shapes.trees)
    action = torch.where(mask, NOTHING, 0)
    moved = apply(shapes, theta, action, radius)
    for name in ("rotation", "translation", "log_scale", "state", "shift"):
        torch.testing.assert_close(getattr(moved, name), getattr(theta, name))
    assert not mask[~shapes.trees.valid].any()


def test_the_expert_comes_within_the_smallest_step_of_the_goal(shapes: Shapes, radius: torch.Tensor) -> None:
    theta, goal = some_theta(shapes, 5), some_theta(shapes, 6)
    for _ in range(80):
        theta = apply(shapes, theta, expert(shapes, theta, goal, radius), radius)
    left = residual(shapes, theta, goal, radius).abs()
    assert left.max() < MAGNITUDES[0]


def test_the_expert_never_ends_farther_away_on_any_axis(shapes: Shapes, radius: torch.Tensor) -> None:
    theta, goal = some_theta(shapes, 7), some_theta(shapes, 8)
    # A slide's lengths change with the scale, and turns about several axes at once do not add up.
    theta = replace(theta, log_scale=goal.log_scale, rotation=goal.rotation)
    before = residual(shapes, theta, goal, radius)
    after = residual(shapes, apply(shapes, theta, expert(shapes, theta, goal, radius), radius), goal, radius)
    assert (after.abs() <= before.abs() + 1e-9).all()
    far = before.abs() > 2 * MAGNITUDES[-1]
    assert far.any()
    torch.testing.assert_close((before - after)[far].abs(), torch.full_like(before[far], MAGNITUDES[-1]))


def test_rotation_vectors_of_all_angles() -> None:
    generator = torch.Generator().manual_seed(0)
    axis = torch.nn.functional.normalize(torch.randn(200, 3, generator=generator, dtype=torch.float64), dim=-1)
    angle = torch.cat([torch.linspace(0.0, torch.pi - 1e-6, 196), torch.tensor([0.0, 1e-9, 1e-5, torch.pi - 1e-9])])
    vector = axis * angle.double()[:, None]
    found = rotation_vector(rotation_from_vector(vector))
    torch.testing.assert_close(rotation_from_vector(found), rotation_from_vector(vector), atol=1e-7, rtol=0)
    torch.testing.assert_close(torch.linalg.vector_norm(found, dim=-1), angle.double(), atol=1e-6, rtol=0)


@pytest.mark.parametrize("axis", range(3))
def test_turns_and_moves_are_along_the_axes_of_the_rest_frame(shapes: Shapes, radius: torch.Tensor, axis: int) -> None:
    """Done to the posed points by hand: turned about the line through the middle of the root's box, and moved."""
    theta = some_theta(shapes, 9)
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    line = posed.rotation[:, 0, :, axis]  # where the rest frame's axis points in the camera's
    points, middle = posed.points(shapes.points, shapes.box_center), posed.center[:, 0, None, None]
    turn = torch.from_numpy(Rotation.from_rotvec(0.2 * line.numpy()).as_matrix())[:, None, None]
    turned = (turn @ (points - middle)[..., None])[..., 0] + middle
    moved = points + (0.5 * radius[:, None] * line)[:, None, None]
    for where, size, wanted in ((TURN, 0.2, turned), (MOVE, 0.5, moved)):
        step = torch.zeros(*shapes.trees.valid.shape, NUM_AXES, dtype=torch.float64)
        step[:, 0, where.start + axis] = size
        after = pose_parts(shapes.trees, move(shapes, theta, step, radius), shapes.box_center)
        found = after.points(shapes.points, shapes.box_center)
        torch.testing.assert_close(found[shapes.has_surface], wanted[shapes.has_surface], atol=1e-9, rtol=0)


def test_the_expert_does_the_same_wherever_the_scene_is_seen_from(shapes: Shapes, radius: torch.Tensor) -> None:
    theta, goal = some_theta(shapes, 12), some_theta(shapes, 13)
    turn = rotation_from_vector(torch.tensor([[0.4, -1.1, 0.7]], dtype=torch.float64))
    away = torch.tensor([0.3, 0.1, -2.0], dtype=torch.float64)
    seen = [replace(t, rotation=turn @ t.rotation, translation=t.translation @ turn[0].T + away) for t in (theta, goal)]
    torch.testing.assert_close(residual(shapes, *seen, radius), residual(shapes, theta, goal, radius))


def test_the_nearest_bin_is_that_of_all_bins_by_the_scale_of_errors() -> None:
    step = torch.linspace(-0.6, 0.6, 4001, dtype=torch.float64)
    apart = (compressed(step)[:, None] - compressed(STEPS.double())).abs()
    two = apart.topk(2, largest=False).values
    clear = two[:, 1] - two[:, 0] > 1e-6
    assert clear.double().mean() > 0.99
    assert torch.equal(nearest_bin(step)[clear], apart.argmin(1)[clear])
    assert torch.equal(nearest_bin(STEPS), torch.arange(len(STEPS)))
