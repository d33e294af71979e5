"""The one writer of a folder or of a file; a lock goes with the process, however it ends."""

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from artsim.common.files import write_error
from artsim.errors import ConfigError, DatasetError


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Keep a second run out of a folder, which is made if missing.

    Raises
    ------
    DatasetError
        When another run has it, or the file system has no locks.
    ConfigError
        When it cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / ".lock").open("w")
    except OSError as error:
        raise write_error(error, folder) from error
    with file:
        try:
            _lock(file)
        except BlockingIOError as error:
            raise DatasetError("another run is writing here", folder, "wait for it or stop it") from error
        except OSError as error:
            raise DatasetError(f"cannot lock ({error.strerror})", folder, "use a folder on a local disk") from error
        yield


@contextlib.contextmanager
def file_lock(file: IO[Any], path: Path) -> Iterator[None]:
    """Keep a second program from an open file; without a check where the file system has no locks.

    Raises
    ------
    ConfigError
        When another program has it.
    """
    try:
        _lock(file)
    except BlockingIOError as error:
        raise ConfigError(
            "another program writes to it", path, "wait for its end, or name another file for --out"
        ) from error
    except OSError:  # a file system without locks
        pass
    yield


def _lock(file: IO[Any]) -> None:
    """Lock a file until it is closed; without effect on Windows."""
    if sys.platform != "win32":
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
