"""Figures of an estimator: errors, failures, confidence, tables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from artperl.core.estimate import Calibration
from artperl.evaluation.scoring import (
    Scored,
    calibrate,
    compare,
    evaluate,
    found,
    frozen_samples,
    headline,
    mistake,
    retry_residual,
    summary,
    table,
    true_poses,
)
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
    for name, value in {
        "rotation": 0.0,
        "translation": 0.0,
        "iou_exact": 1.0,
        "iou_rest_exact": 1.0,
        "state": 0.0,
    }.items():
        np.testing.assert_allclose(getattr(scored, name), value, atol=1e-6)
    assert scored.right
    assert scored.found == 1.0
    assert scored.segmentation == 1.0


def test_parts_are_found_whatever_their_numbers_are(estimator: Estimator, sample: Sample) -> None:
    rotation, center = true_poses(sample)
    seen = replace(estimator(sample.points), rotation=rotation, translation=center)
    assert found(replace(seen, rotation=rotation[::-1], translation=center[::-1]), sample) == 1.0
    away = center + [[0, 0, 0], [0, 0, 0.06 * sample.diagonal]]
    assert found(replace(seen, translation=away), sample) == 0.5
    twice = replace(seen, rotation=rotation[[0, 1, 1, 1]], translation=center[[0, 1, 1, 1]])
    assert found(twice, sample) == 0.5  # two parts too many
    assert found(replace(seen, rotation=rotation[:1], translation=center[:1]), sample) == 0.5


def test_failures_count_with_the_worst_values(sample: Sample) -> None:
    class Blind(Estimator):
        def __call__(self, points: object) -> None:  # type: ignore[override]
            raise ArtsimError("nothing is seen")

    blind = Blind.__new__(Blind)
    (scored,) = evaluate(blind, [sample])
    assert scored.failed
    assert (scored.rotation == 180.0).all()
    figures = summary([scored])
    assert figures["laptop"]["failures"] == 1
    assert "1 failures" in table(figures)
    assert headline([scored]) == 10.0


def test_views_count_alike_in_the_score_however_many_parts_they_have(estimator: Estimator, sample: Sample) -> None:
    (scored,) = evaluate(estimator, [sample])
    two, four = (replace(scored, rotation=np.full(n, n / 2), translation=np.full(n, n / 200)) for n in (2, 4))
    assert headline([two] * 3 + [four]) == pytest.approx((1.0 + 1.25) / 2)  # median and mean of 1, 1, 1, 2


def test_the_table_holds_medians_and_means(estimator: Estimator, sample: Sample) -> None:
    one = evaluate(estimator, [sample])[0]
    scored = [replace(one, rotation=np.array([r, 2.0 * r])) for r in (1.0, 2.0, 6.0)]
    parts = summary(scored)["laptop"]["parts"]
    assert parts[0]["rotation_deg"] == {"median": 2.0, "mean": 3.0}
    assert parts[1]["rotation_deg"] == {"median": 4.0, "mean": 6.0}
    translation = parts[0]["translation_percent_diagonal"]["median"]
    assert parts[0]["translation_partnet"]["median"] == pytest.approx(0.02 * translation)
    assert f"{'laptop 1':14s}     4.00   6.00" in table(summary(scored))


def test_a_quarter_is_looked_for_again(estimator: Estimator, sample: Sample) -> None:
    one = evaluate(estimator, [sample])[0]
    scored = [replace(one, residual=r) for r in np.linspace(0.0, 0.1, 101)] + [replace(one, residual=np.inf)]
    assert retry_residual(scored) == pytest.approx(0.075)
    assert retry_residual([]) == 0.0


def test_confidence_is_calibrated(estimator: Estimator, sample: Sample) -> None:
    """Where half of the estimates with a residual are right, confidence says so; and it never rises with it."""
    one: Scored = evaluate(estimator, [sample])[0]
    rng = np.random.default_rng(0)
    residual = rng.uniform(0.0, 0.1, 2000)
    chance = 1.0 / (1.0 + np.exp(80.0 * (residual - 0.05)))
    right = rng.random(2000) < chance
    scored = [
        replace(one, residual=r, disagreement=0.02, visibility=0.5, rotation=np.full(2, 1.0 if ok else 90.0))
        for r, ok in zip(residual, right, strict=True)
    ]
    fitted = calibrate(scored)
    found = np.array([fitted(r, 0.02, 0.5) for r in residual])
    assert np.abs(found - chance).mean() < 0.05
    assert fitted(0.3, 0.3, 0.5) < 0.01
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
        replace(one, residual=0.004, disagreement=0.02, visibility=v, rotation=np.full(2, 1.0 if ok else 90.0))
        for v, ok in zip(shows, right, strict=True)
    ])  # fmt: skip
    found = np.array([fitted(0.004, 0.02, v) for v in np.linspace(0.0, 1.0, 11)])
    assert (np.diff(found) >= 0.0).all()
    if better:
        assert np.abs(np.array([fitted(0.004, 0.02, v) for v in shows]) - chance).mean() < 0.05
    else:
        assert np.ptp(found) < 1e-3


def test_a_summary_says_what_confidence_is_worth(estimator: Estimator, sample: Sample) -> None:
    right, wrong = (
        replace(
            evaluate(estimator, [sample])[0], rotation=np.full(2, degrees), translation=np.zeros(2), confidence=sure
        )
        for degrees, sure in ((1.0, 0.9), (90.0, 0.2))
    )
    told = summary([right, right, wrong])["laptop"]
    assert (told["confidence_of_right"], told["confidence_of_wrong"], told["confidence_auroc"]) == (0.9, 0.2, 1.0)
    assert "AUROC 1.00" in table({"laptop": told})
    told = summary([right])["laptop"]
    assert (told["confidence_of_wrong"], told["confidence_auroc"]) == (None, None)
    assert "AUROC" not in table({"laptop": told})


def test_estimates_with_other_parts_are_wrong_whatever_they_fit(estimator: Estimator, sample: Sample) -> None:
    (other,) = evaluate(estimator, frozen_samples(["eyeglasses"], 1, 1))
    assert other.failed
    assert np.isfinite([other.residual, other.disagreement]).all()
    told = {name: getattr(other, name) for name in ("residual", "disagreement", "visibility")}
    right = [replace(evaluate(estimator, [sample])[0], **told)]
    among = calibrate(20 * right + 20 * [other])
    assert among(**told) == pytest.approx(0.5, abs=0.02)
    assert calibrate(20 * right)(**told) > 0.9


def test_whatever_is_said_of_another_category_is_wrong(estimator: Estimator) -> None:
    (scored,) = mistake(estimator, frozen_samples(["bucket"], 1, 1))
    assert not scored.right
    assert np.isfinite([scored.residual, scored.disagreement]).all()


def test_frozen_samples_are_always_the_same() -> None:
    one, other = (frozen_samples(["laptop"], 2, 2) for _ in range(2))
    assert all(np.array_equal(a.points, b.points) for a, b in zip(one, other, strict=True))
    assert len({s.object_id for s in one}) == 2
    assert len(one) == 4
