"""Materials, textures, coats and light are what they say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from artsim import Camera, make
from artsim.making.solids import box
from artsim.model.appearance import Coat, Lights, Material, Sun, corner_normals, patches, plain_coat, subpixel
from artsim.model.appearance.finishes import draw_coats
from artsim.model.objects import Part
from artsim.renderers import Renderer
from artsim.renderers.sapien import SapienRenderer
from artsim.renderers.scene import Scene, Thing
from artsim.renderers.scene_renderer import render_scene
from artsim.scenes.props import place_solid
from tests.conftest import backend, rigid, solid

MATT = Material((0.6, 0.4, 0.2), roughness=1.0, specular=0.0)
NONE = (0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def sapien() -> Iterator[Renderer]:
    renderer = backend("sapien")
    yield renderer
    renderer.close()


def test_spheres_look_round_and_boxes_have_edges() -> None:
    ball, cube = trimesh.creation.icosphere(3), trimesh.creation.box((1, 2, 3))
    normals = corner_normals(np.asarray(ball.vertices), np.asarray(ball.faces, np.int32))
    assert np.abs(normals - ball.vertices[ball.faces].reshape(-1, 3)).max() < 0.02
    normals = corner_normals(np.asarray(cube.vertices), np.asarray(cube.faces, np.int32))
    assert normals.reshape(-1, 3, 3) == pytest.approx(np.repeat(cube.face_normals[:, None], 3, axis=1), abs=1e-6)


def test_textures_have_their_size_in_metres_whatever_the_scale_of_the_object() -> None:
    part = solid("box", trimesh.creation.box((0.4, 0.3, 0.2)))
    coat = plain_coat(part, replace(MATT, tile=0.25))
    for scale in (1.0, 3.0):
        (patch,) = patches(part, coat, scale)
        corners, uv = patch.vertices.reshape(-1, 3, 3) * scale, patch.uv.reshape(-1, 3, 2)
        lengths = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
        assert np.linalg.norm(uv[:, 1] - uv[:, 0], axis=1) * 0.25 == pytest.approx(lengths, rel=1e-5)


def test_patches_are_the_whole_surface_split_by_material() -> None:
    obj = make("laptop", 3)
    for part, coat in zip(obj.parts, draw_coats(obj, np.random.default_rng(0)), strict=True):
        area = 0.0
        for patch in patches(part, coat):
            a, b, c = patch.vertices.reshape(-1, 3, 3).astype(float).transpose(1, 0, 2)
            area += 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
        whole = trimesh.Trimesh(part.vertices, part.two_sided_faces(), process=False)
        assert area == pytest.approx(whole.area, rel=1e-5)


def seen_from_above(things: tuple[Thing, ...], lights: Lights, renderer: Renderer, samples: int = 1) -> np.ndarray:
    """Colours 0 to 1 of a level place around the origin, 1 m wide, seen from 2 m above."""
    camera = Camera.look_at((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), 64, 64, 2 * np.arctan(0.25), up=(1.0, 0.0, 0.0))
    rgb = render_scene(Scene(things, (), (), lights), [camera], renderer, samples)[0].rgb
    assert rgb is not None
    return rgb / 255.0


def floor(size: float = 2.0) -> Thing:
    return place_solid("floor", box((-size, -size, -0.1), (size, size, 0.0)), MATT)


@pytest.mark.slow
def test_a_sun_of_strength_1_shows_a_surface_in_its_own_colour(sapien: Renderer) -> None:
    straight = Lights(Sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0)), NONE, NONE)
    assert seen_from_above((floor(),), straight, sapien)[32, 32] == pytest.approx(MATT.colour, abs=0.012)
    slanting = replace(straight, sun=Sun((np.sqrt(3.0), 0.0, -1.0), (1.0, 1.0, 1.0)))
    half = np.array(MATT.colour) * 0.5 ** (1 / 2.2)
    assert seen_from_above((floor(),), slanting, sapien)[32, 32] == pytest.approx(half, abs=0.012)


@pytest.mark.slow
def test_a_sky_of_strength_1_shows_a_level_surface_in_its_own_colour(sapien: Renderer) -> None:
    sky = Lights(Sun((0.0, 0.0, -1.0), NONE), (1.0, 1.0, 1.0), NONE)
    open_air = seen_from_above((floor(),), sky, sapien, samples=8)[32, 32]
    assert open_air == pytest.approx(MATT.colour, abs=0.02)
    walls = [((-0.3, -0.3, 0.0), (0.3, -0.2, 0.5)), ((-0.3, 0.2, 0.0), (0.3, 0.3, 0.5)),
             ((-0.3, -0.2, 0.0), (-0.2, 0.2, 0.5)), ((0.2, -0.2, 0.0), (0.3, 0.2, 0.5))]  # fmt: skip
    shaft = tuple(place_solid("wall", box(*corners), MATT) for corners in walls)
    assert (seen_from_above((floor(), *shaft), sky, sapien, samples=8)[32, 32] < 0.75 * open_air).all()


@pytest.mark.slow
def test_things_cast_shadows_where_geometry_says(sapien: Renderer) -> None:
    sun = Lights(Sun((1.0, 0.0, -1.0), (1.0, 1.0, 1.0)), NONE, NONE)
    plate = place_solid("plate", box((-0.3, -0.1, 0.199), (-0.1, 0.1, 0.2)), MATT)
    picture = seen_from_above((floor(), plate), sun, sapien)[..., 0]
    # Up in the image is +x, 64 pixels a metre on the ground: the shadow lies at x from -0.1 to 0.1.
    row = {x: round(32 - 64 * x - 0.5) for x in (-0.42, 0.02, 0.3)}
    assert picture[row[0.02], 32] < 0.02
    assert picture[row[0.3], 32] > 0.3
    assert picture[row[-0.42], 32] > 0.3
    assert picture[row[0.02], 4] > 0.3


def test_wide_suns_soften_the_edges_of_shadows(sapien: Renderer) -> None:
    plate = place_solid("plate", box((-0.9, -0.5, 0.499), (-0.5, 0.5, 0.5)), MATT)

    def penumbra(radius: float) -> int:
        sun = Lights(Sun((1.0, 0.0, -1.0), (1.0, 1.0, 1.0), radius), NONE, NONE)
        column = seen_from_above((floor(), plate), sun, sapien, samples=16)[:, 32, 0]
        return int(((column > 0.1) & (column < 0.4)).sum())

    # 1.4 m x 0.2 rad, seen at 64 pixels a metre on a slope of 45 degrees
    assert penumbra(0.0) <= 2
    assert 8 <= penumbra(0.2) <= 30


@pytest.mark.parametrize("name", ["sapien", "pybullet"])
def test_textures_lie_the_right_way_up(name: str) -> None:
    renderer = backend(name)
    texture = np.zeros((64, 64, 3), np.uint8)
    texture[:32, :32], texture[32:, 32:] = (255, 0, 0), (0, 255, 0)  # red above left, green below right
    sheet = Part("sheet", "sheet", np.array([[0, 0.5, -0.5], [0, -0.5, -0.5], [0, -0.5, 0.5], [0, 0.5, 0.5]], float),
                 np.array([[0, 1, 2], [0, 2, 3]], np.int32))  # fmt: skip
    uv = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], float)
    obj = replace(rigid(trimesh.creation.box()), parts=(sheet,))
    coat = Coat((replace(MATT, texture=texture),), np.zeros(2, np.int64), uv)
    lights = Lights(Sun((1.0, 0.0, 0.0), (0.5, 0.5, 0.5)), NONE, (0.5, 0.5, 0.5))
    scene = Scene((Thing(obj, np.zeros(1), np.eye(4), (coat,)),), (), (), lights)
    rgb = render_scene(scene, [Camera.look_at((-2, 0, 0), (0, 0, 0), 64, 64)], renderer)[0].rgb
    renderer.close()
    assert rgb is not None
    assert rgb[24, 24].argmax() == 0
    assert rgb[40, 40].argmax() == 1
    assert rgb[24, 24].max() > 80
    assert rgb[40, 40].max() > 80
    assert rgb[24, 40].max() < 60


def test_several_cameras_see_a_scene_that_was_loaded_once(sapien: Renderer) -> None:
    assert isinstance(sapien, SapienRenderer)
    scene = Scene((floor(),), (), (), Lights(Sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0)), NONE, NONE))
    cameras = [Camera.look_at((-1, 0.3, z), (0, 0, 0), *size) for z in (0.5, 1.0) for size in ((64, 48), (48, 64))]
    first = sapien.render_scene(scene, cameras)
    again = [sapien.render_scene(scene, [camera])[0] for camera in cameras]
    sapien._stages.get(scene, scene.num_faces, lambda: pytest.fail("it has to be loaded again"))
    for one, two in zip(first, again, strict=True):
        assert np.array_equal(one.depth, two.depth)
        assert np.array_equal(one.rgb, two.rgb)


def test_samples_of_a_picture_lie_within_their_pixel_around_its_middle() -> None:
    offsets = np.array([subpixel(index) for index in range(65)])
    assert (offsets[0] == 0.0).all()
    assert (np.abs(offsets) <= 0.5).all()
    assert np.abs(offsets.mean(axis=0)).max() < 0.02
    assert len(np.unique(offsets, axis=0)) == 65
