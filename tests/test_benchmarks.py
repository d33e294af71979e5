"""Programs that measure, run as their users run them: what they print is so."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artperl.evaluation.artimage import row_objects, row_samples
from artperl.evaluation.metrics import rotation_error
from artperl.methods.estimator_files import load_estimator
from artsim.export import export
from artsim.families import make
from tests.conftest import BOX_LAPTOP, ROOT, absent, installed, valve
from tests.programs import run_here

pytestmark = pytest.mark.slow


def run(name: str, *options: object, code: int = 0) -> tuple[list[str], str]:
    """Lines that a program prints, and what it says of an error."""
    if name == "inputs":  # what its workers answer is of the program that they were started by
        words = [sys.executable, "-m", f"benchmarks.{name}", *map(str, options)]
        done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    else:
        done = run_here(f"benchmarks.{name}", *options)
    assert done.returncode == code, done.stderr[-3000:]
    return done.stdout.splitlines(), done.stderr


def figures(name: str, *options: object) -> Any:
    """The JSON object of the last line."""
    return json.loads(run(name, *options)[0][-1])


def test_no_test_imports_a_benchmark() -> None:
    for path in (ROOT / "tests").rglob("*.py"):
        text = path.read_text()
        assert f"from {'benchmarks'}" not in text, path
        assert f"\nimport {'benchmarks'}" not in text, path


def test_inputs_counts_files_and_reasons_without_names_and_numbers(tmp_path: Path) -> None:
    (tmp_path / "good").mkdir()
    (tmp_path / "good" / "laptop.urdf").write_text(BOX_LAPTOP)
    for name in ("one", "two"):
        (tmp_path / f"{name}.urdf").write_text(BOX_LAPTOP.replace("lid", f"lid_{name}").replace("revolute", name, 1))
    (tmp_path / "none.urdf").write_text("")
    lines, _ = run("inputs", tmp_path, tmp_path / "good")
    counted = {
        "files": 4,
        "loaded": 1,
        "reasons": {"joint ...: joint type ... is not supported": 2, "the file is empty": 1},
        "compared": 1,
        "parts": 2,
    }
    found = json.loads(lines[-1])
    assert {name: found["formats"]["urdf"][name] for name in counted} == counted
    assert {name: found[name] for name in counted} == counted
    assert found["max_deviation"] < 1e-9
    assert lines[-2] == "1 of 4 files load as given (25.0 %), 0 of them with repairs"
    assert sum(line.startswith("does not load: ") for line in lines) == 3


def test_inputs_compares_mjcf_and_usd_files_with_their_own_libraries(tmp_path: Path) -> None:
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
    *lines, last = run("inputs", tmp_path)[0]
    found = json.loads(last)
    assert (found["files"], found["loaded"]) == (6, 6)
    assert {name: one["files"] for name, one in found["formats"].items()} == {"mjcf": 4, "usd": 2}
    assert all(one["compared"] == one["files"] for one in found["formats"].values())
    assert found["formats"]["mjcf"]["max_deviation"] < 1e-12
    assert found["formats"]["usd"]["max_deviation"] < 1e-5  # joints of USD are in single precision
    assert "mjcf: 1 files do not count: MuJoCo does not compile it" in lines
    assert "usd: 1 files do not count: it holds no joint that moves" in lines


def test_a_file_that_takes_too_long_stops_nothing(tmp_path: Path) -> None:
    file = tmp_path / "laptop.urdf"
    file.write_text(BOX_LAPTOP)
    assert f"does not load: {file}: no answer within 1e-06 s" in run("inputs", file, "--seconds", "1e-6")[0]


def test_there_must_be_something_to_load(tmp_path: Path) -> None:
    assert "no URDF, MJCF or USD file below" in run("inputs", tmp_path, code=2)[1]
    assert "no such folder" in run("inputs", tmp_path / "nowhere", code=2)[1]


def test_two_revisions_that_are_the_same_give_the_same_bytes_and_no_worktree_stays() -> None:
    if not (ROOT / ".git").exists():
        absent("this is not a git checkout")
    code = "import pathlib\ndef work():\n    return 10, b'same'"
    assert figures("compare", "HEAD", "--code", code, "--rounds", 2)["measures"]["code"]["same"] is True
    own = "import artsim\ndef work():\n    return 1, artsim.__file__.encode()"  # each side has its own packages
    assert figures("compare", "HEAD", "--code", own, "--rounds", 1)["measures"]["code"]["same"] is False
    assert "failed" in figures("compare", "HEAD", "--code", "import nothing")["measures"]["code"]
    listed = subprocess.run(["git", "-C", str(ROOT), "worktree", "list"], capture_output=True, text=True).stdout
    assert len(listed.splitlines()) == 1 or "/tmp" not in listed


def test_an_unknown_measure_and_an_unknown_revision_are_refused() -> None:
    assert "no measure is called colours" in run("compare", "HEAD", "--only", "colours", code=2)[1]
    if (ROOT / ".git").exists():
        assert "no revision 'nowhere'" in run("compare", "nowhere", code=2)[1]


def test_a_family_without_real_objects_is_refused() -> None:
    assert "there is no real 'dragon'" in run("held_out", "--categories", "dragon", code=2)[1]


def test_errors_are_told_by_points_and_true_labels_are_used() -> None:
    options = ("--categories", "drawer", "--objects", 3, "--views", 1)
    own, told = figures("errors", *options)["drawer"], figures("errors", *options, "--true-labels")["drawer"]
    for found in (own, told):
        assert found["all"]["parts"] == 9
        for by in ("points", "percent moved"):
            assert sum(means["parts"] for means in found[by].values()) == 9
        known = [found["all"][f"{axis} known"] for axis in "xyz"]
        assert max(known) > found["all"]["posed"]
    assert told["all"]["labelled"] > 0.95
    assert told["all"]["labelled"] >= own["all"]["labelled"]


def test_stages_end_with_the_estimate_and_the_truth_stays_the_truth() -> None:
    found = figures("stages", "--categories", "laptop", "--rows", "procedural", "--objects", 2, "--views", 2)[
        "procedural"
    ]["laptop"]
    method = load_estimator("laptop", method="artperl")
    samples = row_samples("procedural", row_objects("procedural", "laptop", objects=2), 2)
    estimates = [method(sample.points) for sample in samples]
    truth = [sample.T_camera_part[:, :3, :3] for sample in samples]
    off = [rotation_error(one.rotation, true) for one, true in zip(estimates, truth, strict=True)]
    last = [part["mean"] for part in found["method"]["refinement"]]
    np.testing.assert_allclose(last, np.mean(off, axis=0), atol=0.01)
    starts = [rotation_error(one.trajectory[0, :, :3, :3], t) for one, t in zip(estimates, truth, strict=True)]
    assert np.mean([part["mean"] for part in found["method"]["best start"]]) <= np.mean(starts) + 0.01
    assert max(part["mean"] for part in found["own shape, true labels"]["from the truth"]) < 1.0
    assert found["rank"] >= 1


def test_renderers_that_draw_the_same_agree() -> None:
    found = figures("renderers", "--objects", 0, "--procedural", 2, "--states", 1, "--renderers", "raycast", "pybullet")
    assert found["pybullet"]["agrees"]
    assert found["raycast"]["fps"]["128x128"] > found["raycast"]["fps"]["640x480"] > 0
