"""CONTRIBUTING.md stays true: what it adds to a copy of the packages works there as it says."""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ASSETS

pytestmark = pytest.mark.slow

ROOT = ASSETS.parent
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SECTIONS = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", (ROOT / "CONTRIBUTING.md").read_text(), re.M | re.S))
# As the installed programs are, but of the copy.
PROGRAMS = {
    "python": [],
    "artsim": ["-c", "from artsim.commands.verbs import main; main()"],
    "artperl": ["-c", "from artperl.commands.verbs import main; main()"],
}


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the packages, with every template and registry line in its place."""
    folder = tmp_path_factory.mktemp("clone")
    for name in ("artsim", "artperl", "benchmarks", "tests"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("weights", "golden"))
    (folder / "artperl" / "weights").symlink_to(ROOT / "artperl" / "weights")
    (folder / "urdf_assets").symlink_to(ASSETS)
    for name in ("generate.py", "pyproject.toml"):
        shutil.copy(ROOT / name, folder)
    for section in SECTIONS.values():
        for kind, block in BLOCK.findall(section):
            if kind == "python":
                register(block, folder)
            for line in block.splitlines():
                if line.startswith("cp "):
                    _, template, module = line.split()
                    assert not (folder / module).exists(), module
                    shutil.copy(ROOT / template, folder / module)
    return folder


def register(block: str, folder: Path) -> None:
    """Add the lines of a block to a registry, whose place its first line names: ``# path, in NAME``."""
    first, _, code = block.partition("\n")
    path, _, registry = first.removeprefix("# ").partition(", in ")
    text = (folder / path).read_text()
    changed = re.sub(rf"^({registry}\b[^\n]*[({{[]\n)", lambda found: found[1] + code, text, count=1, flags=re.M)
    assert changed != text, f"{path} has no registry {registry}"
    (folder / path).write_text(changed)


def run(words: list[str], folder: Path) -> str:
    """What a command prints in the copy; its packages come first."""
    assert words[0] in PROGRAMS, words
    done = subprocess.run(
        [sys.executable, *PROGRAMS[words[0]], *words[1:]], cwd=folder, capture_output=True, text=True, timeout=300,
        env={**os.environ, "PYTHONPATH": str(folder)},
    )  # fmt: skip
    assert done.returncode == 0, f"{shlex.join(words)}\n{done.stdout[-2000:]}{done.stderr[-3000:]}"
    return done.stdout


def follow(section: str, folder: Path) -> list[str]:
    """What each command of a section prints."""
    blocks = [block for kind, block in BLOCK.findall(SECTIONS[section]) if kind == "sh"]
    lines = [line for block in blocks for line in block.splitlines() if not line.startswith("cp ")]
    return [run(shlex.split(line, comments=True), folder) for line in lines]


def test_a_category_is_generated_and_passes_every_gate(clone: Path) -> None:
    _, _, inspected = follow("Add a category", clone)
    assert "door" in inspected
    assert (clone / "out" / "mailbox.png").stat().st_size > 1000
    program = (
        "from artsim import make; from artsim.checks.validity import check; "
        "print([str(gate) for seed in range(10) for gate in check(make('mailbox', seed)) if not gate.passed])"
    )
    assert run(["python", "-c", program], clone).strip() == "[]"
    tested = run(["python", "-m", "pytest", "-p", "no:cacheprovider", "tests/artsim/families", "-k", "mailbox"], clone)
    assert re.search(r"\b[2-9] passed", tested)


def test_a_renderer_agrees_with_rays_and_makes_a_dataset(clone: Path) -> None:
    compared, _, verified = follow("Add a renderer", clone)
    assert '"agrees": true' in compared.splitlines()[-1]
    assert verified.endswith(": sound\n")


def test_a_metric_stands_in_the_table_and_in_the_figures(clone: Path) -> None:
    (printed,) = follow("Add a metric", clone)
    assert "size %" in printed
    (laptop,) = json.loads((clone / "out" / "figures.json").read_text()).values()
    assert all(0.0 < part["size_percent"]["median"] < 100.0 for part in laptop["parts"])


def test_a_method_is_evaluated_by_its_name(clone: Path) -> None:
    (printed,) = follow("Add a method", clone)
    assert re.search(r"2 instances, 0 failures, 0 % right", printed)
