"""Rays of a camera that stands still before a row of objects, one of which moves: what stands still is met once."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from artsim.envs.handles import Handle
from artsim.model.camera import Camera
from artsim.model.draws import ViewOptions, posed_bounds, sphere_view
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import compose_transform
from artsim.observing.annotation import shade_parts
from artsim.observing.capture import draw_visible
from artsim.physics.episode import most_open_state
from artsim.renderers import render
from artsim.renderers.raycast import PosedObject, cast, part_depths, pose

_GAP = 0.15
"""Metres between objects in a row."""
_NO_SPANS = np.zeros((0, 2, 0), np.float32), np.zeros((0, 2), np.int64)
_DOT, _OPEN_DOT = (20, 20, 20), (230, 60, 30)
"""Colours of a hand, closed and open."""


@dataclass(frozen=True, eq=False)
class CachedRays:
    """A camera before the object of a handle, whose rest frame is the world's, and before others."""

    handle: Handle
    camera: Camera
    row: NDArray[np.int64]
    column: NDArray[np.int64]
    """(N,) pixels whose rays are cast."""
    still: NDArray[np.float32]
    """(N,) z-depth in metres of what does not move; infinite where there is nothing."""
    others: tuple[tuple[ArticulatedObject, Array], ...]
    """Each with its pose (4, 4) in the world."""
    R_level_world: Array
    """(3, 3) x away from the camera, z up."""
    rays: Array
    """(N, 3) in the level frame; 1 along the optical axis."""

    def cloud(self, T_world_moved: Array, hand: Array) -> Array:
        """(N, 3) where the rays meet something, from the hand (3,), level frame; 0 for those that meet nothing.

        T_world_moved (4, 4) is where moving parts carry the rest frame.
        """
        obj, parts = self.handle.obj, self.handle.parts
        T_camera_part = np.broadcast_to(self.camera.T_camera_world @ T_world_moved, (len(obj), 4, 4))
        posed = PosedObject(obj, self.camera, T_camera_part, *_NO_SPANS)
        moving = part_depths(posed, parts, self.row, self.column)
        depth = np.minimum(self.still, np.where(moving > 0, moving, np.inf))[:, None]
        met = np.isfinite(depth)
        camera = self.R_level_world @ (self.camera.T_world_camera[:3, 3] - hand)
        points: Array = np.where(met, self.rays * np.where(met, depth, 0.0) + camera, 0.0)
        return points

    def picture(self, q: float, hand: Array, closed: bool) -> NDArray[np.uint8]:
        """(H, W, 3) a colour for each part, with the handle's joint in state q, and a dot for the hand."""
        shown = [(self.handle.obj, self.handle.object_state(q), np.eye(4))]
        shown += [(obj, obj.tree.rest, T) for obj, T in self.others]
        height, width = self.camera.height, self.camera.width
        picture, nearest = np.full((height, width, 3), 255, np.uint8), np.full((height, width), np.inf)
        for obj, state, T in shown:
            frame = render(obj, state, self.camera, T)
            nearer = (frame.depth > 0) & (frame.depth < nearest)
            picture[nearer], nearest[nearer] = shade_parts(frame, self.camera)[nearer], frame.depth[nearer]
        there = self.camera.T_camera_world @ np.append(hand, 1.0)
        column, row = self.camera.project(there[None, :3])[0, :2]
        away = np.hypot(np.arange(width) + 0.5 - column, np.arange(height)[:, None] + 0.5 - row)
        picture[away < height / 30] = _DOT if closed else _OPEN_DOT
        return picture


def look_at_row(
    handle: Handle, others: Sequence[ArticulatedObject], views: ViewOptions, num_points: int, rng: np.random.Generator
) -> CachedRays:
    """Draw the order of the objects in their row, a camera, and rays at what is to be seen there.

    Rays are pixels of the objects at rest and of the one with the handle when that is open, as many of each.
    """
    objects = [handle.obj, *others]
    bounds = [posed_bounds(obj, most_open_state(obj)) for obj in objects]
    places, edge = np.zeros((len(objects), 3)), 0.0
    for i in rng.permutation(len(objects)):
        low, high = bounds[i]
        places[i] = 0.0, edge - low[1], bounds[0][0][2] - low[2]
        edge += high[1] - low[1] + _GAP
    places -= places[0]
    low = np.min([place + own[0] for place, own in zip(places, bounds, strict=True)], axis=0)
    high = np.max([place + own[1] for place, own in zip(places, bounds, strict=True)], axis=0)
    camera = sphere_view(0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low)), views, rng)
    standing = [(obj, compose_transform(place, np.eye(3))) for obj, place in zip(objects, places, strict=True)]
    posed = [pose(obj, obj.tree.rest, camera, T) for obj, T in standing]
    opened = pose(handle.obj, handle.object_state(handle.joint.upper), camera)
    share = -(-num_points // (len(posed) + 1))
    seen = [draw_visible(own, partial(_look, own), share, rng)[0] for own in (opened, *posed)]
    found = np.concatenate(seen)
    pixels = np.sort(rng.choice(found, num_points, replace=len(found) < num_points))
    row, column = np.divmod(pixels, camera.width)
    fixed = [sorted(set(range(len(handle.obj))) - set(handle.parts)), *(range(len(obj)) for obj in others)]
    depths = [part_depths(own, parts, row, column) for own, parts in zip(posed, fixed, strict=True)]
    still = np.min([np.where(depth > 0, depth, np.inf) for depth in depths], axis=0)
    x, y = camera.T_world_camera[:2, 2] / np.linalg.norm(camera.T_world_camera[:2, 2])
    R_level_world = np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]])
    rays = camera.directions(pixels) @ (R_level_world @ camera.T_world_camera[:3, :3]).T
    return CachedRays(handle, camera, row, column, still, tuple(standing[1:]), R_level_world, rays)


def _look(
    posed: PosedObject, row: NDArray[np.int64], column: NDArray[np.int64]
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    return cast(posed, row, column)[:2]
