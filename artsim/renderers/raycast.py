"""The embedded renderer: rays against one static acceleration structure per part.

Joints move, geometry does not: rays are carried into each part's rest frame instead of moving triangles, so
nothing is rebuilt when the state changes. Only the pixels of a part's projected box are cast. Ray directions
have z = 1 in the camera frame, which makes the ray parameter the z-depth itself.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.products import apply, matmul
from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Part
from artsim.renderers.compiled import kernels
from artsim.renderers.outlines import bounding_corners, outline_spans
from artsim.renderers.ray_scenes import RayScene, ray_scene

_MISS = np.float32(1e30)


@dataclass(frozen=True, eq=False)
class RaySurface:
    """What rays need of a part, made at first use and kept as long as the part.

    Attributes
    ----------
    scene : RayScene
        Acceleration structure, native units.
    corners : (C, 3) float
        Corners of a convex body around the part, native units.
    """

    scene: RayScene
    corners: Array


_surfaces: weakref.WeakKeyDictionary[Part, RaySurface] = weakref.WeakKeyDictionary()


def ray_surface(part: Part) -> RaySurface:
    """The surface of a part that has one."""
    made = _surfaces.get(part)
    if made is None:
        scene = ray_scene(part.vertices, part.faces)
        made = _surfaces[part] = RaySurface(scene, bounding_corners(part.vertices[np.unique(part.faces)]))
    return made


@dataclass(frozen=True, eq=False)
class PosedObject:
    """An object in front of a camera: what rays need to know, worked out once per view.

    Attributes
    ----------
    obj : ArticulatedObject
    camera : Camera
    T_camera_part : (K, 4, 4) float
    spans : (K, 2, H) float
        Columns between which each part's outline can cover the centres of a row of pixels; empty (inf, -inf) where it
        does not.
    row_ranges : (K, 2) int
        First and end row of each part's spans.
    """

    obj: ArticulatedObject
    camera: Camera
    T_camera_part: Array
    spans: NDArray[np.float32]
    row_ranges: NDArray[np.int64]

    @cached_property
    def intrinsics(self) -> NDArray[np.float32]:
        """(3, 3) matrix of the camera in single precision."""
        return np.array(self.camera.K, dtype=np.float32, order="C")

    @cached_property
    def _set_out(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        compiled, T = kernels(), np.ascontiguousarray(self.T_camera_part)
        if compiled is not None:
            known: tuple[NDArray[np.float32], NDArray[np.float32]] = compiled.set_out(T, float(self.obj.scale))
            return known
        rotation, translation = T[:, :3, :3], T[:, :3, 3]
        origins = apply(np.swapaxes(rotation, 1, 2), translation) / -self.obj.scale
        return rotation.astype(np.float32, order="C"), origins.astype(np.float32, order="C")

    @property
    def rotations(self) -> NDArray[np.float32]:
        """(K, 3, 3) rotations from each part to the camera."""
        return self._set_out[0]

    @property
    def origins(self) -> NDArray[np.float32]:
        """(K, 3) position of the camera in each part's rest frame, native units."""
        return self._set_out[1]

    def image_plane(self, row: NDArray[np.int64], column: NDArray[np.int64]) -> NDArray[np.float32]:
        """(2, N) x and y of the directions of the rays through pixel centres, camera frame, where z = 1."""
        K = self.intrinsics
        plane = np.empty((2, len(row)), dtype=np.float32)
        plane[1] = (row.astype(np.float32) + (np.float32(0.5) - K[1, 2])) / K[1, 1]
        plane[0] = (column.astype(np.float32) + (np.float32(0.5) - K[0, 2]) - K[0, 1] * plane[1]) / K[0, 0]
        return plane

    def candidates(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(H,) first and end column, in each row, of the pixels that the whole object can cover."""
        compiled = kernels()
        if compiled is not None:
            columns: tuple[NDArray[np.int64], NDArray[np.int64]] = compiled.columns(self.spans, self.camera.width)
            return columns
        return _columns(self.spans[:, 0].min(axis=0), self.spans[:, 1].max(axis=0), self.camera.width)


def _columns(
    low: NDArray[np.float32], high: NDArray[np.float32], width: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and end column of the pixels whose centres lie between two bounds."""
    first = np.clip(np.ceil(low), 0, width).astype(np.int64)
    return first, np.maximum(np.clip(np.floor(high) + 1, 0, width).astype(np.int64), first)


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
    T_camera_rest = camera.T_camera_world
    if T_world_object is not None:
        T_camera_rest = matmul(T_camera_rest, np.asarray(T_world_object, dtype=np.float64))
    T_camera_part = matmul(T_camera_rest, obj.tree.forward_kinematics(q))
    return PosedObject(obj, camera, T_camera_part, *outline_spans(obj, _corners(obj), camera, T_camera_part))


def _corners(obj: ArticulatedObject) -> Array:
    """(K, 3, C) corners around each part, native units; the last is repeated where a part has fewer."""
    root, others = obj.parts[0], obj.parts[1:]
    known = _corners_of.get(root)
    if known is None or known[0] != others:  # other objects may have the same root
        own = [ray_surface(p).corners if len(p.faces) else np.zeros((1, 3)) for p in obj.parts]
        most = max(map(len, own))
        padded = np.stack([np.pad(c, ((0, most - len(c)), (0, 0)), "edge").T for c in own])
        known = _corners_of[root] = (others, padded)
    return known[1]


_corners_of: weakref.WeakKeyDictionary[Part, tuple[tuple[Part, ...], Array]] = weakref.WeakKeyDictionary()


def cast(
    posed: PosedObject, row: NDArray[np.int64], column: NDArray[np.int64]
) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.int64]]:
    """Cast one ray through the centre of each pixel.

    Where surfaces of two parts coincide exactly, the part with the lower index is seen.

    Parameters
    ----------
    posed : PosedObject
    row, column : (N,) int
        Row after row.

    Returns
    -------
    depth : (N,) float32
        z-depth in metres, 0 where no part is hit.
    part_ids : (N,) uint8
        ``BACKGROUND`` where no part is hit.
    amodal : (K,) int64
        Rays that hit each part, hidden or not.
    """
    return cast_counted(posed, row, column)[:3]


def cast_counted(
    posed: PosedObject, row: NDArray[np.int64], column: NDArray[np.int64]
) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]:
    """As :func:`cast`; and of each part (K,) how many rays see it."""
    compiled = kernels()
    if compiled is not None:
        rays, directions, ends = compiled.ray_set_up(
            row, column, posed.row_ranges, posed.spans, posed.rotations, posed.intrinsics
        )
        distance = _cast_directions(posed, range(len(posed.obj)), directions, ends)
        found: tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]
        found = compiled.nearest(rays, ends, distance, len(row), _MISS, np.float32(posed.obj.scale))
        return found
    nearest = _Nearest(len(row), len(posed.obj))
    plane = posed.image_plane(row, column)
    for k, (start, end) in enumerate(np.searchsorted(row, posed.row_ranges).tolist()):
        low, high = posed.spans[k]
        near_row, near_column = row[start:end], column[start:end]
        mine = ((near_column >= low[near_row]) & (near_column <= high[near_row])).nonzero()[0] + start
        if len(mine):
            nearest.update(k, mine, _cast_part(posed, k, plane.take(mine, axis=1)))
    depth, part_ids = nearest.result(posed.obj.scale)
    seen = np.bincount(part_ids, minlength=BACKGROUND + 1)[: len(posed.obj)]
    return depth, part_ids, nearest.amodal, seen


class _Nearest:
    """The nearest hit of each ray so far."""

    def __init__(self, num_rays: int, num_parts: int):
        self.distance = np.full(num_rays, _MISS, dtype=np.float32)
        self.part_ids = np.full(num_rays, BACKGROUND, dtype=np.uint8)
        self.amodal = np.zeros(num_parts, dtype=np.int64)

    def update(self, k: int, rays: NDArray[np.int64], distance: NDArray[np.float32]) -> None:
        """Take in the native z-depths at which some rays meet part k."""
        self.amodal[k] += np.count_nonzero(distance < _MISS)
        nearer = (distance < self.distance[rays]).nonzero()[0]
        rays = rays[nearer]
        self.distance[rays] = distance[nearer]
        self.part_ids[rays] = k

    def result(self, scale: float) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Depth in metres (0 for no hit) and part ids."""
        self.distance[self.part_ids == BACKGROUND] = 0.0
        return self.distance * np.float32(scale), self.part_ids


def hit_faces(posed: PosedObject, k: int, row: NDArray[np.int64], column: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) first face of part k that the ray through the centre of each pixel meets; -1 where it meets none."""
    directions = _part_directions(posed, k, posed.image_plane(row, column))
    faces = ray_surface(posed.obj.parts[k]).scene.run(_origins(posed, k, len(row)), directions, query="INTERSECT")
    return np.asarray(faces, dtype=np.int64)


def _cast_part(posed: PosedObject, k: int, plane: NDArray[np.float32]) -> NDArray[np.float32]:
    """Native z-depth at which rays from the camera meet part k, ``_MISS`` or more where they do not.

    ``plane`` is (2, N), what :meth:`PosedObject.image_plane` gives.
    """
    return _distance(posed, k, _part_directions(posed, k, plane))


def _part_directions(posed: PosedObject, k: int, plane: NDArray[np.float32]) -> NDArray[np.float32]:
    """(N, 3) directions of rays in the frame of part k."""
    # Row by row of the rotation, not by BLAS: see `artsim.common.products`.
    x, y, z = posed.rotations[k][..., None]
    directions = plane[0] * x
    directions += plane[1] * y
    directions += z
    return directions.T


def _origins(posed: PosedObject, k: int, count: int) -> NDArray[np.float32]:
    """(count, 3) origins of rays in the frame of part k: all at the camera, seen through a stride of 0."""
    return np.ndarray((count, 3), np.float32, posed.origins, offset=12 * k, strides=(0, 4))


def _distance(posed: PosedObject, k: int, directions: NDArray[np.float32]) -> NDArray[np.float32]:
    """Native z-depth along directions (N, 3) in the frame of part k."""
    scene = ray_surface(posed.obj.parts[k]).scene
    distance: NDArray[np.float32] = scene.run(_origins(posed, k, len(directions)), directions, query="DISTANCE")
    return distance


def _cast_directions(
    posed: PosedObject, parts: Iterable[int], directions: NDArray[np.float32], ends: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Native z-depth along directions, of which those up to ``ends[i + 1]`` are cast at the i-th of some parts."""
    distance = np.empty(len(directions), np.float32)
    last = ends.tolist()
    for i, k in enumerate(parts):
        if last[i + 1] > last[i]:
            mine = slice(last[i], last[i + 1])
            distance[mine] = _distance(posed, k, directions[mine])
    return distance


def visibility(posed: PosedObject, parts: Sequence[int], max_rays: int) -> NDArray[np.int64]:
    """Of the pixels within the spans of some parts, or every n-th of them: how many meet the part, how many show it.

    Parameters
    ----------
    posed : PosedObject
    parts : sequence of int
    max_rays : int
        About the most rays to cast at each part; all its pixels are looked at when there are fewer.

    Returns
    -------
    (len(parts), 2) int
    """
    row, column, owner = _met_pixels(posed, parts, max_rays)
    counts = np.zeros((len(parts), 2), dtype=np.int64)
    if len(row):
        order = np.argsort(row, kind="stable")
        _, part_ids, _ = cast(posed, row[order], column[order])
        owner = owner[order]
        counts[:, 0] = np.bincount(owner, minlength=len(parts))
        counts[:, 1] = np.bincount(owner[part_ids == np.asarray(parts)[owner]], minlength=len(parts))
    return counts


def _met_pixels(
    posed: PosedObject, parts: Sequence[int], max_rays: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Row, column and the number of the part of pixels, every n-th of a part's spans, whose rays meet that part."""
    low, high = posed.spans[parts, 0], posed.spans[parts, 1]
    first, end = _columns(low, high, posed.camera.width)
    compiled = kernels()
    if compiled is not None:
        row, column, ends = compiled.every_nth(first, end, max_rays)
        directions = compiled.part_directions(row, column, ends, posed.rotations[parts], posed.intrinsics)
        met = (_cast_directions(posed, parts, directions, ends) < _MISS).nonzero()[0]
        return row[met], column[met], np.searchsorted(ends, met, side="right") - 1
    nothing = np.zeros(0, np.int64)
    found = [(nothing, nothing, nothing)]
    for i, k in enumerate(parts):
        up_to = np.cumsum(end[i] - first[i])
        step = max(1, int(up_to[-1]) // max_rays)
        number = np.arange(step // 2, int(up_to[-1]), step)
        row = np.searchsorted(up_to, number, side="right")
        column = number + (end[i] - up_to)[row]
        if len(row):
            met = _cast_part(posed, k, posed.image_plane(row, column)) < _MISS
            found.append((row[met], column[met], np.full(np.count_nonzero(met), i)))
    rows, columns, owners = (np.concatenate(pieces) for pieces in zip(*found, strict=True))
    return rows, columns, owners


def render_posed(posed: PosedObject, only: int | None = None) -> Frame:
    """Cast a ray through every pixel that a part, or only one of them, can cover."""
    camera = posed.camera
    nearest = _Nearest(camera.height * camera.width, len(posed.obj))
    for k in range(len(posed.obj)) if only is None else (only,):
        row, column = _span_pixels(posed, k)
        if len(row):
            nearest.update(k, row * camera.width + column, _cast_part(posed, k, posed.image_plane(row, column)))
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


def _span_pixels(posed: PosedObject, k: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns of the pixels within a part's spans, row by row."""
    low, high = posed.spans[k]
    first, end = _columns(low, high, posed.camera.width)
    count = end - first
    row = np.repeat(np.arange(len(count)), count)
    before = np.cumsum(count) - count  # pixels in earlier rows
    return row, np.arange(len(row)) + np.repeat(first - before, count)
