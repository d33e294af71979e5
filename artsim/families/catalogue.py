"""What each procedural category is: its family's own words, and what its first objects are like."""

import inspect
import sys
from collections import Counter

from artsim.errors import ConfigError
from artsim.families import FAMILIES, make
from artsim.families.constraints import FEATURES, LENGTHS, measured


def parameters(category: str) -> str:
    """What a category is, and what varies, as its family says.

    Raises
    ------
    ConfigError
        When there is no such category.
    """
    if category not in FAMILIES:
        raise ConfigError(f"there is no category {category!r}", fix=f"use one of {', '.join(sorted(FAMILIES))}")
    return inspect.cleandoc(sys.modules[FAMILIES[category].__module__].__doc__ or "")


def describe_family(category: str, count: int = 20) -> str:
    """Several lines: what varies, and what is seen over the first ``count`` seeds of a category.

    Raises
    ------
    ConfigError
        When there is no such category, or nothing to look at.
    """
    if count < 1:
        raise ConfigError(f"{count} is not a count", "objects", "use 1 or more")
    text = parameters(category)
    objects = [make(category, seed) for seed in range(count)]
    types = Counter(kind for obj in objects for kind in set(obj.tree.types[1:]))
    parts: dict[str, list[int]] = {part.label: [] for obj in objects for part in obj.parts[1:]}
    for label, counts in parts.items():
        counts += [sum(part.label == label for part in obj.parts[1:]) for obj in objects]
    rows = [
        ("parts", _range([len(obj) for obj in objects])),
        ("joint types", ", ".join(f"{kind} ({number})" for kind, number in sorted(types.items()))),
        ("moving parts", ", ".join(f"{label} {_range(counts)}" for label, counts in sorted(parts.items()))),
    ]
    for name in LENGTHS:
        values = [float(measured(obj, name)) for obj in objects]  # type: ignore[arg-type]
        rows.append((name, f"{min(values):.3g} to {max(values):.3g} m"))
    rows += [(name, f"{sum(bool(measured(obj, name)) for obj in objects)} have some") for name in FEATURES]
    lines = [f"  {name:13s} {value}" for name, value in rows]
    return "\n".join([category, *(f"  {line}".rstrip() for line in text.splitlines()), "",
                      f"  of {count} objects:", *lines, ""])  # fmt: skip


def _range(numbers: list[int]) -> str:
    low, high = min(numbers), max(numbers)
    return str(low) if low == high else f"{low} to {high}"
