"""The option ``--package-root NAME=FOLDER`` of every program that loads objects."""

from __future__ import annotations

from collections.abc import Mapping
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
