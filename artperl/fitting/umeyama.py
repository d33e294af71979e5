"""Similarities between paired points: in closed form (Umeyama 1991), and by RANSAC where some pairs are wrong."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_PAIRS = 3
"""Pairs that a hypothesis is made of: the fewest that tell a similarity."""
_SCORED = 128
"""Pairs that hypotheses are compared on; more of them change hardly any choice."""


@dataclass(frozen=True, eq=False)
class Similarity:
    """``target = scale * rotation @ source + translation``, of any leading dimensions."""

    scale: Array
    """(...) float."""
    rotation: Array
    """(..., 3, 3) float."""
    translation: Array
    """(..., 3) float."""

    def __call__(self, points: Array) -> Array:
        """(..., N, 3) where points (..., N, 3) go."""
        turned: Array = self.scale[..., None, None] * points @ np.swapaxes(self.rotation, -1, -2)
        return turned + self.translation[..., None, :]


def umeyama(source: Array, target: Array) -> Similarity:
    """The similarity of least squared error (Umeyama 1991, equations 40 to 43).

    Parameters
    ----------
    source, target : (..., N, 3) float
        Paired; at least three pairs that are not on a line.
    """
    source_mean, target_mean = source.mean(axis=-2), target.mean(axis=-2)
    local, aim = source - source_mean[..., None, :], target - target_mean[..., None, :]
    covariance = np.swapaxes(aim, -1, -2) @ local / source.shape[-2]
    U, D, Vt = np.linalg.svd(covariance)
    sign = np.ones_like(D)
    sign[..., 2] = np.where(np.linalg.det(U) * np.linalg.det(Vt) < 0.0, -1.0, 1.0)  # no reflection
    rotation = (U * sign[..., None, :]) @ Vt
    variance = (local**2).sum(axis=-1).mean(axis=-1)
    scale = (D * sign).sum(axis=-1) / np.maximum(variance, 1e-18)
    translation = target_mean - scale[..., None] * (rotation @ source_mean[..., None])[..., 0]
    return Similarity(scale, rotation, translation)


def ransac_umeyama(
    source: Array, target: Array, rng: np.random.Generator, iterations: int = 1000, inlier: float = 0.1
) -> tuple[Similarity, NDArray[np.bool_]]:
    """The similarity that most pairs agree with, fitted to all of these.

    A hypothesis of three pairs costs the squared distances of the others, each cut at the bound of inliers (MSAC).

    Parameters
    ----------
    source, target : (N, 3) float
        Paired, at least three.
    rng : numpy.random.Generator
    iterations : int
        Hypotheses.
    inlier : float
        Bound of distances, in units of the source.

    Returns
    -------
    Similarity
    (N,) bool
        The pairs that agree.
    """
    N = len(source)
    spread = np.sqrt(((target - target.mean(axis=0)) ** 2).sum(axis=1).mean())
    within = inlier * spread / max(np.sqrt(((source - source.mean(axis=0)) ** 2).sum(axis=1).mean()), 1e-12)
    chosen = rng.random((iterations, N)).argpartition(_PAIRS - 1, axis=1)[:, :_PAIRS] if N <= _SCORED else (
        rng.integers(N, size=(iterations, _PAIRS))
    )  # fmt: skip
    hypotheses = umeyama(source[chosen], target[chosen])
    judged = rng.permutation(N)[:_SCORED]
    cost = np.minimum(((hypotheses(source[judged]) - target[judged]) ** 2).sum(axis=2), within**2).sum(axis=1)
    best = int(cost.argmin())
    found = Similarity(hypotheses.scale[best], hypotheses.rotation[best], hypotheses.translation[best])
    for _ in range(2):  # a fit to the pairs that agree brings in a few more
        agree = ((found(source) - target) ** 2).sum(axis=1) < within**2
        if agree.sum() < _PAIRS:
            break
        found = umeyama(source[agree], target[agree])
    agree = ((found(source) - target) ** 2).sum(axis=1) < within**2
    return found, agree
