"""The embedded renderer: rays against one static acceleration structure per part.

Joints move, geometry does not: rays are carried into each part's rest frame instead of moving triangles, so
nothing is rebuilt when the state changes. Only the pixels of a part's projected box are cast. Ray directions
have z = 1 in the camera frame, which makes the ray parameter the z-depth itself.
"""

import weakref
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.products import matmul
from artsim.model.camera import Camera
from artsim.model.frame import Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Part
from artsim.renderers import ray_kernels
from artsim.renderers.outlines import bounding_corners, outline_spans
from artsim.renderers.ray_scenes import RayScene, ray_scene

_MISS = np.float32(1e30)


@dataclass(frozen=True, eq=False)
class RaySurface:
    """What rays need of a part, made at first use and kept as long as the part."""

    scene: RayScene
    """Acceleration structure, native units."""
    corners: Array
    """(C, 3) float. Corners of a convex body around the part, native units."""


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
    """An object in front of a camera: what rays need to know, worked out once per view."""

    obj: ArticulatedObject
    camera: Camera
    T_camera_part: Array
    """(K, 4, 4) float."""
    spans: NDArray[np.float32]
    """(K, 2, H) float. Columns between which each part's outline can cover the centres of a row of pixels; empty (inf,
    -inf) where it does not."""
    row_ranges: NDArray[np.int64]
    """(K, 2) int. First and end row of each part's spans."""

    @cached_property
    def intrinsics(self) -> NDArray[np.float32]:
        """(3, 3) matrix of the camera in single precision."""
        return np.array(self.camera.K, dtype=np.float32, order="C")

    @cached_property
    def _set_out(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        known: tuple[NDArray[np.float32], NDArray[np.float32]]
        known = ray_kernels.set_out(np.ascontiguousarray(self.T_camera_part), float(self.obj.scale))
        return known

    @property
    def rotations(self) -> NDArray[np.float32]:
        """(K, 3, 3) rotations from each part to the camera."""
        return self._set_out[0]

    @property
    def origins(self) -> NDArray[np.float32]:
        """(K, 3) position of the camera in each part's rest frame, native units."""
        return self._set_out[1]

    def candidates(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(H,) first and end column, in each row, of the pixels that the whole object can cover."""
        columns: tuple[NDArray[np.int64], NDArray[np.int64]] = ray_kernels.columns(self.spans, self.camera.width)
        return columns


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
    rays, directions, ends = ray_kernels.ray_set_up(
        row, column, posed.row_ranges, posed.spans, posed.rotations, posed.intrinsics
    )
    return _nearest(posed, rays, _cast_directions(posed, range(len(posed.obj)), directions, ends), ends, len(row))


def _nearest(
    posed: PosedObject, rays: NDArray[np.int64], distance: NDArray[np.float32], ends: NDArray[np.int64], count: int
) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]:
    """Depth, part, and how many rays of each part meet and see it, of native z-depths along ``count`` rays."""
    found: tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.int64], NDArray[np.int64]]
    found = ray_kernels.nearest(rays, ends, distance, count, _MISS, np.float32(posed.obj.scale))
    return found


def part_depths(
    posed: PosedObject, parts: Sequence[int], row: NDArray[np.int64], column: NDArray[np.int64]
) -> NDArray[np.float32]:
    """(N,) z-depth in metres of the nearest of one or more parts at the centre of each pixel; 0 where there is none.

    It needs no spans: rays that are known can be cast again and again at what moves.
    """
    count, parts = len(row), list(parts)
    ends = count * np.arange(len(parts) + 1)
    many = np.tile(row, len(parts)), np.tile(column, len(parts))
    directions = ray_kernels.part_directions(*many, ends, posed.rotations[parts], posed.intrinsics)
    distance = _cast_directions(posed, parts, directions, ends).reshape(len(parts), count).min(axis=0)
    depth: NDArray[np.float32] = np.where(distance < _MISS, distance * np.float32(posed.obj.scale), np.float32(0.0))
    return depth


def hit_faces(posed: PosedObject, k: int, row: NDArray[np.int64], column: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) first face of part k that the ray through the centre of each pixel meets; -1 where it meets none."""
    ends = np.array([0, len(row)])
    directions = ray_kernels.part_directions(row, column, ends, posed.rotations[k : k + 1], posed.intrinsics)
    faces = ray_surface(posed.obj.parts[k]).scene.run(_origins(posed, k, len(row)), directions)
    return np.asarray(faces, dtype=np.int64)


def _origins(posed: PosedObject, k: int, count: int) -> NDArray[np.float32]:
    """(count, 3) origins of rays in the frame of part k: all at the camera, seen through a stride of 0."""
    return np.ndarray((count, 3), np.float32, posed.origins, offset=12 * k, strides=(0, 4))


def _cast_directions(
    posed: PosedObject, parts: Iterable[int], directions: NDArray[np.float32], ends: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Native z-depth along directions, of which those up to ``ends[i + 1]`` are cast at the i-th of some parts.

    It is ``_MISS`` or more where a ray does not meet the part.
    """
    distance = np.empty(len(directions), np.float32)
    last = ends.tolist()
    for i, k in enumerate(parts):
        if last[i + 1] > last[i]:
            mine = slice(last[i], last[i + 1])
            part, origins = posed.obj.parts[k], _origins(posed, k, last[i + 1] - last[i])
            met = ray_surface(part).scene.run(origins, directions[mine])
            eye, forward = posed.origins[k], posed.rotations[k, 2]
            ray_kernels.depths(met, directions[mine], eye, forward, part.vertices, part.faces, _MISS, distance[mine])
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
    row, column, distance, ends = _cast_spans(posed, parts, max_rays)
    met = (distance < _MISS).nonzero()[0]
    row, column, owner = row[met], column[met], np.searchsorted(ends, met, side="right") - 1
    counts = np.zeros((len(parts), 2), dtype=np.int64)
    if len(row):
        order = np.argsort(row, kind="stable")
        _, part_ids, _ = cast(posed, row[order], column[order])
        owner = owner[order]
        counts[:, 0] = np.bincount(owner, minlength=len(parts))
        counts[:, 1] = np.bincount(owner[part_ids == np.asarray(parts)[owner]], minlength=len(parts))
    return counts


def _cast_spans(
    posed: PosedObject, parts: Sequence[int], max_rays: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32], NDArray[np.int64]]:
    """Row and column of every n-th pixel of the spans of some parts, native z-depth of the part there, where each ends.

    ``n`` is such that about ``max_rays`` are cast at a part.
    """
    low, high, width = posed.spans[parts, 0], posed.spans[parts, 1], posed.camera.width
    first = np.clip(np.ceil(low), 0, width).astype(np.int64)
    end = np.maximum(np.clip(np.floor(high) + 1, 0, width).astype(np.int64), first)
    row, column, ends = ray_kernels.every_nth(first, end, max_rays)
    directions = ray_kernels.part_directions(row, column, ends, posed.rotations[parts], posed.intrinsics)
    return row, column, _cast_directions(posed, parts, directions, ends), ends


def render_posed(posed: PosedObject, only: int | None = None) -> Frame:
    """Cast a ray through every pixel that a part, or only one of them, can cover."""
    shape, parts = (posed.camera.height, posed.camera.width), len(posed.obj)
    shown = range(parts) if only is None else (only,)
    row, column, distance, ends = _cast_spans(posed, list(shown), shape[0] * shape[1])
    all_ends = np.zeros(parts + 1, np.int64)
    all_ends[1:][list(shown)] = ends[1:]
    np.maximum.accumulate(all_ends, out=all_ends)
    depth, part_ids, amodal, _ = _nearest(posed, row * shape[1] + column, distance, all_ends, shape[0] * shape[1])
    return Frame(depth.reshape(shape), part_ids.reshape(shape), amodal)


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
