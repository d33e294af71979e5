"""What looks alike is told alike: of the two truths of a symmetric object, training sees one."""

from __future__ import annotations

import numpy as np
import pytest

import artsim
from artperl.data.facing import facing
from artperl.data.sources import Given
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.model.camera import Camera
from artsim.model.draws import ViewOptions
from artsim.model.objects import ArticulatedObject
from artsim.observing.capture import observe
from artsim.observing.symmetry import equivalent_sample, symmetries
from artsim.renderers import shared_renderer

CAMERA = Camera.look_at((-0.9, 0.4, 0.7), (0.0, 0.0, 0.0), 160, 120)


def symmetric_box() -> ArticulatedObject:
    """The first carton whose two halves are alike."""
    for seed in range(60):
        obj = artsim.make("box", seed)
        if symmetries(obj):
            return obj.with_diagonal(0.4)
    raise AssertionError("no box is symmetric")


@pytest.mark.slow
def test_both_truths_of_a_view_become_one() -> None:
    obj = symmetric_box()
    sample = observe(obj, obj.tree.rest + 0.4 * np.minimum(obj.tree.limits[:, 1], 1.0), CAMERA, num_points=300)
    some = symmetries(obj)
    first, second = facing(sample, some), facing(equivalent_sample(sample, some[0]), some)
    np.testing.assert_allclose(first.T_camera_part, second.T_camera_part, atol=1e-9)
    np.testing.assert_array_equal(first.part, second.part)
    np.testing.assert_allclose(first.rest_points, second.rest_points, atol=1e-6)
    np.testing.assert_allclose(first.joint_state, second.joint_state, atol=1e-9)


@pytest.mark.slow
def test_npcs_of_the_other_truth_name_the_places_that_are_seen() -> None:
    obj = symmetric_box()
    sample = observe(obj, obj.tree.rest, CAMERA, num_points=300)
    other = equivalent_sample(sample, symmetries(obj)[0])
    for own in (sample, other):
        T = own.T_camera_part[own.part]
        seen = np.einsum("nij,nj->ni", T[:, :3, :3], own.rest_points) + T[:, :3, 3]
        assert np.abs(seen - sample.points).max() < 1e-4 * obj.diagonal


@pytest.mark.slow
def test_an_object_is_learnt_with_its_front_to_the_camera_if_it_has_several() -> None:
    obj, options = symmetric_box(), SampleOptions(num_points=64, views=ViewOptions("sphere"))
    some, source = symmetries(obj), Given([obj], options, 0, 1, 8)
    drawn = [draw_sample(obj, options, 0, i, shared_renderer("raycast")) for i in range(24)]
    learnt = [source[i] for i in range(24)]
    assert all(facing(sample, some) is sample for sample in learnt)
    turned = [not np.allclose(a.T_camera_part, b.T_camera_part) for a, b in zip(drawn, learnt, strict=True)]
    assert 4 < sum(turned) < 20
