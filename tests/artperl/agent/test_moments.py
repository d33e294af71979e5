"""Moments of offsets are the motions that caused them."""

from __future__ import annotations

from dataclasses import replace

import torch

from artperl.agent.decision_process import Fitting
from artperl.agent.moments import NUM_MOMENTS, moments
from artperl.core.rotations import rotation_from_vector
from tests.artperl.worlds import small_problem


def _steps(values: torch.Tensor) -> torch.Tensor:
    """Undo the logarithmic scale."""
    return values.sign() * 0.003 * ((values.abs() * torch.tensor(101.0).log()).exp() - 1.0)


def test_a_small_motion_of_the_reference_is_read_off_its_offsets() -> None:
    problem = small_problem("laptop")
    view = Fitting(problem.shapes, problem.observed, problem.goal).view()
    turn, move = torch.tensor([0.01, -0.02, 0.015]), torch.tensor([0.02, 0.01, -0.01])
    # Where a reference would be that must turn and move like that to lie on the observed points.
    source = (view.observed - move) @ rotation_from_vector(-turn).T
    found = _steps(moments(replace(view, offset=source - view.observed)))
    assert found.shape == (*view.valid.shape, NUM_MOMENTS)
    assert (found[:, 0, 8:11] - turn).abs().max() < 3e-3
    middle = view.observed.mean(1)
    expected = move + torch.linalg.cross(turn.expand_as(middle), middle)
    assert (found[:, 0, 11:] - expected).abs().max() < 3e-3


def test_a_hinge_is_read_off_the_offsets_of_its_part() -> None:
    problem = small_problem("laptop")
    view = Fitting(problem.shapes, problem.observed, problem.goal).view()
    axis, anchor = view.joint[:, 1, :3], view.joint[:, 1, 3:]
    local = view.observed - anchor[:, None]
    turned = local @ rotation_from_vector(-0.05 * axis).transpose(1, 2)
    offset = torch.where((view.part == 1)[..., None], turned - local, 0.0)
    found = _steps(moments(replace(view, offset=offset)))
    seen = (view.part == 1).sum(1) > 20
    assert seen.any()
    assert ((found[:, 1, 6] - 0.05).abs() < 0.01)[seen].all()


def test_no_offset_asks_for_no_motion() -> None:
    problem = small_problem("laptop")
    view = Fitting(problem.shapes, problem.observed, problem.goal).view()
    assert moments(replace(view, offset=torch.zeros_like(view.offset))).abs().max() == 0.0
