"""Rays where Embree has no wheel: Warp's find what Embree's find, and the whole generator works by them."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from packaging.requirements import Requirement

from artsim import Camera, Dataset, make
from artsim.renderers.ray_kernels import part_directions
from artsim.renderers.ray_scenes import WarpScene, embree_scene
from artsim.renderers.raycast import pose, render_posed
from tests.conftest import absent, installed
from tests.without import environment

ROOT = Path(__file__).parents[3]
PLATFORMS = {
    "Linux on ARM": ("Linux", "aarch64", [f"manylinux_2_{n}_aarch64" for n in (17, 28, 34)]),
    "macOS on ARM": ("Darwin", "arm64", [f"macosx_{n}_0_arm64" for n in (11, 13, 14)]),
    "Windows": ("Windows", "AMD64", ["win_amd64"]),
}  # fmt: skip


def rays_at(vertices: NDArray[np.float64], count: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Rays from all round at and beside a mesh, their directions of any length."""
    rng = np.random.default_rng(0)
    middle, size = vertices.mean(axis=0), float(np.ptp(vertices, axis=0).max())
    outward = rng.normal(size=(count, 3))
    origins = middle + 2.0 * size * outward / np.linalg.norm(outward, axis=1, keepdims=True)
    aims = middle + size * rng.uniform(-0.7, 0.7, (count, 3))
    directions = (aims - origins) * rng.uniform(0.2, 2.0, (count, 1))
    return origins.astype(np.float32), directions.astype(np.float32)


@pytest.mark.parametrize("category", ["laptop", "scissors", "faucet"])
def test_both_libraries_meet_the_same_faces(category: str) -> None:
    installed("warp")
    for part in make(category, seed=2).parts:
        if not len(part.faces):
            continue
        origins, directions = rays_at(part.vertices, 4000)
        one, other = (scene(part.vertices, part.faces) for scene in (embree_scene, WarpScene))
        near, found = (scene.run(origins, directions) for scene in (one, other))
        assert (near >= 0).mean() > 0.02  # thin parts are hard to meet
        assert ((near >= 0) == (found >= 0)).mean() > 0.999
        assert (near == found).mean() > 0.99  # at an edge, and where faces coincide, either is right


@pytest.mark.parametrize("category", ["laptop", "scissors", "faucet", "bucket"])
def test_depths_are_those_of_embree(category: str) -> None:
    installed("embreex")
    obj = make(category, seed=2)
    camera = Camera.look_at(2.0 * obj.diagonal * np.array([-0.7, 0.4, 0.5]), (0, 0, 0), 160, 120)
    posed = pose(obj, obj.tree.rest, camera)
    for k, part in enumerate(obj.parts):
        depth = render_posed(posed, only=k).depth.ravel()
        row, column = np.divmod(np.arange(len(depth)), 160)
        rays = part_directions(row, column, np.array([0, len(row)]), posed.rotations[k : k + 1], posed.intrinsics)
        eyes = np.repeat(posed.origins[k : k + 1], len(rays), axis=0)
        found: Any = embree_scene(part.vertices, part.faces)
        near = found.run(eyes, rays, query="DISTANCE")
        assert ((near < 1e30) == (depth > 0)).all()
        np.testing.assert_allclose(depth[depth > 0], near[depth > 0] * obj.scale, rtol=2e-5)


def test_thousands_of_scenes_live_in_one_process() -> None:
    """Datasets of many small objects keep as many: a worker that made ArtSim-10K died of it."""
    source = (
        "import numpy as np\n"
        "from artsim.renderers.ray_scenes import embree_scene\n"
        "corners, faces = np.array([[-9, -9, 1], [9, -9, 1], [0, 9, 1.0]]), np.array([[0, 1, 2]])\n"
        "scenes = [embree_scene(corners * [1, 1, n + 1], faces) for n in range(4000)]\n"
        "ray = np.zeros((1, 3), np.float32), np.array([[0, 0, 1]], np.float32)\n"
        "print([float(s.run(*ray, query='DISTANCE')[0]) for s in scenes] == [n + 1.0 for n in range(4000)])\n"
    )
    done = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, "True\n"), done.stderr


@pytest.mark.slow
def test_without_embreex_the_generator_makes_the_same_clouds_by_several_workers(tmp_path: Path) -> None:
    installed("warp")
    (tmp_path / "hide").mkdir()
    clouds = {}
    for name, env in (("embree", None), ("warp", environment(tmp_path / "hide", {"embreex"}))):
        out = tmp_path / name
        command = [sys.executable, "-m", "artsim", "generate", "--categories", "laptop", "--num-samples", "4",
                   "--workers", "2", "--out", str(out)]  # fmt: skip
        done = subprocess.run(command, env=env, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stderr
        assert ("warp-lang" in json.loads((out / "dataset.json").read_text())["versions"]) == (name == "warp")
        clouds[name] = np.array([sample.points.mean(axis=0) for sample in Dataset(out)])
    # Points are drawn from the pixels that are met: one more or less, and others are drawn.
    assert np.abs(clouds["embree"] - clouds["warp"]).max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("name", PLATFORMS)
def test_the_core_has_wheels_for_other_systems(name: str, tmp_path: Path) -> None:
    system, machine, tags = PLATFORMS[name]
    there = {"platform_system": system, "platform_machine": machine, "python_version": "3.11", "extra": ""}
    listed = (ROOT / "pyproject.toml").read_text().partition("\ndependencies = [")[2].partition("\n]")[0]
    needs = [Requirement(line) for line in re.findall(r'^    "([^"]+)"', listed, re.MULTILINE)]
    assert len(needs) > 8
    wanted = [f"{need.name}{need.specifier}" for need in needs if not need.marker or need.marker.evaluate(there)]
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--no-deps", "--only-binary=:all:",
               "--python-version=3.11", f"--target={tmp_path}", *(f"--platform={tag}" for tag in tags)]  # fmt: skip
    done = subprocess.run([*command, *wanted], capture_output=True, text=True, timeout=300, check=False)
    if done.returncode:
        known = subprocess.run([*command, "numpy"], capture_output=True, text=True, timeout=300, check=False)
        if known.returncode:
            absent(f"pip finds not even numpy for {name}: wheels of the rest are not tested ({known.stderr[-300:]})")
    assert done.returncode == 0, done.stderr
