"""Labels: odds of perception against distances from what is fitted."""

from __future__ import annotations

import numpy as np

from artperl.core.labels import labels_by_boxes


def test_points_are_of_a_part_whose_box_they_are_in() -> None:
    """Two boxes side by side, the second one turned: odds decide within both and within neither, boxes elsewhere."""
    T = np.tile(np.eye(4), (2, 1, 1))
    T[1, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    center, size = np.array([[0.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([[1.0, 1.0, 1.0], [0.2, 1.2, 1.0]])
    points = np.array([[0.2, 0.0, 0.0], [0.2, 0.05, 0.0], [0.45, 0.0, 0.0], [1.4, 0.0, 0.0], [0.0, 0.0, 0.0]])
    odds = np.log([[0.1, 0.8, 0.1], [0.8, 0.1, 0.1], [0.3, 0.6, 0.1], [0.9, 0.05, 0.05], [np.nan] * 3])
    assert labels_by_boxes(points, T, center, size, odds, 0.01).tolist() == [0, 0, 1, 1, -1]
