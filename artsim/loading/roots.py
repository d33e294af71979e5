"""Options of programs that load objects: where files lie, ``--package-root NAME=FOLDER``, and which object is meant."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro


def _pairs(texts: list[str]) -> dict[str, Path]:
    found = {}
    for text in texts:
        name, equals, folder = text.partition("=")
        if not (name and equals and folder):
            raise ValueError(f"{text!r} is not NAME=FOLDER")
        found[name] = Path(folder)
    return found


def _is_mapping(value: Any) -> bool:
    return isinstance(value, Mapping)


PackageRoots = Annotated[
    Mapping[str, Path],
    tyro.constructors.PrimitiveConstructorSpec(
        nargs="+",
        metavar="NAME=FOLDER",
        instance_from_str=_pairs,
        is_instance=_is_mapping,
        str_from_instance=lambda roots: [f"{name}={folder}" for name, folder in roots.items()],
        _action="append",  # named twice, it adds: tyro would let the last one win without a word
    ),
]
"""Folder of each ``package://`` name: several after one option, or the option several times."""


@dataclass(frozen=True, kw_only=True)
class Packages:
    """Where files lie that objects name by their package."""

    package_root: PackageRoots = field(default_factory=dict)
    """Folder of each package name, as in package://NAME/. Meshes and included files outside the object's folder open
    below these folders, too. Repeatable."""


@dataclass(frozen=True, kw_only=True)
class Opened(Packages):
    """Options of commands that open objects of files."""

    body: str | None = None
    """For an MJCF or USD scene of several objects: the body to load, with its children. world: the children of
    the world body."""
