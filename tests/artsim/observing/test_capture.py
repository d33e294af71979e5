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
from artsim.datasets.sample_checks import sample_problems
from artsim.loading.sources import find_sources
from artsim.model.draws import sample_scale
from artsim.model.frame import BACKGROUND
from artsim.model.joints import Joint
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform, transform_points
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


@pytest.mark.slow
@pytest.mark.parametrize("category", REAL)
def test_points_lie_on_their_own_posed_part_of_real_objects(category: str, partnet_dir: Path) -> None:
    for source in find_sources([partnet_dir / category])[:2]:
        obj = artsim.load(source.path)
        for sample in views(obj, 1, num_points=200):
            assert_cloud_lies_on_posed_parts(obj, sample)
            assert list(sample_problems(sample, obj.scaled(sample.scale))) == []


@pytest.mark.slow
def test_every_other_real_object_gives_a_sound_sample(partnet_dir: Path) -> None:
    for source in find_sources([partnet_dir])[::2]:
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


def test_by_default_an_object_is_seen_at_rest_whole_and_wherever_it_stands() -> None:
    obj, T_world_object = artsim.make("drawer", 3), np.eye(4)
    T_world_object[:3, 3] = 1.0, 2.0, 3.0
    here, there = observe(obj), observe(obj, T_world_object=T_world_object)
    np.testing.assert_array_equal(here.joint_state, obj.tree.rest)
    corners = trimesh.bounds.corners(obj.bounds)
    pixels = (transform_points(here.T_camera_part[0], corners) @ here.K.T)[:, :2] / (
        transform_points(here.T_camera_part[0], corners)[:, 2:]
    )
    assert (pixels >= 0.0).all()
    assert (pixels <= [here.width, here.height]).all()
    np.testing.assert_allclose(there.points, here.points, atol=1e-5)
    np.testing.assert_allclose(there.T_world_camera[:3, 3] - here.T_world_camera[:3, 3], [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(sample_state(obj), sample_state(obj, StateOptions(), np.random.default_rng(0)))


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


def _slide() -> list[Joint]:
    return [Joint("slide", "prismatic", 0, lower=-1.0, upper=1.0)]


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
