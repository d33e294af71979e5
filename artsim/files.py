"""Reading untrusted files and writing whole ones."""

from __future__ import annotations

import contextlib
import errno
import os
import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artsim.errors import ArtsimError, AssetError, ConfigError


def write_atomic(path: Path, data: bytes) -> None:
    """Write a file so that it is either absent (or as before) or whole, whatever happens meanwhile.

    Raises
    ------
    ConfigError
        When the folder cannot be written to, or the disk is full.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise write_error(error, path) from error


def write_error(error: OSError, path: Path) -> ArtsimError:
    """The readable form of an operating-system error on writing ``path``."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return ConfigError("the disk is full", path, "free some space and run the same command again: it resumes")
    return ConfigError(f"cannot write ({error.strerror})", path, "choose another --out folder or mend its rights")


def read_bounded(path: Path, max_bytes: int, what: str) -> bytes:
    """The content of a file, refused above a size.

    Raises
    ------
    AssetError
        When the file is missing, unreadable or larger than ``max_bytes``.
    """
    try:
        size = path.stat().st_size
        if size > max_bytes:
            raise AssetError(
                f"{what} of {size / 1e6:.0f} MB is over the limit of {max_bytes / 1e6:.0f} MB",
                path,
                "raise the limit with artsim.load(..., limits=LoadLimits(...)) if you trust the file",
            )
        return path.read_bytes()
    except OSError as error:
        raise AssetError(f"cannot read {what} ({error.strerror})", path, "check the path and its rights") from error


def read_npz(path: Path) -> dict[str, NDArray[np.generic]]:
    """All arrays of an ``.npz`` file, never unpickling.

    Raises
    ------
    AssetError
        When the file is missing or damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except (OSError, ValueError, zipfile.BadZipFile, EOFError) as error:
        raise AssetError(f"cannot read the archive ({error})", path, "generate it again") from error
