"""Rooms import only rooms below them, and no modules import each other in a circle: in functions and by name, too.

``python -m tests.test_structure`` prints the floors, the arrows between rooms and their modules.
"""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from tests.conftest import ROOT

PACKAGES = ("artsim", "artperl")
FLOORS = {"artsim": 12, "artperl": 8}
ARROWS = {"artsim": 110, "artperl": 52}
"""The most that there may be. Errors and common, which everything may use, count as one room."""
GROUND = {"artsim.errors": "artsim.common"}
INFERENCE = ("core", "perception", "retrieval", "agent", "boxes", "fitting", "methods")
NOT_FOR_INFERENCE = ("artperl.data", "artperl.training", "artperl.evaluation", "artsim.renderers", "artsim.datasets")

DRAWN_APART = {"artsim.export.simready"}
"""Draws the picture of a package. Estimates are exported, too, but never as packages."""


@cache
def modules() -> dict[str, Path]:
    """Every module by its name."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for path in paths]
    return dict(zip(names, paths, strict=True))


def imports_of(name: str, source: str, known: frozenset[str], is_package: bool = False) -> set[str]:
    """Modules that a module imports or names: anywhere in its text, whole or, in tables of lazy names, by their end.

    A text such as ``f"artsim.families.{category}"`` stands for each module below whose name is a text of the same file.
    """
    nodes = list(ast.walk(ast.parse(source)))
    texts = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    found = {text.partition(":")[0] for text in texts if re.fullmatch(r"\w+(\.\w+)+(:\w+)?", text)}
    for node in nodes:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            within = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= within & known or {str(node.module)}
        elif isinstance(node, ast.JoinedStr) and isinstance(first := node.values[0], ast.Constant):
            found |= {f"{first.value}{text}" for text in texts}
        elif is_package and isinstance(node, ast.Name) and node.id == "lazy_names":
            found |= {f"{name}.{text}" for text in texts}
    return (found & known) - {name}


@cache
def graph() -> dict[str, set[str]]:
    """What every module imports."""
    known = frozenset(modules())
    return {
        name: imports_of(name, path.read_text(), known, path.name == "__init__.py") for name, path in modules().items()
    }


@cache
def floors(package: str) -> dict[str, int]:
    """The floor of each room of a package, 0 for the ground, as pyproject.toml has them for import-linter."""
    text = (ROOT / "pyproject.toml").read_text()
    (layers,) = re.findall(rf'containers = \["{package}"\]\nlayers = \[\n(.*?)\n\]', text, re.DOTALL)
    rows = re.findall(r'^    "(.*)",', layers, re.MULTILINE)
    return {f"{package}.{name}": floor for floor, row in enumerate(reversed(rows)) for name in re.split(r" [|:] ", row)}


def room_of(module: str) -> str:
    """The room of a module: the package itself for its public names."""
    return ".".join(module.split(".")[:2])


def arrows(package: str) -> dict[tuple[str, str], set[str]]:
    """Pairs of rooms of a package, of which one imports the other, and the modules that do."""
    found = defaultdict(set)
    for module, imported in graph().items():
        for each in imported:
            pair = tuple(GROUND.get(room, room) for room in (room_of(module), room_of(each)))
            if pair[0] != pair[1] and all(room.partition(".")[0] == package for room in pair):
                found[pair[0], pair[1]].add(module)
    return dict(found)


def upward(package: str) -> Iterator[str]:
    """Imports of rooms that are not below."""
    floor, together = floors(package), {frozenset({f"{package}.__main__", f"{package}.commands"})}
    for (room, imported), those in arrows(package).items():
        if room != package and floor[room] <= floor[imported] and frozenset({room, imported}) not in together:
            yield f"{', '.join(sorted(those))}: imports {imported}"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_room_imports_only_rooms_below_it(package: str) -> None:
    assert {room_of(module) for module in modules() if "." in module and module.startswith(package)} == set(
        floors(package)
    )
    assert list(upward(package)) == []


def test_no_modules_import_each_other_in_a_circle() -> None:
    try:
        TopologicalSorter(graph()).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_artsim_never_imports_artperl_and_inference_no_training_and_no_renderer() -> None:
    reached: dict[str, set[str]] = {}
    for module in TopologicalSorter(graph()).static_order():
        reached[module] = graph()[module].union(*(reached[each] for each in graph()[module] - DRAWN_APART))
    for module, below in reached.items():
        if module.startswith("artsim"):
            assert not [each for each in below if each.startswith("artperl")], module
        elif module.split(".")[1:2] and module.split(".")[1] in INFERENCE:
            assert not [each for each in below if each.startswith(NOT_FOR_INFERENCE)], module


@pytest.mark.parametrize("package", PACKAGES)
def test_there_are_few_floors_and_few_arrows_between_rooms(package: str) -> None:
    assert max(floors(package).values()) + 1 <= FLOORS[package]
    assert len(arrows(package)) <= ARROWS[package]


@pytest.mark.parametrize(
    "source",
    [
        "import artsim.model.camera",
        "def f():\n    from artsim.model.camera import Camera",
        "from artsim.model import camera",
        "if TYPE_CHECKING:\n    from artsim.model.camera import Camera",
        "import_module('artsim.model.camera')",
        "RENDERERS = {'ray': 'artsim.model.camera:Camera'}",
        "NAMES = ('camera',)\nimport_module(f'artsim.model.{name}')",
        "lazy_names(__name__, {'Camera': 'model.camera'})",
    ],
)
def test_imports_are_found_wherever_they_stand(source: str) -> None:
    known = frozenset(modules())
    assert imports_of("artsim", source, known, is_package=True) == {"artsim.model.camera"}
    assert not imports_of("artsim", "'''Of artsim.model.camera.'''", known)


if __name__ == "__main__":
    for each in PACKAGES:
        print(f"{each}: {max(floors(each).values()) + 1} floors, {len(arrows(each))} arrows")
        for (room, imported), those in sorted(arrows(each).items()):
            print(f"  {room} -> {imported}: {len(those)}")
