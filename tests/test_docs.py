"""The pages read plainly: short sentences, the present tense, and pictures that exist."""

from __future__ import annotations

import pkgutil
import re
from pathlib import Path

import pytest

from tests.conftest import installed

ROOT = Path(__file__).parents[1]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md")), *sorted(ROOT.glob("examples/*/README.md"))]
TELL_THE_PAST = ("CHANGELOG.md", "experiments.md")
"""Pages about what was done; all others describe what is."""
LONGEST_MEAN = 18.0
"""Words a sentence, on average over a page."""
HISTORY = (
    r"\bused to be\b", r"\bnot taken\b", r"\b(?:of|from) then\b", r"\bearlier (?:weights|version|commit)",
    r"\bcommit [0-9a-f]{7}", r"\bno longer\b", r"\bpreviously\b", r"\bformerly\b", r"\bso far\b", r"\banymore\b",
    r"\bha(?:s|ve) changed since\b", r"\buntil (?:now|commit|January|November)", r"\bbefore and after\b",
)  # fmt: skip
"""Words that say how something came about."""

ENVIRONMENTS = {"artsim/Articulated-v0", "artsim/Opening-v0"}
"""Names of gymnasium that look like paths."""


def prose(text: str) -> list[str]:
    """Paragraphs and items of lists, without code, tables, headings and pictures; quoted code is one word."""
    text = re.sub(r"^ *```.*?^ *```$", "", text, flags=re.M | re.S)
    text = re.sub(r"`[^`]+`", "code", text)
    lines = [
        "" if re.match(r"\s*(?:\||#|!\[)|    \S", line) else re.sub(r"^\s*(?:[-*]|\d+\.)\s", "\n\n", line)
        for line in text.splitlines()
    ]
    blocks = re.split(r"\n\s*\n", "\n".join(lines))
    return [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", block).strip() for block in blocks if block.strip()]


def sentences(text: str) -> list[list[str]]:
    """Words of each sentence of a page."""
    ends = r"(?<=[.!?])(?:\*\*|\)|\")*\s+(?=[\W_]*(?:[A-Z0-9]|code))"
    split = [sentence for block in prose(text) for sentence in re.split(ends, " ".join(block.split()))]
    return [words for sentence in split if (words := re.findall(r"\w[\w'.,/-]*", sentence))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_sentences_of_a_page_have_fewer_than_18_words_on_average(page: Path) -> None:
    lengths = [len(words) for words in sentences(page.read_text())]
    assert lengths, "a page without a sentence"
    mean = sum(lengths) / len(lengths)
    assert mean < LONGEST_MEAN, f"{mean:.1f} words a sentence. Fix: split the longest sentences of {page.name}"


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.name not in TELL_THE_PAST], ids=lambda page: str(page.relative_to(ROOT))
)
def test_pages_describe_what_is_and_not_what_was(page: Path) -> None:
    told = [found[0] for pattern in HISTORY for found in re.finditer(pattern, page.read_text(), re.I)]
    assert not told, f"{page.name} says {told}. Fix: move history to CHANGELOG.md, attempts to docs/experiments.md"


def test_symbols_of_the_glossary_stand_in_the_files_that_it_names() -> None:
    rows = re.findall(r"^\|([^|]*)\|([^|]*)\|.*\|([^|]*)\|$", (ROOT / "docs" / "glossary.md").read_text(), re.M)
    named = [
        (symbol, ROOT / where)
        for _, symbols, wheres in rows
        for symbol in re.findall(r"`([\w.]+)`", symbols)
        for where in re.findall(r"`([\w/]+\.py)`", wheres)
    ]
    assert len(named) > 40
    absent = [f"{symbol}: {path.name}" for symbol, path in named if symbol.split(".")[-1] not in path.read_text()]
    assert not absent


def test_no_page_rests_on_a_script_that_is_not_in_the_repository() -> None:
    for page in PAGES:
        assert not re.search(r"[(;,] ?scripts?\b(?![/-])[^()]{0,40}\)", page.read_text()), page.name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_and_modules_that_a_page_names_exist(page: Path) -> None:
    quoted = re.findall(r"`([^`\s]+)`", page.read_text())
    folders = r"(?:artsim|artperl|tests|benchmarks|results|examples|scripts|docs|urdf_assets)/[\w./-]+"
    missing = [
        name
        for name in quoted
        if re.fullmatch(folders, name) and not (ROOT / name).exists() and name not in ENVIRONMENTS
    ]
    for name in quoted:
        if re.match(r"(?:artsim|artperl)\.\w", name):
            try:
                pkgutil.resolve_name(re.split(r"[(=]", name)[0])
            except (ImportError, AttributeError):
                missing.append(name)
    assert not missing, f"{page.name} names {missing}"


def test_every_picture_of_the_docs_is_shown_on_a_page() -> None:
    shown = {
        (page.parent / link).resolve()
        for page in PAGES
        for link in re.findall(r"!\[[^\]]+\]\(([^)\s]+)\)", page.read_text())
    }
    assert shown == {path for path in (ROOT / "docs").iterdir() if path.suffix in (".png", ".webp")}


def test_sentences_are_counted_as_a_reader_counts_them() -> None:
    page = "# A title\n\nOne two three. Four `a b c` six!\n\n| a | b |\n\n- Seven [eight](x).\n  Ten.\n\n    code\n"
    assert [len(words) for words in sentences(page)] == [3, 3, 2, 1]


def test_citation_names_the_version_and_the_paper_of_the_readme() -> None:
    yaml = installed("yaml")
    record = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors"} <= set(record)
    assert record["cff-version"] == "1.2.0"
    assert f'version = "{record["version"]}"' in (ROOT / "pyproject.toml").read_text()
    (paper,) = record["references"]
    readme = (ROOT / "README.md").read_text()
    assert all(str(paper[key]) in readme for key in ("title", "year", "doi", "collection-title"))
    assert all(f"{author['family-names']}, {author['given-names']}" in readme for author in paper["authors"])
