"""Poses of parts that no point shows, by their parents, their joints and what is usual in the category."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artperl.core.category_prior import CategoryPrior

Array = NDArray[np.float64]


def turn_inferred(start: Array, seen: NDArray[np.bool_], prior: CategoryPrior, axis: Array) -> Array:
    """Rotations (K, 3, 3) where each part that is not seen (K,) is half-way between the limits of its joint (K, 3)."""
    start = start.copy()
    for k in range(1, len(prior)):
        if not seen[k]:
            start[k] = start[prior.parents[k]] @ _typical_turn(prior, axis, k)
    return start


def _typical_turn(prior: CategoryPrior, axis: Array, k: int) -> Array:
    """(3, 3) of part k against its parent, half-way between its limits."""
    angle = 0.0 if prior.kinds[k] == "prismatic" else prior.typical_state[k] - prior.rest[k]
    turn: Array = Rotation.from_rotvec(angle * axis[k]).as_matrix()
    return turn


def place_inferred(
    center: Array, rotation: Array, seen: NDArray[np.bool_], prior: CategoryPrior, rest_center: Array, axis: Array,
    origin: Array,
) -> Array:  # fmt: skip
    """Box centres (K, 3), camera frame, where those of parts that are not seen follow from their parents and joints.

    Parameters
    ----------
    center : (K, 3) float
        Of parts that are seen.
    rotation : (K, 3, 3) float
        As :func:`turn_inferred` gives it.
    seen : (K,) bool
    prior : CategoryPrior
    rest_center : (K, 3) float
        Box centres in the rest frame, metres.
    axis, origin : (K, 3) float
        Joints in the rest frame, metres; an axis is as long as the object's diagonal.
    """
    center = center.copy()
    if not seen[0] and seen.any():  # a root that is not seen is where its first seen child has it at rest
        k = int(np.flatnonzero(seen)[0])
        center[0] = center[k] + rotation[0] @ (rest_center[0] - rest_center[k])
    for k in range(1, len(prior)):
        if not seen[k]:
            above = prior.parents[k]
            offset = center[above] - rotation[above] @ rest_center[above]
            if prior.kinds[k] == "prismatic":
                slid = rest_center[k] + (prior.typical_state[k] - prior.rest[k]) * axis[k]
                center[k] = offset + rotation[above] @ slid
            else:
                pivot = offset + rotation[above] @ origin[k]
                center[k] = pivot + rotation[k] @ (rest_center[k] - origin[k])
    return center
