"""docs/api.md lists the public names: each exists, is documented, and none is missing."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from types import ModuleType
from typing import Any

import pytest

import artperl.commands.verbs
import artsim.commands.verbs
from artsim.common.program import verb_name
from tests.conftest import ROOT, installed

PAGE = (ROOT / "docs" / "api.md").read_text()
NAMES = sorted(set(re.findall(r"`(art(?:sim|perl)\.[\w.]+)`", PAGE)))
PACKAGES = re.findall(r"^## (art\w+(?:\.\w+)*)$", PAGE, re.MULTILINE)
EXTRAS = {"artsim.envs": "gymnasium"} | {name: "torch" for name in NAMES if re.fullmatch(r"artperl\.\w+", name)}
"""What must be installed for a name besides the core."""


def import_package(name: str) -> ModuleType:
    if name in EXTRAS:
        installed(EXTRAS[name])
    return importlib.import_module(name)


@pytest.mark.parametrize("name", NAMES)
def test_public_name_imports_and_is_documented(name: str) -> None:
    package, _, last = name.rpartition(".")
    if name in EXTRAS:
        installed(EXTRAS[name])
    public: Any = getattr(import_package(package), last)
    if not isinstance(public, (str, tuple, dict)):  # a constant has its meaning in the page alone
        assert (public.__doc__ or "").strip()
        assert not (public.__doc__ or "").startswith(f"{last}(")  # what dataclass writes where nobody did


@pytest.mark.parametrize("package", PACKAGES)
def test_page_lists_every_name_of_a_public_package(package: str) -> None:
    assert {f"{package}.{name}" for name in import_package(package).__all__} == {
        name for name in NAMES if name.rpartition(".")[0] == package
    }


@pytest.mark.parametrize("package", ["artsim", "artperl"])
def test_completion_offers_public_names_alone(package: str) -> None:
    module = importlib.import_module(package)
    assert {name for name in dir(module) if name not in module.__all__} <= {
        re.sub(r"^\w+\.", "", name) for name in PACKAGES if name.startswith(f"{package}.")
    }


@pytest.mark.parametrize("program", ["artsim", "artperl"])
def test_page_lists_every_command(program: str) -> None:
    groups = {"artsim": artsim.commands.verbs.VERBS, "artperl": artperl.commands.verbs.VERBS}[program]
    listed = PAGE[PAGE.index("## Commands") :]
    names = {verb_name(verb) for verbs in groups.values() for verb in verbs}
    assert names == set(re.findall(rf"`{program} ([a-z][a-z-]*)`", listed))


@pytest.mark.parametrize("package", [name for name in PACKAGES if name != "artsim.envs" and "artperl" not in name])
def test_public_package_works_after_import_artsim_and_imports_no_backend(package: str) -> None:
    heavy = {"torch", "sapien", "pybullet", "mujoco", "matplotlib", "rerun", "warp", "gymnasium"}
    code = f"import sys, artsim; {package}; print(*{heavy!r} & sys.modules.keys())"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert not run.stdout.strip()
