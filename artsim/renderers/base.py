"""What every renderer does: turn a posed object and a camera into a frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.model.camera import Camera
from artsim.model.describe import brief
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Part

BACKGROUND = 255
"""Part id of pixels that show no part."""


@dataclass(frozen=True, eq=False)
class Frame:
    """What a camera sees of one object.

    Attributes
    ----------
    depth : (H, W) float32
        z-depth in metres, 0 = no return.
    part_ids : (H, W) uint8
        Index of the part seen at each pixel; ``BACKGROUND`` where none is.
    amodal_pixels : (K,) int64 or None
        Pixels that each part would cover if nothing hid it, where the renderer knows.
    rgb : (H, W, 3) uint8 or None
        Colour, where the renderer makes it.
    """

    depth: NDArray[np.float32]
    part_ids: NDArray[np.uint8]
    amodal_pixels: NDArray[np.int64] | None = None
    rgb: NDArray[np.uint8] | None = None

    __repr__ = brief


class Renderer(Protocol):
    """A renderer is one class with three members: its name, ``render`` and ``close``."""

    name: str

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        """Render one posed object.

        Parameters
        ----------
        obj : ArticulatedObject
        q : (K,) float
            Joint states.
        camera : Camera
        T_world_object : (4, 4) float, optional
            Pose of the rest frame in the world; identity by default.

        Returns
        -------
        Frame
        """
        ...

    def close(self) -> None:
        """Release what the renderer holds (contexts, scenes)."""
        ...


@runtime_checkable
class CameraBatch(Protocol):
    """What a renderer has besides, if it draws several views at once faster than one after another."""

    def render_cameras(
        self,
        obj: ArticulatedObject,
        q: ArrayLike,
        cameras: Sequence[Camera],
        T_world_object: ArrayLike | None = None,
    ) -> list[Frame]:
        """Render one posed object by at least one camera, all of one image size.

        Users call :func:`artsim.renderers.render_cameras`, which any renderer will do for.
        """
        ...


def two_sided_faces(part: Part) -> NDArray[np.int32]:
    """(F, 3) triangles of a part; unless it is a closed solid, each facing both ways.

    Rasterisers leave out triangles that face away, and real meshes are wound any way.
    """
    import trimesh

    mesh = trimesh.Trimesh(part.vertices, part.faces, process=False)
    mesh.merge_vertices()
    return part.faces if mesh.is_volume else np.concatenate([part.faces, part.faces[:, ::-1]])


def depth_range(obj: ArticulatedObject, T_camera_part: Array) -> tuple[float, float]:
    """Near and far planes close around the posed object, native units: depth buffers have 24 bits."""
    bounds = obj.part_bounds / obj.scale
    center, half = bounds.mean(axis=1), 0.5 * (bounds[:, 1] - bounds[:, 0])
    depth = (T_camera_part[:, 2, :3] * center).sum(axis=1) + T_camera_part[:, 2, 3]
    reach = (np.abs(T_camera_part[:, 2, :3]) * half).sum(axis=1)
    margin = 1e-3 * obj.diagonal / obj.scale
    far = max(float((depth + reach).max()), 2 * margin) + margin
    return max(float((depth - reach).min()) - margin, 1e-4 * far), far
