"""SAPIEN: a Vulkan rasteriser, on a GPU or on a CPU through Mesa's lavapipe."""

from __future__ import annotations

import subprocess
import sys
from collections import OrderedDict
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from artsim.camera import Camera
from artsim.errors import RenderError
from artsim.kinematics import Array
from artsim.objects import ArticulatedObject, Part
from artsim.renderers.base import BACKGROUND, Frame, depth_range, two_sided_faces
from artsim.renderers.raycast import pose

_MAX_SCENES = 16  # as many objects as take turns in a plan
_MAX_FACES = 1_500_000  # triangles kept loaded
_PROBE_TIMEOUT = 120.0  # seconds
_EXTRA_MEND = "pip install 'artsim[sapien]'"
_DRIVER_MEND = (
    "run scripts/install-vulkan.sh as root (Mesa's lavapipe >= 24.3 renders on a CPU) or install the GPU's Vulkan "
    "driver; or use --renderer raycast"
)
# SAPIEN's camera looks along x with z up.
_SAPIEN_FROM_CV = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
_COLOURS = np.array(
    [(0.72, 0.72, 0.70), (0.36, 0.52, 0.70), (0.80, 0.55, 0.36), (0.47, 0.64, 0.45), (0.70, 0.44, 0.47),
     (0.56, 0.48, 0.68), (0.76, 0.70, 0.42), (0.40, 0.62, 0.63)]
)  # fmt: skip


class SapienRenderer:
    """Rasterises one entity per part, so that the segmentation picture holds part ids.

    Each object has a scene of its own; the least recently drawn are dropped.

    Raises
    ------
    RenderError
        When SAPIEN is not installed, or finds no device to render on.
    """

    name = "sapien"

    def __init__(self) -> None:
        self._sapien = import_sapien()
        self._scenes: OrderedDict[tuple[Part, ...], _Scene] = OrderedDict()

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        """Render one posed object; see :class:`artsim.renderers.base.Renderer`."""
        T_camera_part = pose(obj, q, camera, T_world_object).T_camera_part
        T_camera_part[:, :3, 3] /= obj.scale  # drawn in native units
        depth, part_ids, rgb = self._scene(obj).draw(camera, T_camera_part, *depth_range(obj, T_camera_part))
        return Frame(depth * np.float32(obj.scale), part_ids, rgb=rgb)

    def _scene(self, obj: ArticulatedObject) -> _Scene:
        scene = self._scenes.get(obj.parts)
        if scene is None:
            while self._scenes and (
                len(self._scenes) >= _MAX_SCENES
                or sum(s.num_faces for s in self._scenes.values()) + obj.num_faces > _MAX_FACES
            ):
                self._scenes.popitem(last=False)[1].close()
            scene = self._scenes[obj.parts] = _Scene(obj.parts, self._sapien)
        self._scenes.move_to_end(obj.parts)
        return scene

    def close(self) -> None:
        """Drop every scene."""
        while self._scenes:
            self._scenes.popitem()[1].close()


class _Scene:
    """One object's parts around a camera that stands at the origin."""

    def __init__(self, parts: tuple[Part, ...], sapien: ModuleType):
        self.num_faces = sum(len(part.faces) for part in parts)
        self._sapien = sapien
        self._scene: Any = sapien.Scene([sapien.render.RenderSystem()])
        self._scene.set_ambient_light([0.3, 0.3, 0.3])
        self._scene.add_directional_light([1.0, 0.35, -0.6], [1.7, 1.7, 1.7])  # over the camera's left shoulder
        self._entities = [self._entity(k, part) for k, part in enumerate(parts)]
        self._cameras: dict[tuple[int, int], Any] = {}
        # Number of each part's entity in the segmentation picture -> part id; 0 is the background.
        numbers = [0 if entity is None else int(entity.per_scene_id) for entity in self._entities]
        self._part_of_number = np.full(max(numbers) + 1, BACKGROUND, dtype=np.uint8)
        for k, number in enumerate(numbers):
            if number:
                self._part_of_number[number] = k

    def _entity(self, k: int, part: Part) -> Any:
        """Entity with the part's surface, None for a part without."""
        if len(part.faces) == 0:
            return None
        vertices, faces, normals = flat_shaded(part)
        render = self._sapien.render
        material = render.RenderMaterial(
            base_color=[*_COLOURS[k % len(_COLOURS)].tolist(), 1.0], specular=0.2, roughness=0.7
        )
        body = render.RenderBodyComponent()
        body.attach(render.RenderShapeTriangleMesh(vertices, faces, normals, np.zeros((0, 2), np.float32), material))
        entity = self._sapien.Entity()
        entity.add_component(body)
        self._scene.add_entity(entity)
        return entity

    def _camera(self, width: int, height: int) -> Any:
        made = self._cameras.get((width, height))
        if made is None:
            # A picture is taken by one camera at a time: the others would be drawn along with it.
            for old in self._cameras.values():
                self._scene.remove_camera(old)
            made = self._scene.add_camera("camera", width, height, 1.0, 0.01, 10.0)
            made.set_entity_pose(self._sapien.Pose())
            self._cameras = {(width, height): made}
        return made

    def draw(
        self, camera: Camera, T_camera_part: Array, near: float, far: float
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.uint8]]:
        """Depth in native units, part ids and colour."""
        for entity, T in zip(self._entities, _SAPIEN_FROM_CV @ T_camera_part, strict=True):
            if entity is not None:
                quaternion = Rotation.from_matrix(T[:3, :3]).as_quat()[[3, 0, 1, 2]]
                entity.set_pose(self._sapien.Pose(T[:3, 3], quaternion))
        eye, K = self._camera(camera.width, camera.height), camera.K
        eye.set_perspective_parameters(near, far, K[0, 0], K[1, 1], K[0, 2], K[1, 2], K[0, 1])
        self._scene.update_render()
        eye.take_picture()
        numbers = eye.get_picture("Segmentation")[..., 1]
        known = numbers < len(self._part_of_number)
        part_ids = self._part_of_number[np.where(known, numbers, 0)]
        # OpenGL's camera looks along -z.
        depth = np.where(part_ids == BACKGROUND, np.float32(0.0), -eye.get_picture("Position")[..., 2])
        rgb = (255.0 * eye.get_picture("Color")[..., :3].clip(0.0, 1.0)).round().astype(np.uint8)
        return depth, part_ids, rgb

    def close(self) -> None:
        """Release the scene's pictures and meshes."""
        self._cameras.clear()
        self._entities.clear()
        self._scene.clear()
        self._scene = None


def flat_shaded(part: Part) -> tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.float32]]:
    """Triangles that share no corner, and the normal at each corner.

    Returns
    -------
    vertices : (3 F, 3) float32
        Native units.
    faces : (F, 3) uint32
    normals : (3 F, 3) float32
    """
    corners = part.vertices[two_sided_faces(part)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 0, normals / np.where(length > 0, length, 1.0), (0.0, 0.0, 1.0))
    faces = np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3)
    return corners.reshape(-1, 3).astype(np.float32), faces, np.repeat(normals, 3, axis=0).astype(np.float32)


@cache
def import_sapien() -> ModuleType:
    """SAPIEN, once a process of its own has shown that it can render here.

    Raises
    ------
    RenderError
        When it is not installed, lacks a system library, or finds no device to render on.
    """
    # Some drivers crash the process that asks for a device in vain, at once or at its exit.
    command = [sys.executable, "-c", "import sapien; sapien.render.RenderSystem()"]
    try:
        probe = subprocess.run(command, capture_output=True, text=True, timeout=_PROBE_TIMEOUT)
    except subprocess.TimeoutExpired as error:
        raise RenderError("SAPIEN's driver gives no answer", "sapien", _DRIVER_MEND) from error
    if probe.returncode != 0:
        said = (probe.stderr.strip().splitlines() or [f"the probe ended with {probe.returncode}"])[-1]
        if "No module named 'sapien'" in said:
            raise RenderError("SAPIEN is not installed", "sapien", _EXTRA_MEND)
        raise RenderError(f"SAPIEN cannot render here ({said})", "sapien", _DRIVER_MEND)
    import sapien

    return sapien
