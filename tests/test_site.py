"""The site of the docs: it is built without a warning, runs its notebooks, and needs no network."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT, installed

NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    for module in ("mkdocs", "material", "mkdocstrings", "nbclient"):
        installed(module)
    folder = tmp_path_factory.mktemp("site")
    variables = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1", "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)],
        cwd=ROOT, env=variables, capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    assert not re.search(r"WARNING|ERROR", done.stderr), done.stderr
    return folder


@pytest.mark.slow
def test_every_page_every_public_name_and_every_result_is_in_the_site(site: Path) -> None:
    for page in (ROOT / "docs").rglob("*.md"):
        assert (site / page.relative_to(ROOT / "docs").with_suffix(".html")).is_file(), page
    for page in (ROOT / "results").glob("[!R]*.md"):
        assert (site / "results" / f"{page.stem}.html").is_file(), page
    reference = "".join(page.read_text() for page in (site / "reference").glob("*.html"))
    names = set(re.findall(r"`art\w+(?:\.\w+)*\.(\w+)`", (ROOT / "docs" / "api.md").read_text()))
    shown = set(re.findall(r'id="art[\w.]+?\.(\w+)"', reference))
    assert names - shown <= {"__version__", "errors", "stream"}  # a text, and two modules with pages of their own


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_run_and_shows_pictures_or_pages(site: Path, path: Path) -> None:
    page = (site / "notebooks" / f"{path.stem}.html").read_text()
    shown = re.findall(rf'(?:src|data)="({path.stem}-\d+\.(?:png|html))"', page)
    assert shown
    assert all((site / "notebooks" / name).stat().st_size > 1000 for name in shown)


def test_notebooks_are_kept_without_outputs() -> None:
    assert len(NOTEBOOKS) == 5
    for path in NOTEBOOKS:
        cells = json.loads(path.read_text())["cells"]
        assert not [cell for cell in cells if cell.get("outputs") or cell.get("execution_count")], path.name


@pytest.mark.slow
def test_no_page_loads_anything_from_a_network(site: Path) -> None:
    loaded = re.compile(
        r"<(?:script|img|iframe|source)[^>]+src=[\"']?(?:https?:)?//|<link[^>]+rel=[\"']?(?:stylesheet|preload)[^>]+//"
    )
    for page in site.rglob("*.html"):
        assert not loaded.search(page.read_text()), page.name
    for sheet in site.rglob("*.css"):
        assert not re.search(r"@import|url\(['\"]?(?:https?:)?//", sheet.read_text()), sheet.name


@pytest.mark.slow
def test_search_finds_pages_in_a_site_that_is_opened_as_files(site: Path, browser: Any) -> None:
    page = browser.new_page()
    page.goto((site / "index.html").as_uri())
    page.click("input[name=query]")
    page.keyboard.type("amodal")
    found = page.locator(".md-search-result__link").first
    found.wait_for()
    assert "concepts.html" in str(found.get_attribute("href"))
