"""Labels: odds of perception against distances from what is fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import artsim
from artperl.core.labels import label_log_odds, labels_by_boxes, labels_by_surface
from artperl.core.pose import Theta
from artperl.core.shapes import Observed, Shapes
from tests.artperl.worlds import view


def test_points_are_of_a_part_whose_box_they_are_in() -> None:
    """Two boxes side by side, the second one turned: odds decide within both and within neither, boxes elsewhere."""
    T = np.tile(np.eye(4), (2, 1, 1))
    T[1, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    center, size = np.array([[0.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([[1.0, 1.0, 1.0], [0.2, 1.2, 1.0]])
    points = np.array([[0.2, 0.0, 0.0], [0.2, 0.05, 0.0], [0.45, 0.0, 0.0], [1.4, 0.0, 0.0], [0.0, 0.0, 0.0]])
    odds = np.log([[0.1, 0.8, 0.1], [0.8, 0.1, 0.1], [0.3, 0.6, 0.1], [0.9, 0.05, 0.05], [np.nan] * 3])
    assert labels_by_boxes(points, T, center, size, odds, 0.01).tolist() == [0, 0, 1, 1, -1]


def test_log_odds_are_those_of_bayes_with_gaussian_distances() -> None:
    """The posterior of two parts whose points scatter by sigma over the root of two, as a product of densities."""
    prior, distance, sigma = np.array([0.7, 0.3]), np.array([0.5, 0.2]), 0.4
    density = np.exp(-0.5 * (distance / (sigma / np.sqrt(2.0))) ** 2)
    expected = np.log(prior[0] * density[0]) - np.log(prior[1] * density[1])
    found = label_log_odds(np.log(prior), distance, sigma)
    assert found[0] - found[1] == pytest.approx(expected)


def test_surfaces_tell_labels_where_perception_does_not() -> None:
    """Points of a laptop in its true pose: labels without any odds are true ones, and sure odds stay."""
    obj = artsim.make("laptop", 3).with_diagonal(1.0)
    sample = view(obj, 3, 512)
    shapes = Shapes.from_objects([obj], 2048)
    at_rest = Theta.at_rest(shapes.trees)
    rotation, translation = (torch.from_numpy(v).float()[None] for v in (
        sample.T_camera_part[0, :3, :3], sample.T_camera_part[0, :3, 3]))  # fmt: skip
    state = torch.from_numpy(sample.joint_state).float()[None]
    theta = replace(at_rest, rotation=rotation, translation=translation, state=state)
    observed = Observed.of(torch.from_numpy(sample.points)[None], torch.zeros(1, len(sample.points), dtype=torch.int64))
    unsure = torch.zeros(1, len(sample.points), 2)
    found = labels_by_surface(shapes, observed, theta, unsure)[0].numpy()
    assert (found == sample.part).mean() > 0.97
    sure = 1e4 * torch.tensor([0.0, 1.0]).expand_as(unsure)
    assert labels_by_surface(shapes, observed, theta, sure).all()
