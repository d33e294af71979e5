"""What every renderer does: turn a posed object and a camera into a frame."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from artsim.model.camera import Camera
from artsim.model.frame import Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject


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
        self, obj: ArticulatedObject, q: ArrayLike, cameras: Sequence[Camera], T_world_object: ArrayLike | None = None
    ) -> list[Frame]:
        """Render one posed object by at least one camera, all of one image size.

        Users call :func:`artsim.renderers.render_cameras`, which any renderer will do for.
        """
        ...


def depth_range(obj: ArticulatedObject, T_camera_part: Array) -> tuple[float, float]:
    """Near and far planes close around the posed object, native units: depth buffers have 24 bits."""
    bounds = obj.part_bounds / obj.scale
    center, half = bounds.mean(axis=1), 0.5 * (bounds[:, 1] - bounds[:, 0])
    depth = (T_camera_part[:, 2, :3] * center).sum(axis=1) + T_camera_part[:, 2, 3]
    reach = (np.abs(T_camera_part[:, 2, :3]) * half).sum(axis=1)
    margin = 1e-3 * obj.diagonal / obj.scale
    far = max(float((depth + reach).max()), 2 * margin) + margin
    return max(float((depth - reach).min()) - margin, 1e-4 * far), far
