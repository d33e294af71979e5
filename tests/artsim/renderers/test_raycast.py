"""The embedded renderer against closed forms, and sparse clouds against full images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.stats import chi2, chisquare

import artsim
from artsim import Camera, StateOptions, ViewOptions, observe, render, sample_state, sample_view
from artsim.errors import ConfigError, RenderError
from artsim.model.camera import points_from_depth
from artsim.model.frame import BACKGROUND
from artsim.model.joints import Joint
from artsim.model.objects import Part
from artsim.observing.capture import draw_visible
from artsim.renderers import make_renderer
from artsim.renderers.outlines import bounding_corners
from artsim.renderers.raycast import cast, pose
from tests.conftest import ASSETS, DEMO, rigid, solid


def test_a_box_face_in_front_has_the_depth_of_its_plane() -> None:
    frame = render(rigid(trimesh.creation.box((1, 1, 1))), [0.0], Camera.look_at([-3, 0, 0], [0, 0, 0]))
    seen = frame.depth[frame.part_ids == 0]
    assert np.abs(seen - 2.5).max() < 1e-6
    f = 240 / np.tan(np.deg2rad(22.5))
    assert len(seen) == pytest.approx((f / 2.5) ** 2, rel=0.01)


def test_a_sphere_has_the_depth_of_a_sphere() -> None:
    sphere = trimesh.creation.icosphere(6)
    camera = Camera.look_at([-4, 1, 2], [0, 0, 0])
    frame = render(rigid(sphere), [0.0], camera)
    points, _ = points_from_depth(frame.depth, camera)
    world = points @ camera.T_world_camera[:3, :3].T + camera.T_world_camera[:3, 3]
    radius = np.linalg.norm(world, axis=1)
    assert radius.max() < 1 + 1e-6
    assert radius.min() > 1 - 5e-4  # flat triangles lie a little inside


def test_an_off_centre_principal_point_moves_the_image() -> None:
    obj, camera = rigid(trimesh.creation.box((1, 1, 1))), Camera.look_at([-3, 0.3, 0.2], [0, 0, 0])
    K = camera.K.copy()
    K[:2, 2] += [40, -25]
    frame, moved = render(obj, [0.0], camera), render(obj, [0.0], replace(camera, K=K))
    assert np.array_equal(frame.part_ids[100:400, 100:500], moved.part_ids[75:375, 140:540])


def test_a_scaled_object_seen_from_as_far_away_looks_the_same() -> None:
    obj, camera = artsim.load(ASSETS / "scissors"), Camera.look_at([-0.2, 0.05, 0.15], [0, 0, 0])
    T = camera.T_world_camera.copy()
    T[:3, 3] *= 7.0
    q = obj.tree.rest + [0.0, 0.4]
    frame, large = render(obj, q, camera), render(obj.scaled(7.0), q, replace(camera, T_world_camera=T))
    assert (frame.part_ids == large.part_ids).mean() > 0.9999
    same = (frame.part_ids == large.part_ids) & (frame.part_ids != BACKGROUND)
    assert np.abs(7 * frame.depth - large.depth)[same].max() < 1e-5


@pytest.mark.slow
def test_only_the_projected_outline_is_cast_and_nothing_is_lost() -> None:
    for path in DEMO:
        obj, rng = artsim.load(path), np.random.default_rng(5)
        q = sample_state(obj, StateOptions(), rng)
        camera = sample_view(obj, q, ViewOptions(preset="sphere"), rng)
        frame = render(obj, q, camera)
        posed = pose(obj, q, camera)
        everywhere = replace(posed, row_ranges=np.tile([0, 480], (len(obj), 1)))
        everywhere = replace(everywhere, spans=np.broadcast_to(np.float32([[-np.inf], [np.inf]]), posed.spans.shape))
        d, p, amodal = cast(everywhere, *np.divmod(np.arange(640 * 480), 640))
        assert np.array_equal(p.reshape(480, 640), frame.part_ids)
        assert np.array_equal(d.reshape(480, 640), frame.depth)
        assert np.array_equal(amodal, frame.amodal_pixels)


def test_a_part_without_geometry_is_never_seen() -> None:
    """Toasters of PartNet-Mobility have a root that shows nothing."""
    turn = Joint("turn", "continuous", 0, lower=-np.inf, upper=np.inf)
    tree = artsim.KinematicTree([Joint("root", "free", -1), turn])
    empty = Part("empty", "empty", np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    obj = artsim.ArticulatedObject("o", "c", (empty, solid("box", trimesh.creation.box((1, 1, 1)))), tree, "0" * 64)
    sample = observe(obj, [0.0, 1.0], Camera.look_at([-3, 1, 1], [0, 0, 0]))
    assert set(sample.part) == {1}
    assert sample.visible_fraction.tolist() == [0.0, 1.0]


@pytest.mark.parametrize("shape", ["ball", "plate", "needle", "triangle"])
def test_bounding_corners_contain_every_point(shape: str) -> None:
    points = np.random.default_rng(0).normal(size=(300, 3))
    points *= {"ball": (1, 1, 1), "plate": (1, 1, 0), "needle": (1, 1e-5, 1e-5), "triangle": (1, 1, 0)}[shape]
    points = points[:3] if shape == "triangle" else points
    points = points @ trimesh.transformations.random_rotation_matrix(np.array([0.3, 0.5, 0.7]))[:3, :3]
    corners = bounding_corners(points)
    normals = np.random.default_rng(1).normal(size=(500, 3))
    assert ((corners @ normals.T).max(axis=0) >= (points @ normals.T).max(axis=0) - 1e-9).all()


def test_a_camera_inside_the_object_sees_its_walls() -> None:
    frame = render(rigid(trimesh.creation.box((2, 2, 2))), [0.0], Camera.look_at([0, 0, 0], [1, 0, 0]))
    assert np.abs(frame.depth - 1.0).max() < 1e-6


def test_an_object_behind_the_camera_is_not_seen() -> None:
    obj, camera = rigid(trimesh.creation.box((1, 1, 1))), Camera.look_at([3, 0, 0], [9, 0, 0])
    assert (render(obj, [0.0], camera).part_ids == BACKGROUND).all()
    with pytest.raises(RenderError, match="does not see"):
        observe(obj, [0.0], camera)


@pytest.mark.parametrize("name", ["eyeglasses", "cabinet"])
def test_a_sparse_cloud_is_the_cloud_of_the_full_image(name: str) -> None:
    obj = artsim.load(ASSETS / name)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        q = sample_state(obj, StateOptions(), rng)
        camera = sample_view(obj, q, ViewOptions(), rng)
        sparse = observe(obj, q, camera, rng=np.random.default_rng(seed))
        full = observe(obj, q, camera, rng=np.random.default_rng(seed), images=("depth", "part_mask"))
        assert np.array_equal(sparse.points, full.points)
        assert np.array_equal(sparse.part, full.part)
        assert np.abs(sparse.visible_fraction - full.visible_fraction).max() < 0.2


def test_sparse_clouds_choose_every_visible_pixel_equally_often() -> None:
    """Chi-square over 400 clouds against the uniform distribution over the pixels of the full image."""
    obj, camera = artsim.load(ASSETS / "scissors"), Camera.look_at([-0.13, 0.04, 0.13], [0, 0, 0], 64, 48)
    q = obj.tree.rest + [0.0, 0.6]
    visible = np.flatnonzero(render(obj, q, camera).part_ids.ravel() != BACKGROUND)
    assert len(visible) > 300
    posed = pose(obj, q, camera)

    def look(row: np.ndarray, column: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return cast(posed, row, column)[:2]

    counts = np.zeros(64 * 48)
    for seed in range(400):
        pixels, _, _ = draw_visible(posed, look, 60, np.random.default_rng(seed))
        assert len(np.unique(pixels)) == 60
        counts[pixels] += 1
    assert counts.sum() == counts[visible].sum() == 400 * 60
    # Draws without replacement spread less than independent ones.
    statistic = chisquare(counts[visible]).statistic / (1 - 60 / len(visible))
    assert 1e-3 < chi2.cdf(statistic, len(visible) - 1) < 1 - 1e-3


def test_a_cloud_larger_than_the_image_takes_every_pixel_and_repeats() -> None:
    obj, camera = artsim.load(ASSETS / "laptop"), Camera.look_at([-2, 0.1, 1], [0, 0, 0], 64, 48)
    visible = (render(obj, obj.tree.rest, camera).part_ids != BACKGROUND).sum()
    sample = observe(obj, obj.tree.rest, camera, num_points=2048)
    assert visible < 2048
    assert len(np.unique(sample.points, axis=0)) == visible


def test_unknown_names_are_refused() -> None:
    with pytest.raises(ConfigError, match="no renderer 'opengl'"):
        make_renderer("opengl")
    obj, camera = artsim.load(ASSETS / "laptop"), Camera.look_at([-1, 0, 1], [0, 0, 0])
    with pytest.raises(ConfigError, match="no image normals"):
        observe(obj, obj.tree.rest, camera, images=("normals",))
    with pytest.raises(ConfigError, match="makes no rgb"):
        observe(obj, obj.tree.rest, camera, images=("rgb",))
    with pytest.raises(ConfigError, match="is empty"):
        observe(obj, obj.tree.rest, camera, num_points=0)
