"""What must hold of the pinhole camera."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artsim.errors import ConfigError
from artsim.model.camera import Camera, look_at_transform, points_from_depth


def camera(seed: int) -> Camera:
    rng = np.random.default_rng(seed)
    fx, fy = rng.uniform(100, 900, 2)
    K = np.array([[fx, rng.uniform(-3, 3), rng.uniform(0, 64)], [0, fy, rng.uniform(0, 48)], [0, 0, 1]])
    return Camera(K, 64, 48, look_at_transform(rng.normal(size=3), rng.normal(size=3)))


@given(st.integers(0, 1000))
def test_a_pixel_unprojects_to_a_point_that_projects_to_its_centre(seed: int) -> None:
    cam = camera(seed)
    pixels = np.arange(64 * 48)
    depth = np.random.default_rng(seed).uniform(0.1, 9, len(pixels))
    image = cam.project(cam.unproject(pixels, depth))
    row, column = np.divmod(pixels, 64)
    assert np.abs(image - np.stack([column, row], axis=1) - 0.5).max() < 1e-8


def test_depth_is_along_the_optical_axis() -> None:
    cam = camera(1)
    depth = np.full((48, 64), 2.5, np.float32)
    depth[0, 0] = 0
    points, pixels = points_from_depth(depth, cam)
    assert len(points) == 64 * 48 - 1
    assert 0 not in pixels
    assert np.all(points[:, 2] == 2.5)


def test_a_camera_that_looks_at_a_point_sees_it_in_the_middle_with_up_upwards() -> None:
    cam = Camera.look_at([-2, 0, 1], [0, 0, 0.5], 640, 480)
    seen = np.array([[0, 0, 0.5, 1], [0, 0, 0.6, 1], [0, -0.1, 0.5, 1]]) @ cam.T_camera_world.T
    middle, above, right = cam.project(seen[:, :3])
    assert np.allclose(middle, [320, 240])
    assert above[1] < middle[1]
    assert right[0] > middle[0]  # from the front, which is -X, the object's -Y side is on the right


def test_a_camera_may_look_straight_down() -> None:
    T = look_at_transform([0, 0, 3], [0, 0, 0])
    assert np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3))
    assert np.allclose(T[:3, 2], [0, 0, -1])


def test_nonsense_is_refused() -> None:
    with pytest.raises(ConfigError, match="own position"):
        look_at_transform([1, 1, 1], [1, 1, 1])
    with pytest.raises(ConfigError, match="field of view"):
        Camera.look_at([1, 0, 0], [0, 0, 0], fov_y=4.0)
