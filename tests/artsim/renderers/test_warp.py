"""Rays by Warp against Embree's, many views of different objects at once, and clouds made on the device."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import trimesh
from scipy.stats import chisquare

import artsim
from artsim import Camera, StateOptions, make, make_renderer, observe, sample_state
from artsim.errors import ArtsimError, ConfigError, KinematicsError
from artsim.families import FAMILIES
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.joints import Joint
from artsim.model.objects import ArticulatedObject, Part
from artsim.renderers import render_cameras
from artsim.renderers.raycast import pose
from artsim.renderers.view_batch import Views
from artsim.renderers.warp import WarpRenderer
from tests.agreement import Agreement, Scene, draw_scenes
from tests.conftest import ASSETS, DEMO, absent, installed, rigid, solid, valve
from tests.without import environment


@pytest.fixture(scope="module")
def warp() -> ModuleType:
    return installed("warp")


@pytest.fixture(scope="module")
def renderer(warp: ModuleType) -> WarpRenderer:
    return WarpRenderer()


def small(camera: Camera) -> Camera:
    """A camera of 640x480 pixels as one of 128x128 that sees the middle."""
    K = camera.K * [[128 / 480], [128 / 480], [1.0]]
    K[0, 2] = 64.0
    return replace(camera, K=K, width=128, height=128)


def scenes_of(objects: list[ArticulatedObject], states: int) -> list[Scene]:
    scenes = [scene for seed, obj in enumerate(objects) for scene in draw_scenes(obj, states, 1, seed)]
    return [(obj, q, small(camera)) for obj, q, camera in scenes]


def views_of(scenes: list[Scene]) -> tuple[list[ArticulatedObject], Views]:
    """The objects of scenes, and the scenes as views of them."""
    objects = list(dict.fromkeys(obj for obj, _, _ in scenes))
    numbers = [objects.index(obj) for obj, _, _ in scenes]
    return objects, Views.of(numbers, [q for _, q, _ in scenes], [camera for _, _, camera in scenes])


@pytest.mark.slow
def test_one_object_of_each_category_in_one_launch_looks_as_embree_sees_it(renderer: WarpRenderer) -> None:
    scenes = scenes_of([make(category, seed=3) for category in FAMILIES], states=2)
    objects, views = views_of(scenes)
    images, rays, agreement = (
        renderer.render_views(renderer.load(objects), views),
        make_renderer("raycast"),
        Agreement(),
    )
    for scene, depth, part_ids in zip(scenes, images.depth.numpy(), images.part_ids.numpy(), strict=True):
        agreement.add(scene, rays.render(*scene), Frame(depth, part_ids))
    summary = agreement.summary()
    assert summary["median_mm"] < 0.001
    assert summary["p999_mm"] < 0.01
    assert summary["part_ids_equal"] > 0.9999


def test_different_objects_at_once_look_as_they_do_one_by_one(renderer: WarpRenderer) -> None:
    scenes = scenes_of([artsim.load(path) for path in DEMO], states=2)
    scenes = [scenes[i] for i in np.random.default_rng(0).permutation(len(scenes))]
    objects, views = views_of(scenes)
    images = renderer.render_views(renderer.load(objects), views)
    for i, scene in enumerate(scenes):
        alone = renderer.render(*scene)
        assert np.array_equal(alone.depth, images.depth.numpy()[i])
        assert np.array_equal(alone.part_ids, images.part_ids.numpy()[i])


def test_every_type_of_joint_moves_on_the_device_as_in_numpy(renderer: WarpRenderer) -> None:
    objects = [valve(), valve().scaled(0.1), artsim.load(ASSETS / "cabinet"), make("lamp", seed=1)]
    scenes = scenes_of(objects, states=4)
    objects, views = views_of(scenes)
    # A mimic follows its source whatever its own entry says, and nothing reads the root's.
    for row, (obj, _, _) in zip(views.q, scenes, strict=True):
        row[[k for k, joint in enumerate(obj.tree.joints) if k == 0 or joint.mimic]] = 0.7
    found = renderer.render_views(renderer.load(objects), views).T_camera_part.numpy()
    for T_camera_part, (obj, q, camera) in zip(found, scenes, strict=True):
        expected = pose(obj, q, camera).T_camera_part
        assert np.abs(T_camera_part[: len(obj)] - expected).max() < 1e-12
        assert (T_camera_part[len(obj) :] == 0).all()


def test_several_cameras_of_one_object_in_one_call(renderer: WarpRenderer) -> None:
    obj = artsim.load(ASSETS / "cabinet")
    q = obj.tree.rest + [0, 0.2, 0.1, 0.3]
    cameras = [Camera.look_at([-1.5, y, 1.0], [0, 0, 0], 160, 120) for y in (-1.0, 0.0, 0.7)]
    T_world_object = trimesh.transformations.rotation_matrix(0.4, [0, 0, 1])
    for drawer in (renderer, make_renderer("raycast")):
        frames = render_cameras(obj, q, cameras, T_world_object, drawer)
        for frame, camera in zip(frames, cameras, strict=True):
            alone = drawer.render(obj, q, camera, T_world_object)
            assert np.array_equal(frame.depth, alone.depth)
            assert np.array_equal(frame.part_ids, alone.part_ids)
        assert render_cameras(obj, q, [], renderer=drawer) == []
        with pytest.raises(ConfigError, match="one image size"):
            render_cameras(obj, q, [*cameras, Camera.look_at([-1, 0, 0], [0, 0, 0])], renderer=drawer)


def test_each_view_can_have_its_own_placement_and_intrinsics(renderer: WarpRenderer) -> None:
    obj, rays = artsim.load(ASSETS / "laptop"), make_renderer("raycast")
    cameras = [Camera.look_at([-0.6, 0.1, 0.4], [0, 0, 0], 129, 67, fov_y=fov) for fov in (0.4, 0.6)]
    cameras[1].K[0, 1] = 7.0  # skew
    T_world_object = np.stack([trimesh.transformations.rotation_matrix(a, [1, 2, 3]) for a in (0.3, 2.0)])
    T_world_object[:, :3, 3] = [[0.02, 0.03, -0.01], [0.05, -0.01, 0]]
    views = Views.of([0, 0], [obj.tree.rest + [0, 1.0]] * 2, cameras, T_world_object)
    images = renderer.render_views(renderer.load([obj]), views)
    for i in range(2):
        expected = rays.render(obj, views.q[i], cameras[i], T_world_object[i])
        assert (expected.part_ids != BACKGROUND).sum() > 500
        assert (images.part_ids.numpy()[i] == expected.part_ids).mean() > 0.9995
        assert np.median(np.abs(images.depth.numpy()[i] - expected.depth)) < 1e-6


def test_what_reaches_behind_the_camera_is_not_lost(renderer: WarpRenderer) -> None:
    room = rigid(trimesh.creation.box((2, 2, 2)))
    assert np.abs(renderer.render(room, [0.0], Camera.look_at([0, 0, 0], [1, 0, 0])).depth - 1.0).max() < 1e-6
    behind = renderer.render(room, [0.0], Camera.look_at([3, 0, 0], [9, 0, 0]))
    assert (behind.part_ids == BACKGROUND).all()
    assert (behind.depth == 0).all()


def test_a_part_without_geometry_is_never_seen(renderer: WarpRenderer) -> None:
    turn = Joint("turn", "continuous", 0, lower=-np.inf, upper=np.inf)
    tree = artsim.KinematicTree([Joint("root", "free", -1), turn])
    empty = Part("empty", "empty", np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    obj = ArticulatedObject("o", "c", (empty, solid("box", trimesh.creation.box((1, 1, 1)))), tree, "0" * 64)
    frame = renderer.render(obj, [0.0, 1.0], Camera.look_at([-3, 1, 1], [0, 0, 0]))
    assert set(np.unique(frame.part_ids)) == {1, BACKGROUND}


def test_a_sample_is_the_same_as_by_raycast(renderer: WarpRenderer) -> None:
    obj = artsim.load(ASSETS / "eyeglasses")
    q = sample_state(obj, StateOptions(), np.random.default_rng(2))
    camera = Camera.look_at([-0.4, 0.1, 0.2], [0, 0, 0], 160, 120)
    ours, rays = (observe(obj, q, camera, num_points=64, renderer=r) for r in (renderer, "raycast"))
    assert ours.renderer == "warp"
    assert np.abs(ours.points - rays.points).max() < 1e-5
    assert np.array_equal(ours.part, rays.part)
    assert np.abs(ours.visible_fraction - rays.visible_fraction).max() < 0.2


def pixels_of(camera: Camera, points: np.ndarray) -> np.ndarray:
    column, row = np.floor(camera.project(points)).astype(int).T
    return (row * camera.width + column).T


def test_clouds_choose_every_visible_pixel_equally_often(renderer: WarpRenderer) -> None:
    """Chi-square over 1000 clouds of each of two objects, against the uniform distribution over the visible pixels."""
    camera = Camera.look_at([-1.6, 0.5, 1.0], [0, 0, 0], 48, 36)
    cabinet, laptop = artsim.load(ASSETS / "cabinet"), artsim.load(ASSETS / "laptop").with_diagonal(1.2)
    objects, count = renderer.load([cabinet, laptop]), 2000
    numbers = np.arange(count) % 2
    views = Views.of(numbers, [[cabinet.tree.rest, laptop.tree.rest][n] for n in numbers], [camera] * count)
    images, clouds = renderer.render_views(objects, views), renderer.clouds(objects, views, 40, seed=7)
    points, part = clouds.points.numpy(), clouds.part.numpy()
    for number in range(2):
        depth, part_ids = images.depth.numpy()[number].ravel(), images.part_ids.numpy()[number].ravel()
        visible = np.flatnonzero(part_ids != BACKGROUND)
        assert len(visible) > 80
        pixels = pixels_of(camera, points[number::2])
        assert all(len(np.unique(cloud)) == 40 for cloud in pixels)
        assert np.array_equal(part[number::2], part_ids[pixels])
        assert (
            np.abs(points[number::2] - camera.unproject(pixels.ravel(), depth[pixels].ravel()).reshape(-1, 40, 3)).max()
            < 1e-6
        )
        counts = np.bincount(pixels.ravel(), minlength=depth.size)
        assert counts.sum() == counts[visible].sum()
        assert chisquare(counts[visible]).pvalue > 1e-3
        # No two pixels are chosen together more often than by chance: neighbours, in the order of pixels.
        chosen = np.zeros((len(pixels), depth.size), dtype=bool)
        np.put_along_axis(chosen, pixels, True, axis=1)
        chosen, n = chosen[:, visible], len(visible)
        for apart in (1, 2, 5, 16):
            together = (chosen[:, apart:] & chosen[:, :-apart]).sum()
            expected = len(pixels) * (n - apart) * 40 * 39 / (n * (n - 1))
            assert abs(together - expected) < 5 * np.sqrt(expected)


def test_clouds_depend_on_nothing_but_seed_and_place_in_the_batch(renderer: WarpRenderer) -> None:
    scenes = scenes_of([make("laptop", seed=1), make("bucket", seed=2)], states=2)
    objects, views = views_of(scenes)
    loaded = renderer.load(objects)
    first, again, other = (renderer.clouds(loaded, views, 256, seed).points.numpy() for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    alone = Views(views.objects[:2], views.q[:2], views.T_camera_object[:2], views.K[:2], views.width, views.height)
    assert np.array_equal(renderer.clouds(loaded, alone, 256, 1).points.numpy(), first[:2])


def test_a_cloud_larger_than_the_object_takes_every_pixel_and_repeats(renderer: WarpRenderer) -> None:
    obj = artsim.load(ASSETS / "laptop")
    cameras = [Camera.look_at([-2, 0.1, 1], [0, 0, 0], 64, 48), Camera.look_at([-2, 0.1, 1], [-4, 0, 0], 64, 48)]
    views, objects = Views.of([0, 0], [obj.tree.rest] * 2, cameras), renderer.load([obj])
    visible = (renderer.render_views(objects, views).part_ids.numpy()[0] != BACKGROUND).sum()
    clouds = renderer.clouds(objects, views, 2048)
    assert 0 < visible < 2048
    assert len(np.unique(clouds.points.numpy()[0], axis=0)) == visible
    assert (clouds.part.numpy()[0] != BACKGROUND).all()
    assert (clouds.part.numpy()[1] == BACKGROUND).all(), "the second camera looks away"
    assert (clouds.points.numpy()[1] == 0).all()


def test_arrays_of_the_device_are_taken_and_given_without_a_copy(renderer: WarpRenderer, warp: ModuleType) -> None:
    torch = installed("torch")
    _, views = views_of(scenes_of([make("laptop", seed=1)], states=2))
    objects = renderer.load([make("laptop", seed=1).with_diagonal(1.0)])
    shared = replace(views, q=warp.from_torch(torch.from_numpy(views.q).to(warp.device_to_torch(renderer.device))))
    images = renderer.render_views(objects, shared)
    assert np.array_equal(images.depth.numpy(), renderer.render_views(objects, views).depth.numpy())
    depth = torch.from_dlpack(images.depth)
    assert depth.data_ptr() == images.depth.ptr
    assert warp.to_torch(images.T_camera_part).shape == (2, len(views.q[0]), 4, 4)


def test_what_does_not_fit_is_refused(renderer: WarpRenderer) -> None:
    obj, camera = artsim.load(ASSETS / "cabinet"), Camera.look_at([-2, 0, 1], [0, 0, 0], 64, 48)
    objects, views = renderer.load([obj]), Views.of([0, 0], [obj.tree.rest] * 2, [camera] * 2)
    with pytest.raises(ConfigError, match="use 0 to 0"):
        renderer.render_views(objects, replace(views, objects=np.array([0, 1])))
    with pytest.raises(ConfigError, match=r"q: an array of shape \(2, 3\) does not fit"):
        renderer.render_views(objects, replace(views, q=views.q[:, :3]))
    with pytest.raises(ConfigError, match="finite"):
        renderer.render_views(objects, replace(views, q=views.q * np.nan))
    with pytest.raises(ConfigError, match="not made at once"):
        renderer.render_views(objects, replace(views, width=2**20, height=2**20))
    with pytest.raises(ConfigError, match=r"K: an array of shape \(1, 3, 3\)"):
        renderer.render_views(objects, replace(views, K=views.K[:1]))
    with pytest.raises(ConfigError, match="is empty"):
        renderer.clouds(objects, views, 0)
    with pytest.raises(ConfigError, match="no object"):
        renderer.load([])
    with pytest.raises(ConfigError, match="2 objects, 1 states"):
        Views.of([0, 0], [obj.tree.rest], [camera] * 2)
    with pytest.raises(KinematicsError, match="does not fit"):
        renderer.render(obj, [0.0], camera)


@pytest.mark.parametrize("device", ["abacus", "cuda:99"])
def test_an_unknown_device_is_refused_with_those_there_are(device: str, warp: ModuleType) -> None:
    with pytest.raises(ArtsimError, match=r"no device.*use one of .*cpu"):
        WarpRenderer(device)


@pytest.mark.slow
@pytest.mark.parametrize(("missing", "mend"), [("warp", "[warp]"), ("cache", "WARP_CACHE_PATH")])
def test_what_warp_lacks_is_said_with_the_mend(missing: str, mend: str, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    variables = {**os.environ, "WARP_CACHE_PATH": str(tmp_path / "file" / "cache")}
    if missing == "warp":
        variables["PYTHONPATH"] = environment(tmp_path, ["warp"])["PYTHONPATH"]
    program = (
        "import artsim\ntry:\n    artsim.make_renderer('warp')\nexcept artsim.ArtsimError as error:\n    print(error)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=variables, timeout=120)
    assert done.returncode == 0, done.stderr
    assert mend in done.stdout


def test_importing_artsim_does_not_import_warp() -> None:
    program = "import sys, artsim.renderers; artsim.renderers.RENDERERS; sys.exit('warp' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], timeout=120).returncode == 0


@pytest.mark.slow
def test_the_kernels_compile_for_a_gpu_that_is_not_here(tmp_path: Path, warp: ModuleType) -> None:
    program = (
        "import sys, warp\n"
        "from artsim.renderers import warp_kernels\n"
        "warp.compile_aot_module(warp_kernels, arch=90, module_dir=sys.argv[1], use_ptx=True)\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    if "NVRTC" in done.stderr:
        absent(f"this build of Warp has no compiler for GPUs: {done.stderr[-200:]}")
    assert done.returncode == 0, done.stderr
    (ptx,) = tmp_path.glob("*.ptx")
    assert all(kernel in ptx.read_text() for kernel in ("pose", "cast", "mark", "gather", "draw"))
