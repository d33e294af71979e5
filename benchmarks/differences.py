"""Why two renderers show something else at a pixel: every pixel falls into the first class that applies to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, maximum_filter, minimum_filter

from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.renderers.raycast import pose, render_posed

Scene = tuple[ArticulatedObject, Array, Camera]
"""A sized object, its joint states and the camera that looks at it."""
Mask = NDArray[np.bool_]

CLASSES = {
    "coincident surfaces": "two parts' surfaces lie within 0.1 mm of each other: rounding chooses",
    "sliver": "a part or a gap thinner than 3 px: whether a pixel's centre meets it is rounding",
    "silhouette": "within 2 px of the object's outline: the pixel's centre falls on either side",
    "edge": "within 2 px of a part's border, a step or a crease",
    "grazing": "seen at more than 80 deg: a fraction of a pixel is a long way along the ray",
    "unexplained": "none of these",
}
"""Classes of pixels, and why renderers differ there."""

_REACH = 2  # pixels about an edge
_JUMP = 2e-3  # metres between neighbouring pixels, beyond the local slope: a step
_COINCIDENT = 1e-4  # metres
_GRAZING = np.tan(np.deg2rad(80.0))


def classify(scene: Scene, rays: Frame, other: Frame) -> dict[str, Mask]:
    """Pixels of each class: (H, W) each, every pixel in one of them.

    Parameters
    ----------
    scene : Scene
    rays : Frame
        By the ray caster.
    other : Frame
        By another renderer.
    """
    found = {
        "coincident surfaces": coincident_parts(*scene, rays, other),
        "sliver": slivers(rays) | slivers(other),
        "silhouette": near_outline(rays) | near_outline(other),
        "edge": near_edge(rays) | near_edge(other),
        "grazing": grazing(rays, scene[2]),
        "unexplained": np.ones(rays.depth.shape, dtype=bool),
    }
    left = np.ones(rays.depth.shape, dtype=bool)
    for name in CLASSES:
        found[name] &= left
        left &= ~found[name]
    return found


def near_edge(frame: Frame) -> Mask:
    """(H, W) pixels within 2 px of a part's border or of a jump in depth."""
    ids, depth = frame.part_ids, frame.depth
    edge = np.zeros(ids.shape, dtype=bool)
    for first, second in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        step = np.abs(depth[first] - depth[second])
        border = (ids[first] != ids[second]) | (step > _JUMP + 0.02 * depth[first])
        edge[first] |= border
        edge[second] |= border
    # A smooth slope has equal steps either side; a thin gap or sliver does not.
    bend = np.zeros(ids.shape, dtype=bool)
    bend[1:-1] |= np.abs(depth[2:] - 2 * depth[1:-1] + depth[:-2]) > _JUMP
    bend[:, 1:-1] |= np.abs(depth[:, 2:] - 2 * depth[:, 1:-1] + depth[:, :-2]) > _JUMP
    return binary_dilation(edge | bend, iterations=_REACH)


def near_outline(frame: Frame) -> Mask:
    """(H, W) pixels within 2 px of where the object ends and the background begins."""
    shown = frame.part_ids != BACKGROUND
    return binary_dilation(shown, iterations=_REACH) & binary_dilation(~shown, iterations=_REACH)


def slivers(frame: Frame) -> Mask:
    """(H, W) pixels that no 3x3 window of one part, or of background, contains."""
    ids = frame.part_ids
    uniform = minimum_filter(ids, 3) == maximum_filter(ids, 3)
    return ~binary_dilation(uniform, np.ones((3, 3), dtype=bool))


def grazing(frame: Frame, camera: Camera) -> Mask:
    """(H, W) pixels at which the surface is seen at more than 80 deg from its normal, by the slope of the depth."""
    depth = frame.depth.astype(np.float64)
    across = np.zeros_like(depth)
    for axis, focal in ((0, camera.K[1, 1]), (1, camera.K[0, 0])):
        step = np.abs(np.diff(depth, axis=axis)) * focal
        before = np.concatenate([step.take([0], axis), step], axis)
        after = np.concatenate([step, step.take([-1], axis)], axis)
        across += np.minimum(before, after) ** 2  # the smaller: the larger may be a step
    grazes: Mask = (depth > 0) & (np.sqrt(across) > _GRAZING * depth)
    return grazes


def coincident_parts(obj: ArticulatedObject, q: Array, camera: Camera, rays: Frame, other: Frame) -> Mask:
    """(H, W) pixels at which the two parts that the renderers show lie at the same depth."""
    differ = (rays.part_ids != other.part_ids) & (rays.part_ids != BACKGROUND) & (other.part_ids != BACKGROUND)
    apart = np.full(rays.depth.shape, np.inf)
    posed = pose(obj, q, camera)
    for k in np.unique(other.part_ids[differ]):
        alone = render_posed(posed, only=int(k)).depth
        theirs = differ & (other.part_ids == k) & (alone > 0)
        apart[theirs] = np.abs(alone - rays.depth)[theirs]
    return apart < _COINCIDENT
