"""Whole scenes through any renderer."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from artsim.errors import ConfigError
from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND
from artsim.renderers import Renderer, shared_renderer
from artsim.renderers.scene import Scene, SceneFrame


@runtime_checkable
class SceneRenderer(Protocol):
    """What a renderer has besides, if it draws a whole scene at once, in colour."""

    def render_scene(self, scene: Scene, cameras: Sequence[Camera], samples: int = 1) -> list[SceneFrame]:
        """See a scene with several cameras; colour images are the mean of ``samples`` pictures."""
        ...


def render_scene(
    scene: Scene, cameras: Sequence[Camera], renderer: str | Renderer = "sapien", samples: int = 1
) -> list[SceneFrame]:
    """See a scene with several cameras.

    Parameters
    ----------
    scene : Scene
    cameras : sequence of Camera
    renderer : str or Renderer
        One of ``RENDERERS``, or one of your own. Where it draws no whole scenes, each thing is drawn by itself, and the
        nearest is seen: depth and ids, without colour.
    samples : int
        Pictures that each colour image is the mean of: more of them give smooth edges and, by SAPIEN, soft shadows.

    Returns
    -------
    list of SceneFrame
        One for each camera.

    Raises
    ------
    ConfigError
        When the number of samples is not positive.
    RenderError
        When the renderer is missing or does not start.
    """
    if samples < 1:
        raise ConfigError(f"a mean of {samples} pictures is none", "rgb_samples", "use 1 or more")
    drawer = shared_renderer(renderer) if isinstance(renderer, str) else renderer
    if isinstance(drawer, SceneRenderer):
        return drawer.render_scene(scene, cameras, samples)
    return [_compose(scene, camera, drawer) for camera in cameras]


def _compose(scene: Scene, camera: Camera, drawer: Renderer) -> SceneFrame:
    """The nearest of all things, each drawn by itself; of equally near ones, the first."""
    shape = (camera.height, camera.width)
    depth = np.full(shape, np.inf, dtype=np.float32)
    instance_ids, part_ids = np.full(shape, BACKGROUND, np.uint8), np.full(shape, BACKGROUND, np.uint8)
    for number, thing in enumerate(scene.things):
        frame = drawer.render(thing.obj, thing.q, camera, thing.T_world_object)
        nearer = (frame.part_ids != BACKGROUND) & (frame.depth < depth)
        depth[nearer], instance_ids[nearer] = frame.depth[nearer], number
        part_ids[nearer] = frame.part_ids[nearer] if number < len(scene.instances) else BACKGROUND
    return SceneFrame(np.where(np.isinf(depth), np.float32(0.0), depth), instance_ids, part_ids)
