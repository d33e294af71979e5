"""Several views of an object that stands still make one estimate; frames in which joints moved tell how they move."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import artsim
from artperl.core.estimate import Estimate
from artperl.evaluation.metrics import axis_error, rotation_error, true_poses
from artperl.evaluation.scoring import match_parts
from artperl.methods.estimator_files import load_estimator
from artperl.methods.full import Estimator
from artperl.methods.views import Joint, as_one_object, hinge
from artsim.errors import ArtsimError, ConfigError
from artsim.model.camera import Camera
from artsim.model.transforms import transform_points
from artsim.observing.sample import Sample

coordinate = st.floats(-2.0, 2.0)
place = st.tuples(coordinate, coordinate, coordinate).map(np.array)
direction = place.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))


def seen(obj: artsim.ArticulatedObject, q: np.ndarray, azimuth: float, points: int = 2048) -> Sample:
    """An object from the side of an azimuth, degrees; 0 is its front."""
    side, up = np.deg2rad(azimuth), np.deg2rad(35.0)
    eye = 2.2 * obj.diagonal * np.array([-np.cos(side) * np.cos(up), -np.sin(side) * np.cos(up), np.sin(up)])
    return artsim.observe(obj, q, Camera.look_at(eye, np.zeros(3)), num_points=points)


def truth(sample: Sample) -> Estimate:
    """An estimate without error."""
    rotation, center = true_poses(sample)
    K = len(center)
    return Estimate(
        rotation=rotation, translation=center, size=sample.box_size, T_camera_part=sample.T_camera_part,
        state=sample.joint_state, joint_type=sample.joint_type, joint_parent=sample.joint_parent,
        joint_axis=sample.joint_axis_camera, joint_origin=sample.joint_origin_camera, part=sample.part.astype(np.int64),
        visibility=np.ones(K), trajectory=sample.T_camera_part[None], joint_limits=sample.joint_limits,
        part_confidence=np.full(K, 0.9),
    )  # fmt: skip


@given(axis=direction, origin=place, point=place, angle=st.floats(0.1, 3.0), slide=coordinate)
def test_the_hinge_of_a_screw_motion_is_its_axis(
    axis: np.ndarray, origin: np.ndarray, point: np.ndarray, angle: float, slide: float
) -> None:
    rotation = Rotation.from_rotvec(angle * axis).as_matrix()
    displacement = np.eye(4)
    displacement[:3, :3], displacement[:3, 3] = rotation, origin - rotation @ origin + slide * axis
    found = hinge(displacement, point)
    np.testing.assert_allclose(found.axis, axis, atol=1e-6)
    on_axis = transform_points(displacement, found.origin[None])[0] - found.origin
    np.testing.assert_allclose(on_axis, slide * axis, atol=1e-6)  # what lies on the axis only slides along it
    assert abs((found.origin - point) @ axis) < 1e-6


@given(kind=st.sampled_from(["revolute", "prismatic"]), axis=direction, origin=place, point=place,
       amount=st.floats(-3.0, 3.0))  # fmt: skip
def test_a_joint_tells_how_far_it_has_moved(
    kind: str, axis: np.ndarray, origin: np.ndarray, point: np.ndarray, amount: float
) -> None:
    joint = Joint(kind, axis, origin)
    assert joint.amount(joint.motion(amount), point) == pytest.approx(amount, abs=1e-6)


@settings(max_examples=5, deadline=None)
@given(azimuth=st.floats(-60.0, 60.0), opened=st.floats(0.7, 1.4))
def test_a_lid_that_was_taken_for_a_slide_is_seen_to_turn(azimuth: float, opened: float) -> None:
    obj = artsim.make("laptop", 3)
    samples = [seen(obj, np.array([0.0, q]), side, 256) for q, side in ((0.5, 0.0), (0.5 + opened, azimuth))]
    axis = samples[0].T_camera_part[0, :3, 0]
    wrong = [replace(truth(s), joint_type=("free", "prismatic"), joint_axis=np.stack([axis, axis])) for s in samples]
    for sample, estimate in zip(samples, as_one_object(wrong), strict=True):
        assert estimate.joint_type[1] == "revolute"
        assert axis_error(estimate.joint_axis[1], sample.joint_axis_camera[1]) < 1e-3
        rotation, center = true_poses(sample)
        assert rotation_error(estimate.rotation, rotation).max() < 1e-3
        np.testing.assert_allclose(estimate.translation, center, atol=1e-6)
    first, second = as_one_object(wrong)
    assert abs(second.state[1] - first.state[1]) == pytest.approx(opened, abs=1e-6)


def test_what_is_known_without_error_stays(one_drawer: artsim.ArticulatedObject) -> None:
    low, high = one_drawer.tree.limits[1]
    states = [np.array([0.0, low + share * (high - low)]) for share in (0.1, 0.9, 0.5)]
    samples = [seen(one_drawer, q, side, 256) for q, side in zip(states, (0.0, 30.0, -40.0), strict=True)]
    for sample, estimate in zip(samples, as_one_object([truth(s) for s in samples]), strict=True):
        assert estimate.joint_type == sample.joint_type
        np.testing.assert_allclose(estimate.state, sample.joint_state, atol=1e-6)
        np.testing.assert_allclose(estimate.T_camera_part, sample.T_camera_part, atol=1e-6)
        np.testing.assert_allclose(estimate.joint_axis[1], sample.joint_axis_camera[1], atol=1e-6)
        np.testing.assert_array_equal(estimate.part, sample.part)
    assert as_one_object([]) == []


@pytest.fixture(scope="module")
def estimator() -> Estimator:
    return load_estimator("generic")


@pytest.mark.slow
def test_views_of_a_real_refrigerator_make_one_estimate_in_any_order(estimator: Estimator, partnet_dir: Path) -> None:
    obj = artsim.load(sorted((partnet_dir / "Refrigerator").glob("*/mobility.urdf"))[0])
    samples = [seen(obj, artsim.sample_state(obj), azimuth) for azimuth in (-30.0, 20.0)]
    poses = np.stack([sample.T_world_camera for sample in samples])
    there = estimator.views([sample.points for sample in samples], poses)
    back = estimator.views([sample.points for sample in samples[::-1]], poses[::-1])
    T = np.linalg.inv(poses[0]) @ poses[1]
    np.testing.assert_allclose(T @ back.T_camera_part, there.T_camera_part, atol=1e-6)
    np.testing.assert_allclose(there.size, back.size, atol=1e-6)
    assert len(there.part) == 4096
    assert match_parts(there, samples[0])[0]
    alone = estimator.views([samples[0].points], poses[:1])
    np.testing.assert_allclose(alone.T_camera_part, estimator(samples[0].points).T_camera_part, atol=1e-9)


def test_poses_that_are_none_are_refused(estimator: Estimator) -> None:
    cloud = np.random.default_rng(0).random((100, 3)) + 1.0
    for poses in (np.eye(4), np.stack([np.eye(4)] * 2), 2.0 * np.eye(4)[None], np.full((1, 4, 4), np.nan)):
        with pytest.raises(ConfigError, match="T_world_camera"):
            estimator.views([cloud], poses)
    with pytest.raises(ConfigError, match="0 clouds"):
        estimator.views([], np.zeros((0, 4, 4)))


def test_views_without_an_object_are_an_error(estimator: Estimator) -> None:
    with pytest.raises(ArtsimError, match="show an object"):
        estimator.views([np.zeros((10, 3))] * 2, np.stack([np.eye(4)] * 2))
