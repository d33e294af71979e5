"""A rasteriser in NumPy. It leaves out triangles that reach behind the camera.

A ray ``d`` meets the plane of a triangle with corners ``a, b, c`` where ``w = [a b c]^-1 d`` scales to barycentric
coordinates. The pixel lies in the triangle when no weight is negative, at the depth ``1 / sum(w)``.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import transform_points
from artsim.renderers.raycast import pose

DEGENERATE = 1e-12
"""Determinant, in cubic metres, of a triangle that is seen edge-on and covers no pixel."""


class Rasterizer:
    """Draws one triangle after another; the nearest one wins each pixel."""

    name = "rasterizer"

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        """Render one posed object; see :class:`artsim.renderers.base.Renderer`."""
        shape = (camera.height, camera.width)
        rays = camera.directions(np.arange(camera.height * camera.width)).reshape(*shape, 3)
        depth, part_ids = np.full(shape, np.inf), np.full(shape, BACKGROUND, np.uint8)
        T_camera_part = pose(obj, q, camera, T_world_object).T_camera_part
        for k, part in enumerate(obj.parts):
            corners = transform_points(T_camera_part[k], obj.scale * part.vertices)[part.faces]  # (F, 3, 3)
            seen = (corners[..., 2] > 0).all(axis=1) & (np.abs(np.linalg.det(corners)) > DEGENERATE)
            for triangle, pixels in zip(corners[seen], camera.project(corners[seen]), strict=True):
                draw(triangle, pixels, rays, depth, part_ids, k)
        return Frame(np.where(np.isinf(depth), 0.0, depth).astype(np.float32), part_ids)

    def close(self) -> None:
        """Nothing to release."""


def draw(triangle: Array, pixels: Array, rays: Array, depth: Array, part_ids: NDArray[np.uint8], k: int) -> None:
    """Draw a triangle (3, 3) of part k, whose corners are seen at pixels (3, 2), into depth and part_ids (H, W)."""
    last = np.array(depth.shape[::-1])
    left, top = np.clip(np.floor(pixels.min(axis=0)), 0, last).astype(int)
    right, bottom = np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, last).astype(int)
    window = np.s_[top:bottom, left:right]
    weights = rays[window] @ np.linalg.inv(triangle)
    inside = (weights >= 0).all(axis=-1)
    z = 1.0 / np.where(inside, weights.sum(axis=-1), np.inf)
    nearer = inside & (z < depth[window])
    depth[window][nearer], part_ids[window][nearer] = z[nearer], k
