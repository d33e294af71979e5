"""How sure an estimate is, of the whole object and of each part, by what it says about itself."""

from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LIKELY = 0.5
"""Confidence from which an estimate is worth showing: it is the probability of being right, so that most of the others
are wrong."""


@dataclass(frozen=True)
class Symptoms:
    """What an estimate says about itself, by which confidence judges it."""

    residual: float = np.inf
    disagreement: float = np.inf
    visibility: float = 0.0
    """Of the part that shows least; the better, the higher."""
    expected_error: float = np.inf
    outlier_share: float = 0.0
    """As in :class:`artperl.core.estimate.Estimate`; the worse, the higher."""


@dataclass(frozen=True, eq=False)
class PartSymptoms:
    """What an estimate says about each of its K parts."""

    disagreement: Array = field(default_factory=lambda: np.zeros(0))
    """(K,) float. Median distance between where perception and the fit place the part's points in the rest frame, in
    diagonals; of the method artperl, between where the two best ends do."""
    expected_error: Array = field(default_factory=lambda: np.zeros(0))
    """(K,) float. Median error that perception expects of these places, in diagonals; of the method artperl, median
    probability that their label is wrong."""
    certainty: Array = field(default_factory=lambda: np.zeros(0))
    """(K,) float. Mean probability, by perception, that the part's points are of it."""
    visibility: Array = field(default_factory=lambda: np.zeros(0))
    """(K,) float. Share of the part's surface that is seen."""
    points: Array = field(default_factory=lambda: np.zeros(0))
    """(K,) float. Root of the share of the cloud's points that are of the part."""

    @property
    def table(self) -> Array:
        """(K, 5) in the order of the fields."""
        return np.stack([getattr(self, each.name) for each in fields(self)], axis=1)


def logistic(score: Array) -> Array:
    """Probability of log-odds."""
    chance: Array = 1.0 / (1.0 + np.exp(-np.clip(score, -60.0, 60.0)))
    return chance


@dataclass(frozen=True)
class Calibration:
    """Confidence as a logistic function of :class:`Symptoms`.

    The defaults are guesses; :func:`artperl.evaluation.calibration.calibrate` fits them to a validation set.
    """

    bias: float = 2.0
    residual: float = -100.0
    disagreement: float = -30.0
    visibility: float = 10.0
    """What shows of other parts fits as well where the part that shows least is wrong."""
    expected_error: float = -10.0
    outlier_share: float = -3.0

    def log_odds(self, symptoms: Symptoms) -> float:
        """Log-odds of being right."""
        return float(self.bias + sum(getattr(self, name) * value for name, value in vars(symptoms).items()))

    def __call__(self, symptoms: Symptoms) -> float:
        return float(logistic(np.array(self.log_odds(symptoms))))


@dataclass(frozen=True)
class PartCalibration:
    """Confidence of each part as a logistic function of :class:`PartSymptoms` and of the confidence of the whole.

    The defaults are guesses; :func:`artperl.evaluation.part_calibration.calibrate_parts` fits them to a validation set.
    """

    bias: float = -2.0
    whole: float = 0.5
    """Of the log-odds that the whole is right, clipped: one wrong part says little of the others."""
    disagreement: float = -20.0
    expected_error: float = -10.0
    certainty: float = 3.0
    visibility: float = 2.0
    points: float = 1.0

    def features(self, whole: float, symptoms: PartSymptoms) -> Array:
        """(K, 6) what the weights, after the bias, are of."""
        odds = np.full((len(symptoms.points), 1), np.clip(whole, -_CLIPPED, _CLIPPED))
        return np.concatenate([odds, symptoms.table], axis=1)

    def __call__(self, whole: float, symptoms: PartSymptoms) -> Array:
        """(K,) confidences.

        Parameters
        ----------
        whole : float
            Log-odds of the whole.
        symptoms : PartSymptoms
        """
        weights = np.array([getattr(self, each.name) for each in fields(self)])
        return logistic(weights[0] + self.features(whole, symptoms) @ weights[1:])


_CLIPPED = 6.0
