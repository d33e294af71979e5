"""``python -m benchmarks.inputs``: how many files load as given, and why others do not."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artsim import load
from artsim.errors import ArtsimError, ConfigError
from artsim.export import export
from artsim.families import make
from benchmarks.inputs import Options, Outcome, kind_of, load_all, main, object_files
from benchmarks.oracles import deviation
from tests.conftest import BOX_LAPTOP, absent, installed, valve


def test_the_last_line_counts_files_and_reasons(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "good").mkdir()
    (tmp_path / "good" / "laptop.urdf").write_text(BOX_LAPTOP)
    for name in ("one", "two"):
        (tmp_path / f"{name}.urdf").write_text(BOX_LAPTOP.replace("lid", f"lid_{name}").replace("revolute", name, 1))
    (tmp_path / "none.urdf").write_text("")
    main(Options((tmp_path, tmp_path / "good")))
    lines = capsys.readouterr().out.splitlines()
    counted = {
        "files": 4,
        "loaded": 1,
        "reasons": {"joint ...: joint type ... is not supported": 2, "the file is empty": 1},
    }
    assert json.loads(lines[-1]) == counted | {"formats": {"urdf": counted}}
    assert lines[-2] == "1 of 4 files load as given (25.0 %), 0 of them with repairs"
    assert sum(line.startswith("does not load: ") for line in lines) == 3


def test_mjcf_and_usd_files_are_compared_with_their_own_libraries(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those that the library itself refuses, or that hold no object, do not count."""
    installed("mujoco")
    installed("pxr")
    for category in ("drawer", "valve"):
        export(valve() if category == "valve" else make(category, 0), tmp_path / category, ["mjcf", "usd"])
    ball = '<body name="b" pos="1 0 0"><joint type="ball"/><geom size="1"/></body>'
    free = '<body name="c{}"><freejoint/><geom size="1"/></body>'
    for name, body in {"ball": ball, "scene": free.format(0) + free.format(1), "refused": "<no/>"}.items():
        (tmp_path / f"{name}.xml").write_text(f"<!-- a --><mujoco><worldbody>{body}</worldbody></mujoco>")
    (tmp_path / "other.xml").write_text("<launch/>")
    (tmp_path / "rigid.usda").write_text("#usda 1.0\n")
    main(Options((tmp_path,)))
    *lines, last = capsys.readouterr().out.splitlines()
    found = json.loads(last)
    assert (found["files"], found["loaded"]) == (6, 6)
    assert {name: one["files"] for name, one in found["formats"].items()} == {"mjcf": 4, "usd": 2}
    assert all(one["compared"] == one["files"] for one in found["formats"].values())
    assert found["formats"]["mjcf"]["max_deviation"] < 1e-12
    assert found["formats"]["usd"]["max_deviation"] < 1e-5  # joints of USD are in single precision
    assert "mjcf: 1 files do not count: MuJoCo does not compile it" in lines
    assert "usd: 1 files do not count: it holds no joint that moves" in lines


def test_a_deviation_is_seen() -> None:
    """The oracle moves by other joints: by the loader's own, it would not be one."""
    obj = make("drawer", 0)
    rng = np.random.default_rng(0)
    names = [part.name for part in obj.parts]

    def still(values: Mapping[str, float]) -> dict[str, Any]:
        return {name: np.eye(4) for name in names}

    parts, largest = deviation(obj, still, 3, rng)
    assert parts == len(obj)
    assert largest > 0.01


def test_a_file_that_takes_too_long_stops_nothing(tmp_path: Path) -> None:
    file = tmp_path / "laptop.urdf"
    file.write_text(BOX_LAPTOP)
    late, *_ = load_all([file], seconds=1e-6)
    assert late.error == f"{file}: no answer within 1e-06 s"


def test_reasons_forget_names_and_numbers() -> None:
    file = Path("/a/b.urdf")
    reasons = {kind_of(Outcome(file, f"{file}: link 'x{i}': {i}.5 is not /some/{i}. Fix: {i}")) for i in range(3)}
    assert reasons == {"link ...: N is not ..."}


def test_there_must_be_something_to_load(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no URDF, MJCF or USD file below"):
        object_files([tmp_path])
    with pytest.raises(ConfigError, match="no such folder"):
        object_files([tmp_path / "nowhere"])


@pytest.mark.slow
def test_pybullets_own_robots_load_as_given() -> None:
    """Of its files, those without the thousand random ones that are alike; each failure is known by its reason."""
    spec = importlib.util.find_spec("pybullet_data")
    if spec is None or not spec.submodule_search_locations:
        absent("pybullet_data is not installed: its files are not loaded")
    folder = Path(spec.submodule_search_locations[0])
    known = {
        "biped2d_pybullet.urdf": "lower='-1.57.'",
        "humanoid.urdf": "'spherical' is not supported",
        "husky.urdf": "not expanded",
        "microtaur.urdf": "is not 3 numbers",
        "racecar_differential.urdf": "--package-root",
        "spherical_joint_limit.urdf": "'spherical' is not supported",
        "torus_deform.urdf": "has no <link>",
    }
    for file in sorted(folder.rglob("*.urdf")):
        if "random_urdfs" in file.parts or file.stat().st_size > 40_000 or "vhacd" in file.name:
            continue  # alike, or slow
        if file.name in known:
            with pytest.raises(ArtsimError) as error:
                load(file)
            assert known[file.name] in str(error.value)
        else:
            assert len(load(file))
