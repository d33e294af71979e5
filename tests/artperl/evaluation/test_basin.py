"""Starts are as far off as they are said to be; parts are covered where their surfaces are near."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from artperl.agent.policy import Agent
from artperl.evaluation import metrics
from artperl.evaluation.basin import ANGLES, _apart, basin_problem, perturb_goal, run_basin
from artperl.fitting.options import EstimatorOptions
from artperl.methods.full import Estimator
from artperl.perception.network import Perception
from tests.artperl.worlds import small_base, small_problem


def test_starts_are_as_far_off_as_they_are_said_to_be() -> None:
    problem = small_problem("laptop")
    start = perturb_goal(problem, 0.5)
    off = metrics.rotation_error(start.rotation.double().numpy(), problem.goal.rotation.double().numpy())
    np.testing.assert_allclose(off, np.rad2deg(0.5), atol=1e-2)
    near = perturb_goal(problem, 0.5, "near")
    assert (near.state - problem.goal.state).abs().max() <= 0.5
    assert not torch.equal(near.state, start.state)
    torch.manual_seed(0)
    estimator = Estimator(Perception(2, 16), small_base("laptop"), Agent(16), EstimatorOptions(num_points=128))
    lines: list[str] = []
    found = run_basin(estimator, basin_problem(estimator, ["laptop"], count=2), lines.append)
    assert [row["start_deg"] for row in found] == list(ANGLES)
    assert all(0.0 <= row["agent and refinement"] <= 1.0 for row in found)


def test_parts_are_covered_when_their_surfaces_are_near() -> None:
    problem = small_problem("laptop")
    goal, shapes = problem.goal, problem.shapes
    valid = shapes.trees.valid.numpy()
    assert _apart(problem, goal)[valid].max() < 1e-3
    diagonal = torch.linalg.vector_norm(shapes.box_size[:, 0], dim=-1)
    for share in (0.05, 1.0):
        away = torch.tensor([0.0, 0.0, share]) * diagonal[:, None]
        apart = _apart(problem, replace(goal, translation=goal.translation + away))[:, 0]
        # Never farther than it was moved; and by a whole diagonal, no part is where it was.
        assert (apart <= share + 1e-6).all()
        assert (apart > 0.1).all() == (share == 1.0)
