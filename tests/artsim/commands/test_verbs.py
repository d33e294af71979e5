"""The programs as a user runs them."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.programs import run_here as run

pytestmark = pytest.mark.slow

LAPTOP = "urdf_assets/laptop"
ARTSIM, GENERATE = "artsim", "generate.py"


def test_help_teaches() -> None:
    """By new processes, as a shell starts them."""
    result = subprocess.run([sys.executable, GENERATE, "--help"], capture_output=True, text=True, cwd=ROOT)
    assert result.returncode == 0
    for word in (
        "--objects",
        "--out",
        "--states.fraction-open",
        "--views.preset",
        "--renderer",
        "To make objects:",
        "To load objects:",
    ):
        assert word in result.stdout
    program = Path(sys.executable).with_name(ARTSIM)
    result = subprocess.run([program, "--help"], capture_output=True, text=True)
    for verb in ("generate", "families", "vary", "view", "inspect", "verify"):
        assert verb in result.stdout


@pytest.mark.parametrize("program", [ARTSIM, "artperl"])
def test_without_words_a_list_of_commands_fits_a_screen(program: str) -> None:
    bare = run(program)
    assert bare.returncode == 0
    assert bare.stdout == run(program, "--help").stdout
    assert len(bare.stdout.splitlines()) <= 50
    assert "Exit codes: 0" in bare.stdout
    assert run(program, "--completion", "fishing").returncode == 2


def test_help_of_a_command_fits_a_tall_screen_and_names_every_option() -> None:
    for program, verb in ((ARTSIM, "generate"), (ARTSIM, "scene"), ("artperl", "estimate"), ("artperl", "train")):
        brief, full = (run(program, verb, "--help", *more).stdout for more in ((), ("--verbose",)))
        assert len(brief.splitlines()) <= 60
        assert all(len(line) <= 150 for line in brief.splitlines())
        assert len(full.split()) > 1.2 * len(brief.split())
        options = re.findall(r"^(?:\W*)(--[a-z][\w.-]*\w)", full, re.MULTILINE)
        assert len(options) > 20
        assert {*options} <= {*re.findall(r"--[\w.-]+", brief)}
        assert brief.rindex("--quiet") > brief.rindex("--seed" if verb == "generate" else "--workers")


def test_bash_completes_commands_options_and_choices(tmp_path: Path) -> None:
    """By bash itself, as the key Tab has it call the function."""
    (tmp_path / "artsim").write_text(run(ARTSIM, "--completion", "bash").stdout)
    script = """source artsim
        tab() { COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)); _tyro_artsim; printf '%s\n' "${COMPREPLY[@]}"; }
        tab artsim ge; echo; tab artsim view --s; echo; tab artsim families --pack; echo; tab artsim convert --to h"""
    result = subprocess.run(["bash", "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
    found = [block.split("\n") for block in result.stdout.strip().split("\n\n")]
    assert [sorted(words) for words in found[:2]] == [
        ["generate", "generate-objects"],
        ["--samples", "--serve", "--split"],
    ]
    assert sorted(found[-1]) == ["hdf5", "huggingface"]


def test_a_mistyped_option_is_pointed_out() -> None:
    result = run(GENERATE, "--objects", LAPTOP, "--out", "x", "--num-sample", "3")
    assert result.returncode == 2
    assert "num-samples" in result.stdout + result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("words", [("genrate",), ("genrate", "--help"), ("",)])
def test_a_mistyped_command_is_pointed_out(words: tuple[str, ...]) -> None:
    result = run(ARTSIM, *words)
    assert result.returncode == 2
    assert "generate" in result.stderr
    assert "Traceback" not in result.stderr


def test_errors_are_one_line_and_exit_with_2(tmp_path: Path) -> None:
    broken = tmp_path / "broken.urdf"
    broken.write_text("<robot>")
    for arguments in (
        (ARTSIM, "inspect", str(broken)),
        (ARTSIM, "inspect", str(tmp_path / "nowhere")),
        (ARTSIM, "verify", str(tmp_path)),
        (ARTSIM, "view", str(tmp_path)),
        (GENERATE, "--objects", str(tmp_path / "nowhere"), "--out", str(tmp_path / "out")),
        (GENERATE, "--objects", "urdf_assets/laptop", "--out", str(tmp_path), "--num-points", "0"),
    ):
        result = run(*arguments)
        assert result.returncode == 2, arguments
        assert "Traceback" not in result.stderr
        assert "error" in result.stderr.lower() or "error" in result.stdout.lower()


def test_inspect_prints_tree_limits_boxes_and_repairs() -> None:
    result = run(ARTSIM, "inspect", "urdf_assets/quirks/chain")
    assert result.returncode == 0
    for text in (
        "7 parts, 6 free joints",
        "revolute 'j1'",
        "-114.6 to 114.6 deg",
        "turns freely",
        "repairs: 3",
        "axis of length 2",
    ):
        assert text in result.stdout
    assert "m/rad" in run(ARTSIM, "inspect", "urdf_assets/quirks/screw_helper").stdout
    assert "follows 1 x -1 + 0.1" in run(ARTSIM, "inspect", "urdf_assets/quirks/mimic_pair").stdout


def test_generate_verify_and_view_work_together(tmp_path: Path) -> None:
    out = tmp_path / "first"
    options = "--num-samples 20 --scale 0.5 1.0 --states.joint-range screen -1.5 0 --images depth part_mask"
    made = run(GENERATE, "--objects", "urdf_assets/laptop", "urdf_assets/scissors", "--out", str(out), *options.split())
    assert made.returncode == 0, made.stderr
    assert "20 samples" in made.stderr
    assert "sound" in run(ARTSIM, "verify", str(out)).stdout
    (out / "plan.json").write_text("{")
    shutil.copy(out / "train-000000.tar", out / "mine.tar")
    found = run(ARTSIM, "verify", str(out))
    assert found.returncode == 2
    assert "plan.json: is damaged (" in found.stdout
    assert f"Fix: artsim repair {out}" in found.stderr
    refused = run(ARTSIM, "repair", str(out))
    assert refused.returncode == 2
    assert "restored: plan.json" in refused.stdout
    assert "mine.tar: is no part of this dataset. Fix: move it out of the folder, or delete it" in refused.stdout
    (out / "mine.tar").unlink()
    assert f"{out}: nothing to repair" in run(ARTSIM, "repair", str(out)).stdout
    assert "already complete, 20 samples" in run(*made.args).stderr
    view = run(ARTSIM, "view", str(out), "--samples", "2", "--rerun", str(tmp_path / "r.rrd"))
    assert view.returncode == 0, view.stderr
    assert (out / "contact_sheet.png").stat().st_size > 10_000
    assert (tmp_path / "r.rrd").stat().st_size > 10_000


def test_families_tells_what_a_category_is_and_what_varies() -> None:
    told = run(ARTSIM, "families", "laptop", "drawer", "--objects", "3")
    assert told.returncode == 0, told.stderr
    for text in ("Laptops: a base with keyboard", "What varies", "of 3 objects", "revolute", "drawer", "handles"):
        assert text in told.stdout
    refused = run(ARTSIM, "families", "lapdog")
    assert refused.returncode == 2
    assert "no category 'lapdog'" in refused.stderr


def test_constraints_are_met_and_impossible_ones_refused(tmp_path: Path) -> None:
    out = str(tmp_path / "out")
    options = ("--category", "storage_furniture", "--count", "2", "--workers", "1", "--out", out)
    made = run(ARTSIM, "generate-objects", *options, "--having", "doors=2", "drawers=1..3")
    assert made.returncode == 0, made.stderr
    rows = (tmp_path / "out" / "index.csv").read_text().splitlines()[1:]
    assert all("door_1" in row and "door_2" not in row and "drawer_0" in row for row in rows)
    again = run(ARTSIM, "generate-objects", *options, "--having", "doors=2", "drawers=1..3")
    assert "already complete" in again.stderr
    other = run(ARTSIM, "generate-objects", *options, "--having", "doors=1")
    assert "2 objects made now" in other.stderr
    for having in ("doors=90", "doors", "handles=perhaps"):
        refused = run(ARTSIM, "generate-objects", *options, "--having", having)
        assert refused.returncode == 2
        assert "Fix:" in refused.stderr
        assert "Traceback" not in refused.stderr


def test_vary_writes_objects_that_inspect_reads_and_says_how_it_went(tmp_path: Path) -> None:
    made = run(ARTSIM, "vary", LAPTOP, "--count", "3", "--out", str(tmp_path / "out"))
    assert made.returncode == 0, made.stderr
    for text in ("3 variations", "passed at the first draw", "different trees", "operation: stretch"):
        assert text in made.stdout
    assert "2 parts" in run(ARTSIM, "inspect", str(tmp_path / "out" / "1")).stdout
    refused = run(ARTSIM, "vary", "urdf_assets/quirks/zero_axis", "--out", str(tmp_path / "none"))
    assert refused.returncode == 2
    assert "no joint can move" in refused.stderr
