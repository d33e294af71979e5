"""Axes that parts are round about, as knobs, bottles and wheels are: no method can tell how far these are turned.

The search tries the axes of the rest frame and that of the part's own joint, through the centre of the part's box. So a
part that lies askew and turns about something else does not count as round.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.symmetry import surface_points

_TOLERANCE = 0.03
"""In the part's own diagonals: most points of the turned surface lie that near to the surface, as those of a prism of
eight sides and more do."""
_MOST = 0.98
_PROBES = 500
_TURNS = np.deg2rad([25.0, 47.0, 77.0])
"""No prism of fewer sides is the same after all three."""
_PARALLEL = np.cos(np.deg2rad(3.0))


def round_axes(obj: ArticulatedObject) -> tuple[Array, ...]:
    """For each part, unit vectors (A, 3) in the rest frame about which its surface is the same however it is turned.

    A is 0 for most parts, 1 for round ones, and more for balls and for parts without a surface.
    """
    return tuple(_of_part(surface_points(obj, k), np.asarray(obj.tree.axes[k])) for k in range(len(obj)))


def _of_part(points: Array, joint_axis: Array) -> Array:
    if len(points) == 0:
        return np.eye(3)
    low, high = points.min(0), points.max(0)
    points = points - 0.5 * (low + high)
    bound, tree = _TOLERANCE * float(np.linalg.norm(high - low)), cKDTree(points)

    def same(turn: Array) -> bool:
        away, _ = tree.query(points[:_PROBES] @ Rotation.from_rotvec(turn).as_matrix().T)
        return bool(np.quantile(away, _MOST) <= bound)

    found: list[Array] = []
    for axis in (*np.eye(3), joint_axis):
        known = any(abs(axis @ other) > _PARALLEL for other in found)
        if not known and axis.any() and all(same(turn * axis) and same(-turn * axis) for turn in _TURNS):
            found.append(axis)
    return np.array(found).reshape(-1, 3)
