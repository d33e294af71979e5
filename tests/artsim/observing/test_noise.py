"""Noise steps have the deviation and the share of drop-outs that their formulae say."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest

from artsim import Camera
from artsim.model.kinematics import Array
from artsim.observing.noise import (
    AxialNoise,
    DisparityQuantisation,
    EdgeDropout,
    FlyingPixels,
    LateralJitter,
    PixelView,
)
from artsim.observing.sensor import Sensor
from tests.artsim.observing.test_sensor import DEPTHS, DOWNHILL, camera, plane, relative_sigma

STEPS = {
    "jitter": LateralJitter(0.8),
    "jitter that grows with incidence": LateralJitter(0.8, 0.035),
    "quantisation": DisparityQuantisation(1 / 8, 0.075),
    "axial": AxialNoise(0.0012, linear=0.0005, quadratic=0.0019, start=0.4),
    "axial, grazing": AxialNoise(0.0012, grazing=0.0001),
}


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("name", STEPS)
def test_a_step_has_the_sigma_of_its_formula(name: str, depth: float) -> None:
    tilt = np.deg2rad(75.0 if "grazing" in name else 40.0)
    assert relative_sigma(Sensor("one step", (STEPS[name],), focal=1200.0), depth, tilt) == pytest.approx(1, abs=0.05)


def test_the_incidence_of_a_tilted_plane_is_the_angle_between_ray_and_normal() -> None:
    seen_by, tilt = camera(100.0), np.deg2rad(35.0)
    true = plane(1.5, tilt, seen_by)
    row, column = np.divmod(np.arange(true.size), seen_by.width)
    view = PixelView(lambda r, c: (true[r, c], np.zeros(len(r), np.uint8)), seen_by, row, column, true.ravel(), key=0)
    ray = seen_by.directions(np.arange(true.size))
    ray /= np.linalg.norm(ray, axis=1, keepdims=True)
    expected = np.arccos(ray @ (np.array([0.0, 0.0, np.cos(tilt)]) - np.sin(tilt) * DOWNHILL))
    assert np.allclose(view.incidence, expected, atol=1e-6)


def step_scene(near: float, far: float) -> tuple[Array, Camera]:
    """(H, W) depth of two parallel walls that meet in the middle of the image."""
    seen_by = camera(size=400)
    depth = np.full((400, 400), near, dtype=np.float32)
    depth[:, 200:] = far
    return depth, seen_by


def test_pixels_beside_an_edge_drop_out_as_often_as_asked() -> None:
    true, seen_by = step_scene(1.0, 1.5)
    sensor = Sensor("edges", (EdgeDropout(jump=0.4, chance=0.3),))
    lost = np.mean([sensor.read_image(true, seen_by, key) == 0 for key in range(20)], axis=0)
    assert lost[:, 199:201].mean() == pytest.approx(0.3, abs=0.015)
    assert lost[:, :199].max() == lost[:, 201:].max() == 0
    smaller = Sensor("edges", (EdgeDropout(jump=0.6, chance=1.0),)).read_image(true, seen_by, key=0)
    assert np.array_equal(smaller, true)


def test_flying_pixels_lie_anywhere_between_the_two_sides() -> None:
    true, seen_by = step_scene(1.0, 1.2)
    sensor = Sensor("flying", (FlyingPixels(jump=0.1, chance=0.5, reach=1.0),))
    read = np.concatenate([sensor.read_image(true, seen_by, key)[:, 199:201].ravel() for key in range(10)])
    flying = read[(read != np.float32(1.0)) & (read != np.float32(1.2))].astype(np.float64)
    assert len(flying) / len(read) == pytest.approx(0.5, abs=0.03)
    assert kstest((flying - 1.0) / 0.2, "uniform").pvalue > 1e-3


def test_flying_pixels_before_an_empty_background_stay_within_reach() -> None:
    true, seen_by = step_scene(1.0, 0.0)
    read = Sensor("flying", (FlyingPixels(0.1, 1.0, reach=0.05),)).read_image(true, seen_by, key=0)
    assert read[:, 199].min() >= 1.0
    assert 1.04 < read[:, 199].max() <= 1.05
    assert (read[:, 200:] == 0).all()


def test_chance_at_a_pixel_is_normal_and_independent_of_its_neighbours() -> None:
    seen_by = camera(size=300)
    row, column = np.divmod(np.arange(300 * 300), 300)
    view = PixelView(lambda r, c: (np.ones(len(r), np.float32), r), seen_by, row, column, np.ones(len(row)), key=7)
    normal = view.normal(0)
    assert kstest(normal, "norm").pvalue > 1e-3
    for other in (np.roll(normal, 1), np.roll(normal, 300), view.normal(1), view.normal(10)):
        assert abs(np.corrcoef(normal, other)[0, 1]) < 4 / np.sqrt(len(normal))
