"""Runs of any method fill the time that they are given, and say how long they took."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from artperl.training.options import METHOD_PRESETS, TrainOptions, preset_of, scaled
from artperl.training.run import Training
from artperl.training.stages import stages_of
from artperl.training.timing import expected_seconds, filling, seconds_per_step, trained_minutes
from artsim.errors import ConfigError

TINY = TrainOptions(
    method="ancsh", base_objects=3, reference_points=32, width=16, perception_steps=60, batch_size=4, num_points=128,
    validate_every=1000, test_objects=1, validation_views=1, test_views=1, retrieval_objects=3, foreign_categories=1,
)  # fmt: skip


@pytest.mark.parametrize("method", METHOD_PRESETS)
def test_every_length_of_a_preset_is_that_of_a_stage_that_is_timed(method: str) -> None:
    for name in ("quick", "long"):
        options = preset_of(method, name)  # type: ignore[arg-type]
        groups = [group for stage in stages_of(options) for group in stage.lengths]
        assert len(groups) == len(set(groups))
        once = expected_seconds(options, dict.fromkeys(groups, 1.0))
        assert expected_seconds(scaled(options, 2.0), dict.fromkeys(groups, 1.0)) == 2.0 * once
        assert scaled(options, 0.5).validate_every == options.validate_every // 2
        assert scaled(options, 1e-9).perception_steps == 1


@pytest.mark.slow
def test_a_run_takes_the_minutes_that_it_is_given_and_the_same_steps_again(tmp_path: Path) -> None:
    kept = tmp_path / "lengths.json"
    options = filling(TINY, 0.1, kept)
    written = kept.read_bytes()
    assert filling(TINY, 0.1, kept) == options
    assert kept.read_bytes() == written
    training = Training(options, tmp_path / "run", workers=0, progress=False)
    training.run()
    assert 0.03 < trained_minutes(training) < 0.3  # a busy machine is slower than it was when it was timed
    seconds = json.loads((tmp_path / "run" / "seconds.json").read_text())
    assert seconds.keys() == {"coordinates", "joints", "validation"}
    again = Training(options, tmp_path / "run", workers=0, progress=False)
    assert trained_minutes(again) == pytest.approx(trained_minutes(training), abs=1e-3)
    with pytest.raises(ConfigError, match="lengths of another run"):
        filling(TINY, 0.2, kept)
    with pytest.raises(ConfigError, match="lengths of another run"):
        filling(replace(TINY, seed=1), 0.1, kept)


@pytest.mark.slow
def test_the_lengths_of_a_method_with_an_agent_are_taken_again(tmp_path: Path) -> None:
    options = replace(TINY, method="artperl", perception_steps=2, retrieval_steps=1, agent_rollouts=2, episodes=4)
    made = filling(options, 0.01, tmp_path / "lengths.json")
    assert made.agent_rollouts > 0
    assert filling(options, 0.01, tmp_path / "lengths.json") == made


@pytest.mark.slow
def test_what_a_stage_reports_between_its_steps_takes_time_too(tmp_path: Path) -> None:
    options = replace(TINY, method="artperl", perception_steps=2, retrieval_steps=1, agent_rollouts=6, episodes=4)
    training = Training(options, tmp_path, workers=0, progress=False)
    training.run()
    assert 6 * seconds_per_step(options)["agent"] == pytest.approx(training.context.state.seconds["agent"], rel=0.5)


@pytest.mark.slow
def test_time_adds_up_over_stops(tmp_path: Path) -> None:
    def stop(group: str, figures: dict[str, float], step: int) -> None:
        training.context.stop.asked = (group, step) == ("joints", 20)

    training = Training(TINY, tmp_path, workers=0, progress=False, report=stop)
    with pytest.raises(KeyboardInterrupt):
        training.run()
    before = Training(TINY, tmp_path, workers=0, progress=False).context.state.seconds
    assert before.keys() == {"coordinates", "joints"}
    again = Training(TINY, tmp_path, workers=0, progress=False)
    again.run()
    after = again.context.state.seconds
    assert after["coordinates"] == pytest.approx(before["coordinates"], abs=1e-3)  # done before
    assert after["joints"] > 1.5 * before["joints"]
