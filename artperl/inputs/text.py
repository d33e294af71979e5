"""Clouds of text: .xyz, .txt, .csv, .pts, .asc, with any separator, with or without a line of names."""

import io
import re
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import MAX_LINE_BYTES, MAX_LINES, MAX_TEXT_BYTES, guard, read_file
from artsim.common.names import is_number
from artsim.errors import ConfigError

Array = NDArray[np.float64]

_FIX = "write x, y, z in each line, with blanks, commas or semicolons between them"
_COMMENTS = ("#", "//", "%", ";")
_MOST_HEAD = 100
"""Lines before the first numbers, at most."""


def read_text(path: Path) -> tuple[Array, tuple[str, ...]]:
    """(N, 3) points, and which columns they are.

    Raises
    ------
    ConfigError
        When a line is no point.
    """
    return guard(lambda: _read(path), path, "cloud", _FIX)


def parse_columns(
    data: bytes, columns: list[int], separator: str | None, skip: int = 0, rows: int | None = None, comma: bool = False
) -> Array:
    """(N, C) numbers of some columns of a text; ``comma``: a comma is the decimal point.

    Raises
    ------
    ValueError
        When a line does not have them.
    """
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if comma:
        data = data.replace(b",", b".")
    if len(data) > MAX_TEXT_BYTES or (rows or data.count(b"\n")) > MAX_LINES:
        raise ValueError(f"more than {MAX_LINES:,} lines, or {MAX_TEXT_BYTES // 1_000_000} MB, of text are not read")
    ends = np.flatnonzero(np.frombuffer(data, np.uint8) == ord("\n"))
    if np.diff(ends, prepend=-1, append=len(data)).max() > MAX_LINE_BYTES:
        raise ValueError(f"a line has more than {MAX_LINE_BYTES:,} characters")
    text = io.StringIO(data.decode("latin-1"))
    if not data.strip():
        return np.zeros((0, len(columns)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of empty lines, which are no rows
        return np.loadtxt(
            text, delimiter=separator, usecols=columns, ndmin=2, skiprows=skip, max_rows=rows, comments="#",
            quotechar='"',
        )  # fmt: skip


def _read(path: Path) -> tuple[Array, tuple[str, ...]]:
    data = read_file(path, "cloud", MAX_TEXT_BYTES)
    if b"\x00" in data[:4096]:
        raise ConfigError("it is no text", path, _FIX)
    skip, head, first = _head(data.removeprefix(b"\xef\xbb\xbf"))
    if not first:
        raise ConfigError("it holds no line of numbers", path, _FIX)
    separator = next((s for s in ";," if s in first), None)
    values = _split(first, separator)
    comma = separator == ";" and "," in first
    columns, notes = [0, 1, 2], list[str]()
    names = _split(head, next((s for s in ";," if s in head), None)) if head else []
    if len(names) >= 3:
        columns = _axes([_plain(name) for name in names], path)
        notes.append(f"columns {', '.join(names[c].strip() for c in columns)} are x, y, z")
    elif len(values) > 3:
        notes.append(f"the first three of {len(values)} columns are x, y, z; the others are not used")
    if max(columns) >= len(values):
        raise ConfigError(f"its lines hold {len(values)} numbers", path, _FIX)
    return parse_columns(data.removeprefix(b"\xef\xbb\xbf"), columns, separator, skip, comma=comma), tuple(notes)


def _head(data: bytes) -> tuple[int, str, str]:
    """How many lines come before the numbers, the names of the columns ("" for none), and the first line of numbers."""
    names = ""
    lines = data[:1_000_000].decode("latin-1").replace("\r\n", "\n").replace("\r", "\n").split("\n")
    for number, line in enumerate(lines[:_MOST_HEAD]):
        bare = line.strip()
        comment = bare.startswith(_COMMENTS)
        words = re.split(r"[;,\s]+", bare.strip(";,"))
        if not bare or (len(words) == 1 and not comment):  # a count of points, as .pts and some .xyz have it
            continue
        named = {"x", "y", "z"} <= {_plain(word) for word in re.split(r"[;,\s]+", names)}
        if not comment and (named or all(is_number(word.strip("\"'")) for word in words)):  # labels may be words
            return number, names, bare
        text = bare.lstrip("#/%; ") if comment and not bare.startswith("//X") else bare
        if {"x", "y", "z"} <= {_plain(word) for word in re.split(r"[;,\s]+", text)} or not comment:
            names = text
    return 0, names, ""


def _split(line: str, separator: str | None) -> list[str]:
    return [word.strip().strip("\"'") for word in line.strip().split(separator)]


def _plain(name: str) -> str:
    """The name of a column without what programs and people put around it: //X, "x", x [mm], pos_x, Points:0."""
    bare = re.sub(r"[\[(].*", "", name.strip().strip("\"'").lower()).strip(" /_")
    bare = re.sub(r"^(pos|position|point|points|p|coord)[_.: ]", "", bare)
    return {"0": "x", "1": "y", "2": "z"}.get(bare, bare)


def _axes(names: list[str], path: Path) -> list[int]:
    missing = [axis for axis in "xyz" if axis not in names]
    if missing:
        raise ConfigError(f"its columns are {', '.join(names)[:200]}", path, "name three of them x, y, z")
    return [names.index(axis) for axis in "xyz"]
