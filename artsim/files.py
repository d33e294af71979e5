"""Reading untrusted files and writing whole ones."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

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


MAX_JSON_BYTES = 64_000_000
"""The description of a dataset of 100,000 objects takes half of it."""


def read_json(path: Path, what: str, error: type[ArtsimError] = AssetError, max_bytes: int = MAX_JSON_BYTES) -> Any:
    """The content of an untrusted JSON file, bounded in size and in depth.

    Parameters
    ----------
    path : Path
    what : str
        What the file is, for messages.
    error : type of ArtsimError
        Raised when the file cannot be used.
    max_bytes : int

    Raises
    ------
    ArtsimError
        Of the type ``error``: when the file is missing, too large, nested too deeply, or not JSON.
    """
    try:
        return parse_json(read_bounded(path, max_bytes, what))
    except ValueError as problem:
        raise error(f"{what} is not usable JSON ({problem})", path, "restore the file, or make it again") from problem
    except AssetError as problem:
        raise error(problem.what, problem.where, problem.fix) from problem


def parse_json(data: bytes) -> Any:
    """The value of a JSON text.

    Raises
    ------
    ValueError
        When it is not JSON in UTF-8, or is nested too deeply.
    """
    try:
        return json.loads(data.decode("utf-8"))
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


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
