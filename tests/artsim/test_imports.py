"""What is imported when: artsim itself, its programs' help and a few clouds wait for nothing that they do not use."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

import artsim
from artsim.families import CATEGORIES, FAMILIES

PACKAGES = ["artsim", "artsim.drawing", "artsim.formats", "artsim.physics", "artsim.scenes"]


@pytest.mark.parametrize("name", PACKAGES)
def test_each_public_name_is_there_and_listed(name: str) -> None:
    package = import_module(name)
    for public in package.__all__:
        assert getattr(package, public) is not None
        assert public in dir(package)
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        package.nothing  # noqa: B018


def imported(code: str) -> set[str]:
    run = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"], capture_output=True, text=True, check=True
    )
    return set(run.stdout.split())


def test_import_artsim_is_all_but_free() -> None:
    assert not imported("import artsim") & {"numpy", "scipy", "lxml", "PIL", "embreex", "tyro"}


def test_help_waits_for_no_family_no_mesh_reader_and_no_scipy() -> None:
    modules = imported("import artsim.commands.verbs")
    assert not modules & {"scipy", "trimesh", "torch", "numba", "pybullet", "artsim.loading.painted"}
    assert not [name for name in modules if name.startswith("artsim.families.") and name.split(".")[-1] in CATEGORIES]


def test_a_family_is_imported_with_its_first_object() -> None:
    modules = imported("import artsim; artsim.make('laptop')")
    assert "artsim.families.laptop" in modules
    assert "artsim.families.toilet" not in modules


def test_the_registry_is_a_mapping_of_all_categories() -> None:
    assert tuple(FAMILIES) == CATEGORIES
    assert len(FAMILIES) == len(CATEGORIES)
    assert "laptop" in FAMILIES
    assert "__init__" not in FAMILIES
    with pytest.raises(KeyError):
        FAMILIES["catalogue"]
    assert callable(FAMILIES["laptop"])
    assert artsim.families.FAMILIES is FAMILIES
