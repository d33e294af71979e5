"""Clouds beside other programs: ``python -m benchmarks.peers``.

The same objects, states, cameras and pixels: each program gives depth and part at pixels, and the cloud is drawn of
them as artsim draws its own. trimesh and open3d cast only the rays of the cloud, through Embree, against the posed
triangles; the others draw whole frames. The pixels of a cloud are drawn by artsim's own loops for all. artsim's
clouds carry all ground truth, those of the others points and parts. open3d and pyrender are no dependencies of
artsim: ``pip install open3d pyrender`` adds them. What is not installed is named. Blender is left out, since its
package needs NumPy 1. Processor time; the last line is one JSON object.
"""

import json
import os
import time
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from numpy.typing import NDArray

from artsim import ArticulatedObject, Camera, make_renderer, observe
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError
from artsim.model.frame import BACKGROUND
from artsim.model.transforms import transform_points
from artsim.observing.capture import draw_visible
from artsim.renderers.raycast import pose
from tests.agreement import Scene, choose, choose_procedural, draw_scenes

NUM_POINTS = 2048
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
    only: tuple[str, ...] = ()
    """Programs beside artsim; by default all."""

    def __post_init__(self) -> None:
        if min(self.objects, self.views) < 1:
            raise ConfigError(f"{self.objects} objects, {self.views} views are no work", fix="use 1 or more of each")


def main(options: Options) -> None:
    """Measure and print."""
    for library in ("OMP", "OPENBLAS", "MKL"):
        os.environ[f"{library}_NUM_THREADS"] = "1"
    for library in ("MUJOCO_GL", "PYOPENGL_PLATFORM"):
        os.environ.setdefault(library, "egl")
    partnet = os.environ.get("ARTSIM_PARTNET_DIR")
    real = choose(Path(partnet), options.objects // 2) if partnet else []
    sources = real + choose_procedural(options.objects - len(real))
    scenes = [scene for i, one in enumerate(sources) for scene in draw_scenes(one.load(), options.views, 1, i)]
    # In any order: those that are cut off are no special ones.
    scenes = [scenes[i] for i in np.random.default_rng(0).permutation(len(scenes))]
    print(f"{len(scenes)} scenes")
    rates: dict[str, float] = {}
    for name, program in PROGRAMS.items():
        if options.only and name not in ("artsim", *options.only):
            continue
        try:
            cloud = program()
            cloud(scenes[0])
            rates[name] = clouds_per_second(name, cloud, scenes, options.seconds)
            print(
                f"{name:14} {rates[name]:8.1f} clouds/s   artsim / it {rates['artsim'] / rates[name]:6.1f}", flush=True
            )
        except (ArtsimError, ImportError, OSError) as error:
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
            return _of_frame(pose(*scene), frame.depth, frame.part_ids)

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


def open3d_frames() -> Callable[[Scene], Cloud]:
    """Rays of Open3D through all pixels."""
    return open3d_rays(whole=True)


def open3d_rays(whole: bool = False) -> Callable[[Scene], Cloud]:
    """Rays of Open3D, which hands them to Embree, against the posed parts: those of the cloud, or of all pixels."""
    import open3d as o3d

    def cloud(scene: Scene) -> Cloud:
        obj, _, camera = scene
        posed, rays = pose(*scene), o3d.t.geometry.RaycastingScene(nthreads=1)
        part_of = np.full(len(obj) + 1, BACKGROUND, np.uint8)
        for k in (k for k in range(len(obj)) if len(obj.parts[k].faces)):
            corners = transform_points(posed.T_camera_part[k], obj.scale * obj.parts[k].vertices)
            faces = obj.parts[k].faces.astype(np.uint32)
            part_of[rays.add_triangles(o3d.core.Tensor(corners.astype(np.float32)), o3d.core.Tensor(faces))] = k

        def look(row: Any, column: Any) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
            cast = np.zeros((len(row), 6), np.float32)
            cast[:, 3:] = camera.directions(row * camera.width + column)
            found = rays.cast_rays(o3d.core.Tensor(cast), nthreads=1)
            number = np.minimum(found["geometry_ids"].numpy(), len(obj))
            return found["t_hit"].numpy(), part_of[number]

        if whole:
            row, column = np.divmod(np.arange(camera.width * camera.height), camera.width)
            depth, part = look(row, column)
            size = camera.height, camera.width
            return _of_frame(posed, depth.reshape(size), part.reshape(size))
        return draw_visible(posed, look, NUM_POINTS, np.random.default_rng(0))

    return cloud


def mujoco_frames() -> Callable[[Scene], Cloud]:
    """Depth and segmentation of MuJoCo's renderer; one model for each object, its parts moved as mocap bodies."""
    import mujoco

    kept: weakref.WeakKeyDictionary[ArticulatedObject, tuple[Any, ...]] = weakref.WeakKeyDictionary()

    def prepare(obj: ArticulatedObject, camera: Camera) -> tuple[Any, ...]:
        spec = mujoco.MjSpec()
        spec.visual.global_.offwidth, spec.visual.global_.offheight = camera.width, camera.height
        spec.worldbody.add_camera(name="camera", quat=[0.0, 1.0, 0.0, 0.0])  # looks along +Z, y down
        solid = [k for k in range(len(obj)) if len(obj.parts[k].faces)]
        for k in solid:
            mesh = spec.add_mesh(name=f"m{k}", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
            mesh.uservert = (obj.scale * obj.parts[k].vertices).ravel()
            mesh.userface = obj.parts[k].faces.ravel()
            body = spec.worldbody.add_body(name=f"p{k}", mocap=True)
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"m{k}", contype=0, conaffinity=0)
        model = spec.compile()
        model.stat.extent, model.vis.map.znear, model.vis.map.zfar = 1.0, 0.05, 100.0
        data = mujoco.MjData(model)
        return model, data, mujoco.Renderer(model, camera.height, camera.width), solid

    def cloud(scene: Scene) -> Cloud:
        obj, _, camera = scene
        if obj not in kept:
            kept[obj] = prepare(obj, camera)
        model, data, drawer, solid = kept[obj]
        posed = pose(*scene)
        for slot, k in enumerate(solid):
            T = posed.T_camera_part[k]
            data.mocap_pos[slot] = T[:3, 3]
            mujoco.mju_mat2Quat(data.mocap_quat[slot], T[:3, :3].ravel())
        mujoco.mj_kinematics(model, data)
        mujoco.mj_camlight(model, data)
        model.cam_fovy[0] = np.rad2deg(2.0 * np.arctan(0.5 * camera.height / camera.K[1, 1]))
        drawer.update_scene(data, "camera")
        drawer.enable_depth_rendering()
        depth = drawer.render()
        drawer.disable_depth_rendering()
        drawer.enable_segmentation_rendering()
        geom = drawer.render()[..., 0]
        drawer.disable_segmentation_rendering()
        part = np.array([*solid, BACKGROUND], np.uint8)[geom]  # -1 where there is nothing
        return _of_frame(posed, depth, part)

    return cloud


def pyrender_frames() -> Callable[[Scene], Cloud]:
    """Depth and segmentation of pyrender's renderer; meshes stay on the card."""
    import pyrender
    from trimesh import Trimesh

    kept: weakref.WeakKeyDictionary[ArticulatedObject, tuple[Any, ...]] = weakref.WeakKeyDictionary()
    drawers: dict[tuple[int, int], Any] = {}

    def prepare(obj: ArticulatedObject, camera: Camera) -> tuple[Any, ...]:
        scene = pyrender.Scene()
        nodes = {
            k: scene.add(
                pyrender.Mesh.from_trimesh(
                    Trimesh(obj.scale * obj.parts[k].vertices, obj.parts[k].faces, process=False), smooth=False
                )
            )
            for k in range(len(obj)) if len(obj.parts[k].faces)
        }  # fmt: skip
        K = camera.K
        look = pyrender.IntrinsicsCamera(K[0, 0], K[1, 1], K[0, 2], K[1, 2], znear=0.05, zfar=100.0)
        eye = scene.add(look, pose=np.diag([1.0, -1.0, -1.0, 1.0]))
        return scene, nodes, eye

    def cloud(asked: Scene) -> Cloud:
        obj, _, camera = asked
        size = camera.width, camera.height
        if size not in drawers:
            drawers[size] = pyrender.OffscreenRenderer(*size)
        if obj not in kept:
            kept[obj] = prepare(obj, camera)
        scene, nodes, eye = kept[obj]
        posed, K = pose(*asked), camera.K
        eye.camera.fx, eye.camera.fy, eye.camera.cx, eye.camera.cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
        for k, node in nodes.items():
            scene.set_pose(node, posed.T_camera_part[k])
        colours = {node: (k + 1, 0, 0) for k, node in nodes.items()}
        marked, depth = drawers[size].render(scene, pyrender.RenderFlags.SEG, colours)
        part = (marked[..., 0].astype(np.int16) - 1).astype(np.uint8)  # 255 where there is nothing
        return _of_frame(posed, depth, part)

    return cloud


def _of_frame(posed: Any, depth: NDArray[np.float32], part: NDArray[np.uint8]) -> Cloud:
    return draw_visible(
        posed, lambda row, column: (depth[row, column], part[row, column]), NUM_POINTS, np.random.default_rng(0)
    )


PROGRAMS: dict[str, Callable[[], Callable[[Scene], Cloud]]] = {
    "artsim": artsim_cloud,
    "trimesh": trimesh_rays,
    "open3d": open3d_rays,
    "open3d-frames": open3d_frames,
    "mujoco": mujoco_frames,
    "pyrender": pyrender_frames,
    "pybullet": frames_of("pybullet"),
    "pybullet-egl": frames_of("pybullet-egl"),
    "sapien": frames_of("sapien"),
}
"""What makes clouds, by name; artsim comes first."""


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
