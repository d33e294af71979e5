"""Confidence of an estimator, fitted to its scores on a validation set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from artperl.core.estimate import Calibration
from artperl.evaluation.scoring import Scored

Array = NDArray[np.float64]


def calibrate(scored: Sequence[Scored], foreign: Sequence[Scored] = ()) -> Calibration:
    """Confidence such that, of estimates with confidence p, a share p is right: regularised logistic regression.

    Clouds of other things count as much, all together, as those of the category. Estimates with a part too many or too
    few are wrong ones.

    Weights of the residual and of the disagreement are kept from rising above 0, and that of the visibility from
    falling below, so that nothing that fits badly or hardly shows is ever trusted more for it, however far it lies from
    what was seen here.
    """
    own, others = ([s for s in some if np.isfinite(s.residual)] for some in (scored, foreign))
    known = own + others
    default = Calibration()
    if not known:
        return default
    prior = np.array([default.bias, default.residual, default.disagreement, default.visibility])
    features = np.array([[1.0, s.residual, s.disagreement, s.visibility] for s in known])
    right = np.array([s.right for s in known], dtype=np.float64)
    count = np.array([1.0] * len(own) + [len(own) / len(others) for _ in others])
    loose = np.array([0.1, 0.01, 0.03, 0.1]) ** 2  # precision of the prior

    def cost(scaled: Array) -> tuple[float, Array]:
        weights = scaled * np.abs(prior)
        score = features @ weights
        chance = 1.0 / (1.0 + np.exp(-score.clip(-60.0, 60.0)))
        off = weights - prior
        value = count @ (np.logaddexp(0.0, score) - right * score) + 0.5 * loose @ off**2
        slope = features.T @ (count * (chance - right)) + loose * off
        return float(value), slope * np.abs(prior)

    bounds = [(None, None), (None, -0.1), (None, -0.1), (0.0, None)]
    weights = minimize(cost, np.sign(prior), jac=True, bounds=bounds).x * np.abs(prior)
    return Calibration(*(float(w) for w in weights))
