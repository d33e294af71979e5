"""One camera, written as every tool writes it, with that tool's pixel centres, is the same camera."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from artperl.inputs import InputOptions, points_of_depth, read_cloud, read_intrinsics, read_points
from artperl.inputs.intrinsics import read_camera
from artperl.inputs.intrinsics_formats import Hints
from artsim.errors import ConfigError
from artsim.scenes.ground_truth import observe_scene, write_view
from artsim.scenes.random_scene import SceneCameraOptions, SceneOptions, make_scene, scene_camera

CASES = Path(__file__).parents[2] / "cases"
K = np.array([[376.617315730203, 0.0, 167.25], [0.0, 289.7056274847714, 116.5], [0.0, 0.0, 1.0]])
"""The first pixel's centre is at (0.5, 0.5)."""
THEIRS = K - [[0.0, 0.0, 0.5], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]]
"""The same camera where it is at (0, 0)."""
FX, FY, CX, CY = 376.617315730203, 289.7056274847714, 166.75, 116.0
SIZE = {"width": 320, "height": 240}
FOUR = {"fx": FX, "fy": FY, "cx": CX, "cy": CY}
FLAT = THEIRS.ravel().tolist()

ROS1 = f"""header:
  seq: 7
  stamp: {{secs: 1, nsecs: 2}}
  frame_id: "camera_depth_optical_frame"
height: 240
width: 320
distortion_model: "plumb_bob"
D: [0.0, 0.0, 0.0, 0.0, 0.0]
K: {FLAT}
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [{FX}, 0.0, {CX}, 0.0, 0.0, {FY}, {CY}, 0.0, 0.0, 0.0, 1.0, 0.0]
---
"""
ROS2 = "header:\n  frame_id: c\nheight: 240\nwidth: 320\nd:\n- 0.0\n- 0.0\nk:\n" + "".join(f"- {v}\n" for v in FLAT)
CALIBRATION = (
    f"""image_width: 320
image_height: 240
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: {FLAT[:6]}
""".replace(f"{FLAT[:6]}", str(FLAT))
    + "distortion_model: plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"
)
OPENCV = f"""%YAML:1.0
---
image_width: 320
image_height: 240
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ {", ".join(map(str, FLAT[:5]))},
       {", ".join(map(str, FLAT[5:]))} ]
"""

FORMATS: dict[str, Any] = {
    "ours.json": {"fx": FX, "fy": FY, "cx": CX + 0.5, "cy": CY + 0.5},
    "ours_K.json": {"K": K.tolist()},
    "ours_flat.json": {"K": K.ravel().tolist(), **SIZE},
    "scene.json": {"camera": {"K": K.tolist(), **SIZE, "T_world_camera": np.eye(4).tolist()}, "things": []},
    "bop_camera.json": {**FOUR, **SIZE, "depth_scale": 1.0},
    "bop_K.json": {"cam_K": FLAT, "depth_scale": 1.0},
    "scene_camera.json": {"3": {"cam_K": FLAT, "depth_scale": 1.0}},
    "open3d.json": {**SIZE, "intrinsic_matrix": THEIRS.T.ravel().tolist()},
    "open3d_view.json": {"extrinsic": [1.0] * 16, "intrinsic": {**SIZE, "intrinsic_matrix": THEIRS.T.ravel().tolist()}},
    "realsense.json": {**SIZE, "fx": FX, "fy": FY, "ppx": CX, "ppy": CY, "model": 4, "coeffs": [0, 0, 0, 0, 0]},
    "realsense_both.json": {
        "color": {"width": 640, "height": 480, "fx": 600, "fy": 600, "ppx": 320, "ppy": 240},
        "depth": {**SIZE, "fx": FX, "fy": FY, "ppx": CX, "ppy": CY}, "depth_units": 0.001,
    },
    "ros1.json": {**SIZE, "K": FLAT, "D": [0, 0], "R": [0] * 9, "distortion_model": "plumb_bob"},
    "ros2.json": {**SIZE, "k": FLAT, "d": [], "p": [0] * 12},
    "ros1.yaml": ROS1, "ros2.yml": ROS2, "calibration.yaml": CALIBRATION, "opencv.yaml": OPENCV,
    "ours.yaml": f"fx: {FX}\nfy: {FY}\ncx: {CX + 0.5}\ncy: {CY + 0.5}\n",
    "transforms.json": {"fl_x": FX, "fl_y": FY, "cx": CX + 0.5, "cy": CY + 0.5, "w": 320, "h": 240, "frames": []},
    "record3d.json": {"intrinsics": THEIRS.T.ravel().tolist(), "w": 320, "h": 240},
    "matrix.txt": "\n".join(" ".join(map(str, row)) for row in THEIRS.tolist()),
    "matrix4.txt": "\n".join(" ".join(map(str, [*row, 0.0])) for row in THEIRS.tolist()) + "\n0 0 0 1\n",
    "matrix.csv.txt": "\n".join(",".join(map(str, row)) for row in THEIRS.tolist()),
}  # fmt: skip


@pytest.fixture(params=sorted(FORMATS))
def written(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    content = FORMATS[request.param]
    (tmp_path / request.param).write_text(content if isinstance(content, str) else json.dumps(content))
    return tmp_path / request.param


@pytest.mark.filterwarnings("error")
def test_every_format_gives_the_same_points(written: Path) -> None:
    np.testing.assert_allclose(read_intrinsics(written), K, rtol=0, atol=1e-9)
    case = CASES / "S01"
    expected = read_points(case / "depth.png", case / "mask.png", case / "cam.json")
    np.testing.assert_allclose(read_points(case / "depth.png", case / "mask.png", written), expected, rtol=0, atol=1e-9)


def test_arrays_are_matrices(tmp_path: Path) -> None:
    np.save(tmp_path / "K.npy", THEIRS)
    np.savez(tmp_path / "K.npz", K=THEIRS, dist=np.zeros(5))
    for name in ("K.npy", "K.npz"):
        np.testing.assert_allclose(read_intrinsics(tmp_path / name), K, rtol=0, atol=1e-9)


def test_where_pixel_centres_are_can_be_said(tmp_path: Path) -> None:
    (tmp_path / "c.json").write_text(json.dumps(FOUR))
    (tmp_path / "b.json").write_text(json.dumps({"cam_K": K.ravel().tolist()}))
    np.testing.assert_array_equal(read_intrinsics(tmp_path / "c.json"), THEIRS)
    np.testing.assert_array_equal(read_intrinsics(tmp_path / "c.json", "0"), K)
    np.testing.assert_array_equal(read_intrinsics(tmp_path / "b.json", "0.5"), K)
    assert "(0, 0), as asked for" in read_camera(tmp_path / "c.json", None, "0").notes[0]


def test_the_camera_of_the_image(tmp_path: Path) -> None:
    cameras = {str(n): {"cam_K": [100.0 + n, 0, 9.5, 0, 100, 9.5, 0, 0, 1], "depth_scale": 0.1 * n} for n in (1, 2, 7)}
    path = tmp_path / "scene_camera.json"
    path.write_text(json.dumps(cameras))
    assert read_camera(path, Hints(name="000007")).K[0, 0] == 107.0
    assert read_camera(path, Hints(name="frame-000002.depth")).depth_scale == pytest.approx(0.0002)
    assert read_camera(path, Hints(image_id="1", name="000007")).K[0, 0] == 101.0
    for hints in (Hints(), Hints(name="depth"), Hints(name="000003"), Hints(name="7_2"), Hints("4"), Hints("x")):
        with pytest.raises(ConfigError, match="--image-id"):
            read_camera(path, hints)


def test_depth_scales_are_the_formats_own(tmp_path: Path) -> None:
    case, options = CASES / "S03", InputOptions(mask=CASES / "S03" / "mask.png", intrinsics=CASES / "S03" / "cam.json")
    raw = np.asarray(Image.open(case / "depth.png")) * 1e-4
    np.testing.assert_allclose(np.unique(read_cloud(case / "depth.png", options).points[:, 2]),
                               np.unique(raw[np.asarray(Image.open(case / "mask.png")) > 0]))  # fmt: skip
    given = InputOptions(mask=options.mask, intrinsics=options.intrinsics, depth_scale=0.002)
    ratio = read_cloud(case / "depth.png", given).points[:, 2] / read_cloud(case / "depth.png", options).points[:, 2]
    np.testing.assert_allclose(ratio, 20.0)
    np.save(tmp_path / "metres.npy", raw)  # a scale is for whole numbers
    metres = InputOptions(mask=options.mask, intrinsics=options.intrinsics)
    np.testing.assert_allclose(
        read_cloud(tmp_path / "metres.npy", metres).points, read_cloud(case / "depth.png", options).points
    )
    for content in (
        {**FOUR, "depth_scale": 1000.0},
        {**FOUR, "depth_scale": 0.001},
        {"ppx": 1, "ppy": 1, **FOUR, "depth_units": 1.0},
    ):
        (tmp_path / "c.json").write_text(json.dumps(content))
        with pytest.raises(ConfigError, match="--depth-scale"):
            read_camera(tmp_path / "c.json")


def test_intrinsics_that_are_not_of_the_image_are_refused(tmp_path: Path) -> None:
    def said(content: dict[str, Any]) -> str:
        (tmp_path / "c.json").write_text(json.dumps(content))
        with pytest.raises(ConfigError) as error:
            read_points(CASES / "S01" / "depth.png", None, tmp_path / "c.json")
        return str(error.value)

    double = {"fx": 2 * FX, "fy": 2 * FY, "cx": 334.5, "cy": 233.0}
    text = said({**double, "width": 640, "height": 480})
    assert "640 x 480" in text
    assert "320 x 240" in text
    assert '{"fx": 376.6173, "fy": 289.7056, "cx": 167.25, "cy": 116.5}' in text  # to be pasted
    assert "principal point (334.5, 233)" in said(double)
    assert "principal point" in said({**FOUR, "cx": 5000.0})
    text = said({"K": [FX / 320, 0, 167.25 / 320, 0, FY / 240, 116.5 / 240, 0, 0, 1]})
    assert '{"fx": 376.6173, "fy": 289.7056, "cx": 167.25, "cy": 116.5}' in text
    assert "divided by the size" in said({"fx": 1.1, "fy": 1.2, "cx": 0.5, "cy": 0.5, "width": 320, "height": 240})
    assert "focal lengths" in said({**FOUR, "fx": 1e9})


def test_what_is_not_undone_is_said(tmp_path: Path) -> None:
    (tmp_path / "c.json").write_text(json.dumps({**FORMATS["realsense.json"], "coeffs": [0.1, -0.2, 0, 0, 0]}))
    assert "distortion (0.1, -0.2" in read_camera(tmp_path / "c.json").warnings[0]
    (tmp_path / "c.yaml").write_text(ROS1.replace("D: [0.0", "D: [0.3"))
    assert "distortion" in read_camera(tmp_path / "c.yaml").warnings[0]
    (tmp_path / "c.json").write_text(json.dumps({**FOUR, "cx": 20.0}))
    cloud = read_cloud(CASES / "S01" / "depth.png", InputOptions(intrinsics=tmp_path / "c.json"))
    assert "far from the middle" in cloud.warnings[0]


@pytest.mark.slow
def test_a_written_scene_is_read_as_it_was_rendered(tmp_path: Path) -> None:
    """Whatever artsim writes: the depth image, the instance mask and the camera of a scene."""
    scene = make_scene(SceneOptions(categories=("laptop", "box"), distractors=0), 3)
    camera = scene_camera(scene, SceneCameraOptions(width=160, height=120), 3)
    (view,) = observe_scene(scene, [camera], num_points=64)
    write_view(view, tmp_path)
    read = 0
    for i, sample in enumerate(view.samples):
        if sample is not None:
            expected = points_of_depth(view.depth, camera.K, view.frame.instance_ids == i)
            for mask in ({"mask": tmp_path / "instance_ids.png", "mask_id": f"{i}"},
                         {"mask": tmp_path / f"instance_{i}.part_mask.png"}):  # fmt: skip
                options = InputOptions(intrinsics=tmp_path / "scene.json", **mask)
                cloud = read_cloud(tmp_path / "depth.npy", options)
                np.testing.assert_allclose(cloud.points, expected, rtol=0, atol=1e-9)
                assert cloud.warnings == ()
            read += 1
    assert read > 0


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{}", '{"K": [1, 2]}', '{"fx": 1}', '{"K": "none"}', "[" * 100_000, '{"a":' * 100_000, '{"cam_K": null}',
     '{"1": {"cam_K": {}}}', '{"K": [[1, 0, 1], [0, -1, 1], [0, 0, 1]]}', '{"fx": true, "fy": 1, "cx": 1, "cy": 1}',
     '{"fx": NaN, "fy": 1, "cx": 1, "cy": 1}', '{"camera": {"camera": {"camera": {"camera": {"camera": {"K": 1}}}}}}'],
)  # fmt: skip
def test_other_intrinsics_are_refused(tmp_path: Path, content: str) -> None:
    for name in ("camera.json", "camera.yaml", "camera.txt"):
        (tmp_path / name).write_text(content)
        with pytest.raises(ConfigError, match=r"intrinsic|focal|no camera"):
            read_intrinsics(tmp_path / name)


def test_references_of_yaml_are_not_followed(tmp_path: Path) -> None:
    lines = ["a0: &a0 [1, 1]"] + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 12)]
    (tmp_path / "c.yaml").write_text("\n".join(lines))
    with pytest.raises(ConfigError, match="references"):
        read_intrinsics(tmp_path / "c.yaml")
    (tmp_path / "c.yaml").write_text(f"K: !!python/object/apply:pathlib.Path.touch [{tmp_path / 'ran'}]")
    with pytest.raises(ConfigError):
        read_intrinsics(tmp_path / "c.yaml")
    assert not (tmp_path / "ran").exists()


def test_the_damaged_file_of_the_cases_is_one_clear_error() -> None:
    (case,) = (CASES / "hostile").glob("fuzz_inputs_*")
    with pytest.raises(ConfigError, match="no intrinsics"):
        read_intrinsics(case)
