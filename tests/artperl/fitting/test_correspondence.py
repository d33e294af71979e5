"""Distances between clouds and posed references."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

from artperl.core.pose import Theta, pose_parts
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.correspondence import Target
from tests.artperl.fitting.torch_matches import match


def test_true_poses_are_at_next_to_no_distance(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    matches = match(shapes, Target.of(observed, shapes.diagonal), truth, 0.3)
    assert matches.square.sqrt().median() < 1e-3
    assert float((matches.weight * matches.square).sum(1).max()) < 2e-4


def test_a_point_goes_with_the_nearest_facing_point_of_its_own_part(laptops: tuple[Shapes, Observed, Theta]) -> None:
    """By the metric of point to plane and tangent, over all pairs."""
    shapes, observed, truth = laptops
    matches = match(shapes, Target.of(observed, shapes.diagonal), truth, 0.0)
    posed = pose_parts(shapes.trees, truth, shapes.box_center)
    points, normals = posed.points(shapes.points, shapes.box_center), posed.normals(shapes.normals)
    found = least = 0.0
    for b in range(len(shapes)):
        for k in range(2):
            own = observed.part[b] == k
            facing = (points[b, k] * normals[b, k]).sum(-1) < 0.0
            apart = observed.points[b, own][:, None] - points[b, k, facing]
            cost = (apart * normals[b, k, facing]).sum(-1) ** 2 + 0.4**2 * apart.square().sum(-1)
            least += float(cost.amin(1).sum())
            index = (shapes.points[b, k, facing][None] - matches.local[b, own][:, None]).square().sum(-1).argmin(1)
            found += float(cost.gather(1, index[:, None]).sum())
    assert found == pytest.approx(least, rel=1e-3)


def test_a_reference_that_is_too_large_lies_outside_the_outline(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    target = Target.of(observed, shapes.diagonal)
    outside = []
    for factor in (1.0, 1.5):
        theta = replace(truth, log_scale=truth.log_scale + torch.tensor(factor).log())
        square = match(shapes, target, theta, 0.3).square[:, observed.points.shape[1] :]
        outside.append(square.sqrt().mean(1))
    assert (outside[0] < 0.01).all()
    assert (outside[1] > 5.0 * outside[0]).all()
