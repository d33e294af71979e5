"""Axes that parts are round about, as knobs, bottles and wheels are: no method can tell how far these are turned.

The search tries the axes of the rest frame and that of the part's own joint, through the centre of the part's box. So a
part that lies askew and turns about something else does not count as round.
"""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.symmetry import surface_points

_TOLERANCE = 0.03
"""In the part's own diagonals: most points of the turned surface lie that near to the surface. Those of prisms of eight
sides and more do; of six and seven sides, those of thin plates and long bars may."""
_MOST = 0.98
_PROBES = 500
_TURNS = np.deg2rad([25.0, 47.0, 77.0])
"""No prism of five sides and fewer is the same after all three."""
_PARALLEL = np.cos(np.deg2rad(3.0))


def round_axes(obj: ArticulatedObject) -> tuple[Array, ...]:
    """For each part, unit vectors (A, 3) in the rest frame about which its surface is the same however it is turned.

    A is 0 for most parts, 1 for round ones, and more for balls and for parts without a surface.
    """
    return tuple(_of_part(obj, k) for k in range(len(obj)))


def _of_part(obj: ArticulatedObject, k: int) -> Array:
    part = obj.parts[k]
    if len(part.faces) == 0:
        return np.eye(3)
    corners = obj.scale * part.vertices[np.unique(part.faces)]
    bound = _TOLERANCE * float(np.linalg.norm(np.ptp(corners, axis=0)))
    axes = [axis for axis in _candidates(obj.tree.axes[k]) if _as_wide_as_high(corners, axis, 2.0 * bound)]
    if not axes:  # of most parts, whose surfaces take long
        return np.zeros((0, 3))
    points = surface_points(obj, k)
    points = points - 0.5 * (points.min(0) + points.max(0))
    tree = cKDTree(points)

    def same(turn: Array) -> bool:
        away, _ = tree.query(points[:_PROBES] @ Rotation.from_rotvec(turn).as_matrix().T)
        return bool(np.quantile(away, _MOST) <= bound)

    found = [axis for axis in axes if all(same(turn * axis) and same(-turn * axis) for turn in _TURNS)]
    return np.array(found).reshape(-1, 3)


def _candidates(joint_axis: Array) -> list[Array]:
    """Axes of the rest frame, and that of the joint unless it is one of them, or there is none."""
    along = np.abs(joint_axis).max()
    return [*np.eye(3), *([] if along == 0.0 or along > _PARALLEL else [np.asarray(joint_axis)])]


def _as_wide_as_high(corners: Array, axis: Array, tolerance: float) -> bool:
    """Whether points reach equally far in two directions across an axis."""
    one = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    one /= np.linalg.norm(one)
    width, height = (np.ptp(corners @ across) for across in (one, np.cross(axis, one)))
    return bool(abs(width - height) <= tolerance)
