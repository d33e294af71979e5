"""The beam search: parts below tell how round links above have turned."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

import artsim
from artperl.core.pose import Theta, pose_parts
from artperl.core.rotations import rotation_from_vector
from artperl.core.shapes import Observed, Shapes
from artperl.core.trees import Trees
from artperl.fitting.beam_search import _grid, _joint_order, beam, half_turns
from artperl.fitting.levenberg_marquardt import refine
from artperl.fitting.refine_options import RefineOptions
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.model.joints import Joint, Mimic
from artsim.model.kinematics import KinematicTree
from artsim.renderers import shared_renderer
from tests.conftest import installed

_RIGID = RefineOptions(sigma_scale=1e-3, sigma_aspect=1e-3, sigma_stretch=1e-3, sigma_shift=1e-3)


@cache
def view(seed: int) -> tuple[Shapes, Theta, Tensor, Tensor]:
    """An arm as a reference, the state that it is seen in, its cloud, and the part of each point."""
    arm = artsim.make("robot_arm", seed)
    options = SampleOptions(num_points=512)
    sample = draw_sample(arm, options, 0, seed, shared_renderer(options.renderer))
    shapes = Shapes.from_objects([arm], 64)
    shapes = replace(shapes, diagonal=torch.tensor([sample.diagonal]).float())
    root = torch.from_numpy(sample.T_camera_part[0]).float()
    true = replace(
        Theta.at_rest(shapes.trees), rotation=root[None, :3, :3], translation=root[None, :3, 3],
        state=torch.from_numpy(sample.joint_state).float()[None],
    )  # fmt: skip
    return shapes, true, torch.from_numpy(sample.points)[None], torch.from_numpy(sample.part.astype(np.int64))[None]


def centers_off(shapes: Shapes, theta: Theta, true: Theta) -> Tensor:
    """(B,) farthest that a part's middle is from where it is, in diagonals."""
    trees = shapes.trees.repeat(len(theta))
    at = pose_parts(trees, theta, shapes.box_center).center
    goal = pose_parts(shapes.trees, true, shapes.box_center).center
    return torch.linalg.vector_norm(at - goal, dim=-1).amax(1) / shapes.diagonal


def leaning(seed: int) -> Theta:
    """A start whose root leans by 17 degrees, the joints at rest."""
    shapes, true, _, _ = view(seed)
    rotation = rotation_from_vector(torch.tensor([[0.2, -0.2, 0.1]])) @ true.rotation
    return replace(true, rotation=rotation, state=shapes.trees.rest)


def search(seed: int) -> Theta:
    """What the search finds from there when labels are right."""
    shapes, _, cloud, part = view(seed)
    labels = torch.nn.functional.one_hot(part, shapes.trees.num_rows).float()
    return beam(shapes, cloud, labels, leaning(seed), 8, 64, _RIGID)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 3, 7])
def test_an_arm_is_found_where_refinement_alone_does_not_find_it(seed: int) -> None:
    shapes, true, cloud, part = view(seed)
    few = Observed.of(cloud[:, :256], part[:, :256])
    assert centers_off(shapes, refine(shapes, few, leaning(seed), _RIGID).theta, true) > 0.2
    found = search(seed)
    refined = refine(shapes.repeat(len(found)), few.repeat(len(found)), found, _RIGID)
    best = refined.theta[refined.energy.argmin()[None]]
    assert centers_off(shapes, best, true) < 0.05


def test_states_are_within_their_limits_and_differ() -> None:
    shapes, _, _, _ = view(7)
    found, trees = search(7), shapes.trees
    assert len(found) == 8
    assert ((found.state >= trees.lower) & (found.state <= trees.upper))[:, trees.free[0]].all()
    assert len(found.state.unique(dim=0)) == 8


def test_a_part_has_its_place_once_all_joints_that_move_it_have_their_states() -> None:
    tree = KinematicTree(
        [
            Joint("root", "free", -1),
            Joint("lower", "revolute", 0, lower=-1.0, upper=1.0),
            Joint("rod", "revolute", 0, lower=-1.0, upper=1.0, mimic=Mimic(3, 1.0, 0.0)),
            Joint("upper", "revolute", 1, lower=-1.0, upper=1.0),
            Joint("drawer", "prismatic", 0, lower=0.0, upper=0.2),
        ]
    )
    joints, turn = _joint_order(Trees.stack([tree], 6))
    assert joints == [1, 4, 3]
    assert turn.tolist() == [0, 1, 3, 3, 2, 0]  # the rod waits for what it follows; padding has its place at once


def test_joints_without_limits_are_looked_for_all_round() -> None:
    tree = KinematicTree(
        [
            Joint("root", "free", -1),
            Joint("wheel", "continuous", 0, lower=-np.inf, upper=np.inf),
            Joint("drawer", "prismatic", 0, lower=0.0, upper=0.24),
        ]
    )
    trees = Trees.stack([tree])
    round_about, along = _grid(trees, 1), _grid(trees, 2)
    torch.testing.assert_close(round_about.diff(), torch.full_like(round_about[1:], 2.0 * torch.pi / len(round_about)))
    assert 0.0 < along.min() < 0.01
    assert 0.23 < along.max() < 0.24


def test_a_part_as_an_object_of_its_own_is_where_it_is_in_the_whole() -> None:
    shapes, true, _, _ = view(7)
    posed = pose_parts(shapes.trees, true, shapes.box_center)
    alone = shapes.part(2)
    placed = replace(
        Theta.at_rest(alone.trees), rotation=posed.rotation[:, 2], translation=posed.translation[:, 2]
    )  # fmt: skip
    own = pose_parts(alone.trees, placed, alone.box_center).points(alone.points, alone.box_center)
    torch.testing.assert_close(own[:, 0], posed.points(shapes.points, shapes.box_center)[:, 2])


def test_half_turns_leave_what_hangs_from_a_shoulder_where_it_is() -> None:
    arm = artsim.load(Path(installed("pybullet_data").getDataPath(), "franka_panda", "panda.urdf"))
    shapes = Shapes.from_objects([arm], 64)
    rest = Theta.at_rest(shapes.trees)
    state = rest.state.clone()
    state[:, 1:7] = torch.tensor([0.5, 0.8, -1.0, -1.5, 0.4, 2.0])
    theta = replace(rest, state=state)
    others = half_turns(shapes, theta)
    assert others is not None
    assert torch.allclose((others.state - state)[0, 1:4], torch.tensor([-np.pi, -1.6, np.pi], dtype=state.dtype))
    before, after = (pose_parts(shapes.trees, values, shapes.box_center) for values in (theta, others[:1]))
    stays = torch.isclose(before.rotation, after.rotation, atol=1e-5).all(-1).all(-1)[0]
    assert stays.tolist() == [True, False, False, *[True] * (len(stays) - 3)]
    assert torch.allclose(before.center[0, stays], after.center[0, stays], atol=1e-5)


def test_limits_and_axes_that_do_not_meet_forbid_half_turns() -> None:
    shapes, true, _, _ = view(7)
    assert half_turns(shapes, true) is None
    laptop = Shapes.from_objects([artsim.make("laptop", 0)], 64)
    assert half_turns(laptop, Theta.at_rest(laptop.trees)) is None
