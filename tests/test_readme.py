"""README and docs stay true: commands and options exist, links lead somewhere, and the blocks shown work in order."""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import re
import shlex
import subprocess
import sys
from dataclasses import fields
from functools import cache
from importlib.metadata import metadata
from pathlib import Path
from typing import Any

import pytest
import tyro

import artperl.commands.verbs
import artsim.commands.verbs
from artsim.common.program import parser_of
from tests.conftest import ROOT

README = ROOT / "README.md"
TUTORIAL = ROOT / "docs" / "tutorial.md"
ALONE = [
    *(page for page in sorted((ROOT / "docs" / "how_to").glob("*.md")) if page.stem != "maniskill"),
    *(ROOT / "docs" / f"{name}.md" for name in ("concepts", "other_conventions", "artperl", "formats", "scenes")),
]
"""Pages whose blocks run in their order, after those of README; the tests of ManiSkill cover its page."""
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md")), *sorted(ROOT.glob("examples/*/README.md"))]
PROGRAMS: dict[str, Any] = {
    "artsim": parser_of(artsim.commands.verbs.VERBS),
    "artperl": parser_of(artperl.commands.verbs.VERBS),
    "generate.py": parser_of({"": (artsim.commands.verbs.Generate,)}),
    "train.py": parser_of({"": (artperl.commands.verbs.Train,)}),
}
BLOCKS = [
    (kind, block)
    for page in (README, TUTORIAL, *ALONE)
    for kind, block in re.findall(r"^```(\w*)\n(.*?)^```$", page.read_text(), re.MULTILINE | re.DOTALL)
    if kind in ("sh", "python")
]


def commands(text: str) -> list[list[str]]:
    """Words of every command of ours in a page: in blocks, indented, or quoted with options."""
    lines = [
        line
        for kind, block in re.findall(r"^```(\w*)\n(.*?)^```$", text, re.M | re.S)
        if kind in ("", "sh", "text")
        for line in block.splitlines()
    ]
    outside = re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)
    lines += [line.strip() for line in outside.splitlines() if line.startswith("    ")]
    lines += [quoted.replace("\n", " ") for quoted in re.findall(r"(?<!`)`([^`]+)`(?!`)", outside)]
    found = []
    for line in lines:
        with contextlib.suppress(ValueError):  # prose with one quotation mark
            words = shlex.split(line, comments=True)
            if words[:1] == ["python"]:
                words = words[1:]
            if words and (words[0] in PROGRAMS or (words[:1] == ["-m"] and words[1].startswith("benchmarks."))):
                found.append(words)
    return found


RESULTS = sorted((ROOT / "results").glob("*.md"))
COMMANDS = [(page.name, words) for page in [*PAGES, *RESULTS] for words in commands(page.read_text())]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("page", "words"), COMMANDS, ids=lambda value: value if isinstance(value, str) else " ".join(value)[:60]
)
def test_every_command_that_is_shown_exists_with_its_options(page: str, words: list[str]) -> None:
    if words[0] == "-m":
        module = importlib.import_module(words[1])
        known = {"help", *(field.name for field in fields(module.Options))}
        assert {word[2:].replace("-", "_") for word in words[2:] if word.startswith("--")} <= known
        return
    options = words[1:]
    if not options or "..." in options or "--help" in options or "--version" in options:
        return
    verb = PROGRAMS[words[0]]
    shown = [word for word in options if word.startswith("--")]
    help_of = options[:1] if words[0] in ("artsim", "artperl") else []
    text = help_text(verb, *help_of)
    for option in shown:
        assert re.search(rf"{option}(?![\w-])", text), f"{page}: {words[0]} {' '.join(help_of)} has no {option}"


@cache
def help_text(verb: Any, *words: str) -> str:
    """What a command explains of itself."""
    return told(verb, [*words, "--help"])


def told(verb: Any, words: list[str]) -> str:
    """What a program prints, however wide."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.suppress(SystemExit), pytest.MonkeyPatch.context() as patched:
        patched.setenv("COLUMNS", "300")
        tyro.cli(verb, args=words, prog="x")
    return out.getvalue()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files_and_headings(page: Path) -> None:
    text = page.read_text()
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        path, _, heading = link.partition("#")
        assert not path.startswith("http"), link
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), link
        if heading:
            slugs = [
                re.sub(r"[^\w -]", "", line.lstrip("# ").lower()).replace(" ", "-")
                for line in target.read_text().splitlines()
                if line.startswith("#")
            ]
            assert heading in slugs, link


def test_readme_is_short_and_installs_before_it_runs_anything() -> None:
    assert len(README.read_text().splitlines()) <= 150
    kind, first = BLOCKS[0]
    assert kind == "sh"
    assert [line.split()[0] for line in first.splitlines()] == ["python3", ".", "pip"]


def test_readme_and_the_navigation_of_the_site_have_every_page() -> None:
    linked = {(ROOT / link).resolve() for link in re.findall(r"\]\(([^)#\s]+)", README.read_text())}
    named = {ROOT / "docs" / name for name in re.findall(r"[\w/]+\.md", (ROOT / "mkdocs.yml").read_text())}
    pages = set((ROOT / "docs").rglob("*.md"))
    assert pages <= linked
    assert pages <= named
    assert set((ROOT / "docs").rglob("*.ipynb")) <= linked


def test_readme_lists_every_extra_and_make_target() -> None:
    text = README.read_text()
    extras = metadata("artsim").get_all("Provides-Extra") or []
    assert len(extras) > 5
    table = text[text.index("| extra |") : text.index("## Ten lines")]
    assert set(extras) <= set(re.findall(r"`([\w]+)`", table))
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for page in PAGES:
        assert set(re.findall(r"^make (\w+)|`make (\w+)`", page.read_text(), re.M)) <= {(t, "") for t in targets} | {
            ("", t) for t in targets
        }


SLOW = (
    "make",
    "python3 -m venv",
    ". .venv",
    "pip install",
    "artperl train",
    "artperl evaluate",
    "artperl demo",
    "artsim doctor",
)
"""Beginnings of lines that are not run here: they make environments, or take minutes."""
# In one process: to start Python anew for each line takes longer than all that they do.
READER = """
import json, shlex, sys
import artperl.commands.verbs, artsim.commands.verbs

programs = {
    "artsim": artsim.commands.verbs.main,
    "artperl": artperl.commands.verbs.main,
    "generate.py": artsim.commands.verbs.generate_main,
}
names = {}
if __name__ == "__main__":
    for kind, block in json.load(sys.stdin):
        if kind == "python":
            exec(block, names)
            continue
        for line in block.replace("\\\\\\n", "").splitlines():
            words = shlex.split(line, comments=True)
            sys.argv = words[words[0] == "python" :]
            programs[sys.argv[0]]()
"""


@pytest.mark.slow
def test_what_readme_and_tutorial_show_works_in_order(tmp_path: Path) -> None:
    """Shell and Python blocks, in one new folder, as a reader pastes them."""
    (tmp_path / "reader.py").write_text(READER)
    pasted = [
        (kind, "\n".join(line for line in block.splitlines() if kind == "python" or not line.startswith(SLOW)))
        for kind, block in BLOCKS
    ]
    assert [kind for kind, _ in pasted].count("python") >= 4
    variables = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(
        [sys.executable, "reader.py"], input=json.dumps(pasted), cwd=tmp_path, env=variables, capture_output=True,
        text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    said = re.search(r"^([\d.-]+) estimated, ([\d.-]+) true$", done.stdout, re.MULTILINE)
    assert said is not None
    assert abs(float(said[1]) - float(said[2])) < 2.0
    for made in ("first/recording.rrd", "gallery.png", "objects/drawer/0/mobility.usda", "estimate.html", "pose.json"):
        assert (tmp_path / "out" / made).stat().st_size > 1000, made
