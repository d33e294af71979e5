"""The embedded renderer: Embree rays against one static acceleration structure per part.

Joints move, geometry does not: rays are carried into each part's rest frame instead of moving triangles, so
nothing is rebuilt when the state changes. Only the pixels of a part's projected box are cast. Ray directions
have z = 1 in the camera frame, which makes the ray parameter the z-depth itself.
"""

from __future__ import annotations

import contextlib
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import ArrayLike, NDArray

from artsim.common.elementary import cos, tan
from artsim.common.products import apply, matmul, unit
from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Part

_MISS = np.float32(1e30)


@dataclass(frozen=True, eq=False)
class RaySurface:
    """What rays need of a part, made at first use and kept as long as the part.

    Attributes
    ----------
    scene : EmbreeScene
        Acceleration structure, native units.
    corners : (C, 3) float
        Corners of a convex body around the part, native units.
    """

    scene: EmbreeScene
    corners: Array


_surfaces: weakref.WeakKeyDictionary[Part, RaySurface] = weakref.WeakKeyDictionary()


def ray_surface(part: Part) -> RaySurface:
    """The surface of a part that has one."""
    made = _surfaces.get(part)
    if made is None:
        # Embree's `robust` mode costs a third more and changed no pixel in ten million on real objects.
        scene = EmbreeScene()
        TriangleMesh(scene, part.vertices.astype(np.float32), part.faces)
        made = _surfaces[part] = RaySurface(scene, bounding_corners(part.vertices[np.unique(part.faces)]))
    return made


def bounding_corners(points: Array) -> Array:
    """Corners of the bounding polytope with 26 faces: normal to the axes, and to a cube's edges and corners.

    Parameters
    ----------
    points : (N, 3) float

    Returns
    -------
    (C, 3) float
        Their convex hull contains the points.
    """
    from scipy.spatial import HalfspaceIntersection, QhullError

    reach = matmul(points, _NORMALS.T)
    low, high = reach.min(axis=0), reach.max(axis=0)
    slack = 1e-5 * float((high - low).max()) + 1e-12  # gives flat parts a thickness
    faces = np.concatenate([np.column_stack([_NORMALS, -high - slack]), np.column_stack([-_NORMALS, low - slack])])
    with contextlib.suppress(QhullError):
        corners = HalfspaceIntersection(faces, points.mean(axis=0)).intersections
        around = matmul(corners, _NORMALS.T)
        if np.isfinite(around).all() and (around.min(axis=0) <= low).all() and (around.max(axis=0) >= high).all():
            return corners
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    return np.array([(box[a, 0], box[b, 1], box[c, 2]) for a in (0, 1) for b in (0, 1) for c in (0, 1)])


_NORMALS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) > (0, 0, 0)])
_NORMALS = unit(_NORMALS)


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
    def rotations(self) -> NDArray[np.float32]:
        """(K, 3, 3) rotations from each part to the camera."""
        return self.T_camera_part[:, :3, :3].astype(np.float32)

    @cached_property
    def origins(self) -> NDArray[np.float32]:
        """(K, 3) position of the camera in each part's rest frame, native units."""
        rotation, translation = self.T_camera_part[:, :3, :3], self.T_camera_part[:, :3, 3]
        return (apply(np.swapaxes(rotation, 1, 2), translation) / -self.obj.scale).astype(np.float32)

    def image_plane(self, row: NDArray[np.int64], column: NDArray[np.int64]) -> NDArray[np.float32]:
        """(2, N) x and y of the directions of the rays through pixel centres, camera frame, where z = 1."""
        K = self.camera.K.astype(np.float32)
        plane = np.empty((2, len(row)), dtype=np.float32)
        plane[1] = (row.astype(np.float32) + (np.float32(0.5) - K[1, 2])) / K[1, 1]
        plane[0] = (column.astype(np.float32) + (np.float32(0.5) - K[0, 2]) - K[0, 1] * plane[1]) / K[0, 0]
        return plane

    def candidates(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(H,) first and end column, in each row, of the pixels that the whole object can cover."""
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
    return PosedObject(obj, camera, T_camera_part, *_spans(obj, camera, T_camera_part))


_TILTS = np.deg2rad(np.arange(-72.0, 73.0, 18.0))  # of the lines that bound an outline to its left and right
_TANGENTS = tan(_TILTS)[:, None]
_SLOPES = np.stack([_TANGENTS, -_TANGENTS]).astype(np.float32)  # for the left side, and for the negated right side
_MARGIN = 0.05  # pixels: covers single precision
_MARGINS = _MARGIN / cos(_TILTS)


def _spans(
    obj: ArticulatedObject, camera: Camera, T_camera_part: Array
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Row spans of the parts' outlines, and their rows.

    A convex body in front of the camera has a convex image: it lies between its highest and lowest corners, and
    between the lines of any slope that touch it.
    """
    seen = matmul(T_camera_part[:, :3, :3], _corners(obj) * obj.scale) + T_camera_part[:, :3, 3, None]
    depth = seen[:, 2]
    u, v, _ = np.swapaxes(matmul(camera.K, seen) / np.where(depth > 0, depth, np.inf)[:, None], 0, 1).clip(-1e6, 1e6)
    heights = np.stack([v.min(axis=1) - _MARGIN, v.max(axis=1) + 1.0 + _MARGIN], axis=1)
    row_ranges = np.clip(np.ceil(heights - 0.5), 0, camera.height).astype(np.int64)
    # u + tan * v of the corners: the line through the outermost bounds the outline. Spans count from pixel centres.
    across = u[:, None] + v[:, None] * _TANGENTS
    bounds = np.stack([across.min(axis=2) - _MARGINS, -across.max(axis=2) - _MARGINS], axis=1)
    bounds -= [[0.5], [-0.5]]
    first_row, end_row = row_ranges[:, 0].min(), row_ranges[:, 1].max()
    rows = np.arange(first_row, end_row, dtype=np.float32) + np.float32(0.5)
    spans = np.full((len(obj), 2, camera.height), np.inf, dtype=np.float32)
    lines = bounds.astype(np.float32)[..., None] - _SLOPES * rows
    spans[:, :, first_row:end_row] = lines.max(axis=2)
    spans[:, 1] *= -1.0
    for k in range(len(obj)):
        spans[k, 1, : row_ranges[k, 0]] = spans[k, 1, row_ranges[k, 1] :] = -np.inf
    around = (depth <= 0).any(axis=1)  # reaches behind the camera: it may cover any pixel
    spans[around], row_ranges[around] = np.array([[-np.inf], [np.inf]]), (0, camera.height)
    hidden = (depth <= 0).all(axis=1) | ~obj.has_surface
    spans[hidden], row_ranges[hidden] = np.array([[np.inf], [-np.inf]]), 0
    return spans, row_ranges


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
    nearest = _Nearest(len(row), len(posed.obj))
    plane = posed.image_plane(row, column)
    for k, (start, end) in enumerate(np.searchsorted(row, posed.row_ranges).tolist()):
        low, high = posed.spans[k]
        near_row, near_column = row[start:end], column[start:end]
        rays = ((near_column >= low[near_row]) & (near_column <= high[near_row])).nonzero()[0] + start
        if len(rays):
            nearest.update(k, rays, _cast_part(posed, k, plane.take(rays, axis=1)))
    return (*nearest.result(posed.obj.scale), nearest.amodal)


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
    origins, directions = _part_rays(posed, k, posed.image_plane(row, column))
    faces = ray_surface(posed.obj.parts[k]).scene.run(origins, directions.T, query="INTERSECT")
    return np.asarray(faces, dtype=np.int64)


def _cast_part(posed: PosedObject, k: int, plane: NDArray[np.float32]) -> NDArray[np.float32]:
    """Native z-depth at which rays from the camera meet part k, ``_MISS`` or more where they do not.

    ``plane`` is (2, N), what :meth:`PosedObject.image_plane` gives.
    """
    origins, directions = _part_rays(posed, k, plane)
    distance: NDArray[np.float32] = ray_surface(posed.obj.parts[k]).scene.run(origins, directions.T, query="DISTANCE")
    return distance


def _part_rays(
    posed: PosedObject, k: int, plane: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Origins (N, 3) and directions (3, N) of rays from the camera, in the frame of part k."""
    # Row by row of the rotation, not by BLAS: see `artsim.common.products`.
    x, y, z = posed.rotations[k][..., None]
    directions = plane[0] * x
    directions += plane[1] * y
    directions += z
    # All rays start at the camera: one origin, seen N times through a stride of 0.
    shape = (plane.shape[1], 3)
    origins: NDArray[np.float32] = np.ndarray(shape, np.float32, posed.origins[k].copy(), strides=(0, 4))
    return origins, directions


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
    counts = np.zeros((len(parts), 2), dtype=np.int64)
    found: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]] = []
    for i, k in enumerate(parts):
        row, column = _span_pixels(posed, k)
        step = max(1, len(row) // max_rays)
        row, column = row[step // 2 :: step], column[step // 2 :: step]
        if len(row):
            met = _cast_part(posed, k, posed.image_plane(row, column)) < _MISS
            found.append((row[met], column[met], np.full(np.count_nonzero(met), i)))
    if found:
        row, column, owner = (np.concatenate(pieces) for pieces in zip(*found, strict=True))
        order = np.argsort(row, kind="stable")
        _, part_ids, _ = cast(posed, row[order], column[order])
        owner = owner[order]
        counts[:, 0] = np.bincount(owner, minlength=len(parts))
        counts[:, 1] = np.bincount(owner[part_ids == np.asarray(parts)[owner]], minlength=len(parts))
    return counts


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
