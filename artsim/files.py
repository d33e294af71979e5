"""Reading untrusted files and writing whole ones."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

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
    with atomic_file(path) as file:
        file.write(data)


@contextlib.contextmanager
def atomic_file(path: Path) -> Iterator[BinaryIO]:
    """A new file to write to that takes the place of ``path`` once the block ends without an error.

    Raises
    ------
    ConfigError
        As :func:`write_atomic`.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except BaseException as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise write_error(error, path) from error
        raise


def write_error(error: OSError, path: Path) -> ArtsimError:
    """The readable form of an operating-system error on writing ``path``."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return ConfigError("the disk is full", path, "free some space and run the same command again: it resumes")
    return ConfigError(f"cannot write ({error.strerror})", path, "choose another folder or mend its rights")


def file_sha256(path: Path) -> str:
    """Hex digest of a file, read in pieces."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


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
    except (OSError, ValueError, EOFError, RuntimeError, MemoryError, zipfile.BadZipFile) as error:
        raise AssetError(f"cannot read the archive ({error})", path, "make it again") from error
