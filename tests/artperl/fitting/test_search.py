"""The search: one score, one gate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from hypothesis import assume, given
from hypothesis import strategies as st

import artsim
from artperl.agent.policy import Agent
from artperl.core.clock import Clock
from artperl.core.clouds import Clouds
from artperl.core.pose import Theta
from artperl.core.shapes import Shapes
from artperl.evaluation import metrics
from artperl.evaluation.metrics import true_poses
from artperl.fitting.hypotheses import Context, half_turn_about_vertical
from artperl.fitting.options import EstimatorOptions
from artperl.fitting.search import find_fit, fits_badly, outside, score
from artperl.methods.full import Estimator
from artperl.retrieval.references import retrieve_references
from artperl.retrieval.shape_base import ShapeBase
from artsim.model.camera import look_at_transform
from artsim.observing.sample import Sample
from tests.artperl.worlds import Oracle


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
    round_there = outside(half_turn_about_vertical(theta), (azimuth - 10.0, azimuth + 10.0))
    assert bool(round_there) == (170.0 * np.cos(up) > 15.0 or below)


def test_what_does_not_fit_is_looked_for_again(base: ShapeBase, sample: Sample) -> None:
    torch.manual_seed(0)
    options = EstimatorOptions(references=2, agent_steps=3, retry_residual=0.0)
    oracle = Oracle(sample, 2)
    once = Estimator(oracle, base, Agent(16), replace(options, retry_residual=np.inf))(sample.points)
    assert "views around" not in once.milliseconds
    assert once.trajectory.shape == (2, 2, 4, 4)
    again = Estimator(oracle, base, Agent(16), options)(sample.points)
    assert again.milliseconds["views around"] > 0.0
    # An agent that knows nothing does no harm: where it leads competes with the other starts.
    assert again.residual <= once.residual
    rotation, _ = true_poses(sample)
    assert metrics.rotation_error(again.rotation, rotation).max() < 3.0


def test_no_residual_makes_up_for_a_view_from_where_the_camera_is_not() -> None:
    assert score(0.3, False, 1.0) < score(0.0, True)
    residual, elsewhere = torch.tensor([0.001, 0.02, 0.01]), torch.tensor([True, False, False])
    assert int(score(residual, elsewhere).argmin()) == 2
    assert int(score(torch.tensor([0.02, 0.01]), torch.tensor([True, True])).argmin()) == 1


def test_fits_are_tried_again_where_they_are_bad(base: ShapeBase, sample: Sample) -> None:
    clouds = Clouds.of(torch.from_numpy(sample.points)[None])
    perceived = Oracle(sample, 2)(clouds.points)
    cloud = torch.from_numpy(sample.points)[None]
    options = EstimatorOptions()
    fit = find_fit(Context(cloud, clouds, perceived, retrieve_references(base, perceived, 2), None, options), Clock())
    assert not fits_badly(replace(fit, residual=options.retry_residual), options)
    assert fits_badly(replace(fit, residual=1.01 * options.retry_residual), options)
    assert fits_badly(replace(fit, outside=True), options)
    assert fits_badly(None, options)
