"""Bytes and arrays of untrusted files, bounded before anything is expanded.

Every limit here is for one file of a user. A cloud or a depth image of today's largest sensors is well below them, and
a file that is hostile costs less than half a gigabyte and two seconds.
"""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from artsim.common.array_files import npy_header, read_array
from artsim.common.files import read_bounded
from artsim.errors import ArtsimError, ConfigError

MAX_BYTES = 80_000_000
"""Of a file: it is held beside its values as doubles."""
MAX_VALUES = 9_000_000
"""Of an array: 3 million points, or a depth image of 9 megapixels, which are 72 MB as doubles."""
MAX_TEXT_BYTES = 48_000_000
"""Of a file of text, which takes much longer to read than the same numbers in binary: a million points with colours."""
MAX_LINES = 3_000_000
"""Of numbers in text, of which a core reads two million a second."""
MAX_LINE_BYTES = 20_000
"""Of a line of numbers, whose words are all kept in memory for a moment."""
MAX_VERTICES = 900_000
"""Of a mesh in text, whose lines are looked for one by one."""
MAX_DIRECTORY_BYTES = 1_000_000
"""Of the list of members of an archive; zipfile keeps a record of each of them."""
_ZIP_END, _ZIP_END_BYTES = b"PK\x05\x06", 22

Arrays = NDArray[Any]


def read_file(path: Path, what: str, limit: int = MAX_BYTES) -> bytes:
    """The content of a file.

    Parameters
    ----------
    path : Path
    what : str
        What the file is, for messages.
    limit : int
        Bytes above which it is refused.

    Raises
    ------
    ConfigError
        When it is missing, no file, unreadable, or too large.
    """
    return read_bounded(path, limit, what, ConfigError, fix="thin it out, or crop it to the object")


def guard(read: Callable[[], Any], path: Path, what: str, fix: str) -> Any:
    """What ``read`` returns; whatever goes wrong with bytes that are not what they should be is one readable error."""
    try:
        return read()
    except ArtsimError:
        raise
    except Exception as error:  # NumPy, zlib, Pillow and PyYAML fail in many ways on bytes that are not theirs
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise ConfigError(f"no {what} can be read ({reason})", path, fix) from error


def read_npy(path: Path, what: str, fix: str) -> Arrays:
    """The array of an ``.npy`` file; never unpickles, and errors as :func:`read_file`."""

    def read() -> Arrays:
        data = read_file(path, what, 8 * MAX_VALUES + 10_000)
        return _array(io.BytesIO(data), len(data), path)

    return guard(read, path, what, fix)


def read_npz(path: Path, what: str, fix: str, fits: Callable[[tuple[int, ...], np.dtype[Any]], bool]) -> Choice:
    """Arrays of an ``.npz`` file by what their headers say; see :class:`Choice`.

    Parameters
    ----------
    path, what, fix
        As for :func:`guarded`.
    fits : callable
        Whether an array of a shape and a type may be what is looked for.
    """

    def read() -> Choice:
        with io.BytesIO(read_file(path, what)) as file:
            _check_directory(file, path)
            shapes: dict[str, tuple[tuple[int, ...], np.dtype[Any]]] = {}
            with zipfile.ZipFile(file) as archive:
                for member in archive.infolist():
                    if member.filename.endswith(".npy"):
                        with archive.open(member) as stream:
                            shape, _, dtype, _ = npy_header(stream)  # type: ignore[arg-type]
                        shapes[member.filename.removesuffix(".npy")] = shape, dtype
        return Choice(path, what, fix, {n: shape for n, (shape, dtype) in shapes.items() if fits(shape, dtype)}, shapes)

    return guard(read, path, what, fix)


class Choice:
    """Arrays of an archive, of which one is wanted. Nothing but headers is read before it is chosen.

    Attributes
    ----------
    fitting : dict of str to tuple of int
        Shapes of the arrays that may be what is looked for.
    """

    def __init__(
        self, path: Path, what: str, fix: str, fitting: Mapping[str, tuple[int, ...]], every: Mapping[str, Any]
    ):
        self.path, self.what, self.fix = path, what, fix
        self.fitting, self._every = dict(fitting), every

    def one_of(self, names: tuple[str, ...]) -> tuple[str, Arrays]:
        """The first array that has one of these names, or else the only one that fits.

        Raises
        ------
        ConfigError
            When there is none, or several fit.
        """
        name = next((n for wanted in names for n in self.fitting if n.lower() == wanted), None)
        if name is None and len(self.fitting) == 1:
            name = next(iter(self.fitting))
        if name is None:
            listing = ", ".join(f"{n} {shape}" for n, (shape, _) in list(self._every.items())[:8]) or "nothing"
            count = "none" if not self.fitting else "more than one"
            raise ConfigError(
                f"{count} of its arrays fits a {self.what} (it holds {listing[:300]})", self.path,
                f"save the {self.what} as '{names[0]}'",
            )  # fmt: skip
        return name, guard(lambda: self._read(name), self.path, self.what, self.fix)

    def _read(self, name: str) -> Arrays:
        with io.BytesIO(read_file(self.path, self.what)) as file, zipfile.ZipFile(file) as archive:
            member = archive.getinfo(f"{name}.npy")
            with archive.open(member) as stream:
                return _array(stream, member.file_size, self.path)  # type: ignore[arg-type]


def check_count(values: int, path: Path, what: str) -> None:
    """Refuse more values than any cloud or image has."""
    if values > MAX_VALUES:
        raise ConfigError(
            f"{what} of {values:,} values is over the limit of {MAX_VALUES:,}", path, "thin it out, or crop it"
        )


def _array(stream: BinaryIO, size: int, path: Path) -> Arrays:
    """An array, unless it has more values than any cloud or image has."""
    shape, _, dtype, _ = npy_header(stream)
    count = math.prod(shape)
    check_count(count * max(1, len(dtype.names or ())), path, "an array")
    if count * dtype.itemsize > 8 * MAX_VALUES:
        raise ConfigError("it is too large", path, "save fewer points, or fewer columns")
    stream.seek(0)
    return read_array(stream, size)


def _check_directory(file: BinaryIO, path: Path) -> None:
    """Refuse an archive whose list of members alone would fill the memory; the stream is back at its start then."""
    size = file.seek(0, 2)
    file.seek(max(0, size - 65_536 - _ZIP_END_BYTES))
    tail = file.read()
    file.seek(0)
    at = tail.rfind(_ZIP_END)
    if at < 0 or len(tail) < at + _ZIP_END_BYTES:
        raise ValueError("it is no archive")
    if int.from_bytes(tail[at + 12 : at + 16], "little") > MAX_DIRECTORY_BYTES:
        raise ConfigError("its list of members is too long", path, "save one array, or a few")
