"""Parts as detections."""

from __future__ import annotations

import numpy as np
import pytest

from artperl.evaluation.part_detection import part_figures, part_line, precision_recall
from artperl.evaluation.samples import frozen_samples
from artperl.evaluation.scoring import evaluate
from artperl.methods.full import Estimator
from artsim.observing.sample import Sample


def test_precision_and_recall_are_those_of_every_threshold() -> None:
    rng = np.random.default_rng(0)
    confidence = rng.integers(0, 20, 300) / 20.0
    right = rng.random(300) < confidence
    precision, recall = precision_recall(confidence, right, 400)
    thresholds = np.unique(confidence)[::-1]
    assert len(precision) == len(thresholds)
    for threshold, p, r in zip(thresholds, precision, recall, strict=True):
        found = confidence >= threshold
        assert p == pytest.approx(right[found].mean())
        assert r == pytest.approx(right[found].sum() / 400)


def test_parts_that_are_merged_or_lost_cost_recall(estimator: Estimator, sample: Sample) -> None:
    """Eyeglasses have three parts, of which an estimator of laptops finds two at most."""
    scored = evaluate(estimator, [sample, *frozen_samples(["eyeglasses"], 1, 1)])
    figures = part_figures(scored)
    assert (figures["true"], figures["estimated"]) == (5, 4)
    assert figures["right"] == sum(int(s.part_right.sum()) for s in scored)
    assert figures["recall"] <= figures["right"] / 5
    assert all((s.part_confidence >= 0.0).all() and (s.part_confidence <= 1.0).all() for s in scored)
    assert "recall at precision 90 %" in part_line(figures)


def test_without_estimates_there_is_no_precision() -> None:
    assert part_figures([])["precision"] is None
    assert part_figures([])["average_precision"] == 0.0
