"""Figures of the docs are those of results/, where each has its command and what it was measured with."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from artperl.methods.estimator_folders import WEIGHTS
from artsim.families import make
from tests.conftest import ROOT
from tests.digests import weights_digest
from tests.programs import run_here
from tests.reproduce import family_digest

FOLDER = ROOT / "results"
NAMES = sorted(path.stem for path in FOLDER.glob("*.json"))
PAGES = ("artperl_results.md", "measured.md", "experiments.md")
NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e-\d+)?|\.\d+")


def results(folder: Path, *options: str) -> CompletedProcess[str]:
    return run_here("benchmarks.results", "--folder", folder, *options)


def numbers(text: str) -> set[str]:
    return set(NUMBER.findall(re.sub(r"(?<=\d),(?=\d{3})", "", text)))


@pytest.mark.parametrize("name", NAMES)
def test_a_result_names_its_command_and_its_page_has_what_it_printed(name: str) -> None:
    record, page = json.loads((FOLDER / f"{name}.json").read_text()), (FOLDER / f"{name}.md").read_text()
    assert page.startswith(f"# {name}\n\n    ")
    assert all(f"    {line}\n" in page for line in record["command"].splitlines())
    assert all(digest in page for kind in ("weights", "families") for digest in record[kind].values())
    assert record["date"] in page
    assert len(numbers(page.partition(record["machine"])[2])) > 0


@pytest.mark.parametrize("page", PAGES)
def test_numbers_in_tables_of_the_docs_stand_in_the_results_that_they_link(page: str) -> None:
    text = (ROOT / "docs" / page).read_text()
    checked = 0
    for section in re.split(r"^(?=#)", text, flags=re.M):
        for block in re.findall(r"(?:^\|.*\n)+", section, re.M):
            for row in block.splitlines()[2:]:
                linked = re.findall(r"\.\./results/([\w-]+)\.md", row) or re.findall(
                    r"\.\./results/([\w-]+)\.md", section
                )
                if linked:
                    cells = re.sub(r"\[[^\]]*\]\([^)]*\)", "", row.partition("|")[2].partition("|")[2])
                    known = set[str]().union(*(numbers((FOLDER / f"{name}.md").read_text()) for name in linked))
                    assert numbers(cells) <= known, (row, numbers(cells) - known)
                    checked += 1
    assert checked >= 3


@pytest.mark.slow
def test_the_index_says_which_results_are_of_todays_weights_and_families(tmp_path: Path) -> None:
    folder = shutil.copytree(FOLDER, tmp_path / "results")
    done = results(folder, "--list")
    assert (folder / "README.md").read_text() == (FOLDER / "README.md").read_text(), (
        "Fix: python -m benchmarks.results --list"
    )
    chosen = json.loads(done.stdout.splitlines()[-1])["chosen"]
    assert {
        name for name in NAMES if re.search(rf"\[{name}\].*(older:|to be run)", (folder / "README.md").read_text())
    } == set(chosen)


@pytest.mark.slow
def test_what_is_missing_or_stale_is_run_and_no_other(tmp_path: Path) -> None:
    def record(name: str) -> dict[str, Any]:
        found: dict[str, Any] = json.loads((tmp_path / f"{name}.json").read_text())
        return found

    (tmp_path / "good.json").write_text(
        json.dumps({"command": "echo a table; echo '{\"a\": 1}'", "weights": {"laptop": ""}, "families": {"all": ""}})
    )
    (tmp_path / "bad.json").write_text(json.dumps({"command": "false"}))
    done = results(tmp_path)
    assert done.returncode == 1
    assert json.loads(done.stdout.splitlines()[-1]) == {"chosen": ["bad", "good"], "failed": ["bad"]}
    assert record("good")["figures"] == {"a": 1}
    assert record("good")["weights"] == {"laptop": weights_digest("laptop")}
    assert record("good")["date"]
    assert "a table" in (tmp_path / "good.md").read_text()
    assert not (tmp_path / "bad.md").exists()
    assert json.loads(results(tmp_path, "--list").stdout.splitlines()[-1])["chosen"] == ["bad"]
    (tmp_path / "good.json").write_text(json.dumps(record("good") | {"weights": {"laptop": "0" * 12}}))
    assert json.loads(results(tmp_path, "--list").stdout.splitlines()[-1])["chosen"] == ["bad", "good"]
    assert "| older: laptop |" in (tmp_path / "README.md").read_text()
    assert results(tmp_path, "--only", "good").returncode == 0
    assert "there is no result 'other'" in results(tmp_path, "--only", "other").stderr


def test_the_digest_of_weights_sees_networks_references_and_calibration_alone(tmp_path: Path) -> None:
    def digest_after(file: str, change: bytes, by: bytes) -> str:
        folder = tmp_path / f"{file}{by.hex()[:20]}"
        shutil.copytree(WEIGHTS / "laptop", folder)
        content = (folder / file).read_bytes()
        assert change in content
        (folder / file).write_bytes(content.replace(change, by, 1))
        return weights_digest(folder)

    shipped = weights_digest("laptop")
    assert digest_after("estimator.json", b'"about": {', b'"about": {"note": 1, ') == shipped
    assert digest_after("estimator.json", b'"calibration": {', b'"calibration": {"other": 1, ') != shipped
    last = (WEIGHTS / "laptop" / "base.npz").read_bytes()[-30:]
    assert digest_after("base.npz", last, bytes(30)) != shipped
    assert digest_after("weights.safetensors", b"F16", b"F32") != shipped


def test_the_digest_of_a_family_sees_millimetres_and_no_micrometres() -> None:
    obj = make("laptop", 1)
    assert family_digest([obj.scaled(1 + 1e-9)]) == family_digest([obj])
    assert len({family_digest([other]) for other in (obj, obj.scaled(1.01), make("laptop", 2))}) == 3


def test_results_name_no_folder_of_the_machine_that_made_them() -> None:
    place = re.compile(r"/(?:site-packages|partnet_mobility|home|root|tmp)/")
    for page in FOLDER.glob("*.*"):
        assert not place.search(page.read_text()), page.name
