"""Figures of a long measurement in one JSON file, written as they come: a stopped measurement resumes from it."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from artsim.common.files import read_json, write_atomic
from artsim.errors import ConfigError

_MAX_BYTES = 256_000_000


def read_kept(path: Path | None, **asked: Any) -> dict[str, Any]:
    """Content of a file of figures; empty where there is none.

    Parameters
    ----------
    path : Path or None
        None keeps nothing.
    **asked
        All that the figures follow from, by its name in the file.

    Raises
    ------
    ConfigError
        When the file is damaged, or holds figures of something else.
    """
    if path is None or not path.exists():
        return {}
    found = read_json(path, "the file of figures", ConfigError, _MAX_BYTES)
    if not isinstance(found, dict) or any(found.get(name) != value for name, value in asked.items()):
        raise ConfigError("it holds figures of other options", path, "name another file, or remove it")
    return found


def write_kept(path: Path | None, figures: Mapping[str, Any], indent: int | None = None) -> None:
    """Write all figures that there are."""
    if path is not None:
        write_atomic(path, (json.dumps(figures, indent=indent) + "\n").encode())
