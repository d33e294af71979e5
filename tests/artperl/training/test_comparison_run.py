"""A comparison trains what it needs, goes on where it stopped, and refuses rows of other options."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from artperl.evaluation.robotarm import seven_part_arm
from artperl.training.comparison_run import (
    ComparisonOptions,
    arm_folder,
    quick_comparison,
    run_comparison,
    training_options,
)
from artsim.errors import ConfigError
from artsim.loading.urdf import load

TINY = replace(
    quick_comparison(ComparisonOptions(methods=("full", "ancsh"))), views=2, objects=1, num_points=512,
)  # fmt: skip


@pytest.mark.slow
def test_a_report_has_every_method_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    said: list[str] = []
    report = run_comparison(TINY, tmp_path, 0, False, said.append)
    assert set(report["rows"]["laptop"]) == {"full, shipped", "ancsh"}
    assert report["rows"]["laptop"]["full, shipped"]["parts"][0]["rotation_deg"]["mean"] < 5.0
    assert any("training 0.0 min" in line and "full" in line for line in said)
    text = (tmp_path / "report.md").read_text()
    assert "| A-NCSH |" in text
    assert json.loads((tmp_path / "report.json").read_text())["rows"] == report["rows"]

    row = tmp_path / "rows" / "laptop-ancsh.json"
    known = json.loads(row.read_text())
    known["record"]["seconds"] = 1234.5  # a row that is measured is not measured again
    row.write_text(json.dumps(known))
    (tmp_path / "rows" / "laptop-full-shipped.json").unlink()
    again = run_comparison(TINY, tmp_path, 0, False, said.append)
    assert again["rows"]["laptop"]["ancsh"]["seconds"] == 1234.5
    row.unlink()  # a run that has come to its end is not run again
    run_comparison(TINY, tmp_path, 0, False, said.append)
    assert sum("training ancsh" in line for line in said) == 1
    with pytest.raises(ConfigError, match="figures of other options"):
        run_comparison(replace(TINY, views=1), tmp_path, 0, False, said.append)


@pytest.mark.slow
def test_in_equal_minutes_full_learns_like_the_others_beside_its_shipped_weights(tmp_path: Path) -> None:
    said: list[str] = []
    asked = replace(TINY, minutes=0.05)
    rows = run_comparison(asked, tmp_path, 1, False, said.append)["rows"]["laptop"]
    assert list(rows) == ["full", "full, shipped", "ancsh"]
    assert rows["full, shipped"]["trained_core_minutes"] is None
    for method in ("full", "ancsh"):
        assert 0.01 < rows[method]["trained_core_minutes"] < 0.2  # on a busy machine, too
        assert (tmp_path / "train" / f"laptop-{method}-lengths.json").is_file()
    shipped, trained = (rows[name]["parts"][0]["rotation_deg"]["mean"] for name in ("full, shipped", "full"))
    assert shipped < 5.0
    assert trained != shipped
    (tmp_path / "rows" / "laptop-full.json").unlink()
    again = run_comparison(asked, tmp_path, 1, False, said.append)["rows"]["laptop"]
    assert again["full"]["trained_core_minutes"] == pytest.approx(rows["full"]["trained_core_minutes"])
    assert again["full"]["parts"] == rows["full"]["parts"]
    with pytest.raises(ConfigError, match="nothing is learnt"):
        replace(TINY, minutes=0.0)


@pytest.mark.slow
def test_real_objects_are_another_row_of_the_same_trainings(tmp_path: Path, partnet_dir: Path) -> None:
    said: list[str] = []
    asked = replace(TINY, methods=("full",), categories=("laptop", "scissors"), row="real", partnet=str(partnet_dir))
    report = run_comparison(asked, tmp_path, 0, False, said.append)
    assert "scissors: no real object to test on" in said
    assert report["rows"]["laptop"]["full, shipped"]["objects"] == 7
    assert report["rows"]["laptop"]["full, shipped"]["parts"][0]["rotation_deg"]["mean"] < 5.0
    assert str(partnet_dir) not in (tmp_path / "report-real.json").read_text()
    assert "Objects are real" in (tmp_path / "report-real.md").read_text()
    assert [path.name for path in (tmp_path / "rows").iterdir()] == ["laptop-full-shipped-real.json"]


def test_real_objects_are_asked_for_where_there_are_some() -> None:
    with pytest.raises(ConfigError, match="set ARTSIM_PARTNET_DIR"):
        ComparisonOptions(row="real")
    with pytest.raises(ConfigError, match="there is no real scissors"):
        ComparisonOptions(categories=("scissors",), row="real", partnet="partnet")
    with pytest.raises(ConfigError, match="robotarm has no real objects"):
        ComparisonOptions("robotarm", row="real", partnet="partnet")


def test_methods_and_categories_are_those_of_the_benchmark() -> None:
    with pytest.raises(ConfigError, match="robotarm has no omad"):
        ComparisonOptions("robotarm", methods=("omad",))
    with pytest.raises(ConfigError, match=r"artimage has no faucet.*laptop"):
        ComparisonOptions(categories=("faucet",))
    assert len(ComparisonOptions().of_categories) == 5


def test_the_arm_has_seven_parts_in_a_chain_and_all_of_its_methods_learn_from_its_file(tmp_path: Path) -> None:
    arm = load(arm_folder(tmp_path))
    assert len(arm) == len(seven_part_arm()) == 7
    assert arm.tree.parents.tolist() == [-1, 0, 1, 2, 3, 4, 5]
    options = ComparisonOptions("robotarm")
    for method in options.of_methods:
        learning = training_options(options, "robot_arm", method, tmp_path)
        assert learning.objects == (str(tmp_path / "arm"),)
        assert learning.noisy > 0.0
        assert learning.degraded > 0.0  # test clouds are cut out by masks that are not exact
        assert learning.method == method
    with pytest.raises(ConfigError, match="only the benchmark robotarm"):
        ComparisonOptions("artimage", arm="arm.urdf")
