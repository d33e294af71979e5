"""Views of different objects at once, and what they show: what :mod:`artsim.renderers.warp` takes and gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from artsim.common.elementary import cos, sin
from artsim.common.products import apply, matmul, norm
from artsim.errors import ConfigError
from artsim.model.camera import Camera
from artsim.model.draws import StateOptions, ViewOptions, half_width, posed_bounds, states_at
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject


@dataclass(frozen=True, eq=False)
class Views:
    """B views, each of one object in one state by one camera, all of one image size.

    Arrays are NumPy's, or Warp's own (int32, float64, mat44d and mat33d) on the renderer's device, whose contents are
    not looked at before they are used.
    """

    objects: Any
    """(B,) int. Number of each view's object among those loaded."""
    q: Any
    """(B, K) float. Joint states in radians or metres, as many as the object of most parts has; an object of fewer
    ignores the rest."""
    T_camera_object: Any
    """(B, 4, 4) float. Pose of each object's rest frame in the camera."""
    K: Any
    """(B, 3, 3) float. Intrinsic matrices in pixels."""
    width: int
    height: int

    def __len__(self) -> int:
        return len(self.objects)

    @staticmethod
    def of(
        objects: ArrayLike,
        states: Sequence[ArrayLike],
        cameras: Sequence[Camera],
        T_world_object: ArrayLike | None = None,
    ) -> Views:
        """Views from cameras.

        Parameters
        ----------
        objects : (B,) int
        states : B of (K,) float
        cameras : B of Camera
        T_world_object : (4, 4) or (B, 4, 4) float, optional
            Identity by default.

        Raises
        ------
        ConfigError
            When the lengths differ, or the cameras' image sizes do.
        """
        objects = np.asarray(objects, dtype=np.int32)
        sizes = {(camera.width, camera.height) for camera in cameras}
        if not len(objects) == len(states) == len(cameras):
            raise ConfigError(f"{len(objects)} objects, {len(states)} states and {len(cameras)} cameras", "views")
        if len(sizes) != 1:
            raise ConfigError(f"a batch has one image size, not {len(sizes)}", "cameras", "draw each size by itself")
        rows = [np.asarray(state, dtype=np.float64) for state in states]
        q = np.zeros((len(rows), max(map(len, rows))))
        for row, state in zip(q, rows, strict=True):
            row[: len(state)] = state
        T_camera_world = np.stack([camera.T_camera_world for camera in cameras])
        T_camera_object = (
            T_camera_world if T_world_object is None else matmul(T_camera_world, np.asarray(T_world_object))
        )
        return Views(objects, q, T_camera_object, np.stack([camera.K for camera in cameras]), *sizes.pop())


def draw_views(
    objects: Sequence[ArticulatedObject],
    count: int,
    rng: np.random.Generator,
    states: StateOptions | None = None,
    cameras: ViewOptions | None = None,
) -> Views:
    """Random views, many at once: objects evenly, each as ``sample_state`` and ``sample_view`` would show it.

    Parameters
    ----------
    objects : sequence of ArticulatedObject
    count : int
    rng : numpy Generator
    states : StateOptions, optional
    cameras : ViewOptions, optional
        128x128 by default.

    Raises
    ------
    ConfigError
        When there is no object, or cameras are to be drawn by a function of the user's, which draws one at a time.
    """
    if not objects or count < 1:
        raise ConfigError(f"{count} views of {len(objects)} objects show no object", "objects, count", "use 1 or more")
    states, cameras = states or StateOptions(), cameras or ViewOptions(width=128, height=128)
    if cameras.custom is not None:
        raise ConfigError("views of one's own are drawn one at a time", "cameras.custom", "use sample_view, Views.of")
    numbers = rng.permutation(np.arange(count) % len(objects))
    q = np.zeros((count, max(map(len, objects))))
    low, high = np.zeros((2, count, 3))
    for number in np.unique(numbers):
        chosen, obj = np.flatnonzero(numbers == number), objects[number]
        state = states_at(obj, states, rng.random((len(chosen), len(obj))))
        q[chosen, : len(obj)] = state
        low[chosen], high[chosen] = posed_bounds(obj, state)
    azimuth, elevation = cameras.draw_directions(rng, count)
    distance = 0.5 * norm(high - low) / half_width(cameras, rng.uniform(*cameras.fill, count))
    T_camera_object = np.zeros((count, 4, 4))
    T_camera_object[:, :3, :3] = rotation = _facing(azimuth, elevation)
    T_camera_object[:, :3, 3] = -apply(rotation, 0.5 * (low + high))
    T_camera_object[:, 2, 3] += distance
    T_camera_object[:, 3, 3] = 1.0
    K = Camera.look_at((1, 0, 0), (0, 0, 0), cameras.width, cameras.height, np.deg2rad(cameras.fov)).K
    return Views(numbers, q, T_camera_object, np.tile(K, (count, 1, 1)), cameras.width, cameras.height)


def _facing(azimuth: Array, elevation: Array) -> Array:
    """(B, 3, 3) rotations from the world to cameras that look at it from directions as ``ViewOptions`` has them."""
    sin_a, cos_a, sin_e, cos_e = sin(azimuth), cos(azimuth), sin(elevation), cos(elevation)
    right = np.stack([sin_a, -cos_a, np.zeros_like(azimuth)], axis=1)
    down = np.stack([-cos_a * sin_e, -sin_a * sin_e, -cos_e], axis=1)
    forward = np.stack([cos_a * cos_e, sin_a * cos_e, -sin_e], axis=1)
    return np.stack([right, down, forward], axis=1)


@dataclass(frozen=True, eq=False)
class Images:
    """What B views show, on the device."""

    depth: Any
    """(B, H, W) float32. z-depth in metres, 0 = no return."""
    part_ids: Any
    """(B, H, W) uint8. 255 where no part is seen."""
    T_camera_part: Any
    """(B, K) mat44d. As an array (B, K, 4, 4); zero beyond an object's own parts."""


@dataclass(frozen=True, eq=False)
class Clouds:
    """Partial clouds of B views, on the device."""

    points: Any
    """(B, N) vec3. As an array (B, N, 3) float32: camera frame, metres."""
    part: Any
    """(B, N) uint8. Part of each point; 255 throughout where the camera does not see the object."""
    T_camera_part: Any
    """(B, K) mat44d."""
