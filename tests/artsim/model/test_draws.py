"""States, views and sizes are drawn as their options say."""

from __future__ import annotations

import numpy as np
import pytest

import artsim
from artsim import StateOptions, ViewOptions, sample_state, sample_view
from artsim.model.draws import ViewPreset, bounding_sphere, joint_intervals, sample_scale
from artsim.model.transforms import transform_points
from tests.conftest import ASSETS


def test_states_are_uniform_within_their_limits() -> None:
    obj, rng = artsim.load(ASSETS / "cabinet"), np.random.default_rng(0)
    drawn = np.stack([sample_state(obj, StateOptions(), rng) for _ in range(2000)])[:, 1:]
    low, high = joint_intervals(obj)[1:].T
    assert (drawn >= low).all()
    assert (drawn <= high).all()
    assert np.allclose(drawn.mean(axis=0), (low + high) / 2, atol=0.02 * (high - low))
    assert np.allclose(drawn.std(axis=0), (high - low) / np.sqrt(12), rtol=0.05)


def test_state_options_do_what_they_say() -> None:
    obj, rng = artsim.load(ASSETS / "laptop"), np.random.default_rng(0)
    rest, upper = obj.tree.rest[1], obj.tree.limits[1, 1]
    assert sample_state(obj, StateOptions(mode="rest"), rng)[1] == rest
    limits = {sample_state(obj, StateOptions(mode="limits"), rng)[1] for _ in range(50)}
    assert limits == set(obj.tree.limits[1])
    opened = [sample_state(obj, StateOptions(fraction_open=(0.5, 0.6)), rng)[1] for _ in range(50)]
    assert rest + 0.5 * (upper - rest) <= min(opened) <= max(opened) <= rest + 0.6 * (upper - rest)
    ranged = [sample_state(obj, StateOptions(joint_range={"scr*": (-0.2, 9.0)}), rng)[1] for _ in range(50)]
    assert -0.2 <= min(ranged) <= max(ranged) <= upper


def test_mixed_states_are_anywhere_at_rest_or_at_the_ends() -> None:
    obj, rng = artsim.load(ASSETS / "cabinet"), np.random.default_rng(0)
    drawn = np.stack([sample_state(obj, StateOptions(mode="mixed"), rng) for _ in range(2000)])[:, 1:]
    low, high = joint_intervals(obj)[1:].T
    resting, rest = (drawn == obj.tree.rest[1:]).all(1), obj.tree.rest[1:]
    at_ends = ((drawn == low) | (drawn == high)).all(1)
    both = 0.5 ** (high > low).sum() * ((rest == low) | (rest == high)).all()  # ends that happen to be the rest state
    assert resting.mean() == pytest.approx(0.25 * (1.0 + both), abs=0.03)
    assert at_ends.mean() == pytest.approx(0.5 if both else 0.25, abs=0.03)
    anywhere = drawn[~resting & ~at_ends]
    assert len(anywhere) == pytest.approx(1000, abs=60)
    assert np.allclose(anywhere.mean(axis=0), (low + high) / 2, atol=0.03 * (high - low))
    assert np.allclose(anywhere.std(axis=0), (high - low) / np.sqrt(12), rtol=0.08)


@pytest.mark.parametrize("preset", ["artimage", "sphere", "mixed"])
def test_views_see_the_whole_object_from_the_preset_directions(preset: ViewPreset) -> None:
    obj = artsim.load(ASSETS / "dishwasher")
    azimuths, elevations = [], []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        q = sample_state(obj, StateOptions(), rng)
        camera = sample_view(obj, q, ViewOptions(preset=preset), rng)
        center, _ = bounding_sphere(obj, q)
        away = camera.T_world_camera[:3, 3] - center
        azimuths.append(np.rad2deg(np.arctan2(-away[1], -away[0])))
        elevations.append(np.rad2deg(np.arcsin(away[2] / np.linalg.norm(away))))
        poses = camera.T_camera_world @ obj.tree.forward_kinematics(q)
        corners = np.concatenate([transform_points(T, obj.parts[k].vertices) for k, T in enumerate(poses)])
        image = camera.project(corners)
        assert (image > 0).all()
        assert (image < (640, 480)).all()
        assert np.ptp(image[:, 1]) > 100 or np.ptp(image[:, 0]) > 100
    wide, low, high = (75, 10, 60) if preset == "artimage" else (180, -10, 85)
    assert 0.9 * wide < max(np.abs(azimuths)) <= wide
    assert low - 1e-6 <= min(elevations) < low + 5
    assert high - 5 < max(elevations) <= high + 1e-6
    # Mixed views are from within 75 deg of the front half of the time, and 150 / 360 of the other half.
    share = {"artimage": 1.0, "sphere": 150 / 360, "mixed": 0.5 + 0.5 * 150 / 360}[preset]
    in_front = np.mean(np.abs(azimuths) <= 75)
    assert abs(in_front - share) < 4 * np.sqrt(share * (1 - share) / 200) + 1e-9


def test_a_view_function_of_ones_own_is_used() -> None:
    obj = artsim.load(ASSETS / "laptop")
    options = ViewOptions(custom="tests.artsim.model.test_draws:from_above")
    camera = sample_view(obj, obj.tree.rest, options, np.random.default_rng(0))
    assert np.allclose(camera.T_world_camera[:3, 3], [0, 0, 2])
    with pytest.raises(artsim.ArtsimError, match="cannot import"):
        sample_view(obj, obj.tree.rest, ViewOptions(custom="nowhere:view"), np.random.default_rng(0))


def test_scales_are_diagonals() -> None:
    obj, rng = artsim.load(ASSETS / "laptop"), np.random.default_rng(0)
    assert sample_scale(obj, "unit", rng).diagonal == pytest.approx(1.0)
    assert sample_scale(obj, "native", rng).diagonal == obj.diagonal
    diagonals = [sample_scale(obj, (0.3, 0.5), rng).diagonal for _ in range(100)]
    assert 0.3 <= min(diagonals) < 0.32
    assert 0.48 < max(diagonals) <= 0.5


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [
        lambda: ViewOptions(azimuth=(10, -10)),
        lambda: ViewOptions(fov=200),
        lambda: ViewOptions(width=0),
        lambda: ViewOptions(fill=(0, 1)),
        lambda: StateOptions(fraction_open=(0.5, 1.5)),
        lambda: StateOptions(joint_range={"lid": (1.0, 0.0)}),
        lambda: artsim.datasets.plan.SampleOptions(num_points=0),
        lambda: artsim.datasets.plan.SampleOptions(scale=(1.0, 0.5)),
        lambda: artsim.datasets.plan.SampleOptions(images=("rgb",)),
    ],
)
def test_options_that_make_no_sense_are_refused(options: object) -> None:
    with pytest.raises(artsim.ArtsimError, match="Fix:"):
        options()  # type: ignore[operator]


def from_above(rng: np.random.Generator, obj: artsim.ArticulatedObject, q: np.ndarray) -> artsim.Camera:
    return artsim.Camera.look_at([0, 0, 2], [0, 0, 0], 64, 48)
