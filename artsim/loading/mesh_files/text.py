"""Rows of numbers in text files of millions of rows, read by NumPy instead of row by row."""

import codecs
import re
import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.loading.mesh_files.surface import UnusableMeshError

_WORD = 8
"""Letters of a row's first word that are told apart: as many as fit a number, which sorts fast."""

_BLANKS = bytes(c if c == ord("\n") else max(c, ord(" ")) for c in range(256))
"""Tabs and other characters that control a terminal become blanks."""

_MAX_ROWS = 8_000_000
"""For as many faces as a mesh may have, and their vertices; each takes some 20 bytes of memory besides its text."""

FEW_WORDS = 10
"""First words of rows that are named: the most frequent ones."""

_BLOCK = 1_000_000

_SMALL = 4096
"""Letters of a text that are read word by word where need be."""

_RUNS = 100
"""Runs of rows that are copied one by one."""

_MAX_UNREADABLE = 20_000
"""Words that are no numbers in a file that is damaged; more make it something else."""


def plain_text(data: bytes) -> bytes:
    """Text with newlines for any line end, blanks for tabs, and no blank before a row's first word."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        data = data.decode("utf-16", "replace").encode("ascii", "replace")
    data = data.removeprefix(codecs.BOM_UTF8)
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    data = data.translate(_BLANKS)
    while b"  " in data:
        data = data.replace(b"  ", b" ")
    return data.replace(b"\n ", b"\n").removeprefix(b" ")


def substitute(pattern: bytes, replacement: bytes, text: bytes) -> bytes:
    """Replace within rows, some thousand rows at a time: each match takes tens of bytes of memory."""
    compiled, blocks, at = re.compile(pattern), [], 0
    while at < len(text):
        end = text.find(b"\n", at + _BLOCK) + 1 or len(text)
        blocks.append(compiled.sub(replacement, text[at:end]))
        at = end
    return b"".join(blocks)


@dataclass(frozen=True)
class Rows:
    """The rows of a plain text.

    Raises
    ------
    UnusableMeshError
        When there are too many.
    """

    data: bytes

    def __post_init__(self) -> None:
        if self.data.count(b"\n") > _MAX_ROWS or len(self.data) >= 2**31:
            raise UnusableMeshError(f"has over {_MAX_ROWS} rows")

    @cached_property
    def _bytes(self) -> NDArray[np.uint8]:
        return np.frombuffer(self.data + b"\n", np.uint8)

    @cached_property
    def _ends(self) -> NDArray[np.int32]:
        return np.flatnonzero(self._bytes == ord("\n")).astype(np.int32)

    @cached_property
    def _starts(self) -> NDArray[np.int32]:
        return np.concatenate([np.zeros(1, np.int32), self._ends[:-1] + 1])

    @cached_property
    def _first(self) -> NDArray[np.uint8]:
        """The first letter of each row, or its newline."""
        return self._bytes[self._starts]

    @cached_property
    def _two(self) -> NDArray[np.uint16]:
        """The first two letters of each row as one number; newlines for those that are not there."""
        return self._first * np.uint16(256) + self._bytes[np.minimum(self._starts + 1, self._ends)]

    def which(self, word: bytes) -> NDArray[np.bool_]:
        """Which rows begin with a word, alone or before a blank."""
        head = word[0] << 8
        if len(word) == 1:
            return (self._two == head + ord(" ")) | (self._two == head + ord("\n"))
        here = self._two == head + word[1]
        rows = np.flatnonzero(here)
        if len(rows) == 0:
            return here
        for i, letter in enumerate(word[2:] + b" ", start=2):
            found = self._bytes[np.minimum(self._starts[rows] + i, self._ends[rows])]
            fits = (found == letter) | ((found == ord("\n")) & (i == len(word)))
            here[rows] &= fits
            rows = rows[fits]
        return here

    def are_silent(self) -> NDArray[np.bool_]:
        """Which rows are blank, or begin with #."""
        return (self._first == ord("#")) | (self._first == ord("\n"))

    def rest(self, which: NDArray[np.bool_], word: bytes) -> bytes:
        """What follows a word in the rows that begin with it, each with its newline."""
        steps = np.flatnonzero(np.concatenate([which[:1], which[1:] != which[:-1], which[-1:]]))
        if len(steps) <= 2 * _RUNS:  # rows of a kind mostly stand together
            runs = steps.reshape(-1, 2)
            places = zip(self._starts[runs[:, 0]].tolist(), (self._ends[runs[:, 1] - 1] + 1).tolist(), strict=True)
            text = b"".join([self._bytes[start:end].tobytes() for start, end in places])
            return text[len(word) :].replace(b"\n" + word, b"\n")
        starts, ends = self._starts[which] + len(word), self._ends[which]
        change = np.zeros(len(self._bytes) + 1, dtype=np.int8)
        change[starts] = 1
        change[ends + 1] = -1
        return self._bytes[np.cumsum(change[:-1], dtype=np.int8).view(np.bool_)].tobytes()

    def words(self, which: NDArray[np.bool_]) -> dict[str, int]:
        """How many of some rows begin with each word, by its first letters; "..." stands for the rare ones."""
        which = which & (self._starts < self._ends)
        starts, ends = self._starts[which], self._ends[which]
        if len(starts) == 0:
            return {}
        letters = np.stack([self._bytes[np.minimum(starts + i, ends)] for i in range(_WORD)], axis=1)
        blank = (letters == ord(" ")) | (letters == ord("\n"))
        letters[np.logical_or.accumulate(blank, axis=1)] = 0
        found, counts = np.unique(np.ascontiguousarray(letters).view(">u8"), return_counts=True)
        found, counts = found[found > 0], counts[found > 0]  # without blank rows
        most = np.argsort(-counts, kind="stable")[:FEW_WORDS]
        words = [word.to_bytes(_WORD, "big").rstrip(b"\0") for word in found[most].tolist()]
        texts = [word.decode("ascii", "replace") for word in words]
        told = {text: int(n) for text, n in zip(texts, counts[most].tolist(), strict=True)}
        others = int(counts.sum() - counts[most].sum())
        return told | {"...": others} if others else told


def numbers_per_row(text: bytes) -> NDArray[np.int64]:
    """How many words each row of a text has, the last one ending in a newline."""
    letters = np.frombuffer(b"\n" + text, np.uint8)
    blank = letters <= ord(" ")
    begun = blank[:-1] & ~blank[1:]
    starts = np.flatnonzero(letters[:-1] == ord("\n"))
    return np.add.reduceat(begun, starts, dtype=np.int64) if len(starts) else np.zeros(0, np.int64)


def first_numbers(text: bytes, width: int) -> NDArray[np.float64]:
    """(N, width) first numbers of each row of a text; NaN where there are fewer, or a word is none.

    Raises
    ------
    UnusableMeshError
        When very many words are no numbers.
    """
    per_row = numbers_per_row(text)
    values = numbers(text, np.float64, np.nan, int(per_row.sum()))
    if (per_row == width).all():
        return values.reshape(-1, width)
    values = np.append(values, np.nan)
    at = (np.cumsum(per_row) - per_row)[:, None] + np.arange(width)
    return values[np.where(per_row[:, None] >= width, at, len(values) - 1)]


def numbers(text: bytes, dtype: type[np.generic], unreadable: float, count: int | None = None) -> NDArray[Any]:
    """One number of each word of a text: ``unreadable`` where it is none.

    ``count`` is how many words there are, for who has counted them already.

    Raises
    ------
    UnusableMeshError
        When very many words are no numbers.
    """
    blocks = _blocks(text, dtype, unreadable, count, [_MAX_UNREADABLE])
    return blocks[0] if len(blocks) == 1 else np.concatenate([np.zeros(0, dtype), *blocks])


def _blocks(
    text: bytes, dtype: type[np.generic], unreadable: float, count: int | None, patience: list[int]
) -> list[NDArray[Any]]:
    """The numbers of a text, in pieces: halves are tried again until the words that are no numbers stand alone."""
    if not text or text.isspace():  # NumPy would find a number in it
        return []
    found = _read(text, dtype)
    if found is not None and len(found) == (_num_words(text) if count is None else count):
        return [found]
    middle = text.find(b" ", len(text) // 2)
    if len(text) < _SMALL or middle < 0:
        values = [_number(word, dtype) for word in text.translate(_BLANKS).split()]
        patience[0] -= sum(value is None for value in values)
        if patience[0] < 0:
            raise UnusableMeshError("holds words where numbers belong")
        return [np.array([unreadable if value is None else value for value in values], dtype)]
    halves = text[:middle], text[middle:]
    return [block for half in halves for block in _blocks(half, dtype, unreadable, None, patience)]


def _read(text: bytes, dtype: type[np.generic]) -> NDArray[Any] | None:
    """Numbers of a text; None, or too few, where a word is none."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # how NumPy says, in some versions, that it stopped in the middle
            return np.fromstring(text, dtype=dtype, sep=" ")
    except (ValueError, DeprecationWarning):
        return None


def first_of_each(text: bytes, count: int) -> NDArray[np.int64]:
    """The first number of each word such as ``1/2/3``, 0 where it is none; ``count`` is how many words there are.

    Raises
    ------
    UnusableMeshError
        When very many words are no numbers.
    """
    slashes, odd = divmod(text.count(b"/"), max(count, 1))
    if slashes and not odd:  # all words may be alike: then their numbers are read at once
        frame = text.translate(None, b"-0123456789\n")
        found = _read(text.replace(b"/", b" "), np.int64) if frame == (b" " + b"/" * slashes) * count else None
        # Words such as 1//3 have a number less, if all have their slashes side by side.
        each = slashes if slashes == 2 and text.count(b"//") == count else slashes + 1
        if found is not None and len(found) == count * each:
            return found[::each].astype(np.int64)
    return numbers(substitute(rb"/[^ \n]*", b"", text) if b"/" in text else text, np.int64, 0, count)


def _num_words(text: bytes) -> int:
    blank = np.frombuffer(b" " + text, np.uint8) <= ord(" ")
    return int((blank[:-1] & ~blank[1:]).sum())


def _number(word: bytes, dtype: type[np.generic]) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    if b"_" in word:  # Python's, not a file's
        return None
    if np.issubdtype(dtype, np.integer) and not (abs(value) < 2**53 and value == int(value)):
        return None
    return value
