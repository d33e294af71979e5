"""Where the members of a tar file lie, in some 50 bytes a sample, so that an index is kept for each shard there is."""

from __future__ import annotations

import tarfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from artsim.common.names import printable

MAX_MEMBER = 1 << 30
"""Bytes of a member at most."""

_NAME, _SIZE, _CHECKSUM, _TYPE, _PREFIX = slice(0, 100), slice(124, 136), slice(148, 156), 156, slice(345, 500)
"""Fields of a header of the POSIX format."""
_ZEROS, _NO_PREFIX, _PLAIN = bytes(tarfile.BLOCKSIZE), bytes(155), (ord("0"), 0)

Member = tuple[str, int, int]
"""Name, offset of the content, size."""


@dataclass(frozen=True, eq=False)
class TarIndex:
    """The members of a tar file by sample."""

    keys: NDArray[np.bytes_]
    """(S,) bytes. What the names of a sample's members begin with, up to the first dot; in ascending order."""
    starts: NDArray[np.int32]
    """(S + 1,) int32. First member of each sample, and the number of members."""
    offsets: NDArray[np.int64]
    """(M,) int64."""
    sizes: NDArray[np.int32]
    """(M,) int32."""
    kinds: NDArray[np.int32]
    """(M,) int32. Which of ``suffixes`` a name ends with."""
    suffixes: tuple[str, ...]

    @staticmethod
    def of(members: Sequence[Member]) -> TarIndex:
        """An index of members in the order of the file; of two with one name the later counts."""
        split = [name.partition(".") for name, _, _ in members]
        keys = np.array([_encoded(key) for key, _, _ in split], dtype=bytes)
        suffixes = tuple(dict.fromkeys(suffix for _, _, suffix in split))
        kind = {suffix: i for i, suffix in enumerate(suffixes)}
        order = np.argsort(keys, kind="stable")
        first = np.ones(len(keys), dtype=bool)
        first[1:] = keys[order][1:] != keys[order][:-1]
        starts = np.append(first.nonzero()[0], len(keys)).astype(np.int32)
        return TarIndex(
            keys[order][first],
            starts,
            np.array([offset for _, offset, _ in members], dtype=np.int64)[order],
            np.array([size for _, _, size in members], dtype=np.int32)[order],
            np.array([kind[suffix] for _, _, suffix in split], dtype=np.int32)[order],
            suffixes,
        )

    def __len__(self) -> int:
        return len(self.keys)

    def in_file_order(self) -> list[str]:
        """Keys in the order in which their first members stand in the file."""
        order = np.argsort(self.offsets[self.starts[:-1]], kind="stable")
        return [key.decode(errors="surrogateescape") for key in self.keys[order].tolist()]

    def members(self, key: str) -> list[Member]:
        """Suffix, offset and size of each member of a sample, in the order of the file; none without that sample."""
        encoded = _encoded(key)
        i = int(self.keys.searchsorted(encoded)) if len(self.keys) else 0
        if i == len(self.keys) or self.keys[i] != encoded:
            return []
        mine = slice(self.starts[i], self.starts[i + 1])
        kinds, offsets, sizes = self.kinds[mine].tolist(), self.offsets[mine].tolist(), self.sizes[mine].tolist()
        return [(self.suffixes[k], offset, size) for k, offset, size in zip(kinds, offsets, sizes, strict=True)]


def _encoded(key: str) -> bytes:
    return key.encode(errors="surrogateescape")


def read_index(file: BinaryIO, size: int) -> TarIndex:
    """The index of an uncompressed tar file.

    Parameters
    ----------
    file : BinaryIO
        At any place.
    size : int
        Of the file, bytes.

    Raises
    ------
    tarfile.TarError
        When it is not a whole tar file.
    ValueError
        When a member is no plain file, too large, or reaches beyond the end.
    """
    members = _plain_members(file, size)
    return TarIndex.of(list(_any_members(file, size)) if members is None else members)


def _plain_members(file: BinaryIO, size: int) -> list[Member] | None:
    """Members of a file as :func:`artsim.datasets.shards.write_tar` writes it; None of any other.

    It reads nothing but headers, and takes a sixth of the time of ``tarfile``, which knows all other kinds.
    """
    members: list[Member] = []
    headers: list[bytes] = []
    at = 0
    while at < size:
        file.seek(at)
        header = file.read(tarfile.BLOCKSIZE)
        if header == _ZEROS:
            return members if _sums_agree(headers) else None
        digits, end = header[_SIZE], header.find(b"\0")
        plain = len(header) == tarfile.BLOCKSIZE and header[_TYPE] in _PLAIN and header[_PREFIX] == _NO_PREFIX
        if not (plain and 0 < end < _NAME.stop and digits[:11].isdigit() and digits[11] == 0):
            return None
        try:
            name, length = header[:end].decode(), int(digits[:11], 8)
        except ValueError:
            return None
        start = at + tarfile.BLOCKSIZE
        _check_inside(name, start, length, size)
        members.append((name, start, length))
        headers.append(header)
        at = start + length + -length % tarfile.BLOCKSIZE
    return None


def _sums_agree(headers: Sequence[bytes]) -> bool:
    """Whether each header has the checksum that it holds: the sum of its bytes, its own field taken as blanks."""
    table = np.frombuffer(b"".join(headers), dtype=np.uint8).reshape(-1, tarfile.BLOCKSIZE)
    sums = table.sum(axis=1, dtype=np.int64) - table[:, _CHECKSUM].sum(axis=1, dtype=np.int64) + 8 * ord(" ")
    return [header[_CHECKSUM] for header in headers] == [b"%06o\0 " % total for total in sums.tolist()]


def _any_members(file: BinaryIO, size: int) -> Iterator[Member]:
    file.seek(0)
    with tarfile.open(fileobj=file, mode="r:") as tar:
        for info in tar:
            if info.type not in (tarfile.REGTYPE, tarfile.AREGTYPE) or info.issparse():
                raise ValueError(f"unexpected member {printable(info.name)}")
            _check_inside(info.name, info.offset_data, info.size, size)
            yield info.name, info.offset_data, info.size


def _check_inside(name: str, start: int, length: int, size: int) -> None:
    if not 0 <= length <= min(MAX_MEMBER, size - start):
        raise ValueError(f"unexpected member {printable(name)}")
