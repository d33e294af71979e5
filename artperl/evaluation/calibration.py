"""Confidence of an estimator, fitted to its scores on a validation set."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from typing_extensions import Self

from artperl.core.confidence import Calibration, PartCalibration, Symptoms, logistic
from artperl.evaluation.scoring import Scored

Array = NDArray[np.float64]

_LOOSE = np.array([0.2, 1.0, 0.9, 1.0, 0.3, 0.3])
"""How firmly the bias and the weight of each symptom are held where they were guessed: guesses are rough."""
_LEAST = -0.1
"""Highest weight of what speaks against an estimate, over the size of its guess: what is worse than all that was seen
here is trusted less for it."""


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
    names = [each.name for each in fields(Symptoms)]
    guess = np.array([getattr(default, name) for name in ("bias", *names)])
    features = np.array([[getattr(s.symptoms, name) for name in names] for s in known])
    right = np.array([s.right for s in known], dtype=np.float64)
    count = np.array([1.0] * len(own) + [len(own) / len(others) for _ in others])
    weights = fit_logistic(features, right, count, guess, _LOOSE)
    return Calibration(*weights)


class Calibrated(Protocol):
    """A method with a confidence that is fitted to its scores."""

    def with_confidence(self, calibration: Calibration, part_calibration: PartCalibration) -> Self:
        """The method with another confidence of the whole, and of parts."""
        ...


M = TypeVar("M", bound=Calibrated)


def calibrated(method: M, scored: Sequence[Scored], foreign: Sequence[Scored] = ()) -> M:
    """The method with the confidence, of the whole and of parts, that its scores say."""
    calibration = calibrate(scored, foreign)
    return method.with_confidence(calibration, calibrate_parts(scored, calibration))


def calibrate_parts(scored: Sequence[Scored], calibration: Calibration) -> PartCalibration:
    """Confidence of parts, fitted in the same way: of parts with confidence p, a share p is near a true one.

    Parameters
    ----------
    scored : sequence of Scored
    calibration : Calibration
        Of the whole.
    """
    known = [s for s in scored if len(s.part_right) and np.isfinite(s.symptoms.residual)]
    default = PartCalibration()
    if not known:
        return default
    features = np.concatenate([default.features(calibration.log_odds(s.symptoms), s.part_symptoms) for s in known])
    right = np.concatenate([s.part_right for s in known]).astype(np.float64)
    guess = np.array([getattr(default, each.name) for each in fields(default)])
    weights = fit_logistic(features, right, np.ones(len(right)), guess, np.full(len(guess), 0.1))
    return PartCalibration(*weights)


def fit_logistic(features: Array, right: Array, count: Array, guess: Array, loose: Array) -> list[float]:
    """Bias and weights of a regularised logistic regression whose weights keep the sign of a guess, or are 0.

    Parameters
    ----------
    features : (n, f) float
    right : (n,) float
        0 or 1.
    count : (n,) float
        How often each counts.
    guess : (1 + f,) float
        Bias first; none is 0. It is the mean of the prior.
    loose : (1 + f,) float
        Deviation of the prior, inverted, over the guess.
    """
    known = np.concatenate([np.ones((len(features), 1)), features], axis=1)

    def cost(scaled: Array) -> tuple[float, Array]:
        weights = scaled * np.abs(guess)
        score = known @ weights
        off = scaled - np.sign(guess)
        value = count @ (np.logaddexp(0.0, score) - right * score) + 0.5 * loose**2 @ off**2
        slope = known.T @ (count * (logistic(score) - right)) * np.abs(guess) + loose**2 * off
        return float(value), slope

    bounds = [(None, None), *((0.0, None) if each > 0.0 else (None, _LEAST) for each in guess[1:])]
    scaled = minimize(cost, np.sign(guess), jac=True, bounds=bounds).x
    return [float(each) for each in scaled * np.abs(guess)]
