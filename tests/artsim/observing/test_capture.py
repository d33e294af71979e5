"""What must hold of every sample, on demo objects and real ones."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh.proximity import closest_point

import artsim
from artsim import StateOptions, ViewOptions, observe, sample_state, sample_view
from artsim.datasets.verify import sample_problems
from artsim.loading.sources import find_sources
from artsim.model.draws import ViewPreset, bounding_sphere, joint_intervals, sample_scale
from artsim.model.frame import BACKGROUND
from artsim.model.kinematics import invert_transform, transform_points
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from tests.conftest import ASSETS, DEMO

REAL = ("Laptop", "Eyeglasses", "Dishwasher", "StorageFurniture", "Box", "Oven", "Faucet", "Knife")


def views(obj: ArticulatedObject, count: int, num_points: int = 2048) -> Iterator[Sample]:
    for seed in range(count):
        rng = np.random.default_rng(seed)
        sized = sample_scale(obj, (0.2, 3.0), rng)
        q = sample_state(sized, StateOptions(), rng)
        camera = sample_view(sized, q, ViewOptions(preset="sphere"), rng)
        yield observe(sized, q, camera, num_points=num_points, rng=rng)


def assert_cloud_lies_on_posed_parts(obj: ArticulatedObject, sample: Sample) -> None:
    """Distance to each point's own part, posed by the ground truth, with trimesh as the judge."""
    sized = obj.scaled(sample.scale)
    for k in np.unique(sample.part):
        surface = sized.part_mesh(int(k))
        surface.apply_transform(sample.T_camera_part[k])
        points = sample.points[sample.part == k].astype(np.float64)
        _, distance, _ = closest_point(surface, points)
        assert distance.max() < 1e-4 * sample.diagonal


@pytest.mark.parametrize("path", DEMO, ids=lambda path: path.name)
def test_points_lie_on_their_own_posed_part(path: Path) -> None:
    obj = artsim.load(path)
    for sample in views(obj, 2, num_points=300):
        assert_cloud_lies_on_posed_parts(obj, sample)
        assert list(sample_problems(sample, obj.scaled(sample.scale))) == []


@pytest.mark.parametrize("category", REAL)
def test_points_lie_on_their_own_posed_part_of_real_objects(category: str, partnet_dir: Path) -> None:
    for source in find_sources([partnet_dir / category])[:2]:
        obj = artsim.load(source.path)
        for sample in views(obj, 1, num_points=200):
            assert_cloud_lies_on_posed_parts(obj, sample)
            assert list(sample_problems(sample, obj.scaled(sample.scale))) == []


def test_every_real_object_gives_a_sound_sample(partnet_dir: Path) -> None:
    for source in find_sources([partnet_dir]):
        obj = artsim.load(source.path)
        for sample in views(obj, 1, num_points=256):
            assert list(sample_problems(sample, obj.scaled(sample.scale))) == [], source.name


def test_a_cloud_carried_back_lands_in_its_rest_frame_boxes() -> None:
    obj = artsim.load(ASSETS / "cabinet").with_diagonal(1.0)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        q = sample_state(obj, StateOptions(), rng)
        sample = observe(obj, q, sample_view(obj, q, ViewOptions(), rng), rng=rng)
        back = transform_points(invert_transform(sample.T_camera_part)[sample.part], sample.points[:, None])[:, 0]
        low, high = obj.part_bounds[sample.part, 0], obj.part_bounds[sample.part, 1]
        assert ((back > low - 1e-5) & (back < high + 1e-5)).all()


def test_npcs_have_one_uniform_scale_for_each_part() -> None:
    """Distances in NPCS are distances in space over the diagonal of the part's box, as Umeyama's fit needs."""
    obj = artsim.load(ASSETS / "laptop")
    camera = artsim.Camera.look_at([-0.5, 0.2, 0.4], [0, 0, 0])
    sample = observe(obj, obj.tree.rest + [0.0, 1.2], camera)
    for k in range(2):
        mine = sample.part == k
        apart = np.linalg.norm(sample.points[mine][1:] - sample.points[mine][:-1], axis=1)
        npcs_apart = np.linalg.norm(sample.npcs[mine][1:] - sample.npcs[mine][:-1], axis=1)
        assert np.allclose(npcs_apart * np.linalg.norm(sample.box_size[k]), apart, atol=2e-6)
        assert (sample.npcs[mine] > 0).all()
        assert (sample.npcs[mine] < 1).all()


def test_the_visible_fraction_is_visible_over_amodal_pixels() -> None:
    """A plate half hidden by another, in closed form."""
    wall = trimesh.creation.box(bounds=[[0.0, -1, -1], [0.01, 1, 1]])
    screen = trimesh.creation.box(bounds=[[-0.011, -1, 0], [-0.001, 1, 1]])
    from tests.conftest import solid

    tree = artsim.KinematicTree([artsim.load(ASSETS / "quirks" / "mimic_pair").tree.joints[0], *_slide()])
    obj = ArticulatedObject("o", "c", (solid("wall", wall), solid("screen", screen)), tree, "0" * 64)
    camera = artsim.Camera.look_at([-50, 0, 0], [0, 0, 0], fov_y=np.deg2rad(4.0))
    exact = observe(obj, [0.0, 0.0], camera, images=("part_mask",))
    assert exact.visible_fraction == pytest.approx([0.5, 1.0], abs=0.01)
    assert observe(obj, [0.0, 0.0], camera).visible_fraction == pytest.approx([0.5, 1.0], abs=0.05)


def _slide() -> list[artsim.model.kinematics.Joint]:
    return [artsim.model.kinematics.Joint("slide", "prismatic", 0, lower=-1.0, upper=1.0)]


def test_images_agree_with_the_cloud() -> None:
    obj = artsim.load(ASSETS / "eyeglasses")
    camera = artsim.Camera.look_at([-0.3, 0.1, 0.15], [0, 0, 0])
    sample = observe(obj, obj.tree.rest, camera, images=("depth", "part_mask"))
    assert sample.depth is not None
    assert sample.part_mask is not None
    image = np.floor(camera.project(sample.points)).astype(int)
    assert np.array_equal(sample.part_mask[image[:, 1], image[:, 0]], sample.part)
    assert np.allclose(sample.depth[image[:, 1], image[:, 0]], sample.points[:, 2], atol=1e-6)
    assert ((sample.depth == 0) == (sample.part_mask == BACKGROUND)).all()


# --- the pose distribution -----------------------------------------------------------------------------------------


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
    options = ViewOptions(custom="tests.artsim.observing.test_capture:from_above")
    camera = sample_view(obj, obj.tree.rest, options, np.random.default_rng(0))
    assert np.allclose(camera.T_world_camera[:3, 3], [0, 0, 2])
    with pytest.raises(artsim.ArtsimError, match="cannot import"):
        sample_view(obj, obj.tree.rest, ViewOptions(custom="nowhere:view"), np.random.default_rng(0))


def from_above(rng: np.random.Generator, obj: ArticulatedObject, q: np.ndarray) -> artsim.Camera:
    return artsim.Camera.look_at([0, 0, 2], [0, 0, 0], 64, 48)


def test_scales_are_diagonals() -> None:
    obj, rng = artsim.load(ASSETS / "laptop"), np.random.default_rng(0)
    assert sample_scale(obj, "unit", rng).diagonal == pytest.approx(1.0)
    assert sample_scale(obj, "native", rng).diagonal == obj.diagonal
    diagonals = [sample_scale(obj, (0.3, 0.5), rng).diagonal for _ in range(100)]
    assert 0.3 <= min(diagonals) < 0.32
    assert 0.48 < max(diagonals) <= 0.5


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
