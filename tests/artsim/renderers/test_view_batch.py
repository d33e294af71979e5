"""Views drawn many at once follow the distribution of those drawn one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import ks_2samp

from artsim import StateOptions, ViewOptions, make, sample_state, sample_view
from artsim.errors import ConfigError
from artsim.model.camera import look_at_transform
from artsim.model.draws import ViewPreset, bounding_sphere
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform
from artsim.renderers.view_batch import draw_views

COUNT = 1500
CAMERAS = ViewOptions(width=160, height=120)


def traits(obj: ArticulatedObject, q: np.ndarray, T_world_camera: np.ndarray) -> list[float]:
    """Joint states, direction of the camera in the rest frame, and its distance in radii."""
    center, radius = bounding_sphere(obj, q)
    away = T_world_camera[:3, 3] - center
    distance = np.linalg.norm(away)
    return [*q[1:], np.arctan2(-away[1], -away[0]), np.arcsin(away[2] / distance), distance / radius]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("states", "preset"),
    [
        (StateOptions(), "artimage"),
        (StateOptions(fraction_open=(0.2, 0.9)), "sphere"),
        (StateOptions(joint_range={"*": (0.0, 0.1)}), "mixed"),
    ],
)
def test_views_at_once_are_distributed_as_views_one_by_one(states: StateOptions, preset: ViewPreset) -> None:
    obj, rng = make("lamp", seed=1), np.random.default_rng(0)
    cameras = replace(CAMERAS, preset=preset)
    views = draw_views([obj], COUNT, rng, states, cameras)
    together = np.array(
        [traits(obj, q, invert_transform(T)) for q, T in zip(views.q, views.T_camera_object, strict=True)]
    )
    one_by_one = []
    for _ in range(COUNT):
        q = sample_state(obj, states, rng)
        camera = sample_view(obj, q, cameras, rng)
        one_by_one.append(traits(obj, q, camera.T_world_camera))
    for ours, theirs in zip(together.T, np.array(one_by_one).T, strict=True):
        assert ks_2samp(ours, theirs).pvalue > 1e-4
    assert np.array_equal(views.K[7], camera.K)
    assert (views.width, views.height) == (camera.width, camera.height)


def test_every_camera_looks_at_its_object_and_stands_upright() -> None:
    objects = [make(category, seed=2) for category in ("door", "scissors", "drawer")]
    views = draw_views(objects, 60, np.random.default_rng(1), cameras=ViewOptions(preset="sphere"))
    assert np.bincount(views.objects).tolist() == [20, 20, 20]
    for number, q, T in zip(views.objects, views.q, views.T_camera_object, strict=True):
        obj = objects[number]
        center, _ = bounding_sphere(obj, q[: len(obj)])
        T_object_camera = invert_transform(T)
        assert np.abs(look_at_transform(T_object_camera[:3, 3], center) - T_object_camera).max() < 1e-12
        assert (q[len(obj) :] == 0).all()


def test_cameras_of_a_users_function_are_not_drawn_at_once() -> None:
    with pytest.raises(ConfigError, match="one at a time"):
        draw_views([make("door", 0)], 3, np.random.default_rng(0), cameras=ViewOptions(custom="a:b"))
    with pytest.raises(ConfigError, match="no object"):
        draw_views([], 3, np.random.default_rng(0))
