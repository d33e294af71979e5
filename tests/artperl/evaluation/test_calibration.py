"""Confidence is calibrated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from artperl.core.confidence import Calibration, Symptoms
from artperl.evaluation.calibration import calibrate
from artperl.evaluation.samples import frozen_samples
from artperl.evaluation.scoring import Scored, evaluate
from artperl.methods.full import Estimator
from artsim.observing.sample import Sample


def _off(scored: Scored, degrees: float) -> Scored:
    """The same with a rotation error of every part."""
    return replace(scored, errors=scored.errors | {"rotation_deg": np.full(len(scored.rotation), degrees)})


def test_confidence_is_calibrated(estimator: Estimator, sample: Sample) -> None:
    """Where half of the estimates with a residual are right, confidence says so; and it never rises with it."""
    one: Scored = evaluate(estimator, [sample])[0]
    rng = np.random.default_rng(0)
    residual = rng.uniform(0.0, 0.1, 2000)
    chance = 1.0 / (1.0 + np.exp(80.0 * (residual - 0.05)))
    right = rng.random(2000) < chance
    scored = [
        replace(_off(one, 1.0 if ok else 90.0), symptoms=Symptoms(r, 0.02, 0.5, 0.01))
        for r, ok in zip(residual, right, strict=True)
    ]
    fitted = calibrate(scored)
    found = np.array([fitted(Symptoms(r, 0.02, 0.5, 0.01)) for r in residual])
    assert np.abs(found - chance).mean() < 0.05
    assert fitted(Symptoms(0.3, 0.3, 0.5, 0.01)) < 0.01
    assert calibrate([]) == Calibration()


@pytest.mark.parametrize("better", [True, False])
def test_confidence_takes_notice_of_what_does_not_show(estimator: Estimator, sample: Sample, better: bool) -> None:
    """Where estimates of what hardly shows are wrong more often, it says by how much; it never trusts them more."""
    one: Scored = evaluate(estimator, [sample])[0]
    rng = np.random.default_rng(0)
    shows = rng.uniform(0.0, 1.0, 2000)
    chance = 1.0 / (1.0 + np.exp((-1.0 if better else 1.0) * 12.0 * (shows - 0.3)))
    right = rng.random(2000) < chance
    fitted = calibrate([
        replace(_off(one, 1.0 if ok else 90.0), symptoms=Symptoms(0.004, 0.02, v, 0.01))
        for v, ok in zip(shows, right, strict=True)
    ])  # fmt: skip
    found = np.array([fitted(Symptoms(0.004, 0.02, v, 0.01)) for v in np.linspace(0.0, 1.0, 11)])
    assert (np.diff(found) >= 0.0).all()
    if better:
        assert np.abs(np.array([fitted(Symptoms(0.004, 0.02, v, 0.01)) for v in shows]) - chance).mean() < 0.05
    else:
        assert np.ptp(found) < 1e-3


def test_estimates_with_other_parts_are_wrong_whatever_they_fit(estimator: Estimator, sample: Sample) -> None:
    (other,) = evaluate(estimator, frozen_samples(["eyeglasses"], 1, 1))
    assert other.failed
    assert np.isfinite([other.symptoms.residual, other.symptoms.disagreement]).all()
    right = [replace(evaluate(estimator, [sample])[0], symptoms=other.symptoms)]
    among = calibrate(20 * right + 20 * [other])
    assert among(other.symptoms) == pytest.approx(0.5, abs=0.02)
    assert calibrate(20 * right)(other.symptoms) > 0.9


@pytest.mark.parametrize("name", ["expected_error", "outlier_share"])
def test_confidence_takes_notice_of_doubt_and_of_other_things(estimator: Estimator, sample: Sample, name: str) -> None:
    """Where estimates with more of it are wrong more often, it says by how much."""
    one: Scored = evaluate(estimator, [sample])[0]
    rng = np.random.default_rng(0)
    values = rng.uniform(0.0, 0.5, 2000)
    chance = 1.0 / (1.0 + np.exp(20.0 * (values - 0.2)))
    told = [replace(Symptoms(0.004, 0.02, 0.5, 0.01), **{name: v}) for v in values]
    scored = [
        replace(_off(one, 1.0 if ok else 90.0), symptoms=symptoms)
        for symptoms, ok in zip(told, rng.random(2000) < chance, strict=True)
    ]
    fitted = calibrate(scored)
    assert np.abs(np.array([fitted(symptoms) for symptoms in told]) - chance).mean() < 0.05
