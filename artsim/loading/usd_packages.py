"""USDZ files: zip archives whose members are stored as they are, the first of them a layer."""

from __future__ import annotations

import struct
from collections.abc import Mapping

_HEADER = struct.Struct("<4sHHHHHIIIHH")
"""Signature, version, flags, method, time, date, checksum, packed size, size, lengths of the name and of its extras."""
_SIGNATURE = b"PK\3\4"
_UTF8 = 0x800
"""The one flag that a member may have: its name is Unicode."""
_MAX_MEMBERS = 10_000
_MAX_NAME = 500


def members(data: bytes) -> Mapping[str, bytes]:
    """Contents of a package by name, in its order; none is unpacked, so none is larger than in the package.

    The headers before the contents are followed, as USD does: the table at the end may say anything, and is not read.

    Raises
    ------
    ValueError
        Saying what is wrong with it.
    """
    found: dict[str, bytes] = {}
    at = 0
    while data[at : at + 4] == _SIGNATURE:
        if at + _HEADER.size > len(data):
            raise ValueError("its last member is cut off")
        _, _, flags, method, _, _, _, packed, size, length, more = _HEADER.unpack_from(data, at)
        start = at + _HEADER.size + length + more
        try:
            name = data[at + _HEADER.size : at + _HEADER.size + length].decode()
        except UnicodeDecodeError:
            raise ValueError("the name of a member is no text") from None
        if method != 0 or packed != size or flags & ~_UTF8:
            raise ValueError(f"its member {name[:100]!a} is compressed or encrypted, which USDZ does not allow")
        if start + size > len(data):
            raise ValueError(f"its member {name[:100]!a} is cut off")
        if name in found or not _is_inside(name):
            raise ValueError(f"its member {name[:100]!a} has a name that two have, or that leads out of it")
        if len(found) == _MAX_MEMBERS:
            raise ValueError(f"it has over {_MAX_MEMBERS} members")
        found[name] = data[start : start + size]
        at = start + size
    if not found:
        raise ValueError("it is no zip archive, or an empty one")
    return found


def _is_inside(name: str) -> bool:
    parts = name.split("/")
    return (
        0 < len(name) <= _MAX_NAME and name.isprintable() and not any(part in ("", ".", "..") for part in parts)
        and not set(name) & set("\\:[]")
    )  # fmt: skip
