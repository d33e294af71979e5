"""Rows of the benchmark are run with the right estimators."""

from __future__ import annotations

from pathlib import Path

from artperl.evaluation.benchmark import category_folder, run_benchmark
from artperl.methods.estimator_writing import save_estimator
from artperl.methods.full import Estimator
from artperl.perception.network import Perception
from tests.artperl.worlds import small_base


def test_rows_are_run_with_the_estimators_of_a_folder(tmp_path: Path) -> None:
    save_estimator(Estimator(Perception(2, 16), small_base("laptop")), tmp_path / "laptop" / "best", {})
    lines: list[str] = []
    figures = run_benchmark(["procedural"], ["laptop"], tmp_path, objects=1, views=2, say=lines.append)
    assert figures["procedural"]["laptop"]["instances"] == 2
    assert figures["procedural"]["laptop"]["objects"] == 1
    assert "published" in "\n".join(lines)


def test_runs_are_found_by_the_names_that_training_gives_them(tmp_path: Path) -> None:
    for name in ("laptop-long", "laptop-quick", "scissors-ancsh-quick", "scissors-quick"):
        (tmp_path / name / "best").mkdir(parents=True)
    assert category_folder(tmp_path, "laptop") == tmp_path / "laptop-long" / "best"
    assert category_folder(tmp_path, "scissors") == tmp_path / "scissors-quick" / "best"
    assert category_folder(tmp_path, "scissors", "ancsh") == tmp_path / "scissors-ancsh-quick" / "best"
    assert category_folder(tmp_path, "drawer") == tmp_path / "drawer"


def test_what_could_not_learn_from_real_objects_is_left_out_of_their_row(tmp_path: Path) -> None:
    """Drawers have one real object, to test on, and so no weights that learnt from others."""
    lines: list[str] = []
    figures = run_benchmark(["real_trained"], ["drawer", "scissors"], None, tmp_path, say=lines.append)
    assert figures == {"real_trained": {}}
    assert lines[1:] == ["drawer: no real object to learn from", "scissors: no real object to learn from"]
