"""Summaries and tables of scores, and published figures beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from artperl.evaluation.metrics import METRICS
from artperl.evaluation.published import ARTIMAGE_PUBLISHED
from artperl.evaluation.scoring import evaluate
from artperl.evaluation.tables import against_published, summary, table
from artperl.methods.full import Estimator
from artsim.observing.sample import Sample


def test_the_table_holds_medians_and_means(estimator: Estimator, sample: Sample) -> None:
    one = evaluate(estimator, [sample])[0]
    scored = [replace(one, errors=one.errors | {"rotation_deg": np.array([r, 2.0 * r])}) for r in (1.0, 2.0, 6.0)]
    parts = summary(scored)["laptop"]["parts"]
    assert parts[0]["rotation_deg"] == {"median": 2.0, "mean": 3.0}
    assert parts[1]["rotation_deg"] == {"median": 4.0, "mean": 6.0}
    translation = parts[0]["translation_percent_diagonal"]["median"]
    assert parts[0]["translation_partnet"]["median"] == pytest.approx(0.02 * translation)
    assert f"{'laptop lid':14s}     4.00   6.00" in table(summary(scored))


def test_a_summary_says_what_confidence_is_worth(estimator: Estimator, sample: Sample) -> None:
    (one,) = evaluate(estimator, [sample])
    placed = one.errors | {"translation_percent_diagonal": np.zeros(2)}
    right, wrong = (
        replace(one, errors=placed | {"rotation_deg": np.full(2, degrees)}, confidence=sure)
        for degrees, sure in ((1.0, 0.9), (90.0, 0.2))
    )
    told = summary([right, right, wrong])["laptop"]
    assert (told["confidence_of_right"], told["confidence_of_wrong"], told["confidence_auroc"]) == (0.9, 0.2, 1.0)
    assert (
        "confidence of right ones 90 %, of wrong ones 20 % in the median, AUROC 1.00, expected calibration error 13 %"
        in table({"laptop": told})
    )
    told = summary([right])["laptop"]
    assert (told["confidence_of_wrong"], told["confidence_auroc"]) == (None, None)
    assert table({"laptop": told}).count("confidence of right ones 90 % in the median, AUROC -, expected") == 1
    assert "confidence of wrong ones 20 % in the median, AUROC -, expected" in table(summary([wrong]))


def test_published_means_are_beaten_or_not() -> None:
    def figures(share: float) -> dict[str, object]:
        published = ARTIMAGE_PUBLISHED["scissors"]["artperl"]
        means = [
            {"rotation_deg": share * r, "translation_partnet": share * t, "iou_omad_legacy": i / share}
            for r, t, i in zip(published.rotation, published.translation, published.iou, strict=True)
        ]
        return {"parts": [{name: {"mean": value} for name, value in part.items()} for part in means]}

    assert against_published("scissors", figures(0.9)).count("better") == 3
    assert "not" not in against_published("scissors", figures(0.9))
    assert against_published("scissors", figures(1.1)).count("not better for part [0, 1]") == 3


def test_a_metric_that_does_not_apply_is_left_out(estimator: Estimator, sample: Sample) -> None:
    """Only categories of ArtImage have a diagonal in PartNet's units."""
    figures = summary(evaluate(estimator, [replace(sample, category="bucket")]))["bucket"]
    assert figures["parts"][0].keys() == METRICS.keys() - {"translation_partnet"}
    assert "bucket base" in table({"bucket": figures})
