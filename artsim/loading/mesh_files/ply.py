"""PLY: a header that says what follows, then rows of numbers in text or in bytes."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from artsim.loading.mesh_files.polygons import strips, triangulate
from artsim.loading.mesh_files.surface import Array, Bounds, Draft, Indices, Surface, UnusableMeshError, quote_name
from artsim.loading.mesh_files.text import numbers

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "int64": "i8", "uint64": "u8", "float": "f4", "double": "f8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_MAX_HEADER = 100_000
_MAX_LISTS = 2_000_000
"""Lists that are read one by one, in some 0.2 microseconds each."""

_ORDER = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")


@dataclass
class Property:
    """One column of an element: numbers of a type, or lists of them."""

    name: str
    type: str
    count_type: str | None = None


@dataclass
class Element:
    """One table of a PLY file."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)

    @property
    def least(self) -> int:
        """Numbers that a row has at least."""
        return len(self.properties)

    @property
    def least_bytes(self) -> int:
        """Bytes that a row has at least."""
        return sum(np.dtype(p.count_type or p.type).itemsize for p in self.properties)


@dataclass
class _Lists:
    """A column of lists: how long each is, and all their values."""

    counts: Indices
    values: Indices


def read_ply(data: bytes, bounds: Bounds) -> Surface:
    """The surface of a PLY file: its faces and triangle strips.

    Raises
    ------
    UnusableMeshError
    AssetError
    """
    order, elements, start = read_header(data)
    body = _Text(data[start:]) if order == "" else _Bytes(data, start, order)
    draft = Draft(declared=sum(e.count for e in elements if e.name == "face"))
    for element in elements:
        if element.count and (element.least == 0 or element.count > body.room(element)):
            raise UnusableMeshError(
                f"declares {element.count} rows of {quote_name(element.name)}, more than its bytes can hold"
            )
        if element.name in ("vertex", "face", "tristrips"):
            bounds.check(element.count, "vertices" if element.name == "vertex" else "triangles")
    tables: dict[str, dict[str, Any]] = {}
    for element in elements:
        # Every table is read, because what is not wanted of it must be skipped.
        tables[element.name] = body.table(element)
    points = _points(tables.get("vertex", {}))
    if "face" in tables:
        _add_faces(tables["face"], points, bounds, draft)
    if "tristrips" in tables:
        _add_strips(tables["tristrips"], points, bounds, draft)
    if body.left:
        draft.note(f"has {body.left} {body.unit} more than its header declares")
    return draft.surface()


def read_header(data: bytes) -> tuple[str, list[Element], int]:
    """Byte order ("" for text), elements, and where their values begin.

    Raises
    ------
    UnusableMeshError
    """
    found = re.search(rb"(?:^|[\r\n])end_header[ \t]*(\r\n|\r|\n)", data[:_MAX_HEADER])
    if not data.startswith(b"ply") or found is None:
        raise UnusableMeshError("has no PLY header")
    order: str | None = None
    elements: list[Element] = []
    for row in re.split(rb"[\r\n]+", data[: found.start()])[1:]:
        words = row.decode("ascii", "replace").split()
        match words:
            case ["format", kind, *_] if kind in _ORDER:
                order = _ORDER[kind]
            case ["element", name, count] if count.isdecimal() and len(count) < 19:
                elements.append(Element(name, int(count)))
            case ["property", "list", count_type, kind, name] if (
                elements and kind in _TYPES and _TYPES.get(count_type, "f")[0] != "f"
            ):
                elements[-1].properties.append(Property(name, _TYPES[kind], _TYPES[count_type]))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(Property(name, _TYPES[kind]))
            case [] | ["comment" | "obj_info", *_]:
                pass
            case _:
                raise UnusableMeshError(f"its header says {quote_name(' '.join(words))}, which is not understood")
    if order is None:
        raise UnusableMeshError("its header names no format that is read")
    names = [element.name for element in elements]
    if len(set(names)) < len(names):
        raise UnusableMeshError("its header declares an element twice")
    return order, elements, found.end()


class _Text:
    """The numbers after the header of a text file."""

    unit = "numbers"

    def __init__(self, text: bytes):
        # Rows, not numbers, are what PLY declares; but no file is known whose rows span lines.
        self._values = numbers(text, np.float64, np.nan)
        self._at = 0

    @property
    def left(self) -> int:
        return len(self._values) - self._at

    def room(self, element: Element) -> int:
        return self.left // max(element.least, 1)

    def table(self, element: Element) -> dict[str, Any]:
        lists = [p.count_type is not None for p in element.properties]
        if not any(lists):
            block = self._take(element.count * element.least).reshape(element.count, element.least)
            return {p.name: block[:, i] for i, p in enumerate(element.properties)}
        return self._rows(element, lists)

    def _take(self, count: int) -> Array:
        if count > self.left:
            raise UnusableMeshError("ends before what its header declares")
        self._at += count
        return self._values[self._at - count : self._at]

    def _rows(self, element: Element, lists: list[bool]) -> dict[str, Any]:
        if element.count == 0:
            return {}
        uniform = self._uniform(element, lists)
        if uniform is not None:
            return uniform
        widths = [(1 if is_list else 0, 1) for is_list in lists]
        read: Callable[[int], float] = self._values.data.__getitem__
        starts, counts, self._at = _walk(read, self._at, widths, element.count, len(self._values))
        columns = {}
        for i, (p, is_list) in enumerate(zip(element.properties, lists, strict=True)):
            first, length = starts[:, i], counts[:, i]
            if is_list and (self._values[first - 1] != length).any():
                raise UnusableMeshError(f"{quote_name(element.name)} has lists whose lengths are no whole numbers")
            columns[p.name] = (
                _Lists(length, _whole(self._values[_places(first, length)])) if is_list else self._values[first]
            )
        return columns

    def _uniform(self, element: Element, lists: list[bool]) -> dict[str, Any] | None:
        """The table, if all of its rows are as long as the first."""
        columns: list[tuple[int, int]] = []
        at = 0
        for is_list in lists:
            number = self._values[self._at + at] if is_list and self.left > at else 1.0
            if not 0 <= number <= self.left or number != int(number):
                return None
            at += is_list
            columns.append((at, int(number)))
            at += int(number)
        if at * element.count > self.left:
            return None
        block = self._values[self._at : self._at + at * element.count].reshape(element.count, at)
        if any((block[:, c - 1] != n).any() for (c, n), is_list in zip(columns, lists, strict=True) if is_list):
            return None
        self._at += at * element.count
        return {
            p.name: _Lists(np.full(element.count, n), _whole(block[:, c : c + n].ravel())) if is_list else block[:, c]
            for p, (c, n), is_list in zip(element.properties, columns, lists, strict=True)
        }


class _Bytes:
    """The bytes after the header."""

    unit = "bytes"

    def __init__(self, data: bytes, start: int, order: str):
        self._data, self._at, self._order = data, start, order

    @property
    def left(self) -> int:
        return len(self._data) - self._at

    def room(self, element: Element) -> int:
        return self.left // max(element.least_bytes, 1)

    def table(self, element: Element) -> dict[str, Any]:
        if element.count == 0:
            return {}
        lengths = [self._length(element, i) if p.count_type else None for i, p in enumerate(element.properties)]
        row = self._row_type(element, lengths)
        if row is not None and row.itemsize * element.count <= self.left:
            block = np.frombuffer(self._data, row, element.count, self._at)
            same = all((block[f"n{i}"] == n).all() for i, n in enumerate(lengths) if n is not None)
            if same:
                self._at += row.itemsize * element.count
                return {
                    p.name: block[f"v{i}"]
                    if n is None
                    else _Lists(np.full(element.count, n), _whole(block[f"v{i}"].ravel()))
                    for i, (p, n) in enumerate(zip(element.properties, lengths, strict=True))
                }
        if all(n is None for n in lengths):
            raise UnusableMeshError("ends before what its header declares")
        return self._rows(element)

    def _length(self, element: Element, i: int) -> int:
        """Length of the i-th column's list in the first row, if the lists before it are as long as they are there."""
        at = self._at
        for p in element.properties[: i + 1]:
            size = np.dtype(p.type).itemsize
            if p.count_type is None:
                at, n = at + size, 0
                continue
            n, at = self._integer(at, p.count_type)
            at += n * size
        return n

    def _integer(self, at: int, kind: str) -> tuple[int, int]:
        size = np.dtype(kind).itemsize
        if at + size > len(self._data):
            raise UnusableMeshError("ends before what its header declares")
        order = "big" if self._order == ">" else "little"
        value = int.from_bytes(self._data[at : at + size], order, signed=kind[0] == "i")  # type: ignore[arg-type]
        if not 0 <= value <= len(self._data) - at - size:
            raise UnusableMeshError(f"has a list of {value} values, which its bytes cannot hold")
        return value, at + size

    def _row_type(self, element: Element, lengths: list[int | None]) -> np.dtype[Any] | None:
        columns: list[tuple[Any, ...]] = []
        for i, (p, n) in enumerate(zip(element.properties, lengths, strict=True)):
            if n is None:
                columns.append((f"v{i}", self._order + p.type))
            else:
                columns += [(f"n{i}", self._order + str(p.count_type)), (f"v{i}", self._order + p.type, (n,))]
        return np.dtype(columns) if sum(n or 0 for n in lengths) * 8 < 2**31 else None

    def _rows(self, element: Element) -> dict[str, Any]:
        """The lists of a table whose rows differ in length."""
        widths = [
            (np.dtype(p.count_type).itemsize if p.count_type else 0, np.dtype(p.type).itemsize)
            for p in element.properties
        ]
        kinds = {p.count_type for p in element.properties if p.count_type}
        if len(kinds) > 1:
            raise UnusableMeshError(f"{quote_name(element.name)} counts its lists in several types, which is not read")
        kind = np.dtype(kinds.pop())
        end = len(self._data)
        starts, counts, self._at = _walk(self._reader(kind), self._at, widths, element.count, end)
        letters = np.frombuffer(self._data, np.uint8)
        columns = {}
        for i, p in enumerate(element.properties):
            if p.count_type:
                size = widths[i][1]
                raw = letters[_places(starts[:, i], counts[:, i], size)[:, None] + np.arange(size)]
                items = np.ascontiguousarray(raw).view(self._order + p.type).ravel()
                columns[p.name] = _Lists(counts[:, i], _whole(items))
        return columns

    def _reader(self, kind: np.dtype[Any]) -> Callable[[int], int]:
        """Gives the whole number at a place."""
        data, size, signed = self._data, kind.itemsize, kind.kind == "i"
        if size == 1 and not signed:
            return data.__getitem__
        order: Literal["big", "little"] = "big" if self._order == ">" else "little"
        return lambda at: int.from_bytes(data[at : at + size], order, signed=signed)


def _walk(
    read: Callable[[int], float], start: int, widths: list[tuple[int, int]], rows: int, end: int
) -> tuple[Indices, Indices, int]:
    """Where the columns of rows are that differ in length.

    Parameters
    ----------
    read : callable
        Gives the number at a place.
    start, end : int
        Places where the table starts and what holds it ends.
    widths : list of (int, int)
        Of each column: the width of its list's length, 0 where it is no list, and the width of a value.
    rows : int

    Returns
    -------
    starts, counts : (rows, columns) int
        Where the values of each column start, and how many there are.
    int
        Place after the table.
    """
    lists = sum(1 for head, _ in widths if head)
    if rows * lists > _MAX_LISTS:
        raise UnusableMeshError(f"has over {_MAX_LISTS} lists of different lengths")
    # Widths up to each list, and after the last one: rows are walked in a loop, which is to do little.
    steps: list[tuple[int, int, int]] = []
    skip = 0
    for head, size in widths:
        if head:
            steps.append((skip, head, size))
            skip = 0
        else:
            skip += size
    found: list[int] = []
    at = start
    for _ in range(rows):
        for before, head, size in steps:
            at += before
            count = read(at) if at + head <= end else -1
            if not 0 <= count <= end - at:
                raise UnusableMeshError("has a list that ends after the file")
            count = int(count)
            found.append(count)
            at += head + count * size
        at += skip
    if at > end:
        raise UnusableMeshError("ends before what its header declares")
    counts = np.ones((rows, len(widths)), np.int64)
    counts[:, [bool(head) for head, _ in widths]] = np.array(found, np.int64).reshape(rows, lists)
    heads, sizes = np.array(widths).T
    ends = start + np.cumsum(counts * sizes + heads).reshape(rows, -1)
    return ends - counts * sizes, counts, at


def _places(starts: Indices, counts: Indices, size: int = 1) -> Indices:
    """Places of the items of lists that start at given places, each item ``size`` wide."""
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(starts, counts) + size * within


def _whole(values: NDArray[Any]) -> Indices:
    """Whole numbers of vertices; -2 where a value is none (-1 ends a strip)."""
    if values.dtype.kind in "iu" and values.dtype.itemsize < 8:
        return values.astype(np.int64)
    with np.errstate(invalid="ignore"):
        fit = (values >= -1) & (values < 2**53)
        return np.where(fit & (values == np.floor(values)), np.where(fit, values, 0).astype(np.int64), -2)


def _points(table: dict[str, Any]) -> Array:
    if any(not isinstance(table.get(axis), np.ndarray) for axis in "xyz"):
        raise UnusableMeshError("has no vertices with x, y and z")
    return np.stack([np.asarray(table[axis], np.float64) for axis in "xyz"], axis=1)


def _corners(table: dict[str, Any]) -> _Lists:
    found = next((table[name] for name in _CORNERS if isinstance(table.get(name), _Lists)), None)
    if found is None:
        if not table:
            return _Lists(np.zeros(0, np.int64), np.zeros(0, np.int64))
        raise UnusableMeshError(f"its faces have no list named {' or '.join(_CORNERS)}")
    return found


def _add_faces(table: dict[str, Any], points: Array, bounds: Bounds, draft: Draft) -> None:
    lists = _corners(table)
    bounds.check(len(lists.values) - 2 * len(lists.counts), "triangles")
    made = triangulate(points, lists.values, lists.counts)
    draft.accounted += len(lists.counts)
    made.tell(draft)
    draft.add(points, lists.values[made.corners])


def _add_strips(table: dict[str, Any], points: Array, bounds: Bounds, draft: Draft) -> None:
    """Strips of triangles, each ended by -1 or by its list's end."""
    lists = _corners(table)
    bounds.check(len(lists.values), "triangles")
    runs = np.insert(lists.values, np.cumsum(lists.counts), -1)
    draft.add(points, strips(runs))
