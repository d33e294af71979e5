"""PyBullet's two rasterisers: TinyRenderer (software, always there) and EGL (OpenGL without a display)."""

import importlib.util
import tempfile
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from artsim.common.extras import import_pybullet, silence_output
from artsim.errors import RenderError
from artsim.model.appearance import Coat, Lights, Patch, patches, subpixel
from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Part
from artsim.model.transforms import transform_points
from artsim.renderers.base import depth_range
from artsim.renderers.geometry_cache import GeometryCache
from artsim.renderers.raycast import pose
from artsim.renderers.scene import Scene, SceneFrame, split_ids

# As many objects as take turns in a plan; a process with several EGL contexts crashes inside PyBullet.
_MAX_WORLDS = {"pybullet": 16, "pybullet-egl": 1}
_EGL_FIX = "install libegl1 libegl-mesa0 libgl1-mesa-dri (Debian/Ubuntu), or use --renderer raycast"
# OpenGL's camera looks along -z with y up.
_GL_FROM_CV = np.diag([1.0, -1.0, -1.0, 1.0])


class BulletRenderer:
    """Rasterises one body per part, so that the segmentation buffer holds part ids.

    Each object has a physics world of its own; the least recently drawn are dropped.

    Raises
    ------
    RenderError
        When PyBullet is not installed, or EGL does not start.
    """

    name = "pybullet"
    _egl = False

    def __init__(self) -> None:
        self._worlds: GeometryCache[_World] = GeometryCache(_MAX_WORLDS[self.name])
        _World((), self._egl).close()  # says now, rather than at the first frame, that the backend is missing

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        """Render one posed object; see :class:`artsim.renderers.base.Renderer`."""
        T_camera_part = pose(obj, q, camera, T_world_object).T_camera_part
        T_camera_part[:, :3, 3] /= obj.scale  # drawn in native units
        world = self._worlds.get(
            obj.parts, obj.num_faces, lambda: _World([_Solid(part) for part in obj.parts], self._egl)
        )
        depth, solid, rgb = world.draw(camera, T_camera_part, *depth_range(obj, T_camera_part))
        part_ids = np.where(solid < 0, BACKGROUND, solid).astype(np.uint8)
        return Frame((depth * obj.scale).astype(np.float32), part_ids, rgb=rgb)

    def render_scene(self, scene: Scene, cameras: Sequence[Camera], samples: int = 1) -> list[SceneFrame]:
        """See a scene with several cameras; it is loaded once.

        Parameters
        ----------
        scene : Scene
        cameras : sequence of Camera
        samples : int
            Pictures that each colour image is the mean of: more of them give smooth edges. All else is sharp.

        Returns
        -------
        list of SceneFrame
            One for each camera.
        """
        world = self._worlds.get(
            scene, scene.num_faces, lambda: _World([_Solid(*solid) for solid in scene.solids], self._egl)
        )
        frames = []
        for camera in cameras:
            z = transform_points(camera.T_camera_world, scene.vertices)[:, 2]
            far = max(1.01 * float(z.max()), 0.1)
            near = max(0.9 * float(z[z > 0].min(initial=far)), 0.01 * far)
            T_camera_solid = camera.T_camera_world @ scene.T_world_solid
            if self._egl:  # depth buffers have 24 bits: a first picture says between which planes everything lies
                depth, _, _ = world.draw(camera, T_camera_solid, near, far)
                near, far = 0.99 * float(depth[depth > 0].min(initial=far)), 1.01 * max(float(depth.max()), near)
            depth, solid, rgb = world.draw(camera, T_camera_solid, near, far, scene.lights, samples)
            frames.append(SceneFrame(depth.astype(np.float32), *split_ids(scene, solid), rgb))
        return frames

    def close(self) -> None:
        """Drop every world."""
        self._worlds.close()


class EglRenderer(BulletRenderer):
    """Draws with OpenGL through EGL instead of TinyRenderer."""

    name = "pybullet-egl"
    _egl = True


@dataclass(frozen=True, eq=False)
class _Solid:
    """A part, drawn at a scale; without a coat, in PyBullet's own colours."""

    part: Part
    coat: Coat | None = None
    scale: float = 1.0


class _World:
    """A physics server that holds some solids, placed in the camera's own frame."""

    def __init__(self, solids: Sequence[_Solid], egl: bool):
        self.num_faces = sum(len(solid.part.faces) for solid in solids)
        self._bullet = import_pybullet()
        self._client: int = self._bullet.connect(self._bullet.DIRECT)
        self._flag = self._bullet.ER_BULLET_HARDWARE_OPENGL if egl else self._bullet.ER_TINY_RENDERER
        # TinyRenderer looks through the lower left corner of a pixel where others look through its centre (measured).
        self._shift = (0.0, 0.0) if egl else (-0.5, 0.5)
        self._textures: dict[int, int] = {}
        self.close = weakref.finalize(self, _disconnect, self._bullet, self._client)  # at exit, if not before
        try:
            if egl:
                self._start_egl()
            with tempfile.TemporaryDirectory(prefix="artsim-bullet-") as folder:
                self._bodies = [(k, body) for k, solid in enumerate(solids) for body in self._load(solid, Path(folder))]
        except RenderError:
            self.close()
            raise
        # Body -> number of its solid; the last entry answers for the background.
        self._solid_of_body = np.full(max((body for _, body in self._bodies), default=-1) + 2, -1, dtype=np.int64)
        for k, body in self._bodies:
            self._solid_of_body[body] = k

    def _start_egl(self) -> None:
        spec = importlib.util.find_spec("eglRenderer")
        if spec is None or spec.origin is None:
            raise RenderError("this PyBullet has no EGL plugin", "pybullet-egl", _EGL_FIX)
        with silence_output():
            plugin = self._bullet.loadPlugin(spec.origin, "_eglRendererPlugin", physicsClientId=self._client)
        if plugin < 0:
            raise RenderError("EGL does not start", "pybullet-egl", _EGL_FIX)

    def _load(self, solid: _Solid, folder: Path) -> Iterator[int]:
        """Bodies that show a solid: one, or one for each of its materials."""
        if len(solid.part.faces) == 0:
            return
        if solid.coat is None:
            yield self._body(_obj_text(solid.part.vertices, solid.part.two_sided_faces()), solid.part.name, folder)
            return
        for patch in patches(solid.part, solid.coat, solid.scale):
            body = self._body(_patch_text(patch, solid.scale), solid.part.name, folder)
            texture = patch.material.texture
            look: dict[str, object] = {"rgbaColor": [*patch.material.colour, 1.0]}
            if texture is not None:
                if id(texture) not in self._textures:
                    path = folder / f"{len(self._textures)}.png"
                    Image.fromarray(texture).save(path)
                    self._textures[id(texture)] = self._bullet.loadTexture(str(path), physicsClientId=self._client)
                look = {"rgbaColor": [1.0] * 4, "textureUniqueId": self._textures[id(texture)]}
            self._bullet.changeVisualShape(body, -1, physicsClientId=self._client, **look)
            yield body

    def _body(self, text: str, name: str, folder: Path) -> int:
        path = folder / f"{self._bullet.getNumBodies(physicsClientId=self._client)}.obj"
        path.write_text(text)
        visual = self._bullet.createVisualShape(
            self._bullet.GEOM_MESH, fileName=str(path), physicsClientId=self._client
        )
        if visual < 0:
            raise RenderError(f"PyBullet does not take the mesh of part {name!r}", "pybullet", "use raycast")
        return int(self._bullet.createMultiBody(0, -1, visual, physicsClientId=self._client))

    def draw(
        self,
        camera: Camera,
        T_camera_solid: Array,
        near: float,
        far: float,
        lights: Lights | None = None,
        samples: int = 1,
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.uint8]]:
        """Depth in the unit of the poses, numbers of solids (-1 for none) and colour.

        The first picture is taken through the pixels' centres; the colour is the mean of all.
        """
        from scipy.spatial.transform import Rotation  # takes longer to import than artsim itself

        for k, body in self._bodies:
            T = T_camera_solid[k]
            quaternion = Rotation.from_matrix(T[:3, :3]).as_quat()
            self._bullet.resetBasePositionAndOrientation(body, T[:3, 3], quaternion, physicsClientId=self._client)
        total = np.zeros((camera.height, camera.width, 3))
        for sample in range(samples):
            shift = np.asarray(self._shift) + subpixel(sample)
            colour, buffer, bodies = self._picture(camera, near, far, shift, lights)
            known = (bodies >= 0) & (bodies < len(self._solid_of_body) - 1)
            seen = self._solid_of_body[np.where(known, bodies, -1)]
            if lights is not None:
                colour[seen < 0] = 255.0 * np.asarray(lights.background)
            total += colour
            if sample == 0:
                solid, depth = seen, np.where(seen < 0, 0.0, far * near / (far - (far - near) * buffer))
        return depth, solid, (total / samples).round().astype(np.uint8)

    def _picture(
        self, camera: Camera, near: float, far: float, shift: Array, lights: Lights | None
    ) -> tuple[Array, Array, NDArray[np.int64]]:
        """Colour, depth buffer and bodies."""
        projection = _projection(camera, near, far, (float(shift[0]), float(shift[1])))
        light = {} if lights is None else _light_options(lights, camera)
        with silence_output():
            _, _, rgb, buffer, bodies = self._bullet.getCameraImage(
                camera.width,
                camera.height,
                viewMatrix=_GL_FROM_CV.ravel(order="F").tolist(),
                projectionMatrix=projection.ravel(order="F").tolist(),
                renderer=self._flag,
                physicsClientId=self._client,
                **light,
            )
        shape = (camera.height, camera.width)
        return (
            np.asarray(rgb, dtype=np.float64).reshape(*shape, -1)[..., :3],
            np.asarray(buffer, dtype=np.float64).reshape(shape),
            np.asarray(bodies, dtype=np.int64).reshape(shape),
        )


def _light_options(lights: Lights, camera: Camera) -> dict[str, object]:
    """The sun, and the light of the sky as if it came from everywhere."""
    towards = -camera.T_camera_world[:3, :3] @ np.asarray(lights.sun.direction)
    strongest = max(*lights.sun.colour, 1e-6)
    return {
        "lightDirection": (towards / np.linalg.norm(towards)).tolist(),
        "lightDistance": 4.0,
        "lightColor": [c / strongest for c in lights.sun.colour],
        "lightAmbientCoeff": float(np.mean(lights.ambient) + 0.7 * np.mean(lights.sky)),
        "lightDiffuseCoeff": float(strongest),
        "lightSpecularCoeff": 0.05,
        "shadow": 1,
    }


def _disconnect(bullet: ModuleType, client: int) -> None:
    """Close a physics server, and with it its plugins."""
    with silence_output():
        bullet.disconnect(client)


def _obj_text(vertices: Array, faces: NDArray[np.int32]) -> str:
    """A surface as a Wavefront file."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}\n" for a, b, c in (faces + 1).tolist()]
    return "".join(lines)


def _patch_text(patch: Patch, scale: float) -> str:
    """A patch as a Wavefront file with texture coordinates and normals."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in (patch.vertices * scale).tolist()]
    lines += [f"vt {u:.7g} {v:.7g}\n" for u, v in patch.uv.tolist()]
    lines += [f"vn {x:.6g} {y:.6g} {z:.6g}\n" for x, y, z in patch.normals.tolist()]
    lines += [f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}\n" for a, b, c in (patch.faces + 1).tolist()]
    return "".join(lines)


def _projection(camera: Camera, near: float, far: float, shift: tuple[float, float]) -> NDArray[np.float64]:
    """(4, 4) OpenGL projection of an intrinsic matrix: pixel (u, v) covers [u, u + 1) x [v, v + 1), v downwards.

    The principal point is moved by ``shift`` pixels.
    """
    K, width, height = camera.K.copy(), camera.width, camera.height
    K[:2, 2] += shift
    return np.array(
        [
            [2 * K[0, 0] / width, -2 * K[0, 1] / width, 1 - 2 * K[0, 2] / width, 0],
            [0, 2 * K[1, 1] / height, 2 * K[1, 2] / height - 1, 0],
            [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)],
            [0, 0, -1, 0],
        ]
    )
