"""Confidence of an estimator, fitted to its scores on a validation set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from artperl.core.estimate import Calibration, Symptoms
from artperl.evaluation.scoring import Scored

Array = NDArray[np.float64]

_LOOSE = {"residual": 0.01, "disagreement": 0.03, "visibility": 0.1, "doubt": 0.03, "foreign": 0.1}
"""How firmly the weight of each symptom is held where it was guessed: precision of the prior, over that guess."""
_MOST = {"residual": -0.1, "disagreement": -0.1, "doubt": 0.0, "foreign": 0.0}
"""Most that the weight of a symptom may be, over the guess's size."""


def calibrate(scored: Sequence[Scored], foreign: Sequence[Scored] = ()) -> Calibration:
    """Confidence such that, of estimates with confidence p, a share p is right: regularised logistic regression.

    Clouds of other things count as much, all together, as those of the category. Estimates with a part too many or too
    few are wrong ones.

    The weight of the visibility is kept from falling below 0, and the others from rising above, so that nothing that
    fits badly, hardly shows or is full of other things is ever trusted more for it, however far it lies from what was
    seen here.
    """
    own, others = ([s for s in some if np.isfinite(s.symptoms.residual)] for some in (scored, foreign))
    known = own + others
    default = Calibration()
    if not known:
        return default
    names = [field.name for field in fields(Symptoms)]
    prior = np.array([default.bias, *(getattr(default, name) for name in names)])
    features = np.array([[1.0, *(getattr(s.symptoms, name) for name in names)] for s in known])
    right = np.array([s.right for s in known], dtype=np.float64)
    count = np.array([1.0] * len(own) + [len(own) / len(others) for _ in others])
    loose = np.array([0.1, *(_LOOSE[name] for name in names)]) ** 2

    def cost(scaled: Array) -> tuple[float, Array]:
        weights = scaled * np.abs(prior)
        score = features @ weights
        chance = 1.0 / (1.0 + np.exp(-score.clip(-60.0, 60.0)))
        off = weights - prior
        value = count @ (np.logaddexp(0.0, score) - right * score) + 0.5 * loose @ off**2
        slope = features.T @ (count * (chance - right)) + loose * off
        return float(value), slope * np.abs(prior)

    bounds = [
        (None, None),
        *(
            (0.0, None) if default_weight > 0.0 else (None, _MOST[name])
            for name, default_weight in zip(names, prior[1:], strict=True)
        ),
    ]
    weights = minimize(cost, np.sign(prior), jac=True, bounds=bounds).x * np.abs(prior)
    return Calibration(float(weights[0]), **dict(zip(names, weights[1:].tolist(), strict=True)))
