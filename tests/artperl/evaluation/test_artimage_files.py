"""A folder in ArtImage's layout is read to the samples that it was written from."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from artperl.commands import verbs
from artperl.data.categories import objects_of
from artperl.evaluation.artimage_files import TEST_IDS, ArtImageFiles
from artperl.evaluation.metrics import rotation_error
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.errors import DatasetError
from artsim.observing.sample import Sample
from artsim.renderers import shared_renderer
from tests.artperl.evaluation.artimage_writer import write_artimage


def written(root: Path, category: str, three_channels: bool = False) -> list[Sample]:
    """Two views of a test object and one of another, written; those of the test object."""
    objects = objects_of([category], 2, 30)
    numbered = {TEST_IDS[category][0]: objects[0], 77: objects[1]}
    options = SampleOptions(num_points=512, images=("depth", "part_mask"))
    renderer = shared_renderer("raycast")
    views = [
        (number, draw_sample(numbered[number], options, 5, n, renderer))
        for n, number in enumerate((TEST_IDS[category][0], TEST_IDS[category][0], 77))
    ]
    write_artimage(root, category, numbered, views, three_channels)
    return [sample for number, sample in views if number != 77]


@pytest.mark.slow
@pytest.mark.parametrize("category", ["laptop", "drawer", "scissors"])
def test_what_is_read_is_what_was_written(tmp_path: Path, category: str) -> None:
    truth = written(tmp_path, category, three_channels=category == "drawer")
    read = list(ArtImageFiles(tmp_path, category, "test", 4096))
    assert len(read) == len(truth) == 2
    for found, true in zip(read, truth, strict=True):
        assert found.joint_type == true.joint_type
        assert (found.joint_parent == true.joint_parent).all()
        assert rotation_error(found.T_camera_part[:, :3, :3], true.T_camera_part[:, :3, :3]).max() < 1e-4
        np.testing.assert_allclose(found.T_camera_part[:, :3, 3], true.T_camera_part[:, :3, 3], atol=1e-6)
        np.testing.assert_allclose(found.box_center, true.box_center, atol=1e-6)
        np.testing.assert_allclose(found.box_size, true.box_size, atol=1e-6)
        np.testing.assert_allclose(found.joint_axis[1:], true.joint_axis[1:], atol=1e-6)
        np.testing.assert_allclose(found.joint_state - found.joint_rest, true.joint_state - true.joint_rest, atol=1e-6)
        np.testing.assert_allclose(found.K, true.K, atol=1e-9)
        off = np.cross(found.joint_origin_camera - true.joint_origin_camera, true.joint_axis_camera)[1:]
        hinges = np.array(true.joint_type[1:]) == "revolute"
        assert np.abs(off[hinges]).max(initial=0.0) < 1e-6
        # Points lie where the boxes of their parts are, to a millimetre of depth.
        rest = np.abs(found.rest_points - found.box_center[found.part]) - 0.5 * found.box_size[found.part]
        assert rest.max() < 0.003
        seen = np.bincount(found.part, minlength=len(true.joint_type)) > 0
        assert ((found.visible_fraction > 0) == seen).mean() > 0.7


def test_splits_are_those_of_the_lists_and_of_the_numbers(tmp_path: Path) -> None:
    written(tmp_path, "laptop")
    (other,) = ArtImageFiles(tmp_path, "laptop", "train", 64)
    assert other.object_id == "77"
    (tmp_path / "laptop" / "test.txt").write_text("000001.json\n")
    (one,) = ArtImageFiles(tmp_path, "laptop", "test", 64)
    assert one.object_id == str(TEST_IDS["laptop"][0])
    assert len(one.points) == 64


def test_damaged_files_are_named(tmp_path: Path) -> None:
    written(tmp_path, "laptop")
    files = ArtImageFiles(tmp_path, "laptop", "test", 64)
    annotation = tmp_path / "laptop" / "train" / "annotations" / "000000.json"
    whole = annotation.read_text()
    annotation.write_text(whole.replace('"link_category_id": 1', '"link_category_id": 3'))
    with pytest.raises(DatasetError, match=r"000000.json: this is no annotation of ArtImage"):
        files.read("000000.json")
    annotation.write_text(whole.replace("depth/000000.png", "../../../../etc/depth/000000.png"))
    with pytest.raises(DatasetError):
        files.read("000000.json")
    annotation.write_text(whole[:-5])
    with pytest.raises(DatasetError, match="damaged"):
        files.read("000000.json")
    with pytest.raises(DatasetError, match="missing"):
        files.read("000009.json")
    with pytest.raises(DatasetError, match=r"missing.*--root"):
        ArtImageFiles(tmp_path / "laptop", "laptop")
    with pytest.raises(DatasetError, match="ArtImage has no 'faucet'"):
        ArtImageFiles(tmp_path, "faucet")


@pytest.mark.slow
def test_a_method_is_evaluated_on_such_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written(tmp_path, "laptop")
    json_path = tmp_path / "figures.json"
    verbs.ArtImage(root=tmp_path, json=json_path).run()
    printed = capsys.readouterr().out
    assert "laptop part_1" in printed
    assert "eyeglasses: left out" in printed
    figures = json.loads(json_path.read_text())["original"]["laptop"]
    assert figures["instances"] == 2
    assert figures["parts"][0]["rotation_deg"]["mean"] < 10.0
