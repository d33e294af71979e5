"""The search: one score."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from hypothesis import assume, given
from hypothesis import strategies as st

import artsim
from artperl.core.pose import Theta
from artperl.core.shapes import Shapes
from artperl.evaluation import metrics
from artperl.evaluation.metrics import true_poses
from artperl.fitting.search import outside, score
from artperl.methods.full import Estimator
from artsim.model.camera import look_at_transform
from artsim.observing.sample import Sample


@given(
    azimuth=st.floats(-180.0, 180.0), elevation=st.floats(-60.0, 60.0), middle=st.floats(-180.0, 180.0),
    half=st.floats(0.0, 120.0),
)  # fmt: skip
def test_what_is_seen_from_elsewhere_is_told(azimuth: float, elevation: float, middle: float, half: float) -> None:
    """By the arc on a sphere about the object, from the camera to the nearest meridian of the range; or from below."""
    side, up = np.deg2rad([azimuth, elevation])
    eye = np.array([-np.cos(side) * np.cos(up), -np.sin(side) * np.cos(up), np.sin(up)])
    T = np.linalg.inv(look_at_transform(eye, np.zeros(3)))
    trees = Shapes.from_objects([artsim.make("laptop", 1)], 8, dtype=torch.float64).trees
    theta = replace(
        Theta.at_rest(trees), rotation=torch.from_numpy(T[None, :3, :3]), translation=torch.from_numpy(T[None, :3, 3])
    )
    arc = max(abs((azimuth - middle + 180.0) % 360.0 - 180.0) - half, 0.0) * np.cos(up)
    assume(abs(arc - 15.0) > 1e-6 and abs(elevation + 25.0) > 1e-6)
    below = elevation < -25.0
    assert bool(outside(theta, (middle - half, middle + half))) == (arc > 15.0 or below)
    assert not outside(theta, None)
    turned = replace(theta, rotation=theta.rotation * torch.tensor([-1.0, -1.0, 1.0]))  # half a turn about z
    round_there = outside(turned, (azimuth - 10.0, azimuth + 10.0))
    assert bool(round_there) == (170.0 * np.cos(up) > 15.0 or below)


def test_no_residual_makes_up_for_a_view_from_where_the_camera_is_not() -> None:
    assert score(1.3, False) < score(0.0, True)
    residual, elsewhere = torch.tensor([0.001, 0.02, 0.01]), torch.tensor([True, False, False])
    assert int(score(residual, elsewhere).argmin()) == 2
    assert int(score(torch.tensor([0.02, 0.01]), torch.tensor([True, True])).argmin()) == 1


def test_a_fit_seen_from_elsewhere_is_turned_round(estimator: Estimator, sample: Sample) -> None:
    """Told that the camera is behind, the estimate of a laptop that is seen from in front turns its back."""
    plain = estimator(sample.points)
    rotation, _ = true_poses(sample)
    assert metrics.rotation_error(plain.rotation, rotation).max() < 4.0
    found = {}
    for middle in (0.0, 180.0):
        options = replace(estimator.options, seen_from=(middle - 75.0, middle + 75.0))
        found[middle] = replace(estimator, options=options)(sample.points)
    assert np.array_equal(found[0.0].T_camera_part, plain.T_camera_part)
    front = [estimate.T_camera_part[0, :3, :3].T @ estimate.T_camera_part[0, :3, 3] for estimate in found.values()]
    assert front[0][0] > 0.0 > front[1][0]  # from the camera to the object, in its frame: its front is at -X
