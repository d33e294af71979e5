"""PyBullet's two rasterisers: TinyRenderer (software, always there) and EGL (OpenGL without a display)."""

from __future__ import annotations

import contextlib
import ctypes
import importlib.util
import os
import sys
import tempfile
import weakref
from collections import OrderedDict
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from artsim.camera import Camera
from artsim.errors import RenderError
from artsim.kinematics import Array
from artsim.objects import ArticulatedObject, Part
from artsim.renderers.base import BACKGROUND, Frame, depth_range, two_sided_faces
from artsim.renderers.raycast import pose

# As many objects as take turns in a plan; a process with several EGL contexts crashes inside PyBullet.
_MAX_WORLDS = {"pybullet": 16, "pybullet-egl": 1}
_MAX_FACES = 1_500_000  # triangles kept loaded
_EGL_MEND = "install libegl1 libegl-mesa0 libgl1-mesa-dri (Debian/Ubuntu), or use --renderer raycast"
# OpenGL's camera looks along -z with y up.
_GL_FROM_CV = np.diag([1.0, -1.0, -1.0, 1.0])


class BulletRenderer:
    """Rasterises one body per part, so that the segmentation buffer holds part ids.

    Each object has a physics world of its own; the least recently drawn are dropped.

    Parameters
    ----------
    egl : bool
        Draw with OpenGL through EGL instead of TinyRenderer.

    Raises
    ------
    RenderError
        When PyBullet is not installed, or EGL does not start.
    """

    def __init__(self, egl: bool = False):
        self.name = "pybullet-egl" if egl else "pybullet"
        self._egl = egl
        self._worlds: OrderedDict[tuple[Part, ...], _World] = OrderedDict()
        _World((), egl).close()  # says now, rather than at the first frame, that the backend is missing

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        """Render one posed object; see :class:`artsim.renderers.base.Renderer`."""
        T_camera_part = pose(obj, q, camera, T_world_object).T_camera_part
        T_camera_part[:, :3, 3] /= obj.scale  # drawn in native units
        depth, part_ids, rgb = self._world(obj).draw(camera, T_camera_part, *depth_range(obj, T_camera_part))
        return Frame((depth * obj.scale).astype(np.float32), part_ids, rgb=rgb)

    def _world(self, obj: ArticulatedObject) -> _World:
        world = self._worlds.get(obj.parts)
        if world is None:
            while self._worlds and (
                len(self._worlds) >= _MAX_WORLDS[self.name]
                or sum(w.num_faces for w in self._worlds.values()) + obj.num_faces > _MAX_FACES
            ):
                self._worlds.popitem(last=False)[1].close()
            world = self._worlds[obj.parts] = _World(obj.parts, self._egl)
        self._worlds.move_to_end(obj.parts)
        return world

    def close(self) -> None:
        """Drop every world."""
        while self._worlds:
            self._worlds.popitem()[1].close()


class _World:
    """A physics server that holds one object's parts, placed in the camera's own frame."""

    def __init__(self, parts: tuple[Part, ...], egl: bool):
        self.num_faces = sum(len(part.faces) for part in parts)
        self._bullet = import_pybullet()
        self._client: int = self._bullet.connect(self._bullet.DIRECT)
        self._flag = self._bullet.ER_BULLET_HARDWARE_OPENGL if egl else self._bullet.ER_TINY_RENDERER
        # TinyRenderer looks through the lower left corner of a pixel where others look through its centre (measured).
        self._shift = (0.0, 0.0) if egl else (-0.5, 0.5)
        self.close = weakref.finalize(self, _disconnect, self._bullet, self._client)  # at exit, if not before
        try:
            if egl:
                self._start_egl()
            self._bodies = [self._body(part) for part in parts]
        except RenderError:
            self.close()
            raise
        # Body of each part -> part id; the last entry answers for the background.
        self._part_of_body = np.full(max(self._bodies, default=-1) + 2, BACKGROUND, dtype=np.uint8)
        for k, body in enumerate(self._bodies):
            if body >= 0:
                self._part_of_body[body] = k

    def _start_egl(self) -> None:
        spec = importlib.util.find_spec("eglRenderer")
        if spec is None or spec.origin is None:
            raise RenderError("this PyBullet has no EGL plugin", "pybullet-egl", _EGL_MEND)
        with silent():
            plugin = self._bullet.loadPlugin(spec.origin, "_eglRendererPlugin", physicsClientId=self._client)
        if plugin < 0:
            raise RenderError("EGL does not start", "pybullet-egl", _EGL_MEND)

    def _body(self, part: Part) -> int:
        """Body with the part's surface, -1 for a part without."""
        if len(part.faces) == 0:
            return -1
        with tempfile.TemporaryDirectory(prefix="artsim-bullet-") as folder:
            path = Path(folder) / "part.obj"
            path.write_text(_obj_text(part))
            visual = self._bullet.createVisualShape(
                self._bullet.GEOM_MESH, fileName=str(path), physicsClientId=self._client
            )
        if visual < 0:
            raise RenderError(f"PyBullet does not take the mesh of part {part.name!r}", "pybullet", "use raycast")
        return int(self._bullet.createMultiBody(0, -1, visual, physicsClientId=self._client))

    def draw(
        self, camera: Camera, T_camera_part: Array, near: float, far: float
    ) -> tuple[NDArray[np.float64], NDArray[np.uint8], NDArray[np.uint8]]:
        """Depth in native units, part ids and colour."""
        for body, T in zip(self._bodies, T_camera_part, strict=True):
            if body >= 0:
                quaternion = Rotation.from_matrix(T[:3, :3]).as_quat()
                self._bullet.resetBasePositionAndOrientation(body, T[:3, 3], quaternion, physicsClientId=self._client)
        with silent():
            _, _, rgb, buffer, bodies = self._bullet.getCameraImage(
                camera.width,
                camera.height,
                viewMatrix=_GL_FROM_CV.ravel(order="F").tolist(),
                projectionMatrix=_projection(camera, near, far, self._shift).ravel(order="F").tolist(),
                renderer=self._flag,
                physicsClientId=self._client,
            )
        shape = (camera.height, camera.width)
        bodies = np.asarray(bodies).reshape(shape)
        known = (bodies >= 0) & (bodies < len(self._part_of_body) - 1)
        part_ids = self._part_of_body[np.where(known, bodies, -1)]
        buffer = np.asarray(buffer, dtype=np.float64).reshape(shape)
        depth = np.where(part_ids == BACKGROUND, 0.0, far * near / (far - (far - near) * buffer))
        return depth, part_ids, np.ascontiguousarray(np.asarray(rgb, dtype=np.uint8).reshape(*shape, -1)[..., :3])


def _disconnect(bullet: ModuleType, client: int) -> None:
    """Close a physics server, and with it its plugins."""
    with silent():
        bullet.disconnect(client)


def _obj_text(part: Part) -> str:
    """A part as a Wavefront file."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in part.vertices.tolist()]
    lines += [f"f {a} {b} {c}\n" for a, b, c in (two_sided_faces(part) + 1).tolist()]
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


def import_pybullet() -> ModuleType:
    """PyBullet, without its greeting.

    Raises
    ------
    RenderError
        When it is not installed.
    """
    try:
        with silent():
            import pybullet
    except ImportError as error:
        raise RenderError("PyBullet is not installed", "pybullet", "pip install 'artsim[pybullet]'") from error
    return pybullet


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """Keep PyBullet's own chatter, which it prints from C, out of the program's output."""
    sys.stdout.flush()
    sys.stderr.flush()
    with contextlib.ExitStack() as stack:
        null = os.open(os.devnull, os.O_WRONLY)
        stack.callback(os.close, null)
        for stream in (1, 2):
            saved = os.dup(stream)
            stack.callback(os.close, saved)
            os.dup2(null, stream)
            stack.callback(os.dup2, saved, stream)
        stack.callback(ctypes.CDLL(None).fflush, None)  # C buffers what it prints
        yield
