"""Estimators in their folders: saved, read again, refused when damaged."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from artperl.core.confidence import Calibration
from artperl.fitting.options import EstimatorOptions
from artperl.methods.estimator_files import load_estimator
from artperl.methods.estimator_writing import save_estimator
from artperl.methods.full import Estimator
from artperl.perception.network import Perception
from artperl.retrieval.shape_base import ShapeBase
from artsim.errors import ConfigError, DatasetError
from artsim.observing.sample import Sample


def test_an_estimator_comes_back_from_its_folder(base: ShapeBase, sample: Sample, tmp_path: Path) -> None:
    torch.manual_seed(0)
    options = EstimatorOptions(references=2)
    made = Estimator(Perception(2, 16), base, options, Calibration(1.0, -2.0, -3.0, 4.0, -5.0, -6.0))
    save_estimator(made, tmp_path / "made", {"note": "untrained"})
    back = load_estimator(tmp_path / "made")
    assert (back.options, back.calibration) == (options, made.calibration)
    for name, tensor in made.perception.state_dict().items():  # half precision
        torch.testing.assert_close(back.perception.state_dict()[name], tensor, rtol=5e-4, atol=1e-7)
    assert repr(back) == f"<Estimator of laptop: {len(base.categories)} references, on cpu>"
    assert back.to("cpu") is back
    assert back.device == torch.device("cpu")
    back.save(tmp_path / "again")
    again = load_estimator(tmp_path / "again")
    np.testing.assert_array_equal(again(sample.points).T_camera_part, back(sample.points).T_camera_part)


@pytest.mark.parametrize("spoiled", ["estimator.json", "weights.safetensors", "base.npz"])
def test_damaged_folders_are_refused(base: ShapeBase, tmp_path: Path, spoiled: str) -> None:
    folder = tmp_path / "made"
    save_estimator(Estimator(Perception(2, 16), base), folder, {})
    (folder / spoiled).write_bytes(b"damaged")
    with pytest.raises(DatasetError, match="Fix"):
        load_estimator(folder)


def test_a_missing_estimator_says_which_there_are() -> None:
    with pytest.raises(DatasetError, match="come"):
        load_estimator("no-such-category")


def test_options_change_as_an_estimator_is_loaded(base: ShapeBase, tmp_path: Path) -> None:
    save_estimator(Estimator(Perception(2, 16), base), tmp_path, {})
    assert load_estimator(tmp_path, seen_from=(-75.0, 75.0), normal_alignment=False).options == EstimatorOptions(
        seen_from=(-75.0, 75.0), normal_alignment=False
    )
    with pytest.raises(ConfigError, match="sene_from"):
        load_estimator(tmp_path, sene_from=(-75.0, 75.0))
    with pytest.raises(ConfigError, match="LOW HIGH"):
        load_estimator(tmp_path, seen_from=(75.0, -75.0))


def test_an_option_of_a_former_version_is_passed_over(base: ShapeBase, tmp_path: Path) -> None:
    save_estimator(Estimator(Perception(2, 16), base), tmp_path, {})
    file = tmp_path / "estimator.json"
    settings = json.loads(file.read_text())
    settings["options"] = {"occluded_parts": False, "references": 2}
    file.write_text(json.dumps(settings))
    assert load_estimator(tmp_path).options == EstimatorOptions(references=2)
