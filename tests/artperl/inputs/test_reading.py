"""Clouds, depth images and intrinsics of files are read as what they are; a page shows what was estimated."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import artsim
from artperl.evaluation.estimate_page import page
from artperl.evaluation.samples import samples_of
from artperl.inputs import points_of_depth, read_intrinsics, read_points
from artperl.methods.full import Estimator
from artperl.perception.network import Perception
from artsim.datasets.plan import SampleOptions
from artsim.errors import ArtsimError, ConfigError
from artsim.model.frame import BACKGROUND
from artsim.observing.sample import Sample
from tests.artperl.worlds import small_base


@pytest.fixture(scope="module")
def sample() -> Sample:
    (one,) = samples_of([artsim.make("laptop", 3)], 1, SampleOptions(num_points=512, images=("depth", "part_mask")))
    return one


def test_a_depth_image_holds_the_sampled_points(sample: Sample) -> None:
    assert sample.depth is not None
    assert sample.part_mask is not None
    points = points_of_depth(sample.depth, sample.K, sample.part_mask != BACKGROUND)
    apart = np.abs(points[:, None] - sample.points[None, :8]).max(axis=-1).min(axis=0)
    assert apart.max() < 1e-5


def test_files_of_a_depth_image(sample: Sample, tmp_path: Path) -> None:
    assert sample.depth is not None
    assert sample.part_mask is not None
    mask = sample.part_mask == 1
    Image.fromarray((sample.depth * 1000).round().astype(np.uint16)).save(tmp_path / "depth.png")
    Image.fromarray((mask * 255).astype(np.uint8)).convert("RGB").save(tmp_path / "mask.png")
    np.save(tmp_path / "depth.npy", sample.depth)
    (tmp_path / "camera.json").write_text(json.dumps({"K": sample.K.ravel().tolist()}))
    rounded = read_points(tmp_path / "depth.png", tmp_path / "mask.png", tmp_path / "camera.json")
    exact = read_points(tmp_path / "depth.npy", tmp_path / "mask.png", tmp_path / "camera.json")
    assert len(rounded) == len(exact) == mask.sum()
    assert np.abs(rounded - exact).max() < 0.001


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"K": [1, 2]}', '{"fx": 1}', '{"K": "none"}'])
def test_other_intrinsics_are_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "camera.json").write_text(content)
    with pytest.raises(ConfigError, match="intrinsics"):
        read_intrinsics(tmp_path / "camera.json")


def test_images_that_make_no_cloud_are_refused(tmp_path: Path) -> None:
    depth, K = np.ones((4, 5)), np.eye(3)
    for wrong in (
        lambda: points_of_depth(np.ones((4, 5, 3)), K),
        lambda: points_of_depth(np.zeros((4, 5)), K),
        lambda: points_of_depth(depth, K, np.zeros((4, 5))),
        lambda: points_of_depth(depth, K, np.ones((5, 4))),
        lambda: points_of_depth(depth, np.zeros((3, 3))),
        lambda: points_of_depth(np.full((4, 5), np.nan), K),
    ):
        with pytest.raises(ArtsimError):
            wrong()
    (tmp_path / "depth.png").write_bytes(b"nothing")
    with pytest.raises(ConfigError, match="intrinsics"):
        read_points(tmp_path / "depth.png")
    (tmp_path / "camera.json").write_text('{"fx": 1, "fy": 1, "cx": 0, "cy": 0}')
    with pytest.raises(ConfigError, match="no depth image"):
        read_points(tmp_path / "depth.png", intrinsics=tmp_path / "camera.json")
    with pytest.raises(ConfigError, match="cannot read intrinsics"):
        read_intrinsics(tmp_path / "lost.json")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("cloud.md", b"# words"),
        ("cloud.ply", b""),
        ("cloud.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nend_header\n12"),
        ("cloud.npy", b"\x93NUMPY\x01\x00"),
        ("cloud.npz", b"PK\x03\x04"),
        ("cloud.stl", b"solid"),
        ("cloud.obj", b"v 1 2"),
        ("cloud.off", b"OFF\n9 0 0\n1 2 3\n"),
        ("cloud.pcd", b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 9\nDATA binary\n12"),
        ("cloud.csv", b"a,b,c\n1,2,3"),
        ("cloud.xyz", b"1 2\n"),
        ("cloud.txt", b"1 2 3\n1 2 no\n"),
    ],
)
def test_files_that_hold_no_cloud_are_named(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ConfigError, match=name):
        read_points(tmp_path / name)
    with pytest.raises(ConfigError, match="lost"):
        read_points(tmp_path / f"lost{Path(name).suffix}")


def test_a_page_holds_the_cloud_and_every_box_of_the_way(sample: Sample) -> None:
    estimate = Estimator(Perception(2, 16), small_base("laptop"))(sample.points)
    text = page(estimate, sample.points, "a <laptop>")
    found = re.search(r"const data = (\{.*\});\n", text)
    assert found is not None
    assert "<" not in found[1]
    data = json.loads(found[1])
    assert data["title"] == "a <laptop>"
    assert len(data["frames"]) == len(estimate.trajectory)
    last = data["frames"][-1]
    assert len(np.frombuffer(base64.b64decode(last["part"]), "<i2")) == np.isfinite(sample.points).all(axis=1).sum()
    centers = [np.array(box["T"]) @ [*box["center"], 1.0] for box in last["shown"]["boxes"]]
    np.testing.assert_allclose(np.array(centers)[:, :3], estimate.translation, atol=1e-4)
    assert estimate._repr_html_().startswith("<iframe")
