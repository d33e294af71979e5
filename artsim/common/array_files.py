"""Untrusted files of arrays, ``.npz`` and ``.npy``: never unpickled, and bounded before anything is expanded."""

import io
import math
import zipfile
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from artsim.common.files import read_bounded
from artsim.errors import ArtsimError, AssetError

MAX_ARRAY_BYTES = 256_000_000
"""Arrays of one archive, expanded."""

_FREE_BYTES, _MAX_RATIO = 32_000_000, 100
"""An archive may expand to so many bytes at any rate, and beyond them to so many times its own size: clouds and weights
shrink to a third at best, and only bombs by a thousand."""

_MAX_MEMBERS = 10_000
_MAX_NPY_HEADER = 4096
"""The header of a plain array takes 128 bytes."""


def read_npz(
    path: Path,
    what: str = "archive",
    error: type[ArtsimError] = AssetError,
    max_bytes: int = MAX_ARRAY_BYTES,
) -> dict[str, NDArray[Any]]:
    """All arrays of an ``.npz`` file, never unpickling, bounded before they are expanded.

    Parameters
    ----------
    path : Path
    what : str
        What the file is, for messages.
    error : type of ArtsimError
        Raised when the file cannot be used.
    max_bytes : int
        Of the file, and of all arrays together.

    Raises
    ------
    ArtsimError
        Of the type ``error``: when the file is missing, damaged, too large or holds Python objects.
    """
    data = read_bounded(path, max_bytes, what, error, fix="make it again with less in it")
    try:
        return parse_npz(data, max_bytes)
    except ValueError as problem:
        raise error(f"{what} cannot be read ({problem})", path, "restore the file, or make it again") from problem


def parse_npz(data: bytes, max_bytes: int = MAX_ARRAY_BYTES) -> dict[str, NDArray[Any]]:
    """All arrays of the bytes of an ``.npz`` file, as :func:`read_npz`.

    Raises
    ------
    ValueError
        When they are damaged, too large when expanded, or hold Python objects.
    """
    # The list of members is as long as it says; it is counted by its marks before it is read.
    if data.count(b"PK\x01\x02") > _MAX_MEMBERS:
        raise ValueError(f"it has over {_MAX_MEMBERS} members")
    left = min(max_bytes, max(_FREE_BYTES, _MAX_RATIO * len(data)))
    arrays: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for member in archive.infolist():
                name = member.filename.removesuffix(".npy")
                if name in arrays:
                    raise ValueError(f"two members are called {name!r}")
                left -= member.file_size
                if left < 0:
                    raise ValueError("it expands to more than the limit")
                with archive.open(member) as stream:
                    arrays[name] = read_array(stream, member.file_size)  # type: ignore[arg-type]  # has read()
                    stream.read(1)  # at its end, the checksum is compared
    except Exception as problem:  # zipfile and zlib raise whatever they stumble on in bytes that are not theirs
        raise ValueError(str(problem) or type(problem).__name__) from problem
    return arrays


def read_npy(
    path: Path, what: str = "array", error: type[ArtsimError] = AssetError, max_bytes: int = MAX_ARRAY_BYTES
) -> NDArray[Any]:
    """The array of an ``.npy`` file, never unpickling.

    Raises
    ------
    ArtsimError
        Of the type ``error``: when the file is missing, damaged, too large or holds Python objects.
    """
    data = read_bounded(path, max_bytes, what, error, fix="make it again with less in it")
    try:
        return parse_npy(data)
    except ValueError as problem:
        raise error(f"{what} cannot be read ({problem})", path, "restore the file, or make it again") from problem


def parse_npy(data: bytes) -> NDArray[Any]:
    """The array of the bytes of an ``.npy`` file.

    Raises
    ------
    ValueError
        When they are damaged or hold Python objects.
    """
    return read_array(io.BytesIO(data), len(data))


def npy_header(stream: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype[Any], int]:
    """What an array in NumPy's format says of itself; its numbers are next in the stream.

    Returns
    -------
    shape : tuple of int
    fortran : bool
        Whether columns, not rows, are together.
    dtype : dtype
        May be of Python objects, which nobody may read.
    offset : int
        Bytes before the numbers.

    Raises
    ------
    ValueError
        When it is damaged.
    """
    start = stream.read(12)
    length = int.from_bytes(start[8:10] if start[6:7] == b"\x01" else start[8:12], "little")
    if start[:6] != b"\x93NUMPY" or length > _MAX_NPY_HEADER:
        raise ValueError("it is no array in NumPy's format")
    offset = 10 if start[6:7] == b"\x01" else 12
    shape, fortran, dtype = _header_fields(start[8:] + stream.read(length - (12 - offset)), offset)
    return shape, fortran, dtype, offset + length


@lru_cache(maxsize=256)
def _header_fields(text: bytes, offset: int) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, order and type; to parse them takes longer than to read a cloud, and all clouds of a dataset have few."""
    header = io.BytesIO(text)
    read_header = np.lib.format.read_array_header_1_0 if offset == 10 else np.lib.format.read_array_header_2_0
    try:
        shape, fortran, dtype = read_header(header, max_header_size=_MAX_NPY_HEADER)
    except Exception as problem:  # NumPy lets through what Python's parser raises on a text that is not its own
        raise ValueError("the header of an array is damaged") from problem
    if any(side < 0 for side in shape):
        raise ValueError(f"there is no shape {shape}")
    return tuple(int(side) for side in shape), fortran, dtype


def read_array(stream: BinaryIO, size: int) -> NDArray[Any]:
    """One array in NumPy's format out of ``size`` bytes: its header is compared with them before memory is taken.

    Raises ValueError as :func:`parse_npy`.
    """
    shape, fortran, dtype, offset = npy_header(stream)
    if dtype.hasobject:
        raise ValueError("it holds Python objects, which are never read")
    wanted = math.prod(shape) * dtype.itemsize
    if not 0 <= wanted <= size - offset or dtype.itemsize == 0:
        raise ValueError(f"an array says that it takes {wanted} bytes, but there are {size - offset}")
    content = stream.read(wanted)
    if len(content) != wanted:
        raise ValueError("an array ends too early")
    flat = np.frombuffer(bytearray(content), dtype=dtype)  # a bytearray can be written to, as what np.load returns
    return flat.reshape(shape, order="F" if fortran else "C")
