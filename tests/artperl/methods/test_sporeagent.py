"""SporeAgent registers parts apart, and comes back from disk as it was."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import artsim
from artperl.agent.registration import part_goals, part_problems
from artperl.agent.start import MeanView, mean_start
from artperl.core.shapes import Observed
from artperl.evaluation.metrics import rotation_error
from artperl.methods.retrieved import Sizes
from artperl.methods.sporeagent import SporeAgent, posed_apart
from artperl.retrieval.shape_base import ShapeBase
from artperl.retrieval.siamese import by_siamese
from artperl.training.fitting_problems import part_truth
from tests.artperl.worlds import view


@pytest.fixture(scope="module")
def method() -> SporeAgent:
    torch.manual_seed(0)
    networks = SporeAgent.new_networks(Sizes(2, 16, 8, 8))
    for network in networks.values():
        network.half().float()  # as precise as files are
    base = ShapeBase.of([artsim.make("laptop", seed) for seed in range(4)], 64)
    return SporeAgent(**networks, base=by_siamese(base, networks["siamese"]))


def test_parts_at_their_goals_are_the_true_poses_and_the_joint_follows() -> None:
    obj = artsim.make("laptop", 11)
    sample, base = view(obj, 3), ShapeBase.of([obj], 64)
    observed = Observed.of(torch.from_numpy(sample.points)[None], torch.from_numpy(sample.part.astype(np.int64))[None])
    start = mean_start(base.shapes, observed.points, MeanView())
    problems = part_problems(base.shapes, observed, start, torch.Generator().manual_seed(0))
    assert problems is not None
    _, rotation, center, _, _, _ = part_truth(sample, 2)
    posed = posed_apart(base.shapes, start, problems, part_goals(problems, rotation[None], center[None]))
    assert rotation_error(posed.rotation[0].numpy(), rotation.numpy()).max() < 1e-2
    np.testing.assert_allclose(posed.center[0], center, atol=1e-5)


def test_a_policy_that_does_nothing_leaves_the_parts_where_the_reference_has_them(method: SporeAgent) -> None:
    still = method.policy
    for head in (still.turn, still.move):
        torch.nn.init.zeros_(head[-1].weight)  # type: ignore[arg-type]
        torch.nn.init.zeros_(head[-1].bias)  # type: ignore[arg-type]
    estimate = method(view(artsim.make("laptop", 7), 1).points)
    turn = estimate.rotation[0].T @ estimate.rotation[1]
    axis = estimate.rotation[0].T @ estimate.joint_axis[1]
    np.testing.assert_allclose(turn @ axis, axis, atol=1e-5)  # still one kinematic object
    assert estimate.joint_limits[1, 0] <= estimate.state[1] <= estimate.joint_limits[1, 1]
    assert len(estimate.part) == 2048
