"""What a run was asked for: options that make sense, and how they differ from those it was begun with."""

from collections.abc import Iterator, Mapping
from typing import Any

from artsim.errors import ConfigError


def check_counts(least: int = 1, **counts: int) -> None:
    """Refuse numbers, by their names, below the least one that makes sense.

    Raises
    ------
    ConfigError
    """
    for name, value in counts.items():
        if value < least:
            raise ConfigError(f"{value} is not a count", name, f"use {least} or more")


def check_seed(seed: int) -> None:
    """Refuse a negative seed.

    Raises
    ------
    ConfigError
    """
    if seed < 0:
        raise ConfigError(f"{seed} is not a seed", "seed", "use 0 or more")


def differences(found: Mapping[str, Any], wanted: Mapping[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    """Name, such as 'sample.views.fov', found value and wanted value of each entry of ``wanted`` that differs."""
    for name, new in wanted.items():
        old = found.get(name)
        if isinstance(old, dict) and isinstance(new, dict):
            for inner, before, after in differences(old, {**dict.fromkeys(old), **new}):
                yield f"{name}.{inner}", before, after
        elif old != new:
            yield name, old, new
