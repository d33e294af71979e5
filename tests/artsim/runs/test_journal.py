"""A journal gives back whole lines alone; recipes differ by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from artsim.errors import ConfigError
from artsim.runs.journal import Journal
from artsim.runs.kept import read_kept, write_kept
from artsim.runs.recipe import check_counts, differences


def test_what_a_kill_has_cut_off_is_left_out_and_written_anew(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "progress.jsonl")
    assert journal.lines() == []
    journal.start([{"seed": 1}, ["a", 2]])
    journal.add(["b", 3.5])
    journal.path.write_bytes(journal.path.read_bytes() + b'["c", 4')
    assert journal.lines() == [{"seed": 1}, ["a", 2], ["b", 3.5]]
    journal.start(journal.lines())
    journal.add(["c", 4])
    assert journal.lines()[-2:] == [["b", 3.5], ["c", 4]]
    journal.remove()
    assert journal.lines() == []


def test_recipes_differ_by_the_names_of_what_is_asked_for() -> None:
    begun = {"seed": 1, "views": {"fov": 40, "preset": "sphere"}, "files": ["more"]}
    asked = {"seed": 1, "views": {"fov": 50, "preset": "sphere", "roll": 0}, "workers": 2}
    assert list(differences(begun, asked)) == [
        ("views.fov", 40, 50),
        ("views.roll", None, 0),
        ("workers", None, 2),
    ]
    assert list(differences(begun, begun)) == []


def test_figures_of_other_options_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "rows.json"
    assert read_kept(None, options=1) == read_kept(file, options=1) == {}
    write_kept(file, {"options": 1, "rows": {"a": 0.5}})
    assert read_kept(file, options=1)["rows"] == {"a": 0.5}
    with pytest.raises(ConfigError, match="other options"):
        read_kept(file, options=2)


def test_numbers_below_the_least_are_named() -> None:
    check_counts(0, seed=0)
    with pytest.raises(ConfigError, match="workers: 0 is not a count"):
        check_counts(shards=1, workers=0)
