"""Noise has the standard deviation that its formula says, and never touches the ground truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim import Camera, ViewOptions, observe, sample_state, sample_view
from artsim.datasets.plan import SampleOptions
from artsim.datasets.sample_checks import sample_problems
from artsim.datasets.verify import verify
from artsim.errors import ConfigError
from artsim.loading.sources import find_sources
from artsim.model.draws import StateOptions
from artsim.model.frame import BACKGROUND
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.noise import (
    EdgeDropout,
    LateralJitter,
)
from artsim.observing.sensor import SENSORS, Sensor
from tests.conftest import ASSETS

DEPTHS = (0.6, 1.0, 1.7, 2.5, 4.0)
DOWNHILL = np.array([np.cos(0.3), np.sin(0.3), 0.0])
NOISY = [name for name in SENSORS if name != "none"]


def camera(focal: float = 600.0, size: int = 120) -> Camera:
    K = np.array([[focal, 0.0, size / 2], [0.0, focal, size / 2], [0.0, 0.0, 1.0]])
    return Camera(K, size, size, np.eye(4))


def plane(depth: float, tilt: float, seen_by: Camera) -> Array:
    """(H, W) depth of a plane that crosses the optical axis at ``depth``, tilted about an oblique axis."""
    across = seen_by.directions(np.arange(seen_by.width * seen_by.height)) @ DOWNHILL
    z = depth / (1.0 - across * np.tan(tilt))
    return z.reshape(seen_by.height, seen_by.width)


def relative_sigma(sensor: Sensor, depth: float, tilt: float) -> float:
    """Measured over expected standard deviation on a tilted plane, away from the image's border."""
    seen_by = camera(sensor.focal)
    true = plane(depth, tilt, seen_by).astype(np.float32)
    expected = sensor.sigma(true, tilt)
    inside = np.s_[4:-4, 4:-4]  # readings from beyond the border are taken from the border
    ratios = [((sensor.read_image(true, seen_by, key) - true) / expected)[inside] for key in range(10)]
    return float(np.std(ratios))


PUBLISHED = {
    "kinect_v1": lambda z: 0.0012 + 0.0019 * (z - 0.4) ** 2,
    "d435": lambda z: (1e3 * z) ** 2 * 0.08 / (425 * 50) / 1e3,
    "azure": lambda z: 0.0005 + 0.001 * (z - 0.5),
    "gaussian3mm": lambda z: 0.003,
}


@pytest.mark.slow
@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("name", NOISY)
def test_a_preset_has_the_sigma_of_its_closed_form(name: str, depth: float) -> None:
    sensor, tilt = SENSORS[name], np.deg2rad(6.0)
    assert relative_sigma(sensor, depth, tilt) == pytest.approx(1, abs=0.05)
    # What was published for the device is for surfaces that face it.
    assert sensor.sigma(depth) == pytest.approx(PUBLISHED[name](depth), rel=1e-9)


@pytest.mark.parametrize("depth", DEPTHS)
def test_a_camera_of_another_resolution_sees_the_same_noise_in_metres(depth: float) -> None:
    sensor, tilt = Sensor("jitter", (LateralJitter(1.5),), focal=600.0), np.deg2rad(40.0)
    half = camera(300.0)
    true = plane(depth, tilt, half).astype(np.float32)
    error = (sensor.read_image(true, half, key=1) - true) / sensor.sigma(true, tilt)
    assert error[4:-4, 4:-4].std() == pytest.approx(1, abs=0.06)


@pytest.fixture(scope="module", params=["cabinet", "eyeglasses"])
def obj(request: pytest.FixtureRequest) -> ArticulatedObject:
    return artsim.load(ASSETS / request.param)


def scene(obj: ArticulatedObject, seed: int = 5) -> tuple[ArticulatedObject, Array, Camera]:
    rng = np.random.default_rng(seed)
    q = sample_state(obj, StateOptions(), rng)
    return obj, q, sample_view(obj, q, ViewOptions(), rng)


@pytest.mark.slow
@pytest.mark.parametrize("noise", NOISY)
def test_rays_and_images_give_the_same_noisy_cloud_and_true_ground_truth(noise: str, obj: ArticulatedObject) -> None:
    rays = observe(*scene(obj), num_points=500, noise=noise, rng=np.random.default_rng(2))
    images = observe(
        *scene(obj), num_points=500, noise=noise, images=("depth", "part_mask"), rng=np.random.default_rng(2)
    )
    assert np.array_equal(rays.points, images.points)
    assert np.array_equal(rays.npcs, images.npcs)
    assert rays.noise == noise
    assert list(sample_problems(rays, obj)) == list(sample_problems(images, obj)) == []
    true = artsim.render(*scene(obj))
    assert images.part_mask is not None
    assert images.depth is not None
    assert np.array_equal(images.part_mask, true.part_ids)
    assert not np.array_equal(images.depth, true.depth)


@pytest.mark.parametrize("noise", NOISY)
def test_points_differ_from_the_places_their_npcs_name_along_the_ray_only(noise: str, obj: ArticulatedObject) -> None:
    sample = observe(*scene(obj), noise=noise)
    size = np.linalg.norm(sample.box_size, axis=1)[sample.part, None]
    p_rest = (sample.npcs - 0.5) * size + sample.box_center[sample.part]
    T = sample.T_camera_part[sample.part]
    true = np.einsum("nij,nj->ni", T[:, :3, :3], p_rest) + T[:, :3, 3]
    assert np.allclose(sample.points / sample.points[:, 2:], true / true[:, 2:], atol=1e-5)
    assert np.median(np.abs(sample.points[:, 2] - true[:, 2])) > 1e-4


def test_a_sample_whose_npcs_are_not_true_is_found_under_noise(obj: ArticulatedObject) -> None:
    sample = observe(*scene(obj), noise="d435")
    assert any("npcs name" in p for p in sample_problems(replace(sample, npcs=sample.npcs[::-1].copy()), obj))
    behind = sample.npcs + np.float32(0.3) * (sample.npcs - 0.5)
    assert list(sample_problems(replace(sample, npcs=behind), obj))


@pytest.mark.parametrize("category", ["Laptop", "Faucet"])
def test_real_objects_keep_their_ground_truth_under_every_sensor(category: str, partnet_dir: Path) -> None:
    real = artsim.load(find_sources([partnet_dir / category])[0].path)
    for noise in NOISY:
        assert list(sample_problems(observe(*scene(real), noise=noise), real)) == []


def test_without_noise_points_are_what_they_were(obj: ArticulatedObject) -> None:
    plain = observe(*scene(obj), rng=np.random.default_rng(1))
    none = observe(*scene(obj), noise="none", rng=np.random.default_rng(1))
    own = observe(*scene(obj), noise=Sensor("no steps"), rng=np.random.default_rng(1))
    assert np.array_equal(plain.points, none.points)
    assert np.array_equal(plain.points, own.points)
    assert plain.noise == "none"


def test_pixels_without_a_return_are_in_no_cloud(obj: ArticulatedObject) -> None:
    blind = Sensor("half blind", (EdgeDropout(jump=-1.0, chance=0.5),))
    sample = observe(*scene(obj), noise=blind, images=("depth", "part_mask"), num_points=300)
    assert sample.depth is not None
    assert sample.part_mask is not None
    seen = sample.part_mask != BACKGROUND
    assert (sample.depth[seen] > 0).mean() == pytest.approx(0.5, abs=0.03)
    assert sample.points[:, 2].min() > 0


@pytest.mark.slow
def test_a_dataset_with_noise_is_sound_and_says_which(tmp_path: Path) -> None:
    artsim.generate(
        find_sources([ASSETS / "laptop", ASSETS / "cabinet"]),
        tmp_path / "noisy",
        num_samples=12,
        sample=SampleOptions(num_points=200, noise="kinect_v1", images=("depth", "part_mask")),
        workers=1,
        splits=(1, 0, 0),
        progress=False,
    )
    assert verify(tmp_path / "noisy", progress=False) == []
    dataset = artsim.open_dataset(tmp_path / "noisy")
    assert dataset.plan.sample.noise == "kinect_v1"
    assert {dataset[i].noise for i in range(12)} == {"kinect_v1"}


def test_an_unknown_sensor_is_refused(obj: ArticulatedObject) -> None:
    with pytest.raises(ConfigError, match="d435"):
        observe(*scene(obj), noise="kinect_v7")
