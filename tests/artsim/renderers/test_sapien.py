"""SAPIEN sees what rays see."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

import artsim
from artsim import Camera, make_renderer, observe
from artsim.datasets.sample_checks import sample_problems
from artsim.loading.sources import find_sources
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.objects import ArticulatedObject
from artsim.renderers import Renderer
from tests.agreement import LIMITS, compare, draw_scenes
from tests.conftest import ASSETS, DEMO, backend, rigid
from tests.without import environment

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def sapien() -> Iterator[Renderer]:
    renderer = backend("sapien")
    yield renderer
    renderer.close()


def assert_agrees(obj: ArticulatedObject, renderer: Renderer, states: int = 2) -> None:
    agreement = compare(draw_scenes(obj, states, 1, seed=3), renderer)
    assert agreement.agrees(LIMITS["sapien"]), agreement.summary()
    assert agreement.ids_differ["unexplained"] == 0


@pytest.mark.parametrize("path", DEMO, ids=lambda path: path.name)
def test_sapien_sees_what_rays_see_of_our_objects(path: Path, sapien: Renderer) -> None:
    assert_agrees(artsim.load(path), sapien)


@pytest.mark.parametrize("category", ["Laptop", "Faucet", "StorageFurniture", "Bucket"])
def test_sapien_sees_what_rays_see_of_real_objects(category: str, partnet_dir: Path, sapien: Renderer) -> None:
    assert_agrees(artsim.load(find_sources([partnet_dir / category])[0].path), sapien)


@pytest.mark.parametrize("category", ["laptop", "drawer"])
def test_sapien_sees_what_rays_see_of_procedural_objects(category: str, sapien: Renderer) -> None:
    assert_agrees(artsim.make(category, seed=1), sapien)


def test_every_intrinsic_parameter_counts(sapien: Renderer) -> None:
    K = np.array([[410.0, 12.0, 171.5], [0.0, 365.0, 98.25], [0.0, 0.0, 1.0]])
    look = Camera.look_at((-1.2, 0.7, 0.9), (0.0, 0.0, 0.0))
    camera = Camera(K, 320, 200, look.T_world_camera)
    T_world_object = np.eye(4)
    T_world_object[:3, 3] = 0.05, -0.1, 0.02
    obj = artsim.load(ASSETS / "cabinet").with_diagonal(0.8)
    mine, rays = (
        make.render(obj, obj.tree.rest, camera, T_world_object) for make in (sapien, make_renderer("raycast"))
    )
    shown = (mine.part_ids == rays.part_ids) & (rays.part_ids != BACKGROUND)
    assert (mine.part_ids != rays.part_ids).sum() < 1e-3 * shown.sum()
    assert np.median(np.abs(mine.depth - rays.depth)[shown]) < 5e-6


def frame_of_sheet(sapien: Renderer, normal_away: bool) -> Frame:
    """One triangle, which faces the camera or does not."""
    faces = np.array([[0, 1, 2] if normal_away else [0, 2, 1]])
    sheet = trimesh.Trimesh([[0, -0.5, -0.5], [0, 0.5, -0.5], [0, 0.0, 0.5]], faces, process=False)
    return sapien.render(rigid(sheet), [0.0], Camera.look_at((-2, 0, 0), (0, 0, 0), 64, 64))


def test_open_surfaces_are_seen_from_both_sides(sapien: Renderer) -> None:
    one, other = frame_of_sheet(sapien, True), frame_of_sheet(sapien, False)
    assert (one.part_ids == 0).sum() > 100
    assert np.array_equal(one.depth, other.depth)


def test_colour_tells_parts_apart(sapien: Renderer) -> None:
    obj = artsim.load(ASSETS / "laptop")
    camera = Camera.look_at((-1.0, 0.3, 0.8), (0, 0, 0), 160, 120)
    frame = sapien.render(obj, [0.0, 1.2], camera)
    assert frame.rgb is not None
    assert frame.rgb.shape == (120, 160, 3)
    colours = [frame.rgb[frame.part_ids == k].mean(axis=0) for k in range(2)]
    assert np.abs(colours[0] - colours[1]).max() > 20


def test_samples_drawn_by_sapien_are_sound(sapien: Renderer) -> None:
    obj = artsim.load(ASSETS / "cabinet")
    for scene in draw_scenes(obj, 2, 1, seed=0):
        sample = observe(*scene, renderer=sapien, images=("depth", "part_mask", "rgb"), noise="azure")
        assert sample.renderer == "sapien"
        assert list(sample_problems(sample, scene[0])) == []


def test_more_objects_than_are_kept_and_cameras_of_two_sizes_give_the_same_pictures(sapien: Renderer) -> None:
    objects = [rigid(trimesh.creation.box((0.2 + 0.01 * i, 0.3, 0.4))) for i in range(20)]
    cameras = [Camera.look_at((-1, 0.5, 0.5), (0, 0, 0), *size) for size in ((64, 48), (40, 40))]

    def pictures() -> list[NDArray[np.float32]]:
        return [sapien.render(obj, [0.0], camera).depth for obj in objects for camera in cameras]

    first, again = pictures(), pictures()
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert len(sapien._stages) <= 16  # type: ignore[attr-defined]


@pytest.mark.parametrize("missing", ["driver", "package"])
def test_what_sapien_lacks_is_said_and_the_process_lives_on(missing: str, tmp_path: Path) -> None:
    variables = {**os.environ, "VK_DRIVER_FILES": "/nonexistent", "VK_ICD_FILENAMES": "/nonexistent"}
    if missing == "package":
        variables = environment(tmp_path, ["sapien"])
    program = (
        "import artsim\n"
        "try:\n"
        "    artsim.make_renderer('sapien')\n"
        "except artsim.ArtsimError as error:\n"
        "    print(type(error).__name__, error)\n"
        "print('alive')"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=variables, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "RenderError" in done.stdout
    assert ("install-vulkan.sh" if missing == "driver" else "[sapien]") in done.stdout
    assert done.stdout.endswith("alive\n")


def test_importing_artsim_does_not_import_sapien() -> None:
    program = "import sys, artsim.renderers; artsim.renderers.RENDERERS; sys.exit('sapien' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], timeout=120).returncode == 0
