"""The verb ``artperl calibrate``."""

from __future__ import annotations

from pathlib import Path

import pytest

from artperl.commands.calibrate import Calibrate
from artperl.methods.estimator_files import load_estimator
from artperl.methods.estimator_folders import read_settings
from artsim.errors import ConfigError


@pytest.mark.slow
def test_only_the_confidence_changes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Calibrate("laptop", tmp_path / "made", objects=2, views=1).run()
    before, after = load_estimator("laptop"), load_estimator(tmp_path / "made")
    assert after.calibration != before.calibration
    assert after.part_calibration != before.part_calibration
    assert after.options == before.options
    for name, tensor in before.perception.state_dict().items():
        assert after.perception.state_dict()[name].equal(tensor)
    assert read_settings(tmp_path / "made")["about"]["options"]["categories"] == ["laptop"]
    assert "recall at precision 90 %" in capsys.readouterr().out


def test_estimators_of_the_package_stay_as_they_are() -> None:
    with pytest.raises(ConfigError, match="--out"):
        Calibrate("laptop").run()


def test_mistyped_categories_are_named(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="laptp"):
        Calibrate("laptop", tmp_path, category=("laptp",)).run()
