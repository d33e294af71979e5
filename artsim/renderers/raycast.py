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
    spans : (K, 2, H) float
        Columns between which each part's posed box covers the centres of a row of pixels; empty (inf, -inf) where it
        does not.
    windows : (K, 4) int
        Pixels around each part's spans: first row, end row, first column, end column.
    """

    obj: ArticulatedObject
    camera: Camera
    T_camera_part: Array
    spans: NDArray[np.float32]
    windows: NDArray[np.int64]

    @property
    def window(self) -> tuple[int, int, int, int]:
        """Pixels that the whole object can cover: first row, end row, first column, end column."""
        used = self.windows[self.windows[:, 1] > self.windows[:, 0]]
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
    spans = _spans(obj, camera, T_camera_part)
    return PosedObject(obj, camera, T_camera_part, spans, _windows(spans, camera.width))


_CORNERS = np.array([[i & 1, i & 2, i & 4] for i in range(8)], dtype=bool)
_EDGES = np.array([(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit])
_MARGIN = np.float32(0.05)  # pixels: covers single precision


def _spans(obj: ArticulatedObject, camera: Camera, T_camera_part: Array) -> NDArray[np.float32]:
    """Row spans of the projected boxes: the outline of a convex body is made of its edges' images."""
    corners = np.where(_CORNERS, obj.part_bounds[:, None, 1], obj.part_bounds[:, None, 0])
    seen = transform_points(T_camera_part, corners)
    depth = seen[..., 2]
    image = camera.project(np.where(depth[..., None] > 0, seen, [0.0, 0.0, 1.0]))
    image = image.clip(-1e6, 1e6).astype(np.float32)
    start, end = image[:, _EDGES[:, 0]], image[:, _EDGES[:, 1]]
    rise = end[..., 1] - start[..., 1]
    rows = np.arange(camera.height, dtype=np.float32) + np.float32(0.5)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (rows - start[..., 1, None]) / rise[..., None]
        column = start[..., 0, None] + along * (end[..., 0] - start[..., 0])[..., None]
    slack = _MARGIN / np.maximum(np.abs(rise), _MARGIN)[..., None]
    crossed = (along >= -slack) & (along <= 1.0 + slack)
    low = np.where(crossed, column, np.inf).min(axis=1) - _MARGIN
    high = np.where(crossed, column, -np.inf).max(axis=1) + _MARGIN
    spans = np.stack([low, high], axis=1) - np.float32(0.5)
    spans[(depth <= 0).any(axis=1)] = np.array([-np.inf, np.inf])[:, None]  # reaches behind the camera: anywhere
    hidden = (depth <= 0).all(axis=1) | np.array([len(part.faces) == 0 for part in obj.parts])
    spans[hidden] = np.array([np.inf, -np.inf])[:, None]
    return spans


def _windows(spans: NDArray[np.float32], width: int) -> NDArray[np.int64]:
    low = np.clip(np.ceil(spans[:, 0]), 0, width)
    end = np.clip(np.floor(spans[:, 1]) + 1, 0, width)
    covered = end > low
    windows = np.zeros((len(spans), 4), dtype=np.int64)
    for k in np.flatnonzero(covered.any(axis=1)):
        rows = np.flatnonzero(covered[k])
        windows[k] = rows[0], rows[-1] + 1, low[k, rows].min(), end[k, rows].max()
    return windows


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
    nearest = _Nearest(len(pixels), len(posed.obj))
    row, column = np.divmod(pixels.astype(np.int32), np.int32(posed.camera.width))
    for k, (first_row, end_row, _, _) in enumerate(posed.windows):
        if end_row > first_row:
            low, high = posed.spans[k]
            rays = np.flatnonzero((column >= low[row]) & (column <= high[row]))
            if len(rays) == 0:
                continue
            nearest.update(k, rays, _cast_part(posed, k, row[rays], column[rays]))
    return (*nearest.result(posed.obj.scale), nearest.amodal)


class _Nearest:
    """The nearest hit of each ray so far."""

    def __init__(self, num_rays: int, num_parts: int):
        self.distance = np.full(num_rays, _MISS, dtype=np.float32)
        self.part_ids = np.full(num_rays, BACKGROUND, dtype=np.uint8)
        self.amodal = np.zeros(num_parts, dtype=np.int64)

    def update(self, k: int, rays: NDArray[np.int64], distance: NDArray[np.float32]) -> None:
        """Take in the native z-depths at which some rays meet part k."""
        hit = np.flatnonzero(distance < _MISS)
        self.amodal[k] += len(hit)
        rays, distance = rays[hit], distance[hit]
        nearer = np.flatnonzero(distance < self.distance[rays])
        rays = rays[nearer]
        self.distance[rays] = distance[nearer]
        self.part_ids[rays] = k

    def result(self, scale: float) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Depth in metres (0 for no hit) and part ids."""
        self.distance[self.part_ids == BACKGROUND] = 0.0
        return self.distance * np.float32(scale), self.part_ids


def _cast_part(
    posed: PosedObject, k: int, row: NDArray[np.integer], column: NDArray[np.integer]
) -> NDArray[np.float32]:
    """Native z-depth at which rays through pixel centres meet part k, ``_MISS`` or more where they do not."""
    K = posed.camera.K.astype(np.float32)
    directions = np.ones((len(row), 3), dtype=np.float32)
    directions[:, 1] = (row + (np.float32(0.5) - K[1, 2])) * (1 / K[1, 1])
    directions[:, 0] = (column + (np.float32(0.5) - K[0, 2]) - K[0, 1] * directions[:, 1]) * (1 / K[0, 0])
    rotation = posed.T_camera_part[k, :3, :3]
    origin = -(posed.T_camera_part[k, :3, 3] / posed.obj.scale) @ rotation
    distance: NDArray[np.float32] = part_scene(posed.obj.parts[k]).run(
        np.broadcast_to(origin.astype(np.float32), directions.shape),
        directions @ rotation.astype(np.float32),
        query="DISTANCE",
    )
    return distance


def visibility(posed: PosedObject, k: int, max_rays: int) -> tuple[int, int]:
    """Of the pixels within part k's spans, or every n-th of them: how many meet the part, and how many show it.

    Parameters
    ----------
    posed : PosedObject
    k : int
    max_rays : int
        About the most rays to cast; all pixels are looked at when there are fewer.
    """
    pixels, row, column = _span_pixels(posed, k)
    step = max(1, len(pixels) // max_rays)
    chosen = slice(step // 2, None, step)
    met = np.flatnonzero(_cast_part(posed, k, row[chosen], column[chosen]) < _MISS)
    _, part_ids, _ = cast(posed, pixels[chosen][met])
    return len(met), int(np.count_nonzero(part_ids == k))


def render_posed(posed: PosedObject, only: int | None = None) -> Frame:
    """Cast a ray through every pixel that a part, or only one of them, can cover."""
    camera = posed.camera
    nearest = _Nearest(camera.height * camera.width, len(posed.obj))
    for k in range(len(posed.obj)) if only is None else (only,):
        pixels, row, column = _span_pixels(posed, k)
        if len(pixels):
            nearest.update(k, pixels, _cast_part(posed, k, row, column))
    depth, part_ids = nearest.result(posed.obj.scale)
    shape = (camera.height, camera.width)
    return Frame(depth.reshape(shape), part_ids.reshape(shape), nearest.amodal)


class RaycastRenderer:
    """The embedded renderer behind the common protocol; needs no GPU, no display and no system library."""

    name = "raycast"

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        """Render one posed object; see :class:`artsim.renderers.base.Renderer`."""
        return render_posed(pose(obj, q, camera, T_world_object))

    def close(self) -> None:
        """Nothing to release: acceleration structures live as long as their parts."""


def _span_pixels(posed: PosedObject, k: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Flat indices, rows and columns of the pixels within a part's spans, row by row."""
    width = posed.camera.width
    first_row, end_row, _, _ = posed.windows[k]
    low, high = posed.spans[k, :, first_row:end_row]
    first = np.clip(np.ceil(low), 0, width).astype(np.int64)
    end = np.clip(np.floor(high) + 1, 0, width).astype(np.int64)
    count = np.maximum(end - first, 0)
    row = np.repeat(np.arange(first_row, end_row), count)
    before = np.cumsum(count) - count  # pixels in earlier rows
    column = np.arange(len(row)) + np.repeat(first - before, count)
    return row * width + column, row, column
