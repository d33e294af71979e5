"""What camera files say beside the matrix, and soft masks: each is read by its specification, or said."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from artperl.inputs import Cloud, InputOptions, read_cloud
from artperl.inputs.depth_images import read_depth
from artperl.inputs.intrinsics import Intrinsics, read_camera
from artperl.inputs.intrinsics_formats import Hints
from artperl.inputs.masks import read_mask
from artsim.errors import ConfigError
from artsim.formats.coco import run_lengths

CASES = Path(__file__).parents[2] / "cases" / "second"
SIZE = (640, 480)
FOUR = {"fx": 600.0, "fy": 610.0, "cx": 320.8, "cy": 238.2}
FLAT = [600.0, 0.0, 320.8, 0.0, 610.0, 238.2, 0.0, 0.0, 1.0]
ORB = "".join(f"Camera.{name}: {value}\n" for name, value in {**FOUR, "k1": 0.2, "width": 640, "height": 480}.items())


def _case(name: str, depth: str, camera: str, mask: str = "mask.png") -> Cloud:
    folder = CASES / name
    return read_cloud(folder / depth, InputOptions(intrinsics=folder / camera, mask=folder / mask))


def _camera(folder: Path, content: Any, ending: str = ".json", hints: Hints | None = None) -> Intrinsics:
    path = folder / f"camera{ending}"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return read_camera(path, hints or Hints(size=SIZE))


def test_the_scale_of_instant_ngp_is_metres_of_one_unit() -> None:
    z = _case("DC1_integer_depth_scale", "d01.png", "ngp.json").points[:, 2]
    assert 0.6 < z.min() < z.max() < 0.9


def test_a_soft_mask_is_read_over_half() -> None:
    cloud = _case("DC3_soft_mask_png", "dbg.png", "K.txt", "msoft.png")
    assert len(cloud.points) == 74557
    assert any("over 127.5" in note for note in cloud.notes)


@pytest.mark.parametrize("name", ["k3b", "k3c", "k3d", "k3e", "k3f", "k3g", "k3h", "cal"])
def test_distortion_is_said_wherever_it_stands(name: str) -> None:
    cloud = _case("DC7_distortion_beside", "d.png", "cal.npz" if name == "cal" else f"{name}.json")
    assert "distortion (-0.1, 0.2" in cloud.warnings[0]


def test_a_resolution_is_that_of_the_image() -> None:
    with pytest.raises(ConfigError, match="1280 x 720 pixels, and the depth image has 640 x 480"):
        _case("DC9_resolution", "d.png", "k4.json")


@pytest.mark.parametrize(
    ("content", "metres"),
    [
        ({"camera": {"w": 640, "h": 480, **FOUR, "scale": 6553.5}}, 1 / 6553.5),  # Replica
        ({"cam": {"H": 480, "W": 640, **FOUR, "png_depth_scale": 6553.5}}, 1 / 6553.5),  # NICE-SLAM
        ({"camera_params": {"image_height": 480, "image_width": 640, **FOUR, "png_depth_scale": 5000.0}}, 0.0002),
        (ORB + "DepthMapFactor: 5000.0\n", 0.0002),
        (ORB + "RGBD.DepthMapFactor: 5000.0\n", 0.0002),
        ({"intrinsics": FLAT, "scale_to_meters": 0.001}, 0.001),
        ({"intrinsic_matrix": np.reshape(FLAT, (3, 3)).tolist(), "factor_depth": [[1000]]}, 0.001),  # GraspNet
        ({"K": FLAT, "depthShift": 1000}, 0.001),  # ScanNet
        ({"fl_x": 600.0, "w": 640, "h": 480, "depth_unit_scale_factor": 0.001, "scale": 0.33}, 0.001),  # nerfstudio
        ({"K": FLAT, "depth_unit": "mm"}, 0.001),
        ({"K": FLAT, "depth": {"scale": 0.00025}}, 0.00025),
        ({"K": FLAT, "depth_scale": 1000.0}, 0.001),
        ({"cam_K": FLAT, "depth_scale": 0.1}, 0.0001),  # BOP: millimetres
        ({"fx": 600.0, "fy": 600.0, "ppx": 320.0, "ppy": 240.0, "depth_scale": 0.001}, 0.001),  # RealSense: metres
    ],
)  # fmt: skip
def test_units_of_depth_are_read_by_their_specification(tmp_path: Path, content: Any, metres: float) -> None:
    found = _camera(tmp_path, content, ".yaml" if isinstance(content, str) else ".json")
    assert found.depth_scale == pytest.approx(metres, rel=1e-9)
    assert not any("ignored" in text for text in found.warnings)


@pytest.mark.parametrize(
    "extra",
    [{"my_scale": 3.0}, {"a": {"b": {"unit": "inch"}}}, {"crop_factor": 2}, {"k1x": 1.0}, {"a": [{"undistort": True}]},
     {"scale": 1.0}, {"factor": 8}, {"distances": [1, 2]}],
)  # fmt: skip
def test_what_may_be_a_scale_or_distortion_is_not_left_out_without_a_word(tmp_path: Path, extra: Any) -> None:
    for content in ({"K": FLAT, **extra}, {"camera": FOUR, **extra}):
        (warning,) = _camera(tmp_path, content).warnings
        assert warning.startswith("ignored in camera.json")


@pytest.mark.parametrize("extra", [{"integer_depth_scale": 5.0}, {"png_depth_scale": 0.001}, {"depth_scale": 1.0}])
def test_a_unit_that_cannot_be_is_refused(tmp_path: Path, extra: Any) -> None:
    with pytest.raises(ConfigError, match="--depth-scale"):
        _camera(tmp_path, {"K": FLAT, **extra})


def test_of_two_units_one_is_taken_and_said(tmp_path: Path) -> None:
    found = _camera(tmp_path, {"camera": {**FOUR, "png_depth_scale": 5000.0}, "depth_units": 0.001})
    assert found.depth_scale == pytest.approx(0.0002)
    assert "several units" in found.warnings[0]


@pytest.mark.parametrize(
    "extra",
    [{"k1": 0.1}, {"D": [0.1, 0]}, {"distCoeffs": [[0.1]]}, {"distortion": {"k1": 0.1, "model": "radtan"}},
     {"dist_coeffs": {"rows": 1, "cols": 1, "data": [0.1]}}, {"radial_distortion": [0.1]}, {"kc": [0.1]},
     {"distortion_model": "equidistant"}, {"camera_model": "OPENCV_FISHEYE"}, {"is_fisheye": True}],
)  # fmt: skip
def test_a_lens_that_is_no_pinhole_is_said(tmp_path: Path, extra: Any) -> None:
    for content in ({**FOUR, **extra}, {"depth_intrinsics": FOUR, **extra}, {"K": FLAT, **extra}):
        assert any("not undone" in text for text in _camera(tmp_path, content).warnings)


def test_the_distortion_of_another_camera_is_not_that_of_the_depth_image(tmp_path: Path) -> None:
    one = {**FOUR, "width": 640, "height": 480}
    both = {"color": {**one, "coeffs": [0.1, 0, 0, 0, 0]}, "depth": {**one, "coeffs": [0, 0, 0, 0, 0]}}
    assert _camera(tmp_path, both).warnings == ()


@pytest.mark.parametrize(
    "stated", [[1280, 720], "1280x720", {"width": 1280, "height": 720}, [720, 1280]], ids=["list", "text", "map", "hw"]
)
def test_sizes_of_every_kind_are_read(tmp_path: Path, stated: Any) -> None:
    for around in ({}, {"width": 1280, "height": 720}):
        found = _camera(tmp_path, {**FOUR, **around, "resolution": stated}, hints=Hints(size=(1280, 720)))
        assert found.size == (1280, 720)
    assert _camera(tmp_path, {**FOUR, "width": 640, "height": 480, "resolution": stated}).size != SIZE
    kalibr = {"cam0": {"intrinsics": list(FOUR.values()), "distortion_coeffs": [0.1], "resolution": [640, 480]}}
    assert _camera(tmp_path, kalibr).size == SIZE


def test_roi_and_binning_of_ros_move_the_matrix(tmp_path: Path) -> None:
    """Of 1280 x 960 pixels those from (200, 100) on, binned by two: a pixel sees what its four did."""
    whole = {"K": [1200, 0, 641.5, 0, 1220, 475.5, 0, 0, 1], "D": [0, 0], "width": 1280, "height": 960}
    window = {"x_offset": 200, "y_offset": 100, "width": 640, "height": 480}
    content = {**whole, "binning_x": 2, "binning_y": 2, "roi": window}
    found = _camera(tmp_path, content, hints=Hints(size=(320, 240)))
    plain = _camera(tmp_path, whole, hints=Hints(size=(1280, 960))).K
    assert found.size == (320, 240)
    point = np.array([0.1, -0.05, 0.9])
    at, before = ((K @ point)[:2] / point[2] for K in (found.K, plain))
    np.testing.assert_allclose(at, (before - [200, 100]) / 2, atol=1e-9)
    assert any("roi" in note for note in found.notes)
    np.testing.assert_array_equal(_camera(tmp_path, content, hints=Hints(size=(1280, 960))).K, plain)
    assert _camera(tmp_path, content, hints=Hints(size=(640, 480))).size == (320, 240)  # an error against the image


def test_arrays_beside_a_matrix_count(tmp_path: Path) -> None:
    np.savez(tmp_path / "c.npz", K=np.reshape(FLAT, (3, 3)), dist=[0.1, 0], depth_scale=1000.0, image_size=[640, 480])
    found = read_camera(tmp_path / "c.npz", Hints(size=SIZE))
    assert (found.size, found.depth_scale) == (SIZE, 0.001)
    assert "distortion" in found.warnings[0]
    np.savez(tmp_path / "c.npz", **FOUR, scale_to_meters=0.001)
    assert read_camera(tmp_path / "c.npz").depth_scale == 0.001


def _soft() -> np.ndarray:
    """(48, 64) signed distance to a circle's rim, in pixels; inside is positive."""
    y, x = np.mgrid[:48, :64]
    return 14.0 - np.hypot(y - 24.3, x - 31.6)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("logits.npy", _soft()), ("sam.npy", _soft()[None, None]), ("probability.npy", 1 / (1 + np.exp(-_soft()))),
        ("overshoot.npy", np.clip(_soft() / 4 + 0.5, -0.2, 1.2)),
        ("sigmoid.png", (255 / (1 + np.exp(-_soft()))).round().astype(np.uint8)),
        ("deep.png", (65535 / (1 + np.exp(-_soft()))).round().astype(np.uint16)),
        ("smooth.png", (255 * np.clip(_soft() + 0.5, 0, 1)).round().astype(np.uint8)),
        ("two.png", np.where(_soft() > 0, 249, 5).astype(np.uint8)),
        ("greys.npy", 255 * np.clip(_soft() + 0.5, 0, 1)),
        ("rgb.png", np.repeat((255 / (1 + np.exp(-_soft())))[..., None], 3, axis=2).round().astype(np.uint8)),
        ("compressed.png", (np.where(_soft() > 0, 250, 4)[..., None] + np.array([0, 3, 5])).astype(np.uint8)),
    ],
)  # fmt: skip
def test_soft_masks_are_read_over_half_and_said(tmp_path: Path, name: str, values: np.ndarray) -> None:
    if name.endswith(".npy"):
        np.save(tmp_path / name, values)
    else:
        Image.fromarray(values).save(tmp_path / name)
    mask = read_mask(tmp_path / name)
    differing = (mask.shown != (_soft() > 0)).sum()
    assert differing <= 0.002 * mask.shown.size  # rounding, at the rim
    assert "over" in mask.notes[0]
    assert mask.warnings == ()


def test_stacks_of_logits_are_read_over_half(tmp_path: Path) -> None:
    np.save(tmp_path / "sam.npy", np.stack([_soft(), -_soft(), _soft() - 5.0, _soft()]))
    np.testing.assert_array_equal(read_mask(tmp_path / "sam.npy", "2").shown, _soft() > 5.0)


def test_masks_of_segment_anything_are_told_by_their_areas(tmp_path: Path) -> None:
    masks = [np.zeros((48, 64), bool) for _ in range(2)]
    masks[0][:4, :5], masks[1][10:20, 10:13] = True, True
    entries = [{"segmentation": {"size": [48, 64], "counts": run_lengths(m)}, "area": int(m.sum())} for m in masks]
    (tmp_path / "sam.json").write_text(json.dumps({"annotations": entries}))
    with pytest.raises(ConfigError, match=r"it holds 2 masks, of 20, 30 pixels.*--mask-id 0 to 1"):
        read_mask(tmp_path / "sam.json")
    np.testing.assert_array_equal(read_mask(tmp_path / "sam.json", "1").shown, masks[1])


def test_numbers_of_objects_are_no_greys(tmp_path: Path) -> None:
    labels = np.zeros((48, 64), np.uint8)
    for i in range(12):
        labels[4 * i : 4 * i + 4, 5 * i : 5 * i + 5] = 20 * i + 20
    Image.fromarray(labels).save(tmp_path / "ids.png")
    mask = read_mask(tmp_path / "ids.png")
    np.testing.assert_array_equal(mask.shown, labels != 0)
    assert "--mask-id" in mask.warnings[0]


def test_a_depth_buffer_gets_a_hint(tmp_path: Path) -> None:
    near, far = 0.1, 10.0
    z = np.full((48, 64), far)
    z[10:30, 20:40] = np.linspace(0.6, 0.9, 20)
    buffer = far / (far - near) * (1.0 - near / z)
    for values in (buffer, buffer[10:30, 20:40] * 0.1 + 0.9, z / z.max()):
        np.save(tmp_path / "b.npy", values.astype(np.float32))
        assert "near * far" in read_depth(tmp_path / "b.npy").warnings[0]
    np.testing.assert_allclose(near * far / (far - buffer * (far - near)), z)  # the formula that the hint gives
    for values in (np.where(z < 1, z, 0.0), z):
        np.save(tmp_path / "b.npy", values.astype(np.float32))
        assert read_depth(tmp_path / "b.npy").warnings == ()
