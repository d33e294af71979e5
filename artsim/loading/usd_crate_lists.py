"""Compressed lists of binary USD files, called crates: blocks of LZ4."""

from __future__ import annotations

RATIO = 1100
"""Numbers for each byte: LZ4 packs up to 255 bytes into one, and such a byte holds four numbers."""


def unpacked(packed: bytes, size: int) -> bytes:
    """The bytes of a compressed list, which has one block after a zero.

    Raises
    ------
    ValueError, IndexError
        When they are not so many as they should be.
    """
    at, found = 1, bytearray()
    if packed[:1] != b"\0":
        raise ValueError
    while at < len(packed):
        token = packed[at]
        run, at = _length(packed, at + 1, token >> 4, size)
        found += packed[at : at + run]
        at += run
        if at >= len(packed):
            break
        back = packed[at] | packed[at + 1] << 8
        run, at = _length(packed, at + 2, token & 15, size)
        run += 4
        if not 0 < back <= len(found) or len(found) + run > size:
            raise ValueError
        piece = found[len(found) - back :][:run]
        found += (piece * (run // len(piece) + 1))[:run] if len(piece) < run else piece
    if at != len(packed) or len(found) != size:
        raise ValueError
    return bytes(found)


def _length(packed: bytes, at: int, length: int, size: int) -> tuple[int, int]:
    """A length, which goes on where it is 15, and where it ends."""
    more = 255 if length == 15 else 0
    while more == 255 and length <= size:
        more = packed[at]
        length, at = length + more, at + 1
    return length, at
