"""Rotations of parts that obey their joints: the kinematic optimisation of A-NCSH (Li et al. 2020, section 4.3).

Each part has paired points of its own. A hinge carries its axis to the same vector by both of its parts; the parts of a
slide are turned alike. All joints of an object are optimised together, by Levenberg and Marquardt over one rotation
vector for each part.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

_MOST = 200
"""Evaluations, far more than converge."""
_PAIRS = 96
"""Pairs of each part that are optimised over."""


def couple_rotations(
    source: Sequence[Array], target: Sequence[Array], scale: Array, rotation: Array, kinds: Sequence[str],
    parents: NDArray[np.int64], axis: Array, weight: float = 1.0,
) -> Array:  # fmt: skip
    """Rotations (K, 3, 3) of least squared error of the pairs and of the joints.

    The best translation of a part, given its rotation, joins the means of its pairs, so that only rotations are looked
    for.

    Parameters
    ----------
    source, target : sequence of (N_k, 3) float, length K
        Pairs that agree; none where a part is not seen.
    scale : (K,) float
        From source to target.
    rotation : (K, 3, 3) float
        Where to begin.
    kinds : sequence of str, length K
        "free" for the root.
    parents : (K,) int64
    axis : (K, 3) float
        Of the joints, in the frame that rotations are from.
    weight : float
        Of a joint's residual, against the root of the mean squared error of a part over its spread.
    """
    K = len(kinds)
    local, aim = [], []
    for points, others, factor in zip(source, target, scale, strict=True):
        few = np.linspace(0, len(points) - 1, min(_PAIRS, len(points))).astype(int)
        spread = max(float(others.std()), 1e-12) * np.sqrt(max(len(few), 1)) if len(few) else 1.0
        local.append(factor * (points[few] - points[few].mean(axis=0)) / spread if len(few) else points[few])
        aim.append((others[few] - others[few].mean(axis=0)) / spread if len(few) else others[few])

    def residuals(turns: Array) -> Array:
        turned = Rotation.from_rotvec(turns.reshape(K, 3)).as_matrix() @ rotation
        rows = [(own @ R.T - other).ravel() for own, other, R in zip(local, aim, turned, strict=True)]
        for k in range(1, K):
            above, below = turned[parents[k]], turned[k]
            apart = above - below if kinds[k] == "prismatic" else (above - below) @ axis[k]
            rows.append(weight * apart.ravel())
        return np.concatenate(rows)

    start = residuals(np.zeros(3 * K))
    method = "lm" if len(start) >= 3 * K else "trf"  # MINPACK wants as many residuals as unknowns
    found = least_squares(residuals, np.zeros(3 * K), method=method, max_nfev=_MOST * (3 * K + 1))
    result: Array = Rotation.from_rotvec(found.x.reshape(K, 3)).as_matrix() @ rotation
    return result
