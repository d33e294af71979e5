"""Generators of hypotheses, and what they look at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from artperl.core.clock import Clock
from artperl.core.clouds import Clouds
from artperl.data.categories import objects_of
from artperl.evaluation.samples import TEST_SEEDS, frozen_samples
from artperl.fitting.hypotheses import (
    Context,
    Hypotheses,
    chain_states,
    half_turn,
    hinged_root,
    other_sides,
    part_weights,
    perceived_pose,
)
from artperl.fitting.options import EstimatorOptions
from artperl.fitting.search import find_fit
from artperl.methods.full import Estimator
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.references import retrieve_references
from artperl.retrieval.shape_base import ShapeBase
from artsim.observing.sample import Sample
from tests.artperl.worlds import Oracle


def test_only_chains_of_joints_are_searched_for_down_the_tree(estimator: Estimator, sample: Sample) -> None:
    (seen,) = frozen_samples(["robot_arm"], 1, 1, parts="any", max_parts=10)
    arm = ShapeBase.of(objects_of(["robot_arm"], 1, TEST_SEEDS, "any", 10), 64)
    for shown, base in ((sample, estimator.base), (seen, by_boxes(arm))):
        oracle, cloud = Oracle(shown, len(shown.joint_type)), torch.from_numpy(shown.points)[None]
        clouds = Clouds.of(cloud)
        perceived = oracle(clouds.points)
        found = retrieve_references(base, perceived, 1)
        context = Context(cloud, clouds, perceived, found, EstimatorOptions())
        proposed = chain_states(context, None)
        assert (proposed is not None) == (shown is seen)
        assert chain_states(replace(context, options=EstimatorOptions(beam=0)), None) is None


def test_parts_count_by_the_root_of_their_points_but_no_point_for_more_than_eight() -> None:
    part = torch.tensor([[0] * 1600 + [1] * 400 + [2], [0] * 500 + [2] * 1501])
    weight = part_weights(part)
    assert [weight[0, part[0] == k].sum().item() for k in range(3)] == [1600.0, 800.0, 8.0]
    total = [weight[1, part[1] == k].sum().item() for k in (0, 2)]
    assert total[0] / total[1] == pytest.approx((500 / 1501) ** 0.5)


def test_each_generator_proposes_hypotheses_of_its_own_reference(estimator: Estimator, sample: Sample) -> None:
    cloud = torch.from_numpy(sample.points)[None]
    clouds = Clouds.of(cloud)
    perceived = Oracle(sample, 2)(clouds.points)
    found = retrieve_references(estimator.base, perceived, 3)
    context = Context(cloud, clouds, perceived, found, EstimatorOptions())
    proposed = perceived_pose(context, None)
    assert proposed.row == found.row.tolist()
    assert hinged_root(context, None) is None  # the base of the laptop shows
    assert half_turn(context, None) is None
    best = find_fit(context, Clock())
    assert other_sides(context, best) is None  # the camera may be anywhere
    sides = other_sides(context, replace(best, outside=True))
    assert sides is not None
    both = Hypotheses.join([proposed, sides])
    assert both.row == [*found.row.tolist(), *[best.row] * 4]
    assert len(both.shapes) == len(both.theta) == 7


@pytest.mark.parametrize("flip", [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]])
def test_other_sides_stand_however_the_fit_lies(estimator: Estimator, sample: Sample, flip: list[float]) -> None:
    """From a camera above the horizon all four sides are seen from above, a quarter turn apart."""
    cloud = torch.from_numpy(sample.points)[None]
    clouds = Clouds.of(cloud)
    perceived = Oracle(sample, 2)(clouds.points)
    found = retrieve_references(estimator.base, perceived, 1)
    context = Context(cloud, clouds, perceived, found, EstimatorOptions())
    best = find_fit(context, Clock())
    theta = replace(best.theta, rotation=best.theta.rotation * torch.tensor(flip))
    sides = other_sides(context, replace(best, theta=theta, outside=True))
    assert sides is not None
    x, y, z = (sides.theta.rotation.mT @ sides.theta.translation[:, :, None])[..., 0].double().numpy().T
    assert (z < 0.0).all()  # from the camera down to the object
    azimuth = np.rad2deg(np.unwrap(np.arctan2(y, x)))
    np.testing.assert_allclose(abs(np.diff(azimuth)), 90.0, atol=0.1)
