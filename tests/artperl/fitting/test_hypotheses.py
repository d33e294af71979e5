"""Generators of hypotheses, and what they look at."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

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
    assert both.row == [*found.row.tolist(), *[best.row] * 5]
    assert len(both.shapes) == len(both.theta) == 8
    turns = (best.theta.rotation.mT @ both.theta.rotation[3:]).double().numpy()
    angle = np.rad2deg(Rotation.from_matrix(turns).as_rotvec())
    np.testing.assert_allclose(np.linalg.norm(angle, axis=1), [180.0, 180.0, 180.0, 90.0, 90.0], atol=0.1)
    np.testing.assert_allclose(abs(angle[:3]), 180.0 * np.eye(3), atol=0.1)  # about each axis once
    np.testing.assert_allclose(angle[3:], [[0.0, 0.0, 90.0], [0.0, 0.0, -90.0]], atol=0.1)
