"""Figures of the docs are of the weights and families that come along, or say that they are not."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from artperl.methods.estimator_files import WEIGHTS
from artsim.families import make
from tests.conftest import ROOT
from tests.figures import (
    RECORD,
    Figure,
    commands,
    lines_of,
    read_figures,
    recorded_anew,
    weights_digest,
    without_record,
)
from tests.reproduce import family_digest
from tests.test_docs import PAGES, TELL_THE_PAST

FIGURES = read_figures()
WITH_WEIGHTS = [page for page in [*PAGES, WEIGHTS / "README.md"] if page.name not in TELL_THE_PAST]


@pytest.mark.parametrize("figure", FIGURES, ids=lambda figure: f"{figure.page}:{figure.command}")
def test_a_figure_is_of_todays_weights_and_families_or_says_that_they_are_older(figure: Figure) -> None:
    complaint = figure.complaint((ROOT / figure.page).read_text())
    assert not complaint, complaint


@pytest.mark.parametrize("page", WITH_WEIGHTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_table_below_a_command_that_loads_shipped_weights_has_a_record(page: Path) -> None:
    name = page.relative_to(ROOT).as_posix()
    missing = without_record(page.read_text(), {figure.command for figure in FIGURES if figure.page == name})
    assert not missing, f"{name}: {missing}. Fix: add a line for each to {RECORD.name}, see tests/figures.py"


PAGE = """# Title

    artperl evaluate any
    artperl evaluate any --files \\
        folder  # real ones

Text.

| a | b |
|---|---|
| 1 | `python -m benchmarks.tracking` |
| 2 | `python -m benchmarks.growth` |

## Other

    artperl report

No table.

    python -m benchmarks.growth

| 3 |
"""


def test_tables_are_those_below_a_command_and_rows_are_their_own() -> None:
    found = {(heading, command): text for heading, command, text in commands(PAGE)}
    assert found["Title", "python -m benchmarks.tracking"] == "| 1 | `python -m benchmarks.tracking` |"
    assert "| 2 |" in found["Title", "artperl evaluate any --files folder"]
    assert "| 3 |" not in found["Other", "artperl report"]
    missing = without_record(PAGE, {"artperl evaluate any"})
    assert missing == ["'Title': artperl evaluate any --files folder", "'Title': python -m benchmarks.tracking"]


def test_changed_weights_are_told_by_page_heading_and_command_until_the_page_says_so() -> None:
    fresh = Figure("docs/page.md", "artperl evaluate any", {"any": ""}, {"laptop": "", "all": ""}).today()
    stale = replace(fresh, weights={"any": "0" * 12})
    assert fresh.complaint(PAGE) == ""
    told = stale.complaint(PAGE)
    assert "docs/page.md, 'Title': artperl evaluate any\n" in told
    assert "changed: weights any." in told
    assert "python -m tests.figures --record docs/page.md 'artperl evaluate any'" in told
    admitted = PAGE.replace("Text.", "Measured with older weights.")
    assert stale.complaint(admitted) == ""
    assert "remove" in fresh.complaint(admitted)
    assert "no command" in fresh.complaint("# Another page\n")
    assert replace(fresh, families={"laptop": "0" * 12}).changed() == ["family laptop"]


def test_one_figure_is_recorded_and_no_other() -> None:
    stale = [replace(figure, weights=dict.fromkeys(figure.weights, "")) for figure in FIGURES]
    which = next(i for i, figure in enumerate(FIGURES) if figure.weights and not figure.changed())
    anew = recorded_anew(stale, FIGURES[which].page, FIGURES[which].command)
    assert anew[which] == FIGURES[which]
    assert anew[:which] + anew[which + 1 :] == stale[:which] + stale[which + 1 :]
    assert [Figure(**record) for record in json.loads(lines_of(anew))] == anew
    assert lines_of(FIGURES) == RECORD.read_text()


def test_the_digest_of_weights_sees_networks_references_and_calibration_alone(tmp_path: Path) -> None:
    def digest_after(file: str, change: bytes, by: bytes) -> str:
        folder = tmp_path / f"{file}{by.hex()[:20]}"
        shutil.copytree(WEIGHTS / "laptop", folder)
        content = (folder / file).read_bytes()
        assert change in content
        (folder / file).write_bytes(content.replace(change, by, 1))
        return weights_digest(folder)

    shipped = weights_digest(WEIGHTS / "laptop")
    assert digest_after("estimator.json", b'"about": {', b'"about": {"note": 1, ') == shipped
    assert digest_after("estimator.json", b'"calibration": {', b'"calibration": {"other": 1, ') != shipped
    last = (WEIGHTS / "laptop" / "base.npz").read_bytes()[-30:]
    assert digest_after("base.npz", last, bytes(30)) != shipped
    assert digest_after("weights.safetensors", b"F16", b"F32") != shipped


def test_the_digest_of_a_family_sees_millimetres_and_no_micrometres() -> None:
    obj = make("laptop", 1)
    assert family_digest([obj.scaled(1 + 1e-9)]) == family_digest([obj])
    assert len({family_digest([other]) for other in (obj, obj.scaled(1.01), make("laptop", 2))}) == 3
