"""Clouds beside other programs: ``python -m benchmarks.peers``.

The same objects, states, cameras and pixels: each program gives depth and part at pixels, and the cloud is drawn of
them as artsim draws its own. trimesh casts only the rays of the cloud, through Embree, against the posed triangles; the
others draw whole frames. artsim's clouds carry all ground truth, those of the others points and parts. What is not
installed is named. Processor time, all by turns; the last line is one JSON object.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import tyro
from numpy.typing import NDArray

from artsim import ArticulatedObject, Camera, StateOptions, ViewOptions, make_renderer, observe, sample_state
from artsim import sample_view as draw_camera
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError
from artsim.model.frame import BACKGROUND
from artsim.model.kinematics import Array, transform_points
from artsim.observing.capture import draw_visible
from artsim.renderers.compiled import compile_now
from artsim.renderers.raycast import pose
from benchmarks.compared.generation import benchmark_objects

NUM_POINTS = 2048
Scene = tuple[ArticulatedObject, Array, Camera]
Cloud = tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.uint8]]


@dataclass(frozen=True)
class Options:
    """Compare clouds with those of other programs."""

    objects: int = 40
    """Half of them real where ARTSIM_PARTNET_DIR is set."""
    views: int = 4
    """Of each object; slow programs see as many as fit in --seconds."""
    seconds: float = 30.0
    """Processor time of each program, at most."""

    def __post_init__(self) -> None:
        if min(self.objects, self.views) < 1:
            raise ConfigError(f"{self.objects} objects, {self.views} views are no work", fix="use 1 or more of each")


def main(options: Options) -> None:
    """Measure and print."""
    rng = np.random.default_rng(0)
    scenes: list[Scene] = []
    for obj in benchmark_objects(options.objects):
        for _ in range(options.views):
            q = sample_state(obj, StateOptions(), rng)
            scenes.append((obj, q, draw_camera(obj, q, ViewOptions(), rng)))
    scenes = [scenes[i] for i in rng.permutation(len(scenes))]  # those that are cut off are no special ones
    compiled = compile_now()
    print(f"{len(scenes)} scenes, artsim's loops {'compiled' if compiled else 'in NumPy'}")
    rates: dict[str, float] = {}
    for name, program in PROGRAMS.items():
        try:
            cloud = program()
            cloud(scenes[0])
            rates[name] = clouds_per_second(name, cloud, scenes, options.seconds)
            print(
                f"{name:14} {rates[name]:8.1f} clouds/s   artsim / it {rates['artsim'] / rates[name]:6.1f}", flush=True
            )
        except (ArtsimError, ImportError) as error:
            print(f"{name:14} not measured: {error}")
    best = max((rate for name, rate in rates.items() if name != "artsim"), default=float("nan"))
    ratio = rates["artsim"] / best
    print(json.dumps({"clouds_per_s": {k: round(v, 1) for k, v in rates.items()}, "over_best_peer": round(ratio, 2)}))


def clouds_per_second(name: str, cloud: Callable[[Scene], Cloud], scenes: list[Scene], most: float) -> float:
    """Of one core; each object is seen once before, so that what is kept of it does not count."""
    for scene in {id(scene[0]): scene for scene in scenes}.values():
        cloud(scene)
    begun, count = time.process_time(), 0
    for scene in track(name, scenes, leave=False):
        cloud(scene)
        count += 1
        if time.process_time() - begun > most:
            break
    return count / (time.process_time() - begun)


def artsim_cloud() -> Callable[[Scene], Cloud]:
    """Ours, with all ground truth."""

    def cloud(scene: Scene) -> Cloud:
        sample = observe(*scene, num_points=NUM_POINTS, rng=np.random.default_rng(0))
        return np.zeros(0, np.int64), sample.points[:, 2], sample.part

    return cloud


def frames_of(renderer: str) -> Callable[[], Callable[[Scene], Cloud]]:
    """Whole frames of a program behind artsim's protocol for renderers."""

    def program() -> Callable[[Scene], Cloud]:
        drawer = make_renderer(renderer)

        def cloud(scene: Scene) -> Cloud:
            frame = drawer.render(*scene)
            return draw_visible(
                pose(*scene),
                lambda row, column: (frame.depth[row, column], frame.part_ids[row, column]),
                NUM_POINTS,
                np.random.default_rng(0),
            )

        return cloud

    return program


def trimesh_rays() -> Callable[[Scene], Cloud]:
    """Rays of trimesh, which hands them to Embree, against the posed object."""
    from trimesh import Trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    def cloud(scene: Scene) -> Cloud:
        obj, _, camera = scene
        posed = pose(*scene)
        solid = [k for k in range(len(obj)) if len(obj.parts[k].faces)]
        corners = [transform_points(posed.T_camera_part[k], obj.scale * obj.parts[k].vertices) for k in solid]
        before = np.cumsum([0, *map(len, corners)])
        faces = np.concatenate([obj.parts[k].faces + before[i] for i, k in enumerate(solid)])
        owner = np.repeat(np.array(solid, dtype=np.uint8), [len(obj.parts[k].faces) for k in solid])
        mesh = Trimesh(np.concatenate(corners), faces, process=False)
        rays = RayMeshIntersector(mesh)

        def look(row: Any, column: Any) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
            directions = camera.directions(row * camera.width + column)
            depth, part = np.zeros(len(row), np.float32), np.full(len(row), BACKGROUND, np.uint8)
            triangle = rays.intersects_first(np.zeros_like(directions), directions)
            hit = (triangle >= 0).nonzero()[0]
            normal = mesh.triangles_cross[triangle[hit]]
            corner = mesh.triangles[triangle[hit], 0]
            with np.errstate(divide="ignore", invalid="ignore"):  # a ray along its triangle
                depth[hit] = (normal * corner).sum(axis=1) / (normal * directions[hit]).sum(axis=1)
            part[hit] = owner[triangle[hit]]
            return depth, part

        return draw_visible(posed, look, NUM_POINTS, np.random.default_rng(0))

    return cloud


PROGRAMS: dict[str, Callable[[], Callable[[Scene], Cloud]]] = {
    "artsim": artsim_cloud,
    "trimesh": trimesh_rays,
    "pybullet": frames_of("pybullet"),
    "pybullet-egl": frames_of("pybullet-egl"),
    "sapien": frames_of("sapien"),
}
"""What makes clouds, by name; artsim comes first."""


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
