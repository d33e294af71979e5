"""How sure the paper's method is: its symptoms say what is wrong, and its training calibrates what they are worth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import torch

import artsim
from artperl.agent.start import MeanView
from artperl.core.confidence import Calibration, PartCalibration
from artperl.methods.artperl import ArtPERL
from artperl.methods.estimator_files import load_estimator
from artperl.methods.estimator_writing import save_estimator
from artperl.methods.retrieved import Sizes
from artperl.retrieval.shape_base import ShapeBase
from artperl.retrieval.siamese import by_siamese
from artperl.training.options import PAPER_PRESETS
from artperl.training.run import Training
from artperl.training.validation import Calibration as CalibrationStage
from artperl.training.validation import Validation
from tests.artperl.worlds import made


@pytest.fixture(scope="module")
def method() -> ArtPERL:
    torch.manual_seed(0)
    networks = ArtPERL.new_networks(Sizes(2, segmentation=16, siamese=8, policy=16))
    base = by_siamese(ShapeBase.of([artsim.make("laptop", 3)], 96), networks["siamese"].eval())
    return ArtPERL(**networks, base=base)


def starting(method: ArtPERL, *azimuths: float) -> ArtPERL:
    """The method with starts seen from these sides."""
    options = replace(method.options, starts=tuple(map(MeanView, azimuths)))
    return ArtPERL(**method.networks(), base=method.base, options=options)  # type: ignore[arg-type]


def test_ends_disagree_as_far_as_they_are_apart(method: ArtPERL) -> None:
    points = made("laptop", 7).points
    assert starting(method, 0.0)(points).disagreement == 0.0
    assert starting(method, 0.0, 0.0)(points).disagreement == 0.0
    assert starting(method, 0.0, 180.0)(points).disagreement > 0.1  # a laptop and its back


def test_labels_are_in_doubt_as_far_as_they_are_unsure(method: ArtPERL) -> None:
    points, last = made("laptop", 7).points, method.segmentation.mlp[-1]
    weight, bias = last.weight.detach().clone(), last.bias.detach().clone()
    try:
        for factor, least, most in ((0.0, 0.49, 0.51), (1e4, 0.0, 0.01)):
            with torch.no_grad():
                last.weight.copy_(factor * weight)
                last.bias.copy_(factor * bias)
            assert least <= method(points).expected_error <= most
    finally:
        with torch.no_grad():
            last.weight.copy_(weight)
            last.bias.copy_(bias)


def test_confidence_is_that_of_the_calibration_on_disk(method: ArtPERL, tmp_path: Path) -> None:
    sure = method.with_confidence(Calibration(0.5, -2.0, -3.0, 4.0, -5.0, -6.0), PartCalibration(-1.0, points=2.0))
    save_estimator(sure, tmp_path, {})
    loaded = load_estimator(tmp_path, method="artperl").to("cpu")
    assert loaded.options == sure.options
    estimate = loaded(made("laptop", 7).points)
    assert estimate.confidence == sure.options.calibration(estimate.symptoms)
    odds = sure.options.calibration.log_odds(estimate.symptoms)
    assert (estimate.part_confidence == sure.options.part_calibration(odds, estimate.part_symptoms)).all()
    assert method.options.calibration == Calibration()


@pytest.mark.slow
def test_a_training_calibrates_what_it_ends_with(tmp_path: Path) -> None:
    options = replace(
        PAPER_PRESETS["quick"], base_objects=3, reference_points=48, width=16, test_objects=2, validation_views=1,
        foreign_categories=1,
    )  # fmt: skip
    context = Training(options, tmp_path, workers=0, progress=False).context
    Validation().run(context)
    before = load_estimator(tmp_path / "best", method="artperl")
    CalibrationStage().run(context)
    after = load_estimator(tmp_path / "best", method="artperl")
    assert before.options.calibration == Calibration() != after.options.calibration
    assert before.options.part_calibration == PartCalibration() != after.options.part_calibration
