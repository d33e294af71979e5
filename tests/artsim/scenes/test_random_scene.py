"""Things stand in scenes without overlap, and what is said of a view of them is true."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold, Mesh64
from PIL import Image

from artsim import Camera
from artsim.datasets.shards import sample_from_members
from artsim.drawing.scene_overview import overview
from artsim.errors import ConfigError
from artsim.making.solids import box
from artsim.model.appearance import Lights, Material, Sun
from artsim.model.frame import BACKGROUND
from artsim.model.transforms import transform_points
from artsim.renderers import Renderer
from artsim.renderers.scene import Scene, Thing
from artsim.renderers.scene_renderer import render_scene
from artsim.scenes.ground_truth import SceneView, observe_scene, write_view
from artsim.scenes.props import place_solid
from artsim.scenes.random_scene import SceneCameraOptions, SceneOptions, make_scene, scene_camera, with_appearance
from tests.agreement import LIMITS
from tests.conftest import backend

pytestmark = pytest.mark.slow

CAMERA = SceneCameraOptions(width=320, height=200, aspect=(0.9, 1.1), off_center=0.05)
TABLE = SceneOptions(distractors=4)
FURNITURE = SceneOptions(categories=("storage_furniture", "dishwasher", "trash_can"), distractors=1)
GREY = Material((0.5, 0.5, 0.5), specular=0.0)
DAYLIGHT = Lights(Sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0)), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.fixture(scope="module")
def table_scene() -> Scene:
    return make_scene(TABLE, 3)


@pytest.fixture(scope="module")
def floor_scene() -> Scene:
    return make_scene(FURNITURE, 1)


@pytest.fixture(scope="module", params=["table_scene", "floor_scene"])
def scene(request: pytest.FixtureRequest) -> Scene:
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="module")
def view(table_scene: Scene) -> SceneView:
    camera = scene_camera(table_scene, CAMERA, seed=3)
    return observe_scene(table_scene, [camera], 512, "raycast", noise="d435", seed=5)[0]


def block(size: tuple[float, float, float], center: tuple[float, float, float]) -> Thing:
    half, middle = np.array(size) / 2, np.array(center)
    return place_solid("block", box(middle - half, middle + half), GREY)


def solids(thing: Thing) -> list[Manifold]:
    """Exact solid of each part as posed."""
    made = []
    for part, T in zip(thing.obj.parts, thing.T_world_part, strict=True):
        vertices = transform_points(T, part.vertices * thing.obj.scale)
        solid = Manifold(Mesh64(vertices, part.faces.astype(np.uint64)))
        assert solid.volume() > 0
        made.append(solid)
    return made


def test_no_two_things_overlap(scene: Scene) -> None:
    standing = [solids(thing) for thing in (*scene.instances, *scene.distractors)]
    for one, other in combinations(standing, 2):
        assert all((a ^ b).volume() == 0.0 for a in one for b in other)


def test_everything_stands_on_the_support(scene: Scene) -> None:
    support = scene.supports[0]
    assert support.vertices[:, 2].max() == pytest.approx(0.0, abs=1e-9)
    low, high = support.vertices.min(axis=0), support.vertices.max(axis=0)
    for thing in (*scene.instances, *scene.distractors):
        assert abs(thing.vertices[:, 2].min()) < 1e-6
        assert (thing.vertices[:, :2] > low[:2]).all()
        assert (thing.vertices[:, :2] < high[:2]).all()


def test_furniture_stands_on_the_floor_and_small_things_on_a_table(table_scene: Scene, floor_scene: Scene) -> None:
    assert table_scene.supports[0].obj.category == "table"
    assert floor_scene.supports[0].obj.category == "floor"
    assert all(np.allclose(thing.T_world_object[2], [0, 0, 1, thing.T_world_object[2, 3]], atol=1e-9)
               for thing in floor_scene.instances)  # fmt: skip


def test_the_same_seed_makes_the_same_scene(table_scene: Scene) -> None:
    again, other = make_scene(TABLE, 3), make_scene(SceneOptions(categories=("laptop",), distractors=0), 4)
    for one, two in zip(table_scene.things, again.things, strict=True):
        assert np.array_equal(one.vertices, two.vertices)
        for coat, same in zip(one.coats, two.coats, strict=True):
            assert [m.colour for m in coat.materials] == [m.colour for m in same.materials]
    assert table_scene.lights == again.lights
    cameras = [scene_camera(s, CAMERA, 3, view) for s in (table_scene, again) for view in (0, 1)]
    assert np.array_equal(cameras[0].K, cameras[2].K)
    assert np.array_equal(cameras[0].T_world_camera, cameras[2].T_world_camera)
    assert not np.allclose(cameras[0].T_world_camera, cameras[1].T_world_camera)
    assert other.instances[0].obj.sha256 != table_scene.instances[0].obj.sha256


def test_another_appearance_moves_nothing(table_scene: Scene) -> None:
    painted = with_appearance(table_scene, 8)
    colours = [[m.colour for coat in t.coats for m in coat.materials] for s in (table_scene, painted) for t in s.things]
    half = len(table_scene.things)
    assert all(before != after for before, after in zip(colours[:half], colours[half:], strict=True))
    assert painted.lights != table_scene.lights
    camera = scene_camera(table_scene, CAMERA, 0)
    assert np.array_equal(camera.T_world_camera, scene_camera(painted, CAMERA, 0).T_world_camera)
    first, second = (render_scene(s, [camera], "raycast")[0] for s in (table_scene, painted))
    assert np.array_equal(first.depth, second.depth)
    assert np.array_equal(first.instance_ids, second.instance_ids)


def test_objects_fill_the_share_of_the_image_that_was_asked_for(scene: Scene) -> None:
    options = SceneCameraOptions(width=400, height=300, fill=(0.8, 0.8), off_center=0.1, aspect=(1.2, 1.2))
    camera = scene_camera(scene, options, 0)
    assert camera.K[1, 1] / camera.K[0, 0] == pytest.approx(1.2)
    assert camera.K[0, 2] != 200.0
    points = np.concatenate([thing.vertices for thing in scene.instances])
    image = camera.project(transform_points(camera.T_camera_world, points)) / [400, 300]
    assert np.abs(image - 0.5).max() == pytest.approx(0.4, abs=1e-3)


@pytest.fixture(scope="module", params=["sapien", "pybullet", "pybullet-egl", "warp"])
def other(request: pytest.FixtureRequest) -> Iterator[Renderer]:
    renderer = backend(request.param)
    yield renderer
    renderer.close()


def test_every_renderer_sees_the_scene_that_rays_see(scene: Scene, other: Renderer) -> None:
    cameras = [scene_camera(scene, CAMERA, 0, view) for view in range(2)]
    mine, rays = render_scene(scene, cameras, other), render_scene(scene, cameras, "raycast")
    shown = equal = 0
    errors = []
    for one, two in zip(mine, rays, strict=True):
        objects = (one.instance_ids < len(scene.instances)) | (two.instance_ids < len(scene.instances))
        same = (one.instance_ids == two.instance_ids) & (one.part_ids == two.part_ids)
        shown, equal = shown + objects.sum(), equal + (objects & same).sum()
        errors.append(1e3 * np.abs(one.depth - two.depth)[same & objects])
        assert (one.rgb is None) == (other.name == "warp")
    assert shown > 5000
    median, _, share = LIMITS[other.name]
    assert equal / shown >= share
    assert np.median(np.concatenate(errors)) < median


def test_part_ids_are_those_of_articulated_objects_only(view: SceneView) -> None:
    ids, parts = view.frame.instance_ids, view.frame.part_ids
    count = len(view.scene.instances)
    assert (parts[ids >= count] == BACKGROUND).all()
    for i, thing in enumerate(view.scene.instances):
        assert parts[ids == i].max(initial=0) < len(thing.obj)
    assert set(np.unique(ids)) - {BACKGROUND} <= set(range(len(view.scene.things)))
    assert len(set(np.unique(ids)) & set(range(count))) == count


def test_a_plate_that_hides_half_of_another_leaves_half_of_it() -> None:
    near, far = block((0.01, 0.5, 1.0), (0.0, -0.25, 0.0)), block((0.01, 2.0, 2.0), (1.0, 0.0, 0.0))
    scene = Scene((near, far), (), (), DAYLIGHT)
    camera = Camera.look_at((-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 400, 400, fov_y=2 * np.arctan(1.2))
    seen = observe_scene(scene, [camera], 64, "raycast")[0]
    # Front faces at 0.995 and 1.995 m: the near plate's image is just larger than the far one's right half.
    hidden = 0.5
    assert seen.visible_fraction == pytest.approx([1.0, 1.0 - hidden], abs=0.006)
    assert seen.samples[1] is not None
    assert seen.samples[1].visible_fraction == pytest.approx([1.0 - hidden], abs=0.006)
    assert seen.boxes[1] == pytest.approx([116.5, 116.5, 200, 283.5], abs=1)


def test_what_is_hidden_altogether_has_no_sample() -> None:
    wall, behind = block((0.1, 2.0, 2.0), (0.0, 0.0, 0.0)), block((0.1, 0.2, 0.2), (0.5, 0.0, 0.0))
    scene = Scene((behind,), (wall,), (), DAYLIGHT)
    seen = observe_scene(scene, [Camera.look_at((-2, 0, 0), (0, 0, 0), 64, 48)], 64, "raycast")[0]
    assert seen.samples == (None,)
    assert seen.visible_fraction[0] == 0.0
    assert (seen.boxes[0] == 0).all()
    assert overview(seen).shape == (96, 128, 3)


def test_points_of_each_object_are_pixels_of_the_depth_image(view: SceneView) -> None:
    assert view.noise == "d435"
    assert not np.array_equal(view.depth, view.frame.depth)
    for i, sample in enumerate(view.samples):
        assert sample is not None
        image = view.camera.project(sample.points)
        assert np.abs(image % 1.0 - 0.5).max() < 1e-2
        column, row = image.astype(int).T
        assert (view.frame.instance_ids[row, column] == i).all()
        assert (view.frame.part_ids[row, column] == sample.part).all()
        assert sample.points[:, 2] == pytest.approx(view.depth[row, column], rel=1e-6)


def test_each_record_is_true_of_its_object(view: SceneView) -> None:
    for i, (sample, thing) in enumerate(zip(view.samples, view.scene.instances, strict=True)):
        assert sample is not None
        T = view.camera.T_camera_world @ thing.T_world_part
        assert sample.T_camera_part == pytest.approx(T, abs=1e-12)
        assert sample.category == thing.obj.category
        assert sample.joint_state == pytest.approx(thing.q)
        # The true place of each point, from its normalised part coordinates, lies on the noise-free surface.
        size = np.linalg.norm(sample.box_size, axis=1)[sample.part, None]
        rest = (sample.npcs - 0.5) * size + sample.box_center[sample.part]
        place = np.einsum("nij,nj->ni", T[sample.part][:, :3, :3], rest) + T[sample.part][:, :3, 3]
        column, row = view.camera.project(place).astype(int).T
        assert place[:, 2] == pytest.approx(view.frame.depth[row, column], abs=1e-5)
        assert sample.part_mask is not None
        assert np.array_equal(sample.part_mask != BACKGROUND, view.frame.instance_ids == i)


def test_the_same_seed_gives_the_same_view(view: SceneView) -> None:
    again = observe_scene(view.scene, [view.camera], 512, "raycast", noise="d435", seed=5)[0]
    assert np.array_equal(view.depth, again.depth)
    for one, two in zip(view.samples, again.samples, strict=True):
        assert one is not None
        assert two is not None
        assert np.array_equal(one.points, two.points)


def test_files_of_a_view_say_what_it_holds(view: SceneView, tmp_path: Path) -> None:
    write_view(view, tmp_path)
    assert np.array_equal(np.load(tmp_path / "depth.npy", allow_pickle=False), view.depth)
    ids = np.asarray(Image.open(tmp_path / "instance_ids.png"))
    assert np.array_equal(ids, view.frame.instance_ids)
    record = json.loads((tmp_path / "scene.json").read_text())
    assert [thing["kind"] for thing in record["things"]].count("object") == len(view.scene.instances)
    assert np.allclose(record["camera"]["K"], view.camera.K)
    assert record["things"][2]["category"] == view.scene.instances[2].obj.category
    members = {p.name.removeprefix("instance_1."): p.read_bytes() for p in tmp_path.glob("instance_1.*")}
    sample = view.samples[1]
    assert sample is not None
    assert np.array_equal(sample_from_members(members, "instance_1").points, sample.points)


@pytest.mark.parametrize(
    ("options", "mend"),
    [
        (SceneOptions(categories=("laptpo",)), "laptop"),
        (SceneOptions(categories=("microwave",) * 9, place="table", distractors=0), "fewer"),
    ],
)
def test_scenes_that_cannot_be_made_say_why(options: SceneOptions, mend: str) -> None:
    with pytest.raises(ConfigError) as caught:
        make_scene(options, 0)
    assert mend in str(caught.value)


def test_options_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ConfigError, match="negative"):
        make_scene(SceneOptions(), -1)
    with pytest.raises(ConfigError, match="rgb_samples"):
        render_scene(Scene((), (), (), DAYLIGHT), [], "raycast", 0)
    with pytest.raises(ConfigError, match="needs an object"):
        SceneOptions(categories=())
    with pytest.raises(ConfigError, match="distractors"):
        SceneOptions(distractors=-1)
    with pytest.raises(ConfigError, match="place"):
        SceneOptions(place="moon")  # type: ignore[arg-type]
    for wrong in ({"fov": (50.0, 40.0)}, {"fov": (0.0, 40.0)}, {"width": 0}, {"fill": (0.5, 1.5)}, {"off_center": 0.5}):
        with pytest.raises(ConfigError):
            SceneCameraOptions(**wrong)  # type: ignore[arg-type]


def test_the_command_writes_every_view(tmp_path: Path) -> None:
    program = str(Path(sys.executable).with_name("artsim"))
    command = [program, "scene", "--out", str(tmp_path), "--categories", "stapler", "scissors", "--seed", "2",
               "--views", "2", "--renderer", "raycast", "--camera.width", "96", "--camera.height", "64",
               "--distractors", "1"]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == [".lock", "000002_0", "000002_1", "scenes.json"]
    assert Image.open(tmp_path / "000002_1" / "overview.png").size == (192, 128)
    assert "stapler" in done.stdout
