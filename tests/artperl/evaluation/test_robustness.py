"""Rows of the benchmark that show where an estimator stops being right."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import artsim
from artperl.evaluation.conditions import CONDITIONS, condition_samples
from artperl.evaluation.reliability import calibration_error
from artperl.evaluation.robustness import run_robustness
from artsim.errors import ConfigError
from artsim.observing.interference import FOREIGN


@pytest.mark.parametrize("name", CONDITIONS)
def test_conditions_do_what_they_say(name: str) -> None:
    condition, laptop = CONDITIONS[name], artsim.make("laptop", 5)
    samples, clean = condition_samples(name, [laptop], 3), condition_samples("clean", [laptop], 3)
    again = condition_samples(name, [laptop], 3)
    for sample, same, reference in zip(samples, again, clean, strict=True):
        np.testing.assert_array_equal(sample.points, same.points)
        assert sample.noise == condition.noise
        other = sample.part == FOREIGN
        assert other.mean() == pytest.approx(condition.outlier_share, abs=1e-3)
        assert (~other).sum() == pytest.approx(condition.num_points * (1.0 - condition.hidden), abs=1)
        if condition.states == "rest":
            np.testing.assert_array_equal(sample.joint_state, sample.joint_rest)
        elif condition.preset == "artimage":
            np.testing.assert_array_equal(sample.T_camera_part, reference.T_camera_part)


def test_expected_calibration_error_is_that_of_its_definition() -> None:
    """Estimates that are right in a share of their squared confidence: the error is that of the closed form."""
    rng = np.random.default_rng(0)
    confidence = rng.random(200_000)
    right = rng.random(200_000) < confidence**2
    assert calibration_error(confidence, right) == pytest.approx(1 / 2 - 1 / 3, abs=0.005)  # of p - p^2 over 0 to 1
    assert calibration_error(confidence, rng.random(200_000) < confidence) < 0.01
    assert calibration_error(np.array([1.0, 0.05]), np.array([True, False])) == pytest.approx(0.025)


def test_rows_are_kept_and_not_measured_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file, lines = tmp_path / "rows.json", []
    asked = {"conditions": ("clean", "leak_10"), "objects": 1, "views": 1, "kept": file, "say": lines.append}
    first = run_robustness(("procedural",), ("laptop",), **asked)
    assert set(first["rows"]) == {"procedural/laptop/clean", "procedural/laptop/leak_10"}
    assert json.loads(file.read_text())["rows"] == first["rows"]
    assert set(first["confidence"]) == {"procedural/laptop"}  # of all conditions, never of several categories
    assert lines[-1].startswith("procedural, laptop, all conditions: AUROC ")
    monkeypatch.setattr("artperl.evaluation.robustness.evaluate", None)
    assert run_robustness(("procedural",), ("laptop",), **asked) == first
    with pytest.raises(ConfigError, match="other options"):
        run_robustness(("procedural",), ("laptop",), **asked | {"views": 2})


def test_mistyped_conditions_and_rows_are_named() -> None:
    with pytest.raises(ConfigError, match="occluded_20"):
        run_robustness(("procedural",), ("laptop",), ("occluded20",))
    with pytest.raises(ConfigError, match="real_all"):
        run_robustness(("reall",), ("laptop",))
