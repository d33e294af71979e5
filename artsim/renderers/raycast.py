"""The embedded renderer: Embree rays against one static acceleration structure per part.

Joints move, geometry does not: rays are carried into each part's rest frame instead of moving triangles, so
nothing is rebuilt when the state changes. Only the pixels of a part's projected box are cast. Ray directions
have z = 1 in the camera frame, which makes the ray parameter the z-depth itself.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import ArrayLike, NDArray

from artsim.camera import Camera
from artsim.kinematics import Array, transform_points
from artsim.objects import ArticulatedObject, Part
from artsim.renderers.base import BACKGROUND, Frame

_MISS = np.float32(1e30)
_scenes: weakref.WeakKeyDictionary[Part, EmbreeScene] = weakref.WeakKeyDictionary()


def part_scene(part: Part) -> EmbreeScene:
    """Acceleration structure of a part's surface, built at first use and kept as long as the part."""
    scene = _scenes.get(part)
    if scene is None:
        scene = EmbreeScene(robust=True)
        TriangleMesh(scene, part.vertices.astype(np.float32), part.faces)
        _scenes[part] = scene
    return scene


@dataclass(frozen=True, eq=False)
class PosedObject:
    """An object in front of a camera: what rays need to know, worked out once per view.

    Attributes
    ----------
    obj : ArticulatedObject
    camera : Camera
    T_camera_part : (K, 4, 4) float
    windows : (K, 4) int
        Pixels that each part's box can cover: first row, end row, first column, end column.
    """

    obj: ArticulatedObject
    camera: Camera
    T_camera_part: Array
    windows: NDArray[np.int64]

    @property
    def window(self) -> tuple[int, int, int, int]:
        """Pixels that the whole object can cover: first row, end row, first column, end column."""
        used = self.windows[(self.windows[:, 1] > self.windows[:, 0]) & (self.windows[:, 3] > self.windows[:, 2])]
        if len(used) == 0:
            return 0, 0, 0, 0
        return int(used[:, 0].min()), int(used[:, 1].max()), int(used[:, 2].min()), int(used[:, 3].max())


def pose(obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None) -> PosedObject:
    """Place an object in front of a camera.

    Parameters
    ----------
    obj : ArticulatedObject
    q : (K,) float
        Joint states.
    camera : Camera
    T_world_object : (4, 4) float, optional
        Pose of the rest frame in the world; identity by default.
    """
    T_world_rest = np.eye(4) if T_world_object is None else np.asarray(T_world_object, dtype=np.float64)
    T_camera_part = camera.T_camera_world @ T_world_rest @ obj.tree.forward_kinematics(q)
    return PosedObject(obj, camera, T_camera_part, _windows(obj, camera, T_camera_part))


def _windows(obj: ArticulatedObject, camera: Camera, T_camera_part: Array) -> NDArray[np.int64]:
    low, high = obj.part_bounds[:, None, 0], obj.part_bounds[:, None, 1]
    corners = np.where(_CORNERS, high, low)
    seen = transform_points(T_camera_part, corners)
    depth = seen[..., 2]
    image = camera.project(np.where(depth[..., None] > 0, seen, [0.0, 0.0, 1.0]))
    size = np.array([camera.width, camera.height])
    first = np.clip(np.floor(image.min(axis=1) - 1.0), 0, size)
    end = np.clip(np.ceil(image.max(axis=1) + 1.0), 0, size)
    around = (depth <= 0).any(axis=1)  # the box reaches behind the camera: it may cover any pixel
    first[around], end[around] = 0, size
    hidden = (depth <= 0).all(axis=1) | np.array([len(p.faces) == 0 for p in obj.parts])
    end[hidden] = first[hidden]
    return np.stack([first[:, 1], end[:, 1], first[:, 0], end[:, 0]], axis=1).astype(np.int64)


_CORNERS = np.array([[i & 1, i & 2, i & 4] for i in range(8)], dtype=bool)


def cast(
    posed: PosedObject, pixels: NDArray[np.int64]
) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.int64]]:
    """Cast one ray through the centre of each pixel.

    Where surfaces of two parts coincide exactly, the part with the lower index is seen.

    Parameters
    ----------
    posed : PosedObject
    pixels : (N,) int
        Flat indices ``row * width + column``.

    Returns
    -------
    depth : (N,) float32
        z-depth in metres, 0 where no part is hit.
    part_ids : (N,) uint8
        ``BACKGROUND`` where no part is hit.
    amodal : (K,) int64
        Rays that hit each part, hidden or not.
    """
    obj, camera = posed.obj, posed.camera
    directions = camera.directions(pixels).astype(np.float32)
    row, column = np.divmod(pixels, camera.width)
    nearest = np.full(len(pixels), _MISS, dtype=np.float32)
    part_ids = np.full(len(pixels), BACKGROUND, dtype=np.uint8)
    amodal = np.zeros(len(obj), dtype=np.int64)
    for k, (first_row, end_row, first_column, end_column) in enumerate(posed.windows):
        if end_row <= first_row or end_column <= first_column:
            continue
        inside = (row >= first_row) & (row < end_row) & (column >= first_column) & (column < end_column)
        rays = np.flatnonzero(inside)
        if len(rays) == 0:
            continue
        distance = _cast_part(posed, k, directions[rays])
        amodal[k] = np.count_nonzero(distance < _MISS)
        nearer = distance < nearest[rays]
        nearest[rays[nearer]] = distance[nearer]
        part_ids[rays[nearer]] = k
    return np.where(nearest < _MISS, nearest * np.float32(obj.scale), np.float32(0.0)), part_ids, amodal


def _cast_part(posed: PosedObject, k: int, directions: NDArray[np.float32]) -> NDArray[np.float32]:
    """Native z-depth at which rays from the camera meet part k, ``_MISS`` or more where they do not."""
    rotation = posed.T_camera_part[k, :3, :3]
    origin = -(posed.T_camera_part[k, :3, 3] / posed.obj.scale) @ rotation
    origins = np.empty_like(directions)
    origins[:] = origin
    distance: NDArray[np.float32] = part_scene(posed.obj.parts[k]).run(
        origins, directions @ rotation.astype(np.float32), query="DISTANCE"
    )
    return distance


def window_pixels(window: tuple[int, int, int, int], width: int) -> NDArray[np.int64]:
    """Flat indices of the pixels of a window (first row, end row, first column, end column), row by row."""
    first_row, end_row, first_column, end_column = window
    rows = np.arange(first_row, end_row) * width
    return (rows[:, None] + np.arange(first_column, end_column)).ravel()


class RaycastRenderer:
    """Renders frames with :func:`cast`; needs no GPU, no display and no system library."""

    name = "raycast"

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        """Render one posed object; see :class:`artsim.renderers.base.Renderer`."""
        posed = pose(obj, q, camera, T_world_object)
        pixels = window_pixels(posed.window, camera.width)
        depth = np.zeros(camera.height * camera.width, dtype=np.float32)
        part_ids = np.full(camera.height * camera.width, BACKGROUND, dtype=np.uint8)
        depth[pixels], part_ids[pixels], amodal = cast(posed, pixels)
        shape = (camera.height, camera.width)
        return Frame(depth.reshape(shape), part_ids.reshape(shape), amodal)

    def close(self) -> None:
        """Nothing to release: acceleration structures live as long as their parts."""
