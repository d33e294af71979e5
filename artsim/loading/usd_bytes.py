"""The bytes of USD files, looked at before usd-core reads them.

Its reader of text calls itself for each bracket inside another, and ends the process where these are too many. Its
reader of binary files, called crates, reserves what a file declares and looks afterwards. A crate has a header, a table
of sections, and in each section compressed lists, each with its size before it.
"""

from __future__ import annotations

import re
import struct

import numpy as np

from artsim.loading.usd_crate_lists import RATIO
from artsim.loading.usd_crate_values import are_sound

_MAX_NESTING = 600
"""Brackets inside each other: each prim, dictionary, list and tuple is one."""
_QUOTED = re.compile(
    rb"""\"{3}.*?(?:\"{3}|\Z)|'{3}.*?(?:'{3}|\Z)|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|@{3}.*?(?:@{3}|\Z)|@[^@\n]*@|\#[^\n]*""",
    re.DOTALL,
)
"""Texts, names of files and comments."""
MAGIC = b"PXR-USDC"
_HEADER, _ENTRY = 24, 32
_MAX_SECTIONS = 64
_OLDEST = (0, 4)
"""Lists of older files are not compressed."""
_SIZES = {b"TOKENS": 1, b"FIELDS": 2, b"FIELDSETS": 1, b"PATHS": 3, b"SPECS": 3}
"""Compressed lists of each section."""


def problem_of(data: bytes) -> str | None:
    """What is wrong with a USD file, text or binary, before it is read; None where nothing is."""
    return _problem_of_crate(data) if data.startswith(MAGIC) else _problem_of_text(data)


def _problem_of_text(data: bytes) -> str | None:
    """Too many brackets inside each other."""
    codes = np.frombuffer(_QUOTED.sub(b"", data), dtype=np.uint8)
    step = np.zeros(256, dtype=np.int8)
    step[list(b"([{")], step[list(b")]}")] = 1, -1
    steps = step[codes]
    depth = np.cumsum(steps[steps != 0], dtype=np.int64)
    return f"over {_MAX_NESTING} brackets inside each other" if depth.max(initial=0) > _MAX_NESTING else None


def _problem_of_crate(data: bytes) -> str | None:
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
        name = data[entry : entry + 16].partition(b"\0")[0]
        start, size = _count(data, entry + 16), _count(data, entry + 24)
        if start < _HEADER or start + size > len(data) or not _is_sound(name, data[start : start + size]):
            return f"its section {name.decode('latin-1')!a} is damaged"
        if name == b"FIELDS" and not are_sound(data, start):
            return "its values are damaged, or too many"
    return None


def _is_sound(name: bytes, section: bytes) -> bool:
    """Whether a section can hold as much as it says."""
    if len(section) < 8:
        return False
    if _count(section, 0) > RATIO * len(section):
        return False
    at = 8
    if name in (b"TOKENS", b"PATHS"):  # bytes of all tokens; the number of paths once more
        if _count(section, at) > RATIO * len(section):
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
