"""An estimate of parts that were posed one by one: what joints say of them is worked out from their poses."""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from artperl.core.confidence import Calibration, Symptoms
from artperl.core.estimate import Estimate
from artperl.core.rotations import nearest_angle

Array = NDArray[np.float64]


def estimate_of_parts(
    kinds: Sequence[str], parents: NDArray[np.int64], rest: Array, limits: Array, rotation: Array, center: Array,
    size: Array, rest_center: Array, rest_axis: Array, rest_origin: Array, part: NDArray[np.int64], residual: float,
    visibility: Array,
) -> Estimate:  # fmt: skip
    """The estimate of K parts by their 9D poses. Lengths are in metres.

    States are those nearest to the poses: the angle about the axis that the parts are turned by against each other,
    or the way along it between their box centres.

    Parameters
    ----------
    kinds : sequence of str, length K
    parents : (K,) int64
        -1 for the root; parents before children.
    rest : (K,) float
        States at rest.
    limits : (K, 2) float
    rotation, center, size : (K, 3, 3), (K, 3), (K, 3) float
        9D poses, camera frame.
    rest_center, rest_axis, rest_origin : (K, 3) float
        Box centres and joints in the rest frame.
    part : (N,) int64
        Of each given point.
    residual : float
        In diagonals.
    visibility : (K,) float
    """
    K = len(kinds)
    T = np.tile(np.eye(4), (K, 1, 1))
    T[:, :3, :3], T[:, :3, 3] = rotation, center - np.einsum("kij,kj->ki", rotation, rest_center)
    above = np.maximum(parents, 0)
    state = np.zeros(K)
    for k in range(1, K):
        parent = T[above[k]]
        if kinds[k] == "prismatic":
            away = parent[:3, :3].T @ (center[k] - parent[:3, 3]) - rest_center[k]
            state[k] = rest[k] + away @ rest_axis[k]
        else:
            turned = torch.from_numpy(parent[:3, :3].T @ rotation[k])
            state[k] = rest[k] + float(nearest_angle(turned, torch.from_numpy(np.ascontiguousarray(rest_axis[k]))))
    symptoms = Symptoms(residual, 0.0, float(visibility.min()), 0.0)
    return Estimate(
        rotation=rotation, translation=center, size=size, T_camera_part=T, state=state, joint_type=tuple(kinds),
        joint_parent=parents, joint_axis=np.einsum("kij,kj->ki", T[above, :3, :3], rest_axis),
        joint_origin=np.einsum("kij,kj->ki", T[above, :3, :3], rest_origin) + T[above, :3, 3], part=part,
        visibility=visibility, trajectory=T[None], residual=residual, disagreement=0.0,
        confidence=Calibration()(symptoms), joint_limits=limits,
    )  # fmt: skip
