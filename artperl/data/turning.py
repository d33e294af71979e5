"""Clouds turned about to the rest frame, as an estimator that looks twice turns them for its second look."""

import numpy as np
from scipy.spatial.transform import Rotation

from artsim.model.kinematics import Array
from artsim.observing.sample import Sample

_MEAN_ERROR = np.deg2rad(6.0)
"""Of the first look; the errors of ``generic`` on fronts have medians of 2 to 5 degrees and long tails."""
_LOST = 0.06
"""Share of clouds whose first look takes another side for the front."""


def turn_upright(sample: Sample, rng: np.random.Generator) -> Array:
    """Rotation (3, 3) from the camera to about the rest frame: to that of the root, with the errors of a first look."""
    axis = rng.normal(size=3)
    off = Rotation.from_rotvec(rng.exponential(_MEAN_ERROR) * axis / np.linalg.norm(axis))
    if rng.random() < _LOST:
        off = off * Rotation.from_rotvec([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    turn: Array = off.as_matrix() @ sample.T_camera_part[0, :3, :3].T
    return turn
