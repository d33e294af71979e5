"""SAPIEN: a Vulkan rasteriser, on a GPU or on a CPU through Mesa's lavapipe."""

import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from types import ModuleType

import numpy as np
from numpy.typing import ArrayLike

from artsim.common.extras import install_command
from artsim.errors import RenderError
from artsim.loading.painted import painted_coats
from artsim.model.appearance import Coat, Lights, Material, Sun, plain_coat
from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.objects import ArticulatedObject
from artsim.renderers.base import depth_range
from artsim.renderers.geometry_cache import GeometryCache
from artsim.renderers.raycast import pose
from artsim.renderers.sapien_stage import Shadows, Stage
from artsim.renderers.scene import Scene, SceneFrame, split_ids

_MAX_STAGES = 16  # as many objects as take turns in a plan
_PROBE_TIMEOUT = 120.0  # seconds
_DRIVER_FIX = (
    "run scripts/install-vulkan.sh as root (Mesa's lavapipe >= 24.3 renders on a CPU) or install the GPU's Vulkan "
    "driver; or use --renderer raycast"
)
_NEAREST = 0.02  # metres from the camera of a scene
_PLAIN = tuple(
    Material(colour, roughness=0.7, specular=0.2)
    for colour in (
        (0.86, 0.86, 0.85), (0.63, 0.74, 0.85), (0.90, 0.76, 0.63), (0.71, 0.82, 0.70), (0.85, 0.69, 0.71),
        (0.77, 0.72, 0.84), (0.88, 0.85, 0.67), (0.66, 0.80, 0.81),
    )
)  # fmt: skip
"""Of the parts of an object whose files give it no colours."""
_HEADLIGHT = Lights(
    sun=Sun((-0.35, 0.6, 1.0), (0.54, 0.54, 0.54)),  # camera frame: from over the left shoulder
    sky=(0.0, 0.0, 0.0),
    ambient=(0.3, 0.3, 0.3),
    background=(0.58, 0.58, 0.58),
)


class SapienRenderer:
    """Rasterises one entity per part, so that the segmentation picture holds part ids.

    Each object, and each scene, is loaded once; the least recently drawn are dropped.

    Raises
    ------
    RenderError
        When SAPIEN is not installed, or finds no device to render on.
    """

    name = "sapien"

    def __init__(self) -> None:
        self._sapien = import_sapien()
        self._stages: GeometryCache[Stage] = GeometryCache(_MAX_STAGES)

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        """Render one posed object; see :class:`artsim.renderers.base.Renderer`."""
        T_camera_part = pose(obj, q, camera, T_world_object).T_camera_part
        T_camera_part[:, :3, 3] /= obj.scale  # drawn in native units, in the camera's own frame

        def load() -> Stage:
            solids = [(part, coat, 1.0) for part, coat in zip(obj.parts, _coats(obj), strict=True)]
            return Stage(self._sapien, solids, _HEADLIGHT)

        stage = self._stages.get(obj.parts, obj.num_faces, load)
        stage.place(T_camera_part)
        depth, solid, rgb = stage.picture(camera, np.eye(4), *depth_range(obj, T_camera_part))
        part_ids = np.where(solid < 0, BACKGROUND, solid).astype(np.uint8)
        return Frame(depth * np.float32(obj.scale), part_ids, rgb=rgb)

    def render_scene(self, scene: Scene, cameras: Sequence[Camera], samples: int = 1) -> list[SceneFrame]:
        """See a scene with several cameras; it is loaded once.

        Parameters
        ----------
        scene : Scene
        cameras : sequence of Camera
        samples : int
            Pictures that each colour image is the mean of: more of them give smooth edges and soft shadows. All else
            is sharp, seen through the pixels' centres.

        Returns
        -------
        list of SceneFrame
            One for each camera.
        """

        def load() -> Stage:
            stage = Stage(self._sapien, scene.solids, scene.lights, _shadows(scene))
            stage.place(scene.T_world_solid)
            return stage

        stage = self._stages.get(scene, scene.num_faces, load)
        frames = []
        for camera in cameras:
            far = float((scene.vertices @ camera.T_camera_world[2, :3] + camera.T_camera_world[2, 3]).max())
            depth, solid, rgb = stage.picture(
                camera, camera.T_world_camera, _NEAREST, max(1.01 * far, 2.0 * _NEAREST), samples
            )
            frames.append(SceneFrame(depth, *split_ids(scene, solid), rgb))
        return frames

    def close(self) -> None:
        """Drop everything loaded."""
        self._stages.close()


def _coats(obj: ArticulatedObject) -> Sequence[Coat]:
    """What the object's files say, else a colour for each part."""
    painted = painted_coats(obj)
    return painted or [plain_coat(part, _PLAIN[k % len(_PLAIN)]) for k, part in enumerate(obj.parts)]


def _shadows(scene: Scene) -> Shadows:
    """Around the objects and distractors; the sky lights everything."""
    points = np.concatenate([thing.vertices for thing in (*scene.instances, *scene.distractors)])
    everything = np.concatenate([thing.vertices for thing in scene.things])
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    near, lit = (float(np.linalg.norm(p - center, axis=1).max()) for p in (points, everything))
    return Shadows(center, 1.3 * near + 0.1, lit + 0.1)


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
        raise RenderError("SAPIEN's driver gives no answer", "sapien", _DRIVER_FIX) from error
    if probe.returncode != 0:
        said = (probe.stderr.strip().splitlines() or [f"the probe ended with {probe.returncode}"])[-1]
        if "No module named 'sapien'" in said:
            raise RenderError("SAPIEN is not installed", "sapien", install_command("sapien"))
        raise RenderError(f"SAPIEN cannot render here ({said})", "sapien", _DRIVER_FIX)
    import sapien

    return sapien
