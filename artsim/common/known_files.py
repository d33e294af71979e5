"""Files that a program has read, and what else may not be overwritten."""

import os
import stat
from pathlib import Path

from artsim.errors import ConfigError

_read = set[str]()
"""Files that this process has read, by their real paths."""
_MOST = 100_000


def note_input(path: Path) -> None:
    """Remember that this process has read a file."""
    if len(_read) < _MOST:
        _read.add(os.path.realpath(path))


def is_input(path: Path) -> bool:
    """Whether this process has read the file, by whatever path."""
    return os.path.realpath(path) in _read


def refuse_special(path: Path) -> None:
    """Refuse to write where a folder, a pipe, a socket or a device is: a file would take its place.

    Raises
    ------
    ConfigError
    """
    try:
        kind = path.stat().st_mode
    except (OSError, ValueError):  # nothing is there, or what is wrong is told where it is written
        return
    if not stat.S_ISREG(kind):
        what = "a folder" if stat.S_ISDIR(kind) else "no regular file, but a pipe, a socket or a device"
        raise ConfigError(f"it is {what}", path, "name a file to write")
