"""Binary USD files: what their table of contents says is compared with what is there before usd-core takes memory.

usd-core reserves what a file declares and looks afterwards. A crate has a header, a table of sections, and in each
section compressed lists, each with its size before it.
"""

from __future__ import annotations

import struct

MAGIC = b"PXR-USDC"
_HEADER, _ENTRY = 24, 32
_MAX_SECTIONS = 64
_OLDEST = (0, 4)
"""Lists of older files are not compressed."""
_RATIO = 1100
"""Numbers for each byte: LZ4 packs up to 255 bytes into one, and such a byte holds four numbers."""
_SIZES = {b"TOKENS": 1, b"FIELDS": 2, b"FIELDSETS": 1, b"PATHS": 3, b"SPECS": 3}
"""Compressed lists of each section."""


def problem_of_crate(data: bytes) -> str | None:
    """What is wrong with the structure of a binary USD file; None where nothing is."""
    if len(data) < _HEADER or data[: len(MAGIC)] != MAGIC:
        return "it has no header"
    if tuple(data[8:10]) < _OLDEST:
        return f"it is of version {data[8]}.{data[9]}, which is not read"
    table = _count(data, 16)
    sections = _count(data, table)
    if sections > _MAX_SECTIONS or table + 8 + _ENTRY * sections > len(data):
        return "its table of contents is damaged"
    for number in range(sections):
        entry = table + 8 + _ENTRY * number
        name = data[entry : entry + 16].rstrip(b"\0")
        start, size = _count(data, entry + 16), _count(data, entry + 24)
        if start < _HEADER or start + size > len(data) or not _is_sound(name, data[start : start + size]):
            return f"its section {name.decode('latin-1')!a} is damaged"
    return None


def _is_sound(name: bytes, section: bytes) -> bool:
    """Whether a section can hold as much as it says."""
    if len(section) < 8:
        return False
    if _count(section, 0) > _RATIO * len(section):
        return False
    at = 8
    if name in (b"TOKENS", b"PATHS"):  # bytes of all tokens; the number of paths once more
        if _count(section, at) > _RATIO * len(section):
            return False
        at += 8
    for _ in range(_SIZES.get(name, 0)):
        size = _count(section, at)
        at += 8 + size
        if at > len(section):
            return False
    return True


def _count(data: bytes, at: int) -> int:
    """An unsigned number of 64 bits; one that is too large for any file where there is none."""
    return int(struct.unpack_from("<Q", data, at)[0]) if 0 <= at <= len(data) - 8 else 1 << 62
