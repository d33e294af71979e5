"""Values of binary USD files, called crates, looked at before usd-core reads them.

Its reader makes room for as many elements as a value declares, before it looks for them. A crate holds, for each field,
64 bits on its value: flags, a type, and the value itself or its place. Lists, dictionaries and samples over time lie at
such places, with counts before their items; what they hold may be such 64 bits again.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from artsim.loading.usd_crate_lists import RATIO, unpacked

_MAX_FIELDS = 400_000
_MAX_VALUES = 400_000
"""Values looked at, those inside others each time."""
_MAX_DEPTH = 100
"""Values inside each other."""
_ROOM = 1 << 25
"""Bytes that the items of all values take, besides a few times the file: items may be compressed or shared."""
_SHARED = 4
_SIMPLE = (1, 1, 4, 4, 8, 8, 2, 4, 8, 4, 4, 4)
_MATRICES, _TURNS, _VECTORS = (32, 72, 128), (32, 16, 8), (16, 8, 4, 8, 24, 12, 6, 12, 32, 16, 8, 16)
_SIZES = dict(enumerate(_SIMPLE + _MATRICES + _TURNS + _VECTORS, 1)) | {56: 8, 57: 4}
"""Bytes of an element, of each type that comes in arrays."""
_ARRAY, _INLINE, _COMPRESSED, _EDIT = (1 << bit for bit in (63, 62, 61, 60))
"""Flags of a value. An edit is of an array: its elements, and 64-bit numbers on what to do with them."""
_AT, _LONG = (1 << 48) - 1, 5
_WHOLE, _FRACTIONS = (3, 4, 5, 6), (7, 8, 9)
"""Types whose arrays may be compressed."""
_LEAST_COMPRESSED = 16
_Read: TypeAlias = "Callable[[_Values, int], int]"
"""Looks at what is at a place, and says where that ends."""


def are_sound(data: bytes, start: int) -> bool:
    """Whether all values of a crate can hold as much as they declare; its fields start at a place."""
    try:
        fields, size = struct.unpack_from("<QQ", data, start)
        (packed,) = struct.unpack_from("<Q", data, start + 16 + size)
        at = start + 24 + size
        if fields > _MAX_FIELDS:
            return False
        values = np.frombuffer(unpacked(data[at : at + packed], 8 * fields), dtype="<u8")
        _Values(data).look(values)
    except (ValueError, IndexError, struct.error):
        return False
    return True


class _Values:
    """Looks at values; raises ValueError where one cannot hold what it declares."""

    def __init__(self, data: bytes):
        self._data, self._version = data, tuple(data[8:10])
        self._room, self._left, self._depth = _ROOM + _SHARED * len(data), _MAX_VALUES, 0
        self._seen: set[int] = set()

    def look(self, values: NDArray[np.uint64]) -> None:
        """Look at values that are read one by one; those that lie in their 64 bits need none."""
        kinds = values >> np.uint64(48) & np.uint64(0xFF)
        layouts = (values & np.uint64(_INLINE) == 0) & np.isin(kinds, list(_LAYOUTS))
        arrays = values & np.uint64(_ARRAY | _EDIT) != 0
        for value in np.unique(values[layouts | arrays]).tolist():
            if value not in self._seen:
                self._seen.add(value)
                self._look(value)

    def _look(self, value: int) -> None:
        self._left, self._depth = self._left - 1, self._depth + 1
        if self._left < 0 or self._depth > _MAX_DEPTH:
            raise ValueError
        kind, at = value >> 48 & 0xFF, value & _AT
        if kind in _SIZES and value & _EDIT:
            if value & _ARRAY:
                raise ValueError
            if at:
                self._array(kind, self.number(at))
                self._array(_LONG, self.number(at + 8))
        elif kind in _SIZES and value & _ARRAY:
            self._array(kind, value)
        elif kind in _LAYOUTS and not value & _INLINE:
            _LAYOUTS[kind](self, at)
        self._depth -= 1

    def _array(self, kind: int, value: int) -> None:
        """An array of a type, whatever type its value has; one without a place is empty."""
        at, compressed = value & _AT, bool(value & _COMPRESSED)
        if not at:
            return
        at += 4 if self._version < (0, 5) else 0  # the number of dimensions
        form = "<I" if self._version < (0, 7) else "<Q"
        count, at, size = self.number(at, form), at + struct.calcsize(form), _SIZES[kind]
        since = (0, 5) if kind in _WHOLE else (0, 6)
        if not compressed or kind not in (*_WHOLE, *_FRACTIONS) or self._version < since or count < _LEAST_COMPRESSED:
            self.take(count, size, at)
            return
        if kind in _FRACTIONS:
            code, at = self._data[at], at + 1
            if code == ord("t"):  # indexes into a table
                table = self.number(at, "<I")
                self.take(table, size, at + 4)
                at += 4 + table * size
        packed = self.number(at)
        self.take(packed, 1, at + 8)
        if count > RATIO * packed:
            raise ValueError
        self.take(count, size, None)

    def number(self, at: int, form: str = "<Q") -> int:
        return int(struct.unpack_from(form, self._data, at)[0])

    def take(self, count: int, size: int, at: int | None) -> None:
        """Take room for items, which lie at a place unless they are compressed."""
        self._room -= count * size
        if self._room < 0 or (at is not None and count * size > len(self._data) - at):
            raise ValueError

    def jump(self, at: int) -> int:
        """Where the distance at a place leads to: what is there comes after what it needs."""
        ahead = self.number(at, "<q")
        if ahead < 8:
            raise ValueError
        return at + ahead

    def inner(self, at: int) -> int:
        """A value inside another, which is read with it."""
        at = self.jump(at)
        self._look(self.number(at))
        return at + 8

    def samples(self, at: int) -> int:
        """Samples over time: their times, and their values, which are read one by one."""
        at = self.jump(at)
        times = self.number(at)
        if not times & _INLINE:  # read as a list of numbers, whatever type it has
            _NUMBERS(self, times & _AT)
        at = self.jump(at + 8)
        count = self.number(at)
        self.take(count, 8, at + 8)
        self.look(np.frombuffer(self._data, "<u8", count, at + 8))
        return at + 8 + 8 * count


def _many(size: int, then: _Read | None = None) -> _Read:
    """A count, and items of so many bytes and of what comes after these in each, at least eight bytes."""

    def read(values: _Values, at: int) -> int:
        count = values.number(at)
        at += 8
        values.take(count, size + 8 * (then is not None), at)
        if then is None:
            return at + size * count
        for _ in range(count):
            at = then(values, at + size)
        return at

    return read


def _edits(items: _Read) -> _Read:
    """A byte of flags, and one list of items for each flag but the first: what is set, added, deleted and so on."""

    def read(values: _Values, at: int) -> int:
        lists = (values.number(at, "<B") >> 1 & 0x3F).bit_count()
        at += 1
        for _ in range(lists):
            at = items(values, at)
        return at

    return read


def _both(first: _Read, second: _Read) -> _Read:
    return lambda values, at: second(values, first(values, at))


_NUMBERS = _many(8)
_NAMES = _many(4)
_DICTIONARY = _many(4, _Values.inner)
_LAYOUTS: dict[int, _Read] = {
    31: _DICTIONARY,
    **dict.fromkeys((32, 33, 34, 36, 38), _edits(_NAMES)),  # tokens, texts, paths, whole numbers of 32 bits
    35: _edits(_many(24, _DICTIONARY)),  # references
    37: _edits(_NUMBERS),
    39: _edits(_NUMBERS),
    40: _NAMES,
    41: _NAMES,
    45: _many(8),  # choices of variants
    46: _Values.samples,
    48: _NUMBERS,
    49: _many(16),  # offsets of layers
    50: _NAMES,
    52: _Values.inner,
    53: _Values.inner,
    54: _edits(_many(0, _Values.inner)),
    55: _edits(_many(24)),  # payloads
    58: _many(8),  # relocates
    59: _both(_many(1), _many(8, _DICTIONARY)),  # splines: their knots, and a dictionary for some times
}
"""Types of values that hold counts."""
