"""Values out of an untrusted JSON document, each checked for its type and range before it is used."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from typing import Any

SHA256 = re.compile(r"[0-9a-f]{64}")


def mapping(value: object, name: str) -> Mapping[str, Any]:
    """A set of named values; ValueError otherwise, as from all functions here."""
    if not isinstance(value, dict):
        raise ValueError(f"{name} is not a set of named values")
    return value


def sequence(value: object, name: str, most: int) -> list[Any]:
    """A list of at most so many values."""
    if not isinstance(value, list) or len(value) > most:
        raise ValueError(f"{name} is not a list of at most {most} values")
    return value


def whole(value: object, name: str, low: int, high: int) -> int:
    """A whole number from ``low`` to ``high``."""
    if type(value) is not int or not low <= value <= high:
        raise ValueError(f"{name} is {value!r:.40}, not a whole number from {low} to {high}")
    return value


def number(value: object, name: str) -> float:
    """A finite number."""
    if type(value) not in (int, float) or not math.isfinite(value):  # type: ignore[arg-type]  # it is a number here
        raise ValueError(f"{name} is {value!r:.40}, not a number")
    return float(value)  # type: ignore[arg-type]


def pair(value: object, name: str) -> tuple[float, float]:
    """Two numbers."""
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"{name} is {value!r:.40}, not two numbers")
    return number(value[0], name), number(value[1], name)


def text(value: object, name: str, pattern: re.Pattern[str] | None = None, most: int = 4096) -> str:
    """A text of at most so many characters, all of which match a pattern."""
    if not isinstance(value, str) or len(value) > most or (pattern is not None and not pattern.fullmatch(value)):
        raise ValueError(f"{name} is {value!r:.80}")
    return value


def one_of(value: object, name: str, choices: Collection[str]) -> Any:
    """One of some texts."""
    if not isinstance(value, str) or value not in choices:
        raise ValueError(f"{name} is {value!r:.40}, not one of {', '.join(choices)}")
    return value


def boolean(value: object, name: str) -> bool:
    """True or false."""
    if type(value) is not bool:
        raise ValueError(f"{name} is {value!r:.40}, neither true nor false")
    return value
