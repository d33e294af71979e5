"""Renderers behind one protocol, by name."""

from __future__ import annotations

from functools import cache

from numpy.typing import ArrayLike

from artsim.camera import Camera
from artsim.errors import ConfigError
from artsim.objects import ArticulatedObject
from artsim.renderers.base import BACKGROUND, Frame, Renderer

RENDERERS = ("raycast", "pybullet", "pybullet-egl", "sapien")


def make_renderer(name: str) -> Renderer:
    """A new renderer by name.

    Raises
    ------
    ConfigError
        When there is no such renderer.
    RenderError
        When its backend is not installed or does not start.
    """
    if name == "raycast":
        from artsim.renderers.raycast import RaycastRenderer

        return RaycastRenderer()
    if name in ("pybullet", "pybullet-egl"):
        from artsim.renderers.bullet import BulletRenderer

        return BulletRenderer(egl=name == "pybullet-egl")
    if name == "sapien":
        from artsim.renderers.sapien import SapienRenderer

        return SapienRenderer()
    raise ConfigError(f"there is no renderer {name!r}", "renderer", f"use one of {', '.join(RENDERERS)}")


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


__all__ = ["BACKGROUND", "RENDERERS", "Frame", "Renderer", "make_renderer", "render", "shared_renderer"]
