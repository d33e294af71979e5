"""The comparison of two revisions takes ratios by the round, notices other bytes, and leaves no worktree."""

from __future__ import annotations

import subprocess
from importlib import import_module

import pytest

from artsim.errors import ConfigError
from benchmarks.compare import ROOT, Figure, Options, older_tree
from benchmarks.compared import MEASURES
from tests.conftest import absent


def answer(seconds: float, digest: str = "") -> dict[str, object]:
    return {"seconds": seconds, "count": 10, "digest": digest, "facts": {}}


def test_a_ratio_is_the_median_of_rounds_so_that_a_disturbed_one_does_not_count() -> None:
    figure = Figure()
    for old, new in ((2.0, 1.0), (2.0, 1.0), (20.0, 1.0)):
        figure.add(0, answer(old))
        figure.add(1, answer(new))
    record = figure.record()
    assert (record["ratio"], record["least"], record["most"]) == (2.0, 2.0, 20.0)
    assert record["seconds_each"] == [0.2, 0.1]
    assert "same" not in record


def test_other_bytes_are_noticed() -> None:
    figure = Figure()
    figure.add(0, answer(1.0, "a"))
    figure.add(1, answer(1.0, "b"))
    assert figure.record()["same"] is False


def test_each_measure_names_a_function() -> None:
    for measure in MEASURES.values():
        module, _, function = measure.prepare.partition(":")
        assert callable(getattr(import_module(f"benchmarks.compared.{module}"), function)), measure.prepare


def test_an_unknown_measure_and_an_unknown_revision_are_refused() -> None:
    with pytest.raises(ConfigError, match="no measure is called colours"):
        Options("HEAD", only=("colours",))
    if (ROOT / ".git").exists():
        with pytest.raises(ConfigError, match="no revision 'nowhere'"), older_tree("nowhere"):
            pass


def test_the_worktree_goes_when_the_work_is_over() -> None:
    if not (ROOT / ".git").exists():
        absent("this is not a git checkout")
    with older_tree("HEAD") as (tree, commit):
        assert len(commit) == 40
        assert (tree / "artsim" / "__init__.py").is_file()
    listed = subprocess.run(["git", "-C", str(ROOT), "worktree", "list"], capture_output=True, text=True).stdout
    assert not tree.exists()
    assert str(tree) not in listed
