"""A journal gives back whole lines alone; recipes differ by name."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from artsim.errors import ConfigError
from artsim.runs.kept import read_kept, write_kept
from artsim.runs.recipe import check_counts, differences
from artsim.runs.tasks import JOURNAL, Output, Run, Task, read_journal, run_tasks


def write(output: Output, name: str) -> str:
    output.write(name, name.encode())
    return f"made {name}"


def test_what_a_kill_has_cut_off_is_left_out_and_written_anew(tmp_path: Path) -> None:
    run, tasks = Run(tmp_path, {"seed": 1}, "done.json", "letters", "letter", progress=False), {
        name: Task(write, (name,)) for name in "abc"
    }  # fmt: skip
    assert read_journal(tmp_path) == []
    for name in "ab":
        write(made := Output(tmp_path), name)
        line = json.dumps([name, made.files, f"made {name}"])
        with (tmp_path / JOURNAL).open("a") as file:
            file.write(f'{line}\n["c", 4' if name == "b" else f'{{"seed": 1}}\n{line}\n')
    assert [line if isinstance(line, dict) else line[0] for line in read_journal(tmp_path)] == [{"seed": 1}, "a", "b"]
    (tmp_path / "b").write_text("damaged")
    values: list[dict[str, str]] = []
    files, made_now = run_tasks(run, tasks, 1, lambda found, output: values.append(found))
    assert made_now == 2
    assert values == [{name: f"made {name}" for name in "abc"}]
    assert {name: (tmp_path / name).read_text() for name in files} == {"a": "a", "b": "b", "c": "c"}
    assert read_journal(tmp_path) == []
    assert run_tasks(run, tasks, 1) == (files, 0)


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
