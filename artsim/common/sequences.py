"""Names and paths where a list of them is due."""

import os
from collections.abc import Iterable
from dataclasses import fields
from typing import Any, TypeVar

T = TypeVar("T")


def listed(given: Iterable[T] | T) -> list[T]:
    """One name or path as a list of one; others as they are. A string has letters, which nobody means by a list."""
    return [given] if isinstance(given, (str, os.PathLike)) else list(given)  # type: ignore[arg-type]


def wrap_singles(options: Any) -> None:
    """Where options of a frozen dataclass are a tuple of names or paths, one that is given alone becomes a tuple."""
    for field in fields(options):
        value = getattr(options, field.name)
        if str(field.type).startswith("tuple[") and isinstance(value, (str, os.PathLike)):
            object.__setattr__(options, field.name, (value,))
