"""``artperl estimate`` of an image with detections: what is written, and what is refused with which mend."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from artperl.commands.detections import MakeDetections
from artperl.commands.estimate import Estimate
from artperl.commands.estimate_scene import is_image_pair
from artperl.commands.estimators import named_estimators
from artperl.inputs.images import read_image
from artsim.errors import ConfigError
from artsim.scenes import SceneCameraOptions, SceneOptions, SceneRun, generate_scenes
from tests.artsim.datasets.conftest import quick_workers  # noqa: F401

RUN = SceneRun(
    SceneOptions(("laptop", "lighter"), distractors=0), SceneCameraOptions(width=320, height=180), renderer="raycast",
    num_points=64,
)  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("image")
    generate_scenes(RUN, root / "scenes", 1, seed=4, workers=1, progress=False)
    MakeDetections(root / "scenes", root / "detections.json").run()
    Image.new("RGB", (320, 180), (90, 90, 90)).save(root / "scenes" / "000004_0" / "rgb.png")
    return root


def command(folder: Path, **changes: object) -> Estimate:
    view = folder / "scenes" / "000004_0"
    own = {"clouds": (view / "rgb.png", view / "depth.npy"), "intrinsics": view / "scene.json",
           "detections": folder / "detections.json"}  # fmt: skip
    return Estimate(**(own | changes))  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.usefixtures("quick_workers")
def test_all_objects_are_written_with_a_picture(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command(folder, out=tmp_path / "out.json", picture=tmp_path / "out.png", mjcf=tmp_path / "sim").run()
    record = json.loads((tmp_path / "out.json").read_text())
    _check_simulation(tmp_path / "sim", [obj for obj in record["objects"] if "state" in obj])
    told = json.loads((folder / "detections.json").read_text())
    assert [obj["category"] for obj in record["objects"]] == [d["category"] for d in told]
    for obj in record["objects"]:
        if obj["category"] == "lighter":
            assert "--estimators lighter=" in obj["error"]
        else:
            assert np.shape(obj["T_camera_part"])[1:] == (4, 4)
    assert Image.open(tmp_path / "out.png").size == (320, 180)
    assert "laptop" in capsys.readouterr().out


def _check_simulation(folder: Path, records: list[dict[str, Any]]) -> None:
    """The scene has every estimated object in its pose and state, standing upright on the support."""
    import mujoco

    told = json.loads((folder / "scene.json").read_text())
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    T_world_camera = np.array(told["T_world_camera"])
    assert len(told["objects"]) == len(records) > 0
    upward = []
    for obj, record in zip(told["objects"], records, strict=True):
        T_part = T_world_camera @ np.array(record["T_camera_part"])
        bodies = [model.body(n).name for n in range(model.nbody) if model.body(n).name.startswith(f"{obj['name']}/")]
        assert len(bodies) == len(T_part)
        for body, T in zip(bodies, T_part, strict=True):
            np.testing.assert_allclose(data.body(body).xmat.reshape(3, 3), T[:3, :3], atol=1e-3)
        upward.append(T_part[0, :3, 2])
    np.testing.assert_allclose(np.mean(upward, axis=0)[:2], 0.0, atol=1e-6)
    lowest = min(data.geom(n).xpos[2] for n in range(model.ngeom))
    assert lowest >= 0.0


@pytest.mark.parametrize("mode", ["RGB", "RGBA", "P", "PA", "L", "LA", "I;16", "CMYK"])
def test_an_image_in_colour_is_one_in_any_mode(mode: str, tmp_path: Path) -> None:
    grey = np.repeat(np.random.default_rng(0).integers(0, 6, (30, 40, 1), dtype=np.uint8) * 51, 3, axis=2)
    file = tmp_path / ("image.tif" if mode in ("PA", "CMYK") else "image.png")
    (Image.fromarray(grey[..., 0].astype(np.uint16)) if mode == "I;16" else Image.fromarray(grey).convert(mode)).save(
        file
    )
    assert is_image_pair([file, tmp_path / "depth.npy"]) == (mode in ("RGB", "RGBA", "P", "PA"))
    if mode in ("I;16", "CMYK"):
        with pytest.raises(ConfigError, match="no image in colour"):
            read_image(file)
    else:
        assert np.array_equal(read_image(file), grey)


@pytest.mark.slow
@pytest.mark.usefixtures("quick_workers")
def test_what_does_not_fit_is_refused_with_its_mend(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    view = folder / "scenes" / "000004_0"
    depth = np.load(view / "depth.npy")
    np.save(tmp_path / "mm.npy", 1000 * depth)
    with pytest.raises(ConfigError, match="--unit mm"):
        command(folder, clouds=(view / "rgb.png", tmp_path / "mm.npy")).run()
    command(folder, clouds=(view / "rgb.png", tmp_path / "mm.npy"), unit="mm").run()
    with pytest.raises(ConfigError, match="name the image in colour"):
        command(folder, clouds=(view / "rgb.png",)).run()
    with pytest.raises(ConfigError, match="--intrinsics"):
        command(folder, intrinsics=None).run()
    with pytest.raises(ConfigError, match=r"gone\.png"):
        command(folder, clouds=(tmp_path / "gone.png", view / "depth.npy")).run()
    with pytest.raises(ConfigError, match="do not go with several objects"):
        command(folder, mask=view / "instance_ids.png").run()
    with pytest.raises(ConfigError, match="no image '9'"):
        command(folder, image_id="9").run()
    bad = json.loads((folder / "detections.json").read_text())
    bad.append({**bad[0], "bbox": [500, 10, 20, 20]})
    (tmp_path / "bad.json").write_text(json.dumps(bad))
    with pytest.raises(ConfigError, match=r"reaches outside the image of 320 x 180.*--skip-bad"):
        command(folder, detections=tmp_path / "bad.json").run()
    capsys.readouterr()
    command(folder, detections=tmp_path / "bad.json", skip_bad=True, out=Path("-")).run()
    assert "left out: detection" in caplog.text
    assert len(json.loads(capsys.readouterr().out)["skipped"]) == 1
    with pytest.raises(ConfigError, match="add --intrinsics"):
        Estimate((view / "depth.npy",), picture=tmp_path / "x.png").run()


def test_estimators_are_named_by_category(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="CATEGORY=NAME"):
        named_estimators((str(tmp_path),))
    assert named_estimators(("drawer=generic",))["drawer"].name == "generic"  # type: ignore[union-attr]
