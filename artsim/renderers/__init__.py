"""Renderers behind one protocol, by name."""

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Literal, TypeAlias

from numpy.typing import ArrayLike

from artsim.common.names import name_fix
from artsim.errors import ConfigError
from artsim.model.camera import Camera
from artsim.model.frame import Frame
from artsim.model.objects import ArticulatedObject
from artsim.renderers.base import CameraBatch, Renderer

RENDERERS = {
    "raycast": "artsim.renderers.raycast:RaycastRenderer",
    "pybullet": "artsim.renderers.bullet:BulletRenderer",
    "pybullet-egl": "artsim.renderers.bullet:EglRenderer",
    "sapien": "artsim.renderers.sapien:SapienRenderer",
    "warp": "artsim.renderers.warp:WarpRenderer",
}
"""The registry: each renderer's name, and the ``module:class`` that is imported when it is first asked for."""

if TYPE_CHECKING:
    RendererName: TypeAlias = str
else:  # command lines and files of options read the names from this type, which type checkers cannot
    RendererName = Literal[tuple(RENDERERS)]


def make_renderer(name: str) -> Renderer:
    """A new renderer by name.

    Raises
    ------
    ConfigError
        When there is no such renderer.
    RenderError
        When its backend is not installed or does not start.
    """
    if name not in RENDERERS:
        raise ConfigError(f"there is no renderer {name!r}", "renderer", name_fix(name, RENDERERS))
    module, _, kind = RENDERERS[name].partition(":")
    renderer: Renderer = getattr(import_module(module), kind)()
    return renderer


@cache
def shared_renderer(name: str) -> Renderer:
    """This process's own renderer of that name, made at first use; see :func:`make_renderer`."""
    return make_renderer(name)


def render(
    obj: ArticulatedObject,
    q: ArrayLike,
    camera: Camera,
    T_world_object: ArrayLike | None = None,
    renderer: str = "raycast",
) -> Frame:
    """Render one posed object with this process's renderer of that name.

    Parameters
    ----------
    obj : ArticulatedObject
    q : (K,) float
        Joint states in radians or metres; the root's entry is ignored.
    camera : Camera
    T_world_object : (4, 4) float, optional
        Pose of the rest frame in the world; identity by default.
    renderer : str
        One of ``RENDERERS``.

    Returns
    -------
    Frame
    """
    return shared_renderer(renderer).render(obj, q, camera, T_world_object)


def render_cameras(
    obj: ArticulatedObject,
    q: ArrayLike,
    cameras: Sequence[Camera],
    T_world_object: ArrayLike | None = None,
    renderer: str | Renderer = "raycast",
) -> list[Frame]:
    """Render one posed object by several cameras: at once where the renderer can, else one after another.

    Parameters
    ----------
    obj : ArticulatedObject
    q : (K,) float
        Joint states.
    cameras : sequence of Camera
        All of one image size.
    T_world_object : (4, 4) float, optional
        Pose of the rest frame in the world; identity by default.
    renderer : str or Renderer
        One of ``RENDERERS``, or one of your own.

    Returns
    -------
    list of Frame
        One for each camera.

    Raises
    ------
    ConfigError
        When the image sizes differ.
    """
    sizes = {(camera.width, camera.height) for camera in cameras}
    if len(sizes) > 1:
        raise ConfigError(f"a batch has one image size, not {len(sizes)}", "cameras", "draw each size by itself")
    drawer = shared_renderer(renderer) if isinstance(renderer, str) else renderer
    if cameras and isinstance(drawer, CameraBatch):
        return drawer.render_cameras(obj, q, cameras, T_world_object)
    return [drawer.render(obj, q, camera, T_world_object) for camera in cameras]


__all__ = [
    "RENDERERS",
    "CameraBatch",
    "Renderer",
    "RendererName",
    "make_renderer",
    "render",
    "render_cameras",
    "shared_renderer",
]
