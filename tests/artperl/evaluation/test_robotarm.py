"""The arm's test clouds come from images: labels, places and flaws are those of what the camera sees."""

from __future__ import annotations

import numpy as np
import pytest

from artperl.evaluation.metrics import true_poses
from artperl.evaluation.robotarm import arm_samples, seven_part_arm
from artsim.model.transforms import transform_points
from artsim.observing.interference import FOREIGN
from artsim.observing.sample import Sample
from artsim.scenes import SceneOptions, make_scene

ARM = seven_part_arm()


@pytest.fixture(scope="module")
def clouds() -> list[Sample]:
    return arm_samples(ARM, 3, 2048)


@pytest.mark.slow
def test_points_of_the_arm_lie_on_its_parts_up_to_the_sensors_noise(clouds: list[Sample]) -> None:
    for sample in clouds:
        assert sample.points.shape == (2048, 3)
        own = sample.part != FOREIGN
        size = sample.box_size[sample.part[own]]
        off = (sample.npcs[own] - 0.5) * np.linalg.norm(
            size, axis=1, keepdims=True
        )  # from the middle of the part's box
        assert (np.abs(off) <= size / 2 + 0.02).all(axis=1).mean() > 0.9


@pytest.mark.slow
def test_masks_take_in_points_of_other_things(clouds: list[Sample]) -> None:
    shares = [(sample.part == FOREIGN).mean() for sample in clouds]
    assert 0.0 < np.mean(shares) < 0.2
    for sample in clouds:
        foreign = sample.part == FOREIGN
        np.testing.assert_array_equal(np.isnan(sample.npcs).any(axis=1), foreign)


@pytest.mark.slow
def test_the_same_images_come_again(clouds: list[Sample]) -> None:
    again = arm_samples(ARM, 1, 2048)[0]
    np.testing.assert_array_equal(again.points, clouds[0].points)


def test_a_bolted_arm_stands_upright_and_nothing_of_it_is_below_its_base() -> None:
    options = SceneOptions((), obj=(ARM,), distractors=0, bolted=True)
    for seed in range(3):
        (thing,) = make_scene(options, seed).instances
        assert thing.T_world_object[2, 2] == pytest.approx(1.0)
        low = [vertices[:, 2].min() for vertices in thing.part_vertices]
        assert min(low) == pytest.approx(low[0]) == pytest.approx(0.0, abs=1e-9)


def test_true_poses_are_those_of_the_posed_object(clouds: list[Sample]) -> None:
    sample = clouds[0]
    rotation, center = true_poses(sample)
    np.testing.assert_allclose(rotation[0] @ rotation[0].T, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(
        transform_points(sample.T_camera_part[0], sample.box_center[:1])[0], center[0], atol=1e-9
    )
