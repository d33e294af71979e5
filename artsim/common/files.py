"""Reading untrusted files and writing whole ones.

Every size is known, and refused when it is too large, before anything is expanded: bytes of a file, values of a JSON
text, arrays of an archive, pixels of an image.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import io
import json
import math
import os
import re
import stat
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from artsim.common.known_files import note_input, refuse_special
from artsim.errors import ArtsimError, AssetError, ConfigError

if TYPE_CHECKING:
    from PIL import Image


def write_atomic(path: Path, data: bytes) -> None:
    """Write a file so that it is either absent (or as before) or whole, whatever happens meanwhile.

    Raises
    ------
    ConfigError
        When the folder cannot be written to, the disk is full, or the path is that of a folder, a pipe or a device.
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
    refuse_special(path)
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


def append(path: Path, data: bytes) -> None:
    """Add to the end of a file, which is made if missing.

    Raises
    ------
    ConfigError
        When it cannot be written.
    """
    try:
        with path.open("ab") as file:
            file.write(data)
    except OSError as error:
        raise write_error(error, path) from error


def write_error(error: OSError, path: Path) -> ArtsimError:
    """The readable form of an operating-system error on writing ``path``."""
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return ConfigError("the disk is full", path, "free some space and run the same command again: it resumes")
    in_the_way = next((each for each in (path, *path.parents) if each.is_file()), None)
    if in_the_way is not None and error.errno in (errno.EEXIST, errno.ENOTDIR):
        return ConfigError("it is a file, where a folder is to be written", in_the_way, "name another folder for --out")
    return ConfigError(f"cannot write ({error.strerror})", path, "choose another folder or correct its permissions")


def file_sha256(path: Path) -> str:
    """Hex digest of a file, read in pieces."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


_RAISE_LIMITS = "raise the limit with artsim.load(..., limits=LoadLimits(...)) if you trust the file"


def read_bounded(
    path: Path,
    max_bytes: int,
    what: str,
    error: type[ArtsimError] = AssetError,
    inside: Path | None = None,
    fix: str | None = None,
) -> bytes:
    """The content of a regular file, refused above a size.

    Pipes and devices are refused without waiting for them.

    Parameters
    ----------
    path : Path
    max_bytes : int
    what : str
        What the file is, for messages.
    error : type of ArtsimError
        Raised when the file cannot be used.
    inside : Path, optional
        Folder that the file must lie in once every link is followed. The folder itself may be reached through links.
    fix : str, optional
        What a user can do about a file that is too large. By default: raise the limits of an asset, pass another file.

    Raises
    ------
    ArtsimError
        Of the type ``error``: when the file is missing, unreadable, no regular file, outside ``inside``, or larger than
        ``max_bytes``.
    """
    try:
        if inside is not None and not path.resolve().is_relative_to(inside.resolve()):
            raise error(f"{what} is a link that leads out of the folder", path, "put the file itself there")
        # Without O_NONBLOCK, opening a pipe waits for somebody to write to it.
        flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        with os.fdopen(os.open(path, flags), "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise error(f"{what} is no regular file", path, "pass a file")
            if status.st_size > max_bytes:
                mend = fix or (_RAISE_LIMITS if error is AssetError else "pass a smaller file")
                raise error(
                    f"{what} of {status.st_size / 1e6:.3g} MB is over the limit of {max_bytes / 1e6:.3g} MB", path, mend
                )
            data = file.read(status.st_size + 1)
        note_input(path)
    except IsADirectoryError as problem:
        raise error(f"{what} is a folder", path, "pass a file") from problem
    except (OSError, ValueError, RuntimeError) as problem:  # a null in the name is a ValueError, links in a circle
        reason = getattr(problem, "strerror", None) or problem  # are a RuntimeError before Python 3.13
        raise error(f"cannot read {what} ({reason})", path, "check the path and its rights") from problem
    if len(data) > status.st_size:
        raise error(f"{what} grows while it is read", path, "try again once it is whole")
    return data


def read_text(path: Path, what: str, error: type[ArtsimError] = AssetError, max_bytes: int = 16_000_000) -> str:
    """The content of a text file in UTF-8, with or without a byte order mark; any line end becomes a newline.

    Raises
    ------
    ArtsimError
        Of the type ``error``: when the file cannot be read, is too large or is not UTF-8.
    """
    data = read_bounded(path, max_bytes, what, error, fix="split it, or store it in a binary format")
    try:
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as problem:
        raise error(f"{what} is not text in UTF-8 ({problem.reason})", path, "save it as UTF-8") from problem


MAX_JSON_BYTES = 64_000_000
"""The description of a dataset of 100,000 objects takes half of it."""

_MAX_JSON_VALUES = 3_000_000
"""About 100 bytes each in memory."""

_MAX_JSON_DEPTH = 64
"""Python itself fails at about 1,000, later and elsewhere: when such a value is printed, for one."""


def read_json(
    path: Path,
    what: str,
    error: type[ArtsimError] = AssetError,
    max_bytes: int = MAX_JSON_BYTES,
    finite: bool = True,
) -> Any:
    """The content of an untrusted JSON file, bounded in size and in depth.

    Parameters
    ----------
    path : Path
    what : str
        What the file is, for messages.
    error : type of ArtsimError
        Raised when the file cannot be used.
    max_bytes : int
    finite : bool
        Refuse Python's ``NaN`` and ``Infinity``, which are not JSON, and numbers that no float holds.

    Raises
    ------
    ArtsimError
        Of the type ``error``: when the file is missing, too large, nested too deeply, or not JSON.
    """
    data = read_bounded(path, max_bytes, what, error, fix="restore the file, or make it again")
    try:
        return parse_json(data, finite)
    except ValueError as problem:
        raise error(f"{what} is not usable JSON ({problem})", path, "restore the file, or make it again") from problem


def parse_json(data: bytes, finite: bool = True) -> Any:
    """The value of a JSON text. Its whole numbers fit 64 bits, and with ``finite``, all its numbers are finite.

    Raises
    ------
    ValueError
        When it is not JSON in UTF-8, is nested too deeply, or holds too many values or a number out of range.
    """
    # Each value follows one of these; strings may hold some too, which only makes the bound stricter.
    if data.count(b",") + data.count(b"[") + data.count(b"{") > _MAX_JSON_VALUES:
        raise ValueError(f"it holds over {_MAX_JSON_VALUES:,} values")
    try:
        text = data.decode("utf-8-sig")
        if finite:
            value = json.loads(text, parse_int=_whole, parse_float=_real, parse_constant=_refuse_constant)
        else:
            value = json.loads(text, parse_int=_whole)
        if re.search(rb"\\u[dD][89a-fA-F]", data):  # half of a pair, alone, is no text: nothing can be written with it
            json.dumps(value, ensure_ascii=False).encode()
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except (UnicodeDecodeError, UnicodeEncodeError) as error:
        raise ValueError(f"it is not text in UTF-8: {error.reason}") from None
    level = [value]
    for _ in range(_MAX_JSON_DEPTH):
        level = [
            child
            for one in level
            if isinstance(one, (dict, list))
            for child in (one.values() if isinstance(one, dict) else one)
        ]
        if not level:
            return value
    raise ValueError("it is nested too deeply")


def _whole(text: str) -> int:
    if len(text) > 20 or not -(1 << 63) <= (value := int(text)) < 1 << 64:
        raise ValueError("it holds a whole number of over 64 bits")
    return value


def _real(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise ValueError("it holds a number that is out of range")
    return value


def _refuse_constant(text: str) -> float:
    raise ValueError(f"{text} is no number in JSON")


MAX_IMAGE_PIXELS = 32_000_000
"""More than 6,500 x 4,900: four bytes each, and once more when they become an array."""

_IMAGE_FORMATS = ("PNG", "TIFF", "PPM", "JPEG", "BMP", "WEBP")
"""Pillow knows others, some of which start programs."""


def open_image(
    source: Path | bytes,
    what: str = "image",
    error: type[ArtsimError] = ConfigError,
    max_pixels: int = MAX_IMAGE_PIXELS,
    where: str | Path | None = None,
) -> Image.Image:
    """An image, decoded; its size is taken from its header and refused before it is decoded.

    Parameters
    ----------
    source : Path or bytes
        A file, or its content.
    what : str
        What it is, for messages.
    error : type of ArtsimError
        Raised when the image cannot be used.
    max_pixels : int
    where : str or Path, optional
        Where bytes come from, for messages.

    Raises
    ------
    ArtsimError
        Of the type ``error``: when there is no image, or it is damaged or too large.
    """
    from PIL import Image

    if isinstance(source, Path):
        where = source
        source = read_bounded(source, 8 * max_pixels, what, error, fix="make it smaller")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow warns of what is refused just below
            image = Image.open(io.BytesIO(source), formats=_IMAGE_FORMATS)
            pixels = image.width * image.height
            if pixels <= max_pixels:
                image.load()
    except Exception as problem:  # Pillow raises whatever it stumbles on in bytes that are not an image's
        raise error(f"{what} cannot be read ({problem})", where, "save it as PNG") from problem
    if pixels > max_pixels:
        raise error(f"{what} of {image.width} x {image.height} pixels is too large", where, "make it smaller")
    return image
