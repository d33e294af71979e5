"""Anybody's estimates against a dataset: perfect ones have no error, absent ones count, and bad files are named."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import artsim
from artperl.commands.score import Score
from artperl.evaluation.metrics import true_poses
from artsim import Dataset
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError, DatasetError
from artsim.loading.sources import family_sources
from artsim.observing.sample import Sample
from tests.artsim.datasets.conftest import quick_workers  # noqa: F401


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    out, sources = tmp_path_factory.mktemp("scored") / "out", family_sources(("laptop", "drawer"), 1)
    options = SampleOptions(num_points=32)
    artsim.generate(sources, out, 4, sample=options, splits=(0, 0, 1), workers=1, progress=False)
    return artsim.open_dataset(out)


def truth(sample: Sample, degrees: float = 0.0) -> dict[str, Any]:
    """The record of an estimate that is turned by so much about the camera's axis, and else perfect."""
    rotation, center = true_poses(sample)
    turned = Rotation.from_euler("z", degrees, degrees=True).as_matrix() @ rotation
    boxes = {"rotation": turned.tolist(), "translation": center.tolist(), "size": sample.box_size.tolist()}
    return {"sample": sample.index, **boxes}


def figures(dataset: Dataset, tmp_path: Path, **files: str) -> dict[str, Any]:
    """What the command writes of files by these names."""
    for name, text in files.items():
        (tmp_path / f"{name}.json").write_text(text)
    paths = tuple(tmp_path / f"{name}.json" for name in files)
    Score(paths, dataset.folder, out=tmp_path / "page.md", json=tmp_path / "figures.json").run()
    figures: dict[str, Any] = json.loads((tmp_path / "figures.json").read_text())
    return figures


def test_methods_stand_side_by_side_with_their_errors(dataset: Dataset, tmp_path: Path) -> None:
    perfect = json.dumps([
        {**truth(s), "T_camera_part": s.T_camera_part.tolist(), "state": s.joint_state.tolist(),
         "joint_axis": s.joint_axis_camera.tolist()} for s in dataset
    ])  # fmt: skip
    turned = "\n".join(json.dumps({**truth(s, 5.0), "sample": f"{s.index:09d}"}) for s in dataset)
    found = figures(dataset, tmp_path, perfect=perfect, turned=turned)
    for category in ("laptop", "drawer"):
        for part in found["perfect"][category]["parts"]:
            assert part["rotation_deg"]["mean"] == pytest.approx(0.0, abs=1e-5)
            assert part["iou_exact"]["mean"] == pytest.approx(1.0, abs=1e-6)
            assert part["joint_state"]["mean"] == pytest.approx(0.0, abs=1e-9)
        for part in found["turned"][category]["parts"]:
            assert part["rotation_deg"]["mean"] == pytest.approx(5.0)
            assert "joint_state" not in part  # which the file does not say
        assert found["turned"][category]["right"] == 1.0
    page = (tmp_path / "page.md").read_text()
    assert page.index("| perfect | 4 | 0 | 100.0") < page.index("| turned | 4 | 0 | 100.0")
    assert "no frozen dataset" in page


@pytest.mark.slow
def test_a_split_is_scored_alone(tmp_path: Path) -> None:
    out, sample = tmp_path / "out", SampleOptions(num_points=32)
    shares = (0.6, 0, 0.4)
    artsim.generate(family_sources(("laptop",), 3), out, 6, sample=sample, splits=shares, workers=1, progress=False)
    dataset, test = artsim.open_dataset(out), artsim.open_dataset(out, "test")
    poses, page, found = tmp_path / "poses.json", tmp_path / "page.md", tmp_path / "figures.json"
    poses.write_text(json.dumps([truth(s) for s in test]))
    for split, views, failed in (("test", test, 0), (None, dataset, len(dataset) - len(test))):
        Score((poses,), out, split, page, json=found).run()
        assert json.loads(found.read_text())["poses"]["laptop"]["failures"] == failed
        assert f"{len(views)} views of {len({s.object_id for s in views})} objects" in page.read_text()
    with pytest.raises(DatasetError, match="split val has no sample"):
        Score((poses,), out, "val").run()


def test_absent_estimates_and_those_with_other_parts_are_failures(dataset: Dataset, tmp_path: Path) -> None:
    first, second, third, _ = dataset
    fewer = {name: value if name == "sample" else value[:1] for name, value in truth(second).items()}
    said = [truth(first), fewer, {"sample": third.index, "error": "no estimate"}]
    found = figures(dataset, tmp_path, some=json.dumps(said))["some"]
    assert sum(own["failures"] for own in found.values()) == 3
    assert sum(own["instances"] for own in found.values()) == 4
    worst = max(part["rotation_deg"]["mean"] for own in found.values() for part in own["parts"])
    assert worst == pytest.approx(180.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [({"rotation": None}, "record 1"), ({"size": [[1, 1, 1]]}, "size has shape"), ({"confidence": 2}, "confidence"),
     ({"translation": "here"}, "record 1"), ({"sample": [1]}, "its sample is"), ({"sample": 99}, "not there"),
     ({"rotation": np.ones((2, 3, 3)).tolist()}, "no rotation"), ({"size": [[1, 1, 1e9]] * 2}, "not finite"),
     ({"size": [[1, 1, float("nan")]] * 2}, "no number")],
)  # fmt: skip
def test_bad_records_are_named(dataset: Dataset, change: dict[str, Any], message: str, tmp_path: Path) -> None:
    sample = next(sample for sample in dataset if sample.category == "laptop")
    with pytest.raises(ConfigError, match=message):
        figures(dataset, tmp_path, bad=json.dumps([{**truth(sample), **change}]))


@pytest.mark.parametrize("text", ["{", "[1, 2]", "[" * 50_000, '[{"sample": 0}, {"sample": 0}]', "\0"])
def test_files_of_something_else_are_refused(dataset: Dataset, text: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="not a file of estimates"):
        figures(dataset, tmp_path, other=text)
