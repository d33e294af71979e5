"""Every method keeps the best estimator of its validations, and ends a stage early only where it is asked to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from artperl.methods import StoredMethod
from artperl.methods.estimator_folders import read_settings
from artperl.training.options import TrainOptions
from artperl.training.run import Training
from artperl.training.validation import goes_on

TINY = TrainOptions(
    method="ancsh", base_objects=3, reference_points=32, width=16, perception_steps=6, batch_size=4, num_points=128,
    validate_every=2, test_objects=1, validation_views=1, test_views=1,
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.usefixtures("brief_fits")
@pytest.mark.parametrize(("method", "stage"), [("ancsh", "joints"), ("omad", "cues")])
def test_the_best_of_several_validations_is_kept(tmp_path: Path, method: StoredMethod, stage: str) -> None:
    options = replace(TINY, method=method, prior_steps=3 if method == "omad" else 0)
    training = Training(options, tmp_path, workers=0, progress=False)
    training.run()
    history, best = training.context.state.history, float("inf")
    assert [(each["stage"], each["done"][stage]) for each in history] == [(stage, 2), (stage, 4), (stage, 6)]
    for each in history:
        if each["score"] < 1.01 * best:
            kept, best = each, min(best, each["score"])
    assert read_settings(tmp_path / "best")["about"]["done"] == kept["done"]
    network = next(iter(training.context.state.networks.values()))
    learnt = training.context.estimator()
    assert next(iter(learnt.networks().values())) is not network  # what is validated is a copy


def test_a_stage_ends_after_as_many_validations_without_a_gain_as_patience_says(tmp_path: Path) -> None:
    context = Training(TINY, tmp_path, workers=0, progress=False).context
    state = context.state
    state.done["joints"] = 4
    state.history = [{"stage": "other", "score": 0.1}, *({"stage": "joints", "score": s} for s in (3.0, 2.0, 2.5, 2.0))]
    for patience, on in ((0, True), (1, False), (2, False), (3, True)):
        context.options = replace(TINY, patience=patience)
        assert goes_on(context, "joints", 6) is on
        assert goes_on(context, "coordinates", 6)  # not validated yet
    assert not goes_on(context, "joints", 4)
