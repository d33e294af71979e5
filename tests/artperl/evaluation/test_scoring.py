"""Errors of estimates, failures, and the score by which the best is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from artperl.evaluation.metrics import METRICS, true_poses
from artperl.evaluation.samples import frozen_samples
from artperl.evaluation.scoring import compare, evaluate, evaluate_foreign, headline, match_share
from artperl.evaluation.tables import summary, table
from artperl.methods.full import Estimator
from artsim.errors import ArtsimError
from artsim.observing.sample import Sample


def test_a_perfect_estimate_has_no_error(estimator: Estimator, sample: Sample) -> None:
    rotation, center = true_poses(sample)
    perfect = replace(
        estimator(sample.points), rotation=rotation, translation=center, size=sample.box_size,
        T_camera_part=sample.T_camera_part, state=sample.joint_state, joint_axis=sample.joint_axis_camera,
        part=sample.part.astype(np.int64),
    )  # fmt: skip
    scored = compare(perfect, sample, 1.0)
    assert scored.errors.keys() == METRICS.keys()
    for name, metric in METRICS.items():
        if name != "iou_omad_legacy":  # the published sampler is below 1 for equal boxes
            np.testing.assert_allclose(scored.errors[name], 0.0 if metric.less_is_better else 1.0, atol=1e-6)
    assert scored.right
    assert scored.parts_found == 1.0
    assert scored.segmentation == 1.0


def test_parts_are_found_whatever_their_numbers_are(estimator: Estimator, sample: Sample) -> None:
    rotation, center = true_poses(sample)
    seen = replace(estimator(sample.points), rotation=rotation, translation=center)
    assert match_share(replace(seen, rotation=rotation[::-1], translation=center[::-1]), sample) == 1.0
    away = center + [[0, 0, 0], [0, 0, 0.06 * sample.diagonal]]
    assert match_share(replace(seen, translation=away), sample) == 0.5
    twice = replace(seen, rotation=rotation[[0, 1, 1, 1]], translation=center[[0, 1, 1, 1]])
    assert match_share(twice, sample) == 0.5  # two parts too many
    assert match_share(replace(seen, rotation=rotation[:1], translation=center[:1]), sample) == 0.5


def test_failures_count_with_the_worst_values(sample: Sample) -> None:
    class Blind(Estimator):
        def __call__(self, points: object) -> None:  # type: ignore[override]
            raise ArtsimError("nothing is seen")

    blind = Blind.__new__(Blind)
    (scored,) = evaluate(blind, [sample])
    assert scored.failed
    assert (scored.rotation == 180.0).all()
    np.testing.assert_allclose(scored.errors["joint_state"], [0.0, np.rad2deg(np.ptp(sample.joint_limits[1]))])
    assert scored.errors["joint_axis_deg"].tolist() == [0.0, 90.0]
    figures = summary([scored])
    assert figures["laptop"]["failures"] == 1
    assert "1 failures" in table(figures)
    assert headline([scored]) == 10.0


def test_views_count_alike_in_the_score_however_many_parts_they_have(estimator: Estimator, sample: Sample) -> None:
    (scored,) = evaluate(estimator, [sample])
    two, four = (
        replace(scored, errors={"rotation_deg": np.full(n, n / 2), "translation_percent_diagonal": np.full(n, n / 2)})
        for n in (2, 4)
    )
    assert headline([two] * 3 + [four]) == pytest.approx((1.0 + 1.25) / 2)  # median and mean of 1, 1, 1, 2


def test_whatever_is_said_of_another_category_is_wrong(estimator: Estimator) -> None:
    (scored,) = evaluate_foreign(estimator, frozen_samples(["bucket"], 1, 1))
    assert not scored.right
    assert np.isfinite([scored.residual, scored.disagreement]).all()
