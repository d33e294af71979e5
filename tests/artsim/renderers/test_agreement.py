"""The renderers against each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

import artsim
from artsim import Camera, make_renderer, observe
from tests.agreement import LIMITS, choose, compare, draw_scenes
from tests.conftest import ASSETS, DEMO, backend, rigid

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", LIMITS)
def test_renderers_agree_on_real_objects(name: str, partnet_dir: Path) -> None:
    renderer = backend(name)
    scenes = [
        scene
        for seed, source in enumerate(choose(partnet_dir, 23)[::3])
        for scene in draw_scenes(source.load(), states=2, views=1, seed=seed)
    ]
    agreement = compare(scenes, renderer)
    renderer.close()
    assert agreement.agrees(LIMITS[name]), agreement.summary()


@pytest.mark.parametrize("name", ["raycast", "warp", "sapien", "pybullet", "pybullet-egl"])
def test_depth_is_along_the_optical_axis_in_metres(name: str) -> None:
    renderer = backend(name)
    box = rigid(trimesh.creation.box((1, 1, 1)))
    for scale, distance in ((1.0, 3.0), (0.01, 0.05), (50.0, 120.0)):
        frame = renderer.render(box.scaled(scale), [0.0], Camera.look_at([-distance, 0, 0], [0, 0, 0]))
        seen = frame.depth[frame.part_ids == 0]
        assert len(seen) > 1000
        assert np.abs(seen - (distance - 0.5 * scale)).max() < 1e-5 * distance
        assert (frame.depth[frame.part_ids != 0] == 0).all()
    renderer.close()


@pytest.mark.parametrize("name", ["warp", "sapien", "pybullet", "pybullet-egl"])
def test_principal_point_and_placement_are_honoured(name: str) -> None:
    obj = artsim.load(ASSETS / "cabinet")
    K = np.array([[500.0, 0, 280], [0, 520, 270], [0, 0, 1]])
    camera = Camera(K, 640, 480, Camera.look_at([-1.5, 0.4, 1.0], [0.2, 0, 0]).T_world_camera)
    T_world_object = np.eye(4)
    T_world_object[:3, :3] = trimesh.transformations.rotation_matrix(0.4, [0, 0, 1])[:3, :3]
    T_world_object[:3, 3] = [0.1, -0.05, 0.02]
    q = obj.tree.rest + [0, 0.1, 0.2, 0.05]
    renderer = backend(name)
    rays = make_renderer("raycast").render(obj, q, camera, T_world_object)
    frame = renderer.render(obj, q, camera, T_world_object)
    renderer.close()
    assert (rays.part_ids == frame.part_ids).mean() > 0.999
    same = (rays.part_ids == frame.part_ids) & (rays.depth > 0)
    assert np.median(np.abs(rays.depth - frame.depth)[same]) < 5e-5


@pytest.mark.parametrize("name", ["sapien", "pybullet"])
def test_colour_comes_with_rasterisers(name: str) -> None:
    obj = artsim.load(ASSETS / "laptop")
    camera = Camera.look_at([-0.5, 0.2, 0.4], [0, 0, 0])
    sample = observe(obj, obj.tree.rest + [0.0, 1.5], camera, renderer=backend(name), images=("rgb", "depth"))
    assert sample.rgb is not None
    assert sample.rgb.shape == (480, 640, 3)
    assert sample.renderer == name


@pytest.mark.parametrize("name", ["warp", "sapien", "pybullet"])
def test_many_objects_in_turn_keep_their_own_pictures(name: str) -> None:
    renderer = backend(name)
    objects = [artsim.load(path) for path in DEMO]
    camera = Camera.look_at([-1.2, 0.3, 0.6], [0, 0, 0], 160, 120)
    first = [renderer.render(obj, obj.tree.rest, camera) for obj in objects]
    again = [renderer.render(obj, obj.tree.rest, camera) for obj in objects]
    renderer.close()
    for one, two in zip(first, again, strict=True):
        assert np.array_equal(one.depth, two.depth)
        assert np.array_equal(one.part_ids, two.part_ids)
