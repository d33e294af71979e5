"""Equations 6 and 7, and the refinement that minimises them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import artsim
from artperl.core.pose import Theta, Trees, clamp_state, pose_parts
from artperl.core.rotations import rotation_from_vector
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.paper_energy import joint_energy, part_energy, refine_by_gradient
from tests.artperl.fitting.problems import errors, perturbed


def test_joint_energy_holds_for_theta_and_counts_for_free_parts() -> None:
    trees = Trees.stack([artsim.make(category, 0).tree for category in ("laptop", "drawer")])
    theta = replace(Theta.at_rest(trees), state=clamp_state(trees, trees.rest + 0.7))
    rotation = pose_parts(trees, theta, torch.zeros_like(theta.shift)).rotation
    torch.testing.assert_close(joint_energy(trees, rotation), torch.zeros(2).double())
    tilted = rotation.clone()
    tilted[:, 1] = rotation_from_vector(torch.tensor([0.0, 0.0, 0.2], dtype=torch.float64)) @ tilted[:, 1]
    # A laptop's hinge, level, is carried by 2 sin(0.1) away from itself; so is a drawer's rail.
    torch.testing.assert_close(joint_energy(trees, tilted), torch.full((2,), 2 * np.sin(0.1)).double())


def test_part_energy_is_the_chamfer_distance_of_each_part() -> None:
    shapes = Shapes.from_objects([artsim.make("laptop", 3)], 64, dtype=torch.float64)
    theta = replace(Theta.at_rest(shapes.trees), translation=torch.tensor([[0.1, 0.0, 2.0]], dtype=torch.float64))
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    points = shapes.points.flatten(1, 2) + torch.tensor([0.0, 0.0, 2.0], dtype=torch.float64)
    part = torch.arange(2).repeat_interleave(64)[None]
    expected = 0.0
    for k in range(2):
        a, b = posed.points(shapes.points, shapes.box_center)[0, k].numpy(), points[0, part[0] == k].numpy()
        square = ((a[:, None] - b) ** 2).sum(-1)
        expected += square.min(0).mean() + square.min(1).mean()
    found = part_energy(shapes, Observed.of(points, part), posed)
    assert float(found) == pytest.approx(expected / float(shapes.diagonal) ** 2, rel=1e-6)


def test_the_papers_energy_leads_back_too(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    start = perturbed(shapes, truth, 10.0, 0.05)
    result = refine_by_gradient(shapes, observed, start, two_sided=False)
    before, after = errors(shapes, start, truth), errors(shapes, result.theta, truth)
    assert np.median(after[0]) < 0.5 * np.median(before[0])
    assert np.median(after[1]) < 0.8 * np.median(before[1])  # parts slide along themselves
